//! Stress runs say all that they promise, judge the same on any number of threads, and fail where a required bound is
//! missed. No test looks at how long anything takes: bounds are such that nothing can hold them, or nothing miss them.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

#[path = "program_support/program.rs"]
mod program;

use messages::Interface;
use program::{Run, number, run};
use serde_json::{Value, json};
use trajectory_selector::bag::{McapWriter, QosProfile, WriterOptions};
use trajectory_selector::scenario::Scenario;

const CANDIDATES: u64 = 20;
const CYCLES: u64 = 12;

/// A small load with more arguments.
fn stress(more: &[&str]) -> Run {
    let small = ["stress", "--candidates", "20", "--points", "20", "--objects", "6", "--paths", "2"];
    let cycles: &[&str] = if more.contains(&"--cycles") { &[] } else { &["--cycles", "12"] };
    run(&[&small[..], &["--generators", "3"], cycles, more].concat())
}

#[test]
fn every_scene_gives_the_whole_result() {
    for scene in ["road", "intersection", "dense"] {
        let run = stress(&["--scene", scene, "--threads", "2"]);
        let json = &run.json;
        assert_eq!(run.exit_code, 0, "{}", run.stderr);
        assert_eq!(
            (&json["command"], &json["input"]),
            (&json!("stress"), &json!({ "name": scene, "seed": 1 }))
        );
        assert_eq!(number(json, &["cycles", "anchor"]), CYCLES);
        assert_eq!(number(json, &["cycles", "cut_by_deadline"]), 0);
        assert_eq!(number(json, &["candidates", "judged"]), CYCLES * CANDIDATES);
        assert!(number(json, &["candidates", "accepted"]) > 0, "{scene}");
        assert!(number(json, &["candidates", "rejected"]) > 0, "{scene}");
        assert_eq!(json["candidates"]["by_generator"].as_object().unwrap().len(), 3);
        for stage in ["receive", "buffer", "snapshot", "observe", "judge", "rank", "publish", "cycle"] {
            assert_eq!(number(json, &["latency_us", stage, "count"]), CYCLES, "{stage}");
            for quantile in ["p50", "p90", "p99", "p999", "max"] {
                assert!(json["latency_us"][stage][quantile].is_number(), "{stage} {quantile}");
            }
        }
        for filter in ["crosswalk", "traffic_light", "vehicle_constraint", "collision_check"] {
            let stage = format!("filter.{filter}_filter");
            assert_eq!(number(json, &["latency_us", &stage, "count"]), CYCLES);
        }
        let efficiency = json["parallel_efficiency"].as_f64().unwrap();
        assert!(efficiency > 0.0 && efficiency <= 1.0, "{efficiency}");
        assert!(json["allocations"]["per_candidate_judge"].is_number());
        assert!(json["allocations"]["per_cycle"].as_f64().unwrap() > 0.0);
        for key in ["start", "warm", "most", "end"] {
            assert!(json["memory_mb"][key].as_f64().unwrap() > 0.0, "{key}");
        }
        assert_eq!(number(json, &["stores", "buffer_candidates", "most"]), CANDIDATES);
        assert_eq!(number(json, &["stores", "buffer_generators", "most"]), 3);
        for (name, store) in json["stores"].as_object().unwrap() {
            let bound = store["bound"].as_u64().unwrap_or(u64::MAX);
            assert!(store["most"].as_u64().is_some_and(|most| most <= bound), "{name}: {store}");
        }
        // Whoever has a memory tells how full it is.
        let remembering = ["crosswalk", "traffic_light", "uncrossable_boundary_departure", "collision_check"];
        for filter in remembering {
            let name = format!("filter.{filter}_filter");
            assert!(json["stores"][&name]["bound"].as_u64().unwrap() > 1000, "{name}");
        }
        assert!(number(json, &["stores", "filter.collision_check_filter", "most"]) > 0, "somebody stands");
        assert_eq!(number(json, &["stores", "ranker", "most"]), 10, "the last ten that were chosen");
        assert!(json["heap_mb"]["end"].is_number());
        assert_eq!(json["fresh_verdicts_hash"], json!(null), "only where hours are asked for");
        for (topic, received) in json["messages"].as_object().unwrap() {
            let once = topic.ends_with("lanelet2_map") || topic.ends_with("route");
            let expected = if topic.ends_with("backup") {
                0
            } else if once {
                1
            } else {
                CYCLES
            };
            assert_eq!(number(received, &["received"]), expected, "{topic}");
        }
    }
}

/// What does not depend on the machine.
fn verdicts(json: &Value) -> [&Value; 4] {
    ["candidates", "rejections", "shadow", "selected"].map(|key| &json[key])
}

#[test]
fn threads_change_no_verdict() {
    let [one, two, again] =
        ["1", "2", "2"].map(|threads| stress(&["--scene", "dense", "--threads", threads]));
    assert_eq!(verdicts(&one.json), verdicts(&two.json));
    assert_eq!(verdicts(&two.json), verdicts(&again.json));
    assert_eq!((&one.json["threads"], &two.json["threads"]), (&json!(1), &json!(2)));
    let other = stress(&["--scene", "dense", "--seed", "2"]);
    assert_ne!(verdicts(&one.json), verdicts(&other.json), "another seed is another load");
}

#[test]
fn judging_allocates_nothing_once_buffers_have_their_size() {
    for scene in ["road", "intersection", "dense"] {
        let run = stress(&["--scene", scene, "--threads", "1", "--cycles", "30"]);
        assert_eq!(run.json["allocations"]["per_candidate_judge"], json!(0.0), "{scene}");
    }
}

#[test]
fn after_a_long_run_a_load_is_judged_as_by_a_fresh_node() {
    // More than a minute of the node's clock, against a fresh node's first one.
    let hours = ["--hours", "0.02", "--scene", "dense"];
    let run = |more: &[&str]| {
        let small = ["stress", "--candidates", "12", "--points", "12", "--objects", "4", "--generators", "3"];
        run(&[&small[..], &hours[..], more].concat())
    };
    let one = run(&["--threads", "1"]);
    assert_eq!(one.exit_code, 0, "{}", one.stderr);
    assert_eq!(number(&one.json, &["cycles", "anchor"]), 720);
    assert_eq!(number(&one.json, &["cycles", "timer"]), 0, "an anchor in time arms the timer anew");
    let hash = &one.json["verdicts_hash"];
    assert!(hash.as_str().is_some_and(|hash| hash.len() == 16), "{hash}");
    assert_eq!(&one.json["fresh_verdicts_hash"], hash);
    let growth = &one.json["memory_growth_percent"];
    assert!(growth.as_f64().is_some_and(|percent| percent < 10.0), "{growth} % in a minute");
    assert_eq!(&run(&["--threads", "2"]).json["verdicts_hash"], hash);
    assert_ne!(&run(&["--seed", "2"]).json["verdicts_hash"], hash, "another load is judged otherwise");
}

fn places(run: &Run) -> Vec<&str> {
    run.json["errors"].as_array().unwrap().iter().filter_map(|error| error["where"].as_str()).collect()
}

#[test]
fn a_missed_bound_is_exit_code_3() {
    let slow = stress(&["--max-p99", "0.000001"]);
    assert_eq!((slow.exit_code, places(&slow)), (3, vec!["--max-p99"]), "{}", slow.stderr);
    assert_eq!(slow.json["errors"][0]["code"], json!("requirement"));

    let cut = stress(&["--deadline", "0.000001"]);
    assert_eq!((cut.exit_code, places(&cut)), (3, vec!["--deadline"]), "{}", cut.stderr);
    assert_eq!(number(&cut.json, &["deadline_missed"]), CYCLES);
    assert_eq!(number(&cut.json, &["cycles", "cut_by_deadline"]), CYCLES);
    assert_eq!(number(&cut.json, &["candidates", "not_judged"]), CYCLES * CANDIDATES);
    assert_eq!(number(&cut.json, &["candidates", "accepted"]), 0);

    let held = stress(&["--max-p99", "1e6", "--deadline", "1e6"]);
    assert_eq!(held.exit_code, 0, "{}", held.stderr);
    assert_eq!(number(&held.json, &["deadline_missed"]), 0);
}

#[test]
fn at_a_rate_every_message_comes() {
    let run = stress(&["--rate", "100", "--deadline", "1e6"]);
    assert_eq!(run.exit_code, 0, "{}", run.stderr);
    let anchors = &run.json["messages"]["/trajectory_selector_node/input/trajectories_generative"];
    assert_eq!(number(anchors, &["received"]), CYCLES);
    // Those that came while a cycle ran are merged into the next one.
    let cycles = number(&run.json, &["cycles", "anchor"]);
    assert!(cycles > 0 && cycles + number(&run.json, &["cycles", "coalesced"]) <= CYCLES + 1);
    assert_eq!(run.json["rate_hz"], json!(100.0));
}

#[test]
fn a_limit_that_nothing_holds_is_told() {
    let none = stress(&["--find-limit", "--rate", "max", "--deadline", "0.000001"]);
    assert_eq!((none.exit_code, places(&none)), (3, vec!["--deadline"]), "{}", none.stderr);
    let limit = &none.json["limit"];
    assert_eq!(number(limit, &["candidates"]), 0);
    let probes = limit["probes"].as_array().unwrap();
    assert_eq!(number(&probes[0], &["candidates"]), CANDIDATES);
    assert!(probes.iter().all(|probe| probe["held"] == json!(false)));
}

#[test]
fn a_drive_is_a_load_with_as_many_candidates_as_wanted() {
    let folder = tempfile::tempdir().unwrap();
    let drive = folder.path().join("drive.mcap");
    let mut writer = McapWriter::create(&drive, WriterOptions::default()).unwrap();
    let mut topics = std::collections::BTreeMap::new();
    for timed in Scenario::road(1).drive().take(300) {
        let topic = *topics.entry(timed.topic).or_insert_with(|| {
            let (name, kind) = (timed.topic.full_name(), timed.topic.type_name());
            writer.add_topic(&name, kind, "", QosProfile::default()).unwrap()
        });
        let (at_ns, cdr) = (timed.time.nanoseconds(), timed.input.to_cdr(Interface::V0_53).unwrap());
        writer.write(topic, at_ns, at_ns, cdr).unwrap();
    }
    writer.finish().unwrap();
    let drive = drive.to_str().unwrap();
    let run_drive = |more: &[&str]| run(&[&["stress", "--drive", drive, "--cycles", "5"], more].concat());
    let (recorded, more) = (run_drive(&[]), run_drive(&["--candidates", "40"]));
    for run in [&recorded, &more] {
        assert_eq!(run.exit_code, 0, "{}", run.stderr);
        assert_eq!(number(&run.json, &["cycles", "anchor"]), 5);
    }
    // Eight samples of the planner, and two backup planners that are left as they are.
    assert_eq!(number(&recorded.json, &["stores", "buffer_candidates", "most"]), 10);
    assert_eq!(number(&more.json, &["stores", "buffer_candidates", "most"]), 42);
    let contradiction = run_drive(&["--scene", "dense"]);
    assert_eq!(contradiction.exit_code, 2, "{}", contradiction.stderr);
}

/// As fast as cycles end, an anchor follows the answer to the one before, so none is merged and each is answered.
#[test]
fn the_load_goes_through_the_graph_and_comes_back() {
    // A machine that stands still for a while costs no cycle.
    let run = stress(&["--through", "ros", "--threads", "2", "--deadline", "60000"]);
    assert_eq!(run.exit_code, 0, "{}", run.stderr);
    assert_eq!(run.json["graph"], json!({ "anchors": CYCLES, "answers": CYCLES, "restarts": 0 }));
    assert_eq!(number(&run.json, &["cycles", "anchor"]), CYCLES);
    assert_eq!(number(&run.json, &["candidates", "judged"]), CYCLES * CANDIDATES);
    assert_eq!(number(&run.json, &["latency_us", "round_trip", "count"]), CYCLES);
    let alone = stress(&["--restart-planners", "1"]);
    assert_eq!(alone.exit_code, 2, "{}", alone.stderr);
}

/// Who comes back brings the map and all else anew; the node goes on, and judges as one that has just been started.
#[test]
fn planners_that_restart_at_random_are_answered_again() {
    let run = run(&[
        "stress",
        "--through",
        "ros",
        "--candidates",
        "8",
        "--points",
        "20",
        "--objects",
        "5",
        "--threads",
        "2",
        "--rate",
        "10",
        "--hours",
        "0.002",
        "--restart-planners",
        "1.5",
    ]);
    assert_eq!(run.exit_code, 0, "{}", run.stderr);
    assert!(number(&run.json, &["graph", "restarts"]) >= 2, "{}", run.json["graph"]);
    assert!(number(&run.json, &["graph", "answers"]) >= 10, "{}", run.json["graph"]);
    assert_eq!(run.json["verdicts_hash"], run.json["fresh_verdicts_hash"]);
    assert_ne!(run.json["verdicts_hash"], json!(null));
}
