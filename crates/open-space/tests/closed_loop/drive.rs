//! The loop: vehicle, stage and planning in virtual time.

use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

use motion::Point2;
use open_space::fallback::{FallbackParameters, PredictedObstacle};
use open_space::partition::PartitionParameters;
use open_space::provider::{
    Execution, Job, Optimizer, Outcome as Planning, PlanFailure, Planned, PlanningWorker, ProblemPlanner,
    Provider, ProviderParameters, Region, WorkerNotStarted, WorkerState,
};
use open_space::stage::{Command, ParkingStage, StageInput};
use open_space::{CollisionChecker, PlanarPose, Problem, unwatched};

use crate::random::Random;
use crate::vehicle::{Controller, Imperfection, TICK_S, Vehicle};

/// Ticks from cycle to cycle: ten cycles a second.
const CYCLE_TICKS: u32 = 10;

/// Longest drive, s.
const PATIENCE_S: f64 = 240.0;

/// What the region's frame is in the map: anything but the identity.
const ORIGIN: Point2 = Point2::new(1234.5, -987.6);
const HEADING_RAD: f64 = 2.2;

/// Width of who stands in the way, m.
const PERSON_M: f64 = 0.6;

/// How to drive a scene.
#[derive(Clone, Debug)]
pub(crate) struct Setting {
    pub imperfection: Imperfection,
    pub provider: ProviderParameters,
    pub seed: u64,
    /// How far the start is displaced at random, m.
    pub start_noise_m: f64,
    /// Until when somebody stands in the way, s; the place is on the first part that is followed.
    pub blocked_until_s: f64,
}

/// How a drive ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Ending {
    Parked,
    Collision,
    TimeOut,
}

/// A drive in numbers.
#[derive(Clone, Debug)]
pub(crate) struct Outcome {
    pub ending: Ending,
    pub seconds: f64,
    pub plans: u32,
    pub skips: u32,
    pub failures: u32,
    pub lost: u32,
    pub brakes: u32,
    pub goal_error_m: f64,
    pub goal_error_rad: f64,
    pub min_clearance_m: f64,
    pub max_off_track_m: f64,
    pub last_failure: Option<String>,
    pub at: PlanarPose,
}

/// A drive in progress.
pub(crate) struct Drive {
    stage: ParkingStage,
    region: Arc<Region>,
    checker: CollisionChecker,
    vehicle: Vehicle,
    controller: Controller,
    random: Random,
    counts: Arc<Counts>,
    blocked_until_s: f64,
    in_the_way: Option<PlanarPose>,
    outcome: Outcome,
}

#[derive(Debug, Default)]
struct Counts {
    plans: AtomicU32,
    skips: AtomicU32,
}

impl Drive {
    pub(crate) fn new(
        problem: &Problem,
        planner: impl ProblemPlanner + Send + 'static,
        setting: Setting,
    ) -> Self {
        let mut random = Random::new(setting.seed);
        let region = Arc::new(Region {
            origin: ORIGIN,
            heading_rad: HEADING_RAD,
            goal: problem.goal,
            bounds: problem.bounds,
            obstacles: problem.obstacles.clone(),
        });
        let counts = Arc::new(Counts::default());
        let worker = VirtualWorker {
            optimizer: Optimizer::new(planner, problem.vehicle, problem.limits, 0.1),
            random: Random::new(setting.seed ^ 0xfeed),
            waiting: None,
            running: None,
            planned: None,
            failure: None,
            counts: counts.clone(),
        };
        let execution = Execution::Threaded(Box::new(worker));
        let provider = Provider::new(setting.provider, execution).expect("parameters in range");
        let stage = ParkingStage::new(
            provider,
            PartitionParameters::default(),
            FallbackParameters::default(),
            problem.vehicle,
        );
        let noise = setting.start_noise_m;
        let start = PlanarPose::new(
            problem.start.x + random.between(-noise, noise),
            problem.start.y + random.between(-noise, noise),
            problem.start.yaw + 0.1 * random.between(-noise, noise),
        );
        let preview_s = 0.12 + 0.01 * setting.imperfection.delay_ticks as f64;
        Self {
            stage,
            checker: CollisionChecker::new(problem).expect("a sane scene"),
            vehicle: Vehicle::standing(problem.vehicle, region.to_map(start), setting.imperfection),
            controller: Controller::new(problem.vehicle, preview_s),
            random,
            counts,
            blocked_until_s: setting.blocked_until_s,
            in_the_way: None,
            outcome: Outcome {
                ending: Ending::TimeOut,
                seconds: 0.0,
                plans: 0,
                skips: 0,
                failures: 0,
                lost: 0,
                brakes: 0,
                goal_error_m: f64::INFINITY,
                goal_error_rad: f64::INFINITY,
                min_clearance_m: f64::INFINITY,
                max_off_track_m: 0.0,
                last_failure: None,
                at: start,
            },
            region,
        }
    }

    /// Drives until the vehicle is parked, has hit something, or patience ends.
    pub(crate) fn run(mut self) -> Outcome {
        let (mut tick, mut stood_s, mut arrived) = (0_u32, 0.0, false);
        let trace = std::env::var_os("TRACE").is_some();
        loop {
            let now_s = f64::from(tick) * TICK_S;
            self.outcome.seconds = now_s;
            if tick.is_multiple_of(CYCLE_TICKS) {
                arrived |= self.cycle(now_s, trace);
            }
            let state = self.vehicle.measured(&mut self.random);
            let (speed_mps, steer_rad, gear) = self.controller.control(now_s, &state);
            self.vehicle.advance(speed_mps, steer_rad, gear);
            let pose = self.region.to_region(self.vehicle.pose);
            if !self.checker.is_free(&pose, 0.0) {
                return self.end(Ending::Collision);
            }
            if tick.is_multiple_of(CYCLE_TICKS) {
                let clearance_m = self.checker.clearance_m(&pose);
                self.outcome.min_clearance_m = self.outcome.min_clearance_m.min(clearance_m);
            }
            stood_s = if self.vehicle.speed_mps.abs() < 0.005 { stood_s + TICK_S } else { 0.0 };
            if arrived && stood_s > 1.0 {
                return self.end(Ending::Parked);
            }
            if now_s > PATIENCE_S {
                return self.end(Ending::TimeOut);
            }
            tick += 1;
        }
    }

    fn cycle(&mut self, now_s: f64, trace: bool) -> bool {
        let state = self.vehicle.measured(&mut self.random);
        let standing =
            |pose| PredictedObstacle { length_m: PERSON_M, width_m: PERSON_M, path: vec![(0.0, pose)] };
        let obstacles: Vec<_> =
            self.in_the_way.filter(|_| now_s < self.blocked_until_s).map(standing).into_iter().collect();
        let output = self.stage.step(&StageInput {
            now_s,
            vehicle: state,
            region: &self.region,
            in_check_stage: false,
            obstacles: &obstacles,
        });
        if trace {
            let command = match &output.command {
                Command::Stop(_) => "stop".to_owned(),
                Command::Follow(part) => {
                    format!("follow {:?} of {} points", part.gear, part.trajectory.points.len())
                }
                Command::Brake { .. } => "brake".to_owned(),
            };
            eprintln!(
                "{now_s:6.1} {:?} v {:6.3} {:?} off {:6.3} | {} | {:?} {command} {:?}",
                self.region.to_region(self.vehicle.pose),
                self.vehicle.speed_mps,
                self.vehicle.gear,
                self.off_track_m(&output.command).unwrap_or_default(),
                output.provision.status.message(),
                output.provision.source,
                output.lost,
            );
        }
        if let Some(left_m) = self.off_track_m(&output.command) {
            self.outcome.max_off_track_m = self.outcome.max_off_track_m.max(left_m.abs());
        }
        if let Command::Follow(part) = &output.command
            && self.in_the_way.is_none()
        {
            let place = part.trajectory.points.len() * 2 / 3;
            self.in_the_way = part.trajectory.points[place].path_point.map(|point| point.pose);
        }
        self.outcome.brakes += u32::from(matches!(output.command, Command::Brake { .. }));
        self.outcome.lost += u32::from(output.lost.is_some());
        if let Some(failure) = &output.provision.failure {
            self.outcome.failures += 1;
            self.outcome.last_failure = Some(failure.to_string());
        }
        self.controller.take(now_s, &output.command);
        output.provision.destination_reached
    }

    /// How far to the left of the part that it follows the vehicle is, m.
    fn off_track_m(&self, command: &Command) -> Option<f64> {
        let Command::Follow(part) = command else { return None };
        let here = part.trajectory.evaluate(0.0)?.path_point?;
        let (sin, cos) = here.pose.yaw.sin_cos();
        let off = self.vehicle.pose.point() - here.pose.point();
        Some(off.y * cos - off.x * sin)
    }

    fn end(mut self, ending: Ending) -> Outcome {
        let goal = self.region.goal_in_map();
        self.outcome.ending = ending;
        self.outcome.plans = self.counts.plans.load(Ordering::Relaxed);
        self.outcome.skips = self.counts.skips.load(Ordering::Relaxed);
        self.outcome.goal_error_m = self.vehicle.pose.distance_m(&goal);
        self.outcome.goal_error_rad = self.vehicle.pose.yaw_to(&goal).abs();
        self.outcome.at = self.region.to_region(self.vehicle.pose);
        self.outcome
    }
}

/// Plans at once and hands the result over some cycles later.
struct VirtualWorker<P> {
    optimizer: Optimizer<P>,
    random: Random,
    waiting: Option<Job>,
    running: Option<(u32, Job)>,
    planned: Option<Planned>,
    failure: Option<PlanFailure>,
    counts: Arc<Counts>,
}

impl<P: ProblemPlanner> PlanningWorker for VirtualWorker<P> {
    fn start(&mut self) -> Result<(), WorkerNotStarted> {
        Ok(())
    }

    fn submit(&mut self, job: Job) {
        self.waiting = Some(job);
        match self.running.take() {
            Some((0, job)) => self.finish(job),
            Some((left, job)) => self.running = Some((left - 1, job)),
            None => {}
        }
        if self.running.is_none() && self.planned.is_none() {
            let cycles = self.random.between(2.0, 12.0) as u32;
            self.running = self.waiting.take().map(|job| (cycles, job));
        }
    }

    fn take_planned(&mut self) -> Option<Planned> {
        let planned = self.planned.take()?;
        self.waiting = None;
        Some(planned)
    }

    fn take_failure(&mut self) -> Option<PlanFailure> {
        self.failure.take()
    }

    fn state(&self) -> WorkerState {
        WorkerState { skips: self.counts.skips.load(Ordering::Relaxed).into(), ..WorkerState::default() }
    }

    fn request_stop(&mut self) {}

    fn stop(&mut self) {}
}

impl<P: ProblemPlanner> VirtualWorker<P> {
    fn finish(&mut self, job: Job) {
        match self.optimizer.plan(&job, &unwatched()) {
            Ok(Planning::Planned(optimized)) => {
                self.counts.plans.fetch_add(1, Ordering::Relaxed);
                let Job { stitching, submitted_s, .. } = job;
                self.planned = Some(Planned { optimized, stitching, submitted_s, latency_ms: 0.0 });
            }
            Ok(Planning::Skipped) => {
                self.counts.skips.fetch_add(1, Ordering::Relaxed);
            }
            Err(failure) => self.failure = Some(failure),
        }
    }
}
