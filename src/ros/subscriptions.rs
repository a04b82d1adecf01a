//! Messages of the graph into the inlets, one task for each topic.
//!
//! What was sent and never came is noticed by its sequence number; what comes and is no message of its topic is
//! reported once a second, with what is wrong with it and what would help. Of a sensor that sent several messages since
//! the last look, only the newest is decoded.

use super::graph::Reader;
use super::payload::Payload;
use futures::{FutureExt, Stream, StreamExt, pin_mut};
use messages::Interface;
use rustdds::no_key::DeserializedCacheChange;
use rustdds::{GUID, SequenceNumber};
use selector_actors::{DropReason, Inlets, InputTopic};
use std::collections::BTreeMap;
use std::time::{Duration, Instant};
use tracing::warn;

/// Publishers whose numbering is remembered per topic; more than that only come and go.
const MAX_PUBLISHERS: usize = 64;

/// Feeds one topic into the node until the node stops.
pub async fn feed(reader: Reader, topic: InputTopic, interface: Interface, inlets: Inlets) {
    let mut feeder = Feeder {
        name: reader.topic.clone(),
        topic,
        interface,
        inlets,
        numbers: Numbers::default(),
        malformed: Throttle::every(Duration::from_secs(1)),
        lost: Throttle::every(Duration::from_secs(5)),
    };
    let stream = reader.reader.as_async_stream();
    pin_mut!(stream);
    while let Some(sample) = stream.next().await {
        let arrived = Instant::now();
        let Some(payload) = feeder.open(sample) else { continue };
        let newest = feeder.newest(payload, &mut stream);
        if feeder.deliver(&newest, arrived).await.is_err() {
            return;
        }
    }
}

type Sample = rustdds::dds::ReadResult<DeserializedCacheChange<Payload>>;

struct Feeder {
    name: String,
    topic: InputTopic,
    interface: Interface,
    inlets: Inlets,
    numbers: Numbers,
    malformed: Throttle,
    lost: Throttle,
}

impl Feeder {
    /// The payload, if there is one; notices what is missing before it.
    fn open(&mut self, sample: Sample) -> Option<Payload> {
        let change = match sample {
            Ok(change) => change,
            Err(error) => {
                self.inlets.count_dropped(self.topic, DropReason::Malformed, 1);
                self.malformed.warn(|| format!("{}: a message cannot be read: {error}", self.name));
                return None;
            }
        };
        let publisher = change.writer_guid();
        let missing = self.numbers.missing_before(publisher, change.sequence_number);
        if missing > 0 {
            self.inlets.count_dropped(self.topic, DropReason::Lost, missing);
            self.lost
                .warn(|| format!("{}: {missing} messages from {} never came", self.name, peer(publisher)));
        }
        Some(change.into_value())
    }

    /// Of a topic where only the newest message matters, the newest that is there already.
    fn newest(&mut self, first: Payload, stream: &mut (impl Stream<Item = Sample> + Unpin)) -> Payload {
        let mut newest = first;
        if matches!(self.topic, InputTopic::Generative | InputTopic::Backup) {
            return newest;
        }
        while let Some(Some(sample)) = stream.next().now_or_never() {
            if let Some(payload) = self.open(sample) {
                self.inlets.count_dropped(self.topic, DropReason::Superseded, 1);
                newest = payload;
            }
        }
        newest
    }

    async fn deliver(
        &mut self,
        payload: &Payload,
        arrived: Instant,
    ) -> Result<(), selector_actors::inlets::Closed> {
        match self.topic.decode(payload.as_bytes(), self.interface) {
            Ok(input) => self.inlets.take(input, arrived).await,
            Err(mut error) => {
                self.inlets.count_dropped(self.topic, DropReason::Malformed, 1);
                let hint = hint(self.topic, payload, self.interface);
                error.topic.clone_from(&self.name);
                self.malformed.warn(|| format!("{error}{hint}"));
                Ok(())
            }
        }
    }
}

/// What would help with a message that cannot be decoded.
fn hint(topic: InputTopic, payload: &Payload, interface: Interface) -> String {
    let other = match interface {
        Interface::V0_52 => Interface::V0_53,
        Interface::V0_53 => Interface::V0_52,
    };
    if !matches!(topic, InputTopic::Generative | InputTopic::Backup) {
        String::new()
    } else if topic.decode(payload.as_bytes(), other).is_ok() {
        format!(
            "; it is a message of the other interface: start the node with `-p autoware_interface:='\"{other}\"'`"
        )
    } else {
        format!("; autoware_interface is \"{interface}\", and \"{other}\" does not fit it either")
    }
}

/// An endpoint of another node, as tools show it.
pub(super) fn peer(guid: GUID) -> String {
    let bytes = guid.to_bytes();
    bytes.iter().map(|byte| format!("{byte:02x}")).collect::<Vec<_>>().join(".")
}

/// The last number seen from each publisher.
#[derive(Debug, Default)]
struct Numbers(BTreeMap<GUID, i64>);

impl Numbers {
    /// How many messages are missing between the last one and this one. A publisher's first message misses none: what
    /// it sent before was not for us.
    fn missing_before(&mut self, publisher: GUID, number: SequenceNumber) -> u64 {
        if self.0.len() >= MAX_PUBLISHERS && !self.0.contains_key(&publisher) {
            self.0.clear();
        }
        let number = i64::from(number);
        let last = self.0.insert(publisher, number);
        last.map_or(0, |last| u64::try_from(number - last - 1).unwrap_or(0))
    }
}

/// Lets so many lines of a kind through in a while and tells how many it held back.
#[derive(Debug)]
pub(super) struct Throttle {
    most: u32,
    period: Duration,
    began: Option<Instant>,
    passed: u32,
    held_back: u64,
}

impl Throttle {
    pub(super) fn every(period: Duration) -> Self {
        Self::at_most(1, period)
    }

    /// Counted from the first line of each period.
    pub(super) fn at_most(most: u32, period: Duration) -> Self {
        Self { most, period, began: None, passed: 0, held_back: 0 }
    }

    pub(super) fn warn(&mut self, text: impl FnOnce() -> String) {
        if let Some(line) = self.pass(Instant::now(), text) {
            warn!("{line}");
        }
    }

    /// The line, if it is to be written.
    pub(super) fn pass(&mut self, now: Instant, text: impl FnOnce() -> String) -> Option<String> {
        if self.began.is_none_or(|began| now.duration_since(began) >= self.period) {
            (self.began, self.passed) = (Some(now), 0);
        }
        if self.passed == self.most {
            self.held_back += 1;
            return None;
        }
        self.passed += 1;
        Some(match std::mem::take(&mut self.held_back) {
            0 => text(),
            held_back => format!("{} ({held_back} more like this since the last line)", text()),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use messages::Message;
    use messages::autoware_internal_planning_msgs::{CandidateTrajectories, CandidateTrajectory};
    use std::sync::Arc;

    #[test]
    fn gaps_are_counted_per_publisher() {
        let mut numbers = Numbers::default();
        let (one, two) = (GUID::from_bytes([1; 16]), GUID::from_bytes([2; 16]));
        let missing = |numbers: &mut Numbers, guid, number| numbers.missing_before(guid, number_of(number));
        assert_eq!(missing(&mut numbers, one, 40), 0, "what came before we listened is not missing");
        assert_eq!(missing(&mut numbers, one, 41), 0);
        assert_eq!(missing(&mut numbers, two, 7), 0);
        assert_eq!(missing(&mut numbers, one, 44), 2);
        assert_eq!(missing(&mut numbers, one, 44), 0, "a repetition is no gap");
    }

    fn number_of(number: i64) -> SequenceNumber {
        SequenceNumber::from(number)
    }

    #[test]
    fn a_throttle_lets_some_lines_of_each_period_through_and_counts_the_others() {
        let began = Instant::now();
        let mut throttle = Throttle::at_most(2, Duration::from_secs(10));
        let mut line_after =
            |seconds| throttle.pass(began + Duration::from_secs(seconds), || format!("left at {seconds}"));
        let lines: Vec<_> = [0, 1, 2, 9, 10, 11, 12, 30].into_iter().filter_map(&mut line_after).collect();
        let expected = [
            "left at 0",
            "left at 1",
            "left at 10 (2 more like this since the last line)",
            "left at 11",
            "left at 30 (1 more like this since the last line)",
        ];
        assert_eq!(lines, expected);
    }

    #[test]
    fn publishers_without_end_are_forgotten() {
        let mut numbers = Numbers::default();
        for publisher in 0..10_u8 {
            for instance in 0..100_u8 {
                let mut bytes = [publisher; 16];
                bytes[0] = instance;
                numbers.missing_before(GUID::from_bytes(bytes), number_of(1));
            }
        }
        assert!(numbers.0.len() <= MAX_PUBLISHERS);
    }

    #[test]
    fn a_message_of_the_other_interface_is_recognised() {
        let set = CandidateTrajectories {
            candidate_trajectories: vec![Arc::new(CandidateTrajectory::default())],
            generator_info: Vec::new(),
        };
        let payload = Payload::from(set.to_cdr(Interface::V0_52));
        let hint = hint(InputTopic::Generative, &payload, Interface::V0_53);
        assert!(hint.contains("0.52") && hint.contains("autoware_interface"), "{hint}");
    }

    #[test]
    fn garbage_fits_neither_interface() {
        let hint = hint(InputTopic::Backup, &Payload::from(vec![0, 1, 0, 0, 9, 9]), Interface::V0_53);
        assert!(hint.contains("does not fit it either"), "{hint}");
    }
}
