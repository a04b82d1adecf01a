//! The topics of the node: names, types and quality of service, in one place.

use lanelet_map::Map;
use messages::Message;
use messages::autoware_internal_debug_msgs::{Float64Stamped, ProcessingTimeTree, StringStamped};
use messages::autoware_internal_planning_msgs::{
    CandidateTrajectories, PlanningFactorArray, ScoredCandidateTrajectories,
};
use messages::autoware_map_msgs::LaneletMapBin;
use messages::autoware_perception_msgs::{PredictedObjects, TrafficLightGroupArray};
use messages::autoware_planning_msgs::{LaneletRoute, Trajectory};
use messages::autoware_trajectory_validator::ValidationReportArray;
use messages::autoware_vehicle_msgs::TurnIndicatorsCommand;
use messages::diagnostic_msgs::DiagnosticArray;
use messages::geometry_msgs::{AccelWithCovarianceStamped, PoseStamped};
use messages::nav_msgs::{OccupancyGrid, Odometry};
use messages::{DecodeError, Interface};
use selection::report::PLANNING_MODULE;
use std::sync::Arc;

/// Name of the node.
pub const NODE_NAME: &str = "trajectory_selector_node";

/// A topic that the node listens to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum InputTopic {
    /// HD map.
    Map,
    /// Route.
    Route,
    /// Candidates that start a cycle: the anchor.
    Generative,
    /// Candidates that wait for the next cycle.
    Backup,
    /// Pose and velocity of the own vehicle.
    Odometry,
    /// Acceleration of the own vehicle.
    Acceleration,
    /// Other road users.
    Objects,
    /// Traffic lights.
    TrafficSignals,
    /// Where the open-space provider shall take the vehicle.
    GoalPose,
    /// Which places are taken, for the open-space provider.
    OccupancyGrid,
}

impl InputTopic {
    /// Every input of the selector.
    pub const ALL: [Self; 8] = [
        Self::Map,
        Self::Route,
        Self::Generative,
        Self::Backup,
        Self::Odometry,
        Self::Acceleration,
        Self::Objects,
        Self::TrafficSignals,
    ];

    /// What the open-space provider needs beside them.
    pub const OPEN_SPACE: [Self; 2] = [Self::GoalPose, Self::OccupancyGrid];

    /// All inputs, of the selector and the open-space provider.
    pub fn every() -> impl Iterator<Item = Self> {
        Self::ALL.into_iter().chain(Self::OPEN_SPACE)
    }

    /// Name below `~/input/`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Map => "lanelet2_map",
            Self::Route => "route",
            Self::Generative => "trajectories_generative",
            Self::Backup => "trajectories_backup",
            Self::Odometry => "odometry",
            Self::Acceleration => "acceleration",
            Self::Objects => "objects",
            Self::TrafficSignals => "traffic_signals",
            Self::GoalPose => "goal_pose",
            Self::OccupancyGrid => "occupancy_grid",
        }
    }

    /// Full name for the node in the root namespace.
    #[must_use]
    pub fn full_name(self) -> String {
        format!("/{NODE_NAME}/input/{}", self.name())
    }

    /// Name as the node itself says it, before remapping.
    #[must_use]
    pub fn ros_name(self) -> String {
        format!("~/input/{}", self.name())
    }

    /// ROS type.
    #[must_use]
    pub fn type_name(self) -> &'static str {
        match self {
            Self::Map => LaneletMapBin::TYPE_NAME,
            Self::Route => LaneletRoute::TYPE_NAME,
            Self::Generative | Self::Backup => CandidateTrajectories::TYPE_NAME,
            Self::Odometry => Odometry::TYPE_NAME,
            Self::Acceleration => AccelWithCovarianceStamped::TYPE_NAME,
            Self::Objects => PredictedObjects::TYPE_NAME,
            Self::TrafficSignals => TrafficLightGroupArray::TYPE_NAME,
            Self::GoalPose => PoseStamped::TYPE_NAME,
            Self::OccupancyGrid => OccupancyGrid::TYPE_NAME,
        }
    }

    /// Decodes a message of this topic.
    ///
    /// # Errors
    /// The bytes are not such a message.
    pub fn decode(self, bytes: &[u8], interface: Interface) -> Result<Input, DecodeError> {
        let topic = self.full_name();
        Ok(match self {
            Self::Map => Input::Map(read(bytes, interface, &topic)?),
            Self::Route => Input::Route(read(bytes, interface, &topic)?),
            Self::Generative => Input::Generative(read(bytes, interface, &topic)?),
            Self::Backup => Input::Backup(read(bytes, interface, &topic)?),
            Self::Odometry => Input::Odometry(read(bytes, interface, &topic)?),
            Self::Acceleration => Input::Acceleration(read(bytes, interface, &topic)?),
            Self::Objects => Input::Objects(read(bytes, interface, &topic)?),
            Self::TrafficSignals => Input::TrafficSignals(read(bytes, interface, &topic)?),
            Self::GoalPose => Input::GoalPose(read(bytes, interface, &topic)?),
            Self::OccupancyGrid => Input::OccupancyGrid(read(bytes, interface, &topic)?),
        })
    }
}

fn read<M: Message>(bytes: &[u8], interface: Interface, topic: &str) -> Result<Arc<M>, DecodeError> {
    M::from_cdr(bytes, interface, topic).map(Arc::new)
}

/// A message that came in.
#[derive(Debug, Clone)]
pub enum Input {
    /// HD map as an archive; decoded off the actors.
    Map(Arc<LaneletMapBin>),
    /// HD map from elsewhere, ready to use, in its frame.
    ReadyMap(Arc<Map>, Arc<str>),
    /// Route.
    Route(Arc<LaneletRoute>),
    /// Candidates that start a cycle.
    Generative(Arc<CandidateTrajectories>),
    /// Candidates that wait for the next cycle.
    Backup(Arc<CandidateTrajectories>),
    /// Pose and velocity of the own vehicle.
    Odometry(Arc<Odometry>),
    /// Acceleration of the own vehicle.
    Acceleration(Arc<AccelWithCovarianceStamped>),
    /// Other road users.
    Objects(Arc<PredictedObjects>),
    /// Traffic lights.
    TrafficSignals(Arc<TrafficLightGroupArray>),
    /// Where the open-space provider shall take the vehicle.
    GoalPose(Arc<PoseStamped>),
    /// Which places are taken.
    OccupancyGrid(Arc<OccupancyGrid>),
}

impl Input {
    /// The topic that it belongs to.
    #[must_use]
    pub fn topic(&self) -> InputTopic {
        match self {
            Self::Map(_) | Self::ReadyMap(..) => InputTopic::Map,
            Self::Route(_) => InputTopic::Route,
            Self::Generative(_) => InputTopic::Generative,
            Self::Backup(_) => InputTopic::Backup,
            Self::Odometry(_) => InputTopic::Odometry,
            Self::Acceleration(_) => InputTopic::Acceleration,
            Self::Objects(_) => InputTopic::Objects,
            Self::TrafficSignals(_) => InputTopic::TrafficSignals,
            Self::GoalPose(_) => InputTopic::GoalPose,
            Self::OccupancyGrid(_) => InputTopic::OccupancyGrid,
        }
    }

    /// The serialised message; `None` for a map that came from elsewhere than a message.
    #[must_use]
    pub fn to_cdr(&self, interface: Interface) -> Option<Vec<u8>> {
        Some(match self {
            Self::ReadyMap(..) => return None,
            Self::Map(message) => message.to_cdr(interface),
            Self::Route(message) => message.to_cdr(interface),
            Self::Generative(message) | Self::Backup(message) => message.to_cdr(interface),
            Self::Odometry(message) => message.to_cdr(interface),
            Self::Acceleration(message) => message.to_cdr(interface),
            Self::Objects(message) => message.to_cdr(interface),
            Self::TrafficSignals(message) => message.to_cdr(interface),
            Self::GoalPose(message) => message.to_cdr(interface),
            Self::OccupancyGrid(message) => message.to_cdr(interface),
        })
    }
}

/// A topic that the node publishes on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum OutputTopic {
    /// The validated set, under its first name.
    Trajectories,
    /// All fresh candidates.
    ConcatenatedTrajectories,
    /// The validated set.
    ValidatedTrajectories,
    /// The accepted candidates that can be ranked, with their scores.
    ScoredTrajectories,
    /// The best of them: what is to be driven.
    Trajectory,
    /// What the open-space provider says, if it was accepted; only where there is a provider.
    OpenSpaceTrajectory,
    /// What the turn indicators shall do meanwhile; only where candidates carry a command.
    TurnIndicators,
    /// How old the trajectory is when it leaves.
    Latency,
    /// What was found about each candidate.
    ValidationReports,
    /// Why planners would have to do something about the candidates.
    PlanningFactors,
    /// Health of the node.
    Diagnostics,
    /// Time of a whole validation.
    ProcessingTime,
    /// Time of one filter, by its name.
    FilterProcessingTime(&'static str),
    /// The times as text.
    ProcessingTimeText,
    /// Nested times of a cycle.
    ProcessingTimeTree,
}

impl OutputTopic {
    /// Full name for the node in the root namespace.
    #[must_use]
    pub fn full_name(self) -> String {
        match self {
            Self::Diagnostics => "/diagnostics".to_owned(),
            Self::PlanningFactors => format!("/planning/planning_factors/{PLANNING_MODULE}"),
            Self::FilterProcessingTime(filter) => format!("/{NODE_NAME}/debug/{filter}/processing_time_ms"),
            other => format!("/{NODE_NAME}/{}", other.private_name()),
        }
    }

    /// Every topic that a node with these filters (in order of evaluation) publishes on, in the order of a cycle.
    /// Without a command in the candidates there is none for the turn indicators. A node with an open-space provider
    /// has one more.
    #[must_use]
    pub fn all(interface: Interface, filters: &[&'static str]) -> Vec<Self> {
        let mut topics = vec![
            Self::ConcatenatedTrajectories,
            Self::ValidationReports,
            Self::PlanningFactors,
            Self::Diagnostics,
            Self::ProcessingTime,
        ];
        topics.extend(filters.iter().map(|filter| Self::FilterProcessingTime(filter)));
        topics.extend([
            Self::ProcessingTimeText,
            Self::Trajectories,
            Self::ValidatedTrajectories,
            Self::ScoredTrajectories,
            Self::Latency,
            Self::Trajectory,
        ]);
        topics.extend(interface.has_turn_indicators().then_some(Self::TurnIndicators));
        topics.push(Self::ProcessingTimeTree);
        topics
    }

    /// Name as the node itself says it: private (`~/..`), or absolute where all nodes share the topic.
    #[must_use]
    pub fn ros_name(self) -> String {
        match self {
            Self::Diagnostics | Self::PlanningFactors => self.full_name(),
            Self::FilterProcessingTime(filter) => format!("~/debug/{filter}/processing_time_ms"),
            other => format!("~/{}", other.private_name()),
        }
    }

    /// True for what only people look at.
    #[must_use]
    pub fn is_debug(self) -> bool {
        match self {
            Self::ValidationReports
            | Self::ProcessingTime
            | Self::FilterProcessingTime(_)
            | Self::ProcessingTimeText
            | Self::ProcessingTimeTree => true,
            Self::Trajectories
            | Self::ConcatenatedTrajectories
            | Self::ValidatedTrajectories
            | Self::ScoredTrajectories
            | Self::Trajectory
            | Self::OpenSpaceTrajectory
            | Self::TurnIndicators
            | Self::Latency
            | Self::PlanningFactors
            | Self::Diagnostics => false,
        }
    }

    /// ROS type.
    #[must_use]
    pub fn type_name(self) -> &'static str {
        match self {
            Self::Trajectories | Self::ConcatenatedTrajectories | Self::ValidatedTrajectories => {
                CandidateTrajectories::TYPE_NAME
            }
            Self::ScoredTrajectories => ScoredCandidateTrajectories::TYPE_NAME,
            Self::Trajectory | Self::OpenSpaceTrajectory => Trajectory::TYPE_NAME,
            Self::TurnIndicators => TurnIndicatorsCommand::TYPE_NAME,
            Self::ValidationReports => ValidationReportArray::TYPE_NAME,
            Self::PlanningFactors => PlanningFactorArray::TYPE_NAME,
            Self::Diagnostics => DiagnosticArray::TYPE_NAME,
            Self::Latency | Self::ProcessingTime | Self::FilterProcessingTime(_) => Float64Stamped::TYPE_NAME,
            Self::ProcessingTimeText => StringStamped::TYPE_NAME,
            Self::ProcessingTimeTree => ProcessingTimeTree::TYPE_NAME,
        }
    }

    fn private_name(self) -> &'static str {
        match self {
            Self::Trajectories => "output/trajectories",
            Self::ConcatenatedTrajectories => "output/concatenated_trajectories",
            Self::ValidatedTrajectories => "output/validated_trajectories",
            Self::ScoredTrajectories => "output/scored_trajectories",
            Self::Trajectory => "output/trajectory",
            Self::OpenSpaceTrajectory => "output/open_space_trajectory",
            Self::TurnIndicators => "output/turn_indicators",
            Self::Latency => "debug/planning_component_latency_s",
            Self::ValidationReports => "debug/validation_reports",
            Self::PlanningFactors => "planning_factors",
            Self::ProcessingTime | Self::FilterProcessingTime(_) => "debug/processing_time_ms",
            Self::ProcessingTimeText => "debug/processing_time_text",
            Self::ProcessingTimeTree => "debug/processing_time_detail_ms/trajectory_selector",
            Self::Diagnostics => "diagnostics",
        }
    }

    /// How many messages a late or slow reader may find: 1, but 10 for diagnostics.
    #[must_use]
    pub fn depth(self) -> u32 {
        if self == Self::Diagnostics { 10 } else { 1 }
    }
}

/// A message on its way out. Cheap to clone.
#[derive(Debug, Clone)]
pub enum OutputMessage {
    /// A set of candidates.
    Candidates(Arc<CandidateTrajectories>),
    /// Candidates with scores.
    Scored(Arc<ScoredCandidateTrajectories>),
    /// A trajectory to drive.
    Trajectory(Arc<Trajectory>),
    /// A command to the turn indicators.
    TurnIndicators(TurnIndicatorsCommand),
    /// Planning factors.
    PlanningFactors(Arc<PlanningFactorArray>),
    /// Validation reports.
    Reports(Arc<ValidationReportArray>),
    /// Diagnostics.
    Diagnostics(Arc<DiagnosticArray>),
    /// A number.
    Number(Float64Stamped),
    /// A text.
    Text(Arc<StringStamped>),
    /// Nested times.
    Times(Arc<ProcessingTimeTree>),
}

impl OutputMessage {
    /// ROS type.
    #[must_use]
    pub fn type_name(&self) -> &'static str {
        match self {
            Self::Candidates(_) => CandidateTrajectories::TYPE_NAME,
            Self::Scored(_) => ScoredCandidateTrajectories::TYPE_NAME,
            Self::Trajectory(_) => Trajectory::TYPE_NAME,
            Self::TurnIndicators(_) => TurnIndicatorsCommand::TYPE_NAME,
            Self::PlanningFactors(_) => PlanningFactorArray::TYPE_NAME,
            Self::Reports(_) => ValidationReportArray::TYPE_NAME,
            Self::Diagnostics(_) => DiagnosticArray::TYPE_NAME,
            Self::Number(_) => Float64Stamped::TYPE_NAME,
            Self::Text(_) => StringStamped::TYPE_NAME,
            Self::Times(_) => ProcessingTimeTree::TYPE_NAME,
        }
    }

    /// Definition text of the type.
    #[must_use]
    pub fn definition(&self, interface: Interface) -> String {
        match self {
            Self::Candidates(_) => CandidateTrajectories::definition(interface),
            Self::Scored(_) => ScoredCandidateTrajectories::definition(interface),
            Self::Trajectory(_) => Trajectory::definition(interface),
            Self::TurnIndicators(_) => TurnIndicatorsCommand::definition(interface),
            Self::PlanningFactors(_) => PlanningFactorArray::definition(interface),
            Self::Reports(_) => ValidationReportArray::definition(interface),
            Self::Diagnostics(_) => DiagnosticArray::definition(interface),
            Self::Number(_) => Float64Stamped::definition(interface),
            Self::Text(_) => StringStamped::definition(interface),
            Self::Times(_) => ProcessingTimeTree::definition(interface),
        }
    }

    /// The serialised message.
    #[must_use]
    pub fn to_cdr(&self, interface: Interface) -> Vec<u8> {
        match self {
            Self::Candidates(message) => message.to_cdr(interface),
            Self::Scored(message) => message.to_cdr(interface),
            Self::Trajectory(message) => message.to_cdr(interface),
            Self::TurnIndicators(message) => message.to_cdr(interface),
            Self::PlanningFactors(message) => message.to_cdr(interface),
            Self::Reports(message) => message.to_cdr(interface),
            Self::Diagnostics(message) => message.to_cdr(interface),
            Self::Number(message) => message.to_cdr(interface),
            Self::Text(message) => message.to_cdr(interface),
            Self::Times(message) => message.to_cdr(interface),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_those_of_the_upstream_node() {
        assert_eq!(InputTopic::Map.full_name(), "/trajectory_selector_node/input/lanelet2_map");
        assert_eq!(OutputTopic::Trajectories.full_name(), "/trajectory_selector_node/output/trajectories");
        let times = OutputTopic::ProcessingTimeTree.full_name();
        assert_eq!(times, "/trajectory_selector_node/debug/processing_time_detail_ms/trajectory_selector");
        let filter = OutputTopic::FilterProcessingTime("vehicle_constraint_filter").full_name();
        assert_eq!(filter, "/trajectory_selector_node/debug/vehicle_constraint_filter/processing_time_ms");
        assert_eq!(OutputTopic::Diagnostics.full_name(), "/diagnostics");
    }

    #[test]
    fn names_before_and_after_expansion_agree() {
        let expand = |name: String| name.replace('~', &format!("/{NODE_NAME}"));
        for topic in OutputTopic::all(Interface::V0_53, &["vehicle_constraint_filter"]) {
            assert_eq!(expand(topic.ros_name()), topic.full_name());
        }
        for topic in InputTopic::every() {
            assert_eq!(expand(topic.ros_name()), topic.full_name());
        }
    }

    #[test]
    fn a_malformed_input_names_its_topic() {
        let error = InputTopic::Odometry.decode(&[0, 1, 0, 0, 7], Interface::V0_53).unwrap_err();
        assert!(
            error.to_string().starts_with("/trajectory_selector_node/input/odometry: malformed nav_msgs")
        );
    }
}
