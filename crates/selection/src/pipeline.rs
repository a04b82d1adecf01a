//! The whole step of a cycle: candidates and a scene in, what leaves the node out.
//!
//! Owns validator and ranker, and with them all memory from cycle to cycle but the concatenator's. What it promises:
//! every accepted candidate was judged in this very step; what is selected was accepted in it; a ranker that panics costs
//! the choice and its own memory, not the validated set. How candidates are spread over threads is the caller's business,
//! and so are the clock and what is done with the results.

use crate::adapter::{self, Selected};
use crate::candidate::Candidate;
use crate::concatenator::Concatenated;
use crate::filters::{Fill, Scratch};
use crate::panics::caught;
use crate::parameters::{RankerParameters, ValidatorParameters};
use crate::ranker::{GeneratorSource, Rank, Ranking};
use crate::report::{self, FilterSummary};
use crate::scene::Scene;
use crate::validator::{Stopwatch, Validator};
use crate::verdict::Verdict;
use messages::autoware_internal_planning_msgs::{
    CandidateTrajectories, PlanningFactorArray, ScoredCandidateTrajectories,
};
use messages::autoware_trajectory_validator::ValidationReportArray;

/// Judges all candidates of a scene; gives verdicts in the order of the candidates, and nanoseconds by filter. A
/// candidate whose verdict is not in its place counts as not judged.
pub type JudgeAll<'a> = dyn Fn(&Validator, &Scene, &[Candidate]) -> (Vec<Verdict>, Vec<u64>) + 'a;

/// Validates, ranks and adapts.
#[derive(Debug)]
pub struct Pipeline {
    validator: Validator,
    ranker: Box<dyn Rank>,
}

/// What a step gives.
#[derive(Debug, Clone)]
pub struct Step {
    /// One for each candidate, in order.
    pub verdicts: Vec<Verdict>,
    /// The accepted candidates.
    pub validated: CandidateTrajectories,
    /// What is reported about each candidate.
    pub reports: ValidationReportArray,
    /// Why planners would have to do something about the candidates.
    pub planning_factors: PlanningFactorArray,
    /// What each filter did, the data-validity check first.
    pub filters: Vec<FilterSummary>,
    /// The accepted candidates with their scores, and those that have none.
    pub ranking: Ranking,
    /// The scored candidates.
    pub scored: ScoredCandidateTrajectories,
    /// The trajectory to drive. `None` if there is none that may be driven.
    pub selected: Option<Selected>,
    /// How full the ranker's memory is after the step; `None` if it has none.
    pub ranker_fill: Option<Fill>,
    /// How long it took.
    pub times: StepTimes,
}

/// How long the parts of a step took, on the caller's stopwatch, ns.
#[derive(Debug, Clone, Default)]
pub struct StepTimes {
    /// Before the first candidate.
    pub observe_ns: u64,
    /// From the first candidate to the last, folding included.
    pub judge_ns: u64,
    /// In each loaded filter, over all candidates and threads.
    pub filters_ns: Vec<u64>,
    /// Ranking, remembering included.
    pub rank_ns: u64,
    /// The part of `rank_ns` that remembering took.
    pub remember_ns: u64,
    /// Making the messages of the selected trajectory.
    pub adapt_ns: u64,
}

impl Pipeline {
    /// Joins validator and ranker.
    #[must_use]
    pub fn new(validator: Validator, ranker: impl Rank + 'static) -> Self {
        Self { validator, ranker: Box::new(ranker) }
    }

    /// The filters.
    #[must_use]
    pub fn validator(&self) -> &Validator {
        &self.validator
    }

    /// The parameters of the filters.
    #[must_use]
    pub fn validator_parameters(&self) -> &ValidatorParameters {
        self.validator.parameters()
    }

    /// Hands changed parameters to the filters; to be called between two steps.
    pub fn configure_validator(&mut self, parameters: ValidatorParameters) {
        self.validator.configure(parameters);
    }

    /// Hands changed parameters to the ranker; to be called between two steps.
    pub fn configure_ranker(&mut self, parameters: RankerParameters, sources: Vec<GeneratorSource>) {
        if caught(|| self.ranker.configure(parameters, sources)).is_err() {
            self.ranker.forget();
        }
    }

    /// One step. `scene` has all mandatory inputs.
    pub fn step(
        &mut self,
        scene: &Scene,
        concatenated: &Concatenated,
        judge_all: &JudgeAll<'_>,
        stopwatch: Stopwatch,
    ) -> Step {
        let candidates = &concatenated.candidates[..];
        let started = stopwatch();
        self.validator.announce(candidates);
        self.validator.observe(scene);
        let observed = stopwatch();
        let (verdicts, filters_ns) = judge_all(&self.validator, scene, candidates);
        let verdicts = in_their_places(candidates, verdicts);
        self.validator.remember(candidates, &verdicts);
        let judged = stopwatch();
        let (ranking, ranked) = self.rank(scene, candidates, &verdicts, stopwatch);
        let remembered = stopwatch();
        let selected = adapter::select(candidates, &verdicts, &ranking);
        let adapted = stopwatch();
        Step {
            validated: report::validated_set(concatenated, &verdicts),
            reports: report::validation_reports(&self.validator, candidates, &verdicts),
            planning_factors: report::planning_factors(&self.validator, scene, &verdicts),
            filters: report::filter_summaries(&self.validator, &verdicts),
            scored: ranking.to_message(candidates, &verdicts, &concatenated.generators),
            ranking,
            selected,
            verdicts,
            ranker_fill: caught(|| self.ranker.fill()).ok().flatten(),
            times: StepTimes {
                observe_ns: observed.saturating_sub(started),
                judge_ns: judged.saturating_sub(observed),
                filters_ns,
                rank_ns: remembered.saturating_sub(judged),
                remember_ns: remembered.saturating_sub(ranked),
                adapt_ns: adapted.saturating_sub(remembered),
            },
        }
    }

    /// Ranks and remembers; gives the time between the two. Should the ranker panic, nothing is ranked in this step, and
    /// its memory starts anew.
    fn rank(
        &mut self,
        scene: &Scene,
        candidates: &[Candidate],
        verdicts: &[Verdict],
        stopwatch: Stopwatch,
    ) -> (Ranking, u64) {
        let ranked = caught(|| {
            let ranking = self.ranker.rank(scene, candidates, verdicts);
            let ranked = stopwatch();
            self.ranker.remember(scene, candidates, &ranking);
            (ranking, ranked)
        });
        ranked.unwrap_or_else(|panic| {
            self.ranker.forget();
            (Ranking::failed(panic), stopwatch())
        })
    }
}

/// One verdict for each candidate, in order; where there is none or another's, the candidate was not judged.
fn in_their_places(candidates: &[Candidate], mut verdicts: Vec<Verdict>) -> Vec<Verdict> {
    verdicts.truncate(candidates.len());
    for (verdict, candidate) in verdicts.iter_mut().zip(candidates) {
        if verdict.key != candidate.key {
            *verdict = Verdict::out_of_time(candidate.key);
        }
    }
    let missing = candidates[verdicts.len()..].iter();
    verdicts.extend(missing.map(|candidate| Verdict::out_of_time(candidate.key)));
    verdicts
}

/// Judges candidates one after the other, for a [`JudgeAll`] on one thread or a thread's share of one.
pub fn judge_in_order(
    validator: &Validator,
    scene: &Scene,
    candidates: &[Candidate],
    scratch: &mut Scratch,
    stopwatch: Stopwatch,
) -> (Vec<Verdict>, Vec<u64>) {
    let mut times_ns = vec![0; validator.filters().len()];
    let mut judge = |candidate| validator.judge(scene, candidate, scratch, stopwatch, &mut times_ns);
    let verdicts = candidates.iter().map(&mut judge).collect();
    (verdicts, times_ns)
}

#[cfg(test)]
mod tests;
