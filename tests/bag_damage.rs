//! Damaged recordings give what is intact and a clear error: never a wrong message, a panic or a hang.

#[path = "bag_support/recordings.rs"]
mod recordings;

use std::fs;

use recordings::{SCHEMA, Sample, foreign_ways, read, read_bytes, record, record_with, samples};
use trajectory_selector::bag::{self, BagError, DataBefore, WriterOptions};

fn own_recording(written: &[Sample]) -> Vec<u8> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("out.mcap");
    record(&path, written, WriterOptions { chunk_bytes: 2000, queue_messages: 64 });
    fs::read(&path).expect("just written")
}

/// Every way of writing, with checksums where the way has them.
fn recordings(written: &[Sample]) -> Vec<(&'static str, Vec<u8>)> {
    let mut all: Vec<_> =
        foreign_ways().into_iter().map(|(way, options)| (way, record_with(options, written))).collect();
    all.push(("our own", own_recording(written)));
    all
}

#[test]
fn a_cut_gives_a_prefix_and_says_where() {
    let written = samples(150);
    for (way, bytes) in recordings(&written) {
        for cut in (1..bytes.len()).step_by(97) {
            let outcome = match read_bytes(bytes[..cut].to_vec()) {
                Ok(outcome) => outcome,
                Err(error) => {
                    assert!(
                        cut < 8 && matches!(error, BagError::Truncated { .. }),
                        "{way} at {cut}: {error}"
                    );
                    continue;
                }
            };
            let count = outcome.samples.len();
            assert_eq!(outcome.samples, written[..count], "{way} at {cut}");
            let [BagError::Truncated { offset, messages_read, .. }] = outcome.errors.as_slice() else {
                panic!("{way} at {cut}: {:?}", outcome.errors)
            };
            assert!(*offset <= cut as u64, "{way} at {cut}: {offset}");
            assert_eq!(*messages_read, count as u64, "{way} at {cut}");
        }
    }
}

#[test]
fn a_flipped_byte_is_noticed_or_harmless() {
    let written = samples(150);
    for (way, bytes) in recordings(&written) {
        for (number, at) in (0..bytes.len()).step_by(7).enumerate() {
            let mut flipped = bytes.clone();
            flipped[at] ^= [0x01, 0x80, 0xff, 0x10][number % 4];
            let Ok(outcome) = read_bytes(flipped) else { continue };
            let count = outcome.samples.len();
            if outcome.errors.is_empty() {
                assert_eq!(outcome.samples, written, "{way}: byte {at} changed the drive unnoticed");
            } else if outcome.errors[0].data_before() == DataBefore::Valid {
                // Topics come from definitions that the flip may have hit; payloads and order must hold.
                assert!(count <= written.len(), "{way}: byte {at}");
                let mut rest = written.iter();
                for sample in &outcome.samples {
                    assert!(
                        rest.any(|expected| expected == sample),
                        "{way}: byte {at} gave a message that was never recorded"
                    );
                }
            }
        }
    }
}

#[test]
fn a_wrong_chunk_checksum_names_the_chunk() {
    let written = samples(60);
    let mut bytes = record_with(mcap::WriteOptions::new().chunk_size(Some(2000)).compression(None), &written);
    let payload = &written[40].data;
    let at = bytes.windows(payload.len()).position(|window| window == payload).unwrap();
    bytes[at + 10] ^= 1;
    let outcome = read_bytes(bytes).unwrap();
    let [error @ BagError::ChunkCrc { offset, .. }] = outcome.errors.as_slice() else {
        panic!("{:?}", outcome.errors)
    };
    assert!(*offset < at as u64);
    assert_eq!(error.data_before(), DataBefore::Valid);
    let count = outcome.samples.len();
    assert!((1..=40).contains(&count), "{count}");
    assert_eq!(outcome.samples, written[..count]);
}

#[test]
fn a_length_is_checked_before_it_is_believed() {
    let written = samples(60);
    let bytes = own_recording(&written);
    // The first chunk follows magic and header: opcode, length, times, uncompressed size.
    let header_len = u64::from_le_bytes(bytes[9..17].try_into().unwrap()) as usize;
    let chunk = 17 + header_len;
    assert_eq!(bytes[chunk], 6, "the first chunk");
    for (field, name) in [(1, "record length"), (25, "uncompressed size"), (46, "compressed size")] {
        for claim in [u64::MAX, 1 << 40, 3 << 30, bytes.len() as u64 + 1] {
            let mut corrupt = bytes.clone();
            corrupt[chunk + field..chunk + field + 8].copy_from_slice(&claim.to_le_bytes());
            let Ok(outcome) = read_bytes(corrupt) else { continue };
            assert!(!outcome.errors.is_empty(), "{name} {claim}");
            assert!(outcome.samples.is_empty(), "{name} {claim}");
        }
    }
}

#[test]
fn what_is_no_recording_is_called_so() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    fs::write(at("empty.mcap"), b"").unwrap();
    fs::write(at("notes.txt"), b"not a recording at all").unwrap();
    fs::create_dir(at("bare")).unwrap();
    fs::create_dir(at("other")).unwrap();
    fs::write(at("other/drive_0.mcap"), b"").unwrap();
    fs::create_dir(at("lost")).unwrap();
    let metadata = "rosbag2_bagfile_information:\n  relative_file_paths: [gone_0.mcap]\n";
    fs::write(at("lost/metadata.yaml"), metadata).unwrap();
    fs::create_dir(at("broken")).unwrap();
    fs::write(at("broken/metadata.yaml"), "rosbag2_bagfile_information: [1, 2").unwrap();

    let error = |name: &str| bag::open(at(name)).map(|_| ()).unwrap_err();
    assert!(matches!(error("missing.mcap"), BagError::NotFound { .. }));
    assert!(matches!(error("empty.mcap"), BagError::Empty { .. }));
    assert!(matches!(error("notes.txt"), BagError::NotABag { found, .. } if found.contains("not a")));
    assert!(matches!(error("bare"), BagError::NoBagInFolder { .. }));
    assert!(
        matches!(error("other"), BagError::NoBagInFolder { found, .. } if found.contains("drive_0.mcap"))
    );
    assert!(matches!(error("lost"), BagError::MissingFile { file, .. } if file == "gone_0.mcap"));
    assert!(matches!(error("broken"), BagError::Metadata { .. }));
}

#[test]
fn a_count_that_does_not_add_up_is_reported() {
    let folder = tempfile::tempdir().unwrap();
    let written = samples(10);
    let options = WriterOptions::default();
    record(&folder.path().join("one.mcap"), &written, options);
    let metadata = "rosbag2_bagfile_information:\n  message_count: 12\n  relative_file_paths: [one.mcap]\n";
    fs::write(folder.path().join("metadata.yaml"), metadata).unwrap();
    let outcome = read(bag::open(folder.path()).unwrap());
    assert_eq!(outcome.samples, written);
    let [error @ BagError::WrongCount { expected: 12, read: 10, .. }] = outcome.errors.as_slice() else {
        panic!("{:?}", outcome.errors)
    };
    assert_eq!(error.data_before(), DataBefore::Incomplete);
}

#[test]
fn other_encodings_are_told_per_connection() {
    use std::{collections::BTreeMap, io::Cursor};
    let mut file = Cursor::new(Vec::new());
    let mut writer = mcap::WriteOptions::new().create(&mut file).unwrap();
    let schema = writer.add_schema("std_msgs/msg/String", "ros2msg", SCHEMA.as_bytes()).unwrap();
    writer.add_channel(schema, "/a", "cdr", &BTreeMap::new()).unwrap();
    writer.add_channel(schema, "/b", "json", &BTreeMap::new()).unwrap();
    writer.finish().unwrap();
    drop(writer);
    let reader = bag::Reader::from_mcap("test", file).unwrap();
    let cdr: Vec<bool> = reader.connections().iter().map(bag::Connection::is_cdr).collect();
    assert_eq!(cdr, [true, false]);
}
