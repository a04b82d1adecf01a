//! Parameters of the vehicle constraint filter.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Limits that a candidate must keep; a value equal to its limit passes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct VehicleConstraintParameters {
    /// Highest speed of a point.
    #[schemars(range(min = 0.0), extend("x-unit" = "m/s"))]
    pub max_speed: f64,
    /// Highest commanded acceleration.
    #[schemars(range(min = 0.0), extend("x-unit" = "m/s2"))]
    pub max_acceleration: f64,
    /// Highest commanded deceleration, a positive magnitude.
    #[schemars(range(min = 0.0), extend("x-unit" = "m/s2"))]
    pub max_deceleration: f64,
    /// Highest magnitude of the steering angle that the path implies; our bound is just below a quarter turn.
    #[schemars(range(min = 0.0, max = 1.57), extend("x-unit" = "rad"))]
    pub max_steering_angle: f64,
    /// Highest magnitude of the rate of that angle.
    #[schemars(range(min = 0.0), extend("x-unit" = "rad/s"))]
    pub max_steering_rate: f64,
}

impl Default for VehicleConstraintParameters {
    fn default() -> Self {
        Self {
            max_speed: 16.7,
            max_acceleration: 5.0,
            max_deceleration: 5.0,
            max_steering_angle: 0.8,
            max_steering_rate: 0.3,
        }
    }
}
