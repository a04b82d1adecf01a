//! The shipped values, listed a second time and by hand: a slip in a `Default` must not go unnoticed, since all
//! generated files would follow it.
use std::collections::BTreeSet;

use trajectory_selector::settings::{Component, ParameterValue, Settings, parameter_table};

const LEVELS: &str = "[safe, low_caution, high_caution, danger, fatal]";
const SOURCES: &str = "[diffusion_planner, backup_planner_go, backup_planner_stop]";
const PREFIXES: &str = "[DiffusionPlanner_, MinimumRuleBasedPlanner_Go, MinimumRuleBasedPlanner_Stop]";
const DECAY: &str =
    "[1.0, 0.8, 0.64, 0.51, 0.41, 0.33, 0.26, 0.21, 0.17, 0.13, 0.1, 0.08, 0.067, 0.053, 0.043, 0.034]";

/// Groups, each with names and values. `*` marks what is fixed at start.
const EXPECTED: &[(&str, &[(&str, &str)])] = &[
    (
        "",
        &[
            ("use_sim_time", "false"),
            ("fallback_period_ms", "150"),
            ("cycle_budget_ms", "100"),
            ("generator_name_prefixes", PREFIXES),
            ("autoware_interface*", "\"0.53\""),
            ("duration_time", "0.2"),
            (
                "filter_names*",
                "[\"safety::VehicleConstraintFilter\", \"safety::UncrossableBoundaryDepartureFilter\", \
                 \"traffic_rule::TrafficLightFilter\", \"traffic_rule::CrosswalkFilter\"]",
            ),
            ("shadow_mode_filter_names*", "[\"safety::CollisionCheckFilter\", \"safety::OutOfLaneFilter\"]"),
            ("stop_at_first_rejection", "false"),
            ("wheel_radius*", "0.383"),
            ("wheel_width*", "0.235"),
            ("wheel_base*", "2.79"),
            ("wheel_tread*", "1.64"),
            ("front_overhang*", "1.0"),
            ("rear_overhang*", "1.1"),
            ("left_overhang*", "0.128"),
            ("right_overhang*", "0.128"),
            ("vehicle_height*", "2.5"),
            ("max_steer_angle*", "0.7"),
        ],
    ),
    (
        "vehicle_constraint.",
        &[
            ("max_speed", "16.7"),
            ("max_acceleration", "5.0"),
            ("max_deceleration", "5.0"),
            ("max_steering_angle", "0.8"),
            ("max_steering_rate", "0.3"),
        ],
    ),
    (
        "boundary_departure.",
        &[
            ("lateral_margin_m", "0.01"),
            ("longitudinal_margin_m", "1.0"),
            ("near_boundary_lateral_th_m", "0.2"),
            ("max_deceleration_mps2", "-4.0"),
            ("max_jerk_mps3", "-5.0"),
            ("brake_delay_s", "1.0"),
            ("time_to_departure_cutoff_s", "2.0"),
            ("on_time_buffer_s", "0.15"),
            ("off_time_buffer_s", "0.15"),
            ("enable_developer_marker", "true"),
            ("boundary_types*", "[road_border]"),
        ],
    ),
    (
        "traffic_light.",
        &[
            ("deceleration_limit", "2.8"),
            ("jerk_limit", "5.0"),
            ("delay_response_time", "0.5"),
            ("crossing_time_limit", "2.75"),
            ("treat_amber_light_as_red_light", "true"),
            ("treat_unknown_light_as_red_light", "false"),
            ("enable_arrow_aware_amber_passing", "true"),
            ("stop_overshoot_margin", "0.5"),
            ("allow_if_cannot_stop_distance", "0.0"),
            ("min_lookahead_distance", "20.0"),
            ("stable_duration_threshold_red", "0.0"),
            ("stable_duration_threshold_amber", "0.0"),
            ("stable_duration_threshold_unknown", "0.0"),
            ("ego_stopped_velocity_threshold", "0.01"),
            ("checked_trajectory_length.deceleration_limit", "2.0"),
            ("checked_trajectory_length.jerk_limit", "2.0"),
            ("amber_rejection.hysteresis_duration", "0.0"),
            ("amber_rejection.reject_if_stop_detected", "false"),
        ],
    ),
    (
        "crosswalk.",
        &[
            ("object_types", "[pedestrian, bicycle]"),
            ("lon_detection_margin", "2.0"),
            ("lat_detection_margin", "1.0"),
            ("object_clear_time_th", "0.3"),
            ("distance_hysteresis_th", "0.3"),
            ("overshoot_tolerance", "0.1"),
            ("nominal_deceleration", "1.0"),
            ("nominal_jerk", "1.0"),
            ("stop_duration", "3.0"),
            ("arrived_distance_threshold", "5.0"),
            ("use_trajectory_time", "false"),
        ],
    ),
    (
        "out_of_lane.",
        &[("time", "3.0"), ("min_value", "0.0"), ("lanelet_subtypes*", "[road, road_shoulder]")],
    ),
    ("collision_check.global_setting.", &[("time_resolution", "0.1")]),
    (
        "collision_check.drac.",
        &[
            ("stop_tracking.ego.stopped_velocity_threshold", "0.01"),
            ("stop_tracking.ego.history_timeout", "0.3"),
            ("stop_tracking.object.stopped_velocity_threshold", "0.3"),
            ("stop_tracking.object.history_timeout", "0.3"),
            ("enable_assessment.base", "[bbox, cylinder]"),
            ("enable_assessment.unknown", "[\"\"]"),
            ("enable_assessment.over_drivable", "[\"\"]"),
            ("enable_assessment.under_drivable", "[\"\"]"),
            ("pet_margin.ego_earlier.base", "0.6"),
            ("pet_margin.object_earlier.base", "1.0"),
            ("pet_margin.object_earlier_judgement_bias.base", "0.0"),
            ("ego_footprint_margin.lateral.base", "0.3"),
            ("ego_footprint_margin.lateral.pedestrian", "0.5"),
            ("ego_footprint_margin.lateral.bicycle", "0.5"),
            ("ego_footprint_margin.front.base", "1.0"),
            ("ego_footprint_margin.rear.base", "0.0"),
            ("ego_reaction_braking_delay.nominal.base", "0.5"),
            ("ego_reaction_braking_delay.departure.base", "1.0"),
        ],
    ),
    (
        "collision_check.drac.constant_curvature.",
        &[
            ("enable_assessment.base", "true"),
            ("object_time_horizon.base", "1.0"),
            ("object_time_horizon.pedestrian", "1.5"),
            ("object_time_horizon.bicycle", "1.5"),
            ("ego_earlier.enable_assessment.base", "false"),
            ("object_earlier.enable_assessment.base", "true"),
        ],
    ),
    (
        "collision_check.drac.map_based.",
        &[
            ("enable_assessment.base", "true"),
            ("mutual_yield_timeout_arbitration.enabled.base", "false"),
            ("mutual_yield_timeout_arbitration.enabled.pedestrian", "true"),
            ("mutual_yield_timeout_arbitration.enabled.bicycle", "true"),
            ("mutual_yield_timeout_arbitration.min_wait_time.base", "3.0"),
            ("ego_prioritized_ego_earlier.enable_assessment.base", "false"),
            ("ego_prioritized_object_earlier.enable_assessment.base", "false"),
            ("object_prioritized_ego_earlier.enable_assessment.base", "true"),
            ("object_prioritized_object_earlier.enable_assessment.base", "true"),
            ("object_prioritized_ego_earlier.object_drac_acceleration.safe_limit.base", "-0.5"),
            ("object_prioritized_ego_earlier.object_drac_acceleration.low_caution_limit.base", "-1.5"),
        ],
    ),
    (
        "collision_check.rss.",
        &[
            ("enable_assessment.base", "[bbox, polygon, cylinder]"),
            ("enable_assessment.motorcycle", "[bbox, cylinder]"),
            ("enable_assessment.bicycle", "[bbox, cylinder]"),
            ("enable_assessment.over_drivable", "[\"\"]"),
            ("enable_assessment.under_drivable", "[\"\"]"),
            ("stop_distance_margin.base", "2.0"),
            ("ego_total_braking_delay.base", "0.4"),
            ("ego_footprint_margin.lateral", "0.0"),
            ("ego_footprint_margin.front", "0.0"),
            ("ego_footprint_margin.rear", "0.0"),
            ("object_assumed_acceleration.base", "-4.0"),
            ("error_threshold.ego_acceleration.base", "-4.0"),
        ],
    ),
    (
        "safety.",
        &[
            ("enable", "true"),
            ("levels", LEVELS),
            ("penalty", "[0.0, 0.1, 0.4, 1.0, 1.0]"),
            ("scale", "20.0"),
        ],
    ),
    (
        "source.",
        &[("enable", "true"), ("levels", SOURCES), ("penalty", "[0.0, 0.45, 0.5]"), ("scale", "5.0")],
    ),
    (
        "evaluation.",
        &[
            ("enable", "false"),
            (
                "plugin_names*",
                "[\"autoware::trajectory_ranker::metrics::LateralAcceleration\", \
                 \"autoware::trajectory_ranker::metrics::LongitudinalJerk\", \
                 \"autoware::trajectory_ranker::metrics::TravelDistance\", \
                 \"autoware::trajectory_ranker::metrics::LateralDeviation\", \
                 \"autoware::trajectory_ranker::metrics::SteeringConsistency\", \
                 \"autoware::trajectory_ranker::metrics::TrajectoryConsistency\"]",
            ),
            ("scale", "1.0"),
            ("sampling_number", "16"),
            ("sampling_resolution", "0.5"),
            ("trajectory_history_size", "10"),
            ("decay_weight_base", DECAY),
            ("lateral_acceleration.weight", "0.1"),
            ("lateral_acceleration.maximum", "5.0"),
            ("longitudinal_jerk.weight", "0.1"),
            ("longitudinal_jerk.maximum", "10.0"),
            ("travel_distance.weight", "0.3"),
            ("travel_distance.maximum", "500.0"),
            ("lateral_deviation.weight", "0.3"),
            ("lateral_deviation.maximum", "10.0"),
            ("steering_consistency.weight", "0.3"),
            ("steering_consistency.maximum", "0.1"),
            ("trajectory_consistency.weight", "0.2"),
            ("trajectory_consistency.maximum", "1.0"),
            ("trajectory_consistency.time_horizon", "2.0"),
        ],
    ),
];

/// All parameters that are set by default: full name, value, fixed at start.
fn expected() -> BTreeSet<(String, String, bool)> {
    let listed = EXPECTED.iter().flat_map(|(group, members)| {
        members.iter().map(move |(name, value)| {
            let plain = name.trim_end_matches('*');
            (format!("{group}{plain}"), (*value).to_owned(), plain.len() < name.len())
        })
    });
    let metrics = ["lateral_acceleration", "longitudinal_jerk", "travel_distance"].into_iter().chain([
        "lateral_deviation",
        "steering_consistency",
        "trajectory_consistency",
    ]);
    let metrics = metrics.flat_map(|metric| {
        [("enable", "true"), ("decay_weight", DECAY)]
            .map(|(name, value)| (format!("evaluation.{metric}.{name}"), value.to_owned(), false))
    });
    let cases = [
        "constant_curvature.ego_earlier",
        "constant_curvature.object_earlier",
        "map_based.ego_prioritized_ego_earlier",
        "map_based.ego_prioritized_object_earlier",
        "map_based.object_prioritized_ego_earlier",
        "map_based.object_prioritized_object_earlier",
    ];
    let braking = cases.into_iter().flat_map(|case| {
        [
            ("safe_limit", "-1.5"),
            ("danger_limit", "-3.0"),
            ("fatal_limit", "-6.0"),
            ("enable_abandon", "false"),
        ]
        .map(|(name, value)| {
            let group = format!("collision_check.drac.{case}.ego_drac_acceleration");
            (format!("{group}.{name}.base"), value.to_owned(), false)
        })
    });
    listed.chain(metrics).chain(braking).collect()
}

#[test]
fn names_values_and_mutability_are_those_of_the_specification() {
    let defaults = Settings::default();
    let declared: BTreeSet<_> = defaults
        .iter()
        .filter(|(_, value)| **value != ParameterValue::NotSet)
        // Those of the planner are held to the specification where they are declared.
        .filter(|(descriptor, _)| descriptor.component != Component::OpenSpace)
        .map(|(descriptor, value)| (descriptor.name.clone(), value.to_string(), descriptor.read_only))
        .collect();
    let expected = expected();
    assert_eq!(declared.difference(&expected).collect::<Vec<_>>(), [] as [&(String, String, bool); 0]);
    assert_eq!(expected.difference(&declared).collect::<Vec<_>>(), [] as [&(String, String, bool); 0]);
}

#[test]
fn what_is_not_set_is_the_own_value_of_a_class() {
    for descriptor in parameter_table().iter().filter(|d| d.default == ParameterValue::NotSet) {
        assert!(descriptor.class_of.is_some(), "{}", descriptor.name);
        assert_eq!(descriptor.component, Component::Validator);
    }
}
