//! Runs a drive through the actors, from the first message to the last, and gives what came out.
//!
//! The node's clock follows the drive: the fallback timer fires where the drive has no anchor, and everything that a
//! message sets off has happened before the next one is delivered. So the outputs depend on the drive and the settings
//! alone, not on the threads that judge or the speed of the machine.

use crate::allocations;
use crate::commands::Failure;
use crate::drive::{Event, TimedInput};
use crate::recorder::{Drawing, Recorder};
use crate::report::markers::Markers;
use crate::report::markers::scene_updates::SceneUpdates;
use crate::report::page::Page;
use crate::report::summary::{Input as InputSummary, Received, RunResult};
use crate::settings::Settings;
use crossbeam_channel::bounded;
use lanelet_map::Map;
use messages::Interface;
use messages::builtin_interfaces::Time;
use motion::{VehicleDimensions, VehicleInfo};
use selection::{Pipeline, Ranker, Validator};
use selector_actors::cycle::{CycleReport, CycleTimes};
use selector_actors::publisher::PublishedTimes;
use selector_actors::{Clock, Config, Input, InputTopic, SelectorSystem, SystemError};
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Messages that are read ahead.
const READ_AHEAD: usize = 64;
/// At most this many malformed messages are told one by one; all are counted.
const MAX_MALFORMED_WARNINGS: usize = 5;

/// How fast a drive runs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Rate {
    /// As fast as the machine allows. Published times are zero, so that the output is the same every time.
    Max,
    /// This many seconds of the drive in one second. Published times are measured.
    Times(f64),
}

/// A rate that is none.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("\"{0}\" is no rate; write max, or a number greater than 0 such as 1 or 2.5")]
pub struct BadRate(pub String);

impl std::str::FromStr for Rate {
    type Err = BadRate;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        match text.parse::<f64>() {
            _ if text == "max" => Ok(Self::Max),
            Ok(rate) if rate.is_finite() && rate > 0.0 => Ok(Self::Times(rate)),
            _ => Err(BadRate(text.to_owned())),
        }
    }
}

/// What to run, and where the results go.
#[derive(Debug)]
pub struct Session {
    /// Drive or scene.
    pub input: InputSummary,
    /// Wire form of candidates in the output.
    pub interface: Interface,
    /// When the drive begins and ends.
    pub span: (Time, Time),
    /// Threads that judge.
    pub threads: usize,
    /// How fast.
    pub rate: Rate,
    /// File for what the node publishes.
    pub output: Option<PathBuf>,
    /// Map from elsewhere than the drive.
    pub map: Option<Arc<Map>>,
    /// Number of a cycle to keep for a closer look; the session ends with it.
    pub watch: Option<u64>,
    /// Whether to gather the report page.
    pub page: bool,
    /// Whether to draw every cycle into the output.
    pub markers: bool,
    /// Whether to draw a progress bar.
    pub progress: bool,
}

/// What a session gives, with what went wrong on the way.
#[derive(Debug)]
pub struct Ended {
    /// Counts, latencies, output.
    pub result: RunResult,
    /// The cycle that was asked for, if it came, with the time that it took.
    pub watched: Option<(CycleReport, CycleTimes)>,
    /// The report page, if it was asked for; it lacks the result of the run.
    pub page: Option<Page>,
    /// What stopped the session early, if anything; what was done before stands.
    pub errors: Vec<Failure>,
    /// What was odd.
    pub warnings: Vec<Failure>,
}

impl Session {
    /// Runs all events of a drive through the node.
    ///
    /// # Errors
    /// The node cannot be started; nothing was written.
    pub fn run(
        self,
        settings: &Settings,
        events: impl Iterator<Item = Event> + Send,
    ) -> Result<Ended, Failure> {
        let recorder = match &self.output {
            Some(path) => Recorder::writing(path, self.interface)?,
            None => Recorder::counting(),
        };
        self.run_into(&recorder, settings, events, |events, take| read_ahead(events, take))
    }

    /// The same with a recorder of the caller's. Events are read between cycles, so that reading takes no processor
    /// from judging.
    ///
    /// # Errors
    /// The node cannot be started.
    pub fn measure(
        self,
        recorder: &Recorder,
        settings: &Settings,
        events: impl Iterator<Item = Event>,
    ) -> Result<Ended, Failure> {
        self.run_into(recorder, settings, events, |mut events, take| {
            events.all(take);
        })
    }

    fn run_into<E: Iterator<Item = Event>>(
        self,
        recorder: &Recorder,
        settings: &Settings,
        events: E,
        play: impl FnOnce(E, &mut dyn FnMut(Event) -> bool),
    ) -> Result<Ended, Failure> {
        let started = Instant::now();
        if let Some(cycle) = self.watch {
            recorder.watch(cycle);
        }
        if self.page {
            recorder.lock().page = Some(page_of(settings)?);
        }
        if self.markers {
            let markers = Markers::new(validator_of(settings)?);
            let updates = SceneUpdates::new(validator_of(settings)?);
            recorder.lock().drawing = Some(Drawing { markers, updates });
        }
        let clock = Clock::stepped(self.span.0);
        let config = self.config(settings, clock)?;
        let system = SelectorSystem::start(config, Box::new(recorder.clone()))?;
        let mut player = Player::new(&self, &system, started);
        if let Some(map) = self.map.clone() {
            player.stopped = system.deliver(Input::ReadyMap(map, "map".into())).err().map(Failure::from);
        }
        play(events, &mut |event| {
            // Nothing that comes after the watched cycle changes it.
            if player.stopped.is_some() || recorder.lock().watched.is_some() {
                return false;
            }
            player.take(event, recorder);
            true
        });
        player.bar.finish_and_clear();
        let Player { messages, mut warnings, malformed, stopped, .. } = player;
        let mut errors: Vec<Failure> = stopped.into_iter().collect();
        let coalesced = match system.stop() {
            Ok(state) => state.coalesced,
            Err(error) => {
                if errors.is_empty() {
                    errors.push(error.into());
                }
                0
            }
        };
        let output = recorder.finish().unwrap_or_else(|error| {
            // The first failure says what is wrong; this one may only say it again.
            if errors.is_empty() {
                errors.push(error.into());
            }
            None
        });
        if malformed > MAX_MALFORMED_WARNINGS {
            warnings.push(Failure::note(
                "malformed_message",
                format!("{malformed} messages are malformed in all"),
            ));
        }
        if errors.is_empty() {
            errors.extend(nothing_decoded(&messages, self.interface));
        }
        let statistics = std::mem::take(&mut recorder.lock().statistics);
        let watched = recorder.lock().watched.take();
        let page = recorder.lock().page.take();
        let result = RunResult {
            input: self.input,
            interface: self.interface.name(),
            statistics,
            messages,
            coalesced,
            output,
            wall: started.elapsed(),
        };
        Ok(Ended { result, watched, page, errors, warnings })
    }

    fn config(&self, settings: &Settings, clock: Clock) -> Result<Config, Failure> {
        let (vehicle, validator) = (vehicle_of(settings)?, validator_of(settings)?);
        let ranker = Ranker::new(settings.ranker.clone(), settings.selector.sources());
        Ok(Config {
            clock,
            threads: self.threads,
            fallback_period_ms: settings.selector.fallback_period_ms,
            duration_time_s: settings.concatenator.duration_time,
            vehicle,
            pipeline: Pipeline::new(validator, ranker),
            interface: self.interface,
            // A replay at full speed gives the same bytes on every machine, however slow.
            cycle_budget: match self.rate {
                Rate::Max => None,
                Rate::Times(_) => Some(settings.selector.cycle_budget()),
            },
            published_times: match self.rate {
                Rate::Max => PublishedTimes::Zero,
                Rate::Times(_) => PublishedTimes::Measured,
            },
            count_allocations: Some(allocations::of_this_thread),
        })
    }
}

pub(crate) fn vehicle_of(settings: &Settings) -> Result<VehicleInfo, motion::VehicleError> {
    let vehicle = &settings.vehicle;
    VehicleInfo::new(VehicleDimensions {
        wheel_radius_m: vehicle.wheel_radius,
        wheel_width_m: vehicle.wheel_width,
        wheel_base_m: vehicle.wheel_base,
        wheel_tread_m: vehicle.wheel_tread,
        front_overhang_m: vehicle.front_overhang,
        rear_overhang_m: vehicle.rear_overhang,
        left_overhang_m: vehicle.left_overhang,
        right_overhang_m: vehicle.right_overhang,
        vehicle_height_m: vehicle.vehicle_height,
        max_steer_angle_rad: vehicle.max_steer_angle,
    })
}

/// The filters that the settings load.
pub(crate) fn validator_of(settings: &Settings) -> Result<Validator, Failure> {
    Ok(Validator::new(settings.validator.clone(), &vehicle_of(settings)?)?)
}

/// An empty report page for a run with these settings.
pub(crate) fn page_of(settings: &Settings) -> Result<Page, Failure> {
    Ok(Page::new(validator_of(settings)?, settings.selector.cycle_budget()))
}

/// A drive of which no candidate message can be decoded was judged by nobody, however smoothly it ran.
fn nothing_decoded(messages: &BTreeMap<String, Received>, interface: Interface) -> Option<Failure> {
    let lost = |topic: InputTopic| {
        let received = messages.get(&topic.full_name())?;
        let malformed = received.dropped.get("malformed").copied().unwrap_or(0);
        (received.received > 0 && malformed == received.received).then_some((topic, malformed))
    };
    let (topic, count) = lost(InputTopic::Generative).or_else(|| lost(InputTopic::Backup))?;
    let name = topic.full_name();
    Some(Failure::malformed(format!(
        "none of the {count} messages on {name} is a message of interface {interface}; try another --interface"
    )))
}

/// Hands events over in order until they are refused; a reading thread stays ahead by a bounded number of them.
fn read_ahead(events: impl Iterator<Item = Event> + Send, take: &mut dyn FnMut(Event) -> bool) {
    let (sender, receiver) = bounded(READ_AHEAD);
    std::thread::scope(|scope| {
        scope.spawn(move || {
            for event in events {
                // The other side hangs up when the session has failed.
                if sender.send(event).is_err() {
                    break;
                }
            }
        });
        for event in receiver {
            if !take(event) {
                break;
            }
        }
    });
}

/// Feeds the node and keeps count of what it is fed.
struct Player<'a> {
    system: &'a SelectorSystem,
    rate: Rate,
    started: Instant,
    first: Time,
    bar: indicatif::ProgressBar,
    messages: BTreeMap<String, Received>,
    warnings: Vec<Failure>,
    malformed: usize,
    stopped: Option<Failure>,
}

impl<'a> Player<'a> {
    fn new(session: &Session, system: &'a SelectorSystem, started: Instant) -> Self {
        let (first, last) = session.span;
        let bar = if session.progress {
            let milliseconds = (last.nanoseconds() - first.nanoseconds()) / 1_000_000;
            indicatif::ProgressBar::new(u64::try_from(milliseconds).unwrap_or(0))
                .with_style(indicatif::ProgressStyle::default_bar())
        } else {
            indicatif::ProgressBar::hidden()
        };
        let messages = InputTopic::ALL.map(|topic| (topic.full_name(), Received::default())).into();
        Self {
            system,
            rate: session.rate,
            started,
            first,
            bar,
            messages,
            warnings: Vec::new(),
            malformed: 0,
            stopped: None,
        }
    }

    fn take(&mut self, event: Event, recorder: &Recorder) {
        match event {
            Event::Input(input) => {
                self.count(input.topic);
                let milliseconds = (input.time.nanoseconds() - self.first.nanoseconds()) / 1_000_000;
                if self.bar.position() + 100 < u64::try_from(milliseconds).unwrap_or(0) {
                    self.bar.set_position(u64::try_from(milliseconds).unwrap_or(0));
                    self.bar.set_message(crate::report::table::progress_line(&recorder.lock().statistics));
                }
                self.stopped = self.deliver(input).err().map(Failure::from);
            }
            Event::Malformed(topic, error) => {
                self.count(topic).dropped.entry("malformed").and_modify(|count| *count += 1).or_insert(1);
                self.malformed += 1;
                if self.malformed <= MAX_MALFORMED_WARNINGS {
                    self.warnings.push(Failure::note("malformed_message", error.to_string()));
                }
            }
            Event::Broken(error) => self.stopped = Some(error.into()),
        }
    }

    fn count(&mut self, topic: InputTopic) -> &mut Received {
        let received = self.messages.entry(topic.full_name()).or_default();
        received.received += 1;
        received
    }

    fn deliver(&self, input: TimedInput) -> Result<(), SystemError> {
        let due = match self.rate {
            Rate::Max => None,
            Rate::Times(rate) => Some(self.keep_pace(rate, input.time)?),
        };
        self.system.advance_to(input.time)?;
        // A message that had to wait for the cycle before it is late, and its latency shows that.
        self.system.deliver_due(input.input, due.unwrap_or_else(Instant::now))
    }

    /// Waits until the drive's time has come, and lets the fallback timer fire at its own time before that. Gives when
    /// the time came.
    fn keep_pace(&self, rate: f64, time: Time) -> Result<Instant, SystemError> {
        loop {
            let deadline = self.system.settle()?.deadline;
            let next = deadline.min(time);
            let due_s = (next.nanoseconds() - self.first.nanoseconds()) as f64 * 1e-9 / rate;
            let due = self.started + Duration::from_secs_f64(due_s.max(0.0));
            std::thread::sleep(due.saturating_duration_since(Instant::now()));
            if next == time {
                return Ok(due);
            }
            self.system.advance_to(next)?;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates() {
        assert_eq!("max".parse(), Ok(Rate::Max));
        assert_eq!("2.5".parse(), Ok(Rate::Times(2.5)));
        for bad in ["", "0", "-1", "nan", "inf", "fast"] {
            assert!(bad.parse::<Rate>().is_err(), "{bad}");
        }
    }
}
