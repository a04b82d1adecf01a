//! Boxes by square cells of the plane: the cheapest answer to which boxes are near a small thing.

use motion::Point2;
use motion::occupancy::Bounds;
use std::ops::Range;

/// Side of the smallest cells \[m\]: about the length of a vehicle.
const CELL_M: f64 = 4.0;
/// Most cells, and most entries in them: cells are made larger until there are no more.
const MOST_CELLS: f64 = 1e6;
const MOST_ENTRIES: f64 = 8e6;

/// Items by the cells that their boxes reach into.
#[derive(Debug, Default)]
pub(super) struct CellGrid {
    min: Point2,
    cells_per_m: f64,
    columns: usize,
    rows: usize,
    /// Where the items of a cell begin; the last entry is the number of all.
    starts: Vec<u32>,
    items: Vec<u32>,
}

impl CellGrid {
    /// A grid whose item `i` has box `i`.
    pub(super) fn new(boxes: &[Bounds]) -> Self {
        if boxes.is_empty() {
            return Self::default();
        }
        let around = boxes.iter().fold(Bounds::EMPTY, |all, one| all.joined(one));
        let mut cell_m = CELL_M;
        let mut grid = Self::with_cells(&around, cell_m);
        // One cell for all is the end in any case.
        while grid.columns * grid.rows > 1 && !grid.is_small(boxes) {
            cell_m *= 2.0;
            grid = Self::with_cells(&around, cell_m);
        }
        grid.fill(boxes);
        grid
    }

    fn with_cells(around: &Bounds, cell_m: f64) -> Self {
        let count = |length_m: f64| ((length_m / cell_m) as usize).min(MOST_CELLS as usize) + 1;
        let extent = around.max - around.min;
        let (columns, rows) = (count(extent.x), count(extent.y));
        Self { min: around.min, cells_per_m: 1.0 / cell_m, columns, rows, ..Self::default() }
    }

    fn is_small(&self, boxes: &[Bounds]) -> bool {
        let entries = || boxes.iter().map(|one| self.columns_of(one).len() * self.rows_of(one).len());
        (self.columns * self.rows) as f64 <= MOST_CELLS
            && entries().map(|count| count as f64).sum::<f64>() <= MOST_ENTRIES.max(boxes.len() as f64)
    }

    fn fill(&mut self, boxes: &[Bounds]) {
        let mut starts = vec![0; self.columns * self.rows + 1];
        for one in boxes {
            self.for_each_cell(one, |cell| starts[cell + 1] += 1);
        }
        for cell in 1..starts.len() {
            starts[cell] += starts[cell - 1];
        }
        let mut next = starts.clone();
        let mut items = vec![0; starts.last().map_or(0, |&count| count as usize)];
        for (item, one) in (0..).zip(boxes) {
            self.for_each_cell(one, |cell| {
                items[next[cell] as usize] = item;
                next[cell] += 1;
            });
        }
        (self.starts, self.items) = (starts, items);
    }

    fn for_each_cell(&self, bounds: &Bounds, mut visit: impl FnMut(usize)) {
        for row in self.rows_of(bounds) {
            for column in self.columns_of(bounds) {
                visit(row * self.columns + column);
            }
        }
    }

    #[inline]
    fn columns_of(&self, bounds: &Bounds) -> Range<usize> {
        self.span(bounds.min.x - self.min.x, bounds.max.x - self.min.x, self.columns)
    }

    #[inline]
    fn rows_of(&self, bounds: &Bounds) -> Range<usize> {
        self.span(bounds.min.y - self.min.y, bounds.max.y - self.min.y, self.rows)
    }

    /// Cells between two offsets from the first one; none when all of it is beside the grid.
    #[inline]
    fn span(&self, from_m: f64, to_m: f64, count: usize) -> Range<usize> {
        // Casts saturate: what begins before the grid begins at 0.
        let at = |offset_m: f64| (offset_m * self.cells_per_m) as usize;
        let end = if to_m < 0.0 { 0 } else { at(to_m).saturating_add(1).min(count) };
        at(from_m).min(end)..end
    }

    /// True if `is_wanted` holds for any item near a box. Items are asked about cell by cell, one that reaches into
    /// several cells several times.
    #[inline]
    pub(super) fn any_near(&self, bounds: &Bounds, mut is_wanted: impl FnMut(u32) -> bool) -> bool {
        let columns = self.columns_of(bounds);
        self.rows_of(bounds).any(|row| {
            // The cells of a row lie side by side, and so do their items.
            let first = row * self.columns;
            let items =
                self.starts[first + columns.start] as usize..self.starts[first + columns.end] as usize;
            self.items[items].iter().any(|&item| is_wanted(item))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use motion::Vector2;

    fn square(x: f64, y: f64, side: f64) -> Bounds {
        let min = Point2::new(x, y);
        Bounds { min, max: min + Vector2::new(side, side) }
    }

    fn near(grid: &CellGrid, bounds: &Bounds) -> Vec<u32> {
        let mut found = Vec::new();
        grid.any_near(bounds, |item| {
            found.push(item);
            false
        });
        found
    }

    #[test]
    fn nothing_that_meets_is_left_out() {
        let boxes: Vec<Bounds> = (0..400)
            .map(|k| square(f64::from(k * 37 % 101) - 50.0, f64::from(k * 53 % 97), f64::from(k % 7)))
            .collect();
        let grid = CellGrid::new(&boxes);
        for wanted in [square(3.0, 4.0, 5.0), square(-80.0, 30.0, 40.0), square(-1e12, -1e12, 2e12)] {
            let near = near(&grid, &wanted);
            let meeting = (0..).zip(&boxes).filter(|(_, one)| one.meets(&wanted)).map(|(item, _)| item);
            for item in meeting {
                assert!(near.contains(&item), "{item}");
            }
        }
        for far in [square(1e3, 0.0, 5.0), square(0.0, -1e3, 5.0), square(-1e300, 0.0, 1.0)] {
            assert!(near(&grid, &far).is_empty(), "{far:?}");
        }
    }

    #[test]
    fn wide_maps_and_wide_boxes_stay_small() {
        let ends = [square(-1e12, -1e12, 1.0), square(1e12, 1e12, 1.0)];
        let grid = CellGrid::new(&ends);
        assert!(grid.starts.len() <= 2_000_000);
        assert_eq!(near(&grid, &ends[1]), [1]);
        let wide = vec![square(0.0, 0.0, 3000.0); 100];
        let grid = CellGrid::new(&wide);
        assert!(grid.items.len() <= 8_000_000, "{}", grid.items.len());
        assert!(near(&CellGrid::new(&[]), &ends[0]).is_empty());
        let unbounded =
            Bounds { min: Point2::new(f64::NEG_INFINITY, 0.0), max: Point2::new(f64::INFINITY, 1.0) };
        assert_eq!(near(&CellGrid::new(&[unbounded]), &square(7.0, 0.5, 1.0)), [0]);
    }
}
