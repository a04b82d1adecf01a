//! The open-space trajectory provider: each cycle it says what the vehicle shall do, be it a fresh plan, the one from
//! before, or to stand.
//!
//! One call of [`Provider::process`] is one cycle. Planning takes longer than a cycle, so it goes on beside the cycles
//! in a [`PlanningWorker`]; the provider never waits for it. Its own state is small: whether the worker runs, whether
//! planning is over, and how long planning has been failing. Everything else is an argument.

mod optimizer;
mod parameters;
mod planning;
mod status;

use std::sync::Arc;

pub use optimizer::{Optimizer, ProblemPlanner};
pub use parameters::{OutOfRange, ProviderParameters, out_of_range};
pub(crate) use parameters::{out_of_ranges, ranges};
pub use planning::{
    Execution, Job, Outcome, PlanFailure, Planned, PlanningWorker, Region, SynchronousPlanner,
    WorkerNotStarted, WorkerState,
};
pub use status::{Code, Status};

use crate::stitcher::{
    DiscretizedPoint, DiscretizedTrajectory, PathPoint, PublishedTrajectory, ReplanReason, StitchRequest,
    Stitching, compute_reinit_stitching_trajectory, compute_stitching_trajectory,
};
use crate::vehicle_model::VehicleState;

/// A vehicle on fallback has stopped below this speed (m/s) ...
const FALLBACK_STOP_SPEED_MPS: f64 = 0.1;

/// ... and this acceleration (m/s²).
const FALLBACK_STOP_ACCELERATION_MPS2: f64 = 0.1;

/// A stop trajectory holds against rolling forward down to this speed (m/s), against rolling back below it.
const ROLLING_BACK_MPS: f64 = -1e-5;

const STOP_POINTS: usize = 10;
const STOP_INTERVAL_S: f64 = 0.1;

/// What a cycle starts from.
#[derive(Clone, Copy, Debug)]
pub struct Frame<'a> {
    /// Now, s, on one clock for all cycles.
    pub now_s: f64,
    /// The vehicle.
    pub vehicle: VehicleState,
    /// Where to go, and between what.
    pub region: &'a Arc<Region>,
    /// Whether a vehicle that is about to leave its slot is still being checked.
    pub in_check_stage: bool,
    /// The cycle before.
    pub previous: Option<&'a PreviousFrame>,
}

/// What a cycle leaves to the next.
#[derive(Clone, Debug, PartialEq)]
pub struct PreviousFrame {
    /// Its result, times from the header of what was published.
    pub stitched: PublishedTrajectory,
    /// Whether what was published led to a stop before an obstacle, or nobody looked.
    pub fallback: bool,
    /// Whether the provider had a plan to follow.
    pub provider_success: bool,
}

/// Where the trajectory of a cycle comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// There is none.
    Nothing,
    /// The vehicle is held where it is.
    Stop,
    /// A plan that has just come in.
    Planned,
    /// The result of the cycle before.
    Reused,
}

/// What a cycle says.
#[derive(Clone, Debug, PartialEq)]
pub struct Provision {
    /// How the cycle ended.
    pub status: Status,
    /// What the vehicle shall do. A plan carries arc lengths that grow in both gears.
    pub trajectory: DiscretizedTrajectory,
    /// What its times count from, s: now, or the header of the trajectory that is used again.
    pub header_time_s: f64,
    /// Where it comes from.
    pub source: Source,
    /// Whether the vehicle has arrived.
    pub destination_reached: bool,
    /// The vehicle has stopped before an obstacle and planning begins anew: who follows the result must look for the
    /// vehicle's place on it again.
    pub restarted: bool,
    /// Why the plan that is asked for does not continue the previous trajectory.
    pub replan: Option<ReplanReason>,
    /// The failure that was reported in this cycle, whatever came of it.
    pub failure: Option<PlanFailure>,
    /// How long the plan that came in took, ms.
    pub latency_ms: Option<f64>,
}

impl Provision {
    /// Whether there is a plan to follow.
    #[must_use]
    pub fn success(&self) -> bool {
        matches!(self.source, Source::Planned | Source::Reused)
    }
}

/// What the provider and its worker are doing, for whoever watches.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ProviderState {
    /// Whether a worker was started since the last restart.
    pub thread_started: bool,
    /// Whether planning is over until a restart.
    pub generation_stopped: bool,
    /// Failures since the last good plan.
    pub failures: u32,
    /// The worker; without one nothing but zeros.
    pub worker: WorkerState,
}

/// The provider.
#[derive(Debug)]
pub struct Provider {
    execution: Execution,
    memory: Memory,
}

/// What the provider keeps from cycle to cycle.
#[derive(Debug)]
struct Memory {
    parameters: ProviderParameters,
    thread_started: bool,
    generation_stopped: bool,
    failing: Failing,
}

/// How long planning has been failing.
#[derive(Clone, Copy, Debug, Default)]
struct Failing {
    count: u32,
    since_s: Option<f64>,
    last_s: f64,
    skips: u64,
}

impl Failing {
    /// Takes note of a failure; how long there has been nothing else, s. A skipped job, a clock set back and a silence
    /// longer than the limit each begin a new stretch.
    fn note(&mut self, now_s: f64, skips: u64, limit_s: f64) -> f64 {
        self.count = self.count.saturating_add(1);
        let goes_on = self.skips == skips && now_s >= self.last_s && now_s - self.last_s <= limit_s;
        let since_s = self.since_s.filter(|_| goes_on).unwrap_or(now_s);
        (self.since_s, self.last_s, self.skips) = (Some(since_s), now_s, skips);
        now_s - since_s
    }
}

impl Provider {
    /// A provider at rest.
    ///
    /// # Errors
    /// Every parameter that is out of its range.
    pub fn new(parameters: ProviderParameters, execution: Execution) -> Result<Self, Vec<OutOfRange>> {
        let refused = out_of_range(&parameters);
        if !refused.is_empty() {
            return Err(refused);
        }
        let memory = Memory {
            parameters,
            thread_started: false,
            generation_stopped: false,
            failing: Failing::default(),
        };
        Ok(Self { execution, memory })
    }

    /// One cycle.
    pub fn process(&mut self, frame: &Frame<'_>) -> Provision {
        let memory = &mut self.memory;
        if !(frame.now_s.is_finite() && frame.vehicle.is_finite()) {
            // Not even a stop can be placed.
            let unusable = PlanFailure::InputNotReady { field: "vehicle_state", fault: "is not finite" };
            return Provision::without_plan(frame, Status::Failed(unusable));
        }
        if frame.in_check_stage {
            return memory.stop_with(frame, Status::Done);
        }
        if let Execution::Threaded(worker) = &mut self.execution
            && !memory.thread_started
        {
            if let Err(fault) = worker.start() {
                return memory.stop_with(frame, Status::NoWorker(fault));
            }
            memory.thread_started = true;
        }
        let (Stitching { trajectory, replan }, restarted) = memory.stitching(frame);
        let provision = match &mut self.execution {
            Execution::Threaded(worker) => memory.cycle_beside_worker(worker.as_mut(), frame, trajectory),
            Execution::Synchronous(planner) => memory.cycle_with_plan(planner.as_mut(), frame, trajectory),
        };
        Provision { restarted, replan, ..provision }
    }

    /// Ends planning, waiting for the worker to let go of its job. What is asked of the provider until a restart is
    /// answered with a stop. Without a worker there is nothing to end.
    pub fn stop(&mut self) {
        if let Execution::Threaded(worker) = &mut self.execution {
            self.memory.generation_stopped = true;
            if self.memory.thread_started {
                worker.stop();
            }
            self.memory.failing = Failing::default();
        }
    }

    /// Ends planning and makes ready for a new goal: the next cycle starts a fresh worker.
    ///
    /// Upstream keeps the job that waits; it asks for a goal that may be no longer wanted, so it is dropped here.
    pub fn restart(&mut self) {
        self.stop();
        (self.memory.generation_stopped, self.memory.thread_started) = (false, false);
    }

    /// What the provider and its worker are doing.
    #[must_use]
    pub fn state(&self) -> ProviderState {
        ProviderState {
            thread_started: self.memory.thread_started,
            generation_stopped: self.memory.generation_stopped,
            failures: self.memory.failing.count,
            worker: match &self.execution {
                Execution::Threaded(worker) => worker.state(),
                Execution::Synchronous(_) => WorkerState::default(),
            },
        }
    }

    /// The parameters.
    #[must_use]
    pub fn parameters(&self) -> &ProviderParameters {
        &self.memory.parameters
    }
}

impl Memory {
    /// What the next plan continues, and whether that is the vehicle after a stop before an obstacle.
    fn stitching(&self, frame: &Frame<'_>) -> (Stitching, bool) {
        let p = &self.parameters;
        if stopped_due_to_fallback(frame) {
            let trajectory = compute_reinit_stitching_trajectory(p.cycle_s(), &frame.vehicle);
            return (Stitching { trajectory, replan: None }, true);
        }
        let request = StitchRequest {
            vehicle: &frame.vehicle,
            now_s: frame.now_s,
            period_s: p.open_space_planning_period,
            reinit_cycle_s: p.reinit_cycle_s(),
            preserved_points: p.open_space_trajectory_stitching_preserved_length as usize,
            replan_by_offset: false,
            enabled: p.enable_trajectory_stitcher,
            offset_limits: p.offset_limits(),
            previous: frame.previous.map(|previous| &previous.stitched),
        };
        (compute_stitching_trajectory(&request), false)
    }

    fn cycle_beside_worker(
        &mut self,
        worker: &mut dyn PlanningWorker,
        frame: &Frame<'_>,
        stitching: DiscretizedTrajectory,
    ) -> Provision {
        if self.generation_stopped {
            return self.stop_with(frame, Status::ParkingFinished);
        }
        worker.submit(Job { stitching, region: frame.region.clone(), submitted_s: frame.now_s });
        if self.near_destination(frame) {
            worker.request_stop();
            self.generation_stopped = true;
            return self.arrived(frame);
        }
        if let Some(planned) = worker.take_planned() {
            return self.load(frame, planned);
        }
        let failure = worker.take_failure();
        if let Some(last) = &failure {
            let (p, skips) = (&self.parameters, worker.state().skips);
            let lasting_s = self.failing.note(frame.now_s, skips, p.error_duration_limit);
            let count = self.failing.count;
            if count > p.error_count_limit || lasting_s > p.error_duration_limit {
                let status = Status::TooManyFailures { count, lasting_s, last: last.clone() };
                return Provision { failure, ..self.stop_with(frame, status) };
            }
        }
        Provision { failure, ..self.wait(frame) }
    }

    fn cycle_with_plan(
        &mut self,
        planner: &mut dyn SynchronousPlanner,
        frame: &Frame<'_>,
        stitching: DiscretizedTrajectory,
    ) -> Provision {
        if self.near_destination(frame) {
            return self.arrived(frame);
        }
        let job = Job { stitching, region: frame.region.clone(), submitted_s: frame.now_s };
        let (outcome, latency_ms) = planner.plan(&job);
        let provision = match outcome {
            Ok(Outcome::Planned(optimized)) => {
                let Job { stitching, submitted_s, .. } = job;
                self.load(frame, Planned { optimized, stitching, submitted_s, latency_ms })
            }
            Ok(Outcome::Skipped) => Provision::without_plan(frame, Status::Skipped),
            Err(failure) => {
                let status = Status::Failed(failure.clone());
                Provision { failure: Some(failure), ..Provision::without_plan(frame, status) }
            }
        };
        Provision { latency_ms: Some(latency_ms), ..provision }
    }

    fn load(&mut self, frame: &Frame<'_>, planned: Planned) -> Provision {
        let latency_ms = Some(planned.latency_ms);
        match load_result(frame.now_s, planned) {
            Ok(trajectory) => {
                self.failing = Failing::default();
                let loaded = Provision::without_plan(frame, Status::Done);
                Provision { trajectory, source: Source::Planned, latency_ms, ..loaded }
            }
            Err(failure) => {
                let held = self.stop_with(frame, Status::Failed(failure.clone()));
                Provision { failure: Some(failure), latency_ms, ..held }
            }
        }
    }

    /// The result of the cycle before if it was a plan, else a stop.
    fn wait(&self, frame: &Frame<'_>) -> Provision {
        match frame.previous {
            Some(previous) if previous.provider_success => Provision {
                trajectory: previous.stitched.trajectory.clone(),
                header_time_s: previous.stitched.header_time_s,
                source: Source::Reused,
                ..Provision::without_plan(frame, Status::Waiting)
            },
            _ => self.stop_with(frame, Status::StopUnfinished),
        }
    }

    fn arrived(&self, frame: &Frame<'_>) -> Provision {
        Provision { destination_reached: true, ..self.stop_with(frame, Status::NearDestination) }
    }

    fn stop_with(&self, frame: &Frame<'_>, status: Status) -> Provision {
        let standstill = self.parameters.open_space_standstill_acceleration;
        Provision {
            trajectory: stop_trajectory(&frame.vehicle, standstill),
            source: Source::Stop,
            ..Provision::without_plan(frame, status)
        }
    }

    /// Whether the vehicle has arrived: near the goal, strictly, and as good as at rest. One that rolls past its goal to
    /// come back to it has not.
    fn near_destination(&self, frame: &Frame<'_>) -> bool {
        let (p, goal, vehicle) = (&self.parameters, frame.region.goal_in_map(), frame.vehicle.pose);
        vehicle.distance_m(&goal) < p.is_near_destination_threshold
            && vehicle.yaw_to(&goal).abs() < p.is_near_destination_theta_threshold
            && frame.vehicle.speed_mps.abs() <= p.is_near_destination_speed_threshold
    }
}

impl Drop for Provider {
    fn drop(&mut self) {
        self.stop();
    }
}

impl Provision {
    fn without_plan(frame: &Frame<'_>, status: Status) -> Self {
        Self {
            status,
            trajectory: DiscretizedTrajectory::default(),
            header_time_s: frame.now_s,
            source: Source::Nothing,
            destination_reached: false,
            restarted: false,
            replan: None,
            failure: None,
            latency_ms: None,
        }
    }
}

/// Whether the vehicle has come to rest before the obstacle that the cycle before stopped for.
fn stopped_due_to_fallback(frame: &Frame<'_>) -> bool {
    frame.previous.is_some_and(|previous| previous.fallback)
        && frame.vehicle.speed_mps.abs() < FALLBACK_STOP_SPEED_MPS
        && frame.vehicle.acceleration_mps2.abs() < FALLBACK_STOP_ACCELERATION_MPS2
}

/// Ten points at the vehicle over nine tenths of a second, at rest, braking against the way it rolls.
#[must_use]
pub fn stop_trajectory(vehicle: &VehicleState, standstill_acceleration_mps2: f64) -> DiscretizedTrajectory {
    let acceleration_mps2 = if vehicle.speed_mps >= ROLLING_BACK_MPS {
        -standstill_acceleration_mps2
    } else {
        standstill_acceleration_mps2
    };
    let path_point = Some(PathPoint { pose: vehicle.pose, ..PathPoint::default() });
    let mut relative_time_s = 0.0;
    let points = (0..STOP_POINTS).map(|_| {
        let point = DiscretizedPoint {
            path_point,
            acceleration_mps2,
            relative_time_s,
            ..DiscretizedPoint::default()
        };
        relative_time_s += STOP_INTERVAL_S;
        point
    });
    DiscretizedTrajectory { points: points.collect() }
}

/// The plan behind the piece that it continues, times from now: they were counted from when the job was made.
fn load_result(now_s: f64, planned: Planned) -> Result<DiscretizedTrajectory, PlanFailure> {
    let Planned { optimized, stitching: mut joined, submitted_s, .. } = planned;
    let refused = |why: &str| PlanFailure::Refused { why: why.to_owned() };
    // The last point of the piece is the first of the plan.
    let joint = joined.points.pop().ok_or_else(|| refused("it continues nothing"))?;
    let joint_s_m = joint.path_point.ok_or_else(|| refused("it continues a point without a pose"))?.s_m;
    let mut shifted = optimized.points;
    for point in &mut shifted {
        point.relative_time_s += joint.relative_time_s;
        if let Some(path_point) = &mut point.path_point {
            path_point.s_m += joint_s_m;
        }
    }
    if let (Some(before), Some(after)) = (joined.points.last(), shifted.first())
        && before.relative_time_s >= after.relative_time_s
    {
        return Err(refused("it begins before the piece that it continues has ended"));
    }
    joined.points.append(&mut shifted);
    let elapsed_s = (now_s - submitted_s).max(0.0);
    for point in &mut joined.points {
        point.relative_time_s -= elapsed_s;
    }
    Ok(joined)
}

#[cfg(test)]
mod tests;
