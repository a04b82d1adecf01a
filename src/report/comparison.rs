//! Two profiles held against each other, stage by stage, with the noise of both taken into account.
//!
//! A stage's change is the ratio of the medians, B over A. How far that may be chance is estimated by a bootstrap in two
//! levels: whole runs are drawn with replacement, and within each run blocks of consecutive cycles, because neighbouring
//! cycles resemble each other and runs differ as wholes. Of both profiles the same blocks are drawn: cycles of a drive
//! differ, but the same cycle is in both. A stage got slower or faster if 99 of 100 such draws lie on one
//! side of 1 and the change is more than [`NEGLIGIBLE`]; it stayed the same if 99 of 100 lie within [`SAME`] of 1; else
//! the runs are too noisy to tell. The draws are the same every time.

use super::samples::median;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt;

/// A change below this share is none worth a word.
const NEGLIGIBLE: f64 = 0.03;
/// An interval within this share of 1 is no change.
const SAME: f64 = 0.10;
/// Bootstrap draws.
const DRAWS: usize = 1000;
/// Draws cut off at each end: one in two hundred, so that 99 of 100 are left.
const CUT_OFF: usize = DRAWS / 200;
/// Most samples of a run that are drawn from.
const MOST_SAMPLES: usize = 200;

/// What is read of a profile.
#[derive(Debug, Clone, Deserialize)]
pub struct Profile {
    /// What was profiled.
    pub input: ProfiledInput,
    /// Hash over all effective parameters.
    pub settings_hash: Option<String>,
    /// Threads that judged.
    pub threads: Option<usize>,
    /// Times of the cycles by stage and run, µs.
    pub samples_us: BTreeMap<String, Vec<Vec<f64>>>,
}

/// The drive of a profile.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
pub struct ProfiledInput {
    /// Its name.
    pub name: String,
}

/// How a stage changed from A to B.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Change {
    /// B takes less time.
    Faster,
    /// B takes more time.
    Slower,
    /// No change worth a word.
    Same,
    /// The runs are too noisy to tell.
    Unclear,
}

impl fmt::Display for Change {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Faster => "faster",
            Self::Slower => "slower",
            Self::Same => "same",
            Self::Unclear => "unclear",
        })
    }
}

/// One stage in both profiles.
#[derive(Debug, Clone, Serialize)]
pub struct StageChange {
    /// Median in A, µs.
    pub a_p50_us: f64,
    /// Median in B, µs.
    pub b_p50_us: f64,
    /// B over A.
    pub ratio: f64,
    /// Lower end of the interval in which 99 of 100 draws of the ratio lie.
    pub low: f64,
    /// Its upper end.
    pub high: f64,
    /// What follows from that.
    pub verdict: Change,
}

/// Both profiles side by side.
#[derive(Debug, Clone, Serialize)]
pub struct Comparison {
    /// How the verdicts were found.
    pub method: &'static str,
    /// Stages that both have.
    pub stages: BTreeMap<String, StageChange>,
}

impl Comparison {
    /// From A to B.
    #[must_use]
    pub fn of(a: &Profile, b: &Profile) -> Self {
        let both = a.samples_us.iter().filter_map(|(stage, a)| Some((stage, a, b.samples_us.get(stage)?)));
        let stages = both.filter_map(|(stage, a, b)| Some((stage.clone(), change(a, b)?)));
        let method =
            "ratio of medians; bootstrap over runs and blocks of cycles, interval of 99 of 100 draws";
        Self { method, stages: stages.collect() }
    }
}

/// `None` if one of them has no sample.
fn change(a: &[Vec<f64>], b: &[Vec<f64>]) -> Option<StageChange> {
    let (a, b) = (thinned(a), thinned(b));
    if a.is_empty() || b.is_empty() {
        return None;
    }
    let (a_p50_us, b_p50_us) = (median(a.concat()), median(b.concat()));
    // Where a stage takes no time at all there is nothing to compare.
    let ratio_of = |b: f64, a: f64| if a > 0.0 { b / a } else { 1.0 };
    let mut draw = Draw(0x5eed);
    let mut ratio_of_draw = || {
        let blocks = draw.fork();
        ratio_of(draw.median(&b, blocks.clone()), draw.median(&a, blocks))
    };
    let mut ratios: Vec<f64> = (0..DRAWS).map(|_| ratio_of_draw()).collect();
    ratios.sort_by(f64::total_cmp);
    let (ratio, low, high) = (ratio_of(b_p50_us, a_p50_us), ratios[CUT_OFF], ratios[DRAWS - 1 - CUT_OFF]);
    Some(StageChange { a_p50_us, b_p50_us, ratio, low, high, verdict: verdict(ratio, low, high) })
}

fn verdict(ratio: f64, low: f64, high: f64) -> Change {
    if low > 1.0 && ratio > 1.0 + NEGLIGIBLE {
        Change::Slower
    } else if high < 1.0 && ratio < 1.0 - NEGLIGIBLE {
        Change::Faster
    } else if low > 1.0 - SAME && high < 1.0 + SAME {
        Change::Same
    } else {
        Change::Unclear
    }
}

/// The runs that have samples, each with at most so many that drawing takes no time worth a word.
fn thinned(runs: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let thin = |run: &Vec<f64>| {
        let step = run.len().div_ceil(MOST_SAMPLES).max(1);
        run.iter().copied().step_by(step).collect::<Vec<_>>()
    };
    runs.iter().filter(|run| !run.is_empty()).map(thin).collect()
}

/// Draws with replacement; SplitMix64.
#[derive(Debug, Clone)]
struct Draw(u64);

impl Draw {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn below(&mut self, end: usize) -> usize {
        (self.next() % end as u64) as usize
    }

    /// Draws that are independent of the further ones of this.
    fn fork(&mut self) -> Self {
        Self(self.next())
    }

    /// The median of one draw: as many runs as there are, of each as many blocks as fill it, where `blocks` says.
    fn median(&mut self, runs: &[Vec<f64>], mut blocks: Self) -> f64 {
        let mut drawn = Vec::with_capacity(runs.len() * MOST_SAMPLES);
        for _ in runs {
            let run = &runs[self.below(runs.len())];
            let block = (run.len() as f64).sqrt().ceil() as usize;
            let end = drawn.len() + run.len();
            while drawn.len() < end {
                let start = blocks.below(run.len() - block + 1);
                drawn.extend_from_slice(&run[start..start + block]);
            }
            drawn.truncate(end);
        }
        median(drawn)
    }
}

impl fmt::Display for Comparison {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "{:48} {:>10} {:>10} {:>7} {:>15}  verdict",
            "median of stage, µs", "A", "B", "B/A", "99 % interval"
        )?;
        for (stage, change) in &self.stages {
            let StageChange { a_p50_us, b_p50_us, ratio, low, high, verdict } = change;
            writeln!(
                f,
                "  {stage:46} {a_p50_us:>10.1} {b_p50_us:>10.1} {ratio:>7.3} {low:>7.3} {high:>7.3}  {verdict}"
            )?;
        }
        writeln!(f, "{}", self.method)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Runs of cycles around a median, each run off by a few per cent of its own.
    fn runs(median_us: f64, between_runs: f64, seed: u64) -> Vec<Vec<f64>> {
        let mut draw = Draw(seed);
        let mut unit = move || draw.below(1001) as f64 / 500.0 - 1.0;
        (0..5)
            .map(|_| {
                let run = 1.0 + between_runs * unit();
                (0..300).map(|_| median_us * run * (1.0 + 0.3 * unit())).collect()
            })
            .collect()
    }

    #[test]
    fn equal_profiles_are_the_same() {
        for seed in 0..10 {
            let change = change(&runs(100.0, 0.01, seed), &runs(100.0, 0.01, seed + 100)).unwrap();
            assert_eq!(change.verdict, Change::Same, "{change:?}");
        }
    }

    #[test]
    fn a_clear_change_is_told_with_its_direction() {
        let (a, b) = (runs(100.0, 0.01, 1), runs(120.0, 0.01, 2));
        assert_eq!(change(&a, &b).unwrap().verdict, Change::Slower);
        assert_eq!(change(&b, &a).unwrap().verdict, Change::Faster);
    }

    #[test]
    fn runs_that_differ_among_themselves_tell_nothing() {
        let change = change(&runs(100.0, 0.4, 3), &runs(110.0, 0.4, 4)).unwrap();
        assert_eq!(change.verdict, Change::Unclear, "{change:?}");
    }

    #[test]
    fn cycles_that_differ_among_themselves_are_held_against_their_like() {
        let uneven = |seed| {
            let mut runs = runs(100.0, 0.01, seed);
            runs.iter_mut().for_each(|run| (1..).zip(run).for_each(|(cycle, us)| *us *= f64::from(cycle)));
            runs
        };
        let change = change(&uneven(5), &uneven(6)).unwrap();
        assert_eq!(change.verdict, Change::Same, "{change:?}");
    }

    #[test]
    fn nothing_is_said_of_a_stage_without_samples() {
        assert!(change(&[Vec::new()], &runs(1.0, 0.0, 1)).is_none());
        let verdict = change(&[vec![0.0; 5]], &[vec![0.0; 5]]).unwrap().verdict;
        assert_eq!(verdict, Change::Same, "a stage that takes no time");
    }
}
