//! Every anchor of a recorded drive gives one cycle, the timer bridges what lacks one, and nothing stale, corrupt or
//! rejected ever leaves the node.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

#[path = "program_support/program.rs"]
mod program;

use messages::autoware_internal_planning_msgs::CandidateTrajectories;
use messages::autoware_planning_msgs::TrajectoryPoint;
use program::{Recorded, number, read, reports, run, shared, validated_sets};
use std::collections::BTreeSet;
use std::path::Path;

const PREFIX: &str = "/trajectory_selector_node/input/";
/// Default of `duration_time`.
const WINDOW_S: f64 = 0.2;

/// Recording, messages by topic, longest gap between anchors as the README of the drives tells it.
const DRIVES: [(&str, [(&str, u64); 4]); 4] = [
    (
        "intersection.mcap",
        [
            ("odometry", 1000),
            ("objects", 200),
            ("trajectories_generative", 194),
            ("trajectories_backup", 200),
        ],
    ),
    (
        "crosswalk.mcap",
        [("odometry", 600), ("objects", 120), ("trajectories_generative", 119), ("trajectories_backup", 120)],
    ),
    (
        "parking.mcap",
        [("odometry", 300), ("objects", 60), ("trajectories_generative", 59), ("trajectories_backup", 60)],
    ),
    (
        "stress.mcap",
        [("odometry", 150), ("objects", 30), ("trajectories_generative", 29), ("trajectories_backup", 30)],
    ),
];

#[test]
fn every_drive_is_replayed_and_only_accepted_candidates_leave() {
    for (drive, counts) in DRIVES {
        let Some(path) = shared(&format!("data/drives/{drive}")) else { return };
        let folder = tempfile::tempdir().unwrap();
        let output = folder.path().join("out.mcap");
        let outcome = run(&["replay", path.to_str().unwrap(), "--output", output.to_str().unwrap()]);
        assert_eq!(outcome.exit_code, 0, "{drive}: {}", outcome.stderr);
        let json = &outcome.json;
        for (topic, count) in counts {
            let topic = format!("{PREFIX}{topic}");
            assert_eq!(number(json, &["messages", &topic, "received"]), count, "{drive} {topic}");
        }
        let anchors = number(json, &["messages", &format!("{PREFIX}trajectories_generative"), "received"]);
        assert_eq!(number(json, &["cycles", "anchor"]), anchors, "{drive}: one cycle for each anchor");
        assert_eq!(number(json, &["cycles", "coalesced"]), 0, "{drive}");
        let recorded = read(&output);
        let cycles = anchors + number(json, &["cycles", "timer"]);
        let early: u64 = json["cycles"]["early_return"]
            .as_object()
            .unwrap()
            .values()
            .filter_map(serde_json::Value::as_u64)
            .sum();
        assert_eq!(validated_sets(&recorded).len() as u64, cycles - early, "{drive}");
        only_accepted_candidates_leave(drive, &recorded);
        candidate_counts_agree(json, &recorded);
    }
}

/// The sets that left against the reports of the same cycle, and against the rules that need no filter.
fn only_accepted_candidates_leave(drive: &str, recorded: &[Recorded]) {
    let (sets, reports) = (validated_sets(recorded), reports(recorded));
    assert_eq!(sets.len(), reports.len());
    for ((time, set), (report_time, report)) in sets.iter().zip(&reports) {
        assert_eq!(time, report_time);
        let accepted = report.reports.iter().filter(|report| report.risk.level < 2);
        let accepted: BTreeSet<_> =
            accepted.map(|report| (report.generator_id, report.trajectory_stamp)).collect();
        for candidate in &set.candidate_trajectories {
            let key = (candidate.generator_id, candidate.header.stamp);
            assert!(accepted.contains(&key), "{drive} at {time}: {key:?} left without being accepted");
            let age_s = messages::builtin_interfaces::Time::from_nanoseconds(*time).seconds()
                - candidate.header.stamp.seconds();
            assert!(age_s <= WINDOW_S, "{drive} at {time}: {age_s} s old");
            assert!(candidate.points.len() >= 2, "{drive} at {time}");
            assert!(candidate.points.iter().all(is_sound), "{drive} at {time}");
            let times = candidate.points.windows(2);
            assert!(times.into_iter().all(|pair| pair[0].time_from_start <= pair[1].time_from_start));
            assert_eq!(candidate.header.frame_id, "map", "{drive} at {time}");
        }
        generators_are_listed_once(set);
    }
}

fn is_sound(point: &TrajectoryPoint) -> bool {
    let (position, q) = (point.pose.position, point.pose.orientation);
    let numbers = [position.x, position.y, position.z, q.x, q.y, q.z, q.w];
    let motion = [point.longitudinal_velocity_mps, point.lateral_velocity_mps, point.acceleration_mps2];
    let norm = q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w;
    numbers.iter().all(|number| number.is_finite())
        && motion.iter().all(|number| number.is_finite())
        && (norm - 1.0).abs() < 0.1
}

fn generators_are_listed_once(set: &CandidateTrajectories) {
    let listed: BTreeSet<_> = set.generator_info.iter().map(|info| info.generator_id).collect();
    let used: BTreeSet<_> =
        set.candidate_trajectories.iter().map(|candidate| candidate.generator_id).collect();
    assert_eq!(listed, used);
    assert_eq!(listed.len(), set.generator_info.len());
}

fn candidate_counts_agree(json: &serde_json::Value, recorded: &[Recorded]) {
    let accepted: usize =
        validated_sets(recorded).iter().map(|(_, set)| set.candidate_trajectories.len()).sum();
    let judged: usize = reports(recorded).iter().map(|(_, report)| report.reports.len()).sum();
    assert_eq!(number(json, &["candidates", "accepted"]), accepted as u64);
    assert_eq!(number(json, &["candidates", "judged"]), judged as u64);
    assert_eq!(number(json, &["candidates", "rejected"]), (judged - accepted) as u64);
}

#[test]
fn the_hiccup_is_bridged_and_the_defects_of_the_intersection_drive_are_named() {
    let Some(path) = shared("data/drives/intersection.mcap") else { return };
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("out.mcap");
    let outcome = run(&["replay", path.to_str().unwrap(), "--output", output.to_str().unwrap()]);
    let recorded = read(&output);
    hiccup_is_bridged(&recorded, 1_750_000_007_000_000_000, 1_750_000_007_600_000_000);
    // Generator 14: NaN x 4, no points x 3, time back x 3, infinity x 3, one point, zero quaternions x 2, NaN x 3;
    // and one candidate of another generator in frame base_link.
    let codes: Vec<_> = reports(&recorded)
        .iter()
        .flat_map(|(_, array)| &array.reports)
        .map(|report| report.metrics[0].metric_value as u8)
        .filter(|code| *code != 0)
        .collect();
    let count = |code: u8| codes.iter().filter(|found| **found == code).count();
    assert_eq!([1, 2, 3, 4, 5].map(count), [4, 10, 3, 2, 1]);
    let json = &outcome.json;
    assert_eq!(number(json, &["rejections", "data_validity", "data_validity"]), 20);
    assert_eq!(number(json, &["candidates", "announced_twice"]), 1, "generator 3 at 16.5 s");
    assert_eq!(number(json, &["candidates", "unannounced"]), 1, "generator 1 at 17.1 s");
    // The first candidate of the messages at 18.0 to 18.3 s is stamped 0.35 s early.
    assert!(number(json, &["candidates", "by_generator", "DiffusionPlanner_0", "stale"]) >= 3);
}

/// At least three cycles by timer between the two anchors, none further than the fallback period from the one before.
fn hiccup_is_bridged(recorded: &[Recorded], from_ns: i64, to_ns: i64) {
    let times: Vec<i64> = validated_sets(recorded).iter().map(|(time, _)| *time).collect();
    let during = times.iter().filter(|time| (from_ns..to_ns).contains(*time)).count();
    assert!(during >= 3, "{during} cycles in the hiccup");
    let gaps = times.windows(2).map(|pair| pair[1] - pair[0]);
    assert!(gaps.max().unwrap() <= 150_000_000, "a gap of more than the fallback period");
}

#[test]
fn an_output_that_cannot_be_written_is_an_error() {
    let Some(path) = shared("data/drives/parking.mcap") else { return };
    let outcome = run(&["replay", path.to_str().unwrap(), "--output", "/proc/no/such/place.mcap"]);
    assert_eq!(outcome.exit_code, 1);
    assert_eq!(outcome.json["errors"][0]["code"], "output");
    assert!(!Path::new("/proc/no").exists());
}
