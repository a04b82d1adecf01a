//! Poses in the plane, and the gear between two of them.

use motion::Point2;
use motion::pose::normalize_radian;

/// Pose of the middle of the rear axle in the plane.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PlanarPose {
    /// m.
    pub x: f64,
    /// m.
    pub y: f64,
    /// Heading of the vehicle (not of its travel), rad, counter-clockwise from the x axis, any real number.
    pub yaw: f64,
}

impl PlanarPose {
    /// Pose at `(x, y)` with heading `yaw`.
    #[must_use]
    pub const fn new(x: f64, y: f64, yaw: f64) -> Self {
        Self { x, y, yaw }
    }

    /// Position.
    #[must_use]
    pub fn point(&self) -> Point2 {
        Point2::new(self.x, self.y)
    }

    /// Whether all three numbers are finite.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        self.x.is_finite() && self.y.is_finite() && self.yaw.is_finite()
    }

    /// Distance to `other`, m.
    #[must_use]
    pub fn distance_m(&self, other: &Self) -> f64 {
        (other.x - self.x).hypot(other.y - self.y)
    }

    /// Heading of `other` minus ours, in [-pi, pi).
    #[must_use]
    pub fn yaw_to(&self, other: &Self) -> f64 {
        normalize_radian(other.yaw - self.yaw)
    }
}

/// Direction of motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Gear {
    /// Along the heading.
    Forward,
    /// Against the heading.
    Reverse,
}

impl Gear {
    /// 1 forward, -1 in reverse.
    #[must_use]
    pub const fn sign(self) -> f64 {
        match self {
            Self::Forward => 1.0,
            Self::Reverse => -1.0,
        }
    }

    /// The other gear.
    #[must_use]
    pub const fn reversed(self) -> Self {
        match self {
            Self::Forward => Self::Reverse,
            Self::Reverse => Self::Forward,
        }
    }
}
