//! A profile names every stage, keeps a sample of every cycle, tells the worst cycles and why, gives a trace that other
//! programs read, and is held against another profile. No test looks at how long anything takes.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

#[path = "program_support/program.rs"]
mod program;

use messages::Interface;
use program::{number, run};
use serde_json::{Value, json};
use std::path::Path;
use trajectory_selector::bag::{McapWriter, QosProfile, WriterOptions};
use trajectory_selector::scenario::Scenario;

/// Records the first two seconds of a generated drive.
fn record(path: &Path) {
    let mut writer = McapWriter::create(path, WriterOptions::default()).unwrap();
    let mut topics = std::collections::BTreeMap::new();
    let scenario = Scenario::road(1);
    let end_ns = scenario.span().0.nanoseconds() + 2_000_000_000;
    for timed in scenario.drive().take_while(|timed| timed.time.nanoseconds() < end_ns) {
        let topic = *topics.entry(timed.topic).or_insert_with(|| {
            let (name, kind) = (timed.topic.full_name(), timed.topic.type_name());
            writer.add_topic(&name, kind, "", QosProfile::default()).unwrap()
        });
        let (at_ns, cdr) = (timed.time.nanoseconds(), timed.input.to_cdr(Interface::V0_53).unwrap());
        writer.write(topic, at_ns, at_ns, cdr).unwrap();
    }
    writer.finish().unwrap();
}

#[test]
fn stages_samples_and_worst_cycles() {
    let folder = tempfile::tempdir().unwrap();
    let drive = folder.path().join("drive.mcap");
    record(&drive);
    let drive = drive.to_str().unwrap();
    let profile = run(&["profile", drive, "--runs", "2", "--threads", "2", "--worst", "3"]);
    assert_eq!(profile.exit_code, 0, "{}", profile.stderr);
    let json = &profile.json;
    assert_eq!((&json["command"], &json["ok"], &json["runs"]), (&json!("profile"), &json!(true), &json!(2)));
    let cycles = number(json, &["cycles", "anchor"]) + number(json, &["cycles", "timer"]);
    for stage in [
        "cycle",
        "receive",
        "buffer",
        "wait",
        "snapshot",
        "observe",
        "judge",
        "rank",
        "report",
        "publish",
        "hand_over",
        "filter.vehicle_constraint_filter",
        "filter.collision_check_filter",
    ] {
        let runs = json["samples_us"][stage].as_array().unwrap();
        assert_eq!(runs.len(), 2, "{stage}");
        let samples: usize = runs.iter().map(|run| run.as_array().unwrap().len()).sum();
        assert_eq!(number(json, &["latency_us", stage, "count"]), samples as u64, "{stage}");
    }
    assert_eq!(number(json, &["latency_us", "cycle", "count"]), 2 * cycles);
    let efficiency = json["parallel_efficiency"].as_f64().unwrap();
    assert!(efficiency > 0.0 && efficiency <= 1.0, "{efficiency}");
    assert!(json["allocations"]["per_cycle"].as_f64().unwrap() > 0.0);

    let worst = json["worst"].as_array().unwrap();
    let took = |cycle: &Value| cycle["cycle_us"].as_f64().unwrap();
    assert_eq!(worst.len(), 3);
    assert!(worst.windows(2).all(|pair| took(&pair[0]) >= took(&pair[1])));
    assert!(worst.iter().all(|cycle| !cycle["cause"].as_str().unwrap().is_empty()));

    let replay = run(&["replay", drive]);
    assert_eq!(json["candidates"], replay.json["candidates"], "measuring changes no verdict");
    assert_eq!(json["rejections"], replay.json["rejections"]);
}

#[test]
fn a_trace_has_a_span_for_every_cycle_chunk_and_filter() {
    let folder = tempfile::tempdir().unwrap();
    let (drive, trace) = (folder.path().join("drive.mcap"), folder.path().join("trace.json"));
    record(&drive);
    let profile = run(&[
        "profile",
        drive.to_str().unwrap(),
        "--runs",
        "1",
        "--threads",
        "2",
        "--trace",
        trace.to_str().unwrap(),
    ]);
    assert_eq!(profile.exit_code, 0, "{}", profile.stderr);
    let text = std::fs::read_to_string(&trace).unwrap();
    let parsed: Value = serde_json::from_str(&text).unwrap();
    let events = parsed["traceEvents"].as_array().unwrap();
    let spans: Vec<&Value> = events.iter().filter(|event| event["ph"] == "X").collect();
    assert!(spans.iter().all(|span| span["ts"].is_number() && span["dur"].is_number()));
    let named = |name: &str| spans.iter().filter(|span| span["name"] == name).count();
    let json = &profile.json;
    let cycles = number(json, &["cycles", "anchor"]) + number(json, &["cycles", "timer"]);
    let of_cycles = spans.iter().filter(|span| span["name"].as_str().unwrap().starts_with("cycle "));
    assert_eq!(of_cycles.count() as u64, cycles);
    let judged: u64 = spans
        .iter()
        .filter(|span| span["name"] == "chunk")
        .map(|chunk| number(chunk, &["args", "candidates"]))
        .sum();
    assert_eq!(judged, number(json, &["candidates", "judged"]));
    assert!(named("chunk") > 0);
    let stages = json["latency_us"].as_object().unwrap().keys();
    let filters: Vec<&str> = stages.filter_map(|stage| stage.strip_prefix("filter.")).collect();
    assert_eq!(filters.len(), 6);
    for filter in filters {
        assert_eq!(named(filter), named("chunk"), "every chunk says what {filter} took of it");
    }
    let names: Vec<&Value> =
        events.iter().filter(|event| event["ph"] == "M").map(|event| &event["args"]["name"]).collect();
    assert!(names.contains(&&json!("cycles")) && names.contains(&&json!("judge-0")), "{names:?}");
}

/// A profile of three runs whose cycles take about so long.
fn profile(path: &Path, judge_us: f64) {
    let runs: Vec<Vec<f64>> = (0..3)
        .map(|run| {
            (0..50).map(|cycle| judge_us * (1.0 + f64::from((run + cycle * 7) % 10) / 100.0)).collect()
        })
        .collect();
    let profile = json!({
        "input": { "name": "drive" }, "settings_hash": "5", "threads": 2,
        "samples_us": { "judge": runs, "publish": vec![vec![10.0; 50]; 3] },
    });
    std::fs::write(path, profile.to_string()).unwrap();
}

#[test]
fn a_comparison_has_a_verdict_for_every_stage() {
    let folder = tempfile::tempdir().unwrap();
    let (a, b) = (folder.path().join("a.json"), folder.path().join("b.json"));
    profile(&a, 100.0);
    profile(&b, 150.0);
    let (a, b) = (a.to_str().unwrap(), b.to_str().unwrap());
    let verdicts = |first, second| {
        let compared = run(&["profile", "--compare", first, second]);
        assert_eq!(compared.exit_code, 0, "{}", compared.stderr);
        let stages = &compared.json["stages"];
        (stages["judge"]["verdict"].clone(), stages["publish"]["verdict"].clone())
    };
    assert_eq!(verdicts(a, b), (json!("slower"), json!("same")));
    assert_eq!(verdicts(b, a), (json!("faster"), json!("same")));
    assert_eq!(verdicts(a, a), (json!("same"), json!("same")));
}

#[test]
fn what_is_no_profile_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("other.json");
    std::fs::write(&path, "{}").unwrap();
    let path = path.to_str().unwrap();
    let refused = run(&["profile", "--compare", path, path]);
    assert_eq!(refused.exit_code, 2, "{}", refused.stderr);
    assert_eq!(refused.json["errors"][0]["where"], json!(path));
    assert_eq!(run(&["profile"]).exit_code, 2, "a drive is needed where nothing is compared");
}
