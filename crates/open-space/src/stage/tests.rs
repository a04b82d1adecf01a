//! The stage over a worker that plans its first job, four metres straight ahead, and then nothing until it is told to.

use std::sync::Mutex;

use motion::Point2;

use super::*;
use crate::pose::PlanarPose;
use crate::provider::{
    Execution, Job, PlanFailure, Planned, PlanningWorker, ProviderParameters, Status, WorkerNotStarted,
    WorkerState,
};
use crate::stitcher::{DiscretizedPoint, PathPoint};

#[derive(Debug)]
struct Script {
    plans_left: u32,
    jobs: Vec<Job>,
}

#[derive(Clone, Debug)]
struct ScriptedWorker(Arc<Mutex<Script>>);

impl PlanningWorker for ScriptedWorker {
    fn start(&mut self) -> Result<(), WorkerNotStarted> {
        Ok(())
    }

    fn submit(&mut self, job: Job) {
        self.0.lock().unwrap().jobs.push(job);
    }

    fn take_planned(&mut self) -> Option<Planned> {
        let mut script = self.0.lock().unwrap();
        script.plans_left = script.plans_left.checked_sub(1)?;
        let Job { stitching, submitted_s, .. } = script.jobs.last()?.clone();
        let start = stitching.points.last()?.path_point?.pose;
        let point = |i: i32| {
            let t = f64::from(i) * 0.1;
            DiscretizedPoint {
                path_point: Some(PathPoint {
                    pose: PlanarPose::new(start.x + t, start.y, 0.0),
                    s_m: t,
                    ..PathPoint::default()
                }),
                speed_mps: if i == 40 { 0.0 } else { 1.0 },
                relative_time_s: t,
                ..DiscretizedPoint::default()
            }
        };
        let optimized = DiscretizedTrajectory { points: (0..=40).map(point).collect() };
        Some(Planned { optimized, stitching, submitted_s, latency_ms: 1.0 })
    }

    fn take_failure(&mut self) -> Option<PlanFailure> {
        None
    }

    fn state(&self) -> WorkerState {
        WorkerState::default()
    }

    fn request_stop(&mut self) {}

    fn stop(&mut self) {}
}

fn stage(plans: u32) -> (ParkingStage, ScriptedWorker) {
    let worker = ScriptedWorker(Arc::new(Mutex::new(Script { plans_left: plans, jobs: Vec::new() })));
    let execution = Execution::Threaded(Box::new(worker.clone()));
    let provider = Provider::new(ProviderParameters::default(), execution).unwrap();
    let stage = ParkingStage::new(
        provider,
        PartitionParameters::default(),
        FallbackParameters::default(),
        VehicleInfo::default(),
    );
    (stage, worker)
}

fn at(x: f64, y: f64, speed_mps: f64) -> VehicleState {
    VehicleState { speed_mps, ..VehicleState::standing_at(PlanarPose::new(x, y, 0.0)) }
}

fn region() -> Arc<Region> {
    Arc::new(Region {
        origin: Point2::origin(),
        heading_rad: 0.0,
        goal: PlanarPose::new(20.0, 0.0, 0.0),
        bounds: [-50.0, 50.0, -50.0, 50.0],
        obstacles: Vec::new(),
    })
}

fn step(stage: &mut ParkingStage, now_s: f64, vehicle: VehicleState, blocked: bool) -> StageOutput {
    let obstacle =
        PredictedObstacle { length_m: 1.0, width_m: 1.0, path: vec![(0.0, PlanarPose::new(7.0, 0.0, 0.0))] };
    let obstacles = if blocked { vec![obstacle] } else { Vec::new() };
    let region = region();
    let input = StageInput { now_s, vehicle, region: &region, in_check_stage: false, obstacles: &obstacles };
    stage.step(&input)
}

fn first_pose(command: &Command) -> PlanarPose {
    let Command::Follow(part) = command else { panic!("{command:?}") };
    part.trajectory.evaluate(0.0).unwrap().path_point.unwrap().pose
}

#[test]
fn the_vehicle_stands_until_there_is_a_plan_and_follows_it_from_where_it_is() {
    let (mut stage, worker) = stage(0);
    let waiting = step(&mut stage, 0.0, at(0.0, 0.0, 0.0), false);
    let Command::Stop(Some(stop)) = &waiting.command else { panic!("{:?}", waiting.command) };
    assert_eq!(stop.points.len(), 10);
    worker.0.lock().unwrap().plans_left = 1;
    let first = step(&mut stage, 0.1, at(0.0, 0.0, 0.0), false);
    assert_eq!(
        (first.provision.status.clone(), first_pose(&first.command)),
        (Status::Done, PlanarPose::default())
    );
    // Ten centimetres a cycle, reused: time 0 is always where the vehicle is.
    for (now_s, x) in [(0.2, 0.1), (0.3, 0.2), (0.4, 0.3), (0.9, 0.8)] {
        let output = step(&mut stage, now_s, at(x, 0.0, 1.0), false);
        assert_eq!(output.provision.status, Status::Waiting);
        assert!((first_pose(&output.command).x - x).abs() < 1e-9, "{:?}", first_pose(&output.command));
    }
    // A vehicle that falls behind gets the plan from where it is, not from where it should be.
    let late = step(&mut stage, 2.5, at(1.0, 0.0, 0.5), false);
    assert!((first_pose(&late.command).x - 1.0).abs() < 1e-9);
}

#[test]
fn brakes_for_an_obstacle_and_plans_anew_from_where_it_has_stopped() {
    let (mut stage, worker) = stage(1);
    step(&mut stage, 0.0, at(0.0, 0.0, 0.0), false);
    let braking = step(&mut stage, 0.5, at(0.4, 0.0, 1.0), true);
    let Command::Brake { trajectory, collision, gear } = &braking.command else {
        panic!("{:?}", braking.command)
    };
    assert_eq!((*gear, collision.obstacle), (Gear::Forward, 0));
    assert_eq!(trajectory.points.last().unwrap().speed_mps, 0.0);
    // It still rolls: not yet.
    assert!(!step(&mut stage, 0.6, at(0.5, 0.0, 0.9), true).provision.restarted);
    let standing = step(&mut stage, 1.5, at(1.0, 0.05, 0.0), true);
    assert!(standing.provision.restarted);
    let start = worker.0.lock().unwrap().jobs.last().unwrap().stitching.clone();
    assert_eq!(start.points.len(), 1);
    assert_eq!(start.points[0].path_point.unwrap().pose, PlanarPose::new(1.0, 0.05, 0.0));
    // Until the new plan comes in the old one is still followed from where the vehicle is, not from its beginning.
    let free = step(&mut stage, 1.6, at(1.0, 0.05, 0.0), false);
    assert!((first_pose(&free.command).x - 1.0).abs() < 0.11);
    worker.0.lock().unwrap().plans_left = 1;
    step(&mut stage, 1.7, at(1.0, 0.05, 0.0), true);
    let anew = step(&mut stage, 1.8, at(1.0, 0.05, 0.0), false);
    assert!((first_pose(&anew.command).x - 1.0).abs() < 0.11);
}

#[test]
fn a_vehicle_that_has_left_its_plan_is_stopped() {
    let (mut stage, _) = stage(1);
    step(&mut stage, 0.0, at(0.0, 0.0, 0.0), false);
    let lost = step(&mut stage, 0.5, at(0.0, 3.0, 0.5), false);
    assert!(matches!(lost.command, Command::Stop(Some(_))), "{:?}", lost.command);
    assert_eq!(lost.lost, Some(PartitionError::NothingNear { range_m: 2.0 }));
    // The plan is given up, not resumed.
    let after = step(&mut stage, 0.6, at(0.0, 0.0, 0.5), false);
    assert_eq!(after.provision.status, Status::StopUnfinished);
}

#[test]
fn at_the_end_of_the_plan_the_vehicle_stands() {
    let (mut stage, _) = stage(1);
    step(&mut stage, 0.0, at(0.0, 0.0, 0.0), false);
    step(&mut stage, 0.1, at(3.0, 0.0, 1.0), false);
    for now_s in [9.0, 9.1] {
        let end = step(&mut stage, now_s, at(3.95, 0.0, 0.05), false);
        assert!(matches!(end.command, Command::Stop(Some(_))), "{:?}", end.command);
        assert_eq!((end.provision.status, end.lost), (Status::Waiting, None));
    }
}

/// The goal is 20 m away, the plan ends after 4 m: whoever stands there has not arrived.
#[test]
fn where_a_plan_has_ended_short_of_the_goal_planning_begins_anew() {
    let (mut stage, worker) = stage(1);
    step(&mut stage, 0.0, at(0.0, 0.0, 0.0), false);
    step(&mut stage, 0.1, at(3.0, 0.0, 1.0), false);
    step(&mut stage, 9.0, at(3.95, 0.0, 0.0), false);
    assert!(step(&mut stage, 9.1, at(3.95, 0.0, 0.0), false).provision.restarted);
    assert_eq!(worker.0.lock().unwrap().jobs.last().unwrap().stitching.points.len(), 1);
    worker.0.lock().unwrap().plans_left = 1;
    let Command::Follow(part) = step(&mut stage, 9.2, at(3.95, 0.0, 0.0), false).command else { panic!() };
    assert_eq!(part.trajectory.points[0].path_point.unwrap().pose.x, 3.95);
}

#[test]
fn without_a_place_there_is_not_even_a_stop() {
    let (mut stage, _) = stage(1);
    let output = step(&mut stage, 0.0, at(f64::NAN, 0.0, 0.0), false);
    assert_eq!(output.command, Command::Stop(None));
}

#[test]
fn a_restart_forgets_the_plan() {
    let (mut stage, worker) = stage(1);
    step(&mut stage, 0.0, at(0.0, 0.0, 0.0), false);
    assert!(matches!(step(&mut stage, 0.1, at(0.1, 0.0, 1.0), false).command, Command::Follow(_)));
    stage.restart();
    let output = step(&mut stage, 0.2, at(0.1, 0.0, 0.0), false);
    assert_eq!(output.provision.status, Status::StopUnfinished);
    worker.0.lock().unwrap().plans_left = 1;
    assert_eq!(step(&mut stage, 0.3, at(0.1, 0.0, 0.0), false).provision.status, Status::Done);
    stage.stop();
    assert_eq!(step(&mut stage, 0.4, at(0.1, 0.0, 0.0), false).provision.status, Status::ParkingFinished);
}
