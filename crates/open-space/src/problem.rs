//! What is to be planned: a vehicle, its surroundings, where it stands and where it shall stand.

use motion::{Point2, VehicleInfo};

use crate::pose::PlanarPose;

/// A planning problem in one plane frame (the region of interest's or the map's; the planner moves it where it
/// calculates best).
#[derive(Clone, Debug)]
pub struct Problem {
    /// Dimensions, wheel base and steering limit.
    pub vehicle: VehicleInfo,
    /// Limits of the motion.
    pub limits: Limits,
    /// Box that the reference point must not leave: x_min, x_max, y_min, y_max, m.
    pub bounds: [f64; 4],
    /// Polylines, m. A closed one (first vertex = last) is a solid polygon, an open one a wall.
    pub obstacles: Vec<Vec<Point2>>,
    /// Where the vehicle stands.
    pub start: PlanarPose,
    /// Speed at the start along the heading, m/s.
    pub start_speed_mps: f64,
    /// Acceleration at the start, m/s².
    pub start_acceleration_mps2: f64,
    /// Curvature that the front wheels are turned to at the start, 1/m, to the left; `None` where that is not known. Only
    /// a vehicle that rolls must go on with it: at rest the wheels turn on the spot.
    pub start_curvature: Option<f64>,
    /// Where it shall come to rest.
    pub goal: PlanarPose,
}

/// Limits of a parking motion. All are positive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// m/s.
    pub max_speed_forward_mps: f64,
    /// m/s, a positive number.
    pub max_speed_reverse_mps: f64,
    /// Of speeding up and braking, m/s².
    pub max_acceleration_mps2: f64,
    /// m/s³.
    pub max_jerk_mps3: f64,
    /// Of the front wheels, rad/s.
    pub max_steer_rate_rps: f64,
}

impl Limits {
    /// Smallest limit of any kind: below it a manoeuvre takes hours, and millions of points.
    pub const SMALLEST: f64 = 0.01;
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            max_speed_forward_mps: 2.0,
            max_speed_reverse_mps: 1.0,
            max_acceleration_mps2: 1.0,
            max_jerk_mps3: 2.0,
            max_steer_rate_rps: 0.53,
        }
    }
}
