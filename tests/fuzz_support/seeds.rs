//! Seed corpora made from our own data.

use crate::targets::{KINDS, TARGETS};
use lanelet_map::{MapBuilder, Member, archive};
use messages::Interface;
use std::error::Error;
use std::fs;
use std::path::Path;
use trajectory_selector::bag::{McapWriter, QosProfile, WriterOptions};
use trajectory_selector::scenario::Scenario;

type Outcome = Result<(), Box<dyn Error>>;

/// Larger ones slow the fuzzer down more than they tell it.
const MAX_SEED_BYTES: usize = 6_000;

/// Writes the corpora of all targets to folders of their names.
pub(crate) fn write_all(folder: &Path) -> Outcome {
    for (target, _) in TARGETS {
        fs::create_dir_all(folder.join(target))?;
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    cdr(&folder.join("cdr"))?;
    maps(folder)?;
    recordings(folder)?;
    texts(root, folder)?;
    drawn(folder)
}

fn write(folder: &Path, name: &str, parts: &[&[u8]]) -> Outcome {
    let bytes = parts.concat();
    if bytes.len() <= MAX_SEED_BYTES {
        fs::write(folder.join(name), bytes)?;
    }
    Ok(())
}

/// The first messages of every topic of a drive, and bytes that some message of each kind begins with.
fn cdr(folder: &Path) -> Outcome {
    for (index, interface) in [Interface::V0_53, Interface::V0_52].into_iter().enumerate() {
        let front = |kind: usize| [kind as u8, index as u8];
        let mut seen = std::collections::BTreeMap::new();
        for timed in Scenario::road(1).drive().take(400) {
            let kind = KINDS.iter().position(|(name, _)| *name == timed.topic.type_name());
            let (Some(kind), Some(cdr)) = (kind, timed.input.to_cdr(interface)) else { continue };
            let count = seen.entry(kind).or_insert(0);
            *count += 1;
            if *count <= 3 {
                write(folder, &format!("{index}_{kind}_{count}"), &[&front(kind), &cdr])?;
            }
        }
        for kind in 0..KINDS.len() {
            for (name, length) in [("short", 8), ("middle", 60), ("long", 600)] {
                write(
                    folder,
                    &format!("{index}_{kind}_{name}"),
                    &[&front(kind), &[0, 1, 0, 0], &vec![0; length]],
                )?;
            }
        }
    }
    Ok(())
}

const OSM: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<osm generator="VMB" version="0.6">
  <MetaInfo format_version="1.0" map_version="3"/>
  <node id="1" lat="35.1" lon="139.7"><tag k="ele" v="19.3"/><tag k="local_x" v="0.0"/><tag k="local_y" v="3.0"/></node>
  <node id="2" lat="35.1001" lon="139.7"><tag k="ele" v="19.3"/><tag k="local_x" v="20.0"/><tag k="local_y" v="3.0"/></node>
  <node id="3" lat="35.1" lon="139.7001"><tag k="ele" v="19"/><tag k="local_x" v="0.0"/><tag k="local_y" v="0.0"/></node>
  <node id="4" lat="35.1001" lon="139.7001"><tag k="ele" v="19"/><tag k="local_x" v="20.0"/><tag k="local_y" v="0.0"/></node>
  <way id="10"><nd ref="1"/><nd ref="2"/><tag k="type" v="road_border"/></way>
  <way id="11"><nd ref="3"/><nd ref="4"/><tag k="type" v="line_thin"/></way>
  <way id="12"><nd ref="2"/><nd ref="4"/><tag k="type" v="stop_line"/></way>
  <relation id="20"><member type="way" role="left" ref="10"/><member type="way" role="right" ref="11"/>
    <member type="relation" role="regulatory_element" ref="30"/>
    <tag k="type" v="lanelet"/><tag k="subtype" v="road"/><tag k="speed_limit" v="50"/></relation>
  <relation id="30"><member type="way" role="ref_line" ref="12"/><member type="way" role="refers" ref="10"/>
    <tag k="type" v="regulatory_element"/><tag k="subtype" v="traffic_light"/></relation>
  <relation id="40"><member type="way" role="outer" ref="10"/><member type="way" role="outer" ref="11"/>
    <tag k="type" v="multipolygon"/><tag k="subtype" v="parking"/></relation>
</osm>
"#;

fn maps(folder: &Path) -> Outcome {
    for choice in 0..16 {
        write(&folder.join("osm"), &format!("choice_{choice}"), &[&[choice], OSM.as_bytes()])?;
    }
    let archives = folder.join("map_archive");
    write(&archives, "empty", &[&archive::encode(&MapBuilder::new().build()?)])?;
    write(&archives, "lanelet", &[&archive::encode(&lane()?.build()?)])?;
    let mut lit = lane()?;
    lit.regulatory_element(5, &[("ref_line", Member::LineString(12))], &[("subtype", "traffic_light")])?;
    lit.attach(1, 5)?;
    write(&archives, "light", &[&archive::encode(&lit.build()?)])
}

fn lane() -> Result<MapBuilder, Box<dyn Error>> {
    let mut builder = MapBuilder::new();
    for (id, y, kind) in [(10, 2.5, "road_border"), (11, -2.5, "line_thin"), (12, 0.0, "stop_line")] {
        builder.line_string_at(id, &[[0.0, y, 0.0], [9.0, y, 1.0]], &[("type", kind)])?;
    }
    builder.lanelet(1, 10, 11, &[("subtype", "road"), ("speed_limit", "30")])?;
    Ok(builder)
}

fn recordings(folder: &Path) -> Outcome {
    let messages: Vec<_> = Scenario::road(1)
        .drive()
        .filter_map(|timed| Some((timed.topic, timed.time, timed.input.to_cdr(Interface::V0_53)?)))
        .filter(|(.., cdr)| cdr.len() < 800)
        .take(6)
        .collect();
    let path = folder.join("mcap").join("drive");
    let mut writer = McapWriter::create(&path, WriterOptions::default())?;
    let mut topics = std::collections::BTreeMap::new();
    for (topic, time, cdr) in &messages {
        let id = match topics.get(topic) {
            Some(id) => *id,
            None => writer.add_topic(&topic.full_name(), topic.type_name(), "x", QosProfile::default())?,
        };
        topics.insert(*topic, id);
        writer.write(id, time.nanoseconds(), time.nanoseconds(), cdr.clone())?;
    }
    writer.finish()?;
    for (name, qos, hash) in [("foxy", false, false), ("humble", true, false), ("jazzy", true, true)] {
        database(&folder.join("sqlite").join(name), qos, hash, &messages[0].2)?;
    }
    let metadata = "rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: sqlite3\n  duration:\n    \
                    nanoseconds: 1\n  message_count: 3\n  compression_format: \"\"\n  compression_mode: \"\"\n  \
                    relative_file_paths:\n    - a.db3\n";
    let folders = folder.join("bag_folder");
    write(&folders, "plain", &[metadata.as_bytes()])?;
    write(&folders, "packed", &[metadata.replace("format: \"\"", "format: \"zstd\"").as_bytes()])
}

fn database(path: &Path, has_qos: bool, has_hash: bool, cdr: &[u8]) -> Outcome {
    let _ = fs::remove_file(path);
    let database = rusqlite::Connection::open(path)?;
    let qos = if has_qos { ", offered_qos_profiles text not null" } else { "" };
    let hash = if has_hash { ", type_description_hash text not null" } else { "" };
    database.execute_batch(&format!(
        "pragma page_size = 512; vacuum;
         create table topics(id integer primary key, name text not null, type text not null,
           serialization_format text not null{qos}{hash});
         create table messages(id integer primary key, topic_id integer not null, timestamp integer not null,
           data blob not null);"
    ))?;
    let (qos, hash) = (if has_qos { ", ''" } else { "" }, if has_hash { ", 'h'" } else { "" });
    database.execute_batch(&format!(
        "insert into topics values(1, '/a', 'std_msgs/msg/String', 'cdr'{qos}{hash})"
    ))?;
    for time_ns in 1..4 {
        let cdr = &cdr[..cdr.len().min(60)];
        database.execute("insert into messages values(?1, 1, ?1, ?2)", rusqlite::params![time_ns, cdr])?;
    }
    Ok(())
}

const ARGUMENTS: [&str; 5] = [
    "node\n--ros-args\n-r\n__node:=other\n-r\n__ns:=/a/b\n-p\nuse_sim_time:=true\n--params-file\na.yaml",
    "node\n--ros-args\n--remap\n~/input/odometry:=/odometry\n--\nrest",
    "node\n--ros-args\n-r\nother_node:/topic:=rostopic://new\n--log-level\nnode:=debug",
    "node\n--ros-args\n--log-level\ninfo\n--disable-stdout-logs\n--enable-rosout-logs\n-e\n/enclave",
    "node\n--ros-args\n-p\nthresholds:=[1.0, 2, .nan]\n--log-config-file\nx",
];

fn texts(root: &Path, folder: &Path) -> Outcome {
    for (number, arguments) in ARGUMENTS.into_iter().enumerate() {
        write(&folder.join("ros_arguments"), &number.to_string(), &[arguments.as_bytes()])?;
    }
    let parameters = folder.join("parameter_files");
    for entry in fs::read_dir(root.join("config"))? {
        let path = entry?.path();
        if path.extension().is_some_and(|ending| ending == "yaml") {
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            let text = fs::read_to_string(&path)?;
            write(&parameters, &name, &[text.as_bytes()])?;
            // Without what people read, and in pieces.
            let lines: Vec<&str> = text.lines().filter(|line| !line.trim_start().starts_with('#')).collect();
            write(
                &parameters,
                &format!("{name}.short"),
                &[lines[..lines.len().min(25)].join("\n").as_bytes()],
            )?;
        }
    }
    let single = "/**:\n  ros__parameters:\n    duration_time: 0.3\n\0duration_time:=0.5";
    write(&parameters, "single", &[single.as_bytes()])?;
    for entry in fs::read_dir(root.join("config/scenes"))? {
        let path = entry?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        write(&folder.join("parking_scene"), &name, &[&fs::read(&path)?])?;
    }
    write(&folder.join("verify_scene"), "sequence", &[SEQUENCE.as_bytes()])
}

const SEQUENCE: &str = r#"{"format":"trajectory-filters/2","name":"n","tags":["a"],"map":"m.osm",
"vehicle":{"wheel_radius":0.45,"wheel_width":0.3,"wheel_base":4.76,"wheel_tread":1.75,"front_overhang":1.11,
"rear_overhang":1.12,"left_overhang":0.15,"right_overhang":0.15,"vehicle_height":3.0,"max_steer_angle":0.65},
"params":{"crosswalk":{"stop_duration":0.5},"boundary_departure":{"lateral_margin_m":-0.1}},
"filters":["vehicle_constraint_filter","crosswalk_filter"],"columns":["t","x","y","z","yaw","v","vy","a"],
"cycles":[{"time":3.44,"odometry":{"x":0,"y":0,"z":0,"yaw":0.1,"vx":2},"acceleration":{"ax":0},
"objects":[{"id":"b565fe637d6de1a5b238788d608988b9","classes":[[1,0.9]],"x":9,"y":1,"z":0,"yaw":0,"vx":1,
"shape":{"type":0,"x":4.5,"y":1.9,"z":1.6},"paths":[{"confidence":0.5,"dt":0.5,"points":[[9,1,0],[10,1,0],[11,1,0]]}]}],
"signals":[{"id":5,"elements":[[1,1,2,1.0]]}],"route":[1,2],"params":{"crosswalk":{"stop_duration":1}},
"candidates":[{"generator":"b565fe637d6de1a5b238788d608988b8","sample":0,"points":[[0,0,0,0,0,2,0,0.1],
[0.1,0.2,0,0,0.01,2,0,0.1],[0.2,0.4,0,0,0.02,2,0,"nan"],[0.3,0.6,0,0,0.02,2,0,0],[0.4,0.8,0,0,0,2,0,-1]]}]}],
"expected":[[{"vehicle_constraint_filter":{"feasible":true,"metrics":[["check_speed",0,0]]},
"crosswalk_filter":{"error":"x"}}]]}"#;

/// Scenes of different lengths: what is drawn from them is as good as any.
fn drawn(folder: &Path) -> Outcome {
    let mut state = 1_u64;
    let mut noise = |length: usize| -> Vec<u8> {
        let mut next = || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            state.to_le_bytes()[4]
        };
        (0..length).map(|_| next()).collect()
    };
    for target in ["cycle", "open_space"] {
        for length in [40, 100, 250, 700, 1500] {
            for number in 0..4 {
                write(&folder.join(target), &format!("{length}_{number}"), &[&noise(length)])?;
            }
        }
    }
    Ok(())
}
