//! A planned motion, sample by sample.

use crate::pose::{Gear, PlanarPose};

/// One sample of a planned motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrajectoryPoint {
    /// Time since the start of the plan, s; strictly increases along a trajectory.
    pub time_s: f64,
    /// Where the middle of the rear axle is.
    pub pose: PlanarPose,
    /// Curvature dyaw/ds with ds negative in reverse, 1/m; equals tan(steering angle) / wheel base in both gears.
    pub curvature: f64,
    /// Along the heading, negative in reverse, m/s.
    pub speed_mps: f64,
    /// Rate of change of `speed_mps`, m/s².
    pub acceleration_mps2: f64,
    /// Angle of the front wheels, positive to the left, rad.
    pub steer_rad: f64,
    /// Gear of the motion that leaves this point (at the last point: of the motion that reached it).
    pub gear: Gear,
}

/// A planned motion. At a change of gear the cusp is one point at rest.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Trajectory {
    /// Samples in order of time.
    pub points: Vec<TrajectoryPoint>,
}
