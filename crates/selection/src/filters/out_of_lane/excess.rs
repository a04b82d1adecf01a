//! How far an outline sticks out of the road.
//!
//! The outline is cut where it crosses edges of lanelets. The pieces that no lanelet holds are open; each is searched
//! for the point farthest from the road.

use super::borders::{PIECE_M, cut_ratio};
use super::lanes::{NearEdge, Surroundings, bounds_of};
use super::road::Road;
use motion::occupancy::Bounds;
use motion::{Point2, Segment};

/// To within this \[m\] the excess is found.
const EXCESS_M: f64 = 1e-7;
/// How far around something \[m\] rounding can put what touches it.
const TOUCH_M: f64 = 1e-5;
/// More than a bound can be too small \[m\] by rounding.
const ROUNDING_M: f64 = 1e-9;
/// Most steps of the search for the farthest point of one piece.
const MAX_STEPS: usize = 4096;
/// Most steps of the search for a bound: where it takes more, the excess itself is as quickly found.
const MAX_BOUND_STEPS: usize = 24;
/// Most edges that a search keeps at hand.
const MOST_EDGES: usize = 256;

/// Something sticks out of the road.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Excess {
    /// Distance of the farthest point from the road \[m\].
    pub(super) distance_m: f64,
    /// That point.
    pub(super) point: Point2,
}

/// A part of a side of an outline that is off the road, as ratios.
#[derive(Debug, Clone, Copy)]
pub(super) struct Piece {
    side: Segment,
    from: f64,
    to: f64,
}

impl Piece {
    #[inline]
    fn at(&self, ratio: f64) -> Point2 {
        self.side.start + self.side.vector() * ratio
    }
}

/// Memory of questions.
#[derive(Debug, Default)]
pub(super) struct ExcessBuffers {
    cuts: Vec<f64>,
    places: Vec<u32>,
    numbers: Vec<usize>,
    /// Edges near the outline or piece in question, with their numbers.
    edges: Vec<(usize, Segment)>,
    /// Parts of a piece that are yet to be searched.
    open: Vec<(f64, f64)>,
    hints: Hints,
}

impl ExcessBuffers {
    /// Forgets what belongs to another road.
    pub(super) fn restart(&mut self) {
        self.hints.restart();
    }
}

/// Edges that were nearest lately: often they are near enough for a bound, and always a start for a search.
#[derive(Debug, Default)]
struct Hints {
    edges: [usize; 4],
    count: usize,
    surroundings: Surroundings,
}

impl Hints {
    fn restart(&mut self) {
        self.count = 0;
        self.surroundings.restart();
    }

    fn latest(&self) -> Option<usize> {
        self.known().last().copied()
    }

    fn known(&self) -> &[usize] {
        &self.edges[..self.count]
    }

    fn add(&mut self, edge: usize) {
        if let Some(place) = self.known().iter().position(|&known| known == edge) {
            self.edges[place..self.count].rotate_left(1);
        } else if self.count < self.edges.len() {
            self.edges[self.count] = edge;
            self.count += 1;
        } else {
            self.edges.rotate_left(1);
            self.edges[self.count - 1] = edge;
        }
    }
}

impl Road {
    /// Appends the open pieces of an outline inside a box.
    pub(super) fn find_open_pieces(
        &self,
        outline: &[Point2],
        bounds: &Bounds,
        buffers: &mut ExcessBuffers,
        pieces: &mut Vec<Piece>,
    ) {
        let ExcessBuffers { cuts, places, edges, .. } = buffers;
        let reach = bounds.grown(TOUCH_M);
        self.lanes.find_meeting(bounds, places);
        edges.clear();
        for &place in &*places {
            let mut take = |number| edges.push((number, *self.lanes.edge(number)));
            self.lanes.for_each_edge_meeting(place, &reach, &mut take);
        }
        for (k, &start) in outline.iter().enumerate() {
            let side = Segment::new(start, outline[(k + 1) % outline.len()]);
            let reach = bounds_of(&side).grown(TOUCH_M);
            cuts.clear();
            cuts.extend([0.0, 1.0]);
            let near = edges.iter().filter(|(_, edge)| bounds_of(edge).meets(&reach));
            cuts.extend(near.filter_map(|(_, edge)| cut_ratio(&side, edge)));
            cuts.sort_unstable_by(f64::total_cmp);
            let shortest = PIECE_M / side.length().max(PIECE_M);
            for pair in cuts.windows(2) {
                let piece = Piece { side, from: pair[0], to: pair[1] };
                if piece.to - piece.from <= shortest {
                    continue;
                }
                let middle = piece.at(0.5 * (piece.from + piece.to));
                if !places.iter().any(|&place| self.lanes.holds(place, middle)) {
                    pieces.push(piece);
                }
            }
        }
    }

    /// A distance from the road \[m\] that no point of the convex outline of some corners exceeds; infinity if that is
    /// not soon found to be at most `enough_m`.
    pub(super) fn bound_outline(
        &self,
        corners: &[Point2],
        enough_m: f64,
        buffers: &mut ExcessBuffers,
    ) -> f64 {
        let known = buffers.hints.known().iter();
        let bound_m =
            known.map(|&edge| reach_of(self.lanes.edge(edge), corners)).fold(f64::INFINITY, f64::min);
        if bound_m <= enough_m || corners.is_empty() {
            return bound_m;
        }
        let middle =
            corners.iter().fold(Point2::origin(), |sum, corner| sum + corner.coords / corners.len() as f64);
        let nearest = self.nearest_edge(middle, &mut buffers.hints);
        let bound_m = reach_of(self.lanes.edge(nearest.edge), corners);
        if bound_m <= enough_m { bound_m } else { f64::INFINITY }
    }

    /// A distance from the road \[m\] that no point of a piece exceeds; infinity if that is not soon found to be at most
    /// `enough_m`.
    pub(super) fn bound(&self, piece: &Piece, enough_m: f64, buffers: &mut ExcessBuffers) -> f64 {
        let ExcessBuffers { hints, open, .. } = buffers;
        let length_m = piece.side.length();
        // Where a side was cut it is on the road, to within rounding.
        let cuts = u32::from(piece.from > 0.0) + u32::from(piece.to < 1.0);
        let from_cuts_m = (piece.to - piece.from) * length_m / f64::from(cuts) + TOUCH_M;
        if from_cuts_m <= enough_m {
            return from_cuts_m;
        }
        let mut bound_m = 0.0_f64;
        open.clear();
        open.push((piece.from, piece.to));
        for _ in 0..MAX_BOUND_STEPS {
            let Some((from, to)) = open.pop() else { return bound_m };
            let ends = [piece.at(from), piece.at(to)];
            let reach_m = |edge: usize| reach_of(self.lanes.edge(edge), &ends);
            let mut here_m = hints.known().iter().map(|&edge| reach_m(edge)).fold(f64::INFINITY, f64::min);
            if here_m > enough_m {
                let middle = 0.5 * (from + to);
                let nearest = self.nearest_edge(piece.at(middle), hints);
                let distance_m = nearest.squared_m2.sqrt();
                if distance_m > enough_m {
                    return f64::INFINITY;
                }
                here_m = reach_m(nearest.edge).min(distance_m + 0.5 * (to - from) * length_m + ROUNDING_M);
                if here_m > enough_m {
                    open.extend([(from, middle), (middle, to)]);
                    continue;
                }
            }
            bound_m = bound_m.max(here_m);
        }
        if open.is_empty() { bound_m } else { f64::INFINITY }
    }

    fn nearest_edge(&self, point: Point2, hints: &mut Hints) -> NearEdge {
        let nearest = self.lanes.nearest_edge_around(point, hints.latest(), &mut hints.surroundings);
        hints.add(nearest.edge);
        nearest
    }

    /// The point of a piece that is farthest from the road.
    ///
    /// Two bounds end the search. The distance changes by no more than one goes along the side. And it is at most that
    /// from any one edge, which is convex along the side and therefore largest at one of the ends.
    pub(super) fn farthest(&self, piece: &Piece, buffers: &mut ExcessBuffers) -> Excess {
        let length_m = piece.side.length();
        let has_edges = self.gather_edges(piece, length_m, buffers);
        let mut distance = |point| self.distance(point, has_edges, buffers);
        let mut best = Excess { distance_m: 0.0, point: piece.at(piece.from) };
        let mut take = |distance_m: f64, point: Point2| {
            if distance_m > best.distance_m {
                best = Excess { distance_m, point };
            }
            best.distance_m
        };
        for point in [piece.from, piece.to].map(|ratio| piece.at(ratio)) {
            take(distance(point).0, point);
        }
        let mut open = std::mem::take(&mut buffers.open);
        open.clear();
        open.push((piece.from, piece.to));
        for _ in 0..MAX_STEPS {
            let Some((from, to)) = open.pop() else { break };
            let middle = 0.5 * (from + to);
            let (distance_m, edge) = self.distance(piece.at(middle), has_edges, buffers);
            let best_m = take(distance_m, piece.at(middle));
            let nowhere_more_m = distance_m + 0.5 * (to - from) * length_m;
            let from_edge_m =
                edge.map_or(f64::INFINITY, |edge| farthest_end_m(self.lanes.edge(edge), piece, from, to));
            if nowhere_more_m.min(from_edge_m) > best_m + EXCESS_M {
                open.extend([(from, middle), (middle, to)]);
            }
        }
        buffers.open = open;
        best
    }

    /// Puts the edges at hand that can be nearest to any point of a piece; false if there are too many. No point of the
    /// piece is farther from the road than its middle is and half the piece, and no edge nearer to the middle by more.
    fn gather_edges(&self, piece: &Piece, length_m: f64, buffers: &mut ExcessBuffers) -> bool {
        let ExcessBuffers { numbers, edges, hints, .. } = buffers;
        let middle = piece.at(0.5 * (piece.from + piece.to));
        let nearest = self.nearest_edge(middle, hints);
        let reach_m = nearest.squared_m2.sqrt() + (piece.to - piece.from) * length_m + TOUCH_M;
        edges.clear();
        let are_few = self.lanes.find_edges_within(middle, reach_m, MOST_EDGES, &hints.surroundings, numbers);
        edges.extend(numbers.iter().map(|&number| (number, *self.lanes.edge(number))));
        are_few
    }

    /// Distance of a point of the piece in question from the road, and the edge that is nearest; 0 and no edge on the
    /// road.
    fn distance(&self, point: Point2, has_edges: bool, buffers: &mut ExcessBuffers) -> (f64, Option<usize>) {
        let mut nearest = NearEdge::NONE;
        if has_edges {
            for (number, edge) in &buffers.edges {
                nearest.take(*number, edge.squared_distance_to_point(point));
            }
        } else {
            nearest = self.nearest_edge(point, &mut buffers.hints);
        }
        // The pieces are open: only where one ends, or runs along an edge, can a point of it be on the road.
        if nearest.squared_m2 < TOUCH_M * TOUCH_M && self.is_on_road(point, &mut buffers.places) {
            return (0.0, None);
        }
        (nearest.squared_m2.sqrt(), Some(nearest.edge))
    }

    fn is_on_road(&self, point: Point2, places: &mut Vec<u32>) -> bool {
        self.lanes.find_meeting(&Bounds { min: point, max: point }, places);
        places.iter().any(|&place| self.lanes.holds(place, point))
    }
}

/// Distance of the farther end of a part of a piece from an edge \[m\].
#[inline]
fn farthest_end_m(edge: &Segment, piece: &Piece, from: f64, to: f64) -> f64 {
    edge.distance_to_point(piece.at(from)).max(edge.distance_to_point(piece.at(to)))
}

/// No point of the convex outline of some corners is farther from an edge than this \[m\]: the distance from a segment
/// is convex.
#[inline]
fn reach_of(edge: &Segment, corners: &[Point2]) -> f64 {
    let squared = corners.iter().map(|&corner| edge.squared_distance_to_point(corner));
    squared.fold(0.0, f64::max).sqrt() + ROUNDING_M
}
