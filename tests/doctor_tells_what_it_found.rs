//! `doctor` looks at the host it runs on and answers as every command does, well or not.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may fail loudly")]

#[path = "program_support/program.rs"]
mod program;

use serde_json::Value;
use std::process::Command;

#[test]
fn this_host() {
    let program::Run { exit_code, json, .. } = program::run(&["doctor"]);
    assert_eq!(json["command"], "doctor");
    let checks = json["checks"].as_array().unwrap();
    let count = |status: &str| checks.iter().filter(|check| check["status"] == status).count();
    assert_eq!(count("ok") + count("warn") + count("fail"), checks.len());
    assert!(checks.len() >= 8, "{json}");
    assert_eq!(json["errors"].as_array().unwrap().len(), count("fail"));
    assert_eq!(json["warnings"].as_array().unwrap().len(), count("warn"));
    assert_eq!(exit_code, if count("fail") > 0 { 3 } else { 0 }, "{json}");
    assert_eq!(json["ok"], exit_code == 0);
}

#[test]
fn a_host_on_which_the_node_would_not_start() {
    let output = Command::new(env!("CARGO_BIN_EXE_trajectory-selector"))
        .args(["doctor", "--json"])
        .env("ROS_DOMAIN_ID", "elephant")
        .output()
        .unwrap();
    let json: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(output.status.code(), Some(3));
    let error = &json["errors"][0];
    assert_eq!((&error["code"], &error["where"]), (&"requirement".into(), &"environment".into()));
    assert!(error["message"].as_str().unwrap().contains("ROS_DOMAIN_ID is `elephant`"), "{error}");

    let text = Command::new(env!("CARGO_BIN_EXE_trajectory-selector"))
        .arg("doctor")
        .env("ROS_DOMAIN_ID", "elephant")
        .output()
        .unwrap();
    let text = String::from_utf8(text.stdout).unwrap();
    assert!(text.starts_with("FAIL  environment     ROS_DOMAIN_ID is `elephant`"), "{text}");
}
