//! Owns the concatenator: takes candidates in, gives the fresh ones out.
//!
//! An anchor message is added first, then the scheduler is told; a backup message is only added.

use crate::cycle::Trigger;
use crate::lifeline::Lifeline;
use crate::scheduler::{Scheduler, Triggered};
use actix::{Actor, Addr, Context, Handler, Message, MessageResult};
use crossbeam_channel::Sender;
use messages::autoware_internal_planning_msgs::CandidateTrajectories;
use messages::builtin_interfaces::Time;
use selection::{Concatenated, Concatenator};
use std::sync::Arc;
use std::time::Instant;

/// The owner of the candidates.
#[derive(Debug)]
pub(crate) struct Buffer {
    concatenator: Concatenator,
    scheduler: Addr<Scheduler>,
    _lifeline: Lifeline,
}

impl Buffer {
    pub(crate) fn new(duration_time_s: f64, scheduler: Addr<Scheduler>, lifeline: Lifeline) -> Self {
        Self { concatenator: Concatenator::new(duration_time_s), scheduler, _lifeline: lifeline }
    }
}

impl Actor for Buffer {
    type Context = Context<Self>;
}

/// Candidates that came in.
#[derive(Debug)]
pub(crate) struct Add {
    pub(crate) message: Arc<CandidateTrajectories>,
    /// Set if the message is an anchor: when it arrived.
    pub(crate) anchor: Option<Instant>,
}

impl Message for Add {
    type Result = ();
}

impl Handler<Add> for Buffer {
    type Result = ();

    fn handle(&mut self, add: Add, _: &mut Self::Context) {
        let taken_up = Instant::now();
        self.concatenator.add(&add.message);
        if let Some(arrived) = add.anchor {
            self.scheduler.do_send(Triggered {
                trigger: Trigger::Anchor,
                arrived,
                receive: taken_up.saturating_duration_since(arrived),
                buffer: taken_up.elapsed(),
            });
        }
    }
}

/// Asks for the candidates that are fresh at a time.
#[derive(Debug)]
pub(crate) struct TakeFresh(pub(crate) Time);

impl Message for TakeFresh {
    type Result = Concatenated;
}

impl Handler<TakeFresh> for Buffer {
    type Result = MessageResult<TakeFresh>;

    fn handle(&mut self, TakeFresh(now): TakeFresh, _: &mut Self::Context) -> Self::Result {
        MessageResult(self.concatenator.get(now))
    }
}

/// Changes how long candidates are kept.
#[derive(Debug)]
pub(crate) struct SetDurationTime(pub(crate) f64);

impl Message for SetDurationTime {
    type Result = ();
}

impl Handler<SetDurationTime> for Buffer {
    type Result = ();

    fn handle(&mut self, SetDurationTime(seconds): SetDurationTime, _: &mut Self::Context) {
        self.concatenator.set_duration_time_s(seconds);
    }
}

/// Asks to be told when everything sent so far is in the buffer.
#[derive(Debug)]
pub(crate) struct WaitForBuffer(pub(crate) Sender<()>);

impl Message for WaitForBuffer {
    type Result = ();
}

impl Handler<WaitForBuffer> for Buffer {
    type Result = ();

    fn handle(&mut self, WaitForBuffer(reply): WaitForBuffer, _: &mut Self::Context) {
        // Whoever no longer waits does not need the answer.
        let _ = reply.send(());
    }
}
