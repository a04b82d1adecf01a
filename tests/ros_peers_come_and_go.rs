//! Peers come late, leave, come back, and send maps of any size; the node goes on, tells when it leaves itself, and hears
//! nobody of another domain.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

#[path = "interop_support/lab.rs"]
mod lab;

use lab::{Lab, PATIENCE, Peer, isolated};
use lanelet_map::{Map, MapBuilder};
use messages::autoware_internal_planning_msgs::{CandidateTrajectories, CandidateTrajectory, GeneratorInfo};
use messages::autoware_map_msgs::LaneletMapBin;
use messages::autoware_planning_msgs::TrajectoryPoint;
use messages::builtin_interfaces::{Duration as RosDuration, Time};
use messages::std_msgs::{Header, Text};
use messages::unique_identifier_msgs::Uuid;
use messages::{Interface, Message};
use selector_actors::{InputTopic, OutputTopic};
use serde_json::json;
use std::sync::Arc;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

fn topic(topic: InputTopic) -> (String, &'static str) {
    (topic.full_name(), topic.type_name())
}

fn now() -> Time {
    let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap();
    Time::from_nanoseconds(i64::try_from(now.as_nanos()).unwrap())
}

/// One fresh candidate; the generator tells one message from another.
fn candidate(generator: u8) -> Vec<u8> {
    let point = |index: i64| TrajectoryPoint {
        time_from_start: RosDuration::from_nanoseconds(index * 100_000_000),
        ..TrajectoryPoint::default()
    };
    let generator_id = Uuid { uuid: [generator; 16] };
    let candidate = CandidateTrajectory {
        header: Header { stamp: now(), frame_id: "map".to_owned() },
        generator_id,
        points: vec![point(0), point(1)],
        ..CandidateTrajectory::default()
    };
    let info = GeneratorInfo { generator_id, generator_name: Text { data: format!("Planner_{generator}") } };
    CandidateTrajectories { candidate_trajectories: vec![Arc::new(candidate)], generator_info: vec![info] }
        .to_cdr(Interface::default())
}

/// A straight road of lanelets of 10 m.
fn road(lanelets: i64) -> Map {
    let mut builder = MapBuilder::new();
    for index in 0..=lanelets {
        let x = 10.0 * index as f64;
        builder.point(2 * index + 1, [x, 2.0, 0.0], &[]).unwrap();
        builder.point(2 * index + 2, [x, -2.0, 0.0], &[]).unwrap();
    }
    let first_line = 10 * (lanelets + 1);
    for index in 0..lanelets {
        let (left, right) = (first_line + 3 * index, first_line + 3 * index + 1);
        builder.line_string(left, &[2 * index + 1, 2 * index + 3], &[]).unwrap();
        builder.line_string(right, &[2 * index + 2, 2 * index + 4], &[]).unwrap();
        builder.lanelet(first_line + 3 * index + 2, left, right, &[("subtype", "road")]).unwrap();
    }
    builder.build().unwrap()
}

/// A planner and whoever sees that its anchors are taken: the set of fresh candidates of the cycle comes back.
struct Planner {
    peer: Peer,
    anchors: u64,
    concatenated: u64,
}

impl Planner {
    fn join(lab: &Lab) -> Self {
        let mut peer = lab.peer();
        let (name, type_name) = topic(InputTopic::Generative);
        let anchors = peer.open("write", &name, type_name, &json!({"depth": 10}));
        let output = OutputTopic::ConcatenatedTrajectories;
        let many = json!({"depth": 100});
        let concatenated = peer.open("read", &output.full_name(), output.type_name(), &many);
        peer.wait_for_peers(anchors, 1);
        peer.wait_for_peers(concatenated, 1);
        let mut planner = Self { peer, anchors, concatenated };
        planner.wait_until_heard();
        planner
    }

    /// Both sides know of each other when an anchor has come back.
    fn wait_until_heard(&mut self) {
        let until = Instant::now() + PATIENCE;
        loop {
            self.peer.send(self.anchors, &candidate(0));
            if !self.peer.take(self.concatenated, 1, Duration::from_millis(200)).is_empty() {
                break;
            }
            assert!(Instant::now() < until, "no anchor came back");
        }
        self.peer.take(self.concatenated, 100, Duration::from_millis(300));
    }

    /// Sends an anchor and waits for its cycle; tells how long that took.
    fn cycle(&mut self, generator: u8) -> Duration {
        let sent = Instant::now();
        self.peer.send(self.anchors, &candidate(generator));
        let name = format!("Planner_{generator}");
        while sent.elapsed() < PATIENCE {
            let set = self.peer.take_one(self.concatenated);
            let set = CandidateTrajectories::from_cdr(&set, Interface::default(), "").unwrap();
            if set.generator_info.iter().any(|info| info.generator_name.data == name) {
                return sent.elapsed();
            }
        }
        panic!("the anchor of {name} started no cycle");
    }
}

#[test]
fn a_map_of_20_mb_arrives_late_and_delays_no_cycle() {
    isolated("a_map_of_20_mb_arrives_late_and_delays_no_cycle", |lab| {
        let node = lab.node(&[]);
        let mut planner = Planner::join(lab);
        let data = lanelet_map::archive::encode(&road(72_500));
        assert!(data.len() > 20_000_000, "{} bytes", data.len());
        let map = LaneletMapBin { data, ..LaneletMapBin::default() }.to_cdr(Interface::default());
        // The map server starts after the node and publishes once.
        let mut server = lab.peer();
        let (name, type_name) = topic(InputTopic::Map);
        let id = server.open("write", &name, type_name, &json!({"transient_local": true}));
        let sending = Instant::now();
        let sender = std::thread::spawn(move || {
            server.send(id, &map);
            server
        });
        let mut slowest = Duration::ZERO;
        let mut cycles = 0_u8;
        while !node.log().iter().any(|line| line.contains("Map 1:")) {
            assert!(sending.elapsed() < 2 * PATIENCE, "the map never came:\n{}", node.log().join("\n"));
            cycles = cycles.wrapping_add(1);
            slowest = slowest.max(planner.cycle(cycles));
        }
        let took = sending.elapsed();
        let _server = sender.join().unwrap();
        node.wait_for_line(&["Map 1:", "72500 lanelets"]);
        eprintln!("the map took {took:.2?}, meanwhile the slowest of {cycles} cycles {slowest:.2?}");
        assert!(slowest < Duration::from_secs(2), "a cycle waited {slowest:?} while the map came");
        node.stop("INT");
    });
}

#[test]
fn a_planner_that_is_restarted_is_heard_again() {
    isolated("a_planner_that_is_restarted_is_heard_again", |lab| {
        let node = lab.node(&[]);
        for generator in [1, 2, 3] {
            let mut planner = Planner::join(lab);
            planner.cycle(generator);
            // Killed, not closed: the node learns of it by the lease only, and must not wait for that.
            drop(planner);
        }
        let mut observer = lab.peer();
        let output = OutputTopic::Diagnostics;
        let id = observer.open("read", &output.full_name(), output.type_name(), &json!({}));
        observer.wait_for_peers(id, 1);
        observer.take_one(id);
        assert_eq!(node.stop("INT").status.code(), Some(0));
    });
}

#[test]
fn a_node_that_is_restarted_takes_the_map_that_was_sent_before() {
    isolated("a_node_that_is_restarted_takes_the_map_that_was_sent_before", |lab| {
        let mut server = lab.peer();
        let (name, type_name) = topic(InputTopic::Map);
        let id = server.open("write", &name, type_name, &json!({"transient_local": true}));
        let data = lanelet_map::archive::encode(&road(500));
        server.send(id, &LaneletMapBin { data, ..LaneletMapBin::default() }.to_cdr(Interface::default()));
        for signal in ["INT", "TERM", "INT"] {
            let node = lab.node(&[]);
            let matched = server.wait_for_peers(id, 1);
            let started = Instant::now();
            node.wait_for_line(&["Map 1:", "500 lanelets"]);
            eprintln!("SIG{signal}: matched after {matched:.2?}, map {:.2?} later", started.elapsed());
            let stopped = node.stop(signal);
            assert_eq!(stopped.status.code(), Some(0));
            let gone = server.wait_for_peers(id, 0);
            eprintln!("SIG{signal}: stopped in {:.2?}, seen as gone {gone:.2?} later", stopped.took);
        }
    });
}

#[test]
fn leaving_is_said_and_does_not_take_long() {
    isolated("leaving_is_said_and_does_not_take_long", |lab| {
        for signal in ["INT", "TERM"] {
            let node = lab.node(&[]);
            let mut planner = Planner::join(lab);
            planner.cycle(1);
            let stopped = node.stop(signal);
            assert_eq!(stopped.status.code(), Some(0), "{:?}", stopped.log);
            assert!(stopped.took < Duration::from_secs(5), "SIG{signal}: {:?}", stopped.took);
            assert_eq!(stopped.json["ok"], true);
            assert!(stopped.json["cycles"]["anchor"].as_u64().unwrap() >= 1);
            // A lease would take ten seconds or more.
            for endpoint in [planner.anchors, planner.concatenated] {
                let waited = planner.peer.wait_for_peers(endpoint, 0);
                assert!(waited < Duration::from_secs(5), "SIG{signal}: seen as gone after {waited:?}");
            }
        }
    });
}

#[test]
fn domains_do_not_hear_each_other() {
    isolated("domains_do_not_hear_each_other", |lab| {
        let other = (lab.domain % 100 + 1).to_string();
        let node = lab.node(&[]);
        let foreign = lab.node_with(&[], &[], &[("ROS_DOMAIN_ID", &other)]);
        let mut planner = Planner::join(lab);
        planner.cycle(1);
        assert_eq!(planner.peer.peers(planner.anchors), 1, "only the node of this domain");
        let (node, foreign) = (node.stop("INT"), foreign.stop("INT"));
        let anchors = |json: &serde_json::Value| json["cycles"]["anchor"].as_u64().unwrap();
        assert!(anchors(&node.json) >= 2);
        assert_eq!(anchors(&foreign.json), 0);
    });
}
