//! Counts and latencies of a run, gathered cycle by cycle.

use hdrhistogram::Histogram;
use selection::report::rejection_names;
use selection::{Enforcement, Judgement, data_validity};
use selector_actors::cycle::{CycleReport, CycleTimes, Judged, Outcome, Trigger};
use std::collections::BTreeMap;
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
    fn record(&mut self, took: Duration) {
        self.0.saturating_record(u64::try_from(took.as_nanos()).unwrap_or(u64::MAX));
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
    /// Latencies by stage.
    pub latency: BTreeMap<String, Latency>,
}

impl Statistics {
    /// Takes in one cycle.
    pub fn add(&mut self, report: &CycleReport, times: CycleTimes) {
        *self.cycles.entry(report.cycle.trigger.name()).or_default() += 1;
        self.record("cycle", times.cycle);
        self.record("snapshot", report.cycle.snapshot);
        self.record("publish", times.publish);
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
        self.record("observe", judged.observe);
        self.record("judge", judged.judge);
        self.record("rank", judged.rank + judged.adapt);
        for (_, why) in &judged.ranking.unranked {
            *self.unranked.entry(why.name()).or_default() += 1;
        }
        if let Some(selected) = &judged.selected {
            *self.selected.entry(selected.generator_name.to_string()).or_default() += 1;
        }
        // The first summary is the data-validity check, which has no time of its own.
        let filters = &judged.filters[1..];
        for (filter, &took) in filters.iter().zip(&judged.filter_times) {
            self.record(&format!("filter.{}", filter.name), took);
        }
        for (candidate, verdict) in report.cycle.concatenated.candidates.iter().zip(&judged.verdicts) {
            self.selected.entry(candidate.generator_name.to_string()).or_default();
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

    fn record(&mut self, stage: &str, took: Duration) {
        self.latency.entry(stage.to_owned()).or_default().record(took);
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
