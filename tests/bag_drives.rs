//! The recorded drives, which another program wrote, read in full.

#[path = "bag_support/recordings.rs"]
mod recordings;

use std::{collections::BTreeMap, fs, io::Cursor};

use trajectory_selector::bag::{self, BagError, RawMessage, Reader};

const PREFIX: &str = "/trajectory_selector_node/input/";
const TOPICS: [(&str, &str); 8] = [
    ("lanelet2_map", "autoware_map_msgs/msg/LaneletMapBin"),
    ("route", "autoware_planning_msgs/msg/LaneletRoute"),
    ("odometry", "nav_msgs/msg/Odometry"),
    ("acceleration", "geometry_msgs/msg/AccelWithCovarianceStamped"),
    ("objects", "autoware_perception_msgs/msg/PredictedObjects"),
    ("traffic_signals", "autoware_perception_msgs/msg/TrafficLightGroupArray"),
    ("trajectories_generative", "autoware_internal_planning_msgs/msg/CandidateTrajectories"),
    ("trajectories_backup", "autoware_internal_planning_msgs/msg/CandidateTrajectories"),
];
const COUNTS: [(&str, [u64; 8]); 6] = [
    ("intersection.mcap", [1, 1, 1000, 1000, 200, 200, 194, 200]),
    ("intersection_052.mcap", [1, 1, 250, 250, 50, 50, 49, 50]),
    ("intersection_sqlite", [1, 1, 250, 250, 50, 50, 49, 50]),
    ("stress.mcap", [1, 1, 150, 150, 30, 30, 29, 30]),
    ("crosswalk.mcap", [1, 1, 600, 600, 120, 120, 119, 120]),
    ("parking.mcap", [1, 1, 300, 300, 60, 60, 59, 60]),
];

fn messages(reader: Reader) -> Vec<(String, RawMessage)> {
    let topics: Vec<String> =
        reader.connections().iter().map(|connection| connection.topic.to_string()).collect();
    reader
        .map(|message| message.expect("the drives are sound"))
        .map(|message| (topics[message.connection].clone(), message))
        .collect()
}

#[test]
fn every_drive_has_the_messages_of_its_table() {
    let Some(drives) = recordings::drives() else { return };
    for (name, counts) in COUNTS {
        let reader = bag::open(drives.join(name)).unwrap();
        assert!(reader.warnings().is_empty(), "{name}: {:?}", reader.warnings());
        assert_eq!(reader.connections().len(), TOPICS.len(), "{name}");
        for ((topic, type_name), count) in TOPICS.iter().zip(counts) {
            let full = format!("{PREFIX}{topic}");
            let connection =
                reader.connections().iter().find(|connection| *connection.topic == full).unwrap();
            assert_eq!(&*connection.type_name, *type_name, "{name}");
            assert_eq!(connection.message_count, count, "{name} {topic}");
            assert!(connection.is_cdr(), "{name} {topic}");
            assert_eq!(connection.schema.as_ref().unwrap().encoding, "ros2msg", "{name} {topic}");
            let transient = connection.offered_qos.as_ref().unwrap().contains("transient_local");
            assert_eq!(transient, ["lanelet2_map", "route"].contains(topic), "{name} {topic}");
        }
        let mut read: BTreeMap<String, u64> = BTreeMap::new();
        let mut last_ns = 0;
        for (topic, message) in messages(reader) {
            assert!(message.log_time_ns >= last_ns, "{name}: goes back at {last_ns}");
            last_ns = message.log_time_ns;
            assert_eq!(message.data[..2], [0, 1], "{name}: little-endian CDR");
            *read.entry(topic).or_default() += 1;
        }
        let expected: BTreeMap<String, u64> = TOPICS
            .iter()
            .zip(counts)
            .map(|((topic, _), count)| (format!("{PREFIX}{topic}"), count))
            .collect();
        assert_eq!(read, expected, "{name}");
    }
}

#[test]
fn sqlite_and_mcap_give_the_same_messages() {
    let Some(drives) = recordings::drives() else { return };
    let from_mcap = messages(bag::open(drives.join("intersection.mcap")).unwrap());
    let folder = drives.join("intersection_sqlite");
    let from_folder = messages(bag::open(&folder).unwrap());
    assert_eq!(from_folder.len(), 701);
    for (number, ((topic, message), (expected_topic, expected))) in
        from_folder.iter().zip(&from_mcap).enumerate()
    {
        assert_eq!(topic, expected_topic, "message {number}");
        assert_eq!(message.log_time_ns, expected.log_time_ns, "message {number}");
        assert!(message.data == expected.data, "message {number} on {topic}: payloads differ");
    }
    let bare = messages(bag::open(folder.join("intersection_sqlite.db3")).unwrap());
    assert!(bare == from_folder, "the bare file differs from its folder");
}

#[test]
fn half_a_drive_gives_its_first_messages_and_says_where_it_ends() {
    let Some(drives) = recordings::drives() else { return };
    let whole = messages(bag::open(drives.join("intersection.mcap")).unwrap());
    let mut bytes = fs::read(drives.join("intersection.mcap")).unwrap();
    bytes.truncate(bytes.len() / 2);
    let len = bytes.len() as u64;
    let mut reader = Reader::from_mcap("half", Cursor::new(bytes)).unwrap();
    let promised = reader.message_count();
    let mut read = 0;
    let error = loop {
        match reader.next().unwrap() {
            Ok(message) => {
                let expected = &whole[read].1;
                assert_eq!(message.log_time_ns, expected.log_time_ns);
                assert!(message.data == expected.data, "message {read} differs");
                read += 1;
            }
            Err(error) => break error,
        }
    };
    assert!(reader.next().is_none());
    assert!((1000..1800).contains(&read), "{read}");
    assert_eq!(promised, read as u64);
    let BagError::Truncated { offset, messages_read, .. } = error else { panic!("{error}") };
    assert_eq!(messages_read, read as u64);
    assert!(offset < len && offset + 400_000 > len, "{offset} of {len}");
}

#[test]
fn a_drive_without_its_summary_gives_the_same_messages() {
    let Some(drives) = recordings::drives() else { return };
    let path = drives.join("intersection_052.mcap");
    let bytes = fs::read(&path).unwrap();
    // Keep everything up to the footer's fields, and say there that no summary exists.
    let footer = bytes.len() - 8 - 20;
    let summary_start = u64::from_le_bytes(bytes[footer..footer + 8].try_into().unwrap()) as usize;
    let mut stripped = bytes[..summary_start].to_vec();
    stripped.extend_from_slice(&[2, 20, 0, 0, 0, 0, 0, 0, 0]);
    stripped.extend_from_slice(&[0; 20]);
    stripped.extend_from_slice(b"\x89MCAP0\r\n");
    let unindexed = Reader::from_mcap("stripped", Cursor::new(stripped)).unwrap();
    let indexed = bag::open(&path).unwrap();
    assert_eq!(unindexed.connections(), indexed.connections());
    assert!(messages(unindexed) == messages(indexed), "the messages differ");
}
