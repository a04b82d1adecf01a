//! Whether a trajectory is driven forward or in reverse.

use super::{Posed, TrajectoryPoint};
use crate::pose;
use crate::tolerance::DRIVING_DIRECTION_M;

/// True when the first pose faces the first later point at least [`DRIVING_DIRECTION_M`] away, false when it faces
/// away from it, `None` when there is no such point (`isDrivingForward`).
#[must_use]
pub fn is_driving_forward<P: Posed>(points: &[P]) -> Option<bool> {
    let (first, rest) = points.split_first()?;
    let start = first.point();
    let ahead = rest.iter().map(Posed::point).find(|point| (point - start).norm() >= DRIVING_DIRECTION_M)?;
    Some(pose::is_driving_forward(first.pose(), ahead))
}

/// As [`is_driving_forward`]; a single point is judged by the sign of its velocity, `None` at standstill
/// (`isDrivingForwardWithTwist`).
#[must_use]
pub fn is_driving_forward_with_velocity(points: &[TrajectoryPoint]) -> Option<bool> {
    if let [only] = points {
        let velocity = only.longitudinal_velocity_mps;
        return if velocity > 0.0 {
            Some(true)
        } else if velocity < 0.0 {
            Some(false)
        } else {
            None
        };
    }
    is_driving_forward(points)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use crate::pose::Pose;

    #[test]
    fn direction_of_travel() {
        let at = Pose::from_xy_yaw;
        let cases = [
            ("no point", vec![], None),
            ("one point", vec![at(0.0, 0.0, 0.0)], None),
            ("forward", vec![at(0.0, 0.0, 0.0), at(1.0, 0.5, 0.0)], Some(true)),
            ("reverse", vec![at(0.0, 0.0, PI), at(1.0, 0.5, PI)], Some(false)),
            ("standing", vec![at(0.0, 0.0, 0.0), at(0.009, 0.0, 0.0)], None),
            ("jitter back", vec![at(0.0, 0.0, 0.0), at(-0.009, 0.0, 0.0), at(0.01, 0.0, 0.0)], Some(true)),
            ("beside", vec![at(0.0, 0.0, 0.0), at(0.0, 1.0, 0.0)], Some(false)),
        ];
        for (name, poses, expected) in cases {
            assert_eq!(is_driving_forward(&poses), expected, "{name}");
        }
    }

    #[test]
    fn one_point_goes_by_its_velocity() {
        for (velocity, expected) in [(1.0, Some(true)), (-1.0, Some(false)), (0.0, None), (f32::NAN, None)] {
            let point = TrajectoryPoint { longitudinal_velocity_mps: velocity, ..Default::default() };
            assert_eq!(is_driving_forward_with_velocity(&[point]), expected);
        }
        let back = [0.0, -1.0]
            .map(|x| TrajectoryPoint { pose: Pose::from_xy_yaw(x, 0.0, 0.0), ..Default::default() });
        assert_eq!(is_driving_forward_with_velocity(&back), Some(false));
    }
}
