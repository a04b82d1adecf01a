//! Starts the actors, feeds them, steps their clock, and stops them.
//!
//! [`SelectorSystem`] is what a door to the world holds. A recorded drive goes through it in lock-step: a message is
//! delivered and everything that it sets off has happened before the next one is, so it gives the same outputs on any
//! number of threads, at any speed. A graph brings messages when they come, through [`Inlets`], and its clock runs.

use crate::buffer::{Add, Buffer, SetDurationTime};
use crate::clock::Clock;
use crate::inlets::{Inlets, SensorSlots};
use crate::lifeline::Lifelines;
use crate::map_decoder::MapDecoder;
use crate::provider::{OpenSpace, ProviderConfig, SetGoal, SetRegion};
use crate::publisher::{Outlet, PublishedTimes, Publisher, Report, Sink, SinkError};
use crate::scheduler::{
    Configure, Finish, Parameters, Scheduler, SchedulerState, SetFallbackPeriod, Stages, TimerWakeUp,
    WaitForIdle, Wire, sleep_and_wake,
};
use crate::sensors::{Sense, Sensors, WaitForSensors};
use crate::tally::Tally;
use crate::topics::Input;
use crate::validation::{SetRankerParameters, SetValidatorParameters, Validation};
use actix::{Actor, Addr, System};
use crossbeam_channel::{Sender, bounded};
use messages::Interface;
use messages::autoware_perception_msgs::TrafficLightGroupArray;
use messages::builtin_interfaces::Time;
use motion::VehicleInfo;
use open_space::provider::{OutOfRange, Region};
use rayon::{ThreadPool, ThreadPoolBuilder};
use selection::parameters::{RankerParameters, ValidatorParameters};
use selection::ranker::GeneratorSource;
use selection::{Pipeline, Scene};
use std::sync::{Arc, OnceLock};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// What the actors start with.
#[derive(Debug)]
pub struct Config {
    /// Where time comes from.
    pub clock: Clock,
    /// Threads that judge; at least 1.
    pub threads: usize,
    /// Time without an anchor after which a cycle runs all the same.
    pub fallback_period_ms: i64,
    /// Age beyond which a candidate is dropped.
    pub duration_time_s: f64,
    /// Time after its start at which a cycle judges no further candidate. `None`: it judges all of them, however long
    /// that takes; only so do the outputs not depend on the speed of the machine.
    pub cycle_budget: Option<Duration>,
    /// The own vehicle.
    pub vehicle: VehicleInfo,
    /// Filters and ranker.
    pub pipeline: Pipeline,
    /// Wire form of candidates; where they carry no turn indicator command, none is published.
    pub interface: Interface,
    /// Whether published times are measured.
    pub published_times: PublishedTimes,
    /// Heap allocations of the calling thread so far; `None` where nobody counts them.
    pub count_allocations: Option<fn() -> u64>,
}

/// Why the actors cannot be started or cannot go on.
#[derive(Debug, thiserror::Error)]
pub enum SystemError {
    /// The operating system gave no thread.
    #[error("a thread cannot be started: {0}; are there limits on threads or memory?")]
    NoThread(String),
    /// Parameters of the open-space provider that are out of their range.
    #[error("{}", refusals(.0))]
    Parameters(Vec<OutOfRange>),
    /// An actor is gone; nothing more will be published.
    #[error("the selector has stopped: its {0} is gone; see the log for a panic, and start it anew")]
    ActorGone(&'static str),
    /// An output could not be written. What was written before stands.
    #[error(transparent)]
    Sink(#[from] SinkError),
}

fn refusals(refused: &[OutOfRange]) -> String {
    refused.iter().map(ToString::to_string).collect::<Vec<_>>().join("; ")
}

/// The running actors.
#[derive(Debug)]
pub struct SelectorSystem {
    clock: Clock,
    actors: Actors,
    inlets: Inlets,
    system: System,
    thread: Option<JoinHandle<()>>,
    failure: Arc<OnceLock<SinkError>>,
    lifelines: Lifelines,
}

#[derive(Debug, Clone)]
struct Actors {
    provider: Option<Addr<OpenSpace>>,
    buffer: Addr<Buffer>,
    sensors: Addr<Sensors>,
    scheduler: Addr<Scheduler>,
    validation: Addr<Validation>,
}

impl SelectorSystem {
    /// Starts the actors on a thread of their own, and the pool that judges.
    ///
    /// # Errors
    /// The operating system gives no threads.
    pub fn start(config: Config, sink: Box<dyn Sink>) -> Result<Self, SystemError> {
        Self::start_with_provider(config, None, sink)
    }

    /// Starts the actors, the open-space provider among them if there is a configuration for it. It rests until it has
    /// a goal.
    ///
    /// # Errors
    /// The operating system gives no threads, or a parameter is out of its range.
    pub fn start_with_provider(
        config: Config,
        provider: Option<ProviderConfig>,
        sink: Box<dyn Sink>,
    ) -> Result<Self, SystemError> {
        let shared = Shared::default();
        let lifelines = shared.lifelines.clone();
        let pool = ThreadPoolBuilder::new()
            .num_threads(config.threads.max(1))
            .thread_name(|index| format!("judge-{index}"))
            .panic_handler(move |_| lifelines.cut("pool"))
            .build()
            .map_err(|error| SystemError::NoThread(error.to_string()))?;
        let line = shared.lifelines.line("map decoder");
        let parameters = config.pipeline.validator_parameters().clone();
        let decoder = MapDecoder::start(parameters, line);
        let decoder = decoder.map_err(|error| SystemError::NoThread(error.to_string()))?;
        let clock = config.clock.clone();
        let parts = Parts { config, provider, sink, pool: Arc::new(pool), decoder, shared: shared.clone() };
        let (ready, started) = bounded(1);
        let thread = std::thread::Builder::new()
            .name("selector".to_owned())
            .spawn(move || run_actors(parts, &ready))
            .map_err(|error| SystemError::NoThread(error.to_string()))?;
        let (actors, system) = started.recv().map_err(|_| SystemError::ActorGone("arbiter"))??;
        let Shared { failure, slots, tally, lifelines } = shared;
        let Actors { provider, buffer, sensors, .. } = actors.clone();
        let inlets = Inlets::new(slots, tally, buffer, sensors, provider);
        Ok(Self { clock, actors, inlets, system, thread: Some(thread), failure, lifelines })
    }

    /// The way in for messages that come when they come.
    #[must_use]
    pub fn inlets(&self) -> &Inlets {
        &self.inlets
    }

    /// Takes in one message and returns when all that it sets off has happened.
    ///
    /// # Errors
    /// The actors are gone, or an output cannot be written.
    pub fn deliver(&self, input: Input) -> Result<(), SystemError> {
        self.deliver_due(input, Instant::now())
    }

    /// The same for a message that should have come at `due`: latencies count from then.
    ///
    /// # Errors
    /// The actors are gone, or an output cannot be written.
    pub fn deliver_due(&self, input: Input, due: Instant) -> Result<(), SystemError> {
        self.all_alive()?;
        match input {
            Input::Generative(message) => {
                self.actors.buffer.do_send(Add { message, anchor: Some(due) });
                self.settle_buffer()?;
                self.settle().map(|_| ())
            }
            Input::Backup(message) => {
                self.actors.buffer.do_send(Add { message, anchor: None });
                self.settle_buffer()
            }
            Input::Map(_) | Input::ReadyMap(..) | Input::Route(_) => {
                self.actors.sensors.do_send(Sense(input));
                self.ask("sensors", |reply| self.actors.sensors.do_send(WaitForSensors(reply)))
            }
            Input::GoalPose(goal) => {
                if let Some(provider) = &self.actors.provider {
                    provider.do_send(SetGoal(goal));
                }
                Ok(())
            }
            sensor => {
                self.inlets.put(sensor);
                Ok(())
            }
        }
    }

    /// Lets time pass until `time`: the fallback timer fires at each of its deadlines on the way.
    ///
    /// # Errors
    /// The actors are gone, or an output cannot be written.
    pub fn advance_to(&self, time: Time) -> Result<(), SystemError> {
        loop {
            let deadline = self.settle()?.deadline;
            if deadline > time {
                break;
            }
            self.clock.set(deadline);
            self.wake_timer()?;
        }
        // A clock that was set back has to be noticed by the timer, too.
        let goes_back = time < self.clock.now();
        self.clock.set(time);
        if goes_back { self.wake_timer() } else { Ok(()) }
    }

    /// Sets the clock to `time` in one leap, forward or back, as a simulator does: the timer fires at most once.
    ///
    /// # Errors
    /// The actors are gone, or an output cannot be written.
    pub fn jump_to(&self, time: Time) -> Result<(), SystemError> {
        self.clock.set(time);
        self.wake_timer()
    }

    fn wake_timer(&self) -> Result<(), SystemError> {
        self.actors.scheduler.do_send(TimerWakeUp);
        self.settle().map(|_| ())
    }

    /// Returns when no cycle runs or waits.
    ///
    /// # Errors
    /// The actors are gone, or an output could not be written.
    pub fn settle(&self) -> Result<SchedulerState, SystemError> {
        let state = self.ask("scheduler", |reply| self.actors.scheduler.do_send(WaitForIdle(reply)))?;
        match self.failure.get() {
            Some(failure) => Err(failure.clone().into()),
            None => Ok(state),
        }
    }

    /// The buffer has no messages of its own to wait for, so a reading of its mailbox is enough.
    fn settle_buffer(&self) -> Result<(), SystemError> {
        self.ask("buffer", |reply| self.actors.buffer.do_send(crate::buffer::WaitForBuffer(reply)))
    }

    /// Gives the open-space provider a goal and what surrounds it, from the next cycle on, or takes it away; a plan in
    /// progress is called off. Nothing happens where the actors were started without a provider.
    pub fn set_region(&self, region: Option<Arc<Region>>) {
        if let Some(provider) = &self.actors.provider {
            provider.do_send(SetRegion(region));
        }
    }

    /// Changes the fallback period; a new value restarts the timer, the same one does not.
    ///
    /// # Errors
    /// The actors are gone.
    pub fn set_fallback_period_ms(&self, period_ms: i64) -> Result<(), SystemError> {
        self.actors.scheduler.do_send(SetFallbackPeriod(period_ms));
        self.settle().map(|_| ())
    }

    /// Changes all parameters together, from the next cycle on. Returns at once.
    pub fn configure(&self, parameters: Parameters) {
        self.actors.scheduler.do_send(Configure(Box::new(parameters)));
    }

    /// Changes how long candidates are kept, from the next cycle on.
    pub fn set_duration_time_s(&self, duration_time_s: f64) {
        self.actors.buffer.do_send(SetDurationTime(duration_time_s));
    }

    /// Changes the parameters of the filters, from the next cycle on.
    pub fn set_validator_parameters(&self, parameters: ValidatorParameters) {
        self.actors.validation.do_send(SetValidatorParameters(parameters));
    }

    /// Changes the parameters of the ranker and its table of generators, from the next cycle on.
    pub fn set_ranker_parameters(&self, parameters: RankerParameters, sources: Vec<GeneratorSource>) {
        self.actors.validation.do_send(SetRankerParameters(parameters, sources));
    }

    /// Lets the running cycle end and no other start, then stops the actors; the sink is dropped before this returns.
    ///
    /// # Errors
    /// The actors were gone already, or an output could not be written.
    pub fn stop(mut self) -> Result<SchedulerState, SystemError> {
        let state = self.ask("scheduler", |reply| self.actors.scheduler.do_send(Finish(reply)));
        self.system.stop();
        if let Some(thread) = self.thread.take()
            && thread.join().is_err()
        {
            return Err(SystemError::ActorGone("arbiter"));
        }
        match self.failure.get() {
            Some(failure) => Err(failure.clone().into()),
            None => state,
        }
    }
}

impl SelectorSystem {
    /// Returns when an actor has died; nothing more will be published.
    pub async fn death(&self) -> SystemError {
        SystemError::ActorGone(self.lifelines.death().await)
    }

    /// Sends a question that carries its reply channel, and waits for the answer.
    fn ask<T>(&self, whom: &'static str, send: impl FnOnce(Sender<T>)) -> Result<T, SystemError> {
        let (reply, answer) = bounded(1);
        send(reply);
        // An actor that dies drops the channel, so this cannot wait for ever.
        let answer = answer.recv();
        self.all_alive()?;
        answer.map_err(|_| SystemError::ActorGone(whom))
    }

    fn all_alive(&self) -> Result<(), SystemError> {
        self.lifelines.dead().map_or(Ok(()), |whose| Err(SystemError::ActorGone(whose)))
    }
}

impl Drop for SelectorSystem {
    fn drop(&mut self) {
        self.system.stop();
    }
}

/// What the actors share with whoever holds the system.
#[derive(Debug, Clone, Default)]
struct Shared {
    failure: Arc<OnceLock<SinkError>>,
    slots: Arc<SensorSlots>,
    tally: Arc<Tally>,
    lifelines: Lifelines,
}

/// What the actors are made of.
struct Parts {
    config: Config,
    provider: Option<ProviderConfig>,
    sink: Box<dyn Sink>,
    pool: Arc<ThreadPool>,
    decoder: MapDecoder,
    shared: Shared,
}

/// The arbiter thread: wires the actors, hands out their addresses, runs until the system is stopped.
fn run_actors(parts: Parts, ready: &Sender<Result<(Actors, System), SystemError>>) {
    let runner = System::new();
    runner.block_on(async {
        parts.shared.lifelines.hold(System::current());
        let actors = wire(parts);
        if actors.is_err() {
            System::current().stop();
        }
        // If nobody waits for the addresses any more, the system will be stopped at once.
        let _ = ready.send(actors.map(|actors| (actors, System::current())));
    });
    if let Err(error) = runner.run() {
        tracing::error!("the actors have ended abnormally: {error}");
    }
}

fn wire(parts: Parts) -> Result<Actors, SystemError> {
    let Parts { config, provider, sink, pool, decoder, shared } = parts;
    let Shared { failure, slots, tally, lifelines } = shared;
    let outlet = Outlet {
        sink,
        clock: config.clock.clone(),
        times: config.published_times,
        interface: config.interface,
        failure,
        has_provider: provider.is_some(),
    };
    let publisher = Publisher::new(outlet, tally.clone(), lifelines.line("publisher")).start();
    let line = lifelines.line("validation");
    let validation =
        Validation::new(config.pipeline, pool, publisher.clone(), config.count_allocations, line).start();
    let vehicle = config.vehicle;
    let mut scene = Scene::empty(config.clock.now(), Arc::new(vehicle));
    // A node that never saw a traffic light message judges as if no light were in sight.
    scene.traffic_signals = Some(Arc::new(TrafficLightGroupArray::default()));
    let clock = config.clock.clone();
    let line = lifelines.line("sensors");
    let sensors = Sensors::new(scene, slots.clone(), tally, clock, decoder, publisher.clone(), line).start();
    let line = lifelines.line("scheduler");
    let scheduler =
        Scheduler::new(config.clock.clone(), config.fallback_period_ms, config.cycle_budget, line).start();
    let line = lifelines.line("buffer");
    let buffer = Buffer::new(config.duration_time_s, scheduler.clone(), line).start();
    let provider = match provider {
        Some(provider) => {
            let provider = OpenSpace::new(provider, vehicle, &config.clock, slots, buffer.clone());
            Some(provider.map_err(SystemError::Parameters)?.start())
        }
        None => None,
    };
    publisher.do_send(Report(scheduler.clone()));
    scheduler.do_send(Wire(Stages {
        provider: provider.clone(),
        buffer: buffer.clone(),
        sensors: sensors.clone(),
        validation: validation.clone(),
    }));
    if config.clock.runs_by_itself() {
        actix::spawn(sleep_and_wake(config.clock, scheduler.clone(), lifelines.line("fallback timer")));
    }
    Ok(Actors { provider, buffer, sensors, scheduler, validation })
}

#[cfg(test)]
mod tests;
