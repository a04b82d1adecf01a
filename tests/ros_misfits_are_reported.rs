//! What does not fit is told of, with topic, peer and what would help; and it stops nothing: peers with the wrong quality
//! of service or type, messages of the other interface, messages that are none, packets that are none.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

#[path = "interop_support/lab.rs"]
mod lab;

use lab::{PATIENCE, isolated};
use messages::autoware_internal_planning_msgs::{CandidateTrajectories, CandidateTrajectory};
use messages::diagnostic_msgs::DiagnosticArray;
use messages::nav_msgs::Odometry;
use messages::rcl_interfaces::Log;
use messages::{Interface, Message};
use selector_actors::{InputTopic, OutputTopic};
use serde_json::json;
use std::net::UdpSocket;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Bytes of a message that is none.
const GARBAGE_BYTES: usize = 64;
/// Bytes of a message that breaks off.
const CUT_BYTES: usize = 296;

fn values(cdr: &[u8]) -> Vec<(String, String)> {
    let message = DiagnosticArray::from_cdr(cdr, Interface::default(), "").unwrap();
    message.status[0].values.iter().map(|value| (value.key.clone(), value.value.clone())).collect()
}

#[test]
fn peers_that_do_not_fit_are_warned_of_once() {
    isolated("peers_that_do_not_fit_are_warned_of_once", |lab| {
        let node = lab.node(&[]);
        let mut peer = lab.peer();
        let odometry = InputTopic::Odometry.full_name();
        let best_effort = json!({"reliable": false});
        let id = peer.open("write", &odometry, InputTopic::Odometry.type_name(), &best_effort);
        node.wait_for_line(&["WARN", &odometry, "publisher", "best_effort", "reliable"]);
        assert_eq!(peer.ask(&json!({"op": "status", "id": id}))["incompatible"], 1, "the peer sees it, too");
        let route = InputTopic::Route.full_name();
        peer.open("write", &route, InputTopic::Route.type_name(), &json!({}));
        node.wait_for_line(&["WARN", &route, "volatile is offered, transient_local is asked for"]);
        let output = OutputTopic::Trajectories.full_name();
        let latched = json!({"transient_local": true});
        peer.open("read", &output, OutputTopic::Trajectories.type_name(), &latched);
        node.wait_for_line(&["WARN", &output, "subscriber", "transient_local"]);
        let objects = InputTopic::Objects.full_name();
        peer.open("write", &objects, "nav_msgs/msg/Odometry", &json!({}));
        node.wait_for_line(&["WARN", &objects, "nav_msgs::msg::dds_::Odometry_", "PredictedObjects_"]);

        let diagnostics = OutputTopic::Diagnostics;
        let id = peer.open("read", &diagnostics.full_name(), diagnostics.type_name(), &json!({}));
        peer.wait_for_peers(id, 1);
        let values = values(&peer.take_one(id));
        assert!(values.contains(&("peers.incompatible_qos".to_owned(), "4".to_owned())), "{values:?}");
        let stopped = node.stop("INT");
        let warnings =
            stopped.log.iter().filter(|line| line.contains("does not fit") && line.contains(&odometry));
        assert_eq!(warnings.count(), 1);
    });
}

#[test]
fn messages_that_do_not_decode_are_told_of_with_what_would_help() {
    isolated("messages_that_do_not_decode_are_told_of_with_what_would_help", |lab| {
        let node = lab.node(&[]);
        let mut peer = lab.peer();
        let (generative, backup, odometry) =
            (InputTopic::Generative, InputTopic::Backup, InputTopic::Odometry);
        let older = format!("{}052", generative.type_name());
        let anchors = peer.open("write", &generative.full_name(), &older, &json!({"depth": 10}));
        // The other implementation sends nothing that does not fit the type it was told.
        let mut blob = |topic: InputTopic, length: usize| {
            let type_name = format!("blob:{length}:{}", topic.type_name());
            peer.open("write", &topic.full_name(), &type_name, &json!({"depth": 10}))
        };
        let (backups, odometries) = (blob(backup, GARBAGE_BYTES), blob(odometry, CUT_BYTES));
        let diagnostics = OutputTopic::Diagnostics;
        let watch = peer.open("read", &diagnostics.full_name(), diagnostics.type_name(), &json!({}));
        let rosout = peer.open("read", "/rosout", "rcl_interfaces/msg/Log", &json!({"depth": 1000}));
        for id in [anchors, backups, odometries, watch, rosout] {
            peer.wait_for_peers(id, 1);
        }
        let set = CandidateTrajectories {
            candidate_trajectories: vec![Arc::new(CandidateTrajectory::default())],
            generator_info: Vec::new(),
        };
        let garbage = [&[0, 1, 0, 0][..], &[0xff; GARBAGE_BYTES]].concat();
        let cut = &Odometry::default().to_cdr(Interface::default())[..4 + CUT_BYTES];
        let until = Instant::now() + PATIENCE;
        // Until both sides know of each other, messages may go nowhere.
        let all_told = |log: &[String]| {
            let told = |texts: &[&str]| log.iter().any(|line| texts.iter().all(|text| line.contains(text)));
            told(&[&generative.full_name(), "autoware_interface", "0.52"])
                && told(&[&backup.full_name(), "malformed", "does not fit it either"])
                && told(&[&odometry.full_name(), "malformed nav_msgs/msg/Odometry at byte"])
        };
        let mut told_on_rosout = false;
        while !(told_on_rosout && all_told(&node.log())) {
            assert!(Instant::now() < until, "on /rosout: {told_on_rosout}\n{}", node.log().join("\n"));
            peer.send(anchors, &set.to_cdr(Interface::V0_52));
            peer.send(backups, &garbage);
            peer.send(odometries, cut);
            told_on_rosout |= peer.take(rosout, 1000, Duration::from_millis(20)).iter().any(|cdr| {
                let line = Log::from_cdr(cdr, Interface::default(), "").unwrap();
                line.level == Log::WARN
                    && line.name == "trajectory_selector_node"
                    && line.msg.contains("0.52")
            });
        }
        // Counted where operators look.
        peer.take(watch, 100, Duration::ZERO);
        let values = values(&peer.take_one(watch));
        for topic in [generative, backup, odometry] {
            let key = format!("input.{}.malformed", topic.name());
            let count = values.iter().find(|(name, _)| *name == key).map(|(_, count)| count.parse::<u64>());
            assert!(count.is_some_and(|count| count.unwrap() >= 1), "{key} in {values:?}");
        }
        // A flood of them makes one line a second, beside some that are still on their way.
        let before = node.log().iter().filter(|line| line.contains("malformed")).count();
        let flood = Instant::now();
        for _ in 0..300 {
            peer.send(anchors, &set.to_cdr(Interface::V0_52));
        }
        let seconds = usize::try_from(flood.elapsed().as_secs()).unwrap() + 5;
        let after = node.log().iter().filter(|line| line.contains("malformed")).count();
        assert!(after - before <= seconds, "{} lines in {seconds} s", after - before);
        assert_eq!(node.stop("INT").status.code(), Some(0));
    });
}

/// A little generator of noise, the same each time.
fn noise(seed: u64, length: usize) -> Vec<u8> {
    let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
    let mut bytes = Vec::with_capacity(length);
    while bytes.len() < length {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        bytes.push(state.to_le_bytes()[3]);
    }
    bytes
}

#[test]
fn packets_that_are_none_do_not_disturb_the_node() {
    isolated("packets_that_are_none_do_not_disturb_the_node", |lab| {
        let node = lab.node(&[]);
        let mut peer = lab.peer();
        let diagnostics = OutputTopic::Diagnostics;
        let watch =
            peer.open("read", &diagnostics.full_name(), diagnostics.type_name(), &json!({"depth": 100}));
        peer.wait_for_peers(watch, 1);
        // Ports of the first participants of a domain, as the standard lays them out.
        let base = 7400 + 250 * lab.domain;
        let ports = [base, base + 10, base + 11, base + 12, base + 13];
        let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
        for packet in 0..2000_u64 {
            let mut bytes = noise(packet, usize::try_from(packet % 900).unwrap());
            if packet % 2 == 0 {
                // Looks like the middleware's own at first sight.
                bytes.splice(..bytes.len().min(4), *b"RTPS");
            }
            for port in ports {
                // Nobody may listen there.
                let _ = socket.send_to(&bytes, ("127.0.0.1", port));
            }
        }
        peer.take(watch, 1000, Duration::ZERO);
        assert_eq!(peer.take(watch, 5, PATIENCE).len(), 5, "cycles go on");
        let stopped = node.stop("INT");
        assert_eq!(stopped.status.code(), Some(0), "{:?}", stopped.log);
        let lines = stopped.log.len();
        assert!(lines < 100, "{lines} lines were logged:\n{}", stopped.log[..50].join("\n"));
    });
}
