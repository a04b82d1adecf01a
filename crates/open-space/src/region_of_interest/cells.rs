//! From occupied cells to few rectangles.

use motion::Point2;
use motion::geometry::AxisAlignedBox;
use std::ops::Range;

use super::{OccupancyGrid, RegionParameters};

/// More rectangles than this cost a planner too much time: cells are looked at in blocks then, each as occupied as any
/// cell of it.
const MAX_RECTANGLES: usize = 2_000;

/// Occupied cells within the box as closed polylines in the grid's frame.
pub(super) fn obstacles(
    parameters: &RegionParameters,
    grid: &OccupancyGrid<'_>,
    within: AxisAlignedBox,
) -> Vec<Vec<Point2>> {
    let range = |low_m: f64, high_m: f64, count: usize| {
        let first = (low_m / grid.resolution_m).floor().clamp(0.0, count as f64) as usize;
        let last = (high_m / grid.resolution_m).ceil().clamp(0.0, count as f64) as usize;
        first..last.max(first)
    };
    let window = Window {
        parameters,
        grid,
        columns: range(within.min.x, within.max.x, grid.columns),
        rows: range(within.min.y, within.max.y, grid.rows()),
    };
    let mut side = 1;
    loop {
        // One block holds all cells at last, so this ends.
        if let Some(rectangles) = window.rectangles(side) {
            return rectangles.into_iter().map(|rectangle| rectangle.outline(grid.resolution_m)).collect();
        }
        side *= 2;
    }
}

struct Window<'a> {
    parameters: &'a RegionParameters,
    grid: &'a OccupancyGrid<'a>,
    columns: Range<usize>,
    rows: Range<usize>,
}

/// Cells from and up to, excluding the latter.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Cells {
    columns: Range<usize>,
    rows: Range<usize>,
}

impl Cells {
    fn outline(&self, resolution_m: f64) -> Vec<Point2> {
        let at =
            |column: usize, row: usize| Point2::new(column as f64 * resolution_m, row as f64 * resolution_m);
        let (columns, rows) = (&self.columns, &self.rows);
        let first = at(columns.start, rows.start);
        vec![
            first,
            at(columns.end, rows.start),
            at(columns.end, rows.end),
            at(columns.start, rows.end),
            first,
        ]
    }
}

impl Window<'_> {
    /// Rectangles that cover the occupied blocks of `side` by `side` cells and no other; `None` if they are too many.
    fn rectangles(&self, side: usize) -> Option<Vec<Cells>> {
        let (mut done, mut open) = (Vec::new(), Vec::<Cells>::new());
        for first in self.rows.clone().step_by(side) {
            let rows = first..(first + side).min(self.rows.end);
            let mut next = Vec::new();
            for columns in self.runs(&rows, side) {
                // One that ends here and is as wide goes on.
                match open.iter().position(|above| above.columns == columns) {
                    Some(above) => {
                        let mut grown = open.swap_remove(above);
                        grown.rows.end = rows.end;
                        next.push(grown);
                    }
                    None => next.push(Cells { columns, rows: rows.clone() }),
                }
            }
            done.append(&mut open);
            open = next;
            if done.len() + open.len() > MAX_RECTANGLES {
                return None;
            }
        }
        done.append(&mut open);
        Some(done)
    }

    /// Occupied blocks of a row that lie side by side.
    fn runs(&self, rows: &Range<usize>, side: usize) -> Vec<Range<usize>> {
        let mut runs: Vec<Range<usize>> = Vec::new();
        for first in self.columns.clone().step_by(side) {
            let columns = first..(first + side).min(self.columns.end);
            if !self.has_occupied(rows, &columns) {
                continue;
            }
            match runs.last_mut().filter(|run| run.end == columns.start) {
                Some(run) => run.end = columns.end,
                None => runs.push(columns),
            }
        }
        runs
    }

    fn has_occupied(&self, rows: &Range<usize>, columns: &Range<usize>) -> bool {
        rows.clone().any(|row| {
            let begin = row * self.grid.columns;
            self.grid.cells[begin + columns.start..begin + columns.end]
                .iter()
                .any(|&value| is_occupied(self.parameters, value))
        })
    }
}

/// Whether a cell of this value is an obstacle.
pub(super) fn is_occupied(parameters: &RegionParameters, value: i8) -> bool {
    // Negative values are those of nobody's knowledge.
    u32::try_from(value).map_or(parameters.unknown_is_occupied, |value| value >= parameters.occupied_from)
}
