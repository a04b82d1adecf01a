//! What leaves the node in one cycle: topics in order, types and quality of service, in both interfaces.
//!
//! The expected tables lie in `tests/snapshots`; whoever changes an interface changes them knowingly.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

#[path = "program_support/program.rs"]
mod program;

#[path = "program_support/cycles.rs"]
mod cycles;

use cycles::{Cycle, drive};
use messages::Interface;
use program::read;
use selector_actors::{InputTopic, OutputTopic};
use std::fmt::Write;
use trajectory_selector::bag::{self, QosProfile};

/// One line for each topic: name, type, reliability, durability, depth.
fn table(rows: impl Iterator<Item = (String, String, String)>) -> String {
    let mut text = String::new();
    for (topic, type_name, qos) in rows {
        let of = |key: &str| {
            let line = qos.lines().find_map(|line| line.trim_start_matches(['-', ' ']).strip_prefix(key));
            line.unwrap_or_else(|| panic!("no {key} in {qos}")).trim().to_owned()
        };
        let (reliability, durability, depth) = (of("reliability:"), of("durability:"), of("depth:"));
        writeln!(text, "{topic} {type_name} {reliability} {durability} {depth}").unwrap();
    }
    text
}

/// The first cycle of a generated drive with a trajectory to drive, as a recording shows it.
fn recorded_table(interface: Interface) -> String {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("drive.mcap");
    drive(1, 1.0, interface, &[], &|_, _| (), &path);
    let connections = bag::open(&path).unwrap().connections().to_vec();
    let cycles = Cycle::all(read(&path));
    let cycle = cycles.iter().find(|cycle| cycle.bytes("/output/trajectory").is_some()).unwrap();
    table(cycle.topics().into_iter().map(|topic| {
        let connection = connections.iter().find(|connection| &*connection.topic == topic).unwrap();
        let qos = connection.offered_qos.clone().unwrap();
        (topic.to_owned(), connection.type_name.to_string(), qos)
    }))
}

fn assert_equal(found: &str, expected: &str, what: &str) {
    assert!(found == expected, "{what} has changed; if that is meant, the snapshot becomes\n{found}");
}

#[test]
fn topics_order_types_and_qos_of_a_cycle_in_both_interfaces() {
    let new = recorded_table(Interface::V0_53);
    assert_equal(&new, include_str!("snapshots/outputs_0.53.txt"), "interface 0.53");
    let old = recorded_table(Interface::V0_52);
    assert_equal(&old, include_str!("snapshots/outputs_0.52.txt"), "interface 0.52");
    // The one difference: without a command in the candidates there is none to put out.
    let without: String = new
        .lines()
        .filter(|line| !line.contains("turn_indicators"))
        .map(|line| format!("{line}\n"))
        .collect();
    assert_eq!(old, without);
}

#[test]
fn what_is_advertised_is_what_a_cycle_publishes() {
    let filters = [
        "collision_check_filter",
        "crosswalk_filter",
        "out_of_lane_filter",
        "traffic_light_filter",
        "uncrossable_boundary_departure_filter",
        "vehicle_constraint_filter",
    ];
    for (interface, expected) in [
        (Interface::V0_53, include_str!("snapshots/outputs_0.53.txt")),
        (Interface::V0_52, include_str!("snapshots/outputs_0.52.txt")),
    ] {
        let rows = OutputTopic::all(interface, &filters).into_iter().map(|topic| {
            (topic.full_name(), topic.type_name().to_owned(), QosProfile::of_output(topic).to_string())
        });
        assert_equal(&table(rows), expected, "the list of outputs");
    }
}

#[test]
fn inputs_of_the_node() {
    let rows = InputTopic::ALL.into_iter().map(|topic| {
        (topic.full_name(), topic.type_name().to_owned(), QosProfile::of_input(topic).to_string())
    });
    assert_equal(&table(rows), include_str!("snapshots/inputs.txt"), "the list of inputs");
}
