use motion::geometry::{Segment, convex_contains, polygon_contains};
use motion::{Point2, VehicleInfo};
use proptest::prelude::*;

use super::*;
use crate::arc::Arc;
use crate::problem::Limits;

fn problem(bounds: [f64; 4], obstacles: Vec<Vec<Point2>>) -> Problem {
    Problem {
        vehicle: VehicleInfo::default(),
        limits: Limits::default(),
        bounds,
        obstacles,
        start: PlanarPose::default(),
        start_speed_mps: 0.0,
        start_acceleration_mps2: 0.0,
        start_curvature: None,
        goal: PlanarPose::default(),
    }
}

fn line(points: &[(f64, f64)]) -> Vec<Point2> {
    points.iter().map(|&(x, y)| Point2::new(x, y)).collect()
}

fn checker(obstacles: &[Vec<Point2>]) -> CollisionChecker {
    CollisionChecker::new(&problem([-20.0, 20.0, -20.0, 20.0], obstacles.to_vec())).unwrap()
}

/// Clearance by going over everything, with none of the code under test.
fn reference_clearance(pose: &PlanarPose, obstacles: &[Vec<Point2>]) -> f64 {
    let vehicle = VehicleInfo::default();
    let (sin, cos) = pose.yaw.sin_cos();
    let corners: Vec<Point2> = [(3.79, 0.948), (-1.1, 0.948), (-1.1, -0.948), (3.79, -0.948)]
        .map(|(x, y)| Point2::new(pose.x + x * cos - y * sin, pose.y + x * sin + y * cos))
        .to_vec();
    assert!((vehicle.vehicle_length_m() - 4.89).abs() < 1e-12);
    let mut best = f64::INFINITY;
    for obstacle in obstacles {
        if obstacle.len() > 3 && obstacle.first() == obstacle.last() && polygon_contains(obstacle, corners[0])
        {
            return 0.0;
        }
        for ends in obstacle.windows(2) {
            let segment = Segment::new(ends[0], ends[1]);
            if convex_contains(&corners, ends[0]) {
                return 0.0;
            }
            for k in 0..4 {
                let side = Segment::new(corners[k], corners[(k + 1) % 4]);
                best = best.min(side.squared_distance(&segment).sqrt());
            }
        }
    }
    best
}

/// The pose at `ratio` of the screw motion, by the centre about which it turns.
fn reference_between(from: &PlanarPose, to: &PlanarPose, ratio: f64) -> PlanarPose {
    let turn = from.yaw_to(to);
    let chord = to.point() - from.point();
    if turn.abs() < 1e-9 {
        let p = from.point() + chord * ratio;
        return PlanarPose::new(p.x, p.y, from.yaw);
    }
    let across = motion::Vector2::new(-chord.y, chord.x);
    let center = from.point() + chord * 0.5 + across * (0.5 / (turn / 2.0).tan());
    let (sin, cos) = (turn * ratio).sin_cos();
    let arm = from.point() - center;
    PlanarPose::new(
        center.x + cos * arm.x - sin * arm.y,
        center.y + sin * arm.x + cos * arm.y,
        from.yaw + turn * ratio,
    )
}

#[test]
fn a_vehicle_beside_a_wall() {
    // the left side is at y = 0.948
    let wall = [line(&[(-10.0, 1.448), (10.0, 1.448)])];
    let checker = checker(&wall);
    let pose = PlanarPose::default();
    assert!((checker.clearance_m(&pose) - 0.5).abs() < 1e-12);
    assert!(checker.is_free(&pose, 0.0) && checker.is_free(&pose, 0.499));
    assert!(!checker.is_free(&pose, 0.501));
    assert!(!checker.is_free(&PlanarPose::new(0.0, 0.5, 0.0), 0.0), "touching is a collision");
    assert!(checker.is_free(&PlanarPose::new(0.0, 0.5 - 1e-9, 0.0), 0.0));
    assert!(!checker.is_free(&PlanarPose::new(0.0, 0.0, 0.3), 0.0), "the front corner is through");
}

#[test]
fn inside_a_solid_is_a_collision_inside_a_wall_is_not() {
    let ring = [(-9.0, -9.0), (9.0, -9.0), (9.0, 9.0), (-9.0, 9.0)];
    let mut closed = ring.to_vec();
    closed.push(ring[0]);
    let pose = PlanarPose::new(0.3, -0.2, 1.0);
    let solid = checker(&[line(&closed)]);
    assert!(!solid.is_free(&pose, 0.0));
    assert_eq!(solid.clearance_m(&pose), 0.0);
    assert!(!solid.motion_is_free(&pose, &PlanarPose::new(0.4, -0.2, 1.0), 0.0));
    let wall = checker(&[line(&ring)]);
    assert!(wall.is_free(&pose, 0.0));
    assert!(wall.clearance_m(&pose) > 3.0);
    // a line there and back has the same ends, but nothing is inside
    let there_and_back = checker(&[line(&[(-9.0, 5.0), (9.0, 5.0), (-9.0, 5.0)])]);
    assert!(there_and_back.is_free(&pose, 0.0));
}

#[test]
fn obstacles_within_the_footprint_and_single_points_are_seen() {
    for small in [
        line(&[(1.0, 0.0), (1.1, 0.0), (1.1, 0.1), (1.0, 0.0)]),
        line(&[(1.0, 0.2), (1.0, 0.3)]),
        line(&[(2.0, 0.5)]),
    ] {
        let checker = checker(&[small]);
        assert!(!checker.is_free(&PlanarPose::default(), 0.0));
        assert_eq!(checker.clearance_m(&PlanarPose::default()), 0.0);
        assert!(checker.is_free(&PlanarPose::new(6.0, 0.0, 0.0), 0.5));
    }
}

#[test]
fn bounds_are_those_of_the_reference_point_even_without_obstacles() {
    let checker = CollisionChecker::new(&problem([0.0, 10.0, -5.0, 5.0], Vec::new())).unwrap();
    let cases = [
        ((0.0, 0.0, 0.0), true),
        ((10.0, 5.0, std::f64::consts::FRAC_PI_2), true),
        ((-1e-9, 0.0, 0.0), false),
        ((5.0, 5.1, 0.0), false),
        ((f64::NAN, 0.0, 0.0), false),
        ((1.0, f64::NAN, 0.0), false),
        ((1.0, 0.0, f64::NAN), false),
        ((1.0, 0.0, f64::INFINITY), false),
    ];
    for ((x, y, yaw), expected) in cases {
        let pose = PlanarPose::new(x, y, yaw);
        assert_eq!(checker.is_free(&pose, 0.0), expected, "{pose:?}");
        let inside = PlanarPose::new(5.0, 0.0, 0.0);
        assert_eq!(checker.motion_is_free(&inside, &pose, 0.0), expected, "{pose:?}");
        assert_eq!(checker.motion_is_free(&pose, &inside, 0.0), expected, "{pose:?}");
    }
    assert_eq!(checker.clearance_m(&PlanarPose::new(5.0, 0.0, 0.0)), f64::INFINITY);
}

#[test]
fn a_thin_post_between_two_samples_is_hit() {
    // In a left turn the front right corner passes here between the samples; neither end touches.
    let from = PlanarPose::default();
    let to = Arc::new(0.3, 0.5).end(&from);
    let middle = Arc::new(0.3, 0.25).end(&from);
    let (sin, cos) = middle.yaw.sin_cos();
    let corner = Point2::new(middle.x + 3.788 * cos + 0.946 * sin, middle.y + 3.788 * sin - 0.946 * cos);
    let checker = checker(&[vec![corner]]);
    assert!(checker.is_free(&from, 0.0) && checker.is_free(&to, 0.0));
    assert!(!checker.is_free(&middle, 0.0));
    assert!(!checker.motion_is_free(&from, &to, 0.0));
}

#[test]
fn bad_bounds_and_vertices_are_refused_by_place() {
    let wall = vec![line(&[(0.0, 0.0), (1.0, 1.0)])];
    for bounds in [
        [0.0, 0.0, 0.0, 1.0],
        [1.0, 0.0, 0.0, 1.0],
        [0.0, 1.0, 1.0, 0.0],
        [0.0, f64::INFINITY, 0.0, 1.0],
        [f64::NAN, 1.0, 0.0, 1.0],
        [-1e8, 1.0, 0.0, 1.0],
    ] {
        let error = CollisionChecker::new(&problem(bounds, wall.clone())).unwrap_err();
        assert!(matches!(error, ObstacleError::Bounds { .. }), "{error}");
    }
    for bad in [f64::NAN, f64::INFINITY, 1e8] {
        let obstacles = vec![wall[0].clone(), line(&[(0.0, 0.0), (1.0, bad)])];
        let error = CollisionChecker::new(&problem([0.0, 1.0, 0.0, 1.0], obstacles)).unwrap_err();
        assert!(matches!(error, ObstacleError::Vertex { obstacle: 1, vertex: 1, .. }), "{error}");
    }
}

#[test]
fn immense_bounds_and_crowds_of_obstacles_stay_small_and_correct() {
    let posts = (0..30_000).map(|k| line(&[(f64::from(k) * 0.5, 5.0), (f64::from(k) * 0.5, 1e6)])).collect();
    let checker = CollisionChecker::new(&problem([-1e7, 1e7, -1e7, 1e7], posts)).unwrap();
    assert!(checker.is_free(&PlanarPose::new(100.0, 4.0, 0.0), 0.0));
    assert!((checker.clearance_m(&PlanarPose::new(100.0, 4.0, 0.0)) - 0.052).abs() < 1e-9);
    assert!(!checker.is_free(&PlanarPose::new(100.0, 4.1, 0.0), 0.0));
}

fn any_pose() -> impl Strategy<Value = PlanarPose> {
    (-8.0..8.0_f64, -8.0..8.0_f64, -7.0..7.0_f64).prop_map(|(x, y, yaw)| PlanarPose::new(x, y, yaw))
}

/// Walls and closed polygons, some of them crossing themselves.
fn any_obstacles() -> impl Strategy<Value = Vec<Vec<Point2>>> {
    let vertex = (-4.0..4.0_f64, -4.0..4.0_f64);
    let one = (prop::collection::vec(vertex, 2..6), -12.0..12.0_f64, -12.0..12.0_f64, any::<bool>());
    let shaped = one.prop_map(|(vertices, x, y, closed)| {
        let mut points: Vec<_> = vertices.iter().map(|v| Point2::new(x + v.0, y + v.1)).collect();
        if closed {
            points.push(points[0]);
        }
        points
    });
    prop::collection::vec(shaped, 0..6)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(600))]

    #[test]
    fn clearance_is_that_of_going_over_everything(obstacles in any_obstacles(), pose in any_pose()) {
        let checker = checker(&obstacles);
        let expected = reference_clearance(&pose, &obstacles);
        let actual = checker.clearance_m(&pose);
        prop_assert!(actual == expected || (actual - expected).abs() < 1e-9, "{actual} instead of {expected}");
        for inflation in [0.0, 0.05, 0.3, 1.0, 4.0] {
            if (expected - inflation).abs() > 1e-9 || expected == 0.0 {
                prop_assert_eq!(checker.is_free(&pose, inflation), expected > inflation, "{} {}", inflation, expected);
            }
        }
        prop_assert!(checker.room_m(pose.point()) <= reference_room(pose.point(), &obstacles) + 1e-9);
    }

    #[test]
    fn a_motion_is_free_when_all_poses_between_are(
        obstacles in any_obstacles(), from in any_pose(),
        ahead in -0.6..0.6_f64, aside in -0.05..0.05_f64, turn in -0.5..0.5_f64, inflation in 0.0..0.2_f64,
    ) {
        let checker = checker(&obstacles);
        let (sin, cos) = from.yaw.sin_cos();
        let to = PlanarPose::new(
            from.x + ahead * cos - aside * sin, from.y + ahead * sin + aside * cos, from.yaw + turn,
        );
        let n = 200;
        let least = (0..=n)
            .map(|k| reference_clearance(&reference_between(&from, &to, f64::from(k) / f64::from(n)), &obstacles))
            .fold(f64::INFINITY, f64::min);
        let free = checker.motion_is_free(&from, &to, inflation);
        prop_assert_eq!(free, checker.motion_is_free(&to, &from, inflation));
        if free {
            prop_assert!(least > inflation - 1e-9, "comes within {least} of {inflation}");
        } else {
            // A corner 5 m from the centre of the turn goes 20 cm in a piece that bulges by a millimetre.
            prop_assert!(least <= inflation + 2.0 * SWEEP_BULGE_M + 0.12, "keeps {least} of {inflation}");
        }
    }
}

fn reference_room(point: Point2, obstacles: &[Vec<Point2>]) -> f64 {
    let segments = obstacles.iter().flat_map(|line| line.windows(2));
    let nearest = segments
        .map(|ends| Segment::new(ends[0], ends[1]).distance_to_point(point))
        .fold(f64::INFINITY, f64::min);
    let solid =
        |line: &&Vec<Point2>| line.len() > 3 && line.first() == line.last() && polygon_contains(line, point);
    if obstacles.iter().any(|line| solid(&line)) { 0.0 } else { nearest }
}
