//! The parameters of the provider, and the check of any parameters against the ranges they declare.
//!
//! Names are those of the upstream flags. Doc comments, units and ranges become the parameter file, its schema and
//! the documentation; the schema is also what [`out_of_range`] holds values against, so that there is one source.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::stitcher::OffsetLimits;

/// Parameters of the open-space trajectory provider.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ProviderParameters {
    /// Plan on a thread beside the cycle; without it a cycle waits for its plan.
    #[schemars(extend("x-read-only" = true))]
    pub enable_open_space_planner_thread: bool,
    /// How far ahead of now a plan starts on the previous trajectory. With 4 s every cycle offers a fresh start, so
    /// that planning is continuous; 1000 s puts the start at the end of the plan, so that it is planned once and
    /// then tracked.
    #[schemars(range(max = 10_000.0), extend("exclusiveMinimum" = 0.0, "x-unit" = "s"))]
    pub open_space_planning_period: f64,
    /// Longest time that a plan may take: what is best by then is taken, and a search without a path by then has
    /// failed. Where the clock is stepped only the number of expansions counts.
    #[schemars(range(max = 10_000.0), extend("exclusiveMinimum" = 0.0, "x-unit" = "s"))]
    pub open_space_planning_time_limit: f64,
    /// Points of the previous trajectory that are kept behind the vehicle.
    #[schemars(range(min = 0, max = 10_000))]
    pub open_space_trajectory_stitching_preserved_length: u32,
    /// Magnitude of the acceleration in a stop trajectory: the brake that holds the vehicle.
    #[schemars(range(min = 0.0, max = 10.0), extend("x-unit" = "m/s2"))]
    pub open_space_standstill_acceleration: f64,
    /// Continue the previous trajectory; without it every plan starts from the vehicle.
    pub enable_trajectory_stitcher: bool,
    /// Cycles in a second; its inverse is how far a moving vehicle is predicted where a plan starts from it.
    #[schemars(range(min = 1.0, max = 1000.0), extend("x-unit" = "Hz"))]
    pub planning_loop_rate: f64,
    /// Predict the vehicle by the planning period instead, as upstream does where a stitch fails. For comparison
    /// only: a moving vehicle is carried absurdly far.
    pub reinit_uses_stitching_period: bool,
    /// Distance across the path beyond which a previous trajectory is not continued, where offsets count.
    #[schemars(range(max = 100.0), extend("exclusiveMinimum" = 0.0, "x-unit" = "m"))]
    pub replan_lateral_distance_threshold: f64,
    /// Distance along the path beyond which a previous trajectory is not continued, where offsets count.
    #[schemars(range(max = 100.0), extend("exclusiveMinimum" = 0.0, "x-unit" = "m"))]
    pub replan_longitudinal_distance_threshold: f64,
    /// Distance from the goal below which the vehicle has arrived, if its heading agrees too.
    #[schemars(range(max = 10.0), extend("exclusiveMinimum" = 0.0, "x-unit" = "m"))]
    pub is_near_destination_threshold: f64,
    /// Difference of heading from the goal's below which the vehicle has arrived.
    #[schemars(range(max = 3.2), extend("exclusiveMinimum" = 0.0, "x-unit" = "rad"))]
    pub is_near_destination_theta_threshold: f64,
    /// Speed up to which the vehicle has arrived; one that is faster rolls past its goal on the way, or is about to stop.
    #[schemars(range(max = 10.0), extend("exclusiveMinimum" = 0.0, "x-unit" = "m/s"))]
    pub is_near_destination_speed_threshold: f64,
    /// Failed plans since the last good one beyond which the provider reports an error.
    #[schemars(range(min = 1, max = 1_000_000))]
    pub error_count_limit: u32,
    /// Time of nothing but failed plans beyond which the provider reports an error.
    #[schemars(range(max = 10_000.0), extend("exclusiveMinimum" = 0.0, "x-unit" = "s"))]
    pub error_duration_limit: f64,
}

impl Default for ProviderParameters {
    fn default() -> Self {
        Self {
            enable_open_space_planner_thread: true,
            open_space_planning_period: 4.0,
            open_space_planning_time_limit: 2.0,
            open_space_trajectory_stitching_preserved_length: 0,
            open_space_standstill_acceleration: 0.3,
            enable_trajectory_stitcher: true,
            planning_loop_rate: 10.0,
            reinit_uses_stitching_period: false,
            replan_lateral_distance_threshold: 0.5,
            replan_longitudinal_distance_threshold: 2.5,
            is_near_destination_threshold: 0.1,
            is_near_destination_theta_threshold: 0.05,
            is_near_destination_speed_threshold: 0.2,
            error_count_limit: 1000,
            error_duration_limit: 10.0,
        }
    }
}

impl ProviderParameters {
    /// Time from one cycle to the next, s.
    #[must_use]
    pub fn cycle_s(&self) -> f64 {
        1.0 / self.planning_loop_rate
    }

    /// Time by which a moving vehicle is predicted where a stitch fails, s.
    #[must_use]
    pub fn reinit_cycle_s(&self) -> f64 {
        if self.reinit_uses_stitching_period { self.open_space_planning_period } else { self.cycle_s() }
    }

    /// Limits of replanning by offset.
    #[must_use]
    pub fn offset_limits(&self) -> OffsetLimits {
        OffsetLimits {
            lateral_m: self.replan_lateral_distance_threshold,
            longitudinal_m: self.replan_longitudinal_distance_threshold,
        }
    }
}

/// A parameter that its range does not allow.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("parameter `{parameter}` is {value}, but must be {allowed}; correct the parameter file")]
pub struct OutOfRange {
    /// Name of the parameter.
    pub parameter: String,
    /// Its value; "not a finite number" where it is none.
    pub value: String,
    /// The range, in words.
    pub allowed: String,
}

/// Every number that its own schema does not allow, by name; empty where all is well. Numbers must be finite.
#[must_use]
pub fn out_of_range<T: Serialize + JsonSchema>(parameters: &T) -> Vec<OutOfRange> {
    out_of_ranges(parameters, &ranges::<T>())
}

/// The ranges that parameters declare, as [`out_of_ranges`] takes them; for who asks again and again.
pub(crate) fn ranges<T: JsonSchema>() -> serde_json::Value {
    schemars::schema_for!(T).to_value()
}

/// As [`out_of_range`], with the [`ranges`] of the parameters.
pub(crate) fn out_of_ranges(parameters: &impl Serialize, schema: &serde_json::Value) -> Vec<OutOfRange> {
    // A plain struct of numbers and switches always has a JSON form.
    let Ok(values) = serde_json::to_value(parameters) else { return Vec::new() };
    let (Some(values), Some(properties)) = (values.as_object(), schema["properties"].as_object()) else {
        return Vec::new();
    };
    let judged = values.iter().filter_map(|(name, value)| {
        let rules = &properties.get(name)?;
        let limit = |rule: &str| rules.get(rule).and_then(serde_json::Value::as_f64);
        let (above, least, most) = (limit("exclusiveMinimum"), limit("minimum"), limit("maximum"));
        let fits = match value.as_f64() {
            Some(number) => {
                above.is_none_or(|limit| number > limit)
                    && least.is_none_or(|limit| number >= limit)
                    && most.is_none_or(|limit| number <= limit)
            }
            // JSON writes what is not finite as null.
            None => !value.is_null(),
        };
        let words = [("greater than", above), ("at least", least), ("at most", most)];
        (!fits).then(|| OutOfRange {
            parameter: name.clone(),
            value: value.as_f64().map_or("not a finite number".to_owned(), |number| number.to_string()),
            allowed: words
                .iter()
                .filter_map(|(word, limit)| limit.map(|limit| format!("{word} {limit}")))
                .collect::<Vec<_>>()
                .join(" and "),
        })
    });
    judged.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_defaults_are_in_range() {
        assert_eq!(out_of_range(&ProviderParameters::default()), []);
    }

    /// Every number is refused beyond either end of its range and when it is none, with its name; all at once.
    #[test]
    fn every_number_is_held_to_its_range() {
        type Change = fn(&mut ProviderParameters, f64);
        let changes: [(&str, Change, f64); 10] = [
            ("open_space_planning_period", |p, v| p.open_space_planning_period = v, 0.0),
            ("open_space_planning_time_limit", |p, v| p.open_space_planning_time_limit = v, 0.0),
            ("open_space_standstill_acceleration", |p, v| p.open_space_standstill_acceleration = v, -0.1),
            ("planning_loop_rate", |p, v| p.planning_loop_rate = v, 0.5),
            ("replan_lateral_distance_threshold", |p, v| p.replan_lateral_distance_threshold = v, 0.0),
            (
                "replan_longitudinal_distance_threshold",
                |p, v| p.replan_longitudinal_distance_threshold = v,
                0.0,
            ),
            ("is_near_destination_threshold", |p, v| p.is_near_destination_threshold = v, 0.0),
            ("is_near_destination_theta_threshold", |p, v| p.is_near_destination_theta_threshold = v, 0.0),
            ("is_near_destination_speed_threshold", |p, v| p.is_near_destination_speed_threshold = v, 0.0),
            ("error_duration_limit", |p, v| p.error_duration_limit = v, 0.0),
        ];
        for (name, change, low) in changes {
            for bad in [low, 1e9, f64::NAN, f64::INFINITY] {
                let mut parameters = ProviderParameters::default();
                change(&mut parameters, bad);
                let found = out_of_range(&parameters);
                assert_eq!(found.len(), 1, "{name} = {bad}: {found:?}");
                assert_eq!(found[0].parameter, name);
            }
        }
        let several = ProviderParameters {
            error_count_limit: 0,
            planning_loop_rate: 0.0,
            open_space_trajectory_stitching_preserved_length: u32::MAX,
            ..ProviderParameters::default()
        };
        assert_eq!(out_of_range(&several).len(), 3);
    }

    #[test]
    fn a_refusal_says_what_is_allowed() {
        let parameters = ProviderParameters { planning_loop_rate: 0.0, ..ProviderParameters::default() };
        assert_eq!(
            out_of_range(&parameters)[0].to_string(),
            "parameter `planning_loop_rate` is 0, but must be at least 1 and at most 1000; correct the parameter file"
        );
    }

    /// Whoever adds a number must give it a range, and every number with a dimension its unit.
    #[test]
    fn every_parameter_has_a_text_and_every_number_a_range() {
        let schema = schemars::schema_for!(ProviderParameters).to_value();
        for (name, rules) in schema["properties"].as_object().unwrap() {
            assert!(rules["description"].is_string(), "{name}");
            if rules["type"] != "boolean" {
                assert!(rules.get("maximum").is_some(), "{name}");
                let bounded_below = ["minimum", "exclusiveMinimum"].iter().any(|k| rules.get(k).is_some());
                assert!(bounded_below, "{name}");
                assert!(rules["type"] == "integer" || rules["x-unit"].is_string(), "{name}");
            }
        }
    }
}
