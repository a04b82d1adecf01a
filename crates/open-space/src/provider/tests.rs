//! The provider, cause by cause and case by case, over a worker that does what the test says.

mod cycles;
mod loading;
mod planning_period;
mod stopping;
mod synchronous;

use std::sync::{Arc, Mutex};

use motion::Point2;

use super::*;
use crate::pose::{Gear, PlanarPose};

/// What a fake worker was told, and what it shall answer.
#[derive(Clone, Debug, Default)]
struct Desk {
    starts: usize,
    stops: usize,
    stop_requests: usize,
    refuse_start: bool,
    jobs: Vec<Job>,
    planned: Option<Planned>,
    failure: Option<PlanFailure>,
    skips: u64,
}

/// A worker whose results lie on a desk that the test can reach.
#[derive(Clone, Debug, Default)]
struct FakeWorker(Arc<Mutex<Desk>>);

impl FakeWorker {
    /// A look at the desk.
    fn desk(&self) -> Desk {
        self.0.lock().unwrap().clone()
    }

    fn desk_mut(&self) -> std::sync::MutexGuard<'_, Desk> {
        self.0.lock().unwrap()
    }

    /// A finished plan of `metres` straight ahead for the newest job.
    fn finish(&self, metres: i32) {
        let mut desk = self.desk_mut();
        let job = desk.jobs.last().unwrap().clone();
        desk.planned = Some(Planned {
            optimized: straight(metres),
            stitching: job.stitching,
            submitted_s: job.submitted_s,
            latency_ms: 12.5,
        });
    }

    fn fail(&self) {
        self.desk_mut().failure = Some(search_failure());
    }
}

impl PlanningWorker for FakeWorker {
    fn start(&mut self) -> Result<(), WorkerNotStarted> {
        let mut desk = self.desk_mut();
        if desk.refuse_start {
            return Err(WorkerNotStarted { why: "no threads left".to_owned() });
        }
        desk.starts += 1;
        Ok(())
    }

    fn submit(&mut self, job: Job) {
        self.desk_mut().jobs.push(job);
    }

    fn take_planned(&mut self) -> Option<Planned> {
        self.desk_mut().planned.take()
    }

    fn take_failure(&mut self) -> Option<PlanFailure> {
        self.desk_mut().failure.take()
    }

    fn state(&self) -> WorkerState {
        let desk = self.desk();
        WorkerState {
            data_ready: !desk.jobs.is_empty(),
            trajectory_updated: desk.planned.is_some(),
            trajectory_skipped: desk.skips > 0,
            trajectory_error: desk.failure.is_some(),
            skips: desk.skips,
        }
    }

    fn request_stop(&mut self) {
        self.desk_mut().stop_requests += 1;
    }

    fn stop(&mut self) {
        let mut desk = self.desk_mut();
        desk.stops += 1;
        (desk.planned, desk.failure, desk.skips) = (None, None, 0);
        desk.jobs.clear();
    }
}

fn search_failure() -> PlanFailure {
    PlanFailure::Search { why: "the open set ran out".to_owned() }
}

/// From the origin along x, a point every tenth of a metre and of a second.
fn straight(metres: i32) -> DiscretizedTrajectory {
    let point = |i: i32| {
        let t = f64::from(i) * 0.1;
        DiscretizedPoint {
            path_point: Some(PathPoint {
                pose: PlanarPose::new(t, 0.0, 0.0),
                s_m: t,
                ..PathPoint::default()
            }),
            speed_mps: 1.0,
            relative_time_s: t,
            ..DiscretizedPoint::default()
        }
    };
    DiscretizedTrajectory { points: (0..=metres * 10).map(point).collect() }
}

fn vehicle_at(x: f64, y: f64, yaw: f64) -> VehicleState {
    VehicleState::standing_at(PlanarPose::new(x, y, yaw))
}

/// A region whose frame is the map's, its goal 20 m along x.
fn region() -> Arc<Region> {
    Arc::new(Region {
        origin: Point2::origin(),
        heading_rad: 0.0,
        goal: PlanarPose::new(20.0, 0.0, 0.0),
        bounds: [-50.0, 50.0, -50.0, 50.0],
        obstacles: Vec::new(),
    })
}

fn frame<'a>(now_s: f64, region: &'a Arc<Region>, previous: Option<&'a PreviousFrame>) -> Frame<'a> {
    Frame { now_s, vehicle: vehicle_at(0.0, 0.0, 0.0), region, in_check_stage: false, previous }
}

fn provider(parameters: ProviderParameters) -> (Provider, FakeWorker) {
    let worker = FakeWorker::default();
    let provider = Provider::new(parameters, Execution::Threaded(Box::new(worker.clone()))).unwrap();
    (provider, worker)
}

/// What a cycle leaves behind if nothing is re-timed and no obstacle is in the way.
fn left_by(provision: &Provision) -> PreviousFrame {
    PreviousFrame {
        stitched: PublishedTrajectory {
            trajectory: provision.trajectory.clone(),
            header_time_s: provision.header_time_s,
        },
        fallback: false,
        provider_success: provision.success(),
    }
}

fn assert_stop(provision: &Provision, status: &Status) {
    assert_eq!(&provision.status, status);
    assert_eq!(provision.source, Source::Stop);
    assert!(!provision.success());
    assert_eq!(provision.trajectory.points.len(), 10);
}
