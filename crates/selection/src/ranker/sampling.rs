//! A candidate at equal steps of time, from where the vehicle is.

use crate::parameters::EvaluationParameters;
use motion::pose::{Orientation, interpolated_pose};
use motion::trajectory::find_nearest_index_within;
use motion::{Pose, TrajectoryPoint};
use std::f64::consts::FRAC_PI_2;

/// Farthest that the vehicle may be from a candidate's nearest point \[m\].
const MAX_DISTANCE_M: f64 = 10.0;
/// Most that the vehicle's yaw may differ from that point's \[rad\].
const MAX_YAW_RAD: f64 = FRAC_PI_2;

/// Samples of the points from the one nearest to the vehicle on. Empty if none is near enough to `ego`.
///
/// Between points everything is linear and the vehicle faces along the path; outside the time that the points cover the
/// last one is repeated. Of points with equal times the earlier one counts.
#[must_use]
pub fn samples(
    points: &[TrajectoryPoint],
    ego: &Pose,
    parameters: &EvaluationParameters,
) -> Vec<TrajectoryPoint> {
    let Some(nearest) = find_nearest_index_within(points, ego, MAX_DISTANCE_M, MAX_YAW_RAD) else {
        return Vec::new();
    };
    let start_s = points[nearest].time_from_start.seconds();
    let count = usize::try_from(parameters.sampling_number).unwrap_or(0);
    let time_s = |index: usize| start_s + index as f64 * parameters.sampling_resolution;
    (0..count).filter_map(|index| point_at(points, time_s(index))).collect()
}

/// The trajectory at a time; `None` only for no points.
fn point_at(points: &[TrajectoryPoint], time_s: f64) -> Option<TrajectoryPoint> {
    let last = *points.last()?;
    let seconds = |point: &TrajectoryPoint| point.time_from_start.seconds();
    // Times never decrease.
    let after = points.partition_point(|point| seconds(point) <= time_s);
    let Some((from, to)) =
        after.checked_sub(1).and_then(|before| Some((&points[before], points.get(after)?)))
    else {
        return Some(last);
    };
    let ratio = (time_s - seconds(from)) / (seconds(to) - seconds(from));
    let share = ratio as f32;
    let linear = |a: f32, b: f32| a + share * (b - a);
    Some(TrajectoryPoint {
        pose: interpolated_pose(&from.pose, &to.pose, ratio, Orientation::AlongPath),
        longitudinal_velocity_mps: linear(from.longitudinal_velocity_mps, to.longitudinal_velocity_mps),
        lateral_velocity_mps: linear(from.lateral_velocity_mps, to.lateral_velocity_mps),
        acceleration_mps2: linear(from.acceleration_mps2, to.acceleration_mps2),
        ..*from
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_scene::straight;

    fn sampled(points: &[TrajectoryPoint], ego: Pose, number: i64, resolution_s: f64) -> Vec<f64> {
        let parameters = EvaluationParameters {
            sampling_number: number,
            sampling_resolution: resolution_s,
            ..EvaluationParameters::default()
        };
        samples(points, &ego, &parameters).iter().map(|point| point.pose.position.x).collect()
    }

    fn close(found: &[f64], expected: &[f64]) {
        let equal = found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-6);
        assert!(equal && found.len() == expected.len(), "{found:?} instead of {expected:?}");
    }

    #[test]
    fn samples_begin_at_the_point_nearest_to_the_vehicle() {
        // 0.5 m apart, from 0 to 4.5 m.
        let points = straight(10, 5.0);
        let at = |x: f64, y: f64, yaw: f64| sampled(&points, Pose::from_xy_yaw(x, y, yaw), 4, 0.25);
        close(&at(0.0, 0.0, 0.0), &[0.0, 1.25, 2.5, 3.75]);
        close(&at(1.2, 3.0, 1.5), &[1.0, 2.25, 3.5, 4.5]);
        assert!(at(0.0, 10.1, 0.0).is_empty(), "too far");
        assert!(at(0.0, 0.0, 1.6).is_empty(), "facing away");
    }

    #[test]
    fn outside_the_time_of_the_points_the_last_one_is_repeated() {
        let points = straight(3, 5.0);
        close(&sampled(&points, Pose::default(), 6, 0.1), &[0.0, 0.5, 1.0, 1.0, 1.0, 1.0]);
        assert!(sampled(&[], Pose::default(), 6, 0.1).is_empty());
        assert_eq!(point_at(&points, -0.1).unwrap(), points[2]);
        assert_eq!(point_at(&points[..1], 0.0).unwrap(), points[0]);
    }

    #[test]
    fn speeds_are_linear_and_the_vehicle_faces_along_the_path() {
        let mut points = straight(2, 5.0);
        points[1].longitudinal_velocity_mps = 7.0;
        points[1].lateral_velocity_mps = 1.0;
        points[1].acceleration_mps2 = -4.0;
        points[0].pose = Pose::from_xy_yaw(0.0, 0.0, 0.3);
        let middle = point_at(&points, 0.025).unwrap();
        assert_eq!(middle.longitudinal_velocity_mps, 5.5);
        assert_eq!(middle.lateral_velocity_mps, 0.25);
        assert_eq!(middle.acceleration_mps2, -1.0);
        assert!(middle.pose.yaw().abs() < 1e-12);
    }
}
