//! Serialises what the node publishes, each content once.
//!
//! The validated set goes out on two topics of a cycle and is hundreds of kilobytes: the second time it is the same
//! bytes, without a copy.

use super::payload::Payload;
use messages::autoware_internal_planning_msgs::CandidateTrajectories;
use messages::{Interface, Message};
use selector_actors::topics::OutputMessage;
use std::sync::Arc;

/// Serialises outputs; keeps the set of candidates that came last until the cycle ends.
#[derive(Debug)]
pub struct Encoder {
    interface: Interface,
    last: Option<(Arc<CandidateTrajectories>, Payload)>,
}

impl Encoder {
    /// For the wire form of this interface.
    #[must_use]
    pub fn new(interface: Interface) -> Self {
        Self { interface, last: None }
    }

    /// The wire form.
    #[must_use]
    pub fn interface(&self) -> Interface {
        self.interface
    }

    /// The serialised message.
    pub fn encode(&mut self, message: &OutputMessage) -> Payload {
        let OutputMessage::Candidates(set) = message else {
            return Payload::from(message.to_cdr(self.interface));
        };
        if let Some((last, payload)) = &self.last
            && Arc::ptr_eq(last, set)
        {
            return payload.clone();
        }
        let payload = Payload::from(set.to_cdr(self.interface));
        self.last = Some((set.clone(), payload.clone()));
        payload
    }

    /// Gives back what was kept: the next cycle has sets of its own.
    pub fn end_cycle(&mut self) {
        self.last = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use messages::autoware_internal_planning_msgs::CandidateTrajectory;

    fn set_of(candidates: usize) -> Arc<CandidateTrajectories> {
        let candidate = Arc::new(CandidateTrajectory::default());
        Arc::new(CandidateTrajectories {
            candidate_trajectories: vec![candidate; candidates],
            ..Default::default()
        })
    }

    #[test]
    fn the_same_set_is_encoded_once_and_another_is_not_taken_for_it() {
        let mut encoder = Encoder::new(Interface::V0_53);
        let (one, other) = (set_of(1), set_of(2));
        let first = encoder.encode(&OutputMessage::Candidates(one.clone()));
        assert_eq!(first.as_bytes(), one.to_cdr(Interface::V0_53));
        let again = encoder.encode(&OutputMessage::Candidates(one.clone()));
        assert!(std::ptr::eq(first.as_bytes(), again.as_bytes()), "the same bytes");
        let another = encoder.encode(&OutputMessage::Candidates(other.clone()));
        assert_eq!(another.as_bytes(), other.to_cdr(Interface::V0_53));
        assert_eq!(encoder.encode(&OutputMessage::Candidates(one)), first);
    }

    #[test]
    fn nothing_is_kept_beyond_the_cycle() {
        let mut encoder = Encoder::new(Interface::V0_53);
        let set = set_of(1);
        let _ = encoder.encode(&OutputMessage::Candidates(set.clone()));
        assert_eq!(Arc::strong_count(&set), 2);
        encoder.end_cycle();
        assert_eq!(Arc::strong_count(&set), 1);
    }
}
