//! The report of `check`, for machines and for people.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may fail loudly")]
use std::path::PathBuf;

use serde_json::json;
use trajectory_selector::commands::check::{self, FileProblem};

/// A folder of its own for each test, removed at the end.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("settings_check_{}_{name}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    fn file(&self, name: &str, text: &str) -> PathBuf {
        let path = self.0.join(name);
        std::fs::write(&path, text).unwrap();
        path
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn no_maps(_: &std::path::Path) -> Vec<FileProblem> {
    panic!("no map was given")
}

#[test]
fn the_report_has_the_promised_form() {
    let folder = Folder::new("form");
    let good = folder.file("good.yaml", "/**:\n  ros__parameters:\n    duration_time: 0.3\n");
    let bad = folder
        .file("bad.yaml", "/**:\n  ros__parameters:\n    fallback_period: 150\n    duration_time: -1.0\n");
    let report = check::run(&[good.clone(), bad.clone()], None, no_maps);
    assert!(!report.ok());
    assert_eq!(
        serde_json::to_value(&report).unwrap(),
        json!({ "files": [
            { "path": good, "kind": "parameters", "problems": [] },
            { "path": bad, "kind": "parameters", "problems": [
                {
                    "line": 3, "column": 5, "key": "fallback_period",
                    "message": "`fallback_period` is no parameter of this node",
                    "allowed": null, "nearest": "fallback_period_ms",
                },
                {
                    "line": 4, "column": 5, "key": "duration_time",
                    "message": "`duration_time` is -1.0, outside its range",
                    "allowed": "at least 0.0 s", "nearest": null,
                },
            ] },
        ] })
    );
    let (good, bad) = (good.display(), bad.display());
    assert_eq!(
        report.to_string(),
        format!(
            "{good}: ok\n\
             {bad}:3:5: `fallback_period` is no parameter of this node (did you mean `fallback_period_ms`?)\n\
             {bad}:4:5: `duration_time` is -1.0, outside its range (allowed: at least 0.0 s)\n"
        )
    );
}

#[test]
fn a_missing_file_is_a_problem_without_a_line() {
    let report = check::run(&["no/such.yaml".into()], None, no_maps);
    let problem = &report.files[0].problems[0];
    assert_eq!((problem.line, problem.column), (None, None));
    assert!(report.to_string().starts_with("no/such.yaml: cannot be read: "), "{report}");
}

#[test]
fn blocks_for_the_node_in_any_namespace_are_checked() {
    let folder = Folder::new("namespace");
    let file =
        folder.file("a.yaml", "/planning/trajectory_selector_node:\n  ros__parameters: {duration_time: 1}\n");
    assert_eq!(check::run(std::slice::from_ref(&file), None, no_maps).files[0].problems.len(), 1);
    let report = check::run(&[file], Some("selector"), no_maps);
    let message = &report.files[0].problems[0].message;
    assert_eq!(
        message,
        "no block for the node `selector`; the file has blocks for `/planning/trajectory_selector_node`"
    );
}

#[test]
fn files_are_checked_together_as_the_node_would_load_them() {
    let folder = Folder::new("together");
    let levels =
        folder.file("levels.yaml", "/**:\n  ros__parameters:\n    source.levels: [backup_planner_go]\n");
    let penalty = folder.file("penalty.yaml", "/**:\n  ros__parameters:\n    source.penalty: [0.1]\n");
    let alone = check::run(std::slice::from_ref(&levels), None, no_maps);
    assert_eq!(alone.files[0].problems.len(), 1, "{alone}");
    assert!(check::run(&[levels, penalty], None, no_maps).ok());
}

#[test]
fn maps_go_to_their_own_checker() {
    let folder = Folder::new("maps");
    let parameters = folder.file("a.yaml", "/**:\n  ros__parameters:\n    x: 1\n");
    let report = check::run(&["a.osm".into(), parameters, "b.bin".into()], None, |path| {
        let message = format!("{} looked at", path.display());
        vec![FileProblem { message, ..FileProblem::default() }]
    });
    assert_eq!(serde_json::to_value(report.files[0].kind).unwrap(), "map");
    assert_eq!(report.files[0].problems[0].message, "a.osm looked at");
    assert_eq!(report.files[1].problems[0].key.as_deref(), Some("x"));
    assert_eq!(report.files[2].problems[0].message, "b.bin looked at");
}
