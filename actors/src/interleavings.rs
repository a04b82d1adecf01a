//! The protocol of buffer, sensors, scheduler, validation and publisher under every order of steps that a scheduler comes
//! upon.
//!
//! What decides is the real code: [`Rule`](crate::scheduler::Rule), [`Custody`], the slots of the sensors and the concatenator. What carries
//! messages between them is modelled: every owner has a thread of its own and a mailbox, where actix has one thread for
//! all, so there are more orders here than there. Owners post without waiting, as `do_send` does; whoever brings
//! candidates waits for room in the mailbox, which has room for one.
//!
//! Each scenario runs under so many random schedules, and as many adversarial ones, as `SELECTOR_SCHEDULES` says.

mod mailbox;
mod scheduler;

use crate::cycle::Trigger;
use crate::inlets::SensorSlots;
use crate::scheduler::{SchedulerState, Triggered};
use crate::validation::Custody;
use mailbox::Mailbox;
use messages::autoware_internal_planning_msgs::{CandidateTrajectories, CandidateTrajectory, GeneratorInfo};
use messages::builtin_interfaces::Time;
use messages::nav_msgs::Odometry;
use messages::std_msgs::Header;
use messages::unique_identifier_msgs::Uuid;
use motion::VehicleInfo;
use scheduler::SchedulerActor;
use selection::{Concatenator, Scene};
use shuttle::rand::Rng;
use shuttle::sync::Arc;
use shuttle::sync::atomic::{AtomicI64, Ordering};
use shuttle::thread::{self, JoinHandle, yield_now};
use std::collections::BTreeMap;
use std::time::{Duration, Instant};

const PERIOD_MS: i64 = 150;
const STEP_MS: i64 = 60;
const PLANNERS: u8 = 2;
const ANCHORS: i64 = 2;

fn schedules() -> usize {
    std::env::var("SELECTOR_SCHEDULES").ok().and_then(|number| number.parse().ok()).unwrap_or(1000)
}

/// Random schedules, and schedules that starve a thread at a few chosen steps.
fn explore(scenario: impl Fn() + Send + Sync + Clone + 'static) {
    shuttle::check_random(scenario.clone(), schedules());
    shuttle::check_pct(scenario, schedules(), 3);
}

/// Of each planner the number of its newest message.
type Newest = BTreeMap<u8, i64>;

enum ToBuffer {
    Add(CandidateTrajectories),
    TakeFresh(u64),
    Wait(Arc<Mailbox<()>>),
    Stop,
}

enum ToSensors {
    TakeSnapshot(u64),
    Stop,
}

enum ToScheduler {
    Triggered(Triggered),
    Fresh(u64, Newest),
    Snapshot(u64, i64),
    WakeUp,
    CycleEnded,
    Configure(u64),
    WaitForIdle(Arc<Mailbox<SchedulerState>>),
    Finish(Arc<Mailbox<SchedulerState>>),
    Stop,
}

enum ToValidation {
    Cycle(u64, Newest),
    Judged { number: u64, pipeline: u64, newest: Newest },
    GiveUp(u64),
    Set(u64),
    Stop,
}

/// A cycle to publish: what was judged by which parameters, if it was.
enum ToPublisher {
    Publish(u64, Option<(Newest, u64)>),
    Stop,
}

/// What happened, in order.
#[derive(Debug, Clone, PartialEq)]
enum Event {
    Triggered,
    Fired { now: i64, before: i64, after: i64 },
    Started { number: u64, trigger: Trigger, applied: u64 },
    Collected { number: u64, newest: Newest, odometry: i64 },
    Ended { number: u64, now: i64, before: i64, after: i64 },
    GivenUp(u64),
    Published(u64, Option<(Newest, u64)>),
    Finished,
}

/// The owners' addresses, and the world that they share.
#[derive(Clone)]
struct Node {
    buffer: Arc<Mailbox<ToBuffer>>,
    sensors: Arc<Mailbox<ToSensors>>,
    scheduler: Arc<Mailbox<ToScheduler>>,
    validation: Arc<Mailbox<ToValidation>>,
    publisher: Arc<Mailbox<ToPublisher>>,
    pool: Arc<Mailbox<Option<(u64, u64, Newest)>>>,
    grace: Arc<Mailbox<Option<u64>>>,
    slots: Arc<SensorSlots>,
    clock: Arc<AtomicI64>,
    // Not one of the explored primitives: looking must not change what is looked at.
    events: Arc<std::sync::Mutex<Vec<Event>>>,
}

impl Node {
    fn now(&self) -> Time {
        Time::from_nanoseconds(self.clock.load(Ordering::SeqCst) * 1_000_000)
    }

    fn log(&self, event: Event) {
        self.events.lock().unwrap().push(event);
    }

    fn run_buffer(self) {
        let mut concatenator = Concatenator::new(1e9);
        loop {
            match self.buffer.next() {
                ToBuffer::Add(message) => {
                    concatenator.add(&message);
                    let (receive, buffer) = (Duration::ZERO, Duration::ZERO);
                    let (trigger, arrived) = (Trigger::Anchor, Instant::now());
                    self.scheduler.post(ToScheduler::Triggered(Triggered {
                        trigger,
                        arrived,
                        receive,
                        buffer,
                    }));
                }
                ToBuffer::TakeFresh(number) => {
                    let fresh = concatenator.get(self.now());
                    let stamped = fresh.candidates.iter().map(|candidate| {
                        let stamp = candidate.message.header.stamp;
                        (candidate.key.generator.uuid[0], stamp.nanoseconds())
                    });
                    self.scheduler.post(ToScheduler::Fresh(number, stamped.collect()));
                }
                ToBuffer::Wait(reply) => reply.post(()),
                ToBuffer::Stop => return,
            }
        }
    }

    fn run_sensors(self) {
        let mut scene = Scene::empty(Time::default(), VehicleInfo::default().into());
        loop {
            match self.sensors.next() {
                ToSensors::TakeSnapshot(number) => {
                    self.slots.take_into(&mut scene);
                    let odometry =
                        scene.odometry.as_ref().map_or(0, |odometry| odometry.header.stamp.nanoseconds());
                    self.scheduler.post(ToScheduler::Snapshot(number, odometry));
                }
                ToSensors::Stop => return,
            }
        }
    }

    fn run_validation(self) {
        // The pipeline is the version of its parameters.
        let (mut custody, mut changed) = (Custody::of(0), None);
        loop {
            match self.validation.next() {
                ToValidation::Cycle(number, newest) if newest.is_empty() => {
                    self.publisher.post(ToPublisher::Publish(number, None));
                }
                ToValidation::Cycle(number, newest) => match custody.hand_out(number) {
                    Some(pipeline) => {
                        self.grace.post(Some(number));
                        self.pool.post(Some((number, pipeline, newest)));
                    }
                    None => self.publisher.post(ToPublisher::Publish(number, None)),
                },
                ToValidation::Judged { number, pipeline, newest } => {
                    if custody.take_back(changed.take().unwrap_or(pipeline), number) {
                        self.publisher.post(ToPublisher::Publish(number, Some((newest, pipeline))));
                    }
                }
                ToValidation::GiveUp(number) => {
                    if custody.give_up(number) {
                        self.log(Event::GivenUp(number));
                        self.publisher.post(ToPublisher::Publish(number, None));
                    }
                }
                ToValidation::Set(version) => match custody.here() {
                    Some(pipeline) => *pipeline = version,
                    None => changed = Some(version),
                },
                ToValidation::Stop => return,
            }
        }
    }

    fn run_publisher(self) {
        loop {
            match self.publisher.next() {
                ToPublisher::Publish(number, judged) => {
                    self.log(Event::Published(number, judged));
                    self.scheduler.post(ToScheduler::CycleEnded);
                }
                ToPublisher::Stop => return,
            }
        }
    }

    fn run_pool(self) {
        while let Some((number, pipeline, newest)) = self.pool.next() {
            yield_now();
            self.validation.post(ToValidation::Judged { number, pipeline, newest });
        }
    }

    fn run_grace(self) {
        while let Some(number) = self.grace.next() {
            // Most cycles are in time whatever the schedule.
            if shuttle::rand::thread_rng().gen_bool(0.5) {
                self.validation.post(ToValidation::GiveUp(number));
            }
        }
    }

    /// A planner: where the vehicle is, then candidates for that place.
    fn run_planner(self, planner: u8) {
        for number in 1..=ANCHORS {
            let header = Header { stamp: Time::from_nanoseconds(number), ..Header::default() };
            if planner == 0 {
                self.slots.put_odometry(Odometry { header: header.clone(), ..Odometry::default() });
            }
            let generator_id = Uuid { uuid: [planner; 16] };
            let candidate = CandidateTrajectory { header, generator_id, ..CandidateTrajectory::default() };
            self.buffer.send(ToBuffer::Add(CandidateTrajectories {
                candidate_trajectories: vec![candidate.into()],
                generator_info: vec![GeneratorInfo { generator_id, ..GeneratorInfo::default() }],
            }));
        }
    }

    fn run_clock(self) {
        for _ in 0..6 {
            self.clock.fetch_add(STEP_MS, Ordering::SeqCst);
            self.scheduler.post(ToScheduler::WakeUp);
        }
    }

    fn run_settings(self) {
        for version in [1, 2] {
            self.scheduler.post(ToScheduler::Configure(version));
        }
    }

    /// Returns when everything that was brought has had its cycle.
    fn settle(&self) {
        let buffered = Mailbox::new();
        self.buffer.post(ToBuffer::Wait(buffered.clone()));
        buffered.next();
        let idle = Mailbox::new();
        self.scheduler.post(ToScheduler::WaitForIdle(idle.clone()));
        idle.next();
    }

    /// No further cycle; returns when none runs.
    fn finish(&self) -> SchedulerState {
        let reply = Mailbox::new();
        self.scheduler.post(ToScheduler::Finish(reply.clone()));
        let state = reply.next();
        self.log(Event::Finished);
        state
    }
}

/// Runs a node among planners, a clock and somebody who changes parameters; stops it when all are done, or at any time.
fn drive(stops_early: bool) -> (SchedulerState, Vec<Event>) {
    let node = Node {
        buffer: Mailbox::new(),
        sensors: Mailbox::new(),
        scheduler: Mailbox::new(),
        validation: Mailbox::new(),
        publisher: Mailbox::new(),
        pool: Mailbox::new(),
        grace: Mailbox::new(),
        slots: Default::default(),
        clock: Arc::new(AtomicI64::new(0)),
        events: Default::default(),
    };
    let start = |run: fn(Node)| -> JoinHandle<()> {
        let node = node.clone();
        thread::spawn(move || run(node))
    };
    let mut owners: Vec<_> = [
        Node::run_buffer,
        Node::run_sensors,
        Node::run_validation,
        Node::run_publisher,
        Node::run_pool,
        Node::run_grace,
    ]
    .map(start)
    .into();
    let scheduler = SchedulerActor::new(node.clone());
    owners.push(thread::spawn(move || scheduler.run()));
    let mut world: Vec<_> = [Node::run_clock, Node::run_settings].map(start).into();
    world.extend((0..PLANNERS).map(|planner| {
        let node = node.clone();
        thread::spawn(move || node.run_planner(planner))
    }));
    let early = stops_early.then(|| node.finish());
    world.into_iter().for_each(|thread| thread.join().unwrap());
    let state = early.unwrap_or_else(|| {
        node.settle();
        node.finish()
    });
    node.pool.post(None);
    node.grace.post(None);
    node.buffer.post(ToBuffer::Stop);
    node.sensors.post(ToSensors::Stop);
    node.validation.post(ToValidation::Stop);
    node.publisher.post(ToPublisher::Stop);
    node.scheduler.post(ToScheduler::Stop);
    owners.into_iter().for_each(|thread| thread.join().unwrap());
    let events = node.events.lock().unwrap().clone();
    (state, events)
}

fn started(events: &[Event]) -> Vec<(u64, Trigger, u64)> {
    let started = events.iter().filter_map(|event| match event {
        Event::Started { number, trigger, applied } => Some((*number, *trigger, *applied)),
        _ => None,
    });
    started.collect()
}

#[test]
fn one_cycle_at_a_time_and_every_trigger_starts_one_or_is_merged_into_one() {
    explore(|| {
        let (state, events) = drive(false);
        let mut running = None;
        let (mut triggers, mut cycles) = (0, 0);
        for event in &events {
            match event {
                Event::Triggered => triggers += 1,
                Event::Started { number, .. } => {
                    assert_eq!(running.replace(*number), None, "two cycles at once");
                    cycles += 1;
                    assert_eq!(*number, cycles);
                }
                Event::Published(number, _) => assert_eq!(running, Some(*number)),
                Event::Ended { number, .. } => assert_eq!(running.take(), Some(*number)),
                _ => {}
            }
        }
        assert_eq!(running, None);
        assert_eq!(state.cycles, cycles);
        assert_eq!(state.cycles + state.coalesced, triggers);
    });
}

#[test]
fn no_candidate_is_brought_without_a_cycle_that_has_it_and_a_scene_as_new() {
    explore(|| {
        let (_, events) = drive(false);
        let mut last = Newest::new();
        for event in &events {
            if let Event::Collected { newest, odometry, .. } = event {
                let planned_at = newest.get(&0).copied().unwrap_or(0);
                assert!(*odometry >= planned_at, "a scene older than its candidates");
                assert!(
                    last.iter().all(|(planner, number)| newest[planner] >= *number),
                    "an older candidate again"
                );
                last.clone_from(newest);
            }
        }
        assert_eq!(last, (0..PLANNERS).map(|planner| (planner, ANCHORS)).collect());
    });
}

#[test]
fn the_timer_is_rearmed_from_the_end_of_an_anchors_cycle_and_by_nothing_else() {
    explore(|| {
        let (_, events) = drive(false);
        let triggers: BTreeMap<u64, Trigger> =
            started(&events).into_iter().map(|(number, trigger, _)| (number, trigger)).collect();
        let mut deadline = PERIOD_MS;
        for event in &events {
            match *event {
                Event::Fired { now, before, after } => {
                    assert_eq!(before, deadline);
                    assert!(now >= before, "fired too early");
                    assert!(after > now && after - now <= PERIOD_MS && (after - before) % PERIOD_MS == 0);
                    deadline = after;
                }
                Event::Ended { number, now, before, after } => {
                    assert_eq!(before, deadline);
                    let is_anchor = triggers[&number] == Trigger::Anchor;
                    assert_eq!(after, if is_anchor { now + PERIOD_MS } else { before });
                    deadline = after;
                }
                _ => {}
            }
        }
    });
}

#[test]
fn a_cycle_publishes_once_and_never_after_it_was_given_up() {
    explore(|| {
        let (_, events) = drive(false);
        let mut given_up = Vec::new();
        let mut published = 0;
        for event in &events {
            match event {
                Event::GivenUp(number) => given_up.push(*number),
                Event::Published(number, judged) => {
                    published += 1;
                    assert_eq!(*number, published, "each once, in order");
                    assert!(judged.is_none() || !given_up.contains(number), "published although given up");
                }
                _ => {}
            }
        }
        assert_eq!(published, started(&events).len() as u64);
    });
}

#[test]
fn a_cycle_is_judged_by_the_parameters_that_held_when_it_started() {
    explore(|| {
        let (_, events) = drive(false);
        let applied: BTreeMap<u64, u64> =
            started(&events).into_iter().map(|(number, _, applied)| (number, applied)).collect();
        for event in &events {
            if let Event::Published(number, Some((_, version))) = event {
                assert_eq!(*version, applied[number], "cycle {number}");
            }
        }
    });
}

#[test]
fn it_stops_in_order_from_every_state() {
    explore(|| {
        let (state, events) = drive(true);
        let (before, after) =
            events.split_at(events.iter().position(|event| *event == Event::Finished).unwrap());
        assert_eq!(started(before).len() as u64, state.cycles);
        assert_eq!(started(after), [], "a cycle after the end");
        let ended = before.iter().filter(|event| matches!(event, Event::Ended { .. })).count();
        assert_eq!(ended as u64, state.cycles, "the running cycle has ended");
    });
}
