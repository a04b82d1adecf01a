//! What a cycle costs beside judging: mailboxes, snapshots, hand-over to the pool, reports, publication.
//!
//! Drives the actor system with anchors of 64 candidates x 80 points and prints, for each number of threads, the median
//! time of judging and of everything else between the arrival of the anchor and the last output handed over. The sink
//! takes outputs and drops them, so the cost of a file or a network is not in the figure.
//!
//! Run: `cargo bench --bench cycle`
#![allow(
    missing_docs,
    clippy::unwrap_used,
    reason = "a benchmark is a program of its own and fails by panicking"
)]

#[path = "../actors/tests/support/inputs.rs"]
mod inputs;

use crossbeam_channel::{Sender, unbounded};
use inputs::{candidate_set, one_lanelet};
use messages::Interface;
use messages::autoware_internal_planning_msgs::CandidateTrajectories;
use messages::autoware_planning_msgs::TrajectoryPoint;
use messages::builtin_interfaces::{Duration as Span, Time};
use messages::geometry_msgs::{Point, Pose, Quaternion};
use motion::VehicleInfo;
use selection::parameters::{RankerParameters, ValidatorParameters};
use selection::ranker::GeneratorSource;
use selection::{Pipeline, Ranker, Validator};
use selector_actors::cycle::{CycleReport, CycleTimes, Outcome};
use selector_actors::publisher::PublishedTimes;
use selector_actors::{Clock, Config, Input, Publication, SelectorSystem, Sink, SinkError};
use std::sync::Arc;
use std::time::Duration;

const CANDIDATES: u8 = 64;
const GENERATORS: u8 = 8;
const POINTS: u32 = 80;
const CYCLES: usize = 2000;

/// Drops outputs, keeps times.
struct Stopwatch(Sender<Sample>);

/// One cycle.
struct Sample {
    snapshot: Duration,
    judge: Duration,
    publish: Duration,
    cycle: Duration,
}

impl Sample {
    /// Everything that is not judging.
    fn own(&self) -> Duration {
        self.cycle.saturating_sub(self.judge)
    }

    /// Taking the anchor in, mailboxes, hand-over to the pool and back, putting the report together.
    fn rest(&self) -> Duration {
        self.own().saturating_sub(self.snapshot + self.publish)
    }
}

impl Sink for Stopwatch {
    fn publish(&mut self, _: Publication) -> Result<(), SinkError> {
        Ok(())
    }

    fn observe(&mut self, report: &CycleReport, times: CycleTimes) {
        if let Outcome::Judged(judged) = &report.outcome {
            let sample = Sample {
                snapshot: report.cycle.snapshot,
                judge: judged.observe + judged.judge,
                publish: times.publish,
                cycle: times.cycle,
            };
            self.0.send(sample).unwrap();
        }
    }
}

fn main() {
    println!(
        "one cycle, {CANDIDATES} candidates x {POINTS} points, data validity and vehicle constraint, {CYCLES} cycles"
    );
    println!("medians in µs; own cost = snapshot + publish + rest");
    println!(
        "{:>8} {:>8} {:>9} {:>9} {:>9} {:>8} {:>8} {:>12}",
        "threads", "cycle", "judging", "own cost", "snapshot", "publish", "rest", "own/judging"
    );
    for threads in [1, 2] {
        let samples = measure(threads);
        let judge = median_us(&samples, |sample| sample.judge);
        let own = median_us(&samples, Sample::own);
        println!(
            "{threads:>8} {:>8.1} {judge:>9.1} {own:>9.1} {:>9.1} {:>8.1} {:>8.1} {:>12.2}",
            median_us(&samples, |sample| sample.cycle),
            median_us(&samples, |sample| sample.snapshot),
            median_us(&samples, |sample| sample.publish),
            median_us(&samples, Sample::rest),
            own / judge,
        );
    }
}

fn median_us(samples: &[Sample], of: impl Fn(&Sample) -> Duration) -> f64 {
    let mut times: Vec<Duration> = samples.iter().map(of).collect();
    times.sort_unstable();
    times[times.len() / 2].as_secs_f64() * 1e6
}

fn measure(threads: usize) -> Vec<Sample> {
    let (sender, samples) = unbounded();
    let parameters = ValidatorParameters {
        filter_names: vec!["safety::VehicleConstraintFilter".to_owned()],
        shadow_mode_filter_names: Vec::new(),
        ..ValidatorParameters::default()
    };
    let vehicle = VehicleInfo::default();
    let config = Config {
        clock: Clock::stepped(Time { sec: 10, nanosec: 0 }),
        threads,
        fallback_period_ms: 150,
        duration_time_s: 0.2,
        cycle_budget: None,
        vehicle,
        pipeline: Pipeline::new(
            Validator::new(parameters, &vehicle).unwrap(),
            Ranker::new(RankerParameters::default(), GeneratorSource::table(&["=diffusion_planner"])),
        ),
        interface: Interface::V0_53,
        published_times: PublishedTimes::Measured,
        count_allocations: None,
    };
    let system = SelectorSystem::start(config, Box::new(Stopwatch(sender))).unwrap();
    for input in [
        Input::ReadyMap(Arc::new(one_lanelet()), "map".into()),
        Input::Odometry(Default::default()),
        Input::Objects(Default::default()),
        Input::Acceleration(Default::default()),
    ] {
        system.deliver(input).unwrap();
    }
    let anchor = anchor();
    for _ in 0..CYCLES {
        system.deliver(Input::Generative(anchor.clone())).unwrap();
    }
    system.stop().unwrap();
    let samples: Vec<Sample> = samples.try_iter().collect();
    assert_eq!(samples.len(), CYCLES);
    samples
}

/// Gentle curves at 8 m/s, each a little different.
fn anchor() -> Arc<CandidateTrajectories> {
    let point = |candidate: u8, index: u32| {
        let (time_s, curvature) = (f64::from(index) * 0.1, (f64::from(candidate) - 32.0) * 1e-3);
        let (along, heading) = (8.0 * time_s, 8.0 * time_s * curvature);
        TrajectoryPoint {
            time_from_start: Span::from_nanoseconds(i64::from(index) * 100_000_000),
            pose: Pose {
                position: Point {
                    x: along * (heading * 0.5).cos(),
                    y: along * (heading * 0.5).sin(),
                    z: 0.0,
                },
                orientation: Quaternion::from_yaw(heading),
            },
            longitudinal_velocity_mps: 8.0,
            ..TrajectoryPoint::default()
        }
    };
    let generators = (0..GENERATORS).map(|number| (number, format!("DiffusionPlanner_{number}")));
    let candidates = (0..CANDIDATES)
        .map(|number| (number % GENERATORS, (0..POINTS).map(|index| point(number, index)).collect()));
    candidate_set(Time { sec: 10, nanosec: 0 }, generators, candidates)
}
