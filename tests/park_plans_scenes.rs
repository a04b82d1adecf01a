//! `park`: what it answers for the shipped scenes, for scenes without a plan, and for files that are no scenes.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

#[path = "program_support/program.rs"]
mod program;

use program::run;
use serde_json::Value;
use std::path::{Path, PathBuf};

fn shipped() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("config/scenes");
    let mut scenes: Vec<_> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    scenes.sort();
    scenes
}

fn number(value: &Value, key: &str) -> f64 {
    value[key].as_f64().unwrap_or_else(|| panic!("{key} is {}", value[key]))
}

/// The rules that the answer states for its trajectory.
fn assert_keeps_the_contract(answer: &Value) {
    let points = answer["trajectory"].as_array().unwrap();
    for pair in points.windows(2) {
        let step = |key: &str| number(&pair[1], key) - number(&pair[0], key);
        assert!(step("t") > 0.0 && step("t") <= 0.1 + 1e-9, "{pair:?}");
        assert!(step("x").hypot(step("y")) <= 0.1 + 1e-9, "{pair:?}");
    }
    for point in points {
        let (speed, forward) = (number(point, "v"), point["gear"] == "forward");
        assert!(speed == 0.0 || (speed > 0.0) == forward, "{point}");
    }
    let (first, last) = (&points[0], points.last().unwrap());
    assert_eq!(number(first, "t"), 0.0);
    assert_eq!((number(last, "v"), number(last, "a")), (0.0, 0.0));
}

#[test]
fn every_shipped_scene_is_planned_and_drawn() {
    let scenes = shipped();
    assert!(scenes.len() >= 7);
    let folder = tempfile::tempdir().unwrap();
    for scene in scenes {
        let page = folder.path().join("page.html");
        let ran = run(&["park", scene.to_str().unwrap(), "--report", page.to_str().unwrap()]);
        assert_eq!((ran.exit_code, &ran.json["status"]), (0, &"planned".into()), "{}", ran.json);
        assert_eq!(ran.json["scene"].as_str().unwrap(), scene.file_stem().unwrap());
        assert_eq!((&ran.json["stage"], &ran.json["reason"]), (&"timed".into(), &Value::Null));
        assert!(number(&ran.json, "end_error_m") < 0.05 && number(&ran.json, "end_error_rad") < 0.017);
        assert!(number(&ran.json, "min_clearance_m") > 0.0 && number(&ran.json, "length_m") > 1.0);
        for step in ["heuristic", "search", "smooth", "speed", "total"] {
            assert!(number(&ran.json["times_ms"], step) > 0.0, "{step}");
        }
        assert_keeps_the_contract(&ran.json);
        let page = std::fs::read_to_string(page).unwrap();
        assert!(page.len() < 2_000_000 && !page.contains("{{"));
        // Names of the XML namespace are the only addresses on it.
        let addresses = page.matches("http").count();
        assert_eq!(addresses, page.matches("http://www.w3.org/2000/svg").count(), "nothing is loaded");
    }
}

fn scene(text: &str) -> tempfile::NamedTempFile {
    let file = tempfile::Builder::new().suffix(".yaml").tempfile().unwrap();
    std::fs::write(file.path(), text).unwrap();
    file
}

#[test]
fn a_goal_that_nobody_can_reach_is_an_answer_with_a_reason() {
    let walled_in = scene(
        "bounds: [-10.0, 30.0, -10.0, 10.0]\nobstacles:\n  - [[10.0, -10.0], [10.0, 10.0]]\n\
         start: {x: 0.0, y: 0.0, yaw: 0.0}\ngoal: {x: 20.0, y: 0.0, yaw: 0.0}\n",
    );
    let ran = run(&["park", walled_in.path().to_str().unwrap()]);
    assert_eq!((ran.exit_code, &ran.json["status"]), (1, &"failed".into()), "{}", ran.json);
    assert!(ran.json["reason"].as_str().is_some_and(|reason| reason.len() > 10), "{}", ran.json["reason"]);
    assert_eq!(ran.json["trajectory"], Value::Array(Vec::new()));
    assert_eq!(ran.json["errors"][0]["code"], "no_plan");
}

#[test]
fn out_of_time_is_said_and_nothing_unchecked_is_handed_out() {
    let tight = shipped().into_iter().find(|path| path.ends_with("perpendicular_forward.yaml")).unwrap();
    let ran = run(&["park", tight.to_str().unwrap(), "--deadline", "1"]);
    match ran.json["status"].as_str().unwrap() {
        "failed" => assert_eq!(ran.exit_code, 1),
        "best_effort" => assert_keeps_the_contract(&ran.json),
        other => panic!("{other} within a millisecond"),
    }
    assert!(ran.json["reason"].is_string());
}

#[test]
fn a_file_that_is_no_scene_is_refused_with_its_line() {
    for (text, line, what) in [
        ("bounds: [0, 1]\nstart: {x: 0, y: 0, yaw: 0}\ngoal: {x: 0, y: 0, yaw: 0}\n", ":1:", "four numbers"),
        (
            "bounds: [-9, 9, -9, 9]\nstart: {x: 0, y: .nan, yaw: 0}\ngoal: {x: 0, y: 0, yaw: 0}\n",
            ":2:",
            "start.y",
        ),
        ("bounds: [-9, 9, -9, 9]\nstart: {x: 0, y: 0, yaw: 0}\ngaol: {x: 0, y: 0, yaw: 0}\n", ":3:", "goal"),
    ] {
        let file = scene(text);
        let ran = run(&["park", file.path().to_str().unwrap()]);
        assert_eq!(ran.exit_code, 2, "{}", ran.json);
        let message = ran.json["errors"][0]["message"].as_str().unwrap();
        assert!(message.contains(line) && message.contains(what), "{message}");
    }
}
