//! The point or segment of a trajectory nearest to a place, and offsets from it.

use super::Posed;
use crate::geometry::Point2;
use crate::pose::{Pose, azimuth, normalize_radian};
use crate::tolerance::OVERLAP_M;

/// Index of the point nearest to `target`; the first of equals. `None` only for no points (`findNearestIndex`).
#[must_use]
#[inline]
pub fn find_nearest_index<P: Posed>(points: &[P], target: Point2) -> Option<usize> {
    if points.is_empty() {
        return None;
    }
    let mut best = (0, f64::INFINITY);
    for (i, point) in points.iter().enumerate() {
        let squared = (point.point() - target).norm_squared();
        if squared < best.1 {
            best = (i, squared);
        }
    }
    Some(best.0)
}

/// Index of the nearest point among those within `max_distance_m` of `target` whose yaw differs from it by no more
/// than `max_yaw_rad` (`findNearestIndex` with a pose). Infinity lifts a limit.
#[must_use]
pub fn find_nearest_index_within<P: Posed>(
    points: &[P],
    target: &Pose,
    max_distance_m: f64,
    max_yaw_rad: f64,
) -> Option<usize> {
    let (center, yaw) = (target.point(), target.yaw());
    let max_squared = max_distance_m * max_distance_m;
    let mut best = None;
    let mut best_squared = f64::INFINITY;
    for (i, point) in points.iter().enumerate() {
        let squared = (point.point() - center).norm_squared();
        if squared > max_squared || squared >= best_squared {
            continue;
        }
        if normalize_radian(yaw - point.pose().yaw()).abs() > max_yaw_rad {
            continue;
        }
        best_squared = squared;
        best = Some(i);
    }
    best
}

/// Nearest point in the first run of points that keep the limits; if there is none, the same by distance alone; if
/// there is none either, the nearest point (`findFirstNearestIndexWithSoftConstraints`). `None` only for no points.
///
/// "First run" keeps a path that passes the place twice from answering with the later pass.
#[must_use]
pub fn find_first_nearest_index_soft<P: Posed>(
    points: &[P],
    target: &Pose,
    max_distance_m: f64,
    max_yaw_rad: f64,
) -> Option<usize> {
    let yaw = target.yaw();
    first_run_nearest(points, target.point(), max_distance_m, |point| {
        normalize_radian(yaw - point.pose().yaw()).abs() > max_yaw_rad
    })
    .or_else(|| first_run_nearest(points, target.point(), max_distance_m, |_| false))
    .or_else(|| find_nearest_index(points, target.point()))
}

fn first_run_nearest<P: Posed>(
    points: &[P],
    target: Point2,
    max_distance_m: f64,
    is_excluded: impl Fn(&P) -> bool,
) -> Option<usize> {
    let max_squared = max_distance_m * max_distance_m;
    let mut best = None;
    let mut best_squared = f64::INFINITY;
    for (i, point) in points.iter().enumerate() {
        let squared = (point.point() - target).norm_squared();
        if max_squared < squared || is_excluded(point) {
            if best.is_some() {
                break;
            }
        } else if squared < best_squared {
            best_squared = squared;
            best = Some(i);
        }
    }
    best
}

/// The points without those that coincide (in x and y, within [`OVERLAP_M`]) with the last one kept
/// (`removeOverlapPoints`). The first point is always kept.
pub fn distinct_points<P: Posed>(points: &[P]) -> impl Iterator<Item = &P> {
    let mut kept: Option<Point2> = None;
    points.iter().filter(move |point| {
        let here = point.point();
        let keep = kept.is_none_or(|last| !coincide(last, here));
        if keep {
            kept = Some(here);
        }
        keep
    })
}

#[inline]
fn coincide(a: Point2, b: Point2) -> bool {
    (a.x - b.x).abs() < OVERLAP_M && (a.y - b.y).abs() < OVERLAP_M
}

/// Distance of `target` along the direction of segment `segment`, counted from its first point \[m\]
/// (`calcLongitudinalOffsetToSegment`). Negative before the segment, beyond its length after it: not clamped.
///
/// The segment ends at the first later point that does not coincide with its start. `None` when there is no such
/// point or no such segment (upstream: not-a-number).
#[must_use]
#[inline]
pub fn longitudinal_offset_to_segment<P: Posed>(points: &[P], segment: usize, target: Point2) -> Option<f64> {
    let (first, rest) = points.get(segment..)?.split_first()?;
    let front = first.point();
    let back = rest.iter().map(Posed::point).find(|&point| !coincide(front, point))?;
    Some(offset_along(front, back, target))
}

#[inline]
fn offset_along(front: Point2, back: Point2, target: Point2) -> f64 {
    let along = back - front;
    (target - front).dot(&along) / along.norm()
}

/// Index of the first point of the segment nearest to `target` (`findNearestSegmentIndex`). `None` only for no points;
/// a single point gives 0, which is then no segment.
///
/// It is a segment at the nearest *point*, chosen by the side of that point on which `target` lies.
#[must_use]
#[inline]
pub fn find_nearest_segment<P: Posed>(points: &[P], target: Point2) -> Option<usize> {
    find_nearest_index(points, target).map(|nearest| segment_at(points, nearest, target))
}

/// As [`find_nearest_segment`], at the point of [`find_first_nearest_index_soft`]
/// (`findFirstNearestSegmentIndexWithSoftConstraints`).
#[must_use]
pub fn find_first_nearest_segment_soft<P: Posed>(
    points: &[P],
    target: &Pose,
    max_distance_m: f64,
    max_yaw_rad: f64,
) -> Option<usize> {
    find_first_nearest_index_soft(points, target, max_distance_m, max_yaw_rad)
        .map(|nearest| segment_at(points, nearest, target.point()))
}

fn segment_at<P: Posed>(points: &[P], nearest: usize, target: Point2) -> usize {
    if nearest == 0 {
        return 0;
    }
    if nearest + 1 == points.len() {
        return nearest - 1;
    }
    match longitudinal_offset_to_segment(points, nearest, target) {
        Some(offset) if offset <= 0.0 => nearest - 1,
        _ => nearest,
    }
}

/// Distance of `target` from the line of a segment \[m\], positive to the left (`calcLateralOffset`).
///
/// `segment` counts in the points without coinciding ones ([`distinct_points`]); beyond the last segment it means the
/// last. `None` with fewer than two different points.
#[must_use]
pub fn lateral_offset<P: Posed>(points: &[P], target: Point2, segment: usize) -> Option<f64> {
    let mut distinct = distinct_points(points).map(Posed::point);
    let mut front = distinct.next()?;
    let mut back = distinct.next()?;
    for next in distinct.take(segment) {
        (front, back) = (back, next);
    }
    Some(offset_across(front, back, target))
}

/// Distance of `target` from the line of the nearest segment \[m\], positive to the left (`calcLateralOffset`).
/// `None` with fewer than two different points.
#[must_use]
pub fn lateral_offset_to_nearest<P: Posed>(points: &[P], target: Point2) -> Option<f64> {
    nearest_distinct_segment(points, target).map(|(front, back)| offset_across(front, back, target))
}

#[inline]
fn offset_across(front: Point2, back: Point2, target: Point2) -> f64 {
    let along = back - front;
    along.perp(&(target - front)) / along.norm()
}

/// Yaw of `target` relative to the nearest segment \[rad\] in [-π, π), positive to the left (`calcYawDeviation`). `None`
/// with fewer than two different points (upstream: 0 or an exception).
#[must_use]
pub fn yaw_deviation_from<P: Posed>(points: &[P], target: &Pose) -> Option<f64> {
    let (front, back) = nearest_distinct_segment(points, target.point())?;
    Some(normalize_radian(target.yaw() - azimuth(front, back)))
}

/// Both ends of the segment nearest to `target` in the points without coinciding ones.
fn nearest_distinct_segment<P: Posed>(points: &[P], target: Point2) -> Option<(Point2, Point2)> {
    let (mut before, mut nearest, mut after) = (None, None, None);
    let mut best_squared = f64::INFINITY;
    let mut previous = None;
    let mut is_next = false;
    for point in distinct_points(points).map(Posed::point) {
        if is_next {
            after = Some(point);
        }
        let squared = (point - target).norm_squared();
        is_next = squared < best_squared || nearest.is_none();
        if is_next {
            best_squared = squared.min(best_squared);
            (before, nearest, after) = (previous, Some(point), None);
        }
        previous = Some(point);
    }
    match (before, nearest?, after) {
        (Some(before), nearest, Some(after)) if offset_along(nearest, after, target) <= 0.0 => {
            Some((before, nearest))
        }
        (_, nearest, Some(after)) => Some((nearest, after)),
        (Some(before), nearest, None) => Some((before, nearest)),
        (None, _, None) => None,
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use proptest::prelude::*;

    use super::*;

    const ANY: f64 = f64::INFINITY;

    fn path(points: &[(f64, f64)]) -> Vec<Pose> {
        points.iter().map(|&(x, y)| Pose::from_xy_yaw(x, y, 0.0)).collect()
    }

    fn p(x: f64, y: f64) -> Point2 {
        Point2::new(x, y)
    }

    #[test]
    fn nearest_point_is_the_first_of_equals() {
        let line = path(&[(0.0, 0.0), (2.0, 0.0), (2.0, 0.0), (4.0, 0.0)]);
        assert_eq!(find_nearest_index(&line, p(1.0, 5.0)), Some(0));
        assert_eq!(find_nearest_index(&line, p(2.1, 0.0)), Some(1));
        assert_eq!(find_nearest_index(&line, p(99.0, 0.0)), Some(3));
        assert_eq!(find_nearest_index::<Pose>(&[], p(0.0, 0.0)), None);
        assert_eq!(find_nearest_index(&path(&[(f64::NAN, 0.0), (1.0, 0.0)]), p(0.0, 0.0)), Some(1));
        assert_eq!(find_nearest_index(&path(&[(f64::NAN, 0.0)]), p(0.0, 0.0)), Some(0));
    }

    #[test]
    fn nearest_point_within_limits() {
        let poses = [(0.0, 0.0), (1.0, PI), (2.0, 0.1)].map(|(x, yaw)| Pose::from_xy_yaw(x, 0.0, yaw));
        let at = |x, distance, yaw| {
            find_nearest_index_within(&poses, &Pose::from_xy_yaw(x, 0.0, 0.0), distance, yaw)
        };
        assert_eq!(at(1.1, ANY, ANY), Some(1));
        assert_eq!(at(1.1, ANY, 0.5), Some(2));
        assert_eq!(at(1.1, 0.5, 0.5), None);
        assert_eq!(at(3.0, 1.0, ANY), Some(2), "limits are inclusive");
        assert_eq!(at(3.0, 0.999, ANY), None);
    }

    #[test]
    fn soft_limits_fall_back_one_by_one() {
        // out and back on the same line
        let poses = [(0.0, 0.0), (1.0, 0.0), (2.0, 0.0), (5.0, 0.0), (2.0, PI), (1.0, PI), (0.2, PI)]
            .map(|(x, yaw)| Pose::from_xy_yaw(x, 0.0, yaw));
        let at = |x, yaw, distance, max_yaw| {
            find_first_nearest_index_soft(&poses, &Pose::from_xy_yaw(x, 0.0, yaw), distance, max_yaw)
        };
        assert_eq!(at(0.9, 0.0, 1.5, 1.0), Some(1), "both limits");
        assert_eq!(at(0.9, PI, 1.5, 1.0), Some(5), "the way back");
        assert_eq!(at(0.9, PI / 2.0, 1.5, 1.0), Some(1), "distance alone");
        assert_eq!(at(20.0, 0.0, 1.5, 1.0), Some(3), "no limit");
        let twice = path(&[(0.0, 0.0), (1.0, 0.0), (2.0, 0.0), (9.0, 0.0), (1.2, 0.0)]);
        let target = Pose::from_xy_yaw(1.2, 0.0, 0.0);
        assert_eq!(
            find_first_nearest_index_soft(&twice, &target, 3.0, 1.0),
            Some(1),
            "the first pass, not the exact one"
        );
        assert_eq!(find_first_nearest_index_soft(&twice, &target, ANY, ANY), Some(4), "one run only");
        assert_eq!(find_first_nearest_index_soft::<Pose>(&[], &Pose::default(), 1.0, 1.0), None);
        let target = Pose::from_xy_yaw(0.9, 0.0, 0.0);
        assert_eq!(find_first_nearest_segment_soft(&poses, &target, 1.5, 1.0), Some(0));
    }

    #[test]
    fn offsets_along_a_segment() {
        let line = path(&[(0.0, 0.0), (0.0, 0.0), (3.0, 4.0), (9.0, 4.0), (9.0, 4.0)]);
        let at = |segment, x, y| longitudinal_offset_to_segment(&line, segment, p(x, y));
        assert_eq!(at(0, 3.0, 4.0), Some(5.0), "skips the doubled start");
        assert_eq!(at(1, -3.0, -4.0), Some(-5.0), "not clamped before");
        assert_eq!(at(2, 19.0, 7.0), Some(16.0), "nor after");
        assert_eq!(at(3, 0.0, 0.0), None, "only doubles follow");
        assert_eq!(at(4, 0.0, 0.0), None, "the last point starts no segment");
        assert_eq!(at(99, 0.0, 0.0), None);
    }

    #[test]
    fn points_this_close_are_one() {
        let line = path(&[(0.0, 0.0), (9e-9, 9e-9), (1.1e-8, 0.0), (1.0, 0.0), (1.0, 0.0)]);
        let kept: Vec<_> = distinct_points(&line).map(|pose| pose.position.x).collect();
        assert_eq!(kept, [0.0, 1.1e-8, 1.0], "measured from the last point kept");
    }

    #[test]
    fn nearest_segment_by_the_side_of_the_nearest_point() {
        let line = path(&[(0.0, 0.0), (1.0, 0.0), (2.0, 0.0), (3.0, 0.0)]);
        for (x, segment) in [(-5.0, 0), (0.4, 0), (0.9, 0), (1.0, 0), (1.1, 1), (2.6, 2), (3.0, 2), (9.0, 2)]
        {
            assert_eq!(find_nearest_segment(&line, p(x, 0.5)), Some(segment), "{x}");
        }
        assert_eq!(find_nearest_segment(&line[..1], p(5.0, 0.0)), Some(0));
        assert_eq!(find_nearest_segment::<Pose>(&[], p(5.0, 0.0)), None);
        // the point after the nearest one coincides with it to the end: no offset, so its own index
        let stopped = path(&[(0.0, 0.0), (1.0, 0.0), (1.0, 0.0)]);
        assert_eq!(find_nearest_segment(&stopped, p(0.9, 0.0)), Some(1));
    }

    #[test]
    fn lateral_offsets_are_positive_to_the_left() {
        let line = path(&[(0.0, 0.0), (0.0, 0.0), (10.0, 0.0), (10.0, 10.0)]);
        assert_eq!(lateral_offset(&line, p(5.0, 2.0), 0), Some(2.0));
        assert_eq!(lateral_offset(&line, p(5.0, -2.0), 0), Some(-2.0));
        assert_eq!(lateral_offset(&line, p(7.0, 5.0), 1), Some(3.0), "counted without doubles");
        assert_eq!(lateral_offset(&line, p(7.0, 5.0), 99), Some(3.0), "at most the last");
        assert_eq!(lateral_offset(&line[..2], p(5.0, 2.0), 0), None);
        assert_eq!(lateral_offset_to_nearest(&line, p(9.0, 8.0)), Some(1.0));
        assert_eq!(lateral_offset_to_nearest(&line, p(1.0, -3.0)), Some(-3.0));
        assert_eq!(lateral_offset_to_nearest(&line[..1], p(1.0, -3.0)), None);
        assert_eq!(lateral_offset_to_nearest::<Pose>(&[], p(1.0, -3.0)), None);
    }

    #[test]
    fn yaw_relative_to_the_nearest_segment() {
        let line = path(&[(0.0, 0.0), (0.0, 0.0), (10.0, 0.0), (10.0, 10.0)]);
        let at = |x, y, yaw| yaw_deviation_from(&line, &Pose::from_xy_yaw(x, y, yaw));
        assert!((at(1.0, 0.0, 0.2).unwrap() - 0.2).abs() < 1e-12);
        assert!((at(10.0, 9.0, 0.2).unwrap() - (0.2 - PI / 2.0)).abs() < 1e-12);
        assert_eq!(yaw_deviation_from(&line[..2], &Pose::default()), None);
    }

    prop_compose! {
        fn any_path()(
            points in prop::collection::vec((-3..3_i32, -3..3_i32), 1..12),
        ) -> Vec<Pose> {
            points.iter().map(|&(x, y)| Pose::from_xy_yaw(f64::from(x), f64::from(y), f64::from(x - y))).collect()
        }
    }

    proptest! {
        #[test]
        fn nothing_is_nearer_than_the_nearest(line in any_path(), x in -4.0..4.0_f64, y in -4.0..4.0_f64) {
            let nearest = find_nearest_index(&line, p(x, y)).unwrap();
            let d = |pose: &Pose| (pose.point() - p(x, y)).norm_squared();
            prop_assert!(line[..nearest].iter().all(|pose| d(pose) > d(&line[nearest])));
            prop_assert!(line[nearest..].iter().all(|pose| d(pose) >= d(&line[nearest])));
            let target = Pose::from_xy_yaw(x, y, 1.0);
            prop_assert_eq!(find_nearest_index_within(&line, &target, ANY, ANY), Some(nearest));
            prop_assert_eq!(find_first_nearest_index_soft(&line, &target, ANY, ANY), Some(nearest));
        }

        /// The walk without a list against upstream's way: remove overlaps, find the segment in what is left.
        #[test]
        fn distinct_segment_equals_the_one_of_a_cleaned_copy(
            line in any_path(), x in -8..8_i32, y in -8..8_i32,
        ) {
            // on a grid, where ties occur
            let (x, y) = (0.5 * f64::from(x), 0.5 * f64::from(y));
            let clean: Vec<Pose> = distinct_points(&line).copied().collect();
            let expected = (clean.len() >= 2).then(|| {
                let segment = find_nearest_segment(&clean, p(x, y)).unwrap();
                (clean[segment].point(), clean[segment + 1].point())
            });
            prop_assert_eq!(nearest_distinct_segment(&line, p(x, y)), expected);
            for segment in 0..line.len() {
                let expected = (clean.len() >= 2).then(|| {
                    let front = segment.min(clean.len() - 2);
                    offset_across(clean[front].point(), clean[front + 1].point(), p(x, y))
                });
                prop_assert_eq!(lateral_offset(&line, p(x, y), segment), expected);
            }
        }
    }
}
