//! Parking scenes from start to rest at the goal: solved, free of collisions, within limits, short, and the same every
//! time. Plans are judged by code that shares nothing with the planner's own checks.
#![allow(clippy::unwrap_used, clippy::panic, reason = "tests fail by panicking")]

#[path = "support/judge.rs"]
mod judge;
#[path = "support/scenes.rs"]
mod scenes;

use motion::Point2;
use open_space::planner::{OpenSpaceParameters, Plan, PlanError, Planner, Stage, Unsupervised};
use open_space::scenes::{SceneKind, scene, suite};
use open_space::{Problem, SearchError};
use scenes::scenes;

/// Unoptimised builds leave the searches that take longest to the optimised ones and to the benchmark.
const NODES: u32 = if cfg!(debug_assertions) { 10_000 } else { 150_000 };

fn plan(problem: &Problem, nodes: u32) -> Result<Plan, PlanError> {
    let mut parameters = OpenSpaceParameters::default();
    parameters.search.max_expansions = nodes;
    Planner::new(parameters).plan(problem, &mut Unsupervised)
}

/// Plans and judges; none where the budget of unoptimised builds was used up.
fn judged(name: &str, problem: &Problem) -> Option<Plan> {
    let plan = match plan(problem, NODES) {
        Ok(plan) => plan,
        Err(PlanError::Search(SearchError::OutOfExpansions { .. })) if cfg!(debug_assertions) => return None,
        Err(error) => panic!("{name}: {error}"),
    };
    assert_eq!((plan.stage, plan.held_back), (Stage::Timed, None), "{name}");
    let faults = judge::faults(&plan.trajectory, problem);
    assert!(faults.is_empty(), "{name}: {}", faults.join("\n"));
    Some(plan)
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

#[test]
fn every_scene_that_can_be_solved_is_solved_and_no_detour() {
    let (mut planned, mut ratios, mut changes, mut fewest_changes) = (0, Vec::new(), 0.0, 0.0);
    let scenes = scenes();
    for scene in scenes.iter().filter(|scene| scene.best.is_some()) {
        let best = scene.best.as_ref().unwrap();
        if let Some(plan) = judged(&scene.name, &scene.problem) {
            planned += 1;
            ratios.push(plan.measures.length_m / best.length_m());
            changes += plan.measures.gear_changes as f64;
            fewest_changes += scene.fewest_gear_changes.unwrap() as f64;
        }
    }
    if scenes.is_empty() {
        return;
    }
    assert!(planned >= if cfg!(debug_assertions) { 54 } else { 59 }, "{planned}");
    let ratio = median(ratios);
    assert!(ratio <= 1.15, "{ratio}");
    assert!(changes <= 1.5 * fewest_changes, "{changes} changes of gear instead of {fewest_changes}");
}

#[test]
fn generated_scenes_are_solved() {
    let planned = suite(11, 3).filter(|scene| judged(&scene.name, &scene.problem).is_some()).count();
    assert!(planned >= if cfg!(debug_assertions) { 25 } else { 27 }, "{planned}");
}

#[test]
fn the_same_input_and_budget_give_the_same_plan_bit_for_bit() {
    let problems: Vec<Problem> =
        [SceneKind::Parallel, SceneKind::DeadEnd, SceneKind::Clutter, SceneKind::PerpendicularForward]
            .map(|kind| scene(kind, 0.5, 4, 1).problem)
            .into();
    let plans = || problems.iter().map(|problem| plan(problem, 8_000)).collect::<Vec<_>>();
    // On another thread, too: nothing depends on where or when it runs.
    let (here, there) = std::thread::scope(|scope| {
        let there = scope.spawn(plans);
        (plans(), there.join().unwrap())
    });
    assert!(here.iter().any(Result::is_ok));
    for (here, there) in here.iter().zip(&there) {
        assert_eq!(format!("{here:?}"), format!("{there:?}"), "down to the last digit and the sign of zero");
    }
    // A budget that is too small is an error at the same node.
    let tight = &scene(SceneKind::UTurn, 0.9, 5, 0).problem;
    let few: Vec<_> = (0..2).map(|_| plan(tight, 500)).collect();
    assert_eq!(few[0], few[1]);
    assert_eq!(few[0], Err(PlanError::Search(SearchError::OutOfExpansions { expansions: 500 })));
}

/// What is judged good must not be good because nobody looks.
#[test]
fn the_judge_sees_what_is_wrong() {
    let problem = scene(SceneKind::Parallel, 0.2, 4, 1).problem;
    let good = plan(&problem, NODES).unwrap().trajectory;
    assert_eq!(judge::faults(&good, &problem), Vec::<String>::new());
    let middle = good.points[good.points.len() / 2].pose;
    let post = Point2::new(middle.x + 0.1, middle.y);
    let around = |r: f64| {
        let corners = [(-r, -r), (r, -r), (r, r), (-r, r), (-r, -r)];
        corners.iter().map(|(x, y)| Point2::new(post.x + x, post.y + y)).collect::<Vec<_>>()
    };
    for obstacle in [vec![post], vec![post, Point2::new(post.x, post.y + 0.01)], around(0.01), around(400.0)]
    {
        let mut blocked = problem.clone();
        blocked.obstacles = vec![obstacle];
        assert!(judge::faults(&good, &blocked).iter().any(|fault| fault.contains("touches")));
    }
    type Change = fn(&mut open_space::Trajectory, &mut Problem);
    let changes: [(&str, Change); 9] = [
        ("starts", |_, p| p.start.x += 0.01),
        ("ends", |_, p| p.goal.y -= 0.06),
        ("ends", |_, p| p.goal.yaw += 0.02),
        ("rest", |t, _| t.points.last_mut().unwrap().speed_mps = 0.01),
        ("m/s at", |_, p| p.limits.max_speed_reverse_mps = 0.1),
        ("m/s²", |_, p| p.limits.max_acceleration_mps2 = 0.1),
        ("m/s³", |_, p| p.limits.max_jerk_mps3 = 0.1),
        ("rad/s", |_, p| p.limits.max_steer_rate_rps = 0.01),
        ("instead of", |t, _| t.points.iter_mut().for_each(|point| point.speed_mps *= 0.5)),
    ];
    for (words, change) in changes {
        let (mut trajectory, mut problem) = (good.clone(), problem.clone());
        change(&mut trajectory, &mut problem);
        let faults = judge::faults(&trajectory, &problem);
        assert!(faults.iter().any(|fault| fault.contains(words)), "{words}: {faults:?}");
    }
}

#[test]
fn lengths_are_those_of_the_points() {
    let problem = scene(SceneKind::PullOut, 0.4, 4, 1).problem;
    let plan = plan(&problem, NODES).unwrap();
    let length_m: f64 = plan
        .trajectory
        .points
        .windows(2)
        .map(|pair| (pair[1].pose.x - pair[0].pose.x).hypot(pair[1].pose.y - pair[0].pose.y))
        .sum();
    assert!((plan.measures.length_m - length_m).abs() < 1e-9);
    assert!(plan.coarse_length_m > 0.9 * length_m);
}
