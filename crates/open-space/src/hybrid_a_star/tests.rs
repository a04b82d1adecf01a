use motion::{Point2, VehicleDimensions, VehicleInfo};

use super::*;
use crate::problem::Limits;
use crate::scenes;

/// The vehicle of the open-space planner's own tests.
fn reference_vehicle() -> VehicleInfo {
    VehicleInfo::new(VehicleDimensions {
        wheel_base_m: 2.8448,
        front_overhang_m: 3.89 - 2.8448,
        rear_overhang_m: 1.043,
        wheel_tread_m: 1.6,
        left_overhang_m: 0.255,
        right_overhang_m: 0.255,
        max_steer_angle_rad: 0.512_690_467_773,
        ..VehicleDimensions::default()
    })
    .unwrap()
}

fn problem(bounds: [f64; 4], obstacles: &[&[(f64, f64)]], start: PlanarPose, goal: PlanarPose) -> Problem {
    let line = |points: &&[(f64, f64)]| points.iter().map(|&(x, y)| Point2::new(x, y)).collect();
    Problem {
        vehicle: reference_vehicle(),
        limits: Limits::default(),
        bounds,
        obstacles: obstacles.iter().map(line).collect(),
        start,
        start_speed_mps: 0.0,
        start_acceleration_mps2: 0.0,
        start_curvature: None,
        goal,
    }
}

const STALL: [&[(f64, f64)]; 2] = [
    &[(-14.0, 0.0), (0.0, 0.0), (0.0, -5.5), (3.2, -5.5), (3.2, 0.0), (18.0, 0.0)],
    &[(18.0, 7.0), (-14.0, 7.0)],
];

fn stall(start: PlanarPose) -> Problem {
    let goal = PlanarPose::new(1.6, -4.1, std::f64::consts::FRAC_PI_2);
    problem([-14.0, 18.0, -6.0, 8.0], &STALL, start, goal)
}

fn run(problem: &Problem, parameters: &SearchParameters) -> Result<CoarsePath, SearchError> {
    let checker = CollisionChecker::new(problem).unwrap();
    Search::prepare(problem, &checker, parameters, &mut || None)?.run(&mut || None)
}

/// As the regression figures were calculated: full steering, exact footprint.
fn exact() -> SearchParameters {
    SearchParameters { traj_kappa_constraint_ratio: 1.0, clearance: 0.0, ..SearchParameters::default() }
}

/// What every path promises.
fn assert_sound(path: &CoarsePath, problem: &Problem, name: &str) {
    let checker = CollisionChecker::new(problem).unwrap();
    let (first, last) = (path.parts.first().unwrap(), path.parts.last().unwrap());
    assert_eq!(first.poses[0], problem.start, "{name}");
    let end = last.poses.last().unwrap();
    assert!(end.distance_m(&problem.goal) == 0.0 && end.yaw_to(&problem.goal).abs() < 1e-12, "{name}");
    for pair in path.parts.windows(2) {
        assert_eq!(pair[0].poses.last(), pair[1].poses.first(), "{name}: one cusp");
        assert_ne!(pair[0].gear, pair[1].gear, "{name}");
    }
    for part in &path.parts {
        assert_eq!(part.poses.len(), part.arcs.len() + 1, "{name}");
        for (pair, arc) in part.poses.windows(2).zip(&part.arcs) {
            assert_eq!(arc.gear(), part.gear, "{name}");
            assert!(arc.length_m.abs() <= 0.1 + 1e-9, "{name}");
            assert!(arc.curvature.abs() <= problem.vehicle.max_curvature() + 1e-12, "{name}");
            let end = arc.end(&pair[0]);
            assert!(end.distance_m(&pair[1]) < 1e-6 && (end.yaw - pair[1].yaw).abs() < 1e-6, "{name}");
            // the swept test rounds to the safe side by a millimetre
            let inflation = (path.inflation_m - 2e-3).max(0.0);
            assert!(checker.motion_is_free(&pair[0], &pair[1], inflation), "{name} at {:?}", pair[0]);
        }
    }
}

#[test]
fn known_scenes_have_paths_as_short_as_known() {
    let straight = problem(
        [-50.0, 50.0, -50.0, 50.0],
        &[&[(1.0, 0.0), (-1.0, 0.0)]],
        PlanarPose::new(-15.0, 0.0, 0.0),
        PlanarPose::new(15.0, 0.0, 0.0),
    );
    let cases = [
        ("round a board", straight, 30.533, 0),
        ("backing into a stall from before it", stall(PlanarPose::new(-4.0, 3.0, 0.0)), 15.62, 1),
        ("backing into a stall from behind it", stall(PlanarPose::new(8.0, 3.0, 0.0)), 11.53, 0),
    ];
    for (name, problem, length_m, changes) in cases {
        let path = run(&problem, &exact()).unwrap();
        assert_sound(&path, &problem, name);
        assert!(path.length_m() <= 1.05 * length_m, "{name}: {} instead of {length_m}", path.length_m());
        assert_eq!(path.gear_changes(), changes, "{name}");
    }
}

#[test]
fn without_obstacles_the_path_is_a_word() {
    let pose = |x: f64, y: f64, deg: f64| PlanarPose::new(x, y, deg.to_radians());
    for (start, goal) in [
        (pose(0.0, 0.0, 10.0), pose(7.0, -8.0, 50.0)),
        (pose(0.0, 0.0, 10.0), pose(7.0, -8.0, -50.0)),
        (pose(0.0, 10.0, -10.0), pose(-7.0, -8.0, -50.0)),
        (pose(0.0, 10.0, -10.0), pose(-7.0, -8.0, 150.0)),
        (pose(0.0, 10.0, -10.0), pose(7.0, 8.0, 150.0)),
    ] {
        let problem = problem([-1000.0, 1000.0, -1000.0, 1000.0], &[], start, goal);
        let path = run(&problem, &exact()).unwrap();
        assert_sound(&path, &problem, "open field");
        let word = crate::reeds_shepp::Words::between(&start, &goal, problem.vehicle.max_curvature());
        let best = word.as_slice().iter().map(|w| w.length_m() + 2.0 * w.gear_changes() as f64);
        assert!(path.cost_m <= best.fold(f64::INFINITY, f64::min) + 1e-6);
    }
}

#[test]
fn generated_scenes_are_solved_soundly_and_the_same_every_time() {
    let parameters = SearchParameters::default();
    let mut solved = 0;
    for scene in scenes::suite(3, 3).filter(|scene| scene.tightness < 0.6) {
        let Ok(path) = run(&scene.problem, &parameters) else { continue };
        solved += 1;
        assert_sound(&path, &scene.problem, &scene.name);
        assert_eq!(run(&scene.problem, &parameters).as_ref(), Ok(&path), "{}", scene.name);
    }
    assert!(solved >= 17, "{solved} of 18");
}

#[test]
fn start_and_goal_must_be_possible() {
    let good = stall(PlanarPose::new(-4.0, 3.0, 0.0));
    let at = |x: f64, y: f64, yaw: f64| PlanarPose::new(x, y, yaw);
    type Is = fn(&SearchError) -> bool;
    let cases: [(PlanarPose, PlanarPose, Is); 6] = [
        (at(f64::NAN, 3.0, 0.0), good.goal, |e| matches!(e, SearchError::NotFinite { end: End::Start, .. })),
        (good.start, at(1.6, -4.1, f64::INFINITY), |e| {
            matches!(e, SearchError::NotFinite { end: End::Goal, .. })
        }),
        (at(-14.1, 3.0, 0.0), good.goal, |e| matches!(e, SearchError::OutsideBounds { end: End::Start, .. })),
        (good.start, at(1.6, -6.1, 0.0), |e| matches!(e, SearchError::OutsideBounds { end: End::Goal, .. })),
        (at(-4.0, 0.5, 0.0), good.goal, |e| matches!(e, SearchError::InCollision { end: End::Start, .. })),
        (good.start, at(1.0, -4.1, 1.57), |e| matches!(e, SearchError::InCollision { end: End::Goal, .. })),
    ];
    for (start, goal, is_expected) in cases {
        let error = run(&Problem { start, goal, ..good.clone() }, &SearchParameters::default()).unwrap_err();
        assert!(is_expected(&error), "{error}");
    }
}

#[test]
fn a_goal_behind_walls_is_given_up() {
    let cell: &[(f64, f64)] = &[(6.0, -4.0), (14.0, -4.0), (14.0, 4.0), (6.0, 4.0), (6.0, -3.999)];
    let (start, goal) = (PlanarPose::new(-6.0, 0.0, 0.0), PlanarPose::new(8.5, 0.0, 0.0));
    let closed = problem([-12.0, 16.0, -6.0, 6.0], &[cell], start, goal);
    let error = run(&closed, &SearchParameters::default()).unwrap_err();
    assert!(matches!(error, SearchError::Exhausted { .. } | SearchError::OutOfExpansions { .. }), "{error}");
    let few = SearchParameters { max_expansions: 60, ..SearchParameters::default() };
    let error = run(&closed, &few).unwrap_err();
    assert!(
        matches!(error, SearchError::OutOfExpansions { expansions: 60 } | SearchError::Exhausted { .. }),
        "{error}"
    );
}

#[test]
fn the_budget_of_expansions_is_kept_to_the_node() {
    let tight = scenes::scene(scenes::SceneKind::UTurn, 0.9, 5, 0).problem;
    for max_expansions in [1, 60, 137, 500] {
        let few = SearchParameters { max_expansions, ..SearchParameters::default() };
        let expansions = max_expansions as usize;
        assert_eq!(run(&tight, &few), Err(SearchError::OutOfExpansions { expansions }));
    }
}

#[test]
fn paths_stay_within_bounds_even_where_nothing_else_is_in_the_way() {
    // Half turns in open fields that are narrower than the turning circle.
    let mut swung_out = 0;
    for y in [1.0, 2.0, 3.0, 3.8] {
        let (start, goal) = (PlanarPose::new(0.0, 0.0, 0.0), PlanarPose::new(0.0, y, std::f64::consts::PI));
        let [x_min, x_max, y_min, y_max] = [-12.0, 12.0, -1.0, 4.0];
        let path =
            run(&problem([x_min, x_max, y_min, y_max], &[], start, goal), &SearchParameters::default())
                .unwrap();
        let inside =
            |pose: &PlanarPose| (x_min..=x_max).contains(&pose.x) && (y_min..=y_max).contains(&pose.y);
        for pose in path.parts.iter().flat_map(|part| &part.poses) {
            assert!(inside(pose), "{pose:?}");
        }
        let free = run(&problem([-50.0, 50.0, -50.0, 50.0], &[], start, goal), &SearchParameters::default());
        swung_out += usize::from(!free.unwrap().parts.iter().flat_map(|part| &part.poses).all(inside));
    }
    assert!(swung_out > 0, "without the bounds some go further out");
}

#[test]
fn the_caller_can_interrupt() {
    let tight = scenes::scene(scenes::SceneKind::UTurn, 0.9, 5, 0).problem;
    let checker = CollisionChecker::new(&tight).unwrap();
    let parameters = SearchParameters::default();
    for (cause, cancelled) in [(Interruption::Cancelled, true), (Interruption::OutOfTime, false)] {
        let mut questions = 0;
        let search = Search::prepare(&tight, &checker, &parameters, &mut || None).unwrap();
        let error = search
            .run(&mut || {
                questions += 1;
                (questions > 2).then_some(cause)
            })
            .unwrap_err();
        match error {
            SearchError::Cancelled { expansions } => assert!(cancelled && expansions <= 100),
            SearchError::OutOfTime { expansions } => assert!(!cancelled && expansions <= 100),
            other => panic!("{other}"),
        }
        assert_eq!(questions, 3, "asked often enough, and not after the answer");
    }
}

#[test]
fn parameters_out_of_range_are_named() {
    type Change = fn(&mut SearchParameters);
    let cases: [(&str, Change); 6] = [
        ("xy_grid_resolution", |p| p.xy_grid_resolution = 0.0),
        ("phi_grid_resolution", |p| p.phi_grid_resolution = f64::NAN),
        ("next_node_num", |p| p.next_node_num = 5),
        ("traj_kappa_constraint_ratio", |p| p.traj_kappa_constraint_ratio = 1.1),
        ("clearance", |p| p.clearance = -0.1),
        ("pose_spacing", |p| p.pose_spacing = 0.0),
    ];
    for (name, change) in cases {
        let mut parameters = SearchParameters::default();
        change(&mut parameters);
        let error = run(&stall(PlanarPose::new(-4.0, 3.0, 0.0)), &parameters).unwrap_err();
        assert!(
            matches!(&error, SearchError::Parameter(wrong) if wrong.parameter == name),
            "{name}: {error}"
        );
    }
}

#[test]
fn straight_on_is_always_one_of_the_motions() {
    for (next_node_num, steerings) in [(6, 3), (7, 3), (8, 3), (10, 5), (12, 5), (14, 7), (42, 21)] {
        let parameters = SearchParameters { next_node_num, ..SearchParameters::default() };
        assert_eq!(parameters.steerings(), steerings, "{next_node_num}");
    }
}

#[test]
fn a_start_that_is_the_goal_needs_no_parts() {
    let here = PlanarPose::new(-4.0, 3.0, 0.0);
    let path = run(&Problem { goal: here, ..stall(here) }, &SearchParameters::default()).unwrap();
    assert!(path.parts.is_empty() && path.length_m() == 0.0 && path.gear_changes() == 0);
}
