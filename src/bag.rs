//! The file door: recorded drives in, recorded drives out.
//!
//! It moves raw messages and knows nothing of their types. [`open`] takes an `.mcap` file, a rosbag2 folder or a
//! `.db3` file and gives every message **in the order in which it was logged**; messages of the same time keep the
//! order they have in the file. [`McapWriter`] writes an MCAP file that other tools read; the same calls give the
//! same bytes.
//!
//! What the reader promises: a message comes out only if its chunk is whole and its checksum (where the recording has
//! one) is right. A recording that was cut off gives all that is intact and then says so; nothing is left out
//! silently, as far as the recording's own counts and checksums can tell. Memory is bounded by the chunks whose times
//! overlap. Input is not trusted: a length is checked before it is believed.

mod block;
mod encoder;
mod error;
mod folder;
mod mcap_file;
mod mcap_scan;
mod qos;
mod reader;
mod records;
mod sqlite_file;
mod writer;

pub use error::{BagError, DataBefore};
pub use qos::{Durability, QosProfile, Reliability};
pub use reader::Reader;
pub use writer::{McapWriter, Summary, TopicId, WriterOptions};

use std::{path::Path, sync::Arc};

/// A stream of messages of one type on one topic, as a recording lists it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Connection {
    /// Full topic name, `/a/b`.
    pub topic: Arc<str>,
    /// ROS type name, `pkg/msg/Name`; empty if the recording does not tell.
    pub type_name: Arc<str>,
    /// How payloads are encoded; `cdr` in ROS 2.
    pub serialization: String,
    /// Definition of the type, if recorded; connections of one type share it.
    pub schema: Option<Arc<SchemaText>>,
    /// QoS profiles of the publishers as YAML text, if recorded.
    pub offered_qos: Option<String>,
    /// Messages in the recording; in a recording that was cut off, those that are intact.
    pub message_count: u64,
}

impl Connection {
    /// Whether payloads are CDR, the only encoding that this program decodes.
    #[must_use]
    pub fn is_cdr(&self) -> bool {
        self.serialization == "cdr"
    }

    /// Whether both are the same but for the number of their messages.
    fn is_like(&self, other: &Self) -> bool {
        self.topic == other.topic
            && self.type_name == other.type_name
            && self.serialization == other.serialization
            && self.schema == other.schema
            && self.offered_qos == other.offered_qos
    }
}

/// The definition of a message type.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SchemaText {
    /// `ros2msg`, `ros2idl` or another name that the recorder chose.
    pub encoding: String,
    /// The definition and those it depends on.
    pub text: String,
}

/// A message as it was recorded.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RawMessage {
    /// Index into [`Reader::connections`].
    pub connection: usize,
    /// When it was recorded; nanoseconds since the epoch, not negative.
    pub log_time_ns: i64,
    /// When it was sent; nanoseconds since the epoch. sqlite3 files do not tell: the log time.
    pub publish_time_ns: i64,
    /// The serialized message: 4 bytes of encapsulation, then CDR.
    pub data: Vec<u8>,
}

/// Opens an `.mcap` file, a rosbag2 folder (`metadata.yaml` and its files) or a `.db3` file.
///
/// The kind is told from the contents, not from the name. Files that rosbag2 compressed as a whole, or message by
/// message, with zstd are unpacked.
///
/// # Errors
/// A path that is missing, empty, no recording, or damaged so that nothing of it can be trusted. A recording that
/// was cut off opens; its iterator says so at the end.
pub fn open(path: impl AsRef<Path>) -> Result<Reader, BagError> {
    Reader::open(path.as_ref())
}
