//! `diagnostic_msgs`: the health of the node.

use crate::define::message;
use crate::std_msgs::Header;

message! {
    /// A named value.
    #[derive(Eq, Default)]
    KeyValue = "diagnostic_msgs/msg/KeyValue" {
        /// Name.
        key: String,
        /// Value as text.
        value: String,
    }
}

message! {
    /// The state of one component.
    #[derive(Eq, Default)]
    DiagnosticStatus = "diagnostic_msgs/msg/DiagnosticStatus" {
        /// One of the constants.
        level: u8 as "byte",
        /// Component.
        name: String,
        /// In words.
        message: String,
        /// Machine or node.
        hardware_id: String,
        /// Details.
        values: Vec<KeyValue>,
    }
    constants {
        /// All is well.
        OK: u8 = 0,
        /// Something is off.
        WARN: u8 = 1,
        /// Something is broken.
        ERROR: u8 = 2,
        /// Nothing new is known.
        STALE: u8 = 3,
    }
}

message! {
    /// The state of components.
    #[derive(Eq, Default)]
    DiagnosticArray = "diagnostic_msgs/msg/DiagnosticArray" {
        /// Time.
        header: Header,
        /// The states.
        status: Vec<DiagnosticStatus>,
    }
}
