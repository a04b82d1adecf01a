//! Putting the rings of an area together from ways.

use crate::map::elements::Polyline;
use crate::map::store::{Handle, Store};

/// Rings of ways in member order, each closed and clockwise; the count of rings that could not be made.
pub(super) fn rings(store: &Store, ways: &[Handle]) -> (Vec<Vec<Handle>>, usize) {
    let mut remaining: Vec<Handle> = ways.to_vec();
    let (mut rings, mut broken) = (Vec::new(), 0);
    while !remaining.is_empty() {
        let mut ring = vec![remaining.remove(0)];
        let is_closed = loop {
            let (first, last) = (end_points(store, ring[0]).0, end_points(store, ring[ring.len() - 1]).1);
            if first == last {
                break true;
            }
            let next = remaining.iter().position(|way| {
                let (start, end) = end_points(store, *way);
                start == last || end == last
            });
            let Some(next) = next else { break false };
            let way = remaining.remove(next);
            ring.push(if end_points(store, way).0 == last { way } else { way.flipped() });
        };
        match if is_closed { clockwise(store, ring) } else { None } {
            Some(ring) => rings.push(ring),
            None => broken += 1,
        }
    }
    (rings, broken)
}

/// Arena indexes of the first and the last point in reading order; a way has points.
fn end_points(store: &Store, way: Handle) -> (Option<u32>, Option<u32>) {
    let points = &store.line_points[store.lines[way.index()].points.range()];
    let (first, last) = (points.first().copied(), points.last().copied());
    if way.is_inverted() { (last, first) } else { (first, last) }
}

/// The ring in clockwise order, or nothing if it is not a simple polygon.
fn clockwise(store: &Store, mut ring: Vec<Handle>) -> Option<Vec<Handle>> {
    let mut corners: Vec<[f64; 2]> =
        ring.iter().flat_map(|way| Polyline::new(store, *way).positions()).map(|[x, y, _]| [x, y]).collect();
    corners.dedup();
    while corners.len() > 1 && corners.first() == corners.last() {
        corners.pop();
    }
    if corners.len() < 3 || crosses_itself(&corners) {
        return None;
    }
    let area = doubled_area(&corners);
    if area > 0.0 {
        ring.reverse();
        for way in &mut ring {
            *way = way.flipped();
        }
    }
    (area != 0.0).then_some(ring)
}

/// Twice the area, positive for counter-clockwise corners; relative to the first corner, since map coordinates are
/// large against areas.
fn doubled_area(corners: &[[f64; 2]]) -> f64 {
    let origin = corners[0];
    corners.windows(2).map(|pair| cross(origin, pair[0], pair[1])).sum()
}

fn cross(origin: [f64; 2], a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - origin[0]) * (b[1] - origin[1]) - (a[1] - origin[1]) * (b[0] - origin[0])
}

/// Whether two sides of a ring meet anywhere but at the corner they share.
fn crosses_itself(corners: &[[f64; 2]]) -> bool {
    let count = corners.len();
    let side = |at: usize| (corners[at], corners[(at + 1) % count]);
    let mut order: Vec<usize> = (0..count).collect();
    let low = |at: usize| side(at).0[0].min(side(at).1[0]);
    let high = |at: usize| side(at).0[0].max(side(at).1[0]);
    order.sort_by(|a, b| low(*a).total_cmp(&low(*b)));
    order.iter().enumerate().any(|(rank, &i)| {
        order[rank + 1..].iter().take_while(|&&j| low(j) <= high(i)).any(|&j| {
            let (first, second) = (i.min(j), i.max(j));
            if second == first + 1 {
                folds_back(side(first).0, side(second).0, side(second).1)
            } else if first == 0 && second == count - 1 {
                folds_back(side(second).0, side(first).0, side(first).1)
            } else {
                meet(side(first), side(second))
            }
        })
    })
}

/// Whether the way from a over the corner to b runs back upon itself.
fn folds_back(a: [f64; 2], corner: [f64; 2], b: [f64; 2]) -> bool {
    let along = (a[0] - corner[0]) * (b[0] - corner[0]) + (a[1] - corner[1]) * (b[1] - corner[1]);
    cross(corner, a, b) == 0.0 && along > 0.0
}

fn meet((a, b): ([f64; 2], [f64; 2]), (c, d): ([f64; 2], [f64; 2])) -> bool {
    let (c_side, d_side) = (cross(a, b, c), cross(a, b, d));
    let (a_side, b_side) = (cross(c, d, a), cross(c, d, b));
    if c_side * d_side < 0.0 && a_side * b_side < 0.0 {
        return true;
    }
    let within = |p: [f64; 2], q: [f64; 2], r: [f64; 2]| {
        (0..2).all(|axis| p[axis].min(q[axis]) <= r[axis] && r[axis] <= p[axis].max(q[axis]))
    };
    (c_side == 0.0 && within(a, b, c))
        || (d_side == 0.0 && within(a, b, d))
        || (a_side == 0.0 && within(c, d, a))
        || (b_side == 0.0 && within(c, d, b))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn simple_and_crossing_rings() {
        let square = [[0.0, 0.0], [0.0, 2.0], [2.0, 2.0], [2.0, 0.0]];
        assert!(!crosses_itself(&square));
        assert!(doubled_area(&square) < 0.0, "this order is clockwise");
        let bow_tie = [[0.0, 0.0], [2.0, 2.0], [2.0, 0.0], [0.0, 2.0]];
        assert!(crosses_itself(&bow_tie));
        let spike = [[0.0, 0.0], [2.0, 0.0], [4.0, 0.0], [3.0, 0.0], [2.0, 2.0]];
        assert!(crosses_itself(&spike));
        let touching = [[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [2.0, 0.0], [0.0, 4.0]];
        assert!(crosses_itself(&touching));
        let concave = [[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [2.0, 1.0], [0.0, 4.0]];
        assert!(!crosses_itself(&concave));
    }
}
