//! What is counted. Time is an argument; nothing here reads a clock or draws.
//!
//! A cycle is counted when its diagnostics come, because every cycle has some. Reports may come before or after them and
//! are counted on their own, as soon as the diagnostics have said once which filters are enforced.

use super::Told;
use super::histogram::Histogram;
use messages::autoware_internal_debug_msgs::ProcessingTimeTree;
use messages::autoware_trajectory_validator::{RiskLevel, ValidationReport, ValidationReportArray};
use messages::builtin_interfaces::Time;
use messages::diagnostic_msgs::{DiagnosticArray, DiagnosticStatus};
use selection::data_validity;
use selection::report::{FEASIBILITY_METRIC, NOT_ASSESSED, NOT_JUDGED};
use selector_actors::OutputTopic;
use selector_actors::topics::{NODE_NAME, OutputMessage};
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::Arc;
use std::time::Duration;

/// The rate is that of so much time.
const RATE_WINDOW: Duration = Duration::from_secs(5);
/// Warnings that are kept, the newest last; the same text again counts on.
const MAX_WARNINGS: usize = 100;
/// Generators that are told apart; a planner that invents names must not fill the memory.
const MAX_GENERATORS: usize = 1024;
/// What the others are counted as.
const OTHERS: &str = "(others)";

/// Candidates of one generator.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Row {
    /// Judged by the filters.
    pub judged: u64,
    /// No enforced filter objects.
    pub accepted: u64,
    /// Put out as the trajectory to drive.
    pub chosen: u64,
    /// Objections by filter.
    pub objections: BTreeMap<String, u64>,
    /// What the objections are about: filter and metric.
    pub reasons: BTreeMap<(String, String), u64>,
}

/// One filter, or the check of the data before them.
#[derive(Debug, Clone, Default)]
pub struct Column {
    /// Whether its objection counts.
    pub is_shadow: bool,
    /// Its place in the order of evaluation.
    order: usize,
    time: Histogram,
}

impl Column {
    /// Time of a cycle's judging that 99 of 100 cycles stayed below, over all candidates and threads, µs; `None`
    /// before the first.
    #[must_use]
    pub fn p99_us(&self) -> Option<f64> {
        (self.time.count() > 0).then(|| self.time.quantile_us(0.99))
    }
}

/// What one part of the node says about itself.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Health {
    /// As in [`DiagnosticStatus`].
    pub level: u8,
    /// In words.
    pub message: String,
}

/// A warning, and how often it came.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Warning {
    /// Its text.
    pub text: String,
    /// How often.
    pub count: u64,
    /// When it came last, since the board began.
    pub last: Duration,
}

/// Everything counted so far.
#[derive(Debug, Clone, Default)]
pub struct Board {
    /// Cycles by what started them.
    pub triggers: BTreeMap<String, u64>,
    /// What started the last one.
    pub last_trigger: String,
    /// Candidates by generator.
    pub rows: BTreeMap<String, Row>,
    /// Filters by name.
    pub columns: BTreeMap<String, Column>,
    /// What the validator and the ranker say, by name.
    pub health: BTreeMap<String, Health>,
    /// Values of the last diagnostics that tell of inputs: their ages, and what was lost.
    pub inputs: BTreeMap<String, String>,
    /// Of the last cycle: candidates, accepted, and the generator whose candidate is driven.
    pub last: (u64, u64, Option<String>),
    /// Warnings, the newest last.
    pub warnings: VecDeque<Warning>,
    /// Why no more will come.
    pub ended: Option<String>,
    cycle: Histogram,
    arrivals: VecDeque<Duration>,
    stamps: Option<(Time, Time)>,
    waiting: Option<Arc<ValidationReportArray>>,
}

impl Board {
    /// Takes in what came at a time since the board began.
    pub fn take(&mut self, told: Told, at: Duration) {
        match told {
            Told::Published(topic, message) => self.publication(topic, message, at),
            Told::Warning(text) => self.warn(text, at),
            Told::Ended(why) => self.ended = Some(why),
        }
    }

    fn publication(&mut self, topic: OutputTopic, message: OutputMessage, at: Duration) {
        match (topic, message) {
            (OutputTopic::Diagnostics, OutputMessage::Diagnostics(diagnostics)) => {
                self.diagnostics(&diagnostics, at);
            }
            (OutputTopic::ValidationReports, OutputMessage::Reports(reports)) => {
                if self.columns.is_empty() {
                    self.waiting = Some(reports);
                } else {
                    self.reports(&reports);
                }
            }
            (OutputTopic::FilterProcessingTime(filter), OutputMessage::Number(took)) => {
                // Before the first diagnostics nobody knows the filter's place.
                if let (Some(column), Some(took)) = (self.columns.get_mut(filter), duration_of(took.data)) {
                    column.time.add(took);
                }
            }
            (OutputTopic::ProcessingTimeTree, OutputMessage::Times(tree)) => self.times(&tree),
            _ => {}
        }
    }

    fn column(&mut self, filter: &str) -> &mut Column {
        let order = self.columns.len();
        self.columns.entry(filter.to_owned()).or_insert_with(|| Column { order, ..Column::default() })
    }

    /// The filters in order of evaluation.
    #[must_use]
    pub fn columns_in_order(&self) -> Vec<(&str, &Column)> {
        let mut columns: Vec<_> = self.columns.iter().map(|(name, column)| (&name[..], column)).collect();
        columns.sort_by_key(|(_, column)| column.order);
        columns
    }

    fn times(&mut self, tree: &ProcessingTimeTree) {
        // Of a cycle; a map that was decoded has a tree of its own.
        let root = tree.nodes.iter().find(|node| node.name == "process_trajectories");
        if let Some(took) = root.and_then(|node| duration_of(node.processing_time)) {
            self.cycle.add(took);
        }
    }

    fn diagnostics(&mut self, diagnostics: &DiagnosticArray, at: Duration) {
        let statuses = diagnostics.status.iter().filter_map(|status| {
            let part = status.name.strip_prefix(NODE_NAME)?.strip_prefix(": ")?;
            Some((part, status))
        });
        let mut is_ours = false;
        for (part, status) in statuses {
            is_ours = true;
            let health = Health { level: status.level, message: status.message.clone() };
            self.health.insert(part.to_owned(), health);
            match part {
                "trajectory_validator" => self.validator(status),
                "trajectory_ranker" => self.ranker(status),
                _ => {}
            }
        }
        if !is_ours {
            return;
        }
        self.arrivals.push_back(at);
        while self.arrivals.front().is_some_and(|first| at.saturating_sub(*first) > RATE_WINDOW) {
            self.arrivals.pop_front();
        }
        let stamp = diagnostics.header.stamp;
        let first = self.stamps.map_or(stamp, |(first, _)| first);
        self.stamps = Some((first, stamp));
        if let Some(reports) = self.waiting.take() {
            self.reports(&reports);
        }
    }

    fn validator(&mut self, status: &DiagnosticStatus) {
        self.inputs.clear();
        self.last = (0, 0, None);
        for value in &status.values {
            let (key, value) = (&value.key[..], &value.value[..]);
            if key == "cycle.trigger" {
                *self.triggers.entry(value.to_owned()).or_default() += 1;
                value.clone_into(&mut self.last_trigger);
            } else if key == "candidates.input" {
                self.last.0 = value.parse().unwrap_or(0);
            } else if key == "candidates.accepted" {
                self.last.1 = value.parse().unwrap_or(0);
            } else if let Some(filter) = key.strip_suffix(".shadow") {
                self.column(filter).is_shadow = value == "true";
            } else if key.starts_with("input.") || key.starts_with("peers.") || key.starts_with("outputs.") {
                self.inputs.insert(key.to_owned(), value.to_owned());
            }
        }
    }

    fn ranker(&mut self, status: &DiagnosticStatus) {
        let chosen = status.values.iter().find(|value| value.key == "selected.generator");
        if let Some(chosen) = chosen {
            self.row(&chosen.value).chosen += 1;
        }
        self.last.2 = chosen.map(|chosen| chosen.value.clone());
    }

    fn row(&mut self, generator: &str) -> &mut Row {
        let is_new = !self.rows.contains_key(generator);
        let name = if is_new && self.rows.len() >= MAX_GENERATORS { OTHERS } else { generator };
        self.rows.entry(name.to_owned()).or_default()
    }

    fn reports(&mut self, reports: &ValidationReportArray) {
        let shadow: BTreeSet<String> = self
            .columns
            .iter()
            .filter(|(_, column)| column.is_shadow)
            .map(|(name, _)| name.clone())
            .collect();
        for report in &reports.reports {
            let row = self.row(&report.generator_name);
            if !report.metrics.iter().any(|metric| metric.metric_name == NOT_JUDGED) {
                count(row, report, &shadow);
            }
        }
    }

    fn warn(&mut self, text: String, at: Duration) {
        let known = self.warnings.iter().position(|warning| warning.text == text);
        let before = known.and_then(|index| self.warnings.remove(index)).map_or(0, |warning| warning.count);
        self.warnings.push_back(Warning { text, count: before + 1, last: at });
        if self.warnings.len() > MAX_WARNINGS {
            self.warnings.pop_front();
        }
    }

    /// Cycles per second over the last seconds.
    #[must_use]
    pub fn rate_hz(&self, now: Duration) -> f64 {
        let recent = self.arrivals.iter().filter(|at| now.saturating_sub(**at) <= RATE_WINDOW);
        let (mut count, mut first) = (0_u32, now);
        for at in recent {
            first = first.min(*at);
            count += 1;
        }
        // From the first of them until now: a node that has stopped slows down at once.
        let span_s = now.saturating_sub(first).as_secs_f64();
        if count > 1 && span_s > 0.0 { f64::from(count - 1) / span_s } else { 0.0 }
    }

    /// Time on the node's clock since the first cycle, s.
    #[must_use]
    pub fn elapsed_s(&self) -> f64 {
        let of = |(first, last): (Time, Time)| (last.nanoseconds() - first.nanoseconds()) as f64 * 1e-9;
        self.stamps.map_or(0.0, of)
    }

    /// Cycles so far.
    #[must_use]
    pub fn cycles(&self) -> u64 {
        self.triggers.values().sum()
    }

    /// All generators together.
    #[must_use]
    pub fn total(&self) -> Row {
        self.rows.values().fold(Row::default(), |mut sum, row| {
            sum.judged += row.judged;
            sum.accepted += row.accepted;
            sum.chosen += row.chosen;
            for (filter, count) in &row.objections {
                *sum.objections.entry(filter.clone()).or_default() += count;
            }
            for (reason, count) in &row.reasons {
                *sum.reasons.entry(reason.clone()).or_default() += count;
            }
            sum
        })
    }

    /// Cycles by how long they took; see [`LATENCY_LABELS`](Self::LATENCY_LABELS).
    #[must_use]
    pub fn latency_bars(&self) -> &[u64] {
        self.cycle.bars()
    }

    /// Upper ends of the bars, ms.
    pub const LATENCY_LABELS: [&'static str; 13] = super::histogram::LABELS;

    /// Median, 99th percentile and maximum of a cycle, ms; `None` before the first.
    #[must_use]
    pub fn latency_ms(&self) -> Option<[f64; 3]> {
        let cycle = &self.cycle;
        let of = [cycle.quantile_us(0.5), cycle.quantile_us(0.99), cycle.max_us()];
        (cycle.count() > 0).then(|| of.map(|microseconds| microseconds / 1e3))
    }
}

/// Counts one candidate.
fn count(row: &mut Row, report: &ValidationReport, shadow: &BTreeSet<String>) {
    let mut objecting = BTreeSet::new();
    for metric in &report.metrics {
        let filter = &*metric.validator_name;
        let objects = match &*metric.metric_name {
            // Only the check of the data has no metric for its verdict.
            _ if filter == data_validity::NAME => metric.risk.level > RiskLevel::SAFE,
            FEASIBILITY_METRIC => metric.metric_value == 0.0,
            _ => false,
        };
        if objects {
            objecting.insert(filter);
        }
    }
    row.judged += 1;
    row.accepted += u64::from(objecting.iter().all(|filter| shadow.contains(*filter)));
    for filter in &objecting {
        *row.objections.entry((*filter).to_owned()).or_default() += 1;
    }
    let mut unexplained = objecting.clone();
    let beyond = report.metrics.iter().filter(|metric| {
        let name = &*metric.metric_name;
        let is_verdict = name == FEASIBILITY_METRIC || name == NOT_ASSESSED;
        !is_verdict && metric.risk.level > RiskLevel::SAFE && objecting.contains(&*metric.validator_name)
    });
    for metric in beyond {
        unexplained.remove(&*metric.validator_name);
        let reason = (metric.validator_name.to_string(), metric.metric_name.to_string());
        *row.reasons.entry(reason).or_default() += 1;
    }
    // A filter that objects without a number could not judge.
    for filter in unexplained {
        *row.reasons.entry((filter.to_owned(), NOT_ASSESSED.to_owned())).or_default() += 1;
    }
}

/// Of a published time, ms; what is no time is left out.
fn duration_of(milliseconds: f64) -> Option<Duration> {
    Duration::try_from_secs_f64(milliseconds / 1e3).ok()
}

#[cfg(test)]
mod tests;
