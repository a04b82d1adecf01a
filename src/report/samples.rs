//! Every cycle of a run with the time of each stage: which cycles were the worst, and why.
//!
//! Bounded: of longer runs the first [`MAX_CYCLES`] are kept, and how many there were.

use super::stages::{self, CYCLE, IN_TURN};
use selector_actors::cycle::{CycleReport, CycleTimes, Outcome};
use serde::Serialize;
use std::collections::BTreeMap;

/// Most cycles that are kept: a drive of five hours and a half at 10 Hz.
pub const MAX_CYCLES: usize = 200_000;
/// Candidates beyond this multiple of the usual number are why judging took longer.
const MANY_CANDIDATES: f64 = 1.2;

/// One cycle.
#[derive(Debug, Clone)]
struct Sample {
    number: u64,
    trigger: &'static str,
    candidates: usize,
    not_judged: usize,
    threads: usize,
    /// By stage, µs; not a number where the cycle did not pass the stage.
    took_us: Vec<f32>,
}

/// The cycles of a run.
#[derive(Debug, Clone, Default)]
pub struct Samples {
    names: Vec<String>,
    cycles: Vec<Sample>,
    left_out: u64,
}

/// A cycle that took long.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct WorstCycle {
    /// Number of the run, from 1.
    pub run: usize,
    /// Number of the cycle.
    pub cycle: u64,
    /// What started it.
    pub trigger: &'static str,
    /// Its candidates.
    pub candidates: usize,
    /// Those whose turn did not come.
    pub not_judged: usize,
    /// From the trigger's arrival to the last output.
    pub cycle_us: f64,
    /// What most of the excess over the usual cycle went into: a stage, a filter, `candidates` where there were more
    /// than usual, or `interrupted` where the threads did not get to judge for a while.
    pub cause: String,
    /// Time of that beyond the usual.
    pub excess_us: f64,
    /// Time of each stage.
    pub stages_us: BTreeMap<String, f64>,
}

impl Samples {
    /// Takes in one cycle.
    pub fn add(&mut self, report: &CycleReport, times: CycleTimes) {
        if self.cycles.len() == MAX_CYCLES {
            self.left_out += 1;
            return;
        }
        let mut took_us = vec![f32::NAN; self.names.len()];
        stages::of_cycle(report, times, |stage, took| {
            let index = self.names.iter().position(|name| name == stage).unwrap_or_else(|| {
                self.names.push(stage.to_owned());
                took_us.push(f32::NAN);
                self.names.len() - 1
            });
            took_us[index] = took.as_secs_f32() * 1e6;
        });
        let (not_judged, threads) = match &report.outcome {
            Outcome::Judged(judged) => (judged.not_judged(), judged.shares.len()),
            _ => (0, 0),
        };
        self.cycles.push(Sample {
            number: report.cycle.number,
            trigger: report.cycle.trigger.name(),
            candidates: report.cycle.concatenated.candidates.len(),
            not_judged,
            threads,
            took_us,
        });
    }

    /// Cycles that are not kept because there were too many.
    #[must_use]
    pub fn left_out(&self) -> u64 {
        self.left_out
    }

    /// Times of each stage in the order of the cycles, µs, of at most about `most` cycles evenly spread.
    #[must_use]
    pub fn by_stage(&self, most: usize) -> BTreeMap<String, Vec<f64>> {
        let step = self.cycles.len().div_ceil(most.max(1)).max(1);
        let of = |stage: usize| self.cycles.iter().step_by(step).filter_map(move |cycle| cycle.us(stage));
        let stages = self.names.iter().enumerate();
        stages.map(|(index, name)| (name.clone(), of(index).map(tenths).collect())).collect()
    }

    /// The cycles that took longest, the worst first; `run` is their number.
    #[must_use]
    pub fn worst(&self, count: usize, run: usize) -> Vec<WorstCycle> {
        let Some(total) = self.stage(CYCLE) else { return Vec::new() };
        let usual = Usual::of(self);
        let mut worst: Vec<&Sample> = self.cycles.iter().collect();
        worst.sort_by(|a, b| b.took_us[total].total_cmp(&a.took_us[total]));
        let shown = |sample: &Sample| {
            let (cause, excess_us) = self.cause(sample, &usual);
            let stages = self.names.iter().enumerate();
            let took = stages.filter_map(|(index, name)| Some((name.clone(), tenths(sample.us(index)?))));
            WorstCycle {
                run,
                cycle: sample.number,
                trigger: sample.trigger,
                candidates: sample.candidates,
                not_judged: sample.not_judged,
                cycle_us: tenths(sample.us(total).unwrap_or_default()),
                cause,
                excess_us: tenths(excess_us),
                stages_us: took.collect(),
            }
        };
        worst.into_iter().take(count).map(shown).collect()
    }

    fn stage(&self, name: &str) -> Option<usize> {
        self.names.iter().position(|known| known == name)
    }

    /// What most of the excess over the usual went into, and how much that was.
    fn cause(&self, sample: &Sample, usual: &Usual) -> (String, f64) {
        let excess = |index: usize| sample.us(index).unwrap_or_default() - usual.us[index];
        let stages = IN_TURN.into_iter().filter_map(|name| Some((name, excess(self.stage(name)?))));
        let Some((stage, excess_us)) = stages.max_by(|a, b| a.1.total_cmp(&b.1)) else {
            return (CYCLE.to_owned(), 0.0);
        };
        if stage != "judge" {
            return (stage.to_owned(), excess_us);
        }
        if sample.candidates as f64 > MANY_CANDIDATES * usual.candidates {
            return ("candidates".to_owned(), excess_us);
        }
        // Filters run on all threads at once: only their share of that is time of the cycle.
        let threads = sample.threads.max(1) as f64;
        let is_filter = |(_, name): &(usize, &String)| name.starts_with("filter.");
        let filters = self.names.iter().enumerate().filter(is_filter);
        let dearest = filters.map(|(index, name)| (name, excess(index) / threads));
        match dearest.max_by(|a, b| a.1.total_cmp(&b.1)) {
            Some((filter, of_filter_us)) if of_filter_us >= 0.3 * excess_us => (filter.clone(), of_filter_us),
            _ => ("interrupted".to_owned(), excess_us),
        }
    }
}

impl Sample {
    fn us(&self, stage: usize) -> Option<f64> {
        self.took_us.get(stage).map(|&us| f64::from(us)).filter(|us| !us.is_nan())
    }
}

/// Medians over a run.
struct Usual {
    us: Vec<f64>,
    candidates: f64,
}

impl Usual {
    fn of(samples: &Samples) -> Self {
        let of = |stage: usize| samples.cycles.iter().filter_map(move |sample| sample.us(stage));
        Self {
            us: (0..samples.names.len()).map(|stage| median(of(stage).collect())).collect(),
            candidates: median(samples.cycles.iter().map(|sample| sample.candidates as f64).collect()),
        }
    }
}

/// The middle value, the upper one of two; 0 of none.
pub(super) fn median(mut values: Vec<f64>) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// Rounded to tenths of a microsecond: no clock tells more.
fn tenths(us: f64) -> f64 {
    (us * 10.0).round() / 10.0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn samples(names: &[&str], cycles: &[(usize, &[f32])]) -> Samples {
        let sample = |(number, (candidates, took_us)): (u64, &(usize, &[f32]))| Sample {
            number,
            trigger: "anchor",
            candidates: *candidates,
            not_judged: 0,
            threads: 2,
            took_us: took_us.to_vec(),
        };
        Samples {
            names: names.iter().map(|&name| name.to_owned()).collect(),
            cycles: (1..).zip(cycles).map(sample).collect(),
            left_out: 0,
        }
    }

    const NAMES: [&str; 5] = ["wait", "judge", "cycle", "filter.a", "filter.b"];
    const USUAL: (usize, &[f32]) = (10, &[1.0, 100.0, 110.0, 90.0, 90.0]);

    fn cause(odd: (usize, &[f32])) -> String {
        let worst = samples(&NAMES, &[USUAL, USUAL, odd, USUAL]).worst(1, 1);
        assert_eq!(worst[0].cycle, 3);
        worst[0].cause.clone()
    }

    #[test]
    fn the_cause_is_where_the_excess_is() {
        assert_eq!(cause((10, &[500.0, 100.0, 610.0, 90.0, 90.0])), "wait");
        assert_eq!(cause((20, &[1.0, 200.0, 210.0, 180.0, 180.0])), "candidates");
        assert_eq!(cause((10, &[1.0, 200.0, 210.0, 280.0, 95.0])), "filter.a");
        assert_eq!(cause((10, &[1.0, 200.0, 210.0, 90.0, 90.0])), "interrupted");
    }

    #[test]
    fn a_stage_that_a_cycle_did_not_pass_has_no_sample() {
        let by_stage = samples(&NAMES, &[USUAL, (0, &[2.0, f32::NAN, 3.0])]).by_stage(100);
        assert_eq!((by_stage["wait"].len(), by_stage["judge"].len(), by_stage["filter.a"].len()), (2, 1, 1));
    }

    #[test]
    fn long_runs_are_thinned_evenly() {
        let cycles = vec![USUAL; 1000];
        assert_eq!(samples(&NAMES, &cycles).by_stage(300)["cycle"].len(), 250);
    }
}
