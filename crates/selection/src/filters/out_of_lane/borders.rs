//! The borders of the road: where a step aside leaves it.
//!
//! Edges of lanelets are of three kinds. One that runs between the same two places as an edge of another lanelet, in
//! the other direction, lies inside the road. Of the others the parts that lie inside another lanelet do too. What is
//! left is the border. A convex outline that meets no border and has one point on the road lies on the road altogether.

use super::cell_grid::CellGrid;
use super::lanes::{Lanes, NearEdge, bounds_of};
use lanelet_map::index::{Outline, OutlineIndex};
use motion::occupancy::Bounds;
use motion::{Point2, Segment};
use std::collections::HashMap;

/// Pieces of an edge \[m\] shorter than this are cuts of one place: lanelets that share a bound leave no gap.
pub(super) const PIECE_M: f64 = 1e-6;
/// How far beside a shared edge \[m\] there must be road on both sides.
const BESIDE_M: f64 = 1e-4;

/// The borders, found once for a map.
#[derive(Debug)]
pub(super) struct Borders {
    borders: Vec<(Bounds, Segment)>,
    grid: CellGrid,
}

impl Borders {
    /// The borders of the road that these lanelets make up.
    pub(super) fn new(outlines: &OutlineIndex, lanes: &Lanes) -> Self {
        let mut borders = Vec::new();
        let mut buffers = Buffers::default();
        let directed = directed_edges(outlines.outlines(), lanes);
        let shared: HashMap<_, u32> = directed.iter().fold(HashMap::new(), |mut counts, (_, edge)| {
            *counts.entry(key(edge)).or_default() += 1;
            counts
        });
        for (place, edge) in &directed {
            let is_shared = shared.contains_key(&key(&Segment::new(edge.end, edge.start)));
            if !(is_shared && has_road_beside(outlines, edge, &mut buffers)) {
                push_outer_parts(lanes, *place, edge, &mut buffers, &mut borders);
            }
        }
        let bounds: Vec<Bounds> = borders.iter().map(bounds_of).collect();
        let grid = CellGrid::new(&bounds);
        Self { borders: bounds.into_iter().zip(borders).collect(), grid }
    }

    /// True if `may_meet` says so of any border whose box meets a box.
    #[inline]
    pub(super) fn any_meeting(&self, bounds: &Bounds, may_meet: impl Fn(&Segment) -> bool) -> bool {
        self.grid.any_near(bounds, |border| {
            let (around, border) = &self.borders[border as usize];
            around.meets(bounds) && may_meet(border)
        })
    }
}

#[derive(Default)]
struct Buffers {
    holding: Vec<usize>,
    near: Vec<u32>,
    cuts: Vec<f64>,
}

/// All edges with the places of their lanelets. Outlines that run the other way round are turned: the inside is on the
/// same side of all edges.
fn directed_edges(outlines: &[Outline], lanes: &Lanes) -> Vec<(u32, Segment)> {
    let of_lane = |(place, outline): (u32, &Outline)| {
        let is_reversed = twice_signed_area(&outline.corners) > 0.0;
        let directed = move |edge: &Segment| {
            if is_reversed { Segment::new(edge.end, edge.start) } else { *edge }
        };
        lanes.edges_of(place).iter().map(move |edge| (place, directed(edge)))
    };
    (0..).zip(outlines).flat_map(of_lane).collect()
}

fn key(edge: &Segment) -> [u64; 4] {
    // Shared points have the very same coordinates.
    [edge.start.x, edge.start.y, edge.end.x, edge.end.y].map(f64::to_bits)
}

/// An outline that crosses itself has its inside on the wrong side here and there: see for oneself.
fn has_road_beside(outlines: &OutlineIndex, edge: &Segment, buffers: &mut Buffers) -> bool {
    let middle = edge.start + edge.vector() * 0.5;
    let aside =
        motion::Vector2::new(-edge.vector().y, edge.vector().x) * (BESIDE_M / edge.length().max(BESIDE_M));
    [middle + aside, middle - aside].iter().all(|point| {
        outlines.holding([point.x, point.y], &mut buffers.holding);
        !buffers.holding.is_empty()
    })
}

/// Adds the parts of an edge that are not inside another lanelet. Between two cuts by edges of others a piece is inside
/// a lanelet altogether or not at all.
fn push_outer_parts(
    lanes: &Lanes,
    place: u32,
    edge: &Segment,
    buffers: &mut Buffers,
    borders: &mut Vec<Segment>,
) {
    let Buffers { near, cuts, .. } = buffers;
    let around = bounds_of(edge).grown(PIECE_M);
    lanes.find_meeting(&around, near);
    near.retain(|&other| other != place);
    cuts.clear();
    cuts.extend([0.0, 1.0]);
    for &other in &*near {
        lanes.for_each_edge_meeting(other, &around, |number| {
            cuts.extend(cut_ratio(edge, lanes.edge(number)));
        });
    }
    cuts.sort_unstable_by(f64::total_cmp);
    let at = |ratio: f64| if ratio < 1.0 { edge.start + edge.vector() * ratio } else { edge.end };
    let slack = PIECE_M / edge.length().max(PIECE_M);
    let mut outer: Option<(f64, f64)> = None;
    for pair in cuts.windows(2) {
        let (from, to) = (pair[0], pair[1]);
        let middle = at(0.5 * (from + to));
        if to - from <= slack || near.iter().any(|&other| is_inside(lanes, other, middle)) {
            continue;
        }
        // A little longer than the piece, so that what was left out as too short is not missed beside it.
        let (from, to) = ((from - 2.0 * slack).max(0.0), (to + 2.0 * slack).min(1.0));
        outer = match outer {
            Some((begun, until)) if from <= until => Some((begun, to)),
            Some((begun, until)) => {
                borders.push(Segment::new(at(begun), at(until)));
                Some((from, to))
            }
            None => Some((from, to)),
        };
    }
    let is_too_short_to_cut = slack >= 1.0;
    if let Some((from, to)) = outer.or(is_too_short_to_cut.then_some((0.0, 1.0))) {
        borders.push(Segment::new(at(from), at(to)));
    }
}

/// True if a point is inside a lanelet and not on its outline.
fn is_inside(lanes: &Lanes, place: u32, point: Point2) -> bool {
    let mut nearest = NearEdge::NONE;
    lanes.holds(place, point) && {
        lanes.take_nearest_of(place, point, &mut nearest);
        nearest.squared_m2 > PIECE_M * PIECE_M
    }
}

fn twice_signed_area(corners: &[[f64; 2]]) -> f64 {
    let Some(&[x, y]) = corners.first() else { return 0.0 };
    let relative = |[cx, cy]: [f64; 2]| motion::Vector2::new(cx - x, cy - y);
    let next = corners.iter().cycle().skip(1);
    corners.iter().zip(next).map(|(&a, &b)| relative(a).perp(&relative(b))).sum()
}

/// Where on a segment another one crosses or touches it.
pub(super) fn cut_ratio(side: &Segment, edge: &Segment) -> Option<f64> {
    let (v, w) = (side.vector(), edge.vector());
    let determinant = v.perp(&w);
    if determinant == 0.0 {
        return None;
    }
    let between = edge.start - side.start;
    let (ratio, on_edge) = (between.perp(&w) / determinant, between.perp(&v) / determinant);
    let is_inside = |u: f64| (-1e-9..=1.0 + 1e-9).contains(&u);
    (is_inside(ratio) && is_inside(on_edge)).then(|| ratio.clamp(0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn borders(outlines: &[&[[f64; 2]]]) -> Vec<[f64; 4]> {
        let outline = |(id, corners): (i64, &&[[f64; 2]])| Outline { id, corners: corners.to_vec() };
        let outlines = OutlineIndex::new((0..).zip(outlines).map(outline));
        let lanes = Lanes::new(outlines.outlines()).unwrap();
        let borders = Borders::new(&outlines, &lanes).borders;
        let ends = |(_, border): &(Bounds, Segment)| {
            let (a, b) = if (border.start.x, border.start.y) < (border.end.x, border.end.y) {
                (border.start, border.end)
            } else {
                (border.end, border.start)
            };
            [a.x, a.y, b.x, b.y].map(|v| (v * 1e3).round() / 1e3)
        };
        let mut borders: Vec<_> = borders.iter().map(ends).collect();
        borders.sort_by(|a, b| a.partial_cmp(b).unwrap());
        borders
    }

    #[test]
    fn shared_edges_are_no_borders() {
        let low = [[0.0, 0.0], [4.0, 0.0], [4.0, 1.0], [0.0, 1.0]];
        let high = [[0.0, 1.0], [4.0, 1.0], [4.0, 2.0], [0.0, 2.0]];
        let mut turned = high;
        turned.reverse();
        let expected = [
            [0.0, 0.0, 0.0, 1.0],
            [0.0, 0.0, 4.0, 0.0],
            [0.0, 1.0, 0.0, 2.0],
            [0.0, 2.0, 4.0, 2.0],
            [4.0, 0.0, 4.0, 1.0],
            [4.0, 1.0, 4.0, 2.0],
        ];
        assert_eq!(borders(&[&low, &high]), expected);
        assert_eq!(borders(&[&low, &turned]), expected);
    }

    #[test]
    fn parts_of_edges_inside_another_lanelet_are_no_borders() {
        let along = [[0.0, 0.0], [10.0, 0.0], [10.0, 2.0], [0.0, 2.0]];
        let across = [[4.0, -5.0], [6.0, -5.0], [6.0, 7.0], [4.0, 7.0]];
        let expected = [
            [0.0, 0.0, 0.0, 2.0],
            [0.0, 0.0, 4.0, 0.0],
            [0.0, 2.0, 4.0, 2.0],
            [4.0, -5.0, 4.0, 0.0],
            [4.0, -5.0, 6.0, -5.0],
            [4.0, 2.0, 4.0, 7.0],
            [4.0, 7.0, 6.0, 7.0],
            [6.0, -5.0, 6.0, 0.0],
            [6.0, 0.0, 10.0, 0.0],
            [6.0, 2.0, 6.0, 7.0],
            [6.0, 2.0, 10.0, 2.0],
            [10.0, 0.0, 10.0, 2.0],
        ];
        assert_eq!(borders(&[&along, &across]), expected);
    }

    #[test]
    fn what_only_touches_stays_a_border() {
        // Two lanelets that touch at one corner, and a gap of a tenth of a millimetre between two others.
        let one = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        let other = [[1.0, 1.0], [2.0, 1.0], [2.0, 2.0], [1.0, 2.0]];
        let beside = [[0.0, 1.0001], [-1.0, 1.0001], [-1.0, 3.0], [0.0, 3.0]];
        assert_eq!(borders(&[&one, &other, &beside]).len(), 12);
    }
}
