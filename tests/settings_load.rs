//! What parameter sources may say, and what is answered when they are wrong.
use selection::parameters::{FilterClass, ObjectClass, Shape};
use trajectory_selector::settings::{
    AutowareInterface, ParameterValue, Problem, ProblemKind, Settings, SettingsError, Source, Warning,
};

const NODE: &str = "/planning/selector";

fn text(text: &str) -> Source {
    Source::Text { origin: "a.yaml".to_owned(), text: text.to_owned() }
}

fn assign(name: &str, value: &str) -> Source {
    Source::Override { name: name.to_owned(), value: value.to_owned(), origin: "argument 3".to_owned() }
}

fn load(source: Source) -> Result<Settings, SettingsError> {
    Settings::load(NODE, &[source])
}

/// Parameters in a block for every node.
fn block(lines: &[&str]) -> Source {
    let lines: String = lines.iter().map(|line| format!("    {line}\n")).collect();
    text(&format!("/**:\n  ros__parameters:\n{lines}"))
}

fn problems(source: Source) -> Vec<Problem> {
    load(source).expect_err("must be refused").problems
}

fn rendered(source: Source) -> Vec<String> {
    problems(source).iter().map(ToString::to_string).collect()
}

/// Every rule with one wrong line and the whole text of the answer.
#[test]
fn wrong_values_are_answered_with_place_range_and_name() {
    let cases: &[(&str, &str)] = &[
        (
            "falback_period_ms: 100",
            "a.yaml:3:5: `falback_period_ms` is no parameter of this node (did you mean `fallback_period_ms`?)",
        ),
        (
            "max_speed: 3.0",
            "a.yaml:3:5: `max_speed` is no parameter of this node (did you mean `vehicle_constraint.max_speed`?)",
        ),
        ("colour_of_the_car: red", "a.yaml:3:5: `colour_of_the_car` is no parameter of this node"),
        (
            "traffic_light.amber_rejection_hysteresis_duration: 1.0",
            "a.yaml:3:5: `traffic_light.amber_rejection_hysteresis_duration` is no parameter of this node \
             (did you mean `traffic_light.amber_rejection.hysteresis_duration`?)",
        ),
        (
            "vehicle_constraint: 3.0",
            "a.yaml:3:5: `vehicle_constraint` is a group of parameters and has no value of its own \
             (did you mean `vehicle_constraint.max_speed`?)",
        ),
        (
            "duration_time: {value: 0.2}",
            "a.yaml:3:21: `duration_time.value` is no parameter of this node (did you mean `duration_time`?)",
        ),
        (
            "duration_time: 1",
            "a.yaml:3:5: Wrong parameter type, parameter {duration_time} is of type {double}, \
             setting it to {integer} is not allowed. (allowed: double, at least 0.0 s)",
        ),
        (
            "fallback_period_ms: 150.0",
            "a.yaml:3:5: Wrong parameter type, parameter {fallback_period_ms} is of type {integer}, \
             setting it to {double} is not allowed. (allowed: integer, 1 to 3600000 ms)",
        ),
        (
            "fallback_period_ms: \"150\"",
            "a.yaml:3:5: Wrong parameter type, parameter {fallback_period_ms} is of type {integer}, \
             setting it to {string} is not allowed. (allowed: integer, 1 to 3600000 ms)",
        ),
        (
            "autoware_interface: 0.53",
            "a.yaml:3:5: Wrong parameter type, parameter {autoware_interface} is of type {string}, \
             setting it to {double} is not allowed. (allowed: one of \"0.52\", \"0.53\", written in quotes)",
        ),
        (
            "safety.enable: 1",
            "a.yaml:3:5: Wrong parameter type, parameter {safety.enable} is of type {bool}, \
             setting it to {integer} is not allowed. (allowed: bool)",
        ),
        (
            "safety.penalty: [0, 1, 1, 1, 1]",
            "a.yaml:3:5: Wrong parameter type, parameter {safety.penalty} is of type {double_array}, \
             setting it to {integer_array} is not allowed. (allowed: double_array, at least 0.0)",
        ),
        (
            "use_sim_time: 1",
            "a.yaml:3:5: Wrong parameter type, parameter {use_sim_time} is of type {bool}, \
             setting it to {integer} is not allowed. (allowed: bool)",
        ),
        (
            "fallback_period_ms: 0",
            "a.yaml:3:5: `fallback_period_ms` is 0, outside its range (allowed: 1 to 3600000 ms)",
        ),
        (
            "duration_time: -0.1",
            "a.yaml:3:5: `duration_time` is -0.1, outside its range (allowed: at least 0.0 s)",
        ),
        (
            "wheel_base: 0.0",
            "a.yaml:3:5: `wheel_base` is 0.0, outside its range (allowed: greater than 0.0 and at most 50.0 m)",
        ),
        (
            "safety.penalty: [0.0, 0.1, -0.4, 1.0, 1.0]",
            "a.yaml:3:5: `safety.penalty` is -0.4, outside its range (allowed: at least 0.0)",
        ),
        (
            "duration_time: .nan",
            "a.yaml:3:5: `duration_time` is .nan, which is not a finite number (allowed: at least 0.0 s)",
        ),
        (
            "duration_time: .inf",
            "a.yaml:3:5: `duration_time` is .inf, which is not a finite number (allowed: at least 0.0 s)",
        ),
        (
            "autoware_interface: \"0.51\"",
            "a.yaml:3:5: `autoware_interface` names `0.51`, which does not exist \
             (allowed: one of \"0.52\", \"0.53\"; did you mean `0.52`?)",
        ),
        (
            "evaluation.travel_distance.decay_weight: [1.0]",
            "a.yaml:3:5: `evaluation.travel_distance.decay_weight` has 1 entries \
             (allowed: 16 entries, each at least 0.0)",
        ),
        ("duration_time:", "a.yaml:3:5: `duration_time` has no value"),
        ("duration_time: ~", "a.yaml:3:5: `duration_time` has no value"),
        ("safety.penalty: [0.0, 1]", "a.yaml:3:5: `safety.penalty` is a list of values of different types"),
        (
            "safety.penalty: [0.0, [1.0]]",
            "a.yaml:3:5: `safety.penalty` is a list with an entry that is not a single value",
        ),
        (
            "collision_check.drac.enable_assessment.car: [box]",
            "a.yaml:3:5: `collision_check.drac.enable_assessment.car` names `box`, which does not exist \
             (allowed: any of \"\", \"bbox\", \"polygon\", \"cylinder\"; did you mean `bbox`?)",
        ),
        (
            "collision_check.drac.enable_assessment.car: [\"\", bbox]",
            "a.yaml:3:5: `collision_check.drac.enable_assessment.car` mixes \"\" with other entries; \
             [\"\"] alone switches the assessment off",
        ),
        (
            "collision_check.rss.object_assumed_acceleration.base: 4.0",
            "a.yaml:3:5: `collision_check.rss.object_assumed_acceleration.base` is 4.0, outside its range \
             (allowed: at least -50.0 and less than 0.0 m/s2)",
        ),
        (
            "collision_check.global_setting.time_resolution: 0.0",
            "a.yaml:3:5: `collision_check.global_setting.time_resolution` is 0.0, outside its range \
             (allowed: greater than 0.0 and at most 1.0 s)",
        ),
        (
            "source.levels: [diffusion_planner]",
            "a.yaml:3:5: `source.penalty` has 3 entries but `source.levels` has 1: \
             entry i of one belongs to entry i of the other",
        ),
        (
            "safety.levels: [safe, safe, high_caution, danger, fatal]",
            "a.yaml:3:5: `safety.levels` names `safe` more than once",
        ),
        (
            "crosswalk.object_types: []",
            "a.yaml:3:5: `crosswalk.object_types` names nothing, which would switch the check off without a word; \
             remove the filter from the filter lists instead",
        ),
        (
            "boundary_departure.max_deceleration_mps2: 0.0",
            "a.yaml:3:5: `boundary_departure.max_deceleration_mps2` is 0.0, with which the vehicle never stops: \
             its magnitude must exceed 0.001",
        ),
    ];
    for (line, expected) in cases {
        assert_eq!(rendered(block(&[line])), [*expected], "{line}");
    }
}

#[test]
fn an_unknown_filter_is_answered_with_the_nearest_one() {
    let found = problems(block(&["filter_names: [\"\", safety::VehicleConstrainFilter]"]));
    assert_eq!(found.len(), 1);
    assert_eq!(found[0].kind, ProblemKind::NotAChoice { value: "safety::VehicleConstrainFilter".to_owned() });
    assert_eq!(found[0].nearest.as_deref(), Some("safety::VehicleConstraintFilter"));
    let found = problems(block(&["shadow_mode_filter_names: [OutOfLaneFilter]"]));
    assert_eq!(found[0].nearest.as_deref(), Some("safety::OutOfLaneFilter"));
}

#[test]
fn bad_yaml_is_answered_with_the_line() {
    for (yaml, line, part) in [
        ("/**:\n  ros__parameters:\n    a: [1, 2\n    b: 2\n", 4, "not valid YAML"),
        ("/**:\n\tros__parameters: {}\n", 2, "not valid YAML"),
        ("/**:\n  ros__parameters:\n    a: *nobody\n", 3, "not valid YAML"),
        ("/**:\n  ros__parameters:\n    [a]: 1\n", 3, "a key must be a plain text"),
        ("/**:\n  ros__parameters:\n    duration_time: !!int 0.5\n", 3, "cannot have the tag"),
        ("/**:\n  ros__parameters:\n    duration_time: !mine 0.5\n", 3, "cannot have the tag"),
        ("a: 1\n---\nb: 2\n", 3, "more than one YAML document"),
        ("", 1, "has no content"),
        ("# nothing\n", 1, "has no content"),
        ("just text", 1, "must be a node name above"),
        ("ros__parameters:\n  duration_time: 0.2\n", 1, "must be a node name above"),
        ("/**:\n  duration_time: 0.2\n", 2, "must be a node name above"),
        ("/**:\n  ros__parameters: 3\n", 2, "must be a map"),
        ("/**:\n  ros__parameters:\n    - duration_time: 0.2\n", 2, "must be a map"),
        ("/plan*:\n  ros__parameters: {}\n", 1, "is no node name pattern"),
    ] {
        let found = problems(text(yaml));
        assert_eq!(found.len(), 1, "{yaml:?}: {found:?}");
        let position = found[0].location.as_ref().unwrap().position.unwrap();
        assert_eq!(position.line, line, "{yaml:?}: {}", found[0]);
        assert!(found[0].message().contains(part), "{yaml:?}: {}", found[0]);
    }
}

#[test]
fn a_name_given_twice_in_one_block_names_both_lines() {
    let twice = "`duration_time` is given twice; first in line 3, again in line 5";
    let found = rendered(block(&["duration_time: 0.2", "safety.enable: true", "duration_time: 0.3"]));
    assert_eq!(found, [format!("a.yaml:5:5: {twice}")]);

    // Also when one is written with a dot and the other nested.
    let found = rendered(block(&["safety.enable: true", "safety:", "  enable: false"]));
    assert_eq!(found, ["a.yaml:5:7: `safety.enable` is given twice; first in line 3, again in line 5"]);

    let node_twice = "/**:\n  ros__parameters: {}\n/**:\n  ros__parameters: {}\n";
    assert_eq!(
        rendered(text(node_twice)),
        ["a.yaml:3:1: `/**` is given twice; first in line 1, again in line 3"]
    );
}

#[test]
fn all_problems_of_all_sources_come_at_once_in_order() {
    let sources = [
        text("/**:\n  ros__parameters:\n    b: 1\n    duration_time: 3\n"),
        Source::File("no/such/file.yaml".into()),
        assign("fallback_period_ms", "0"),
        assign("fallback_period_ms", "[1"),
        Source::Text { origin: "b.yaml".to_owned(), text: "/**:\n  ros__parameters:\n    c: 1\n".to_owned() },
    ];
    let error = Settings::load(NODE, &sources).unwrap_err();
    let origins: Vec<_> = error
        .problems
        .iter()
        .map(|p| {
            let location = p.location.clone().unwrap();
            (location.origin, location.position.map(|at| at.line))
        })
        .collect();
    let expected = [
        ("a.yaml", Some(3)),
        ("a.yaml", Some(4)),
        ("no/such/file.yaml", None),
        ("argument 3", None),
        ("argument 3", None),
        ("b.yaml", Some(3)),
    ];
    assert_eq!(origins, expected.map(|(origin, line)| (origin.to_owned(), line)));
    assert!(error.to_string().starts_with("6 problems with the parameters:\n  a.yaml:3:5: "));
}

#[test]
fn a_file_that_is_no_text_is_refused() {
    let path = std::env::temp_dir().join(format!("settings_load_{}.bin", std::process::id()));
    std::fs::write(&path, [0xff, 0xfe, 0x00]).unwrap();
    let found = problems(Source::File(path.clone()));
    std::fs::remove_file(path).unwrap();
    assert!(matches!(found[0].kind, ProblemKind::Unreadable { .. }), "{found:?}");
}

#[test]
fn a_broken_rule_is_not_reported_beside_the_mistake_that_caused_it() {
    let found = rendered(block(&["safety.levels: [safe, dangerous]", "safety.penalty: [0.0]"]));
    assert_eq!(found.len(), 1, "{found:?}");
    assert!(found[0].contains("names `dangerous`"));
}

#[test]
fn node_patterns_choose_the_blocks() {
    for (pattern, applies) in [
        ("/**", true),
        ("/planning/selector", true),
        ("planning/selector", true),
        ("/**/selector", true),
        ("/*/selector", true),
        ("/planning/**", true),
        ("/planning/*", true),
        ("selector", false),
        ("\"*\"", false),
        ("\"**\"", true),
        ("/selector", false),
        ("/planning/other", false),
        ("/control/**", false),
    ] {
        let source = text(&format!("{pattern}:\n  ros__parameters:\n    duration_time: 0.7\n"));
        let settings = load(source).unwrap();
        let expected = if applies { 0.7 } else { 0.2 };
        assert_eq!(settings.concatenator.duration_time, expected, "{pattern}");
        let warned = settings.warnings().iter().any(|w| matches!(w, Warning::NoBlockForNode { .. }));
        assert_eq!(warned, !applies, "{pattern}");
    }
}

#[test]
fn nested_node_names_and_other_nodes() {
    let settings = load(text(
        "planning:\n  selector:\n    ros__parameters:\n      duration_time: 0.7\n  \
         other:\n    ros__parameters:\n      whatever: [1, [2]]\n      duration_time: 9\n",
    ))
    .unwrap();
    assert_eq!(settings.concatenator.duration_time, 0.7);
}

#[test]
fn the_last_assignment_wins_whatever_its_pattern() {
    let file = |name: &str, value: f64| {
        text(&format!("{name}:\n  ros__parameters:\n    duration_time: {value:?}\n"))
    };
    for (sources, expected) in [
        (vec![file("/planning/selector", 0.5), file("/**", 0.6)], 0.6),
        (vec![file("/**", 0.6), file("/planning/selector", 0.5)], 0.5),
        (vec![file("/**", 0.6), assign("duration_time", "0.9")], 0.9),
        (vec![assign("duration_time", "0.9"), file("/**", 0.6)], 0.6),
    ] {
        let settings = Settings::load(NODE, &sources).unwrap();
        assert_eq!(settings.concatenator.duration_time, expected);
    }
    let one_file = "/planning/selector:\n  ros__parameters: {duration_time: 0.5}\n\
                    /**:\n  ros__parameters: {duration_time: 0.6}\n";
    assert_eq!(load(text(one_file)).unwrap().concatenator.duration_time, 0.6);
}

#[test]
fn nested_maps_lists_and_all_types() {
    let settings = load(block(&[
        "use_sim_time: true",
        "qos_overrides./parameter_events.publisher.depth: 10",
        "autoware_interface: \"0.52\"",
        "fallback_period_ms: 0x10",
        "generator_name_prefixes: []",
        "vehicle_constraint: {max_speed: 3.5, max_acceleration: 1.}",
        "evaluation:",
        "  decay_weight_base: &decay [1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 0.5]",
        "  travel_distance:",
        "    enable: off",
        "    decay_weight: *decay",
        "safety.scale: 2e1",
        "boundary_departure.boundary_types:",
        "  - road_border",
        "  - '1'",
    ]))
    .unwrap();
    assert!(settings.node.use_sim_time);
    assert_eq!(settings.selector.autoware_interface, AutowareInterface::V0_52);
    assert_eq!(settings.selector.fallback_period_ms, 16);
    assert_eq!(settings.selector.generator_name_prefixes, Vec::<String>::new());
    assert_eq!(settings.validator.vehicle_constraint.max_speed, 3.5);
    assert_eq!(settings.validator.vehicle_constraint.max_acceleration, 1.0);
    assert!(!settings.ranker.evaluation.travel_distance.enable);
    assert_eq!(settings.ranker.evaluation.travel_distance.decay_weight[15], 0.5);
    assert_eq!(settings.ranker.safety.scale, 20.0);
    assert_eq!(settings.validator.boundary_departure.boundary_types, ["road_border", "1"]);
}

#[test]
fn an_empty_list_fits_every_list() {
    let settings = load(block(&["safety.levels: []", "safety.penalty: []"])).unwrap();
    assert_eq!(settings.ranker.safety.levels, []);
    assert_eq!(settings.get("safety.penalty"), Some(&ParameterValue::DoubleArray(vec![])));
}

#[test]
fn values_per_class() {
    let settings = load(block(&[
        "collision_check.rss.stop_distance_margin: 3.0",
        "collision_check.drac.ego_footprint_margin.lateral: {base: 0.4, pedestrian: .nan, car: 0.2}",
        "collision_check.drac.enable_assessment: {base: [polygon], unknown: [], truck: [bbox]}",
        "collision_check.drac.map_based.mutual_yield_timeout_arbitration.enabled: {base: true, bicycle: false}",
    ]))
    .unwrap();
    let check = &settings.validator.collision_check;
    assert_eq!(*check.rss.stop_distance_margin.get(ObjectClass::Bus), 3.0);
    let lateral = &check.drac.ego_footprint_margin.lateral;
    for (class, expected) in [
        (ObjectClass::Car, 0.2),
        (ObjectClass::Pedestrian, 0.4),
        (ObjectClass::Bicycle, 0.5),
        (ObjectClass::Animal, 0.4),
    ] {
        assert_eq!(*lateral.get(class), expected, "{class:?}");
    }
    let shapes = &check.drac.enable_assessment;
    assert_eq!(*shapes.get(ObjectClass::Unknown), [Shape::Polygon]);
    assert_eq!(*shapes.get(ObjectClass::Truck), [Shape::Bbox]);
    assert_eq!(*shapes.get(ObjectClass::OverDrivable), [Shape::Nothing]);
    let mutual = &check.drac.map_based.mutual_yield_timeout_arbitration.enabled;
    assert!(*mutual.get(ObjectClass::Car));
    assert!(!*mutual.get(ObjectClass::Bicycle));
    assert!(*mutual.get(ObjectClass::Pedestrian));
}

#[test]
fn nan_is_refused_for_the_base() {
    for name in ["collision_check.rss.stop_distance_margin", "collision_check.rss.stop_distance_margin.base"]
    {
        let found = problems(assign(name, ".nan"));
        assert!(matches!(found[0].kind, ProblemKind::NotFinite { .. }), "{found:?}");
    }
}

#[test]
fn a_filter_in_both_lists_is_enforced_with_a_warning() {
    let settings = load(block(&[
        "filter_names: [safety::OutOfLaneFilter, safety::OutOfLaneFilter, \"\"]",
        "shadow_mode_filter_names: [\"\", safety::OutOfLaneFilter, safety::CollisionCheckFilter]",
    ]))
    .unwrap();
    let filters: Vec<_> = settings.validator.filters().iter().map(|f| (f.class, f.enforced)).collect();
    assert_eq!(filters, [(FilterClass::CollisionCheck, false), (FilterClass::OutOfLane, true)]);
    let class_name = || "safety::OutOfLaneFilter".to_owned();
    assert!(settings.warnings().contains(&Warning::FilterInBothLists { class_name: class_name() }));
    let repeated = Warning::FilterRepeated { class_name: class_name(), list: "filter_names" };
    assert!(settings.warnings().contains(&repeated));
}

#[test]
fn generators_whose_kind_is_unknown_are_a_warning() {
    let without_source = |entries: &str| -> Vec<String> {
        let settings = load(assign("generator_name_prefixes", entries)).unwrap();
        let of_generator = |warning: &Warning| match warning {
            Warning::GeneratorWithoutSource { entry } => Some(entry.clone()),
            _ => None,
        };
        settings.warnings().iter().filter_map(of_generator).collect()
    };
    assert_eq!(without_source("[DiffusionPlanner_, MyPlanner_=backup_planner_go]"), Vec::<String>::new());
    let found = without_source("[MinimumRuleBasedPlanner, DiffusionPlanner_, \"MyPlanner_=backup\"]");
    assert_eq!(found, ["MinimumRuleBasedPlanner", "MyPlanner_=backup"]);
    let text = Warning::GeneratorWithoutSource { entry: "MyPlanner_".to_owned() }.to_string();
    assert!(text.contains("write it as MyPlanner_=diffusion_planner"), "{text}");
}

#[test]
fn dimensions_of_the_vehicle_that_nobody_gave_are_a_warning() {
    let missing = |settings: &Settings| {
        settings.warnings().iter().find_map(|w| match w {
            Warning::VehicleDimensionsAssumed { names } => Some(names.clone()),
            _ => None,
        })
    };
    let none_given = Settings::load(NODE, &[]).unwrap();
    assert!(missing(&none_given).unwrap().starts_with("wheel_radius, wheel_width, wheel_base"));
    let one_given = load(assign("wheel_base", "2.79")).unwrap();
    assert!(!missing(&one_given).unwrap().contains("wheel_base"));
}

#[test]
fn without_sources_the_defaults_hold() {
    let settings = Settings::load(NODE, &[]).unwrap();
    assert_eq!(settings.settings_hash(), Settings::default().settings_hash());
    assert_eq!(settings.validator, Settings::default().validator);
}
