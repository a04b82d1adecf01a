//! Peers come late, leave, come back, and send maps of any size; the node goes on, tells when it leaves itself, and hears
//! nobody of another domain.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

#[path = "interop_support/lab.rs"]
mod lab;
#[path = "interop_support/road.rs"]
mod road;

use lab::{Lab, PATIENCE, Peer, isolated, on_loopback};
use messages::autoware_internal_planning_msgs::{CandidateTrajectories, CandidateTrajectory, GeneratorInfo};
use messages::autoware_planning_msgs::TrajectoryPoint;
use messages::builtin_interfaces::{Duration as RosDuration, Time};
use messages::std_msgs::{Header, Text};
use messages::unique_identifier_msgs::Uuid;
use messages::{Interface, Message};
use road::{LANELETS_OF_20_MB, road_message};
use selector_actors::{InputTopic, OutputTopic};
use serde_json::json;
use std::net::UdpSocket;
use std::sync::Arc;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// The lease of the peers is ten seconds.
const LONGER_THAN_A_LEASE: Duration = Duration::from_secs(13);

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

    /// Sends an anchor until its cycle comes back; tells how long that took from the first time on.
    ///
    /// Once may not be enough: where the machine stands still on an anchor's way its candidate is too old when it comes, and
    /// is not published.
    fn cycle(&mut self, generator: u8) -> Duration {
        let first_sent = Instant::now();
        let name = format!("Planner_{generator}");
        while first_sent.elapsed() < PATIENCE {
            self.peer.send(self.anchors, &candidate(generator));
            for set in self.peer.take(self.concatenated, 1, Duration::from_millis(500)) {
                let set = CandidateTrajectories::from_cdr(&set, Interface::default(), "").unwrap();
                if set.generator_info.iter().any(|info| info.generator_name.data == name) {
                    return first_sent.elapsed();
                }
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
        let map = road_message(LANELETS_OF_20_MB);
        assert!(map.len() > 20_000_000, "{} bytes", map.len());
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
        // A cycle that waited for the map would take most of that time; the machine itself may stand still for a while.
        let limit = Duration::from_secs(2).max(took / 2);
        assert!(slowest < limit, "a cycle waited {slowest:?} of the {took:?} while the map came");
        node.stop("INT");
    });
}

#[test]
fn a_node_that_was_suspended_hears_and_answers_again() {
    isolated("a_node_that_was_suspended_hears_and_answers_again", |lab| {
        let node = lab.node(&[]);
        let mut planner = Planner::join(lab);
        for generator in 1..=3 {
            // Its threads wait for something when they are stopped; the system then says that they were interrupted.
            node.signal("STOP");
            node.signal("CONT");
            planner.cycle(generator);
        }
        // Who comes later is found, too.
        Planner::join(lab).cycle(4);
        // For longer than a lease of the peer, which is then taken for gone, or not: that is a race.
        node.signal("STOP");
        std::thread::sleep(LONGER_THAN_A_LEASE);
        node.signal("CONT");
        let took = planner.cycle(5);
        let stopped = node.stop("INT");
        assert_eq!(stopped.status.code(), Some(0), "{:?}", stopped.log);
        let anew = stopped.log.iter().filter(|line| line.contains("joins the graph anew")).count();
        eprintln!("back after {took:.2?}, joined {anew} times anew");
        assert!(stopped.json["cycles"]["anchor"].as_u64().unwrap() >= 5, "{}", stopped.json["cycles"]);
        let anchors = &stopped.json["messages"][topic(InputTopic::Generative).0];
        assert!(anchors["received"].as_u64().unwrap() >= 5, "{anchors}");
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
        server.send(id, &road_message(500));
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
            // A cycle may take 100 ms of judging; the rest is for a machine that is held up.
            assert!(stopped.took < Duration::from_secs(8), "SIG{signal}: {:?}", stopped.took);
            eprintln!("SIG{signal}: ended {:.0?} after it", stopped.took);
            assert_eq!(stopped.json["ok"], true);
            assert!(stopped.json["cycles"]["anchor"].as_u64().unwrap() >= 1);
            // A lease would take ten seconds or more.
            for endpoint in [planner.anchors, planner.concatenated] {
                let waited = planner.peer.wait_for_peers(endpoint, 0);
                assert!(waited < Duration::from_secs(8), "SIG{signal}: seen as gone after {waited:?}");
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

#[test]
fn a_planner_that_changes_its_domain_is_gone_until_it_comes_back() {
    isolated("a_planner_that_changes_its_domain_is_gone_until_it_comes_back", |lab| {
        let node = lab.node(&[]);
        let mut planner = Planner::join(lab);
        planner.cycle(1);
        drop(planner);
        let mut away = lab.peer_in(lab.domain % 100 + 1);
        let (name, type_name) = topic(InputTopic::Generative);
        let anchors = away.open("write", &name, type_name, &json!({"depth": 10}));
        for _ in 0..10 {
            away.send(anchors, &candidate(2));
            std::thread::sleep(Duration::from_millis(50));
        }
        assert_eq!(away.peers(anchors), 0, "nobody is there");
        drop(away);
        let mut planner = Planner::join(lab);
        planner.cycle(3);
        let stopped = node.stop("INT");
        let generators = stopped.json["candidates"]["by_generator"].to_string();
        assert!(!generators.contains("Planner_2"), "{generators}");
    });
}

/// Addresses at which a participant says it can be reached, in its announcement: the parameters for unicast.
fn announced(packet: &[u8]) -> Vec<[u8; 4]> {
    const PARAMETERS: [[u8; 4]; 2] = [[0x31, 0, 24, 0], [0x32, 0, 24, 0]];
    let is_locator = |at: &usize| PARAMETERS.iter().any(|begin| packet[*at..].starts_with(begin));
    let address = |at: usize| packet.get(at + 24..at + 28).and_then(|address| address.try_into().ok());
    (0..packet.len()).filter(is_locator).filter_map(address).collect()
}

#[test]
fn without_a_namespace_the_node_is_reached_on_127_0_0_1_alone() {
    on_loopback(|lab| {
        // The places of the last participants that are told of newcomers on their own host.
        let ports = (8..12).map(|participant| 7400 + 250 * lab.domain + 10 + 2 * participant);
        let ears = ports.filter_map(|port| UdpSocket::bind(("127.0.0.1", port)).ok()).next().unwrap();
        ears.set_read_timeout(Some(PATIENCE)).unwrap();
        let node = lab.node(&[]);
        let mut packet = [0; 65_536];
        let mut addresses = Vec::new();
        let until = Instant::now() + PATIENCE;
        while addresses.is_empty() {
            assert!(Instant::now() < until, "nothing was announced");
            let (length, from) = ears.recv_from(&mut packet).unwrap();
            assert!(from.ip().is_loopback(), "{from}");
            addresses = announced(&packet[..length]);
        }
        assert!(addresses.iter().all(|address| *address == [127, 0, 0, 1]), "{addresses:?}");
        let mut planner = Planner::join(lab);
        planner.cycle(1);
        assert_eq!(node.stop("TERM").status.code(), Some(0));
    });
}
