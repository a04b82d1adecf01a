//! Walks along a candidate and finds where a side of the vehicle comes too near to its borders.
//!
//! The nearest border at a point matters only if it is nearer than everything before it, or within the margins. So every
//! border, and every run of borders, sleeps until the vehicle has moved far enough to possibly come that near; bounds
//! are conservative by [`ROUNDING_M`], so the result is that of looking at every border at every point.

use motion::{Point2, Segment, Vector2};

use super::borders::Borders;
use super::projection::project;
use super::stance::{Side, Stance};
use super::tolerance::{PASSED_M, ROUNDING_M};

/// Most segments in a run.
const RUN: usize = 8;

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

/// Where one side is critical for the first time; if it never is, where it is nearest to a border.
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

/// What was found on both sides; `None` for a side that is beside no border at any point.
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
}

#[derive(Debug, Clone, Copy)]
struct Watched {
    border: u32,
    /// Position in the order of claims, which decides between equals.
    rank: u32,
    line: Segment,
    /// Movement of the vehicle from which on this must be looked at.
    wake_m: f64,
}

/// Successive segments of one line string: all within `radius_m` of the chord.
#[derive(Debug, Clone, Copy)]
struct Run {
    first: usize,
    end: usize,
    chord: Segment,
    radius_m: f64,
    wake_m: f64,
}

impl Watch {
    /// Watches the claims of a side.
    pub(super) fn set(&mut self, borders: &Borders, claims: &[u32]) {
        let Self { watched, runs } = self;
        watched.clear();
        watched.extend(claims.iter().zip(0..).map(|(&border, rank)| Watched {
            border,
            rank,
            line: *borders.line(border),
            wake_m: f64::NEG_INFINITY,
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
            runs.push(Run { first, end: first + length, chord, radius_m, wake_m: f64::NEG_INFINITY });
            first += length;
        }
    }

    /// Walks along the stances until the side is critical.
    pub(super) fn walk(&mut self, stances: &[Stance], side: Side, limits: &Limits) -> Option<Finding> {
        let mut nearest: Option<Finding> = None;
        let mut has_passed = false;
        let mut wake_m = f64::NEG_INFINITY;
        for (index, stance) in stances.iter().enumerate() {
            if !has_passed && stance.moved_m < wake_m {
                continue;
            }
            // What is farther than this changes nothing. Behind a crossed border even far distances count.
            let reach_m = match nearest {
                Some(nearest) if !has_passed => nearest.lateral_m.max(limits.lateral_margin_m).max(PASSED_M),
                _ => f64::INFINITY,
            };
            let (beside, next_m) = self.look(stance, side, reach_m);
            wake_m = next_m;
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

    /// The nearest border at a stance, if any is within `reach_m`; and the movement up to which nothing else will be,
    /// as long as the reach does not grow.
    fn look(&mut self, stance: &Stance, side: Side, reach_m: f64) -> (Option<Beside>, f64) {
        let hull = Hull::new(stance, side);
        let (now_m, reach_m) = (stance.moved_m, reach_m + ROUNDING_M);
        let mut beside: Option<Beside> = None;
        let mut next_m = f64::INFINITY;
        for run in &mut self.runs {
            let is_asleep = reach_m.is_finite() && now_m < run.wake_m;
            if !is_asleep {
                run.wake_m = now_m + (hull.gap_m(&run.chord) - run.radius_m - reach_m);
            }
            if now_m < run.wake_m {
                next_m = next_m.min(run.wake_m);
                continue;
            }
            run.wake_m = f64::INFINITY;
            for watched in &mut self.watched[run.first..run.end] {
                if !(reach_m.is_finite() && now_m < watched.wake_m) {
                    let gap_m = hull.gap_m(&watched.line);
                    watched.wake_m = now_m + (gap_m - reach_m);
                    let nearest_m = beside.as_ref().map_or(f64::INFINITY, |beside| beside.lateral_m);
                    if now_m >= watched.wake_m && gap_m <= nearest_m + ROUNDING_M {
                        hull.measure(watched, &mut beside);
                    }
                }
                run.wake_m = run.wake_m.min(watched.wake_m);
            }
            next_m = next_m.min(run.wake_m);
        }
        (beside, next_m)
    }
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

/// True if the way to the border leads to the inner side.
fn is_behind(stance: &Stance, side: Side, to_border: Vector2) -> bool {
    let side_line = stance.side(side);
    let cross = (side_line.start - side_line.end).perp(&to_border);
    match side {
        Side::Left => cross < 0.0,
        Side::Right => cross > 0.0,
    }
}

/// The vehicle at a stance, with the box around it along the side.
struct Hull {
    side: Segment,
    front: Segment,
    rear: Segment,
    axis: Vector2,
    low: Vector2,
    high: Vector2,
}

impl Hull {
    fn new(stance: &Stance, side: Side) -> Self {
        let side = stance.side(side);
        let forward = side.start - side.end;
        let length = forward.norm();
        // Any axis gives a box; a vehicle that stands on its nose has no direction.
        let axis = if length > 0.0 { forward / length } else { Vector2::new(1.0, 0.0) };
        let mut hull = Self {
            side,
            front: stance.front_edge(),
            rear: stance.rear_edge(),
            axis,
            low: Vector2::repeat(f64::INFINITY),
            high: Vector2::repeat(f64::NEG_INFINITY),
        };
        for corner in stance.corners() {
            let local = hull.local(corner);
            hull.low = hull.low.inf(&local);
            hull.high = hull.high.sup(&local);
        }
        hull
    }

    /// Along and across the axis, from the front corner of the side.
    #[inline]
    fn local(&self, place: Point2) -> Vector2 {
        let v = place - self.side.start;
        Vector2::new(self.axis.dot(&v), self.axis.perp(&v))
    }

    /// The vehicle is at least this far from the line; negative if that cannot be told.
    #[inline]
    fn gap_m(&self, line: &Segment) -> f64 {
        let (a, b) = (self.local(line.start), self.local(line.end));
        let gap = |axis: usize| {
            let (low, high) = if a[axis] < b[axis] { (a[axis], b[axis]) } else { (b[axis], a[axis]) };
            let (ahead, behind) = (low - self.high[axis], self.low[axis] - high);
            if ahead > behind { ahead } else { behind }
        };
        let (along, across) = (gap(0), gap(1));
        if along > across { along } else { across }
    }

    /// Keeps the border in `beside` if it counts more: a border across the front or rear edge before all others, of
    /// those the one farthest back, which is reached last but was passed first; else the nearest, first claimed first.
    fn measure(&self, watched: &Watched, beside: &mut Option<Beside>) {
        let across = if self.front.intersection(&watched.line).is_some() {
            Some(0.0)
        } else {
            self.rear.intersection(&watched.line).map(|_| self.side.length())
        };
        let (border, rank) = (watched.border, watched.rank);
        let new = if let Some(offset_m) = across {
            Beside { lateral_m: 0.0, offset_m, to_border: Vector2::zeros(), border, rank, is_across: true }
        } else {
            let Some(projection) = project(&self.side, &watched.line) else { return };
            let (lateral_m, offset_m) = (projection.lateral_m, projection.offset_m);
            Beside { lateral_m, offset_m, to_border: projection.to_border, border, rank, is_across: false }
        };
        let is_better = beside.as_ref().is_none_or(|old| {
            let is_first = new.rank < old.rank;
            match (new.is_across, old.is_across) {
                (true, true) => new.offset_m > old.offset_m || (new.offset_m == old.offset_m && is_first),
                (false, false) => {
                    new.lateral_m < old.lateral_m || (new.lateral_m == old.lateral_m && is_first)
                }
                (is_across, _) => is_across,
            }
        });
        // A border without length has no distance.
        if is_better && !new.lateral_m.is_nan() {
            *beside = Some(new);
        }
    }
}
