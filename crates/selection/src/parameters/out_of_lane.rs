//! Parameters of the out-of-lane filter.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::RuleViolation;

/// How long and how exactly the footprint must stay on the road.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct OutOfLaneParameters {
    /// Horizon, measured on the time from start.
    #[schemars(range(min = 0.0), extend("x-unit" = "s"))]
    pub time: f64,
    /// How far the footprint may reach beyond the road.
    #[schemars(range(min = 0.0), extend("x-unit" = "m"))]
    pub min_value: f64,
    /// Subtypes of the lanelets that form the road.
    #[schemars(extend("x-read-only" = true))]
    pub lanelet_subtypes: Vec<String>,
}

impl Default for OutOfLaneParameters {
    fn default() -> Self {
        Self {
            time: 3.0,
            min_value: 0.0,
            lanelet_subtypes: vec!["road".to_owned(), "road_shoulder".to_owned()],
        }
    }
}

impl OutOfLaneParameters {
    pub(super) fn check(&self, found: &mut Vec<RuleViolation>) {
        if self.lanelet_subtypes.iter().all(String::is_empty) {
            found.push(RuleViolation::NamesNothing { parameter: "out_of_lane.lanelet_subtypes".to_owned() });
        }
    }
}
