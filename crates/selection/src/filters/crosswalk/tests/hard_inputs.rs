//! Inputs that are missing or make no sense: each has a defined outcome, on the safe side.

use super::*;
use crate::verdict::Failure;

fn why(judgement: &Judgement) -> &str {
    assert!(!judgement.feasible && judgement.metrics.is_empty());
    assert_eq!(judgement.risk(), RiskLevel::Danger);
    match &judgement.failure {
        Some(Failure::NotAssessed(why)) => why,
        other => panic!("{other:?}"),
    }
}

fn blocks(person: PredictedObject) -> bool {
    let scene = scene(map_with(&[(10, 10.0)]), 5.0, &[person]);
    !judge(&mut filter(), &scene, &drive(0.0, 80.0, 5.0)).feasible
}

#[test]
fn missing_inputs_are_named_in_order() {
    let mut scene = scene(map_with(&[(10, 10.0)]), 5.0, &[]);
    type Remove = fn(&mut Scene);
    let inputs: [(&str, Remove); 5] = [
        ("predicted objects are not available", |scene| scene.objects = None),
        ("acceleration is not available", |scene| scene.acceleration = None),
        ("odometry is not available", |scene| scene.odometry = None),
        ("route is not available", |scene| scene.route = None),
        ("lanelet map is not available", |scene| scene.map = None),
    ];
    for (text, remove) in inputs {
        remove(&mut scene);
        let judgement = judge(&mut filter(), &scene, &drive(0.0, 80.0, 5.0));
        assert_eq!(why(&judgement), text);
        assert_eq!(filter().explain(&judgement).unwrap(), text);
    }
}

#[test]
fn nothing_is_judged_before_a_scene_was_seen() {
    let scene = scene(map_with(&[]), 5.0, &[]);
    let judgement = filter().judge(&scene, &drive(0.0, 80.0, 5.0), &mut Scratch::default());
    assert_eq!(why(&judgement), "no scene was observed");
}

#[test]
fn an_input_that_comes_back_is_used_again() {
    let mut filter = filter();
    let mut scene = scene(map_with(&[(10, 10.0)]), 5.0, &[pedestrian(1, 10.0, -7.0)]);
    let route = scene.route.take();
    assert!(judge(&mut filter, &scene, &drive(0.0, 80.0, 5.0)).failure.is_some());
    scene.route = route;
    let judgement = judge(&mut filter, &scene, &drive(0.0, 80.0, 5.0));
    assert!(judgement.failure.is_none() && !judgement.feasible);
}

#[test]
fn a_route_over_unknown_lanelets_cannot_be_judged() {
    let mut scene = scene(map_with(&[(10, 10.0)]), 5.0, &[]);
    scene.route = Some(route(2, &[ROAD, 77]));
    let judgement = judge(&mut filter(), &scene, &drive(0.0, 80.0, 5.0));
    assert_eq!(why(&judgement), "lanelet 77 is not in the map");
    scene.objects = None;
    assert_eq!(
        why(&judge(&mut filter(), &scene, &drive(0.0, 80.0, 5.0))),
        "predicted objects are not available"
    );
}

#[test]
fn a_crosswalk_without_its_lanelet_cannot_be_judged() {
    let mut sketch = Sketch::new();
    sketch.stop_line(12, &[(10.0, -5.0), (10.0, 5.0)]);
    let members = [("ref_line", Member::LineString(12))];
    sketch.0.regulatory_element(10, &members, &[("subtype", "crosswalk")]).unwrap();
    sketch.0.attach(ROAD, 10).unwrap();
    let scene = scene(sketch.0.build().unwrap(), 5.0, &[]);
    let judgement = judge(&mut filter(), &scene, &drive(0.0, 80.0, 5.0));
    assert_eq!(why(&judgement), "the lanelet of crosswalk 10 is not in the map");
}

#[test]
fn degenerate_crosswalks_have_no_detection_areas() {
    for (name, bounds) in [
        ("bounds of one point", [vec![(8.0, -6.0)], vec![(12.0, -6.0)]]),
        ("bounds on top of each other", [vec![(10.0, -6.0), (10.0, 6.0)], vec![(10.0, -6.0), (10.0, 6.0)]]),
    ] {
        let mut sketch = Sketch::new();
        let lines = bounds.map(|places| sketch.line(&places));
        sketch.0.lanelet(11, lines[0], lines[1], &[]).unwrap();
        sketch.stop_line(12, &[(10.0, -5.0), (10.0, 5.0)]);
        sketch.rule(10, &[12]);
        let scene = scene(sketch.0.build().unwrap(), 5.0, &[pedestrian(1, 10.0, -7.0)]);
        let judgement = judge(&mut filter(), &scene, &drive(0.0, 80.0, 5.0));
        assert!(judgement.feasible && judgement.metrics.len() == 1, "{name}");
    }
}

#[test]
fn a_bound_that_ends_in_two_equal_points_has_no_outward_direction() {
    let mut sketch = Sketch::new();
    let bounds = [8.0, 12.0].map(|x| sketch.line(&[(x, -6.0), (x, -6.0), (x, 6.0)]));
    sketch.0.lanelet(11, bounds[0], bounds[1], &[]).unwrap();
    sketch.stop_line(12, &[(10.0, -5.0), (10.0, 5.0)]);
    sketch.rule(10, &[12]);
    let mut scene = scene(sketch.0.build().unwrap(), 5.0, &[]);
    for (y, feasible) in [(-6.0005, false), (-6.5, true), (7.0, false)] {
        set_people(&mut scene, &[pedestrian(1, 10.0, y)]);
        assert_eq!(judge(&mut filter(), &scene, &drive(0.0, 80.0, 5.0)).feasible, feasible, "{y}");
    }
}

#[test]
fn people_without_paths_are_judged_by_their_motion() {
    assert!(blocks(pedestrian(1, 10.0, -7.0)));
    assert!(!blocks(walking(pedestrian(1, 10.0, -7.0), -90.0, 1.0)));
    let pathless = with_path(walking(pedestrian(1, 10.0, -7.0), 90.0, 1.0), 0.9, &[]);
    assert!(blocks(pathless), "a sure path without points says nothing");
}

#[test]
fn numbers_that_are_none_make_people_wait() {
    let somebody = || walking(pedestrian(1, 10.0, -7.0), -90.0, 1.0);
    assert!(!blocks(somebody()), "goes away");
    type Spoil = fn(&mut PredictedObject);
    let cases: [(&str, Spoil); 6] = [
        ("place", |o| o.kinematics.initial_pose_with_covariance.pose.position.y = f64::NAN),
        ("infinite place", |o| o.kinematics.initial_pose_with_covariance.pose.position.x = f64::INFINITY),
        ("speed", |o| o.kinematics.initial_twist_with_covariance.twist.linear.x = f64::NAN),
        ("side speed", |o| o.kinematics.initial_twist_with_covariance.twist.linear.y = f64::NAN),
        ("no rotation", |o| {
            o.kinematics.initial_pose_with_covariance.pose.orientation =
                Quaternion { x: 0.0, y: 0.0, z: 0.0, w: 0.0 };
        }),
        ("path", |o| *o = with_path(o.clone(), 0.9, &[(f64::NAN, 0.0)])),
    ];
    for (name, spoil) in cases {
        let mut person = somebody();
        spoil(&mut person);
        assert!(blocks(person), "{name}");
    }
    let unsure = with_path(somebody(), f32::NAN, &[(10.0, 0.0)]);
    assert!(!blocks(unsure), "a confidence that is none is not sure: the motion decides");
}

#[test]
fn somebody_nowhere_is_waited_for_like_anybody() {
    let mut filter = filter();
    let mut scene = scene(map_with(&[(10, 10.0)]), 0.0, &[pedestrian(1, f64::NAN, -7.0)]);
    let candidate = drive(8.0, 80.0, 5.0);
    assert!(!waits_no_more(&mut filter, &mut scene, 100.0, &candidate));
    assert!(waits_no_more(&mut filter, &mut scene, 101.2, &candidate));
}

#[test]
fn an_odometry_without_numbers_looks_far_and_never_stands() {
    let dense: Vec<Row> = (0..80).map(|k| (f64::from(k), 5.0, 0.2 * f64::from(k))).collect();
    let mut filter = filter();
    let mut scene = scene(map_with(&[(10, 70.0)]), f64::NAN, &[pedestrian(1, 70.0, -7.0)]);
    for now_s in [100.0, 102.0, 104.0] {
        set_odometry(&mut scene, now_s, f64::NAN);
        assert!(!judge(&mut filter, &scene, &candidate(&dense)).feasible);
    }
}

#[test]
fn when_time_goes_back_the_waiting_only_gets_longer() {
    let candidate = drive(8.0, 80.0, 5.0);
    let person = [pedestrian(1, 10.0, -7.0)];
    // A small step: waits go on, and those that were over stay over.
    let mut filter = filter();
    let mut scene = scene(map_with(&[(10, 10.0)]), 0.0, &person);
    assert!(!waits_no_more(&mut filter, &mut scene, 100.0, &candidate));
    assert!(!waits_no_more(&mut filter, &mut scene, 99.8, &candidate), "less than nothing was waited");
    assert!(!waits_no_more(&mut filter, &mut scene, 100.9, &candidate));
    assert!(waits_no_more(&mut filter, &mut scene, 101.1, &candidate));
    assert!(waits_no_more(&mut filter, &mut scene, 100.9, &candidate));
    // A large one: another time line, so all waiting starts anew.
    assert!(!waits_no_more(&mut filter, &mut scene, 50.0, &candidate));
    assert!(!waits_no_more(&mut filter, &mut scene, 50.9, &candidate));
    assert!(waits_no_more(&mut filter, &mut scene, 51.1, &candidate));
    // Lost people of the future do not stay for ever.
    set_people(&mut scene, &[]);
    assert!(waits_no_more(&mut filter, &mut scene, 10.0, &candidate));
    assert_eq!(filter.timers.len(), 0);
}

#[test]
fn a_clock_that_stands_still_never_lets_anybody_go() {
    let mut filter = filter();
    let mut scene = scene(map_with(&[(10, 10.0)]), 0.0, &[pedestrian(1, 10.0, -7.0)]);
    for _ in 0..50 {
        assert!(!waits_no_more(&mut filter, &mut scene, 100.0, &drive(8.0, 80.0, 5.0)));
    }
}

#[test]
fn candidates_with_odd_points_do_no_harm() {
    let scene = scene(map_with(&[(10, 10.0)]), 5.0, &[pedestrian(1, 10.0, -7.0)]);
    let spots = candidate(&[(10.0, 5.0, 0.0), (10.0, 5.0, 0.1), (10.0, 5.0, 0.2)]);
    assert!(!judge(&mut filter(), &scene, &spots).feasible, "standing on the line, with speed");
    let past = candidate(&[(0.0, 5.0, -2.0), (80.0, 5.0, -1.0)]);
    let judgement = judge(&mut filter(), &scene, &past);
    assert!(judgement.feasible && judgement.metrics.is_empty(), "all in the past");
    let twice = candidate(&[(0.0, 5.0, 0.0), (20.0, 5.0, 1.0), (0.0, 5.0, 2.0), (20.0, 5.0, 3.0)]);
    let judgement = judge(&mut filter(), &scene, &twice);
    assert_eq!(judgement.metrics.len(), 1, "met once, however often it is crossed");
}
