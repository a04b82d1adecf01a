//! Counts and latencies of a run, gathered cycle by cycle.

use super::stages;
use crate::allocations;
use hdrhistogram::Histogram;
use selection::filters::Fill;
use selection::report::rejection_names;
use selection::{Enforcement, Judgement, Verdict, data_validity};
use selector_actors::cycle::{CycleReport, CycleTimes, Judged, Outcome, Trigger};
use std::collections::BTreeMap;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::time::Duration;

/// Longest latency that is told apart, ns: one minute.
const MAX_LATENCY_NS: u64 = 60_000_000_000;
/// Digits kept of a latency.
const LATENCY_DIGITS: u8 = 3;

/// Candidates of one generator.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Tally {
    /// Judged by the filters.
    pub judged: u64,
    /// Published.
    pub accepted: u64,
    /// Not published.
    pub rejected: u64,
    /// Too old when a cycle asked for them; not judged.
    pub stale: u64,
}

/// Latencies of one stage.
#[derive(Debug, Clone)]
pub struct Latency(Histogram<u64>);

impl Default for Latency {
    fn default() -> Self {
        // A histogram takes 0 to 5 digits and bounds that are a factor of two apart; ours are constants that fit.
        let histogram = Histogram::new_with_bounds(1, MAX_LATENCY_NS, LATENCY_DIGITS);
        Self(histogram.expect("constant bounds fit"))
    }
}

impl Latency {
    pub(crate) fn record(&mut self, took: Duration) {
        self.0.saturating_record(u64::try_from(took.as_nanos()).unwrap_or(u64::MAX));
    }

    /// Takes in what another one has seen of the same stage.
    pub fn merge(&mut self, other: &Self) {
        // Cannot fail: all of them have the same bounds and digits.
        let _ = self.0.add(&other.0);
    }

    /// How many times the stage ran.
    #[must_use]
    pub fn count(&self) -> u64 {
        self.0.len()
    }

    /// The latency that a share of all runs stayed below, µs; 0 if there were none.
    #[must_use]
    pub fn quantile_us(&self, share: f64) -> f64 {
        self.0.value_at_quantile(share) as f64 / 1000.0
    }

    /// The longest latency, µs.
    #[must_use]
    pub fn max_us(&self) -> f64 {
        self.0.max() as f64 / 1000.0
    }
}

/// Everything counted in a run.
#[derive(Debug, Clone, Default)]
pub struct Statistics {
    /// Cycles by trigger.
    pub cycles: BTreeMap<&'static str, u64>,
    /// Cycles that judged nothing, by reason.
    pub early_return: BTreeMap<&'static str, u64>,
    /// Candidates dropped because their message does not announce their generator.
    pub unannounced: u64,
    /// Generators announced more than once in a message.
    pub announced_twice: u64,
    /// Candidates by generator name.
    pub generators: BTreeMap<String, Tally>,
    /// Accepted candidates that could not be ranked, by reason.
    pub unranked: BTreeMap<&'static str, u64>,
    /// How many times a generator's candidate was the one to drive, by generator name; every generator is listed that
    /// had a candidate judged.
    pub selected: BTreeMap<String, u64>,
    /// Cycles that ended at their deadline before every candidate was judged.
    pub cut_by_deadline: u64,
    /// Candidates whose turn did not come.
    pub not_judged: u64,
    /// Rejections by enforced filter and metric.
    pub rejections: BTreeMap<&'static str, BTreeMap<&'static str, u64>>,
    /// The same for shadow filters, which reject nothing.
    pub shadow: BTreeMap<&'static str, BTreeMap<&'static str, u64>>,
    /// Most candidates in the buffer when a cycle asked.
    pub most_candidates: usize,
    /// Most generators in it.
    pub most_generators: usize,
    /// The most that was in each memory of the pipeline, with its bound: `filter.NAME` and `ranker`.
    pub fill: BTreeMap<String, Fill>,
    /// Hash over all verdicts of the last cycle that judged every candidate: what was found, not when.
    pub last_verdicts: Option<u64>,
    /// Latencies by stage.
    pub latency: BTreeMap<String, Latency>,
    /// Time that the threads spent on judging, and the time that they had for it.
    pub judging: Judging,
    /// Heap allocations.
    pub heap: Heap,
}

/// How well the threads that judge are used.
#[derive(Debug, Clone, Copy, Default)]
pub struct Judging {
    /// Time spent on candidates, over all threads.
    pub busy: Duration,
    /// From the first candidate of a cycle to the last, times the threads that were to judge.
    pub available: Duration,
}

impl Judging {
    fn add(&mut self, judged: &Judged) {
        let threads = u32::try_from(judged.shares.len()).unwrap_or(u32::MAX);
        self.busy += judged.shares.iter().map(|share| share.ended - share.began).sum::<Duration>();
        self.available += judged.judge * threads;
    }

    /// The share of their time in which the threads judged; `None` if nothing was judged.
    #[must_use]
    pub fn efficiency(self) -> Option<f64> {
        let available_s = self.available.as_secs_f64();
        (available_s > 0.0).then(|| self.busy.as_secs_f64() / available_s)
    }
}

/// Heap allocations of a run, counted at the end of each cycle.
#[derive(Debug, Clone, Copy, Default)]
pub struct Heap {
    /// At the end of the last cycle that still filled buffers for the first time.
    warm: Counted,
    now: Counted,
    /// Made by those who look on, up to now; they count from the next cycle's end on.
    own: u64,
}

/// Cycles after which buffers that are reused have their size.
const WARM_UP_CYCLES: u64 = 10;

#[derive(Debug, Clone, Copy, Default)]
struct Counted {
    cycles: u64,
    candidates: u64,
    /// Of all threads.
    all: u64,
    /// While candidates were judged.
    judging: u64,
    /// For those who look on: these statistics, pages, traces, pictures.
    own: u64,
}

impl Heap {
    /// The end of a cycle, before anything is counted.
    fn add(&mut self, report: &CycleReport) {
        if let Outcome::Judged(judged) = &report.outcome {
            self.now.candidates += judged.shares.iter().map(|share| share.candidates as u64).sum::<u64>();
            self.now.judging += judged.shares.iter().map(|share| share.allocations).sum::<u64>();
        }
        self.now.cycles += 1;
        self.now.own = self.own;
        self.now.all = allocations::of_all_threads();
        if self.now.cycles == 1 || self.now.cycles == WARM_UP_CYCLES {
            self.warm = self.now;
        }
    }

    /// Allocations per candidate while it was judged, and per cycle by all threads, both after the first cycles;
    /// `None` where nobody counts or there are too few cycles.
    #[must_use]
    pub fn per_candidate_and_cycle(&self) -> Option<[f64; 2]> {
        let since = |of: fn(&Counted) -> u64| of(&self.now).saturating_sub(of(&self.warm)) as f64;
        let (candidates, cycles) = (since(|at| at.candidates), since(|at| at.cycles));
        if !allocations::is_counting() || cycles == 0.0 {
            return None;
        }
        let of_cycles = since(|at| at.all) - since(|at| at.own);
        Some([since(|at| at.judging) / candidates.max(1.0), of_cycles / cycles])
    }
}

impl Statistics {
    /// Takes in one cycle.
    pub fn add(&mut self, report: &CycleReport, times: CycleTimes) {
        self.heap.add(report);
        let allocated = allocations::of_this_thread();
        self.count(report, times);
        self.set_aside(allocations::of_this_thread() - allocated);
    }

    /// So many allocations since the last cycle were made by somebody who looked on, and are none of the node's.
    pub fn set_aside(&mut self, allocations: u64) {
        self.heap.own += allocations;
    }

    /// Takes in what of the cycle was spent in the middleware.
    pub fn add_sending(&mut self, report: &CycleReport, times: CycleTimes, sending: Duration) {
        stages::of_sending(report, times, sending, |stage, took| record(&mut self.latency, stage, took));
    }

    fn count(&mut self, report: &CycleReport, times: CycleTimes) {
        *self.cycles.entry(report.cycle.trigger.name()).or_default() += 1;
        stages::of_cycle(report, times, |stage, took| record(&mut self.latency, stage, took));
        let concatenated = &report.cycle.concatenated;
        self.most_candidates = self.most_candidates.max(concatenated.candidates.len());
        self.most_generators = self.most_generators.max(concatenated.generators.len());
        for stale in &report.cycle.concatenated.stale {
            self.tally(&stale.generator_name).stale += 1;
        }
        let oddities = report.cycle.concatenated.oddities;
        self.unannounced += oddities.unannounced as u64;
        self.announced_twice += oddities.announced_twice as u64;
        if let Some(reason) = report.outcome.early_return() {
            *self.early_return.entry(reason).or_default() += 1;
        }
        if let Outcome::Judged(judged) = &report.outcome {
            self.add_judged(report, judged);
        }
    }

    fn add_judged(&mut self, report: &CycleReport, judged: &Judged) {
        let not_judged = judged.not_judged() as u64;
        self.not_judged += not_judged;
        self.cut_by_deadline += u64::from(not_judged > 0);
        if not_judged == 0 {
            self.last_verdicts = Some(hash_of(&judged.verdicts));
        }
        for filter in &judged.filters {
            if let Some(fill) = filter.fill {
                keep_most(&mut self.fill, "filter.", filter.name, fill);
            }
        }
        if let Some(fill) = judged.ranker_fill {
            keep_most(&mut self.fill, "", "ranker", fill);
        }
        self.judging.add(judged);
        for (_, why) in &judged.ranking.unranked {
            *self.unranked.entry(why.name()).or_default() += 1;
        }
        if let Some(selected) = &judged.selected {
            *self.selected.entry(selected.generator_name.to_string()).or_default() += 1;
        }
        // The first summary is the data-validity check, which always rejects.
        let filters = &judged.filters[1..];
        for (candidate, verdict) in report.cycle.concatenated.candidates.iter().zip(&judged.verdicts) {
            if !self.selected.contains_key(&*candidate.generator_name) {
                self.selected.insert(candidate.generator_name.to_string(), 0);
            }
            if !verdict.is_judged() {
                continue;
            }
            let tally = self.tally(&candidate.generator_name);
            tally.judged += 1;
            if verdict.accepted {
                tally.accepted += 1;
            } else {
                tally.rejected += 1;
            }
            count(&mut self.rejections, data_validity::NAME, &verdict.data_validity);
            for (filter, judgement) in filters.iter().zip(&verdict.judgements) {
                let counts = match filter.enforcement {
                    Enforcement::Enforced => &mut self.rejections,
                    Enforcement::Shadow => &mut self.shadow,
                };
                count(counts, filter.name, judgement);
            }
        }
    }

    fn tally(&mut self, generator: &str) -> &mut Tally {
        self.generators.entry(generator.to_owned()).or_default()
    }

    /// Takes in a time that was measured elsewhere.
    pub fn record(&mut self, stage: &str, took: Duration) {
        record(&mut self.latency, stage, took);
    }

    /// Cycles started by a trigger.
    #[must_use]
    pub fn cycles_by(&self, trigger: Trigger) -> u64 {
        self.cycles.get(trigger.name()).copied().unwrap_or(0)
    }

    /// Candidates of all generators.
    #[must_use]
    pub fn total(&self) -> Tally {
        self.generators.values().fold(Tally::default(), |sum, tally| Tally {
            judged: sum.judged + tally.judged,
            accepted: sum.accepted + tally.accepted,
            rejected: sum.rejected + tally.rejected,
            stale: sum.stale + tally.stale,
        })
    }
}

/// What the filters say about all candidates, to the last bit, without the times at which they say it.
fn hash_of(verdicts: &[Verdict]) -> u64 {
    let mut hasher = DefaultHasher::new();
    for verdict in verdicts {
        verdict.accepted.hash(&mut hasher);
        for judgement in std::iter::once(&verdict.data_validity).chain(&verdict.judgements) {
            judgement.feasible.hash(&mut hasher);
            judgement.failure.is_some().hash(&mut hasher);
            for metric in &judgement.metrics {
                (metric.name, metric.value.to_bits(), metric.risk).hash(&mut hasher);
            }
        }
    }
    hasher.finish()
}

fn keep_most(most: &mut BTreeMap<String, Fill>, group: &str, name: &str, fill: Fill) {
    // Looked up by its parts: a name is made once.
    let known = most.iter_mut().find(|(known, _)| known.strip_prefix(group) == Some(name));
    match known {
        Some((_, most)) if most.entries >= fill.entries && most.bound == fill.bound => {}
        Some((_, most)) => *most = Fill { entries: most.entries.max(fill.entries), bound: fill.bound },
        None => drop(most.insert(format!("{group}{name}"), fill)),
    }
}

fn record(latency: &mut BTreeMap<String, Latency>, stage: &str, took: Duration) {
    match latency.get_mut(stage) {
        Some(known) => known.record(took),
        None => latency.entry(stage.to_owned()).or_default().record(took),
    }
}

fn count(
    counts: &mut BTreeMap<&'static str, BTreeMap<&'static str, u64>>,
    filter: &'static str,
    judgement: &Judgement,
) {
    let by_metric = counts.entry(filter).or_default();
    for name in rejection_names(judgement) {
        *by_metric.entry(name).or_default() += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn latencies_keep_three_digits() {
        let mut latency = Latency::default();
        for microseconds in 1..=1000 {
            latency.record(Duration::from_micros(microseconds));
        }
        assert_eq!(latency.count(), 1000);
        assert!((latency.quantile_us(0.5) - 500.0).abs() < 1.0);
        assert!((latency.quantile_us(0.99) - 990.0).abs() < 1.0);
        assert!((latency.max_us() - 1000.0).abs() < 1.0);
    }

    #[test]
    fn an_endless_latency_saturates() {
        let mut latency = Latency::default();
        latency.record(Duration::MAX);
        assert!(latency.max_us() >= 6e7);
    }
}
