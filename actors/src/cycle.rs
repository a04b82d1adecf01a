//! A cycle is one value in and one value out.

use messages::autoware_internal_planning_msgs::{
    CandidateTrajectories, PlanningFactorArray, ScoredCandidateTrajectories,
};
use messages::autoware_trajectory_validator::ValidationReportArray;
use selection::adapter::Selected;
use selection::filters::Fill;
use selection::pipeline::Step;
use selection::report::FilterSummary;
use selection::{Concatenated, MissingInput, Ranking, Scene, Verdict};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// What started a cycle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Trigger {
    /// A message with generative candidates arrived.
    Anchor,
    /// No anchor arrived for the fallback period.
    Timer,
}

impl Trigger {
    /// Stable name for reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Anchor => "anchor",
            Self::Timer => "timer",
        }
    }
}

/// Everything that a cycle works on.
#[derive(Debug, Clone)]
pub struct Cycle {
    /// From 1.
    pub number: u64,
    /// What started it.
    pub trigger: Trigger,
    /// When the trigger arrived, or should have: latencies count from then.
    pub arrived: Instant,
    /// From then until its owner took it up; zero for the timer.
    pub receive: Duration,
    /// Time spent on adding the candidates that it brought; zero for the timer.
    pub buffer: Duration,
    /// When the cycle began; it waits where another one runs.
    pub started: Instant,
    /// From then on no further candidate is judged. `None`: the cycle takes the time that it takes.
    pub deadline: Option<Instant>,
    /// Time spent on collecting candidates and scene.
    pub snapshot: Duration,
    /// The world.
    pub scene: Arc<Scene>,
    /// The fresh candidates.
    pub concatenated: Concatenated,
}

/// How a cycle ended.
#[derive(Debug, Clone)]
pub enum Outcome {
    /// There was no candidate; nothing is published.
    NoCandidates,
    /// A mandatory input is missing; no validated set is published.
    MissingInput(MissingInput),
    /// The validation itself broke down outside of any filter; no validated set is published.
    Failed(String),
    /// Every candidate was judged.
    Judged(Box<Judged>),
}

impl Outcome {
    /// Why nothing was judged, as a stable name; `None` if everything was.
    #[must_use]
    pub fn early_return(&self) -> Option<&'static str> {
        match self {
            Self::NoCandidates => Some("no_candidates"),
            Self::MissingInput(input) => Some(input.name()),
            Self::Failed(_) => Some("validation_failed"),
            Self::Judged(_) => None,
        }
    }
}

impl Cycle {
    /// Time between taking up the trigger and the beginning of the cycle.
    #[must_use]
    pub fn wait(&self) -> Duration {
        self.started.saturating_duration_since(self.arrived + self.receive + self.buffer)
    }
}

/// What one thread did of a cycle's judging.
#[derive(Debug, Clone)]
pub struct Share {
    /// When the thread came to it.
    pub began: Instant,
    /// When it found nothing more to judge.
    pub ended: Instant,
    /// Candidates that it judged.
    pub candidates: usize,
    /// Time spent in each loaded filter; names as in [`Judged::filters`] without the first.
    pub filter_times: Vec<Duration>,
    /// Heap allocations while it judged; 0 where nobody counts them.
    pub allocations: u64,
}

/// The verdicts of a cycle and the messages made from them.
#[derive(Debug, Clone)]
pub struct Judged {
    /// One for each candidate, in order.
    pub verdicts: Vec<Verdict>,
    /// The accepted candidates.
    pub validated: Arc<CandidateTrajectories>,
    /// What is reported about each candidate.
    pub reports: Arc<ValidationReportArray>,
    /// Why planners would have to do something about the candidates.
    pub planning_factors: Arc<PlanningFactorArray>,
    /// What each filter did, the data-validity check first.
    pub filters: Vec<FilterSummary>,
    /// The accepted candidates with their scores, and those that have none.
    pub ranking: Ranking,
    /// The scored candidates.
    pub scored: Arc<ScoredCandidateTrajectories>,
    /// The trajectory to drive. `None` if there is none that may be driven.
    pub selected: Option<Selected>,
    /// How full the ranker's memory is after the cycle; `None` if it has none.
    pub ranker_fill: Option<Fill>,
    /// Time spent in each loaded filter, over all candidates and threads; names as in `filters` without the first.
    pub filter_times: Vec<Duration>,
    /// What each thread did; one where the cycle was judged on the thread of all actors.
    pub shares: Vec<Share>,
    /// When work on the candidates began.
    pub began: Instant,
    /// Time spent before the first candidate.
    pub observe: Duration,
    /// Time from the first candidate to the last, folding included.
    pub judge: Duration,
    /// Time spent on ranking, remembering included.
    pub rank: Duration,
    /// The part of `rank` that remembering took.
    pub remember: Duration,
    /// Time spent on the messages of the selected trajectory.
    pub adapt: Duration,
    /// Time spent on the messages made from the verdicts.
    pub report: Duration,
}

impl Judged {
    /// Candidates whose turn did not come within the cycle's budget.
    #[must_use]
    pub fn not_judged(&self) -> usize {
        self.verdicts.iter().filter(|verdict| !verdict.is_judged()).count()
    }

    /// A step that began at `began` and has just ended, with what each thread did of it.
    pub(crate) fn new(step: Step, began: Instant, shares: Vec<Share>) -> Self {
        let times = step.times;
        let timed_ns = times.observe_ns + times.judge_ns + times.rank_ns + times.adapt_ns;
        let report = began.elapsed().saturating_sub(Duration::from_nanos(timed_ns));
        Self {
            verdicts: step.verdicts,
            validated: Arc::new(step.validated),
            reports: Arc::new(step.reports),
            planning_factors: Arc::new(step.planning_factors),
            filters: step.filters,
            ranking: step.ranking,
            scored: Arc::new(step.scored),
            selected: step.selected,
            ranker_fill: step.ranker_fill,
            shares,
            began,
            report,
            filter_times: times.filters_ns.into_iter().map(Duration::from_nanos).collect(),
            observe: Duration::from_nanos(times.observe_ns),
            judge: Duration::from_nanos(times.judge_ns),
            rank: Duration::from_nanos(times.rank_ns),
            remember: Duration::from_nanos(times.remember_ns),
            adapt: Duration::from_nanos(times.adapt_ns),
        }
    }
}

/// A cycle that came to its end.
#[derive(Debug, Clone)]
pub struct CycleReport {
    /// What went in.
    pub cycle: Cycle,
    /// What came out.
    pub outcome: Outcome,
}

/// How long the stages around the judging took.
#[derive(Debug, Clone, Copy)]
pub struct CycleTimes {
    /// From handing the report to the publisher to the last output handed over.
    pub publish: Duration,
    /// From the arrival of the trigger to the last output handed over.
    pub cycle: Duration,
}
