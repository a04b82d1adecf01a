//! A late cycle is cut, not late: what was not judged by the deadline is not published, and the report says so. A filter
//! that does not come back costs its cycle, and its late result is never published.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

#[path = "support/inputs.rs"]
mod inputs;

use crossbeam_channel::{Receiver, Sender, unbounded};
use inputs::{candidate_set, one_lanelet};
use messages::Interface;
use messages::autoware_internal_planning_msgs::CandidateTrajectories;
use messages::autoware_planning_msgs::TrajectoryPoint;
use messages::builtin_interfaces::{Duration as Span, Time};
use motion::VehicleInfo;
use selection::parameters::{RankerParameters, ValidatorParameters};
use selection::ranker::GeneratorSource;
use selection::{Candidate, Enforcement, Filter, Judgement, Pipeline, Ranker, Scene, Scratch, Validator};
use selector_actors::cycle::{CycleReport, CycleTimes, Judged};
use selector_actors::publisher::PublishedTimes;
use selector_actors::{
    Clock, Config, Input, Outcome, OutputTopic, Publication, SelectorSystem, Sink, SinkError,
};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Does something whenever it judges; has nothing against any candidate.
struct Does(Arc<dyn Fn() + Send + Sync>);

impl Filter for Does {
    fn name(&self) -> &'static str {
        "does_filter"
    }

    fn configure(&mut self, _: &ValidatorParameters) {}

    fn judge(&self, _: &Scene, _: &Candidate, _: &mut Scratch) -> Judgement {
        (self.0)();
        Judgement::feasible([])
    }
}

/// Keeps what every cycle published, and its report.
struct Watcher {
    reports: Sender<(CycleReport, Vec<Publication>)>,
    published: Vec<Publication>,
}

impl Sink for Watcher {
    fn publish(&mut self, publication: Publication) -> Result<(), SinkError> {
        self.published.push(publication);
        Ok(())
    }

    fn observe(&mut self, report: &CycleReport, _: CycleTimes) {
        self.reports.send((report.clone(), std::mem::take(&mut self.published))).unwrap();
    }
}

struct Node {
    system: SelectorSystem,
    reports: Receiver<(CycleReport, Vec<Publication>)>,
}

impl Node {
    fn start(threads: usize, budget: Duration, does: Arc<dyn Fn() + Send + Sync>) -> Self {
        let parameters = ValidatorParameters {
            filter_names: Vec::new(),
            shadow_mode_filter_names: Vec::new(),
            ..ValidatorParameters::default()
        };
        let mut validator = Validator::new(parameters, &VehicleInfo::default()).unwrap();
        let make = move |_: &ValidatorParameters| Box::new(Does(does.clone())) as Box<dyn Filter>;
        validator.load("", Enforcement::Enforced, Arc::new(make));
        let ranker = Ranker::new(RankerParameters::default(), GeneratorSource::table(&["DiffusionPlanner_"]));
        let (sender, reports) = unbounded();
        let config = Config {
            clock: Clock::stepped(Time { sec: 10, nanosec: 0 }),
            threads,
            fallback_period_ms: 150,
            duration_time_s: 1.0,
            cycle_budget: Some(budget),
            vehicle: VehicleInfo::default(),
            pipeline: Pipeline::new(validator, ranker),
            interface: Interface::V0_53,
            published_times: PublishedTimes::Measured,
            count_allocations: None,
        };
        let watcher = Watcher { reports: sender, published: Vec::new() };
        let system = SelectorSystem::start(config, Box::new(watcher)).unwrap();
        for input in [
            Input::ReadyMap(Arc::new(one_lanelet()), "map".into()),
            Input::Odometry(Arc::default()),
            Input::Objects(Arc::default()),
            Input::Acceleration(Arc::default()),
        ] {
            system.deliver(input).unwrap();
        }
        Self { system, reports }
    }

    /// Runs one cycle on an anchor.
    fn cycle(&self, anchor: &Arc<CandidateTrajectories>) -> (CycleReport, Vec<Publication>) {
        self.system.deliver(Input::Generative(anchor.clone())).unwrap();
        self.reports.try_iter().last().unwrap()
    }
}

fn judged(report: &CycleReport) -> &Judged {
    match &report.outcome {
        Outcome::Judged(judged) => judged,
        other => panic!("{other:?}"),
    }
}

fn sets(published: &[Publication]) -> usize {
    let is_set = |publication: &&Publication| {
        matches!(publication.topic, OutputTopic::Trajectories | OutputTopic::Trajectory)
    };
    published.iter().filter(is_set).count()
}

/// `count` candidates, each a millisecond newer than the one before.
fn anchor(count: u32) -> Arc<CandidateTrajectories> {
    let point = |milliseconds: u32| TrajectoryPoint {
        time_from_start: Span { sec: 0, nanosec: milliseconds * 1_000_000 },
        ..TrajectoryPoint::default()
    };
    let candidates = (0..count).map(|_| (1, vec![point(0), point(100)]));
    let mut set = candidate_set(Time::default(), [(1, "DiffusionPlanner_0".to_owned())], candidates);
    let stamped = Arc::make_mut(&mut set).candidate_trajectories.iter_mut();
    for (number, candidate) in (0..).zip(stamped) {
        Arc::make_mut(candidate).header.stamp = Time { sec: 9, nanosec: 900_000_000 + number * 1_000_000 };
    }
    set
}

#[test]
fn a_late_cycle_is_cut_and_says_so() {
    for threads in [1, 2] {
        let slowly = || {
            let until = Instant::now() + Duration::from_millis(3);
            while Instant::now() < until {
                std::hint::spin_loop();
            }
        };
        let node = Node::start(threads, Duration::from_millis(20), Arc::new(slowly));
        // A machine that stands still for longer than the grace gives a cycle up, or judges nothing of it.
        let mut cycles = std::iter::repeat_with(|| node.cycle(&anchor(64))).take(1_000);
        let cut = cycles.find(|(report, _)| match &report.outcome {
            Outcome::Judged(judged) => judged.not_judged() < 64,
            _ => false,
        });
        let (report, published) = cut.expect("a cycle that is cut");
        let judged = judged(&report);
        assert_eq!(judged.verdicts.len(), 64);
        let left = judged.not_judged();
        assert!(left > 0, "64 candidates of 3 ms each do not fit into 20 ms");
        // What was judged is the newest, and only that is published.
        let candidates = &report.cycle.concatenated.candidates;
        let stamps = |wanted: bool| {
            let of = candidates.iter().zip(&judged.verdicts).filter(move |(_, v)| v.is_judged() == wanted);
            of.map(|(candidate, _)| candidate.message.header.stamp.nanoseconds())
        };
        assert!(stamps(true).min() > stamps(false).max());
        assert!(judged.verdicts.iter().all(|verdict| verdict.accepted == verdict.is_judged()));
        assert_eq!(judged.validated.candidate_trajectories.len(), 64 - left);
        let told =
            judged.reports.reports.iter().filter(|report| report.metrics[0].metric_name == "not_judged");
        assert_eq!(told.count(), left);
        assert!(published.iter().any(|publication| publication.topic == OutputTopic::Diagnostics));
    }
}

#[test]
fn a_filter_that_does_not_come_back_costs_its_cycle() {
    let (release, wait) = unbounded::<()>();
    // Blocks until the sender is gone, then never again.
    let blocks = move || {
        let _ = wait.recv();
    };
    let node = Node::start(1, Duration::from_millis(20), Arc::new(blocks));
    let (report, published) = node.cycle(&anchor(3));
    assert_eq!(report.outcome.early_return(), Some("validation_failed"));
    assert_eq!(sets(&published), 0, "nothing leaves a cycle that was given up");
    assert!(published.iter().any(|publication| publication.topic == OutputTopic::Diagnostics));

    let (report, published) = node.cycle(&anchor(3));
    assert_eq!(report.outcome.early_return(), Some("validation_failed"), "the filter is still away");
    assert_eq!(sets(&published), 0);

    drop(release);
    let recovered = (0..10_000).find_map(|_| {
        let (report, published) = node.cycle(&anchor(3));
        matches!(report.outcome, Outcome::Judged(_)).then_some((report, published))
    });
    let (report, published) = recovered.expect("the node recovers");
    assert_eq!(judged(&report).validated.candidate_trajectories.len(), 3);
    assert_eq!(sets(&published), 2, "the set and the trajectory of this cycle, nothing of the earlier ones");
}
