//! How far a point still has to go to a place, round the obstacles: a lower bound of the search's cost that knows dead
//! ends, but neither headings nor gears.
//!
//! Dijkstra from the target over a square lattice aligned to it. Lattice points closer to an obstacle than a radius
//! that the vehicle keeps in any case, or out of bounds, are blocked. All distances are metres.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use motion::Point2;

use crate::collision::CollisionChecker;
use crate::interruption::Patience;

/// Lattice points beyond which the lattice is made coarser.
const MAX_POINTS: usize = 1_000_000;

/// Lattice points looked at between two questions whether to go on: a millisecond.
const BETWEEN_QUESTIONS: usize = 10_000;

/// Distances to one target.
#[derive(Clone, Debug)]
pub struct GridHeuristic {
    /// The lattice point at column 0, row 0.
    low: Point2,
    resolution_m: f64,
    columns: usize,
    rows: usize,
    /// Infinite where there is no way.
    distances_m: Vec<f32>,
}

/// A lattice point in the queue; the order is that of the distance, then of the index.
type Entry = Reverse<(OrderedDistance, usize)>;

#[derive(Clone, Copy, PartialEq)]
struct OrderedDistance(f64);

impl Eq for OrderedDistance {}

impl PartialOrd for OrderedDistance {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for OrderedDistance {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.0.total_cmp(&other.0)
    }
}

impl GridHeuristic {
    /// Distances to `target` within the bounds of `checker`, over points that keep `radius_m` from its obstacles, on a
    /// lattice of `resolution_m` (positive) or a multiple where the bounds are immense.
    ///
    /// `patience` is asked now and then; once it ends what has no distance yet counts as out of reach.
    #[must_use]
    pub fn new(
        checker: &CollisionChecker,
        target: Point2,
        resolution_m: f64,
        radius_m: f64,
        patience: &mut dyn Patience,
    ) -> Self {
        let [x_min, x_max, y_min, y_max] = checker.bounds();
        let mut resolution_m = resolution_m;
        loop {
            let steps = |from: f64, to: f64| ((to - from) / resolution_m + 1e-9).floor().max(0.0);
            let (left, right) = (steps(x_min, target.x), steps(target.x, x_max));
            let (below, above) = (steps(y_min, target.y), steps(target.y, y_max));
            if (left + right + 1.0) * (below + above + 1.0) > MAX_POINTS as f64 {
                resolution_m *= 2.0;
                continue;
            }
            let low = Point2::new(target.x - left * resolution_m, target.y - below * resolution_m);
            let (columns, rows) = ((left + right) as usize + 1, (below + above) as usize + 1);
            let distances_m = vec![f32::INFINITY; columns * rows];
            let mut grid = Self { low, resolution_m, columns, rows, distances_m };
            grid.spread(checker, below as usize * columns + left as usize, radius_m, patience);
            return grid;
        }
    }

    /// Way to the target from the lattice point nearest to `point`, m; infinite where there is none or it is not on
    /// the lattice.
    #[must_use]
    #[inline]
    pub fn distance_m(&self, point: Point2) -> f64 {
        let (x, y) = ((point.x - self.low.x) / self.resolution_m, (point.y - self.low.y) / self.resolution_m);
        // Up to half a cell outside is nearest to a point on the border.
        let (column, row) = (x.round(), y.round());
        if column >= 0.0 && row >= 0.0 && column < self.columns as f64 && row < self.rows as f64 {
            f64::from(self.distances_m[row as usize * self.columns + column as usize])
        } else {
            f64::INFINITY
        }
    }

    /// Dijkstra from `target`.
    fn spread(
        &mut self,
        checker: &CollisionChecker,
        target: usize,
        radius_m: f64,
        patience: &mut dyn Patience,
    ) {
        let mut steps = 0;
        let mut ends = || {
            steps += 1;
            steps % BETWEEN_QUESTIONS == 0 && patience.ends()
        };
        let blocked: Vec<bool> = (0..self.distances_m.len())
            .map_while(|at| {
                if ends() {
                    return None;
                }
                let (row, column) = (at / self.columns, at % self.columns);
                let x = self.low.x + column as f64 * self.resolution_m;
                let y = self.low.y + row as f64 * self.resolution_m;
                Some(!checker.has_room(Point2::new(x, y), radius_m))
            })
            .collect();
        if blocked.len() < self.distances_m.len() {
            return;
        }
        let mut distances = vec![f64::INFINITY; self.distances_m.len()];
        let mut queue: BinaryHeap<Entry> = BinaryHeap::new();
        distances[target] = 0.0;
        queue.push(Reverse((OrderedDistance(0.0), target)));
        while let Some(Reverse((OrderedDistance(distance), at))) = queue.pop() {
            if distance > distances[at] {
                continue;
            }
            if ends() {
                break;
            }
            for (neighbour, step_m) in self.neighbours(at) {
                let total = distance + step_m;
                if !blocked[neighbour] && total < distances[neighbour] {
                    distances[neighbour] = total;
                    queue.push(Reverse((OrderedDistance(total), neighbour)));
                }
            }
        }
        self.distances_m = distances.into_iter().map(|distance| distance as f32).collect();
    }

    /// The eight neighbours of a lattice point that are on the lattice, and the way there, m.
    fn neighbours(&self, at: usize) -> impl Iterator<Item = (usize, f64)> + use<> {
        let (columns, rows, resolution_m) = (self.columns as isize, self.rows as isize, self.resolution_m);
        let (row, column) = ((at / self.columns) as isize, (at % self.columns) as isize);
        const STEPS: [(isize, isize); 8] =
            [(-1, -1), (-1, 0), (-1, 1), (0, -1), (0, 1), (1, -1), (1, 0), (1, 1)];
        STEPS.into_iter().filter_map(move |(up, right)| {
            let (row, column) = (row + up, column + right);
            let inside = row >= 0 && row < rows && column >= 0 && column < columns;
            let step_m = if up != 0 && right != 0 { std::f64::consts::SQRT_2 } else { 1.0 } * resolution_m;
            inside.then_some(((row * columns + column) as usize, step_m))
        })
    }
}

#[cfg(test)]
mod tests {
    use motion::VehicleInfo;
    use proptest::prelude::*;

    use super::*;
    use crate::pose::PlanarPose;
    use crate::problem::{Limits, Problem};

    fn distances(checker: &CollisionChecker, target: Point2, radius_m: f64) -> GridHeuristic {
        GridHeuristic::new(checker, target, 0.25, radius_m, &mut || false)
    }

    fn checker(bounds: [f64; 4], obstacles: &[&[(f64, f64)]]) -> CollisionChecker {
        let line = |points: &&[(f64, f64)]| points.iter().map(|&(x, y)| Point2::new(x, y)).collect();
        CollisionChecker::new(&Problem {
            vehicle: VehicleInfo::default(),
            limits: Limits::default(),
            bounds,
            obstacles: obstacles.iter().map(line).collect(),
            start: PlanarPose::default(),
            start_speed_mps: 0.0,
            start_acceleration_mps2: 0.0,
            start_curvature: None,
            goal: PlanarPose::default(),
        })
        .unwrap()
    }

    #[test]
    fn without_obstacles_it_is_the_octile_distance_within_bounds() {
        let checker = checker([-3.0, 10.0, -4.0, 6.0], &[]);
        let target = Point2::new(1.3, 0.7);
        let grid = distances(&checker, target, 0.5);
        for (dx, dy) in [(0.0_f64, 0.0_f64), (4.0, 0.0), (-4.0, -2.0), (3.0, 5.0), (8.5, -4.5)] {
            let (long, short) = (dx.abs().max(dy.abs()), dx.abs().min(dy.abs()));
            let expected = long - short + short * std::f64::consts::SQRT_2;
            let actual = grid.distance_m(Point2::new(target.x + dx, target.y + dy));
            assert!((actual - expected).abs() < 1e-5, "({dx}, {dy}): {actual} instead of {expected}");
        }
        // a target off the lattice origin keeps whole steps: bounds cut the lattice, they do not shift it
        assert_eq!(grid.distance_m(target), 0.0);
        assert!(grid.distance_m(Point2::new(10.2, 0.0)).is_infinite());
        assert!(grid.distance_m(Point2::new(0.0, -4.3)).is_infinite());
        assert!(grid.distance_m(Point2::new(f64::NAN, 0.0)).is_infinite());
    }

    #[test]
    fn the_way_leads_round_a_wall() {
        // A wall from below up to y = 3: round its end, at half a metre.
        let checker = checker([-10.0, 10.0, -5.0, 6.0], &[&[(0.0, -9.0), (0.0, 3.0)]]);
        let grid = distances(&checker, Point2::new(4.0, 0.0), 0.5);
        let way = grid.distance_m(Point2::new(-4.0, 0.0));
        assert!(way > 2.0 * 4.0_f64.hypot(3.5) - 0.5 && way < 12.5, "{way}");
        assert!((grid.distance_m(Point2::new(4.0, 3.0)) - 3.0).abs() < 1e-5);
        assert!(grid.distance_m(Point2::new(0.25, 0.0)).is_infinite(), "too near the wall");
    }

    #[test]
    fn what_is_walled_off_is_infinitely_far() {
        let ring: &[(f64, f64)] = &[(-2.0, -2.0), (2.0, -2.0), (2.0, 2.0), (-2.0, 2.0), (-2.0, -2.0)];
        let outside = distances(&checker([-9.0, 9.0, -9.0, 9.0], &[ring]), Point2::new(5.0, 5.0), 0.5);
        assert!(outside.distance_m(Point2::new(-5.0, -5.0)).is_finite());
        assert!(outside.distance_m(Point2::origin()).is_infinite(), "inside a solid");
    }

    #[test]
    fn immense_bounds_give_a_coarse_lattice() {
        let grid = distances(&checker([-1e5, 1e5, -1e5, 1e5], &[]), Point2::origin(), 0.5);
        assert!(grid.distances_m.len() <= MAX_POINTS);
        assert!((grid.distance_m(Point2::new(5e4, 0.0)) - 5e4).abs() < grid.resolution_m);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        /// Every lattice point has the distance of its best neighbour plus the step: what Dijkstra promises.
        #[test]
        fn distances_are_settled(
            posts in prop::collection::vec((-6.0..6.0_f64, -6.0..6.0_f64), 0..12),
            x in -5.0..5.0_f64, y in -5.0..5.0_f64,
        ) {
            let lines: Vec<Vec<(f64, f64)>> = posts.iter().map(|&p| vec![p]).collect();
            let lines: Vec<&[(f64, f64)]> = lines.iter().map(Vec::as_slice).collect();
            let grid = distances(&checker([-7.0, 7.0, -6.5, 6.0], &lines), Point2::new(x, y), 0.8);
            let at = |k: usize| f64::from(grid.distances_m[k]);
            for k in 0..grid.distances_m.len() {
                let best = grid.neighbours(k).map(|(n, step)| at(n) + step).fold(f64::INFINITY, f64::min);
                if at(k).is_finite() && at(k) > 0.0 {
                    prop_assert!((at(k) - best).abs() < 1e-4, "{} instead of {}", at(k), best);
                }
                let place = Point2::new(
                    grid.low.x + (k % grid.columns) as f64 * grid.resolution_m,
                    grid.low.y + (k / grid.columns) as f64 * grid.resolution_m,
                );
                let room = posts.iter().map(|p| (p.0 - place.x).hypot(p.1 - place.y)).fold(f64::INFINITY, f64::min);
                if at(k) > 0.0 {
                    // blocked is what is near a post, and only that
                    prop_assert!(at(k).is_infinite() || room >= 0.8 - 1e-9);
                    prop_assert!(at(k).is_finite() || room <= 0.8 + 1e-9 || best.is_infinite());
                }
            }
        }
    }
}
