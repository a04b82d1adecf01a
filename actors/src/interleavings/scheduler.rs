//! The scheduler of the model: what its handlers do, around the real rule.

use super::mailbox::Mailbox;
use super::{Event, Newest, Node, PERIOD_MS, ToBuffer, ToScheduler, ToSensors, ToValidation};
use crate::scheduler::{Rule, SchedulerState, Start, Triggered};
use messages::builtin_interfaces::Time;
use shuttle::sync::Arc;

/// Around the rule, with what it has collected for the cycle that runs.
pub(super) struct SchedulerActor {
    node: Node,
    rule: Rule<u64>,
    applied: u64,
    running: u64,
    collected: (Option<Newest>, Option<i64>),
    waiting: Vec<Arc<Mailbox<SchedulerState>>>,
}

fn ms(time: Time) -> i64 {
    time.nanoseconds() / 1_000_000
}

impl SchedulerActor {
    pub(super) fn new(node: Node) -> Self {
        let rule = Rule::new(node.now(), PERIOD_MS);
        Self { node, rule, applied: 0, running: 0, collected: (None, None), waiting: Vec::new() }
    }

    pub(super) fn run(mut self) {
        loop {
            match self.node.scheduler.next() {
                ToScheduler::Triggered(triggered) => self.trigger(triggered),
                ToScheduler::WakeUp => {
                    let (now, before) = (self.node.now(), self.deadline());
                    if self.rule.fire(now) {
                        self.node.log(Event::Fired { now: ms(now), before, after: self.deadline() });
                        self.trigger(Triggered::by_timer());
                    }
                }
                ToScheduler::Fresh(number, newest) => {
                    assert_eq!(number, self.running, "candidates of another cycle");
                    self.collected.0 = Some(newest);
                    self.hand_over();
                }
                ToScheduler::Snapshot(number, odometry) => {
                    assert_eq!(number, self.running, "a scene of another cycle");
                    self.collected.1 = Some(odometry);
                    self.hand_over();
                }
                ToScheduler::CycleEnded => self.end(),
                ToScheduler::Configure(version) => {
                    if let Some(version) = self.rule.change(version) {
                        self.configure(version);
                    }
                }
                ToScheduler::WaitForIdle(reply) => self.answer_when_idle(reply),
                ToScheduler::Finish(reply) => {
                    self.rule.finish();
                    self.answer_when_idle(reply);
                }
                ToScheduler::Stop => return,
            }
        }
    }

    fn answer_when_idle(&mut self, reply: Arc<Mailbox<SchedulerState>>) {
        if self.rule.is_idle() { reply.post(self.rule.state()) } else { self.waiting.push(reply) }
    }

    fn deadline(&self) -> i64 {
        ms(self.rule.state().deadline)
    }

    fn trigger(&mut self, triggered: Triggered) {
        self.node.log(Event::Triggered);
        if let Some(start) = self.rule.trigger(triggered) {
            self.start(start);
        }
    }

    fn start(&mut self, Start { number, triggered: Triggered { trigger, .. } }: Start) {
        self.node.log(Event::Started { number, trigger, applied: self.applied });
        self.running = number;
        self.node.buffer.post(ToBuffer::TakeFresh(number));
        self.node.sensors.post(ToSensors::TakeSnapshot(number));
    }

    fn hand_over(&mut self) {
        if let (Some(newest), Some(odometry)) = &self.collected {
            let (number, newest, odometry) = (self.running, newest.clone(), *odometry);
            self.collected = (None, None);
            self.node.log(Event::Collected { number, newest: newest.clone(), odometry });
            self.node.validation.post(ToValidation::Cycle(number, newest));
        }
    }

    fn end(&mut self) {
        let (now, before) = (self.node.now(), self.deadline());
        let ended = self.rule.end(now);
        self.node.log(Event::Ended { number: self.running, now: ms(now), before, after: self.deadline() });
        if let Some(version) = ended.changed {
            self.configure(version);
        }
        if let Some(start) = self.rule.next() {
            self.start(start);
            return;
        }
        for waiting in self.waiting.drain(..) {
            waiting.post(self.rule.state());
        }
    }

    fn configure(&mut self, version: u64) {
        self.applied = version;
        self.node.validation.post(ToValidation::Set(version));
    }
}
