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
        if squared_m2 < self.squared_m2 || (squared_m2 == self.squared_m2 && edge < self.edge) {
            *self = Self { squared_m2, edge };
        }
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
    /// false.
    pub(super) fn find_edges_within(
        &self,
        point: Point2,
        distance_m: f64,
        most: usize,
        found: &mut Vec<usize>,
    ) -> bool {
        let limit_m2 = distance_m * distance_m;
        found.clear();
        self.tree_of_runs.nearest(point, limit_m2, |run| {
            let run = &self.runs[run as usize];
            let near = run.edges.clone().zip(&self.edges[run.edges.clone()]);
            let near = near.filter(|(_, edge)| edge.squared_distance_to_point(point) <= limit_m2);
            found.extend(near.map(|(number, _)| number));
            // Nothing is within less than no distance: that ends it.
            if found.len() > most { f64::NEG_INFINITY } else { limit_m2 }
        });
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
