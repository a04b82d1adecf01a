//! Lengths along a trajectory in the x-y plane, signed: negative against the order of the points.
//!
//! Places off the points are projected on the line of their nearest segment and **not clamped**: what lies before the
//! first or after the last point counts with the straight continuation.

use super::{Posed, find_nearest_segment, longitudinal_offset_to_segment};
use crate::geometry::Point2;

/// Length from point `from` to point `to` \[m\], negative if `to` comes first, 0 for no points (`calcSignedArcLength`).
/// Indices beyond the end mean the last point.
#[must_use]
#[inline]
pub fn arc_length_between<P: Posed>(points: &[P], from: usize, to: usize) -> f64 {
    let (first, last) = (from.min(to), from.max(to).min(points.len().saturating_sub(1)));
    let stretch = points.get(first..=last).unwrap_or_default();
    let length: f64 = stretch.windows(2).map(|pair| (pair[1].point() - pair[0].point()).norm()).sum();
    if from > to { -length } else { length }
}

/// Length from a place to point `to` \[m\] (`calcSignedArcLength`). 0 for no points; `None` where the segment at the
/// place has no length.
#[must_use]
pub fn arc_length_from_point<P: Posed>(points: &[P], from: Point2, to: usize) -> Option<f64> {
    let Some((segment, offset)) = locate(points, from) else { return Some(0.0) };
    Some(arc_length_between(points, segment, to) - offset?)
}

/// Length from point `from` to a place \[m\], see [`arc_length_from_point`].
#[must_use]
pub fn arc_length_to_point<P: Posed>(points: &[P], from: usize, to: Point2) -> Option<f64> {
    arc_length_from_point(points, to, from).map(|length| -length)
}

/// Length from one place to another \[m\], see [`arc_length_from_point`].
#[must_use]
pub fn arc_length_between_points<P: Posed>(points: &[P], from: Point2, to: Point2) -> Option<f64> {
    let (Some((from_segment, from_offset)), Some((to_segment, to_offset))) =
        (locate(points, from), locate(points, to))
    else {
        return Some(0.0);
    };
    Some(arc_length_between(points, from_segment, to_segment) - from_offset? + to_offset?)
}

/// Nearest segment and offset along it, `None` for no points.
fn locate<P: Posed>(points: &[P], place: Point2) -> Option<(usize, Option<f64>)> {
    let segment = find_nearest_segment(points, place)?;
    Some((segment, longitudinal_offset_to_segment(points, segment, place)))
}

/// Length from the first point to every point \[m\]; `out` is cleared first and then as long as `points`.
pub fn cumulative_arc_length<P: Posed>(points: &[P], out: &mut Vec<f64>) {
    out.clear();
    let Some(first) = points.first() else { return };
    let (mut previous, mut length) = (first.point(), 0.0);
    out.extend(points.iter().map(|point| {
        length += (point.point() - previous).norm();
        previous = point.point();
        length
    }));
}

/// The points up to `length_m` ahead of a place that lies on segment `segment` (`cropForwardPoints`): all before the
/// first one farther than that. Points behind the place stay. All of them when the segment has no length.
#[must_use]
pub fn crop_forward<P: Posed>(points: &[P], place: Point2, segment: usize, length_m: f64) -> &[P] {
    let Some(offset) = longitudinal_offset_to_segment(points, segment, place) else { return points };
    let mut length = -offset;
    for i in segment + 1..points.len() {
        length += (points[i].point() - points[i - 1].point()).norm();
        if length_m < length {
            return &points[..i];
        }
    }
    points
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::pose::Pose;

    fn path(points: &[(f64, f64)]) -> Vec<Pose> {
        points.iter().map(|&(x, y)| Pose::from_xy_yaw(x, y, 0.0)).collect()
    }

    fn p(x: f64, y: f64) -> Point2 {
        Point2::new(x, y)
    }

    #[test]
    fn lengths_between_points() {
        let line = path(&[(0.0, 0.0), (3.0, 4.0), (3.0, 4.0), (9.0, 4.0)]);
        for (from, to, length) in
            [(0, 3, 11.0), (3, 0, -11.0), (1, 2, 0.0), (2, 3, 6.0), (1, 1, 0.0), (0, 99, 11.0)]
        {
            assert_eq!(arc_length_between(&line, from, to), length, "{from} to {to}");
        }
        assert_eq!(arc_length_between::<Pose>(&[], 0, 3), 0.0);
        assert_eq!(arc_length_between(&line, 7, 9), 0.0);
    }

    #[test]
    fn height_does_not_count() {
        let mut line = path(&[(0.0, 0.0), (1.0, 0.0)]);
        line[1].position.z = 100.0;
        assert_eq!(arc_length_between(&line, 0, 1), 1.0);
    }

    #[test]
    fn lengths_to_places() {
        let line = path(&[(0.0, 0.0), (10.0, 0.0), (20.0, 0.0)]);
        assert_eq!(arc_length_from_point(&line, p(4.0, 3.0), 2), Some(16.0));
        assert_eq!(arc_length_from_point(&line, p(14.0, 3.0), 0), Some(-14.0));
        assert_eq!(arc_length_to_point(&line, 0, p(14.0, 3.0)), Some(14.0));
        assert_eq!(arc_length_between_points(&line, p(4.0, 1.0), p(17.0, -1.0)), Some(13.0));
        assert_eq!(arc_length_between_points(&line, p(17.0, 1.0), p(4.0, -1.0)), Some(-13.0));
        assert_eq!(arc_length_to_point(&line, 0, p(-5.0, 1.0)), Some(-5.0), "before the start");
        assert_eq!(arc_length_to_point(&line, 0, p(26.0, 1.0)), Some(26.0), "beyond the end");
    }

    #[test]
    fn places_without_a_segment() {
        assert_eq!(arc_length_from_point::<Pose>(&[], p(1.0, 1.0), 0), Some(0.0));
        assert_eq!(arc_length_between_points::<Pose>(&[], p(1.0, 1.0), p(2.0, 2.0)), Some(0.0));
        let single = path(&[(0.0, 0.0)]);
        assert_eq!(arc_length_to_point(&single, 0, p(1.0, 1.0)), None);
        let standing = path(&[(0.0, 0.0), (0.0, 0.0)]);
        assert_eq!(arc_length_between_points(&standing, p(1.0, 1.0), p(2.0, 2.0)), None);
    }

    #[test]
    fn cropping_ahead() {
        let line = path(&[(0.0, 0.0), (1.0, 0.0), (2.0, 0.0), (3.0, 0.0), (4.0, 0.0)]);
        for (x, segment, length, kept) in [
            (0.0, 0, 2.0, 3),
            (0.0, 0, 1.999, 2),
            (1.5, 1, 1.0, 3),
            (1.5, 1, 1.5, 4),
            (0.0, 0, 99.0, 5),
            (2.0, 2, -1.0, 3),
            (-3.0, 0, 1.0, 1),
        ] {
            assert_eq!(crop_forward(&line, p(x, 0.5), segment, length).len(), kept, "{x} {segment} {length}");
        }
        assert!(crop_forward::<Pose>(&[], p(0.0, 0.0), 0, 1.0).is_empty());
        assert_eq!(crop_forward(&line, p(0.0, 0.0), 99, 1.0).len(), 5);
    }

    prop_compose! {
        fn any_path()(points in prop::collection::vec((-9.0..9.0_f64, -9.0..9.0_f64), 2..15)) -> Vec<Pose> {
            path(&points)
        }
    }

    proptest! {
        #[test]
        fn lengths_add_up(line in any_path(), i in 0..15_usize, j in 0..15_usize, k in 0..15_usize) {
            let sum = arc_length_between(&line, i, j) + arc_length_between(&line, j, k);
            prop_assert!((sum - arc_length_between(&line, i, k)).abs() < 1e-9);
            let mut cumulative = Vec::new();
            cumulative_arc_length(&line, &mut cumulative);
            prop_assert_eq!(cumulative.len(), line.len());
            let (i, j) = (i % line.len(), j % line.len());
            prop_assert!((cumulative[j] - cumulative[i] - arc_length_between(&line, i, j)).abs() < 1e-9);
        }

        #[test]
        fn places_add_up(
            line in any_path(), a in -9.0..9.0_f64, b in -9.0..9.0_f64, c in -9.0..9.0_f64, d in -9.0..9.0_f64,
        ) {
            let (from, to) = (p(a, b), p(c, d));
            let direct = arc_length_between_points(&line, from, to).unwrap();
            let by_way_of_a_point = arc_length_from_point(&line, from, 1).unwrap() + arc_length_to_point(&line, 1, to).unwrap();
            prop_assert!((direct - by_way_of_a_point).abs() < 1e-9);
            prop_assert!((direct + arc_length_between_points(&line, to, from).unwrap()).abs() < 1e-9);
        }

        #[test]
        fn rigid_motion_changes_no_length(
            line in any_path(), x in -1e3..1e3_f64, y in -1e3..1e3_f64, turn in -4.0..4.0_f64,
        ) {
            let transform = Pose::from_xy_yaw(x, y, turn).planar_transform();
            let moved: Vec<Pose> = line
                .iter()
                .map(|pose| transform.apply(pose.point()))
                .map(|point| Pose::from_xy_yaw(point.x, point.y, 0.0))
                .collect();
            let last = line.len() - 1;
            prop_assert!((arc_length_between(&line, 0, last) - arc_length_between(&moved, 0, last)).abs() < 1e-9);
        }
    }
}
