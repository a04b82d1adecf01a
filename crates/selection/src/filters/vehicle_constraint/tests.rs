//! The upstream test cases, the smoothed angles that the specification derives for them, and the edges of each rule.

use super::*;
use crate::test_scene::{candidate_of, scene};
use motion::{Pose, TimeFromStart};
use proptest::prelude::*;

/// x, y, forward speed, lateral speed, acceleration; points are one second apart.
type Point = (f64, f64, f32, f32, f32);

const WHEEL_BASE_M: f64 = 2.5;

fn judge_points(points: Vec<TrajectoryPoint>, limits: VehicleConstraintParameters) -> Judgement {
    let filter = VehicleConstraintFilter::new(limits, WHEEL_BASE_M);
    filter.judge(&scene(), &candidate_of(points), &mut Scratch::default())
}

fn trajectory(points: &[Point], dt_s: f64) -> Vec<TrajectoryPoint> {
    let point = |(index, &(x, y, vlon, vlat, acceleration)): (usize, &Point)| TrajectoryPoint {
        time_from_start: TimeFromStart::from_nanos((index as f64 * dt_s * 1e9).round() as i64),
        pose: Pose::from_xy_yaw(x, y, 0.0),
        longitudinal_velocity_mps: vlon,
        lateral_velocity_mps: vlat,
        acceleration_mps2: acceleration,
        ..TrajectoryPoint::default()
    };
    points.iter().enumerate().map(point).collect()
}

fn judge(points: &[Point], limits: VehicleConstraintParameters) -> Judgement {
    judge_points(trajectory(points, 1.0), limits)
}

fn path(places: &[(f64, f64)]) -> Vec<Point> {
    places.iter().map(|&(x, y)| (x, y, 5.0, 0.0, 0.0)).collect()
}

fn limits(change: impl FnOnce(&mut VehicleConstraintParameters)) -> VehicleConstraintParameters {
    let mut limits = VehicleConstraintParameters::default();
    change(&mut limits);
    limits
}

fn value(judgement: &Judgement, name: &str) -> f64 {
    judgement.metrics.iter().find(|metric| metric.name == name).unwrap().value
}

/// Names of the checks that found something.
fn violated(judgement: &Judgement) -> Vec<&'static str> {
    let beyond = judgement.metrics.iter().filter(|metric| metric.risk == RiskLevel::HighCaution);
    beyond.map(|metric| metric.name).collect()
}

#[test]
fn feasible_case() {
    let points = [(0.0, 0.0, 5.0, 0.0, 0.0), (1.0, 1.0, 5.5, 0.1, 0.0), (2.0, 2.0, 6.0, 0.2, 0.0)];
    let judgement = judge(
        &points,
        VehicleConstraintParameters {
            max_speed: 10.0,
            max_acceleration: 2.0,
            max_deceleration: 2.0,
            max_steering_angle: 0.5,
            max_steering_rate: 0.1,
        },
    );
    assert!(judgement.feasible);
    let names: Vec<_> = judgement.metrics.iter().map(|metric| metric.name).collect();
    let expected = [
        "check_speed",
        "check_acceleration",
        "check_deceleration",
        "check_steering_angle",
        "check_steering_rate",
    ];
    assert_eq!(names, expected);
    assert!(judgement.metrics.iter().all(|metric| metric.value == 0.0 && metric.risk == RiskLevel::Safe));
    assert_eq!(judgement.evidence, None);
}

#[test]
fn speed_cases() {
    let with_last = |last| [(0.0, 0.0, 5.0, 0.0, 0.0), (1.0, 1.0, 6.0, 0.0, 0.0), (2.0, 2.0, last, 0.0, 0.0)];
    let limits = limits(|limits| limits.max_speed = 10.0);
    let judgement = judge(&with_last(11.0), limits.clone());
    assert!(!judgement.feasible);
    assert_eq!(violated(&judgement), ["check_speed"]);
    assert_eq!(value(&judgement, "check_speed"), 11.0);
    assert_eq!(judgement.evidence.unwrap().index, 2);
    assert!(judge(&with_last(7.0), limits.clone()).feasible);
    assert!(judge(&with_last(10.0), limits).feasible, "a value equal to its limit passes");
}

#[test]
fn speed_is_compared_in_f32_widened() {
    let points = [(0.0, 0.0, 16.7, 0.0, 0.0), (16.7, 0.0, 16.7, 0.0, 0.0)];
    let judgement = judge(&points, VehicleConstraintParameters::default());
    assert_eq!(violated(&judgement), ["check_speed"], "16.7f32 is larger than 16.7");
    assert_eq!(value(&judgement, "check_speed"), 16.700_000_762_939_453);
}

#[test]
fn lateral_speed_counts_and_reverse_speed_does_too() {
    let limits = limits(|limits| limits.max_speed = 4.9);
    let sideways = [(0.0, 0.0, 3.0, 4.0, 0.0), (3.0, 4.0, 3.0, -4.0, 0.0)];
    assert_eq!(value(&judge(&sideways, limits.clone()), "check_speed"), 5.0);
    let backwards = [(0.0, 0.0, -5.0, 0.0, 0.0), (-5.0, 0.0, -5.0, 0.0, 0.0)];
    assert_eq!(value(&judge(&backwards, limits), "check_speed"), 5.0);
}

#[test]
fn acceleration_and_deceleration_cases() {
    let with =
        |a: [f32; 3]| [(0.0, 0.0, 0.0, 0.0, a[0]), (1.0, 0.0, 1.0, 0.0, a[1]), (2.0, 0.0, 3.5, 0.0, a[2])];
    let limits = limits(|limits| (limits.max_acceleration, limits.max_deceleration) = (2.0, 2.0));
    let harsh = judge(&with([0.0, 1.0, 3.5]), limits.clone());
    assert_eq!((violated(&harsh), value(&harsh, "check_acceleration")), (vec!["check_acceleration"], 3.5));
    assert!(judge(&with([0.0, 1.0, 2.0]), limits.clone()).feasible, "equality is fine");
    let harsh = judge(&with([0.0, -1.0, -3.0]), limits.clone());
    assert_eq!((violated(&harsh), value(&harsh, "check_deceleration")), (vec!["check_deceleration"], 3.0));
    assert!(judge(&with([0.0, -1.0, -2.0]), limits).feasible);
}

#[test]
fn steering_angle_case() {
    let zigzag = [(0.0, 0.0), (1.0, 0.0), (2.0, 0.0), (2.0, 1.0), (2.0, 2.0), (1.0, 2.0), (0.0, 2.0)];
    let limits = limits(|limits| (limits.max_steering_angle, limits.max_steering_rate) = (0.5, 9.0));
    let judgement = judge(&path(&zigzag), limits.clone());
    assert_eq!(violated(&judgement), ["check_steering_angle"]);
    assert!((value(&judgement, "check_steering_angle") - 0.647_576_763_789_315_6).abs() < 1e-12);
    assert_eq!(judgement.evidence.unwrap().index, 2);
    assert!(judge(&path(&zigzag[..3]), limits).feasible, "below five points there is no smoothed angle");
}

/// Three metres ahead, three to the left, two back.
const TURN: [(f64, f64); 9] = [
    (0.0, 0.0),
    (1.0, 0.0),
    (2.0, 0.0),
    (3.0, 0.0),
    (3.0, 1.0),
    (3.0, 2.0),
    (3.0, 3.0),
    (2.0, 3.0),
    (1.0, 3.0),
];

#[test]
fn steering_rate_case() {
    let limits = limits(|limits| (limits.max_steering_angle, limits.max_steering_rate) = (9.0, 0.1));
    let judgement = judge(&path(&TURN), limits.clone());
    assert_eq!(violated(&judgement), ["check_steering_rate"]);
    assert!((value(&judgement, "check_steering_rate") - 0.259_030_705_515_726_27).abs() < 1e-12);
    assert_eq!(judgement.evidence.unwrap().index, 4, "the first index has a rate of 0.0648");
    let short = path(&[(0.0, 0.0), (1.0, 0.0), (2.0, 0.01), (3.0, 0.02)]);
    assert!(judge(&short, limits).feasible, "below six points there is no rate");
}

#[test]
fn where_no_time_passes_there_is_no_rate() {
    let limits = limits(|limits| (limits.max_steering_angle, limits.max_steering_rate) = (9.0, 0.1));
    assert!(judge_points(trajectory(&path(&TURN), 0.0), limits).feasible);
}

#[test]
fn points_at_one_place_have_no_steering() {
    let judgement = judge(&path(&[(1.0, 1.0); 12]), VehicleConstraintParameters::default());
    assert!(judgement.feasible);
}

#[test]
fn changed_limits_act() {
    let mut filter = VehicleConstraintFilter::new(VehicleConstraintParameters::default(), WHEEL_BASE_M);
    let mut parameters = ValidatorParameters::default();
    parameters.vehicle_constraint.max_speed = 4.0;
    filter.configure(&parameters);
    let candidate = candidate_of(crate::test_scene::straight(5, 5.0));
    assert!(!filter.judge(&scene(), &candidate, &mut Scratch::default()).feasible);
}

proptest! {
    /// Looser limits never turn an accepted candidate into a rejected one, and a reported value is a real violation.
    #[test]
    fn looser_limits_accept_more(
        points in prop::collection::vec((-50.0..50.0_f64, -50.0..50.0_f64, -20.0..20.0_f32, -2.0..2.0_f32, -9.0..9.0_f32), 2..20),
        factor in 1.0..4.0_f64,
    ) {
        let tight = VehicleConstraintParameters::default();
        let loose = VehicleConstraintParameters {
            max_speed: tight.max_speed * factor,
            max_acceleration: tight.max_acceleration * factor,
            max_deceleration: tight.max_deceleration * factor,
            max_steering_angle: tight.max_steering_angle * factor,
            max_steering_rate: tight.max_steering_rate * factor,
        };
        let (tight, loose) = (judge(&points, tight), judge(&points, loose));
        prop_assert!(!tight.feasible || loose.feasible);
        for metric in &tight.metrics {
            prop_assert_eq!(metric.risk == RiskLevel::Safe, metric.value == 0.0);
            prop_assert!(metric.value == 0.0 || metric.value > metric.threshold);
        }
    }

    /// Moving and turning the whole path changes no verdict and no value beyond rounding.
    #[test]
    fn rigid_motion_changes_nothing(
        turns in prop::collection::vec(-0.4..0.4_f64, 6..30),
        yaw in -3.0..3.0_f64,
        dx in -1000.0..1000.0_f64,
    ) {
        let mut heading = 0.0_f64;
        let mut place = (0.0, 0.0);
        let mut places = Vec::new();
        for turn in turns {
            heading += turn;
            place = (place.0 + heading.cos(), place.1 + heading.sin());
            places.push(place);
        }
        let (sin, cos) = yaw.sin_cos();
        let moved: Vec<_> = places.iter().map(|&(x, y)| (cos * x - sin * y + dx, sin * x + cos * y)).collect();
        let limits = limits(|limits| (limits.max_steering_angle, limits.max_steering_rate) = (0.0, 0.0));
        let (a, b) = (judge(&path(&places), limits.clone()), judge(&path(&moved), limits));
        for (a, b) in a.metrics.iter().zip(&b.metrics) {
            prop_assert!((a.value - b.value).abs() < 1e-8, "{} {} {}", a.name, a.value, b.value);
        }
    }
}
