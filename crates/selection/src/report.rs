//! Puts verdicts into the messages that leave the node.

use crate::candidate::Candidate;
use crate::concatenator::Concatenated;
use crate::data_validity;
use crate::filters::Fill;
use crate::scene::Scene;
use crate::validator::{Enforcement, LoadedFilter, Validator};
use crate::verdict::{Failure, Judgement, Metric, RiskLevel, Verdict};
use messages::autoware_internal_planning_msgs::{CandidateTrajectories, PlanningFactorArray};
use messages::autoware_trajectory_validator::{MetricReport, ValidationReport, ValidationReportArray};
use messages::std_msgs::Header;
use std::borrow::Cow;

/// Name of the metric that every filter adds behind its own: 1 if it found the candidate feasible, else 0.
pub const FEASIBILITY_METRIC: &str = "trajectory_feasibility";

/// Name under which planning factors are told, whatever filter they come from.
pub const PLANNING_MODULE: &str = "trajectory_validator";
/// Frame in which they are told.
const MAP_FRAME: &str = "map";

/// The accepted candidates with their generators, each generator once, in order of first use.
#[must_use]
pub fn validated_set(concatenated: &Concatenated, verdicts: &[Verdict]) -> CandidateTrajectories {
    let mut set = CandidateTrajectories::default();
    let judged = concatenated.candidates.iter().zip(verdicts);
    for (candidate, _) in judged.filter(|(_, verdict)| verdict.accepted) {
        set.candidate_trajectories.push(candidate.message.clone());
        let id = candidate.key.generator;
        if set.generator_info.iter().all(|info| info.generator_id != id) {
            let info = concatenated.generators.iter().find(|info| info.generator_id == id);
            set.generator_info.extend(info.cloned());
        }
    }
    set
}

/// One report for each candidate, rejected ones included, in input order. Shadow filters' metrics are in the list but
/// not in the risk.
#[must_use]
pub fn validation_reports(
    validator: &Validator,
    candidates: &[Candidate],
    verdicts: &[Verdict],
) -> ValidationReportArray {
    let reports = candidates.iter().zip(verdicts).map(|(candidate, verdict)| ValidationReport {
        trajectory_stamp: candidate.message.header.stamp,
        generator_id: candidate.key.generator,
        generator_name: candidate.generator_name.to_string(),
        risk: verdict.risk.into(),
        metrics: metric_reports(validator, verdict),
    });
    ValidationReportArray { reports: reports.collect() }
}

fn metric_reports(validator: &Validator, verdict: &Verdict) -> Vec<MetricReport> {
    let own = |metric: &Metric, name: &'static str, category: &'static str| MetricReport {
        validator_name: Cow::Borrowed(name),
        validator_category: Cow::Borrowed(category),
        metric_name: Cow::Borrowed(metric.name),
        metric_value: metric.value,
        risk: metric.risk.into(),
    };
    let count = verdict.judgements.iter().map(|judgement| judgement.metrics.len() + 1).sum::<usize>();
    let mut reports = Vec::with_capacity(verdict.data_validity.metrics.len() + count);
    if !verdict.is_judged() {
        let risk = verdict.risk;
        let not_judged = Metric { name: NOT_JUDGED, value: 1.0, threshold: f64::NAN, risk };
        reports.push(own(&not_judged, data_validity::NAME, data_validity::CATEGORY));
    }
    let validity = &verdict.data_validity.metrics;
    reports.extend(validity.iter().map(|metric| own(metric, data_validity::NAME, data_validity::CATEGORY)));
    for (loaded, judgement) in validator.filters().iter().zip(&verdict.judgements) {
        let (name, category) = (loaded.name(), loaded.category());
        if !judgement.was_needed() {
            let risk = judgement.risk();
            let not_assessed = Metric { name: NOT_ASSESSED, value: 1.0, threshold: f64::NAN, risk };
            reports.push(own(&not_assessed, name, category));
            continue;
        }
        reports.extend(judgement.metrics.iter().map(|metric| own(metric, name, category)));
        let feasibility = Metric {
            name: FEASIBILITY_METRIC,
            value: f64::from(u8::from(judgement.feasible)),
            threshold: f64::NAN,
            risk: judgement.risk(),
        };
        reports.push(own(&feasibility, name, category));
    }
    reports
}

/// Why planners would have to do something about the candidates: what every filter, shadow filters included, tells about
/// every candidate. A factor without control points is left out; of several control points the first and the last stay.
#[must_use]
pub fn planning_factors(validator: &Validator, scene: &Scene, verdicts: &[Verdict]) -> PlanningFactorArray {
    let judged = verdicts.iter().flat_map(|verdict| judgements_by_filter(validator, verdict));
    let told = judged
        .filter(|(_, judgement)| judgement.was_needed())
        .filter_map(|(loaded, judgement)| loaded.planning_factor(scene, judgement));
    let factors = told.filter(|factor| !factor.control_points.is_empty()).map(|mut factor| {
        factor.module = PLANNING_MODULE.to_owned();
        if let [first, .., last] = factor.control_points[..] {
            factor.control_points = vec![first, last];
        }
        factor
    });
    PlanningFactorArray {
        header: Header { stamp: scene.now, frame_id: MAP_FRAME.to_owned() },
        factors: factors.collect(),
    }
}

/// Name under which a candidate is reported whose turn did not come within the cycle's budget.
pub const NOT_JUDGED: &str = "not_judged";
/// Name under which a filter is reported that was not asked about a candidate, because it was rejected already; also the
/// name of a rejection by a filter that could not judge.
pub const NOT_ASSESSED: &str = "not_assessed";

/// What one filter did in a cycle.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FilterSummary {
    /// Name of the filter.
    pub name: &'static str,
    /// Whether its objection counts.
    pub enforcement: Enforcement,
    /// Candidates that it judged.
    pub judged: usize,
    /// Candidates that it objected to.
    pub rejected: usize,
    /// Times that it panicked: over candidates, and over its memory.
    pub panicked: usize,
    /// Worst risk over its judgements.
    pub worst_risk: RiskLevel,
    /// Why the first candidate that it objected to is not feasible.
    pub first_reason: Option<String>,
    /// How full its memory is after the cycle; `None` if it has none.
    pub fill: Option<Fill>,
}

/// What every filter did in a cycle, the data-validity check first.
#[must_use]
pub fn filter_summaries(validator: &Validator, verdicts: &[Verdict]) -> Vec<FilterSummary> {
    let judged = verdicts.iter().filter(|verdict| verdict.is_judged());
    let validity = judged.map(|verdict| &verdict.data_validity);
    let mut summaries = vec![summary(data_validity::NAME, Enforcement::Enforced, validity)];
    summaries.extend(validator.filters().iter().enumerate().map(|(index, loaded)| {
        let judgements = verdicts.iter().filter_map(|verdict| verdict.judgements.get(index));
        let judgements = judgements.filter(|judgement| judgement.was_needed());
        let mut summary = summary(loaded.name(), loaded.enforcement(), judgements);
        summary.fill = loaded.fill();
        if let Some(panic) = loaded.lost_memory() {
            summary.panicked += 1;
            summary.first_reason.get_or_insert_with(|| format!("panic while remembering: {panic}"));
        }
        summary
    }));
    summaries
}

fn summary<'a>(
    name: &'static str,
    enforcement: Enforcement,
    judgements: impl Iterator<Item = &'a Judgement> + Clone,
) -> FilterSummary {
    let rejections = judgements.clone().filter(|judgement| !judgement.feasible);
    FilterSummary {
        name,
        enforcement,
        judged: judgements.clone().count(),
        rejected: rejections.clone().count(),
        panicked: rejections.clone().filter(|judgement| has_panicked(judgement)).count(),
        worst_risk: RiskLevel::worst(judgements.map(Judgement::risk)),
        first_reason: rejections.clone().next().and_then(Judgement::reason).map(Cow::into_owned),
        fill: None,
    }
}

fn has_panicked(judgement: &Judgement) -> bool {
    matches!(judgement.failure, Some(Failure::Panicked(_)))
}

/// The names under which a rejection is counted: the metrics that are not safe, else how the filter failed.
pub fn rejection_names(judgement: &Judgement) -> impl Iterator<Item = &'static str> {
    let failure = match judgement.failure {
        Some(Failure::NotAssessed(_)) => Some(NOT_ASSESSED),
        Some(Failure::Panicked(_)) => Some("panic"),
        Some(Failure::OutOfTime) => Some(NOT_JUDGED),
        Some(Failure::NotNeeded) | None => None,
    };
    let rejected = !judgement.feasible;
    let metrics = judgement.metrics.iter().filter(move |metric| rejected && metric.risk > RiskLevel::Safe);
    failure.into_iter().chain(metrics.map(|metric| metric.name))
}

/// Pairs of loaded filter and judgement, for callers that count by filter.
pub fn judgements_by_filter<'a>(
    validator: &'a Validator,
    verdict: &'a Verdict,
) -> impl Iterator<Item = (&'a LoadedFilter, &'a Judgement)> {
    validator.filters().iter().zip(&verdict.judgements)
}
