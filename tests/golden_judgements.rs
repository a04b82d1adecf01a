//! On recorded scenes every objection is explained, has a place, and a failure leaves nothing behind; and there are
//! enough objections of every filter for a comparison of verdicts to mean something.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may fail loudly")]

#[path = "golden_support/shared.rs"]
mod shared;

use std::collections::BTreeMap;

use selection::filters::CLASSES;
use selection::validator::LoadedFilter;
use selection::{Judgement, Memo, Scratch, Validator};
use trajectory_selector::commands::verify::run_cycle;
use trajectory_selector::golden::{Maps, Sequence, sequence_files};

/// What a filter said, all in all.
#[derive(Debug, Default)]
struct Said {
    accepted: usize,
    rejected: usize,
    failed: usize,
}

impl Said {
    fn count(&mut self, judgement: &Judgement) {
        match (judgement.feasible, &judgement.failure) {
            (true, _) => self.accepted += 1,
            (false, None) => self.rejected += 1,
            (false, Some(_)) => self.failed += 1,
        }
    }
}

/// Filter, and the least number of candidates that it accepts, rejects and cannot judge. The crosswalk and traffic
/// light filters meet missing routes and unknown lanelets, the boundary filter odometry that is missing.
const LEAST: [(&str, [usize; 3]); 4] = [
    ("crosswalk_filter", [3000, 700, 10]),
    ("traffic_light_filter", [3000, 700, 20]),
    ("uncrossable_boundary_departure_filter", [3000, 500, 0]),
    ("vehicle_constraint_filter", [2500, 1200, 0]),
];

/// A departure of an earlier cycle has no place on this candidate, and its words say so.
fn is_held(loaded: &LoadedFilter, judgement: &Judgement) -> bool {
    loaded.explain(judgement).is_some_and(|text| text.contains("still held"))
}

#[test]
fn every_objection_is_explained_and_has_a_place() {
    let Some(golden) = shared::golden("every_objection_is_explained_and_has_a_place") else { return };
    let mut said: BTreeMap<&str, Said> = BTreeMap::new();
    let (mut maps, mut scratch) = (Maps::default(), Scratch::default());
    for file in sequence_files(&[golden.join("open"), golden.join("bench")]).unwrap() {
        let sequence = Sequence::read(&file, &mut maps).unwrap();
        let mut parameters = sequence.parameters.clone();
        parameters.filter_names = CLASSES.iter().map(|class| class.class_name.to_owned()).collect();
        let mut validator = Validator::new(parameters, &sequence.vehicle).unwrap();
        for (number, cycle) in sequence.cycles.iter().enumerate() {
            for verdict in run_cycle(&mut validator, cycle, &mut scratch) {
                for (loaded, judgement) in validator.filters().iter().zip(&verdict.judgements) {
                    let filter = loaded.name();
                    let place = format!("{} cycle {number} {}: {filter}", sequence.name, verdict.key);
                    said.entry(filter).or_default().count(judgement);
                    if judgement.failure.is_some() {
                        assert!(!judgement.feasible && judgement.metrics.is_empty(), "{place}");
                        assert_eq!(judgement.memo, Memo::Nothing, "{place}");
                        assert!(judgement.evidence.is_none(), "{place}");
                    } else {
                        let has_place = judgement.evidence.is_some();
                        assert!(
                            judgement.feasible || has_place || is_held(loaded, judgement),
                            "{place}: no place"
                        );
                    }
                    assert!(judgement.feasible || loaded.explain(judgement).is_some(), "{place}: no reason");
                }
            }
        }
    }
    println!("{said:#?}");
    for (filter, [accepted, rejected, failed]) in LEAST {
        let said = &said[filter];
        let enough = said.accepted >= accepted && said.rejected >= rejected && said.failed >= failed;
        assert!(enough, "{filter}: {said:?}");
    }
}
