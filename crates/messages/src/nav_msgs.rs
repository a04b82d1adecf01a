//! `nav_msgs`: where the vehicle is and how it moves, and which places are taken.

use crate::builtin_interfaces::Time;
use crate::define::message;
use crate::geometry_msgs::{Pose, PoseWithCovariance, TwistWithCovariance};
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

message! {
    /// Where the cells of a grid are.
    #[derive(Copy, Default)]
    MapMetaData = "nav_msgs/msg/MapMetaData" {
        /// Since when it is known.
        map_load_time: Time,
        /// Side of a cell, m.
        resolution: f32,
        /// Cells in a row.
        width: u32,
        /// Rows.
        height: u32,
        /// Corner of the first cell; the first row runs along its x axis.
        origin: Pose,
    }
}

message! {
    /// Cells with the probability that something is there.
    #[derive(Default)]
    OccupancyGrid = "nav_msgs/msg/OccupancyGrid" {
        /// Time and frame.
        header: Header,
        /// Where the cells are.
        info: MapMetaData,
        /// Row by row: 0 to 100 percent, -1 where nobody knows.
        data: Vec<i8>,
    }
}
