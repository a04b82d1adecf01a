//! `autoware_vehicle_msgs`: commands to the body of the vehicle.

use crate::builtin_interfaces::Time;
use crate::define::message;

message! {
    /// What the turn indicators shall do.
    #[derive(Copy, Eq, Default)]
    TurnIndicatorsCommand = "autoware_vehicle_msgs/msg/TurnIndicatorsCommand" {
        /// When the command was made.
        stamp: Time,
        /// One of the constants.
        command: u8,
    }
    constants {
        /// Leave the indicators as they are.
        NO_COMMAND: u8 = 0,
        /// Both off.
        DISABLE: u8 = 1,
        /// Left on.
        ENABLE_LEFT: u8 = 2,
        /// Right on.
        ENABLE_RIGHT: u8 = 3,
    }
}
