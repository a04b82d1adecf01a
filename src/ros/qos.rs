//! Quality of service of every topic of the node, as ROS 2 names it and as the middleware wants it.

use rustdds::policy::{
    Deadline, Durability, History, Lifespan, Liveliness, Ownership, Reliability, ResourceLimits,
};
use rustdds::{Duration, QosPolicies, QosPolicyBuilder};
use selector_actors::{InputTopic, OutputTopic};

/// Samples that the middleware keeps for a slow peer before it refuses to send more. A peer that froze is given up
/// after its lease, 10 s or 20 s; at 20 messages a second that many are needed until then.
const MAX_UNACKNOWLEDGED: i32 = 512;

/// Candidates that may wait while a cycle's messages are being decoded. The upstream node keeps one and loses the
/// others; a deeper queue is compatible with every publisher.
const CANDIDATE_DEPTH: i32 = 32;

/// Messages of a sensor that may wait until they are looked at. Only the newest is decoded; with a queue of one, as
/// the upstream node has it, the middleware would drop the others unseen, and they would count as lost on the way.
const SENSOR_DEPTH: i32 = 16;

/// A profile: history is always "keep last".
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Qos {
    /// Whether lost messages are sent again.
    pub reliable: bool,
    /// Whether late subscribers get earlier messages.
    pub transient_local: bool,
    /// How many messages are kept.
    pub depth: i32,
}

impl Qos {
    /// Reliable, volatile.
    #[must_use]
    pub const fn reliable(depth: i32) -> Self {
        Self { reliable: true, transient_local: false, depth }
    }

    /// Reliable, and late subscribers get what was sent before.
    #[must_use]
    pub const fn latched(depth: i32) -> Self {
        Self { reliable: true, transient_local: true, depth }
    }

    /// The profile of `/clock`.
    pub const CLOCK: Self = Self { reliable: false, transient_local: false, depth: 1 };
    /// The profile of `/rosout`.
    pub const ROSOUT: Self = Self::latched(1000);
    /// The profile of `/parameter_events` and of services.
    pub const PARAMETERS: Self = Self::reliable(1000);

    /// Of an input.
    #[must_use]
    pub fn of_input(topic: InputTopic) -> Self {
        match topic {
            InputTopic::Map | InputTopic::Route => Self::latched(1),
            InputTopic::Generative | InputTopic::Backup => Self::reliable(CANDIDATE_DEPTH),
            InputTopic::Odometry
            | InputTopic::Acceleration
            | InputTopic::Objects
            | InputTopic::TrafficSignals => Self::reliable(SENSOR_DEPTH),
            InputTopic::GoalPose | InputTopic::OccupancyGrid => Self::reliable(1),
        }
    }

    /// Of an output.
    #[must_use]
    pub fn of_output(topic: OutputTopic) -> Self {
        Self::reliable(i32::try_from(topic.depth()).unwrap_or(i32::MAX))
    }

    /// For a reader: keeps no more than it was asked to.
    #[must_use]
    pub fn for_reader(self) -> QosPolicies {
        self.policies(self.depth)
    }

    /// For a writer: never waits for a slow peer.
    #[must_use]
    pub fn for_writer(self) -> QosPolicies {
        self.policies(self.depth.max(MAX_UNACKNOWLEDGED))
    }

    fn policies(self, max_samples: i32) -> QosPolicies {
        let reliability = if self.reliable {
            Reliability::Reliable { max_blocking_time: Duration::ZERO }
        } else {
            Reliability::BestEffort
        };
        let durability = if self.transient_local { Durability::TransientLocal } else { Durability::Volatile };
        QosPolicyBuilder::new()
            .reliability(reliability)
            .durability(durability)
            .history(History::KeepLast { depth: self.depth })
            .resource_limits(ResourceLimits {
                max_samples,
                max_instances: 1,
                max_samples_per_instance: max_samples,
            })
            .deadline(Deadline(Duration::INFINITE))
            .lifespan(Lifespan { duration: Duration::INFINITE })
            .liveliness(Liveliness::Automatic { lease_duration: Duration::INFINITE })
            .ownership(Ownership::Shared)
            .build()
    }
}

/// What an offer and a request differ in, in the words of ROS; empty when the difference is in something that no
/// profile of ours touches.
#[must_use]
pub fn differences(offered: &QosPolicies, requested: &QosPolicies) -> String {
    let mut texts = Vec::new();
    let reliable = |qos: &QosPolicies| matches!(qos.reliability(), Some(Reliability::Reliable { .. }));
    if reliable(requested) && !reliable(offered) {
        texts.push("reliability: best_effort is offered, reliable is asked for".to_owned());
    }
    let durability = |qos: &QosPolicies| qos.durability().unwrap_or(Durability::Volatile);
    let (offers, asks) = (durability(offered), durability(requested));
    if offers < asks {
        texts.push(format!("durability: {} is offered, {} is asked for", name(offers), name(asks)));
    }
    let deadline = |qos: &QosPolicies| qos.deadline().map_or(Duration::INFINITE, |deadline| deadline.0);
    if deadline(offered) > deadline(requested) {
        texts.push("deadline: the one that is asked for is shorter than the one offered".to_owned());
    }
    if let (Some(offers), Some(asks)) = (offered.liveliness(), requested.liveliness())
        && offers < asks
    {
        texts.push("liveliness: more is asked for than is offered".to_owned());
    }
    texts.join("; ")
}

fn name(durability: Durability) -> &'static str {
    match durability {
        Durability::Volatile => "volatile",
        Durability::TransientLocal => "transient_local",
        Durability::Transient => "transient",
        Durability::Persistent => "persistent",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inputs_have_the_profiles_of_the_upstream_node() {
        for topic in InputTopic::every() {
            let qos = Qos::of_input(topic);
            assert!(qos.reliable, "{}", topic.name());
            let latched = matches!(topic, InputTopic::Map | InputTopic::Route);
            assert_eq!(qos.transient_local, latched, "{}", topic.name());
        }
    }

    #[test]
    fn differences_are_told_in_the_words_of_ros() {
        let best_effort = Qos { reliable: false, transient_local: false, depth: 1 };
        let text = differences(&best_effort.for_writer(), &Qos::latched(1).for_reader());
        assert_eq!(
            text,
            "reliability: best_effort is offered, reliable is asked for; \
             durability: volatile is offered, transient_local is asked for"
        );
        assert_eq!(differences(&Qos::latched(1).for_writer(), &Qos::reliable(1).for_reader()), "");
    }
}
