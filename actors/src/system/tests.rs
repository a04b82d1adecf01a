//! The death of an owner, wherever it comes from, ends the node with a clear error; nobody waits for ever, and nothing
//! more leaves.

use super::*;
use crate::publisher::Publication;
use actix::{Context, Handler, Message};
use messages::autoware_internal_planning_msgs::{CandidateTrajectories, CandidateTrajectory, GeneratorInfo};
use messages::autoware_planning_msgs::TrajectoryPoint;
use selection::{Ranker, Validator};
use std::panic::resume_unwind;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Makes an actor panic.
struct Break;

impl Message for Break {
    type Result = ();
}

fn break_down() {
    // Without the report on stderr, which would look as if the test had failed.
    resume_unwind(Box::new("on purpose"));
}

macro_rules! breakable {
    ($($actor:ty),*) => {$(
        impl Handler<Break> for $actor {
            type Result = ();

            fn handle(&mut self, _: Break, _: &mut Context<Self>) {
                break_down();
            }
        }
    )*};
}

breakable!(Buffer, Sensors, Scheduler, Validation);

/// Makes a thread of the pool panic, in a job that no guard is around.
struct BreakPool;

impl Message for BreakPool {
    type Result = ();
}

impl Handler<BreakPool> for Validation {
    type Result = ();

    fn handle(&mut self, _: BreakPool, _: &mut Context<Self>) {
        self.pool.spawn(break_down);
    }
}

/// Counts what is published.
struct Counter(Arc<AtomicUsize>);

impl Sink for Counter {
    fn publish(&mut self, _: Publication) -> Result<(), SinkError> {
        self.0.fetch_add(1, Ordering::Relaxed);
        Ok(())
    }
}

fn start(threads: usize, clock: Clock) -> (SelectorSystem, Arc<AtomicUsize>) {
    let published = Arc::new(AtomicUsize::new(0));
    let parameters = ValidatorParameters {
        filter_names: Vec::new(),
        shadow_mode_filter_names: Vec::new(),
        ..ValidatorParameters::default()
    };
    let vehicle = VehicleInfo::default();
    let validator = Validator::new(parameters, &vehicle).unwrap();
    let ranker = Ranker::new(RankerParameters::default(), Vec::new());
    let config = Config {
        clock,
        threads,
        fallback_period_ms: 150,
        duration_time_s: 1.0,
        cycle_budget: None,
        vehicle,
        pipeline: Pipeline::new(validator, ranker),
        interface: Interface::V0_53,
        published_times: PublishedTimes::Zero,
        count_allocations: None,
    };
    (SelectorSystem::start(config, Box::new(Counter(published.clone()))).unwrap(), published)
}

/// More candidates than are judged inline.
fn anchor() -> Input {
    let candidate = Arc::new(CandidateTrajectory {
        points: vec![TrajectoryPoint::default(); 2],
        ..CandidateTrajectory::default()
    });
    Input::Generative(Arc::new(CandidateTrajectories {
        candidate_trajectories: vec![candidate; 32],
        generator_info: vec![GeneratorInfo::default()],
    }))
}

/// Whom to break, and how.
type Case = (&'static str, fn(&SelectorSystem));

const CASES: [Case; 5] = [
    ("buffer", |system| system.actors.buffer.do_send(Break)),
    ("sensors", |system| system.actors.sensors.do_send(Break)),
    ("scheduler", |system| system.actors.scheduler.do_send(Break)),
    ("validation", |system| system.actors.validation.do_send(Break)),
    ("pool", |system| system.actors.validation.do_send(BreakPool)),
];

#[test]
fn whoever_dies_is_named_and_nothing_leaves_any_more() {
    for threads in [1, 2] {
        for (whose, kill) in CASES {
            let (system, published) = start(threads, Clock::stepped(Time::default()));
            system.deliver(anchor()).unwrap();
            let before = published.load(Ordering::Relaxed);
            assert!(before > 0);
            kill(&system);
            let died =
                tokio::runtime::Builder::new_current_thread().build().unwrap().block_on(system.death());
            assert_eq!(died.to_string(), SystemError::ActorGone(whose).to_string());
            for _ in 0..2 {
                let refused = system.deliver(anchor());
                assert!(matches!(refused, Err(SystemError::ActorGone(who)) if who == whose), "{refused:?}");
            }
            assert_eq!(published.load(Ordering::Relaxed), before, "nothing leaves after the {whose} died");
            let stopped = system.stop();
            assert!(matches!(stopped, Err(SystemError::ActorGone(who)) if who == whose), "{stopped:?}");
        }
    }
}

#[test]
fn a_death_in_the_middle_of_a_cycle_leaves_nobody_waiting() {
    for (whose, kill) in CASES {
        let (system, _) = start(1, Clock::stepped(Time::default()));
        let Input::Generative(message) = anchor() else { unreachable!("an anchor is generative") };
        system.actors.buffer.do_send(Add { message, anchor: Some(Instant::now()) });
        kill(&system);
        let waited = loop {
            // The pool may die a moment after the cycle has ended.
            if let Err(error) = system.settle() {
                break error;
            }
        };
        assert!(matches!(waited, SystemError::ActorGone(who) if who == whose), "{waited:?}");
    }
}

#[test]
fn those_who_bring_messages_are_told() {
    let (system, _) = start(1, Clock::stepped(Time::default()));
    let inlets = system.inlets().clone();
    system.actors.scheduler.do_send(Break);
    let runtime = tokio::runtime::Builder::new_current_thread().build().unwrap();
    runtime.block_on(system.death());
    let mut taken = Ok(());
    while taken.is_ok() {
        // The owners leave one after the other.
        taken = runtime.block_on(inlets.take(anchor(), Instant::now()));
    }
}
