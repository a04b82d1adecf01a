//! Changes at run time, the hash, and that every parameter is what was set.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may fail loudly")]
use proptest::prelude::*;
use proptest::sample::Index;
use trajectory_selector::settings::{
    ParameterDescriptor, ParameterKind, ParameterValue, ProblemKind, Settings, Source, parameter_table,
};

fn change(name: &str, value: ParameterValue) -> (String, ParameterValue) {
    (name.to_owned(), value)
}

#[test]
fn a_change_makes_new_settings_and_leaves_the_old_alone() {
    let old = Settings::default();
    let new = old.with_changes(&[change("fallback_period_ms", ParameterValue::Integer(500))]).unwrap();
    assert_eq!(new.selector.fallback_period_ms, 500);
    assert_eq!(old.selector.fallback_period_ms, 150);
    assert_eq!(new.warnings(), []);
    assert_eq!(new.with_changes(&[change("fallback_period_ms", ParameterValue::Integer(150))]).unwrap(), old);
}

#[test]
fn changes_are_accepted_or_refused_as_a_whole() {
    let settings = Settings::default();
    let shorter = change("source.penalty", ParameterValue::DoubleArray(vec![0.0]));
    let levels = change("source.levels", ParameterValue::StringArray(vec!["backup_planner_go".to_owned()]));
    assert!(settings.with_changes(std::slice::from_ref(&shorter)).is_err());
    let both = settings.with_changes(&[shorter.clone(), levels]).unwrap();
    assert_eq!(both.ranker.source.penalty, [0.0]);

    let good = change("duration_time", ParameterValue::Double(0.5));
    let error = settings.with_changes(&[good, shorter]).unwrap_err();
    assert_eq!(error.problems.len(), 1);
    assert_eq!(error.problems[0].location, None);
}

#[test]
fn refused_changes() {
    let kinds = |name: &str, value: ParameterValue| {
        let error = Settings::default().with_changes(&[change(name, value)]).unwrap_err();
        assert_eq!(error.problems.len(), 1, "{error}");
        error.problems.into_iter().next().unwrap().kind
    };
    let names = ParameterValue::StringArray(vec![String::new()]);
    assert_eq!(kinds("filter_names", names), ProblemKind::ReadOnly);
    assert_eq!(kinds("wheel_base", ParameterValue::Double(3.0)), ProblemKind::ReadOnly);
    assert_eq!(kinds("no_such_name", ParameterValue::Bool(true)), ProblemKind::Unknown);
    assert_eq!(kinds("duration_time", ParameterValue::NotSet), ProblemKind::NoValue);
    let kind = kinds("duration_time", ParameterValue::Double(f64::NAN));
    assert!(matches!(kind, ProblemKind::NotFinite { .. }));
    let kind = kinds("duration_time", ParameterValue::Integer(1));
    assert!(matches!(kind, ProblemKind::WrongType { .. }));
}

#[test]
fn setting_a_read_only_parameter_to_its_value_is_no_change() {
    let settings = Settings::default();
    let same = change("wheel_base", settings.get("wheel_base").unwrap().clone());
    assert_eq!(settings.with_changes(&[same]).unwrap(), settings);
}

/// Another value for a parameter, inside its range.
fn other_value(descriptor: &ParameterDescriptor) -> ParameterValue {
    let number = |current: f64| {
        let low = descriptor.minimum.map_or(current - 1.0, |bound| bound.value);
        let high = descriptor.maximum.map_or(current + 1.0, |bound| bound.value);
        if low + (high - low) / 4.0 == current { low + (high - low) / 2.0 } else { low + (high - low) / 4.0 }
    };
    match &descriptor.default {
        ParameterValue::Bool(value) => ParameterValue::Bool(!value),
        ParameterValue::Integer(value) => ParameterValue::Integer(value + 1),
        ParameterValue::Double(value) => ParameterValue::Double(number(*value)),
        ParameterValue::String(value) => {
            ParameterValue::String(descriptor.choices.iter().find(|c| *c != value).unwrap().clone())
        }
        ParameterValue::DoubleArray(list) => {
            ParameterValue::DoubleArray(list.iter().map(|value| value + 0.5).collect())
        }
        ParameterValue::StringArray(list) if descriptor.choices.is_empty() => {
            ParameterValue::StringArray(list.iter().map(|text| format!("{text}x")).collect())
        }
        ParameterValue::StringArray(list) => {
            let mut list = list.clone();
            list.reverse();
            if list.len() < 2 {
                list = vec![descriptor.choices.iter().find(|c| !list.contains(c)).unwrap().clone()];
            }
            ParameterValue::StringArray(list)
        }
        ParameterValue::NotSet => match descriptor.kind {
            ParameterKind::Bool => ParameterValue::Bool(true),
            ParameterKind::Double => ParameterValue::Double(number(0.0)),
            _ => ParameterValue::StringArray(vec![descriptor.choices[1].clone()]),
        },
        other => panic!("no other value for {other}"),
    }
}

/// Braking limits of one group must keep their order.
const ORDERED: [&str; 4] = ["safe_limit", "low_caution_limit", "danger_limit", "fatal_limit"];

/// Loads a value for a parameter; of a braking limit for all limits of its group, which keeps their order.
fn with_value(descriptor: &ParameterDescriptor, value: &ParameterValue) -> Result<Settings, String> {
    let mut path: Vec<&str> = descriptor.name.split('.').collect();
    let limit = path.len().checked_sub(2).filter(|at| ORDERED.contains(&path[*at]));
    let names = match limit {
        None => vec![descriptor.name.clone()],
        Some(at) => ORDERED
            .iter()
            .map(|limit| {
                path[at] = limit;
                path.join(".")
            })
            .filter(|name| parameter_table().iter().any(|d| d.name == *name))
            .collect(),
    };
    let sources: Vec<Source> = names.iter().map(|name| set(name, value)).collect();
    Settings::load("/selector", &sources).map_err(|error| error.to_string())
}

fn set(name: &str, value: &ParameterValue) -> Source {
    Source::Override { name: name.to_owned(), value: value.to_string(), origin: "test".to_owned() }
}

#[test]
fn the_hash_changes_with_every_parameter_and_with_nothing_else() {
    let mut hashes = std::collections::HashMap::from([(Settings::default().settings_hash(), "defaults")]);
    for descriptor in parameter_table() {
        let value = other_value(descriptor);
        let settings = with_value(descriptor, &value).unwrap_or_else(|e| panic!("{}: {e}", descriptor.name));
        assert_eq!(settings.get(&descriptor.name), Some(&value), "{}", descriptor.name);
        let hash = settings.settings_hash();
        assert_eq!(hash.len(), 64);
        let braking = descriptor.name.contains("_limit.");
        if let Some(other) = hashes.insert(hash, &descriptor.name) {
            assert!(braking, "{} has the hash of {other}", descriptor.name);
        }
    }
    let explicit =
        Settings::load("/selector", &[set("duration_time", &ParameterValue::Double(0.2))]).unwrap();
    assert_eq!(explicit.settings_hash(), Settings::default().settings_hash());
}

/// The hash is compared between machines and versions: its definition must not change unnoticed.
#[test]
fn the_hash_is_over_sorted_lines_of_name_and_value() {
    use sha2::{Digest as _, Sha256};
    let settings = Settings::default();
    let mut lines: Vec<String> =
        settings.iter().map(|(descriptor, value)| format!("{}={value}\n", descriptor.name)).collect();
    lines.sort();
    assert!(lines.iter().any(|line| line == "duration_time=0.2\n"));
    assert!(lines.iter().any(|line| line == "autoware_interface=\"0.53\"\n"));
    let expected: String = Sha256::digest(lines.concat()).iter().map(|byte| format!("{byte:02x}")).collect();
    assert_eq!(settings.settings_hash(), expected);
}

fn numbers() -> Vec<&'static ParameterDescriptor> {
    parameter_table().iter().filter(|d| d.kind == ParameterKind::Double).collect()
}

proptest! {
    #[test]
    fn any_number_inside_its_range_is_kept_exactly(which: Index, share in 0.0..=1.0_f64) {
        let numbers = numbers();
        let descriptor = which.get(&numbers);
        let low = descriptor.minimum.map_or(-1e6, |bound| bound.value);
        let high = descriptor.maximum.map_or(1e6, |bound| bound.value);
        let value = low + (high - low) * share;
        let inside = |bound: Option<trajectory_selector::settings::Bound>| {
            bound.is_none_or(|bound| bound.inclusive || value != bound.value)
        };
        let never_stops = descriptor.name.starts_with("boundary_departure.max_") && value.abs() <= 1e-3;
        prop_assume!(inside(descriptor.minimum) && inside(descriptor.maximum) && !never_stops);
        let set = ParameterValue::Double(value);
        let settings = with_value(descriptor, &set).map_err(TestCaseError::fail)?;
        prop_assert_eq!(settings.get(&descriptor.name), Some(&set));
    }

    #[test]
    fn any_number_outside_its_range_is_refused(which: Index, beyond in 1e-9..1e9_f64) {
        let numbers = numbers();
        let descriptor = which.get(&numbers);
        let outside = [
            descriptor.minimum.map(|bound| bound.value - beyond),
            descriptor.maximum.map(|bound| bound.value + beyond),
        ];
        for value in outside.into_iter().flatten() {
            let refused = with_value(descriptor, &ParameterValue::Double(value));
            prop_assert!(refused.is_err(), "{} = {value}", descriptor.name);
        }
    }

    #[test]
    fn any_text_is_kept_exactly(prefixes in prop::collection::vec(any::<String>(), 0..4)) {
        let value = ParameterValue::StringArray(prefixes.clone());
        let settings = Settings::load("/selector", &[set("generator_name_prefixes", &value)]).unwrap();
        prop_assert_eq!(settings.selector.generator_name_prefixes, prefixes);
    }

    /// Whatever stands in a file: an answer, no panic.
    #[test]
    fn any_text_as_a_file_has_an_answer(text in "[-a-z0-9:*&!{}\\[\\],.\"'#|>~ \n/]{0,200}") {
        let block = format!("/**:\n  ros__parameters:\n    {text}");
        for text in [text, block] {
            let _ = Settings::load("/selector", &[Source::Text { origin: "any".to_owned(), text }]);
        }
    }
}
