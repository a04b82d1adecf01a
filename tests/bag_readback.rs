//! What the program writes is read by two programs that are not ours.

use std::{
    path::Path,
    process::{Command, Output},
};

use trajectory_selector::bag::{Durability, McapWriter, QosProfile, Reliability, WriterOptions};

const NOT_AVAILABLE: i32 = 77;

/// Runs the readers; `None` where they cannot be had and need not be.
fn read_back(path: &Path) -> Option<Output> {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/readback/run.sh");
    let output = Command::new("bash").arg(script).arg(path).output().expect("bash starts");
    if output.status.code() != Some(NOT_AVAILABLE) {
        return Some(output);
    }
    let reason = String::from_utf8_lossy(&output.stderr).into_owned();
    let required = std::env::var_os("CI").is_some()
        || std::env::var("SELECTOR_REQUIRE_PEERS").is_ok_and(|value| value == "1");
    assert!(!required, "the readers are required here: {reason}");
    eprintln!("skipped: {}", reason.lines().last().unwrap_or("the readers are not available"));
    None
}

fn string_field(text: &str) -> Vec<u8> {
    let mut bytes = (text.len() as u32 + 1).to_le_bytes().to_vec();
    bytes.extend_from_slice(text.as_bytes());
    bytes.push(0);
    bytes
}

/// A `std_msgs/Header` in CDR.
fn header(sec: i32, nanosec: u32, frame: &str) -> Vec<u8> {
    let mut bytes = vec![0, 1, 0, 0];
    bytes.extend_from_slice(&sec.to_le_bytes());
    bytes.extend_from_slice(&nanosec.to_le_bytes());
    bytes.extend(string_field(frame));
    bytes
}

/// A `std_msgs/String` in CDR.
fn string(text: &str) -> Vec<u8> {
    let mut bytes = vec![0, 1, 0, 0];
    bytes.extend(string_field(text));
    bytes
}

/// Writes 400 messages in several chunks; `frame` makes the header's payload.
fn write(path: &Path, frame: impl Fn(i64) -> Vec<u8>) {
    let separator = "=".repeat(80);
    let header_schema = format!(
        "builtin_interfaces/Time stamp\nstring frame_id\n{separator}\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"
    );
    let latched =
        QosProfile { reliability: Reliability::Reliable, durability: Durability::TransientLocal, depth: 1 };
    let options = WriterOptions { chunk_bytes: 2000, ..WriterOptions::default() };
    let mut writer = McapWriter::create(path, options).expect("a disk with room");
    let text =
        writer.add_topic("/text", "std_msgs/msg/String", "string data\n", latched).expect("a disk with room");
    let stamps = writer
        .add_topic("/stamps", "std_msgs/msg/Header", &header_schema, QosProfile::default())
        .expect("a disk with room");
    for number in 0..200 {
        let time_ns = 1_750_000_000_000_000_000 + number * 10_000_000;
        writer.write(text, time_ns, time_ns, string(&format!("message {number}"))).expect("a disk with room");
        writer.write(stamps, time_ns + 5, time_ns, frame(number)).expect("a disk with room");
    }
    writer.finish().expect("a disk with room");
}

#[test]
fn two_other_programs_read_every_message() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.mcap");
    write(&path, |number| header(1_750_000_000, number as u32, "base_link"));
    let Some(output) = read_back(&path) else { return };
    let (said, complained) =
        (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success(), "{said}{complained}");
    for line in ["200 /stamps", "200 /text", "400 total"] {
        let words: Vec<&str> = line.split(' ').collect();
        let found = said
            .lines()
            .any(|line| line.split_whitespace().collect::<Vec<_>>() == [words[0], words[0], words[1]]);
        assert!(found, "no {line:?} in\n{said}");
    }
}

#[test]
fn a_message_that_does_not_fit_its_type_is_noticed() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.mcap");
    write(&path, |number| {
        let mut bytes = header(1_750_000_000, 0, "base_link");
        bytes.truncate(if number == 77 { 14 } else { bytes.len() });
        bytes
    });
    let Some(output) = read_back(&path) else { return };
    let complained = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{complained}");
    assert!(complained.contains("rosbags: /stamps message 77"), "{complained}");
    assert!(complained.contains("mcap-ros2: /stamps message 77"), "{complained}");
}
