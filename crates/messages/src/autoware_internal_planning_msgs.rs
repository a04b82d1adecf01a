//! `autoware_internal_planning_msgs`: candidate trajectories, scores and planning factors.

use crate::autoware_perception_msgs::PredictedPath;
use crate::autoware_planning_msgs::TrajectoryPoint;
use crate::autoware_vehicle_msgs::TurnIndicatorsCommand;
use crate::define::message;
use crate::geometry_msgs::{Point, Pose};
use crate::std_msgs::{Header, Text};
use crate::unique_identifier_msgs::Uuid;
use std::sync::Arc;

message! {
    /// A planner that makes candidates.
    #[derive(Eq, Default)]
    GeneratorInfo = "autoware_internal_planning_msgs/msg/GeneratorInfo" {
        /// Identity of the planner.
        generator_id: Uuid,
        /// Its name; the prefix tells its kind.
        generator_name: Text,
    }
}

message! {
    /// One trajectory that a planner proposes.
    #[derive(Default)]
    CandidateTrajectory = "autoware_internal_planning_msgs/msg/CandidateTrajectory" {
        /// Time of the start, and frame of the points.
        header: Header,
        /// Planner that made it.
        generator_id: Uuid,
        /// Samples in order of time.
        points: Vec<TrajectoryPoint>,
        /// What the turn indicators shall do meanwhile; `NO_COMMAND` in interface 0.52.
        #[since(V0_53)]
        turn_indicators_command: TurnIndicatorsCommand,
    }
}

message! {
    /// The proposals of one or more planners.
    #[derive(Default)]
    CandidateTrajectories = "autoware_internal_planning_msgs/msg/CandidateTrajectories" {
        /// The proposals.
        candidate_trajectories: Vec<Arc<CandidateTrajectory>>,
        /// The planners.
        generator_info: Vec<GeneratorInfo>,
    }
}

message! {
    /// A proposal with its rank value.
    #[derive(Default)]
    ScoredCandidateTrajectory = "autoware_internal_planning_msgs/msg/ScoredCandidateTrajectory" {
        /// The proposal.
        candidate_trajectory: Arc<CandidateTrajectory>,
        /// Larger is better; meant to lie in 0..1, not enforced.
        score: f32,
    }
}

message! {
    /// Ranked proposals.
    #[derive(Default)]
    ScoredCandidateTrajectories = "autoware_internal_planning_msgs/msg/ScoredCandidateTrajectories" {
        /// The proposals in input order.
        scored_candidate_trajectories: Vec<ScoredCandidateTrajectory>,
        /// The planners.
        generator_info: Vec<GeneratorInfo>,
    }
}

message! {
    /// A place on the path where a planning factor acts.
    #[derive(Copy, Default)]
    ControlPoint = "autoware_internal_planning_msgs/msg/ControlPoint" {
        /// Where.
        pose: Pose,
        /// Speed there, m/s.
        velocity: f32,
        /// Lateral shift there, m.
        shift_length: f32,
        /// Distance to it along the path, m.
        distance: f32,
    }
}

message! {
    /// One reason for which a motion is safe or not.
    #[derive(Default)]
    SafetyFactor = "autoware_internal_planning_msgs/msg/SafetyFactor" {
        /// One of the constants.
        r#type: u16,
        /// The object, if it is one.
        object_id: Uuid,
        /// The motion assumed for it.
        predicted_path: PredictedPath,
        /// Start of the conflict, s.
        ttc_begin: f32,
        /// End of the conflict, s.
        ttc_end: f32,
        /// Places of the conflict.
        points: Vec<Point>,
        /// True if it does no harm.
        is_safe: bool,
    }
    constants {
        /// Not known.
        UNKNOWN: u16 = 0,
        /// A point cloud.
        POINTCLOUD: u16 = 1,
        /// A tracked object.
        OBJECT: u16 = 2,
    }
}

message! {
    /// Reasons for which a motion is safe or not.
    #[derive(Default)]
    SafetyFactorArray = "autoware_internal_planning_msgs/msg/SafetyFactorArray" {
        /// Time and frame.
        header: Header,
        /// The reasons.
        factors: Vec<SafetyFactor>,
        /// True if all are safe.
        is_safe: bool,
        /// In words.
        detail: String,
    }
}

message! {
    /// Why a planner does what it does.
    #[derive(Default)]
    PlanningFactor = "autoware_internal_planning_msgs/msg/PlanningFactor" {
        /// Module that gives the reason.
        module: String,
        /// False in reverse.
        is_driving_forward: bool,
        /// Where it acts.
        control_points: Vec<ControlPoint>,
        /// One of the constants.
        behavior: u16,
        /// In words.
        detail: String,
        /// Objects and places behind it.
        safety_factors: SafetyFactorArray,
    }
    constants {
        /// Not known.
        UNKNOWN: u16 = 0,
        /// No effect.
        NONE: u16 = 1,
        /// Slower.
        SLOW_DOWN: u16 = 2,
        /// Stop.
        STOP: u16 = 3,
        /// Move to the left within the lane.
        SHIFT_LEFT: u16 = 4,
        /// Move to the right within the lane.
        SHIFT_RIGHT: u16 = 5,
        /// Turn left.
        TURN_LEFT: u16 = 6,
        /// Turn right.
        TURN_RIGHT: u16 = 7,
    }
}

message! {
    /// Planning factors of one cycle.
    #[derive(Default)]
    PlanningFactorArray = "autoware_internal_planning_msgs/msg/PlanningFactorArray" {
        /// Time and frame.
        header: Header,
        /// The factors.
        factors: Vec<PlanningFactor>,
    }
}
