//! The load through the graph: the node with its whole door on one side, somebody who plays sensors and planners on the
//! other.
//!
//! Both are participants of the middleware in this process and keep to the loopback interface. The node has a namespace
//! of its own, so that no node that drives a vehicle ever gets the load. Before anything is counted, anchors go out until
//! one is answered: only then both sides know of each other. The round trip counts from when an anchor was due until the
//! validated set with its candidates has come back. Where it is asked for, the other side leaves the graph at random and
//! joins it anew, with all that the node gets once; anchors that were due meanwhile are not sent.

use super::feed::Feed;
use super::{Course, Heap, INTERFACE, Pace, Stress, Stressed};
use crate::commands::Failure;
use crate::commands::node::received;
use crate::report::summary::{Input as InputSummary, RunResult};
use crate::report::usage;
use crate::ros::environment::{Environment, ServiceMapping};
use crate::ros::estranged::Estranged;
use crate::ros::graph::{Graph, GraphOptions, Reader, Writer};
use crate::ros::names::Names;
use crate::ros::node::{Node, Start};
use crate::ros::qos::Qos;
use crate::scenario::load::LoadMessages;
use crate::scenario::random::Random;
use crate::session::Ended;
use crate::settings::{AutowareInterface, Settings};
use crossbeam_channel::{Receiver, RecvTimeoutError, Sender};
use futures::{StreamExt, pin_mut};
use messages::builtin_interfaces::Time;
use selector_actors::topics::NODE_NAME;
use selector_actors::{Clock, InputTopic, OutputTopic};
use serde::Serialize;
use std::collections::HashMap;
use std::net::{IpAddr, Ipv4Addr};
use std::sync::{Arc, PoisonError};
use std::time::{Duration, Instant};
use tokio::runtime::Runtime;
use tokio::sync::oneshot;
use tokio::task::JoinHandle;

/// Name of the participant that brings the load.
const PLANNERS_NAME: &str = "stress_planners";
/// Time between two anchors that ask whether anybody listens.
const KNOCK_EVERY: Duration = Duration::from_millis(200);
/// How long they ask, and how long an answer is waited for.
const PATIENCE: Duration = Duration::from_secs(30);
/// Sets that may wait to be taken from the middleware.
const ANSWER_DEPTH: i32 = 64;
/// Purpose of the random numbers that say when the planners restart.
const RESTART_STREAM: u64 = 0x7265_7374_6172_7400;

/// What went through the graph.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Carried {
    /// Anchors sent after the first one was answered.
    pub anchors: u64,
    /// Validated sets that came back for them.
    pub answers: u64,
    /// How often those who sent them left the graph and came back.
    pub restarts: u64,
}

impl Stress {
    /// Runs the load through the graph. Time passes by itself; as fast as cycles end, an anchor follows the answer to the
    /// one before.
    ///
    /// # Errors
    /// The node cannot be started, or nothing comes back from it.
    pub fn run_through_graph(&self, settings: &Settings) -> Result<(Stressed, Carried), Failure> {
        let began = Instant::now();
        let mut settings = settings.clone();
        settings.selector.autoware_interface = AutowareInterface::V0_53;
        if let Some(deadline) = self.deadline {
            settings.selector.cycle_budget_ms = i64::try_from(deadline.as_millis()).unwrap_or(i64::MAX);
        }
        let graph = GraphOptions {
            domain_id: Environment::read(|name| std::env::var_os(name))?.domain_id,
            interfaces: vec![IpAddr::V4(Ipv4Addr::LOCALHOST)],
        };
        let names = Names::new(NODE_NAME, &format!("/stress_{}", std::process::id()), &[])?;
        let (of_node, of_planners) = (runtime("graph")?, runtime("planners")?);
        let start = Start {
            graph: graph.clone(),
            mapping: ServiceMapping::default(),
            settings: Arc::new(settings),
            threads: self.threads,
            names: names.clone(),
            rosout: None,
            statistics: Arc::default(),
            estranged: Estranged::default(),
        };
        let node = Node::start(start, of_node.handle())?;
        let statistics = node.statistics();
        let (end, ending) = oneshot::channel::<()>();
        let mut course = Course::new(self, began);
        let (played, ended) = std::thread::scope(|scope| {
            let playing = scope.spawn(|| {
                let forget = || {
                    *statistics.lock().unwrap_or_else(PoisonError::into_inner) = Default::default();
                };
                let place = Place { graph: &graph, names: &names, runtime: &of_planners };
                let played = place.play(self, &forget, &mut course);
                // The node may have ended by itself.
                let _ = end.send(());
                played
            });
            let ended = of_node.block_on(node.run(async {
                // Dropped or used: the load is over.
                let _ = ending.await;
            }));
            let played = playing.join();
            (played.unwrap_or_else(|_| Err(Failure::internal("the planners panicked".to_owned()))), ended)
        });
        let played = played?;
        course.memory_mb.close();
        course.bar.finish_and_clear();
        let mut statistics = std::mem::take(&mut *statistics.lock().unwrap_or_else(PoisonError::into_inner));
        for &took in &played.round_trips {
            statistics.record("round_trip", took);
        }
        let Played { anchors, answers, restarts, .. } = played;
        let carried = Carried { anchors, answers, restarts };
        let missed = self.deadline.map_or(0, |deadline| {
            let late = played.round_trips.iter().filter(|took| **took > deadline).count() as u64;
            late + carried.anchors.saturating_sub(carried.answers)
        });
        let result = RunResult {
            input: InputSummary { name: self.load.scene.name().to_owned(), seed: Some(self.load.seed) },
            interface: INTERFACE.name(),
            statistics,
            messages: received(&ended.tally),
            coalesced: ended.coalesced,
            output: None,
            wall: began.elapsed(),
        };
        let errors = ended.error.iter().map(|error| Failure::internal(error.to_string())).collect();
        let ended = Ended { result, watched: None, page: None, errors, warnings: Vec::new() };
        let (memory_mb, heap_mb) = (course.memory_mb, course.heap_mb);
        Ok((Stressed { ended, missed, memory_mb, heap_mb, most_waiting: None }, carried))
    }
}

fn runtime(name: &str) -> Result<Runtime, Failure> {
    tokio::runtime::Builder::new_multi_thread()
        .worker_threads(1)
        .thread_name(name)
        .enable_all()
        .build()
        .map_err(|error| Failure::internal(format!("the runtime cannot be started: {error}")))
}

/// A validated set that came back.
#[derive(Debug, Clone, Copy)]
struct Answer {
    arrived: Instant,
    /// Stamp of its first candidate, ns; `None` if it is empty.
    stamp_ns: Option<i64>,
}

/// What became of the load.
#[derive(Debug, Default)]
struct Played {
    /// Anchors that were sent.
    anchors: u64,
    /// Validated sets that came back.
    answers: u64,
    /// Times at which the planners joined again.
    restarts: u64,
    /// From when an anchor was due until its answer had come.
    round_trips: Vec<Duration>,
}

/// Where the planners join the graph.
#[derive(Clone, Copy)]
struct Place<'a> {
    graph: &'a GraphOptions,
    names: &'a Names,
    runtime: &'a Runtime,
}

impl Place<'_> {
    fn join(&self) -> Result<Planners, Failure> {
        let Self { names, .. } = self;
        let mut graph = Graph::join(self.graph, names.namespace(), PLANNERS_NAME)?;
        let mut writers = HashMap::new();
        for topic in InputTopic::ALL {
            let writer =
                graph.advertise(&names.topic(&topic.ros_name())?, topic.type_name(), Qos::of_input(topic))?;
            writers.insert(topic, writer);
        }
        let sets = OutputTopic::Trajectories;
        let reader = graph.subscribe(
            &names.topic(&sets.ros_name())?,
            sets.type_name(),
            Qos::reliable(ANSWER_DEPTH),
        )?;
        let (sender, answers) = crossbeam_channel::unbounded();
        let taking = self.runtime.spawn(take_answers(reader, sender));
        graph.announce();
        Ok(Planners { writers, answers, taking, _graph: graph })
    }

    /// Leaves the graph with every endpoint.
    fn leave(&self, planners: Planners) {
        planners.taking.abort();
        // Ended by that: the subscription is gone before the participant is.
        let _ = self.runtime.block_on(planners.taking);
    }

    /// `forget` drops what was counted so far.
    fn play(&self, stress: &Stress, forget: &dyn Fn(), course: &mut Course) -> Result<Played, Failure> {
        let messages = stress.load.messages();
        let mut feed = Feed::of(&messages);
        let mut planners = self.join()?;
        planners.make_acquaintance(&messages, &mut feed)?;
        forget();
        course.memory_mb.start = usage::resident_memory_mb();
        let (mut played, mut due_of) = (Played::default(), HashMap::new());
        let start = Instant::now();
        let (mut back, mut leaves) = (start, stress.next_restart(start, 0));
        for cycle in 1..=stress.cycles {
            let due = match stress.pace {
                Pace::Max => Instant::now(),
                Pace::Hertz(rate_hz) => start + Duration::from_secs_f64(cycle as f64 / rate_hz),
            };
            std::thread::sleep(due.saturating_duration_since(Instant::now()));
            if leaves.is_some_and(|at| at <= Instant::now()) {
                self.leave(planners);
                planners = self.join()?;
                planners.make_acquaintance(&messages, &mut feed)?;
                // What was asked before is no longer answered to anybody.
                due_of.clear();
                played.restarts += 1;
                back = Instant::now();
                leaves = stress.next_restart(back, played.restarts);
            }
            if back <= due {
                let stamp = Clock::System.now();
                due_of.insert(stamp.nanoseconds(), due);
                planners.send(&mut feed, stamp)?;
                played.anchors += 1;
                match stress.pace {
                    Pace::Max => played.take(planners.answer()?, &mut due_of),
                    Pace::Hertz(_) => {
                        planners.answers.try_iter().for_each(|answer| played.take(answer, &mut due_of));
                    }
                }
            }
            course.has_run(cycle);
        }
        // What is still on its way. Anchors that were merged into one cycle get one answer, so silence ends it, too.
        while played.answers < played.anchors
            && let Ok(answer) = planners.answers.recv_timeout(super::SILENCE)
        {
            played.take(answer, &mut due_of);
        }
        course.heap_mb.end = Heap::now();
        Ok(played)
    }
}

impl Stress {
    /// When the planners leave next, if they do: half to one and a half times the mean time after they came.
    fn next_restart(&self, came: Instant, restarts: u64) -> Option<Instant> {
        let share = 1.0 + Random::of(self.load.seed, RESTART_STREAM, restarts).around_zero(0.5);
        self.restart_planners.map(|mean| came + mean.mul_f64(share))
    }
}

/// Whoever plays sensors and planners.
struct Planners {
    writers: HashMap<InputTopic, Writer>,
    answers: Receiver<Answer>,
    /// Takes the answers from the middleware.
    taking: JoinHandle<()>,
    // Last, so that the endpoints leave before it does.
    _graph: Graph,
}

impl Planners {
    /// Sends what the node needs once, and anchors until one is answered.
    fn make_acquaintance(&self, messages: &LoadMessages, feed: &mut Feed) -> Result<(), Failure> {
        for input in messages.once() {
            if let (Some(writer), Some(cdr)) = (self.writers.get(&input.topic()), input.to_cdr(INTERFACE)) {
                writer.send(cdr)?;
            }
        }
        let until = Instant::now() + PATIENCE;
        while Instant::now() < until {
            self.send(feed, Clock::System.now())?;
            if self.answers.recv_timeout(KNOCK_EVERY).is_ok() {
                // Answers to the others must not be taken for answers to what follows.
                while self.answers.recv_timeout(KNOCK_EVERY).is_ok() {}
                return Ok(());
            }
        }
        let waited = PATIENCE.as_secs();
        Err(Failure::internal(format!(
            "within {waited} s the node has answered nothing on the loopback interface; does it carry multicast? \
             `trajectory-selector doctor` tells"
        )))
    }

    fn send(&self, feed: &mut Feed, stamp: Time) -> Result<(), Failure> {
        for message in feed.messages() {
            if let Some(writer) = self.writers.get(&message.topic()) {
                writer.send(message.cdr_at(stamp).to_vec())?;
            }
        }
        Ok(())
    }

    fn answer(&self) -> Result<Answer, Failure> {
        self.answers.recv_timeout(PATIENCE).map_err(|error| {
            let why = match error {
                RecvTimeoutError::Timeout => "an anchor was not answered",
                RecvTimeoutError::Disconnected => "the middleware no longer brings anything",
            };
            Failure::internal(why.to_owned())
        })
    }
}

impl Played {
    fn take(&mut self, answer: Answer, due_of: &mut HashMap<i64, Instant>) {
        self.answers += 1;
        // A set without candidates does not say which anchor it answers.
        if let Some(due) = answer.stamp_ns.and_then(|stamp_ns| due_of.remove(&stamp_ns)) {
            self.round_trips.push(answer.arrived.saturating_duration_since(due));
        }
    }
}

/// Where the stamp of the first candidate is in a set: behind the encapsulation and the number of candidates.
const COUNT_AT: usize = 4;
const FIRST_STAMP_AT: usize = 8;

async fn take_answers(reader: Reader, answers: Sender<Answer>) {
    let stream = reader.payloads();
    pin_mut!(stream);
    while let Some(payload) = stream.next().await {
        let answer = Answer { arrived: Instant::now(), stamp_ns: first_stamp_ns(payload.as_bytes()) };
        if answers.send(answer).is_err() {
            return;
        }
    }
}

/// Stamp of the first candidate of a serialised set, without decoding the rest: that would take from the node the time
/// that is measured.
fn first_stamp_ns(cdr: &[u8]) -> Option<i64> {
    let word = |at: usize| Some(u32::from_le_bytes(cdr.get(at..at + 4)?.try_into().ok()?));
    if word(COUNT_AT)? == 0 {
        return None;
    }
    let stamp = Time { sec: word(FIRST_STAMP_AT)?.cast_signed(), nanosec: word(FIRST_STAMP_AT + 4)? };
    Some(stamp.nanoseconds())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::load::{Load, LoadScene};
    use messages::Message;
    use messages::autoware_internal_planning_msgs::CandidateTrajectories;

    #[test]
    fn the_stamp_of_the_first_candidate_is_found() {
        let load = Load {
            scene: LoadScene::Road,
            candidates: 3,
            points: 4,
            objects: 0,
            paths: 0,
            generators: 2,
            seed: 1,
        };
        let now = Time { sec: 1_800_000_123, nanosec: 456_789_012 };
        let anchor = load.messages().anchor(now, usize::MAX).to_cdr(INTERFACE).unwrap();
        assert_eq!(first_stamp_ns(&anchor), Some(now.nanoseconds()));
        let empty = CandidateTrajectories::default().to_cdr(INTERFACE);
        assert_eq!(first_stamp_ns(&empty), None);
        assert_eq!(first_stamp_ns(&anchor[..9]), None);
    }
}
