//! Load on the whole actor system: messages as fast as cycles end, or at a rate, with everything counted.
//!
//! Messages go in as a graph brings them, serialised; decoding them is part of what is measured. What comes out is
//! encoded as if every output had a subscriber, and dropped. At a rate, a message is due at a fixed time, whatever became of
//! those before it, and latency counts from then: a cycle that blocks the next one costs both. As fast as cycles end,
//! time is stepped by [`PERIOD_NS`] and no cycle is cut, so that the verdicts depend on load and settings alone.

pub mod drive;
mod feed;
pub mod graph;
pub mod limit;

use crate::allocations;
use crate::commands::Failure;
use crate::commands::node::received;
use crate::recorder::Recorder;
use crate::report::summary::{Input as InputSummary, RunResult};
use crate::report::usage;
use crate::ros::encoder::Encoder;
use crate::scenario::load::{Load, LoadMessages};
use crate::session::{Ended, page_of, validator_of, vehicle_of};
use crate::settings::Settings;
use feed::Feed;
use messages::Interface;
use messages::builtin_interfaces::Time;
use selection::{Pipeline, Ranker};
use selector_actors::publisher::PublishedTimes;
use selector_actors::{Clock, Config, SelectorSystem};
use serde::Serialize;
use std::time::{Duration, Instant};

/// Time between two anchors where they come as fast as cycles end.
pub const PERIOD_NS: i64 = 100_000_000;
/// Wire form of the load.
const INTERFACE: Interface = Interface::V0_53;
/// Memory has its steady size after this share of a run, or this long.
const WARM_SHARE: u64 = 10;
const WARM_TIME: Duration = Duration::from_secs(60);
/// After this long without an answer no further one is waited for.
const SILENCE: Duration = Duration::from_secs(2);

/// How fast anchors come.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Pace {
    /// One when the cycle of the one before has ended.
    Max,
    /// So many in a second.
    Hertz(f64),
}

/// A pace that is none.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("\"{0}\" is no rate; write max, or cycles per second such as 10")]
pub struct BadPace(pub String);

impl std::str::FromStr for Pace {
    type Err = BadPace;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        match text.parse::<f64>() {
            _ if text == "max" => Ok(Self::Max),
            Ok(rate) if rate.is_finite() && (0.001..=10_000.0).contains(&rate) => Ok(Self::Hertz(rate)),
            _ => Err(BadPace(text.to_owned())),
        }
    }
}

/// A run of a load.
#[derive(Debug, Clone, Copy)]
pub struct Stress {
    /// What each cycle works on.
    pub load: Load,
    /// Anchors.
    pub cycles: u64,
    /// How fast they come.
    pub pace: Pace,
    /// Threads that judge.
    pub threads: usize,
    /// A cycle is cut then, and missed if it ends later. `None`: the settings' budget at a rate, else no end.
    pub deadline: Option<Duration>,
    /// Through the graph: after how long the planners leave and join anew, in the mean; `None`: they stay.
    pub restart_planners: Option<Duration>,
    /// Whether to gather the report page.
    pub page: bool,
    /// Whether to draw a progress bar.
    pub progress: bool,
}

/// What a run gives.
#[derive(Debug)]
pub struct Stressed {
    /// Counts and latencies.
    pub ended: Ended,
    /// Cycles that missed the deadline.
    pub missed: u64,
    /// Resident memory.
    pub memory_mb: Memory,
    /// What was allocated and not given back.
    pub heap_mb: Heap,
    /// The most messages that waited for their owners at the same time; `None` where nobody counted.
    pub most_waiting: Option<usize>,
}

/// Resident memory in the course of a run, MB.
#[derive(Debug, Clone, Copy, Default, Serialize)]
pub struct Memory {
    /// Before the first cycle.
    pub start: Option<f64>,
    /// After a tenth of the run, or its first minute.
    pub warm: Option<f64>,
    /// The most that was seen since, to the end.
    pub most: Option<f64>,
    /// After the last cycle.
    pub end: Option<f64>,
}

impl Memory {
    /// How much more there was at the most than when it was warm, percent.
    #[must_use]
    pub fn growth_percent(&self) -> Option<f64> {
        let warm = self.warm.filter(|warm| *warm > 0.0)?;
        Some(100.0 * (self.most.or(self.end)? - warm) / warm)
    }

    /// Takes a look at the memory in the course of a run.
    fn look(&mut self, is_warm: bool) {
        let now = usage::resident_memory_mb();
        match (is_warm, self.warm) {
            (true, None) => (self.warm, self.most) = (now, now),
            (true, Some(_)) => self.most = self.most.zip(now).map(|(most, now)| most.max(now)).or(now),
            (false, _) => {}
        }
    }

    /// Takes the last look.
    fn close(&mut self) {
        self.end = usage::resident_memory_mb();
        self.look(self.warm.is_some());
    }
}

/// What was allocated since the run began and is not given back, MB; null where nobody counts.
#[derive(Debug, Clone, Copy, Default, Serialize)]
pub struct Heap {
    /// After a tenth of the run, or its first minute.
    pub warm: Option<f64>,
    /// After the last cycle, before the actors stop.
    pub end: Option<f64>,
}

impl Heap {
    fn now() -> Option<f64> {
        allocations::is_counting().then(|| allocations::outstanding_bytes() as f64 / 1e6)
    }
}

impl Stress {
    /// Runs the load.
    ///
    /// # Errors
    /// The node cannot be started.
    pub fn run(&self, settings: &Settings) -> Result<Stressed, Failure> {
        let began = Instant::now();
        let recorder = Recorder::counting();
        {
            let mut recording = recorder.lock();
            recording.encoder = Some(Encoder::new(INTERFACE));
            recording.deadline = self.deadline;
            recording.page = self.page.then(|| page_of(settings)).transpose()?;
        }
        let messages = self.load.messages();
        let mut feed = Feed::of(&messages);
        let clock = match self.pace {
            Pace::Max => Clock::stepped(LoadMessages::start()),
            Pace::Hertz(_) => Clock::System,
        };
        let system = SelectorSystem::start(self.config(settings, clock)?, Box::new(recorder.clone()))?;
        let mut course = Course::new(self, began);
        let stopped = self.drive(&system, &messages, &mut feed, &mut course).err();
        let received = received(system.inlets().tally());
        let most_waiting = Some(system.inlets().tally().most_waiting());
        course.heap_mb.end = Heap::now();
        let stopping = system.stop().map_err(Failure::from);
        course.memory_mb.close();
        course.bar.finish_and_clear();
        let coalesced = stopping.as_ref().map_or(0, |state| state.coalesced);
        // The first failure says what is wrong; the other may only say it again.
        let errors = stopped.or(stopping.err()).into_iter().collect();
        let mut recording = recorder.lock();
        let result = RunResult {
            input: InputSummary { name: self.load.scene.name().to_owned(), seed: Some(self.load.seed) },
            interface: INTERFACE.name(),
            statistics: std::mem::take(&mut recording.statistics),
            messages: received,
            coalesced,
            output: None,
            wall: began.elapsed(),
        };
        let ended =
            Ended { result, watched: None, page: recording.page.take(), errors, warnings: Vec::new() };
        let Course { memory_mb, heap_mb, .. } = course;
        Ok(Stressed { ended, missed: recording.missed, memory_mb, heap_mb, most_waiting })
    }

    fn config(&self, settings: &Settings, clock: Clock) -> Result<Config, Failure> {
        let (vehicle, validator) = (vehicle_of(settings)?, validator_of(settings)?);
        let ranker = Ranker::new(settings.ranker.clone(), settings.selector.sources());
        let usual_budget = match self.pace {
            Pace::Max => None,
            Pace::Hertz(_) => Some(settings.selector.cycle_budget()),
        };
        Ok(Config {
            clock,
            threads: self.threads,
            fallback_period_ms: settings.selector.fallback_period_ms,
            duration_time_s: settings.concatenator.duration_time,
            cycle_budget: self.deadline.or(usual_budget),
            vehicle,
            pipeline: Pipeline::new(validator, ranker),
            interface: INTERFACE,
            published_times: PublishedTimes::Measured,
            count_allocations: Some(allocations::of_this_thread),
        })
    }

    fn drive(
        &self,
        system: &SelectorSystem,
        messages: &LoadMessages,
        feed: &mut Feed,
        course: &mut Course,
    ) -> Result<(), Failure> {
        for input in messages.once() {
            system.inlets().tally().count_received(input.topic());
            system.deliver(input)?;
        }
        course.memory_mb.start = usage::resident_memory_mb();
        match self.pace {
            Pace::Max => self.step(system, feed, course),
            Pace::Hertz(rate) => self.keep_pace(rate, system, feed, course),
        }
    }

    /// Time stands while a cycle runs.
    fn step(&self, system: &SelectorSystem, feed: &mut Feed, course: &mut Course) -> Result<(), Failure> {
        let start_ns = LoadMessages::start().nanoseconds();
        for cycle in 1..=self.cycles {
            let now = Time::from_nanoseconds(start_ns + i64::try_from(cycle).unwrap_or(i64::MAX) * PERIOD_NS);
            system.advance_to(now)?;
            for message in feed.messages() {
                let due = Instant::now();
                let input = message.at(now)?;
                system.inlets().tally().count_received(input.topic());
                system.deliver_due(input, due)?;
            }
            course.has_run(cycle);
        }
        Ok(())
    }

    /// Time passes by itself; messages come when they are due.
    fn keep_pace(
        &self,
        rate_hz: f64,
        system: &SelectorSystem,
        feed: &mut Feed,
        course: &mut Course,
    ) -> Result<(), Failure> {
        let runtime = tokio::runtime::Builder::new_current_thread()
            .build()
            .map_err(|error| Failure::internal(error.to_string()))?;
        let period = Duration::from_secs_f64(1.0 / rate_hz);
        let (start, start_time) = (Instant::now(), Clock::System.now());
        for cycle in 1..=self.cycles {
            let since_start = period.mul_f64(cycle as f64);
            let due = start + since_start;
            let since_start_ns = i64::try_from(since_start.as_nanos()).unwrap_or(i64::MAX);
            let stamp = Time::from_nanoseconds(start_time.nanoseconds().saturating_add(since_start_ns));
            std::thread::sleep(due.saturating_duration_since(Instant::now()));
            for message in feed.messages() {
                let input = message.at(stamp)?;
                let taken = runtime.block_on(system.inlets().take(input, due));
                taken.map_err(|closed| Failure::internal(closed.to_string()))?;
            }
            course.has_run(cycle);
        }
        system.settle()?;
        Ok(())
    }
}

/// How far a run has come.
struct Course {
    began: Instant,
    cycles: u64,
    memory_mb: Memory,
    heap_mb: Heap,
    bar: indicatif::ProgressBar,
}

/// Cycles between two looks at the bar and the memory.
const LOOK_EVERY: u64 = 10;

impl Course {
    fn new(stress: &Stress, began: Instant) -> Self {
        let bar = if stress.progress {
            indicatif::ProgressBar::new(stress.cycles).with_style(indicatif::ProgressStyle::default_bar())
        } else {
            indicatif::ProgressBar::hidden()
        };
        Self { began, cycles: stress.cycles, memory_mb: Memory::default(), heap_mb: Heap::default(), bar }
    }

    fn has_run(&mut self, cycle: u64) {
        if !cycle.is_multiple_of(LOOK_EVERY) && cycle != self.cycles {
            return;
        }
        self.bar.set_position(cycle);
        let is_warm = cycle >= self.cycles / WARM_SHARE || self.began.elapsed() > WARM_TIME;
        if is_warm && self.memory_mb.warm.is_none() {
            self.heap_mb.warm = Heap::now();
        }
        self.memory_mb.look(is_warm);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn growth_is_from_warm_to_the_most() {
        let memory = Memory { start: Some(5.0), warm: Some(50.0), most: Some(51.0), end: Some(49.0) };
        assert_eq!(memory.growth_percent(), Some(2.0));
        assert_eq!(Memory { most: None, ..memory }.growth_percent(), Some(-2.0));
        assert_eq!(Memory { warm: None, ..memory }.growth_percent(), None);
        assert_eq!(Memory { warm: Some(0.0), ..memory }.growth_percent(), None);
    }

    #[test]
    fn paces() {
        assert_eq!("max".parse(), Ok(Pace::Max));
        assert_eq!("12.5".parse(), Ok(Pace::Hertz(12.5)));
        for bad in ["", "0", "-1", "nan", "inf", "1e9", "fast"] {
            assert!(bad.parse::<Pace>().is_err(), "{bad}");
        }
    }
}
