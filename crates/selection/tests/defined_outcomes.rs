//! Every filter has a defined outcome on the safe side for inputs that are missing, odd, or replaced.
//!
//! The world holds a danger for each filter: the one candidate is too fast, drives at a parked car, over the stop lines
//! of a red light and of a crosswalk where somebody waits, and off the road over its border. Whatever happens to the
//! inputs, a filter either still rejects it, or has been told that its danger is not there, or says that it cannot
//! judge and why.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

#[path = "street_support/world.rs"]
mod world;

use lanelet_map::MapBuilder;
use messages::autoware_perception_msgs::{PredictedObjects, TrafficLightGroupArray};
use motion::VehicleInfo;
use selection::filters::CLASSES;
use selection::parameters::ValidatorParameters;
use selection::validator::LoadedFilter;
use selection::verdict::Failure;
use selection::{Judgement, Scene, Scratch, Validator};
use std::sync::Arc;
use world::*;

fn without_paths(scene: &mut Scene) {
    let mut objects = (**scene.objects.as_ref().unwrap()).clone();
    objects.objects.iter_mut().for_each(|object| object.kinematics.predicted_paths.clear());
    scene.objects = Some(Arc::new(objects));
}

fn without_objects(scene: &mut Scene) {
    let header = header(scene.now.sec);
    scene.objects = Some(Arc::new(PredictedObjects { header, objects: Vec::new() }));
}

fn light_shows_for(scene: &mut Scene, id: i64) {
    let signals = TrafficLightGroupArray { stamp: scene.now, traffic_light_groups: red_light(id) };
    scene.traffic_signals = Some(Arc::new(signals));
}

/// What a filter says.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Outcome {
    /// It objects, with a place, and says why.
    Rejects,
    /// It has nothing against the candidate: the danger it looks for is not there.
    Accepts,
    /// It cannot judge, for this reason.
    NotAssessed(&'static str),
}

use Outcome::{Accepts, NotAssessed, Rejects};

/// What is done to the world, and when the cycle is, by number of the cycle.
type Situation = fn(i32) -> (i32, fn(&mut Scene));

/// A situation of some cycles and the outcome of each filter in the last one, in the order of [`CLASSES`].
type Row = (&'static str, i32, Situation, [Outcome; 6]);

const NAMES: [&str; 6] = [
    "collision_check_filter",
    "crosswalk_filter",
    "out_of_lane_filter",
    "traffic_light_filter",
    "uncrossable_boundary_departure_filter",
    "vehicle_constraint_filter",
];

fn nothing(_: &mut Scene) {}

#[rustfmt::skip]
const ROWS: &[Row] = &[
    ("all inputs, one cycle", 1, |_| (START_S, nothing),
        [Rejects, Rejects, Rejects, Rejects, Rejects, Rejects]),
    ("a map without lights", 1, |_| (START_S, |scene| scene.map = map(1, street(false))),
        [Rejects, Rejects, Rejects, Accepts, Rejects, Rejects]),
    ("a map without anything", 1, |_| (START_S, |scene| scene.map = map(1, MapBuilder::new().build().unwrap())),
        [Rejects, NotAssessed("lanelet 1 is not in the map"),
         NotAssessed("the lanelet map has no lanelet of the configured subtypes"),
         NotAssessed("lanelet 1 is not in the map"),
         NotAssessed("Lanelet map is not available in the context."), Rejects]),
    ("a route that leaves the map", 1, |_| (START_S, |scene| scene.route = route(1, &[ROAD, 77])),
        [Rejects, NotAssessed("lanelet 77 is not in the map"), Rejects, NotAssessed("lanelet 77 is not in the map"),
         Rejects, Rejects]),
    ("an empty route", 1, |_| (START_S, |scene| scene.route = route(1, &[])),
        [Rejects, Accepts, Rejects, Accepts, Rejects, Rejects]),
    ("objects without paths", 1, |_| (START_S, without_paths),
        [Rejects, Rejects, Rejects, Rejects, Rejects, Rejects]),
    ("a message without objects", 1, |_| (START_S, without_objects),
        [Accepts, Accepts, Rejects, Rejects, Rejects, Rejects]),
    ("objects of another time", 1, |_| (START_S, |scene| scene.objects = Some(Arc::default())),
        [NotAssessed("predicted objects and odometry are 1000.0 s apart"), Accepts, Rejects, Rejects, Rejects, Rejects]),
    ("a light id that does not exist", 1, |_| (START_S, |scene| light_shows_for(scene, 4711)),
        [Rejects, Rejects, Rejects, Accepts, Rejects, Rejects]),
    ("the id of a crosswalk as a light", 1, |_| (START_S, |scene| light_shows_for(scene, 600)),
        [Rejects, Rejects, Rejects, Accepts, Rejects, Rejects]),
    ("a second route elsewhere", 2, |cycle| match cycle {
        0 => (START_S, nothing),
        _ => (START_S + 1, |scene| scene.route = route(2, &[TURN_OFF])),
    }, [Rejects, Accepts, Rejects, Accepts, Rejects, Rejects]),
    ("a second route off the map, then the first again", 3, |cycle| match cycle {
        1 => (START_S + 1, |scene| scene.route = route(2, &[77])),
        0 => (START_S, nothing),
        _ => (START_S + 2, |scene| scene.route = route(3, &[ROAD])),
    }, [Rejects, Rejects, Rejects, Rejects, Rejects, Rejects]),
    ("another map in the middle of a drive", 2, |cycle| match cycle {
        0 => (START_S, |scene| scene.map = map(1, street(false))),
        _ => (START_S + 1, |scene| scene.map = map(2, street(true))),
    }, [Rejects, Rejects, Rejects, Rejects, Rejects, Rejects]),
    ("time goes back by a second", 2, |cycle| (START_S - cycle, nothing),
        [Rejects, Rejects, Rejects, Rejects, Rejects, Rejects]),
    ("time goes back by a quarter of an hour", 3, |cycle| (START_S - 900 * (cycle / 2) + cycle % 2, nothing),
        [Rejects, Rejects, Rejects, Rejects, Rejects, Rejects]),
    ("time starts at zero", 1, |_| (0, nothing),
        [Rejects, Rejects, Rejects, Rejects, Accepts, Rejects]),
    ("time stands still", 5, |_| (START_S, nothing),
        [Rejects, Rejects, Rejects, Rejects, Rejects, Rejects]),
    ("no map", 1, |_| (START_S, |scene| scene.map = None),
        [NotAssessed("lanelet map is not available"), NotAssessed("lanelet map is not available"),
         NotAssessed("lanelet map is not available"), NotAssessed("Lanelet map is not set"),
         NotAssessed("Lanelet map is not available in the context."), Rejects]),
    ("no route", 1, |_| (START_S, |scene| scene.route = None),
        [Rejects, NotAssessed("route is not available"), Rejects, NotAssessed("Route is not set"), Rejects, Rejects]),
    ("no odometry", 1, |_| (START_S, |scene| scene.odometry = None),
        [NotAssessed("odometry is not available"), NotAssessed("odometry is not available"), Rejects,
         NotAssessed("Odometry is not set"), NotAssessed("odometry is not available"), Rejects]),
    ("no acceleration", 1, |_| (START_S, |scene| scene.acceleration = None),
        [Rejects, NotAssessed("acceleration is not available"), Rejects, NotAssessed("Acceleration is not set"),
         NotAssessed("acceleration is not available"), Rejects]),
    ("no objects", 1, |_| (START_S, |scene| scene.objects = None),
        [NotAssessed("predicted objects are not available"), NotAssessed("predicted objects are not available"),
         Rejects, Rejects, Rejects, Rejects]),
    ("no signals", 1, |_| (START_S, |scene| scene.traffic_signals = None),
        [Rejects, Rejects, Rejects, NotAssessed("Traffic signals are not set"), Rejects, Rejects]),
    ("an input comes back", 2, |cycle| match cycle {
        0 => (START_S, |scene| scene.odometry = None),
        _ => (START_S + 1, nothing),
    }, [Rejects, Rejects, Rejects, Rejects, Rejects, Rejects]),
];

fn outcome(loaded: &LoadedFilter, judgement: &Judgement, place: &str) -> Result<bool, String> {
    let words = loaded.explain(judgement);
    match &judgement.failure {
        Some(Failure::NotAssessed(why)) => {
            assert!(!judgement.feasible && judgement.metrics.is_empty(), "{place}");
            assert_eq!(words.as_deref(), Some(&**why), "{place}: the reason is what explains it");
            Err(why.to_string())
        }
        Some(Failure::Panicked(what)) => panic!("{place}: {what}"),
        Some(Failure::OutOfTime) => panic!("there is no deadline here"),
        Some(Failure::NotNeeded) => panic!("{place}: every filter is to be asked"),
        None => {
            assert_eq!(words.is_some(), !judgement.feasible, "{place}");
            assert_eq!(judgement.evidence.is_some(), !judgement.feasible, "{place}");
            Ok(judgement.feasible)
        }
    }
}

#[test]
fn every_filter_has_a_defined_outcome() {
    let names: Vec<&str> = CLASSES.iter().map(|class| class.short_name).collect();
    assert_eq!(names, NAMES, "a new filter needs its column");
    let mut wrong = Vec::new();
    for (name, cycles, situation, expected) in ROWS {
        let parameters = ValidatorParameters {
            filter_names: CLASSES.iter().map(|class| class.class_name.to_owned()).collect(),
            ..ValidatorParameters::default()
        };
        let mut validator = Validator::new(parameters, &VehicleInfo::default()).unwrap();
        let mut last = None;
        for cycle in 0..*cycles {
            let (sec, change) = situation(cycle);
            let mut scene = world(sec);
            change(&mut scene);
            let candidates = [candidate(sec, 0.0)];
            validator.observe(&scene);
            let verdicts = [validator.judge(&scene, &candidates[0], &mut Scratch::default(), || 0, &mut [])];
            validator.remember(&candidates, &verdicts);
            assert!(verdicts[0].data_validity.feasible, "{name}");
            last = Some(verdicts);
        }
        let [verdict] = last.unwrap();
        for ((loaded, judgement), expected) in
            validator.filters().iter().zip(&verdict.judgements).zip(expected)
        {
            let place = format!("{name}: {}", loaded.name());
            let expected = match expected {
                Rejects => Ok(false),
                Accepts => Ok(true),
                NotAssessed(why) => Err((*why).to_owned()),
            };
            let outcome = outcome(loaded, judgement, &place);
            if outcome != expected {
                wrong.push(format!("{place}: {outcome:?} instead of {expected:?}"));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Who is there first is waited for longest, and no step of the clock shortens it.
#[test]
fn no_step_of_the_clock_lets_the_vehicle_go_early() {
    for (name, stamps_s) in [
        ("forth and back", [1000, 1001, 1002, 999, 1000]),
        ("back at once", [1000, 990, 980, 970, 960]),
        ("a jump ahead", [1000, 1100, 1200, 1300, 1301]),
    ] {
        let class = selection::filters::FilterClass::find("traffic_rule::CrosswalkFilter").unwrap();
        let mut filter = (class.make)(&ValidatorParameters::default(), &VehicleInfo::default());
        for sec in stamps_s {
            let mut scene = world(sec);
            let mut odometry = (**scene.odometry.as_ref().unwrap()).clone();
            // At the line, standing.
            odometry.twist.twist.linear.x = 0.0;
            scene.odometry = Some(Arc::new(odometry));
            let candidate = candidate(sec, 10.0);
            filter.observe(&scene);
            let judgement = filter.judge(&scene, &candidate, &mut Scratch::default());
            filter.remember(&[(&candidate, &judgement)]);
            assert!(!judgement.feasible, "{name}: at {sec} s");
        }
    }
}
