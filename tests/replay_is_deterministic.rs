//! The same drive gives the same bytes: on one thread and on several, run after run, from MCAP and from sqlite3; and
//! the same verdicts in either wire form of its candidates.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

#[path = "program_support/program.rs"]
mod program;

use messages::autoware_trajectory_validator::{ValidationReport, ValidationReportArray};
use program::{Recorded, read, reports, run, shared};
use std::path::Path;

fn replay(drive: &Path, threads: &str) -> (String, Vec<Recorded>) {
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("out.mcap");
    let arguments =
        ["replay", drive.to_str().unwrap(), "--threads", threads, "--output", output.to_str().unwrap()];
    let outcome = run(&arguments);
    assert_eq!(outcome.exit_code, 0, "{}", outcome.stderr);
    let claimed = outcome.json["output"]["sha256"].as_str().unwrap().to_owned();
    (claimed, read(&output))
}

#[test]
fn threads_and_repetition_change_no_byte() {
    for drive in ["intersection.mcap", "stress.mcap", "crosswalk.mcap", "parking.mcap"] {
        let Some(path) = shared(&format!("data/drives/{drive}")) else { return };
        let (first, recorded) = replay(&path, "1");
        for threads in ["1", "2", "3"] {
            let (again, other) = replay(&path, threads);
            assert!(recorded == other, "{drive}: messages differ on {threads} threads");
            assert_eq!(first, again, "{drive} on {threads} threads");
        }
    }
}

/// A recording of the first five seconds gives the beginning of what the whole recording gives.
#[test]
fn sqlite_gives_what_mcap_gives() {
    let (Some(whole), Some(cut)) =
        (shared("data/drives/intersection.mcap"), shared("data/drives/intersection_sqlite"))
    else {
        return;
    };
    let ((_, whole), (_, cut)) = (replay(&whole, "2"), replay(&cut, "2"));
    assert!(cut.len() > 400, "{} messages", cut.len());
    assert!(whole[..cut.len()] == cut[..], "the outputs differ");
}

/// What is compared of a report: generator, stamp, risk, and metrics by filter, with the bits of their values (a metric
/// that was not assessed is NaN). The collision check looks at turn indicators, which only the newer wire form has.
type Comparable = (String, i64, u8, Vec<(String, String, u64, u8)>);

fn comparable(array: &ValidationReportArray) -> Vec<Comparable> {
    let report = |report: &ValidationReport| {
        let metrics =
            report.metrics.iter().filter(|metric| metric.validator_name != "collision_check_filter");
        let metrics = metrics.map(|metric| {
            let (filter, name) = (metric.validator_name.to_string(), metric.metric_name.to_string());
            (filter, name, metric.metric_value.to_bits(), metric.risk.level)
        });
        let stamp = report.trajectory_stamp.nanoseconds();
        (report.generator_name.clone(), stamp, report.risk.level, metrics.collect())
    };
    array.reports.iter().map(report).collect()
}

#[test]
fn both_wire_forms_give_the_same_verdicts() {
    let (Some(new), Some(old)) =
        (shared("data/drives/intersection.mcap"), shared("data/drives/intersection_052.mcap"))
    else {
        return;
    };
    let ((_, new), (_, old)) = (replay(&new, "2"), replay(&old, "2"));
    let (new, old) = (reports(&new), reports(&old));
    assert!(old.len() > 45, "{} cycles", old.len());
    for ((new_time, new), (old_time, old)) in new.iter().zip(&old) {
        assert_eq!(new_time, old_time);
        assert_eq!(comparable(new), comparable(old), "at {old_time}");
    }
}

#[test]
fn the_demo_depends_on_its_seed_alone() {
    let demo = |seed: &str, threads: &str| {
        let folder = tempfile::tempdir().unwrap();
        let outcome =
            run(&["demo", "--seed", seed, "--threads", threads, "--output", folder.path().to_str().unwrap()]);
        assert_eq!(outcome.exit_code, 0, "{}", outcome.stderr);
        outcome.json["output"]["sha256"].as_str().unwrap().to_owned()
    };
    assert_eq!(demo("1", "1"), demo("1", "2"));
    assert_ne!(demo("1", "1"), demo("2", "1"));
}
