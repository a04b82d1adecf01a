//! The ROS 2 messages that the trajectory selector reads or writes, in wire order, and their CDR encoding.
//!
//! One module per ROS package, named after it. A message is declared once, with the `message!` macro of this crate;
//! its Rust struct, its wire form in both directions and its definition text come from that one declaration and
//! cannot drift apart. The wire form is plain CDR (XCDR1): written little endian, read in both byte orders.
//!
//! ```
//! use messages::builtin_interfaces::Time;
//! use messages::{Interface, Message};
//!
//! let stamp = Time { sec: 12, nanosec: 500_000_000 };
//! let bytes = stamp.to_cdr(Interface::V0_53);
//! assert_eq!(Time::from_cdr(&bytes, Interface::V0_53, "/clock")?, stamp);
//! # Ok::<(), messages::DecodeError>(())
//! ```
//!
//! What a decoder promises: no panic and no allocation beyond a small multiple of the bytes received, whatever those
//! bytes are; an error names topic, type and offset.

mod define;

pub mod autoware_internal_debug_msgs;
pub mod autoware_internal_planning_msgs;
pub mod autoware_map_msgs;
pub mod autoware_perception_msgs;
pub mod autoware_planning_msgs;
pub mod autoware_trajectory_validator;
pub mod autoware_vehicle_msgs;
pub mod builtin_interfaces;
pub mod cdr;
pub mod diagnostic_msgs;
pub mod foxglove_msgs;
pub mod geometry_msgs;
pub mod nav_msgs;
pub mod rcl_interfaces;
pub mod rosgraph_msgs;
pub mod sensor_msgs;
pub mod std_msgs;
pub mod unique_identifier_msgs;
pub mod visualization_msgs;

pub use cdr::{DecodeError, DecodeErrorKind};

use std::fmt;
use std::str::FromStr;

/// Which generation of the Autoware interface is on the wire.
///
/// It changes serialisation only: `CandidateTrajectory` gained `turn_indicators_command` at its end with
/// `autoware_internal_msgs` 1.14.0. The two forms cannot be told apart by a decoder that does not know the choice.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Interface {
    /// `autoware_universe` 0.52.0: candidates without a turn indicator command.
    V0_52,
    /// `autoware_universe` 0.53.0: candidates end with their turn indicator command.
    #[default]
    V0_53,
}

impl Interface {
    /// The name used in parameters and reports, `"0.52"` or `"0.53"`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::V0_52 => "0.52",
            Self::V0_53 => "0.53",
        }
    }

    /// Whether candidates carry a command to the turn indicators.
    #[must_use]
    pub fn has_turn_indicators(self) -> bool {
        self == Self::V0_53
    }
}

impl fmt::Display for Interface {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// The text names no known interface.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("\"{0}\" is no Autoware interface; write \"0.52\" or \"0.53\"")]
pub struct UnknownInterface(pub String);

impl FromStr for Interface {
    type Err = UnknownInterface;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        match text {
            "0.52" => Ok(Self::V0_52),
            "0.53" => Ok(Self::V0_53),
            other => Err(UnknownInterface(other.to_owned())),
        }
    }
}

/// A ROS 2 message that can stand on a topic of its own.
pub trait Message: cdr::Cdr {
    /// ROS type name, `package/msg/Name`.
    const TYPE_NAME: &'static str;

    /// The message with its four byte encapsulation header, little endian.
    #[must_use]
    fn to_cdr(&self, interface: Interface) -> Vec<u8> {
        let mut writer = cdr::Writer::new(interface);
        self.encode(&mut writer);
        writer.finish()
    }

    /// Reads one whole message.
    ///
    /// # Errors
    /// The bytes are not this message in this interface; `topic` only serves to say where.
    fn from_cdr(bytes: &[u8], interface: Interface, topic: &str) -> Result<Self, DecodeError> {
        cdr::read_message(bytes, interface).map_err(|(offset, kind)| DecodeError {
            topic: topic.to_owned(),
            type_name: Self::TYPE_NAME,
            offset,
            kind,
        })
    }

    /// Definition text as rosbag2 stores it in MCAP schemas (`ros2msg`): the message, then every message that it
    /// contains, behind a line of 80 equals signs and a line `MSG: package/Name`.
    #[must_use]
    fn definition(interface: Interface) -> String {
        define::definition_text::<Self>(interface)
    }
}
