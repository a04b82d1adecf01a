//! Parameters of the traffic light filter.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// When a red or amber light forbids a candidate.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct TrafficLightParameters {
    /// Deceleration, a positive magnitude, with which the vehicle is expected to stop at amber.
    #[schemars(extend("exclusiveMinimum" = 1e-3, "x-unit" = "m/s2"))]
    pub deceleration_limit: f64,
    /// Jerk, a positive magnitude, with which the vehicle is expected to stop at amber.
    #[schemars(extend("exclusiveMinimum" = 1e-3, "x-unit" = "m/s3"))]
    pub jerk_limit: f64,
    /// Time before braking begins.
    #[schemars(range(min = 0.0), extend("x-unit" = "s"))]
    pub delay_response_time: f64,
    /// An amber line may be passed when it is reached within this time.
    #[schemars(range(min = 0.0), extend("x-unit" = "s"))]
    pub crossing_time_limit: f64,
    /// Treat amber as red.
    pub treat_amber_light_as_red_light: bool,
    /// Treat an unknown colour as red.
    pub treat_unknown_light_as_red_light: bool,
    /// Let amber pass on a turning lane whose arrow allows it.
    pub enable_arrow_aware_amber_passing: bool,
    /// How far past the stop line a planned stop may lie.
    #[schemars(range(min = 0.0), extend("x-unit" = "m"))]
    pub stop_overshoot_margin: f64,
    /// A line nearer than this may be crossed when stopping before it is impossible; 0 switches the exception off.
    #[schemars(range(min = 0.0, max = 100.0), extend("x-unit" = "m"))]
    pub allow_if_cannot_stop_distance: f64,
    /// Length of the candidate that is always looked at, also at standstill.
    #[schemars(range(min = 0.0, max = 300.0), extend("x-unit" = "m"))]
    pub min_lookahead_distance: f64,
    /// How long red must be seen before it counts.
    #[schemars(range(min = 0.0), extend("x-unit" = "s"))]
    pub stable_duration_threshold_red: f64,
    /// How long amber must be seen before it counts.
    #[schemars(range(min = 0.0), extend("x-unit" = "s"))]
    pub stable_duration_threshold_amber: f64,
    /// How long an unknown colour must be seen before it counts.
    #[schemars(range(min = 0.0), extend("x-unit" = "s"))]
    pub stable_duration_threshold_unknown: f64,
    /// Speed up to which the vehicle counts as stopped.
    #[schemars(range(min = 0.0), extend("x-unit" = "m/s"))]
    pub ego_stopped_velocity_threshold: f64,
    /// Braking that decides how much of a candidate is looked at.
    pub checked_trajectory_length: CheckedTrajectoryLength,
    /// Memory of amber lights that were refused.
    pub amber_rejection: AmberRejection,
}

/// Braking that decides how much of a candidate is looked at.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct CheckedTrajectoryLength {
    /// Deceleration of the stopping distance, a positive magnitude.
    #[schemars(extend("exclusiveMinimum" = 1e-3, "x-unit" = "m/s2"))]
    pub deceleration_limit: f64,
    /// Jerk of the stopping distance, a positive magnitude.
    #[schemars(extend("exclusiveMinimum" = 1e-3, "x-unit" = "m/s3"))]
    pub jerk_limit: f64,
}

/// Memory of amber lights that were refused.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct AmberRejection {
    /// How long an amber light that was refused once stays refused while the vehicle moves.
    #[schemars(range(min = 0.0), extend("x-unit" = "s"))]
    pub hysteresis_duration: f64,
    /// Remember an amber light also when the candidate plans a stop before it.
    pub reject_if_stop_detected: bool,
}

impl Default for TrafficLightParameters {
    fn default() -> Self {
        Self {
            deceleration_limit: 2.8,
            jerk_limit: 5.0,
            delay_response_time: 0.5,
            crossing_time_limit: 2.75,
            treat_amber_light_as_red_light: true,
            treat_unknown_light_as_red_light: false,
            enable_arrow_aware_amber_passing: true,
            stop_overshoot_margin: 0.5,
            allow_if_cannot_stop_distance: 0.0,
            min_lookahead_distance: 20.0,
            stable_duration_threshold_red: 0.0,
            stable_duration_threshold_amber: 0.0,
            stable_duration_threshold_unknown: 0.0,
            ego_stopped_velocity_threshold: 0.01,
            checked_trajectory_length: CheckedTrajectoryLength::default(),
            amber_rejection: AmberRejection::default(),
        }
    }
}

impl Default for CheckedTrajectoryLength {
    fn default() -> Self {
        Self { deceleration_limit: 2.0, jerk_limit: 2.0 }
    }
}
