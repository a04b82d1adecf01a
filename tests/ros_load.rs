//! A minute of full load over the graph: 64 candidates of 80 points at 20 Hz, odometry and acceleration at 100 Hz, objects
//! and lights at 10 Hz. No anchor is lost, memory and processor time stay level; prints what was measured.
//!
//! Not part of the usual tests, because it takes a minute and the figures mean something only in a release build on a
//! quiet machine: `cargo test --release --test ros_load -- --ignored --nocapture`. `SELECTOR_LOAD_SECONDS` sets another
//! length.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

#[path = "interop_support/lab.rs"]
mod lab;
#[path = "program_support/program.rs"]
mod program;

use lab::{PATIENCE, isolated, to_hex};
use messages::autoware_internal_planning_msgs::CandidateTrajectories;
use messages::builtin_interfaces::Time;
use messages::{Interface, Message};
use program::{Recorded, number, read, shared};
use selector_actors::{InputTopic, OutputTopic};
use serde_json::{Value, json};
use std::sync::Arc;
use std::time::{Duration, Instant};

const CANDIDATES: usize = 64;
const ANCHOR_HZ: f64 = 20.0;

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

#[test]
#[ignore = "takes a minute; figures need a release build"]
fn a_minute_of_full_load_loses_no_anchor() {
    let Some(drive) = shared("data/drives/stress.mcap") else { return };
    isolated("a_minute_of_full_load_loses_no_anchor", |lab| {
        let seconds: f64 =
            std::env::var("SELECTOR_LOAD_SECONDS").map_or(60.0, |seconds| seconds.parse().unwrap());
        let recorded = read(&drive);
        let node = lab.node(&[]);
        let mut peer = lab.peer();
        let mut open = |topic: InputTopic, qos: &Value| {
            let id = peer.open("write", &topic.full_name(), topic.type_name(), qos);
            peer.wait_for_peers(id, 1);
            id
        };
        let latched = json!({"transient_local": true});
        let map = [InputTopic::Map, InputTopic::Route].map(|topic| (open(topic, &latched), topic));
        let mut streams = Vec::new();
        for (topic, hz) in [
            (InputTopic::Odometry, 100.0),
            (InputTopic::Acceleration, 100.0),
            (InputTopic::Objects, 10.0),
            (InputTopic::TrafficSignals, 10.0),
        ] {
            let data = to_hex(&first(&recorded, topic));
            // Each begins with its stamp.
            streams.push(json!({"id": open(topic, &json!({})), "data": data, "hz": hz, "stamp_at": [4]}));
        }
        let data = anchor(&recorded);
        let stamps = marks(&data);
        assert_eq!(stamps.len(), CANDIDATES);
        let bytes = data.len();
        let id = open(InputTopic::Generative, &json!({"depth": 10}));
        streams.push(json!({"id": id, "data": to_hex(&data), "hz": ANCHOR_HZ, "stamp_at": stamps}));
        for (id, topic) in map {
            peer.send(id, &first(&recorded, topic));
        }
        node.wait_for_line(&["Map 1:"]);
        // Somebody who listens to what the car would drive by, in a process of its own.
        let mut consumer = lab.peer();
        let output = OutputTopic::Trajectories;
        let reader = consumer.open("read", &output.full_name(), output.type_name(), &json!({}));
        consumer.wait_for_peers(reader, 1);

        peer.ask(&json!({"op": "load", "streams": streams, "seconds": seconds, "background": true}));
        let started = Instant::now();
        let mut samples = Vec::new();
        while started.elapsed().as_secs_f64() < seconds {
            std::thread::sleep(Duration::from_secs(1));
            samples.push(usage(node.id()));
        }
        let sent = peer.ask(&json!({"op": "join", "timeout_s": PATIENCE.as_secs_f64()}));
        let anchors = sent["sent"].as_array().unwrap().last().unwrap().as_u64().unwrap();
        let stopped = node.stop("INT");
        let received = &stopped.json["messages"][InputTopic::Generative.full_name()];
        assert_eq!(received["received"].as_u64().unwrap(), anchors, "{received}");
        assert_eq!(received["dropped"], json!({}));
        let cycles = number(&stopped.json, &["cycles", "anchor"]);
        let coalesced = number(&stopped.json, &["cycles", "coalesced"]);
        report(&stopped.json, &samples, anchors, bytes, &sent);
        assert!(cycles + coalesced >= anchors, "{cycles} cycles, {coalesced} merged, {anchors} anchors");
        let memory = |sample: &(f64, f64)| sample.1;
        let (early, late) = (memory(&samples[samples.len() / 4]), memory(samples.last().unwrap()));
        assert!(late < early * 1.3 + 20.0, "memory grew from {early:.0} MB to {late:.0} MB");
    });
}

fn report(json: &Value, samples: &[(f64, f64)], anchors: u64, bytes: usize, sent: &Value) {
    println!("{anchors} anchors of {bytes} bytes sent, at most {} s late", sent["late_max_s"]);
    println!("cycles {}", json["cycles"]);
    println!(
        "candidates {} judged, {} accepted",
        json["candidates"]["judged"], json["candidates"]["accepted"]
    );
    for (topic, messages) in json["messages"].as_object().unwrap() {
        println!("{topic}: {messages}");
    }
    for stage in ["cycle", "snapshot", "observe", "judge", "publish"] {
        let latency = &json["latency_us"][stage];
        println!(
            "{stage:>9}: p50 {:>9} us, p99 {:>9} us, max {:>9} us",
            latency["p50"], latency["p99"], latency["max"]
        );
    }
    for (index, pair) in samples.windows(2).enumerate().step_by(samples.len().div_ceil(6).max(1)) {
        println!(
            "at {:>3} s: {:.0} % of a core, {:.1} MB",
            index + 2,
            100.0 * (pair[1].0 - pair[0].0),
            pair[1].1
        );
    }
}
