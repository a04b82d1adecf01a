//! Puts the accepted candidates of a cycle in order and says which one is best.
//!
//! Owns the table of generators that may be ranked and the memory of what was chosen before. What it promises: only
//! candidates that were accepted in this cycle are ranked; the score is computed in 64 bits and compared in the 32 bits
//! in which it is published, and of equal scores the first candidate wins; a candidate that cannot be ranked is
//! reported with the reason; memory is bounded. Source of the rules: Autoware's `autoware_trajectory_ranker` as it is
//! part of the trajectory selector. The parts of a score:
//!
//! * *safety*: the worst risk that the enforced filters found on **this** candidate,
//! * *source*: what kind of planner made it, by the beginning of the generator's name,
//! * *quality*: six metrics held against those of the other candidates; off unless `evaluation.enable` is set.

pub mod history;
pub mod metrics;
pub mod preferred_lanes;
pub mod quality;
pub mod sampling;
mod source;

pub use source::{GeneratorSource, source_of};

use crate::candidate::{Candidate, pose_of};
use crate::filters::Fill;
use crate::parameters::{RankerParameters, RiskName, SourceName};
use crate::scene::Scene;
use crate::verdict::{RiskLevel, Verdict};
use history::{Chosen, History};
use messages::autoware_internal_planning_msgs::{
    GeneratorInfo, ScoredCandidateTrajectories, ScoredCandidateTrajectory,
};
use metrics::Surroundings;
use preferred_lanes::PreferredLanes;
use std::fmt;

/// A smaller sum of scales counts as none: all scores are 0.
const MIN_TOTAL_SCALE: f64 = 1e-6;

/// The parts of a score before they are weighted; 0 is best.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Penalties {
    /// For the risk.
    pub safety: f64,
    /// For the generator.
    pub source: f64,
    /// For poor quality.
    pub quality: f64,
}

/// A candidate with its score.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ranked {
    /// Which of the cycle's candidates it is.
    pub index: usize,
    /// What kind of planner made it.
    pub source: SourceName,
    /// Why the score is what it is.
    pub penalties: Penalties,
    /// Larger is better; 1 without any penalty. Below 0 with penalties above 1.
    pub score: f32,
}

/// Why an accepted candidate has no score and cannot be chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Unrankable {
    /// Nothing in the table of generators fits the name of its generator.
    UnknownGenerator,
    /// What fits the name in the table does not say what kind of planner it is.
    GeneratorWithoutSource,
    /// The score is no number, because a parameter is none.
    ScoreIsNoNumber,
}

impl Unrankable {
    /// Stable snake_case name for reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::UnknownGenerator => "unknown_generator",
            Self::GeneratorWithoutSource => "generator_without_source",
            Self::ScoreIsNoNumber => "score_is_no_number",
        }
    }
}

impl fmt::Display for Unrankable {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::UnknownGenerator => "no entry of generator_name_prefixes fits the name of its generator",
            Self::GeneratorWithoutSource => {
                "the entry of generator_name_prefixes that fits the name of its generator has no source"
            }
            Self::ScoreIsNoNumber => "its score is no number; look at the penalties and scales of the ranker",
        })
    }
}

/// The accepted candidates of a cycle in input order, with their scores.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Ranking {
    /// Those with a score.
    pub ranked: Vec<Ranked>,
    /// Those without: which of the cycle's candidates, and why.
    pub unranked: Vec<(usize, Unrankable)>,
    /// Place of the best one in `ranked`.
    best: Option<usize>,
    /// What kind of planner made the last chosen trajectory before this cycle.
    pub previous_source: Option<SourceName>,
    /// Why nothing is ranked although something was accepted: the text of a panic of the ranker.
    pub failure: Option<String>,
}

impl Ranking {
    /// The best one: the first of those with the highest score. `None` if nothing is ranked.
    #[must_use]
    pub fn best(&self) -> Option<&Ranked> {
        self.ranked.get(self.best?)
    }

    /// The ranker broke down: nothing is ranked.
    #[must_use]
    pub fn failed(panic: String) -> Self {
        Self { failure: Some(panic), ..Self::default() }
    }

    /// The message: scored candidates in input order with their generators, each once, in order of first use.
    /// `candidates` are those that were ranked, with one verdict each; as at the last gate, what was not accepted is
    /// left out whatever the ranking says.
    #[must_use]
    pub fn to_message(
        &self,
        candidates: &[Candidate],
        verdicts: &[Verdict],
        generators: &[GeneratorInfo],
    ) -> ScoredCandidateTrajectories {
        let mut message = ScoredCandidateTrajectories::default();
        for ranked in &self.ranked {
            let Some(candidate) = accepted_at(ranked.index, candidates, verdicts) else { continue };
            message.scored_candidate_trajectories.push(ScoredCandidateTrajectory {
                candidate_trajectory: candidate.message.clone(),
                score: ranked.score,
            });
            let id = candidate.key.generator;
            if message.generator_info.iter().all(|info| info.generator_id != id) {
                let info = generators.iter().find(|info| info.generator_id == id);
                message.generator_info.extend(info.cloned());
            }
        }
        message
    }
}

/// The candidate at this place, if it was accepted. Keys are compared, so that a defect in the order of verdicts lets
/// nothing through.
pub(crate) fn accepted_at<'a>(
    index: usize,
    candidates: &'a [Candidate],
    verdicts: &[Verdict],
) -> Option<&'a Candidate> {
    let (candidate, verdict) = (candidates.get(index)?, verdicts.get(index)?);
    (verdict.accepted && verdict.key == candidate.key).then_some(candidate)
}

/// Puts the accepted candidates of a cycle in order, and remembers what it chose. [`Ranker`] does; whatever stands in
/// for it or around it, the gates behind it hold.
pub trait Rank: Send + fmt::Debug {
    /// See [`Ranker::configure`].
    fn configure(&mut self, parameters: RankerParameters, sources: Vec<GeneratorSource>);

    /// See [`Ranker::rank`].
    fn rank(&mut self, scene: &Scene, candidates: &[Candidate], verdicts: &[Verdict]) -> Ranking;

    /// See [`Ranker::remember`].
    fn remember(&mut self, scene: &Scene, candidates: &[Candidate], ranking: &Ranking);

    /// See [`Ranker::forget`].
    fn forget(&mut self);

    /// How full its memory of chosen trajectories is; `None` if it has none.
    fn fill(&self) -> Option<Fill> {
        None
    }
}

impl Rank for Ranker {
    fn configure(&mut self, parameters: RankerParameters, sources: Vec<GeneratorSource>) {
        self.configure(parameters, sources);
    }

    fn rank(&mut self, scene: &Scene, candidates: &[Candidate], verdicts: &[Verdict]) -> Ranking {
        self.rank(scene, candidates, verdicts)
    }

    fn remember(&mut self, scene: &Scene, candidates: &[Candidate], ranking: &Ranking) {
        self.remember(scene, candidates, ranking);
    }

    fn forget(&mut self) {
        self.forget();
    }

    fn fill(&self) -> Option<Fill> {
        Some(Fill { entries: self.history.len(), bound: self.history_size() })
    }
}

/// The ranker with its memory.
#[derive(Debug)]
pub struct Ranker {
    parameters: RankerParameters,
    sources: Vec<GeneratorSource>,
    history: History,
    last_source: Option<SourceName>,
    /// Lanelets that the route prefers, with the epochs of the map and the route they are from.
    lanes: Option<((u64, u64), PreferredLanes)>,
}

impl Ranker {
    /// A ranker that has chosen nothing yet.
    #[must_use]
    pub fn new(parameters: RankerParameters, sources: Vec<GeneratorSource>) -> Self {
        Self { parameters, sources, history: History::default(), last_source: None, lanes: None }
    }

    /// Takes changed parameters; to be called between two cycles. What was chosen before stays remembered.
    pub fn configure(&mut self, parameters: RankerParameters, sources: Vec<GeneratorSource>) {
        self.parameters = parameters;
        self.sources = sources;
    }

    /// Ranks the accepted candidates of a cycle. `verdicts` has one verdict for each candidate, in the same order.
    #[must_use]
    pub fn rank(&mut self, scene: &Scene, candidates: &[Candidate], verdicts: &[Verdict]) -> Ranking {
        let mut ranking = Ranking { previous_source: self.last_source, ..Ranking::default() };
        for (index, verdict) in verdicts.iter().enumerate() {
            let Some(candidate) = accepted_at(index, candidates, verdicts) else { continue };
            match source_of(&self.sources, &candidate.generator_name) {
                Ok(source) => {
                    let penalties = self.penalties(verdict.risk, source);
                    ranking.ranked.push(Ranked { index, source, penalties, score: 0.0 });
                }
                Err(why) => ranking.unranked.push((index, why)),
            }
        }
        self.add_quality(scene, candidates, &mut ranking.ranked);
        for ranked in &mut ranking.ranked {
            ranked.score = self.score(ranked.penalties);
        }
        let Ranking { ranked, unranked, .. } = &mut ranking;
        ranked.retain(|ranked| {
            let is_number = ranked.score.is_finite();
            if !is_number {
                unranked.push((ranked.index, Unrankable::ScoreIsNoNumber));
            }
            is_number
        });
        unranked.sort_unstable();
        ranking.best = first_maximum(&ranking.ranked);
        ranking
    }

    fn penalties(&self, risk: RiskLevel, source: SourceName) -> Penalties {
        let RankerParameters { safety, source: sources, .. } = &self.parameters;
        Penalties {
            safety: if safety.enable { safety.penalty_of(RiskName::from(risk)) } else { 0.0 },
            source: if sources.enable { sources.penalty_of(source) } else { 0.0 },
            quality: 0.0,
        }
    }

    /// Adds the quality penalties, if they count and there is a route to measure quality by.
    fn add_quality(&mut self, scene: &Scene, candidates: &[Candidate], ranked: &mut [Ranked]) {
        let parameters = &self.parameters.evaluation;
        let (Some(map), Some(route), Some(odometry)) = (&scene.map, &scene.route, &scene.odometry) else {
            return;
        };
        if !parameters.enable {
            return;
        }
        let epochs = (map.number, route.number);
        if self.lanes.as_ref().is_none_or(|(known, _)| *known != epochs) {
            self.lanes = Some((epochs, PreferredLanes::along(&map.value.map, &route.value)));
        }
        let Some((_, lanes)) = &self.lanes else { return };
        self.history.forget_old(scene.now);
        let surroundings = Surroundings {
            ego: &pose_of(&odometry.pose.pose),
            wheel_base_m: scene.vehicle.wheel_base_m(),
            lanes,
            history: &self.history,
            parameters,
        };
        let contenders: Vec<&Candidate> = ranked.iter().map(|ranked| &candidates[ranked.index]).collect();
        for (ranked, penalty) in ranked.iter_mut().zip(quality::quality_penalties(surroundings, &contenders))
        {
            ranked.penalties.quality = penalty;
        }
    }

    /// The scale of a term counts in the denominator whether or not the term does, and nothing is clamped.
    fn score(&self, penalties: Penalties) -> f32 {
        let RankerParameters { safety, source, evaluation } = &self.parameters;
        let total = safety.scale + source.scale + evaluation.scale;
        if total < MIN_TOTAL_SCALE {
            return 0.0;
        }
        let cost = safety.scale * penalties.safety
            + source.scale * penalties.source
            + evaluation.scale * penalties.quality;
        (1.0 - cost / total) as f32
    }

    /// Once per cycle, after ranking: remembers the best candidate, whether or not quality counts, so that it can be
    /// switched on at any time. `candidates` are those that were ranked.
    pub fn remember(&mut self, scene: &Scene, candidates: &[Candidate], ranking: &Ranking) {
        let Some(best) = ranking.best() else {
            self.history.nothing_chosen(scene.now);
            return;
        };
        self.last_source = Some(best.source);
        let candidate = &candidates[best.index];
        let size = self.history_size();
        let ego = scene.odometry.as_ref().map(|odometry| pose_of(&odometry.pose.pose));
        let chosen = Chosen {
            at: scene.now,
            stamp: candidate.message.header.stamp,
            points: candidate.points.clone(),
            ego: ego.unwrap_or_default(),
        };
        self.history.push(chosen, size);
    }

    /// Most trajectories that it remembers.
    fn history_size(&self) -> usize {
        usize::try_from(self.parameters.evaluation.trajectory_history_size).unwrap_or(1).max(1)
    }

    /// Forgets what was chosen; called after a panic, whatever it left half done. Parameters stay.
    pub fn forget(&mut self) {
        self.history = History::default();
        self.last_source = None;
        self.lanes = None;
    }

    /// What was chosen before.
    #[must_use]
    pub fn history(&self) -> &History {
        &self.history
    }
}

impl From<RiskLevel> for RiskName {
    fn from(risk: RiskLevel) -> Self {
        match risk {
            RiskLevel::Safe => Self::Safe,
            RiskLevel::LowCaution => Self::LowCaution,
            RiskLevel::HighCaution => Self::HighCaution,
            RiskLevel::Danger => Self::Danger,
            RiskLevel::Fatal => Self::Fatal,
        }
    }
}

fn first_maximum(ranked: &[Ranked]) -> Option<usize> {
    let places = (0..ranked.len()).rev();
    // Backwards, because the last of equal maxima wins here.
    places.max_by(|&a, &b| ranked[a].score.total_cmp(&ranked[b].score))
}

#[cfg(test)]
mod tests;
