//! The node as a graph runs it: messages come when they come, from any thread; the clock runs, stands still or goes
//! back; parameters change while a cycle runs; the end comes in the middle of one.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

use crossbeam_channel::{Receiver, Sender, bounded, unbounded};
use lanelet_map::{Map, MapBuilder};
use messages::Interface;
use messages::autoware_internal_planning_msgs::{CandidateTrajectories, CandidateTrajectory, GeneratorInfo};
use messages::autoware_map_msgs::LaneletMapBin;
use messages::autoware_planning_msgs::TrajectoryPoint;
use messages::builtin_interfaces::{Duration, Time};
use messages::nav_msgs::Odometry;
use messages::std_msgs::Header;
use messages::unique_identifier_msgs::Uuid;
use motion::VehicleInfo;
use selection::parameters::{RankerParameters, ValidatorParameters};
use selection::ranker::GeneratorSource;
use selection::{Candidate, Enforcement, Filter, Judgement, Pipeline, Ranker, Scene, Scratch, Validator};
use selector_actors::cycle::{CycleReport, CycleTimes};
use selector_actors::publisher::PublishedTimes;
use selector_actors::{
    Clock, Config, DropReason, Inlets, Input, InputTopic, Outcome, Parameters, Publication, RosClock,
    SelectorSystem, Sink, SinkError, Trigger,
};
use std::sync::Arc;
use std::time::Instant;

/// Longer than anything here takes on a busy machine.
const PATIENCE: std::time::Duration = std::time::Duration::from_secs(60);

/// Keeps the report of every cycle.
struct Reports(Sender<CycleReport>);

impl Sink for Reports {
    fn publish(&mut self, _: Publication) -> Result<(), SinkError> {
        Ok(())
    }

    fn observe(&mut self, report: &CycleReport, _: CycleTimes) {
        // The test may be over.
        let _ = self.0.send(report.clone());
    }
}

/// A filter that waits for the test at the first candidate of a cycle, and tells with which parameters it judged.
struct Gate {
    entered: Sender<f64>,
    opens: Receiver<()>,
    max_speed: f64,
}

impl Filter for Gate {
    fn name(&self) -> &'static str {
        "gate"
    }

    fn configure(&mut self, parameters: &ValidatorParameters) {
        self.max_speed = parameters.vehicle_constraint.max_speed;
    }

    fn observe(&mut self, _: &Scene) {
        self.entered.send(self.max_speed).unwrap();
        self.opens.recv_timeout(PATIENCE).unwrap();
    }

    fn judge(&self, _: &Scene, _: &Candidate, _: &mut Scratch) -> Judgement {
        Judgement::feasible([])
    }
}

struct Node {
    system: SelectorSystem,
    inlets: Inlets,
    clock: Arc<RosClock>,
    reports: Receiver<CycleReport>,
}

fn validator() -> Validator {
    let parameters = ValidatorParameters {
        filter_names: Vec::new(),
        shadow_mode_filter_names: Vec::new(),
        ..ValidatorParameters::default()
    };
    Validator::new(parameters, &VehicleInfo::default()).unwrap()
}

/// A node on simulated time, with all inputs but candidates.
fn start(validator: Validator) -> Node {
    let (sender, reports) = unbounded();
    let clock = Arc::new(RosClock::new(true));
    let sources = GeneratorSource::table(&["DiffusionPlanner_"]);
    let ranker = Ranker::new(RankerParameters::default(), sources);
    let config = Config {
        clock: Clock::Ros(clock.clone()),
        threads: 1,
        fallback_period_ms: 150,
        duration_time_s: 1.0,
        cycle_budget: None,
        vehicle: VehicleInfo::default(),
        pipeline: Pipeline::new(validator, ranker),
        interface: Interface::V0_53,
        published_times: PublishedTimes::Measured,
        count_allocations: None,
    };
    let system = SelectorSystem::start(config, Box::new(Reports(sender))).unwrap();
    let node = Node { inlets: system.inlets().clone(), system, clock, reports };
    node.take(Input::ReadyMap(Arc::new(road(1)), "map".into()));
    node.take(Input::Odometry(Default::default()));
    node.take(Input::Objects(Default::default()));
    node.take(Input::Acceleration(Default::default()));
    node
}

impl Node {
    fn take(&self, input: Input) {
        block_on(self.inlets.take(input, Instant::now())).unwrap();
    }

    fn next_report(&self) -> CycleReport {
        self.reports.recv_timeout(PATIENCE).unwrap()
    }

    /// Simulated time goes on in steps until a cycle has run.
    fn step_until_a_cycle(&self, from_ms: i64, step_ms: i64) -> CycleReport {
        let patience = Instant::now() + PATIENCE;
        for step in 0.. {
            self.clock.set(at(from_ms + step * step_ms));
            if let Ok(report) = self.reports.recv_timeout(std::time::Duration::from_millis(5)) {
                return report;
            }
            assert!(Instant::now() < patience, "no cycle from {from_ms} ms on");
        }
        unreachable!("the loop has no end");
    }
}

fn block_on<T>(future: impl Future<Output = T>) -> T {
    tokio::runtime::Builder::new_current_thread().build().unwrap().block_on(future)
}

fn at(milliseconds: i64) -> Time {
    Time::from_nanoseconds(milliseconds * 1_000_000)
}

/// A straight road of lanelets of 10 m.
fn road(lanelets: i64) -> Map {
    let mut builder = MapBuilder::new();
    for index in 0..=lanelets {
        let x = 10.0 * index as f64;
        builder.point(2 * index + 1, [x, 2.0, 0.0], &[]).unwrap();
        builder.point(2 * index + 2, [x, -2.0, 0.0], &[]).unwrap();
    }
    let first_line = 10 * (lanelets + 1);
    for index in 0..lanelets {
        let (left, right) = (first_line + 3 * index, first_line + 3 * index + 1);
        builder.line_string(left, &[2 * index + 1, 2 * index + 3], &[]).unwrap();
        builder.line_string(right, &[2 * index + 2, 2 * index + 4], &[]).unwrap();
        builder.lanelet(first_line + 3 * index + 2, left, right, &[("subtype", "road")]).unwrap();
    }
    builder.build().unwrap()
}

/// As many candidates as generators, of two points each.
fn candidates(generators: std::ops::Range<u32>, stamp_ms: i64) -> Arc<CandidateTrajectories> {
    let id = |generator: u32| {
        let mut uuid = [0; 16];
        uuid[..4].copy_from_slice(&generator.to_be_bytes());
        Uuid { uuid }
    };
    let point = |index: i64| TrajectoryPoint {
        time_from_start: Duration::from_nanoseconds(index * 100_000_000),
        ..TrajectoryPoint::default()
    };
    let candidate = |generator| {
        Arc::new(CandidateTrajectory {
            header: Header { stamp: at(stamp_ms), frame_id: "map".to_owned() },
            generator_id: id(generator),
            points: vec![point(0), point(1)],
            ..CandidateTrajectory::default()
        })
    };
    let info = |generator| GeneratorInfo { generator_id: id(generator), ..GeneratorInfo::default() };
    Arc::new(CandidateTrajectories {
        candidate_trajectories: generators.clone().map(candidate).collect(),
        generator_info: generators.map(info).collect(),
    })
}

fn odometry(stamp_ms: i64) -> Input {
    let header = Header { stamp: at(stamp_ms), frame_id: "map".to_owned() };
    Input::Odometry(Arc::new(Odometry { header, ..Odometry::default() }))
}

#[test]
fn of_a_sensor_only_the_newest_message_matters_and_the_rest_is_counted() {
    let node = start(validator());
    (1..=5).for_each(|stamp_ms| node.take(odometry(stamp_ms)));
    node.take(Input::Generative(candidates(0..1, 0)));
    let report = node.next_report();
    assert_eq!(report.cycle.scene.odometry.as_ref().unwrap().header.stamp, at(5));
    let tally = node.inlets.tally();
    assert_eq!(tally.received(InputTopic::Odometry), 6);
    assert_eq!(tally.dropped(InputTopic::Odometry, DropReason::Superseded), 5, "the first one included");
    assert_eq!(tally.dropped(InputTopic::Objects, DropReason::Superseded), 0);
    // Nothing newer came: the next cycle sees the same.
    node.take(Input::Generative(candidates(0..1, 0)));
    assert_eq!(node.next_report().cycle.scene.odometry.as_ref().unwrap().header.stamp, at(5));
}

#[test]
fn no_anchor_of_a_flood_is_lost() {
    let node = start(validator());
    std::thread::scope(|scope| {
        for planner in 0..4 {
            let inlets = node.inlets.clone();
            scope.spawn(move || {
                for message in 0..100 {
                    let generator = 100 * planner + message;
                    let anchor = Input::Generative(candidates(generator..generator + 1, 0));
                    block_on(inlets.take(anchor, Instant::now())).unwrap();
                }
            });
        }
    });
    let state = node.system.settle().unwrap();
    let reports: Vec<_> = node.reports.try_iter().collect();
    let last = reports.last().unwrap();
    assert_eq!(last.cycle.concatenated.candidates.len(), 400, "every generator's candidate is in the buffer");
    assert_eq!(state.cycles + state.coalesced, 400, "every anchor started a cycle or was merged into one");
    assert_eq!(reports.len() as u64, state.cycles);
}

#[test]
fn a_map_being_decoded_delays_no_anchor() {
    let node = start(validator());
    let data = lanelet_map::archive::encode(&road(20_000));
    let map = LaneletMapBin { data, ..LaneletMapBin::default() };
    node.take(Input::Map(Arc::new(map)));
    // More candidates than are judged inline, on a pool of one thread: a map on that thread would be in their way.
    node.take(Input::Generative(candidates(0..32, 0)));
    let report = node.next_report();
    assert!(matches!(report.outcome, Outcome::Judged(_)));
    assert_eq!(report.cycle.scene.map.as_ref().unwrap().number, 1, "judged on the map that was there");
    let patience = Instant::now() + PATIENCE;
    loop {
        node.take(Input::Generative(candidates(0..1, 0)));
        let report = node.next_report();
        if report.cycle.scene.map.as_ref().unwrap().number == 2 {
            break;
        }
        assert!(Instant::now() < patience, "the map never arrived");
    }
}

#[test]
fn maps_that_come_faster_than_they_are_decoded_cost_the_older_ones() {
    let node = start(validator());
    let map = |lanelets| {
        let data = lanelet_map::archive::encode(&road(lanelets));
        Input::Map(Arc::new(LaneletMapBin { data, ..LaneletMapBin::default() }))
    };
    let (large, last) = (map(20_000), map(3));
    (0..5).for_each(|_| node.take(large.clone()));
    node.take(last);
    let patience = Instant::now() + PATIENCE;
    loop {
        node.take(Input::Generative(candidates(0..1, 0)));
        let report = node.next_report();
        if report.cycle.scene.map.as_ref().unwrap().value.map.lanelets().len() == 3 {
            break;
        }
        assert!(Instant::now() < patience, "the last map never arrived");
    }
    let dropped = node.inlets.tally().dropped(InputTopic::Map, DropReason::Superseded);
    assert_eq!(dropped, 5, "five maps were overtaken, waiting or decoded");
}

#[test]
fn the_timer_follows_simulated_time_and_starts_anew_when_it_goes_back() {
    let node = start(validator());
    let first = node.step_until_a_cycle(1_000_000, 1);
    assert_eq!(first.cycle.trigger, Trigger::Timer, "the jump from 0 fires once");
    // Back by a quarter of an hour: without a new start the timer would be due in a quarter of an hour.
    let again = node.step_until_a_cycle(100_000, 50);
    assert_eq!(again.cycle.trigger, Trigger::Timer);
    assert!(again.cycle.scene.now < at(900_000), "at {:?}", again.cycle.scene.now);
}

#[test]
fn the_timer_fires_on_the_machines_time_after_simulation_is_switched_off() {
    let node = start(validator());
    assert!(node.reports.is_empty(), "simulated time stands at 0");
    node.clock.simulate(false);
    let report = node.next_report();
    assert_eq!(report.cycle.trigger, Trigger::Timer);
    assert!(report.cycle.scene.now.sec > 1_577_836_800);
}

fn gated() -> (Validator, Receiver<f64>, Sender<()>) {
    let (entered, enters) = unbounded();
    let (open, opens) = bounded(16);
    let mut validator = validator();
    validator.load(
        "",
        Enforcement::Enforced,
        Arc::new(move |parameters: &ValidatorParameters| {
            Box::new(Gate {
                entered: entered.clone(),
                opens: opens.clone(),
                max_speed: parameters.vehicle_constraint.max_speed,
            }) as Box<dyn Filter>
        }),
    );
    (validator, enters, open)
}

#[test]
fn parameters_change_together_between_two_cycles() {
    let (validator, enters, open) = gated();
    let node = start(validator);
    let anchor = || Input::Generative(candidates(0..32, -400));
    node.take(anchor());
    let before = enters.recv_timeout(PATIENCE).unwrap();
    let mut parameters = Parameters {
        fallback_period_ms: 150,
        duration_time_s: 0.3,
        cycle_budget: None,
        ranker: RankerParameters::default(),
        sources: GeneratorSource::table(&["DiffusionPlanner_"]),
        validator: ValidatorParameters {
            filter_names: Vec::new(),
            shadow_mode_filter_names: Vec::new(),
            ..ValidatorParameters::default()
        },
    };
    parameters.validator.vehicle_constraint.max_speed = before + 1.0;
    node.system.configure(parameters.clone());
    parameters.validator.vehicle_constraint.max_speed = before + 2.0;
    parameters.duration_time_s = 0.5;
    node.system.configure(parameters);
    // Waits for the running cycle; its candidates are 0.4 s old.
    node.take(anchor());
    open.send(()).unwrap();
    assert_eq!(node.next_report().cycle.concatenated.candidates.len(), 32);
    let after = enters.recv_timeout(PATIENCE).unwrap();
    open.send(()).unwrap();
    assert_eq!(after - before, 2.0, "the newest change holds");
    assert_eq!(
        node.next_report().cycle.concatenated.candidates.len(),
        32,
        "not the 0.3 s of the first change"
    );
}

#[test]
fn a_flood_of_anchors_keeps_nobody_from_stopping_the_node() {
    let Node { system, inlets, reports, .. } = start(validator());
    std::thread::scope(|scope| {
        for _ in 0..4 {
            scope.spawn(|| {
                let anchor = candidates(0..32, 0);
                let mut taken = Ok(());
                while taken.is_ok() {
                    taken = block_on(inlets.take(Input::Generative(anchor.clone()), Instant::now()));
                }
            });
        }
        (0..10).for_each(|_| drop(reports.recv_timeout(PATIENCE).unwrap()));
        let state = system.stop().unwrap();
        let ended = reports.try_iter().last().map_or(10, |report| report.cycle.number);
        assert_eq!(ended, state.cycles, "every cycle that started has ended");
    });
}
