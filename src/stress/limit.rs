//! The largest load that holds its deadline.
//!
//! The number of candidates doubles until a cycle misses the deadline, then the gap is halved until it is small. What
//! held is run once more and longer; the result is the profile of that run, so that a limit is never told of which
//! nobody has seen that it holds. Where it does not hold again, the next smaller number is tried.

use super::{Pace, Stress, Stressed};
use crate::commands::Failure;
use crate::settings::Settings;
use serde::Serialize;

/// Most candidates that are tried.
pub const MOST_CANDIDATES: usize = 100_000;
/// The search ends when the gap is below this share of what held.
const GAP: f64 = 0.03;
/// What did not hold again is made smaller by this share.
const STEP_BACK: f64 = 0.05;
/// The last run is so many times as long as the others.
const LAST_RUN: u64 = 3;

/// One number of candidates that was tried.
#[derive(Debug, Clone, Serialize)]
pub struct Probe {
    /// In each cycle.
    pub candidates: usize,
    /// Whether no cycle missed the deadline.
    pub held: bool,
    /// Cycles that missed it.
    pub missed: u64,
    /// Median of the cycles, µs.
    pub p50_us: f64,
    /// The longest cycle, µs.
    pub max_us: f64,
}

/// What was found.
#[derive(Debug, Clone, Serialize)]
pub struct Limit {
    /// Largest number of candidates that held the deadline; 0 if none did.
    pub candidates: usize,
    /// True if more would hold too: the search ended before a miss.
    pub at_least: bool,
    /// The deadline.
    pub deadline_ms: f64,
    /// Anchors in a second; null where they came as fast as cycles ended.
    pub rate_hz: Option<f64>,
    /// Everything that was tried, in that order.
    pub probes: Vec<Probe>,
}

/// Searches, beginning with the candidates of `stress`; its deadline must be set. Gives the run at the limit, or the
/// last one if nothing held.
///
/// # Errors
/// The node cannot be started.
pub fn find(
    stress: &Stress,
    settings: &Settings,
    mut tell: impl FnMut(&Probe),
) -> Result<(Limit, Stressed), Failure> {
    let mut search = Search { stress, settings, probes: Vec::new(), tell: &mut tell };
    let first = stress.load.candidates.clamp(1, MOST_CANDIDATES);
    let (mut held, missed) = bracket(first, |candidates| search.holds(candidates))?;
    loop {
        let (holds, run) = search.run(held.max(1), stress.cycles * LAST_RUN)?;
        if holds || held <= 1 || !run.ended.errors.is_empty() {
            let limit = Limit {
                candidates: if holds { held.max(1) } else { 0 },
                at_least: holds && missed.is_none(),
                deadline_ms: stress.deadline.unwrap_or_default().as_secs_f64() * 1e3,
                rate_hz: match stress.pace {
                    Pace::Max => None,
                    Pace::Hertz(rate) => Some(rate),
                },
                probes: search.probes,
            };
            return Ok((limit, run));
        }
        held -= ((held as f64 * STEP_BACK).ceil() as usize).min(held - 1);
    }
}

/// Numbers of candidates close to each other of which the first held (0 if none did) and the second, if there is
/// one, did not.
fn bracket<E>(
    first: usize,
    mut holds: impl FnMut(usize) -> Result<bool, E>,
) -> Result<(usize, Option<usize>), E> {
    let (mut held, mut next) = (0, first);
    while holds(next)? {
        held = next;
        if held == MOST_CANDIDATES {
            return Ok((held, None));
        }
        next = (2 * held).min(MOST_CANDIDATES);
    }
    let mut missed = next;
    while missed - held > ((held as f64 * GAP) as usize).max(1) {
        let middle = held + (missed - held) / 2;
        if holds(middle)? {
            held = middle;
        } else {
            missed = middle;
        }
    }
    Ok((held, Some(missed)))
}

struct Search<'a> {
    stress: &'a Stress,
    settings: &'a Settings,
    probes: Vec<Probe>,
    tell: &'a mut dyn FnMut(&Probe),
}

impl Search<'_> {
    fn holds(&mut self, candidates: usize) -> Result<bool, Failure> {
        let (holds, run) = self.run(candidates, self.stress.cycles)?;
        match run.ended.errors.into_iter().next() {
            Some(failure) => Err(failure),
            None => Ok(holds),
        }
    }

    fn run(&mut self, candidates: usize, cycles: u64) -> Result<(bool, Stressed), Failure> {
        let mut stress = Stress { cycles, ..*self.stress };
        stress.load.candidates = candidates;
        let run = stress.run(self.settings)?;
        let cycle = run.ended.result.statistics.latency.get("cycle");
        let (p50_us, max_us) = cycle.map_or((0.0, 0.0), |cycle| (cycle.quantile_us(0.5), cycle.max_us()));
        let held = run.missed == 0 && cycle.is_some();
        let probe = Probe { candidates, held, missed: run.missed, p50_us, max_us };
        (self.tell)(&probe);
        self.probes.push(probe);
        Ok((held, run))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Searches where up to `limit` candidates hold.
    fn search(first: usize, limit: usize) -> (usize, Option<usize>) {
        bracket(first, |candidates| Ok::<_, ()>(candidates <= limit)).unwrap()
    }

    #[test]
    fn the_limit_is_bracketed_closely_wherever_it_is() {
        for limit in [1, 2, 3, 63, 64, 65, 1000, 4097, MOST_CANDIDATES - 1] {
            let (held, missed) = search(64, limit);
            let missed = missed.unwrap();
            assert!(held <= limit && missed > limit, "{held} {limit} {missed}");
            assert!((missed - held) as f64 <= (GAP * held as f64).max(1.0), "{held} {missed}");
        }
    }

    #[test]
    fn the_ends_of_the_range_are_found() {
        assert_eq!(search(64, 0), (0, Some(1)));
        assert_eq!(search(64, MOST_CANDIDATES), (MOST_CANDIDATES, None));
    }
}
