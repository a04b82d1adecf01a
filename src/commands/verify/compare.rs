//! When is a judgement equal to an expected verdict?

use std::fmt;

use selection::filters::crosswalk::{self, SafetyFactor};
use selection::verdict::Failure;
use selection::{Judgement, Metric};
use serde::Serialize;

use crate::golden::{ExpectedFactor, ExpectedMetric, ExpectedVerdict};

/// What is different, the gravest first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// Our filter panicked.
    Panic,
    /// One accepts, the other does not.
    Feasibility,
    /// One judges, the other answers with an error; neither accepts.
    Error,
    /// Other names of metrics, another number or order of them.
    Metrics,
    /// The level of a metric.
    Level,
    /// The value of a metric, beyond its tolerance.
    Value,
    /// Other road users to wait for, or at other places.
    SafetyFactors,
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Panic => "panic",
            Self::Feasibility => "feasibility",
            Self::Error => "error",
            Self::Metrics => "metrics",
            Self::Level => "level",
            Self::Value => "value",
            Self::SafetyFactors => "safety factors",
        })
    }
}

/// Two verdicts beside each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Comparison {
    /// What is different, if anything is.
    pub(super) kind: Option<Kind>,
    pub(super) ours_feasible: bool,
    pub(super) expected_feasible: bool,
    /// Largest absolute difference between two values of a metric.
    pub(super) metric_difference: f64,
}

/// How far two values of a metric may be apart.
enum Tolerance {
    /// By this part of the expected value.
    Relative(f64),
    /// By this much, and all values that stand for "no measurement" are equal.
    AbsoluteOrUnmeasured(f64),
    /// Not at all.
    Exact,
}

/// Values from here on mean that nothing was measured.
const UNMEASURED: f64 = 1e300;

fn tolerance(metric: &str) -> Tolerance {
    match metric {
        "check_speed"
        | "check_acceleration"
        | "check_deceleration"
        | "check_steering_angle"
        | "check_steering_rate" => Tolerance::Relative(1e-6),
        "lat_dist_to_uncrossable_bound" => Tolerance::AbsoluteOrUnmeasured(1e-9),
        _ => Tolerance::Exact,
    }
}

pub(super) fn compare(ours: &Judgement, expected: &ExpectedVerdict) -> Comparison {
    let expected_feasible = matches!(expected, ExpectedVerdict::Judged { feasible: true, .. });
    let mut metric_difference = 0.0;
    let kind = match (&ours.failure, expected) {
        (Some(Failure::Panicked(_)), _) => Some(Kind::Panic),
        _ if ours.feasible != expected_feasible => Some(Kind::Feasibility),
        (Some(Failure::NotAssessed(_)), ExpectedVerdict::Error(_)) => None,
        (Some(_), _) | (None, ExpectedVerdict::Error(_)) => Some(Kind::Error),
        (None, ExpectedVerdict::Judged { metrics, safety_factors, .. }) => {
            let same_names = ours.metrics.len() == metrics.len()
                && ours.metrics.iter().zip(metrics).all(|(ours, expected)| ours.name == expected.name);
            let pairs = || ours.metrics.iter().zip(metrics);
            if !same_names {
                Some(Kind::Metrics)
            } else {
                metric_difference =
                    pairs().map(|(ours, expected)| difference(ours, expected)).fold(0.0, f64::max);
                let levels = pairs().all(|(ours, expected)| ours.risk as u8 == expected.level);
                let values = pairs().all(|(ours, expected)| same_value(ours, expected));
                let factors = same_factors(crosswalk::safety_factors(ours), safety_factors);
                let first = [(levels, Kind::Level), (values, Kind::Value), (factors, Kind::SafetyFactors)];
                first.into_iter().find_map(|(equal, kind)| (!equal).then_some(kind))
            }
        }
    };
    Comparison { kind, ours_feasible: ours.feasible, expected_feasible, metric_difference }
}

fn same_value(ours: &Metric, expected: &ExpectedMetric) -> bool {
    let (a, b) = (ours.value, expected.value);
    let difference = difference(ours, expected);
    match tolerance(ours.name) {
        // Infinity times a tolerance would allow every value.
        Tolerance::Relative(part) if b.is_finite() => difference <= part * b.abs(),
        Tolerance::AbsoluteOrUnmeasured(limit) => difference <= limit,
        Tolerance::Relative(_) | Tolerance::Exact => a == b || (a.is_nan() && b.is_nan()),
    }
}

fn same_factors(ours: &[SafetyFactor], expected: &[ExpectedFactor]) -> bool {
    let of_ours = |factor: &SafetyFactor| ExpectedFactor {
        object_id: factor.object_id,
        x_m: factor.position.x,
        y_m: factor.position.y,
    };
    ours.iter().map(of_ours).eq(expected.iter().cloned())
}

/// Absolute difference; infinite where only one of two is a number or a measurement.
fn difference(ours: &Metric, expected: &ExpectedMetric) -> f64 {
    let (a, b) = (ours.value, expected.value);
    let unmeasured =
        |value: f64| matches!(tolerance(ours.name), Tolerance::AbsoluteOrUnmeasured(_)) && value > UNMEASURED;
    if a == b || (a.is_nan() && b.is_nan()) || (unmeasured(a) && unmeasured(b)) {
        return 0.0;
    }
    let difference = (a - b).abs();
    if difference.is_nan() || unmeasured(a) || unmeasured(b) { f64::INFINITY } else { difference }
}

#[cfg(test)]
mod tests {
    use super::*;
    use messages::unique_identifier_msgs::Uuid;
    use selection::RiskLevel;

    fn ours(feasible: bool, name: &'static str, value: f64, risk: RiskLevel) -> Judgement {
        let metric = Metric { name, value, threshold: f64::NAN, risk };
        Judgement { feasible, ..Judgement::feasible([metric]) }
    }

    fn expected(feasible: bool, name: &str, value: f64, level: u8) -> ExpectedVerdict {
        let metric = ExpectedMetric { name: name.to_owned(), value, level };
        ExpectedVerdict::Judged { feasible, metrics: vec![metric], safety_factors: vec![] }
    }

    fn kind_of_values(name: &'static str, ours_value: f64, expected_value: f64) -> Option<Kind> {
        compare(&ours(true, name, ours_value, RiskLevel::Safe), &expected(true, name, expected_value, 0)).kind
    }

    #[test]
    fn values_have_the_tolerance_of_their_metric() {
        let bound = "lat_dist_to_uncrossable_bound";
        let cases = [
            ("check_speed", 16.700_001, 16.7, None),
            ("check_speed", 16.700_1, 16.7, Some(Kind::Value)),
            ("check_speed", f64::INFINITY, f64::INFINITY, None),
            ("check_speed", 20.0, f64::INFINITY, Some(Kind::Value)),
            ("check_speed", 1e-300, 0.0, Some(Kind::Value)),
            (bound, -0.5, -0.5 + 0.9e-9, None),
            (bound, -0.5, -0.5 + 1.1e-9, Some(Kind::Value)),
            (bound, f64::MAX, f64::INFINITY, None),
            (bound, f64::MAX, 3.0, Some(Kind::Value)),
            (bound, f64::NAN, 3.0, Some(Kind::Value)),
            ("check_crossing_red_light", 0.0, 0.0, None),
            ("check_crossing_red_light", 1e-12, 0.0, Some(Kind::Value)),
        ];
        for (name, a, b, kind) in cases {
            assert_eq!(kind_of_values(name, a, b), kind, "{name} {a} {b}");
        }
    }

    #[test]
    fn the_gravest_difference_is_named() {
        let name = "check_speed";
        let judged = ours(true, name, 1.0, RiskLevel::LowCaution);
        let panic = Judgement::panicked("text".to_owned());
        let not_assessed = Judgement::not_assessed("no route");
        let error = ExpectedVerdict::Error("Route is not available".to_owned());
        let nothing_measured =
            ExpectedVerdict::Judged { feasible: true, metrics: vec![], safety_factors: vec![] };
        let mut with_somebody = expected(true, name, 1.0, 1);
        if let ExpectedVerdict::Judged { safety_factors, .. } = &mut with_somebody {
            safety_factors.push(ExpectedFactor { object_id: Uuid::default(), x_m: 0.0, y_m: 0.0 });
        }
        let cases = [
            (&judged, expected(true, name, 1.0, 1), None),
            (&judged, expected(false, name, 9.0, 2), Some(Kind::Feasibility)),
            (&judged, expected(true, name, 9.0, 2), Some(Kind::Level)),
            (&judged, expected(true, "check_acceleration", 1.0, 1), Some(Kind::Metrics)),
            (&judged, nothing_measured, Some(Kind::Metrics)),
            (&judged, with_somebody, Some(Kind::SafetyFactors)),
            (&judged, error.clone(), Some(Kind::Feasibility)),
            (&ours(false, name, 1.0, RiskLevel::Danger), error.clone(), Some(Kind::Error)),
            (&not_assessed, error.clone(), None),
            (&not_assessed, expected(false, name, 1.0, 1), Some(Kind::Error)),
            (&not_assessed, expected(true, name, 1.0, 1), Some(Kind::Feasibility)),
            (&panic, error, Some(Kind::Panic)),
        ];
        for (judgement, verdict, kind) in cases {
            assert_eq!(compare(judgement, &verdict).kind, kind, "{judgement:?} {verdict:?}");
        }
    }
}
