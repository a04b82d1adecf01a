//! The node on the virtual clock: upstream's test cases, and what upstream does not cover (missing map, throttles,
//! order of publication, empty sets, coalescing, one thread and several).

#![allow(clippy::unwrap_used, clippy::panic, clippy::float_cmp_const, reason = "a test fails by panicking")]

#[path = "support/inputs.rs"]
mod inputs;

use crossbeam_channel::{Receiver, Sender, unbounded};
use inputs::{candidate_set, one_lanelet};
use lanelet_map::MapBuilder;
use messages::Interface;
use messages::autoware_internal_planning_msgs::CandidateTrajectories;
use messages::autoware_planning_msgs::TrajectoryPoint;
use messages::builtin_interfaces::{Duration, Time};
use messages::diagnostic_msgs::DiagnosticStatus;
use motion::VehicleInfo;
use selection::parameters::{RankerParameters, ValidatorParameters};
use selection::ranker::GeneratorSource;
use selection::{Candidate, Enforcement, Filter, Judgement, Pipeline, Ranker, Scene, Scratch, Validator};
use selector_actors::publisher::PublishedTimes;
use selector_actors::topics::OutputMessage;
use selector_actors::{
    Clock, Config, Input, OutputTopic, Publication, SelectorSystem, Sink, SinkError, SystemError,
};
use std::sync::Arc;

/// Upstream's dummy filter: objects to a first point with a speed of exactly -999 m/s.
struct Dummy;

const REJECTED_SPEED_MPS: f32 = -999.0;

impl Filter for Dummy {
    fn name(&self) -> &'static str {
        "dummy_filter"
    }

    fn configure(&mut self, _: &ValidatorParameters) {}

    fn judge(&self, _: &Scene, candidate: &Candidate, _: &mut Scratch) -> Judgement {
        if candidate.points[0].longitudinal_velocity_mps == REJECTED_SPEED_MPS {
            Judgement::not_assessed("rejected by the dummy")
        } else {
            Judgement::feasible([])
        }
    }
}

/// Keeps what is published.
struct Collector(Sender<Publication>);

impl Sink for Collector {
    fn publish(&mut self, publication: Publication) -> Result<(), SinkError> {
        self.0.send(publication).map_err(|gone| SinkError(Arc::new(std::io::Error::other(gone.to_string()))))
    }
}

/// The node under test: virtual clock at 1 s, start-up fire of the timer drained.
struct Node {
    system: SelectorSystem,
    outputs: Receiver<Publication>,
    now_ms: i64,
}

const STEP_MS: i64 = 10;

impl Node {
    fn start(threads: usize) -> Self {
        let (sender, outputs) = unbounded();
        let parameters = ValidatorParameters {
            filter_names: Vec::new(),
            shadow_mode_filter_names: Vec::new(),
            ..ValidatorParameters::default()
        };
        let mut validator = Validator::new(parameters, &VehicleInfo::default()).unwrap();
        validator.load(
            "",
            Enforcement::Enforced,
            Arc::new(|_: &ValidatorParameters| Box::new(Dummy) as Box<dyn Filter>),
        );
        let sources = GeneratorSource::table(&["DiffusionPlanner_", "MinimumRuleBasedPlanner_Stop"]);
        let ranker = Ranker::new(RankerParameters::default(), sources);
        let config = Config {
            clock: Clock::stepped(Time::default()),
            threads,
            fallback_period_ms: 150,
            duration_time_s: 1.0,
            cycle_budget: None,
            vehicle: VehicleInfo::default(),
            pipeline: Pipeline::new(validator, ranker),
            interface: Interface::V0_53,
            published_times: PublishedTimes::Zero,
            count_allocations: None,
        };
        let system = SelectorSystem::start(config, Box::new(Collector(sender))).unwrap();
        system.jump_to(at(1000)).unwrap();
        let node = Self { system, outputs, now_ms: 1000 };
        node.take();
        node
    }

    fn deliver(&self, input: Input) {
        self.system.deliver(input).unwrap();
    }

    fn sense_all_but(&self, missing: &str) {
        let map = Input::ReadyMap(Arc::new(one_lanelet()), "map".into());
        let inputs = [
            ("map", map),
            ("odometry", Input::Odometry(Default::default())),
            ("objects", Input::Objects(Default::default())),
            ("acceleration", Input::Acceleration(Default::default())),
        ];
        inputs.into_iter().filter(|(name, _)| *name != missing).for_each(|(_, input)| self.deliver(input));
    }

    /// Steps the clock in steps of 10 ms, as the upstream tests do.
    fn run_for(&mut self, milliseconds: i64) {
        for _ in 0..milliseconds / STEP_MS {
            self.now_ms += STEP_MS;
            self.system.jump_to(at(self.now_ms)).unwrap();
        }
    }

    /// Everything published since the last call.
    fn take(&self) -> Vec<Publication> {
        self.outputs.try_iter().collect()
    }

    /// The validated sets published since the last call.
    fn take_sets(&self) -> Vec<Arc<CandidateTrajectories>> {
        self.take()
            .into_iter()
            .filter(|output| output.topic == OutputTopic::Trajectories)
            .map(set_of)
            .collect()
    }

    fn message(&self, candidates: &[(u8, &str, f32)]) -> Arc<CandidateTrajectories> {
        message_at(self.now_ms, candidates)
    }
}

fn set_of(output: Publication) -> Arc<CandidateTrajectories> {
    match output.message {
        OutputMessage::Candidates(set) => set,
        other => panic!("{other:?} on {}", output.topic.full_name()),
    }
}

fn at(milliseconds: i64) -> Time {
    Time::from_nanoseconds(milliseconds * 1_000_000)
}

/// One candidate of two points for each `(generator, name, speed)`.
fn message_at(stamp_ms: i64, candidates: &[(u8, &str, f32)]) -> Arc<CandidateTrajectories> {
    let point = |index: i64, speed: f32| TrajectoryPoint {
        time_from_start: Duration::from_nanoseconds(index * 100_000_000),
        longitudinal_velocity_mps: speed,
        ..TrajectoryPoint::default()
    };
    let generators = candidates.iter().map(|&(generator, name, _)| (generator, name.to_owned()));
    let trajectories =
        candidates.iter().map(|&(generator, _, speed)| (generator, vec![point(0, speed), point(1, speed)]));
    candidate_set(at(stamp_ms), generators, trajectories)
}

fn ready_node() -> Node {
    let node = Node::start(1);
    node.sense_all_but("");
    node
}

const SAFE: &[(u8, &str, f32)] = &[(1, "SafePlanner", 10.0)];

#[test]
fn filters_trajectories_via_plugin() {
    for threads in [1, 2] {
        let node = Node::start(threads);
        node.sense_all_but("");
        node.deliver(Input::Generative(
            node.message(&[(1, "SafePlanner", 10.0), (2, "RejectedPlanner", REJECTED_SPEED_MPS)]),
        ));
        let sets = node.take_sets();
        assert_eq!(sets.len(), 1);
        assert_eq!(sets[0].candidate_trajectories.len(), 1);
        assert_eq!(sets[0].generator_info.len(), 1);
        assert_eq!(sets[0].generator_info[0].generator_name.data, "SafePlanner");
    }
}

#[test]
fn immediate_output_on_generative_input() {
    let node = ready_node();
    node.deliver(Input::Generative(node.message(SAFE)));
    assert_eq!(node.take_sets().len(), 1, "at once, without any time passing");
}

#[test]
fn no_immediate_output_on_backup_input() {
    let mut node = ready_node();
    node.run_for(50);
    assert!(node.take_sets().is_empty());
    node.deliver(Input::Backup(node.message(SAFE)));
    node.run_for(50);
    assert!(node.take_sets().is_empty());
    node.run_for(200);
    assert!(!node.take_sets().is_empty());
}

#[test]
fn timer_output_without_generative_input() {
    let mut node = ready_node();
    node.deliver(Input::Backup(node.message(SAFE)));
    node.run_for(200);
    assert!(!node.take_sets().is_empty());
}

#[test]
fn handles_plugin_rejection() {
    let node = ready_node();
    node.deliver(Input::Generative(node.message(&[(1, "RejectedPlanner", REJECTED_SPEED_MPS)])));
    let sets = node.take_sets();
    assert_eq!(sets.len(), 1, "an empty set is published");
    assert!(sets[0].candidate_trajectories.is_empty() && sets[0].generator_info.is_empty());
}

#[test]
fn no_publish_when_an_input_is_missing() {
    for (missing, text) in [
        ("odometry", "Failed to take odometry data"),
        ("objects", "Failed to take predicted objects data"),
        ("acceleration", "Failed to take acceleration data"),
        ("map", "Lanelet map is not available"),
    ] {
        let mut node = Node::start(1);
        node.sense_all_but(missing);
        node.deliver(Input::Generative(node.message(SAFE)));
        node.run_for(500);
        let outputs = node.take();
        let topics: Vec<_> = outputs.iter().map(|output| output.topic).collect();
        for forbidden in
            [OutputTopic::Trajectories, OutputTopic::ValidatedTrajectories, OutputTopic::ValidationReports]
        {
            assert!(!topics.contains(&forbidden), "{missing} missing, {} published", forbidden.full_name());
        }
        let first_cycle = [
            OutputTopic::ConcatenatedTrajectories,
            OutputTopic::Diagnostics,
            OutputTopic::ProcessingTimeTree,
        ];
        assert_eq!(topics[..3], first_cycle, "{missing} missing");
        assert_eq!(status_of(&outputs[1]), (DiagnosticStatus::WARN, text.to_owned()));
    }
}

fn status_of(output: &Publication) -> (u8, String) {
    match &output.message {
        OutputMessage::Diagnostics(diagnostics) => {
            (diagnostics.status[0].level, diagnostics.status[0].message.clone())
        }
        other => panic!("{other:?} is no diagnostics"),
    }
}

#[test]
fn a_map_without_lanelets_is_a_missing_input() {
    let node = Node::start(1);
    node.sense_all_but("map");
    node.deliver(Input::ReadyMap(Arc::new(MapBuilder::new().build().unwrap()), "map".into()));
    node.deliver(Input::Generative(node.message(SAFE)));
    let outputs = node.take();
    assert_eq!(status_of(&outputs[1]).1, "Lanelet map does not contain any lanelets");
}

#[test]
fn an_undecodable_map_changes_nothing() {
    let node = ready_node();
    node.deliver(Input::Map(Default::default()));
    node.take();
    node.deliver(Input::Generative(node.message(SAFE)));
    assert_eq!(node.take_sets().len(), 1, "the old map still serves");
}

#[test]
fn missing_traffic_signals_do_not_stop_a_cycle() {
    let node = ready_node();
    node.deliver(Input::Generative(node.message(SAFE)));
    assert_eq!(node.take_sets().len(), 1);
}

#[test]
fn custom_fallback_period() {
    let mut node = ready_node();
    node.system.set_fallback_period_ms(500).unwrap();
    node.deliver(Input::Backup(node.message(SAFE)));
    node.run_for(400);
    assert!(node.take_sets().is_empty());
    node.run_for(200);
    assert!(!node.take_sets().is_empty());
}

#[test]
fn reset_fallback_period() {
    let mut node = ready_node();
    node.system.set_fallback_period_ms(500).unwrap();
    node.deliver(Input::Backup(node.message(SAFE)));
    node.run_for(400);
    assert!(node.take_sets().is_empty());
    node.system.set_fallback_period_ms(400).unwrap();
    node.run_for(200);
    assert!(node.take_sets().is_empty(), "a new value restarts the timer");
    node.system.set_fallback_period_ms(200).unwrap();
    node.run_for(100);
    assert!(node.take_sets().is_empty());
    node.run_for(200);
    assert!(!node.take_sets().is_empty());
}

#[test]
fn the_same_fallback_period_does_not_restart_the_timer() {
    let mut node = ready_node();
    node.deliver(Input::Backup(node.message(SAFE)));
    node.run_for(100);
    node.system.set_fallback_period_ms(150).unwrap();
    node.run_for(100);
    assert!(!node.take_sets().is_empty());
}

#[test]
fn anchors_faster_than_the_period_keep_the_timer_from_firing() {
    let mut node = ready_node();
    let before = node.system.settle().unwrap().cycles;
    for _ in 0..20 {
        node.deliver(Input::Generative(node.message(SAFE)));
        node.run_for(100);
    }
    assert_eq!(node.system.settle().unwrap().cycles - before, 20);
}

#[test]
fn the_timer_is_reset_by_anchors_that_return_early_too_but_not_by_backups() {
    let mut node = ready_node();
    let empty = || Input::Generative(Default::default());
    node.run_for(100);
    node.deliver(empty());
    let deadline = node.system.settle().unwrap().deadline;
    assert_eq!(deadline, at(node.now_ms + 150));
    node.run_for(50);
    node.deliver(Input::Backup(node.message(SAFE)));
    assert_eq!(node.system.settle().unwrap().deadline, deadline);
}

#[test]
fn without_candidates_only_diagnostics_and_the_time_tree_are_published() {
    let node = ready_node();
    node.deliver(Input::Generative(Default::default()));
    let topics: Vec<_> = node.take().into_iter().map(|output| output.topic).collect();
    assert_eq!(topics, [OutputTopic::Diagnostics, OutputTopic::ProcessingTimeTree]);
}

#[test]
fn order_of_publication_in_a_cycle() {
    let node = ready_node();
    node.deliver(Input::Generative(node.message(SAFE)));
    let topics: Vec<_> = node.take().into_iter().map(|output| output.topic).collect();
    let expected = [
        OutputTopic::ConcatenatedTrajectories,
        OutputTopic::ValidationReports,
        OutputTopic::PlanningFactors,
        OutputTopic::Diagnostics,
        OutputTopic::ProcessingTime,
        OutputTopic::FilterProcessingTime("dummy_filter"),
        OutputTopic::ProcessingTimeText,
        OutputTopic::Trajectories,
        OutputTopic::ValidatedTrajectories,
        // Nobody knows what kind of planner this is, so it is scored by nothing and not driven.
        OutputTopic::ScoredTrajectories,
        OutputTopic::ProcessingTimeTree,
    ];
    assert_eq!(topics, expected);
}

#[test]
fn diagnostics_follow_the_verdicts() {
    /// Candidates, level, message.
    type Case = (&'static [(u8, &'static str, f32)], u8, &'static str);
    let cases: [Case; 3] = [
        (SAFE, DiagnosticStatus::OK, "OK"),
        (
            &[(1, "a", 1.0), (2, "b", REJECTED_SPEED_MPS)],
            DiagnosticStatus::WARN,
            "At least one trajectory is infeasible",
        ),
        (&[(1, "a", REJECTED_SPEED_MPS)], DiagnosticStatus::ERROR, "No feasible trajectories found"),
    ];
    for (candidates, level, text) in cases {
        let node = ready_node();
        node.deliver(Input::Generative(node.message(candidates)));
        let outputs = node.take();
        let status = outputs.iter().find(|output| output.topic == OutputTopic::Diagnostics).map(status_of);
        assert_eq!(status, Some((level, text.to_owned())));
    }
}

#[test]
fn stale_candidates_are_not_judged() {
    let mut node = ready_node();
    let old = node.message(SAFE);
    node.run_for(1010);
    node.take();
    node.deliver(Input::Generative(old));
    assert!(node.take_sets().is_empty());
}

#[test]
fn a_shorter_window_acts_from_the_next_cycle_on() {
    let mut node = ready_node();
    let message = node.message(SAFE);
    node.run_for(100);
    node.system.set_duration_time_s(0.05);
    node.take();
    node.deliver(Input::Generative(message));
    assert!(node.take_sets().is_empty());
}

#[test]
fn continuous_time_fires_the_timer_at_each_deadline() {
    let node = ready_node();
    let before = node.system.settle().unwrap().cycles;
    node.system.advance_to(at(1000 + 10 * 150)).unwrap();
    assert_eq!(node.system.settle().unwrap().cycles - before, 10);
    let stamps: Vec<_> = node.take().iter().map(|output| output.stamp).collect();
    // The timer was made at 0 and keeps its phase: 1050, 1200, ... 2400 ms.
    let mut expected: Vec<_> = (0..10).map(|fire| at(1050 + fire * 150)).collect();
    expected.extend(expected.clone());
    expected.sort();
    assert_eq!(stamps, expected, "diagnostics and time tree of each cycle");
}

#[test]
fn a_clock_that_goes_back_does_not_stall_the_timer() {
    let node = ready_node();
    node.system.jump_to(at(500)).unwrap();
    let before = node.system.settle().unwrap().cycles;
    node.system.advance_to(at(650)).unwrap();
    assert_eq!(node.system.settle().unwrap().cycles - before, 1);
}

#[test]
fn a_failing_sink_is_reported_to_whoever_drives_the_node() {
    let node = ready_node();
    drop(node.outputs);
    let failed = node.system.deliver(Input::Generative(message_at(1000, SAFE)));
    assert!(matches!(failed, Err(SystemError::Sink(_))), "{failed:?}");
    assert!(matches!(node.system.stop(), Err(SystemError::Sink(_))));
}

#[test]
fn stopping_drops_the_sink() {
    let node = ready_node();
    node.system.stop().unwrap();
    node.outputs.try_iter().for_each(drop);
    assert_eq!(node.outputs.recv().map(|output| output.topic), Err(crossbeam_channel::RecvError));
}
