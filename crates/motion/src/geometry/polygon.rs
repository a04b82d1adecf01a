//! Polygons as slices of vertices in either sense of rotation, open or closed (last vertex = first).

use super::Point2;

/// Area \[m²\] of any simple polygon, positive when its vertices run counter-clockwise. Zero below three vertices.
#[must_use]
pub fn signed_area(polygon: &[Point2]) -> f64 {
    let Some((&first, rest)) = polygon.split_first() else { return 0.0 };
    // Relative to one vertex: map coordinates are large and would cancel.
    rest.windows(2).map(|edge| (edge[0] - first).perp(&(edge[1] - first))).sum::<f64>() * 0.5
}

/// True when a point lies in a convex polygon or on its border. Below three vertices nothing does.
#[must_use]
pub fn convex_contains(polygon: &[Point2], point: Point2) -> bool {
    if polygon.len() < 3 {
        return false;
    }
    let (mut left, mut right) = (false, false);
    for (start, end) in edges(polygon) {
        let side = (end - start).perp(&(point - start));
        left |= side > 0.0;
        right |= side < 0.0;
    }
    if left || right {
        return left != right;
    }
    // Everything in one line: the sides say nothing, the edges do.
    edges(polygon).any(|(start, end)| (start - point).dot(&(end - point)) <= 0.0)
}

/// True when a point lies in any polygon or on its border. What the outline goes round counts as inside, in either
/// sense and however often (winding rule), so an outline that crosses itself encloses all of its parts. Below three
/// vertices nothing is inside.
#[must_use]
pub fn polygon_contains(polygon: &[Point2], point: Point2) -> bool {
    if polygon.len() < 3 {
        return false;
    }
    let mut turns = 0;
    for (start, end) in edges(polygon) {
        let side = (end - start).perp(&(point - start));
        if side == 0.0 && (start - point).dot(&(end - point)) <= 0.0 {
            return true;
        }
        let (upwards, downwards) =
            (start.y <= point.y && end.y > point.y, start.y > point.y && end.y <= point.y);
        if upwards && side > 0.0 {
            turns += 1;
        } else if downwards && side < 0.0 {
            turns -= 1;
        }
    }
    turns != 0
}

/// True when two convex polygons overlap or touch (separating axes; `intersects_sat`). Below three vertices nothing
/// overlaps.
#[must_use]
pub fn convex_overlap(a: &[Point2], b: &[Point2]) -> bool {
    a.len() >= 3 && b.len() >= 3 && !has_separating_edge(a, b) && !has_separating_edge(b, a)
}

/// True when `a` and `b` lie apart along the normal of an edge of `a`.
///
/// The edge itself lies at 0 on that axis, so only a `b` wholly on one side of it can be apart, and most edges are
/// dismissed by one or two vertices. Not-a-number is on no side: it never separates.
fn has_separating_edge(a: &[Point2], b: &[Point2]) -> bool {
    edges(a).any(|(start, end)| {
        let edge = end - start;
        let side = |p: &Point2| edge.perp(&(p - start));
        let sign = b.first().map_or(0.0, side).signum();
        let mut nearest = f64::INFINITY;
        for point in b {
            let beyond = sign * side(point);
            if beyond > 0.0 {
                nearest = nearest.min(beyond);
            } else {
                return false;
            }
        }
        a.iter().all(|point| sign * side(point) < nearest)
    })
}

/// True unless an edge normal of either convex polygon shows that they are more than `reach_m` apart: they overlap,
/// touch, or come (at least seen along every normal) within `reach_m` of each other.
///
/// The careful answer for polygons that stand for something up to `reach_m` larger: never false when they are that
/// near, perhaps true when two corners face each other a little further apart. One or two vertices are a point or a
/// segment; no vertices are near nothing.
#[must_use]
pub fn convex_overlap_within(a: &[Point2], b: &[Point2], reach_m: f64) -> bool {
    !a.is_empty() && !b.is_empty() && !is_far_along_edge(a, b, reach_m) && !is_far_along_edge(b, a, reach_m)
}

/// True when `a` and `b` lie more than `reach_m` apart along the normal of an edge of `a`.
fn is_far_along_edge(a: &[Point2], b: &[Point2], reach_m: f64) -> bool {
    edges(a).any(|(start, end)| {
        let edge = end - start;
        let reach = reach_m * edge.norm();
        let side = |p: &Point2| edge.perp(&(p - start));
        let sign = b.first().map_or(0.0, side).signum();
        let mut nearest = f64::INFINITY;
        for point in b {
            let beyond = sign * side(point) - reach;
            if beyond > 0.0 {
                nearest = nearest.min(beyond);
            } else {
                return false;
            }
        }
        a.iter().all(|point| sign * side(point) < nearest)
    })
}

/// Every edge, the closing one first.
#[inline]
fn edges(polygon: &[Point2]) -> impl Iterator<Item = (Point2, Point2)> + '_ {
    let mut start = polygon.last().copied().unwrap_or_default();
    polygon.iter().map(move |&end| (std::mem::replace(&mut start, end), end))
}

/// Convex hull of a set of points, counter-clockwise, open, without vertices inside an edge.
///
/// Sorts `points` in place and writes to `hull`, which is cleared first. Fewer than three different points give those
/// points; points in one line give its two ends.
pub fn convex_hull(points: &mut [Point2], hull: &mut Vec<Point2>) {
    hull.clear();
    points.sort_unstable_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    chain(points.iter().copied(), hull, 0);
    // The upper chain starts where the lower one ended, and both ends belong to both chains.
    let lower = hull.len();
    chain(points.iter().rev().copied(), hull, lower.saturating_sub(1));
    if hull.len() > 1 {
        hull.pop();
    }
}

/// Adds one half of the hull to `hull`, never removing what lies before `base`.
fn chain(points: impl Iterator<Item = Point2>, hull: &mut Vec<Point2>, base: usize) {
    for point in points {
        if hull.last().is_some_and(|last| last.x == point.x && last.y == point.y) {
            continue;
        }
        while let [.., a, b] = hull[base..]
            && (b.x - a.x) * (point.y - a.y) - (b.y - a.y) * (point.x - a.x) <= 0.0
        {
            hull.pop();
        }
        hull.push(point);
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use proptest::prelude::*;

    use super::super::Segment;
    use super::*;

    fn regular(n: u32, radius: f64, phase: f64, x: f64, y: f64) -> Vec<Point2> {
        (0..n)
            .map(|k| phase + TAU * f64::from(k) / f64::from(n))
            .map(|angle| Point2::new(x + radius * angle.cos(), y + radius * angle.sin()))
            .collect()
    }

    fn rectangle(length: f64, width: f64, yaw: f64, x: f64, y: f64) -> Vec<Point2> {
        [(0.5, 0.5), (0.5, -0.5), (-0.5, -0.5), (-0.5, 0.5)]
            .map(|(u, v)| (u * length, v * width))
            .map(|(u, v)| Point2::new(x + u * yaw.cos() - v * yaw.sin(), y + u * yaw.sin() + v * yaw.cos()))
            .to_vec()
    }

    #[test]
    fn any_polygon_contains_its_inside_and_its_border() {
        let ell = [(0.0, 0.0), (4.0, 0.0), (4.0, 1.0), (1.0, 1.0), (1.0, 3.0), (0.0, 3.0)];
        let bow_tie = [(0.0, 0.0), (2.0, 2.0), (2.0, 0.0), (0.0, 2.0)];
        type Case<'a> = (&'a str, &'a [(f64, f64)], (f64, f64), bool);
        let cases: [Case<'_>; 12] = [
            ("foot of the L", &ell, (3.0, 0.5), true),
            ("notch of the L", &ell, (2.0, 2.0), false),
            ("inner corner", &ell, (1.0, 1.0), true),
            ("on an edge", &ell, (0.0, 1.5), true),
            ("level with corners, outside", &ell, (2.0, 3.0), false),
            ("level with corners, left of them", &ell, (-1.0, 1.0), false),
            ("in line with an edge", &ell, (5.0, 0.0), false),
            ("one wing", &bow_tie, (0.2, 1.0), true),
            ("other wing", &bow_tie, (1.8, 1.0), true),
            ("above the knot", &bow_tie, (1.0, 1.8), false),
            ("two points", &ell[..2], (1.0, 0.0), false),
            ("no points", &[], (0.0, 0.0), false),
        ];
        for (name, corners, (x, y), inside) in cases {
            let mut polygon: Vec<_> = corners.iter().map(|&(x, y)| Point2::new(x, y)).collect();
            for sense in ["as given", "reversed"] {
                assert_eq!(polygon_contains(&polygon, Point2::new(x, y)), inside, "{name} {sense}");
                polygon.reverse();
            }
        }
    }

    /// Distance of two polygons by containment and all pairs of edges: slow and plain.
    fn distance(a: &[Point2], b: &[Point2]) -> f64 {
        if convex_contains(a, b[0]) || convex_contains(b, a[0]) {
            return 0.0;
        }
        let segments = |p: &[Point2]| edges(p).map(|(s, e)| Segment::new(s, e)).collect::<Vec<_>>();
        let (sa, sb) = (segments(a), segments(b));
        sa.iter().flat_map(|s| sb.iter().map(|t| s.squared_distance(t))).fold(f64::INFINITY, f64::min).sqrt()
    }

    #[track_caller]
    fn check(a: &[Point2], b: &[Point2]) {
        let gap = distance(a, b);
        let overlap = convex_overlap(a, b);
        assert_eq!(overlap, convex_overlap(b, a));
        if gap == 0.0 || gap > 1e-12 {
            assert_eq!(overlap, gap == 0.0, "gap {gap} m\n{a:?}\n{b:?}");
        }
    }

    #[test]
    fn overlap_equals_intersection_on_the_published_grids() {
        let square = rectangle(2.0, 2.0, 0.0, 0.0, 0.0);
        for (i, j) in (-4..=12).flat_map(|i| (-4..=12).map(move |j| (i, j))) {
            let (x, y) = (0.25 * f64::from(i), 0.25 * f64::from(j));
            let other = rectangle(2.0, 2.0, 0.0, x, y);
            assert_eq!(convex_overlap(&square, &other), x.abs() <= 2.0 && y.abs() <= 2.0, "{x} {y}");
        }
        let car = rectangle(4.0, 1.6, 30_f64.to_radians(), 0.0, 0.0);
        let (triangle, pentagon) = (regular(3, 2.0, 0.2, 0.0, 0.0), |x, y| regular(5, 1.2, -0.35, x, y));
        for (i, j) in (-12..=12).flat_map(|i| (-8..=8).map(move |j| (i, j))) {
            let (x, y) = (0.7 + 0.35 * f64::from(i), 0.2 + 0.25 * f64::from(j));
            check(&car, &rectangle(2.8, 1.4, -36_f64.to_radians(), x, y));
            check(&triangle, &pentagon(x, y));
        }
    }

    #[test]
    fn overlap_within_a_reach() {
        let square = rectangle(2.0, 2.0, 0.0, 0.0, 0.0);
        for (x, reach, expected) in
            [(2.0, 0.0, true), (2.1, 0.0, false), (2.1, 0.099, false), (2.1, 0.101, true), (1.0, 0.5, true)]
        {
            assert_eq!(
                convex_overlap_within(&square, &rectangle(2.0, 2.0, 0.0, x, 0.3), reach),
                expected,
                "{x} {reach}"
            );
        }
        // a point and a segment are bodies too
        assert!(convex_overlap_within(&square, &[Point2::new(0.5, 0.5)], 0.0));
        assert!(!convex_overlap_within(&square, &[Point2::new(1.5, 0.5)], 0.4));
        assert!(convex_overlap_within(&[Point2::new(1.5, 0.5), Point2::new(1.5, 9.0)], &square, 0.6));
        assert!(!convex_overlap_within(&square, &[], 1.0));
    }

    #[test]
    fn contact_counts_and_a_micrometre_does_not() {
        let square = rectangle(2.0, 2.0, 0.0, 0.0, 0.0);
        for k in -4..=4 {
            let gap = 1e-6 * f64::from(k);
            let edge = rectangle(2.0, 2.0, 0.0, 2.0 + gap, 0.5);
            assert_eq!(convex_overlap(&square, &edge), k <= 0, "edge, gap {gap}");
            let corner = rectangle(2.0, 2.0, 0.0, 2.0 + gap, 2.0 + gap);
            assert_eq!(convex_overlap(&square, &corner), k <= 0, "corner, gap {gap}");
            let tip = [(1.0 + gap, 0.0), (3.0, 1.0), (3.0, -1.0)].map(|(x, y)| Point2::new(x, y));
            assert_eq!(convex_overlap(&square, &tip), k <= 0, "tip, gap {gap}");
        }
    }

    #[test]
    fn not_a_number_is_no_way_past() {
        let square = rectangle(2.0, 2.0, 0.0, 0.0, 0.0);
        let mut far = rectangle(2.0, 2.0, 0.3, 50.0, 0.0);
        assert!(!convex_overlap(&square, &far));
        for vertex in &mut far {
            vertex.y = f64::NAN;
            let others = convex_overlap(&square, &[*vertex; 3]) && convex_overlap(&[*vertex; 3], &square);
            assert!(others);
        }
        assert!(convex_overlap(&square, &far) && convex_overlap(&far, &square));
    }

    #[test]
    fn a_dent_never_hides_an_overlap() {
        // a notched polygon, given although it is not convex, and a square in front of the notch
        let notched =
            [(0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (2.0, 1.0), (0.0, 4.0)].map(|(x, y)| Point2::new(x, y));
        assert!(convex_overlap(&notched, &rectangle(3.0, 1.0, 0.0, 2.0, 3.0)));
        assert!(!convex_overlap(&notched, &rectangle(3.0, 1.0, 0.0, 2.0, 5.0)));
    }

    #[test]
    fn two_vertices_are_no_polygon() {
        let square = rectangle(2.0, 2.0, 0.0, 0.0, 0.0);
        assert!(!convex_overlap(&square[..2], &square));
        assert!(!convex_contains(&square[..2], square[0]));
        assert_eq!(signed_area(&square[..2]), 0.0);
        assert_eq!(signed_area(&[]), 0.0);
    }

    #[test]
    fn area_and_containment() {
        let square = rectangle(2.0, 2.0, 0.0, 1e5, -1e5);
        assert!((signed_area(&square) + 4.0).abs() < 1e-9, "clockwise");
        let mut reversed = square.clone();
        reversed.reverse();
        assert!((signed_area(&reversed) - 4.0).abs() < 1e-9, "counter-clockwise");
        let mut closed = square.clone();
        closed.push(square[0]);
        for polygon in [&square, &reversed, &closed] {
            for (x, y, inside) in [(0.0, 0.0, true), (1.0, 0.5, true), (1.0, 1.0, true), (1.001, 0.0, false)]
            {
                assert_eq!(convex_contains(polygon, Point2::new(1e5 + x, -1e5 + y)), inside, "{x} {y}");
            }
        }
        let flat = [0.0, 1.0, 2.0].map(|x| Point2::new(x, x));
        assert!(convex_contains(&flat, Point2::new(1.5, 1.5)));
        assert!(!convex_contains(&flat, Point2::new(2.5, 2.5)));
        assert!(!convex_contains(&flat, Point2::new(1.5, 1.0)));
    }

    #[test]
    fn hulls_of_degenerate_sets() {
        let mut hull = vec![Point2::new(9.0, 9.0)];
        convex_hull(&mut [], &mut hull);
        assert!(hull.is_empty());
        let p = Point2::new(1.0, 2.0);
        convex_hull(&mut [p, p, p], &mut hull);
        assert_eq!(hull, [p]);
        convex_hull(&mut [p, Point2::origin(), Point2::new(2.0, 4.0), p], &mut hull);
        assert_eq!(hull, [Point2::origin(), Point2::new(2.0, 4.0)]);
        let mut square = [(0.0, 0.0), (1.0, 1.0), (0.5, 0.0), (1.0, 0.0), (0.5, 0.5), (0.0, 1.0), (0.0, 0.0)]
            .map(|(x, y)| Point2::new(x, y));
        convex_hull(&mut square, &mut hull);
        let expected = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(|(x, y)| Point2::new(x, y));
        assert_eq!(hull, expected);
    }

    prop_compose! {
        fn any_polygon()(
            n in 3..8_u32, radius in 0.2..3.0_f64, phase in 0.0..6.3_f64, x in -4.0..4.0_f64, y in -4.0..4.0_f64,
        ) -> Vec<Point2> {
            regular(n, radius, phase, x, y)
        }
    }

    proptest! {
        #[test]
        fn both_containment_tests_agree_on_convex_polygons(
            n in 3..9_u32, phase in 0.0..6.0_f64, x in -2.0..2.0_f64, y in -2.0..2.0_f64,
        ) {
            let polygon = regular(n, 1.0, phase, 0.0, 0.0);
            let point = Point2::new(x, y);
            prop_assert_eq!(polygon_contains(&polygon, point), convex_contains(&polygon, point));
        }

        #[test]
        fn overlap_equals_zero_distance(a in any_polygon(), b in any_polygon()) {
            check(&a, &b);
        }

        #[test]
        fn hull_is_convex_and_holds_every_point(
            mut points in prop::collection::vec((-9..9_i32, -9..9_i32), 1..20)
                .prop_map(|v| v.into_iter().map(|(x, y)| Point2::new(f64::from(x), f64::from(y))).collect::<Vec<_>>()),
        ) {
            let mut hull = Vec::new();
            convex_hull(&mut points, &mut hull);
            prop_assert!(hull.iter().all(|p| points.contains(p)));
            if hull.len() >= 3 {
                prop_assert!(points.iter().all(|&p| convex_contains(&hull, p)));
                for k in 0..hull.len() {
                    let (a, b, c) = (hull[k], hull[(k + 1) % hull.len()], hull[(k + 2) % hull.len()]);
                    prop_assert!((b - a).perp(&(c - b)) > 0.0, "strictly convex and counter-clockwise");
                }
            }
        }
    }
}
