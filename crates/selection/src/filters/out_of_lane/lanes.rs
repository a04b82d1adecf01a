//! The lanelets that make up the road: which of them hold a point, and which of their edges is nearest to it.
//!
//! Edges are numbered lanelet by lanelet along the outline. They lie in runs of a few with a box around each, so that
//! most of an outline is passed over at a glance.

use super::box_tree::{BoxTree, surely_within_m2};
use lanelet_map::index::Outline;
use motion::occupancy::Bounds;
use motion::{Point2, Segment};
use std::ops::Range;

/// Edges of one run.
const RUN: usize = 8;
/// How much farther than the nearest edge runs are put at hand \[m\]: somewhat more than a vehicle is long.
const AROUND_M: f64 = 8.0;
/// Most runs that are put at hand.
const MOST_AROUND: usize = 48;
/// More than rounding moves a distance \[m\].
const AROUND_SLACK_M: f64 = 1e-5;
/// How far to the right of a run of edges \[m\] a point must be so that rounding cannot put it to the left of one.
const RIGHT_M: f64 = 1e-6;

/// All lanelets of the road, in the order of their ids. There is at least one.
#[derive(Debug)]
pub(super) struct Lanes {
    lanes: Vec<Lane>,
    runs: Vec<Run>,
    edges: Vec<Segment>,
    tree_of_lanes: BoxTree,
    tree_of_runs: BoxTree,
}

#[derive(Debug)]
struct Lane {
    id: i64,
    bounds: Bounds,
    runs: Range<usize>,
}

#[derive(Debug)]
struct Run {
    bounds: Bounds,
    edges: Range<usize>,
}

/// The edge nearest to a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct NearEdge {
    /// Its squared distance \[m²\].
    pub(super) squared_m2: f64,
    /// Its number; the lowest one of several that are equally near.
    pub(super) edge: usize,
}

impl NearEdge {
    pub(super) const NONE: Self = Self { squared_m2: f64::INFINITY, edge: usize::MAX };

    #[inline]
    pub(super) fn take(&mut self, edge: usize, squared_m2: f64) {
        // Most edges are farther, and one comparison tells.
        if squared_m2 <= self.squared_m2 && (squared_m2 < self.squared_m2 || edge < self.edge) {
            *self = Self { squared_m2, edge };
        }
    }
}

/// Runs of edges around a place: questions about near points follow each other.
#[derive(Debug, Default)]
pub(super) struct Surroundings {
    middle: Point2,
    /// All runs within this distance of the middle are at hand \[m\]; none if there are none.
    reach_m: f64,
    runs: Vec<u32>,
    /// True if so many edges are near that the tree is better asked.
    is_crowded: bool,
}

impl Surroundings {
    /// Forgets what belongs to another road.
    pub(super) fn restart(&mut self) {
        self.reach_m = 0.0;
        self.is_crowded = false;
        self.runs.clear();
    }

    /// True if all runs within a distance of a point are at hand, rounding included.
    fn holds(&self, point: Point2, distance_m: f64) -> bool {
        !self.is_crowded && (point - self.middle).norm() + distance_m + AROUND_SLACK_M <= self.reach_m
    }
}

impl Lanes {
    /// The given lanelets; `None` if there are none.
    pub(super) fn new(outlines: &[Outline]) -> Option<Self> {
        let mut lanes = Vec::with_capacity(outlines.len());
        let (mut runs, mut edges): (Vec<Run>, Vec<Segment>) = (Vec::new(), Vec::new());
        for outline in outlines {
            let (first_edge, first_run) = (edges.len(), runs.len());
            edges.extend(edges_of(&outline.corners));
            for run in edges[first_edge..].chunks(RUN) {
                let first = runs.last().map_or(0, |last: &Run| last.edges.end);
                let bounds = Bounds::around(run.iter().flat_map(|edge| [edge.start, edge.end]));
                runs.push(Run { bounds, edges: first..first + run.len() });
            }
            let bounds = runs[first_run..].iter().fold(Bounds::EMPTY, |all, run| all.joined(&run.bounds));
            lanes.push(Lane { id: outline.id, bounds, runs: first_run..runs.len() });
        }
        let tree_of_lanes = BoxTree::new(&lanes.iter().map(|lane| lane.bounds).collect::<Vec<_>>());
        let tree_of_runs = BoxTree::new(&runs.iter().map(|run| run.bounds).collect::<Vec<_>>());
        (!lanes.is_empty()).then_some(Self { lanes, runs, edges, tree_of_lanes, tree_of_runs })
    }

    /// The edge of a number.
    #[inline]
    pub(super) fn edge(&self, number: usize) -> &Segment {
        &self.edges[number]
    }

    /// Id of the lanelet at a place.
    pub(super) fn id(&self, place: u32) -> i64 {
        self.lanes[place as usize].id
    }

    /// Finds the lanelets whose boxes meet a box, as places, ascending.
    pub(super) fn find_meeting(&self, bounds: &Bounds, found: &mut Vec<u32>) {
        found.clear();
        self.tree_of_lanes.meeting(bounds, |place| found.push(place));
        found.sort_unstable();
    }

    /// Calls `visit` with the number of every edge of a lanelet whose box meets a box, ascending.
    #[inline]
    pub(super) fn for_each_edge_meeting(&self, place: u32, bounds: &Bounds, mut visit: impl FnMut(usize)) {
        for run in &self.runs[self.lanes[place as usize].runs.clone()] {
            if !run.bounds.meets(bounds) {
                continue;
            }
            for (number, edge) in run.edges.clone().zip(&self.edges[run.edges.clone()]) {
                if bounds_of(edge).meets(bounds) {
                    visit(number);
                }
            }
        }
    }

    /// True if the outline of a lanelet goes round a point; whether it does round a point on it is left to rounding.
    pub(super) fn holds(&self, place: u32, point: Point2) -> bool {
        let lane = &self.lanes[place as usize];
        if !lane.bounds.holds(point) {
            return false;
        }
        let mut winding = 0;
        for run in &self.runs[lane.runs.clone()] {
            // What counts are the edges to the right of the point, at its height.
            let Bounds { min, max } = run.bounds;
            if point.y < min.y || point.y > max.y || point.x > max.x + RIGHT_M {
                continue;
            }
            for edge in &self.edges[run.edges.clone()] {
                let side = edge.vector().perp(&(point - edge.start));
                if edge.start.y <= point.y {
                    winding += i32::from(edge.end.y > point.y && side > 0.0);
                } else {
                    winding -= i32::from(edge.end.y <= point.y && side < 0.0);
                }
            }
        }
        winding != 0
    }

    /// The edge nearest to a point. A hint, the edge nearest to some other place, shortens the search.
    pub(super) fn nearest_edge(&self, point: Point2, hint: Option<usize>) -> NearEdge {
        let mut nearest = NearEdge::NONE;
        if let Some(edge) = hint {
            nearest.take(edge, self.edges[edge].squared_distance_to_point(point));
        }
        self.tree_of_runs.nearest(point, nearest.squared_m2, |run| {
            self.take_nearest_of_run(&self.runs[run as usize], point, &mut nearest);
            nearest.squared_m2
        });
        nearest
    }

    /// The same, from the runs around a place that are at hand, if it is certain to be among them.
    ///
    /// The nearest edge is no farther from the point than the hint is; so it is no farther from the middle of the
    /// surroundings than that and the way from there to the point. All runs that near are at hand, and of equally near
    /// edges the first one is taken, in whatever order they come.
    pub(super) fn nearest_edge_around(
        &self,
        point: Point2,
        hint: Option<usize>,
        around: &mut Surroundings,
    ) -> NearEdge {
        let Some(edge) = hint.filter(|_| !around.is_crowded) else { return self.nearest_edge(point, hint) };
        let mut nearest = NearEdge::NONE;
        nearest.take(edge, self.edges[edge].squared_distance_to_point(point));
        let hint_m = nearest.squared_m2.sqrt();
        if !around.holds(point, hint_m) && !self.look_around(point, hint_m + AROUND_M, around) {
            return self.nearest_edge(point, hint);
        }
        for &run in &around.runs {
            let run = &self.runs[run as usize];
            if surely_within_m2(&run.bounds, point) <= nearest.squared_m2 {
                self.take_nearest_of_run(run, point, &mut nearest);
            }
        }
        nearest
    }

    /// Puts the runs within a distance of a point at hand; false if they are too many.
    fn look_around(&self, middle: Point2, reach_m: f64, around: &mut Surroundings) -> bool {
        let limit_m2 = reach_m * reach_m;
        let runs = &mut around.runs;
        runs.clear();
        self.tree_of_runs.nearest(middle, limit_m2, |run| {
            runs.push(run);
            // Nothing is within less than no distance: that ends it.
            if runs.len() > MOST_AROUND { f64::NEG_INFINITY } else { limit_m2 }
        });
        around.is_crowded = around.runs.len() > MOST_AROUND;
        (around.middle, around.reach_m) = (middle, reach_m);
        !around.is_crowded
    }

    /// Takes the nearest edge of a lanelet if it is nearer than the one known.
    pub(super) fn take_nearest_of(&self, place: u32, point: Point2, nearest: &mut NearEdge) {
        for run in &self.runs[self.lanes[place as usize].runs.clone()] {
            if surely_within_m2(&run.bounds, point) <= nearest.squared_m2 {
                self.take_nearest_of_run(run, point, nearest);
            }
        }
    }

    #[inline]
    fn take_nearest_of_run(&self, run: &Run, point: Point2, nearest: &mut NearEdge) {
        for (number, edge) in run.edges.clone().zip(&self.edges[run.edges.clone()]) {
            nearest.take(number, edge.squared_distance_to_point(point));
        }
    }

    /// Finds the edges within a distance of a point, as numbers, ascending, as long as there are not too many: then
    /// false. They are taken from the runs at hand where these are all that are so near.
    pub(super) fn find_edges_within(
        &self,
        point: Point2,
        distance_m: f64,
        most: usize,
        around: &Surroundings,
        found: &mut Vec<usize>,
    ) -> bool {
        let limit_m2 = distance_m * distance_m;
        found.clear();
        let mut take = |run: u32| {
            let run = &self.runs[run as usize];
            if found.len() <= most && surely_within_m2(&run.bounds, point) <= limit_m2 {
                let near = run.edges.clone().zip(&self.edges[run.edges.clone()]);
                let near = near.filter(|(_, edge)| edge.squared_distance_to_point(point) <= limit_m2);
                found.extend(near.map(|(number, _)| number));
            }
            // Nothing is within less than no distance: that ends it.
            if found.len() > most { f64::NEG_INFINITY } else { limit_m2 }
        };
        if around.holds(point, distance_m) {
            for &run in &around.runs {
                take(run);
            }
        } else {
            self.tree_of_runs.nearest(point, limit_m2, take);
        }
        found.sort_unstable();
        found.len() <= most
    }

    /// The lanelet nearest to a point, the first one of several. `distance_m` is that of the nearest edge.
    pub(super) fn nearest_lane(&self, point: Point2, distance_m: f64, places: &mut Vec<u32>) -> Option<i64> {
        let reach = Bounds { min: point, max: point }.grown(distance_m * (1.0 + 1e-9) + RIGHT_M);
        self.find_meeting(&reach, places);
        let distance_m = |place: u32| {
            let mut nearest = NearEdge::NONE;
            if self.holds(place, point) {
                return 0.0;
            }
            self.take_nearest_of(place, point, &mut nearest);
            nearest.squared_m2.sqrt()
        };
        let distances = places.iter().map(|&place| (distance_m(place), place));
        let nearest = distances.min_by(|a, b| a.0.total_cmp(&b.0))?;
        Some(self.id(nearest.1))
    }

    /// The edges of a lanelet, in order.
    pub(super) fn edges_of(&self, place: u32) -> &[Segment] {
        let runs = &self.runs[self.lanes[place as usize].runs.clone()];
        let ends = runs.first().zip(runs.last());
        ends.map_or(&[], |(first, last)| &self.edges[first.edges.start..last.edges.end])
    }
}

/// The box around an edge.
#[inline]
pub(super) fn bounds_of(edge: &Segment) -> Bounds {
    Bounds { min: edge.start.inf(&edge.end), max: edge.start.sup(&edge.end) }
}

fn edges_of(corners: &[[f64; 2]]) -> impl Iterator<Item = Segment> + '_ {
    let at = |k: usize| Point2::new(corners[k][0], corners[k][1]);
    (0..corners.len()).map(move |k| Segment::new(at(k), at((k + 1) % corners.len())))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Runs at hand give what the tree gives, wherever one asks and whatever the hint.
        #[test]
        fn edges_at_hand_are_those_of_the_tree(
            places in proptest::collection::vec((-40.0..40.0_f64, -40.0..40.0_f64, 1..6_u32), 1..40),
            questions in proptest::collection::vec((-1.0..1.0_f64, -1.0..1.0_f64, any::<u16>(), 0..8_u8), 1..60),
            (spread, far) in (prop_oneof![Just(1.0), Just(10.0)], prop_oneof![Just(0.0), Just(1e6)]),
        ) {
            // Lanelets that overlap and share edges, so that distances are often equal.
            let outlines: Vec<Outline> = (1..)
                .zip(&places)
                .map(|(id, &(x, y, size))| {
                    let (x, y) = (far + spread * x.round(), spread * y.round() - far);
                    let side = f64::from(size);
                    let corners = (0..12).map(|k| match k {
                        0..3 => [x + side * f64::from(k) / 3.0, y],
                        3..6 => [x + side, y + side * f64::from(k - 3) / 3.0],
                        6..9 => [x + side * f64::from(9 - k) / 3.0, y + side],
                        _ => [x, y + side * f64::from(12 - k) / 3.0],
                    });
                    Outline { id, corners: corners.collect() }
                })
                .collect();
            let lanes = Lanes::new(&outlines).unwrap();
            let mut around = Surroundings::default();
            let (mut at, mut hint) = (Point2::new(far, -far), None);
            for (dx, dy, number, kind) in questions {
                // Mostly a step on; now and then somewhere else, or with a hint of anywhere.
                let step = if kind == 0 { 60.0 } else { 2.0 };
                at = Point2::new(at.x + (step * dx).round(), at.y + (step * dy).round());
                hint = if kind == 1 { Some(usize::from(number) % lanes.edges.len()) } else { hint };
                let nearest = lanes.nearest_edge(at, None);
                prop_assert_eq!(lanes.nearest_edge_around(at, hint, &mut around), nearest);
                let reach_m = nearest.squared_m2.sqrt() + 3.0 * dx.abs();
                let (mut at_hand, mut of_tree) = (Vec::new(), Vec::new());
                let nothing = Surroundings::default();
                let are_few = lanes.find_edges_within(at, reach_m, 64, &around, &mut at_hand);
                prop_assert_eq!(lanes.find_edges_within(at, reach_m, 64, &nothing, &mut of_tree), are_few);
                prop_assert!(!are_few || at_hand == of_tree);
                hint = Some(nearest.edge);
            }
        }
    }
}
