//! Owns the open-space provider: gives its trajectory to the buffer, where it is a candidate like any other.
//!
//! While there is a goal, each cycle of the selector begins with one of the provider, so that what is judged is timed
//! from the cycle's own time; at most as many in a second as the provider is set to. Planning goes on beside the cycles
//! on a thread of its own. Where the clock is stepped there is no thread: a plan is there in the cycle after the one
//! that asked for it, so that a replay repeats itself.

mod candidates;
mod desk;
mod inputs;
mod lockstep;
mod planning_thread;

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
use actix::{Actor, Addr, Context, Handler, Message};
use candidates::{Placement, to_message};
use inputs::{obstacles, vehicle_state};
pub use lockstep::Lockstep;
use motion::VehicleInfo;
use open_space::fallback::FallbackParameters;
use open_space::partition::PartitionParameters;
use open_space::provider::{
    Code, Execution, Optimizer, OutOfRange, ProblemPlanner, Provider, ProviderParameters, Region,
    out_of_range,
};
use open_space::stage::{Command, ParkingStage, StageInput, StageOutput};
use open_space::{Gear, Limits};
pub use planning_thread::{MakePlanner, PlanJob, PlanningThread};
use selection::Scene;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
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
        Box::new(move |job, cancelled| optimizer.plan(job, cancelled))
    })
}

/// The owner of the provider.
#[derive(Debug)]
pub(crate) struct OpenSpace {
    stage: ParkingStage,
    period_s: f64,
    region: Option<Arc<Region>>,
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
        buffer: Addr<Buffer>,
    ) -> Result<Self, Vec<OutOfRange>> {
        let mut refused = out_of_range(&config.partition);
        refused.extend(out_of_range(&config.fallback));
        if !refused.is_empty() {
            refused.extend(out_of_range(&config.provider));
            return Err(refused);
        }
        let period_s = config.provider.cycle_s();
        let execution = Execution::Threaded(if clock.runs_by_itself() {
            Box::new(PlanningThread::new(config.make_planner))
        } else {
            Box::new(Lockstep::new(config.make_planner))
        });
        let provider = Provider::new(config.provider, execution)?;
        let stage = ParkingStage::new(provider, config.partition, config.fallback, vehicle);
        Ok(Self {
            stage,
            period_s,
            region: None,
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

    /// One cycle towards the goal; its candidates go to the buffer.
    fn provide(&mut self, scene: &Scene, region: &Arc<Region>) {
        let now_s = scene.now.seconds();
        if !self.is_due(now_s) {
            return;
        }
        let (Some(odometry), Some(acceleration)) = (&scene.odometry, &scene.acceleration) else { return };
        self.last_cycle_s = Some(now_s);
        let vehicle = vehicle_state(odometry, acceleration, self.gear);
        let obstacles = scene.objects.as_ref().map_or_else(Vec::new, |objects| obstacles(objects, scene.now));
        let input = StageInput { now_s, vehicle, region, in_check_stage: false, obstacles: &obstacles };
        let stage = &mut self.stage;
        // What a panic leaves behind is not used again: the goal is given up.
        match catch_unwind(AssertUnwindSafe(|| stage.step(&input))) {
            Ok(output) => {
                self.note(&output);
                let at = Placement { stamp: scene.now, frame_id: &odometry.header.frame_id, z: vehicle.z };
                self.add(Some(&output.command), &at);
            }
            Err(_) => {
                error!(
                    "the open-space provider panicked; its goal is given up. This is a defect, please report it"
                );
                self.set_region(None, &Placement { stamp: scene.now, frame_id: "", z: 0.0 });
            }
        }
    }

    fn add(&self, command: Option<&Command>, at: &Placement<'_>) {
        let message = Arc::new(to_message(command, at));
        self.buffer.do_send(Add { message, anchor: None });
    }

    fn set_region(&mut self, region: Option<Arc<Region>>, at: &Placement<'_>) {
        self.stage.restart();
        (self.region, self.last_cycle_s) = (region, None);
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
        let mut text = status.message();
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
        if let Some(region) = self.region.clone() {
            self.provide(&scene, &region);
        }
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
