//! The cycle around the provider: provide, cut by gear, look out for moving obstacles, and remember what was published.
//!
//! One call of [`ParkingStage::step`] takes the vehicle's state and gives what it shall drive now. Whenever something is
//! amiss that is to stand still.

use std::sync::Arc;

use motion::VehicleInfo;

use crate::fallback::{Decision, FallbackParameters, PredictedCollision, PredictedObstacle, decide};
use crate::partition::{Followed, Part, PartitionError, PartitionParameters, Partitioner};
use crate::pose::Gear;
use crate::provider::{Frame, PreviousFrame, Provider, Provision, Region, Source, stop_trajectory};
use crate::stitcher::{DiscretizedTrajectory, PublishedTrajectory};
use crate::vehicle_model::VehicleState;

/// What a cycle starts from.
#[derive(Clone, Copy, Debug)]
pub struct StageInput<'a> {
    /// Now, s, on one clock for all cycles.
    pub now_s: f64,
    /// The vehicle.
    pub vehicle: VehicleState,
    /// Where to go, and between what.
    pub region: &'a Arc<Region>,
    /// Whether a vehicle that is about to leave its slot is still being checked.
    pub in_check_stage: bool,
    /// Road users that move; walls are the region's.
    pub obstacles: &'a [PredictedObstacle],
}

/// What the vehicle shall do.
#[derive(Clone, Debug, PartialEq)]
pub enum Command {
    /// Stand where it is; nothing if it is not known where that is.
    Stop(Option<DiscretizedTrajectory>),
    /// Follow a part of the plan. Times count from now, arc lengths from where it is.
    Follow(Part),
    /// Brake along the part for a moving obstacle. Times count from now, arc lengths from where it is.
    Brake {
        /// Braking to rest, and standing.
        trajectory: DiscretizedTrajectory,
        /// Gear of the part.
        gear: Gear,
        /// What for.
        collision: PredictedCollision,
    },
}

/// A cycle's result.
#[derive(Clone, Debug, PartialEq)]
pub struct StageOutput {
    /// What the vehicle shall do.
    pub command: Command,
    /// How the provider got there; its trajectory is in the command.
    pub provision: Provision,
    /// Why the plan cannot be followed, if there is one that cannot.
    pub lost: Option<PartitionError>,
}

/// The provider and the stages after it.
#[derive(Debug)]
pub struct ParkingStage {
    provider: Provider,
    partitioner: Partitioner,
    fallback: FallbackParameters,
    vehicle: VehicleInfo,
    previous: Option<PreviousFrame>,
    /// The vehicle has stopped before an obstacle: the next new plan begins where it stands.
    begins_anew: bool,
}

impl ParkingStage {
    /// A stage before its first cycle. The parameters must be in range ([`crate::provider::out_of_range`]).
    #[must_use]
    pub fn new(
        provider: Provider,
        partition: PartitionParameters,
        fallback: FallbackParameters,
        vehicle: VehicleInfo,
    ) -> Self {
        let partitioner = Partitioner::new(partition, vehicle);
        Self { provider, partitioner, fallback, vehicle, previous: None, begins_anew: false }
    }

    /// One cycle.
    pub fn step(&mut self, input: &StageInput<'_>) -> StageOutput {
        let frame = Frame {
            now_s: input.now_s,
            vehicle: input.vehicle,
            region: input.region,
            in_check_stage: input.in_check_stage,
            previous: self.previous.as_ref(),
        };
        let mut provision = self.provider.process(&frame);
        self.begins_anew |= provision.restarted;
        if provision.source == Source::Planned && std::mem::take(&mut self.begins_anew) {
            self.partitioner.restart();
        }
        let trajectory = std::mem::take(&mut provision.trajectory);
        if !provision.success() {
            let command = self.hold(input, Some(trajectory).filter(|stop| !stop.points.is_empty()));
            return StageOutput { command, provision, lost: None };
        }
        let due_s = input.now_s - provision.header_time_s;
        match self.partitioner.follow(&trajectory, due_s, &input.vehicle) {
            Ok(followed) => StageOutput { command: self.drive(input, followed), provision, lost: None },
            Err(lost) => StageOutput { command: self.hold(input, None), provision, lost: Some(lost) },
        }
    }

    /// The part if it is free, else a brake; either way the plan stays in use.
    fn drive(&mut self, input: &StageInput<'_>, followed: Followed) -> Command {
        let Followed { part, place, stitched, .. } = followed;
        let decision = decide(&self.fallback, &self.vehicle, &part, &input.vehicle, input.obstacles);
        let stitched = PublishedTrajectory { trajectory: stitched, header_time_s: input.now_s };
        if place + 1 == part.trajectory.points.len() {
            // The plan is driven to its end; the vehicle stands or is about to. Should the provider not find that it has
            // arrived, planning begins anew from where it stands.
            self.previous = Some(PreviousFrame { stitched, fallback: true, provider_success: true });
            return Command::Stop(self.stop_here(input));
        }
        let fallback = decision != Decision::Clear;
        self.previous = Some(PreviousFrame { stitched, fallback, provider_success: true });
        match decision {
            Decision::Clear => Command::Follow(part),
            Decision::Brake { collision, trajectory } => {
                Command::Brake { trajectory, gear: part.gear, collision }
            }
        }
    }

    /// Stands, and has nothing to follow until a new plan comes in. Nobody looks out for obstacles then, so planning
    /// begins anew from wherever the vehicle has come to rest.
    fn hold(&mut self, input: &StageInput<'_>, stop: Option<DiscretizedTrajectory>) -> Command {
        let stop = stop.or_else(|| self.stop_here(input));
        let stitched =
            PublishedTrajectory { trajectory: stop.clone().unwrap_or_default(), header_time_s: input.now_s };
        self.previous = Some(PreviousFrame { stitched, fallback: true, provider_success: false });
        Command::Stop(stop)
    }

    fn stop_here(&self, input: &StageInput<'_>) -> Option<DiscretizedTrajectory> {
        let standstill = self.provider.parameters().open_space_standstill_acceleration;
        input.vehicle.is_finite().then(|| stop_trajectory(&input.vehicle, standstill))
    }

    /// Makes ready for a new goal; waits until the running plan is called off.
    pub fn restart(&mut self) {
        self.provider.restart();
        self.partitioner.restart();
        (self.previous, self.begins_anew) = (None, false);
    }

    /// Ends planning; waits until the running plan is called off. From then on the vehicle is held.
    pub fn stop(&mut self) {
        self.provider.stop();
    }

    /// The provider.
    #[must_use]
    pub fn provider(&self) -> &Provider {
        &self.provider
    }
}

#[cfg(test)]
mod tests;
