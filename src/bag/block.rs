//! A block: a piece of a recording that is loaded at once, and what the formats hand to the merge.

use super::{BagError, Connection};

/// A chunk, a run of messages outside chunks, or some rows of a sqlite3 file.
#[derive(Debug, Clone)]
pub(super) struct Block {
    /// No message in the block was logged before; ns since the epoch.
    pub(super) start_ns: i64,
    /// No message in the block was logged after; ns since the epoch. Only for display.
    pub(super) end_ns: i64,
    /// First byte of an MCAP record, or number of the first row in time order.
    pub(super) start: u64,
    /// Bytes, or rows.
    pub(super) len: u64,
}

/// One message inside the bytes of a loaded block.
#[derive(Debug, Clone, Copy)]
pub(super) struct Entry {
    pub(super) log_time_ns: i64,
    pub(super) publish_time_ns: i64,
    /// Number among the connections of the file.
    pub(super) connection: u32,
    pub(super) start: usize,
    pub(super) len: usize,
}

/// A block in memory.
#[derive(Debug)]
pub(super) struct Loaded {
    pub(super) bytes: Vec<u8>,
    /// In log-time order.
    pub(super) entries: Vec<Entry>,
}

impl Loaded {
    pub(super) fn sorted(bytes: Vec<u8>, mut entries: Vec<Entry>) -> Self {
        entries.sort_by_key(|entry| entry.log_time_ns); // stable: file order decides ties
        Self { bytes, entries }
    }

    /// Memory held, in bytes.
    pub(super) fn footprint(&self) -> u64 {
        (self.bytes.capacity() + self.entries.capacity() * size_of::<Entry>()) as u64
    }
}

/// What opening one file finds.
#[derive(Debug, Default)]
pub(super) struct Contents {
    pub(super) connections: Vec<Connection>,
    /// In file order.
    pub(super) blocks: Vec<Block>,
    /// How many messages the file itself promises.
    pub(super) promised: Option<u64>,
    /// Why the file ends early, to be told after its last intact message.
    pub(super) end: Option<BagError>,
    /// Findings that cost no message.
    pub(super) warnings: Vec<BagError>,
}
