//! Makes a planning problem of a job and a trajectory in the map of its solution.
//!
//! The problem is planned in the region's frame, where coordinates are small.

use motion::VehicleInfo;

use super::planning::{Job, Outcome, PlanFailure, Region};
use crate::pose::PlanarPose;
use crate::problem::{Limits, Problem};
use crate::stitcher::DiscretizedTrajectory;
use crate::trajectory::Trajectory;

/// A start slower than this (m/s) is one at rest, whatever acceleration its point carries: a brake that holds the
/// vehicle is no motion.
const REST_SPEED_MPS: f64 = 1e-3;

/// Solves planning problems.
pub trait ProblemPlanner {
    /// A motion from the problem's start to its goal, in the problem's frame, times from 0. `cancelled` is asked
    /// often; once it says true the planner gives up.
    ///
    /// # Errors
    /// There is no such motion, or none was found.
    fn plan(&mut self, problem: &Problem, cancelled: &dyn Fn() -> bool) -> Result<Trajectory, PlanFailure>;
}

/// Turns jobs into plans.
#[derive(Debug)]
pub struct Optimizer<P> {
    planner: P,
    vehicle: VehicleInfo,
    limits: Limits,
    near_destination_m: f64,
}

impl<P: ProblemPlanner> Optimizer<P> {
    /// `near_destination_m`: a start closer to the goal than this is not planned from, m.
    pub fn new(planner: P, vehicle: VehicleInfo, limits: Limits, near_destination_m: f64) -> Self {
        Self { planner, vehicle, limits, near_destination_m }
    }

    /// Plans a job.
    ///
    /// # Errors
    /// The job is not fit to be planned, or the planner has no result.
    pub fn plan(&mut self, job: &Job, cancelled: &dyn Fn() -> bool) -> Result<Outcome, PlanFailure> {
        let region = &*job.region;
        check_region(region)?;
        let start =
            job.stitching.points.last().ok_or_else(|| not_ready("stitching_trajectory", "is empty"))?;
        let at = start.path_point.ok_or_else(|| not_ready("stitching_trajectory", "ends without a pose"))?;
        if !job.stitching.points.iter().all(crate::stitcher::DiscretizedPoint::is_finite) {
            return Err(not_ready("stitching_trajectory", "has a number that is not finite"));
        }
        if at.pose.distance_m(&region.goal_in_map()) < self.near_destination_m {
            return Ok(Outcome::Skipped);
        }
        let moves = start.speed_mps.abs() >= REST_SPEED_MPS;
        let problem = Problem {
            vehicle: self.vehicle,
            limits: self.limits,
            bounds: region.bounds,
            obstacles: region.obstacles.clone(),
            start: region.to_region(at.pose),
            start_speed_mps: if moves { start.speed_mps } else { 0.0 },
            start_acceleration_mps2: if moves { start.acceleration_mps2 } else { 0.0 },
            goal: region.goal,
        };
        let plan = self.planner.plan(&problem, cancelled)?;
        if cancelled() {
            return Err(PlanFailure::Cancelled);
        }
        in_map(region, plan).map(Outcome::Planned)
    }
}

fn in_map(region: &Region, mut plan: Trajectory) -> Result<DiscretizedTrajectory, PlanFailure> {
    for point in &mut plan.points {
        point.pose = region.to_map(point.pose);
    }
    let trajectory = DiscretizedTrajectory::from_plan(&plan);
    let refused = |why: &str| Err(PlanFailure::Refused { why: why.to_owned() });
    if trajectory.points.len() < 2 {
        return refused("it has fewer than two points");
    }
    if !trajectory.points.iter().all(crate::stitcher::DiscretizedPoint::is_finite) {
        return refused("it has a number that is not finite");
    }
    let increasing =
        trajectory.points.windows(2).all(|pair| pair[0].relative_time_s < pair[1].relative_time_s);
    if !increasing {
        return refused("its times do not increase");
    }
    Ok(trajectory)
}

fn not_ready(field: &'static str, fault: &'static str) -> PlanFailure {
    PlanFailure::InputNotReady { field, fault }
}

/// Upstream only looks for empty inputs; a number that is none would be planned with.
fn check_region(region: &Region) -> Result<(), PlanFailure> {
    const NOT_FINITE: &str = "has a number that is not finite";
    let frame = PlanarPose::new(region.origin.x, region.origin.y, region.heading_rad);
    if !frame.is_finite() {
        return Err(not_ready("origin", NOT_FINITE));
    }
    if !region.goal.is_finite() {
        return Err(not_ready("end_pose", NOT_FINITE));
    }
    let [x_min, x_max, y_min, y_max] = region.bounds;
    if !region.bounds.iter().all(|bound| bound.is_finite()) {
        return Err(not_ready("XYbounds", NOT_FINITE));
    }
    if x_min >= x_max || y_min >= y_max {
        return Err(not_ready("XYbounds", "are inverted"));
    }
    if !((x_min..=x_max).contains(&region.goal.x) && (y_min..=y_max).contains(&region.goal.y)) {
        return Err(not_ready("end_pose", "is outside XYbounds"));
    }
    if !region.obstacles.iter().flatten().all(|vertex| vertex.x.is_finite() && vertex.y.is_finite()) {
        return Err(not_ready("obstacles_vertices_vec", NOT_FINITE));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;
    use std::sync::Arc;

    use motion::Point2;

    use super::*;
    use crate::pose::Gear;
    use crate::stitcher::{DiscretizedPoint, PathPoint};
    use crate::trajectory::TrajectoryPoint;

    /// Answers with a straight line to the goal and keeps the problem.
    #[derive(Default)]
    struct Straight {
        asked: Option<Problem>,
    }

    impl ProblemPlanner for Straight {
        fn plan(&mut self, problem: &Problem, _: &dyn Fn() -> bool) -> Result<Trajectory, PlanFailure> {
            self.asked = Some(problem.clone());
            let point = |time_s: f64, pose| TrajectoryPoint {
                time_s,
                pose,
                curvature: 0.125,
                speed_mps: 1.0,
                acceleration_mps2: 0.0,
                steer_rad: 0.25,
                gear: Gear::Forward,
            };
            Ok(Trajectory { points: vec![point(0.0, problem.start), point(1.0, problem.goal)] })
        }
    }

    fn job() -> Job {
        let region = Region {
            origin: Point2::new(100.0, 50.0),
            heading_rad: FRAC_PI_2,
            goal: PlanarPose::new(3.0, 4.0, 0.5),
            bounds: [-10.0, 10.0, -10.0, 10.0],
            obstacles: vec![vec![Point2::new(0.0, 9.0), Point2::new(5.0, 9.0)]],
        };
        let start = DiscretizedPoint {
            path_point: Some(PathPoint { pose: PlanarPose::new(100.0, 50.0, 2.0), ..PathPoint::default() }),
            speed_mps: 0.5,
            acceleration_mps2: -0.25,
            relative_time_s: 0.1,
            ..DiscretizedPoint::default()
        };
        Job {
            stitching: DiscretizedTrajectory { points: vec![start] },
            region: Arc::new(region),
            submitted_s: 7.0,
        }
    }

    fn optimizer() -> Optimizer<Straight> {
        Optimizer::new(Straight::default(), VehicleInfo::default(), Limits::default(), 0.1)
    }

    #[test]
    fn the_problem_is_in_the_region_and_the_plan_in_the_map() {
        let mut optimizer = optimizer();
        let Outcome::Planned(plan) = optimizer.plan(&job(), &|| false).unwrap() else { panic!("skipped") };
        let problem = optimizer.planner.asked.unwrap();
        assert!(problem.start.distance_m(&PlanarPose::default()) < 1e-12);
        assert!((problem.start.yaw - (2.0 - FRAC_PI_2)).abs() < 1e-12);
        assert_eq!((problem.start_speed_mps, problem.start_acceleration_mps2), (0.5, -0.25));
        let end = plan.points[1].path_point.unwrap();
        assert!(end.pose.distance_m(&PlanarPose::new(96.0, 53.0, 0.0)) < 1e-12);
        assert!((end.pose.yaw - (0.5 + FRAC_PI_2)).abs() < 1e-12);
        assert!((end.s_m - 5.0).abs() < 1e-12);
        assert_eq!((end.curvature, plan.points[1].steer_rad), (0.125, 0.25));
    }

    #[test]
    fn a_vehicle_held_by_its_brake_starts_at_rest() {
        let mut held = job();
        (held.stitching.points[0].speed_mps, held.stitching.points[0].acceleration_mps2) = (0.0, -0.3);
        let mut optimizer = optimizer();
        optimizer.plan(&held, &|| false).unwrap();
        let problem = optimizer.planner.asked.unwrap();
        assert_eq!((problem.start_speed_mps, problem.start_acceleration_mps2), (0.0, 0.0));
    }

    #[test]
    fn a_start_at_the_goal_is_skipped_and_its_heading_does_not_count() {
        for (distance_m, skipped) in [(0.099, true), (0.1001, false)] {
            let mut job = job();
            let goal = job.region.goal_in_map();
            job.stitching.points[0].path_point = Some(PathPoint {
                pose: PlanarPose::new(goal.x + distance_m, goal.y, goal.yaw + 3.0),
                ..PathPoint::default()
            });
            let outcome = optimizer().plan(&job, &|| false).unwrap();
            assert_eq!(outcome == Outcome::Skipped, skipped, "{distance_m} m");
        }
    }

    #[test]
    fn jobs_that_cannot_be_planned_are_refused_by_field() {
        type Change = fn(&mut Region);
        let changes: [(&str, Change); 9] = [
            ("origin", |r| r.origin.x = f64::NAN),
            ("origin", |r| r.heading_rad = f64::INFINITY),
            ("end_pose", |r| r.goal.yaw = f64::NAN),
            ("end_pose", |r| r.goal.x = 10.1),
            ("end_pose", |r| r.goal.y = -10.1),
            ("XYbounds", |r| r.bounds[3] = f64::NAN),
            ("XYbounds", |r| r.bounds = [10.0, -10.0, -10.0, 10.0]),
            ("XYbounds", |r| r.bounds = [-10.0, 10.0, 4.0, 4.0]),
            ("obstacles_vertices_vec", |r| r.obstacles[0][1].y = f64::NAN),
        ];
        for (field, change) in changes {
            let mut job = job();
            change(Arc::make_mut(&mut job.region));
            assert_refused(&job, field);
        }
        let stitches: [fn(&mut DiscretizedTrajectory); 4] = [
            |t| t.points.clear(),
            |t| t.points[0].path_point = None,
            |t| t.points[0].speed_mps = f64::NAN,
            |t| t.points[0].relative_time_s = f64::INFINITY,
        ];
        for change in stitches {
            let mut job = job();
            change(&mut job.stitching);
            assert_refused(&job, "stitching_trajectory");
        }
    }

    fn assert_refused(job: &Job, field: &str) {
        let failure = optimizer().plan(job, &|| false).unwrap_err();
        assert_eq!(failure.upstream_text(), "OpenSpaceTrajectoryOptimizer input data not ready");
        let PlanFailure::InputNotReady { field: found, .. } = failure else { panic!("{failure}") };
        assert_eq!(found, field);
    }

    #[test]
    fn a_plan_that_was_called_off_is_no_plan() {
        assert_eq!(optimizer().plan(&job(), &|| true), Err(PlanFailure::Cancelled));
    }

    #[test]
    fn a_planner_that_breaks_its_word_is_refused() {
        struct Broken(Vec<f64>);
        impl ProblemPlanner for Broken {
            fn plan(
                &mut self,
                problem: &Problem,
                cancelled: &dyn Fn() -> bool,
            ) -> Result<Trajectory, PlanFailure> {
                let plan = Straight::default().plan(problem, cancelled)?;
                let points =
                    self.0.iter().map(|&time_s| TrajectoryPoint { time_s, ..plan.points[0] }).collect();
                Ok(Trajectory { points })
            }
        }
        for times in [vec![], vec![0.0], vec![0.0, 0.0], vec![0.0, 1.0, 0.5], vec![0.0, f64::NAN]] {
            let mut optimizer =
                Optimizer::new(Broken(times.clone()), VehicleInfo::default(), Limits::default(), 0.1);
            let failure = optimizer.plan(&job(), &|| false).unwrap_err();
            assert!(matches!(failure, PlanFailure::Refused { .. }), "{times:?}: {failure}");
        }
    }
}
