//! What can be set about the smoothing. Names are upstream's where upstream has them.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Parameters of the smoother. Weights are for points 0.1 m apart; other distances give the same shape.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct SmootherParameters {
    /// Distance of the points that are moved; less on short parts.
    #[schemars(range(min = 0.02, max = 0.5), extend("x-unit" = "m"))]
    pub interpolated_delta_s: f64,
    /// How far a point may move along x and y at first.
    #[schemars(range(max = 10.0), extend("exclusiveMinimum" = 0.0, "x-unit" = "m"))]
    pub default_bound: f64,
    /// What the first collision leaves of how far a point has moved; the second one leaves nothing.
    #[schemars(range(min = 0.0, max = 0.9))]
    pub collision_decrease_ratio: f64,
    /// Programs solved for a part before it is given up or cut in two.
    #[schemars(range(min = 1, max = 50))]
    pub max_passes: u32,
    /// Distance kept from obstacles where the coarse path has at least twice as much, else half of what it has.
    #[schemars(range(min = 0.0, max = 1.0), extend("x-unit" = "m"))]
    pub clearance: f64,
    /// Part of the vehicle's curvature limit within which the smooth path stays unless the coarse one is sharper.
    #[schemars(range(min = 0.1, max = 1.0))]
    pub curvature_ratio: f64,
    /// Weight of squared second differences: curvature.
    #[schemars(range(min = 0.0, max = 1e12))]
    pub weight_fem_pos_deviation: f64,
    /// Weight of squared third differences: how fast the curvature changes, hence how fast the vehicle may go.
    #[schemars(range(min = 0.0, max = 1e12))]
    pub weight_curvature_rate: f64,
    /// Weight of squared distances between neighbours.
    #[schemars(range(min = 0.0, max = 1e12))]
    pub weight_path_length: f64,
    /// Weight of squared distances from the coarse path.
    #[schemars(range(min = 1e-3, max = 1e12))]
    pub weight_ref_deviation: f64,
    /// Weight of curvature beyond the limit.
    #[schemars(range(min = 0.0, max = 1e12))]
    pub weight_curvature_constraint_slack_var: f64,
}

impl Default for SmootherParameters {
    fn default() -> Self {
        Self {
            interpolated_delta_s: 0.1,
            default_bound: 2.0,
            collision_decrease_ratio: 0.5,
            max_passes: 12,
            clearance: 0.03,
            curvature_ratio: 0.91,
            weight_fem_pos_deviation: 1e7,
            weight_curvature_rate: 1e8,
            weight_path_length: 0.0,
            weight_ref_deviation: 1e3,
            weight_curvature_constraint_slack_var: 1e6,
        }
    }
}
