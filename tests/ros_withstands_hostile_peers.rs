//! Whatever comes over the network, the node goes on with its cycles, its memory stays within bounds, and it ends when it
//! is asked to: packets that look like the middleware's own and are not, samples of which only a part ever comes, samples
//! far larger than any, and crowds of peers that announce themselves and are never heard of again.
//!
//! All of it stays on the loopback interface, and is bounded in number and time.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

#[path = "interop_support/lab.rs"]
mod lab;

use lab::{Lab, Node, PATIENCE, Peer, isolated};
use messages::diagnostic_msgs::DiagnosticArray;
use messages::{Interface, Message};
use selector_actors::{InputTopic, OutputTopic};
use serde_json::json;
use std::net::UdpSocket;
use std::time::{Duration, Instant};

/// What a node may have more than before, whatever came: buffers that grew, pages that the allocator keeps.
const USUAL_GROWTH_MB: f64 = 64.0;
/// Half-received samples of one writer that the middleware keeps (RustDDS 0.15.1).
const HALF_RECEIVED_AT_ONCE: usize = 128;
/// Claimed size of each.
const CLAIMED_MB: usize = 1;
const MOST_LOG_LINES: usize = 200;

/// The node, somebody who watches it, and a socket for what should not come.
struct Siege {
    node: Node,
    peer: Peer,
    watch: u64,
    socket: UdpSocket,
    domain: u16,
    before_mb: f64,
}

impl Siege {
    fn lay(lab: &Lab) -> Self {
        let node = lab.node(&[]);
        let mut peer = lab.peer();
        let diagnostics = OutputTopic::Diagnostics;
        let watch =
            peer.open("read", &diagnostics.full_name(), diagnostics.type_name(), &json!({"depth": 100}));
        peer.wait_for_peers(watch, 1);
        peer.take_one(watch);
        let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
        let before_mb = resident_mb(&node);
        Self { node, peer, watch, socket, domain: lab.domain, before_mb }
    }

    /// Sends to the ports of the first participants of the domain, as the standard lays them out: one of them is the
    /// node's, another the watching peer's.
    fn send(&self, packet: &[u8]) {
        let base = 7400 + 250 * self.domain;
        for port in [base, base + 10, base + 11, base + 12, base + 13] {
            // Nobody may listen there.
            let _ = self.socket.send_to(packet, ("127.0.0.1", port));
        }
    }

    fn resident_mb(&self) -> f64 {
        resident_mb(&self.node)
    }

    fn cycles_go_on(&mut self) {
        self.peer.take(self.watch, 1000, Duration::ZERO);
        assert_eq!(self.peer.take(self.watch, 5, PATIENCE).len(), 5, "cycles go on");
    }

    /// Cycles go on, memory is within the bound, and the node ends in order, without having said more than so much.
    fn lift(mut self, growth_mb: f64, most_lines: usize) {
        self.cycles_go_on();
        let grown_mb = self.resident_mb() - self.before_mb;
        eprintln!("{:.1} MB before, {grown_mb:+.1} MB after", self.before_mb);
        assert!(grown_mb < growth_mb, "{grown_mb:.1} MB more than before");
        let stopped = self.node.stop("INT");
        assert_eq!(stopped.status.code(), Some(0), "{:?}", stopped.log);
        let lines = stopped.log.len();
        assert!(lines < most_lines, "{lines} lines were logged:\n{}", stopped.log[..50].join("\n"));
    }
}

/// Resident memory of the node, MB.
fn resident_mb(node: &Node) -> f64 {
    let status = std::fs::read_to_string(format!("/proc/{}/status", node.id())).unwrap();
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:")).unwrap();
    line.split_whitespace().next().unwrap().parse::<f64>().unwrap() / 1e3
}

/// Numbers that look random, the same each time.
struct Noise(u64);

impl Noise {
    fn byte(&mut self) -> u8 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0.to_le_bytes()[3]
    }

    fn bytes(&mut self, count: usize) -> Vec<u8> {
        (0..count).map(|_| self.byte()).collect()
    }
}

/// A packet of a participant with this number: its header, then the parts.
fn packet(participant: u64, parts: &[Vec<u8>]) -> Vec<u8> {
    let mut bytes = b"RTPS\x02\x03\x01\x0f".to_vec();
    bytes.extend(prefix(participant));
    bytes.extend(parts.concat());
    bytes
}

fn prefix(participant: u64) -> [u8; 12] {
    let mut prefix = [0x01, 0x0f, 0, 0, 0, 0, 0, 0, 0, 0, 0, 7];
    prefix[2..10].copy_from_slice(&participant.to_le_bytes());
    prefix
}

/// A part with a kind, flags (bit 0: little endian) and content.
fn part(kind: u8, flags: u8, content: &[u8]) -> Vec<u8> {
    let length = u16::try_from(content.len()).unwrap().to_le_bytes();
    [&[kind, flags], &length[..], content].concat()
}

/// Every kind of part that the standard has.
const KINDS: [u8; 13] = [0x01, 0x06, 0x07, 0x08, 0x09, 0x0c, 0x0d, 0x0e, 0x0f, 0x12, 0x13, 0x15, 0x16];
/// Built-in endpoints, as the standard numbers them: participants, publications, subscriptions, and their readers.
const ENTITIES: [[u8; 4]; 6] =
    [[0, 1, 0, 0xc2], [0, 0, 3, 0xc2], [0, 0, 4, 0xc2], [0, 1, 0, 0xc7], [0, 0, 3, 0xc7], [0, 0, 4, 0xc7]];

#[test]
fn a_flood_of_malformed_packets_stops_nothing() {
    isolated("a_flood_of_malformed_packets_stops_nothing", |lab| {
        let siege = Siege::lay(lab);
        let mut noise = Noise(0x2545_f491_4f6c_dd1d);
        for number in 0..20_000_u64 {
            // Sound in its frame, with lengths, counts and sizes of any kind within.
            let parts: Vec<Vec<u8>> = (0..=number % 3)
                .map(|_| {
                    let length = usize::from(noise.byte()) / 2;
                    let mut content = noise.bytes(length);
                    let entities =
                        [0, 1].map(|_| ENTITIES[usize::from(noise.byte()) % ENTITIES.len()]).concat();
                    if content.len() >= 12 && number % 2 == 0 {
                        // As far as the endpoints it is what it seems to be.
                        content[..4].copy_from_slice(&[0, 0, 16, 0]);
                        content[4..12].copy_from_slice(&entities);
                    }
                    let kind = KINDS[usize::from(noise.byte()) % KINDS.len()];
                    let mut part = part(kind, noise.byte() | 1, &content);
                    if number % 7 == 0 {
                        // A length that is none.
                        part[2..4].copy_from_slice(&noise.bytes(2));
                    }
                    part
                })
                .collect();
            siege.send(&packet(number % 50, &parts));
        }
        siege.lift(USUAL_GROWTH_MB, MOST_LOG_LINES);
    });
}

/// The first fragment of a sample that claims to be larger.
fn first_fragment(sample: u32) -> Vec<u8> {
    const FRAGMENT: u16 = 1024;
    let size = u32::try_from(CLAIMED_MB << 20).unwrap();
    let mut content = vec![0, 0, 28, 0];
    // To the node's reader of publications.
    content.extend([0, 0, 3, 0xc7, 0, 0, 3, 0xc2]);
    content.extend([0; 4]);
    content.extend(sample.to_le_bytes());
    content.extend(1_u32.to_le_bytes());
    content.extend(1_u16.to_le_bytes());
    content.extend(FRAGMENT.to_le_bytes());
    content.extend(size.to_le_bytes());
    content.extend([0; FRAGMENT as usize]);
    part(0x16, 1, &content)
}

#[test]
fn samples_that_never_come_whole_are_bounded_in_number() {
    isolated("samples_that_never_come_whole_are_bounded_in_number", |lab| {
        let mut siege = Siege::lay(lab);
        let samples = 10 * u32::try_from(HALF_RECEIVED_AT_ONCE).unwrap();
        for sample in 1..=samples {
            siege.send(&packet(1, &[first_fragment(sample)]));
            if sample % 64 == 0 {
                // What the kernel cannot hold is lost, and would prove nothing.
                std::thread::sleep(Duration::from_millis(2));
            }
        }
        siege.cycles_go_on();
        let held_mb = siege.resident_mb() - siege.before_mb;
        eprintln!("{samples} samples of {CLAIMED_MB} MB begun: {held_mb:+.1} MB");
        assert!(
            held_mb > 2.0 * CLAIMED_MB as f64,
            "{held_mb} MB: the fragments did not arrive, this says nothing"
        );
        let all_mb = (HALF_RECEIVED_AT_ONCE * CLAIMED_MB) as f64;
        siege.lift(1.2 * all_mb + USUAL_GROWTH_MB, MOST_LOG_LINES);
    });
}

#[test]
fn samples_far_larger_than_any_are_refused_and_given_back() {
    /// Larger than any list of objects.
    const BYTES: usize = 8_000_000;
    isolated("samples_far_larger_than_any_are_refused_and_given_back", |lab| {
        let mut siege = Siege::lay(lab);
        let objects = InputTopic::Objects;
        let type_name = format!("blob:{BYTES}:{}", objects.type_name());
        let writer = siege.peer.open("write", &objects.full_name(), &type_name, &json!({"depth": 1}));
        siege.peer.wait_for_peers(writer, 1);
        let mut noise = Noise(7);
        let garbage = [&[0, 1, 0, 0][..], &noise.bytes(BYTES)].concat();
        let until = Instant::now() + PATIENCE;
        let is_counted = |siege: &mut Siege| {
            siege.peer.take(siege.watch, 100, Duration::ZERO);
            let cdr = siege.peer.take_one(siege.watch);
            let message = DiagnosticArray::from_cdr(&cdr, Interface::default(), "").unwrap();
            let mut values = message.status[0].values.iter();
            values.any(|value| {
                value.key == "input.objects.malformed" && value.value.parse::<u64>().unwrap() >= 3
            })
        };
        while !is_counted(&mut siege) {
            assert!(Instant::now() < until, "{}", siege.node.log().join("\n"));
            siege.peer.send(writer, &garbage);
        }
        siege.lift(USUAL_GROWTH_MB, MOST_LOG_LINES);
    });
}

/// A parameter of an announcement.
fn parameter(id: u16, value: &[u8]) -> Vec<u8> {
    let length = u16::try_from(value.len()).unwrap();
    [&id.to_le_bytes()[..], &length.to_le_bytes(), value].concat()
}

/// What a participant says of itself once; its lease ends after a second, and it is never heard of again.
fn announcement(participant: u64, answer_to: u16) -> Vec<u8> {
    let guid = [&prefix(participant)[..], &[0, 0, 1, 0xc1]].concat();
    let mut locator = 1_u32.to_le_bytes().to_vec();
    locator.extend(u32::from(answer_to).to_le_bytes());
    locator.extend([0; 12]);
    locator.extend([127, 0, 0, 1]);
    let lease = [1_u32.to_le_bytes(), 0_u32.to_le_bytes()].concat();
    let parameters = [
        parameter(0x15, &[2, 3, 0, 0]),
        parameter(0x16, &[1, 0x0f, 0, 0]),
        parameter(0x50, &guid),
        parameter(0x31, &locator),
        parameter(0x32, &locator),
        parameter(0x02, &lease),
        // Publications and subscriptions, announced and detected.
        parameter(0x58, &0x3f_u32.to_le_bytes()),
        parameter(0x01, &[]),
    ]
    .concat();
    let mut content = vec![0, 0, 16, 0, 0, 0, 0, 0, 0, 1, 0, 0xc2];
    content.extend([0; 4]);
    content.extend(1_u32.to_le_bytes());
    content.extend([0, 3, 0, 0]);
    content.extend(parameters);
    packet(participant, &[part(0x15, 0x05, &content)])
}

/// So many peers announce themselves, one after the other, and are gone.
fn a_crowd_comes_and_goes(lab: &Lab, peers: u64) {
    let mut siege = Siege::lay(lab);
    // The node talks to them; nobody listens to what it says.
    let ear = UdpSocket::bind("127.0.0.1:0").unwrap();
    let answer_to = ear.local_addr().unwrap().port();
    let mut most_mb = siege.before_mb;
    for participant in 0..peers {
        siege.send(&announcement(1000 + participant, answer_to));
        std::thread::sleep(Duration::from_millis(2));
        if participant % 500 == 499 {
            siege.cycles_go_on();
            most_mb = most_mb.max(siege.resident_mb());
        }
    }
    ear.set_nonblocking(true).unwrap();
    let answered = ear.recv(&mut [0; 2000]).is_ok();
    assert!(answered, "the node did not believe in any of them: this says nothing");
    eprintln!("{peers} peers: at most {:.1} MB more", most_mb - siege.before_mb);
    // Leases of a second have ended when a new peer is found all the same.
    let mut late = lab.peer();
    let diagnostics = OutputTopic::Diagnostics;
    let watch = late.open("read", &diagnostics.full_name(), diagnostics.type_name(), &json!({}));
    late.wait_for_peers(watch, 1);
    late.take_one(watch);
    // Of each it is told that it has left.
    siege.lift(USUAL_GROWTH_MB, MOST_LOG_LINES + usize::try_from(peers).unwrap());
}

#[test]
fn two_hundred_short_lived_peers_come_and_go() {
    isolated("two_hundred_short_lived_peers_come_and_go", |lab| a_crowd_comes_and_goes(lab, 200));
}

#[test]
#[ignore = "takes a minute"]
fn thousands_of_short_lived_peers_come_and_go() {
    isolated("thousands_of_short_lived_peers_come_and_go", |lab| a_crowd_comes_and_goes(lab, 5_000));
}
