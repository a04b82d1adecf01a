//! The published cases of the boundary checker's functions, held against the filter as a whole: what a function measures
//! is what the filter reports of a map with one border and a vehicle of the function's shape.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

use lanelet_map::MapBuilder;
use messages::builtin_interfaces::Time;
use messages::geometry_msgs::AccelWithCovarianceStamped;
use messages::nav_msgs::Odometry;
use motion::{Pose, TimeFromStart, TrajectoryPoint, VehicleDimensions, VehicleInfo, calculate_stop_distance};
use selection::filters::boundary_departure::UncrossableBoundaryDepartureFilter;
use selection::parameters::BoundaryDepartureParameters;
use selection::scene::{Epoch, HdMap};
use selection::{Candidate, CandidateKey, Filter, Judgement, RiskLevel, Scene, Scratch};
use std::sync::Arc;

/// Limits that nothing is critical by, so that a candidate is measured from its first point to its last.
const ONLY_MEASURED: f64 = -1e6;
/// Values from here on mean that nothing was measured.
const UNMEASURED_M: f64 = 1e300;

/// A vehicle that reaches this far to the front, the rear and either side of its reference point.
fn vehicle(front_m: f64, rear_m: f64, half_width_m: f64) -> VehicleInfo {
    VehicleInfo::new(VehicleDimensions {
        wheel_base_m: front_m - 1.0,
        front_overhang_m: 1.0,
        rear_overhang_m: rear_m,
        wheel_tread_m: 2.0 * half_width_m,
        left_overhang_m: 0.0,
        right_overhang_m: 0.0,
        ..VehicleDimensions::default()
    })
    .unwrap()
}

type Border = [(f64, f64); 2];

fn scene(vehicle: &VehicleInfo, speed_mps: f64, borders: &[Border]) -> Scene {
    let stamp = Time { sec: 1000, nanosec: 0 };
    let mut scene = Scene::empty(stamp, Arc::new(*vehicle));
    let mut odometry = Odometry::default();
    odometry.header.stamp = stamp;
    odometry.twist.twist.linear.x = speed_mps;
    scene.odometry = Some(Arc::new(odometry));
    scene.acceleration = Some(Arc::new(AccelWithCovarianceStamped::default()));
    let mut builder = MapBuilder::new();
    for (border, id) in borders.iter().zip(1..) {
        let places = border.map(|(x, y)| [x, y, 0.0]);
        builder.line_string_at(id, &places, &[("type", "road_border")]).unwrap();
    }
    let map = Arc::new(builder.build().unwrap());
    scene.map = Some(Epoch { number: 1, value: HdMap::new("map".into(), map) });
    scene
}

/// Points at these poses and times.
fn candidate(poses: &[((f64, f64, f64), f64)]) -> Candidate {
    let point = |&((x, y, yaw), time_s): &((f64, f64, f64), f64)| TrajectoryPoint {
        time_from_start: TimeFromStart::from_nanos((time_s * 1e9) as i64),
        pose: Pose::from_xy_yaw(x, y, yaw),
        ..TrajectoryPoint::default()
    };
    Candidate {
        key: CandidateKey { generator: Default::default(), sample: 0 },
        generator_name: "planner".into(),
        message: Arc::default(),
        points: Arc::new(poses.iter().map(point).collect()),
    }
}

fn judge(
    vehicle: &VehicleInfo,
    parameters: &BoundaryDepartureParameters,
    scene: &Scene,
    candidate: &Candidate,
) -> Judgement {
    let mut filter = UncrossableBoundaryDepartureFilter::new(parameters.clone(), *vehicle);
    filter.observe(scene);
    filter.judge(scene, candidate, &mut Scratch::default())
}

/// The smallest lateral distance to these borders.
fn measured(vehicle: &VehicleInfo, borders: &[Border], poses: &[((f64, f64, f64), f64)]) -> f64 {
    let parameters = BoundaryDepartureParameters {
        lateral_margin_m: ONLY_MEASURED,
        ..BoundaryDepartureParameters::default()
    };
    judge(vehicle, &parameters, &scene(vehicle, 0.0, borders), &candidate(poses)).metrics[0].value
}

/// The nearest segment of a side: a border through the rear edge, one through the front edge, one with no foot.
#[test]
fn closest_segments_of_a_side() {
    // To the right of the y axis, from y = -4 to y = 4, driving up.
    let body = vehicle(4.0, 4.0, 1.0);
    let here = [((1.0, 0.0, std::f64::consts::FRAC_PI_2), 0.0); 2];
    for (name, border, expected) in [
        ("through the rear edge", [(1.0, -5.0), (1.0, -3.0)], Some(0.0)),
        ("through the front edge", [(1.0, 5.0), (1.0, 3.0)], Some(0.0)),
        ("beside, with a foot", [(4.0, -2.0), (5.0, -2.0)], Some(2.0)),
        ("beyond the corner, end to end", [(3.0, 5.0), (4.0, 6.0)], None),
    ] {
        let value = measured(&body, &[border], &here);
        match expected {
            Some(expected) => assert!((value - expected).abs() < 1e-9, "{name}: {value}"),
            None => assert!(value > UNMEASURED_M, "{name}: {value}"),
        }
    }
}

/// A side counts what is nearer to it than to the other; what is equally near to both is the left one's.
#[test]
fn borders_belong_to_the_nearer_side() {
    // Sides at y = 2 and y = -2; the vehicle then moves 1 m to its left.
    let body = vehicle(2.0, 1.0, 2.0);
    for (y, values) in [(3.0, [1.0, 0.0]), (-3.0, [1.0, 2.0]), (0.0, [0.0, 0.0])] {
        let border = [[(-20.0, y), (20.0, y)]];
        for (moved, value) in [0.0, 1.0].into_iter().zip(values) {
            let poses = [((0.0, moved, 0.0), 0.0); 2];
            assert!((measured(&body, &border, &poses) - value).abs() < 1e-9, "y = {y}, moved by {moved}");
        }
    }
}

/// Along a way to the left and to the right over a border: the distance falls, is zero, and is negative behind it.
#[test]
fn left_and_right_departures() {
    // Sides from (4.1, 3.8) to (-5.5, 1.0) and from (5.5, -1.0) to (-4.1, -3.8), and on by (24, 7).
    let body = vehicle(5.0, 5.0, 2.5);
    let yaw = 7.0_f64.atan2(24.0);
    for (name, sign) in [("left", 1.0), ("right", -1.0)] {
        let pose = |step: f64| ((24.0 * step, sign * 7.0 * step, sign * yaw), step);
        let poses = [pose(0.0), pose(1.0), pose(2.0)];
        let border = [[(-100.0, sign * 9.4), (100.0, sign * 9.4)]];
        for (count, expected) in [(1, 5.6), (2, 0.0), (3, -5.6)] {
            let value = measured(&body, &border, &poses[..count]);
            assert!((value - expected).abs() < 1e-9, "{name}, {count} poses: {value}");
        }
    }
}

/// Speed from which on the vehicle brakes for this long a way, front overhang included.
fn speed_with_braking_m(braking_m: f64, parameters: &BoundaryDepartureParameters) -> f64 {
    let (mut slow, mut fast) = (0.0, 50.0);
    for _ in 0..60 {
        let speed = 0.5 * (slow + fast);
        let stop_m = calculate_stop_distance(
            speed,
            0.0,
            parameters.max_deceleration_mps2,
            parameters.max_jerk_mps3,
            parameters.brake_delay_s,
        );
        if 1.0 + stop_m.unwrap() < braking_m { slow = speed } else { fast = speed }
    }
    slow
}

/// A finding counts by how far its place is from the front corner: 10 m of way less 2 m of side.
#[test]
fn projections_along_the_path() {
    let body = vehicle(2.0, 2.0, 1.0);
    let poses = [((0.0, 0.0, 0.0), 0.0), ((10.0, 0.0, 0.0), 1.0), ((20.0, 0.0, 0.0), 2.0)];
    let border = [[(10.0, 0.0), (10.0, 2.0)]];
    let parameters = BoundaryDepartureParameters {
        time_to_departure_cutoff_s: 0.0,
        ..BoundaryDepartureParameters::default()
    };
    assert!(measured(&body, &border, &poses[..2]).abs() < 1e-9);
    for (braking_m, is_critical) in [(7.99, false), (8.01, true)] {
        let scene = scene(&body, speed_with_braking_m(braking_m, &parameters), &border);
        let judgement = judge(&body, &parameters, &scene, &candidate(&poses));
        assert_eq!(judgement.feasible, !is_critical, "brakes within {braking_m} m");
        assert_eq!(judgement.evidence.map(|evidence| evidence.index), is_critical.then_some(1));
    }
}

/// S4: of a border across the front edge (no offset) and one across the rear edge (4 m) at one pose, the latter counts,
/// in whatever order they are stored.
#[test]
fn of_several_hits_the_largest_offset_counts() {
    let body = vehicle(2.0, 2.0, 1.0);
    // The two borders are both nearer to the left side.
    let (front, rear) = ([(12.0, 0.5), (12.5, 3.0)], [(8.0, 0.5), (7.5, 3.0)]);
    let poses = [((0.0, 0.0, 0.0), 0.0), ((10.0, 0.0, 0.0), 1.0)];
    let parameters = BoundaryDepartureParameters {
        time_to_departure_cutoff_s: 0.0,
        ..BoundaryDepartureParameters::default()
    };
    for (braking_m, borders, is_critical) in [
        (6.1, vec![front, rear], true),
        (6.1, vec![rear, front], true),
        (5.9, vec![front, rear], false),
        (6.1, vec![front], false),
    ] {
        let scene = scene(&body, speed_with_braking_m(braking_m, &parameters), &borders);
        let judgement = judge(&body, &parameters, &scene, &candidate(&poses));
        assert_eq!(judgement.feasible, !is_critical, "brakes within {braking_m} m of {borders:?}");
    }
}

/// Four poses 0.9, 0.4, 0.2 and 0.6 m beside a border: near, but never critical.
#[test]
fn near_a_border_is_a_low_caution() {
    let body = vehicle(2.0, 2.0, 1.0);
    let pose = |(step, lateral_m): (usize, f64)| ((step as f64, -lateral_m, 0.0), 3.0 + step as f64);
    let poses: Vec<_> = [0.9, 0.4, 0.2, 0.6].into_iter().enumerate().map(pose).collect();
    let borders = [[(-50.0, 1.0), (50.0, 1.0)], [(-50.0, -4.6), (50.0, -4.6)]];
    for (near_m, risk) in [(0.5, RiskLevel::LowCaution), (0.19, RiskLevel::Safe)] {
        let parameters = BoundaryDepartureParameters {
            near_boundary_lateral_th_m: near_m,
            ..BoundaryDepartureParameters::default()
        };
        let judgement = judge(&body, &parameters, &scene(&body, 0.0, &borders), &candidate(&poses));
        let metric = judgement.metrics[0];
        assert!(judgement.feasible && (metric.value - 0.2).abs() < 1e-9, "{metric:?}");
        assert_eq!(metric.risk, risk, "near up to {near_m} m");
    }
}

/// Without any point nothing is measured, nothing rejected, and the memory stays as it was.
#[test]
fn a_candidate_without_points_changes_nothing() {
    let body = vehicle(2.0, 2.0, 1.0);
    let scene = scene(&body, 10.0, &[[(-50.0, 1.0), (50.0, 1.0)]]);
    let mut filter = UncrossableBoundaryDepartureFilter::new(BoundaryDepartureParameters::default(), body);
    let (empty, critical) = (candidate(&[]), candidate(&[((0.0, 0.5, 0.0), 0.0), ((1.0, 0.5, 0.0), 0.1)]));
    filter.observe(&scene);
    let judgement = filter.judge(&scene, &empty, &mut Scratch::default());
    assert!(judgement.feasible && judgement.metrics[0].value > UNMEASURED_M, "{judgement:?}");
    assert!(!filter.judge(&scene, &critical, &mut Scratch::default()).feasible);
}
