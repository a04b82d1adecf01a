//! Runs the program as a user does, and reads what it wrote.
#![allow(
    dead_code,
    clippy::unwrap_used,
    clippy::panic,
    reason = "each test uses some of these; tests fail by panicking"
)]

use messages::autoware_internal_planning_msgs::CandidateTrajectories;
use messages::autoware_trajectory_validator::ValidationReportArray;
use messages::{Interface, Message};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Command;
use trajectory_selector::bag;

/// What one run of the program gave.
#[derive(Debug)]
pub(crate) struct Run {
    pub(crate) exit_code: i32,
    /// The one JSON object on stdout.
    pub(crate) json: Value,
    pub(crate) stderr: String,
}

/// Runs the program with `--json`.
pub(crate) fn run(arguments: &[&str]) -> Run {
    let output = Command::new(env!("CARGO_BIN_EXE_trajectory-selector"))
        .args(arguments)
        .arg("--json")
        .output()
        .unwrap();
    let stdout = String::from_utf8(output.stdout).unwrap();
    let stderr = String::from_utf8(output.stderr).unwrap();
    let json = serde_json::from_str(&stdout).unwrap_or_else(|error| panic!("{error} in {stdout}\n{stderr}"));
    Run { exit_code: output.status.code().unwrap(), json, stderr }
}

/// The folder of recorded data beside the project, or a visible line and `None` where it is absent.
pub(crate) fn shared(path: &str) -> Option<PathBuf> {
    let root = std::env::var_os("SELECTOR_SHARED")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared"), PathBuf::from);
    let path = root.join(path);
    if path.exists() {
        return Some(path);
    }
    eprintln!("skipped: {} is not there", path.display());
    None
}

/// A number in the JSON, by its path of keys.
pub(crate) fn number(json: &Value, keys: &[&str]) -> u64 {
    let found = keys.iter().fold(json, |value, key| &value[*key]);
    found.as_u64().unwrap_or_else(|| panic!("{keys:?} is {found}"))
}

/// A recorded message: topic, log time in ns, payload.
pub(crate) type Recorded = (String, i64, Vec<u8>);

/// All messages of a recording; panics if it is not whole.
pub(crate) fn read(path: &Path) -> Vec<Recorded> {
    let reader = bag::open(path).unwrap();
    let topics: Vec<_> = reader.connections().iter().map(|connection| connection.topic.to_string()).collect();
    reader
        .map(|message| message.unwrap())
        .map(|message| (topics[message.connection].clone(), message.log_time_ns, message.data))
        .collect()
}

/// The messages of one topic whose name ends like this, decoded, with their log times.
pub(crate) fn decode<M: Message>(recorded: &[Recorded], topic: &str, interface: Interface) -> Vec<(i64, M)> {
    recorded
        .iter()
        .filter(|(name, ..)| name.ends_with(topic))
        .map(|(name, time, data)| (*time, M::from_cdr(data, interface, name).unwrap()))
        .collect()
}

/// The validated sets of a recording.
pub(crate) fn validated_sets(recorded: &[Recorded]) -> Vec<(i64, CandidateTrajectories)> {
    decode(recorded, "/output/trajectories", Interface::V0_53)
}

/// The validation reports of a recording.
pub(crate) fn reports(recorded: &[Recorded]) -> Vec<(i64, ValidationReportArray)> {
    decode(recorded, "/debug/validation_reports", Interface::V0_53)
}
