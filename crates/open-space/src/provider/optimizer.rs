//! Makes a planning problem of a job and a trajectory in the map of its solution.
//!
//! The problem is planned in the region's frame, where coordinates are small.

use motion::{VehicleDimensions, VehicleInfo};

use super::planning::{Job, Outcome, PlanFailure, Region};
use crate::interruption::{Interruption, Watch};
use crate::pose::PlanarPose;
use crate::problem::{Limits, Problem};
use crate::stitcher::DiscretizedTrajectory;
use crate::trajectory::{Trajectory, TrajectoryPoint};

/// A start slower than this (m/s) is one at rest, whatever acceleration its point carries: neither the noise of a measured
/// speed is a motion nor a brake that holds the vehicle, and a path must be free to begin in the other gear.
const REST_SPEED_MPS: f64 = 0.05;

/// What a plan spares for a vehicle that does not keep to it to the centimetre, the most first; else nothing.
const SPARED: [Spared; 3] = [
    Spared { room_m: 0.05, steering: 0.05 },
    Spared { room_m: 0.05, steering: 0.0 },
    Spared { room_m: 0.025, steering: 0.0 },
];

/// A plan that takes over from another one in motion may begin with a curvature that the wheels reach within this time,
/// s: the interval of a plan's points.
const STEERED_IN_MOTION_S: f64 = 0.1;

/// Wheels that need no longer than this (s) need not turn.
const TURNED_S: f64 = 1e-3;

/// Interval of points while the wheels turn, s.
const TURNING_INTERVAL_S: f64 = 0.1;

/// Solves planning problems.
pub trait ProblemPlanner {
    /// A motion from the problem's start to its goal, in the problem's frame, times from 0. `watch` is asked often:
    /// once planning is cancelled the planner gives up, out of time it makes do with what it has.
    ///
    /// # Errors
    /// There is no such motion, or none was found.
    fn plan(&mut self, problem: &Problem, watch: &Watch) -> Result<Trajectory, PlanFailure>;
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
    pub fn plan(&mut self, job: &Job, watch: &Watch) -> Result<Outcome, PlanFailure> {
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
        let mut problem = Problem {
            vehicle: self.vehicle,
            limits: self.limits,
            bounds: region.bounds,
            obstacles: region.obstacles.clone(),
            start: region.to_region(at.pose),
            start_speed_mps: if moves { start.speed_mps } else { 0.0 },
            start_acceleration_mps2: if moves { start.acceleration_mps2 } else { 0.0 },
            start_curvature: Some(at.curvature),
            goal: region.goal,
        };
        let plan = if moves {
            problem.vehicle = SPARED[0].of(&self.vehicle);
            match self.planner.plan(&problem, watch) {
                // What it was to continue is better driven on than a plan that spares less.
                Err(PlanFailure::Search { .. } | PlanFailure::Smoothing { .. }) => {
                    return Ok(Outcome::Skipped);
                }
                planned => planned?,
            }
        } else {
            self.plan_with_room(&mut problem, watch)?
        };
        if watch() == Some(Interruption::Cancelled) {
            return Err(PlanFailure::Cancelled);
        }
        let turn_s = self.turning_time_s(at.curvature, &plan);
        if moves && turn_s > STEERED_IN_MOTION_S {
            // The same here.
            return Ok(Outcome::Skipped);
        }
        let plan = if moves { plan } else { after_turning(plan, at.curvature, turn_s, &self.vehicle) };
        in_map(region, plan).map(Outcome::Planned)
    }

    /// Plans for a vehicle that is larger than it is and steers less, so that one that strays from the plan can steer back
    /// and touches nothing before it has; with less to spare where there is not so much.
    fn plan_with_room(&mut self, problem: &mut Problem, watch: &Watch) -> Result<Trajectory, PlanFailure> {
        for spared in SPARED {
            problem.vehicle = spared.of(&self.vehicle);
            match self.planner.plan(problem, watch) {
                Err(PlanFailure::Search { .. }) => {}
                planned => return planned,
            }
        }
        problem.vehicle = self.vehicle;
        self.planner.plan(problem, watch)
    }

    /// How long the wheels take from the curvature at the start to the one that the plan begins with, s.
    fn turning_time_s(&self, curvature: f64, plan: &Trajectory) -> f64 {
        let steer = |curvature| self.vehicle.steering_angle_from_curvature(curvature);
        let first = plan.points.first().map_or(curvature, |point| point.curvature);
        (steer(first) - steer(curvature)).abs() / self.limits.max_steer_rate_rps
    }
}

/// What a plan does not make use of.
#[derive(Clone, Copy, Debug)]
struct Spared {
    /// Around the vehicle, m.
    room_m: f64,
    /// Part of the largest steering angle.
    steering: f64,
}

impl Spared {
    /// The vehicle with room around it, and less lock. Its wheels are where they are.
    fn of(&self, vehicle: &VehicleInfo) -> VehicleInfo {
        let (d, room_m) = (*vehicle.dimensions(), self.room_m);
        let spared = VehicleInfo::new(VehicleDimensions {
            front_overhang_m: d.front_overhang_m + room_m,
            rear_overhang_m: d.rear_overhang_m + room_m,
            left_overhang_m: d.left_overhang_m + room_m,
            right_overhang_m: d.right_overhang_m + room_m,
            max_steer_angle_rad: d.max_steer_angle_rad * (1.0 - self.steering),
            ..d
        });
        // Sane dimensions do not become insane by some centimetres.
        spared.unwrap_or(*vehicle)
    }
}

/// The plan after as long a stand as the wheels take to turn: it begins with whatever curvature its path has.
fn after_turning(mut plan: Trajectory, curvature: f64, turn_s: f64, vehicle: &VehicleInfo) -> Trajectory {
    let Some(&first) = plan.points.first().filter(|_| turn_s > TURNED_S) else { return plan };
    let (from, to) = (
        vehicle.steering_angle_from_curvature(curvature),
        vehicle.steering_angle_from_curvature(first.curvature),
    );
    let steps = (turn_s / TURNING_INTERVAL_S).ceil();
    let turning = |step: f64| {
        let steer_rad = from + (to - from) * step / steps;
        TrajectoryPoint {
            time_s: turn_s * step / steps,
            curvature: vehicle.curvature_from_steering_angle(steer_rad),
            steer_rad,
            speed_mps: 0.0,
            acceleration_mps2: 0.0,
            ..first
        }
    };
    for point in &mut plan.points {
        point.time_s += turn_s;
    }
    let mut points: Vec<TrajectoryPoint> = (0..steps as u32).map(|step| turning(f64::from(step))).collect();
    points.append(&mut plan.points);
    Trajectory { points }
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
    use crate::interruption::unwatched;
    use crate::pose::Gear;
    use crate::stitcher::{DiscretizedPoint, PathPoint};

    /// Answers with a straight line to the goal and keeps the problem.
    #[derive(Default)]
    struct Straight {
        asked: Option<Problem>,
    }

    impl ProblemPlanner for Straight {
        fn plan(&mut self, problem: &Problem, _: &Watch) -> Result<Trajectory, PlanFailure> {
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
            path_point: Some(PathPoint {
                pose: PlanarPose::new(100.0, 50.0, 2.0),
                curvature: 0.125,
                ..PathPoint::default()
            }),
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

    fn standing() -> Job {
        let mut job = job();
        job.stitching.points[0].speed_mps = 0.0;
        job
    }

    fn optimizer() -> Optimizer<Straight> {
        Optimizer::new(Straight::default(), VehicleInfo::default(), Limits::default(), 0.1)
    }

    #[test]
    fn the_problem_is_in_the_region_and_the_plan_in_the_map() {
        let mut optimizer = optimizer();
        let Outcome::Planned(plan) = optimizer.plan(&job(), &unwatched()).unwrap() else { panic!("skipped") };
        let problem = optimizer.planner.asked.unwrap();
        assert!(problem.start.distance_m(&PlanarPose::default()) < 1e-12);
        assert!((problem.start.yaw - (2.0 - FRAC_PI_2)).abs() < 1e-12);
        assert_eq!((problem.start_speed_mps, problem.start_acceleration_mps2), (0.5, -0.25));
        assert_eq!(problem.start_curvature, Some(0.125), "the wheels as they stand at the stitching point");
        let end = plan.points[1].path_point.unwrap();
        assert!(end.pose.distance_m(&PlanarPose::new(96.0, 53.0, 0.0)) < 1e-12);
        assert!((end.pose.yaw - (0.5 + FRAC_PI_2)).abs() < 1e-12);
        assert!((end.s_m - 5.0).abs() < 1e-12);
        assert_eq!((end.curvature, plan.points[1].steer_rad), (0.125, 0.25));
    }

    /// Finds a way for vehicles that are not too wide, and keeps how wide those were that it was asked for.
    struct Narrow {
        widest_m: f64,
        asked_m: Vec<f64>,
        asked_locks: Vec<f64>,
    }

    impl ProblemPlanner for Narrow {
        fn plan(&mut self, problem: &Problem, watch: &Watch) -> Result<Trajectory, PlanFailure> {
            let width_m = problem.vehicle.vehicle_width_m();
            self.asked_m.push(width_m);
            self.asked_locks.push(problem.vehicle.dimensions().max_steer_angle_rad);
            if width_m > self.widest_m {
                return Err(PlanFailure::Search { why: "too narrow".to_owned() });
            }
            Straight::default().plan(problem, watch)
        }
    }

    #[test]
    fn as_much_room_and_lock_is_spared_as_can_be_had() {
        let width_m = VehicleInfo::default().vehicle_width_m();
        for (to_spare_m, tries) in [(0.11, 1), (0.06, 3), (0.01, 4), (-0.01, 4)] {
            let planner =
                Narrow { widest_m: width_m + to_spare_m, asked_m: Vec::new(), asked_locks: Vec::new() };
            let mut optimizer = Optimizer::new(planner, VehicleInfo::default(), Limits::default(), 0.1);
            assert_eq!(optimizer.plan(&standing(), &unwatched()).is_ok(), to_spare_m > 0.0);
            let wanted: Vec<_> =
                [0.1, 0.1, 0.05, 0.0].iter().take(tries).map(|room| width_m + room).collect();
            let asked = &optimizer.planner.asked_m;
            assert_eq!(asked.len(), tries, "{to_spare_m} m");
            assert!(asked.iter().zip(&wanted).all(|(asked, wanted)| (asked - wanted).abs() < 1e-9));
            let locks = &optimizer.planner.asked_locks;
            let wanted = [0.95, 1.0, 1.0, 1.0]
                .map(|part| part * VehicleInfo::default().dimensions().max_steer_angle_rad);
            assert!(
                locks.iter().zip(&wanted).all(|(asked, wanted)| (asked - wanted).abs() < 1e-9),
                "{locks:?}"
            );
        }
    }

    #[test]
    fn in_motion_no_plan_takes_over_that_spares_less() {
        let width_m = VehicleInfo::default().vehicle_width_m();
        for (to_spare_m, taken) in [(0.11, true), (0.06, false)] {
            let planner =
                Narrow { widest_m: width_m + to_spare_m, asked_m: Vec::new(), asked_locks: Vec::new() };
            let mut optimizer = Optimizer::new(planner, VehicleInfo::default(), Limits::default(), 0.1);
            let outcome = optimizer.plan(&job(), &unwatched()).unwrap();
            assert_eq!((outcome != Outcome::Skipped, optimizer.planner.asked_m.len()), (taken, 1));
        }
    }

    #[test]
    fn a_vehicle_held_by_its_brake_starts_at_rest() {
        let mut held = job();
        (held.stitching.points[0].speed_mps, held.stitching.points[0].acceleration_mps2) = (0.0, -0.3);
        let mut optimizer = optimizer();
        optimizer.plan(&held, &unwatched()).unwrap();
        let problem = optimizer.planner.asked.unwrap();
        assert_eq!((problem.start_speed_mps, problem.start_acceleration_mps2), (0.0, 0.0));
    }

    #[test]
    fn a_start_slower_than_a_twentieth_of_a_metre_a_second_is_at_rest() {
        for (speed_mps, taken_mps) in [(0.049, 0.0), (-0.049, 0.0), (0.05, 0.05), (-0.05, -0.05)] {
            let mut slow = job();
            slow.stitching.points[0].speed_mps = speed_mps;
            let mut optimizer = optimizer();
            optimizer.plan(&slow, &unwatched()).unwrap();
            let problem = optimizer.planner.asked.unwrap();
            let taken = (problem.start_speed_mps, problem.start_acceleration_mps2);
            assert_eq!(taken, (taken_mps, if taken_mps == 0.0 { 0.0 } else { -0.25 }), "{speed_mps} m/s");
        }
    }

    #[test]
    fn a_start_at_the_goal_is_skipped_and_its_heading_does_not_count() {
        for (distance_m, skipped) in [(0.099, true), (0.1001, false)] {
            let mut job = job();
            let goal = job.region.goal_in_map();
            let at = job.stitching.points[0].path_point.as_mut().unwrap();
            at.pose = PlanarPose::new(goal.x + distance_m, goal.y, goal.yaw + 3.0);
            let outcome = optimizer().plan(&job, &unwatched()).unwrap();
            assert_eq!(outcome == Outcome::Skipped, skipped, "{distance_m} m");
        }
    }

    fn started(speed_mps: f64, curvature: f64) -> Outcome {
        let mut job = job();
        job.stitching.points[0].speed_mps = speed_mps;
        job.stitching.points[0].path_point.as_mut().unwrap().curvature = curvature;
        optimizer().plan(&job, &unwatched()).unwrap()
    }

    /// The plan begins with a curvature of 0.125 1/m.
    #[test]
    fn in_motion_no_plan_takes_over_that_would_jerk_the_wheels() {
        let vehicle = VehicleInfo::default();
        let (rate_rps, to) =
            (Limits::default().max_steer_rate_rps, vehicle.steering_angle_from_curvature(0.125));
        for (turn_s, taken) in [(0.0, true), (0.099, true), (0.101, false), (-0.101, false)] {
            let curvature = vehicle.curvature_from_steering_angle(to - rate_rps * turn_s);
            let outcome = started(0.5, curvature);
            assert_eq!(outcome != Outcome::Skipped, taken, "{turn_s} s");
        }
    }

    #[test]
    fn at_rest_a_plan_begins_when_the_wheels_have_turned() {
        let Outcome::Planned(plan) = started(0.0, -0.125) else { panic!("skipped") };
        let vehicle = VehicleInfo::default();
        let turn_s =
            2.0 * vehicle.steering_angle_from_curvature(0.125) / Limits::default().max_steer_rate_rps;
        let first = plan.points[0];
        assert_eq!((first.relative_time_s, first.speed_mps), (0.0, 0.0));
        assert!((first.path_point.unwrap().curvature + 0.125).abs() < 1e-12);
        let rate_rps = Limits::default().max_steer_rate_rps;
        let turning = plan.points.len() - 2;
        for pair in plan.points[..turning].windows(2) {
            let dt_s = pair[1].relative_time_s - pair[0].relative_time_s;
            assert!(
                dt_s <= 0.1 + 1e-12
                    && (pair[1].steer_rad - pair[0].steer_rad).abs() / dt_s <= rate_rps + 1e-9
            );
            assert_eq!(
                (pair[1].speed_mps, pair[1].path_point.unwrap().pose),
                (0.0, first.path_point.unwrap().pose)
            );
        }
        assert!((plan.points[turning].relative_time_s - turn_s).abs() < 1e-12);
        assert!((plan.points[turning + 1].relative_time_s - turn_s - 1.0).abs() < 1e-12);
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
        let failure = optimizer().plan(job, &unwatched()).unwrap_err();
        assert_eq!(failure.upstream_text(), "OpenSpaceTrajectoryOptimizer input data not ready");
        let PlanFailure::InputNotReady { field: found, .. } = failure else { panic!("{failure}") };
        assert_eq!(found, field);
    }

    #[test]
    fn a_plan_that_was_called_off_is_no_plan() {
        let cancelled: Watch = Arc::new(|| Some(Interruption::Cancelled));
        assert_eq!(optimizer().plan(&job(), &cancelled), Err(PlanFailure::Cancelled));
    }

    #[test]
    fn a_planner_that_breaks_its_word_is_refused() {
        struct Broken(Vec<f64>);
        impl ProblemPlanner for Broken {
            fn plan(&mut self, problem: &Problem, watch: &Watch) -> Result<Trajectory, PlanFailure> {
                let plan = Straight::default().plan(problem, watch)?;
                let points =
                    self.0.iter().map(|&time_s| TrajectoryPoint { time_s, ..plan.points[0] }).collect();
                Ok(Trajectory { points })
            }
        }
        for times in [vec![], vec![0.0], vec![0.0, 0.0], vec![0.0, 1.0, 0.5], vec![0.0, f64::NAN]] {
            let mut optimizer =
                Optimizer::new(Broken(times.clone()), VehicleInfo::default(), Limits::default(), 0.1);
            let failure = optimizer.plan(&job(), &unwatched()).unwrap_err();
            assert!(matches!(failure, PlanFailure::Refused { .. }), "{times:?}: {failure}");
        }
    }
}
