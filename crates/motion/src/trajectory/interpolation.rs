//! Poses and points between the points of a trajectory.

use super::{Posed, TimeFromStart, TrajectoryPoint, find_first_nearest_segment_soft};
use crate::pose::{Orientation, Pose, interpolated_pose};
use crate::tolerance::{POINT_SEGMENT_M2, SEGMENT_LENGTH_M};

/// Pose at a distance along a path, measured in space from its first pose (`calcInterpolatedPose`). Before the start it
/// is the first pose, past the end the last: nothing is extrapolated. `None` only for no poses.
#[must_use]
pub fn pose_at_length<P: Posed>(points: &[P], length_m: f64, orientation: Orientation) -> Option<Pose> {
    let (first, last) = (points.first()?.pose(), points.last()?.pose());
    if points.len() < 2 || length_m < 0.0 {
        return Some(*first);
    }
    let mut before = 0.0;
    for pair in points.windows(2) {
        let (from, to) = (pair[0].pose(), pair[1].pose());
        let segment = (to.position - from.position).norm();
        if before + segment > length_m {
            let ratio = (length_m - before) / segment.max(SEGMENT_LENGTH_M);
            return Some(interpolated_pose(from, to, ratio, orientation));
        }
        before += segment;
    }
    Some(*last)
}

/// How speeds and acceleration behave between two trajectory points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Hold {
    /// They change linearly.
    Linear,
    /// They keep the value of the earlier point.
    Zero,
}

/// Trajectory point at the place on the trajectory nearest to a pose (`calcInterpolatedPoint`).
///
/// The segment is chosen by [`find_first_nearest_segment_soft`] with the two limits. The pose is turned along the
/// segment; heading rate, wheel angles and time are always linear; speeds and acceleration follow `hold`. No points
/// give a point at rest at `target`, and a segment shorter than about 3 cm gives its first point.
#[must_use]
pub fn interpolated_point(
    points: &[TrajectoryPoint],
    target: &Pose,
    hold: Hold,
    max_distance_m: f64,
    max_yaw_rad: f64,
) -> TrajectoryPoint {
    let Some(segment) = find_first_nearest_segment_soft(points, target, max_distance_m, max_yaw_rad) else {
        return TrajectoryPoint { pose: *target, ..TrajectoryPoint::default() };
    };
    let from = &points[segment];
    let Some(to) = points.get(segment + 1) else { return *from };
    let along = to.pose.position - from.pose.position;
    let squared = along.norm_squared();
    if squared < POINT_SEGMENT_M2 {
        return *from;
    }
    let ratio = (along.dot(&(target.position - from.pose.position)) / squared).clamp(0.0, 1.0);
    let linear = |a: f32, b: f32| (f64::from(a) + ratio * (f64::from(b) - f64::from(a))) as f32;
    let held = |a: f32, b: f32| if hold == Hold::Zero { a } else { linear(a, b) };
    TrajectoryPoint {
        time_from_start: interpolated_time(from.time_from_start, to.time_from_start, ratio),
        pose: interpolated_pose(&from.pose, &to.pose, ratio, Orientation::AlongPath),
        longitudinal_velocity_mps: held(from.longitudinal_velocity_mps, to.longitudinal_velocity_mps),
        lateral_velocity_mps: held(from.lateral_velocity_mps, to.lateral_velocity_mps),
        acceleration_mps2: held(from.acceleration_mps2, to.acceleration_mps2),
        heading_rate_rps: linear(from.heading_rate_rps, to.heading_rate_rps),
        front_wheel_angle_rad: linear(from.front_wheel_angle_rad, to.front_wheel_angle_rad),
        rear_wheel_angle_rad: linear(from.rear_wheel_angle_rad, to.rear_wheel_angle_rad),
    }
}

fn interpolated_time(from: TimeFromStart, to: TimeFromStart, ratio: f64) -> TimeFromStart {
    // Whole nanoseconds keep both ends exact.
    let step = to.nanos().saturating_sub(from.nanos()) as f64 * ratio;
    TimeFromStart::from_nanos(from.nanos().saturating_add(step.round() as i64))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point3;

    const ANY: f64 = f64::INFINITY;

    fn point(x: f64, sec: i32, velocity: f32) -> TrajectoryPoint {
        TrajectoryPoint {
            time_from_start: TimeFromStart::from_parts(sec, 0),
            pose: Pose::from_xy_yaw(x, 0.0, 0.0),
            longitudinal_velocity_mps: velocity,
            lateral_velocity_mps: -velocity,
            acceleration_mps2: velocity / 2.0,
            heading_rate_rps: velocity,
            front_wheel_angle_rad: velocity,
            rear_wheel_angle_rad: -velocity,
        }
    }

    #[test]
    fn poses_at_lengths() {
        let path = [0.0, 10.0, 20.0].map(|x| Pose::from_xy_yaw(x, 0.0, x / 20.0));
        for (length, x) in [(0.0, 0.0), (5.0, 5.0), (15.0, 15.0), (25.0, 20.0), (-3.0, 0.0), (10.0, 10.0)] {
            let pose = pose_at_length(&path, length, Orientation::Interpolated).unwrap();
            assert!((pose.position.x - x).abs() < 1e-12, "{length}: {}", pose.position);
            assert!((pose.yaw() - x / 20.0).abs() < 1e-9);
        }
        let along = pose_at_length(&path, 5.0, Orientation::AlongPath).unwrap();
        assert!(along.yaw().abs() < 1e-12, "turned along the segment");
        assert_eq!(pose_at_length(&path[..1], 5.0, Orientation::Interpolated), Some(path[0]));
        assert_eq!(pose_at_length::<Pose>(&[], 5.0, Orientation::Interpolated), None);
    }

    #[test]
    fn lengths_are_measured_in_space() {
        let slope = Pose { position: Point3::new(3.0, 0.0, 4.0), ..Pose::default() };
        let path = [Pose::default(), slope];
        let middle = pose_at_length(&path, 2.5, Orientation::Interpolated).unwrap();
        assert_eq!(middle.position, Point3::new(1.5, 0.0, 2.0));
    }

    #[test]
    fn points_between_points() {
        let points = [point(0.0, 0, 0.0), point(10.0, 1, 4.0), point(20.0, 2, 8.0)];
        let at = |x: f64, hold| interpolated_point(&points, &Pose::from_xy_yaw(x, 1.0, 0.1), hold, ANY, ANY);
        let linear = at(12.5, Hold::Linear);
        assert_eq!(linear.pose.position, Point3::new(12.5, 0.0, 0.0));
        assert_eq!(linear.time_from_start.nanos(), 1_250_000_000);
        assert_eq!(linear.longitudinal_velocity_mps, 5.0);
        assert_eq!(linear.lateral_velocity_mps, -5.0);
        assert_eq!(linear.acceleration_mps2, 2.5);
        let held = at(12.5, Hold::Zero);
        assert_eq!((held.longitudinal_velocity_mps, held.lateral_velocity_mps), (4.0, -4.0));
        assert_eq!(held.acceleration_mps2, 2.0);
        assert_eq!(
            (held.heading_rate_rps, held.front_wheel_angle_rad, held.rear_wheel_angle_rad),
            (5.0, 5.0, -5.0)
        );
        assert_eq!(at(-5.0, Hold::Linear), points[0], "clamped at the start");
        assert_eq!(at(99.0, Hold::Linear), points[2], "clamped at the end");
    }

    #[test]
    fn too_few_points_to_interpolate() {
        let target = Pose::from_xy_yaw(3.0, 4.0, 0.5);
        let none = interpolated_point(&[], &target, Hold::Linear, ANY, ANY);
        assert_eq!(none, TrajectoryPoint { pose: target, ..Default::default() });
        let only = point(1.0, 5, 2.0);
        assert_eq!(interpolated_point(&[only], &target, Hold::Linear, ANY, ANY), only);
        let close = [point(0.0, 0, 1.0), point(0.03, 1, 2.0)];
        assert_eq!(interpolated_point(&close, &target, Hold::Linear, ANY, ANY), close[0]);
    }
}
