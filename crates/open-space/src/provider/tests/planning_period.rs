//! What the planning period means: planned again and again, or planned once and tracked.

use super::*;
use crate::interruption::{Watch, unwatched};
use crate::problem::{Limits, Problem};
use crate::trajectory::{Trajectory, TrajectoryPoint};

/// Plans straight to the goal at one metre a second.
struct Straight;

impl ProblemPlanner for Straight {
    fn plan(&mut self, problem: &Problem, _: &Watch) -> Result<Trajectory, PlanFailure> {
        let (start, goal) = (problem.start, problem.goal);
        let length_m = start.distance_m(&goal);
        let steps = (length_m / 0.1).ceil().max(1.0);
        let mut points = Vec::new();
        let mut step = 0.0;
        while step <= steps {
            let ratio = step / steps;
            points.push(TrajectoryPoint {
                time_s: ratio * length_m,
                pose: PlanarPose::new(
                    start.x + (goal.x - start.x) * ratio,
                    start.y + (goal.y - start.y) * ratio,
                    start.yaw,
                ),
                curvature: 0.0,
                speed_mps: if step < steps { 1.0 } else { 0.0 },
                acceleration_mps2: 0.0,
                steer_rad: 0.0,
                gear: Gear::Forward,
            });
            step += 1.0;
        }
        Ok(Trajectory { points })
    }
}

/// Plans each job that it is free to take, and is done some cycles later.
struct SlowWorker {
    optimizer: Optimizer<Straight>,
    latency_cycles: u32,
    waiting: Option<Job>,
    running: Option<(u32, Job)>,
    planned: Option<Planned>,
    failure: Option<PlanFailure>,
    counts: Arc<Mutex<Counts>>,
}

#[derive(Clone, Copy, Debug, Default)]
struct Counts {
    planned: u32,
    skipped: u32,
}

impl PlanningWorker for SlowWorker {
    fn start(&mut self) -> Result<(), WorkerNotStarted> {
        Ok(())
    }

    fn submit(&mut self, job: Job) {
        self.waiting = Some(job);
        // A cycle has passed for the running job.
        match self.running.take() {
            Some((0, job)) => self.end(job),
            Some((left, job)) => self.running = Some((left - 1, job)),
            None => {}
        }
        if self.running.is_none() && self.planned.is_none() {
            self.running = self.waiting.take().map(|job| (self.latency_cycles, job));
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
        WorkerState { skips: u64::from(self.counts.lock().unwrap().skipped), ..WorkerState::default() }
    }

    fn request_stop(&mut self) {}

    fn stop(&mut self) {}
}

impl SlowWorker {
    fn end(&mut self, job: Job) {
        let mut counts = self.counts.lock().unwrap();
        match self.optimizer.plan(&job, &unwatched()) {
            Ok(Outcome::Planned(optimized)) => {
                counts.planned += 1;
                let Job { stitching, submitted_s, .. } = job;
                self.planned = Some(Planned { optimized, stitching, submitted_s, latency_ms: 0.0 });
            }
            Ok(Outcome::Skipped) => counts.skipped += 1,
            Err(failure) => self.failure = Some(failure),
        }
    }
}

/// Drives 20 m to the goal, ten cycles a second, the vehicle exactly where its trajectory says; where it was each
/// cycle, and what the worker did.
fn drive(period_s: f64, latency_cycles: u32) -> (Vec<f64>, Counts) {
    let counts = Arc::new(Mutex::new(Counts::default()));
    let worker = SlowWorker {
        optimizer: Optimizer::new(Straight, motion::VehicleInfo::default(), Limits::default(), 0.1),
        latency_cycles,
        waiting: None,
        running: None,
        planned: None,
        failure: None,
        counts: counts.clone(),
    };
    let parameters =
        ProviderParameters { open_space_planning_period: period_s, ..ProviderParameters::default() };
    let mut provider = Provider::new(parameters, Execution::Threaded(Box::new(worker))).unwrap();
    let region = region();
    let (mut vehicle, mut previous) = (vehicle_at(0.0, 0.0, 0.0), None::<PreviousFrame>);
    let mut places = Vec::new();
    for cycle in 0_u32..600 {
        let now_s = f64::from(cycle) * 0.1;
        if let Some(driven) = previous.as_ref().filter(|previous| previous.provider_success) {
            let point = driven.stitched.trajectory.evaluate(now_s - driven.stitched.header_time_s).unwrap();
            (vehicle.pose, vehicle.speed_mps) = (point.path_point.unwrap().pose, point.speed_mps);
        }
        let provision = provider.process(&Frame { vehicle, ..frame(now_s, &region, previous.as_ref()) });
        places.push(vehicle.pose.x);
        if provision.destination_reached {
            break;
        }
        let mut left = left_by(&provision);
        if provision.source == Source::Planned && !previous.as_ref().is_some_and(|p| p.provider_success) {
            // The first plan begins in the past by now; the vehicle is still at its start.
            let shift_s = left.stitched.trajectory.points[0].relative_time_s;
            for point in &mut left.stitched.trajectory.points {
                point.relative_time_s -= shift_s;
            }
        }
        previous = Some(left);
    }
    let counts = *counts.lock().unwrap();
    (places, counts)
}

fn assert_smooth_arrival(places: &[f64]) {
    assert!((places.last().unwrap() - 20.0).abs() < 0.1, "ends at {:?}", places.last());
    for pair in places.windows(2) {
        // A metre a second, and never a leap where a new plan takes over.
        assert!((-1e-9..0.1 + 1e-6).contains(&(pair[1] - pair[0])), "{pair:?}");
    }
}

/// Four seconds: a new plan begins whenever the last has come in, four seconds ahead, and takes over without a leap.
#[test]
fn a_period_of_four_seconds_plans_continuously() {
    for latency_cycles in [0, 3, 12] {
        let (places, counts) = drive(4.0, latency_cycles);
        assert_smooth_arrival(&places);
        assert!(counts.planned >= 160 / (latency_cycles + 3), "{counts:?} at {latency_cycles}");
    }
}

/// A thousand seconds: the next plan would begin at the end of this one, which is the goal, so it is skipped for ever.
#[test]
fn a_period_of_a_thousand_seconds_plans_once_and_tracks() {
    for latency_cycles in [0, 3, 12] {
        let (places, counts) = drive(1000.0, latency_cycles);
        assert_smooth_arrival(&places);
        assert_eq!(counts.planned, 1, "at {latency_cycles}");
        assert!(counts.skipped > 10, "{counts:?} at {latency_cycles}");
    }
}
