use super::*;
use crate::settings::parameter_table;
use messages::rcl_interfaces::{FloatingPointRange, IntegerRange, ParameterType};

const NODE: &str = "/planning/selector";
const NOW: Time = Time { sec: 7, nanosec: 8 };

fn store() -> ParameterStore {
    ParameterStore::new(NODE, Arc::new(Settings::default()))
}

fn names(names: &[&str]) -> Vec<String> {
    names.iter().map(|name| (*name).to_owned()).collect()
}

fn integer(value: i64) -> ParameterValue {
    ParameterValue { r#type: ParameterType::INTEGER, integer_value: value, ..Default::default() }
}

fn double(value: f64) -> ParameterValue {
    ParameterValue { r#type: ParameterType::DOUBLE, double_value: value, ..Default::default() }
}

fn boolean(value: bool) -> ParameterValue {
    ParameterValue { r#type: ParameterType::BOOL, bool_value: value, ..Default::default() }
}

fn doubles(values: &[f64]) -> ParameterValue {
    ParameterValue {
        r#type: ParameterType::DOUBLE_ARRAY,
        double_array_value: values.to_vec(),
        ..Default::default()
    }
}

fn strings(values: &[&str]) -> ParameterValue {
    ParameterValue {
        r#type: ParameterType::STRING_ARRAY,
        string_array_value: names(values),
        ..Default::default()
    }
}

fn parameter(name: &str, value: &ParameterValue) -> Parameter {
    Parameter { name: name.to_owned(), value: value.clone() }
}

fn set(
    store: &mut ParameterStore,
    parameters: &[(&str, ParameterValue)],
) -> (Vec<SetParametersResult>, Option<Change>) {
    let parameters = parameters.iter().map(|(name, value)| parameter(name, value)).collect();
    let (response, change) = store.set(&SetParametersRequest { parameters }, NOW);
    (response.results, change)
}

fn set_atomically(
    store: &mut ParameterStore,
    parameters: &[(&str, ParameterValue)],
) -> (SetParametersResult, Option<Change>) {
    let parameters = parameters.iter().map(|(name, value)| parameter(name, value)).collect();
    let (response, change) = store.set_atomically(&SetParametersAtomicallyRequest { parameters }, NOW);
    (response.result, change)
}

fn get(store: &ParameterStore, name: &str) -> ParameterValue {
    store.get(&GetParametersRequest { names: names(&[name]) }).values.remove(0)
}

fn describe(name: &str) -> ParameterDescriptor {
    store().describe(&DescribeParametersRequest { names: names(&[name]) }).descriptors.remove(0)
}

#[test]
fn values_and_types_come_in_the_order_of_the_names() {
    let asked =
        names(&["fallback_period_ms", "no_such_name", "use_sim_time", "duration_time", "source.penalty"]);
    let values = store().get(&GetParametersRequest { names: asked.clone() }).values;
    assert_eq!(
        values,
        [integer(150), ParameterValue::default(), boolean(false), double(0.2), doubles(&[0.0, 0.45, 0.5])]
    );
    let types = store().types(&GetParameterTypesRequest { names: asked }).types;
    assert_eq!(types, [2, 0, 1, 3, 8]);
    let interface = get(&store(), "autoware_interface");
    assert_eq!((interface.r#type, interface.string_value.as_str()), (4, "0.53"));
    assert_eq!(get(&store(), "filter_names").r#type, 9);
}

/// What `ros2 param dump` writes must be what `ros2 param load` takes.
#[test]
fn every_parameter_has_a_value_that_can_be_set_again() {
    let mut store = store();
    let event = store.declared(NOW);
    assert_eq!((event.stamp, event.node.as_str()), (NOW, NODE));
    assert_eq!(event.new_parameters.len(), parameter_table().len());
    for (parameter, descriptor) in event.new_parameters.iter().zip(parameter_table()) {
        let without_value = parameter.value.r#type == ParameterType::NOT_SET && descriptor.class_of.is_some();
        assert!(
            parameter.value.r#type == descriptor.kind.ros_type() || without_value,
            "{} {:?}",
            parameter.name,
            parameter.value
        );
    }
    let (result, change) =
        store.set_atomically(&SetParametersAtomicallyRequest { parameters: event.new_parameters }, NOW);
    assert_eq!(result.result.reason, "");
    assert_eq!(change, None, "nothing has changed");
}

#[test]
fn names_are_listed_sorted_with_their_groups() {
    let list = |prefixes: &[&str], depth| {
        store().list(&ListParametersRequest { prefixes: names(prefixes), depth }).result
    };
    let all = list(&[], 0);
    let with_value = parameter_table().iter().filter(|descriptor| descriptor.default != Value::NotSet);
    assert_eq!(all.names.len(), with_value.count(), "classes of objects that say nothing are left out");
    assert!(all.names.is_sorted() && all.prefixes.is_sorted());
    assert!(all.prefixes.contains(&"collision_check.rss.stop_distance_margin".to_owned()));
    let top = list(&[], 1);
    assert!(top.names.contains(&"fallback_period_ms".to_owned()) && top.prefixes.is_empty());
    assert!(!top.names.iter().any(|name| name.contains('.')));
    let source = list(&["source", "use_sim_time"], 1);
    assert_eq!(
        source.names,
        ["source.enable", "source.levels", "source.penalty", "source.scale", "use_sim_time"]
    );
    assert_eq!(source.prefixes, ["source"]);
}

#[test]
fn descriptions_tell_range_type_and_whether_it_can_change() {
    let period = describe("fallback_period_ms");
    assert_eq!((period.name.as_str(), period.r#type), ("fallback_period_ms", ParameterType::INTEGER));
    assert_eq!(period.integer_range, Some(IntegerRange { from_value: 1, to_value: 3_600_000, step: 0 }));
    assert_eq!((period.floating_point_range, period.read_only, period.dynamic_typing), (None, false, false));
    assert!(period.description.starts_with("Time after the last generative message"));
    assert_eq!(period.additional_constraints, "1 to 3600000 ms");

    let base = describe("wheel_base");
    let range = FloatingPointRange { from_value: f64::from_bits(1), to_value: 50.0, step: 0.0 };
    assert_eq!((base.floating_point_range, base.read_only), (Some(range), true));
    let age = describe("duration_time").floating_point_range.unwrap();
    assert_eq!((age.from_value, age.to_value), (0.0, f64::MAX));

    let interface = describe("autoware_interface");
    assert_eq!(interface.additional_constraints, "one of \"0.52\", \"0.53\"");
    assert_eq!((interface.floating_point_range, interface.integer_range), (None, None));
    assert_eq!(describe("use_sim_time").additional_constraints, "");
    assert_eq!(describe("source.penalty").floating_point_range, None, "no ranges on lists");

    let unknown = describe("no_such_name");
    assert_eq!(unknown, ParameterDescriptor { name: "no_such_name".to_owned(), ..Default::default() });
}

/// The range that is told and the range that is checked are the same, to the last bit.
#[test]
fn the_ends_of_every_range_are_accepted_and_the_next_numbers_refused() {
    let mut numbers = 0;
    for descriptor in parameter_table().iter().filter(|descriptor| !descriptor.read_only) {
        let told = describe(&descriptor.name);
        let inside = |value: ParameterValue, expected: bool| {
            let (result, _) = set_atomically(&mut store(), &[(&descriptor.name, value.clone())]);
            let out_of_range = result.reason.contains("outside its range");
            assert_eq!(!out_of_range, expected, "{} {value:?}: {}", descriptor.name, result.reason);
        };
        if let Some(range) = told.floating_point_range {
            numbers += 1;
            inside(double(range.from_value), true);
            inside(double(range.to_value), true);
            if descriptor.minimum.is_some() {
                inside(double(range.from_value.next_down()), false);
            }
            if descriptor.maximum.is_some() {
                inside(double(range.to_value.next_up()), false);
            }
        }
        if let Some(range) = told.integer_range {
            numbers += 1;
            inside(integer(range.from_value), true);
            inside(integer(range.to_value), true);
            inside(integer(range.from_value.wrapping_sub(1)), range.from_value == i64::MIN);
            inside(integer(range.to_value.wrapping_add(1)), range.to_value == i64::MAX);
        }
    }
    assert!(numbers > 50, "only {numbers} parameters have a range");
}

#[test]
fn parameters_are_set_one_by_one() {
    let mut store = store();
    let (results, change) = set(
        &mut store,
        &[
            ("fallback_period_ms", integer(200)),
            ("duration_time", double(-1.0)),
            ("no_such_name", integer(1)),
            ("traffic_light.jerk_limit", double(6.0)),
            ("wheel_base", double(3.0)),
        ],
    );
    let successful: Vec<bool> = results.iter().map(|result| result.successful).collect();
    assert_eq!(successful, [true, false, false, true, false]);
    let change = change.unwrap();
    assert_eq!(change.settings, *store.settings());
    assert_eq!(change.settings.selector.fallback_period_ms, 200);
    assert_eq!(change.settings.validator.traffic_light.jerk_limit, 6.0);
    assert_eq!(change.settings.concatenator.duration_time, 0.2);
    let events: Vec<_> = change.events.iter().map(|event| event.changed_parameters.clone()).collect();
    assert_eq!(
        events,
        [
            [parameter("fallback_period_ms", &integer(200))],
            [parameter("traffic_light.jerk_limit", &double(6.0))]
        ]
    );
    assert!(change.events.iter().all(|event| event.node == NODE && event.stamp == NOW));
    assert_eq!(get(&store, "fallback_period_ms"), integer(200));
}

#[test]
fn a_group_is_set_as_a_whole_or_not_at_all() {
    let mut store = store();
    let before = store.settings().clone();
    let good = ("fallback_period_ms", integer(200));
    for (bad, reason) in [
        (("duration_time", double(-1.0)), "`duration_time` is -1.0, outside its range"),
        (("source.scale", double(f64::NAN)), "`source.scale` is .nan, which is not a finite number"),
        (("duration_tim", double(1.0)), "did you mean `duration_time`?"),
        (("autoware_interface", boolean(true)), "is of type {string}, setting it to {bool} is not allowed."),
        (("vehicle_height", double(3.0)), "`vehicle_height` is read-only: it is fixed at start"),
        (("qos_overrides./clock.subscription.depth", integer(5)), "is read-only"),
        (("duration_time", ParameterValue::default()), "`duration_time` has no value"),
        (("source.penalty", doubles(&[0.0])), "source."),
    ] {
        let (result, change) = set_atomically(&mut store, &[good.clone(), bad.clone()]);
        assert!(!result.successful && result.reason.contains(reason), "{bad:?}: {}", result.reason);
        assert_eq!(change, None, "{bad:?}");
        assert!(Arc::ptr_eq(store.settings(), &before), "{bad:?}");
    }
    // what is wrong alone can be right together
    let levels = strings(&["diffusion_planner"]);
    let (result, change) =
        set_atomically(&mut store, &[("source.penalty", doubles(&[0.1])), ("source.levels", levels.clone())]);
    assert_eq!(result, SetParametersResult { successful: true, reason: String::new() });
    let change = change.unwrap();
    assert_eq!(change.settings.ranker.source.penalty, [0.1]);
    assert_eq!(change.events.len(), 1, "one event for the whole group");
    assert_eq!(
        change.events[0].changed_parameters,
        [parameter("source.levels", &levels), parameter("source.penalty", &doubles(&[0.1]))]
    );
    assert!(change.events[0].new_parameters.is_empty() && change.events[0].deleted_parameters.is_empty());
}

#[test]
fn all_reasons_are_told() {
    let parameters = [("duration_time", double(-1.0)), ("fallback_period_ms", integer(0))];
    let (result, _) = set_atomically(&mut store(), &parameters);
    assert!(result.reason.contains("duration_time") && result.reason.contains("; `fallback_period_ms` is 0"));
    let bytes = ParameterValue { r#type: ParameterType::BYTE_ARRAY, ..Default::default() };
    let odd = ParameterValue { r#type: 77, ..Default::default() };
    let (result, _) = set_atomically(&mut store(), &[("duration_time", bytes), ("source.scale", odd)]);
    assert_eq!(
        result.reason,
        "`duration_time`: no parameter of this node is a byte_array; `source.scale`: 77 is no type of a parameter"
    );
}

#[test]
fn the_timer_restarts_for_a_new_period_only() {
    let mut store = store();
    for (value, changed, period) in
        [(150, false, None), (500, true, Some(500)), (500, false, None), (400, true, Some(400))]
    {
        let (result, change) = set_atomically(&mut store, &[("fallback_period_ms", integer(value))]);
        assert!(result.successful);
        assert_eq!(change.is_some(), changed, "{value}");
        assert_eq!(change.and_then(|change| change.fallback_period_ms), period, "{value}");
    }
    // another parameter leaves the timer alone
    let (_, change) =
        set(&mut store, &[("duration_time", double(0.5)), ("fallback_period_ms", integer(400))]);
    assert_eq!(change.unwrap().fallback_period_ms, None);
    // there and back within one request: nothing to restart
    let (results, change) =
        set(&mut store, &[("fallback_period_ms", integer(300)), ("fallback_period_ms", integer(400))]);
    assert!(results.iter().all(|result| result.successful));
    let change = change.unwrap();
    assert_eq!((change.events.len(), change.fallback_period_ms), (2, None));
}

#[test]
fn the_clock_is_told_when_its_source_changes() {
    let mut store = store();
    let change = |store: &mut _, value| set_atomically(store, &[("use_sim_time", boolean(value))]).1;
    assert_eq!(change(&mut store, true).unwrap().use_sim_time, Some(true));
    assert_eq!(change(&mut store, true), None);
    assert_eq!(change(&mut store, false).unwrap().use_sim_time, Some(false));
}

#[test]
fn classes_of_objects_go_back_to_their_base() {
    let mut store = store();
    let (group, own) =
        ("collision_check.rss.stop_distance_margin", "collision_check.rss.stop_distance_margin.car");
    assert!(get(&store, own).double_value.is_nan());
    let (result, change) = set_atomically(&mut store, &[(own, double(1.25)), (group, double(2.5))]);
    assert!(result.successful, "{}", result.reason);
    assert_eq!(change.unwrap().events[0].changed_parameters[0].name, format!("{group}.base"));
    assert_eq!((get(&store, own), get(&store, group)), (double(1.25), double(2.5)));
    let (result, change) = set_atomically(&mut store, &[(own, double(f64::NAN))]);
    assert!(result.successful && change.is_some());
    assert!(get(&store, own).double_value.is_nan());
    let switch = "collision_check.drac.constant_curvature.enable_assessment.car";
    assert_eq!(get(&store, switch), ParameterValue::default());
    for value in [boolean(false), ParameterValue::default()] {
        let (result, change) = set_atomically(&mut store, &[(switch, value.clone())]);
        assert!(result.successful && change.is_some(), "{}", result.reason);
        assert_eq!(get(&store, switch), value);
    }
}

#[test]
fn a_name_given_twice_has_its_last_value() {
    let mut store = store();
    let twice = [("duration_time", double(0.5)), ("duration_time", double(0.7))];
    let (result, change) = set_atomically(&mut store, &twice);
    assert!(result.successful);
    assert_eq!(change.unwrap().events[0].changed_parameters, [parameter("duration_time", &double(0.7))]);
    let (results, change) = set(&mut store, &[]);
    assert_eq!((results, change), (Vec::new(), None));
}
