//! Small recordings for the tests of the file door.
#![allow(dead_code, reason = "each test program uses some of these")]

use std::{
    collections::BTreeMap,
    io::Cursor,
    path::{Path, PathBuf},
};

use mcap::records::MessageHeader;
use trajectory_selector::bag::{self, BagError, McapWriter, QosProfile, RawMessage, Reader, WriterOptions};

pub(crate) const SCHEMA: &str = "string data\n";
pub(crate) const TOPICS: [&str; 3] = ["/a", "/b/c", "/d"];

/// A message to record: topic number, log time in ns, payload.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Sample {
    pub(crate) topic: usize,
    pub(crate) log_time_ns: i64,
    pub(crate) data: Vec<u8>,
}

/// `count` messages a millisecond apart, with payloads of uneven length that compress badly.
pub(crate) fn samples(count: usize) -> Vec<Sample> {
    let mut state = 0x2545_f491_4f6c_dd1d_u64;
    let mut random = move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        state
    };
    let sample = |number: usize| {
        let len = 20 + random() as usize % 200;
        let mut data = vec![0, 1, 0, 0];
        data.extend((0..len).map(|_| random() as u8));
        Sample { topic: number % TOPICS.len(), log_time_ns: 1_000_000_000 + number as i64 * 1_000_000, data }
    };
    (0..count).map(sample).collect()
}

/// The samples as the reader must give them: by log time, equal times as they were written.
pub(crate) fn in_order(samples: &[Sample]) -> Vec<Sample> {
    let mut sorted = samples.to_vec();
    sorted.sort_by_key(|sample| sample.log_time_ns);
    sorted
}

/// Writes with our own writer.
pub(crate) fn record(path: &Path, samples: &[Sample], options: WriterOptions) -> bag::Summary {
    let mut writer = McapWriter::create(path, options).expect("the file can be created");
    let topics = TOPICS.map(|topic| {
        writer.add_topic(topic, "std_msgs/msg/String", SCHEMA, QosProfile::default()).expect("a new topic")
    });
    for sample in samples {
        let (time_ns, data) = (sample.log_time_ns, sample.data.as_slice());
        writer.write(topics[sample.topic], time_ns, time_ns - 1, data).expect("the disk has room");
    }
    writer.finish().expect("the disk has room")
}

/// Writes with the MCAP library alone, in any of its ways.
pub(crate) fn record_with(options: mcap::WriteOptions, samples: &[Sample]) -> Vec<u8> {
    let mut file = Cursor::new(Vec::new());
    let mut writer = options.profile("ros2").create(&mut file).expect("memory");
    let schema = writer.add_schema("std_msgs/msg/String", "ros2msg", SCHEMA.as_bytes()).expect("memory");
    let channels =
        TOPICS.map(|topic| writer.add_channel(schema, topic, "cdr", &BTreeMap::new()).expect("memory"));
    for sample in samples {
        let time = sample.log_time_ns as u64;
        let header = MessageHeader {
            channel_id: channels[sample.topic],
            sequence: 0,
            log_time: time,
            publish_time: time,
        };
        writer.write_to_known_channel(&header, &sample.data).expect("memory");
    }
    writer.finish().expect("memory");
    drop(writer);
    file.into_inner()
}

/// The ways in which other programs write MCAP, by name.
pub(crate) fn foreign_ways() -> Vec<(&'static str, mcap::WriteOptions)> {
    let options = || mcap::WriteOptions::new().chunk_size(Some(2000));
    vec![
        ("zstd", options()),
        ("lz4", options().compression(Some(mcap::Compression::Lz4))),
        ("uncompressed", options().compression(None)),
        ("no summary", options().emit_summary_records(false).emit_summary_offsets(false)),
        ("no chunks", options().use_chunks(false)),
        ("no indexes", options().emit_chunk_indexes(false).emit_message_indexes(false)),
        ("no channels in summary", options().repeat_channels(false)),
    ]
}

/// Everything a recording gives: its messages, and its errors.
#[derive(Debug, Default)]
pub(crate) struct Outcome {
    pub(crate) samples: Vec<Sample>,
    pub(crate) errors: Vec<BagError>,
}

pub(crate) fn read(reader: Reader) -> Outcome {
    let topics: Vec<usize> = reader
        .connections()
        .iter()
        .map(|connection| TOPICS.iter().position(|topic| **topic == *connection.topic).unwrap_or(usize::MAX))
        .collect();
    let mut outcome = Outcome::default();
    for item in reader {
        match item {
            Ok(RawMessage { connection, log_time_ns, data, .. }) => {
                assert!(outcome.errors.is_empty(), "a message after an error");
                outcome.samples.push(Sample { topic: topics[connection], log_time_ns, data });
            }
            Err(error) => outcome.errors.push(error),
        }
    }
    outcome
}

pub(crate) fn read_bytes(bytes: Vec<u8>) -> Result<Outcome, BagError> {
    Reader::from_mcap("test.mcap", Cursor::new(bytes)).map(read)
}

/// The folder with the recorded drives, if this checkout has it.
pub(crate) fn drives() -> Option<PathBuf> {
    let shared = std::env::var_os("SELECTOR_SHARED")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared"), PathBuf::from);
    let drives = shared.join("data/drives");
    if !drives.is_dir() {
        eprintln!("skipped: no recorded drives at {}", drives.display());
        return None;
    }
    Some(drives)
}
