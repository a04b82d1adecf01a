//! The filters give the verdicts that are written down, and `verify` sees it when they do not.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may fail loudly")]

#[path = "program_support/program.rs"]
mod program;
#[path = "golden_support/shared.rs"]
mod shared;

use std::fs;
use std::path::{Path, PathBuf};

use selection::filters::CLASSES;
use serde_json::{Value, json};
use trajectory_selector::commands::verify::{EXIT_DIFFERENT, Kind, Options, VerifyError, VerifyReport, run};

fn verify(paths: &[PathBuf], maps: Option<PathBuf>) -> VerifyReport {
    run(&Options { paths: paths.to_vec(), maps, filters: Vec::new() }).unwrap()
}

#[test]
fn every_filter_that_is_built_equals_the_open_sequences_and_the_bench_scenes() {
    let Some(golden) =
        shared::golden("every_filter_that_is_built_equals_the_open_sequences_and_the_bench_scenes")
    else {
        return;
    };
    let report = verify(&[golden.join("open"), golden.join("bench")], None);
    println!("{report}");
    assert_eq!((report.files, report.cycles), (186 + 5, 1244 + 5));
    assert_eq!(report.unlisted, 0, "{report}");
    assert_eq!(report.exit_code(), 0);
    assert_eq!(report.filters["data_validity"].equal, 3776 + 320, "no candidate is left out");
    for (name, filter) in &report.filters {
        assert_eq!(filter.judgements, filter.equal + filter.unequal + filter.skipped, "{name}");
        let built = name == "data_validity" || CLASSES.iter().any(|class| class.short_name == name);
        if built {
            assert!(filter.equal > 4000, "{name} is compared");
            assert_eq!(filter.skipped_because.get("not built"), None, "{name}");
        }
    }
}

/// A copy of a sequence in a folder of its own.
struct Copy {
    folder: tempfile::TempDir,
    maps: PathBuf,
    file: Value,
}

impl Copy {
    fn of(golden: &Path, name: &str) -> Self {
        let text = fs::read(golden.join("open").join(name)).unwrap();
        Self {
            folder: tempfile::tempdir().unwrap(),
            maps: golden.join("maps"),
            file: serde_json::from_slice(&text).unwrap(),
        }
    }

    fn verify(&self) -> VerifyReport {
        let path = self.folder.path().join("sequence.json");
        fs::write(&path, self.file.to_string()).unwrap();
        verify(&[path], Some(self.maps.clone()))
    }
}

const FILTER: &str = "vehicle_constraint_filter";

/// What is done to a verdict, and what is seen then: what is different, whether we reject what they accept, whether we
/// accept what they reject.
type Damage = (fn(&mut Value), Option<Kind>, usize, usize);

#[test]
fn a_verdict_that_is_broken_on_purpose_is_seen() {
    let Some(golden) = shared::golden("a_verdict_that_is_broken_on_purpose_is_seen") else { return };
    let whole = Copy::of(&golden, "open_intersection_007_vc.json");
    assert_eq!(whole.verify().exit_code(), 0);
    let expected = whole.file["expected"].as_array().unwrap();
    let find = |feasible: bool| {
        let of_filter =
            |(index, verdicts): (usize, &Value)| (verdicts[FILTER]["feasible"] == feasible).then_some(index);
        let cycles = expected.iter().enumerate();
        let mut found = cycles.filter_map(|(cycle, candidates)| {
            candidates.as_array().unwrap().iter().enumerate().find_map(of_filter).map(|index| (cycle, index))
        });
        found.next().unwrap()
    };
    let (accepted, rejected) = (find(true), find(false));
    let cases: [((usize, usize), Damage); 12] = [
        (rejected, (|v| v[FILTER]["feasible"] = true.into(), Some(Kind::Feasibility), 1, 0)),
        (accepted, (|v| v[FILTER]["feasible"] = false.into(), Some(Kind::Feasibility), 0, 1)),
        (accepted, (|v| v[FILTER] = json!({"error": "text"}), Some(Kind::Feasibility), 0, 1)),
        (rejected, (|v| v[FILTER] = json!({"throws": "text"}), Some(Kind::Error), 0, 0)),
        (accepted, (|v| v[FILTER]["metrics"][0][0] = "other".into(), Some(Kind::Metrics), 0, 0)),
        (accepted, (|v| v[FILTER]["metrics"].as_array_mut().unwrap().swap(0, 1), Some(Kind::Metrics), 0, 0)),
        (accepted, (|v| drop(v[FILTER]["metrics"].as_array_mut().unwrap().pop()), Some(Kind::Metrics), 0, 0)),
        (accepted, (|v| v[FILTER]["metrics"][4][2] = 1.into(), Some(Kind::Level), 0, 0)),
        (accepted, (|v| v[FILTER]["metrics"][4][1] = 0.001.into(), Some(Kind::Value), 0, 0)),
        (accepted, (|v| v[FILTER]["metrics"][4][1] = "inf".into(), Some(Kind::Value), 0, 0)),
        // What counts is the verdict on the true nearest borders; what is fragile does not count at all.
        (accepted, (|v| v[FILTER]["true_nearest"] = json!({"error": "text"}), Some(Kind::Feasibility), 0, 1)),
        (accepted, (|v| (v[FILTER]["feasible"], v["fragile"]) = (false.into(), json!([FILTER])), None, 0, 0)),
    ];
    for (number, ((cycle, candidate), (damage, kind, safe, unsafe_))) in cases.into_iter().enumerate() {
        let mut copy = Copy::of(&golden, "open_intersection_007_vc.json");
        damage(&mut copy.file["expected"][cycle][candidate]);
        let report = copy.verify();
        let filter = &report.filters[FILTER];
        assert_eq!(report.exit_code(), if kind.is_some() { EXIT_DIFFERENT } else { 0 }, "case {number}");
        assert_eq!((filter.unequal_safe_side, filter.unequal_unsafe_side), (safe, unsafe_), "case {number}");
        assert_eq!(filter.unequal, usize::from(kind.is_some()), "case {number}");
        assert_eq!(report.differences.first().map(|difference| difference.kind), kind, "case {number}");
        if let Some(difference) = report.differences.first() {
            assert_eq!((difference.cycle, difference.candidate), (cycle, candidate), "case {number}");
            assert_eq!(difference.listed_deviation, None);
        }
        assert_eq!(EXIT_DIFFERENT, 3, "scripts rely on it");
    }
}

#[test]
fn data_that_is_no_longer_invalid_is_seen() {
    let Some(golden) = shared::golden("data_that_is_no_longer_invalid_is_seen") else { return };
    let mut copy = Copy::of(&golden, "open_sim_intersection_edge_02_degenerate.json");
    let whole = copy.verify();
    assert_eq!((whole.exit_code(), whole.filters[FILTER].skipped_because["invalid data"]), (0, 7));
    // Ours rejects where the file does not expect it.
    copy.file["cycles"][0]["candidates"][0]["valid"] = true.into();
    let report = copy.verify();
    assert_eq!((report.exit_code(), report.filters["data_validity"].unequal_safe_side), (EXIT_DIFFERENT, 1));
    // Another defect than expected.
    copy.file["cycles"][0]["candidates"][0]["valid"] = false.into();
    copy.file["cycles"][0]["candidates"][0]["data_validity"] = 2.into();
    let report = copy.verify();
    assert_eq!(report.differences[0].kind, Kind::Value);
}

#[test]
fn changed_input_is_seen_too() {
    let Some(golden) = shared::golden("changed_input_is_seen_too") else { return };
    let mut copy = Copy::of(&golden, "open_intersection_007_vc.json");
    copy.file["params"]["vehicle_constraint"]["max_speed"] = 0.5.into();
    let report = copy.verify();
    let filter = &report.filters[FILTER];
    assert_eq!(report.exit_code(), EXIT_DIFFERENT);
    assert!(filter.unequal_safe_side > 0 && filter.unequal_unsafe_side == 0);
    assert!(filter.max_metric_difference.0 > 0.5);
}

#[test]
fn the_report_has_the_keys_of_its_contract() {
    let Some(golden) = shared::golden("the_report_has_the_keys_of_its_contract") else { return };
    let mut copy = Copy::of(&golden, "open_intersection_007_vc.json");
    copy.file["expected"][0][0][FILTER]["metrics"][0][1] = "nan".into();
    let report = serde_json::to_value(copy.verify()).unwrap();
    assert_eq!(
        (&report["files"], &report["cycles"]),
        (&1.into(), &copy.file["cycles"].as_array().unwrap().len().into())
    );
    let filter = &report["filters"][FILTER];
    for key in ["judgements", "equal", "unequal", "unequal_safe_side", "unequal_unsafe_side", "skipped"] {
        assert!(filter[key].is_u64(), "{key} of {filter}");
    }
    assert_eq!(filter["max_metric_difference"], "inf", "a number against none");
    let difference = &report["differences"][0];
    for key in ["file", "filter"] {
        assert!(difference[key].is_string(), "{key} of {difference}");
    }
    assert_eq!((&difference["cycle"], &difference["candidate"]), (&0.into(), &0.into()));
    assert_eq!(difference["listed_deviation"], Value::Null);
    assert_eq!(difference["expected"]["metrics"][0][1], "nan");
    assert!(difference["ours"]["metrics"][0][1].is_f64());
}

#[test]
fn at_most_the_first_differences_are_listed() {
    let Some(golden) = shared::golden("at_most_the_first_differences_are_listed") else { return };
    let mut copy = Copy::of(&golden, "open_intersection_007_vc.json");
    let mut broken = 0;
    for verdicts in
        copy.file["expected"].as_array_mut().unwrap().iter_mut().flat_map(|c| c.as_array_mut().unwrap())
    {
        verdicts[FILTER] = json!({"feasible": true, "metrics": []});
        broken += 1;
    }
    let report = copy.verify();
    assert_eq!(report.filters[FILTER].unequal, broken);
    assert_eq!((report.unlisted, report.differences.len()), (broken, broken.min(50)));
}

#[test]
fn a_filter_that_does_not_exist_is_refused() {
    let options = Options { filters: vec!["vehicle_constraint".to_owned()], ..Options::default() };
    let Err(error @ VerifyError::UnknownFilter { .. }) = run(&options) else { panic!("accepted") };
    assert!(error.to_string().contains("vehicle_constraint_filter"), "{error}");
}

#[test]
fn the_program_ends_with_3_if_and_only_if_a_verdict_differs() {
    let Some(golden) = shared::golden("the_program_ends_with_3_if_and_only_if_a_verdict_differs") else {
        return;
    };
    let mut copy = Copy::of(&golden, "open_intersection_007_vc.json");
    let path = copy.folder.path().join("sequence.json");
    for (name, exit_code) in [("check_speed", 0), ("check_speeding", 3)] {
        copy.file["expected"][0][0][FILTER]["metrics"][0][0] = name.into();
        fs::write(&path, copy.file.to_string()).unwrap();
        let maps = copy.maps.to_str().unwrap();
        let run = program::run(&["verify", path.to_str().unwrap(), "--maps", maps]);
        assert_eq!((run.exit_code, &run.json["exit_code"]), (exit_code, &exit_code.into()));
        assert_eq!(run.json["ok"], exit_code == 0);
        assert_eq!(run.json["differences"].as_array().unwrap().len(), usize::from(exit_code == 3));
    }
    let run = program::run(&["verify", "/no/such/folder"]);
    assert_eq!((run.exit_code, run.json["errors"].as_array().unwrap().len()), (1, 1));
}
