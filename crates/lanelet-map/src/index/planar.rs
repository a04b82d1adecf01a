//! Plane geometry of the indexes. Borders count as inside everywhere.

type Position = [f64; 2];

/// Distance of a point from a segment. Computed relative to the point, so that large map coordinates cost no
/// precision and segments that share the nearest corner give the very same number.
pub(super) fn segment_distance(a: Position, b: Position, point: Position) -> f64 {
    let (ax, ay) = (a[0] - point[0], a[1] - point[1]);
    let (bx, by) = (b[0] - point[0], b[1] - point[1]);
    let (dx, dy) = (bx - ax, by - ay);
    let along = -(ax * dx + ay * dy);
    let length_2 = dx * dx + dy * dy;
    if along <= 0.0 {
        (ax * ax + ay * ay).sqrt()
    } else if along >= length_2 {
        (bx * bx + by * by).sqrt()
    } else {
        // Exactly 0 on the segment, which the way over the foot would miss by rounding.
        (ax * dy - ay * dx).abs() / length_2.sqrt()
    }
}

/// Whether a segment has a point in common with a box. The boxes of both must overlap already.
pub(super) fn segment_meets_box(a: Position, b: Position, min: Position, max: Position) -> bool {
    // With overlapping boxes only the segment's own normal can separate them.
    let corners = [min, [max[0], min[1]], max, [min[0], max[1]]];
    let sides = corners.map(|corner| cross(a, b, corner));
    !(sides.iter().all(|side| *side > 0.0) || sides.iter().all(|side| *side < 0.0))
}

/// Twice the signed area of a triangle; positive if `c` lies to the left of the way from `a` to `b`.
fn cross(a: Position, b: Position, c: Position) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

fn edges(corners: &[Position]) -> impl Iterator<Item = (Position, Position)> + '_ {
    (0..corners.len()).map(|at| (corners[at], corners[(at + 1) % corners.len()]))
}

fn is_between(a: Position, b: Position, point: Position) -> bool {
    (0..2).all(|axis| a[axis].min(b[axis]) <= point[axis] && point[axis] <= a[axis].max(b[axis]))
}

/// Whether a polygon holds a point, by winding number.
pub(super) fn holds(corners: &[Position], point: Position) -> bool {
    let mut winding = 0;
    for (a, b) in edges(corners) {
        let side = cross(a, b, point);
        if side == 0.0 && is_between(a, b, point) {
            return true;
        }
        if a[1] <= point[1] {
            winding += i32::from(b[1] > point[1] && side > 0.0);
        } else {
            winding -= i32::from(b[1] <= point[1] && side < 0.0);
        }
    }
    winding != 0
}

/// Distance of a point from a polygon, 0 inside.
pub(super) fn outline_distance(corners: &[Position], point: Position) -> f64 {
    if holds(corners, point) {
        return 0.0;
    }
    edges(corners).map(|(a, b)| segment_distance(a, b, point)).fold(f64::INFINITY, f64::min)
}

/// Whether a polygon and a convex polygon have a point in common.
pub(super) fn meets_convex(corners: &[Position], convex: &[Position]) -> bool {
    let (Some(corner), Some(convex_corner)) = (corners.first(), convex.first()) else { return false };
    holds(corners, *convex_corner)
        || holds(convex, *corner)
        || edges(convex).any(|side| edges(corners).any(|edge| segments_meet(side, edge)))
}

fn segments_meet((a, b): (Position, Position), (c, d): (Position, Position)) -> bool {
    let (c_side, d_side) = (cross(a, b, c), cross(a, b, d));
    let (a_side, b_side) = (cross(c, d, a), cross(c, d, b));
    let opposite = |p: f64, q: f64| (p > 0.0 && q < 0.0) || (p < 0.0 && q > 0.0);
    (opposite(c_side, d_side) && opposite(a_side, b_side))
        || (c_side == 0.0 && is_between(a, b, c))
        || (d_side == 0.0 && is_between(a, b, d))
        || (a_side == 0.0 && is_between(c, d, a))
        || (b_side == 0.0 && is_between(c, d, b))
}

#[cfg(test)]
mod tests {
    use super::*;

    const SQUARE: [Position; 4] = [[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]];
    /// The square with a notch from above down to (2, 1).
    const NOTCHED: [Position; 5] = [[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [2.0, 1.0], [0.0, 4.0]];

    #[test]
    fn distances_from_a_segment() {
        let (a, b) = ([100_000.0, 0.0], [100_010.0, 0.0]);
        for (point, expected) in [
            ([100_005.0, 3.0], 3.0),
            ([99_997.0, 4.0], 5.0),
            ([100_013.0, -4.0], 5.0),
            ([100_002.0, 0.0], 0.0),
        ] {
            assert_eq!(segment_distance(a, b, point), expected, "{point:?}");
            assert_eq!(segment_distance(b, a, point), expected, "{point:?}");
            assert_eq!(segment_distance(a, a, a), 0.0);
        }
    }

    #[test]
    fn points_in_polygons() {
        for (point, in_square, in_notched) in [
            ([2.0, 0.5], true, true),
            ([2.0, 3.0], true, false),
            ([0.0, 0.0], true, true),
            ([4.0, 2.0], true, true),
            ([2.0, 1.0], true, true),
            ([4.1, 2.0], false, false),
            ([-1.0, 4.0], false, false),
        ] {
            assert_eq!(holds(&SQUARE, point), in_square, "{point:?}");
            assert_eq!(holds(&NOTCHED, point), in_notched, "{point:?}");
            let backwards: Vec<Position> = NOTCHED.iter().rev().copied().collect();
            assert_eq!(holds(&backwards, point), in_notched, "{point:?}");
        }
        assert!((outline_distance(&SQUARE, [7.0, 8.0]) - 5.0).abs() < 1e-12);
    }

    #[test]
    fn twice_wound_places_are_inside() {
        let twice: Vec<Position> = SQUARE.iter().chain(&SQUARE).copied().collect();
        assert!(holds(&twice, [1.0, 1.0]));
    }

    #[test]
    fn polygons_that_meet() {
        let at = |x: f64, y: f64| [[x, y], [x + 1.0, y], [x + 1.0, y + 1.0], [x, y + 1.0]];
        for (x, y, expected) in [
            (1.0, 0.0, true),
            (3.5, 3.5, true),
            (4.0, 4.0, true),
            (4.1, 0.0, false),
            (1.5, 3.0, false),
            (1.5, 0.5, true),
            (-2.0, 1.0, false),
        ] {
            assert_eq!(meets_convex(&NOTCHED, &at(x, y)), expected, "{x} {y}");
        }
        let around = [[-9.0, -9.0], [9.0, -9.0], [9.0, 9.0], [-9.0, 9.0]];
        assert!(meets_convex(&NOTCHED, &around));
        assert!(meets_convex(&NOTCHED, &[[1.0, 1.0]]));
        assert!(!meets_convex(&NOTCHED, &[]));
    }

    #[test]
    fn segments_and_boxes() {
        let (min, max) = ([0.0, 0.0], [2.0, 2.0]);
        for (a, b, expected) in [
            ([-1.0, 1.0], [3.0, 1.0], true),
            ([1.5, 3.0], [3.0, 1.5], false),
            ([2.0, 2.0], [3.0, 3.0], true),
            ([0.5, 0.5], [0.6, 0.6], true),
        ] {
            assert_eq!(segment_meets_box(a, b, min, max), expected, "{a:?} {b:?}");
        }
    }
}
