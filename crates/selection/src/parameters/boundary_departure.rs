//! Parameters of the uncrossable boundary departure filter.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{RuleViolation, SMALLEST_BRAKING_LIMIT};

/// When a footprint near an uncrossable border is critical, and how long that verdict is held.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct BoundaryDepartureParameters {
    /// Lateral distance to a border up to which the footprint counts as departing.
    #[schemars(range(min = 0.0), extend("x-unit" = "m"))]
    pub lateral_margin_m: f64,
    /// Length of the buffer before a departure; affects markers only.
    #[schemars(range(min = 0.0), extend("x-unit" = "m"))]
    pub longitudinal_margin_m: f64,
    /// Lateral distance of the advisory band: nearer than this is reported, not rejected.
    #[schemars(range(min = 0.0), extend("x-unit" = "m"))]
    pub near_boundary_lateral_th_m: f64,
    /// Deceleration of the braking distance. The sign is ignored, the magnitude must exceed 0.001.
    #[schemars(range(min = -50.0, max = 50.0), extend("x-unit" = "m/s2"))]
    pub max_deceleration_mps2: f64,
    /// Jerk of the braking distance. The sign is ignored, the magnitude must exceed 0.001.
    #[schemars(range(min = -500.0, max = 500.0), extend("x-unit" = "m/s3"))]
    pub max_jerk_mps3: f64,
    /// Time before braking begins.
    #[schemars(range(min = 0.0), extend("x-unit" = "s"))]
    pub brake_delay_s: f64,
    /// A departure sooner than this is critical whatever the braking distance.
    #[schemars(range(min = 0.0), extend("x-unit" = "s"))]
    pub time_to_departure_cutoff_s: f64,
    /// How long a critical finding must last before it rejects.
    #[schemars(range(min = 0.0), extend("x-unit" = "s"))]
    pub on_time_buffer_s: f64,
    /// How long the finding must be absent before the rejection ends.
    #[schemars(range(min = 0.0), extend("x-unit" = "s"))]
    pub off_time_buffer_s: f64,
    /// Publish the detailed markers.
    pub enable_developer_marker: bool,
    /// Values of the line string attribute `type` that must not be crossed.
    #[schemars(extend("x-read-only" = true))]
    pub boundary_types: Vec<String>,
}

impl Default for BoundaryDepartureParameters {
    fn default() -> Self {
        Self {
            lateral_margin_m: 0.01,
            longitudinal_margin_m: 1.0,
            near_boundary_lateral_th_m: 0.2,
            max_deceleration_mps2: -4.0,
            max_jerk_mps3: -5.0,
            brake_delay_s: 1.0,
            time_to_departure_cutoff_s: 2.0,
            on_time_buffer_s: 0.15,
            off_time_buffer_s: 0.15,
            enable_developer_marker: true,
            boundary_types: vec!["road_border".to_owned()],
        }
    }
}

impl BoundaryDepartureParameters {
    pub(super) fn check(&self, found: &mut Vec<RuleViolation>) {
        let limits =
            [("max_deceleration_mps2", self.max_deceleration_mps2), ("max_jerk_mps3", self.max_jerk_mps3)];
        for (name, value) in limits {
            if value.abs() <= SMALLEST_BRAKING_LIMIT {
                found.push(RuleViolation::NeverStops {
                    parameter: format!("boundary_departure.{name}"),
                    value,
                });
            }
        }
        if self.boundary_types.iter().all(String::is_empty) {
            found.push(RuleViolation::NamesNothing {
                parameter: "boundary_departure.boundary_types".to_owned(),
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_limit_that_never_stops_is_refused_whatever_its_sign() {
        for value in [0.0, -0.0, 1e-3, -1e-3] {
            let mut found = Vec::new();
            BoundaryDepartureParameters { max_deceleration_mps2: value, ..Default::default() }
                .check(&mut found);
            assert!(matches!(found.as_slice(), [RuleViolation::NeverStops { .. }]), "{value}: {found:?}");
        }
        for value in [4.0, -4.0, 0.002] {
            let mut found = Vec::new();
            BoundaryDepartureParameters { max_jerk_mps3: value, ..Default::default() }.check(&mut found);
            assert_eq!(found, [], "{value}");
        }
    }

    #[test]
    fn no_boundary_type_is_refused() {
        for types in [vec![], vec![String::new()]] {
            let mut found = Vec::new();
            BoundaryDepartureParameters { boundary_types: types, ..Default::default() }.check(&mut found);
            assert!(matches!(found.as_slice(), [RuleViolation::NamesNothing { .. }]));
        }
    }
}
