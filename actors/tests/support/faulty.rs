//! A node whose parts can be made to fail, and what it did in every cycle. Whatever a test does to it, every cycle that
//! is looked at is held to the promise that nothing leaves that was not accepted in it.
#![allow(dead_code, unreachable_pub, reason = "several programs share this, each uses its own part")]

use crate::inputs::{candidate_set, one_lanelet};
use crossbeam_channel::{Receiver, Sender, unbounded};
use messages::Interface;
use messages::autoware_internal_planning_msgs::{CandidateTrajectories, CandidateTrajectory};
use messages::autoware_planning_msgs::TrajectoryPoint;
use messages::builtin_interfaces::{Duration as Span, Time};
use messages::diagnostic_msgs::{DiagnosticArray, DiagnosticStatus};
use motion::VehicleInfo;
use selection::parameters::{RankerParameters, ValidatorParameters};
use selection::ranker::GeneratorSource;
use selection::{
    Candidate, Enforcement, Filter, Judgement, Pipeline, Rank, Ranker, Scene, Scratch, Validator,
};
use selector_actors::cycle::{CycleReport, CycleTimes, Judged};
use selector_actors::publisher::PublishedTimes;
use selector_actors::topics::OutputMessage;
use selector_actors::{
    Clock, Config, Input, Outcome, OutputTopic, Publication, SelectorSystem, Sink, SinkError,
};
use std::collections::HashSet;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Threads that judge: every test runs on each of these.
pub const THREADS: [usize; 2] = [1, 2];
/// Longer than anything here takes on a busy machine.
pub const PATIENCE: Duration = Duration::from_secs(60);
/// When a node starts.
pub const START: Time = Time { sec: 10, nanosec: 0 };
/// A generator that can be ranked.
pub const DIFFUSION: &str = "DiffusionPlanner_0";

/// Something that a filter does.
pub type Does<A> = Arc<dyn Fn(A) + Send + Sync>;

/// Something that a sink does with a publication.
pub type Takes = dyn FnMut(&Publication) -> Result<(), SinkError> + Send;

/// A filter that does what it is told to.
#[derive(Clone)]
pub struct Scripted {
    pub judge: Arc<dyn Fn(&Candidate) -> Judgement + Send + Sync>,
    pub observe: Arc<dyn Fn(&Scene) + Send + Sync>,
    pub remember: Does<usize>,
    pub configure: Arc<dyn Fn(&ValidatorParameters) + Send + Sync>,
}

impl Default for Scripted {
    fn default() -> Self {
        Self {
            judge: Arc::new(|_| Judgement::feasible([])),
            observe: Arc::new(|_| ()),
            remember: Arc::new(|_| ()),
            configure: Arc::new(|_| ()),
        }
    }
}

impl Filter for Scripted {
    fn name(&self) -> &'static str {
        "scripted_filter"
    }

    fn configure(&mut self, parameters: &ValidatorParameters) {
        (self.configure)(parameters);
    }

    fn observe(&mut self, scene: &Scene) {
        (self.observe)(scene);
    }

    fn judge(&self, _: &Scene, candidate: &Candidate, _: &mut Scratch) -> Judgement {
        (self.judge)(candidate)
    }

    fn remember(&mut self, judged: &[(&Candidate, &Judgement)]) {
        (self.remember)(judged.len());
    }
}

/// Panics without the report on stderr, which would look as if the test had failed.
pub fn break_down() -> ! {
    std::panic::resume_unwind(Box::new("broken on purpose"))
}

/// No filters.
pub fn parameters() -> ValidatorParameters {
    ValidatorParameters {
        filter_names: Vec::new(),
        shadow_mode_filter_names: Vec::new(),
        ..ValidatorParameters::default()
    }
}

/// A validator with this one filter, enforced.
pub fn validator(filter: Scripted) -> Validator {
    let mut validator = Validator::new(parameters(), &VehicleInfo::default()).unwrap();
    let make = move |_: &ValidatorParameters| Box::new(filter.clone()) as Box<dyn Filter>;
    validator.load("test", Enforcement::Enforced, Arc::new(make));
    validator
}

pub fn sources() -> Vec<GeneratorSource> {
    GeneratorSource::table(&["DiffusionPlanner_", "MinimumRuleBasedPlanner_Stop"])
}

pub fn ranker() -> Ranker {
    Ranker::new(RankerParameters::default(), sources())
}

/// What a node is made of.
pub struct Setup {
    pub threads: usize,
    pub clock: Clock,
    pub budget: Option<Duration>,
    pub validator: Validator,
    pub ranker: Box<dyn Rank>,
    /// Something to do with each publication before it is taken.
    pub sink: Box<Takes>,
    /// And after each cycle.
    pub observe: Box<dyn FnMut(&CycleReport) + Send>,
}

/// A ranker in a box.
#[derive(Debug)]
struct Boxed(Box<dyn Rank>);

impl Rank for Boxed {
    fn configure(&mut self, parameters: RankerParameters, sources: Vec<GeneratorSource>) {
        self.0.configure(parameters, sources);
    }

    fn rank(
        &mut self,
        scene: &Scene,
        candidates: &[Candidate],
        verdicts: &[selection::Verdict],
    ) -> selection::Ranking {
        self.0.rank(scene, candidates, verdicts)
    }

    fn remember(&mut self, scene: &Scene, candidates: &[Candidate], ranking: &selection::Ranking) {
        self.0.remember(scene, candidates, ranking);
    }

    fn forget(&mut self) {
        self.0.forget();
    }
}

impl Setup {
    pub fn new(threads: usize) -> Self {
        Self {
            threads,
            clock: Clock::stepped(START),
            budget: None,
            validator: validator(Scripted::default()),
            ranker: Box::new(ranker()),
            sink: Box::new(|_| Ok(())),
            observe: Box::new(|_| ()),
        }
    }

    /// Starts the node, with all inputs but candidates.
    pub fn start(self) -> Node {
        let (sender, seen) = unbounded();
        let Self { threads, clock, budget, validator, ranker, sink, observe } = self;
        let config = Config {
            clock: clock.clone(),
            threads,
            fallback_period_ms: 150,
            duration_time_s: 0.2,
            cycle_budget: budget,
            vehicle: VehicleInfo::default(),
            pipeline: Pipeline::new(validator, Boxed(ranker)),
            interface: Interface::V0_53,
            published_times: PublishedTimes::Zero,
            count_allocations: None,
        };
        let watcher = Watcher { seen: sender, published: Vec::new(), sink, observe };
        let node = Node { system: SelectorSystem::start(config, Box::new(watcher)).unwrap(), clock, seen };
        for input in [
            Input::ReadyMap(Arc::new(one_lanelet()), "map".into()),
            Input::Odometry(Arc::default()),
            Input::Objects(Arc::default()),
            Input::Acceleration(Arc::default()),
        ] {
            node.system.deliver(input).unwrap();
        }
        node
    }
}

/// Keeps what every cycle published, and its report.
struct Watcher {
    seen: Sender<Seen>,
    published: Vec<Publication>,
    sink: Box<Takes>,
    observe: Box<dyn FnMut(&CycleReport) + Send>,
}

impl Sink for Watcher {
    fn publish(&mut self, publication: Publication) -> Result<(), SinkError> {
        (self.sink)(&publication)?;
        self.published.push(publication);
        Ok(())
    }

    fn observe(&mut self, report: &CycleReport, _: CycleTimes) {
        let seen = Seen { report: report.clone(), published: std::mem::take(&mut self.published) };
        // The test may be over.
        let _ = self.seen.send(seen);
        (self.observe)(report);
    }
}

/// The node under test.
pub struct Node {
    pub system: SelectorSystem,
    pub clock: Clock,
    seen: Receiver<Seen>,
}

impl Node {
    /// Runs the one cycle of an anchor.
    pub fn cycle(&self, anchor: &Arc<CandidateTrajectories>) -> Seen {
        self.system.deliver(Input::Generative(anchor.clone())).unwrap();
        let mut seen = self.seen();
        assert_eq!(seen.len(), 1, "cycles of one anchor");
        seen.remove(0)
    }

    /// Brings an anchor and does not wait for its cycle.
    pub fn bring(&self, anchor: &Arc<CandidateTrajectories>) {
        block_on(self.system.inlets().take(Input::Generative(anchor.clone()), Instant::now())).unwrap();
    }

    /// The cycles since the last call.
    pub fn seen(&self) -> Vec<Seen> {
        self.seen.try_iter().inspect(Seen::check).collect()
    }

    /// The next cycle, which runs on its own.
    pub fn next(&self) -> Seen {
        let seen = self.seen.recv_timeout(PATIENCE).unwrap();
        seen.check();
        seen
    }

    /// A cycle of some good candidates that is as it should be.
    pub fn assert_normal(&self, why: &str) {
        let anchor = anchor(self.clock.now(), 12);
        self.cycle(&anchor).assert_normal(12, why);
    }
}

pub fn block_on<T>(future: impl Future<Output = T>) -> T {
    tokio::runtime::Builder::new_current_thread().build().unwrap().block_on(future)
}

/// What became of a cycle.
#[derive(Debug)]
pub struct Seen {
    pub report: CycleReport,
    pub published: Vec<Publication>,
}

impl Seen {
    /// The verdicts, if there are any.
    pub fn judged(&self) -> Option<&Judged> {
        match &self.report.outcome {
            Outcome::Judged(judged) => Some(judged),
            _ => None,
        }
    }

    /// The message on a topic, if there is one.
    pub fn on(&self, topic: OutputTopic) -> Option<&OutputMessage> {
        self.published.iter().find(|publication| publication.topic == topic).map(|found| &found.message)
    }

    /// Numbers of the candidates of the validated set.
    pub fn validated(&self) -> Option<Vec<u32>> {
        match self.on(OutputTopic::Trajectories)? {
            OutputMessage::Candidates(set) => Some(
                set.candidate_trajectories.iter().map(|candidate| number_of(&candidate.points)).collect(),
            ),
            other => panic!("{other:?} is no set"),
        }
    }

    /// Number of the candidate to drive.
    pub fn driven(&self) -> Option<u32> {
        match self.on(OutputTopic::Trajectory)? {
            OutputMessage::Trajectory(trajectory) => Some(number_of(&trajectory.points)),
            other => panic!("{other:?} is no trajectory"),
        }
    }

    fn diagnostics(&self) -> &DiagnosticArray {
        match self.on(OutputTopic::Diagnostics) {
            Some(OutputMessage::Diagnostics(diagnostics)) => diagnostics,
            other => panic!("no diagnostics: {other:?}"),
        }
    }

    /// Level and message of the validator, and of the ranker where the cycle came so far.
    pub fn told(&self) -> Vec<(u8, &str)> {
        let statuses = &self.diagnostics().status;
        statuses.iter().map(|status| (status.level, &status.message[..])).collect()
    }

    /// A value of the diagnostics.
    pub fn value(&self, key: &str) -> Option<&str> {
        let mut values = self.diagnostics().status.iter().flat_map(|status| &status.values);
        values.find(|value| value.key == key).map(|value| &value.value[..])
    }

    /// Nothing left that was not accepted in this cycle.
    pub fn check(&self) {
        let candidates = &self.report.cycle.concatenated.candidates;
        let accepted: Vec<&Arc<CandidateTrajectory>> = self.judged().map_or(Vec::new(), |judged| {
            let verdicts = judged.verdicts.iter().zip(candidates);
            let accepted = verdicts.filter(|(verdict, candidate)| {
                assert_eq!(verdict.key, candidate.key);
                verdict.accepted
            });
            accepted.map(|(_, candidate)| &candidate.message).collect()
        });
        let places: HashSet<*const CandidateTrajectory> =
            accepted.iter().map(|message| Arc::as_ptr(message)).collect();
        let is_accepted = |message: &Arc<CandidateTrajectory>| places.contains(&Arc::as_ptr(message));
        for Publication { topic, message, .. } in &self.published {
            match (topic, message) {
                (
                    OutputTopic::Trajectories | OutputTopic::ValidatedTrajectories,
                    OutputMessage::Candidates(set),
                ) => {
                    assert!(self.judged().is_some(), "a set from a cycle that judged nothing");
                    assert_eq!(set.candidate_trajectories.len(), accepted.len());
                    assert!(set.candidate_trajectories.iter().zip(&accepted).all(|(a, b)| Arc::ptr_eq(a, b)));
                }
                (OutputTopic::ScoredTrajectories, OutputMessage::Scored(scored)) => {
                    let scored = &scored.scored_candidate_trajectories;
                    assert!(scored.iter().all(|scored| is_accepted(&scored.candidate_trajectory)));
                }
                (OutputTopic::Trajectory, OutputMessage::Trajectory(trajectory)) => {
                    let is_it = |candidate: &&Arc<CandidateTrajectory>| {
                        candidate.header == trajectory.header && candidate.points == trajectory.points
                    };
                    assert!(accepted.iter().any(is_it), "driven but not accepted");
                }
                (OutputTopic::ConcatenatedTrajectories, _) => {}
                (
                    _,
                    OutputMessage::Candidates(_) | OutputMessage::Scored(_) | OutputMessage::Trajectory(_),
                ) => {
                    panic!("{} carries trajectories", topic.full_name());
                }
                _ => {}
            }
        }
    }

    /// All of `count` candidates were accepted, one is driven, and nothing is wrong.
    pub fn assert_normal(&self, count: usize, why: &str) {
        assert_eq!(self.validated().map(|set| set.len()), Some(count), "{why}");
        assert!(self.driven().is_some(), "{why}");
        assert_eq!(self.told(), [(DiagnosticStatus::OK, "OK"), (DiagnosticStatus::OK, "OK")], "{why}");
    }
}

/// The number that a test gave to a candidate.
pub fn number_of(points: &[TrajectoryPoint]) -> u32 {
    points[0].longitudinal_velocity_mps as u32
}

/// Candidates of one generator that can be ranked, numbered from 0.
pub fn anchor(stamp: Time, count: u32) -> Arc<CandidateTrajectories> {
    let point = |number: u32, index: i64| TrajectoryPoint {
        time_from_start: Span::from_nanoseconds(index * 100_000_000),
        longitudinal_velocity_mps: number as f32,
        ..TrajectoryPoint::default()
    };
    let candidates = (0..count).map(|number| (1, vec![point(number, 0), point(number, 1)]));
    candidate_set(stamp, [(1, DIFFUSION.to_owned())], candidates)
}

/// A time so many milliseconds after another.
pub fn after(time: Time, milliseconds: i64) -> Time {
    Time::from_nanoseconds(time.nanoseconds() + milliseconds * 1_000_000)
}
