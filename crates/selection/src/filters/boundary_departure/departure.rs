//! Walks along a candidate and finds where a side of the vehicle comes too near to its borders.
//!
//! What is asked for is the first critical point of each side and the smallest distance of both sides. So a border at a
//! point matters only if it is nearer than any other to any side at any point, or within the margins. How near the sides
//! come at least is found out beforehand at a few points. Then stances are taken in stretches and borders in runs: a run
//! that is out of reach of a whole stretch is not looked at in it. All bounds leave [`ROUNDING_M`] to rounding, so the
//! answer is that of looking at every border at every point.

use motion::{Segment, Vector2};

use super::borders::Borders;
use super::bounds::{larger, smaller};
use super::projection::{Projection, project, project_apart};
use super::stance::{Side, Stance};
use super::tolerance::{CONTACT_M, PASSED_M, ROUNDING_M};

/// Most segments in a run.
const RUN: usize = 4;
/// Stances in a stretch.
const STRETCH: usize = 8;
/// One of so many stances is looked at beforehand.
const SAMPLED: usize = 12;
/// Where a box misses the reach by less than this, a second bound is worth its work.
const NARROW_M: f64 = 1.0;

/// When a border is too near.
#[derive(Debug, Clone, Copy)]
pub(super) struct Limits {
    /// Lateral distance that counts as contact.
    pub(super) lateral_margin_m: f64,
    /// Way that the vehicle needs to stop, measured to its rear axle plus the front overhang.
    pub(super) braking_m: f64,
    /// A departure sooner than this is critical whatever the way.
    pub(super) cutoff_s: f64,
}

/// Where one side is critical for the first time; if it never is, where it is nearest to a border, which is exact only if
/// it is the nearest of both sides.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Finding {
    /// Lateral distance, negative behind a border that was crossed.
    pub(super) lateral_m: f64,
    /// Index of the point.
    pub(super) index: usize,
    pub(super) time_s: f64,
    /// The border segment.
    pub(super) border: u32,
    pub(super) is_critical: bool,
}

/// What was found on both sides; `None` for a side that is beside no border at any point, or only farther than the other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Evaluation {
    pub(super) left: Option<Finding>,
    pub(super) right: Option<Finding>,
}

impl Evaluation {
    /// Findings of both sides, left first.
    pub(super) fn findings(&self) -> impl Iterator<Item = &Finding> {
        self.left.iter().chain(&self.right)
    }

    /// Critical findings, left first.
    pub(super) fn critical(&self) -> impl Iterator<Item = &Finding> {
        self.findings().filter(|finding| finding.is_critical)
    }

    /// Smallest lateral distance of both findings; the largest number if there are none.
    pub(super) fn lateral_m(&self) -> f64 {
        self.findings().map(|finding| finding.lateral_m).fold(f64::MAX, f64::min)
    }
}

/// The borders of one side in an order that keeps neighbours together.
#[derive(Debug, Default)]
pub(super) struct Watch {
    watched: Vec<Watched>,
    runs: Vec<Run>,
    /// Runs that are in reach somewhere in a stretch.
    open: Vec<Run>,
    /// Gap and place in `watched` of those that are close at a stance.
    close: Vec<(f64, usize)>,
    /// Distance of the border that counted at the last stance.
    last_m: f64,
}

#[derive(Debug, Clone, Copy)]
struct Watched {
    border: u32,
    /// Position in the order of claims, which decides between equals.
    rank: u32,
    line: Segment,
}

/// Successive segments of one line string: all within `radius_m` of the chord.
#[derive(Debug, Clone, Copy)]
struct Run {
    first: usize,
    end: usize,
    chord: Segment,
    radius_m: f64,
}

impl Watch {
    /// Watches the claims of a side.
    pub(super) fn set(&mut self, borders: &Borders, claims: &[u32]) {
        let Self { watched, runs, last_m, .. } = self;
        *last_m = 0.0;
        watched.clear();
        watched.extend(claims.iter().zip(0..).map(|(&border, rank)| Watched {
            border,
            rank,
            line: *borders.line(border),
        }));
        watched.sort_unstable_by_key(|watched| watched.border);
        runs.clear();
        let mut first = 0;
        while first < watched.len() {
            let rest = &watched[first..];
            let follows =
                |pair: &[Watched]| pair[1].border == pair[0].border + 1 && borders.continues(pair[1].border);
            let length = 1 + rest.windows(2).take(RUN - 1).take_while(|pair| follows(pair)).count();
            let run = &rest[..length];
            let chord = Segment::new(run[0].line.start, run[length - 1].line.end);
            let bulge = run.iter().skip(1).map(|w| chord.squared_distance_to_point(w.line.start));
            let radius_m = bulge.fold(0.0, f64::max).sqrt();
            runs.push(Run { first, end: first + length, chord, radius_m });
            first += length;
        }
    }

    /// Walks along the stances until the side is critical. Distances beyond `bound_m` and the limits are of no interest
    /// before a border is crossed.
    pub(super) fn walk(
        &mut self,
        stances: &[Stance],
        side: Side,
        limits: &Limits,
        bound_m: f64,
    ) -> Option<Finding> {
        let mut nearest: Option<Finding> = None;
        let mut has_passed = false;
        for (index, stance) in stances.iter().enumerate() {
            // What is farther than this changes nothing, until a border is crossed.
            let nearest_m = nearest.map_or(bound_m, |nearest| smaller(nearest.lateral_m, bound_m));
            let reach_m = larger(larger(nearest_m, limits.lateral_margin_m), PASSED_M);
            if index % STRETCH == 0 && !has_passed {
                self.open(&stances[index..stances.len().min(index + STRETCH)], reach_m);
            }
            let beside = if has_passed {
                self.look_everywhere(stance, side)
            } else if self.open.is_empty() {
                continue;
            } else {
                look(stance, side, reach_m, &self.open, &self.watched, &mut self.close)
            };
            let Some(beside) = beside else { continue };
            let mut lateral_m = beside.lateral_m;
            if has_passed && lateral_m > 0.0 && is_behind(stance, side, beside.to_border) {
                lateral_m = -lateral_m;
            }
            has_passed |= lateral_m < PASSED_M;
            let finding = Finding {
                lateral_m,
                index,
                time_s: stance.time_s,
                border: beside.border,
                is_critical: false,
            };
            let is_soon =
                stance.along_m - beside.offset_m <= limits.braking_m || stance.time_s <= limits.cutoff_s;
            if lateral_m <= limits.lateral_margin_m && is_soon {
                return Some(Finding { is_critical: true, ..finding });
            }
            if nearest.is_none_or(|nearest| lateral_m < nearest.lateral_m) {
                nearest = Some(finding);
            }
        }
        nearest
    }

    /// The side comes at least this near to a border: the least distance at some of the stances, or `bound_m` if that is
    /// smaller.
    pub(super) fn bound(&mut self, stances: &[Stance], side: Side, mut bound_m: f64) -> f64 {
        for stance in stances.iter().rev().step_by(SAMPLED) {
            let beside = look(stance, side, bound_m, &self.runs, &self.watched, &mut self.close);
            bound_m = beside.map_or(bound_m, |beside| smaller(beside.lateral_m, bound_m));
        }
        bound_m
    }

    /// Keeps the runs in `open` that are within `reach_m` of the vehicle somewhere in the stretch.
    fn open(&mut self, stretch: &[Stance], reach_m: f64) {
        let Some(first) = stretch.first() else { return };
        let mut bounds = first.bounds;
        for stance in &stretch[1..] {
            for corner in stance.corners() {
                bounds.include(corner);
            }
        }
        let is_in_reach = |run: &&Run| bounds.gap_m(&run.chord) - run.radius_m <= reach_m + ROUNDING_M;
        self.open.clear();
        self.open.extend(self.runs.iter().filter(is_in_reach));
    }

    /// The nearest border at a stance, however far: behind a crossed border even far ones count, as they are negative.
    fn look_everywhere(&mut self, stance: &Stance, side: Side) -> Option<Beside> {
        let mut look = |reach_m| look(stance, side, reach_m, &self.runs, &self.watched, &mut self.close);
        // Mostly it is about as far as at the last stance.
        let reach_m = self.last_m + NARROW_M;
        let beside =
            look(reach_m).filter(|beside| beside.lateral_m <= reach_m).or_else(|| look(f64::INFINITY));
        self.last_m = beside.map_or(0.0, |beside| beside.lateral_m);
        beside
    }
}

/// The nearest border of some runs at a stance, if any is within `reach_m`; if none is, maybe a farther one.
fn look(
    stance: &Stance,
    side: Side,
    reach_m: f64,
    runs: &[Run],
    watched: &[Watched],
    close: &mut Vec<(f64, usize)>,
) -> Option<Beside> {
    let (hull, bounds) = (Hull { stance, side: stance.side(side) }, &stance.bounds);
    close.clear();
    for run in runs {
        if hull.is_beyond(&run.chord, bounds.gap_m(&run.chord), reach_m + run.radius_m) {
            continue;
        }
        let mut start = bounds.local(run.chord.start);
        for (watched, at) in watched[run.first..run.end].iter().zip(run.first..) {
            let end = bounds.local(watched.line.end);
            let gap_m = bounds.gap_between_m(start, end);
            start = end;
            if !hull.is_beyond(&watched.line, gap_m, reach_m) {
                close.push((gap_m, at));
            }
        }
    }
    hull.nearest_of(watched, close)
}

/// The border that counts at a stance.
#[derive(Debug, Clone, Copy)]
struct Beside {
    lateral_m: f64,
    offset_m: f64,
    to_border: Vector2,
    border: u32,
    rank: u32,
    /// Crossed by the front or rear edge.
    is_across: bool,
}

impl Beside {
    /// A border across the front or rear edge counts before all others; of several, the one farthest back, which was
    /// reached first. Else the nearest. The first claimed of equals.
    fn counts_before(&self, other: &Self) -> bool {
        let is_first = self.rank < other.rank;
        match (self.is_across, other.is_across) {
            (true, true) if self.offset_m == other.offset_m => is_first,
            (true, true) => self.offset_m > other.offset_m,
            (false, false) if self.lateral_m == other.lateral_m => is_first,
            (false, false) => self.lateral_m < other.lateral_m,
            (is_across, _) => is_across,
        }
    }
}

/// True if the way to the border leads to the inner side.
fn is_behind(stance: &Stance, side: Side, to_border: Vector2) -> bool {
    let side_line = stance.side(side);
    let cross = (side_line.start - side_line.end).perp(&to_border);
    match side {
        Side::Left => cross < 0.0,
        Side::Right => cross > 0.0,
    }
}

/// A side of the vehicle at a stance.
struct Hull<'a> {
    stance: &'a Stance,
    side: Segment,
}

impl Hull<'_> {
    /// True if no part of the vehicle is within `reach_m` of the line; `gap_m` is what is known.
    #[inline]
    fn is_beyond(&self, line: &Segment, gap_m: f64, reach_m: f64) -> bool {
        let reach_m = reach_m + ROUNDING_M;
        gap_m > reach_m || (gap_m > reach_m - NARROW_M && self.gap_across_m(line) > reach_m)
    }

    /// The vehicle is at least this far from the straight line through a segment; negative or not-a-number if that
    /// cannot be told.
    #[inline]
    fn gap_across_m(&self, line: &Segment) -> f64 {
        let vector = line.vector();
        let [a, b, c, d] = self.stance.corners().map(|corner| vector.perp(&(corner - line.start)));
        let (least, most) = (smaller(smaller(a, b), smaller(c, d)), larger(larger(a, b), larger(c, d)));
        larger(least, -most) / vector.norm()
    }

    /// The border that counts among those that are `close`, given with their gaps. Looks at them in the order of gaps,
    /// so that the first one or two are enough.
    fn nearest_of(&self, watched: &[Watched], close: &mut Vec<(f64, usize)>) -> Option<Beside> {
        let mut nearest: Option<Beside> = None;
        while !close.is_empty() {
            let first =
                (1..close.len()).fold(0, |first, at| if close[at].0 < close[first].0 { at } else { first });
            let (gap_m, at) = close.swap_remove(first);
            if nearest.as_ref().is_some_and(|nearest| gap_m > nearest.lateral_m + ROUNDING_M) {
                break;
            }
            if let Some(new) = self.measure(&watched[at], gap_m)
                && nearest.as_ref().is_none_or(|old| new.counts_before(old))
            {
                nearest = Some(new);
            }
        }
        nearest
    }

    /// How a border lies beside the side or across the front or rear edge, front first.
    fn measure(&self, watched: &Watched, gap_m: f64) -> Option<Beside> {
        let Watched { border, rank, line, .. } = watched;
        let beside = |projection: Projection, is_across| Beside {
            lateral_m: projection.lateral_m,
            offset_m: projection.offset_m,
            to_border: projection.to_border,
            border: *border,
            rank: *rank,
            is_across,
        };
        if gap_m > CONTACT_M {
            return project_apart(&self.side, line).map(|projection| beside(projection, false));
        }
        if self.stance.front_edge().intersection(line).is_some() {
            return Some(beside(Projection::crossing(0.0), true));
        }
        if self.stance.rear_edge().intersection(line).is_some() {
            return Some(beside(Projection::crossing(self.side.length()), true));
        }
        project(&self.side, line).map(|projection| beside(projection, false))
    }
}
