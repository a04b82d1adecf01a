//! What the node publishes in a graph is what a replay of the same drive gives, byte for byte, cycle for cycle; and
//! every type of it is read by another implementation with its own definitions.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

#[path = "interop_support/lab.rs"]
mod lab;
#[path = "program_support/program.rs"]
mod program;

use lab::{Lab, PATIENCE, Stillness, isolated};
use messages::builtin_interfaces::Time;
use messages::diagnostic_msgs::DiagnosticArray;
use messages::rosgraph_msgs::Clock;
use messages::{Interface, Message};
use program::{Recorded, read, run, shared};
use selector_actors::{InputTopic, OutputTopic};
use serde_json::{Value, json};
use std::path::Path;
use std::time::Duration;

/// Time between the clock's step and the anchor that it is for: longer than a message needs on a busy machine.
const SETTLE_S: f64 = 0.05;

/// How often the drive is played before it is given up.
const ATTEMPTS: u32 = 3;

/// Topics whose content depends on nothing but the drive.
const COMPARED: [OutputTopic; 9] = [
    OutputTopic::ConcatenatedTrajectories,
    OutputTopic::ValidationReports,
    OutputTopic::PlanningFactors,
    OutputTopic::Trajectories,
    OutputTopic::ValidatedTrajectories,
    OutputTopic::ScoredTrajectories,
    OutputTopic::Trajectory,
    OutputTopic::TurnIndicators,
    OutputTopic::Diagnostics,
];

/// Topics with times that were measured: they have to be read by others, but differ from run to run.
const MEASURED: [OutputTopic; 5] = [
    OutputTopic::Latency,
    OutputTopic::ProcessingTime,
    OutputTopic::FilterProcessingTime("collision_check_filter"),
    OutputTopic::ProcessingTimeText,
    OutputTopic::ProcessingTimeTree,
];

/// Drawings of one filter.
const MARKERS: &str = "/trajectory_selector_node/debug/markers/collision_check_filter";

fn replay(drive: &Path, lab: &Lab) -> Vec<Recorded> {
    let output = lab.path("replay.mcap");
    let outcome = run(&["replay", drive.to_str().unwrap(), "--output", output.to_str().unwrap()]);
    assert_eq!(outcome.exit_code, 0, "{}", outcome.stderr);
    read(&output)
}

fn payloads(recorded: &[Recorded], topic: &str) -> Vec<Vec<u8>> {
    recorded.iter().filter(|(name, ..)| name == topic).map(|(.., data)| data.clone()).collect()
}

/// When the cycles of the replay ran, on the drive's clock.
fn cycle_times(recorded: &[Recorded]) -> Vec<i64> {
    let diagnostics = payloads(recorded, "/diagnostics");
    let stamp = |cdr: &Vec<u8>| {
        let message = DiagnosticArray::from_cdr(cdr, Interface::default(), "").unwrap();
        message.header.stamp.nanoseconds()
    };
    diagnostics.iter().map(stamp).collect()
}

/// A tape for the peer: the drive's messages, the clock, and a pause at each cycle until its outputs are there.
#[derive(Default)]
struct Tape(Vec<u8>);

impl Tape {
    fn message(&mut self, topic: &str, time_ns: i64, cdr: &[u8]) {
        self.0.push(b'M');
        self.0.push(u8::try_from(topic.len()).unwrap());
        self.0.extend(topic.as_bytes());
        self.0.extend(time_ns.to_le_bytes());
        self.0.extend(u32::try_from(cdr.len()).unwrap().to_le_bytes());
        self.0.extend(cdr);
    }

    fn clock(&mut self, time_ns: i64) {
        let clock = Clock { clock: Time::from_nanoseconds(time_ns) };
        self.message("/clock", time_ns, &clock.to_cdr(Interface::default()));
    }

    fn pause(&mut self) {
        self.0.push(b'P');
        self.0.extend(SETTLE_S.to_le_bytes());
    }

    fn wait_for_cycle(&mut self, time_ns: i64) {
        self.0.push(b'W');
        self.0.extend(time_ns.to_le_bytes());
    }

    /// The drive without map and route, with the clock stepping to each cycle's time before what starts the cycle.
    fn of_drive(drive: &[Recorded], cycles: &[i64]) -> Self {
        let latched = [InputTopic::Map, InputTopic::Route].map(InputTopic::full_name);
        let anchor = InputTopic::Generative.full_name();
        let mut tape = Self::default();
        let mut cycles = cycles.iter().copied().peekable();
        for (topic, time_ns, data) in drive.iter().filter(|(topic, ..)| !latched.contains(topic)) {
            // The timer was due before this message.
            while let Some(due) = cycles.next_if(|&cycle| cycle < *time_ns) {
                tape.clock(due);
                tape.wait_for_cycle(due);
            }
            if *topic != anchor {
                tape.message(topic, *time_ns, data);
                continue;
            }
            assert_eq!(cycles.next(), Some(*time_ns), "the replay has a cycle for each anchor");
            tape.clock(*time_ns);
            tape.pause();
            tape.message(topic, *time_ns, data);
            tape.wait_for_cycle(*time_ns);
        }
        tape
    }
}

fn latched() -> Value {
    json!({"transient_local": true})
}

#[test]
fn a_live_drive_gives_what_its_replay_gives() {
    let Some(drive) = shared("data/drives/intersection.mcap") else { return };
    isolated("a_live_drive_gives_what_its_replay_gives", |lab| {
        let replayed = replay(&drive, lab);
        let cycles = cycle_times(&replayed);
        assert!(cycles.len() > 190, "{} cycles", cycles.len());
        let recorded = read(&drive);
        let tape = lab.path("tape");
        std::fs::write(&tape, Tape::of_drive(&recorded, &cycles).0).unwrap();
        // Topics have no order among each other, and the clock is best effort: on a machine that stands still for longer
        // than the pause before an anchor, the anchor may be first, and its cycle at another time or of other messages.
        let mut attempts = (0..ATTEMPTS).map(|_| play(lab, &recorded, &replayed, &tape));
        let played = attempts.any(|played| played.map_err(|error| eprintln!("held up: {error}")).is_ok());
        assert!(played, "the drive was never played to its end");
    });
}

/// Plays the drive and compares what comes back; an error where it cannot be played to its end.
fn play(lab: &Lab, recorded: &[Recorded], replayed: &[Recorded], tape: &Path) -> Result<(), String> {
    // Map and route are there before the node is: it joins late.
    let mut peer = lab.peer();
    for topic in [InputTopic::Map, InputTopic::Route] {
        let id = peer.open("write", &topic.full_name(), topic.type_name(), &latched());
        peer.send(id, &payloads(recorded, &topic.full_name())[0]);
    }
    let node = lab.node(&["-p", "use_sim_time:=true", "-p", "cycle_budget_ms:=60000"]);
    node.wait_for_line(&["Map 1:", "62 lanelets"]);

    let mut writers = serde_json::Map::new();
    for topic in InputTopic::ALL {
        if !matches!(topic, InputTopic::Map | InputTopic::Route) {
            let id = peer.open("write", &topic.full_name(), topic.type_name(), &json!({"depth": 16}));
            peer.wait_for_peers(id, 1);
            writers.insert(topic.full_name(), id.into());
        }
    }
    let clock = peer.open("write", "/clock", "rosgraph_msgs/msg/Clock", &json!({"reliable": false}));
    peer.wait_for_peers(clock, 1);
    writers.insert("/clock".to_owned(), clock.into());
    let many = json!({"depth": 1000});
    let watch = peer.open("read", "/diagnostics", "diagnostic_msgs/msg/DiagnosticArray", &many);
    peer.wait_for_peers(watch, 1);
    let mut readers = Vec::new();
    for topic in COMPARED {
        let id = peer.open("read", &topic.full_name(), topic.type_name(), &many);
        peer.wait_for_peers(id, 1);
        readers.push((topic, id));
    }

    // Read by somebody else, so that the comparison is not held up.
    let mut observer = lab.peer();
    let observed = MEASURED.map(|topic| (topic.full_name(), topic.type_name()));
    let drawn = (MARKERS.to_owned(), "visualization_msgs/msg/MarkerArray");
    let observed = observed.into_iter().chain([drawn]).map(|(name, type_name)| {
        let id = observer.open("read", &name, type_name, &many);
        observer.wait_for_peers(id, 1);
        (name, id)
    });
    let observed: Vec<_> = observed.collect();

    let stillness = Stillness::watch();
    let played = peer.try_ask(&json!({
        "op": "play", "tape": tape.to_str().unwrap(), "writers": writers, "watch": watch,
        "patience_s": PATIENCE.as_secs_f64() / 2.0,
    }))?;
    let stood_still_s = stillness.longest().as_secs_f64();
    assert!(played["sent"].as_u64().unwrap() > 2500, "{played}");

    for (topic, id) in readers {
        let expected = payloads(replayed, &topic.full_name());
        let mut live = peer.take(id, expected.len() + 10, Duration::from_secs(1));
        if topic == OutputTopic::Diagnostics {
            // At its start the clock jumps from 0, and the timer runs a cycle without candidates.
            live.retain(|cdr| !without_candidates(cdr));
        }
        if let Err(difference) = compare(&topic.full_name(), &live, &expected) {
            assert!(stood_still_s > SETTLE_S / 2.0, "{difference}");
            return Err(format!("{difference}; the machine stood still for {stood_still_s:.3} s"));
        }
    }
    for (name, id) in observed {
        // That it decodes is asserted where it is taken.
        let some = observer.take(id, 20, Duration::from_secs(1)).len();
        assert_eq!(some, 20, "messages on {name}");
    }
    let stopped = node.stop("INT");
    assert_eq!(stopped.status.code(), Some(0), "{:?}", stopped.log);
    assert_eq!(stopped.json["cycles"]["anchor"], 194, "{}", stopped.json["cycles"]);
    assert_eq!(stopped.json["cycles"]["coalesced"], 0);
    Ok(())
}

fn compare(name: &str, live: &[Vec<u8>], expected: &[Vec<u8>]) -> Result<(), String> {
    if live.len() != expected.len() {
        return Err(format!("{name}: {} messages, not {}", live.len(), expected.len()));
    }
    let mut pairs = live.iter().zip(expected);
    match pairs.position(|(live, expected)| !same(live, expected)) {
        Some(number) => Err(format!("{name}: message {number} is not that of the replay")),
        None => Ok(()),
    }
}

fn without_candidates(cdr: &[u8]) -> bool {
    let message = DiagnosticArray::from_cdr(cdr, Interface::default(), "").unwrap();
    message.status[0].message == "No concatenated trajectories received yet"
}

/// Equal up to the zeros that fill the last packet.
fn same(live: &[u8], expected: &[u8]) -> bool {
    live.starts_with(expected)
        && live.len() - expected.len() < 4
        && live[expected.len()..].iter().all(|&byte| byte == 0)
}
