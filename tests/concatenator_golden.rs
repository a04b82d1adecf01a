//! The concatenator gives out what the original gave out, event by event.
//!
//! The order between generators is ours and not compared; the order inside a generator is. A generator that one message
//! announces twice is the one intended difference, so such lists would have to be left out; there are none.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may fail loudly")]

#[path = "golden_support/shared.rs"]
mod shared;

use std::collections::BTreeMap;
use std::fs;
use std::sync::Arc;

use messages::autoware_internal_planning_msgs::{CandidateTrajectories, CandidateTrajectory, GeneratorInfo};
use messages::autoware_planning_msgs::TrajectoryPoint;
use messages::builtin_interfaces::Time;
use messages::std_msgs::{Header, Text};
use messages::unique_identifier_msgs::Uuid;
use selection::{Concatenated, Concatenator};
use serde_json::Value;

/// By generator id: its name, and what identifies its trajectories in their order.
type Content = BTreeMap<String, (String, Vec<f64>)>;

fn time(seconds: &Value) -> Time {
    Time::from_nanoseconds((seconds.as_f64().unwrap() * 1e9).round() as i64)
}

fn uuid(text: &Value) -> Uuid {
    Uuid { uuid: u128::from_str_radix(text.as_str().unwrap(), 16).unwrap().to_be_bytes() }
}

fn list(value: &Value) -> &[Value] {
    value.as_array().unwrap()
}

fn message(add: &Value) -> CandidateTrajectories {
    let trajectory = |candidate: &Value| {
        let mut point = TrajectoryPoint::default();
        point.pose.position.x = candidate["x"].as_f64().unwrap();
        Arc::new(CandidateTrajectory {
            header: Header { stamp: time(&candidate["stamp"]), frame_id: "map".to_owned() },
            generator_id: uuid(&candidate["generator"]),
            points: vec![point],
            ..CandidateTrajectory::default()
        })
    };
    let info = |generator: &Value| GeneratorInfo {
        generator_id: uuid(&generator["id"]),
        generator_name: Text { data: generator["name"].as_str().unwrap().to_owned() },
    };
    CandidateTrajectories {
        candidate_trajectories: list(&add["candidates"]).iter().map(trajectory).collect(),
        generator_info: list(&add["generators"]).iter().map(info).collect(),
    }
}

fn ours(result: &Concatenated) -> Content {
    let mut content = Content::new();
    for info in &result.generators {
        let known =
            content.insert(info.generator_id.to_string(), (info.generator_name.data.clone(), Vec::new()));
        assert_eq!(known, None, "each generator once");
    }
    for candidate in &result.candidates {
        let (_, trajectories) = content.get_mut(&candidate.key.generator.to_string()).unwrap();
        assert_eq!(candidate.key.sample as usize, trajectories.len());
        trajectories.push(candidate.points[0].pose.position.x);
    }
    content
}

fn expected(value: &Value) -> Content {
    let mut content = Content::new();
    for generator in list(&value["generators"]) {
        let text = |key: &str| generator[key].as_str().unwrap().to_owned();
        assert_eq!(content.insert(text("id"), (text("name"), Vec::new())), None);
    }
    for candidate in list(&value["candidates"]) {
        let (_, trajectories) = content.get_mut(candidate["generator"].as_str().unwrap()).unwrap();
        trajectories.push(candidate["x"].as_f64().unwrap());
    }
    content
}

#[test]
fn every_reading_equals_the_original() {
    let Some(golden) = shared::golden("every_reading_equals_the_original") else { return };
    let (mut files, mut readings, mut given_out) = (0, 0, 0);
    for entry in fs::read_dir(golden.join("concatenator/open")).unwrap() {
        let path = entry.unwrap().path();
        let file: Value = serde_json::from_slice(&fs::read(&path).unwrap()).unwrap();
        assert_eq!(file["format"], "concatenator/1");
        let mut concatenator = Concatenator::new(file["duration_time"].as_f64().unwrap());
        for (index, (event, answer)) in list(&file["events"]).iter().zip(list(&file["expected"])).enumerate()
        {
            if let Some(add) = event.get("add") {
                concatenator.add(&message(add));
            } else if let Some(duration) = event.get("duration_time") {
                concatenator.set_duration_time_s(duration.as_f64().unwrap());
            } else {
                let result = concatenator.get(time(&event["get"]));
                assert_eq!(ours(&result), expected(answer), "{} event {index}", path.display());
                assert_eq!(result.oddities.announced_twice, 0);
                readings += 1;
                given_out += result.candidates.len();
            }
        }
        files += 1;
    }
    println!("{files} files, {readings} readings, {given_out} trajectories given out");
    assert!(files >= 60 && readings > files && given_out > readings);
}
