//! `rosgraph_msgs`: simulated time.

use crate::builtin_interfaces::Time;
use crate::define::message;

message! {
    /// The time that the graph agrees on when it runs on simulated time.
    #[derive(Copy, Eq, Default)]
    Clock = "rosgraph_msgs/msg/Clock" {
        /// Now.
        clock: Time,
    }
}
