//! What one cycle of the node publishes: order, types, the choice, and what diagnostics say about it.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

use crossbeam_channel::{Receiver, Sender, unbounded};
use lanelet_map::MapBuilder;
use messages::Interface;
use messages::autoware_internal_planning_msgs::{CandidateTrajectories, CandidateTrajectory, GeneratorInfo};
use messages::autoware_planning_msgs::TrajectoryPoint;
use messages::autoware_vehicle_msgs::TurnIndicatorsCommand;
use messages::builtin_interfaces::{Duration, Time};
use messages::diagnostic_msgs::DiagnosticStatus;
use messages::std_msgs::{Header, Text};
use messages::unique_identifier_msgs::Uuid;
use motion::VehicleInfo;
use selection::parameters::{RankerParameters, ValidatorParameters};
use selection::ranker::GeneratorSource;
use selection::{
    Candidate, Enforcement, Filter, Judgement, Metric, Pipeline, Ranker, RiskLevel, Scene, Scratch, Validator,
};
use selector_actors::publisher::PublishedTimes;
use selector_actors::topics::OutputMessage;
use selector_actors::{Clock, Config, Input, OutputTopic, Publication, SelectorSystem, Sink, SinkError};
use std::sync::Arc;

/// A filter that says the same of every candidate.
struct Constant(&'static str, fn() -> Judgement);

impl Filter for Constant {
    fn name(&self) -> &'static str {
        self.0
    }

    fn configure(&mut self, _: &ValidatorParameters) {}

    fn judge(&self, _: &Scene, _: &Candidate, _: &mut Scratch) -> Judgement {
        self.1()
    }
}

fn accept() -> Judgement {
    Judgement::feasible([])
}

/// Objects at the worst risk that there is.
fn alarm() -> Judgement {
    let metric = Metric { name: "alarm", value: 1.0, threshold: 0.0, risk: RiskLevel::Fatal };
    Judgement { feasible: false, ..Judgement::feasible([metric]) }
}

fn break_down() -> Judgement {
    // Without the report of a panic on stderr, which would look as if the test had failed.
    std::panic::resume_unwind(Box::new("broken on purpose"))
}

struct Collector(Sender<Publication>);

impl Sink for Collector {
    fn publish(&mut self, publication: Publication) -> Result<(), SinkError> {
        self.0.send(publication).map_err(|gone| SinkError(Arc::new(std::io::Error::other(gone.to_string()))))
    }
}

/// The node at 1 s with all inputs, an enforced filter and a shadow filter.
struct Node {
    system: SelectorSystem,
    outputs: Receiver<Publication>,
}

const NOW: Time = Time { sec: 1, nanosec: 0 };
/// Stamp of all candidates, 250 ms before.
const STAMP: Time = Time { sec: 0, nanosec: 750_000_000 };

impl Node {
    fn start(interface: Interface, enforced: fn() -> Judgement, shadow: fn() -> Judgement) -> Self {
        let (sender, outputs) = unbounded();
        let parameters = ValidatorParameters {
            filter_names: Vec::new(),
            shadow_mode_filter_names: Vec::new(),
            ..ValidatorParameters::default()
        };
        let mut validator = Validator::new(parameters, &VehicleInfo::default()).unwrap();
        for (name, enforcement, judge) in
            [("a_filter", Enforcement::Enforced, enforced), ("b_filter", Enforcement::Shadow, shadow)]
        {
            let make = move |_: &ValidatorParameters| Box::new(Constant(name, judge)) as Box<dyn Filter>;
            validator.load("", enforcement, Arc::new(make));
        }
        let sources = GeneratorSource::table(&["DiffusionPlanner_", "MinimumRuleBasedPlanner_Stop"]);
        let config = Config {
            clock: Clock::stepped(NOW),
            threads: 1,
            fallback_period_ms: 150,
            duration_time_s: 1.0,
            cycle_budget: None,
            vehicle: VehicleInfo::default(),
            pipeline: Pipeline::new(validator, Ranker::new(RankerParameters::default(), sources)),
            interface,
            published_times: PublishedTimes::Zero,
            count_allocations: None,
        };
        let node =
            Self { system: SelectorSystem::start(config, Box::new(Collector(sender))).unwrap(), outputs };
        let inputs = [
            Input::ReadyMap(Arc::new(one_lanelet()), "map".into()),
            Input::Odometry(Arc::default()),
            Input::Objects(Arc::default()),
            Input::Acceleration(Arc::default()),
        ];
        inputs.into_iter().for_each(|input| node.system.deliver(input).unwrap());
        node
    }

    /// What a cycle with one candidate of each of these generators publishes.
    fn cycle(&self, generators: &[&str]) -> Vec<Publication> {
        self.system.deliver(Input::Generative(Arc::new(message(generators)))).unwrap();
        self.outputs.try_iter().collect()
    }
}

fn one_lanelet() -> lanelet_map::Map {
    let mut builder = MapBuilder::new();
    for (id, x, y) in [(1, 0.0, 2.0), (2, 50.0, 2.0), (3, 0.0, -2.0), (4, 50.0, -2.0)] {
        builder.point(id, [x, y, 0.0], &[]).unwrap();
    }
    builder.line_string(11, &[1, 2], &[]).unwrap();
    builder.line_string(12, &[3, 4], &[]).unwrap();
    builder.lanelet(21, 11, 12, &[("subtype", "road")]).unwrap();
    builder.build().unwrap()
}

fn message(generators: &[&str]) -> CandidateTrajectories {
    let id = |index: usize| Uuid { uuid: [index as u8 + 1; 16] };
    let point = |index: i64| TrajectoryPoint {
        time_from_start: Duration::from_nanoseconds(index * 100_000_000),
        ..TrajectoryPoint::default()
    };
    let candidate = |index: usize| {
        Arc::new(CandidateTrajectory {
            header: Header { stamp: STAMP, frame_id: "map".to_owned() },
            generator_id: id(index),
            points: vec![point(0), point(1), point(2 + index as i64)],
            turn_indicators_command: TurnIndicatorsCommand {
                stamp: STAMP,
                command: TurnIndicatorsCommand::ENABLE_LEFT,
            },
        })
    };
    let info = |(index, name): (usize, &&str)| GeneratorInfo {
        generator_id: id(index),
        generator_name: Text { data: (*name).to_owned() },
    };
    CandidateTrajectories {
        candidate_trajectories: (0..generators.len()).map(candidate).collect(),
        generator_info: generators.iter().enumerate().map(info).collect(),
    }
}

fn topics(outputs: &[Publication]) -> Vec<OutputTopic> {
    outputs.iter().map(|output| output.topic).collect()
}

/// Name, level and message of every status.
fn statuses(outputs: &[Publication]) -> Vec<(&str, u8, &str)> {
    let diagnostics = outputs.iter().find_map(|output| match &output.message {
        OutputMessage::Diagnostics(diagnostics) => Some(diagnostics),
        _ => None,
    });
    let statuses = &diagnostics.unwrap().status;
    statuses.iter().map(|status| (&status.name[..], status.level, &status.message[..])).collect()
}

const DIFFUSION: &str = "DiffusionPlanner_0";
const STOP: &str = "MinimumRuleBasedPlanner_Stop";

#[test]
fn order_of_publication_with_a_trajectory_to_drive() {
    for (interface, has_indicators) in [(Interface::V0_53, true), (Interface::V0_52, false)] {
        let found = topics(&Node::start(interface, accept, accept).cycle(&[DIFFUSION]));
        assert_eq!(found, OutputTopic::all(interface, &["a_filter", "b_filter"]));
        assert_eq!(found.contains(&OutputTopic::TurnIndicators), has_indicators);
        // Where upstream has them: scores, then age, trajectory and indicators, the tree last.
        let driven: Vec<_> = found.iter().rev().take(if has_indicators { 5 } else { 4 }).rev().collect();
        assert_eq!(
            driven[..3],
            [&OutputTopic::ScoredTrajectories, &OutputTopic::Latency, &OutputTopic::Trajectory]
        );
    }
}

#[test]
fn messages_are_of_their_topics_type() {
    for output in Node::start(Interface::V0_53, accept, accept).cycle(&[DIFFUSION, STOP]) {
        assert_eq!(output.message.type_name(), output.topic.type_name(), "{}", output.topic.full_name());
    }
}

#[test]
fn the_best_candidate_is_driven_with_its_indicators_and_its_age() {
    let outputs = Node::start(Interface::V0_53, accept, accept).cycle(&[STOP, DIFFUSION]);
    let mut seen = 0;
    for output in &outputs {
        match (output.topic, &output.message) {
            (OutputTopic::Trajectory, OutputMessage::Trajectory(trajectory)) => {
                assert_eq!(trajectory.header.stamp, STAMP);
                assert_eq!(trajectory.points, message(&[STOP, DIFFUSION]).candidate_trajectories[1].points);
            }
            (OutputTopic::TurnIndicators, OutputMessage::TurnIndicators(command)) => {
                assert_eq!((command.stamp, command.command), (NOW, TurnIndicatorsCommand::ENABLE_LEFT));
            }
            (OutputTopic::Latency, OutputMessage::Number(latency)) => {
                assert_eq!((latency.stamp, latency.data.to_bits()), (NOW, 0.25_f64.to_bits()));
            }
            (OutputTopic::ScoredTrajectories, OutputMessage::Scored(scored)) => {
                // The generator that was inserted last comes first.
                let scores = scored.scored_candidate_trajectories.iter().map(|scored| scored.score);
                assert_eq!(scores.collect::<Vec<_>>(), [1.0, (1.0 - 2.5 / 26.0) as f32]);
            }
            (OutputTopic::PlanningFactors, OutputMessage::PlanningFactors(factors)) => {
                assert_eq!((factors.header.stamp, factors.factors.len()), (NOW, 0));
            }
            _ => continue,
        }
        seen += 1;
    }
    assert_eq!(seen, 5);
}

#[test]
fn the_time_tree_has_a_node_for_every_stage() {
    let outputs = Node::start(Interface::V0_53, accept, accept).cycle(&[DIFFUSION]);
    let OutputMessage::Times(tree) = &outputs.last().unwrap().message else { panic!("the tree comes last") };
    let nodes: Vec<_> = tree.nodes.iter().map(|node| (node.id, &node.name[..], node.parent_id)).collect();
    let expected = [
        (1, "process_trajectories", 0),
        (2, "validate_trajectories", 1),
        (3, "publish_debug", 2),
        (4, "rank_trajectories", 1),
        (5, "update_last_best_trajectory_info", 4),
        (6, "get_trajectory", 1),
    ];
    assert_eq!(nodes, expected);
}

#[test]
fn diagnostics_say_whether_there_is_a_trajectory() {
    const VALIDATOR: &str = "trajectory_selector_node: trajectory_validator";
    const RANKER: &str = "trajectory_selector_node: trajectory_ranker";
    let (ok, error) = (DiagnosticStatus::OK, DiagnosticStatus::ERROR);
    /// What the enforced filter says, the generators, level and message of validator and ranker.
    type Case = (fn() -> Judgement, &'static [&'static str], [(u8, &'static str); 2]);
    let cases: [Case; 4] = [
        (accept, &[DIFFUSION, "SafePlanner"], [(ok, "OK"), (ok, "OK")]),
        (accept, &["SafePlanner"], [(ok, "OK"), (error, "None of the accepted candidates can be ranked")]),
        (
            alarm,
            &[DIFFUSION],
            [(error, "No feasible trajectories found"), (error, "Every candidate was rejected")],
        ),
        (break_down, &[DIFFUSION], [(error, "A filter panicked"), (error, "Every candidate was rejected")]),
    ];
    for (enforced, generators, [validator, ranker]) in cases {
        let outputs = Node::start(Interface::V0_53, enforced, accept).cycle(generators);
        let expected = [(VALIDATOR, validator.0, validator.1), (RANKER, ranker.0, ranker.1)];
        assert_eq!(statuses(&outputs), expected);
        for topic in [OutputTopic::Trajectory, OutputTopic::TurnIndicators, OutputTopic::Latency] {
            assert_eq!(topics(&outputs).contains(&topic), ranker.0 == ok, "{}", topic.full_name());
        }
    }
}

#[test]
fn a_shadow_filter_raises_no_alarm_whatever_the_risk_unless_it_breaks_down() {
    for (shadow, level, text) in [
        (alarm as fn() -> Judgement, DiagnosticStatus::OK, "OK"),
        (break_down, DiagnosticStatus::ERROR, "A filter panicked"),
    ] {
        let outputs = Node::start(Interface::V0_53, accept, shadow).cycle(&[DIFFUSION]);
        assert_eq!((statuses(&outputs)[0].1, statuses(&outputs)[0].2), (level, text));
        assert!(topics(&outputs).contains(&OutputTopic::Trajectory), "and it never stops the vehicle");
    }
}

#[test]
fn changed_ranker_parameters_take_effect_with_the_next_cycle() {
    let node = Node::start(Interface::V0_53, accept, accept);
    assert!(!topics(&node.cycle(&["SafePlanner"])).contains(&OutputTopic::Trajectory));
    let sources = GeneratorSource::table(&["SafePlanner=backup_planner_go"]);
    node.system.set_ranker_parameters(RankerParameters::default(), sources);
    assert!(topics(&node.cycle(&["SafePlanner"])).contains(&OutputTopic::Trajectory));
}
