//! Trajectories as slices of points, and the questions asked of them: nearest point, arc length, lateral offset,
//! interpolation, direction of travel, steering.
//!
//! Counterpart of `autoware_motion_utils`. Where upstream throws on an empty slice or answers not-a-number, the answer
//! here is `None`.

mod arc_length;
mod direction;
mod interpolation;
mod nearest;
mod steering;

pub use arc_length::{
    arc_length_between, arc_length_between_points, arc_length_from_point, arc_length_to_point, crop_forward,
    cumulative_arc_length,
};
pub use direction::{is_driving_forward, is_driving_forward_with_velocity};
pub use interpolation::{Hold, interpolated_point, pose_at_length};
pub use nearest::{
    distinct_points, find_first_nearest_index_soft, find_first_nearest_segment_soft, find_nearest_index,
    find_nearest_index_within, find_nearest_segment, lateral_offset, lateral_offset_to_nearest,
    longitudinal_offset_to_segment, yaw_deviation_from,
};
pub use steering::{FIRST_SMOOTHED_INDEX, smoothed_steering_angles};

use crate::geometry::Point2;
use crate::pose::Pose;

const NANOS_PER_SECOND: i64 = 1_000_000_000;

/// Anything that has a pose: poses themselves and trajectory points.
pub trait Posed {
    /// Pose of the base_link.
    fn pose(&self) -> &Pose;

    /// x and y of the position \[m\].
    #[inline]
    fn point(&self) -> Point2 {
        self.pose().point()
    }
}

impl Posed for Pose {
    #[inline]
    fn pose(&self) -> &Pose {
        self
    }
}

/// Time of a trajectory point after the stamp of its trajectory; may be negative (behind the vehicle).
///
/// Whole nanoseconds are kept for exact arithmetic, and beside them the seconds that filters compare.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TimeFromStart {
    nanos: i64,
    seconds: f64,
}

impl TimeFromStart {
    /// From the two parts of a `builtin_interfaces/Duration`, also unnormalised ones.
    #[must_use]
    #[inline]
    pub fn from_parts(sec: i32, nanosec: u32) -> Self {
        Self {
            nanos: i64::from(sec) * NANOS_PER_SECOND + i64::from(nanosec),
            seconds: f64::from(sec) + f64::from(nanosec) * 1e-9,
        }
    }

    /// From whole nanoseconds.
    #[must_use]
    #[inline]
    pub fn from_nanos(nanos: i64) -> Self {
        let (sec, nanosec) = (nanos.div_euclid(NANOS_PER_SECOND), nanos.rem_euclid(NANOS_PER_SECOND));
        Self { nanos, seconds: sec as f64 + nanosec as f64 * 1e-9 }
    }

    /// Whole nanoseconds.
    #[must_use]
    #[inline]
    pub fn nanos(self) -> i64 {
        self.nanos
    }

    /// Seconds, rounded as upstream rounds them: `sec + nanosec * 1e-9`.
    #[must_use]
    #[inline]
    pub fn seconds(self) -> f64 {
        self.seconds
    }
}

/// One point of a trajectory (`autoware_planning_msgs/TrajectoryPoint`). The motion fields are 32-bit as on the wire;
/// widen them before comparing with limits.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TrajectoryPoint {
    /// Time after the stamp of the trajectory.
    pub time_from_start: TimeFromStart,
    /// Pose of the base_link in the map frame.
    pub pose: Pose,
    /// Speed along the vehicle, negative in reverse \[m/s\].
    pub longitudinal_velocity_mps: f32,
    /// Speed across the vehicle, positive to the left \[m/s\].
    pub lateral_velocity_mps: f32,
    /// Acceleration along the vehicle \[m/s²\].
    pub acceleration_mps2: f32,
    /// Yaw rate, positive to the left \[rad/s\].
    pub heading_rate_rps: f32,
    /// Angle of the front wheels, positive to the left \[rad\].
    pub front_wheel_angle_rad: f32,
    /// Angle of the rear wheels, positive to the left \[rad\].
    pub rear_wheel_angle_rad: f32,
}

impl Posed for TrajectoryPoint {
    #[inline]
    fn pose(&self) -> &Pose {
        &self.pose
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn parts_of_a_time() {
        let t = TimeFromStart::from_parts(1, 500_000_000);
        assert_eq!((t.nanos(), t.seconds()), (1_500_000_000, 1.5));
        let before = TimeFromStart::from_parts(-1, 900_000_000);
        assert_eq!(before.nanos(), -100_000_000);
        assert!((before.seconds() + 0.1).abs() < 1e-15);
        assert_eq!(TimeFromStart::from_nanos(-100_000_000), before);
        // a second written in nanoseconds, as no well-behaved sender does
        let odd = TimeFromStart::from_parts(0, 4_000_000_000);
        assert_eq!((odd.nanos(), odd.seconds()), (4_000_000_000, 4.0));
    }

    proptest! {
        #[test]
        fn nanoseconds_and_parts_agree(sec in any::<i32>(), nanosec in 0..1_000_000_000_u32) {
            let t = TimeFromStart::from_parts(sec, nanosec);
            prop_assert_eq!(TimeFromStart::from_nanos(t.nanos()), t);
        }
    }
}
