//! What people write: parameter files, ROS arguments, parking scenes, sequences for `verify`.

use lanelet_map::MapBuilder;
use motion::VehicleInfo;
use open_space::{CollisionChecker, Limits};
use selection::filters::CLASSES;
use selection::parameters::ValidatorParameters;
use selection::verdict::Failure;
use selection::{Scratch, Validator, Verdict};
use std::cell::RefCell;
use std::ffi::OsString;
use std::path::Path;
use std::str;
use std::sync::LazyLock;
use trajectory_selector::commands::verify;
use trajectory_selector::golden::{Maps, Sequence};
use trajectory_selector::parking_scene::ParkingScene;
use trajectory_selector::ros::{arguments, names::Names};
use trajectory_selector::settings::{ParameterDescriptor, ParameterValue, Problem, Settings, Source};

const NODE: &str = "/trajectory_selector_node";

/// Of so many files one goes through all doors, with all parameters.
const IN_FULL: usize = 16;

/// A parameter file; with a NUL in it, what stands behind that is a single parameter. What is accepted has a hash, and can
/// be changed to what it is.
pub fn parameter_files(bytes: &[u8]) {
    let Ok(text) = str::from_utf8(bytes) else { return };
    let (text, single) = text.split_once('\0').map_or((text, None), |(text, single)| (text, Some(single)));
    let mut sources = vec![Source::Text { origin: "fuzzed".to_owned(), text: text.to_owned() }];
    if let Some((name, value)) = single.and_then(|single| single.split_once(":=")) {
        let origin = "-p".to_owned();
        sources.push(Source::Override { name: name.to_owned(), value: value.to_owned(), origin });
    }
    let is_in_full = text.len().is_multiple_of(IN_FULL);
    let settings = match Settings::load(NODE, &sources) {
        Ok(settings) => settings,
        Err(error) => {
            let is_told = |problems: &[Problem]| {
                !problems.is_empty() && problems.iter().all(|problem| !problem.to_string().is_empty())
            };
            assert!(is_told(&error.problems), "refused without a reason");
            // The other door costs as much again.
            if is_in_full {
                assert!(is_told(&Settings::check(NODE, &sources)), "refused without a reason");
            }
            return;
        }
    };
    let is_wanted = |(parameter, value): &(&ParameterDescriptor, &ParameterValue)| {
        is_in_full || parameter.default != **value
    };
    let changes: Vec<_> = settings
        .iter()
        .filter(is_wanted)
        .map(|(parameter, value)| (parameter.name.clone(), value.clone()))
        .collect();
    // Some may not be changed while a node runs; that is an answer, too.
    if let Ok(same) = settings.with_changes(&changes) {
        assert!(same.iter().map(|(_, value)| value).eq(settings.iter().map(|(_, value)| value)));
        assert!(!is_in_full || same.settings_hash() == settings.settings_hash());
    }
}

/// A command line, one argument in each line, and the names that follow from it.
pub fn ros_arguments(bytes: &[u8]) {
    let Ok(text) = str::from_utf8(bytes) else { return };
    let Ok(line) = arguments::parse(text.split('\n').map(OsString::from)) else { return };
    let Some(ros) = line.ros else { return };
    let Ok(names) = Names::new("trajectory_selector_node", "/", &ros.remaps) else { return };
    assert!(names.fully_qualified().starts_with('/'));
    for topic in ["~/input/odometry", "/clock", "output/trajectory"] {
        if let Ok(name) = names.topic(topic) {
            assert!(name.starts_with('/') && !name.contains("//"), "{name}");
        }
    }
}

/// A parking scene. What is accepted has a place for its vehicle.
pub fn parking_scene(bytes: &[u8]) {
    let Ok(text) = str::from_utf8(bytes) else { return };
    let vehicle = VehicleInfo::default();
    match ParkingScene::parse(text, "fuzzed", "fuzzed", &vehicle, &Limits::default()) {
        Ok(scene) => {
            let checker = CollisionChecker::new(&scene.problem).expect("what is accepted can be asked for");
            assert!(checker.is_free(&scene.problem.start, 0.0) && checker.is_free(&scene.problem.goal, 0.0));
        }
        Err(error) => assert!(!error.problems.is_empty() && !error.to_string().is_empty()),
    }
}

/// Most points, objects and so on of a sequence that is not only read but judged: bytes are a measure of them.
const MAX_JUDGED_BYTES: usize = 8_000;

thread_local! {
    /// As in a node: made once, and never a memory of what was judged before.
    pub(crate) static SCRATCH: RefCell<Scratch> = RefCell::new(Scratch::default());
}

/// A sequence for `verify`, and all filters on it, whatever it wants.
pub fn verify_scene(bytes: &[u8]) {
    static MAP: LazyLock<std::sync::Arc<lanelet_map::Map>> =
        LazyLock::new(|| std::sync::Arc::new(MapBuilder::new().build().expect("an empty map")));
    let mut maps = Maps::of_one(MAP.clone());
    let Ok(sequence) = Sequence::parse(Path::new("fuzzed.json"), bytes, &mut maps) else { return };
    if bytes.len() > MAX_JUDGED_BYTES {
        return;
    }
    let parameters = ValidatorParameters {
        filter_names: CLASSES.iter().map(|class| class.class_name.to_owned()).collect(),
        ..sequence.parameters.clone()
    };
    let mut validator = Validator::new(parameters, &sequence.vehicle).expect("these filters are built");
    for cycle in &sequence.cycles {
        let verdicts = SCRATCH.with_borrow_mut(|scratch| verify::run_cycle(&mut validator, cycle, scratch));
        assert_eq!(verdicts.len(), cycle.candidates.len());
        verdicts.iter().for_each(no_filter_panicked);
    }
}

/// A filter that panics rejects; that is no reason for it to panic.
pub(crate) fn no_filter_panicked(verdict: &Verdict) {
    for judgement in &verdict.judgements {
        assert!(!matches!(judgement.failure, Some(Failure::Panicked(_))), "{judgement:?}");
    }
}
