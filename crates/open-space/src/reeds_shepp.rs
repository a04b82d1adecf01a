//! Reeds-Shepp words: the ways from pose to pose in at most five pieces, each a straight line or an arc of the
//! tightest curvature, in either gear.
//!
//! All 46 words of the open-space planner's families (SCS, CSC, CCC, CCCC, CCSC, CCSCC). Every word ends at the goal;
//! the shortest is the shortest path there is without obstacles. Lengths are metres, negative in reverse. Nothing
//! here uses the heap.

mod formulas;

use std::f64::consts::PI;

use crate::arc::Arc;
use crate::pose::{Gear, PlanarPose};
use formulas::{FORMULAS, Formula, Goal};

/// Words there can be between two poses.
const MAX_WORDS: usize = 46;
/// Pieces a word can have.
const MAX_PIECES: usize = 5;
/// Pieces shorter than this are none.
const PIECE_M: f64 = 1e-9;

/// Which way the steering wheel is held.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Turn {
    Left,
    Straight,
    Right,
}

impl Turn {
    const fn mirrored(self) -> Self {
        match self {
            Self::Left => Self::Right,
            Self::Straight => Self::Straight,
            Self::Right => Self::Left,
        }
    }

    const fn sign(self) -> f64 {
        match self {
            Self::Left => 1.0,
            Self::Straight => 0.0,
            Self::Right => -1.0,
        }
    }
}

/// One way to the goal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Word {
    arcs: [Arc; MAX_PIECES],
    count: u8,
}

impl Word {
    const EMPTY: Self = Self { arcs: [Arc::new(0.0, 0.0); MAX_PIECES], count: 0 };

    /// The pieces in driving order, none of them without length.
    #[must_use]
    pub fn arcs(&self) -> &[Arc] {
        &self.arcs[..usize::from(self.count)]
    }

    /// Sum of the lengths, m.
    #[must_use]
    pub fn length_m(&self) -> f64 {
        self.arcs().iter().map(|arc| arc.length_m.abs()).sum()
    }

    /// How often the gear changes on the way.
    #[must_use]
    pub fn gear_changes(&self) -> usize {
        self.arcs().windows(2).filter(|pair| pair[0].gear() != pair[1].gear()).count()
    }

    /// Gear of the first and of the last piece; none where the start is the goal.
    #[must_use]
    pub fn gears(&self) -> Option<(Gear, Gear)> {
        Some((self.arcs().first()?.gear(), self.arcs().last()?.gear()))
    }

    /// Where the word leads from `from`.
    #[must_use]
    pub fn end(&self, from: &PlanarPose) -> PlanarPose {
        self.arcs().iter().fold(*from, |pose, arc| arc.end(&pose))
    }
}

/// All words between two poses.
#[derive(Clone, Debug)]
pub struct Words {
    words: [Word; MAX_WORDS],
    count: usize,
}

impl Words {
    /// The words from one pose to the other for a vehicle whose tightest turn has `max_curvature` (positive), 1/m.
    ///
    /// There is at least one for finite poses, and none otherwise. Where the poses are equal a word may have no
    /// pieces.
    #[must_use]
    pub fn between(from: &PlanarPose, to: &PlanarPose, max_curvature: f64) -> Self {
        let mut words = Self { words: [Word::EMPTY; MAX_WORDS], count: 0 };
        if !(from.is_finite() && to.is_finite() && max_curvature > 0.0 && max_curvature.is_finite()) {
            return words;
        }
        let mut put = |word: &Word| {
            words.words[words.count] = *word;
            words.count += 1;
        };
        for_each_word(from, to, max_curvature, &mut put);
        words
    }

    /// In the order of the families.
    #[must_use]
    pub fn as_slice(&self) -> &[Word] {
        &self.words[..self.count]
    }

    /// The shortest word.
    #[must_use]
    pub fn shortest(&self) -> Option<&Word> {
        self.as_slice().iter().min_by(|a, b| a.length_m().total_cmp(&b.length_m()))
    }

    /// The words with their costs, cheapest first; equal costs in the order of the families. Words of infinite cost
    /// are left out.
    pub fn by_cost(self, cost: impl Fn(&Word) -> f64) -> impl Iterator<Item = (f64, Word)> {
        let mut order = [(f64::INFINITY, 0_u8); MAX_WORDS];
        for (at, (slot, word)) in order.iter_mut().zip(self.as_slice()).enumerate() {
            *slot = (cost(word), at as u8);
        }
        order[..self.count].sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        order
            .into_iter()
            .take(self.count)
            .take_while(|(cost, _)| *cost < f64::INFINITY)
            .map(move |(cost, at)| (cost, self.words[usize::from(at)]))
    }
}

/// Cost of the cheapest word from one pose to the other; infinite where there is none.
pub(crate) fn least_cost(
    from: &PlanarPose,
    to: &PlanarPose,
    max_curvature: f64,
    cost: impl Fn(&Word) -> f64,
) -> f64 {
    let mut least = f64::INFINITY;
    if from.is_finite() && to.is_finite() {
        for_each_word(from, to, max_curvature, &mut |word| least = least.min(cost(word)));
    }
    least
}

/// Hands every word between two finite poses to `take`.
fn for_each_word(from: &PlanarPose, to: &PlanarPose, max_curvature: f64, take: &mut impl FnMut(&Word)) {
    let there = Goal::new(from, to, max_curvature);
    let back = there.seen_backwards();
    for (goal, backwards) in [(there, false), (back, true)] {
        for (goal, reflected) in [(goal, false), (goal.reflected(), true)] {
            for (goal, flipped) in [(goal, false), (goal.flipped(), true)] {
                let wanted = |f: &&Formula| (f.flippable || !flipped) && (f.reversible || !backwards);
                for formula in FORMULAS.iter().filter(wanted) {
                    if let Some(lengths) = (formula.solve)(&goal) {
                        let scale = if flipped { -1.0 } else { 1.0 } / max_curvature;
                        take(&word(formula.turns, &lengths, scale, max_curvature, reflected, backwards));
                    }
                }
            }
        }
    }
}

/// The image of a formula's solution.
fn word(
    turns: &[Turn],
    lengths: &[f64; MAX_PIECES],
    scale: f64,
    max_curvature: f64,
    reflected: bool,
    backwards: bool,
) -> Word {
    let mut word = Word::EMPTY;
    for k in 0..turns.len() {
        let k = if backwards { turns.len() - 1 - k } else { k };
        let turn = if reflected { turns[k].mirrored() } else { turns[k] };
        let length_m = lengths[k] * scale;
        if length_m.abs() > PIECE_M {
            word.arcs[usize::from(word.count)] = Arc::new(turn.sign() * max_curvature, length_m);
            word.count += 1;
        }
    }
    word
}

/// Brings an angle of at most a few turns into [-π, π).
fn norm(angle: f64) -> f64 {
    if (-PI..PI).contains(&angle) { angle } else { motion::pose::normalize_radian(angle) }
}

#[cfg(test)]
mod tests;
