//! Poses in the map frame, angles, and interpolation between poses.
//!
//! Quaternions are taken as they come: nothing normalises them unless it says so. Yaw is that of the full
//! three-dimensional orientation.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use crate::geometry::{Point2, Point3, Vector2};
use crate::tolerance::{DIRECTION_M, END_RATIO};

/// Brings an angle into [-π, π) \[rad\] (`autoware_utils_math::normalize_radian`). Not-a-number stays so.
#[must_use]
#[inline]
pub fn normalize_radian(angle_rad: f64) -> f64 {
    // The remainder is the identity on this range, and nearly every angle is in it already.
    if (-PI..PI).contains(&angle_rad) {
        return angle_rad;
    }
    let value = angle_rad % TAU;
    if (-PI..PI).contains(&value) { value } else { value - TAU.copysign(value) }
}

/// Yaw \[rad\] of the direction from one point to another, 0 for equal points (`calc_azimuth_angle`).
#[must_use]
#[inline]
pub fn azimuth(from: Point2, to: Point2) -> f64 {
    (to.y - from.y).atan2(to.x - from.x)
}

/// Yaw of `target` relative to `base` \[rad\] in [-π, π), positive to the left (`calc_yaw_deviation`).
#[must_use]
#[inline]
pub fn yaw_deviation(base: &Pose, target: &Pose) -> f64 {
    normalize_radian(target.yaw() - base.yaw())
}

/// Orientation as a quaternion; the default is the identity (0, 0, 0, 1).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quaternion {
    /// First imaginary part.
    pub x: f64,
    /// Second imaginary part.
    pub y: f64,
    /// Third imaginary part.
    pub z: f64,
    /// Real part.
    pub w: f64,
}

impl Default for Quaternion {
    fn default() -> Self {
        Self::IDENTITY
    }
}

impl Quaternion {
    /// No rotation.
    pub const IDENTITY: Self = Self { x: 0.0, y: 0.0, z: 0.0, w: 1.0 };

    /// Rotation about the z axis \[rad\], positive to the left.
    #[must_use]
    #[inline]
    pub fn from_yaw(yaw_rad: f64) -> Self {
        let (z, w) = (yaw_rad * 0.5).sin_cos();
        Self { x: 0.0, y: 0.0, z, w }
    }

    /// Rotation about x, then about y, then about z of the fixed frame \[rad\] (`tf2::Quaternion::setRPY`).
    #[must_use]
    pub fn from_roll_pitch_yaw(roll_rad: f64, pitch_rad: f64, yaw_rad: f64) -> Self {
        let (sr, cr) = (roll_rad * 0.5).sin_cos();
        let (sp, cp) = (pitch_rad * 0.5).sin_cos();
        let (sy, cy) = (yaw_rad * 0.5).sin_cos();
        Self {
            x: sr * cp * cy - cr * sp * sy,
            y: cr * sp * cy + sr * cp * sy,
            z: cr * cp * sy - sr * sp * cy,
            w: cr * cp * cy + sr * sp * sy,
        }
    }

    fn dot(&self, other: &Self) -> f64 {
        self.x * other.x + self.y * other.y + self.z * other.z + self.w * other.w
    }

    /// The rotated x axis seen from above, times the squared length of the quaternion.
    #[inline]
    fn scaled_heading(&self) -> Vector2 {
        let Self { x, y, z, w } = *self;
        Vector2::new(w * w + x * x - y * y - z * z, 2.0 * (x * y + w * z))
    }

    /// Yaw \[rad\] in [-π, π] of the x axis seen from above, whatever the length of the quaternion; 0 for the zero
    /// quaternion (`tf2::getYaw`, but without its special case within 0.3° of straight up or down, where its answer
    /// is half a turn off).
    #[must_use]
    #[inline]
    pub fn yaw(&self) -> f64 {
        let heading = self.scaled_heading();
        heading.y.atan2(heading.x)
    }

    /// Unit vector of the yaw: `(cos yaw, sin yaw)`, without trigonometry.
    #[must_use]
    #[inline]
    pub fn heading(&self) -> Vector2 {
        let heading = self.scaled_heading();
        let norm = heading.norm();
        if norm == 0.0 { Vector2::new(1.0, 0.0) } else { heading / norm }
    }

    /// Spherical interpolation along the shorter arc (`tf2::slerp`): `self` at ratio 0, `other` (or its equal
    /// opposite) at 1. The ratio is not clamped.
    #[must_use]
    pub fn slerp(&self, other: &Self, ratio: f64) -> Self {
        let sign = if self.dot(other) < 0.0 { -1.0 } else { 1.0 };
        let scale = (self.dot(self) * other.dot(other)).sqrt();
        let half_angle = (sign * self.dot(other) / scale).clamp(-1.0, 1.0).acos();
        if half_angle == 0.0 {
            return *self;
        }
        let d = 1.0 / half_angle.sin();
        let s0 = ((1.0 - ratio) * half_angle).sin() * d;
        let s1 = (ratio * half_angle).sin() * d * sign;
        Self {
            x: self.x * s0 + other.x * s1,
            y: self.y * s0 + other.y * s1,
            z: self.z * s0 + other.z * s1,
            w: self.w * s0 + other.w * s1,
        }
    }
}

/// Position \[m\] and orientation in the map frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Position \[m\].
    pub position: Point3,
    /// Orientation, not necessarily of unit length.
    pub orientation: Quaternion,
}

impl Default for Pose {
    /// At the origin, facing along x.
    fn default() -> Self {
        Self { position: Point3::origin(), orientation: Quaternion::IDENTITY }
    }
}

impl Pose {
    /// A pose on the ground plane z = 0, position in metres, yaw in radians.
    #[must_use]
    pub fn from_xy_yaw(x: f64, y: f64, yaw_rad: f64) -> Self {
        Self { position: Point3::new(x, y, 0.0), orientation: Quaternion::from_yaw(yaw_rad) }
    }

    /// x and y of the position \[m\].
    #[must_use]
    #[inline]
    pub fn point(&self) -> Point2 {
        Point2::new(self.position.x, self.position.y)
    }

    /// Yaw \[rad\], see [`Quaternion::yaw`].
    #[must_use]
    #[inline]
    pub fn yaw(&self) -> f64 {
        self.orientation.yaw()
    }

    /// `(cos yaw, sin yaw)`, see [`Quaternion::heading`].
    #[must_use]
    #[inline]
    pub fn heading(&self) -> Vector2 {
        self.orientation.heading()
    }

    /// How this pose moves points of its own plane z = 0, seen from above.
    ///
    /// The rotation is that of the full quaternion as it is, not normalised, so roll and pitch shrink an outline
    /// (`autoware_utils_geometry::transform_vector` by way of Eigen).
    #[must_use]
    #[inline]
    pub fn planar_transform(&self) -> PlanarTransform {
        let Quaternion { x, y, z, w } = self.orientation;
        PlanarTransform {
            x_axis: Vector2::new(1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z)),
            y_axis: Vector2::new(2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z)),
            origin: self.point(),
        }
    }
}

/// The part of a pose that acts on the ground plane; worth keeping when several points go through one pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlanarTransform {
    x_axis: Vector2,
    y_axis: Vector2,
    origin: Point2,
}

impl PlanarTransform {
    /// The point (x, y, 0) of the pose's frame in the map frame, x and y only \[m\].
    #[must_use]
    #[inline]
    pub fn apply(&self, local: Point2) -> Point2 {
        Point2::new(
            self.x_axis.x * local.x + self.y_axis.x * local.y + self.origin.x,
            self.x_axis.y * local.x + self.y_axis.y * local.y + self.origin.y,
        )
    }
}

/// Where the orientation of an interpolated pose comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Orientation {
    /// Spherical interpolation of both orientations.
    Interpolated,
    /// Along the line between the two positions (roll 0), facing the way the first pose drives it.
    AlongPath,
}

/// Pose between `from` (ratio 0) and `to` (ratio 1); the ratio is clamped, the position linear
/// (`autoware_utils_geometry::calc_interpolated_pose`).
///
/// With [`Orientation::AlongPath`] the direction driven is forward if the yaw of `from` is within π/2 of the line to
/// `to`. A forward pose takes the azimuth of the line (also at ratio 0) but the orientation of `to` at its end; a
/// backward pose takes the reversed azimuth but the orientation of `from` at its start. Positions closer than
/// [`DIRECTION_M`] take the orientation of `to`. Pitch is the elevation of the line, up positive as upstream has it.
#[must_use]
pub fn interpolated_pose(from: &Pose, to: &Pose, ratio: f64, orientation: Orientation) -> Pose {
    let ratio = ratio.clamp(0.0, 1.0);
    let position = from.position + (to.position - from.position) * ratio;
    let orientation = match orientation {
        Orientation::Interpolated => from.orientation.slerp(&to.orientation, ratio),
        Orientation::AlongPath => orientation_along_path(from, to, position, ratio),
    };
    Pose { position, orientation }
}

fn orientation_along_path(from: &Pose, to: &Pose, position: Point3, ratio: f64) -> Quaternion {
    let forward = is_driving_forward(from, to.point());
    if (forward && ratio > 1.0 - END_RATIO) || (to.point() - from.point()).norm() < DIRECTION_M {
        return to.orientation;
    }
    if !forward && ratio < END_RATIO {
        return from.orientation;
    }
    let ahead = if forward { to.position } else { from.position } - position;
    let pitch = ahead.z.atan2(ahead.xy().norm());
    let yaw = ahead.y.atan2(ahead.x);
    Quaternion::from_roll_pitch_yaw(0.0, pitch, yaw)
}

/// True when a pose faces the point it drives to: its yaw is less than π/2 off the azimuth of the point
/// (`autoware_utils_geometry::is_driving_forward`).
#[must_use]
#[inline]
pub fn is_driving_forward(from: &Pose, to: Point2) -> bool {
    normalize_radian(from.yaw() - azimuth(from.point(), to)).abs() < FRAC_PI_2
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const DEG: f64 = PI / 180.0;

    fn close(actual: f64, expected: f64) {
        assert!((actual - expected).abs() < 1e-9, "{actual} instead of {expected}");
    }

    #[test]
    fn normalised_range_is_half_open() {
        assert_eq!(normalize_radian(PI), -PI);
        assert_eq!(normalize_radian(-PI), -PI);
        assert_eq!(normalize_radian(0.0), 0.0);
        close(normalize_radian(3.0 * PI / 2.0), -FRAC_PI_2);
        close(normalize_radian(-3.0 * PI / 2.0), FRAC_PI_2);
        assert!(normalize_radian(f64::NAN).is_nan());
        assert!(normalize_radian(f64::INFINITY).is_nan());
    }

    #[test]
    fn yaw_of_odd_quaternions() {
        let zero = Quaternion { x: 0.0, y: 0.0, z: 0.0, w: 0.0 };
        assert_eq!(zero.yaw(), 0.0);
        assert_eq!(zero.heading(), Vector2::new(1.0, 0.0));
        close(Quaternion { z: 3.0, w: 3.0, ..zero }.yaw(), FRAC_PI_2);
        close(Quaternion::from_roll_pitch_yaw(0.0, 1.57, 0.4).yaw(), 0.4);
    }

    #[test]
    fn yaw_deviation_is_positive_to_the_left() {
        let base = Pose::from_xy_yaw(0.0, 0.0, 170.0 * DEG);
        close(yaw_deviation(&base, &Pose::from_xy_yaw(5.0, 5.0, -170.0 * DEG)), 20.0 * DEG);
        close(yaw_deviation(&base, &Pose::from_xy_yaw(5.0, 5.0, 160.0 * DEG)), -10.0 * DEG);
    }

    #[test]
    fn slerp_takes_the_shorter_arc() {
        let a = Quaternion::from_yaw(0.0);
        let b = Quaternion::from_yaw(60.0 * DEG);
        close(a.slerp(&b, 0.5).yaw(), 30.0 * DEG);
        let opposite = Quaternion { x: -b.x, y: -b.y, z: -b.z, w: -b.w };
        close(a.slerp(&opposite, 0.5).yaw(), 30.0 * DEG);
        assert_eq!(a.slerp(&a, 0.3), a);
    }

    #[test]
    fn planar_transform_does_not_normalise() {
        let pose = Pose {
            position: Point3::new(1.0, 2.0, 3.0),
            orientation: Quaternion { x: 0.0, y: 0.0, z: 1.0, w: 1.0 },
        };
        // A quarter turn of length sqrt(2): Eigen's matrix of it is [[-1, -2], [2, -1]].
        assert_eq!(pose.planar_transform().apply(Point2::new(1.0, 0.0)), Point2::new(0.0, 4.0));
        assert_eq!(pose.planar_transform().apply(Point2::new(0.0, 1.0)), Point2::new(-1.0, 1.0));
    }

    #[test]
    fn interpolated_orientation_follows_the_path() {
        let from = Pose::from_xy_yaw(0.0, 0.0, 0.0);
        let to = Pose::from_xy_yaw(1.0, 1.0, 1.0);
        let along = |a: &Pose, b: &Pose, r| interpolated_pose(a, b, r, Orientation::AlongPath).yaw();
        close(along(&from, &to, 0.0), 45.0 * DEG);
        close(along(&from, &to, 0.5), 45.0 * DEG);
        close(along(&from, &to, 1.0), 1.0);
        close(along(&from, &to, 7.0), 1.0);
        // reversing: the vehicle faces away from where it goes
        let (from, back) = (Pose::from_xy_yaw(0.0, 0.0, 0.2), Pose::from_xy_yaw(-1.0, -1.0, 1.0));
        close(along(&from, &back, 0.0), 0.2);
        close(along(&from, &back, 0.5), 45.0 * DEG);
        close(along(&from, &back, 1.0), 45.0 * DEG);
        // no direction within a millimetre
        close(along(&from, &Pose::from_xy_yaw(0.0005, 0.0005, 1.0), 0.2), 1.0);
    }

    #[test]
    fn interpolated_position_is_linear_and_clamped() {
        let from = Pose::default();
        let mut to = Pose::from_xy_yaw(4.0, 8.0, 60.0 * DEG);
        to.position.z = 2.0;
        let at = |r| interpolated_pose(&from, &to, r, Orientation::Interpolated);
        assert_eq!(at(0.25).position, Point3::new(1.0, 2.0, 0.5));
        close(at(0.5).yaw(), 30.0 * DEG);
        assert_eq!(at(-1.0), from);
        assert_eq!(at(2.0).position, to.position);
    }

    proptest! {
        #[test]
        fn normalising_keeps_the_direction(angle in -1e4..1e4_f64) {
            let n = normalize_radian(angle);
            prop_assert!((-PI..PI).contains(&n));
            prop_assert!((n.sin() - angle.sin()).abs() < 1e-9 && (n.cos() - angle.cos()).abs() < 1e-9);
        }

        #[test]
        fn yaw_survives_roll_pitch_and_scale(
            roll in -1.0..1.0_f64, pitch in -1.4..1.4_f64, yaw in -3.1..3.1_f64, scale in 0.1..10.0_f64,
        ) {
            let q = Quaternion::from_roll_pitch_yaw(roll, pitch, yaw);
            let q = Quaternion { x: q.x * scale, y: q.y * scale, z: q.z * scale, w: q.w * scale };
            prop_assert!((q.yaw() - yaw).abs() < 1e-9);
            prop_assert!((q.heading() - Vector2::new(yaw.cos(), yaw.sin())).norm() < 1e-9);
        }

        #[test]
        fn slerp_turns_evenly(a in -3.1..3.1_f64, turn in -3.0..3.0_f64, r in 0.0..1.0_f64) {
            let q = Quaternion::from_yaw(a).slerp(&Quaternion::from_yaw(a + turn), r);
            prop_assert!(normalize_radian(q.yaw() - (a + r * turn)).abs() < 1e-7);
        }
    }
}
