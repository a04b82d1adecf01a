//! Along a candidate: which outlines stick out of the road, where first, and how far at most.
//!
//! Nearly all outlines lie on the road, and a glance at the borders shows it. Where one does not, the first outline that
//! sticks out too far is what the verdict is about and is measured exactly. Of all others only the largest excess
//! matters: they are looked through from the last one on, since a vehicle that leaves the road tends to go on leaving
//! it, and those that a bound shows to stick out less than what is known are not measured.

use super::excess::{Excess, ExcessBuffers, Piece};
use super::quad::Quad;
use super::road::Road;
use motion::geometry::convex_hull;
use motion::occupancy::Bounds;
use motion::{Footprint, Point2, TrajectoryPoint};
use std::ops::Range;

/// The vehicle at one point of a candidate.
#[derive(Debug)]
struct Stance {
    /// Index of the point.
    index: usize,
    place: Point2,
    outline: Quad,
    /// What of the outline is off the road, places in [`Walk::pieces`]; `None` until somebody wants to know.
    pieces: Option<Range<usize>>,
}

/// Stances of a candidate, and memory.
#[derive(Debug, Default)]
pub(super) struct Walk {
    stances: Vec<Stance>,
    pieces: Vec<Piece>,
    hull_pieces: Vec<Piece>,
    corners: Vec<Point2>,
    hull: Vec<Point2>,
    holding: Vec<usize>,
    places: Vec<u32>,
    search: ExcessBuffers,
}

/// The largest excess of a candidate \[m\], and where it first has too much.
#[derive(Debug, Default)]
pub(super) struct Found {
    pub(super) largest_m: f64,
    pub(super) first: Option<(usize, Excess)>,
    /// True if that is the very first outline.
    pub(super) is_at_start: bool,
}

impl Walk {
    /// Starts a candidate.
    pub(super) fn restart(&mut self) {
        self.stances.clear();
        self.pieces.clear();
        self.search.restart();
    }

    /// Places the outline at every point up to the horizon \[s\].
    pub(super) fn take_stances(
        &mut self,
        road: &Road,
        footprint: &Footprint,
        points: &[TrajectoryPoint],
        horizon_s: f64,
    ) {
        // A place that is known to be on the road: where the vehicle was last.
        let mut known = None;
        for (index, point) in points.iter().enumerate() {
            let time_s = point.time_from_start.seconds();
            if time_s > horizon_s {
                break;
            }
            if time_s < 0.0 {
                continue;
            }
            let outline = Quad::new(footprint, &point.pose);
            let is_on_road = road.covers_vehicle(&outline, known, &mut self.holding);
            known = if is_on_road { Some(outline.center()) } else { known };
            let pieces = is_on_road.then_some(0..0);
            self.stances.push(Stance { index, place: point.pose.point(), outline, pieces });
        }
    }

    /// Finds the largest excess and the first one above a limit \[m\].
    pub(super) fn find(&mut self, road: &Road, half_length_m: f64, limit_m: f64) -> Found {
        let mut found = Found::default();
        let mut begun = 0;
        while begun < self.stances.len() && found.first.is_none() {
            self.take_in_order(road, half_length_m, limit_m, begun, &mut found);
            begun += 1;
        }
        for at in (begun..self.stances.len()).rev() {
            self.raise_by_outline(road, at, &mut found);
        }
        for at in (begun..self.stances.len()).rev() {
            self.raise_by_hull(road, half_length_m, at, &mut found);
        }
        found
    }

    /// Measures the way to a stance and then the stance itself.
    fn take_in_order(&mut self, road: &Road, half_length_m: f64, limit_m: f64, at: usize, found: &mut Found) {
        let on_the_way = if self.wants_hull(road, half_length_m, at) {
            self.take_corners(at);
            self.hull_excess(road, None)
        } else {
            None
        };
        let here = self.outline_excess(road, at, None);
        // What happens on the way happens after the earlier of the two points.
        let before = at.saturating_sub(1);
        for (stance, excess) in [(before, on_the_way), (at, here)] {
            let Some(excess) = excess else { continue };
            found.largest_m = found.largest_m.max(excess.distance_m);
            if excess.distance_m > limit_m && found.first.is_none() {
                found.first = Some((self.stances[stance].index, excess));
                found.is_at_start = at == 0;
            }
        }
    }

    /// Raises the largest excess by that of a stance.
    fn raise_by_outline(&mut self, road: &Road, at: usize, found: &mut Found) {
        let stance = &self.stances[at];
        let known_m = found.largest_m;
        if stance.pieces.as_ref().is_some_and(Range::is_empty)
            || road.bound_outline(&stance.outline.corners, known_m, &mut self.search) <= known_m
        {
            return;
        }
        if let Some(excess) = self.outline_excess(road, at, Some(known_m)) {
            found.largest_m = known_m.max(excess.distance_m);
        }
    }

    /// Raises the largest excess by that of the hull of a stance and the one before.
    fn raise_by_hull(&mut self, road: &Road, half_length_m: f64, at: usize, found: &mut Found) {
        let known_m = found.largest_m;
        let are_on_road = |pieces: &Option<Range<usize>>| pieces.as_ref().is_some_and(Range::is_empty);
        let (before, after) = (&self.stances[at - 1], &self.stances[at]);
        let is_short = (after.place - before.place).norm() <= half_length_m;
        if is_short && are_on_road(&before.pieces) && are_on_road(&after.pieces) {
            return;
        }
        self.take_corners(at);
        if road.bound_outline(&self.corners, known_m, &mut self.search) <= known_m
            || !self.wants_hull(road, half_length_m, at)
        {
            return;
        }
        if let Some(excess) = self.hull_excess(road, Some(known_m)) {
            found.largest_m = known_m.max(excess.distance_m);
        }
    }

    /// Id of the lanelet nearest to an excess.
    pub(super) fn nearest_lanelet(&mut self, road: &Road, excess: &Excess) -> Option<i64> {
        road.lanes.nearest_lane(excess.point, excess.distance_m, &mut self.places)
    }

    /// True if what lies between a stance and the one before is to be tested: one of them sticks out, or they are far
    /// apart.
    fn wants_hull(&mut self, road: &Road, half_length_m: f64, at: usize) -> bool {
        at > 0 && {
            let way = self.stances[at].place - self.stances[at - 1].place;
            way.norm() > half_length_m || self.is_outside(road, at - 1) || self.is_outside(road, at)
        }
    }

    fn is_outside(&mut self, road: &Road, at: usize) -> bool {
        !self.pieces_of(road, at).is_empty()
    }

    fn pieces_of(&mut self, road: &Road, at: usize) -> Range<usize> {
        let Self { stances, pieces, search, .. } = self;
        let Stance { outline, pieces: known, .. } = &mut stances[at];
        known
            .get_or_insert_with(|| {
                let first = pieces.len();
                road.find_open_pieces(&outline.corners, &outline.bounds, search, pieces);
                first..pieces.len()
            })
            .clone()
    }

    /// The excess of a stance; `None` if there is none, or none above what is known \[m\].
    fn outline_excess(&mut self, road: &Road, at: usize, known_m: Option<f64>) -> Option<Excess> {
        let pieces = self.pieces_of(road, at);
        farthest(road, &self.pieces[pieces], known_m, &mut self.search)
    }

    fn take_corners(&mut self, at: usize) {
        let (before, after) = (&self.stances[at - 1].outline, &self.stances[at].outline);
        self.corners.clear();
        self.corners.extend(before.corners.iter().chain(&after.corners));
    }

    /// The excess of the hull of the corners; `None` if there is none, or none above what is known \[m\].
    fn hull_excess(&mut self, road: &Road, known_m: Option<f64>) -> Option<Excess> {
        let Self { corners, hull, hull_pieces, holding, search, .. } = self;
        convex_hull(corners, hull);
        let bounds = Bounds::around(hull.iter().copied());
        if road.covers(hull, &bounds, holding) {
            return None;
        }
        hull_pieces.clear();
        road.find_open_pieces(hull, &bounds, search, hull_pieces);
        farthest(road, hull_pieces, known_m, search)
    }
}

/// The largest excess of some pieces; `None` if there is none, or none above what is known \[m\].
fn farthest(
    road: &Road,
    pieces: &[Piece],
    known_m: Option<f64>,
    search: &mut ExcessBuffers,
) -> Option<Excess> {
    let mut worst: Option<Excess> = None;
    for piece in pieces {
        let known_m = worst.map(|worst| worst.distance_m.max(known_m.unwrap_or(0.0))).or(known_m);
        if known_m.is_some_and(|known_m| road.bound(piece, known_m, search) <= known_m) {
            continue;
        }
        let excess = road.farthest(piece, search);
        if worst.is_none_or(|worst| excess.distance_m > worst.distance_m) {
            worst = Some(excess);
        }
    }
    worst
}
