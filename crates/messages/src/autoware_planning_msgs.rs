//! `autoware_planning_msgs`: trajectories and routes.

use crate::builtin_interfaces::Duration;
use crate::define::message;
use crate::geometry_msgs::Pose;
use crate::std_msgs::Header;
use crate::unique_identifier_msgs::Uuid;

message! {
    /// One sample of a trajectory. The reference point is the middle of the rear axle; the motion fields are f32 on
    /// the wire, and comparisons with f64 limits widen them.
    #[derive(Copy, Default)]
    TrajectoryPoint = "autoware_planning_msgs/msg/TrajectoryPoint" in blocks of 88 {
        /// Time after the stamp of the trajectory; negative for points of the past.
        time_from_start: Duration,
        /// Pose in the frame of the trajectory.
        pose: Pose,
        /// Forward speed, m/s; negative in reverse.
        longitudinal_velocity_mps: f32,
        /// Speed to the left, m/s.
        lateral_velocity_mps: f32,
        /// Longitudinal acceleration, m/s^2.
        acceleration_mps2: f32,
        /// Yaw rate, rad/s, counter-clockwise positive.
        heading_rate_rps: f32,
        /// Steering angle of the front wheels, rad, left positive.
        front_wheel_angle_rad: f32,
        /// Steering angle of the rear wheels, rad, left positive.
        rear_wheel_angle_rad: f32,
    }
}

message! {
    /// A planned motion.
    #[derive(Default)]
    Trajectory = "autoware_planning_msgs/msg/Trajectory" {
        /// Time of the start, and frame.
        header: Header,
        /// Samples in order of time.
        points: Vec<TrajectoryPoint>,
    }
}

message! {
    /// A part of a route: one lanelet, area or line of the map.
    #[derive(Eq, Default)]
    LaneletPrimitive = "autoware_planning_msgs/msg/LaneletPrimitive" {
        /// Id in the map.
        id: i64,
        /// Kind, for example `lane`.
        primitive_type: String,
    }
}

message! {
    /// Side by side primitives of a route, the preferred one singled out.
    #[derive(Eq, Default)]
    LaneletSegment = "autoware_planning_msgs/msg/LaneletSegment" {
        /// Where the vehicle shall drive.
        preferred_primitive: LaneletPrimitive,
        /// Where it may drive.
        primitives: Vec<LaneletPrimitive>,
    }
}

message! {
    /// The route from start to goal.
    #[derive(Default)]
    LaneletRoute = "autoware_planning_msgs/msg/LaneletRoute" {
        /// Time and frame.
        header: Header,
        /// Start in the map frame.
        start_pose: Pose,
        /// Goal in the map frame.
        goal_pose: Pose,
        /// Segments in driving order.
        segments: Vec<LaneletSegment>,
        /// Identity of the route.
        uuid: Uuid,
        /// True if the goal may be moved.
        allow_modification: bool,
    }
}
