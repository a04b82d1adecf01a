//! The result of a command as one JSON object. The keys are a contract with scripts; see `docs/json.md`.

use super::statistics::{Latency, Statistics, Tally};
use super::usage;
use crate::bag;
use crate::commands::Failure;
use selector_actors::Trigger;
use serde::Serialize;
use std::collections::BTreeMap;
use std::time::Duration;

/// What every command says.
#[derive(Debug, Clone, Serialize)]
pub struct Common {
    /// Name of the command.
    pub command: &'static str,
    /// Version of the program.
    pub version: &'static str,
    /// True if nothing failed.
    pub ok: bool,
    /// Exit code of the process.
    pub exit_code: u8,
    /// What failed.
    pub errors: Vec<Failure>,
    /// What is odd but did not stop the command.
    pub warnings: Vec<Failure>,
    /// Hash over all effective parameters; null where no parameters are used.
    pub settings_hash: Option<String>,
    /// Threads that judge; null where nothing is judged.
    pub threads: Option<usize>,
}

impl Common {
    /// A result with what failed and what is odd; the exit code is that of the first failure.
    #[must_use]
    pub fn new(command: &'static str, errors: Vec<Failure>, warnings: Vec<Failure>) -> Self {
        let exit_code = errors.first().map_or(0, |failure| failure.exit_code);
        Self {
            command,
            version: env!("CARGO_PKG_VERSION"),
            ok: errors.is_empty(),
            exit_code,
            errors,
            warnings,
            settings_hash: None,
            threads: None,
        }
    }
}

/// Cycles of a run.
#[derive(Debug, Clone, Serialize)]
pub struct Cycles {
    pub(super) anchor: u64,
    pub(super) timer: u64,
    pub(super) coalesced: u64,
    pub(super) early_return: BTreeMap<&'static str, u64>,
    pub(super) cut_by_deadline: u64,
}

/// Messages of one input topic.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Received {
    /// Messages that came in.
    pub received: u64,
    /// Those that could not be used, by reason.
    pub dropped: BTreeMap<&'static str, u64>,
}

impl Received {
    /// Counts more of the same topic.
    pub fn add(&mut self, more: &Self) {
        self.received += more.received;
        for (&reason, count) in &more.dropped {
            *self.dropped.entry(reason).or_default() += count;
        }
    }
}

/// Candidates of a run.
#[derive(Debug, Clone, Serialize)]
pub struct Candidates {
    pub(super) judged: u64,
    pub(super) accepted: u64,
    pub(super) rejected: u64,
    pub(super) not_judged: u64,
    /// Too old when a cycle asked for them.
    pub(super) stale: u64,
    /// Dropped because their message does not announce their generator.
    pub(super) unannounced: u64,
    /// Generators announced more than once in a message.
    pub(super) announced_twice: u64,
    /// Accepted but not ranked, by reason.
    pub(super) unranked: BTreeMap<&'static str, u64>,
    pub(super) by_generator: BTreeMap<String, ByGenerator>,
}

/// Candidates of one generator.
#[derive(Debug, Clone, Serialize)]
pub struct ByGenerator {
    pub(super) judged: u64,
    pub(super) accepted: u64,
    pub(super) rejected: u64,
    pub(super) stale: u64,
}

impl From<Tally> for ByGenerator {
    fn from(tally: Tally) -> Self {
        Self { judged: tally.judged, accepted: tally.accepted, rejected: tally.rejected, stale: tally.stale }
    }
}

/// Latencies of one stage, µs.
#[derive(Debug, Clone, Serialize)]
pub struct Quantiles {
    pub(super) count: u64,
    pub(super) p50: f64,
    pub(super) p90: f64,
    pub(super) p99: f64,
    pub(super) p999: f64,
    pub(super) max: f64,
}

impl From<&Latency> for Quantiles {
    fn from(latency: &Latency) -> Self {
        Self {
            count: latency.count(),
            p50: latency.quantile_us(0.5),
            p90: latency.quantile_us(0.9),
            p99: latency.quantile_us(0.99),
            p999: latency.quantile_us(0.999),
            max: latency.max_us(),
        }
    }
}

/// Heap allocations after the first cycles.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Allocations {
    /// For each candidate while it is judged.
    pub(super) per_candidate_judge: f64,
    /// For each cycle, by all threads: what judging needs, taking messages in and putting them out included.
    pub(super) per_cycle: f64,
}

impl From<[f64; 2]> for Allocations {
    fn from([per_candidate_judge, per_cycle]: [f64; 2]) -> Self {
        Self { per_candidate_judge, per_cycle }
    }
}

/// The recording that was written.
#[derive(Debug, Clone, Serialize)]
pub struct Output {
    /// Where it is.
    pub path: String,
    /// SHA-256 over its bytes.
    pub sha256: String,
    /// Messages by topic.
    pub messages: BTreeMap<String, u64>,
}

impl From<bag::Summary> for Output {
    fn from(summary: bag::Summary) -> Self {
        Self {
            path: summary.path.display().to_string(),
            sha256: summary.sha256,
            messages: summary.messages.into_iter().collect(),
        }
    }
}

/// The result of `demo` and `replay`.
#[derive(Debug, Clone, Serialize)]
pub struct RunSummary {
    /// What every command says.
    #[serde(flatten)]
    pub common: Common,
    pub(super) input: Input,
    pub(super) interface: &'static str,
    pub(super) cycles: Cycles,
    pub(super) messages: BTreeMap<String, Received>,
    pub(super) candidates: Candidates,
    /// How many times a generator's candidate was the one to drive.
    pub(super) selected: BTreeMap<String, u64>,
    pub(super) rejections: BTreeMap<&'static str, BTreeMap<&'static str, u64>>,
    pub(super) shadow: BTreeMap<&'static str, BTreeMap<&'static str, u64>>,
    pub(super) latency_us: BTreeMap<String, Quantiles>,
    /// Null where nobody counts them.
    pub(super) allocations: Option<Allocations>,
    /// Share of their time in which the threads that judge judged.
    pub(super) parallel_efficiency: Option<f64>,
    pub(super) output: Option<Output>,
    pub(super) cpu_s: Option<f64>,
    pub(super) wall_s: f64,
    pub(super) peak_memory_mb: Option<f64>,
}

/// What went in.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Input {
    /// Drive or scene.
    pub name: String,
    /// Seed of a generated scene.
    pub seed: Option<u64>,
}

/// Everything that a summary of a run is made from.
#[derive(Debug, Clone)]
pub struct RunResult {
    /// What went in.
    pub input: Input,
    /// Wire form of candidates.
    pub interface: &'static str,
    /// What was counted.
    pub statistics: Statistics,
    /// Messages by input topic.
    pub messages: BTreeMap<String, Received>,
    /// Triggers merged into a later cycle.
    pub coalesced: u64,
    /// What was written.
    pub output: Option<bag::Summary>,
    /// Time that the run took.
    pub wall: Duration,
}

impl RunSummary {
    /// Puts the result of a run into its published form.
    #[must_use]
    pub fn new(common: Common, run: RunResult) -> Self {
        let statistics = run.statistics;
        let total = statistics.total();
        Self {
            common,
            input: run.input,
            interface: run.interface,
            cycles: Cycles {
                anchor: statistics.cycles_by(Trigger::Anchor),
                timer: statistics.cycles_by(Trigger::Timer),
                coalesced: run.coalesced,
                early_return: statistics.early_return,
                cut_by_deadline: statistics.cut_by_deadline,
            },
            messages: run.messages,
            candidates: Candidates {
                judged: total.judged,
                accepted: total.accepted,
                rejected: total.rejected,
                not_judged: statistics.not_judged,
                stale: total.stale,
                unannounced: statistics.unannounced,
                announced_twice: statistics.announced_twice,
                unranked: statistics.unranked,
                by_generator: statistics
                    .generators
                    .into_iter()
                    .map(|(name, tally)| (name, tally.into()))
                    .collect(),
            },
            selected: statistics.selected,
            rejections: statistics.rejections,
            shadow: statistics.shadow,
            latency_us: statistics
                .latency
                .iter()
                .map(|(stage, latency)| (stage.clone(), latency.into()))
                .collect(),
            allocations: statistics.heap.per_candidate_and_cycle().map(Allocations::from),
            parallel_efficiency: statistics.judging.efficiency(),
            output: run.output.map(Into::into),
            cpu_s: usage::cpu_s(),
            wall_s: run.wall.as_secs_f64(),
            peak_memory_mb: usage::peak_memory_mb(),
        }
    }
}
