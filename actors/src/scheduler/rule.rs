//! The rule of when a cycle runs, as a value: no mailbox, no clock, no thread.
//!
//! One cycle at a time; triggers that come meanwhile are merged into one that follows; the timer is re-armed from the end
//! of an anchor's cycle; changed parameters wait for the end of a cycle; once finished, no cycle starts.

use super::{FallbackTimer, SchedulerState};
use crate::cycle::Trigger;
use messages::builtin_interfaces::Time;
use std::time::{Duration, Instant};

/// A reason to run a cycle.
#[derive(Debug, Clone)]
pub(crate) struct Triggered {
    pub(crate) trigger: Trigger,
    pub(crate) arrived: Instant,
    /// From its arrival until its owner took it up.
    pub(crate) receive: Duration,
    /// Time spent on adding what it brought.
    pub(crate) buffer: Duration,
}

impl Triggered {
    /// By the timer, now.
    pub(crate) fn by_timer() -> Self {
        let (receive, buffer) = (Duration::ZERO, Duration::ZERO);
        Self { trigger: Trigger::Timer, arrived: Instant::now(), receive, buffer }
    }

    /// Both wait for the same cycle: an anchor outranks the timer, and latency counts from the earlier arrival.
    fn merge(self, later: &Self) -> Self {
        let is_anchor = [self.trigger, later.trigger].contains(&Trigger::Anchor);
        let trigger = if is_anchor { Trigger::Anchor } else { Trigger::Timer };
        let first = if later.arrived < self.arrived { later.clone() } else { self };
        Self { trigger, ..first }
    }
}

/// A cycle that is to start now.
#[derive(Debug)]
pub(crate) struct Start {
    /// From 1.
    pub(crate) number: u64,
    pub(crate) triggered: Triggered,
}

/// What follows from the end of a cycle, before the next one.
#[derive(Debug)]
pub(crate) struct End<P> {
    /// The timer's deadline has moved.
    pub(crate) is_rearmed: bool,
    /// Parameters that take effect now.
    pub(crate) changed: Option<P>,
}

/// The rule, and where it stands. `P` are the parameters.
#[derive(Debug)]
pub(crate) struct Rule<P> {
    timer: FallbackTimer,
    running: Option<Trigger>,
    pending: Option<Triggered>,
    /// Parameters that wait for the running cycle to end.
    changed: Option<P>,
    /// Set when no further cycle is to start.
    finished: bool,
    cycles: u64,
    coalesced: u64,
}

impl<P> Rule<P> {
    pub(crate) fn new(now: Time, fallback_period_ms: i64) -> Self {
        Self {
            timer: FallbackTimer::new(now, fallback_period_ms),
            running: None,
            pending: None,
            changed: None,
            finished: false,
            cycles: 0,
            coalesced: 0,
        }
    }

    pub(crate) fn state(&self) -> SchedulerState {
        SchedulerState { cycles: self.cycles, coalesced: self.coalesced, deadline: self.timer.deadline() }
    }

    pub(crate) fn is_idle(&self) -> bool {
        self.running.is_none()
    }

    /// A trigger has come: the cycle to start, unless one is running.
    pub(crate) fn trigger(&mut self, triggered: Triggered) -> Option<Start> {
        if self.finished {
            return None;
        }
        if self.is_idle() {
            return Some(self.start(triggered));
        }
        self.pending = Some(match self.pending.take() {
            None => triggered,
            Some(earlier) => {
                self.coalesced += 1;
                earlier.merge(&triggered)
            }
        });
        None
    }

    fn start(&mut self, triggered: Triggered) -> Start {
        self.running = Some(triggered.trigger);
        self.cycles += 1;
        Start { number: self.cycles, triggered }
    }

    /// Whether the timer is due; its deadline moves on.
    pub(crate) fn fire(&mut self, now: Time) -> bool {
        self.timer.fire(now)
    }

    /// The running cycle is over. [`next`](Self::next) comes after it.
    pub(crate) fn end(&mut self, now: Time) -> End<P> {
        let is_rearmed = self.running.take() == Some(Trigger::Anchor);
        if is_rearmed {
            self.timer.reset(now);
        }
        End { is_rearmed, changed: self.changed.take() }
    }

    /// The cycle that waited for the end of the one before.
    pub(crate) fn next(&mut self) -> Option<Start> {
        let pending = self.pending.take()?;
        Some(self.start(pending))
    }

    /// Takes changed parameters; gives them back if they take effect now. The newest change wins.
    pub(crate) fn change(&mut self, parameters: P) -> Option<P> {
        if self.is_idle() {
            return Some(parameters);
        }
        self.changed = Some(parameters);
        None
    }

    /// Changes the period; true if the deadline has moved.
    pub(crate) fn set_period(&mut self, now: Time, period_ms: i64) -> bool {
        self.timer.set_period(now, period_ms)
    }

    /// Lets no further cycle start.
    pub(crate) fn finish(&mut self) {
        self.finished = true;
        self.pending = None;
    }
}
