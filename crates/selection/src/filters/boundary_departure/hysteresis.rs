//! When a finding becomes a verdict, and how long a verdict is held.

use std::collections::HashMap;

use super::departure::Evaluation;
use crate::candidate::CandidateKey;

/// Entries of keys that were not seen for this long are dropped, unless a buffer still acts.
const FORGET_AFTER_S: f64 = 10.0;
/// Multiple of the larger buffer after which it acts no more.
const FORGET_AFTER_BUFFERS: f64 = 10.0;
/// Time may go back by this much before everything is forgotten: a recording that starts again.
const GOES_BACK_S: f64 = 1.0;
/// Keys beyond this number are not remembered; a candidate without memory is judged without delay.
pub(super) const MOST_KEYS: usize = 1 << 16;

/// How long findings must last or be absent before the verdict changes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Buffers {
    pub(super) on_s: f64,
    pub(super) off_s: f64,
}

/// What the filter remembers about a candidate from cycle to cycle. The default is that of a candidate never seen: with
/// stamps of the present day its first critical finding is a verdict at once.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Hysteresis {
    /// Stamp of the last evaluation without a critical finding, s.
    last_clear_s: f64,
    /// Stamp of the last critical verdict that came from a finding, s.
    last_critical_s: f64,
    /// Whether a critical verdict is remembered that may be held.
    holds: bool,
}

/// What the finding of one cycle means after the buffers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Status {
    /// Nothing critical.
    Clear,
    /// Critical, but not for long enough yet.
    Pending,
    /// Critical.
    Critical,
}

impl Hysteresis {
    /// Takes the evaluation of a cycle at `now_s`; `None` if no border is near the candidate at all.
    pub(super) fn update(&mut self, now_s: f64, evaluation: Option<&Evaluation>, buffers: Buffers) -> Status {
        let Some(evaluation) = evaluation else {
            *self = Self { last_clear_s: now_s, holds: false, ..*self };
            return Status::Clear;
        };
        if evaluation.critical().next().is_none() {
            self.last_clear_s = now_s;
            self.holds &= now_s - self.last_critical_s < buffers.off_s;
            return if self.holds { Status::Critical } else { Status::Clear };
        }
        let is_soon = evaluation.critical().any(|finding| finding.time_s < buffers.on_s);
        if is_soon || now_s - self.last_clear_s >= buffers.on_s {
            *self = Self { last_critical_s: now_s, holds: true, ..*self };
            Status::Critical
        } else {
            Status::Pending
        }
    }
}

/// The hysteresis of every candidate key seen lately.
#[derive(Debug, Default)]
pub(super) struct Memory {
    entries: HashMap<CandidateKey, (Hysteresis, f64)>,
    now_s: f64,
}

impl Memory {
    /// A new cycle at `now_s`: forgets what is too old, and everything if time went back.
    pub(super) fn advance(&mut self, now_s: f64, buffers: Buffers) {
        if now_s < self.now_s - GOES_BACK_S {
            self.entries.clear();
        }
        self.now_s = now_s;
        let forget_after_s = FORGET_AFTER_S.max(FORGET_AFTER_BUFFERS * buffers.on_s.max(buffers.off_s));
        self.entries.retain(|_, (_, seen_s)| now_s - *seen_s <= forget_after_s);
    }

    /// The hysteresis of a key at the start of the cycle.
    pub(super) fn recall(&self, key: CandidateKey) -> Hysteresis {
        self.entries.get(&key).map(|(hysteresis, _)| *hysteresis).unwrap_or_default()
    }

    /// Number of keys.
    pub(super) fn len(&self) -> usize {
        self.entries.len()
    }

    /// Replaces the hysteresis of a key.
    pub(super) fn store(&mut self, key: CandidateKey, hysteresis: Hysteresis) {
        if self.entries.len() < MOST_KEYS || self.entries.contains_key(&key) {
            self.entries.insert(key, (hysteresis, self.now_s));
        }
    }
}
