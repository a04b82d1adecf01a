//! A disk that fills up in the middle of a recording ends the run with a clear error; what was written before stays
//! readable, is whole cycle by cycle, and holds nothing that was not accepted; with room again the next run is normal.
#![cfg(unix)]
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

#[path = "program_support/program.rs"]
mod program;

use messages::autoware_internal_planning_msgs::CandidateTrajectories;
use messages::autoware_trajectory_validator::ValidationReportArray;
use messages::{Interface, Message};
use program::{number, run};
use serde_json::Value;
use std::collections::BTreeMap;
use std::fs::File;
use std::path::Path;
use std::process::{Command, Stdio};
use trajectory_selector::bag;

/// Runs the demo with files limited to so many blocks of 512 bytes.
fn demo_limited(blocks: u32, threads: &str, output: &Path) -> (i32, Value) {
    let script = format!("trap '' XFSZ; ulimit -f {blocks}; exec \"$0\" \"$@\"");
    let program = env!("CARGO_BIN_EXE_trajectory-selector");
    let mut shell = Command::new("sh");
    shell.args(["-c", &script, program, "demo", "--seed", "1", "--json", "--threads", threads, "--output"]);
    let outcome = shell.arg(output).output().unwrap();
    (outcome.status.code().unwrap(), serde_json::from_slice(&outcome.stdout).unwrap())
}

#[test]
fn a_writer_that_fails_after_some_bytes_ends_the_run_and_keeps_what_is_safe() {
    let folder = tempfile::tempdir().unwrap();
    for (threads, blocks) in [("1", 0), ("1", 400), ("2", 400), ("2", 1300)] {
        let output = folder.path().join(format!("{threads}_{blocks}"));
        let (exit_code, json) = demo_limited(blocks, threads, &output);
        assert_eq!((exit_code, &json["errors"][0]["code"]), (1, &Value::from("output")), "{json}");
        let told = json["errors"][0]["message"].as_str().unwrap();
        assert!(told.contains("cannot write") && told.contains("free space and run again"), "{told}");
        let file = output.join("demo.mcap");
        assert!(std::fs::metadata(&file).unwrap().len() <= u64::from(blocks) * 1024);
        let Ok(reader) = bag::open(&file) else {
            assert_eq!(blocks, 0, "a file with room for a chunk can be opened");
            continue;
        };
        let topics: Vec<_> =
            reader.connections().iter().map(|connection| connection.topic.to_string()).collect();
        let safe: Vec<_> = reader.map_while(Result::ok).collect();
        assert!(
            told.contains(&format!("with {} messages stay readable", safe.len())),
            "{} in {told}",
            safe.len()
        );
        // By time: how many candidates were accepted, and how many left.
        let (mut accepted, mut left): (BTreeMap<i64, usize>, BTreeMap<i64, usize>) = Default::default();
        for message in &safe {
            let topic = &topics[message.connection][..];
            if topic.ends_with("/debug/validation_reports") {
                let reports =
                    ValidationReportArray::from_cdr(&message.data, Interface::V0_53, topic).unwrap();
                let passed = reports.reports.iter().filter(|report| report.risk.level == 0).count();
                accepted.insert(message.log_time_ns, passed);
            } else if topic.ends_with("/output/trajectories") {
                let set = CandidateTrajectories::from_cdr(&message.data, Interface::V0_53, topic).unwrap();
                left.insert(message.log_time_ns, set.candidate_trajectories.len());
            }
        }
        assert!(blocks == 0 || !left.is_empty());
        for (time, count) in left {
            assert!(count >= accepted[&time], "a set without its reports, or beyond them");
        }
    }
}

#[test]
fn with_room_again_the_next_run_is_as_ever() {
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("out");
    let (exit_code, _) = demo_limited(400, "2", &output);
    assert_eq!(exit_code, 1);
    let outcome = run(&["demo", "--seed", "1", "--threads", "2", "--output", output.to_str().unwrap()]);
    assert_eq!(outcome.exit_code, 0, "{}", outcome.stderr);
    assert!(
        number(&outcome.json, &["output", "messages", "/trajectory_selector_node/output/trajectories"]) > 150
    );
}

#[test]
#[cfg(target_os = "linux")]
fn an_answer_that_cannot_be_written_is_a_failure_and_nobody_reading_it_is_none() {
    let folder = tempfile::tempdir().unwrap();
    let sound = folder.path().join("sound.yaml");
    std::fs::write(&sound, "/**:\n  ros__parameters: {}\n").unwrap();
    let missing = folder.path().join("missing.yaml");
    let check = |file: &Path, json: bool, stdout: Stdio, stderr: Stdio| {
        let mut program = Command::new(env!("CARGO_BIN_EXE_trajectory-selector"));
        program.arg("check").arg(file).args(json.then_some("--json")).stdout(stdout).stderr(stderr);
        let outcome = program.spawn().unwrap().wait_with_output().unwrap();
        (outcome.status.code().unwrap(), String::from_utf8(outcome.stderr).unwrap())
    };
    let full = || Stdio::from(File::options().write(true).open("/dev/full").unwrap());
    // A pipe whose reader is gone.
    let nobody = || Stdio::from(std::io::pipe().unwrap().1);
    for json in [false, true] {
        let (exit_code, told) = check(&sound, json, full(), Stdio::piped());
        assert_eq!(exit_code, 1, "{told}");
        assert!(told.contains("cannot be written to stdout: No space left"), "{told}");
        // What failed before says more, and nobody has to hear it.
        assert_eq!(check(&missing, json, full(), full()).0, 2);
        assert_eq!(check(&missing, json, nobody(), nobody()).0, 2);
        assert_eq!(check(&sound, json, nobody(), Stdio::piped()), (0, String::new()));
    }
}
