//! What is said about a candidate: metrics with their risk, the judgement of one filter, the verdict of all.

use crate::candidate::{Candidate, CandidateKey};
use crate::filters::boundary_departure::Hysteresis;
use crate::filters::traffic_light::TrafficLightMemo;
use messages::autoware_trajectory_validator as wire;
use messages::unique_identifier_msgs::Uuid;
use smallvec::SmallVec;
use std::borrow::Cow;
use std::fmt;

/// How bad a finding is. Ordered: later is worse.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub enum RiskLevel {
    /// Nothing found.
    #[default]
    Safe,
    /// Worth a note.
    LowCaution,
    /// Beyond a limit.
    HighCaution,
    /// Must not be driven.
    Danger,
    /// The check itself failed.
    Fatal,
}

impl RiskLevel {
    /// Stable snake_case name, as it appears in reports and in the ranker's parameters.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Safe => "safe",
            Self::LowCaution => "low_caution",
            Self::HighCaution => "high_caution",
            Self::Danger => "danger",
            Self::Fatal => "fatal",
        }
    }

    /// The worst of several; safe if there are none.
    pub fn worst(levels: impl IntoIterator<Item = Self>) -> Self {
        levels.into_iter().max().unwrap_or_default()
    }
}

impl fmt::Display for RiskLevel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl From<RiskLevel> for wire::RiskLevel {
    fn from(risk: RiskLevel) -> Self {
        let level = match risk {
            RiskLevel::Safe => Self::SAFE,
            RiskLevel::LowCaution => Self::LOW_CAUTION,
            RiskLevel::HighCaution => Self::HIGH_CAUTION,
            RiskLevel::Danger => Self::DANGER,
            RiskLevel::Fatal => Self::FATAL,
        };
        Self { level }
    }
}

/// One measurement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Metric {
    /// Stable name, for example `check_speed`.
    pub name: &'static str,
    /// Measured value; its unit is the metric's.
    pub value: f64,
    /// The limit that `value` is held against, same unit; NaN where there is none.
    pub threshold: f64,
    /// How bad the value is.
    pub risk: RiskLevel,
}

/// Where and when on the candidate the first violation is, and what it is a violation against.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Evidence {
    /// Index of the point.
    pub index: usize,
    /// Time from the start of the candidate, s.
    pub time_s: f64,
    /// Place in the map frame, m.
    pub x_m: f64,
    /// Place in the map frame, m.
    pub y_m: f64,
    /// Map element involved: a stop line, a border, a crosswalk.
    pub element_id: Option<i64>,
    /// Regulatory element that gives the map element its meaning, for example the traffic light of a stop line.
    pub regulatory_element_id: Option<i64>,
    /// Road user involved.
    pub object_id: Option<Uuid>,
}

impl Evidence {
    /// The point of a candidate with this index; nothing else is involved.
    #[must_use]
    pub fn at(candidate: &Candidate, index: usize) -> Self {
        let point = &candidate.points[index];
        Self {
            index,
            time_s: point.time_from_start.seconds(),
            x_m: point.pose.position.x,
            y_m: point.pose.position.y,
            element_id: None,
            regulatory_element_id: None,
            object_id: None,
        }
    }
}

/// Why a filter could not say anything about a candidate. Such a candidate is not feasible.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Failure {
    /// An input that the filter needs is missing, or its content makes the question meaningless.
    NotAssessed(Cow<'static, str>),
    /// The filter panicked; the text is the panic's.
    Panicked(String),
    /// The cycle's budget was used up before the candidate's turn came; no filter saw it.
    OutOfTime,
    /// An enforced filter had rejected the candidate already, and the settings ask for no more than that.
    NotNeeded,
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotAssessed(why) => f.write_str(why),
            Self::Panicked(what) => write!(f, "panic: {what}"),
            Self::NotNeeded => {
                f.write_str("not assessed: an enforced filter had rejected the candidate already")
            }
            Self::OutOfTime => f.write_str("not judged: the budget of the cycle was used up"),
        }
    }
}

/// What judging a candidate leaves behind for the filter's memory of that candidate. One variant for each filter that
/// has such memory; kept inline, so that judging allocates nothing.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum Memo {
    /// Nothing to remember.
    #[default]
    Nothing,
    /// Of the crosswalk filter.
    Crosswalk(crate::filters::crosswalk::CrosswalkMemo),
    /// Lights that the candidate violates or stops for.
    TrafficLight(TrafficLightMemo),
    /// Hysteresis of the uncrossable boundary departure filter after this cycle.
    BoundaryDeparture(Hysteresis),
    /// What the collision check found beyond its metrics. Nothing is folded; it explains the judgement.
    CollisionCheck(crate::filters::collision_check::CollisionMemo),
    /// Where the out-of-lane check found the candidate to begin. Nothing is folded; it explains the judgement.
    OutOfLane(crate::filters::out_of_lane::OutOfLaneMemo),
}

/// What one filter says about one candidate.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Judgement {
    /// True if the filter has nothing against the candidate.
    pub feasible: bool,
    /// Why the filter could not judge; then there are no metrics.
    pub failure: Option<Failure>,
    /// Measurements in a fixed order.
    pub metrics: SmallVec<[Metric; 6]>,
    /// First violation, if there is one with a place.
    pub evidence: Option<Evidence>,
    /// What the filter shall fold into its memory after all candidates are judged.
    pub memo: Memo,
}

impl Judgement {
    /// Feasible, with these measurements.
    #[must_use]
    pub fn feasible(metrics: impl IntoIterator<Item = Metric>) -> Self {
        Self { feasible: true, metrics: metrics.into_iter().collect(), ..Self::default() }
    }

    /// The filter cannot judge without an input that is missing.
    #[must_use]
    pub fn not_assessed(why: impl Into<Cow<'static, str>>) -> Self {
        Self { failure: Some(Failure::NotAssessed(why.into())), ..Self::default() }
    }

    /// The filter panicked on this candidate.
    #[must_use]
    pub fn panicked(what: String) -> Self {
        Self { failure: Some(Failure::Panicked(what)), ..Self::default() }
    }

    /// The filter was not asked: the candidate is rejected already.
    #[must_use]
    pub fn not_needed() -> Self {
        Self { failure: Some(Failure::NotNeeded), ..Self::default() }
    }

    /// Whether the filter looked at the candidate, or should have.
    #[must_use]
    pub fn was_needed(&self) -> bool {
        self.failure != Some(Failure::NotNeeded)
    }

    /// Worst risk of the measurements; DANGER where the filter could not judge, FATAL where it panicked.
    #[must_use]
    pub fn risk(&self) -> RiskLevel {
        match self.failure {
            Some(Failure::NotAssessed(_) | Failure::OutOfTime | Failure::NotNeeded) => RiskLevel::Danger,
            Some(Failure::Panicked(_)) => RiskLevel::Fatal,
            None => RiskLevel::worst(self.metrics.iter().map(|metric| metric.risk)),
        }
    }

    /// Why the candidate is not feasible, in the words that the node logs.
    #[must_use]
    pub fn reason(&self) -> Option<Cow<'_, str>> {
        match &self.failure {
            Some(Failure::NotAssessed(why)) => Some(Cow::Borrowed(why)),
            Some(failure @ (Failure::Panicked(_) | Failure::OutOfTime | Failure::NotNeeded)) => {
                Some(Cow::Owned(failure.to_string()))
            }
            None if self.feasible => None,
            None => Some(Cow::Borrowed("Found failed metrics")),
        }
    }
}

/// The first metric beyond its limit and the place of the violation, in words. `None` if the candidate is feasible.
#[must_use]
pub fn explain(judgement: &Judgement) -> Option<String> {
    if judgement.feasible {
        return None;
    }
    let worst = judgement.metrics.iter().filter(|metric| metric.risk > RiskLevel::Safe);
    let metric = worst.reduce(|worst, metric| if metric.risk > worst.risk { metric } else { worst });
    let what = match (&judgement.failure, metric) {
        (Some(failure), _) => failure.to_string(),
        (None, Some(metric)) if metric.threshold.is_nan() => {
            format!("{} is {:.3}", metric.name, metric.value)
        }
        (None, Some(metric)) => {
            format!("{} is {:.3}, the limit is {:.3}", metric.name, metric.value, metric.threshold)
        }
        (None, None) => "no reason given".to_owned(),
    };
    Some(match judgement.evidence {
        Some(at) => {
            format!(
                "{what}; first at point {} after {:.1} s, ({:.1}, {:.1})",
                at.index, at.time_s, at.x_m, at.y_m
            )
        }
        None => what,
    })
}

/// What all filters together say about one candidate.
#[derive(Debug, Clone, PartialEq)]
pub struct Verdict {
    /// The candidate.
    pub key: CandidateKey,
    /// True if it may be published: its data is valid and no enforced filter objects.
    pub accepted: bool,
    /// True if no filter objects, shadow filters included.
    pub feasible: bool,
    /// Worst risk over the data-validity check and the enforced filters.
    pub risk: RiskLevel,
    /// The data-validity check.
    pub data_validity: Judgement,
    /// One judgement for each loaded filter in order of evaluation; empty if the data is not valid.
    pub judgements: SmallVec<[Judgement; 6]>,
}

impl Verdict {
    /// The candidate's turn did not come within the cycle's budget: it is not published.
    #[must_use]
    pub fn out_of_time(key: CandidateKey) -> Self {
        let data_validity = Judgement { failure: Some(Failure::OutOfTime), ..Judgement::default() };
        let (accepted, feasible, risk) = (false, false, data_validity.risk());
        Self { key, accepted, feasible, risk, data_validity, judgements: SmallVec::new() }
    }

    /// Whether anybody looked at the candidate.
    #[must_use]
    pub fn is_judged(&self) -> bool {
        self.data_validity.failure != Some(Failure::OutOfTime)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_candidate_whose_turn_did_not_come_is_neither_judged_nor_accepted() {
        let verdict = Verdict::out_of_time(CandidateKey { generator: Uuid::default(), sample: 3 });
        assert!(!verdict.accepted && !verdict.feasible && !verdict.is_judged());
        assert_eq!(verdict.risk, RiskLevel::Danger);
    }

    fn metric(risk: RiskLevel) -> Metric {
        Metric { name: "m", value: 0.0, threshold: f64::NAN, risk }
    }

    #[test]
    fn worst_risk_is_the_largest_and_safe_without_any() {
        use RiskLevel::*;
        assert_eq!(RiskLevel::worst([]), Safe);
        assert_eq!(RiskLevel::worst([Safe, HighCaution, LowCaution]), HighCaution);
        assert_eq!(RiskLevel::worst([Fatal, Danger]), Fatal);
    }

    #[test]
    fn a_failure_outranks_the_metrics() {
        assert_eq!(Judgement::feasible([metric(RiskLevel::LowCaution)]).risk(), RiskLevel::LowCaution);
        assert_eq!(Judgement::not_assessed("no route").risk(), RiskLevel::Danger);
        assert_eq!(Judgement::panicked("index out of bounds".to_owned()).risk(), RiskLevel::Fatal);
    }

    #[test]
    fn reasons_are_those_that_upstream_logs() {
        let mut judgement = Judgement::feasible([metric(RiskLevel::Danger)]);
        assert_eq!(judgement.reason(), None);
        judgement.feasible = false;
        assert_eq!(judgement.reason().unwrap(), "Found failed metrics");
        assert_eq!(Judgement::not_assessed("no map").reason().unwrap(), "no map");
    }
}
