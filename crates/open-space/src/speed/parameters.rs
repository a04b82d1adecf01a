//! What can be set about the speed. Names are upstream's where upstream has them.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Parameters of the speed: what its quadratic program prefers.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct SpeedParameters {
    /// Weight of the squared distance that remains at each knot.
    #[schemars(range(min = 1e-3, max = 1e6))]
    pub ref_s_weight: f64,
    /// Weight of squared acceleration.
    #[schemars(range(min = 0.0, max = 1e6))]
    pub acc_weight: f64,
    /// Weight of squared jerk.
    #[schemars(range(min = 0.0, max = 1e6))]
    pub jerk_weight: f64,
    /// Leave out the products of neighbouring accelerations from the jerk cost, as upstream's solver call does by
    /// accident. Slower; for comparison only.
    pub pjso_drop_jerk_cross_terms: bool,
}

impl Default for SpeedParameters {
    fn default() -> Self {
        Self { ref_s_weight: 10.0, acc_weight: 1.0, jerk_weight: 1.0, pjso_drop_jerk_cross_terms: false }
    }
}
