//! Owns the rule of when a cycle runs: at once for an anchor, after the fallback period without one, one at a time.
//!
//! Triggers that arrive while a cycle runs are merged into one that follows it; an anchor outranks the timer. The timer
//! is re-armed from the time after an anchor cycle has ended, also when that cycle returned early. The timer's wake-up
//! does not sit in a mailbox that messages can flood: its task sleeps beside the actors and only sends the wake-up here,
//! where nothing but triggers arrives. Changed parameters take effect together, between two cycles.

mod fallback_timer;
mod rule;

pub use fallback_timer::FallbackTimer;
pub(crate) use rule::{Rule, Start, Triggered};

use crate::buffer::{Buffer, SetDurationTime, TakeFresh};
use crate::clock::Clock;
use crate::cycle::Cycle;
use crate::lifeline::Lifeline;
use crate::provider::{OpenSpace, Provide};
use crate::sensors::{Sensors, TakeSnapshot};
use crate::validation::{SetRankerParameters, SetValidatorParameters, Validation};
use actix::fut::WrapFuture;
use actix::{
    Actor, ActorFutureExt, Addr, AsyncContext, Context, Handler, MailboxError, Message, MessageResult,
};
use crossbeam_channel::Sender;
use messages::builtin_interfaces::Time;
use selection::parameters::{RankerParameters, ValidatorParameters};
use selection::ranker::GeneratorSource;
use selection::{Concatenated, Scene};
use std::sync::Arc;
use std::time::{Duration, Instant};
use tokio::sync::watch;
use tracing::{error, info};

/// The actors that a cycle passes through.
#[derive(Debug)]
pub(crate) struct Stages {
    /// Adds its candidates at the beginning of a cycle, if there is one.
    pub(crate) provider: Option<Addr<OpenSpace>>,
    pub(crate) buffer: Addr<Buffer>,
    pub(crate) sensors: Addr<Sensors>,
    pub(crate) validation: Addr<Validation>,
}

/// The owner of the trigger rule.
#[derive(Debug)]
pub(crate) struct Scheduler {
    clock: Clock,
    rule: Rule<Box<Parameters>>,
    /// Tells the sleeping timer task when to wake up.
    deadline: watch::Sender<Time>,
    stages: Option<Stages>,
    /// Time that a cycle has.
    budget: Option<Duration>,
    waiting: Vec<Sender<SchedulerState>>,
    _lifeline: Lifeline,
}

/// The parameters that may change while the node runs.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameters {
    /// Time without an anchor after which a cycle runs all the same; a new value restarts the timer.
    pub fallback_period_ms: i64,
    /// Age beyond which a candidate is dropped.
    pub duration_time_s: f64,
    /// Time after its start at which a cycle judges no further candidate. `None`: it judges all of them.
    pub cycle_budget: Option<Duration>,
    /// The filters'.
    pub validator: ValidatorParameters,
    /// The ranker's.
    pub ranker: RankerParameters,
    /// Which generators may be ranked.
    pub sources: Vec<GeneratorSource>,
}

/// What the scheduler has done so far.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SchedulerState {
    /// Cycles started.
    pub cycles: u64,
    /// Triggers that were merged into a later cycle.
    pub coalesced: u64,
    /// When the fallback timer is due.
    pub deadline: Time,
}

impl Scheduler {
    pub(crate) fn new(
        clock: Clock,
        fallback_period_ms: i64,
        budget: Option<Duration>,
        lifeline: Lifeline,
    ) -> Self {
        let rule = Rule::new(clock.now(), fallback_period_ms);
        info!("New concatenate_and_validate timer callback created with period {fallback_period_ms}.");
        let deadline = watch::Sender::new(rule.state().deadline);
        Self { clock, rule, deadline, stages: None, budget, waiting: Vec::new(), _lifeline: lifeline }
    }

    fn announce_deadline(&self) {
        self.deadline.send_replace(self.rule.state().deadline);
    }

    fn trigger(&mut self, triggered: Triggered, ctx: &mut Context<Self>) {
        if let Some(start) = self.rule.trigger(triggered) {
            self.start(&start, ctx);
        }
    }

    fn start(&mut self, start: &Start, ctx: &mut Context<Self>) {
        // Wired before the first trigger can come.
        let Some(stages) = &self.stages else { return };
        let (number, now, started) = (start.number, self.clock.now(), Instant::now());
        let Triggered { trigger, arrived, receive, buffer } = start.triggered;
        let deadline = self.budget.map(|budget| started + budget);
        let collected =
            collect(stages, now).into_actor(self).map(move |inputs, scheduler, ctx| match inputs {
                Ok((concatenated, scene)) => {
                    let snapshot = started.elapsed();
                    let cycle = Cycle {
                        number,
                        trigger,
                        arrived,
                        receive,
                        buffer,
                        started,
                        deadline,
                        snapshot,
                        scene,
                        concatenated,
                    };
                    scheduler.hand_over(cycle);
                }
                Err(gone) => {
                    error!("cycle {number} is given up, an owner of its inputs is gone: {gone}");
                    scheduler.end(ctx);
                }
            });
        ctx.spawn(collected);
    }

    fn hand_over(&mut self, cycle: Cycle) {
        if let Some(stages) = &self.stages {
            stages.validation.do_send(cycle);
        }
    }

    /// The cycle is over: re-arm the timer if an anchor had started it, then run what came meanwhile.
    fn end(&mut self, ctx: &mut Context<Self>) {
        let ended = self.rule.end(self.clock.now());
        if ended.is_rearmed {
            self.announce_deadline();
        }
        if let Some(changed) = ended.changed {
            self.configure(*changed);
        }
        if let Some(start) = self.rule.next() {
            self.start(&start, ctx);
            return;
        }
        let state = self.rule.state();
        for waiting in self.waiting.drain(..) {
            // Whoever no longer waits does not need the answer.
            let _ = waiting.send(state);
        }
    }

    /// Between two cycles, so that each is judged by one set of parameters.
    fn configure(&mut self, parameters: Parameters) {
        let Parameters { fallback_period_ms, duration_time_s, cycle_budget, validator, ranker, sources } =
            parameters;
        self.budget = cycle_budget;
        self.set_fallback_period(fallback_period_ms);
        if let Some(stages) = &self.stages {
            stages.buffer.do_send(SetDurationTime(duration_time_s));
            stages.sensors.do_send(SetValidatorParameters(validator.clone()));
            stages.validation.do_send(SetValidatorParameters(validator));
            stages.validation.do_send(SetRankerParameters(ranker, sources));
        }
    }

    fn set_fallback_period(&mut self, period_ms: i64) {
        if self.rule.set_period(self.clock.now(), period_ms) {
            info!("New concatenate_and_validate timer callback created with period {period_ms}.");
            self.announce_deadline();
        }
    }
}

/// What a cycle works on.
fn collect(
    stages: &Stages,
    now: Time,
) -> impl Future<Output = Result<(Concatenated, Arc<Scene>), MailboxError>> + use<> {
    let (provider, buffer, sensors) =
        (stages.provider.clone(), stages.buffer.clone(), stages.sensors.clone());
    async move {
        if let Some(provider) = provider {
            provider.send(Provide(sensors.send(TakeSnapshot(now)).await?)).await?;
        }
        // Candidates first: the scene is then at least as new as they are.
        let fresh = buffer.send(TakeFresh(now));
        let scene = sensors.send(TakeSnapshot(now));
        Ok((fresh.await?, scene.await?))
    }
}

impl Actor for Scheduler {
    type Context = Context<Self>;
}

/// Wires the scheduler to the stages; they in turn know the scheduler.
#[derive(Debug)]
pub(crate) struct Wire(pub(crate) Stages);

impl Message for Wire {
    type Result = ();
}

impl Handler<Wire> for Scheduler {
    type Result = ();

    fn handle(&mut self, Wire(stages): Wire, _: &mut Self::Context) {
        self.stages = Some(stages);
    }
}

impl Message for Triggered {
    type Result = ();
}

impl Handler<Triggered> for Scheduler {
    type Result = ();

    fn handle(&mut self, triggered: Triggered, ctx: &mut Self::Context) {
        self.trigger(triggered, ctx);
    }
}

/// The clock may have reached the timer's deadline.
#[derive(Debug)]
pub(crate) struct TimerWakeUp;

impl Message for TimerWakeUp {
    type Result = ();
}

impl Handler<TimerWakeUp> for Scheduler {
    type Result = ();

    fn handle(&mut self, _: TimerWakeUp, ctx: &mut Self::Context) {
        let fires = self.rule.fire(self.clock.now());
        self.announce_deadline();
        if fires {
            self.trigger(Triggered::by_timer(), ctx);
        }
    }
}

/// The outputs of the running cycle are handed over.
#[derive(Debug)]
pub(crate) struct CycleEnded;

impl Message for CycleEnded {
    type Result = ();
}

impl Handler<CycleEnded> for Scheduler {
    type Result = ();

    fn handle(&mut self, _: CycleEnded, ctx: &mut Self::Context) {
        self.end(ctx);
    }
}

/// Changes the fallback period. The same value again leaves the timer alone.
#[derive(Debug)]
pub(crate) struct SetFallbackPeriod(pub(crate) i64);

impl Message for SetFallbackPeriod {
    type Result = ();
}

impl Handler<SetFallbackPeriod> for Scheduler {
    type Result = ();

    fn handle(&mut self, SetFallbackPeriod(period_ms): SetFallbackPeriod, _: &mut Self::Context) {
        self.set_fallback_period(period_ms);
    }
}

/// Changes all parameters at once: now, or when the running cycle has ended. The newest change wins.
#[derive(Debug)]
pub(crate) struct Configure(pub(crate) Box<Parameters>);

impl Message for Configure {
    type Result = ();
}

impl Handler<Configure> for Scheduler {
    type Result = ();

    fn handle(&mut self, Configure(parameters): Configure, _: &mut Self::Context) {
        if let Some(parameters) = self.rule.change(parameters) {
            self.configure(*parameters);
        }
    }
}

/// Lets no further cycle start, and asks to be told when the running one has ended.
#[derive(Debug)]
pub(crate) struct Finish(pub(crate) Sender<SchedulerState>);

impl Message for Finish {
    type Result = ();
}

impl Handler<Finish> for Scheduler {
    type Result = ();

    fn handle(&mut self, Finish(reply): Finish, ctx: &mut Self::Context) {
        self.rule.finish();
        self.handle(WaitForIdle(reply), ctx);
    }
}

/// Asks to be told when no cycle runs or waits.
#[derive(Debug)]
pub(crate) struct WaitForIdle(pub(crate) Sender<SchedulerState>);

impl Message for WaitForIdle {
    type Result = ();
}

impl Handler<WaitForIdle> for Scheduler {
    type Result = ();

    fn handle(&mut self, WaitForIdle(reply): WaitForIdle, _: &mut Self::Context) {
        if self.rule.is_idle() {
            // Whoever no longer waits does not need the answer.
            let _ = reply.send(self.rule.state());
        } else {
            self.waiting.push(reply);
        }
    }
}

/// Asks for the channel that carries the timer's deadline.
#[derive(Debug)]
pub(crate) struct WatchDeadline;

impl Message for WatchDeadline {
    type Result = watch::Receiver<Time>;
}

impl Handler<WatchDeadline> for Scheduler {
    type Result = MessageResult<WatchDeadline>;

    fn handle(&mut self, _: WatchDeadline, _: &mut Self::Context) -> Self::Result {
        MessageResult(self.deadline.subscribe())
    }
}

/// Sleeps until the deadline, however often it moves, and wakes the scheduler; also when time goes back. Ends with the
/// scheduler.
pub(crate) async fn sleep_and_wake(clock: Clock, scheduler: Addr<Scheduler>, _lifeline: Lifeline) {
    let Ok(mut deadlines) = scheduler.send(WatchDeadline).await else { return };
    let mut seen = clock.now();
    loop {
        let deadline = *deadlines.borrow_and_update();
        tokio::select! {
            changed = deadlines.changed() => if changed.is_err() { return },
            () = clock.may_reach(deadline) => {}
        }
        let now = clock.now();
        let wakes = now >= deadline || now < seen;
        seen = now;
        if wakes && scheduler.send(TimerWakeUp).await.is_err() {
            return;
        }
    }
}
