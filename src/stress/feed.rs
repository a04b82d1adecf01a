//! The messages of a load as a graph brings them: serialised once, stamped anew for every cycle.

use super::INTERFACE;
use crate::commands::Failure;
use crate::scenario::load::LoadMessages;
use messages::builtin_interfaces::Time;
use selector_actors::{Input, InputTopic};

/// Bytes of a stamp: seconds and nanoseconds, little endian.
const STAMP_BYTES: usize = 8;
/// Two stamps that differ in every byte: where their messages differ, there is a stamp.
const STAMPS: [Time; 2] =
    [Time { sec: 0x0101_0101, nanosec: 0x0101_0101 }, Time { sec: 0x0202_0202, nanosec: 0x0202_0202 }];

/// What comes in for every cycle, the anchor last.
#[derive(Debug)]
pub(super) struct Feed(Vec<Stamped>);

/// A serialised message with the places of its stamps.
#[derive(Debug)]
pub(super) struct Stamped {
    topic: InputTopic,
    cdr: Vec<u8>,
    stamps: Vec<usize>,
}

impl Feed {
    pub(super) fn of(messages: &LoadMessages) -> Self {
        let [first, second] = STAMPS.map(|now| {
            let mut inputs = messages.sensors(now).to_vec();
            inputs.push(messages.anchor(now, usize::MAX));
            inputs
        });
        Self(first.iter().zip(&second).filter_map(|(first, second)| Stamped::of(first, second)).collect())
    }

    pub(super) fn messages(&mut self) -> impl Iterator<Item = &mut Stamped> {
        self.0.iter_mut()
    }
}

impl Stamped {
    /// A message in both stamps.
    fn of(first: &Input, second: &Input) -> Option<Self> {
        let (cdr, other) = (first.to_cdr(INTERFACE)?, second.to_cdr(INTERFACE)?);
        let (mut stamps, mut at) = (Vec::new(), 0);
        while at < cdr.len() {
            if cdr[at] == other[at] {
                at += 1;
            } else {
                stamps.push(at);
                at += STAMP_BYTES;
            }
        }
        Some(Self { topic: first.topic(), cdr, stamps })
    }

    pub(super) fn topic(&self) -> InputTopic {
        self.topic
    }

    /// The message of a time, as it is when it has been decoded.
    pub(super) fn at(&mut self, now: Time) -> Result<Input, Failure> {
        let topic = self.topic;
        topic.decode(self.cdr_at(now), INTERFACE).map_err(|error| Failure::internal(error.to_string()))
    }

    /// The message of a time, serialised.
    pub(super) fn cdr_at(&mut self, now: Time) -> &[u8] {
        let mut stamp = [0; STAMP_BYTES];
        stamp[..4].copy_from_slice(&now.sec.to_le_bytes());
        stamp[4..].copy_from_slice(&now.nanosec.to_le_bytes());
        for &at in &self.stamps {
            self.cdr[at..at + STAMP_BYTES].copy_from_slice(&stamp);
        }
        &self.cdr
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::load::{Load, LoadScene};

    #[test]
    fn a_stamped_message_is_the_one_made_for_that_time() {
        let load = Load {
            scene: LoadScene::Intersection,
            candidates: 7,
            points: 5,
            objects: 3,
            paths: 2,
            generators: 2,
            seed: 4,
        };
        let messages = load.messages();
        let now = Time { sec: 1_800_000_123, nanosec: 456_789_012 };
        let mut expected = messages.sensors(now).to_vec();
        expected.push(messages.anchor(now, usize::MAX));
        let mut feed = Feed::of(&messages);
        assert_eq!(feed.messages().count(), expected.len());
        for (stamped, expected) in feed.messages().zip(&expected) {
            let input = stamped.at(now).unwrap();
            assert_eq!(input.topic(), expected.topic());
            assert!(input.to_cdr(INTERFACE) == expected.to_cdr(INTERFACE), "{:?}", input.topic());
        }
    }
}
