//! `nav_msgs`: where the vehicle is and how it moves.

use crate::define::message;
use crate::geometry_msgs::{PoseWithCovariance, TwistWithCovariance};
use crate::std_msgs::Header;

message! {
    /// Pose of the vehicle in the map frame, velocity in its body frame.
    #[derive(Default)]
    Odometry = "nav_msgs/msg/Odometry" {
        /// Time, and frame of the pose.
        header: Header,
        /// Frame of the velocity.
        child_frame_id: String,
        /// Pose of the middle of the rear axle.
        pose: PoseWithCovariance,
        /// Velocity in the body frame, forward positive.
        twist: TwistWithCovariance,
    }
}
