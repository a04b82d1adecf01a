//! `autoware_internal_debug_msgs`: where the time went.

use crate::builtin_interfaces::Time;
use crate::define::message;

message! {
    /// One timed scope.
    #[derive(Default)]
    ProcessingTimeNode = "autoware_internal_debug_msgs/msg/ProcessingTimeNode" {
        /// From 1, in depth-first order.
        id: i32,
        /// Name of the scope.
        name: String,
        /// Time spent in it, ms, children included.
        processing_time: f64,
        /// Id of the scope around it; 0 at the root.
        parent_id: i32,
        /// A note, mostly empty.
        comment: String,
    }
}

message! {
    /// Nested timed scopes of one cycle.
    #[derive(Default)]
    ProcessingTimeTree = "autoware_internal_debug_msgs/msg/ProcessingTimeTree" {
        /// The scopes.
        nodes: Vec<ProcessingTimeNode>,
    }
}

message! {
    /// A number with its time.
    #[derive(Copy, Default)]
    Float64Stamped = "autoware_internal_debug_msgs/msg/Float64Stamped" {
        /// When.
        stamp: Time,
        /// The number.
        data: f64,
    }
}

message! {
    /// A text with its time.
    #[derive(Eq, Default)]
    StringStamped = "autoware_internal_debug_msgs/msg/StringStamped" {
        /// When.
        stamp: Time,
        /// The text.
        data: String,
    }
}
