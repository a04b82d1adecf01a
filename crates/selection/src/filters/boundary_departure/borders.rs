//! The borders of a map that must not be crossed, and which of them can be among the five nearest to a place.
//!
//! [`Borders`] is made once for a map. [`Neighbourhoods`] is a memo on top of it: the plane is cut into square cells,
//! and a cell's neighbourhood holds every segment that is one of the five nearest to any place of the cell. So a
//! question costs a few distances instead of a search in a tree. What a memo answers does not depend on what it was
//! asked before.

use std::sync::Arc;

use lanelet_map::Map;
use lanelet_map::index::{NearSegment, SegmentIndex};
use motion::{Point2, Segment};

use super::tolerance::{FARTHEST_M, ROUNDING_M};

/// Segments that are asked for at each front corner (`max_lateral_rtree_queries`).
pub(super) const NEAREST: usize = 5;

/// Side of a cell. Larger cells have longer neighbourhoods, smaller ones are made more often.
const CELL_M: f64 = 1.0;
/// Half the diagonal of a cell.
const CELL_RADIUS_M: f64 = CELL_M * std::f64::consts::SQRT_2 / 2.0;
/// Cells along each side of the window that a memo can hold at once: 128 m.
const WINDOW: usize = 128;
/// Cells are counted from so far below that all their numbers are positive: truncation rounds down there.
const ORIGIN_M: f64 = 1e9;
/// Longest neighbourhood that is kept; longer ones are searched for each time.
const LONGEST: usize = 128;

/// Segments of all line strings of the configured types, in the order of (line string id, index).
#[derive(Debug)]
pub(crate) struct Borders {
    index: SegmentIndex,
    lines: Vec<Segment>,
}

impl Borders {
    /// The borders of a map whose `type` is one of `types`. `None` if one of them is so far out that distances from it
    /// mean nothing.
    pub(super) fn new(map: &Map, types: &[String]) -> Option<Self> {
        let index = SegmentIndex::new(map, types);
        let planar = |[x, y, _]: [f64; 3]| Point2::new(x, y);
        let lines: Vec<Segment> =
            index.segments().iter().map(|s| Segment::new(planar(s.start), planar(s.end))).collect();
        let is_on_map = |point: Point2| point.x.abs() < FARTHEST_M && point.y.abs() < FARTHEST_M;
        lines.iter().all(|line| is_on_map(line.start) && is_on_map(line.end)).then_some(Self { index, lines })
    }

    /// Every segment that can be among the [`NEAREST`] nearest to a place within `radius_m` of `middle`: for such a place
    /// the fifth nearest is at most `radius_m` farther than it is from the middle, and no segment is nearer by more.
    fn nearest_within(&self, middle: [f64; 2], radius_m: f64, found: &mut Vec<NearSegment>) {
        self.index.nearest(middle, NEAREST, found);
        if let (Some(farthest), true) = (found.last(), self.len() > NEAREST) {
            let reach_m = farthest.distance + 2.0 * (radius_m + ROUNDING_M);
            self.index.near(middle, reach_m, found);
        }
    }

    /// Number of segments.
    pub(super) fn len(&self) -> usize {
        self.lines.len()
    }

    /// A segment seen from above.
    #[inline]
    pub(super) fn line(&self, border: u32) -> &Segment {
        &self.lines[border as usize]
    }

    /// Id of the line string that a segment belongs to.
    pub(super) fn line_string(&self, border: u32) -> i64 {
        self.index.segments()[border as usize].line_string
    }

    /// True if the segment continues the one before it in the order of segments.
    #[inline]
    pub(super) fn continues(&self, border: u32) -> bool {
        self.index.segments()[border as usize].index > 0
    }

    /// True if an end of the segment is less than a vehicle's height above or below the ground at `z_m`.
    #[inline]
    pub(super) fn is_at_height(&self, border: u32, z_m: f64, vehicle_height_m: f64) -> bool {
        let segment = &self.index.segments()[border as usize];
        (segment.start[2] - z_m).abs().min((segment.end[2] - z_m).abs()) < vehicle_height_m
    }
}

/// Neighbourhoods of cells that were asked for lately.
#[derive(Debug, Default)]
pub(super) struct Neighbourhoods {
    /// What the slots were made from; holding it keeps its address from being used again.
    made_from: Option<Arc<Borders>>,
    /// A torus of `WINDOW` by `WINDOW` cells.
    slots: Vec<Slot>,
    found: Vec<NearSegment>,
    nearest: Vec<Near>,
}

/// The neighbourhood of a cell.
#[derive(Debug, Clone, Default)]
struct Slot {
    cell: Option<[i32; 2]>,
    /// Empty if there are too many.
    borders: Vec<Near>,
}

/// A segment of a neighbourhood.
#[derive(Debug, Clone, Copy)]
pub(super) struct Near {
    pub(super) border: u32,
    from_middle_m: f64,
}

impl From<&NearSegment> for Near {
    fn from(near: &NearSegment) -> Self {
        Self { border: near.segment as u32, from_middle_m: near.distance }
    }
}

/// Segments among which the nearest to a place are.
#[derive(Debug, Clone, Copy)]
pub(super) struct Neighbourhood<'a> {
    /// In the order of their distances from the middle of the neighbourhood.
    pub(super) borders: &'a [Near],
    /// How far the place is from the middle.
    off_middle_m: f64,
}

impl Neighbourhood<'_> {
    /// The [`NEAREST`] nearest are among these; no distance need be measured to know it: five segments are this near to
    /// the middle, and neither they nor any other can be farther off or nearer to the place than to the middle by more
    /// than the way between them.
    #[inline]
    pub(super) fn possibly_nearest(&self) -> impl Iterator<Item = &Near> {
        let fifth_m = self.borders.get(NEAREST - 1).map_or(f64::INFINITY, |near| near.from_middle_m);
        let limit_m = self.limit_m(fifth_m + self.off_middle_m);
        self.borders.iter().take_while(move |near| !near.is_beyond(limit_m))
    }

    /// Distance from the middle beyond which no segment is within `distance_m` of the place.
    #[inline]
    pub(super) fn limit_m(&self, distance_m: f64) -> f64 {
        distance_m + self.off_middle_m + ROUNDING_M
    }
}

impl Near {
    #[inline]
    pub(super) fn is_beyond(&self, limit_m: f64) -> bool {
        self.from_middle_m > limit_m
    }
}

impl Neighbourhoods {
    /// Makes this a memo of these borders.
    pub(super) fn attach(&mut self, borders: &Arc<Borders>) {
        if self.made_from.as_ref().is_none_or(|old| !Arc::ptr_eq(old, borders)) {
            self.slots.clear();
            self.slots.resize(WINDOW * WINDOW, Slot::default());
            self.made_from = Some(Arc::clone(borders));
        }
    }

    /// Segments among which the [`NEAREST`] nearest to `place` are; all of them if there are not more. The coordinates
    /// of `place` must be within [`FARTHEST_M`](super::tolerance::FARTHEST_M).
    #[inline]
    pub(super) fn around(&mut self, borders: &Borders, place: Point2) -> Neighbourhood<'_> {
        let cell = [cell_of(place.x), cell_of(place.y)];
        let wrap = |at: i32| at as usize % WINDOW;
        let at = wrap(cell[0]) * WINDOW + wrap(cell[1]);
        if self.slots[at].cell != Some(cell) {
            self.fill(borders, cell, at);
        }
        if self.slots[at].borders.is_empty() {
            return self.search(borders, place);
        }
        let middle = middle_of(cell);
        let off_middle_m = (place - Point2::from(middle)).norm();
        Neighbourhood { borders: &self.slots[at].borders, off_middle_m }
    }

    /// Everything that can be among the nearest somewhere in the cell.
    #[cold]
    fn fill(&mut self, borders: &Borders, cell: [i32; 2], at: usize) {
        borders.nearest_within(middle_of(cell), CELL_RADIUS_M, &mut self.found);
        let slot = &mut self.slots[at];
        slot.cell = Some(cell);
        slot.borders.clear();
        if self.found.len() <= LONGEST {
            slot.borders.extend(self.found.iter().map(Near::from));
        }
    }

    #[cold]
    fn search(&mut self, borders: &Borders, place: Point2) -> Neighbourhood<'_> {
        borders.nearest_within([place.x, place.y], 0.0, &mut self.found);
        self.nearest.clear();
        self.nearest.extend(self.found.iter().map(Near::from));
        Neighbourhood { borders: &self.nearest, off_middle_m: 0.0 }
    }
}

fn middle_of(cell: [i32; 2]) -> [f64; 2] {
    cell.map(|at| (f64::from(at) + 0.5) * CELL_M - ORIGIN_M)
}

/// Number of the cell that a coordinate lies in, to within rounding.
#[inline]
fn cell_of(coordinate_m: f64) -> i32 {
    ((coordinate_m + ORIGIN_M) * (1.0 / CELL_M)) as i32
}
