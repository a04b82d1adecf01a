//! Makes a path shorter: wherever a free Reeds-Shepp word between two of its poses costs less than the path between
//! them, it takes its place.
//!
//! The lattice of the search turns at its own steps; here the choice is over all pairs of poses along the path at
//! once, by dynamic programming, so the result is never dearer than the path was.

use super::attempt::Costs;
use super::motion_check::word_is_free;
use super::path::merged;
use super::portfolio::Found;
use crate::arc::Arc;
use crate::collision::CollisionChecker;
use crate::interruption::Interruption;
use crate::pose::{Gear, PlanarPose};
use crate::reeds_shepp::Words;

/// Poses along the path between which words are tried.
const KNOTS: f64 = 40.0;
/// They are no closer than this, m.
const SPACING_M: f64 = 0.3;
/// Gain below which another pass is not worth its time, m.
const GAIN_M: f64 = 0.05;
/// Passes at most.
const PASSES: usize = 3;

/// The cheapest known way to a knot that ends in one gear.
#[derive(Clone, Debug)]
struct Way {
    cost: f64,
    /// Knot and gear index it comes from.
    from: (usize, usize),
    arcs: Vec<Arc>,
}

/// What paths are shortened with.
pub(super) struct Shortcuts<'a> {
    pub(super) checker: &'a CollisionChecker,
    /// Where the paths begin.
    pub(super) start: &'a PlanarPose,
    pub(super) costs: &'a Costs,
    /// Asked for each pose; any answer ends it with what there is.
    pub(super) interruption: &'a mut dyn FnMut() -> Option<Interruption>,
}

impl Shortcuts<'_> {
    /// A path that costs no more and keeps the same room; the same where it cannot be driven in it.
    pub(super) fn shorten(&mut self, found: &Found) -> Found {
        let mut best = Found { arcs: merged(&found.arcs), ..*found };
        for _ in 0..PASSES {
            let before = self.costs.path(&best.arcs);
            let Some(arcs) = self.pass(&best) else { break };
            let arcs = merged(&arcs);
            let gain = before - self.costs.path(&arcs);
            if gain > 0.0 {
                best.arcs = arcs;
            }
            if gain < GAIN_M {
                break;
            }
        }
        best
    }

    /// The cheapest chain of words and pieces of the path; none when interrupted.
    fn pass(&mut self, path: &Found) -> Option<Vec<Arc>> {
        let costs = self.costs;
        let pieces = pieces(&path.arcs);
        let mut knots = vec![*self.start];
        for piece in &pieces {
            knots.push(piece.end(&knots[knots.len() - 1]));
        }
        let mut ways: Vec<[Option<Way>; 2]> = vec![const { [None, None] }; knots.len()];
        for from in 0..knots.len() - 1 {
            if (self.interruption)().is_some() {
                return None;
            }
            let arrivals: Vec<(Option<Gear>, f64, usize)> = if from == 0 {
                vec![(None, 0.0, 0)]
            } else {
                GEARS
                    .into_iter()
                    .filter_map(|gear| {
                        Some((Some(gear), ways[from][index(gear)].as_ref()?.cost, index(gear)))
                    })
                    .collect()
            };
            let first =
                |gear: Gear| if from == 0 && gear == Gear::Reverse { costs.reverse_start_m } else { 0.0 };
            // What a motion that begins in a gear costs up to its beginning.
            let entry = |gear: Gear| {
                let mut best = (f64::INFINITY, 0);
                for &(last, cost, at) in &arrivals {
                    let cost = cost + costs.change(last, gear) + first(gear);
                    if cost < best.0 {
                        best = (cost, at);
                    }
                }
                best
            };
            let entries = GEARS.map(entry);
            let along = pieces[from];
            let (cost, at) = entries[index(along.gear())];
            offer(&mut ways[from + 1], along.gear(), cost + costs.arc(&along), (from, at), &[along]);
            for to in from + 1..knots.len() {
                let words = Words::between(&knots[from], &knots[to], path.max_curvature);
                let cost = |word: &crate::reeds_shepp::Word| {
                    word.gears()
                        .map_or(f64::INFINITY, |(gear, _)| entries[index(gear)].0 + costs.word(word, None))
                };
                for (cost, word) in words.by_cost(cost) {
                    let Some((begins, ends)) = word.gears() else { continue };
                    let known =
                        |gear: Gear| ways[to][index(gear)].as_ref().map_or(f64::INFINITY, |way| way.cost);
                    // A way that arrives in the other gear is worth at most a change of gear.
                    if cost >= known(Gear::Forward).max(known(Gear::Reverse)) {
                        break;
                    }
                    if cost < known(ends) - 1e-9
                        && cost < known(ends.reversed()) + costs.gear_change_m
                        && word_is_free(self.checker, &knots[from], &word, path.inflation_m)
                    {
                        offer(&mut ways[to], ends, cost, (from, entries[index(begins)].1), word.arcs());
                        break;
                    }
                }
            }
        }
        Some(trace(&ways))
    }
}

const GEARS: [Gear; 2] = [Gear::Forward, Gear::Reverse];

fn index(gear: Gear) -> usize {
    usize::from(gear == Gear::Reverse)
}

fn offer(ways: &mut [Option<Way>; 2], gear: Gear, cost: f64, from: (usize, usize), arcs: &[Arc]) {
    let known = &mut ways[index(gear)];
    if known.as_ref().is_none_or(|way| cost < way.cost) {
        *known = Some(Way { cost, from, arcs: arcs.to_vec() });
    }
}

/// The arcs of the cheapest way to the last knot.
fn trace(ways: &[[Option<Way>; 2]]) -> Vec<Arc> {
    let cost = |at: usize, gear: usize| ways[at][gear].as_ref().map_or(f64::INFINITY, |way| way.cost);
    let mut at = ways.len() - 1;
    let mut gear = usize::from(cost(at, 1) < cost(at, 0));
    let mut backwards: Vec<&[Arc]> = Vec::new();
    while at > 0 {
        let Some(way) = &ways[at][gear] else { break };
        backwards.push(&way.arcs);
        (at, gear) = way.from;
    }
    backwards.into_iter().rev().flatten().copied().collect()
}

/// The arcs cut into pieces, so that there are enough knots along the path.
fn pieces(arcs: &[Arc]) -> Vec<Arc> {
    let total: f64 = arcs.iter().map(|arc| arc.length_m.abs()).sum();
    let spacing_m = (total / KNOTS).max(SPACING_M);
    arcs.iter()
        .flat_map(|arc| {
            let pieces = (arc.length_m.abs() / spacing_m).ceil().max(1.0);
            std::iter::repeat_n(Arc::new(arc.curvature, arc.length_m / pieces), pieces as usize)
        })
        .collect()
}
