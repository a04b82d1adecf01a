//! The parameters of the pure stages: one plain struct per component and filter.
//!
//! These structs are the single source. Their fields give the ROS names (nested structs joined with dots), their
//! doc comments the descriptions, their schema attributes unit, range and whether a value may change at run time,
//! and their `Default` the shipped configuration. The program derives parameter files, JSON schemas, documentation
//! and the checks at start from them. SI units everywhere.
//!
//! Schema keys with a meaning of their own: `x-unit` (text), `x-read-only` (fixed at start), `x-per-class` (a
//! [`PerClass`] group; range, unit and mutability of the field hold for every value in it).

mod boundary_departure;
mod collision_check;
mod crosswalk;
mod filter_class;
mod out_of_lane;
mod per_class;
mod ranker;
mod rule;
mod traffic_light;
mod vehicle_constraint;

pub use boundary_departure::BoundaryDepartureParameters;
pub use collision_check::{
    AssessmentParameters, BrakingDelay, CollisionCheckParameters, ConstantCurvatureParameters,
    DracParameters, EgoDracAcceleration, FootprintMargin, GlobalSetting, MapBasedParameters,
    MutualYieldParameters, ObjectDracAcceleration, PetMargin, RssErrorThreshold, RssFootprintMargin,
    RssParameters, Shape, StopTracking, StopTrackingParameters, YieldingAssessmentParameters,
};
pub use crosswalk::CrosswalkParameters;
pub use filter_class::{ConfiguredFilter, FilterClass};
pub use out_of_lane::OutOfLaneParameters;
pub use per_class::{ObjectClass, PerClass};
pub use ranker::{
    ConsistencyMetricParameters, DECAY_LENGTH, EvaluationParameters, MetricParameters, MetricSettings,
    QualityMetric, RankerParameters, RiskName, SafetyParameters, SourceName, SourceParameters,
};
pub use rule::RuleViolation;
pub use traffic_light::{AmberRejection, CheckedTrajectoryLength, TrafficLightParameters};
pub use vehicle_constraint::VehicleConstraintParameters;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Smallest magnitude of a deceleration or jerk limit with which a stopping distance exists, in SI units.
/// Limits at or below it are refused.
pub const SMALLEST_BRAKING_LIMIT: f64 = 1e-3;

/// Parameters of the concatenator, which keeps the newest candidates of every generator.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ConcatenatorParameters {
    /// Age beyond which a buffered candidate is dropped, measured from its header stamp.
    #[schemars(range(min = 0.0), extend("x-unit" = "s"))]
    pub duration_time: f64,
}

impl Default for ConcatenatorParameters {
    fn default() -> Self {
        Self { duration_time: 0.2 }
    }
}

/// Parameters of the validator: which filters run, and the group of each.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ValidatorParameters {
    /// Filters whose verdict decides, by class name. Empty entries are skipped.
    #[schemars(transform = filter_class::choices, extend("x-read-only" = true))]
    pub filter_names: Vec<String>,
    /// Filters that judge and report but never reject, by class name. Empty entries are skipped; a filter that is
    /// also in filter_names is enforced.
    #[schemars(transform = filter_class::choices, extend("x-read-only" = true))]
    pub shadow_mode_filter_names: Vec<String>,
    /// Ask no further filter about a candidate that an enforced one has rejected, unless it has to remember what it
    /// finds; the report then says "not_assessed" for it. Accepted candidates stay the same, a cycle takes less time.
    pub stop_at_first_rejection: bool,
    /// Limits of speed, acceleration and steering.
    pub vehicle_constraint: VehicleConstraintParameters,
    /// Departure over map borders that must not be crossed.
    pub boundary_departure: BoundaryDepartureParameters,
    /// Compliance with traffic lights.
    pub traffic_light: TrafficLightParameters,
    /// Yielding at crosswalks.
    pub crosswalk: CrosswalkParameters,
    /// Collision with predicted objects.
    pub collision_check: CollisionCheckParameters,
    /// Leaving the road.
    pub out_of_lane: OutOfLaneParameters,
}

impl Default for ValidatorParameters {
    fn default() -> Self {
        let names = |classes: &[FilterClass]| classes.iter().map(|c| c.class_name().to_owned()).collect();
        Self {
            filter_names: names(&[
                FilterClass::VehicleConstraint,
                FilterClass::UncrossableBoundaryDeparture,
                FilterClass::TrafficLight,
                FilterClass::Crosswalk,
            ]),
            shadow_mode_filter_names: names(&[FilterClass::CollisionCheck, FilterClass::OutOfLane]),
            stop_at_first_rejection: false,
            vehicle_constraint: VehicleConstraintParameters::default(),
            boundary_departure: BoundaryDepartureParameters::default(),
            traffic_light: TrafficLightParameters::default(),
            crosswalk: CrosswalkParameters::default(),
            collision_check: CollisionCheckParameters::default(),
            out_of_lane: OutOfLaneParameters::default(),
        }
    }
}

impl ValidatorParameters {
    /// The filters to load, in evaluation order (ascending short name). A filter named in both lists is enforced;
    /// names that are not in [`FilterClass::ALL`] are left out, so refuse them before (the settings do).
    #[must_use]
    pub fn filters(&self) -> Vec<ConfiguredFilter> {
        let named = |list: &[String], class: FilterClass| list.iter().any(|name| name == class.class_name());
        FilterClass::ALL
            .into_iter()
            .filter_map(|class| {
                let enforced = named(&self.filter_names, class);
                (enforced || named(&self.shadow_mode_filter_names, class))
                    .then_some(ConfiguredFilter { class, enforced })
            })
            .collect()
    }

    /// Rules between parameters and rules that a range cannot say. Empty when all hold.
    #[must_use]
    pub fn violations(&self) -> Vec<RuleViolation> {
        let mut found = Vec::new();
        self.boundary_departure.check(&mut found);
        self.crosswalk.check(&mut found);
        self.collision_check.check(&mut found);
        self.out_of_lane.check(&mut found);
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shipped_filters_run_in_short_name_order() {
        let filters: Vec<_> = ValidatorParameters::default()
            .filters()
            .into_iter()
            .map(|f| (f.class.short_name(), f.enforced))
            .collect();
        assert_eq!(
            filters,
            [
                ("collision_check_filter", false),
                ("crosswalk_filter", true),
                ("out_of_lane_filter", false),
                ("traffic_light_filter", true),
                ("uncrossable_boundary_departure_filter", true),
                ("vehicle_constraint_filter", true),
            ]
        );
    }

    #[test]
    fn a_filter_in_both_lists_is_enforced_and_loaded_once() {
        let name = FilterClass::OutOfLane.class_name().to_owned();
        let parameters = ValidatorParameters {
            filter_names: vec![String::new(), name.clone()],
            shadow_mode_filter_names: vec![name],
            ..ValidatorParameters::default()
        };
        assert_eq!(
            parameters.filters(),
            [ConfiguredFilter { class: FilterClass::OutOfLane, enforced: true }]
        );
    }

    #[test]
    fn the_defaults_break_no_rule() {
        assert_eq!(ValidatorParameters::default().violations(), []);
        assert_eq!(RankerParameters::default().violations(), []);
    }

    #[test]
    fn the_defaults_survive_serialisation() {
        let written = serde_json::to_value(ValidatorParameters::default()).unwrap();
        let read: ValidatorParameters = serde_json::from_value(written).unwrap();
        assert_eq!(read, ValidatorParameters::default());
    }
}
