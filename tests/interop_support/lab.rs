//! A small graph for tests: the node as a process, and nodes of another DDS implementation that do what a test says.
//!
//! Everything stays on the loopback interface: in a network namespace of its own where the system allows it, else on
//! 127.0.0.1 in a random domain. Every process is ended by its id when the test ends, however it ends; nothing waits
//! without a limit.
#![allow(
    dead_code,
    clippy::unwrap_used,
    clippy::panic,
    reason = "each test uses some of these; tests fail by panicking"
)]

use serde_json::{Value, json};
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, ExitStatus, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Longer than anything here takes on a busy machine: discovery, repair of lost packets, starting Python.
pub(crate) const PATIENCE: Duration = Duration::from_secs(60);
/// Exit code of the script where Python or its packages cannot be had.
const UNAVAILABLE: i32 = 77;
/// Set in the process that already runs in its own network.
const ISOLATED: &str = "SELECTOR_TEST_ISOLATED";
/// Path of another program to test than the one built with the tests.
const PROGRAM: &str = "SELECTOR_PROGRAM";
/// The middleware of the peers uses the loopback interface and no other.
const LOOPBACK_ONLY: &str = "<CycloneDDS><Domain><General><Interfaces><NetworkInterface name=\"lo\"/></Interfaces>\
                             </General></Domain></CycloneDDS>";

/// Runs the body in a network of its own, if the system allows it: the test process starts itself again there.
pub(crate) fn isolated(test: &str, body: impl FnOnce(&Lab)) {
    if std::env::var_os(ISOLATED).is_some() {
        return body(&Lab::new());
    }
    if !peers_are_here() {
        return;
    }
    if !namespaces_are_allowed() {
        return body(&Lab::new());
    }
    let status = unshare()
        .args(["sh", "-c", "ip link set lo up && exec \"$@\"", "_"])
        .arg(std::env::current_exe().unwrap())
        .args([test, "--exact", "--nocapture", "--include-ignored"])
        .env(ISOLATED, "1")
        .status()
        .unwrap();
    assert!(status.success(), "{test} failed in its own network");
}

/// Runs the body as where namespaces are not allowed: in the network of the machine, on 127.0.0.1.
pub(crate) fn on_loopback(body: impl FnOnce(&Lab)) {
    if peers_are_here() {
        body(&Lab::new());
    }
}

/// Whether the peers can be started; if not, that is said, and is a failure where they are required.
fn peers_are_here() -> bool {
    // Packages can only be had from outside.
    let prepared = peer_script().output().unwrap();
    if prepared.status.code() == Some(UNAVAILABLE) {
        let why = String::from_utf8_lossy(&prepared.stderr);
        let required =
            std::env::var_os("SELECTOR_REQUIRE_PEERS").is_some() || std::env::var_os("CI").is_some();
        assert!(!required, "the peers are required here: {why}");
        eprintln!("skipped: {why}");
        return false;
    }
    assert!(prepared.status.success(), "{}", String::from_utf8_lossy(&prepared.stderr));
    true
}

fn peer_script() -> Command {
    let mut command = Command::new("bash");
    command.arg(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/interop/run.sh"));
    command
}

fn unshare() -> Command {
    let mut command = Command::new("unshare");
    command.args(["--net", "--map-root-user"]);
    command
}

fn namespaces_are_allowed() -> bool {
    let tried = unshare().args(["sh", "-c", "ip link set lo up"]).stderr(Stdio::null()).status();
    tried.is_ok_and(|status| status.success())
}

/// The place where processes of a test meet.
#[derive(Debug)]
pub(crate) struct Lab {
    pub(crate) domain: u16,
    pub(crate) folder: tempfile::TempDir,
}

impl Lab {
    fn new() -> Self {
        // The domain only has to differ from that of tests that run at the same time without namespaces.
        let now = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap();
        let domain = u16::try_from((now.subsec_micros() + std::process::id()) % 100 + 1).unwrap();
        Self { domain, folder: tempfile::tempdir().unwrap() }
    }

    /// A node of another implementation.
    pub(crate) fn peer(&self) -> Peer {
        Peer::start(self.domain)
    }

    /// The same in another domain.
    pub(crate) fn peer_in(&self, domain: u16) -> Peer {
        assert_ne!(domain, self.domain);
        Peer::start(domain)
    }

    /// The node under test, with these ROS arguments.
    pub(crate) fn node(&self, ros_arguments: &[&str]) -> Node {
        self.node_with(&[], ros_arguments, &[])
    }

    /// The same with arguments of the program and environment variables.
    pub(crate) fn node_with(&self, own: &[&str], ros: &[&str], environment: &[(&str, &str)]) -> Node {
        Node::start(self.domain, own, ros, environment)
    }

    /// A path in the folder of the test.
    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }
}

/// The lines that a process writes, as they come.
#[derive(Debug)]
struct Lines {
    receiver: Receiver<String>,
}

impl Lines {
    fn of(reader: impl std::io::Read + Send + 'static) -> Self {
        let (sender, receiver) = channel();
        std::thread::spawn(move || {
            for line in BufReader::new(reader).lines().map_while(Result::ok) {
                if sender.send(line).is_err() {
                    break;
                }
            }
        });
        Self { receiver }
    }
}

/// A node of another implementation, told what to do.
#[derive(Debug)]
pub(crate) struct Peer {
    child: Child,
    commands: ChildStdin,
    answers: Lines,
}

impl Peer {
    fn start(domain: u16) -> Self {
        let mut child = peer_script()
            .arg(domain.to_string())
            .env("CYCLONEDDS_URI", LOOPBACK_ONLY)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let commands = child.stdin.take().unwrap();
        let answers = Lines::of(child.stdout.take().unwrap());
        let peer = Self { child, commands, answers };
        let first = peer.answers.receiver.recv_timeout(PATIENCE);
        assert!(
            first.as_ref().is_ok_and(|line| line.contains("ready")),
            "the peer does not start: {first:?}"
        );
        peer
    }

    /// Gives a command and waits for its answer.
    pub(crate) fn ask(&mut self, command: &Value) -> Value {
        self.try_ask(command).unwrap_or_else(|error| panic!("{error} to {}", short(command)))
    }

    /// The same for a command that may fail.
    pub(crate) fn try_ask(&mut self, command: &Value) -> Result<Value, String> {
        writeln!(self.commands, "{command}").unwrap();
        self.commands.flush().unwrap();
        let line = match self.answers.receiver.recv_timeout(4 * PATIENCE) {
            Ok(line) => line,
            Err(RecvTimeoutError::Timeout) => panic!("no answer to {}", short(command)),
            Err(RecvTimeoutError::Disconnected) => panic!("the peer died of {}", short(command)),
        };
        let answer: Value = serde_json::from_str(&line).unwrap();
        match answer.get("error") {
            Some(error) => Err(error.to_string()),
            None => Ok(answer),
        }
    }

    /// Opens a writer or a reader on a topic of ROS.
    pub(crate) fn open(&mut self, what: &str, topic: &str, type_name: &str, qos: &Value) -> u64 {
        self.open_raw(what, &format!("rt{topic}"), type_name, qos)
    }

    /// The same on a topic of DDS.
    pub(crate) fn open_raw(&mut self, what: &str, topic: &str, type_name: &str, qos: &Value) -> u64 {
        let answer = self.ask(&json!({"op": what, "topic": topic, "type": type_name, "qos": qos}));
        answer["id"].as_u64().unwrap()
    }

    /// Waits until the endpoint has exactly so many peers; tells how long it took.
    pub(crate) fn wait_for_peers(&mut self, id: u64, count: u64) -> Duration {
        let answer = self
            .ask(&json!({"op": "matched", "id": id, "count": count, "timeout_s": PATIENCE.as_secs_f64()}));
        assert_eq!(answer["count"], count, "endpoint {id}");
        Duration::from_secs_f64(answer["waited_s"].as_f64().unwrap())
    }

    /// How many peers the endpoint has.
    pub(crate) fn peers(&mut self, id: u64) -> u64 {
        self.ask(&json!({"op": "matched", "id": id, "count": u64::MAX, "timeout_s": 0}))["count"]
            .as_u64()
            .unwrap()
    }

    pub(crate) fn send(&mut self, id: u64, cdr: &[u8]) {
        self.ask(&json!({"op": "send", "id": id, "data": to_hex(cdr)}));
    }

    /// Takes messages until there are so many or the time is over. Each must be what its type says, seen by the peer.
    pub(crate) fn take(&mut self, id: u64, count: usize, timeout: Duration) -> Vec<Vec<u8>> {
        let command = json!({"op": "take", "id": id, "count": count, "timeout_s": timeout.as_secs_f64()});
        let answer = self.ask(&command);
        let samples = answer["samples"].as_array().unwrap();
        samples
            .iter()
            .map(|sample| {
                assert_eq!(sample["same"], true, "the peer's own type does not read what the node wrote");
                from_hex(sample["data"].as_str().unwrap())
            })
            .collect()
    }

    /// Takes one message, which must come.
    pub(crate) fn take_one(&mut self, id: u64) -> Vec<u8> {
        self.take(id, 1, PATIENCE).pop().unwrap_or_else(|| panic!("no message at endpoint {id}"))
    }
}

impl Drop for Peer {
    fn drop(&mut self) {
        // It may be gone already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Measures for how long this machine stands still: for how long this process does nothing that should do something
/// every few milliseconds.
#[derive(Debug)]
pub(crate) struct Stillness {
    /// Closed when it has been looked at for long enough.
    watched: Sender<()>,
    watcher: JoinHandle<Duration>,
}

impl Stillness {
    pub(crate) fn watch() -> Self {
        const STEP: Duration = Duration::from_millis(5);
        let (watched, end) = channel();
        let watcher = std::thread::spawn(move || {
            let mut longest = Duration::ZERO;
            let mut last = Instant::now();
            while end.recv_timeout(STEP) == Err(RecvTimeoutError::Timeout) {
                longest = longest.max(last.elapsed().saturating_sub(STEP));
                last = Instant::now();
            }
            longest
        });
        Self { watched, watcher }
    }

    /// The longest time since then.
    pub(crate) fn longest(self) -> Duration {
        drop(self.watched);
        self.watcher.join().unwrap()
    }
}

fn short(command: &Value) -> String {
    command.to_string().chars().take(200).collect()
}

pub(crate) fn to_hex(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 16] = b"0123456789abcdef";
    let mut text = String::with_capacity(2 * bytes.len());
    for byte in bytes {
        text.push(char::from(DIGITS[usize::from(byte >> 4)]));
        text.push(char::from(DIGITS[usize::from(byte & 15)]));
    }
    text
}

pub(crate) fn from_hex(text: &str) -> Vec<u8> {
    (0..text.len() / 2)
        .map(|index| u8::from_str_radix(&text[2 * index..2 * index + 2], 16).unwrap())
        .collect()
}

/// The node under test.
#[derive(Debug)]
pub(crate) struct Node {
    child: Child,
    log: Arc<Mutex<Vec<String>>>,
    stdout: Lines,
}

/// What a node left behind.
#[derive(Debug)]
pub(crate) struct Stopped {
    pub(crate) status: ExitStatus,
    pub(crate) json: Value,
    pub(crate) log: Vec<String>,
    /// From the signal to the end of the process.
    pub(crate) took: Duration,
}

/// The program under test: the one built with the tests, or the one named by the environment, so that a release build
/// can be measured without building the tests for it.
fn program() -> PathBuf {
    std::env::var_os(PROGRAM).map_or_else(|| env!("CARGO_BIN_EXE_trajectory-selector").into(), PathBuf::from)
}

impl Node {
    fn start(domain: u16, own: &[&str], ros: &[&str], environment: &[(&str, &str)]) -> Self {
        let mut command = Command::new(program());
        command.args(["node", "--json"]).args(own).arg("--ros-args").args(ros);
        command.env("ROS_DOMAIN_ID", domain.to_string()).env("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST");
        // What the machine has set is not for this node.
        command.env_remove("RMW_IMPLEMENTATION").env_remove("ROS_LOCALHOST_ONLY");
        command.envs(environment.iter().copied());
        let mut child =
            command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        let log = Arc::new(Mutex::new(Vec::new()));
        let (lines, kept) = (Lines::of(child.stderr.take().unwrap()), log.clone());
        std::thread::spawn(move || {
            for line in lines.receiver {
                kept.lock().unwrap().push(line);
            }
        });
        let stdout = Lines::of(child.stdout.take().unwrap());
        Self { child, log, stdout }
    }

    pub(crate) fn id(&self) -> u32 {
        self.child.id()
    }

    /// What it has logged so far.
    pub(crate) fn log(&self) -> Vec<String> {
        self.log.lock().unwrap().clone()
    }

    /// Waits for a line that has all of these texts in it.
    pub(crate) fn wait_for_line(&self, texts: &[&str]) -> String {
        let until = Instant::now() + PATIENCE;
        loop {
            let found = self.log().into_iter().find(|line| texts.iter().all(|text| line.contains(text)));
            if let Some(line) = found {
                return line;
            }
            assert!(Instant::now() < until, "no line with {texts:?} in:\n{}", self.log().join("\n"));
            std::thread::sleep(Duration::from_millis(5));
        }
    }

    /// Sends a signal, by name as `kill` knows it.
    pub(crate) fn signal(&self, name: &str) {
        let status = Command::new("kill").args(["-s", name, &self.child.id().to_string()]).status().unwrap();
        assert!(status.success());
    }

    /// Asks it to end and waits until it has.
    pub(crate) fn stop(self, signal: &str) -> Stopped {
        let asked = Instant::now();
        self.signal(signal);
        let mut stopped = self.wait();
        stopped.took = asked.elapsed();
        stopped
    }

    /// Waits until it has ended by itself.
    pub(crate) fn wait(mut self) -> Stopped {
        let until = Instant::now() + PATIENCE;
        let status = loop {
            if let Some(status) = self.child.try_wait().unwrap() {
                break status;
            }
            assert!(Instant::now() < until, "the node does not end:\n{}", self.log().join("\n"));
            std::thread::sleep(Duration::from_millis(2));
        };
        let lines: Vec<String> = self.stdout.receiver.iter().collect();
        let json = serde_json::from_str(&lines.join("\n")).unwrap_or(Value::Null);
        Stopped { status, json, log: self.log(), took: Duration::ZERO }
    }
}

impl Drop for Node {
    fn drop(&mut self) {
        if std::thread::panicking() {
            eprintln!("the node's log:\n{}", self.log().join("\n"));
        }
        // It may be gone already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
