//! Quality of service as recordings state it.

use selector_actors::{InputTopic, OutputTopic};
use std::fmt::{self, Display, Formatter};

/// Whether lost messages are sent again.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reliability {
    /// Until the subscriber has them.
    Reliable,
    /// Never.
    BestEffort,
}

/// Whether late subscribers get earlier messages.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Durability {
    /// Only what is sent from now on.
    Volatile,
    /// Also the last `depth` messages.
    TransientLocal,
}

/// How a publisher offers its messages; history is always "keep last".
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct QosProfile {
    /// Repeat lost messages?
    pub reliability: Reliability,
    /// Keep messages for late subscribers?
    pub durability: Durability,
    /// How many messages are kept.
    pub depth: u32,
}

impl Default for QosProfile {
    /// Reliable, volatile, depth 10: what ROS 2 uses unless told otherwise.
    fn default() -> Self {
        Self { reliability: Reliability::Reliable, durability: Durability::Volatile, depth: 10 }
    }
}

impl QosProfile {
    /// What the node asks for on an input: the newest message; map and route also if they came before it.
    #[must_use]
    pub fn of_input(topic: InputTopic) -> Self {
        let durability = match topic {
            InputTopic::Map | InputTopic::Route => Durability::TransientLocal,
            _ => Durability::Volatile,
        };
        Self { reliability: Reliability::Reliable, durability, depth: 1 }
    }

    /// What the node offers on an output.
    #[must_use]
    pub fn of_output(topic: OutputTopic) -> Self {
        Self { depth: topic.depth(), ..Self::default() }
    }
}

/// A duration without end, as rosbag2 writes it.
const FOREVER: &str = "\n    sec: 9223372036\n    nsec: 854775807";

impl Display for QosProfile {
    /// The YAML list of one profile, as rosbag2 writes it into metadata of version 9.
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let reliability = match self.reliability {
            Reliability::Reliable => "reliable",
            Reliability::BestEffort => "best_effort",
        };
        let durability = match self.durability {
            Durability::Volatile => "volatile",
            Durability::TransientLocal => "transient_local",
        };
        write!(f, "- history: keep_last\n  depth: {}\n  reliability: {reliability}", self.depth)?;
        write!(f, "\n  durability: {durability}\n  deadline:{FOREVER}\n  lifespan:{FOREVER}")?;
        write!(f, "\n  liveliness: automatic\n  liveliness_lease_duration:{FOREVER}")?;
        write!(f, "\n  avoid_ros_namespace_conventions: false")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_text_is_the_yaml_of_rosbag2() {
        let profile = QosProfile {
            reliability: Reliability::BestEffort,
            durability: Durability::TransientLocal,
            depth: 1,
        };
        let expected = "\
- history: keep_last
  depth: 1
  reliability: best_effort
  durability: transient_local
  deadline:
    sec: 9223372036
    nsec: 854775807
  lifespan:
    sec: 9223372036
    nsec: 854775807
  liveliness: automatic
  liveliness_lease_duration:
    sec: 9223372036
    nsec: 854775807
  avoid_ros_namespace_conventions: false";
        assert_eq!(profile.to_string(), expected);
    }
}
