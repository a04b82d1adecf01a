//! A packed tree over boxes: arranged once, then flat arrays without pointers.
//!
//! Node `i` of a level is the box around the boxes from `FAN_OUT * i` on of the level below. What a question finds does
//! not depend on the arrangement, only how long it takes.

use motion::Point2;
use motion::occupancy::Bounds;

/// Boxes below one node.
const FAN_OUT: usize = 4;

/// The tree.
#[derive(Debug)]
pub(super) struct BoxTree {
    /// Item of each box of the lowest level.
    items: Vec<u32>,
    /// Lowest level first; the last one has at most [`FAN_OUT`] boxes.
    levels: Vec<Vec<Bounds>>,
}

impl BoxTree {
    /// A tree whose item `i` has box `i`.
    pub(super) fn new(boxes: &[Bounds]) -> Self {
        let mut items: Vec<u32> = (0..boxes.len() as u32).collect();
        arrange(&mut items, boxes);
        let mut levels = vec![items.iter().map(|&item| boxes[item as usize]).collect::<Vec<_>>()];
        while let Some(below) = levels.last().filter(|level| level.len() > FAN_OUT) {
            let around = |boxes: &[Bounds]| boxes.iter().fold(Bounds::EMPTY, |all, one| all.joined(one));
            let level = below.chunks(FAN_OUT).map(around).collect();
            levels.push(level);
        }
        Self { items, levels }
    }

    /// Calls `visit` with every item whose box meets `wanted`.
    pub(super) fn meeting(&self, wanted: &Bounds, mut visit: impl FnMut(u32)) {
        let top = self.levels.len() - 1;
        self.meeting_below(top, 0..self.levels[top].len(), wanted, &mut visit);
    }

    /// Recursion as deep as the tree: 16 levels for 2^32 items.
    fn meeting_below(
        &self,
        level: usize,
        nodes: std::ops::Range<usize>,
        wanted: &Bounds,
        visit: &mut impl FnMut(u32),
    ) {
        for at in nodes {
            if !self.levels[level][at].meets(wanted) {
                continue;
            }
            if level == 0 {
                visit(self.items[at]);
            } else {
                self.meeting_below(level - 1, self.children(level, at), wanted, visit);
            }
        }
    }

    /// Calls `visit` with items roughly in the order of the distances of their boxes from a point, as long as these are
    /// not surely beyond the limit. `visit` gives the limit from then on. Limits are squared \[m²\].
    pub(super) fn nearest(&self, point: Point2, mut limit_m2: f64, mut visit: impl FnMut(u32) -> f64) {
        let top = self.levels.len() - 1;
        self.nearest_below(top, 0..self.levels[top].len(), point, &mut limit_m2, &mut visit);
    }

    fn nearest_below(
        &self,
        level: usize,
        nodes: std::ops::Range<usize>,
        point: Point2,
        limit_m2: &mut f64,
        visit: &mut impl FnMut(u32) -> f64,
    ) {
        let mut order = [(0.0_f64, 0_usize); FAN_OUT];
        let mut count = 0;
        let boxes = &self.levels[level][nodes.clone()];
        for (at, bounds) in nodes.zip(boxes) {
            let distance_m2 = surely_within_m2(bounds, point);
            if distance_m2 > *limit_m2 {
                continue;
            }
            // Insertion keeps the few boxes in order.
            let mut place = count;
            while place > 0 && order[place - 1].0 > distance_m2 {
                order[place] = order[place - 1];
                place -= 1;
            }
            order[place] = (distance_m2, at);
            count += 1;
        }
        for &(distance_m2, at) in &order[..count] {
            if distance_m2 > *limit_m2 {
                return;
            }
            if level == 0 {
                *limit_m2 = visit(self.items[at]);
            } else {
                self.nearest_below(level - 1, self.children(level, at), point, limit_m2, visit);
            }
        }
    }

    fn children(&self, level: usize, at: usize) -> std::ops::Range<usize> {
        let first = at * FAN_OUT;
        first..(first + FAN_OUT).min(self.levels[level - 1].len())
    }
}

/// A squared distance \[m²\] that no point of the box is nearer than, rounding included.
#[inline]
pub(super) fn surely_within_m2(bounds: &Bounds, point: Point2) -> f64 {
    bounds.squared_distance_to(point) * (1.0 - 1e-9) - 1e-12
}

/// Orders items so that each run of [`FAN_OUT`], each run of its square and so on lies close together: halves along the
/// longer side, at a border between such runs.
fn arrange(items: &mut [u32], boxes: &[Bounds]) {
    if items.len() <= FAN_OUT {
        return;
    }
    let mut run = FAN_OUT;
    while run * FAN_OUT < items.len() {
        run *= FAN_OUT;
    }
    // Twice the middle, which orders as well.
    let middle = |item: &u32| boxes[*item as usize].min + boxes[*item as usize].max.coords;
    let around = Bounds::around(items.iter().map(middle));
    let extent = around.max - around.min;
    let axis = usize::from(extent.y > extent.x);
    let half = items.len().div_ceil(run).div_ceil(2) * run;
    items.select_nth_unstable_by(half, |a, b| middle(a)[axis].total_cmp(&middle(b)[axis]).then(a.cmp(b)));
    let (low, high) = items.split_at_mut(half);
    arrange(low, boxes);
    arrange(high, boxes);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn trees_of_all_sizes_find_what_a_scan_finds() {
        for count in [0, 1, 4, 5, 16, 17, 257, 3000] {
            let boxes: Vec<Bounds> = (0..count)
                .map(|k| {
                    let min = Point2::new(f64::from(k * 37 % 101), f64::from(k * 53 % 97));
                    Bounds { min, max: min + motion::Vector2::new(f64::from(k % 3), f64::from(k % 5)) }
                })
                .collect();
            let tree = BoxTree::new(&boxes);
            let wanted = Bounds { min: Point2::new(20.0, 30.0), max: Point2::new(41.0, 55.0) };
            let mut found = Vec::new();
            tree.meeting(&wanted, |item| found.push(item));
            found.sort_unstable();
            let expected: Vec<u32> =
                (0..).zip(&boxes).filter(|(_, one)| one.meets(&wanted)).map(|(item, _)| item).collect();
            assert_eq!(found, expected, "{count} boxes");

            let point = Point2::new(33.3, 144.4);
            let distance_m2 = |item: u32| surely_within_m2(&boxes[item as usize], point);
            let mut nearest_m2 = f64::INFINITY;
            tree.nearest(point, nearest_m2, |item| {
                nearest_m2 = nearest_m2.min(distance_m2(item));
                nearest_m2
            });
            assert_eq!(nearest_m2, (0..count as u32).map(distance_m2).fold(f64::INFINITY, f64::min));
        }
    }
}
