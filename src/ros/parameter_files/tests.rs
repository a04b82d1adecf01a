use std::io::Write as _;

use tempfile::NamedTempFile;

use super::*;
use crate::ros::arguments::parse;

fn file(text: &str) -> NamedTempFile {
    let mut file = NamedTempFile::with_suffix(".param.yaml").unwrap();
    file.write_all(text.as_bytes()).unwrap();
    file
}

/// What the node `/planning/selector` starts with.
fn start(arguments: &[&str]) -> Result<StartParameters, SettingsError> {
    let line = [&["p", "--ros-args", "-r", "__ns:=/planning"], arguments].concat();
    let ros = parse(line.into_iter().map(Into::into)).unwrap().ros.unwrap();
    load(&Names::new("selector", "/", &ros.remaps).unwrap(), &ros.parameters)
}

fn path(file: &NamedTempFile) -> &str {
    file.path().to_str().unwrap()
}

#[test]
fn nothing_given_is_the_shipped_configuration() {
    let StartParameters { settings, undeclared } = start(&[]).unwrap();
    assert_eq!(settings.settings_hash(), Settings::default().settings_hash());
    assert_eq!(undeclared, []);
}

#[test]
fn the_last_value_wins_whatever_names_the_node_better() {
    let exact = file("/planning/selector: {ros__parameters: {fallback_period_ms: 200, duration_time: 0.5}}");
    let all = file("/**: {ros__parameters: {fallback_period_ms: 300}}");
    for (arguments, period) in [
        (&["--params-file", path(&exact)][..], 200),
        (&["--params-file", path(&exact), "--params-file", path(&all)], 300),
        (&["--params-file", path(&all), "--params-file", path(&exact)], 200),
        (&["--params-file", path(&exact), "-p", "fallback_period_ms:=400"], 400),
        (&["-p", "fallback_period_ms:=400", "--params-file", path(&all)], 300),
        (&["-p", "fallback_period_ms:=1", "-p", "fallback_period_ms:=2"], 2),
        (&["-p", "selector:fallback_period_ms:=500"], 500),
        (&["-p", "another:fallback_period_ms:=500"], 150),
    ] {
        let settings = start(arguments).unwrap().settings;
        assert_eq!(settings.selector.fallback_period_ms, period, "{arguments:?}");
    }
    let merged = start(&["--params-file", path(&exact), "--params-file", path(&all)]).unwrap().settings;
    assert_eq!(merged.concatenator.duration_time, 0.5, "blocks are merged, not replaced");
}

#[test]
fn blocks_are_chosen_by_the_remapped_name() {
    for (pattern, expected) in [
        ("/**", true),
        ("/planning/**", true),
        ("/*/selector", true),
        ("/**/selector", true),
        ("planning/selector", true),
        ("/selector", false),
        ("/*", false),
        ("/control/**", false),
    ] {
        let file = file(&format!("{pattern}: {{ros__parameters: {{duration_time: 0.7}}}}"));
        let settings = start(&["--params-file", path(&file)]).unwrap().settings;
        assert_eq!(settings.concatenator.duration_time == 0.7, expected, "{pattern}");
        assert_eq!(settings.warnings().len(), if expected { 1 } else { 2 }, "{:?}", settings.warnings());
    }
    let nested =
        file("planning:\n  selector:\n    ros__parameters:\n      traffic_light:\n        jerk_limit: 6.0\n");
    let settings = start(&["--params-file", path(&nested)]).unwrap().settings;
    assert_eq!(settings.validator.traffic_light.jerk_limit, 6.0);
}

#[test]
fn values_of_the_command_line_are_yaml() {
    let arguments = [
        "-p",
        "use_sim_time:=true",
        "-p",
        "traffic_light.jerk_limit:=4.5",
        "-p",
        "generator_name_prefixes:=[A_, 'B c']",
        "-p",
        "autoware_interface:='0.52'",
        "-p",
        "source.penalty:=[0.0, 0.1, 0.2]",
    ];
    let settings = start(&arguments).unwrap().settings;
    assert!(settings.node.use_sim_time);
    assert_eq!(settings.validator.traffic_light.jerk_limit, 4.5);
    assert_eq!(settings.selector.generator_name_prefixes, ["A_", "B c"]);
    assert_eq!(settings.ranker.source.penalty, [0.0, 0.1, 0.2]);
}

#[test]
fn parameters_of_other_nodes_pass_and_are_told_once() {
    let shared = file(
        "/**:\n  ros__parameters:\n    use_sim_time: false\n    map_projector_type: MGRS\n    radar:\n      rate: 10.0\n\
         \x20   qos_overrides./clock.subscription.depth: 5\n",
    );
    let arguments = ["--params-file", path(&shared), "-p", "map_projector_type:=UTM"];
    let StartParameters { undeclared, .. } = start(&arguments).unwrap();
    let names: Vec<_> = undeclared.iter().map(|one| one.name.as_str()).collect();
    assert_eq!(names, ["map_projector_type", "radar.rate"]);
    assert!(
        undeclared[0].to_string().ends_with(".param.yaml:4:5: `map_projector_type`"),
        "{}",
        undeclared[0]
    );
}

#[test]
fn a_name_that_may_be_ours_is_refused() {
    for (name, nearest) in [
        ("fallback_period", Some("fallback_period_ms")),
        ("vehicle_constraint.max_sped", Some("vehicle_constraint.max_speed")),
        ("max_speed", Some("vehicle_constraint.max_speed")),
        ("traffic_light.entirely_new_limit", None),
    ] {
        let error = start(&["-p", &format!("{name}:=1.0")]).unwrap_err();
        assert_eq!(error.problems.len(), 1, "{error}");
        assert_eq!(error.problems[0].nearest.as_deref(), nearest, "{name}");
        assert!(error.to_string().contains(&format!("-p {name}:=1.0: `{name}` is no parameter")), "{error}");
    }
}

#[test]
fn everything_wrong_is_reported_at_once_with_its_place() {
    let wrong = file("/**:\n  ros__parameters:\n    fallback_period_ms: 0\n    duration_time: 1\n");
    let arguments = [
        "--params-file",
        path(&wrong),
        "--params-file",
        "/no/such/file.yaml",
        "-p",
        "use_sim_time:=1",
        "-p",
        "source.scale:=[1.0, a]",
    ];
    let error = start(&arguments).unwrap_err();
    let text = error.to_string();
    for expected in [
        format!("{}:3:5: `fallback_period_ms` is 0, outside its range", path(&wrong)),
        format!(
            "{}:4:5: Wrong parameter type, parameter {{duration_time}} is of type {{double}}, setting it to \
             {{integer}} is not allowed.",
            path(&wrong)
        ),
        "/no/such/file.yaml: cannot be read".to_owned(),
        "-p use_sim_time:=1: Wrong parameter type, parameter {use_sim_time} is of type {bool}".to_owned(),
        "-p source.scale:=[1.0, a]: `source.scale` is a list of values of different types".to_owned(),
    ] {
        assert!(text.contains(&expected), "{expected}\nin\n{text}");
    }
    assert_eq!(error.problems.len(), 5, "{text}");
}
