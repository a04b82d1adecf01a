//! Time leaps, sensors freeze, maps and parameters change in the middle of a cycle: a cycle is judged by one time, one
//! map and one set of parameters; what is odd is reported; the next cycle is normal.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

#[path = "support/faulty.rs"]
mod faulty;
#[path = "support/inputs.rs"]
mod inputs;

use crossbeam_channel::{Receiver, Sender, bounded, unbounded};
use faulty::{DIFFUSION, PATIENCE, START, Scripted, Setup, THREADS, after, anchor, number_of, validator};
use inputs::{candidate_set, one_lanelet};
use lanelet_map::MapBuilder;
use messages::autoware_map_msgs::LaneletMapBin;
use messages::diagnostic_msgs::DiagnosticStatus;
use messages::nav_msgs::Odometry;
use messages::std_msgs::Header;
use selection::parameters::{RankerParameters, ValidatorParameters};
use selection::ranker::GeneratorSource;
use selection::{Candidate, Judgement, Scene};
use selector_actors::{Input, Parameters, Trigger};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

const MANY: u32 = 32;
const HOUR_MS: i64 = 3_600_000;

#[test]
fn a_clock_that_jumps_forward_makes_the_old_candidates_stale() {
    for threads in THREADS {
        let node = Setup::new(threads).start();
        node.assert_normal("before");
        node.system.jump_to(after(START, HOUR_MS)).unwrap();
        let seen = node.seen();
        assert_eq!(seen.len(), 1, "the timer fires once, however many of its deadlines were leapt over");
        assert_eq!(seen[0].report.cycle.trigger, Trigger::Timer);
        assert_eq!((seen[0].validated(), seen[0].driven()), (None, None), "nothing an hour old leaves");
        assert_eq!(seen[0].told(), [(DiagnosticStatus::STALE, "No concatenated trajectories received yet")]);
        assert_eq!(seen[0].value("candidates.stale"), Some("12"));
        node.assert_normal("the next cycle");
        let deadline = node.system.settle().unwrap().deadline;
        assert_eq!(deadline, after(START, HOUR_MS + 150), "and the timer counts from it");
    }
}

#[test]
fn a_clock_that_jumps_back_starts_the_timer_anew_and_what_it_left_behind_is_judged_again() {
    for threads in THREADS {
        let node = Setup::new(threads).start();
        node.assert_normal("before");
        let back = after(START, -5000);
        node.system.jump_to(back).unwrap();
        assert!(node.seen().is_empty(), "a leap back is no reason for a cycle");
        assert_eq!(node.system.settle().unwrap().deadline, after(back, 150));
        node.system.advance_to(after(back, 150)).unwrap();
        // Upstream never drops candidates from the future; they are judged in each cycle like all others.
        let seen = node.seen();
        assert_eq!(seen.len(), 1);
        seen[0].assert_normal(12, "candidates of the time that was taken back");
        let seen = node.cycle(&anchor(node.clock.now(), 3));
        seen.assert_normal(3, "the next cycle; their generator's newer ones have replaced them");
    }
}

#[test]
fn a_sensor_that_freezes_is_told_by_its_age() {
    for threads in THREADS {
        let node = Setup::new(threads).start();
        let header = Header { stamp: START, ..Header::default() };
        node.system.deliver(Input::Odometry(Arc::new(Odometry { header, ..Odometry::default() }))).unwrap();
        for tenth in 1..=600 {
            let now = after(START, 100 * tenth);
            node.system.advance_to(now).unwrap();
            let seen = node.cycle(&anchor(now, 3));
            let age = format!("{}.{}00", tenth / 10, tenth % 10);
            assert_eq!(seen.value("input.odometry.age_s"), Some(&age[..]));
            seen.assert_normal(
                3,
                "inputs never expire, as upstream; whoever watches the age may stop the vehicle",
            );
        }
        let header = Header { stamp: node.clock.now(), ..Header::default() };
        node.system.deliver(Input::Odometry(Arc::new(Odometry { header, ..Odometry::default() }))).unwrap();
        let seen = node.cycle(&anchor(node.clock.now(), 3));
        assert_eq!(seen.value("input.odometry.age_s"), Some("0.000"));
    }
}

/// Holds up a cycle before its first candidate.
struct Gate {
    entered: Receiver<()>,
    open: Sender<()>,
}

impl Gate {
    /// The gate, and what a filter does at it.
    fn new() -> (Self, impl Fn(&Scene) + Send + Sync + 'static) {
        let (enter, entered) = unbounded();
        let (open, opens) = bounded(1);
        let wait = move |_: &Scene| {
            enter.send(()).unwrap();
            opens.recv_timeout(PATIENCE).unwrap();
        };
        (Self { entered, open }, wait)
    }

    fn wait_for_cycle(&self) {
        self.entered.recv_timeout(PATIENCE).unwrap();
    }

    fn open(&self) {
        self.open.send(()).unwrap();
    }
}

#[test]
fn a_bad_map_in_the_middle_of_a_cycle_costs_nothing_and_an_empty_one_stops_publishing() {
    let archive = lanelet_map::archive::encode(&one_lanelet());
    let bin = |data: Vec<u8>| Input::Map(Arc::new(LaneletMapBin { data, ..LaneletMapBin::default() }));
    let empty = || Input::ReadyMap(Arc::new(MapBuilder::new().build().unwrap()), "map".into());
    /// What comes, and what the cycle after it says; `None` where it is normal.
    type Case = (Input, Option<&'static str>);
    for threads in THREADS {
        let (gate, wait) = Gate::new();
        let filter = Scripted { observe: Arc::new(wait), ..Scripted::default() };
        let node = Setup { validator: validator(filter), ..Setup::new(threads) }.start();
        let cases: [Case; 4] = [
            (bin(vec![0xA5; 4096]), None),
            (bin(archive[..archive.len() / 2].to_vec()), None),
            (empty(), Some("Lanelet map does not contain any lanelets")),
            (bin(archive.clone()), None),
        ];
        let mut number = 1;
        for (case, (map, after)) in cases.into_iter().enumerate() {
            let was_missing = case == 3;
            node.bring(&anchor(START, MANY));
            if !was_missing {
                gate.wait_for_cycle();
            }
            // Returns when the map is in, or refused.
            node.system.deliver(map).unwrap();
            if !was_missing {
                gate.open();
            }
            let running = node.next();
            assert_eq!(
                running.report.cycle.scene.map.as_ref().unwrap().number,
                number,
                "one map for a cycle"
            );
            if !was_missing {
                running.assert_normal(MANY as usize, "the running cycle");
            }
            number += u64::from(case >= 2);
            node.bring(&anchor(START, MANY));
            if after.is_none() {
                gate.wait_for_cycle();
                gate.open();
            }
            let next = node.next();
            assert_eq!(next.report.cycle.scene.map.as_ref().unwrap().number, number);
            match after {
                None => next.assert_normal(MANY as usize, "the next cycle"),
                Some(why) => {
                    assert_eq!((next.validated(), next.driven()), (None, None));
                    assert_eq!(next.told(), [(DiagnosticStatus::WARN, why)]);
                }
            }
            let refused = (case + 1).min(2).to_string();
            assert_eq!(next.value("input.lanelet2_map.malformed"), Some(&refused[..]));
        }
    }
}

#[test]
fn parameters_that_change_in_the_middle_of_a_cycle_hold_from_the_next_one_on() {
    for threads in THREADS {
        let (gate, wait) = Gate::new();
        let limit = Arc::new(AtomicU64::new(20));
        let (configured, judging) = (limit.clone(), limit);
        let configure = move |parameters: &ValidatorParameters| {
            configured.store(parameters.vehicle_constraint.max_speed as u64, Ordering::Relaxed);
        };
        let judge = move |candidate: &Candidate| {
            let is_slow = u64::from(number_of(&candidate.message.points)) < judging.load(Ordering::Relaxed);
            Judgement { feasible: is_slow, ..Judgement::default() }
        };
        let filter = Scripted {
            observe: Arc::new(wait),
            judge: Arc::new(judge),
            configure: Arc::new(configure),
            ..Scripted::default()
        };
        let node = Setup { validator: validator(filter), ..Setup::new(threads) }.start();
        node.bring(&anchor(START, MANY));
        gate.wait_for_cycle();
        let mut parameters = Parameters {
            fallback_period_ms: 400,
            duration_time_s: 0.2,
            cycle_budget: None,
            validator: faulty::parameters(),
            ranker: RankerParameters::default(),
            sources: GeneratorSource::table(&["MinimumRuleBasedPlanner_Stop"]),
        };
        parameters.validator.vehicle_constraint.max_speed = 5.0;
        node.system.configure(parameters);
        gate.open();
        let running = node.next();
        assert_eq!(running.validated(), Some((0..20).collect()), "by the old limit, all of them");
        assert_eq!(running.driven(), Some(0), "by the old table of generators");
        node.bring(&candidate_set(
            START,
            [(1, DIFFUSION.to_owned()), (2, "MinimumRuleBasedPlanner_Stop".to_owned())],
            anchor(START, MANY)
                .candidate_trajectories
                .iter()
                .map(|candidate| (1 + u8::from(number_of(&candidate.points) == 3), candidate.points.clone())),
        ));
        gate.wait_for_cycle();
        gate.open();
        let next = node.next();
        let mut validated = next.validated().unwrap();
        validated.sort_unstable();
        assert_eq!(validated, [0, 1, 2, 3, 4], "by the new limit, all of them");
        assert_eq!(next.driven(), Some(3), "by the new table of generators");
        assert_eq!(node.system.settle().unwrap().deadline, after(START, 400), "and the new period");
    }
}
