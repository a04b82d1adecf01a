//! Prints the generated drive as text: what the ego does, and what is sent how often.
//!
//! `cargo run --example scenario_dump [SEED]`

use messages::geometry_msgs::Point;
use selector_actors::{Input, InputTopic};
use std::collections::BTreeMap;
use trajectory_selector::scenario::Scenario;

fn main() {
    let seed = std::env::args().nth(1).and_then(|text| text.parse().ok()).unwrap_or(1);
    let scenario = Scenario::road(seed);
    println!(
        "{}, seed {seed}, {} s",
        scenario.name(),
        (scenario.span().1.nanoseconds() - scenario.span().0.nanoseconds()) as f64 * 1e-9
    );
    println!("      time         x         y  speed  how far the candidates lead, m");
    let mut counts: BTreeMap<InputTopic, usize> = BTreeMap::new();
    let (mut ego, mut speed_mps) = (Point::default(), 0.0);
    for timed in scenario.drive() {
        let count = counts.entry(timed.topic).or_default();
        *count += 1;
        match &timed.input {
            Input::Odometry(odometry) => {
                (ego, speed_mps) = (odometry.pose.pose.position, odometry.twist.twist.linear.x);
            }
            Input::Generative(message) if *count % 5 == 1 => {
                let (sec, millisecond) = (timed.time.sec % 100, timed.time.nanosec / 1_000_000);
                print!("{sec:6}.{millisecond:03} {:9.3} {:9.3} {speed_mps:6.2} ", ego.x, ego.y);
                for candidate in &message.candidate_trajectories {
                    let end = candidate.points.last().map_or(ego, |point| point.pose.position);
                    print!(" {:5.1}", (end.x - ego.x).hypot(end.y - ego.y));
                }
                println!();
            }
            _ => {}
        }
    }
    for (topic, count) in counts {
        println!("{count:5} {}", topic.full_name());
    }
}
