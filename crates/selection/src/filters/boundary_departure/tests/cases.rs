//! Upstream's test cases of the checker, and the missing inputs.

use std::sync::Arc;

use motion::{Point2, Pose, Segment, TimeFromStart, TrajectoryPoint, VehicleDimensions};

use super::scenes::{MapSketch, scene_at};
use super::*;
use crate::candidate::CandidateKey;
use crate::scene::Scene;

/// The vehicle of upstream's fixture, whose arguments are in the wrong order: 3.32 m to the left, 0.128 m high.
fn lopsided() -> VehicleInfo {
    let dimensions = VehicleDimensions {
        left_overhang_m: 2.5,
        right_overhang_m: 0.128,
        vehicle_height_m: 0.128,
        ..VehicleDimensions::default()
    };
    VehicleInfo::new(dimensions).unwrap()
}

fn straight_border() -> MapSketch {
    MapSketch { lines: vec![vec![[-100.0, 2.0, 0.0], [100.0, 2.0, 0.0]]] }
}

/// Five points, 5 m and 0.5 s apart.
fn five_points(y0: f64, yaw: f64) -> Vec<TrajectoryPoint> {
    let point = |index: i64| TrajectoryPoint {
        time_from_start: TimeFromStart::from_nanos(index * 500_000_000),
        pose: Pose::from_xy_yaw(5.0 * index as f64 * yaw.cos(), y0 + 5.0 * index as f64 * yaw.sin(), yaw),
        ..TrajectoryPoint::default()
    };
    (0..5).map(point).collect()
}

fn fixture() -> UncrossableBoundaryDepartureFilter {
    let parameters = BoundaryDepartureParameters {
        time_to_departure_cutoff_s: 3.0,
        ..BoundaryDepartureParameters::default()
    };
    UncrossableBoundaryDepartureFilter::new(parameters, lopsided())
}

/// One cycle with one candidate.
fn cycle(filter: &mut UncrossableBoundaryDepartureFilter, scene: &Scene, candidate: &Candidate) -> Judgement {
    filter.observe(scene);
    let judgement = filter.judge(scene, candidate, &mut Scratch::default());
    filter.remember(&[(candidate, &judgement)]);
    judgement
}

#[test]
fn a_standing_vehicle_beside_a_border_is_safe() {
    let scene = scene_at(0.0, 0.0, &lopsided(), &straight_border());
    let judgement = cycle(&mut fixture(), &scene, &candidate_of(five_points(-3.0, 0.0)));
    assert_eq!(judgement.metrics[0].risk, RiskLevel::Safe);
    assert!((judgement.metrics[0].value - 1.68).abs() < 1e-9);
}

#[test]
fn hysteresis_sequence() {
    let mut filter = fixture();
    let (safe, danger) = (candidate_of(five_points(-2.5, 0.0)), candidate_of(five_points(-2.5, 0.2)));
    let steps = [
        (&safe, 0.0, RiskLevel::Safe),
        (&danger, 0.1, RiskLevel::LowCaution),
        (&danger, 0.2, RiskLevel::Danger),
        (&safe, 0.3, RiskLevel::Danger),
        (&safe, 0.6, RiskLevel::Safe),
    ];
    for (candidate, time_s, risk) in steps {
        let scene = scene_at(time_s, 10.0, &lopsided(), &straight_border());
        let judgement = cycle(&mut filter, &scene, candidate);
        assert_eq!(judgement.metrics[0].risk, risk, "at {time_s} s");
        assert_eq!(judgement.feasible, risk != RiskLevel::Danger);
        if time_s == 0.2 {
            let mut stranger = safe.clone();
            stranger.key = CandidateKey { sample: 1, ..safe.key };
            let judgement = filter.judge(&scene, &stranger, &mut Scratch::default());
            assert!(judgement.feasible, "another key has memory of its own");
        }
    }
}

#[test]
fn a_rejection_names_the_border_and_the_point() {
    let mut filter = fixture();
    let scene = scene_at(100.0, 10.0, &lopsided(), &straight_border());
    let candidate = candidate_of(five_points(-2.5, 0.2));
    let judgement = cycle(&mut filter, &scene, &candidate);
    let evidence = judgement.evidence.unwrap();
    assert_eq!((evidence.index, evidence.element_id), (1, Some(10_000)));
    assert_eq!(filter.explain(&judgement).unwrap(), "crosses border 10000 after 0.5 s, at (4.9, -1.5)");
    let scene = scene_at(100.1, 10.0, &lopsided(), &straight_border());
    let held = cycle(&mut filter, &scene, &candidate_of(five_points(-2.5, 0.0)));
    assert_eq!((held.feasible, held.evidence), (false, None));
    assert_eq!(filter.explain(&held).unwrap(), "a departure found a moment ago is still held");
}

#[test]
fn nearest_projections() {
    let segment = |x1: f64, y1, x2, y2| Segment::new(Point2::new(x1, y1), Point2::new(x2, y2));
    let cases = [
        (segment(0.0, 0.0, 0.0, 2.0), segment(1.0, 0.0, 1.0, 2.0), Some(1.0)),
        (segment(0.0, 0.0, 1.0, 2.0), segment(1.0, 0.0, 1.0, 2.0), Some(0.0)),
        (segment(0.0, 0.0, 1.0, 0.0), segment(3.0, 2.0, 4.0, 2.0), None),
        (segment(0.0, 0.0, 2.0, 0.0), segment(1.0, 1.0, 3.0, 1.0), Some(1.0)),
        (segment(0.0, 0.0, 1.0, 0.0), segment(2.0, -1.0, 2.0, 1.0), Some(1.0)),
        (segment(0.0, 0.0, 1.0, 0.0), segment(2.0, 0.0, 3.0, 0.0), None),
        (segment(0.0, 0.0, 1.0, 0.0), segment(0.5, 1.0, 0.5, 1.0), None),
    ];
    for (side, border, expected) in cases {
        let lateral_m = projection::project(&side, &border).map(|projection| projection.lateral_m);
        assert_eq!(lateral_m, expected, "{side:?} {border:?}");
    }
}

#[test]
fn borders_at_another_height_do_not_count() {
    let vehicle = VehicleInfo::default();
    for (z, counts) in [(2.49, true), (2.5, false), (-2.6, false)] {
        let sketch = MapSketch { lines: vec![vec![[-100.0, 1.5, z], [100.0, 1.5, z]]] };
        let mut filter =
            UncrossableBoundaryDepartureFilter::new(BoundaryDepartureParameters::default(), vehicle);
        let judgement =
            cycle(&mut filter, &scene_at(5.0, 5.0, &vehicle, &sketch), &candidate_of(five_points(0.0, 0.0)));
        assert_eq!(judgement.metrics[0].value < 1.0, counts, "border at {z} m");
    }
}

#[test]
fn missing_and_broken_inputs_are_not_assessed() {
    let whole = scene_at(5.0, 5.0, &lopsided(), &straight_border());
    let change = |change: &dyn Fn(&mut Scene)| {
        let mut scene = whole.clone();
        change(&mut scene);
        let judgement = cycle(&mut fixture(), &scene, &candidate_of(five_points(-3.0, 0.0)));
        assert!(!judgement.feasible && judgement.metrics.is_empty());
        judgement.reason().unwrap().into_owned()
    };
    let no_map = "Lanelet map is not available in the context.";
    assert_eq!(change(&|scene| scene.map = None), no_map);
    assert_eq!(change(&|scene| scene.map = crate::test_scene::scene().map), no_map);
    assert_eq!(change(&|scene| scene.odometry = None), "odometry is not available");
    assert_eq!(change(&|scene| scene.acceleration = None), "acceleration is not available");
    let with_speed = |speed_mps: f64| {
        change(&|scene| {
            let odometry = Arc::make_mut(scene.odometry.as_mut().unwrap());
            odometry.twist.twist.linear.x = speed_mps;
        })
    };
    assert_eq!(with_speed(f64::NAN), "odometry is not finite");
    assert_eq!(with_speed(f64::INFINITY), "odometry is not finite");
    let far = MapSketch { lines: vec![vec![[1e9, 0.0, 0.0], [0.0, 0.0, 0.0]]] };
    assert_eq!(
        change(&|scene| scene.map = Some(far.map(2))),
        "a border of the map lies beyond the range of coordinates"
    );
}

#[test]
fn a_candidate_that_leaves_the_map_is_not_assessed() {
    let scene = scene_at(5.0, 5.0, &lopsided(), &straight_border());
    let mut points = five_points(-3.0, 0.0);
    points[3].pose.position.x = 1e300;
    let judgement = cycle(&mut fixture(), &scene, &candidate_of(points));
    assert_eq!(judgement.reason().unwrap(), "a point lies beyond the range of coordinates");
}

#[test]
fn a_new_map_is_used_at_once() {
    let mut filter = fixture();
    let candidate = candidate_of(five_points(-3.0, 0.0));
    let mut scene = scene_at(5.0, 5.0, &lopsided(), &straight_border());
    assert!((cycle(&mut filter, &scene, &candidate).metrics[0].value - 1.68).abs() < 1e-9);
    scene.map = Some(MapSketch { lines: vec![vec![[-100.0, 1.0, 0.0], [100.0, 1.0, 0.0]]] }.map(2));
    assert!((cycle(&mut filter, &scene, &candidate).metrics[0].value - 0.68).abs() < 1e-9);
    filter.configure(&ValidatorParameters {
        boundary_departure: BoundaryDepartureParameters {
            boundary_types: vec!["curb".to_owned()],
            ..BoundaryDepartureParameters::default()
        },
        ..ValidatorParameters::default()
    });
    assert_eq!(cycle(&mut filter, &scene, &candidate).metrics[0].value, f64::MAX, "no border of this type");
}
