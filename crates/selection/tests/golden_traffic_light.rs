//! The traffic light filter against the answers of the upstream C++ on recorded and generated sequences.

#![expect(clippy::unwrap_used, reason = "a golden file that cannot be read fails the test")]

#[path = "golden_traffic_light/sequence.rs"]
mod sequence;

use selection::{Judgement, Memo, Scratch};
use sequence::{Sequence, shared_folder};
use serde_json::Value;

const NAME: &str = "traffic_light_filter";

/// What differs from an expected verdict, in words.
fn difference(judgement: &Judgement, expected: &Value) -> Option<String> {
    if expected.get("error").is_some() || expected.get("throws").is_some() {
        return judgement.failure.is_none().then(|| format!("{expected} expected, but it was judged"));
    }
    let metrics = expected["metrics"].as_array().unwrap().iter();
    let metrics: Vec<(&str, u64)> =
        metrics.map(|metric| (metric[0].as_str().unwrap(), metric[2].as_u64().unwrap())).collect();
    let ours: Vec<(&str, u64)> =
        judgement.metrics.iter().map(|metric| (metric.name, metric.risk as u64)).collect();
    let equal = judgement.failure.is_none()
        && judgement.feasible == expected["feasible"].as_bool().unwrap()
        && ours == metrics;
    (!equal).then(|| format!("{expected} expected, but it is {judgement:?}"))
}

#[test]
fn verdicts_equal_upstream() {
    let Some(folder) = shared_folder() else {
        eprintln!("skipped: no golden files");
        return;
    };
    let (mut compared, mut rejected, mut failed) = (0, 0, 0);
    let mut differences = Vec::new();
    let files = ["golden/open", "golden/bench"].map(|part| sequence::files(&folder.join(part)));
    for file in files.into_iter().flatten() {
        let sequence = Sequence::read(&folder, &file);
        let mut filter = sequence.filter();
        let mut scratch = Scratch::default();
        for (at, cycle) in sequence.cycles().enumerate() {
            filter.configure(&cycle.parameters);
            filter.observe(&cycle.scene);
            let judge = |candidate| filter.judge(&cycle.scene, candidate, &mut scratch);
            let judgements: Vec<Judgement> = cycle.candidates.iter().map(judge).collect();
            for ((candidate, judgement), expected) in
                cycle.candidates.iter().zip(&judgements).zip(&cycle.expected)
            {
                let fragile = expected["fragile"].as_array();
                if fragile.is_some_and(|names| names.iter().any(|name| name == NAME)) {
                    continue;
                }
                compared += 1;
                rejected += usize::from(!judgement.feasible);
                failed += usize::from(judgement.failure.is_some());
                assert_eq!(judgement.feasible, filter.explain(judgement).is_none());
                assert_eq!(judgement.evidence.is_some(), !judgement.feasible && judgement.failure.is_none());
                assert!(judgement.failure.is_none() || judgement.memo == Memo::Nothing);
                if let Some(difference) = difference(judgement, &expected[NAME]) {
                    differences.push(format!("{file:?} cycle {at} {}: {difference}", candidate.key));
                }
            }
            let judged: Vec<_> =
                cycle.candidates.iter().zip(&judgements).filter(|(_, j)| j.failure.is_none()).collect();
            filter.remember(&judged);
        }
    }
    eprintln!("{compared} verdicts compared, {rejected} not feasible, of these {failed} not assessed");
    assert!(compared > 3000 && rejected > 600, "the golden files are there, but hardly any was compared");
    assert!(differences.is_empty(), "{} differ:\n{}", differences.len(), differences.join("\n"));
}
