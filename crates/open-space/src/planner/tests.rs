//! From hand-made coarse paths to trajectories.

use std::f64::consts::FRAC_PI_2;

use motion::{Point2, VehicleInfo};
use proptest::prelude::*;

use super::*;
use crate::interruption;
use crate::manoeuvre::manoeuvre;
use crate::pose::{Gear, PlanarPose};
use crate::problem::Limits;
use crate::provider::{PlanFailure, ProblemPlanner};
use crate::scenes::{self, SceneKind};
use crate::verification::verify;

/// Interrupts from the given question on, and remembers the steps.
struct Watch {
    answers: usize,
    interruption: Interruption,
    steps: Vec<Step>,
}

impl Watch {
    fn ending_after(answers: usize) -> Self {
        Self { answers, interruption: Interruption::OutOfTime, steps: Vec::new() }
    }
}

impl Supervisor for Watch {
    fn interruption(&mut self) -> Option<Interruption> {
        let ends = self.answers == 0;
        self.answers = self.answers.saturating_sub(1);
        ends.then_some(self.interruption)
    }

    fn begin(&mut self, step: Step) {
        self.steps.push(step);
    }
}

fn refine(problem: &Problem, path: &CoarsePath, supervisor: &mut dyn Supervisor) -> Result<Plan, PlanError> {
    let checker = CollisionChecker::new(problem).unwrap();
    Planner::new(OpenSpaceParameters::default()).refine(problem, &checker, path, supervisor)
}

/// Into a slot and forward again, well within the curvature limit.
fn easy() -> (Problem, CoarsePath) {
    let parts: [&[(f64, f64)]; 3] =
        [&[(0.1, 2.0), (0.0, 1.0)], &[(-0.25, 2.5), (0.0, 0.4), (0.25, 2.5)], &[(0.2, 1.0), (-0.2, 1.0)]];
    manoeuvre(Gear::Forward, PlanarPose::new(4.0, -3.0, 2.5), &parts)
}

#[test]
fn a_plan_goes_all_the_way() {
    let (problem, path) = easy();
    let mut supervisor = Watch::ending_after(usize::MAX);
    let plan = refine(&problem, &path, &mut supervisor).unwrap();
    assert_eq!(supervisor.steps, [Step::Smoothing, Step::Speed, Step::Check]);
    assert_eq!((plan.stage, plan.fallbacks.len(), plan.passes), (Stage::Timed, 0, 3));
    assert_eq!(plan.measures.gear_changes, 2);
    assert_eq!(plan.coarse_length_m, path.length_m());
    assert!(plan.measures.length_m < 1.02 * path.length_m());
    let points = &plan.trajectory.points;
    assert_eq!((points[0].pose, points[0].time_s), (problem.start, 0.0));
    let last = points.last().unwrap();
    assert_eq!((last.pose, last.speed_mps, last.acceleration_mps2), (problem.goal, 0.0, 0.0));
    assert_eq!(plan, refine(&problem, &path, &mut Unsupervised).unwrap(), "the same plan every time");
}

#[test]
fn wheels_turn_while_the_vehicle_stands_at_a_cusp() {
    let (problem, path) = manoeuvre(Gear::Reverse, PlanarPose::default(), &[&[(0.25, 3.0)], &[(-0.25, 3.0)]]);
    let points = refine(&problem, &path, &mut Unsupervised).unwrap().trajectory.points;
    let cusp = points.iter().position(|point| point.gear == Gear::Forward).unwrap();
    let standing: Vec<_> =
        points[cusp..].iter().take_while(|point| point.pose == points[cusp].pose).collect();
    let turned = standing.last().unwrap().steer_rad - standing[0].steer_rad;
    assert!(turned < -1.0, "{turned}");
    let took_s = standing.last().unwrap().time_s - standing[0].time_s;
    assert!(-turned / took_s > 0.9 * problem.limits.max_steer_rate_rps, "{took_s} s");
    assert!(standing.iter().all(|point| point.speed_mps == 0.0 && point.acceleration_mps2 == 0.0));
    assert!(standing.iter().all(|point| point.gear == Gear::Forward));
}

#[test]
fn stopped_at_any_time_there_is_something_to_drive() {
    let (problem, path) = easy();
    let checker = CollisionChecker::new(&problem).unwrap();
    let complete = refine(&problem, &path, &mut Unsupervised).unwrap();
    let (mut stages, mut durations) = (Vec::new(), Vec::new());
    for answers in 0.. {
        let plan = refine(&problem, &path, &mut Watch::ending_after(answers)).unwrap();
        assert_eq!(verify(&plan.trajectory, &problem, &checker), Ok(plan.measures));
        if stages.last() != Some(&plan.stage) {
            stages.push(plan.stage);
            durations.push(plan.measures.duration_s);
        }
        if plan == complete {
            break;
        }
    }
    assert_eq!(stages, [Stage::Search, Stage::Smoothed, Stage::Timed]);
    assert!(durations[0] > durations[1] && durations[1] >= durations[2], "{durations:?}");
}

#[test]
fn a_part_that_cannot_be_smoothed_is_driven_with_stops_between_its_arcs() {
    // The shortest way there is, at full lock: no room is left to turn the wheels on the move.
    let full = full_lock();
    let (problem, path) = manoeuvre(
        Gear::Forward,
        PlanarPose::default(),
        &[&[(full, 1.0), (full, 1.0), (-full, 1.0), (-full, 2.0)]],
    );
    let plan = refine(&problem, &path, &mut Unsupervised).unwrap();
    assert_eq!(plan.stage, Stage::Timed);
    assert!(
        matches!(
            plan.fallbacks[..],
            [PartFallback { part: 0, stops: 1, reason: SmoothingError::NoPath { .. } }]
        ),
        "{:?}",
        plan.fallbacks
    );
    assert!((plan.measures.length_m - 5.0).abs() < 0.01);
    let stops = plan.trajectory.points.windows(2).filter(|p| p[0].speed_mps > 0.0 && p[1].speed_mps == 0.0);
    assert_eq!(stops.count(), 2);
}

/// Tail first into a slot.
fn slot() -> Problem {
    scenes::scene(SceneKind::PerpendicularReverse, 0.3, 3, 0).problem
}

fn plan(problem: &Problem, supervisor: &mut dyn Supervisor) -> Result<Plan, PlanError> {
    Planner::new(OpenSpaceParameters::default()).plan(problem, supervisor)
}

#[test]
fn a_problem_is_planned_from_start_to_goal() {
    let problem = slot();
    let mut watch = Watch::ending_after(usize::MAX);
    let found = plan(&problem, &mut watch).unwrap();
    assert_eq!(watch.steps, [Step::Heuristic, Step::Search, Step::Smoothing, Step::Speed, Step::Check]);
    assert_eq!((found.stage, found.held_back), (Stage::Timed, None));
    assert!(found.expansions > 0 && found.coarse_length_m > 0.0);
    let checker = CollisionChecker::new(&problem).unwrap();
    assert_eq!(verify(&found.trajectory, &problem, &checker), Ok(found.measures));
    assert_eq!(found, plan(&problem, &mut Unsupervised).unwrap(), "the same plan every time");
}

#[test]
fn an_end_of_time_gives_the_best_there_is_and_cancelling_nothing() {
    let problem = slot();
    let checker = CollisionChecker::new(&problem).unwrap();
    let mut stages = Vec::new();
    for answers in 0.. {
        let cancelled = plan(
            &problem,
            &mut Watch { interruption: Interruption::Cancelled, ..Watch::ending_after(answers) },
        );
        match plan(&problem, &mut Watch::ending_after(answers)) {
            Ok(found) => {
                assert_eq!(verify(&found.trajectory, &problem, &checker), Ok(found.measures));
                stages.push(Some(found.stage));
            }
            Err(error) => {
                assert!(matches!(error, PlanError::Search(SearchError::OutOfTime { .. })), "{error}");
                stages.push(None);
            }
        }
        if cancelled.is_ok() {
            break;
        }
        assert_eq!(cancelled, Err(PlanError::Cancelled));
    }
    assert!(stages.is_sorted(), "{stages:?}");
    stages.dedup();
    let stage = Some;
    assert_eq!(stages, [None, stage(Stage::Search), stage(Stage::Smoothed), stage(Stage::Timed)]);
}

#[test]
fn a_vehicle_at_its_goal_stays() {
    let mut problem = slot();
    problem.start = problem.goal;
    let found = plan(&problem, &mut Unsupervised).unwrap();
    assert_eq!((found.measures.length_m, found.measures.gear_changes, found.stage), (0.0, 0, Stage::Timed));
    assert!(found.trajectory.points.iter().all(|point| point.pose == problem.goal && point.speed_mps == 0.0));
    problem.start_speed_mps = 0.5;
    let error = plan(&problem, &mut Unsupervised).unwrap_err();
    assert!(matches!(error, PlanError::Speed(SpeedError::CannotStop { .. })), "{error}");
}

#[test]
fn every_failure_has_its_reason() {
    type Change = fn(&mut Problem);
    type Is = fn(&PlanError) -> bool;
    let cases: [(Change, Is); 6] = [
        (|p| p.start.y = f64::NAN, |e| matches!(e, PlanError::Input { field: "start.y", .. })),
        (|p| p.bounds = [1.0, 0.0, 0.0, 1.0], |e| matches!(e, PlanError::Obstacles(_))),
        (|p| p.obstacles.push(vec![Point2::new(f64::NAN, 0.0)]), |e| matches!(e, PlanError::Obstacles(_))),
        (
            |p| p.obstacles.push(vec![p.goal.point(), p.start.point()]),
            |e| matches!(e, PlanError::Search(SearchError::InCollision { .. })),
        ),
        (
            |p| p.goal.x = p.bounds[1] + 1.0,
            |e| matches!(e, PlanError::Search(SearchError::OutsideBounds { .. })),
        ),
        // No goal to reach: a ring of walls about the start.
        (enclose, |e| matches!(e, PlanError::Search(SearchError::Exhausted { .. }))),
    ];
    for (change, is_expected) in cases {
        let mut problem = slot();
        change(&mut problem);
        let error = plan(&problem, &mut Unsupervised).unwrap_err();
        assert!(is_expected(&error), "{error}");
        let failure = Planner::new(OpenSpaceParameters::default()).provide(&problem, false).unwrap_err();
        let is_input = matches!(error, PlanError::Input { .. });
        assert_eq!(matches!(failure, PlanFailure::InputNotReady { .. }), is_input, "{failure}");
        assert_eq!(matches!(failure, PlanFailure::Search { .. }), !is_input, "{failure}");
    }
    let cancelled = Planner::new(OpenSpaceParameters::default()).provide(&slot(), true);
    assert_eq!(cancelled, Err(PlanFailure::Cancelled));
}

impl Planner {
    /// As the provider asks.
    fn provide(&mut self, problem: &Problem, cancelled: bool) -> Result<Trajectory, PlanFailure> {
        let watch: interruption::Watch =
            std::sync::Arc::new(move || cancelled.then_some(Interruption::Cancelled));
        ProblemPlanner::plan(self, problem, &watch)
    }
}

fn enclose(problem: &mut Problem) {
    let (x, y) = (problem.start.x, problem.start.y);
    let corners = [(-7.0, -7.0), (7.0, -7.0), (7.0, 7.0), (-7.0, 7.0), (-7.0, -7.0)];
    // The goal lies outside of the ring.
    problem.goal = PlanarPose::new(x + 30.0, y, problem.start.yaw);
    problem.bounds = [x - 60.0, x + 60.0, y - 60.0, y + 60.0];
    let ring = corners.iter().map(|(dx, dy)| Point2::new(x + dx, y + dy)).collect::<Vec<_>>();
    problem.obstacles = vec![ring[..3].to_vec(), ring[2..].to_vec()];
}

/// Curvature of the default vehicle at full lock.
fn full_lock() -> f64 {
    VehicleInfo::default().max_curvature()
}

#[test]
fn rolling_starts() {
    let (mut problem, path) = easy();
    problem.start_speed_mps = 0.4;
    problem.start_acceleration_mps2 = 0.1;
    let plan = refine(&problem, &path, &mut Unsupervised).unwrap();
    assert_eq!(
        (plan.trajectory.points[0].speed_mps, plan.trajectory.points[0].acceleration_mps2),
        (0.4, 0.1)
    );
    problem.start_speed_mps = -0.1;
    assert!(matches!(refine(&problem, &path, &mut Unsupervised), Err(PlanError::RollingAgainstGear { .. })));
    problem.start_speed_mps = 2.5;
    let error = refine(&problem, &path, &mut Unsupervised).unwrap_err();
    assert!(matches!(error, PlanError::Speed(SpeedError::TooFastAtStart { .. })), "{error}");
}

/// Rolling either way, the wheels to either side, towards goals ahead and behind: the plan goes on as the wheels stand
/// (its steering rate is within its limit from the first point on: that is part of the last check) and arrives.
#[test]
fn a_rolling_vehicle_goes_on_as_its_wheels_stand() {
    let goals = [(9.0, 2.0, 0.4), (-8.0, 1.0, 0.0), (0.3, 0.0, 0.0), (2.0, 6.0, 2.5)];
    let (mut changes, mut timed) = (0, 0);
    for (x, y, yaw) in goals {
        for (speed_mps, curvature) in [(0.3, 0.2), (1.2, -0.15), (-0.4, 0.1), (-0.9, -0.25)] {
            let problem = Problem {
                start_speed_mps: speed_mps,
                start_curvature: Some(curvature),
                goal: PlanarPose::new(x, y, yaw),
                ..crate::manoeuvre::problem(vec![])
            };
            let found = plan(&problem, &mut Unsupervised).unwrap();
            let first = found.trajectory.points[0];
            assert_eq!((first.curvature, first.speed_mps), (curvature, speed_mps), "{found:?}");
            timed += usize::from(found.stage == Stage::Timed);
            let checker = CollisionChecker::new(&problem).unwrap();
            assert_eq!(verify(&found.trajectory, &problem, &checker), Ok(found.measures));
            let away = Problem { start_curvature: Some(curvature + 0.01), ..problem };
            assert!(verify(&found.trajectory, &away, &checker).is_err(), "wheels that jump are seen");
            changes += found.measures.gear_changes;
        }
    }
    assert!(changes > 0, "some must turn back");
    // A fast one whose wheels must turn at once may have to stop for that.
    assert!(timed >= 14, "{timed} of 16");
}

#[test]
fn a_rolling_vehicle_that_cannot_stop_before_a_wall_is_not_planned_for() {
    let wall = vec![Point2::new(5.0, -3.0), Point2::new(5.0, 3.0)];
    let rolling = |start_speed_mps| {
        let goal = PlanarPose::new(-8.0, 0.0, 0.0);
        let problem = Problem { goal, start_speed_mps, ..crate::manoeuvre::problem(vec![wall.clone()]) };
        Problem { start_curvature: Some(0.0), ..problem }
    };
    // The front is 3.79 m ahead of the rear axle.
    assert!(plan(&rolling(0.5), &mut Unsupervised).is_ok());
    let error = plan(&rolling(1.5), &mut Unsupervised).unwrap_err();
    assert!(matches!(error, PlanError::BlockedAhead { speed_mps: 1.5, .. }), "{error}");
    let failure = Planner::new(OpenSpaceParameters::default()).provide(&rolling(1.5), false).unwrap_err();
    assert!(matches!(failure, PlanFailure::Search { .. }), "with less room it may be possible: {failure}");
}

#[test]
fn a_path_that_is_not_free_is_held_back() {
    let (mut problem, path) = easy();
    let middle = path.parts[1].poses[1];
    let (sin, cos) = middle.yaw.sin_cos();
    let post = Point2::new(middle.x + cos, middle.y + sin);
    problem.obstacles = vec![vec![post, Point2::new(post.x + 0.1, post.y)]];
    let error = refine(&problem, &path, &mut Unsupervised).unwrap_err();
    assert!(matches!(error, PlanError::Invalid(Violation::Collision { .. })), "{error}");
}

#[test]
fn impossible_numbers_are_refused_by_name() {
    type Change = fn(&mut Problem);
    let cases: [(&str, Change); 10] = [
        ("start.x", |p| p.start.x = f64::NAN),
        ("start.yaw", |p| p.start.yaw = f64::INFINITY),
        ("start.yaw", |p| p.start.yaw = 1_000.1),
        // So large that a turn more makes no difference: the search and the last check saw different directions.
        ("goal.yaw", |p| p.goal.yaw = -1e34),
        ("start.v", |p| p.start_speed_mps = f64::NAN),
        ("goal.y", |p| p.goal.y = f64::NEG_INFINITY),
        ("limits.max_speed_reverse", |p| p.limits.max_speed_reverse_mps = 0.0),
        ("limits.max_acceleration", |p| p.limits.max_acceleration_mps2 = -1.0),
        ("limits.max_jerk", |p| p.limits.max_jerk_mps3 = f64::NAN),
        ("limits.max_steer_rate", |p| p.limits.max_steer_rate_rps = f64::INFINITY),
    ];
    for (name, change) in cases {
        let (mut problem, _) = easy();
        assert!(check_input(&problem).is_ok());
        change(&mut problem);
        let error = check_input(&problem).unwrap_err();
        assert!(matches!(error, PlanError::Input { field, .. } if field == name), "{name}: {error}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// Whatever arcs the search may find, within limits of every kind: a plan that passes the last check.
    #[test]
    fn any_coarse_path_becomes_a_trajectory(
        forward in any::<bool>(), yaw in -7.0..7.0_f64, x in -30.0..30.0_f64,
        parts in prop::collection::vec(prop::collection::vec((-1.0..=1.0_f64, 0.002..3.0_f64), 1..5), 1..4),
        speed in 0.2..3.0_f64, acceleration in 0.2..2.0_f64, jerk in 0.3..4.0_f64, steer_rate in 0.1..1.0_f64,
        stop_after in prop::option::of(0..12_usize),
    ) {
        let full = full_lock();
        let parts: Vec<Vec<(f64, f64)>> =
            parts.iter().map(|arcs| arcs.iter().map(|(k, l)| (k * full, *l)).collect()).collect();
        let parts: Vec<&[(f64, f64)]> = parts.iter().map(Vec::as_slice).collect();
        let gear = if forward { Gear::Forward } else { Gear::Reverse };
        let (mut problem, path) = manoeuvre(gear, PlanarPose::new(x, FRAC_PI_2, yaw), &parts);
        problem.limits = Limits {
            max_speed_forward_mps: speed,
            max_speed_reverse_mps: 0.7 * speed,
            max_acceleration_mps2: acceleration,
            max_jerk_mps3: jerk,
            max_steer_rate_rps: steer_rate,
        };
        let answers = stop_after.unwrap_or(usize::MAX);
        let plan = refine(&problem, &path, &mut Watch::ending_after(answers));
        prop_assert!(plan.is_ok(), "{plan:?}");
        let plan = plan.unwrap();
        prop_assert_eq!(plan.measures.gear_changes, path.gear_changes());
        prop_assert!(plan.stage == Stage::Timed || stop_after.is_some());
    }
}
