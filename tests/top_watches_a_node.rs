//! `top --node` sees a running node from elsewhere in its graph, without ROS: its cycles, verdicts and times.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

#[path = "interop_support/lab.rs"]
mod lab;
#[path = "program_support/program.rs"]
mod program;
#[path = "program_support/terminal.rs"]
mod terminal;

use lab::isolated;
use messages::autoware_internal_planning_msgs::CandidateTrajectories;
use messages::builtin_interfaces::Time;
use messages::{Interface, Message};
use program::{read, shared};
use selector_actors::InputTopic;
use serde_json::json;
use std::process::Command;
use std::sync::Arc;
use std::time::{Duration, SystemTime, UNIX_EPOCH};
use terminal::{in_a_terminal, keys, wait};

fn now() -> Time {
    let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap();
    Time::from_nanoseconds(i64::try_from(now.as_nanos()).unwrap())
}

/// The candidates as if they were made now.
fn fresh(mut candidates: CandidateTrajectories) -> Vec<u8> {
    for candidate in &mut candidates.candidate_trajectories {
        Arc::make_mut(candidate).header.stamp = now();
    }
    candidates.to_cdr(Interface::V0_53)
}

#[test]
fn verdicts_and_times_of_a_node_are_shown() {
    let Some(drive) = shared("data/drives/crosswalk.mcap") else { return };
    isolated("verdicts_and_times_of_a_node_are_shown", |lab| {
        let mut peer = lab.peer();
        let node = lab.node(&[]);
        let recorded = read(&drive);
        let mut anchor = None;
        for topic in InputTopic::ALL {
            let name = topic.full_name();
            let Some((.., data)) = recorded.iter().rfind(|(recorded, ..)| *recorded == name) else {
                continue;
            };
            let is_latched = matches!(topic, InputTopic::Map | InputTopic::Route);
            let qos = if is_latched { json!({"transient_local": true}) } else { json!({"depth": 16}) };
            let id = peer.open("write", &name, topic.type_name(), &qos);
            peer.wait_for_peers(id, 1);
            if topic == InputTopic::Generative {
                let candidates = CandidateTrajectories::from_cdr(data, Interface::V0_53, &name).unwrap();
                anchor = Some((id, candidates));
            } else {
                peer.send(id, data);
            }
        }
        node.wait_for_line(&["Map 1:"]);
        let (id, candidates) = anchor.unwrap();
        let generator = candidates.generator_info[0].generator_name.data.clone();

        let mut top = Command::new(env!("CARGO_BIN_EXE_trajectory-selector"));
        top.args(["top", "--node"]);
        top.env("ROS_DOMAIN_ID", lab.domain.to_string()).env("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST");
        let steps = [wait("anchor"), wait("crosswalk"), wait("Planner"), keys("q")];
        let shown = std::thread::scope(|scope| {
            let watching = scope.spawn(|| in_a_terminal([140, 45], &steps, &mut top));
            while !watching.is_finished() {
                peer.send(id, &fresh(candidates.clone()));
                std::thread::sleep(Duration::from_millis(100));
            }
            watching.join().unwrap()
        });
        let Some(shown) = shown else { return };
        assert_eq!(shown.exit, 0, "{:?}", shown.output);
        shown.assert_given_back();
        for text in [&generator[..], "/trajectory_selector_node", "ranker", "p99"] {
            assert!(shown.output.contains(text), "{text}");
        }
        let stopped = node.stop("INT");
        assert_eq!(stopped.status.code(), Some(0), "{:?}", stopped.log);
    });
}

#[test]
fn without_a_node_it_waits() {
    let mut top = Command::new(env!("CARGO_BIN_EXE_trajectory-selector"));
    top.args(["top", "--node=/planning/selector", "--interface-address", "127.0.0.1"]);
    top.env("ROS_DOMAIN_ID", "117");
    let steps = [wait("waiting"), keys("q")];
    let Some(shown) = in_a_terminal([80, 24], &steps, &mut top) else { return };
    assert_eq!(shown.exit, 0, "{:?}", shown.output);
    assert!(shown.output.contains("/planning/selector"));
    shown.assert_given_back();
}
