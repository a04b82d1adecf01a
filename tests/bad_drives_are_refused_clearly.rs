//! A drive that does not exist, is no recording, is cut off, carries something else on a known topic, or has no map: a
//! clear message, exit code 1 or 2, and what was already written stays readable.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

#[path = "program_support/program.rs"]
mod program;

use messages::Interface;
use messages::Message;
use messages::nav_msgs::Odometry;
use messages::std_msgs::Text;
use program::{Run, read, run, shared, validated_sets};
use std::fs;
use std::path::Path;
use trajectory_selector::bag::{McapWriter, QosProfile, WriterOptions};

fn replay(drive: &Path) -> Run {
    run(&["replay", drive.to_str().unwrap()])
}

fn error(outcome: &Run) -> (i32, &str, &str) {
    let error = &outcome.json["errors"][0];
    assert_eq!(outcome.json["ok"], false);
    assert_eq!(outcome.json["exit_code"], outcome.exit_code);
    let (code, message) = (error["code"].as_str().unwrap(), error["message"].as_str().unwrap());
    assert!(outcome.stderr.contains(message), "people see it too: {}", outcome.stderr);
    (outcome.exit_code, code, message)
}

/// A recording with one message on each of these topics.
fn recording<M: Message + Default>(path: &Path, topics: &[&str]) {
    let mut writer = McapWriter::create(path, WriterOptions::default()).unwrap();
    for topic in topics {
        let definition = M::definition(Interface::V0_53);
        let id = writer.add_topic(topic, M::TYPE_NAME, &definition, QosProfile::default()).unwrap();
        writer.write(id, 1_000_000_000, 1_000_000_000, M::default().to_cdr(Interface::V0_53)).unwrap();
    }
    writer.finish().unwrap();
}

#[test]
fn a_drive_that_does_not_exist() {
    let outcome = replay(Path::new("/no/such/drive.mcap"));
    let (exit_code, code, message) = error(&outcome);
    assert_eq!((exit_code, code), (1, "not_found"));
    assert!(message.contains("/no/such/drive.mcap"), "{message}");
}

#[test]
fn a_file_that_is_no_recording() {
    let folder = tempfile::tempdir().unwrap();
    for (name, content) in
        [("text.mcap", "this is no recording, and longer than a magic number"), ("empty.mcap", "")]
    {
        let path = folder.path().join(name);
        fs::write(&path, content).unwrap();
        let outcome = replay(&path);
        assert_eq!((error(&outcome).0, error(&outcome).1), (1, "no_bag"), "{name}");
    }
    let outcome = replay(folder.path());
    assert_eq!((error(&outcome).0, error(&outcome).1), (1, "no_bag"), "a folder without a recording");
}

#[test]
fn a_drive_without_a_map() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("no_map.mcap");
    recording::<Odometry>(&path, &["/trajectory_selector_node/input/odometry"]);
    let outcome = replay(&path);
    let (exit_code, code, message) = error(&outcome);
    assert_eq!((exit_code, code), (2, "no_map"));
    assert!(message.contains("--map"), "{message}");
}

#[test]
fn an_unknown_type_on_a_known_topic() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("wrong.mcap");
    recording::<Text>(&path, &["/trajectory_selector_node/input/odometry"]);
    let outcome = replay(&path);
    let (exit_code, code, message) = error(&outcome);
    assert_eq!((exit_code, code), (1, "wrong_type"));
    assert!(
        message.contains("std_msgs/msg/String") && message.contains("nav_msgs/msg/Odometry"),
        "{message}"
    );
}

#[test]
fn a_drive_with_none_of_our_topics_can_be_remapped() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("foreign.mcap");
    recording::<Odometry>(&path, &["/localization/kinematic_state"]);
    let outcome = replay(&path);
    assert_eq!((error(&outcome).0, error(&outcome).1), (1, "no_inputs"));
    assert!(error(&outcome).2.contains("/localization/kinematic_state"));
    let remapped = run(&[
        "replay",
        path.to_str().unwrap(),
        "--remap",
        "/localization/kinematic_state:=~/input/odometry",
    ]);
    assert_eq!(error(&remapped).1, "no_map", "the topic is ours now, only the map is missing");
}

#[test]
fn wrong_usage_and_settings() {
    let outcome = run(&["replay"]);
    assert_eq!((error(&outcome).0, error(&outcome).1), (2, "usage"));
    let folder = tempfile::tempdir().unwrap();
    let parameters = folder.path().join("bad.param.yaml");
    fs::write(&parameters, "/**:\n  ros__parameters:\n    fallback_period: 100\n").unwrap();
    let outcome = run(&["demo", "--params", parameters.to_str().unwrap()]);
    let (exit_code, code, message) = error(&outcome);
    assert_eq!((exit_code, code), (2, "settings"));
    assert!(message.contains("bad.param.yaml:3") && message.contains("fallback_period_ms"), "{message}");
}

#[test]
fn a_drive_that_is_cut_in_the_middle_keeps_what_was_written() {
    let Some(whole) = shared("data/drives/intersection.mcap") else { return };
    let folder = tempfile::tempdir().unwrap();
    let (cut, output) = (folder.path().join("cut.mcap"), folder.path().join("out.mcap"));
    let bytes = fs::read(whole).unwrap();
    fs::write(&cut, &bytes[..bytes.len() / 2]).unwrap();
    let outcome = run(&["replay", cut.to_str().unwrap(), "--output", output.to_str().unwrap()]);
    assert_eq!((error(&outcome).0, error(&outcome).1), (1, "truncated"));
    assert!(validated_sets(&read(&output)).len() > 50, "the first half was judged and written");
}

#[test]
fn the_wrong_interface_is_told_with_a_hint() {
    let Some(drive) = shared("data/drives/intersection_052.mcap") else { return };
    let outcome = run(&["replay", drive.to_str().unwrap(), "--interface", "0.53"]);
    let topic = "/trajectory_selector_node/input/trajectories_generative";
    let received = &outcome.json["messages"][topic];
    assert_eq!(received["received"], received["dropped"]["malformed"]);
    assert_eq!((error(&outcome).0, error(&outcome).1), (1, "malformed_message"));
    assert!(error(&outcome).2.contains("--interface"), "{}", error(&outcome).2);
}

#[test]
fn a_map_from_a_file_serves_a_drive_without_one() {
    let (Some(drive), Some(map)) =
        (shared("data/drives/intersection.mcap"), shared("data/maps/scenario_simulator_v2/intersection.bin"))
    else {
        return;
    };
    let own = run(&["replay", drive.to_str().unwrap()]);
    let other = run(&["replay", drive.to_str().unwrap(), "--map", map.to_str().unwrap()]);
    assert_eq!((own.exit_code, other.exit_code), (0, 0), "{}{}", own.stderr, other.stderr);
    assert_eq!(own.json["candidates"], other.json["candidates"], "the same map from elsewhere");
    let broken = run(&["replay", drive.to_str().unwrap(), "--map", drive.to_str().unwrap()]);
    assert_eq!(error(&broken).1, "map");
}
