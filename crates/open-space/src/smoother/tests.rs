//! The smoother among obstacles.

use motion::VehicleInfo;
use proptest::prelude::*;

use super::*;
use crate::manoeuvre::{part, problem};
use crate::pose::Gear;

fn checker(obstacles: Vec<Vec<Point2>>) -> CollisionChecker {
    CollisionChecker::new(&problem(obstacles)).unwrap()
}

fn max_curvature() -> f64 {
    VehicleInfo::default().max_curvature()
}

fn to_smooth(part: &GearPart, inflation_m: f64) -> PartToSmooth<'_> {
    PartToSmooth { part, inflation_m, start_curvature: None, max_curvature: max_curvature() }
}

fn smooth(
    part: &GearPart,
    inflation_m: f64,
    checker: &CollisionChecker,
) -> Result<SmoothedPart, SmoothingError> {
    smooth_part(&to_smooth(part, inflation_m), checker, &SmootherParameters::default(), &mut || false)
}

#[test]
fn points_lie_evenly_on_the_arcs() {
    let part = part(Gear::Reverse, PlanarPose::new(1.0, 2.0, 0.3), &[(0.2, 1.03), (-0.1, 0.004), (0.0, 2.0)]);
    let points = points_along(&part, 0.1);
    assert_eq!(points.len(), 32);
    assert_eq!(points[0], part.poses[0].point());
    assert_eq!(points[31], part.poses[3].point());
    let spacing = part.length_m() / 31.0;
    assert!(points.windows(2).all(|pair| ((pair[1] - pair[0]).norm() - spacing).abs() < 1e-4));
}

#[test]
fn a_free_path_becomes_smooth_in_one_pass() {
    for gear in [Gear::Forward, Gear::Reverse] {
        let part = part(gear, PlanarPose::new(3.0, -1.0, 2.0), &[(0.27, 2.5), (0.0, 1.0), (-0.27, 2.5)]);
        let smoothed = smooth(&part, 0.1, &checker(vec![])).unwrap();
        let path = smoothed.path;
        assert_eq!(smoothed.passes, 1);
        assert_eq!((path.poses()[0], *path.poses().last().unwrap()), (part.poses[0], part.poses[3]));
        let jump = path.curvatures().windows(2).fold(0.0_f64, |most, k| most.max((k[1] - k[0]).abs()));
        assert!(jump / path.step_m() < 0.45, "curvature changes by {} per metre", jump / path.step_m());
        assert!(path.curvatures().iter().all(|k| k.abs() <= max_curvature()));
        assert!((path.length_m() / part.length_m() - 1.0).abs() < 0.02);
    }
}

#[test]
fn wheels_of_a_rolling_vehicle_are_taken_as_they_stand() {
    for (gear, curvature) in [(Gear::Forward, 0.15), (Gear::Reverse, -0.1), (Gear::Reverse, 0.2)] {
        // On as they stand, then the other way.
        let arcs = [(curvature, 1.5), (0.0, 1.0), (-curvature, 2.5)];
        let part = part(gear, PlanarPose::new(3.0, -1.0, 2.0), &arcs);
        let to_smooth = PartToSmooth { start_curvature: Some(curvature), ..to_smooth(&part, 0.1) };
        let path = smooth_part(&to_smooth, &checker(vec![]), &SmootherParameters::default(), &mut || false)
            .unwrap()
            .path;
        assert_eq!(path.curvatures()[0], curvature);
        let jump = path.curvatures().windows(2).fold(0.0_f64, |most, k| most.max((k[1] - k[0]).abs()));
        assert!(jump / path.step_m() < 0.3, "curvature changes by {} per metre", jump / path.step_m());
        assert_eq!((path.poses()[0], *path.poses().last().unwrap()), (part.poses[0], part.poses[3]));
    }
}

/// Distance between the footprint at `pose` and `point`.
fn distance(pose: &PlanarPose, point: Point2) -> f64 {
    let (sin, cos) = pose.yaw.sin_cos();
    let offset = point - pose.point();
    let (x, y) = (cos * offset.x + sin * offset.y, cos * offset.y - sin * offset.x);
    let beyond = |value: f64, low: f64, high: f64| (low - value).max(value - high).max(0.0);
    beyond(x, -1.1, 3.79).hypot(beyond(y, -0.948, 0.948))
}

/// Two bends in a corridor of posts that follows the swept area 3 to 8 cm away.
fn tight() -> (GearPart, CollisionChecker) {
    let part = part(Gear::Forward, PlanarPose::default(), &[(0.28, 3.0), (-0.28, 3.0), (0.0, 2.0)]);
    let poses: Vec<PlanarPose> = part
        .poses
        .iter()
        .zip(&part.arcs)
        .flat_map(|(pose, arc)| (0..300).map(|k| arc.at(pose, arc.length_m * f64::from(k) / 299.0)))
        .collect();
    let grid = (0..170).flat_map(|i| (0..130).map(move |k| (i, k)));
    let posts = grid
        .map(|(i, k)| Point2::new(-3.0 + 0.1 * f64::from(i), -4.0 + 0.1 * f64::from(k)))
        .filter(|post| {
            let nearest = poses.iter().map(|pose| distance(pose, *post)).fold(f64::INFINITY, f64::min);
            (0.03..0.08).contains(&nearest)
        })
        .map(|post| vec![post])
        .collect();
    (part, checker(posts))
}

#[test]
fn a_tight_path_takes_more_passes_and_stays_free() {
    let (part, checker) = tight();
    assert!(part.poses.windows(2).all(|pair| motion_is_free(&pair[0], &pair[1], &checker, 0.02)));
    let smoothed = smooth(&part, 0.02, &checker).unwrap();
    assert!(smoothed.passes > 1);
    for k in 0..=1000 {
        let pose = smoothed.path.at(smoothed.path.length_m() * f64::from(k) / 1000.0).0;
        assert!(checker.is_free(&pose, 0.009), "{k}");
    }
}

#[test]
fn what_still_collides_is_an_error() {
    let (part, _) = tight();
    // A post in the middle of the way: no path is free of it.
    let checker = checker(vec![vec![Point2::new(4.5, 0.6), Point2::new(4.5, 0.7)]]);
    let error = smooth(&part, 0.0, &checker).unwrap_err();
    assert!(matches!(error, SmoothingError::Colliding { passes: 2.., .. }), "{error}");
}

#[test]
fn stops_when_asked_and_leaves_scraps_alone() {
    let (long, checker) = tight();
    let mut asked = 0;
    let mut stop = || {
        asked += 1;
        asked > 1
    };
    let error = smooth_part(&to_smooth(&long, 0.02), &checker, &SmootherParameters::default(), &mut stop)
        .unwrap_err();
    assert_eq!(error, SmoothingError::Stopped { passes: 1 });
    let short = part(Gear::Forward, PlanarPose::default(), &[(0.1, 0.02)]);
    assert!(matches!(smooth(&short, 0.1, &checker), Err(SmoothingError::TooShort { .. })));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    #[test]
    fn smoothed_paths_keep_ends_limits_and_distance(
        gear in prop::sample::select(vec![Gear::Forward, Gear::Reverse]),
        x in -20.0..20.0_f64, y in -20.0..20.0_f64, yaw in -7.0..7.0_f64,
        arcs in prop::collection::vec((-0.3..0.3_f64, 0.05..3.0_f64), 1..5),
        posts in prop::collection::vec((-25.0..25.0_f64, -25.0..25.0_f64), 0..40),
    ) {
        let part = part(gear, PlanarPose::new(x, y, yaw), &arcs);
        let posts: Vec<_> = posts.iter().map(|(x, y)| vec![Point2::new(*x, *y), Point2::new(x + 0.1, *y)]).collect();
        let checker = checker(posts);
        let free = part.poses.iter().zip(&part.arcs).all(|(pose, arc)| {
            (0..50).all(|k| checker.is_free(&arc.at(pose, arc.length_m * f64::from(k) / 49.0), 0.06))
        });
        prop_assume!(free);
        if let Ok(smoothed) = smooth(&part, 0.05, &checker) {
            let path = smoothed.path;
            prop_assert_eq!(path.poses()[0], part.poses[0]);
            prop_assert_eq!(path.poses().last(), part.poses.last());
            prop_assert!(path.curvatures().iter().all(|k| k.abs() <= max_curvature()));
            for pair in path.poses().windows(2) {
                prop_assert!(motion_is_free(&pair[0], &pair[1], &checker, 0.0));
            }
        }
    }
}
