//! What is written reads back, in log-time order, whoever wrote it.

#[path = "bag_support/recordings.rs"]
mod recordings;

use std::{fs, io::Cursor, sync::Arc};

use proptest::prelude::*;
use recordings::{Sample, TOPICS, foreign_ways, in_order, read, read_bytes, record, record_with, samples};
use sha2::{Digest, Sha256};
use trajectory_selector::bag::{
    self, BagError, DataBefore, Durability, McapWriter, QosProfile, Reader, Reliability, WriterOptions,
};

const SMALL: WriterOptions = WriterOptions { chunk_bytes: 2000, queue_messages: 8 };

#[test]
fn a_recording_reads_back_as_it_was_written() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.mcap");
    let written = samples(300);
    let summary = record(&path, &written, SMALL);

    let reader = bag::open(&path).unwrap();
    assert!(reader.warnings().is_empty(), "{:?}", reader.warnings());
    assert_eq!(reader.message_count(), 300);
    assert_eq!(reader.time_range_ns(), Some((1_000_000_000, 1_299_000_000)));
    let topics: Vec<&str> = reader.connections().iter().map(|connection| &*connection.topic).collect();
    assert_eq!(topics, TOPICS);
    for connection in reader.connections() {
        assert_eq!(&*connection.type_name, "std_msgs/msg/String");
        assert!(connection.is_cdr());
        let schema = connection.schema.as_ref().unwrap();
        assert_eq!((schema.encoding.as_str(), schema.text.as_str()), ("ros2msg", recordings::SCHEMA));
        assert_eq!(connection.offered_qos, Some(QosProfile::default().to_string()));
        assert_eq!(connection.message_count, 100);
    }
    let outcome = read(reader);
    assert!(outcome.errors.is_empty(), "{:?}", outcome.errors);
    assert_eq!(outcome.samples, written);

    assert_eq!(summary.path, path);
    assert_eq!(summary.messages, TOPICS.map(|topic| (topic.to_owned(), 100)));
    let bytes = fs::read(&path).unwrap();
    assert_eq!(summary.bytes, bytes.len() as u64);
    let digest: String = Sha256::digest(&bytes).iter().map(|byte| format!("{byte:02x}")).collect();
    assert_eq!(summary.sha256, digest);
}

#[test]
fn channels_that_name_one_schema_share_its_text() {
    let record = |opcode: u8, body: &[u8]| [&[opcode], &(body.len() as u64).to_le_bytes()[..], body].concat();
    let text = |text: &str| [&(text.len() as u32).to_le_bytes()[..], text.as_bytes()].concat();
    let mut bytes = b"\x89MCAP0\r\n".to_vec();
    let schema = [vec![1, 0], text("a/msg/B"), text("ros2msg"), text("int8 a\n")].concat();
    bytes.extend(record(3, &schema));
    for channel in 0..3_u16 {
        let id = channel.to_le_bytes().to_vec();
        let channel = [id, vec![1, 0], text(&format!("/{channel}")), text("cdr"), vec![0; 4]].concat();
        bytes.extend(record(4, &channel));
    }
    let reader = Reader::from_mcap("shared.mcap", Cursor::new(bytes)).unwrap();
    let [first, rest @ ..] = reader.connections() else { panic!("three channels") };
    assert_eq!((&*first.type_name, rest.len()), ("a/msg/B", 2));
    let schema = first.schema.as_ref().unwrap();
    assert_eq!((schema.encoding.as_str(), schema.text.as_str()), ("ros2msg", "int8 a\n"));
    for other in rest {
        assert!(Arc::ptr_eq(schema, other.schema.as_ref().unwrap()));
        assert!(Arc::ptr_eq(&first.type_name, &other.type_name));
    }
}

#[test]
fn publish_times_are_kept() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.mcap");
    record(&path, &samples(3), SMALL);
    for message in bag::open(&path).unwrap() {
        let message = message.unwrap();
        assert_eq!(message.publish_time_ns, message.log_time_ns - 1);
    }
}

#[test]
fn an_empty_recording_is_a_recording() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.mcap");
    let writer = McapWriter::create(&path, WriterOptions::default()).unwrap();
    let summary = writer.finish().unwrap();
    assert!(summary.messages.is_empty());
    assert_eq!(bag::open(&path).unwrap().count(), 0);
}

#[test]
fn the_same_calls_give_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let written = samples(2000);
    let digests: Vec<String> = [1, 7, 500]
        .map(|queue_messages| {
            let path = folder.path().join(format!("{queue_messages}.mcap"));
            record(&path, &written, WriterOptions { chunk_bytes: 50_000, queue_messages }).sha256
        })
        .into();
    assert_eq!(digests[0], digests[1]);
    assert_eq!(digests[0], digests[2]);
}

#[test]
fn every_way_of_writing_mcap_reads_alike() {
    let written = samples(200);
    for (way, options) in foreign_ways() {
        let bytes = record_with(options, &written);
        let reader = Reader::from_mcap(way, Cursor::new(bytes)).unwrap();
        assert_eq!(reader.message_count(), 200, "{way}");
        let outcome = read(reader);
        assert!(outcome.errors.is_empty(), "{way}: {:?}", outcome.errors);
        assert_eq!(outcome.samples, written, "{way}");
    }
}

#[test]
fn unwanted_connections_are_left_out() {
    let written = samples(90);
    let bytes = record_with(mcap::WriteOptions::new(), &written);
    let mut reader = Reader::from_mcap("test", Cursor::new(bytes)).unwrap();
    reader.select(|connection| &*connection.topic == "/b/c");
    assert_eq!(reader.message_count(), 30);
    let outcome = read(reader);
    assert!(outcome.errors.is_empty(), "{:?}", outcome.errors);
    let wanted: Vec<Sample> = written.into_iter().filter(|sample| sample.topic == 1).collect();
    assert_eq!(outcome.samples, wanted);
}

#[test]
fn the_writer_refuses_what_it_cannot_do() {
    let folder = tempfile::tempdir().unwrap();
    let refused = McapWriter::create(folder.path(), WriterOptions::default()).unwrap_err();
    assert!(matches!(refused, BagError::IsFolder { .. }), "{refused}");
    let missing = folder.path().join("no/such/folder.mcap");
    let refused = McapWriter::create(missing, WriterOptions::default()).unwrap_err();
    assert!(matches!(refused, BagError::Create { .. }), "{refused}");

    let path = folder.path().join("out.mcap");
    let mut writer = McapWriter::create(&path, WriterOptions::default()).unwrap();
    let qos =
        QosProfile { reliability: Reliability::BestEffort, durability: Durability::TransientLocal, depth: 1 };
    let topic = writer.add_topic("/a", "std_msgs/msg/String", "string data", qos).unwrap();
    let twice = writer.add_topic("/a", "std_msgs/msg/String", "string data", qos).unwrap_err();
    assert!(matches!(&twice, BagError::Rejected { topic, .. } if topic == "/a"), "{twice}");
    let early = writer.write(topic, -1, 0, vec![0; 8]).unwrap_err();
    assert!(matches!(early, BagError::Rejected { .. }), "{early}");
    writer.write(topic, 5, 5, vec![0; 8]).unwrap();
    assert_eq!(writer.finish().unwrap().messages, [("/a".to_owned(), 1)]);
    assert_eq!(bag::open(&path).unwrap().filter(Result::is_ok).count(), 1);
}

#[test]
fn a_writer_that_is_dropped_leaves_every_message_and_no_good_end() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.mcap");
    let mut writer = McapWriter::create(&path, SMALL).unwrap();
    let topic = writer.add_topic("/a", "std_msgs/msg/String", "", QosProfile::default()).unwrap();
    for time_ns in 0..100 {
        writer.write(topic, time_ns, time_ns, vec![7; 100]).unwrap();
    }
    drop(writer);
    let outcome = read(bag::open(&path).unwrap());
    assert_eq!(outcome.samples.len(), 100);
    let [error @ BagError::Truncated { messages_read: 100, .. }] = outcome.errors.as_slice() else {
        panic!("{:?}", outcome.errors)
    };
    assert_eq!(error.data_before(), DataBefore::Valid);
}

#[test]
fn a_recording_can_be_read_while_it_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.mcap");
    let options = WriterOptions { chunk_bytes: 2000, queue_messages: 4 };
    let mut writer = McapWriter::create(&path, options).unwrap();
    let topic = writer.add_topic("/a", "std_msgs/msg/String", "", QosProfile::default()).unwrap();
    for time_ns in 0..1000 {
        writer.write(topic, time_ns, time_ns, vec![7; 100]).unwrap();
    }
    // At most the queue, one message in work and one chunk of 17 messages are not in the file yet.
    let copy = fs::read(&path).unwrap();
    let outcome = read_bytes(copy).unwrap();
    let count = outcome.samples.len();
    assert!(count >= 1000 - 4 - 1 - 18, "{count}");
    let [BagError::Truncated { messages_read, .. }] = outcome.errors.as_slice() else {
        panic!("{:?}", outcome.errors)
    };
    assert_eq!(*messages_read, count as u64);
    writer.finish().unwrap();
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_reported_at_the_next_call_and_at_the_end() {
    let mut writer = McapWriter::create("/dev/full", SMALL).unwrap();
    let failed = |error: &BagError| matches!(error, BagError::Write { path, safe_bytes: 0, safe_messages: 0, .. } if path.ends_with("full"));
    let mut send = || {
        let topic = writer.add_topic("/a", "a/msg/B", "", QosProfile::default())?;
        loop {
            writer.write(topic, 0, 0, vec![0; 10_000])?;
        }
    };
    let result: Result<(), BagError> = send();
    let error = result.unwrap_err();
    assert!(failed(&error), "{error}");
    let error = writer.finish().unwrap_err();
    assert!(failed(&error), "{error}");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, ..ProptestConfig::default() })]

    #[test]
    fn messages_come_in_log_time_order_and_ties_in_file_order(
        times in prop::collection::vec((0..3usize, 0..40i64, 0..300usize), 0..200),
        chunk_bytes in 50..4000u64,
    ) {
        let written: Vec<Sample> = times
            .iter()
            .enumerate()
            .map(|(number, (topic, time_ns, len))| Sample {
                topic: *topic,
                log_time_ns: time_ns + 1,
                data: (0..*len + 8).map(|at| (number * 31 + at) as u8).collect(),
            })
            .collect();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("out.mcap");
        record(&path, &written, WriterOptions { chunk_bytes, queue_messages: 16 });
        let outcome = read(bag::open(&path).unwrap());
        prop_assert!(outcome.errors.is_empty(), "{:?}", outcome.errors);
        prop_assert_eq!(&outcome.samples, &in_order(&written));
        for (way, options) in foreign_ways() {
            let outcome = read_bytes(record_with(options, &written)).unwrap();
            prop_assert!(outcome.errors.is_empty(), "{}: {:?}", way, outcome.errors);
            prop_assert_eq!(&outcome.samples, &in_order(&written), "{}", way);
        }
    }
}
