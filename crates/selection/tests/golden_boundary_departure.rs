//! The verdicts of upstream's boundary departure filter on recorded and made-up scenes are ours.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

#[path = "support/golden.rs"]
mod golden;

use std::path::Path;

use selection::filters::boundary_departure::{NAME, UncrossableBoundaryDepartureFilter};
use selection::parameters::ValidatorParameters;
use selection::{Candidate, Filter, Judgement, RiskLevel, Scratch};
use serde_json::Value;

/// Metric values beyond this mean that nothing was measured.
const NO_MEASUREMENT: f64 = 1e300;

#[derive(Default, Debug)]
struct Tally {
    equal: usize,
    accepted: usize,
    rejected: usize,
    errors: usize,
    true_nearest: usize,
    fragile: usize,
    invalid: usize,
    differences: Vec<String>,
}

fn level(risk: RiskLevel) -> u64 {
    match risk {
        RiskLevel::Safe => 0,
        RiskLevel::LowCaution => 1,
        RiskLevel::HighCaution => 2,
        RiskLevel::Danger => 3,
        RiskLevel::Fatal => 4,
    }
}

/// What differs, if anything does.
fn difference(expected: &Value, judgement: &Judgement) -> Option<String> {
    let is_error = expected.get("error").or(expected.get("throws")).is_some();
    if is_error || judgement.failure.is_some() {
        let agree = is_error && judgement.failure.is_some() && !judgement.feasible;
        return (!agree).then(|| format!("{expected} but {:?}", judgement.failure));
    }
    let metrics = expected["metrics"].as_array().unwrap();
    let agrees = |(theirs, ours): (&Value, &selection::Metric)| {
        let value = golden::number(&theirs[1]);
        let is_measured = |value: f64| value <= NO_MEASUREMENT;
        let values = match (is_measured(value), is_measured(ours.value)) {
            (true, true) => (value - ours.value).abs() <= 1e-9,
            (a, b) => a == b,
        };
        values && theirs[0] == ours.name && theirs[2].as_u64() == Some(level(ours.risk))
    };
    let agree = expected["feasible"].as_bool() == Some(judgement.feasible)
        && metrics.len() == judgement.metrics.len()
        && metrics.iter().zip(&judgement.metrics).all(agrees);
    (!agree).then(|| format!("{expected} but {} {:?}", judgement.feasible, judgement.metrics[0]))
}

fn compare(folder: &Path, golden: &Path) -> Tally {
    let (mut maps, mut scratch, mut tally) = (golden::Maps::default(), Scratch::default(), Tally::default());
    for path in golden::sequence_paths(folder) {
        let sequence = golden::read(golden, &path, &mut maps);
        let Some(first) = sequence.cycles.first() else { continue };
        let mut filter = UncrossableBoundaryDepartureFilter::new(first.parameters.clone(), sequence.vehicle);
        for (number, cycle) in sequence.cycles.iter().enumerate() {
            filter.configure(&ValidatorParameters {
                boundary_departure: cycle.parameters.clone(),
                ..ValidatorParameters::default()
            });
            filter.observe(&cycle.scene);
            let mut judged: Vec<(&Candidate, Judgement)> = Vec::new();
            for (candidate, (expected, is_valid)) in cycle.candidates.iter().zip(&cycle.expected) {
                let Some(verdict) = expected.get(NAME) else { continue };
                if !is_valid {
                    tally.invalid += 1;
                    continue;
                }
                let judgement = filter.judge(&cycle.scene, candidate, &mut scratch);
                let is_fragile =
                    expected["fragile"].as_array().is_some_and(|names| names.iter().any(|n| n == NAME));
                let truth = verdict.get("true_nearest").unwrap_or(verdict);
                tally.fragile += usize::from(is_fragile);
                tally.true_nearest += usize::from(verdict.get("true_nearest").is_some());
                tally.accepted += usize::from(judgement.feasible);
                tally.rejected += usize::from(!judgement.feasible && judgement.failure.is_none());
                tally.errors += usize::from(judgement.failure.is_some());
                match difference(truth, &judgement).filter(|_| !is_fragile) {
                    Some(what) => {
                        tally
                            .differences
                            .push(format!("{} cycle {number} {}: {what}", sequence.name, candidate.key));
                    }
                    None => tally.equal += 1,
                }
                if judgement.failure.is_none() {
                    judged.push((candidate, judgement));
                }
            }
            let judged: Vec<_> =
                judged.iter().map(|(candidate, judgement)| (*candidate, judgement)).collect();
            filter.remember(&judged);
        }
    }
    tally
}

#[test]
fn every_verdict_equals_upstream() {
    let Some(golden) = golden::golden("every_verdict_equals_upstream") else { return };
    for (folder, least) in [("open", 3000), ("bench", 320)] {
        let tally = compare(&golden.join(folder), &golden);
        let Tally { equal, accepted, rejected, errors, true_nearest, fragile, invalid, differences } = &tally;
        eprintln!(
            "{folder}: {equal} equal, {accepted} accepted, {rejected} rejected, {errors} errors, {true_nearest} true \
             nearest, {fragile} fragile, {invalid} invalid"
        );
        assert!(differences.is_empty(), "{} differences:\n{}", differences.len(), differences.join("\n"));
        assert!(*equal >= least, "only {equal} verdicts compared");
    }
}
