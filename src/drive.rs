//! A recorded drive as the node's inputs: which topics are ours, which wire form they have, when each message came.
//!
//! Decoding runs on a thread of its own, ahead of the node by a bounded number of messages.

use crate::bag::{self, BagError, RawMessage, Reader};
use messages::autoware_internal_planning_msgs::CandidateTrajectories;
use messages::builtin_interfaces::Time;
use messages::{DecodeError, Interface, Message};
use selector_actors::{Input, InputTopic};
use std::path::{Path, PathBuf};

/// A message for the node, with the time at which it was received.
#[derive(Debug, Clone)]
pub struct TimedInput {
    /// When it was received, on the clock of the recording.
    pub time: Time,
    /// Where it came from.
    pub topic: InputTopic,
    /// What it says.
    pub input: Input,
}

/// Something that a drive gives.
#[derive(Debug)]
pub enum Event {
    /// A message for the node.
    Input(TimedInput),
    /// A message that cannot be decoded; it is lost, the drive goes on.
    Malformed(InputTopic, DecodeError),
    /// The drive ends here, earlier than it should.
    Broken(BagError),
}

/// Why a drive cannot be replayed.
#[derive(Debug, thiserror::Error)]
pub enum DriveError {
    /// The recording cannot be read.
    #[error(transparent)]
    Bag(#[from] BagError),
    /// A topic of ours carries something else.
    #[error(
        "{path}: topic {topic} is recorded as {found}, not as {expected}; remap another topic onto it with --remap"
    )]
    WrongType {
        /// The recording.
        path: PathBuf,
        /// Topic in the recording.
        topic: String,
        /// Type in the recording.
        found: String,
        /// Type that the node takes.
        expected: &'static str,
    },
    /// A topic of ours is not encoded as CDR.
    #[error("{path}: topic {topic} is encoded as {encoding}; only cdr can be read")]
    NotCdr {
        /// The recording.
        path: PathBuf,
        /// Topic in the recording.
        topic: String,
        /// Encoding in the recording.
        encoding: String,
    },
    /// None of the topics is ours.
    #[error("{path}: no topic is an input of the node ({found}); remap yours with --remap THEIRS:={example}")]
    NoInputs {
        /// The recording.
        path: PathBuf,
        /// Topics in the recording.
        found: String,
        /// A topic that the node listens to.
        example: String,
    },
    /// There is no HD map, and without one nothing is ever published.
    #[error("{path}: there is no message on {topic}; give the HD map with --map FILE.bin or --map FILE.osm")]
    NoMap {
        /// The recording.
        path: PathBuf,
        /// Topic of the map.
        topic: String,
    },
}

/// A rule that renames a topic of the recording.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Remap {
    /// Name in the recording.
    pub from: String,
    /// Name that the node knows.
    pub to: String,
}

/// A remap rule that is none.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("\"{0}\" is no remap rule; write /recorded/topic:=/{node}/input/name", node = selector_actors::topics::NODE_NAME)]
pub struct BadRemap(pub String);

impl std::str::FromStr for Remap {
    type Err = BadRemap;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let absolute = |name: &str| {
            if let Some(private) = name.strip_prefix("~/") {
                format!("/{}/{private}", selector_actors::topics::NODE_NAME)
            } else if name.starts_with('/') {
                name.to_owned()
            } else {
                format!("/{name}")
            }
        };
        match text.split_once(":=") {
            Some((from, to)) if !from.is_empty() && !to.is_empty() => {
                Ok(Self { from: absolute(from), to: absolute(to) })
            }
            _ => Err(BadRemap(text.to_owned())),
        }
    }
}

/// A recording, opened, with its topics assigned.
#[derive(Debug)]
pub struct Drive {
    reader: Reader,
    /// For each connection of the recording: the input that it is.
    inputs: Vec<Option<InputTopic>>,
    interface: Interface,
    start: Time,
    end: Time,
}

impl Drive {
    /// Opens a recording. `interface` says how candidates are encoded; `None` finds it out. `needs_map` is false if the
    /// map comes from elsewhere; a map in the recording is then ignored.
    ///
    /// # Errors
    /// The recording cannot be read, or cannot feed the node.
    pub fn open(
        path: &Path,
        remaps: &[Remap],
        interface: Option<Interface>,
        needs_map: bool,
    ) -> Result<Self, DriveError> {
        let mut reader = bag::open(path)?;
        let mut inputs = assign(&reader, remaps)?;
        let map = inputs.iter().position(|input| *input == Some(InputTopic::Map));
        if needs_map {
            let messages = map.map_or(0, |index| reader.connections()[index].message_count);
            if messages == 0 {
                return Err(DriveError::NoMap { path: path.to_owned(), topic: InputTopic::Map.full_name() });
            }
        } else if let Some(index) = map {
            inputs[index] = None;
        }
        let interface = match interface {
            Some(interface) => interface,
            None => detect_interface(path, &inputs)?,
        };
        let ours: Vec<String> = topics_of(&reader, &inputs);
        reader.select(|connection| ours.contains(&connection.topic.to_string()));
        let (start_ns, end_ns) = reader.time_range_ns().unwrap_or_default();
        let (start, end) = (Time::from_nanoseconds(start_ns), Time::from_nanoseconds(end_ns));
        Ok(Self { reader, inputs, interface, start, end })
    }

    /// How candidates are encoded.
    #[must_use]
    pub fn interface(&self) -> Interface {
        self.interface
    }

    /// When the first message was received.
    #[must_use]
    pub fn start(&self) -> Time {
        self.start
    }

    /// When the last message was received.
    #[must_use]
    pub fn end(&self) -> Time {
        self.end
    }

    /// Anchors per second of the recording; `None` if there are too few to tell.
    #[must_use]
    pub fn anchor_rate_hz(&self) -> Option<f64> {
        let connections = self.reader.connections().iter().zip(&self.inputs);
        let anchors: u64 = connections
            .filter(|(_, input)| **input == Some(InputTopic::Generative))
            .map(|(connection, _)| connection.message_count)
            .sum();
        let span_s = (self.end.nanoseconds() - self.start.nanoseconds()) as f64 * 1e-9;
        (anchors > 1 && span_s > 0.0).then(|| anchors as f64 / span_s)
    }

    /// What is odd about the recording although it can be read.
    #[must_use]
    pub fn warnings(&self) -> &[BagError] {
        self.reader.warnings()
    }
}

impl Iterator for Drive {
    type Item = Event;

    fn next(&mut self) -> Option<Event> {
        loop {
            let message = match self.reader.next()? {
                Ok(message) => message,
                Err(error) => return Some(Event::Broken(error)),
            };
            // Messages of other topics are not ours; the reader normally leaves them out by itself.
            if let Some(topic) = self.inputs[message.connection] {
                return Some(decode(topic, &message, self.interface));
            }
        }
    }
}

fn decode(topic: InputTopic, message: &RawMessage, interface: Interface) -> Event {
    match topic.decode(&message.data, interface) {
        Ok(input) => {
            Event::Input(TimedInput { time: Time::from_nanoseconds(message.log_time_ns), topic, input })
        }
        Err(error) => Event::Malformed(topic, error),
    }
}

fn topics_of(reader: &Reader, inputs: &[Option<InputTopic>]) -> Vec<String> {
    let ours = reader.connections().iter().zip(inputs).filter(|(_, input)| input.is_some());
    ours.map(|(connection, _)| connection.topic.to_string()).collect()
}

/// Which connection is which input.
fn assign(reader: &Reader, remaps: &[Remap]) -> Result<Vec<Option<InputTopic>>, DriveError> {
    let path = || reader.path().to_owned();
    let mut inputs = Vec::new();
    for connection in reader.connections() {
        let remap = remaps.iter().find(|remap| *remap.from == *connection.topic);
        let name = remap.map_or(&*connection.topic, |remap| &remap.to);
        let input = InputTopic::ALL.into_iter().find(|input| input.full_name() == name);
        if let Some(input) = input {
            if *connection.type_name != *input.type_name() {
                return Err(DriveError::WrongType {
                    path: path(),
                    topic: connection.topic.to_string(),
                    found: connection.type_name.to_string(),
                    expected: input.type_name(),
                });
            }
            if !connection.is_cdr() {
                return Err(DriveError::NotCdr {
                    path: path(),
                    topic: connection.topic.to_string(),
                    encoding: connection.serialization.clone(),
                });
            }
        }
        inputs.push(input);
    }
    if inputs.iter().all(Option::is_none) {
        let topics: Vec<_> = reader.connections().iter().map(|connection| &*connection.topic).collect();
        return Err(DriveError::NoInputs {
            path: path(),
            found: if topics.is_empty() { "it has none".to_owned() } else { topics.join(", ") },
            example: InputTopic::Generative.full_name(),
        });
    }
    Ok(inputs)
}

/// The interface in which the recording's candidates can be decoded, from the first message that can be read in only
/// one. Recordings without candidates can be read in either.
fn detect_interface(path: &Path, inputs: &[Option<InputTopic>]) -> Result<Interface, BagError> {
    let is_candidates =
        |index: usize| matches!(inputs[index], Some(InputTopic::Generative | InputTopic::Backup));
    let mut reader = bag::open(path)?;
    let topics: Vec<String> = reader
        .connections()
        .iter()
        .enumerate()
        .filter(|(index, _)| is_candidates(*index))
        .map(|(_, connection)| connection.topic.to_string())
        .collect();
    reader.select(|connection| topics.contains(&connection.topic.to_string()));
    for message in reader {
        // A recording that breaks off is reported when it is replayed.
        let Ok(message) = message else { break };
        let fits = |interface| CandidateTrajectories::from_cdr(&message.data, interface, "").is_ok();
        match (fits(Interface::V0_52), fits(Interface::V0_53)) {
            (true, false) => return Ok(Interface::V0_52),
            (false, true) => return Ok(Interface::V0_53),
            _ => {}
        }
    }
    Ok(Interface::default())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn remap_rules_name_topics_as_ros_does() {
        let rule = |text: &str| text.parse::<Remap>();
        let expected = Remap {
            from: "/planning/candidates".to_owned(),
            to: "/trajectory_selector_node/input/trajectories_generative".to_owned(),
        };
        assert_eq!(rule("/planning/candidates:=~/input/trajectories_generative"), Ok(expected.clone()));
        let full = "planning/candidates:=/trajectory_selector_node/input/trajectories_generative";
        assert_eq!(rule(full), Ok(expected));
        for bad in ["", "a", "a:=", ":=b", "a=b"] {
            assert!(rule(bad).is_err(), "{bad}");
        }
    }
}
