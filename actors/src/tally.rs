//! Counts what came in and what was lost on the way, by input and reason. Shared by the doors and whoever reports.

use crate::topics::InputTopic;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};

/// Why a message of an input had no effect.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum DropReason {
    /// A newer one came before a cycle asked. Usual where an input is faster than the cycles.
    Superseded,
    /// It could not be decoded.
    Malformed,
    /// It was sent and never arrived.
    Lost,
}

impl DropReason {
    /// Every reason.
    pub const ALL: [Self; 3] = [Self::Superseded, Self::Malformed, Self::Lost];

    /// Stable snake_case name for reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Superseded => "superseded",
            Self::Malformed => "malformed",
            Self::Lost => "lost",
        }
    }
}

const TOPICS: usize = InputTopic::ALL.len() + InputTopic::OPEN_SPACE.len();

/// Counters that only grow.
#[derive(Debug, Default)]
pub struct Tally {
    received: [AtomicU64; TOPICS],
    dropped: [[AtomicU64; DropReason::ALL.len()]; TOPICS],
    incompatible_peers: AtomicU64,
    unpublished: AtomicU64,
    waiting: AtomicUsize,
    most_waiting: AtomicUsize,
}

/// A message that waits for its owner; dropped when it waits no more.
#[derive(Debug)]
pub(crate) struct Waiting<'a>(&'a Tally);

impl Drop for Waiting<'_> {
    fn drop(&mut self) {
        self.0.waiting.fetch_sub(1, Ordering::Relaxed);
    }
}

impl Tally {
    /// A message came in, whatever becomes of it.
    pub fn count_received(&self, topic: InputTopic) {
        self.received[topic as usize].fetch_add(1, Ordering::Relaxed);
    }

    /// Messages had no effect.
    pub fn count_dropped(&self, topic: InputTopic, reason: DropReason, messages: u64) {
        self.dropped[topic as usize][reason as usize].fetch_add(messages, Ordering::Relaxed);
    }

    /// Another node offers or asks for a quality of service that does not fit ours: it will not hear us, or we not it.
    pub fn count_incompatible_peer(&self) {
        self.incompatible_peers.fetch_add(1, Ordering::Relaxed);
    }

    /// A message begins to wait for its owner.
    pub(crate) fn wait(&self) -> Waiting<'_> {
        let waiting = self.waiting.fetch_add(1, Ordering::Relaxed) + 1;
        self.most_waiting.fetch_max(waiting, Ordering::Relaxed);
        Waiting(self)
    }

    /// The most messages that ever waited for their owners at the same time. There are as many as there are callers that
    /// bring them.
    #[must_use]
    pub fn most_waiting(&self) -> usize {
        self.most_waiting.load(Ordering::Relaxed)
    }

    /// An output could not be handed over.
    pub fn count_unpublished(&self) {
        self.unpublished.fetch_add(1, Ordering::Relaxed);
    }

    /// Messages that came in.
    #[must_use]
    pub fn received(&self, topic: InputTopic) -> u64 {
        self.received[topic as usize].load(Ordering::Relaxed)
    }

    /// Messages that had no effect for this reason.
    #[must_use]
    pub fn dropped(&self, topic: InputTopic, reason: DropReason) -> u64 {
        self.dropped[topic as usize][reason as usize].load(Ordering::Relaxed)
    }

    /// Endpoints of other nodes that do not fit ours.
    #[must_use]
    pub fn incompatible_peers(&self) -> u64 {
        self.incompatible_peers.load(Ordering::Relaxed)
    }

    /// Outputs that could not be handed over.
    #[must_use]
    pub fn unpublished(&self) -> u64 {
        self.unpublished.load(Ordering::Relaxed)
    }

    /// What went wrong so far, as names and counts; empty when all is well.
    #[must_use]
    pub fn faults(&self) -> Vec<(String, u64)> {
        let mut faults = Vec::new();
        for topic in InputTopic::every() {
            for reason in [DropReason::Malformed, DropReason::Lost] {
                faults
                    .push((format!("input.{}.{}", topic.name(), reason.name()), self.dropped(topic, reason)));
            }
        }
        faults.push(("peers.incompatible_qos".to_owned(), self.incompatible_peers()));
        faults.push(("outputs.not_sent".to_owned(), self.unpublished()));
        faults.retain(|(_, count)| *count > 0);
        faults
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_most_that_waited_at_once_is_kept() {
        let tally = Tally::default();
        let (first, second) = (tally.wait(), tally.wait());
        drop(first);
        let third = tally.wait();
        assert_eq!(tally.most_waiting(), 2);
        drop((second, third));
        assert_eq!(tally.waiting.load(Ordering::Relaxed), 0);
    }

    #[test]
    fn every_input_and_reason_has_a_counter_of_its_own() {
        let tally = Tally::default();
        for (index, topic) in InputTopic::every().enumerate() {
            assert_eq!(topic as usize, index, "the counters are found by the order of the inputs");
            tally.count_dropped(topic, DropReason::Lost, index as u64);
        }
        for (index, topic) in InputTopic::every().enumerate() {
            assert_eq!(tally.dropped(topic, DropReason::Lost), index as u64);
            assert_eq!(tally.dropped(topic, DropReason::Malformed), 0);
        }
    }

    #[test]
    fn superseded_messages_are_no_fault() {
        let tally = Tally::default();
        tally.count_dropped(InputTopic::Odometry, DropReason::Superseded, 5);
        assert!(tally.faults().is_empty());
        tally.count_dropped(InputTopic::Objects, DropReason::Malformed, 2);
        assert_eq!(tally.faults(), [("input.objects.malformed".to_owned(), 2)]);
    }
}
