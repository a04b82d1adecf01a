//! What the program writes is read back, message by message, by two programs that are not ours: `rosbags` and
//! `mcap-ros2-support`.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

#[path = "program_support/program.rs"]
mod program;

use program::run;
use std::path::Path;
use std::process::Command;

/// Exit code of the script where Python or its packages cannot be had.
const UNAVAILABLE: i32 = 77;

#[test]
fn two_other_programs_read_the_demo() {
    let folder = tempfile::tempdir().unwrap();
    let outcome = run(&["demo", "--output", folder.path().to_str().unwrap()]);
    assert_eq!(outcome.exit_code, 0, "{}", outcome.stderr);
    let recording = outcome.json["output"]["path"].as_str().unwrap();

    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/readback/run.sh");
    let reading = Command::new("bash").arg(script).arg(recording).output().unwrap();
    let stdout = String::from_utf8_lossy(&reading.stdout);
    let stderr = String::from_utf8_lossy(&reading.stderr);
    if reading.status.code() == Some(UNAVAILABLE) {
        let required =
            std::env::var_os("SELECTOR_REQUIRE_PEERS").is_some() || std::env::var_os("CI").is_some();
        assert!(!required, "the other programs are required here: {stderr}");
        eprintln!("skipped: {stderr}");
        return;
    }
    assert!(reading.status.success(), "{stdout}{stderr}");
    for (topic, count) in outcome.json["output"]["messages"].as_object().unwrap() {
        let line = stdout.lines().find(|line| line.split_whitespace().any(|word| word == topic));
        let line = line.unwrap_or_else(|| panic!("{topic} was not read:\n{stdout}"));
        let expected = count.to_string();
        let counts = line.split_whitespace().filter(|word| *word == expected).count();
        assert!(counts >= 2, "both programs read {count} of {topic}: {line}");
    }
}
