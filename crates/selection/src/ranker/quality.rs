//! The quality penalty: six metrics of every candidate, each held against the same metric of the other candidates.
//!
//! Upstream normalises every compressed metric against itself, so that every candidate gets the same quality and the
//! term decides nothing. Here the best candidate of a cycle gets 1 for a metric, the worst 0.

use super::metrics::{Measured, Surroundings};
use crate::candidate::Candidate;
use crate::parameters::{EvaluationParameters, QualityMetric};

/// Values of a metric that differ by less are equal.
const SMALLEST_RANGE: f64 = 1e-6;

/// The quality penalty of every candidate, from 0 (best in everything) to 1 (worst in everything), in order.
///
/// A metric that cannot be measured on a candidate counts as the worst. Without a metric of positive weight nothing is
/// penalised.
#[must_use]
pub fn quality_penalties(surroundings: Surroundings<'_>, candidates: &[&Candidate]) -> Vec<f64> {
    let parameters = surroundings.parameters;
    let metrics: Vec<QualityMetric> = counted(parameters).collect();
    let measured: Vec<Vec<f64>> = candidates
        .iter()
        .map(|candidate| {
            let measured = Measured::new(surroundings, candidate);
            let compress = |&metric: &QualityMetric| {
                let values = measured.as_ref().map(|measured| measured.values(metric));
                values.map_or(f64::NAN, |values| compressed(parameters, metric, &values))
            };
            metrics.iter().map(compress).collect()
        })
        .collect();
    penalties(parameters, &metrics, &measured)
}

fn counted(parameters: &EvaluationParameters) -> impl Iterator<Item = QualityMetric> + '_ {
    let is_counted =
        |metric: QualityMetric| parameters.of(metric).enable && parameters.of(metric).weight > 0.0;
    parameters.plugin_names.iter().copied().filter(move |metric| is_counted(*metric))
}

/// One number for a metric: its values weighted by their place, over the shorter of both lists.
#[must_use]
pub fn compressed(parameters: &EvaluationParameters, metric: QualityMetric, values: &[f32]) -> f64 {
    let decay = parameters.of(metric).decay_weight;
    decay.iter().zip(values).map(|(weight, value)| weight * f64::from(*value)).sum()
}

/// Penalties from the compressed metrics of every candidate.
fn penalties(
    parameters: &EvaluationParameters,
    metrics: &[QualityMetric],
    measured: &[Vec<f64>],
) -> Vec<f64> {
    let weights: Vec<f64> = metrics.iter().map(|metric| parameters.of(*metric).weight).collect();
    let total: f64 = weights.iter().sum();
    if total <= 0.0 {
        return vec![0.0; measured.len()];
    }
    let ranges: Vec<(f64, f64)> =
        (0..metrics.len()).map(|index| range(measured.iter().map(|values| values[index]))).collect();
    let quality = |values: &Vec<f64>| {
        let shares = metrics.iter().zip(&ranges).zip(values);
        let shares = shares.map(|((metric, range), value)| share(*metric, *range, *value));
        shares.zip(&weights).map(|(share, weight)| share * weight).sum::<f64>() / total
    };
    measured.iter().map(|values| 1.0 - quality(values)).collect()
}

fn range(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let finite = values.filter(|value| value.is_finite());
    finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)))
}

/// Where a value stands among those of all candidates: 1 is best.
fn share(metric: QualityMetric, (low, high): (f64, f64), value: f64) -> f64 {
    if !value.is_finite() {
        return 0.0;
    }
    if high - low < SMALLEST_RANGE {
        return 1.0;
    }
    match metric {
        QualityMetric::TravelDistance => (value - low) / (high - low),
        _ => (high - value) / (high - low),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn penalties_of(metrics: &[QualityMetric], measured: &[&[f64]]) -> Vec<f64> {
        let measured: Vec<Vec<f64>> = measured.iter().map(|values| values.to_vec()).collect();
        penalties(&EvaluationParameters::default(), metrics, &measured)
    }

    fn close(found: &[f64], expected: &[f64]) {
        let equal = found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12);
        assert!(equal && found.len() == expected.len(), "{found:?} instead of {expected:?}");
    }

    #[test]
    fn the_best_gets_no_penalty_and_the_worst_all_of_it() {
        use QualityMetric::{LateralDeviation, TravelDistance};
        close(&penalties_of(&[TravelDistance], &[&[1.0], &[3.0], &[2.0]]), &[1.0, 0.0, 0.5]);
        close(&penalties_of(&[LateralDeviation], &[&[1.0], &[3.0], &[2.0]]), &[0.0, 1.0, 0.5]);
        // Weights 0.3 and 0.3.
        let both =
            penalties_of(&[TravelDistance, LateralDeviation], &[&[1.0, 1.0], &[3.0, 3.0], &[3.0, 1.0]]);
        close(&both, &[0.5, 0.5, 0.0]);
    }

    #[test]
    fn values_that_hardly_differ_are_equal() {
        use QualityMetric::LateralDeviation;
        close(&penalties_of(&[LateralDeviation], &[&[1.0], &[1.0 + 9e-7]]), &[0.0, 0.0]);
        close(&penalties_of(&[LateralDeviation], &[&[1.0], &[1.0 + 2e-6]]), &[0.0, 1.0]);
        close(&penalties_of(&[LateralDeviation], &[&[7.0]]), &[0.0]);
        assert!(penalties_of(&[LateralDeviation], &[]).is_empty());
    }

    #[test]
    fn what_cannot_be_measured_counts_as_the_worst_and_moves_no_range() {
        use QualityMetric::LateralDeviation;
        let bad = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY];
        for value in bad {
            close(&penalties_of(&[LateralDeviation], &[&[1.0], &[value], &[2.0]]), &[0.0, 1.0, 1.0]);
            close(&penalties_of(&[LateralDeviation], &[&[value]]), &[1.0]);
        }
    }

    #[test]
    fn metrics_without_weight_or_switched_off_do_not_count() {
        let mut parameters = EvaluationParameters::default();
        assert_eq!(counted(&parameters).count(), 6);
        parameters.lateral_acceleration.enable = false;
        parameters.trajectory_consistency.weight = 0.0;
        parameters.plugin_names.retain(|metric| *metric != QualityMetric::TravelDistance);
        let left: Vec<_> = counted(&parameters).collect();
        use QualityMetric::{LateralDeviation, LongitudinalJerk, SteeringConsistency};
        assert_eq!(left, [LongitudinalJerk, LateralDeviation, SteeringConsistency]);
        close(&penalties(&parameters, &[], &[vec![], vec![]]), &[0.0, 0.0]);
    }
}
