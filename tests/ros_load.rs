//! Full load over the graph: 64 candidates of 80 points at 20 Hz, odometry and acceleration at 100 Hz, objects and lights
//! at 10 Hz. No anchor is lost and every message that had no effect is accounted for; a map of 20 MB from a server that
//! starts late changes nothing of that.
//!
//! What holds on any machine runs with the usual tests, for a few seconds. What takes a minute and means something only
//! in a release build on a quiet machine - latencies, processor time, memory - is asked for:
//! `cargo build --release && SELECTOR_PROGRAM=target/release/trajectory-selector cargo test --test ros_load -- --ignored
//! --nocapture --test-threads 1`. `SELECTOR_LOAD_SECONDS` sets another length.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

#[path = "interop_support/lab.rs"]
mod lab;
#[path = "program_support/program.rs"]
mod program;
#[path = "interop_support/road.rs"]
mod road;

use lab::{Lab, Node, PATIENCE, Peer, Stopped, isolated, to_hex};
use messages::autoware_internal_planning_msgs::CandidateTrajectories;
use messages::builtin_interfaces::Time;
use messages::{Interface, Message};
use program::{Recorded, number, read, shared};
use road::{LANELETS_OF_20_MB, road_message};
use selector_actors::{InputTopic, OutputTopic};
use serde_json::{Value, json};
use std::sync::Arc;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

const CANDIDATES: usize = 64;
const ANCHOR_HZ: f64 = 20.0;
/// Length of the load where its figures are not looked at, s.
const SHORT_S: f64 = 10.0;
/// A machine that stands still for so long, s, cannot carry the load.
const HELD_UP_S: f64 = 0.1;
/// How often it may try.
const ATTEMPTS: u32 = 3;
/// Maps that are sent for the figures: one is there after some twenty anchors, which have no 99th percentile.
const MAPS: u64 = 10;
/// Where the time of sending is in a set of candidates: the stamp of the first one.
const FIRST_STAMP_AT: usize = 8;

/// A stamp that no message has by chance; found again in the serialised message.
const MARK: Time = Time { sec: 0x5a5a_1234, nanosec: 0x2b67_8901 };

fn first(recorded: &[Recorded], topic: InputTopic) -> Vec<u8> {
    let name = topic.full_name();
    recorded.iter().find(|(topic, ..)| *topic == name).map(|(.., data)| data.clone()).unwrap()
}

/// The first anchor of the drive, cut to size, with marks for stamps.
fn anchor(recorded: &[Recorded]) -> Vec<u8> {
    let whole =
        CandidateTrajectories::from_cdr(&first(recorded, InputTopic::Generative), Interface::V0_53, "")
            .unwrap();
    let mut candidates: Vec<_> = whole
        .candidate_trajectories
        .iter()
        .filter(|candidate| candidate.points.len() == 80)
        .take(CANDIDATES)
        .map(|candidate| {
            let mut candidate = (**candidate).clone();
            candidate.header.stamp = MARK;
            Arc::new(candidate)
        })
        .collect();
    assert_eq!(candidates.len(), CANDIDATES);
    // All of one generator, so that every anchor replaces the one before.
    let generator = candidates[0].generator_id;
    for candidate in &mut candidates {
        Arc::make_mut(candidate).generator_id = generator;
    }
    let info = whole.generator_info.iter().find(|info| info.generator_id == generator).unwrap();
    CandidateTrajectories { candidate_trajectories: candidates, generator_info: vec![info.clone()] }
        .to_cdr(Interface::V0_53)
}

/// Where the marks are.
fn marks(cdr: &[u8]) -> Vec<usize> {
    let mark = [MARK.sec.to_le_bytes(), MARK.nanosec.to_le_bytes()].concat();
    (4..cdr.len() - 8).step_by(4).filter(|&at| cdr[at..at + 8] == mark[..]).collect()
}

/// Processor time in seconds and resident memory in MB of a process.
fn usage(process: u32) -> (f64, f64) {
    let stat = std::fs::read_to_string(format!("/proc/{process}/stat")).unwrap();
    let fields: Vec<&str> = stat.rsplit(')').next().unwrap().split_whitespace().collect();
    let ticks: f64 = fields[11].parse::<f64>().unwrap() + fields[12].parse::<f64>().unwrap();
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).unwrap();
    let resident = status.lines().find(|line| line.starts_with("VmRSS:")).unwrap();
    let kilobytes: f64 = resident.split_whitespace().nth(1).unwrap().parse().unwrap();
    (ticks / 100.0, kilobytes / 1024.0)
}

/// How long the load lasts where figures are asked for.
fn long_s() -> f64 {
    std::env::var("SELECTOR_LOAD_SECONDS").map_or(60.0, |seconds| seconds.parse().unwrap())
}

fn now_ns() -> i64 {
    i64::try_from(SystemTime::now().duration_since(UNIX_EPOCH).unwrap().as_nanos()).unwrap()
}

/// The node with everybody who talks to it, ready to begin.
struct Traffic {
    node: Node,
    peer: Peer,
    /// Somebody who listens, in a process of its own.
    consumer: Peer,
    streams: Vec<Value>,
    topics: Vec<InputTopic>,
    anchor_bytes: usize,
}

/// What came of a load.
struct Carried {
    stopped: Stopped,
    /// Messages sent, by topic.
    sent: Vec<(InputTopic, u64)>,
    /// Greatest delay of a message on the side of the sender, s.
    late_max_s: f64,
    /// Of each set that came out: when its anchor was sent, and how long after that it was, ns.
    latencies: Vec<(i64, i64)>,
}

impl Traffic {
    /// Somebody listens to `output`, a set of candidates.
    fn prepare(lab: &Lab, recorded: &[Recorded], output: OutputTopic) -> Self {
        let node = lab.node(&[]);
        let mut peer = lab.peer();
        let mut open = |topic: InputTopic, qos: &Value| {
            let id = peer.open("write", &topic.full_name(), topic.type_name(), qos);
            peer.wait_for_peers(id, 1);
            id
        };
        let latched = json!({"transient_local": true});
        let map = [InputTopic::Map, InputTopic::Route].map(|topic| (open(topic, &latched), topic));
        let (mut streams, mut topics) = (Vec::new(), Vec::new());
        for (topic, hz) in [
            (InputTopic::Odometry, 100.0),
            (InputTopic::Acceleration, 100.0),
            (InputTopic::Objects, 10.0),
            (InputTopic::TrafficSignals, 10.0),
        ] {
            let data = to_hex(&first(recorded, topic));
            // Each begins with its stamp.
            streams.push(
                json!({"id": open(topic, &json!({"depth": 64})), "data": data, "hz": hz, "stamp_at": [4]}),
            );
            topics.push(topic);
        }
        let data = anchor(recorded);
        let stamps = marks(&data);
        assert_eq!((stamps.len(), stamps[0]), (CANDIDATES, FIRST_STAMP_AT));
        let anchor_bytes = data.len();
        let id = open(InputTopic::Generative, &json!({"depth": 64}));
        streams.push(json!({"id": id, "data": to_hex(&data), "hz": ANCHOR_HZ, "stamp_at": stamps}));
        topics.push(InputTopic::Generative);
        for (id, topic) in map {
            peer.send(id, &first(recorded, topic));
        }
        node.wait_for_line(&["Map 1:"]);
        let mut consumer = lab.peer();
        let many = json!({"depth": 64});
        let reader = consumer.open("read", &output.full_name(), output.type_name(), &many);
        consumer.wait_for_peers(reader, 1);
        consumer.ask(&json!({
            "op": "watch", "id": reader, "stamp_at": FIRST_STAMP_AT, "quiet_s": 5, "background": true,
        }));
        Self { node, peer, consumer, streams, topics, anchor_bytes }
    }

    /// Sends for so long and does something else meanwhile; then the node ends.
    fn carry(mut self, seconds: f64, meanwhile: impl FnOnce(&Node)) -> Carried {
        let load = json!({"op": "load", "streams": self.streams, "seconds": seconds, "background": true});
        self.peer.ask(&load);
        meanwhile(&self.node);
        let join = json!({"op": "join", "timeout_s": seconds + PATIENCE.as_secs_f64()});
        let load = self.peer.ask(&join);
        let seen = self.consumer.ask(&join);
        let stopped = self.node.stop("INT");
        let counts = load["sent"].as_array().unwrap().iter().map(|count| count.as_u64().unwrap());
        let latencies = seen["seen"].as_array().unwrap().iter().map(|seen| {
            let at = |index: usize| seen[index].as_i64().unwrap();
            (at(0), at(1) - at(0))
        });
        Carried {
            sent: self.topics.iter().copied().zip(counts).collect(),
            late_max_s: load["late_max_s"].as_f64().unwrap(),
            latencies: latencies.collect(),
            stopped,
        }
    }
}

impl Carried {
    /// Every message that was sent came in; each of them took effect, or a newer one took its place.
    fn assert_accounted_for(&self) {
        let json = &self.stopped.json;
        let cycles = number(json, &["cycles", "anchor"]) + number(json, &["cycles", "timer"]);
        for &(topic, sent) in &self.sent {
            let messages = &json["messages"][topic.full_name()];
            let received = messages["received"].as_u64().unwrap();
            assert_eq!(received, sent, "{}: {messages}", topic.name());
            let dropped = messages["dropped"].as_object().unwrap();
            if topic == InputTopic::Generative {
                assert!(dropped.is_empty(), "{messages}");
                let used = number(json, &["cycles", "anchor"]) + number(json, &["cycles", "coalesced"]);
                assert!(used >= sent, "{used} anchors had an effect of {sent}: {}", json["cycles"]);
                continue;
            }
            assert!(dropped.keys().all(|reason| reason == "superseded"), "{}: {messages}", topic.name());
            let superseded = dropped.get("superseded").map_or(0, |count| count.as_u64().unwrap());
            // A cycle takes one message at most, and one may wait at the end.
            assert!(received - superseded <= cycles + 1, "{}: {messages} in {cycles} cycles", topic.name());
        }
        assert!(json["cycles"]["early_return"]["validation_failed"].is_null(), "{}", json["cycles"]);
    }

    /// The longest time that the machine let sender or node stand still, as far as they know: the delay of a message that
    /// was due, and of a question between two actors that takes microseconds.
    fn held_up_s(&self) -> f64 {
        let question_us = self.stopped.json["latency_us"]["snapshot"]["max"].as_f64().unwrap();
        self.late_max_s.max(1e-6 * question_us)
    }

    /// What holds on a machine that stands still for longer than queues are: no more is claimed than was sent, and what is
    /// missing was noticed as such.
    fn assert_nothing_is_made_up(&self) {
        for &(topic, sent) in &self.sent {
            let messages = &self.stopped.json["messages"][topic.full_name()];
            let dropped = messages["dropped"].as_object().unwrap();
            let lost = dropped.get("lost").map_or(0, |count| count.as_u64().unwrap());
            let received = messages["received"].as_u64().unwrap();
            assert!(received > 0 && received + lost <= sent, "{}: {messages} of {sent}", topic.name());
            assert!(
                dropped.keys().all(|reason| reason == "superseded" || reason == "lost"),
                "{}: {messages}",
                topic.name()
            );
        }
    }

    fn report(&self, anchor_bytes: usize) {
        let json = &self.stopped.json;
        println!("anchors of {anchor_bytes} bytes, messages at most {:.1} ms late", 1e3 * self.late_max_s);
        println!("cycles {}", json["cycles"]);
        println!(
            "candidates {} judged, {} accepted",
            json["candidates"]["judged"], json["candidates"]["accepted"]
        );
        for (topic, sent) in &self.sent {
            println!("{}: {sent} sent, {}", topic.name(), json["messages"][topic.full_name()]);
        }
        for stage in [
            "receive",
            "buffer",
            "wait",
            "snapshot",
            "observe",
            "judge",
            "rank",
            "report",
            "publish",
            "hand_over",
            "send",
            "own",
            "cycle",
        ] {
            let latency = &json["latency_us"][stage];
            let of = |share: &str| latency[share].as_f64().unwrap();
            println!(
                "{stage:>9}: p50 {:>9.0} us, p99 {:>9.0} us, max {:>9.0} us",
                of("p50"),
                of("p99"),
                of("max")
            );
        }
        let all: Vec<i64> = self.latencies.iter().map(|&(_, latency)| latency).collect();
        print_latencies("from the planner's sending to the selector's", &all);
    }

    /// Median of what is the node's own and of judging, us.
    fn own_and_validation_us(&self) -> (f64, f64) {
        let p50 = |stage: &str| self.stopped.json["latency_us"][stage]["p50"].as_f64().unwrap();
        (p50("own"), p50("observe") + p50("judge"))
    }
}

/// The latency that a share of all stayed below, ms.
fn quantile_ms(latencies_ns: &[i64], share: f64) -> f64 {
    let mut sorted = latencies_ns.to_vec();
    sorted.sort_unstable();
    let index = ((sorted.len() - 1) as f64 * share).ceil() as usize;
    sorted[index] as f64 * 1e-6
}

fn print_latencies(what: &str, latencies_ns: &[i64]) {
    let of = |share| quantile_ms(latencies_ns, share);
    println!(
        "{what}: {} sets, p50 {:.2} ms, p99 {:.2} ms, max {:.2} ms",
        latencies_ns.len(),
        of(0.5),
        of(0.99),
        of(1.0)
    );
}

#[test]
fn a_load_of_seconds_loses_no_anchor() {
    let Some(drive) = shared("data/drives/stress.mcap") else { return };
    isolated("a_load_of_seconds_loses_no_anchor", |lab| {
        let recorded = read(&drive);
        for _ in 0..ATTEMPTS {
            let carried = Traffic::prepare(lab, &recorded, OutputTopic::Trajectories).carry(SHORT_S, |_| {});
            assert_eq!(carried.sent.last().unwrap().1, (SHORT_S * ANCHOR_HZ) as u64);
            let held_up_s = carried.held_up_s();
            if held_up_s < HELD_UP_S {
                return carried.assert_accounted_for();
            }
            carried.assert_nothing_is_made_up();
            eprintln!("skipped: this machine stood still for {held_up_s:.2} s, so messages may be lost");
        }
    });
}

#[test]
#[ignore = "takes a minute; figures need a release build"]
fn a_minute_of_full_load_loses_no_anchor() {
    let Some(drive) = shared("data/drives/stress.mcap") else { return };
    isolated("a_minute_of_full_load_loses_no_anchor", |lab| {
        let seconds = long_s();
        let traffic = Traffic::prepare(lab, &read(&drive), OutputTopic::Trajectories);
        let anchor_bytes = traffic.anchor_bytes;
        let mut samples = Vec::new();
        let carried = traffic.carry(seconds, |node| {
            let started = Instant::now();
            while started.elapsed().as_secs_f64() < seconds {
                std::thread::sleep(Duration::from_secs(1));
                samples.push(usage(node.id()));
            }
        });
        carried.report(anchor_bytes);
        for (index, pair) in samples.windows(2).enumerate().step_by(samples.len().div_ceil(6).max(1)) {
            let processor = 100.0 * (pair[1].0 - pair[0].0);
            println!("at {:>3} s: {processor:.0} % of a core, {:.1} MB", index + 2, pair[1].1);
        }
        carried.assert_accounted_for();
        let (own_us, validation_us) = carried.own_and_validation_us();
        assert!(own_us < f64::max(0.1 * validation_us, 100.0), "{own_us} us of {validation_us} us");
        let memory = |sample: &(f64, f64)| sample.1;
        let (early, late) = (memory(&samples[samples.len() / 4]), memory(samples.last().unwrap()));
        assert!(late < early * 1.1 + 5.0, "memory grew from {early:.0} MB to {late:.0} MB");
    });
}

#[test]
#[ignore = "takes a minute; figures need a release build"]
fn a_map_of_20_mb_does_not_double_the_latency_of_anchors() {
    let Some(drive) = shared("data/drives/stress.mcap") else { return };
    isolated("a_map_of_20_mb_does_not_double_the_latency_of_anchors", |lab| {
        let seconds = long_s();
        // Off the road every candidate is rejected; what came in goes out there all the same.
        let traffic = Traffic::prepare(lab, &read(&drive), OutputTopic::ConcatenatedTrajectories);
        let anchor_bytes = traffic.anchor_bytes;
        let map = lab.path("map.cdr");
        std::fs::write(&map, road_message(LANELETS_OF_20_MB)).unwrap();
        // Between the sending of a map and its readiness.
        let mut arrivals = Vec::new();
        let carried = traffic.carry(seconds, |node| {
            let started = Instant::now();
            let pause = Duration::from_secs_f64(seconds / (MAPS + 2) as f64);
            for number in 1..=MAPS {
                std::thread::sleep((started + pause * u32::try_from(number).unwrap()) - Instant::now());
                // A server that starts only now; it sends before it knows who is there.
                let mut server = lab.peer();
                let topic = InputTopic::Map;
                let latched = json!({"transient_local": true});
                let id = server.open("write", &topic.full_name(), topic.type_name(), &latched);
                let began = now_ns();
                server.ask(&json!({"op": "send", "id": id, "file": map.to_str().unwrap()}));
                node.wait_for_line(&[&format!("Map {}:", number + 1), "72500 lanelets"]);
                arrivals.push((began, now_ns()));
            }
        });
        carried.report(anchor_bytes);
        let is_during = |sent: i64| arrivals.iter().any(|&(from, to)| sent >= from && sent < to);
        // The first map takes the road away: only after it all that is compared is judged alike.
        let first = arrivals[0].1;
        let (during, usual): (Vec<_>, Vec<_>) = carried
            .latencies
            .iter()
            .filter(|(sent, _)| *sent >= first)
            .partition(|&&(sent, _)| is_during(sent));
        let latencies = |of: Vec<&(i64, i64)>| of.iter().map(|&&(_, latency)| latency).collect::<Vec<_>>();
        let (during, usual) = (latencies(during), latencies(usual));
        let took_ms: Vec<i64> = arrivals.iter().map(|(from, to)| (to - from) / 1_000_000).collect();
        println!("maps took {took_ms:?} ms to arrive and to be decoded");
        print_latencies("usual", &usual);
        print_latencies("while a map comes", &during);
        carried.assert_accounted_for();
        let (limit, found) = (2.0 * quantile_ms(&usual, 0.99), quantile_ms(&during, 0.99));
        assert!(found < limit, "{found:.1} ms, twice the usual p99 is {limit:.1} ms");
    });
}
