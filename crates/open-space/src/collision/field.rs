//! Obstacle segments in buckets, and a field of the room about every point.

use motion::Point2;
use motion::geometry::{Segment, polygon_contains};

use super::ObstacleError;
use crate::interruption::Patience;
use crate::tolerance::MAX_COORDINATE_M;

/// More segments than this are refused.
const MAX_SEGMENTS: usize = 100_000;
/// Entries of all buckets together beyond which buckets are made larger.
const MAX_ENTRIES: usize = 4_000_000;
/// Buckets beyond which they are made larger.
const MAX_BUCKETS: usize = 100_000;
/// Cells of the field beyond which they are made larger.
const MAX_CELLS: usize = 1_000_000;
/// Side of a bucket, m.
const BUCKET_M: f64 = 1.0;
/// Side of a cell of the field, m.
const CELL_M: f64 = 0.1;
/// Cells and distances to segments looked at between two questions whether to go on: a millisecond.
const BETWEEN_QUESTIONS: usize = 200_000;
/// How much further than the footprint's radius a bucket looks: room for a sweep and its inflation, m.
const EXTRA_REACH_M: f64 = 0.7;

/// Square cells over a rectangle.
#[derive(Clone, Debug)]
struct Grid {
    low: Point2,
    cell_m: f64,
    columns: usize,
    rows: usize,
}

impl Grid {
    /// Cells of `cell_m`, or larger so that there are at most `max_cells`.
    fn new(low: Point2, high: Point2, cell_m: f64, max_cells: usize) -> Self {
        let (width, height) = (high.x - low.x, high.y - low.y);
        let mut cell_m = cell_m;
        loop {
            let (columns, rows) = ((width / cell_m).ceil().max(1.0), (height / cell_m).ceil().max(1.0));
            if columns * rows <= max_cells as f64 {
                return Self { low, cell_m, columns: columns as usize, rows: rows as usize };
            }
            cell_m *= 2.0;
        }
    }

    fn len(&self) -> usize {
        self.columns * self.rows
    }

    fn center(&self, column: usize, row: usize) -> Point2 {
        let at = |k: usize| (k as f64 + 0.5) * self.cell_m;
        Point2::new(self.low.x + at(column), self.low.y + at(row))
    }

    fn half_diagonal_m(&self) -> f64 {
        self.cell_m * std::f64::consts::FRAC_1_SQRT_2
    }

    /// The cell that holds `point`, if it is in the rectangle.
    #[inline]
    fn index(&self, point: Point2) -> Option<usize> {
        let (x, y) = ((point.x - self.low.x) / self.cell_m, (point.y - self.low.y) / self.cell_m);
        (x >= 0.0 && y >= 0.0 && x < self.columns as f64 && y < self.rows as f64)
            .then(|| y as usize * self.columns + x as usize)
    }

    /// Columns and rows whose centres may lie within `reach_m` of the box round `points`.
    fn cells_near(&self, points: &[Point2], reach_m: f64) -> impl Iterator<Item = (usize, usize)> + use<> {
        let range = |low: f64, high: f64, origin: f64, count: usize| {
            let first = ((low - reach_m - origin) / self.cell_m).floor().max(0.0) as usize;
            let last = ((high + reach_m - origin) / self.cell_m).ceil().clamp(0.0, count as f64) as usize;
            first..last
        };
        let low = points.iter().fold(Point2::new(f64::INFINITY, f64::INFINITY), |a, b| a.inf(b));
        let high = points.iter().fold(Point2::new(f64::NEG_INFINITY, f64::NEG_INFINITY), |a, b| a.sup(b));
        let columns = range(low.x, high.x, self.low.x, self.columns);
        range(low.y, high.y, self.low.y, self.rows)
            .flat_map(move |row| columns.clone().map(move |column| (column, row)))
    }
}

/// The obstacles of a problem, ready to be looked up by place.
#[derive(Clone, Debug)]
pub(super) struct ObstacleField {
    segments: Vec<Segment>,
    solids: Vec<Vec<Point2>>,
    all: Vec<u32>,
    buckets: Grid,
    /// Where each bucket begins in `entries`; one more than buckets.
    begins: Vec<u32>,
    /// Segments within `reach_m` of any point of the bucket.
    entries: Vec<u32>,
    reach_m: f64,
    cells: Grid,
    /// Distance from any point of a cell to the nearest obstacle is at least this, m.
    room_m: Vec<f32>,
}

impl ObstacleField {
    /// Takes in `obstacles` for footprints whose middle is within `margin_m` of `bounds`. Once `patience` ends, there is
    /// no room in what has not been looked at.
    pub(super) fn new(
        bounds: [f64; 4],
        margin_m: f64,
        radius_m: f64,
        obstacles: &[Vec<Point2>],
        patience: &mut dyn Patience,
    ) -> Result<Self, ObstacleError> {
        check(obstacles)?;
        let (mut segments, mut solids) = (Vec::new(), Vec::new());
        for line in obstacles {
            match line.as_slice() {
                [] => {}
                [point] => segments.push(Segment::new(*point, *point)),
                [first, .., last] => {
                    segments.extend(line.windows(2).map(|pair| Segment::new(pair[0], pair[1])));
                    if line.len() > 3 && first == last {
                        solids.push(line[1..].to_vec());
                    }
                }
            }
        }
        let [x_min, x_max, y_min, y_max] = bounds;
        let low = Point2::new(x_min - margin_m, y_min - margin_m);
        let high = Point2::new(x_max + margin_m, y_max + margin_m);
        let reach_m = radius_m + EXTRA_REACH_M;
        let (buckets, begins, entries) = fill_buckets(low, high, &segments, reach_m);
        let cells = Grid::new(low, high, CELL_M, MAX_CELLS);
        let all = (0..segments.len() as u32).collect();
        let mut field =
            Self { segments, solids, all, buckets, begins, entries, reach_m, cells, room_m: Vec::new() };
        field.room_m = field.measure(patience);
        Ok(field)
    }

    /// [`near`](Self::near) looks no further than this, m.
    pub(super) fn reach_m(&self) -> f64 {
        self.reach_m
    }

    pub(super) fn segment(&self, id: u32) -> &Segment {
        &self.segments[id as usize]
    }

    /// Every segment.
    pub(super) fn all(&self) -> &[u32] {
        &self.all
    }

    /// At least the segments within `radius_m` of `point`.
    #[inline]
    pub(super) fn near(&self, point: Point2, radius_m: f64) -> &[u32] {
        match self.buckets.index(point) {
            Some(at) if radius_m <= self.reach_m => self.bucket(at),
            _ => &self.all,
        }
    }

    /// Distance from `point` to the nearest obstacle or less; 0 within solids and far out of bounds.
    #[inline]
    pub(super) fn room_m(&self, point: Point2) -> f64 {
        self.cells.index(point).map_or(0.0, |at| f64::from(self.room_m[at]))
    }

    /// Whether `point` lies in a solid polygon or on its border.
    pub(super) fn is_solid(&self, point: Point2) -> bool {
        self.room_m(point) <= 0.0 && self.solids.iter().any(|solid| polygon_contains(solid, point))
    }

    fn bucket(&self, at: usize) -> &[u32] {
        &self.entries[self.begins[at] as usize..self.begins[at + 1] as usize]
    }

    /// The room in every cell.
    fn measure(&self, patience: &mut dyn Patience) -> Vec<f32> {
        let half_diagonal = self.cells.half_diagonal_m();
        let mut room_m = Vec::with_capacity(self.cells.len());
        let mut looked = 0;
        for row in 0..self.cells.rows {
            for column in 0..self.cells.columns {
                if looked > BETWEEN_QUESTIONS {
                    looked = 0;
                    if patience.ends() {
                        room_m.resize(self.cells.len(), 0.0);
                        return room_m;
                    }
                }
                let center = self.cells.center(column, row);
                let near = self.near(center, self.reach_m);
                looked += 1 + near.len();
                let squared = near.iter().fold(f64::INFINITY, |best, &id| {
                    best.min(self.segment(id).squared_distance_to_point(center))
                });
                // A float is rounded by less than a millionth of itself.
                let room = (squared.sqrt().min(self.reach_m) - half_diagonal) * (1.0 - 1e-6);
                room_m.push(room.max(0.0) as f32);
            }
        }
        for solid in &self.solids {
            for (column, row) in self.cells.cells_near(solid, 0.0) {
                if polygon_contains(solid, self.cells.center(column, row)) {
                    room_m[row * self.cells.columns + column] = 0.0;
                }
            }
        }
        room_m
    }
}

fn check(obstacles: &[Vec<Point2>]) -> Result<(), ObstacleError> {
    let segments = obstacles.iter().map(|line| line.len().saturating_sub(1).max(1)).sum();
    if segments > MAX_SEGMENTS {
        return Err(ObstacleError::TooMany { segments, limit: MAX_SEGMENTS });
    }
    for (obstacle, line) in obstacles.iter().enumerate() {
        if let Some((vertex, p)) = line
            .iter()
            .enumerate()
            .find(|(_, p)| !(p.x.abs() <= MAX_COORDINATE_M && p.y.abs() <= MAX_COORDINATE_M))
        {
            return Err(ObstacleError::Vertex { obstacle, vertex, x: p.x, y: p.y });
        }
    }
    Ok(())
}

/// Lists the segments within `reach_m` of any point of each bucket.
fn fill_buckets(low: Point2, high: Point2, segments: &[Segment], reach_m: f64) -> (Grid, Vec<u32>, Vec<u32>) {
    let mut side_m = BUCKET_M;
    loop {
        let grid = Grid::new(low, high, side_m, MAX_BUCKETS);
        let reach = reach_m + grid.half_diagonal_m();
        let buckets_near = |segment: &Segment| {
            let segment = *segment;
            let grid = &grid;
            grid.cells_near(&[segment.start, segment.end], reach).filter_map(move |(column, row)| {
                let squared = segment.squared_distance_to_point(grid.center(column, row));
                (squared <= reach * reach).then_some(row * grid.columns + column)
            })
        };
        let mut begins = vec![0_u32; grid.len() + 1];
        let mut total = 0;
        for segment in segments {
            for at in buckets_near(segment) {
                begins[at + 1] += 1;
                total += 1;
            }
            if total > MAX_ENTRIES {
                break;
            }
        }
        // One bucket lists each segment once, so this ends.
        if total > MAX_ENTRIES {
            side_m *= 2.0;
            continue;
        }
        for at in 1..begins.len() {
            begins[at] += begins[at - 1];
        }
        let mut next = begins.clone();
        let mut entries = vec![0_u32; total];
        for (id, segment) in segments.iter().enumerate() {
            for at in buckets_near(segment) {
                entries[next[at] as usize] = id as u32;
                next[at] += 1;
            }
        }
        return (grid, begins, entries);
    }
}
