//! The union of the road lanelets, and how far something sticks out of it.
//!
//! The outline edges of all lanelets are of two kinds: an edge that runs between the same two places as an edge of
//! another lanelet, in the other direction, lies inside the union; every other edge may be a border of it. A convex
//! outline that meets no such border and has one corner on the road lies on the road altogether. Only where a border
//! is met the excess is measured: the outline is cut where it crosses lanelet edges, and the pieces that no lanelet
//! holds are searched for the point farthest from the union.

use lanelet_map::Map;
use lanelet_map::index::OutlineIndex;
use motion::occupancy::{Bounds, BoundsColumns};
use motion::{Point2, Segment};
use std::collections::HashMap;

/// Side of a cell of the border grid \[m\].
const CELL_M: f64 = 16.0;
/// Pieces of an outline \[m\] shorter than this are cuts of one place: lanelets that share a bound leave no gap.
const PIECE_M: f64 = 1e-6;
/// To within this \[m\] the excess is found.
const EXCESS_M: f64 = 1e-7;
/// How far beside a shared edge \[m\] there must be road on both sides.
const BESIDE_M: f64 = 1e-4;
/// Most steps of the search for the farthest point of one piece.
const MAX_STEPS: usize = 4096;

/// Something sticks out of the road.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Excess {
    /// Distance of the farthest point from the road \[m\].
    pub(super) distance_m: f64,
    /// That point.
    pub(super) point: Point2,
    /// The lanelet nearest to it.
    pub(super) lanelet: Option<i64>,
}

/// The road, made once for a map.
#[derive(Debug)]
pub(super) struct Road {
    lanelets: OutlineIndex,
    bounds: BoundsColumns,
    borders: Vec<Segment>,
    /// Borders by cell.
    cells: HashMap<(i64, i64), Vec<u32>>,
}

/// Memory of questions.
#[derive(Debug, Default)]
pub(super) struct RoadBuffers {
    found: Vec<usize>,
    cuts: Vec<f64>,
    pieces: Vec<(f64, f64)>,
    open: Vec<(f64, f64)>,
    /// Lanelets that can be nearest to a point of the outline.
    near: Vec<usize>,
}

impl Road {
    /// The lanelets of some subtypes; `None` if there are none.
    pub(super) fn new(map: &Map, subtypes: &[String]) -> Option<Self> {
        let lanelets = OutlineIndex::of_lanelets(map, subtypes);
        if lanelets.outlines().is_empty() {
            return None;
        }
        let mut bounds = BoundsColumns::default();
        for outline in lanelets.outlines() {
            bounds.push(&around(outline.corners.iter().map(|&corner| at(corner))));
        }
        let borders = borders(&lanelets);
        let mut cells: HashMap<(i64, i64), Vec<u32>> = HashMap::new();
        for (place, border) in borders.iter().enumerate() {
            let bounds = around([border.start, border.end].into_iter());
            for_each_cell(&bounds, |cell| cells.entry(cell).or_default().push(place as u32));
        }
        Some(Self { lanelets, bounds, borders, cells })
    }

    /// How far a convex outline sticks out of the road; `None` if it does not.
    pub(super) fn excess(&self, outline: &[Point2], buffers: &mut RoadBuffers) -> Option<Excess> {
        let first = *outline.first()?;
        let bounds = around(outline.iter().copied());
        if !self.meets_border(outline, &bounds) && self.holds(first, buffers) {
            return None;
        }
        self.measured_excess(outline, &bounds, buffers)
    }

    fn holds(&self, point: Point2, buffers: &mut RoadBuffers) -> bool {
        self.lanelets.holding([point.x, point.y], &mut buffers.found);
        !buffers.found.is_empty()
    }

    fn meets_border(&self, outline: &[Point2], bounds: &Bounds) -> bool {
        let mut meets = false;
        for_each_cell(bounds, |cell| {
            let borders = self.cells.get(&cell).map_or(&[][..], Vec::as_slice);
            meets |= borders.iter().any(|&border| may_meet(outline, bounds, &self.borders[border as usize]));
        });
        meets
    }

    fn measured_excess(
        &self,
        outline: &[Point2],
        bounds: &Bounds,
        buffers: &mut RoadBuffers,
    ) -> Option<Excess> {
        self.find_near_lanelets(outline, bounds, buffers);
        let mut worst: Option<(f64, Point2)> = None;
        for (k, &start) in outline.iter().enumerate() {
            let side = Segment::new(start, outline[(k + 1) % outline.len()]);
            self.find_open_pieces(&side, bounds, buffers);
            for piece in 0..buffers.pieces.len() {
                let (from, to) = buffers.pieces[piece];
                let (distance_m, point) = self.farthest(&side, from, to, buffers);
                if worst.is_none_or(|(known_m, _)| distance_m > known_m) {
                    worst = Some((distance_m, point));
                }
            }
        }
        let (distance_m, point) = worst?;
        Some(Excess { distance_m, point, lanelet: self.nearest_lanelet(point, &buffers.near) })
    }

    /// No point of the outline is farther from the road than one corner is, and the way to that corner.
    fn find_near_lanelets(&self, outline: &[Point2], bounds: &Bounds, buffers: &mut RoadBuffers) {
        let all = 0..self.bounds.len();
        let corner = outline[0];
        let mut corner_m = f64::INFINITY;
        for place in all.clone() {
            if distance_from(&self.bounds.get(place), corner) < corner_m {
                corner_m = corner_m.min(self.distance_from_lanelet(place, corner));
            }
        }
        let reach = bounds.grown(corner_m + (bounds.max - bounds.min).norm());
        buffers.near.clear();
        buffers.near.extend(all.filter(|&place| self.bounds.get(place).meets(&reach)));
    }

    /// Finds the parts of a side, as ratios, that no lanelet holds.
    fn find_open_pieces(&self, side: &Segment, bounds: &Bounds, buffers: &mut RoadBuffers) {
        let RoadBuffers { cuts, pieces, near, .. } = buffers;
        cuts.clear();
        pieces.clear();
        cuts.extend([0.0, 1.0]);
        let near = near.iter().copied().filter(|&place| self.bounds.get(place).meets(bounds));
        for place in near.clone() {
            for edge in self.edges(place) {
                cuts.extend(cut_ratio(side, &edge));
            }
        }
        cuts.sort_unstable_by(f64::total_cmp);
        let shortest = PIECE_M / side.length().max(PIECE_M);
        for pair in cuts.windows(2) {
            let (from, to) = (pair[0], pair[1]);
            if to - from <= shortest {
                continue;
            }
            let middle = side.start + side.vector() * (0.5 * (from + to));
            if !near
                .clone()
                .any(|place| self.bounds.get(place).holds(middle) && self.lanelet_holds(place, middle))
            {
                pieces.push((from, to));
            }
        }
    }

    fn lanelet_holds(&self, place: usize, point: Point2) -> bool {
        let mut winding = 0;
        for edge in self.edges(place) {
            let side = edge.vector().perp(&(point - edge.start));
            if edge.start.y <= point.y {
                winding += i32::from(edge.end.y > point.y && side > 0.0);
            } else {
                winding -= i32::from(edge.end.y <= point.y && side < 0.0);
            }
        }
        winding != 0
    }

    fn edges(&self, place: usize) -> impl Iterator<Item = Segment> + '_ {
        edges(&self.lanelets.outlines()[place].corners)
    }

    /// Distance of a point from the road, and the edge that is nearest; 0 and no edge on the road.
    fn distance(&self, point: Point2, near: &[usize]) -> (f64, Option<Segment>) {
        let (mut nearest, mut squared) = (None, f64::INFINITY);
        for &place in near {
            let bounds = self.bounds.get(place);
            if distance_from(&bounds, point).powi(2) >= squared {
                continue;
            }
            if bounds.holds(point) && self.lanelet_holds(place, point) {
                return (0.0, None);
            }
            for edge in self.edges(place) {
                let to_edge = edge.squared_distance_to_point(point);
                if to_edge < squared {
                    (nearest, squared) = (Some(edge), to_edge);
                }
            }
        }
        (squared.sqrt(), nearest)
    }

    fn distance_from_lanelet(&self, place: usize, point: Point2) -> f64 {
        if self.lanelet_holds(place, point) {
            return 0.0;
        }
        self.edges(place)
            .map(|edge| edge.squared_distance_to_point(point))
            .fold(f64::INFINITY, f64::min)
            .sqrt()
    }

    fn nearest_lanelet(&self, point: Point2, near: &[usize]) -> Option<i64> {
        let near = near.iter().map(|&place| (self.distance_from_lanelet(place, point), place));
        let nearest = near.min_by(|a, b| a.0.total_cmp(&b.0))?;
        Some(self.lanelets.outlines()[nearest.1].id)
    }

    /// The point of a piece of a side that is farthest from the road.
    ///
    /// Two bounds end the search. The distance changes by no more than one goes along the side. And it is at most that
    /// from any one edge, which is convex along the side and therefore largest at one of the ends.
    fn farthest(&self, side: &Segment, from: f64, to: f64, buffers: &mut RoadBuffers) -> (f64, Point2) {
        let RoadBuffers { open, near, .. } = buffers;
        let length_m = side.length();
        let at = |ratio: f64| side.start + side.vector() * ratio;
        let mut best = (0.0, at(from));
        for ratio in [from, to] {
            let distance_m = self.distance(at(ratio), near).0;
            if distance_m > best.0 {
                best = (distance_m, at(ratio));
            }
        }
        open.clear();
        open.push((from, to));
        for _ in 0..MAX_STEPS {
            let Some((from, to)) = open.pop() else { break };
            let middle = 0.5 * (from + to);
            let (distance_m, edge) = self.distance(at(middle), near);
            if distance_m > best.0 {
                best = (distance_m, at(middle));
            }
            let nowhere_more_m = distance_m + 0.5 * (to - from) * length_m;
            let from_edge_m = edge.map_or(f64::INFINITY, |edge| {
                edge.distance_to_point(at(from)).max(edge.distance_to_point(at(to)))
            });
            if nowhere_more_m.min(from_edge_m) > best.0 + EXCESS_M {
                open.extend([(from, middle), (middle, to)]);
            }
        }
        best
    }
}

fn at([x, y]: [f64; 2]) -> Point2 {
    Point2::new(x, y)
}

fn edges(corners: &[[f64; 2]]) -> impl Iterator<Item = Segment> + '_ {
    (0..corners.len()).map(|k| Segment::new(at(corners[k]), at(corners[(k + 1) % corners.len()])))
}

fn around(points: impl Iterator<Item = Point2>) -> Bounds {
    points.fold(Bounds::EMPTY, |all, point| all.joined(&Bounds { min: point, max: point }))
}

fn distance_from(bounds: &Bounds, point: Point2) -> f64 {
    let dx = (bounds.min.x - point.x).max(point.x - bounds.max.x).max(0.0);
    let dy = (bounds.min.y - point.y).max(point.y - bounds.max.y).max(0.0);
    (dx * dx + dy * dy).sqrt()
}

fn for_each_cell(bounds: &Bounds, mut visit: impl FnMut((i64, i64))) {
    let cell = |value: f64| (value / CELL_M).floor() as i64;
    for x in cell(bounds.min.x)..=cell(bounds.max.x) {
        for y in cell(bounds.min.y)..=cell(bounds.max.y) {
            visit((x, y));
        }
    }
}

/// Outline edges that no other lanelet has in the other direction. Shared points have the very same coordinates.
fn borders(lanelets: &OutlineIndex) -> Vec<Segment> {
    let key = |edge: &Segment| {
        let bits = |point: Point2| (point.x.to_bits(), point.y.to_bits());
        (bits(edge.start), bits(edge.end))
    };
    let all = || {
        let outlines = lanelets.outlines().iter();
        outlines.flat_map(|outline| {
            // An outline that runs the other way round has its inside on the other side.
            let is_reversed = twice_signed_area(&outline.corners) > 0.0;
            edges(&outline.corners)
                .map(move |edge| if is_reversed { Segment::new(edge.end, edge.start) } else { edge })
        })
    };
    let mut count: HashMap<_, u32> = HashMap::new();
    for edge in all() {
        *count.entry(key(&edge)).or_default() += 1;
    }
    let mut found = Vec::new();
    let mut is_road = |point: Point2| {
        lanelets.holding([point.x, point.y], &mut found);
        !found.is_empty()
    };
    all()
        .filter(|edge| {
            let is_shared = count.contains_key(&key(&Segment::new(edge.end, edge.start)));
            // An outline that crosses itself has its inside on the wrong side here and there: see for oneself.
            let middle = edge.start + edge.vector() * 0.5;
            let aside = motion::Vector2::new(-edge.vector().y, edge.vector().x)
                * (BESIDE_M / edge.length().max(BESIDE_M));
            !(is_shared && is_road(middle + aside) && is_road(middle - aside))
        })
        .collect()
}

fn twice_signed_area(corners: &[[f64; 2]]) -> f64 {
    let Some(&first) = corners.first() else { return 0.0 };
    edges(corners).map(|edge| (edge.start - at(first)).perp(&(edge.end - at(first)))).sum()
}

/// False only if a segment has no point in common with a convex outline.
fn may_meet(outline: &[Point2], bounds: &Bounds, segment: &Segment) -> bool {
    if !around([segment.start, segment.end].into_iter()).meets(bounds) {
        return false;
    }
    motion::geometry::convex_overlap_within(outline, &[segment.start, segment.end], 0.0)
}

/// Where on a side an edge crosses or touches it.
fn cut_ratio(side: &Segment, edge: &Segment) -> Option<f64> {
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
