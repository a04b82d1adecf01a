//! The one table of registered filters.

use schemars::Schema;

/// A filter that can be named in the filter lists.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum FilterClass {
    /// Collision with predicted objects.
    CollisionCheck,
    /// Yielding at crosswalks.
    Crosswalk,
    /// Leaving the road.
    OutOfLane,
    /// Compliance with traffic lights.
    TrafficLight,
    /// Departure over borders that must not be crossed.
    UncrossableBoundaryDeparture,
    /// Limits of speed, acceleration and steering.
    VehicleConstraint,
}

impl FilterClass {
    /// All filters in evaluation and report order: ascending short name.
    pub const ALL: [Self; 6] = [
        Self::CollisionCheck,
        Self::Crosswalk,
        Self::OutOfLane,
        Self::TrafficLight,
        Self::UncrossableBoundaryDeparture,
        Self::VehicleConstraint,
    ];

    /// Name in `filter_names` and `shadow_mode_filter_names`.
    #[must_use]
    pub const fn class_name(self) -> &'static str {
        match self {
            Self::CollisionCheck => "safety::CollisionCheckFilter",
            Self::Crosswalk => "traffic_rule::CrosswalkFilter",
            Self::OutOfLane => "safety::OutOfLaneFilter",
            Self::TrafficLight => "traffic_rule::TrafficLightFilter",
            Self::UncrossableBoundaryDeparture => "safety::UncrossableBoundaryDepartureFilter",
            Self::VehicleConstraint => "safety::VehicleConstraintFilter",
        }
    }

    /// Name in reports, diagnostics and debug topics.
    #[must_use]
    pub const fn short_name(self) -> &'static str {
        match self {
            Self::CollisionCheck => "collision_check_filter",
            Self::Crosswalk => "crosswalk_filter",
            Self::OutOfLane => "out_of_lane_filter",
            Self::TrafficLight => "traffic_light_filter",
            Self::UncrossableBoundaryDeparture => "uncrossable_boundary_departure_filter",
            Self::VehicleConstraint => "vehicle_constraint_filter",
        }
    }

    /// Group of its parameters: what their names begin with.
    #[must_use]
    pub const fn parameter_group(self) -> &'static str {
        match self {
            Self::CollisionCheck => "collision_check",
            Self::Crosswalk => "crosswalk",
            Self::OutOfLane => "out_of_lane",
            Self::TrafficLight => "traffic_light",
            Self::UncrossableBoundaryDeparture => "boundary_departure",
            Self::VehicleConstraint => "vehicle_constraint",
        }
    }

    /// Category in reports: the part of the class name before `::`.
    #[must_use]
    pub const fn category(self) -> &'static str {
        match self {
            Self::CollisionCheck
            | Self::OutOfLane
            | Self::UncrossableBoundaryDeparture
            | Self::VehicleConstraint => "safety",
            Self::Crosswalk | Self::TrafficLight => "traffic_rule",
        }
    }

    /// The filter with this class name.
    #[must_use]
    pub fn from_class_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|class| class.class_name() == name)
    }
}

/// A filter to load and whether its verdict decides.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ConfiguredFilter {
    /// Which filter.
    pub class: FilterClass,
    /// True when a rejection removes the candidate, false in shadow mode.
    pub enforced: bool,
}

/// Lists the class names, and the empty entry of ROS parameter files, as the choices of a list's items.
pub(super) fn choices(schema: &mut Schema) {
    let names: Vec<&str> =
        std::iter::once("").chain(FilterClass::ALL.into_iter().map(FilterClass::class_name)).collect();
    if let Some(items) = schema.get_mut("items").and_then(|items| items.as_object_mut()) {
        items.insert("enum".to_owned(), names.into());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_is_sorted_by_short_name_and_consistent() {
        assert!(FilterClass::ALL.is_sorted_by_key(|class| class.short_name()));
        for class in FilterClass::ALL {
            assert_eq!(FilterClass::from_class_name(class.class_name()), Some(class));
            assert_eq!(class.class_name().split("::").next(), Some(class.category()));
        }
    }
}
