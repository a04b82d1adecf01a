//! Owns what leaves the node: the order of outputs within a cycle, throttled logs, and the sink.
//!
//! What it promises: a validated set is published only from a cycle in which every candidate in it was judged and
//! accepted; a trajectory to drive only if it is in that set; every cycle, early-returned ones included, publishes
//! diagnostics and its processing-time tree; the order of outputs within a cycle is fixed (`OutputTopic::all`); a sink
//! that fails or panics costs the message it was given, which is counted and reported, and the cycle ends all the same.

mod diagnostics;
mod ranking_log;
mod throttle;

use crate::clock::Clock;
use crate::cycle::{CycleReport, CycleTimes, Judged, Outcome};
use crate::lifeline::Lifeline;
use crate::provider::plan_in;
use crate::scheduler::{CycleEnded, Scheduler};
use crate::tally::Tally;
use crate::time_tree::{ROOT, TimeTree, milliseconds};
use crate::topics::{OutputMessage, OutputTopic};
use actix::{Actor, Addr, Context, Handler, Message};
use messages::Interface;
use messages::autoware_internal_debug_msgs::{Float64Stamped, StringStamped};
use messages::builtin_interfaces::Time;
use selection::adapter::Selected;
use selection::concatenator::Oddities;
use selection::panics::caught;
use std::fmt::Write;
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};
use throttle::Throttle;
use tracing::{error, warn};

/// A message with its topic and the time on the node's clock at which it goes out.
#[derive(Debug, Clone)]
pub struct Publication {
    /// Where it goes.
    pub topic: OutputTopic,
    /// When it goes.
    pub stamp: Time,
    /// What goes.
    pub message: OutputMessage,
}

/// The door out of the node could not take a message.
#[derive(Debug, Clone, thiserror::Error)]
#[error("an output cannot be written: {0}")]
pub struct SinkError(pub Arc<dyn std::error::Error + Send + Sync>);

/// A defect of the door out of the node.
#[derive(Debug, thiserror::Error)]
#[error("the sink panicked: {0}")]
struct SinkPanicked(String);

impl SinkError {
    fn panicked(panic: String) -> Self {
        Self(Arc::new(SinkPanicked(panic)))
    }
}

/// The door out of the node.
pub trait Sink: Send {
    /// Takes one message. Must not block for long: it runs on the thread of all actors.
    ///
    /// # Errors
    /// The message cannot be taken; the node goes on, and the first such error is kept for whoever drives it.
    fn publish(&mut self, publication: Publication) -> Result<(), SinkError>;

    /// Sees every cycle after its outputs were taken, with the time that it took.
    fn observe(&mut self, _report: &CycleReport, _times: CycleTimes) {}
}

/// Whether published times are measured, or zero because the cycle takes no time on the node's clock. The latter keeps
/// the output of a replay identical from run to run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PublishedTimes {
    /// As measured.
    Measured,
    /// All zero.
    Zero,
}

/// Where outputs go, and in what form.
pub(crate) struct Outlet {
    pub(crate) sink: Box<dyn Sink>,
    pub(crate) clock: Clock,
    pub(crate) times: PublishedTimes,
    pub(crate) interface: Interface,
    /// Whether there is an open-space provider, whose trajectory has a topic of its own.
    pub(crate) has_provider: bool,
    /// Keeps the first error of the sink.
    pub(crate) failure: Arc<OnceLock<SinkError>>,
}

/// The owner of the outputs.
pub(crate) struct Publisher {
    outlet: Outlet,
    scheduler: Option<Addr<Scheduler>>,
    throttle: Throttle,
    tally: Arc<Tally>,
    now: Time,
    _lifeline: Lifeline,
}

impl std::fmt::Debug for Publisher {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Publisher")
            .field("times", &self.outlet.times)
            .field("failure", &self.outlet.failure)
            .finish_non_exhaustive()
    }
}

impl Publisher {
    pub(crate) fn new(outlet: Outlet, tally: Arc<Tally>, lifeline: Lifeline) -> Self {
        let (throttle, now) = (Throttle::default(), Time::default());
        Self { outlet, scheduler: None, throttle, tally, now, _lifeline: lifeline }
    }

    fn publish(&mut self, topic: OutputTopic, message: OutputMessage) {
        let publication = Publication { topic, stamp: self.now, message };
        let sink = &mut self.outlet.sink;
        let taken =
            caught(|| sink.publish(publication)).unwrap_or_else(|panic| Err(SinkError::panicked(panic)));
        if let Err(failure) = taken {
            self.tally.count_unpublished();
            self.note(failure);
        }
    }

    fn note(&mut self, failure: SinkError) {
        if self.throttle.allows(self.now, 1000, "sink", "publish") {
            error!("{failure}");
        }
        // Only the first failure is kept; the later ones follow from it.
        let _ = self.outlet.failure.set(failure);
    }

    fn shown(&self, took: Duration) -> Duration {
        match self.outlet.times {
            PublishedTimes::Measured => took,
            PublishedTimes::Zero => Duration::ZERO,
        }
    }

    fn publish_cycle(&mut self, report: &CycleReport) {
        let started = Instant::now();
        self.now = report.cycle.scene.now;
        self.log_oddities(report.cycle.concatenated.oddities);
        match &report.outcome {
            Outcome::NoCandidates => {
                if self.throttle.allows(self.now, 1000, "cycle", "no candidates") {
                    warn!("No concatenated trajectories received yet");
                }
            }
            Outcome::MissingInput(input) => {
                self.publish_concatenated(report);
                if self.throttle.allows(self.now, 2000, "cycle", input.name()) {
                    error!("{input}");
                }
            }
            Outcome::Failed(why) => {
                self.publish_concatenated(report);
                error!("{why}");
            }
            Outcome::Judged(judged) => {
                self.publish_concatenated(report);
                self.publish_judged(report, judged);
                return self.end_cycle(report, started);
            }
        }
        self.publish_diagnostics(report);
        self.end_cycle(report, started);
    }

    fn publish_concatenated(&mut self, report: &CycleReport) {
        let set = Arc::new(report.cycle.concatenated.to_message());
        self.publish(OutputTopic::ConcatenatedTrajectories, OutputMessage::Candidates(set));
    }

    fn publish_diagnostics(&mut self, report: &CycleReport) {
        let diagnostics = Arc::new(diagnostics::of_cycle(report, &self.tally));
        self.publish(OutputTopic::Diagnostics, OutputMessage::Diagnostics(diagnostics));
    }

    fn publish_judged(&mut self, report: &CycleReport, judged: &Judged) {
        self.log_rejections(judged);
        self.publish(OutputTopic::ValidationReports, OutputMessage::Reports(judged.reports.clone()));
        let factors = OutputMessage::PlanningFactors(judged.planning_factors.clone());
        self.publish(OutputTopic::PlanningFactors, factors);
        self.publish_diagnostics(report);
        self.publish_times(judged);
        let validated = OutputMessage::Candidates(judged.validated.clone());
        self.publish(OutputTopic::Trajectories, validated.clone());
        self.publish(OutputTopic::ValidatedTrajectories, validated);
        if self.outlet.has_provider
            && let Some(plan) = plan_in(&judged.validated)
        {
            self.publish(OutputTopic::OpenSpaceTrajectory, OutputMessage::Trajectory(Arc::new(plan)));
        }
        self.publish(OutputTopic::ScoredTrajectories, OutputMessage::Scored(judged.scored.clone()));
        ranking_log::write(report, judged, &mut self.throttle);
        if let Some(selected) = &judged.selected {
            self.publish_selected(selected);
        }
    }

    fn publish_selected(&mut self, selected: &Selected) {
        let now = self.outlet.clock.now();
        self.publish(OutputTopic::Latency, OutputMessage::Number(selected.latency(now)));
        self.publish(OutputTopic::Trajectory, OutputMessage::Trajectory(selected.trajectory.clone()));
        if self.outlet.interface.has_turn_indicators() {
            let command = OutputMessage::TurnIndicators(selected.turn_indicators(now));
            self.publish(OutputTopic::TurnIndicators, command);
        }
    }

    fn log_oddities(&mut self, oddities: Oddities) {
        for (count, text) in [
            (
                oddities.announced_twice,
                "generators are announced more than once in a message; the last one counts",
            ),
            (oddities.unannounced, "candidates are dropped, their message does not announce their generator"),
            (oddities.evicted, "generators are dropped, there are too many; do they change their ids?"),
        ] {
            if count > 0 && self.throttle.allows(self.now, 1000, "buffer", text) {
                warn!("{count} {text}");
            }
        }
    }

    fn log_rejections(&mut self, judged: &Judged) {
        let not_judged = judged.not_judged();
        if not_judged > 0 && self.throttle.allows(self.now, 1000, "cycle", "cut") {
            let all = judged.verdicts.len();
            warn!(
                "The cycle was cut at its deadline: {not_judged} of {all} candidates are not judged and not published"
            );
        }
        for filter in &judged.filters {
            if let Some(reason) = &filter.first_reason
                && self.throttle.allows(self.now, 1000, filter.name, reason)
            {
                warn!("[{}] {reason} ({} of {} candidates)", filter.name, filter.rejected, filter.judged);
            }
        }
    }

    /// Times of the validation as numbers and as text.
    fn publish_times(&mut self, judged: &Judged) {
        let stamp = self.now;
        let number = |data| OutputMessage::Number(Float64Stamped { stamp, data });
        let total = milliseconds(self.shown(judged.observe + judged.judge));
        self.publish(OutputTopic::ProcessingTime, number(total));
        let mut text =
            format!("\n--- Trajectory Validator Processing Time Report ---\nTotal: {total:.2} ms\n");
        // The first summary is the data-validity check, which has no time of its own.
        for (filter, &took) in judged.filters.iter().skip(1).zip(&judged.filter_times) {
            let took = milliseconds(self.shown(took));
            self.publish(OutputTopic::FilterProcessingTime(filter.name), number(took));
            // Writing to a string cannot fail.
            let _ = writeln!(text, "- {}: {took:.2} ms", filter.name);
        }
        let text = Arc::new(StringStamped { stamp, data: text });
        self.publish(OutputTopic::ProcessingTimeText, OutputMessage::Text(text));
    }

    fn end_cycle(&mut self, report: &CycleReport, publish_started: Instant) {
        let (publish, cycle) = (publish_started.elapsed(), report.cycle.arrived.elapsed());
        let mut tree = TimeTree::default();
        let root = tree.add(ROOT, "process_trajectories", self.shown(cycle));
        if let Outcome::Judged(judged) = &report.outcome {
            let validation = self.shown(judged.observe + judged.judge + publish);
            let validate = tree.add(root, "validate_trajectories", validation);
            tree.add(validate, "publish_debug", self.shown(publish));
            let rank = tree.add(root, "rank_trajectories", self.shown(judged.rank));
            tree.add(rank, "update_last_best_trajectory_info", self.shown(judged.remember));
            tree.add(root, "get_trajectory", self.shown(judged.adapt));
        }
        self.publish_tree(tree);
        // Again, so that the tree itself is in the latency that is reported.
        let times = CycleTimes { publish: publish_started.elapsed(), cycle: report.cycle.arrived.elapsed() };
        let sink = &mut self.outlet.sink;
        if let Err(panic) = caught(|| sink.observe(report, times)) {
            self.note(SinkError::panicked(panic));
        }
    }

    fn publish_tree(&mut self, tree: TimeTree) {
        let tree = OutputMessage::Times(Arc::new(tree.into_message()));
        self.publish(OutputTopic::ProcessingTimeTree, tree);
    }
}

impl Actor for Publisher {
    type Context = Context<Self>;
}

/// Tells the publisher whom to tell that a cycle has ended.
#[derive(Debug)]
pub(crate) struct Report(pub(crate) Addr<Scheduler>);

impl Message for Report {
    type Result = ();
}

impl Handler<Report> for Publisher {
    type Result = ();

    fn handle(&mut self, Report(scheduler): Report, _: &mut Self::Context) {
        self.scheduler = Some(scheduler);
    }
}

/// A cycle to publish.
#[derive(Debug)]
pub(crate) struct PublishCycle(pub(crate) Box<CycleReport>);

impl Message for PublishCycle {
    type Result = ();
}

impl Handler<PublishCycle> for Publisher {
    type Result = ();

    fn handle(&mut self, PublishCycle(report): PublishCycle, _: &mut Self::Context) {
        if let Err(panic) = caught(|| self.publish_cycle(&report)) {
            error!("cycle {} is not published in full: the publisher panicked: {panic}", report.cycle.number);
        }
        if let Some(scheduler) = &self.scheduler {
            scheduler.do_send(CycleEnded);
        }
    }
}

/// How long a map took to decode.
#[derive(Debug)]
pub(crate) struct MapCallbackTime {
    pub(crate) took: Duration,
    pub(crate) now: Time,
}

impl Message for MapCallbackTime {
    type Result = ();
}

impl Handler<MapCallbackTime> for Publisher {
    type Result = ();

    fn handle(&mut self, MapCallbackTime { took, now }: MapCallbackTime, _: &mut Self::Context) {
        self.now = now;
        let mut tree = TimeTree::default();
        tree.add(ROOT, "map_callback", self.shown(took));
        self.publish_tree(tree);
    }
}
