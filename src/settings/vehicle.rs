//! Dimensions of the vehicle, under the names of ROS.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Dimensions of the vehicle. The reference point of every pose is the middle of the rear axle on the ground.
/// Defaults are those of the Autoware sample vehicle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct VehicleInfoParameters {
    /// Radius of a wheel.
    #[schemars(extend("exclusiveMinimum" = 0.0, "x-unit" = "m", "x-read-only" = true))]
    pub wheel_radius: f64,
    /// Width of a wheel.
    #[schemars(extend("exclusiveMinimum" = 0.0, "x-unit" = "m", "x-read-only" = true))]
    pub wheel_width: f64,
    /// Distance between the axles.
    #[schemars(range(max = 50.0), extend("exclusiveMinimum" = 0.0, "x-unit" = "m", "x-read-only" = true))]
    pub wheel_base: f64,
    /// Distance between the middles of the left and right wheels.
    #[schemars(range(max = 10.0), extend("exclusiveMinimum" = 0.0, "x-unit" = "m", "x-read-only" = true))]
    pub wheel_tread: f64,
    /// From the front axle to the front end.
    #[schemars(range(min = 0.0, max = 50.0), extend("x-unit" = "m", "x-read-only" = true))]
    pub front_overhang: f64,
    /// From the rear axle to the rear end.
    #[schemars(range(min = 0.0, max = 50.0), extend("x-unit" = "m", "x-read-only" = true))]
    pub rear_overhang: f64,
    /// From the middle of the left wheels to the left side.
    #[schemars(range(min = 0.0, max = 10.0), extend("x-unit" = "m", "x-read-only" = true))]
    pub left_overhang: f64,
    /// From the middle of the right wheels to the right side.
    #[schemars(range(min = 0.0, max = 10.0), extend("x-unit" = "m", "x-read-only" = true))]
    pub right_overhang: f64,
    /// Height above the ground.
    #[schemars(range(max = 20.0), extend("exclusiveMinimum" = 0.0, "x-unit" = "m", "x-read-only" = true))]
    pub vehicle_height: f64,
    /// Largest steering angle; our upper bound is just below a quarter turn.
    #[schemars(range(max = 1.57), extend("exclusiveMinimum" = 0.0, "x-unit" = "rad", "x-read-only" = true))]
    pub max_steer_angle: f64,
}

impl Default for VehicleInfoParameters {
    fn default() -> Self {
        Self {
            wheel_radius: 0.383,
            wheel_width: 0.235,
            wheel_base: 2.79,
            wheel_tread: 1.64,
            front_overhang: 1.0,
            rear_overhang: 1.1,
            left_overhang: 0.128,
            right_overhang: 0.128,
            vehicle_height: 2.5,
            max_steer_angle: 0.70,
        }
    }
}
