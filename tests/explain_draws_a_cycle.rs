//! `explain` tells why the candidates of a cycle were accepted or rejected, and draws the cycle.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

#[path = "program_support/program.rs"]
mod program;

use program::{run, shared};
use std::fs;

/// Small enough for a message or a report, also with many candidates on a real map.
const MOST_BYTES: usize = 60_000;

#[test]
fn a_cycle_of_a_drive_is_drawn() {
    for (drive, cycle) in [("crosswalk.mcap", "40"), ("intersection.mcap", "25"), ("stress.mcap", "3")] {
        let Some(path) = shared(&format!("data/drives/{drive}")) else { return };
        let (folder, drive_path) = (tempfile::tempdir().unwrap(), path.to_str().unwrap());
        let file = folder.path().join("cycle.svg");
        let explain = ["explain", drive_path, "--cycle", cycle];
        let with_picture = run(&[&explain[..], &["--picture", file.to_str().unwrap()]].concat());
        assert_eq!(with_picture.exit_code, 0, "{drive}: {}", with_picture.stderr);
        assert_eq!(with_picture.json, run(&explain).json, "{drive}: the picture changes no word");
        let picture = fs::read_to_string(&file).unwrap();
        assert!(picture.starts_with("<svg xmlns=") && picture.ends_with("</svg>\n"), "{drive}");
        assert!(
            picture.contains(&format!("Cycle {cycle}: ")) && picture.contains("class=\"road\""),
            "{drive}"
        );
        assert!(picture.len() < MOST_BYTES, "{drive}: {} bytes", picture.len());
    }
}

#[test]
fn the_wanted_candidate_is_looked_at() {
    let Some(path) = shared("data/drives/crosswalk.mcap") else { return };
    let (folder, drive) = (tempfile::tempdir().unwrap(), path.to_str().unwrap());
    let all = run(&["explain", drive, "--cycle", "40"]);
    for candidate in all.json["candidates"].as_array().unwrap().iter().step_by(3) {
        let (key, generator) = (candidate["key"].as_str().unwrap(), candidate["generator"].as_str().unwrap());
        let file = folder.path().join("cycle.svg");
        let one = run(&[
            "explain",
            drive,
            "--cycle",
            "40",
            "--candidate",
            key,
            "--picture",
            file.to_str().unwrap(),
        ]);
        assert_eq!(one.json["candidates"].as_array().unwrap().len(), 1);
        let verdict = if candidate["accepted"] == true { "accepted" } else { "rejected" };
        let picture = fs::read_to_string(&file).unwrap();
        let (name, _) = picture.split_once(&format!(" is {verdict}</text>")).unwrap();
        assert!(name.rsplit('>').next().unwrap().contains(generator), "{key}");
    }
}

#[test]
fn where_no_picture_can_go_is_said() {
    let Some(path) = shared("data/drives/crosswalk.mcap") else { return };
    let drive = path.to_str().unwrap();
    let usage = run(&["explain", drive, "--cycle", "40", "--picture", "cycle.png"]);
    assert_eq!((usage.exit_code, &usage.json["errors"][0]["code"]), (2, &"usage".into()));
    assert!(usage.stderr.contains(".svg"), "{}", usage.stderr);
    let nowhere = run(&["explain", drive, "--cycle", "40", "--picture", "/no/such/folder/cycle.svg"]);
    assert_eq!((nowhere.exit_code, &nowhere.json["errors"][0]["code"]), (1, &"output".into()));
}
