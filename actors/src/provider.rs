//! Owns the open-space provider: gives its trajectory to the buffer, where it is a candidate like any other.
//!
//! While there is a goal, each cycle of the selector begins with one of the provider, so that what is judged is timed
//! from the cycle's own time; at most as many in a second as the provider is set to. Planning goes on beside the cycles
//! on a thread of its own. Where the clock is stepped there is no thread: a plan is there in the cycle after the one
//! that asked for it, so that a replay repeats itself.

mod candidates;
mod desk;
mod in_cycle;
mod inputs;
mod lockstep;
mod planning_thread;
mod surroundings;

#[cfg(test)]
mod exploration;
#[cfg(test)]
mod stand_ins;
#[cfg(test)]
mod tests;

/// What the planning thread is made of; its exploration puts other primitives in their place.
mod sync {
    pub(super) use std::sync::atomic::{AtomicBool, Ordering};
    pub(super) use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
    pub(super) use std::thread::{Builder, JoinHandle};
}

use crate::buffer::{Add, Buffer};
use crate::clock::Clock;
use crate::inlets::SensorSlots;
use actix::{Actor, Addr, Context, Handler, Message};
pub(crate) use candidates::plan_in;
use candidates::{Placement, to_message};
use in_cycle::InCycle;
use inputs::{obstacles, vehicle_state};
pub use lockstep::Lockstep;
use messages::geometry_msgs::PoseStamped;
use motion::VehicleInfo;
use open_space::fallback::FallbackParameters;
use open_space::partition::PartitionParameters;
use open_space::provider::{
    Code, Execution, Optimizer, OutOfRange, ProblemPlanner, Provider, ProviderParameters, Region,
    out_of_range, stop_trajectory,
};
use open_space::region_of_interest::RegionParameters;
use open_space::stage::{Command, ParkingStage, StageInput, StageOutput};
use open_space::vehicle_model::VehicleState;
use open_space::{Gear, Limits, PlanarPose};
pub use planning_thread::{MakePlanner, PlanJob, PlanningThread};
use selection::Scene;
use selection::panics::caught;
use std::sync::Arc;
use std::time::Duration;
use surroundings::Surroundings;
use tracing::{error, info, warn};

/// Name of the generator of plans.
pub const GENERATOR: &str = "OpenSpacePlanner";

/// Name of the generator of stop trajectories.
pub const STOP_GENERATOR: &str = "OpenSpacePlanner_Stop";

/// A cycle that comes early by this part of the period counts as the next one: periods are not met to the microsecond.
const EARLY: f64 = 0.05;

/// What the provider starts with.
pub struct ProviderConfig {
    /// The provider's parameters.
    pub provider: ProviderParameters,
    /// Those of the partition.
    pub partition: PartitionParameters,
    /// Those of the look-out for moving obstacles.
    pub fallback: FallbackParameters,
    /// Those of the region of interest, for goals that come as messages.
    pub region: RegionParameters,
    /// Makes the planner, on its own thread.
    pub make_planner: MakePlanner,
}

impl std::fmt::Debug for ProviderConfig {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ProviderConfig").field("provider", &self.provider).finish_non_exhaustive()
    }
}

/// A maker of planners that solve problems. `near_destination_m`: a start closer to the goal than this is not planned
/// from, m.
pub fn planner_of<P: ProblemPlanner + Send + 'static>(
    make: impl Fn() -> P + Send + Sync + 'static,
    vehicle: VehicleInfo,
    limits: Limits,
    near_destination_m: f64,
) -> MakePlanner {
    Arc::new(move || {
        let mut optimizer = Optimizer::new(make(), vehicle, limits, near_destination_m);
        Box::new(move |job, watch| optimizer.plan(job, watch))
    })
}

/// The owner of the provider.
#[derive(Debug)]
pub(crate) struct OpenSpace {
    stage: ParkingStage,
    period_s: f64,
    surroundings: Surroundings,
    buffer: Addr<Buffer>,
    /// Gear of what was commanded last; what a standing vehicle is in.
    gear: Gear,
    last_cycle_s: Option<f64>,
    /// How the last cycle ended, so that only changes are logged.
    last_status: String,
}

impl OpenSpace {
    /// A provider without a goal.
    ///
    /// # Errors
    /// Every parameter that is out of its range.
    pub(crate) fn new(
        config: ProviderConfig,
        vehicle: VehicleInfo,
        clock: &Clock,
        slots: Arc<SensorSlots>,
        buffer: Addr<Buffer>,
    ) -> Result<Self, Vec<OutOfRange>> {
        let mut refused = out_of_range(&config.partition);
        refused.extend(out_of_range(&config.fallback));
        refused.extend(out_of_range(&config.region));
        refused.extend(out_of_range(&config.provider));
        if !refused.is_empty() {
            return Err(refused);
        }
        let period_s = config.provider.cycle_s();
        let execution = execution(&config.provider, config.make_planner, clock);
        let provider = Provider::new(config.provider, execution)?;
        let stage = ParkingStage::new(provider, config.partition, config.fallback, vehicle);
        Ok(Self {
            stage,
            period_s,
            surroundings: Surroundings::new(config.region, vehicle, slots),
            buffer,
            gear: Gear::Forward,
            last_cycle_s: None,
            last_status: String::new(),
        })
    }

    /// Whether a period has passed since the last cycle, or time went back.
    fn is_due(&self, now_s: f64) -> bool {
        self.last_cycle_s
            .is_none_or(|last_s| now_s < last_s || now_s - last_s >= self.period_s * (1.0 - EARLY))
    }

    /// One cycle towards the goal, if there is one; its candidates go to the buffer.
    fn provide(&mut self, scene: &Scene) {
        let now_s = scene.now.seconds();
        if !self.is_due(now_s) {
            return;
        }
        let (Some(odometry), Some(acceleration)) = (&scene.odometry, &scene.acceleration) else { return };
        let vehicle = vehicle_state(odometry, acceleration, self.gear);
        let frame_id = &odometry.header.frame_id;
        let at = Placement { stamp: scene.now, frame_id, z: vehicle.z };
        // What a panic leaves behind is not used again: the goal is given up.
        match caught(|| self.decide(scene, vehicle, frame_id)) {
            Ok(None) => {}
            Ok(Some(Ok(output))) => {
                self.note(&output);
                self.add(Some(&output.command), &at);
            }
            Ok(Some(Err(why))) => self.hold(&vehicle, &why, &at),
            Err(panic) => {
                error!(
                    "the open-space provider panicked: {panic}; its goal is given up. This is a defect, please \
                     report it"
                );
                self.set_region(None, &Placement { stamp: scene.now, frame_id: "", z: 0.0 });
            }
        }
    }

    /// What to do, or why to stand; nothing without a goal.
    fn decide(
        &mut self,
        scene: &Scene,
        vehicle: VehicleState,
        frame_id: &str,
    ) -> Option<Result<StageOutput, String>> {
        let region = self.surroundings.region(scene, vehicle.pose, frame_id)?;
        let now_s = scene.now.seconds();
        self.last_cycle_s = Some(now_s);
        let region = match region {
            Ok(region) => region,
            Err(why) => return Some(Err(why.to_string())),
        };
        let obstacles = scene.objects.as_ref().map_or_else(Vec::new, |objects| obstacles(objects, scene.now));
        let input =
            StageInput { now_s, vehicle, region: &region, in_check_stage: false, obstacles: &obstacles };
        let output = self.stage.step(&input);
        if self.surroundings.is_blocked(&region, &way_of(&output.command)) {
            return Some(Err("something has come into the way; planning begins anew".to_owned()));
        }
        Some(Ok(output))
    }

    /// Stands, and follows no plan any more.
    fn hold(&mut self, vehicle: &VehicleState, why: &str, at: &Placement<'_>) {
        if self.last_status != why {
            warn!("open-space provider: {why}");
            why.clone_into(&mut self.last_status);
        }
        self.stage.restart();
        let standstill = self.stage.provider().parameters().open_space_standstill_acceleration;
        let stop = vehicle.is_finite().then(|| stop_trajectory(vehicle, standstill));
        self.add(Some(&Command::Stop(stop)), at);
    }

    fn add(&self, command: Option<&Command>, at: &Placement<'_>) {
        let message = Arc::new(to_message(command, at));
        self.buffer.do_send(Add { message, anchor: None });
    }

    fn set_region(&mut self, region: Option<Arc<Region>>, at: &Placement<'_>) {
        self.surroundings.give(region);
        self.begin_anew(at);
    }

    fn begin_anew(&mut self, at: &Placement<'_>) {
        self.stage.restart();
        self.last_cycle_s = None;
        self.last_status.clear();
        // What was made for the goal before must not be driven any more.
        self.add(None, at);
    }

    fn note(&mut self, output: &StageOutput) {
        match &output.command {
            Command::Follow(part) => self.gear = part.gear,
            Command::Brake { gear, .. } => self.gear = *gear,
            Command::Stop(_) => {}
        }
        let status = &output.provision.status;
        // Whether the plan is new or still the last one changes from cycle to cycle.
        let follows = output.provision.success();
        let mut text = if follows { "following a plan".to_owned() } else { status.message() };
        if let Some(failure) = &output.provision.failure {
            text = format!("{text} ({failure})");
        }
        if let Some(lost) = output.lost {
            text = format!("{text} ({lost})");
        }
        if text != self.last_status {
            match status.code() {
                Code::PlanningError => error!("open-space provider: {text}"),
                Code::Ok if output.provision.failure.is_some() || output.lost.is_some() => {
                    warn!("open-space provider: {text}");
                }
                Code::Ok => info!("open-space provider: {text}"),
            }
            self.last_status = text;
        }
    }
}

/// The poses that the vehicle passes up to where it stands next.
fn way_of(command: &Command) -> Vec<PlanarPose> {
    let points = match command {
        Command::Stop(_) => return Vec::new(),
        Command::Follow(part) => &part.trajectory.points[part.until_stop(0.0)],
        Command::Brake { trajectory, .. } => &trajectory.points[..],
    };
    points.iter().filter_map(|point| point.path_point).map(|point| point.pose).collect()
}

/// Who plans: a thread, or where the clock is stepped nobody beside the cycles; without a thread the cycle itself.
fn execution(parameters: &ProviderParameters, make_planner: MakePlanner, clock: &Clock) -> Execution {
    let time_limit =
        clock.runs_by_itself().then(|| Duration::from_secs_f64(parameters.open_space_planning_time_limit));
    match (parameters.enable_open_space_planner_thread, time_limit) {
        (false, limit) => Execution::Synchronous(Box::new(InCycle::new(make_planner, limit))),
        (true, Some(limit)) => {
            Execution::Threaded(Box::new(PlanningThread::new(make_planner).with_time_limit(limit)))
        }
        (true, None) => Execution::Threaded(Box::new(Lockstep::new(make_planner))),
    }
}

impl Actor for OpenSpace {
    type Context = Context<Self>;
}

/// Asks for candidates at the time of a scene; they are in the buffer's mailbox before the answer is.
#[derive(Debug)]
pub(crate) struct Provide(pub(crate) Arc<Scene>);

impl Message for Provide {
    type Result = ();
}

impl Handler<Provide> for OpenSpace {
    type Result = ();

    fn handle(&mut self, Provide(scene): Provide, _: &mut Self::Context) {
        self.provide(&scene);
    }
}

/// Sets the goal and what surrounds it, or takes it away. Waits until the running plan is called off.
#[derive(Debug)]
pub(crate) struct SetRegion(pub(crate) Option<Arc<Region>>);

impl Message for SetRegion {
    type Result = ();
}

impl Handler<SetRegion> for OpenSpace {
    type Result = ();

    fn handle(&mut self, SetRegion(region): SetRegion, _: &mut Self::Context) {
        self.set_region(region, &Placement::default());
    }
}

/// Sets the goal to be reached among what is seen and known. The one that there is already changes nothing.
#[derive(Debug)]
pub(crate) struct SetGoal(pub(crate) Arc<PoseStamped>);

impl Message for SetGoal {
    type Result = ();
}

impl Handler<SetGoal> for OpenSpace {
    type Result = ();

    fn handle(&mut self, SetGoal(goal): SetGoal, _: &mut Self::Context) {
        if self.surroundings.set_goal(&goal) {
            self.begin_anew(&Placement::default());
        }
    }
}
