//! All parameters of planning in open space, in groups, and their ranges.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::hybrid_a_star::SearchParameters;
use crate::problem::Limits;
use crate::provider::{OutOfRange, out_of_range};
use crate::smoother::SmootherParameters;
use crate::speed::SpeedParameters;

/// Parameters of planning in open space.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct OpenSpaceParameters {
    /// Limits of the motion, where the problem has none of its own.
    pub limits: LimitParameters,
    /// Search of a coarse path.
    pub search: SearchParameters,
    /// Smoothing of the coarse path.
    pub smoother: SmootherParameters,
    /// Speed along the smooth path.
    pub speed: SpeedParameters,
}

impl OpenSpaceParameters {
    /// Every number that its range does not allow, by name; empty where all is well.
    #[must_use]
    pub fn out_of_range(&self) -> Vec<OutOfRange> {
        let groups = [
            ("limits", out_of_range(&self.limits)),
            ("search", out_of_range(&self.search)),
            ("smoother", out_of_range(&self.smoother)),
            ("speed", out_of_range(&self.speed)),
        ];
        let named = |group: &str, found: OutOfRange| {
            let parameter = format!("{group}.{}", found.parameter);
            OutOfRange { parameter, ..found }
        };
        groups
            .into_iter()
            .flat_map(|(group, found)| found.into_iter().map(move |found| named(group, found)))
            .collect()
    }
}

/// Limits of a parking motion.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct LimitParameters {
    /// Highest speed forward.
    #[schemars(range(min = 0.01, max = 10.0), extend("x-unit" = "m/s"))]
    pub max_speed_forward: f64,
    /// Highest speed in reverse.
    #[schemars(range(min = 0.01, max = 10.0), extend("x-unit" = "m/s"))]
    pub max_speed_reverse: f64,
    /// Of speeding up and braking.
    #[schemars(range(min = 0.01, max = 10.0), extend("x-unit" = "m/s2"))]
    pub max_acceleration: f64,
    /// Of speeding up and braking.
    #[schemars(range(min = 0.01, max = 100.0), extend("x-unit" = "m/s3"))]
    pub max_jerk: f64,
    /// Of the front wheels.
    #[schemars(range(min = 0.01, max = 10.0), extend("x-unit" = "rad/s"))]
    pub max_steer_rate: f64,
}

impl Default for LimitParameters {
    fn default() -> Self {
        let limits = Limits::default();
        Self {
            max_speed_forward: limits.max_speed_forward_mps,
            max_speed_reverse: limits.max_speed_reverse_mps,
            max_acceleration: limits.max_acceleration_mps2,
            max_jerk: limits.max_jerk_mps3,
            max_steer_rate: limits.max_steer_rate_rps,
        }
    }
}

impl From<LimitParameters> for Limits {
    fn from(limits: LimitParameters) -> Self {
        Self {
            max_speed_forward_mps: limits.max_speed_forward,
            max_speed_reverse_mps: limits.max_speed_reverse,
            max_acceleration_mps2: limits.max_acceleration,
            max_jerk_mps3: limits.max_jerk,
            max_steer_rate_rps: limits.max_steer_rate,
        }
    }
}

#[cfg(test)]
mod tests {
    use serde_json::Value;

    use super::*;

    #[test]
    fn the_defaults_are_in_range_and_those_of_the_problem() {
        assert_eq!(OpenSpaceParameters::default().out_of_range(), []);
        assert_eq!(Limits::from(LimitParameters::default()), Limits::default());
    }

    #[test]
    fn all_numbers_out_of_range_are_named_at_once() {
        let mut parameters = OpenSpaceParameters::default();
        parameters.limits.max_jerk = f64::NAN;
        parameters.search.next_node_num = 4;
        parameters.smoother.default_bound = 0.0;
        parameters.smoother.max_passes = 0;
        parameters.speed.ref_s_weight = -1.0;
        let names: Vec<_> = parameters.out_of_range().into_iter().map(|found| found.parameter).collect();
        assert_eq!(
            names,
            [
                "limits.max_jerk",
                "search.next_node_num",
                "smoother.default_bound",
                "smoother.max_passes",
                "speed.ref_s_weight"
            ]
        );
    }

    /// Whoever adds a number must give it a text and a range.
    #[test]
    fn every_number_has_a_text_and_a_range() {
        for schema in [
            schemars::schema_for!(LimitParameters).to_value(),
            schemars::schema_for!(SearchParameters).to_value(),
            schemars::schema_for!(SmootherParameters).to_value(),
            schemars::schema_for!(SpeedParameters).to_value(),
        ] {
            for (name, rules) in schema["properties"].as_object().unwrap() {
                assert!(rules["description"].is_string(), "{name}");
                let has = |rule: &str| rules.get(rule).is_some_and(Value::is_number);
                let bounded = has("maximum") && (has("minimum") || has("exclusiveMinimum"));
                assert!(rules["type"] == "boolean" || bounded, "{name}");
            }
        }
    }
}
