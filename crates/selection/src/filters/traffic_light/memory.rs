//! What earlier cycles leave behind about a candidate: lights refused at amber, and how far ahead violations were.
//!
//! Keyed by candidate, so candidates never influence each other. While judging it is read only; afterwards it is folded
//! candidate by candidate. Bounded: candidates unseen for a while are forgotten, and of more than [`MAX_CANDIDATES`]
//! those unseen for longest.

use super::compliance::NearestViolation;
use super::signal_tracker::seconds_between;
use crate::candidate::CandidateKey;
use smallvec::SmallVec;
use std::collections::HashMap;

/// Most candidates remembered at once.
pub(super) const MAX_CANDIDATES: usize = 4096;

/// How long an unseen candidate is remembered at least, s.
const UNSEEN_S: f64 = 10.0;

/// What one check of a candidate against one light leaves behind.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct LightMark {
    /// The light.
    pub(super) light_id: i64,
    /// Arc length to the crossing if it is a violation, including the part of the candidate in the past, m.
    pub(super) violation_arc_m: Option<f64>,
    /// Whether the light was refused at amber.
    pub(super) refused: bool,
}

/// What judging a candidate leaves behind.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TrafficLightMemo {
    /// One mark for each check with a consequence, in order of the checks.
    pub(super) marks: SmallVec<[LightMark; 4]>,
    /// Whether there was anything to check; otherwise refusals stay as they are.
    pub(super) checked: bool,
    /// The violation that the front bumper comes to first.
    pub(super) nearest_violation: Option<NearestViolation>,
}

/// Memory of one candidate.
#[derive(Debug, Default)]
pub(super) struct CandidateMemory {
    last_seen_ns: i64,
    /// Light and when it was refused at amber.
    refused: SmallVec<[(i64, i64); 2]>,
    /// Light and arc length to the last violation, m.
    violations: SmallVec<[(i64, f64); 2]>,
}

fn put<T>(list: &mut SmallVec<[(i64, T); 2]>, light_id: i64, value: T) {
    match list.iter_mut().find(|(id, _)| *id == light_id) {
        Some(entry) => entry.1 = value,
        None => list.push((light_id, value)),
    }
}

impl CandidateMemory {
    /// Whether a light was refused at most this long ago.
    pub(super) fn was_refused(&self, light_id: i64, now_ns: i64, hysteresis_s: f64) -> bool {
        let refused = self.refused.iter().find(|(id, _)| *id == light_id);
        refused.is_some_and(|(_, time_ns)| seconds_between(*time_ns, now_ns) <= hysteresis_s)
    }

    /// Farthest remembered violation of a light that still constrains; 0 without one, m.
    pub(super) fn farthest_violation_m(&self, constrains: impl Fn(i64) -> bool) -> f64 {
        let arcs = self.violations.iter().filter(|(id, _)| constrains(*id)).map(|(_, arc_m)| *arc_m);
        arcs.fold(0.0, f64::max)
    }

    fn fold(
        &mut self,
        memo: &TrafficLightMemo,
        now_ns: i64,
        hysteresis_s: f64,
        constrains: impl Fn(i64) -> bool,
    ) {
        self.last_seen_ns = now_ns;
        self.violations.retain(|(id, _)| constrains(*id));
        for mark in &memo.marks {
            if let Some(arc_m) = mark.violation_arc_m {
                put(&mut self.violations, mark.light_id, arc_m);
            }
            if mark.refused {
                put(&mut self.refused, mark.light_id, now_ns);
            }
        }
        if memo.checked {
            self.refused.retain(|(_, time_ns)| seconds_between(*time_ns, now_ns) <= hysteresis_s);
        }
    }

    fn is_empty(&self) -> bool {
        self.refused.is_empty() && self.violations.is_empty()
    }
}

/// Memory of all candidates that have any.
#[derive(Debug, Default)]
pub(super) struct Memory {
    candidates: HashMap<CandidateKey, CandidateMemory>,
}

impl Memory {
    /// Memory of a candidate, if it has any.
    pub(super) fn of(&self, key: &CandidateKey) -> Option<&CandidateMemory> {
        if self.candidates.is_empty() { None } else { self.candidates.get(key) }
    }

    /// Takes in what judging a candidate left behind. `constrains` tells which lights are red or amber now.
    pub(super) fn fold(
        &mut self,
        key: CandidateKey,
        memo: &TrafficLightMemo,
        now_ns: i64,
        hysteresis_s: f64,
        constrains: impl Fn(i64) -> bool,
    ) {
        if memo.marks.is_empty() && !self.candidates.contains_key(&key) {
            return;
        }
        let candidate = self.candidates.entry(key).or_default();
        candidate.fold(memo, now_ns, hysteresis_s, constrains);
        if candidate.is_empty() {
            self.candidates.remove(&key);
        }
    }

    /// Forgets candidates that were not seen for a while.
    pub(super) fn evict(&mut self, now_ns: i64, hysteresis_s: f64) {
        let kept_s = hysteresis_s.max(UNSEEN_S);
        self.candidates.retain(|_, candidate| seconds_between(candidate.last_seen_ns, now_ns) <= kept_s);
        if self.candidates.len() > MAX_CANDIDATES {
            let mut seen: Vec<_> = self.candidates.iter().map(|(key, c)| (c.last_seen_ns, *key)).collect();
            seen.sort_unstable();
            let surplus = seen.len() - MAX_CANDIDATES;
            seen[..surplus].iter().for_each(|(_, key)| drop(self.candidates.remove(key)));
        }
    }

    /// The clock was set back: nothing happened later than now.
    pub(super) fn restart_clock(&mut self, now_ns: i64) {
        for candidate in self.candidates.values_mut() {
            candidate.last_seen_ns = candidate.last_seen_ns.min(now_ns);
            candidate.refused.iter_mut().for_each(|(_, time_ns)| *time_ns = (*time_ns).min(now_ns));
        }
    }

    /// Forgets everything.
    pub(super) fn clear(&mut self) {
        self.candidates.clear();
    }

    /// Number of candidates.
    pub(super) fn len(&self) -> usize {
        self.candidates.len()
    }
}

#[cfg(test)]
mod tests;
