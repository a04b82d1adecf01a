//! What the world looked like at the start of a cycle: one immutable snapshot for all filters and candidates.

use crate::survey::Survey;
use lanelet_map::Map;
use messages::autoware_perception_msgs::{PredictedObjects, TrafficLightGroupArray};
use messages::autoware_planning_msgs::LaneletRoute;
use messages::builtin_interfaces::Time;
use messages::geometry_msgs::AccelWithCovarianceStamped;
use messages::nav_msgs::Odometry;
use motion::VehicleInfo;
use std::fmt;
use std::sync::Arc;

/// A value that is replaced as a whole; the epoch grows with each replacement, so that whoever derived something from
/// the value knows when to derive it anew.
#[derive(Debug, Clone)]
pub struct Epoch<T> {
    /// Number of the replacement, from 1.
    pub number: u64,
    /// The value.
    pub value: T,
}

/// The HD map as it was announced.
#[derive(Debug, Clone)]
pub struct HdMap {
    /// Frame that its coordinates hold in; candidates in another frame cannot be judged against it.
    pub frame_id: Arc<str>,
    /// The map.
    pub map: Arc<Map>,
    /// What filters have derived from it.
    pub(crate) survey: Arc<Survey>,
}

impl HdMap {
    /// A map in a frame. Filters derive what they need of it when they first see it, unless
    /// [`prepare_map`](crate::filters::prepare_map) has done so before.
    #[must_use]
    pub fn new(frame_id: Arc<str>, map: Arc<Map>) -> Self {
        Self { frame_id, map, survey: Arc::default() }
    }
}

/// An input without which no cycle may publish.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum MissingInput {
    /// No odometry was ever received.
    Odometry,
    /// No predicted objects were ever received.
    Objects,
    /// No acceleration was ever received.
    Acceleration,
    /// No map was ever received, or none could be decoded.
    Map,
    /// The map has no lanelet.
    Lanelets,
}

impl MissingInput {
    /// Every input, in the order in which they are asked for.
    pub const ALL: [Self; 5] = [Self::Odometry, Self::Objects, Self::Acceleration, Self::Map, Self::Lanelets];

    /// Stable snake_case name for reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Odometry => "odometry",
            Self::Objects => "objects",
            Self::Acceleration => "acceleration",
            Self::Map => "lanelet2_map",
            Self::Lanelets => "lanelets",
        }
    }
}

impl fmt::Display for MissingInput {
    /// The text that the node logs, as upstream does.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Odometry => "Failed to take odometry data",
            Self::Objects => "Failed to take predicted objects data",
            Self::Acceleration => "Failed to take acceleration data",
            Self::Map => "Lanelet map is not available",
            Self::Lanelets => "Lanelet map does not contain any lanelets",
        })
    }
}

/// One instant of the world. Inputs never expire: each is the newest ever received.
#[derive(Debug, Clone)]
pub struct Scene {
    /// Time of the cycle on the node's clock.
    pub now: Time,
    /// The own vehicle.
    pub vehicle: Arc<VehicleInfo>,
    /// Pose and velocity of the own vehicle.
    pub odometry: Option<Arc<Odometry>>,
    /// Acceleration of the own vehicle.
    pub acceleration: Option<Arc<AccelWithCovarianceStamped>>,
    /// Other road users.
    pub objects: Option<Arc<PredictedObjects>>,
    /// Traffic lights; a running node substitutes an empty message while none was received.
    pub traffic_signals: Option<Arc<TrafficLightGroupArray>>,
    /// HD map.
    pub map: Option<Epoch<HdMap>>,
    /// Route.
    pub route: Option<Epoch<Arc<LaneletRoute>>>,
}

impl Scene {
    /// A scene in which nothing was received yet.
    #[must_use]
    pub fn empty(now: Time, vehicle: Arc<VehicleInfo>) -> Self {
        Self {
            now,
            vehicle,
            odometry: None,
            acceleration: None,
            objects: None,
            traffic_signals: None,
            map: None,
            route: None,
        }
    }

    /// The first mandatory input that is missing, in upstream's order.
    #[must_use]
    pub fn missing_input(&self) -> Option<MissingInput> {
        MissingInput::ALL.into_iter().find(|input| match input {
            MissingInput::Odometry => self.odometry.is_none(),
            MissingInput::Objects => self.objects.is_none(),
            MissingInput::Acceleration => self.acceleration.is_none(),
            MissingInput::Map => self.map.is_none(),
            MissingInput::Lanelets => {
                self.map.as_ref().is_some_and(|map| map.value.map.lanelets().len() == 0)
            }
        })
    }

    /// Frame of the map, if there is one and it names its frame.
    #[must_use]
    pub fn frame_id(&self) -> Option<&str> {
        self.map.as_ref().map(|map| &*map.value.frame_id).filter(|frame| !frame.is_empty())
    }
}
