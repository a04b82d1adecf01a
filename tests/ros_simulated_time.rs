//! On simulated time the node lives by `/clock`: at any speed, standing still, and going back.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

#[path = "interop_support/lab.rs"]
mod lab;

use lab::{Lab, Node, PATIENCE, Peer, isolated};
use messages::builtin_interfaces::Time;
use messages::diagnostic_msgs::DiagnosticArray;
use messages::rosgraph_msgs::Clock;
use messages::{Interface, Message};
use serde_json::json;
use std::time::{Duration, Instant};

const MS: i64 = 1_000_000;
/// When nothing came for so long, nothing more comes.
const QUIET: Duration = Duration::from_millis(500);

/// A node on simulated time, whoever sets its clock, and whoever sees its cycles.
struct Simulation {
    node: Node,
    peer: Peer,
    clock: u64,
    diagnostics: u64,
}

impl Simulation {
    fn start(lab: &Lab) -> Self {
        let node = lab.node(&["-p", "use_sim_time:=true", "-p", "fallback_period_ms:=100"]);
        let mut peer = lab.peer();
        let clock = peer.open("write", "/clock", "rosgraph_msgs/msg/Clock", &json!({"reliable": false}));
        let many = json!({"depth": 1000});
        let diagnostics = peer.open("read", "/diagnostics", "diagnostic_msgs/msg/DiagnosticArray", &many);
        peer.wait_for_peers(clock, 1);
        peer.wait_for_peers(diagnostics, 1);
        Self { node, peer, clock, diagnostics }
    }

    fn set(&mut self, time_ns: i64) {
        let clock = Clock { clock: Time::from_nanoseconds(time_ns) };
        self.peer.send(self.clock, &clock.to_cdr(Interface::default()));
    }

    /// Times of the cycles since the last call.
    fn cycles(&mut self, wait: Duration) -> Vec<i64> {
        let diagnostics = self.peer.take(self.diagnostics, 1000, wait);
        diagnostics.iter().map(|cdr| stamp(cdr)).collect()
    }

    /// Lets time jump to `from_ns`, and by a second more until a cycle is seen: before both sides know of each other,
    /// messages may go nowhere. Each jump must have fired once at the most. Gives the time at last.
    fn jump(&mut self, from_ns: i64) -> i64 {
        let until = Instant::now() + PATIENCE;
        for now_ns in (0..).map(|jump| from_ns + jump * 1000 * MS) {
            assert!(Instant::now() < until, "no jump was seen");
            self.set(now_ns);
            let cycles = self.cycles(QUIET);
            assert!(cycles.windows(2).all(|pair| pair[1] - pair[0] >= 1000 * MS), "{cycles:?}");
            if cycles.last() == Some(&now_ns) {
                return now_ns;
            }
        }
        unreachable!("there is always a later time")
    }

    /// Lets simulated time pass in steps, at no more than so many times the speed of real time; gives the times of the
    /// cycles. Time that a busy machine lost is not made up for by faster steps.
    fn run(&mut self, from_ns: i64, for_ms: i64, step_ms: i64, speed: f64) -> Vec<i64> {
        let step = Duration::from_secs_f64(step_ms as f64 * 1e-3 / speed);
        for passed_ms in (0..=for_ms / step_ms).map(|index| index * step_ms) {
            let due = Instant::now() + step;
            self.set(from_ns + passed_ms * MS);
            std::thread::sleep(due.saturating_duration_since(Instant::now()));
        }
        self.cycles(QUIET)
    }
}

fn stamp(cdr: &[u8]) -> i64 {
    let message = DiagnosticArray::from_cdr(cdr, Interface::default(), "").unwrap();
    message.header.stamp.nanoseconds()
}

/// The timer fires each 100 ms of simulated time. The clock's steps are best effort, and a node that the machine holds up
/// sees several as one: so some cycles may be missing, but not nearly all, as if real time counted, and none may be too many.
fn assert_regular(cycles: &[i64], from_ns: i64, for_ms: i64) {
    let expected = usize::try_from(for_ms / 100).unwrap();
    assert!(cycles.len() >= expected / 4 && cycles.len() <= expected + 1, "{} cycles", cycles.len());
    assert!(cycles.is_sorted(), "{cycles:?}");
    assert!(cycles.iter().all(|&cycle| (from_ns..=from_ns + for_ms * MS).contains(&cycle)), "{cycles:?}");
}

#[test]
fn the_timer_keeps_simulated_time_at_any_speed() {
    isolated("the_timer_keeps_simulated_time_at_any_speed", |lab| {
        let mut simulation = Simulation::start(lab);
        let start = simulation.jump(1_750_000_000_000 * MS);
        assert_regular(&simulation.run(start, 3000, 10, 1.0), start, 3000);
        assert_regular(&simulation.run(start + 3000 * MS, 30_000, 10, 10.0), start + 3000 * MS, 30_000);
        simulation.node.stop("INT");
    });
}

#[test]
fn time_that_stands_still_or_goes_back_stops_nothing() {
    isolated("time_that_stands_still_or_goes_back_stops_nothing", |lab| {
        let mut simulation = Simulation::start(lab);
        assert!(simulation.cycles(QUIET).is_empty(), "no time passes without a clock");
        let start = simulation.jump(1_750_000_000_000 * MS);
        for _ in 0..30 {
            simulation.set(start);
        }
        assert!(simulation.cycles(QUIET).is_empty(), "paused");
        // Back by an hour: the timer starts anew there instead of waiting for an hour.
        let back = start - 3_600_000 * MS;
        let cycles = simulation.run(back, 1000, 20, 1.0);
        assert!(cycles.len() >= 3, "{cycles:?}");
        assert!(cycles.iter().all(|&cycle| cycle < back + 1001 * MS), "{cycles:?}");
        let stopped = simulation.node.stop("TERM");
        assert!(stopped.took < PATIENCE && stopped.status.code() == Some(0));
    });
}
