//! Parameters of the crosswalk filter.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{ObjectClass, RuleViolation};

/// Whom a candidate must yield to at a crosswalk, and for how long.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct CrosswalkParameters {
    /// Classes of road users to yield to.
    pub object_types: Vec<ObjectClass>,
    /// Length of the detection area before and after the crosswalk; up to 0.001 there is no detection.
    #[schemars(range(min = 0.0), extend("x-unit" = "m"))]
    pub lon_detection_margin: f64,
    /// Width added to the detection area.
    #[schemars(range(min = 0.0), extend("x-unit" = "m"))]
    pub lat_detection_margin: f64,
    /// How long an object must be absent before it is forgotten.
    #[schemars(range(min = 0.0), extend("x-unit" = "s"))]
    pub object_clear_time_th: f64,
    /// Distance within which an object with a new id is taken for a lost one.
    #[schemars(range(min = 0.0), extend("x-unit" = "m"))]
    pub distance_hysteresis_th: f64,
    /// How far past the stop line a stop may lie.
    #[schemars(range(min = 0.0), extend("x-unit" = "m"))]
    pub overshoot_tolerance: f64,
    /// Declared for compatibility; nothing depends on it.
    #[schemars(range(min = 0.0), extend("x-unit" = "m/s2"))]
    pub nominal_deceleration: f64,
    /// Declared for compatibility; nothing depends on it.
    #[schemars(range(min = 0.0), extend("x-unit" = "m/s3"))]
    pub nominal_jerk: f64,
    /// How long the vehicle waits for an object that does not cross.
    #[schemars(range(min = 0.0), extend("x-unit" = "s"))]
    pub stop_duration: f64,
    /// Distance from the front bumper to the stop line within which the vehicle counts as arrived.
    #[schemars(range(min = 0.0), extend("x-unit" = "m"))]
    pub arrived_distance_threshold: f64,
    /// Take the time of arrival from the candidate.
    pub use_trajectory_time: bool,
}

impl Default for CrosswalkParameters {
    fn default() -> Self {
        Self {
            object_types: vec![ObjectClass::Pedestrian, ObjectClass::Bicycle],
            lon_detection_margin: 2.0,
            lat_detection_margin: 1.0,
            object_clear_time_th: 0.3,
            distance_hysteresis_th: 0.3,
            overshoot_tolerance: 0.1,
            nominal_deceleration: 1.0,
            nominal_jerk: 1.0,
            stop_duration: 3.0,
            arrived_distance_threshold: 5.0,
            use_trajectory_time: false,
        }
    }
}

impl CrosswalkParameters {
    pub(super) fn check(&self, found: &mut Vec<RuleViolation>) {
        if self.object_types.is_empty() {
            found.push(RuleViolation::NamesNothing { parameter: "crosswalk.object_types".to_owned() });
        }
    }
}
