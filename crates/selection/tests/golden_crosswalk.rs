//! The crosswalk filter gives the verdicts of the golden sequences.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking; helpers outside test functions do too")]

#[path = "golden_crosswalk/reader.rs"]
mod reader;

use messages::unique_identifier_msgs::Uuid;
use selection::filters::crosswalk::{CrosswalkFilter, safety_factors};
use selection::parameters::ValidatorParameters;
use selection::{Candidate, Filter, Judgement, Scratch};
use serde_json::Value;

/// What is compared, of a judgement as of an expectation.
#[derive(Debug, PartialEq)]
enum Verdict {
    Error,
    Judged { feasible: bool, metrics: Vec<(String, f64, u8)>, factors: Vec<(String, f64, f64)> },
}

fn given(judgement: &Judgement) -> Verdict {
    if judgement.failure.is_some() {
        assert!(!judgement.feasible);
        return Verdict::Error;
    }
    let hex = |id: Uuid| id.to_string();
    Verdict::Judged {
        feasible: judgement.feasible,
        metrics: judgement.metrics.iter().map(|m| (m.name.to_owned(), m.value, m.risk as u8)).collect(),
        factors: safety_factors(judgement)
            .iter()
            .map(|factor| (hex(factor.object_id), factor.position.x, factor.position.y))
            .collect(),
    }
}

fn expected(json: &Value) -> Verdict {
    if json.get("error").is_some() || json.get("throws").is_some() {
        return Verdict::Error;
    }
    let rows = |name: &str| json[name].as_array().cloned().unwrap_or_default();
    let text = |value: &Value| value.as_str().unwrap().to_owned();
    let number = |value: &Value| value.as_f64().unwrap();
    Verdict::Judged {
        feasible: json["feasible"].as_bool().unwrap(),
        metrics: rows("metrics")
            .iter()
            .map(|row| (text(&row[0]), number(&row[1]), row[2].as_u64().unwrap() as u8))
            .collect(),
        factors: rows("safety_factors")
            .iter()
            .map(|row| (text(&row[0]), number(&row[1]), number(&row[2])))
            .collect(),
    }
}

/// Compares a folder; gives the number of compared, rejected and failed verdicts, and the differences.
fn compare(golden: &std::path::Path, folder: &str) -> ([usize; 3], Vec<String>) {
    let mut maps = reader::Maps::default();
    let mut counts = [0; 3];
    let mut differences = Vec::new();
    let mut scratch = Scratch::default();
    for file in reader::files(&golden.join(folder)) {
        let sequence = reader::read(golden, &file, &mut maps);
        let first = sequence.cycles[0].parameters.clone();
        let mut filter = CrosswalkFilter::new(first, sequence.front_m);
        for (number, cycle) in sequence.cycles.iter().enumerate() {
            let crosswalk = cycle.parameters.clone();
            filter.configure(&ValidatorParameters { crosswalk, ..ValidatorParameters::default() });
            filter.observe(&cycle.scene);
            let candidates = &cycle.candidates;
            let judgements: Vec<_> =
                candidates.iter().map(|c| filter.judge(&cycle.scene, c, &mut scratch)).collect();
            for ((candidate, judgement), json) in candidates.iter().zip(&judgements).zip(&cycle.expected) {
                let Some(json) = json else { continue };
                let (given, expected) = (given(judgement), expected(json));
                counts[0] += 1;
                counts[1] += usize::from(!judgement.feasible);
                counts[2] += usize::from(given == Verdict::Error);
                assert_eq!(filter.explain(judgement).is_some(), !judgement.feasible);
                if given != expected {
                    differences.push(format!(
                        "{} cycle {number} {}: {given:?} instead of {expected:?}",
                        sequence.name, candidate.key
                    ));
                }
            }
            let judged: Vec<(&Candidate, &Judgement)> = candidates
                .iter()
                .zip(&judgements)
                .filter(|(_, judgement)| judgement.failure.is_none())
                .collect();
            filter.remember(&judged);
        }
    }
    (counts, differences)
}

#[test]
fn all_verdicts_are_equal() {
    let Some(golden) = reader::golden_folder() else {
        eprintln!("skipped: no golden files");
        return;
    };
    for (folder, least) in [("open", [3700, 640, 10]), ("bench", [320, 99, 0])] {
        let (counts, differences) = compare(&golden, folder);
        eprintln!("{folder}: {counts:?} compared, rejected, failed; {} differ", differences.len());
        assert!(differences.is_empty(), "{}", differences.join("\n"));
        assert!(counts.iter().zip(least).all(|(count, least)| *count >= least), "{folder}: {counts:?}");
    }
}
