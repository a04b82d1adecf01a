//! The way in for messages that arrive at any time, from any thread.
//!
//! Of a sensor only the newest message matters: it waits in a slot until a cycle asks, and a newer one takes its place;
//! however fast a sensor is, no mailbox grows. Candidates are another matter: none is ever skipped. Whoever brings one
//! waits until the buffer has taken it, so a flood queues up where it comes from, within the bounds that hold there.

use crate::buffer::{Add, Buffer};
use crate::provider::{OpenSpace, SetGoal};
use crate::sensors::{Sense, Sensors};
use crate::tally::{DropReason, Tally};
use crate::topics::{Input, InputTopic};
use actix::Addr;
use messages::autoware_perception_msgs::{PredictedObjects, TrafficLightGroupArray};
use messages::geometry_msgs::AccelWithCovarianceStamped;
use messages::nav_msgs::{OccupancyGrid, Odometry};
use selection::Scene;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

/// The node no longer takes messages.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the selector has stopped")]
pub struct Closed;

/// Holds the newest message until somebody takes it.
#[derive(Debug)]
struct Slot<T>(Mutex<Option<Arc<T>>>);

impl<T> Default for Slot<T> {
    fn default() -> Self {
        Self(Mutex::default())
    }
}

impl<T> Slot<T> {
    /// True if an older message is dropped.
    fn put(&self, message: Arc<T>) -> bool {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).replace(message).is_some()
    }

    /// Replaces `known` if there is something newer.
    fn take_into(&self, known: &mut Option<Arc<T>>) {
        if let Some(newer) = self.0.lock().unwrap_or_else(PoisonError::into_inner).take() {
            *known = Some(newer);
        }
    }
}

/// The newest messages of the sensors that no cycle has seen yet.
#[derive(Debug, Default)]
pub(crate) struct SensorSlots {
    odometry: Slot<Odometry>,
    acceleration: Slot<AccelWithCovarianceStamped>,
    objects: Slot<PredictedObjects>,
    traffic_signals: Slot<TrafficLightGroupArray>,
    occupancy_grid: Slot<OccupancyGrid>,
}

impl SensorSlots {
    #[cfg(test)]
    pub(crate) fn put_odometry(&self, odometry: Odometry) {
        self.odometry.put(Arc::new(odometry));
    }

    #[cfg(test)]
    pub(crate) fn put_grid(&self, grid: OccupancyGrid) {
        self.occupancy_grid.put(Arc::new(grid));
    }

    /// Brings the scene up to date.
    pub(crate) fn take_into(&self, scene: &mut Scene) {
        self.odometry.take_into(&mut scene.odometry);
        self.acceleration.take_into(&mut scene.acceleration);
        self.objects.take_into(&mut scene.objects);
        self.traffic_signals.take_into(&mut scene.traffic_signals);
    }

    /// Replaces `known` if there is a newer grid.
    pub(crate) fn take_grid_into(&self, known: &mut Option<Arc<OccupancyGrid>>) {
        self.occupancy_grid.take_into(known);
    }
}

/// A handle for whoever brings messages. Cheap to clone.
#[derive(Debug, Clone)]
pub struct Inlets {
    slots: Arc<SensorSlots>,
    tally: Arc<Tally>,
    buffer: Addr<Buffer>,
    sensors: Addr<Sensors>,
    provider: Option<Addr<OpenSpace>>,
}

impl Inlets {
    pub(crate) fn new(
        slots: Arc<SensorSlots>,
        tally: Arc<Tally>,
        buffer: Addr<Buffer>,
        sensors: Addr<Sensors>,
        provider: Option<Addr<OpenSpace>>,
    ) -> Self {
        Self { slots, tally, buffer, sensors, provider }
    }

    /// Takes in a message that arrived at `arrived`. Returns at once for a sensor; for candidates, a map or a route when
    /// their owner has them.
    ///
    /// # Errors
    /// The node has stopped.
    pub async fn take(&self, input: Input, arrived: Instant) -> Result<(), Closed> {
        self.tally.count_received(input.topic());
        let _waiting = self.tally.wait();
        let taken = match input {
            Input::Generative(message) => self.buffer.send(Add { message, anchor: Some(arrived) }).await,
            Input::Backup(message) => self.buffer.send(Add { message, anchor: None }).await,
            Input::Map(_) | Input::ReadyMap(..) | Input::Route(_) => self.sensors.send(Sense(input)).await,
            Input::GoalPose(goal) => match &self.provider {
                Some(provider) => provider.send(SetGoal(goal)).await,
                None => Ok(()),
            },
            sensor => {
                self.put(sensor);
                Ok(())
            }
        };
        taken.map_err(|_| Closed)
    }

    /// Puts a message of a sensor into its slot; others do not come this way.
    pub(crate) fn put(&self, input: Input) {
        let topic = input.topic();
        let superseded = match input {
            Input::Odometry(message) => self.slots.odometry.put(message),
            Input::Acceleration(message) => self.slots.acceleration.put(message),
            Input::Objects(message) => self.slots.objects.put(message),
            Input::TrafficSignals(message) => self.slots.traffic_signals.put(message),
            Input::OccupancyGrid(message) => self.slots.occupancy_grid.put(message),
            Input::Generative(_)
            | Input::Backup(_)
            | Input::Map(_)
            | Input::ReadyMap(..)
            | Input::Route(_)
            | Input::GoalPose(_) => false,
        };
        if superseded {
            self.tally.count_dropped(topic, DropReason::Superseded, 1);
        }
    }

    /// Counts messages that came in but are of no use, or that were sent and never came.
    pub fn count_dropped(&self, topic: InputTopic, reason: DropReason, messages: u64) {
        if reason != DropReason::Lost {
            self.tally.count_received(topic);
        }
        self.tally.count_dropped(topic, reason, messages);
    }

    /// What came in, and what was lost.
    #[must_use]
    pub fn tally(&self) -> &Arc<Tally> {
        &self.tally
    }
}
