//! The collision check on scenes whose answer is known by hand.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

#[path = "collision_support/scenes.rs"]
mod scenes;

use lanelet_map::MapBuilder;
use messages::autoware_perception_msgs::{ObjectClassification, PredictedObject, Shape};
use messages::autoware_vehicle_msgs::TurnIndicatorsCommand;
use messages::builtin_interfaces::Time;
use messages::geometry_msgs::Point32;
use scenes::*;
use selection::filters::collision_check::{CollisionCause, CollisionCheckFilter, Method};
use selection::parameters::{CollisionCheckParameters, PerClass, Shape as ShapeName};
use selection::scene::{Epoch, HdMap};
use selection::{Filter, Judgement, Memo, RiskLevel, Scratch};
use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

const CAR: u8 = ObjectClassification::CAR;

fn straight(speed: f64) -> selection::Candidate {
    candidate(Arc2::line(0.0, 0.0, 0.0), speed, 101)
}

fn shipped() -> CollisionCheckParameters {
    CollisionCheckParameters::default()
}

/// Risks of predicted paths, constant curvature and distance.
fn risks(judgement: &Judgement) -> [RiskLevel; 3] {
    assert_eq!(judgement.failure, None);
    [0, 1, 2].map(|at| judgement.metrics[at].risk)
}

fn method(judgement: &Judgement) -> Option<(Method, f64)> {
    let Memo::CollisionCheck(memo) = judgement.memo else { return None };
    match memo.cause {
        Some(CollisionCause::Passage { method, pet_s, .. }) => Some((method, pet_s)),
        _ => None,
    }
}

#[test]
fn published_end_to_end_cases() {
    let crossing = |x: f64, y: f64| object(1, CAR, Arc2::line(x, y, FRAC_PI_2), 10.0, 1.0, 1.0);
    let with_path = |x, y| predicted(crossing(x, y), Arc2::line(x, y, FRAC_PI_2), 10.0, 16);
    for (name, objects, feasible) in [
        ("no objects", vec![], true),
        ("stopped car ahead", vec![object(1, CAR, Arc2::line(20.0, 0.0, 0.0), 0.0, 5.0, 1.0)], false),
        ("leaving", vec![with_path(25.0, 0.0)], true),
        ("entering", vec![with_path(10.0, -14.0)], false),
    ] {
        let judgement = judge(&scene(10.0, objects), &straight(10.0), &shipped());
        assert_eq!(judgement.feasible, feasible, "{name}: {judgement:?}");
        assert_eq!(judgement.evidence.is_some(), !feasible, "{name}");
    }
}

#[test]
fn metrics_are_always_these_three() {
    let judgement = judge(&scene(10.0, vec![]), &straight(10.0), &shipped());
    let names: Vec<&str> = judgement.metrics.iter().map(|metric| metric.name).collect();
    assert_eq!(names, ["DRAC_map_based_predicted_path", "DRAC_constant_curvature_path", "RSS"]);
    assert!(judgement.metrics.iter().all(|metric| metric.value == 0.0 && metric.risk == RiskLevel::Safe));
}

/// A car in front keeps standing; the braking it takes follows from the distance alone.
#[test]
fn distance_to_a_stopped_object() {
    // The vehicle's front is at 4 m, the car's rear at x - 2.5; slices are 1 m long at 10 m/s, and the end of the
    // slice that touches counts.
    for (x, distance, feasible) in
        [(20.0, 14.0, false), (25.4, 19.0, true), (24.4, 18.0, false), (6.4, 0.0, false)]
    {
        let car = object(1, CAR, Arc2::line(x, 0.0, 0.0), 0.0, 5.0, 1.0);
        let judgement = judge(&scene(10.0, vec![car]), &straight(10.0), &shipped());
        let free: f64 = distance - 2.0 - 4.0;
        let expected = if free > 0.0 { -100.0 / (2.0 * free) } else { f64::NEG_INFINITY };
        let metric = judgement.metrics[2];
        assert!(
            metric.value == expected || (metric.value - expected).abs() < 1e-9,
            "{x}: {} instead of {expected}",
            metric.value
        );
        assert_eq!(metric.risk == RiskLevel::Safe, feasible, "{x}");
        assert_eq!(metric.threshold, -4.0);
    }
    let beside = object(1, CAR, Arc2::line(15.0, 1.6, 0.0), 0.0, 5.0, 1.0);
    assert_eq!(judge(&scene(10.0, vec![beside.clone()]), &straight(10.0), &shipped()).metrics[2].value, 0.0);
    let touching = PredictedObject {
        object_id: beside.object_id,
        ..object(1, CAR, Arc2::line(15.0, 1.5, 0.0), 0.0, 5.0, 1.0)
    };
    assert!(
        judge(&scene(10.0, vec![touching]), &straight(10.0), &shipped()).metrics[2].value < 0.0,
        "contact counts"
    );
}

/// What is left of a candidate whose last moment has passed is the place where it ends.
#[test]
fn the_end_of_a_candidate_in_the_past_counts() {
    let mut message = (*candidate(Arc2::line(0.0, 0.0, 0.0), 10.0, 2).message).clone();
    message.header.stamp.sec -= 1;
    let past = candidate_of(message);
    for (x, is_met) in [(6.4, true), (7.4, true), (9.5, false), (-4.4, false)] {
        let car = object(1, CAR, Arc2::line(x, 0.0, 0.0), 0.0, 5.0, 1.0);
        let metric = judge(&scene(10.0, vec![car]), &past, &shipped()).metrics[2];
        assert_eq!(metric.value == f64::NEG_INFINITY, is_met, "{x}: {metric:?}");
    }
}

/// Beyond the sampled part of a very slow candidate the path itself is looked at.
#[test]
fn the_whole_path_counts_however_long_it_takes() {
    let slow = candidate(Arc2::line(0.0, 0.0, 0.0), 0.5, 1201);
    let car = object(1, CAR, Arc2::line(56.0, 0.0, 0.0), 0.0, 5.0, 1.0);
    let metric = judge(&scene(30.0, vec![car]), &slow, &shipped()).metrics[2];
    assert!(metric.value < -10.0, "{metric:?}");
}

fn overlapping(bias: f64, ego_earlier: bool) -> Judgement {
    let mut parameters = shipped();
    parameters.drac.pet_margin.object_earlier_judgement_bias = PerClass::all(bias);
    parameters.drac.constant_curvature.enable_assessment = PerClass::all(false);
    parameters.drac.map_based.object_prioritized_ego_earlier.enable_assessment = PerClass::all(ego_earlier);
    let car = object(1, CAR, Arc2::line(0.0, 0.0, 0.0), 0.0, 4.0, 2.0);
    let car = predicted(car, Arc2::line(0.0, 0.0, 0.0), 0.0, 10);
    let still = indicating(&straight(0.0), TurnIndicatorsCommand::ENABLE_LEFT);
    judge(&scene(0.0, vec![car]), &still, &parameters)
}

fn left_open(judgement: &Judgement) -> Option<String> {
    CollisionCheckFilter::new(&shipped(), &vehicle()).not_assessed(judgement)
}

/// Of an object without predicted paths nothing but its present motion is known; the judgement says so, also where it
/// finds nothing (S18).
#[test]
fn a_missing_path_is_told() {
    let arc = Arc2::line(60.0, 30.0, 0.0);
    let far = object(1, CAR, arc, 3.0, 4.0, 2.0);
    for (object, is_told) in [(far.clone(), true), (predicted(far, arc, 3.0, 9), false)] {
        let judgement = judge(&scene(5.0, vec![object]), &straight(5.0), &shipped());
        assert!(judgement.feasible);
        assert_eq!(left_open(&judgement).is_some_and(|text| text.contains("no predicted path")), is_told);
    }
}

#[test]
fn judgement_bias() {
    let judgement = overlapping(0.0, true);
    assert_eq!(method(&judgement), Some((Method::ObjectPrioritizedObjectEarlier, 0.0)));
    assert_eq!(risks(&judgement)[0], RiskLevel::Fatal);
    assert_eq!(judgement.metrics[0].value, f64::NEG_INFINITY);

    let judgement = overlapping(-0.1, true);
    assert_eq!(method(&judgement).map(|found| found.0), Some(Method::ObjectPrioritizedEgoEarlier));

    let judgement = overlapping(-0.1, false);
    assert_eq!(risks(&judgement)[0], RiskLevel::Safe);
    assert!(judgement.metrics[0].value.is_nan(), "switched off: nothing is known");
    let open = left_open(&judgement).unwrap();
    assert!(open.contains("map_based, object prioritized, ego earlier"), "{open}");
}

/// A car ahead on the same line drives slower: the vehicle closes in at 6 m/s.
#[test]
fn tiers_of_required_braking() {
    let closing = |x: f64| {
        let arc = Arc2::line(x, 0.0, 0.0);
        let car = predicted(object(1, CAR, arc, 4.0, 4.0, 2.0), arc, 4.0, 17);
        let mut parameters = shipped();
        parameters.drac.pet_margin.object_earlier = PerClass::all(0.0);
        parameters.drac.pet_margin.ego_earlier = PerClass::all(0.0);
        let judgement = judge(&scene(10.0, vec![car]), &straight(10.0), &parameters);
        (judgement.metrics[0].value, judgement.metrics[0].risk)
    };
    // Gap = x - 2 - 5 (front and its margin); 3 m go in the delay, then 18 / |a| with constant braking.
    assert_eq!(closing(7.0 + 3.0 + 12.0 + 2.0), (-1.5, RiskLevel::Safe));
    assert_eq!(closing(7.0 + 3.0 + 12.0 - 2.0), (-3.0, RiskLevel::Danger));
    assert_eq!(closing(7.0 + 3.0 + 6.0 - 1.0), (-6.0, RiskLevel::Fatal));
    assert_eq!(closing(7.0 + 3.0 + 3.0 - 2.0), (-6.0, RiskLevel::Fatal), "without delay");
    assert_eq!(closing(7.0 + 1.0), (f64::NEG_INFINITY, RiskLevel::Fatal));
}

#[test]
fn an_abandoned_case_is_low_caution_only_if_asked_for() {
    let arc = Arc2::line(8.0, 0.0, 0.0);
    let car = predicted(object(1, CAR, arc, 0.5, 4.0, 2.0), arc, 0.5, 17);
    let mut parameters = shipped();
    parameters.drac.constant_curvature.enable_assessment = PerClass::all(false);
    parameters.rss.enable_assessment = PerClass::all(vec![ShapeName::Nothing]);
    let scene = scene(10.0, vec![car]);
    assert_eq!(risks(&judge(&scene, &straight(10.0), &parameters))[0], RiskLevel::Fatal);
    parameters.drac.map_based.object_prioritized_object_earlier.ego_drac_acceleration.enable_abandon =
        PerClass::all(true);
    let judgement = judge(&scene, &straight(10.0), &parameters);
    assert_eq!(risks(&judgement)[0], RiskLevel::LowCaution);
    assert!(judgement.feasible);
}

/// A braking vehicle stops and stays where it is (S8).
#[test]
fn braking_ends_at_standstill() {
    // At 6 m/s and -3 m/s2 after 0.5 s the vehicle stops at x = 3 + 6 = 9 and covers up to 14 (margin 1).
    let crossing = |x: f64| {
        let arc = Arc2::line(x, -25.0, FRAC_PI_2);
        let car = predicted(object(1, CAR, arc, 10.0, 2.0, 1.0), arc, 10.0, 17);
        let mut parameters = shipped();
        let tiers = &mut parameters.drac.map_based.object_prioritized_object_earlier.ego_drac_acceleration;
        tiers.safe_limit = PerClass::all(-3.0);
        tiers.danger_limit = PerClass::all(-3.0);
        parameters.drac.pet_margin.object_earlier_judgement_bias = PerClass::all(50.0);
        judge(&scene(6.0, vec![car]), &straight(6.0), &parameters).metrics[0].value
    };
    for (x, required, why) in [
        (3.0, 0.0, "passed long before"),
        (20.0, -3.0, "stops before it"),
        (14.6, -3.0, "stops 0.1 m before it"),
        (14.4, -6.0, "would stand 0.1 m in its way"),
    ] {
        assert_eq!(crossing(x), required, "{x}: {why}");
    }
}

#[test]
fn evidence_is_the_first_contact() {
    let arc = Arc2::line(30.0, 0.0, std::f64::consts::PI);
    let car = predicted(object(7, CAR, arc, 10.0, 4.0, 2.0), arc, 10.0, 17);
    let judgement = judge(&scene(10.0, vec![car]), &straight(10.0), &shipped());
    let at = judgement.evidence.unwrap();
    assert_eq!(at.object_id.unwrap().uuid, [7; 16]);
    // The vehicle's front with margin, 5 + 10 t, reaches where the car's front, 28 - 10 t, was 1 s before: at 1.65 s.
    assert!(at.time_s > 1.5 && at.time_s < 1.75, "{at:?}");
    assert!((at.x_m - 10.0 * at.time_s).abs() < 1e-6, "{at:?}");
    let filter = CollisionCheckFilter::new(&shipped(), &vehicle());
    let line = filter.explain(&judgement).unwrap();
    assert!(line.contains("0707") && line.contains("object earlier") && line.contains("m/s2"), "{line}");
}

#[test]
fn missing_inputs_are_named_in_order() {
    let full = scene(10.0, vec![]);
    let mut no_odometry = full.clone();
    no_odometry.odometry = None;
    no_odometry.objects = None;
    let mut no_objects = full.clone();
    no_objects.objects = None;
    no_objects.map = None;
    let mut no_map = full;
    no_map.map = None;
    for (scene, text) in [
        (no_odometry, "odometry is not available"),
        (no_objects, "predicted objects are not available"),
        (no_map, "lanelet map is not available"),
    ] {
        let judgement = judge(&scene, &straight(10.0), &shipped());
        assert_eq!(judgement.reason().unwrap(), text);
        assert!(!judgement.feasible && judgement.risk() == RiskLevel::Danger);
    }
}

#[test]
fn what_cannot_be_compared_is_not_assessed() {
    let car = || object(1, CAR, Arc2::line(60.0, 0.0, 0.0), 1.0, 4.0, 2.0);
    let mut broken = car();
    broken.kinematics.initial_twist_with_covariance.twist.linear.x = f64::NAN;
    let mut odd_shape = car();
    odd_shape.shape.r#type = 77;
    for objects in [vec![broken], vec![odd_shape]] {
        let judgement = judge(&scene(10.0, objects), &straight(10.0), &shipped());
        assert!(judgement.failure.is_some() && !judgement.feasible);
    }
    for sec in [94, 106, 0, i32::MAX] {
        let mut message = (*straight(10.0).message).clone();
        message.header.stamp = Time { sec, nanosec: 0 };
        let judgement = judge(&scene(10.0, vec![car()]), &candidate_of(message), &shipped());
        assert!(judgement.failure.is_some() && !judgement.feasible, "{sec}");
    }
    let mut elsewhere = scene(10.0, vec![car()]);
    let mut objects = (**elsewhere.objects.as_ref().unwrap()).clone();
    objects.header.frame_id = "base_link".to_owned();
    elsewhere.objects = Some(Arc::new(objects));
    assert!(judge(&elsewhere, &straight(10.0), &shipped()).failure.is_some());
}

#[test]
fn shapes_and_classes_choose_what_is_assessed() {
    let ahead = Arc2::line(12.0, 0.0, 0.0);
    let of = |label: u8, kind: u8| {
        let mut object = object(1, label, ahead, 0.0, 2.0, 2.0);
        object.shape.r#type = kind;
        let corners = [(1.0, 1.0), (1.0, -1.0), (-1.0, -1.0), (-1.0, 1.0)];
        object.shape.footprint.points = corners.iter().map(|&(x, y)| Point32 { x, y, z: 0.0 }).collect();
        judge(&scene(10.0, vec![object]), &straight(10.0), &shipped()).metrics[2].value < 0.0
    };
    use ObjectClassification as Label;
    for (label, kind, expected) in [
        (Label::CAR, Shape::BOUNDING_BOX, true),
        (Label::CAR, Shape::CYLINDER, true),
        (Label::CAR, Shape::POLYGON, true),
        (Label::BICYCLE, Shape::POLYGON, false),
        (Label::BICYCLE, Shape::CYLINDER, true),
        (Label::UNKNOWN, Shape::POLYGON, true),
        (Label::OVER_DRIVABLE, Shape::BOUNDING_BOX, false),
        (200, Shape::BOUNDING_BOX, true),
    ] {
        assert_eq!(of(label, kind), expected, "label {label}, shape {kind}");
    }
}

#[test]
fn a_polygon_without_corners_is_still_somewhere() {
    let mut object = object(1, ObjectClassification::UNKNOWN, Arc2::line(12.0, 0.0, 0.0), 0.0, 0.0, 0.0);
    object.shape.r#type = Shape::POLYGON;
    assert!(judge(&scene(10.0, vec![object]), &straight(10.0), &shipped()).metrics[2].value < 0.0);
}

/// A pedestrian on the way of the vehicle, once on a crosswalk in an intersection, once beside it, once outside.
#[test]
fn priority_of_pedestrians() {
    let mut builder = MapBuilder::new();
    let rectangle = |builder: &mut MapBuilder, id: i64, x0: f64, x1: f64, y0: f64, y1: f64| {
        for (k, (x, y)) in [(x0, y1), (x1, y1), (x0, y0), (x1, y0)].into_iter().enumerate() {
            builder.point(id + k as i64, [x, y, 0.0], &[]).unwrap();
        }
        builder.line_string(id + 10, &[id, id + 1], &[]).unwrap();
        builder.line_string(id + 11, &[id + 2, id + 3], &[]).unwrap();
    };
    rectangle(&mut builder, 1000, 5.0, 60.0, -30.0, 30.0);
    builder.polygon(500, &[1000, 1001, 1003, 1002], &[("type", "intersection_area")]).unwrap();
    builder.lanelet(1, 1010, 1011, &[("subtype", "road"), ("intersection_area", "500")]).unwrap();
    rectangle(&mut builder, 2000, 28.0, 32.0, -30.0, 30.0);
    builder.lanelet(2, 2010, 2011, &[("subtype", "crosswalk")]).unwrap();
    let map = Arc::new(builder.build().unwrap());

    let walking = |x: f64, label: u8, command: u8| {
        let arc = Arc2::line(x, -6.0, FRAC_PI_2);
        let person = predicted(object(1, label, arc, 1.5, 0.6, 0.6), arc, 1.5, 17);
        let mut scene = scene(8.0, vec![person]);
        scene.map = Some(Epoch { number: 1, value: HdMap::new("map".into(), Arc::clone(&map)) });
        let judgement = judge(&scene, &indicating(&straight(8.0), command), &shipped());
        let Memo::CollisionCheck(memo) = judgement.memo else { panic!("{judgement:?}") };
        (judgement.metrics[0].value.is_nan(), memo.not_assessed.is_some())
    };
    let (off, none) = (TurnIndicatorsCommand::DISABLE, TurnIndicatorsCommand::NO_COMMAND);
    let (person, car) = (ObjectClassification::PEDESTRIAN, ObjectClassification::CAR);
    for (name, x, label, command, vehicle_first) in [
        ("on the crosswalk", 30.0, person, off, false),
        ("in the intersection", 38.0, person, off, true),
        ("a car in the intersection", 38.0, car, off, true),
        ("indicators not known to be off", 38.0, person, none, false),
    ] {
        assert_eq!(walking(x, label, command), (vehicle_first, vehicle_first), "{name}");
    }
    // Outside of every intersection a pedestrian goes first, a car does not.
    let empty = |label: u8| {
        let arc = Arc2::line(30.0, -6.0, FRAC_PI_2);
        let person = predicted(object(1, label, arc, 1.5, 0.6, 0.6), arc, 1.5, 17);
        let judgement = judge(&scene(8.0, vec![person]), &indicating(&straight(8.0), off), &shipped());
        judgement.metrics[0].value.is_nan()
    };
    assert_eq!((empty(person), empty(car)), (false, true));
}

#[test]
fn two_that_wait_for_each_other_get_away() {
    let arc = Arc2::line(5.2, -0.5, FRAC_PI_2);
    let person = |speed: f64| {
        predicted(object(1, ObjectClassification::PEDESTRIAN, arc, speed, 0.6, 0.6), arc, 1.0, 17)
    };
    let mut parameters = shipped();
    parameters.rss.enable_assessment = PerClass::all(vec![ShapeName::Nothing]);
    parameters.drac.constant_curvature.enable_assessment = PerClass::all(false);
    let mut filter = CollisionCheckFilter::new(&parameters, &vehicle());
    let mut feasible = Vec::new();
    for tick in 0..40 {
        let stamp = Time { sec: 100, nanosec: 0 }.nanoseconds() + tick * 100_000_000;
        let stamp = Time::from_nanoseconds(stamp);
        let mut scene = scene(0.0, vec![person(0.2)]);
        let mut objects = (**scene.objects.as_ref().unwrap()).clone();
        objects.header.stamp = stamp;
        scene.objects = Some(Arc::new(objects));
        let mut odometry = (**scene.odometry.as_ref().unwrap()).clone();
        odometry.header.stamp = stamp;
        scene.odometry = Some(Arc::new(odometry));
        let mut message = (*straight(5.0).message).clone();
        message.header.stamp = stamp;
        filter.observe(&scene);
        feasible.push(filter.judge(&scene, &candidate_of(message), &mut Scratch::default()).feasible);
    }
    assert!(feasible[..=30].iter().all(|&feasible| !feasible), "up to 3 s they wait: {feasible:?}");
    assert!(feasible[31..].iter().all(|&feasible| feasible), "then they may go: {feasible:?}");
}

/// A thin object at speed crosses the path between two samples.
#[test]
fn no_contact_slips_through_between_samples() {
    let arc = Arc2::line(20.0, -50.0, FRAC_PI_2);
    let bullet = predicted(object(1, CAR, arc, 25.0, 0.2, 0.2), arc, 25.0, 17);
    let scene = scene(10.0, vec![bullet]);
    for resolution in [0.01, 0.05, 0.1, 0.3, 0.5, 1.0] {
        let mut parameters = shipped();
        parameters.global_setting.time_resolution = resolution;
        let pet = &mut parameters.drac.pet_margin;
        (pet.ego_earlier, pet.object_earlier) = (PerClass::all(0.0), PerClass::all(0.0));
        pet.object_earlier_judgement_bias = PerClass::all(60.0);
        let judgement = judge(&scene, &straight(10.0), &parameters);
        assert!(judgement.metrics[0].value < 0.0, "resolution {resolution}: {judgement:?}");
    }
}
