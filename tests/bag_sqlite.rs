//! rosbag2 folders and sqlite3 files of several ages, compressions and kinds of damage.

#[path = "bag_support/recordings.rs"]
mod recordings;

use std::{fs, io::Write, path::Path};

use recordings::{Outcome, SCHEMA, Sample, TOPICS, in_order, read, record, samples};
use rusqlite::params;
use trajectory_selector::bag::{self, BagError, WriterOptions};

/// What distinguishes recorders: Foxy, Humble, Iron and later.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Age {
    WithoutQos,
    Humble,
    Jazzy,
}

fn record_sqlite(path: &Path, samples: &[Sample], age: Age) {
    let database = rusqlite::Connection::open(path).expect("a disk with room");
    let (qos_column, qos) = match age {
        Age::WithoutQos => ("", ""),
        _ => (", offered_qos_profiles TEXT NOT NULL", ", '- history: 3'"),
    };
    let (hash_column, hash) = match age {
        Age::Jazzy => (", type_description_hash TEXT NOT NULL", ", 'RIHS01_0'"),
        _ => ("", ""),
    };
    database
        .execute_batch(&format!(
            "create table topics(id integer primary key, name text not null, type text not null,
               serialization_format text not null{qos_column}{hash_column});
             create table messages(id integer primary key, topic_id integer not null,
               timestamp integer not null, data blob not null);
             create index timestamp_idx on messages (timestamp asc);"
        ))
        .expect("a disk with room");
    if age == Age::Jazzy {
        database
            .execute_batch(&format!(
                "create table message_definitions(id integer primary key, topic_type text not null,
                   encoding text not null, encoded_message_definition text not null,
                   type_description_hash text not null);
                 insert into message_definitions values(1, 'std_msgs/msg/String', 'ros2msg', '{SCHEMA}', '');"
            ))
            .expect("a disk with room");
    }
    for (number, topic) in TOPICS.iter().enumerate() {
        let insert = format!("insert into topics values(?1, ?2, 'std_msgs/msg/String', 'cdr'{qos}{hash})");
        database.execute(&insert, params![number as i64 + 1, topic]).expect("a disk with room");
    }
    database.execute_batch("begin").expect("a disk with room");
    for sample in samples {
        let insert = "insert into messages(topic_id, timestamp, data) values(?1, ?2, ?3)";
        database
            .execute(insert, params![sample.topic as i64 + 1, sample.log_time_ns, sample.data])
            .expect("a disk with room");
    }
    database.execute_batch("commit").expect("a disk with room");
}

fn metadata(files: &[&str], count: usize, compression: &str) -> String {
    let mode = if compression.is_empty() { ["", ""] } else { ["zstd", compression] };
    let list: String = files.iter().map(|file| format!("    - {file}\n")).collect();
    format!(
        "rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: sqlite3\n  duration:\n    nanoseconds: 1\n  \
         message_count: {count}\n  compression_format: \"{}\"\n  compression_mode: \"{}\"\n  relative_file_paths:\n{list}",
        mode[0], mode[1]
    )
}

fn sound(path: &Path) -> Outcome {
    let outcome = read(bag::open(path).expect("a sound recording"));
    assert!(outcome.errors.is_empty(), "{:?}", outcome.errors);
    outcome
}

/// Samples out of order, with equal times, that fill several blocks.
fn unordered() -> Vec<Sample> {
    let mut samples = samples(2000);
    for (number, sample) in samples.iter_mut().enumerate() {
        sample.log_time_ns = 1_000 + (number as i64 * 7919) % 500;
    }
    samples
}

#[test]
fn databases_of_every_age_read_in_order() {
    let folder = tempfile::tempdir().unwrap();
    for age in [Age::WithoutQos, Age::Humble, Age::Jazzy] {
        let path = folder.path().join(format!("{age:?}.db3"));
        let written = unordered();
        record_sqlite(&path, &written, age);
        let reader = bag::open(&path).unwrap();
        assert_eq!(reader.message_count(), 2000, "{age:?}");
        assert_eq!(reader.time_range_ns(), Some((1_000, 1_499)), "{age:?}");
        for connection in reader.connections() {
            assert_eq!(connection.schema.is_some(), age == Age::Jazzy);
            assert_eq!(connection.offered_qos.is_some(), age != Age::WithoutQos);
            assert_eq!(&*connection.type_name, "std_msgs/msg/String");
        }
        assert_eq!(sound(&path).samples, in_order(&written), "{age:?}");
    }
}

#[test]
fn the_files_of_a_folder_read_as_one_recording() {
    let folder = tempfile::tempdir().unwrap();
    let written = samples(900);
    let at = |name: &str| folder.path().join(name);
    record_sqlite(&at("d_0.db3"), &written[..300], Age::Jazzy);
    record_sqlite(&at("d_1.db3"), &written[300..600], Age::Jazzy);
    record(&at("d_2.mcap"), &written[600..], WriterOptions::default());
    // An early recorder put the folder's name in front.
    fs::write(at("metadata.yaml"), metadata(&["d_0.db3", "old_name/d_1.db3", "d_2.mcap"], 900, "")).unwrap();
    assert_eq!(sound(folder.path()).samples, written);

    // Files whose times overlap still come out in order.
    record_sqlite(&at("d_0.db3.new"), &unordered(), Age::Jazzy);
    fs::rename(at("d_0.db3.new"), at("d_0.db3")).unwrap();
    record_sqlite(&at("e_1.db3"), &unordered(), Age::Jazzy);
    fs::write(at("metadata.yaml"), metadata(&["d_0.db3", "e_1.db3"], 4000, "")).unwrap();
    let twice = [unordered(), unordered()].concat();
    let reader = bag::open(folder.path()).unwrap();
    assert_eq!(reader.connections().len(), TOPICS.len());
    assert_eq!(read(reader).samples, in_order(&twice));
}

/// One that counts without end would be read for ever; this one would be read as a recording.
#[test]
fn a_view_in_place_of_a_table_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    for (table, columns) in [
        ("topics", "1 id, '/a' name, 't' type, 'cdr' serialization_format, '' offered_qos_profiles"),
        ("messages", "1 id, 1 topic_id, 1 timestamp, x'00' data"),
        ("message_definitions", "1 id, 't' topic_type, 'e' encoding, 'd' encoded_message_definition"),
    ] {
        let path = folder.path().join(format!("{table}.db3"));
        record_sqlite(&path, &[], Age::Jazzy);
        let database = rusqlite::Connection::open(&path).unwrap();
        database
            .execute_batch(&format!("drop table {table}; create view {table} as select {columns}"))
            .unwrap();
        drop(database);
        let refused = bag::open(&path).unwrap_err().to_string();
        assert!(refused.contains("prohibited"), "{table}: {refused}");
    }
}

#[test]
fn unwanted_payloads_are_not_fetched() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("d.db3");
    let written = samples(90);
    record_sqlite(&path, &written, Age::Humble);
    let mut reader = bag::open(&path).unwrap();
    reader.select(|connection| &*connection.topic == TOPICS[2]);
    let wanted: Vec<Sample> = written.into_iter().filter(|sample| sample.topic == 2).collect();
    let outcome = read(reader);
    assert!(outcome.errors.is_empty(), "{:?}", outcome.errors);
    assert_eq!(outcome.samples, wanted);
}

#[test]
fn zstd_compression_of_files_and_of_messages_is_undone() {
    let folder = tempfile::tempdir().unwrap();
    let written = samples(300);
    let at = |name: &str| folder.path().join(name);
    for name in ["plain.db3", "plain.mcap"] {
        if name.ends_with("mcap") {
            record(&at(name), &written, WriterOptions::default());
        } else {
            record_sqlite(&at(name), &written, Age::Jazzy);
        }
        let packed = format!("{name}.zstd");
        fs::write(at(&packed), zstd::encode_all(fs::File::open(at(name)).unwrap(), 1).unwrap()).unwrap();
        fs::write(at("metadata.yaml"), metadata(&[&packed], 300, "FILE")).unwrap();
        assert_eq!(sound(folder.path()).samples, written, "{name}");
    }

    let mut packed = written.clone();
    for sample in &mut packed {
        sample.data = zstd::encode_all(sample.data.as_slice(), 1).unwrap();
    }
    record_sqlite(&at("messages.db3"), &packed, Age::Jazzy);
    fs::write(at("metadata.yaml"), metadata(&["messages.db3"], 300, "MESSAGE")).unwrap();
    assert_eq!(sound(folder.path()).samples, written);

    packed[100].data.truncate(10);
    fs::remove_file(at("messages.db3")).unwrap();
    record_sqlite(&at("messages.db3"), &packed, Age::Jazzy);
    let outcome = read(bag::open(folder.path()).unwrap());
    assert_eq!(outcome.samples, written[..100]);
    assert!(matches!(outcome.errors.as_slice(), [BagError::Damaged { .. }]), "{:?}", outcome.errors);

    let other = metadata(&["messages.db3"], 300, "MESSAGE").replace("zstd", "lzma");
    fs::write(at("metadata.yaml"), other).unwrap();
    let error = bag::open(folder.path()).unwrap_err();
    assert!(matches!(error, BagError::Unsupported { .. }), "{error}");
}

#[test]
fn a_database_that_is_cut_or_no_recording_is_called_so() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    record_sqlite(&at("whole.db3"), &samples(500), Age::Jazzy);
    let bytes = fs::read(at("whole.db3")).unwrap();
    for cut in (16..bytes.len()).step_by(4097) {
        fs::write(at("cut.db3"), &bytes[..cut]).unwrap();
        let error = bag::open(at("cut.db3")).unwrap_err();
        assert!(matches!(error, BagError::Truncated { offset, .. } if offset == cut as u64), "{error}");
    }
    rusqlite::Connection::open(at("other.db3"))
        .unwrap()
        .execute_batch("create table cars(id integer primary key)")
        .unwrap();
    let error = bag::open(at("other.db3")).unwrap_err();
    assert!(matches!(error, BagError::Sqlite { .. }), "{error}");
    let mut garbage = fs::File::create(at("garbage.db3")).unwrap();
    garbage.write_all(b"SQLite format 3\0").unwrap();
    garbage.write_all(&[0xa5; 5000]).unwrap();
    drop(garbage);
    assert!(bag::open(at("garbage.db3")).is_err());
}

#[test]
fn a_flipped_byte_in_a_database_never_panics() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("whole.db3");
    record_sqlite(&path, &samples(200), Age::Jazzy);
    let bytes = fs::read(&path).unwrap();
    let flipped_path = folder.path().join("flipped.db3");
    for at in (0..bytes.len()).step_by(151) {
        let mut flipped = bytes.clone();
        flipped[at] ^= 0xff;
        fs::write(&flipped_path, flipped).unwrap();
        if let Ok(reader) = bag::open(&flipped_path) {
            let outcome = read(reader);
            assert!(outcome.samples.len() <= 300, "byte {at}");
        }
    }
}
