//! What a node is fed in tests and benchmarks: the least map that counts as one, and messages of candidates.
#![allow(dead_code, unreachable_pub, reason = "several programs share this, each uses its own part")]

use lanelet_map::{Map, MapBuilder};
use messages::autoware_internal_planning_msgs::{CandidateTrajectories, CandidateTrajectory, GeneratorInfo};
use messages::autoware_planning_msgs::TrajectoryPoint;
use messages::builtin_interfaces::Time;
use messages::std_msgs::{Header, Text};
use messages::unique_identifier_msgs::Uuid;
use std::sync::Arc;

/// 50 m of road along x, 4 m wide.
pub fn one_lanelet() -> Map {
    let mut builder = MapBuilder::new();
    for (id, x, y) in [(1, 0.0, 2.0), (2, 50.0, 2.0), (3, 0.0, -2.0), (4, 50.0, -2.0)] {
        builder.point(id, [x, y, 0.0], &[]).unwrap();
    }
    builder.line_string(11, &[1, 2], &[]).unwrap();
    builder.line_string(12, &[3, 4], &[]).unwrap();
    builder.lanelet(21, 11, 12, &[("subtype", "road")]).unwrap();
    builder.build().unwrap()
}

/// Identity of a generator from a number.
pub fn generator(number: u8) -> Uuid {
    Uuid { uuid: [number; 16] }
}

/// A message in frame `map`: generators by number and name, candidates by their generator's number and their points.
pub fn candidate_set(
    stamp: Time,
    generators: impl IntoIterator<Item = (u8, String)>,
    candidates: impl IntoIterator<Item = (u8, Vec<TrajectoryPoint>)>,
) -> Arc<CandidateTrajectories> {
    let info = |(number, name)| GeneratorInfo {
        generator_id: generator(number),
        generator_name: Text { data: name },
    };
    let candidate = |(number, points)| {
        Arc::new(CandidateTrajectory {
            header: Header { stamp, frame_id: "map".to_owned() },
            generator_id: generator(number),
            points,
            ..CandidateTrajectory::default()
        })
    };
    Arc::new(CandidateTrajectories {
        candidate_trajectories: candidates.into_iter().map(candidate).collect(),
        generator_info: generators.into_iter().map(info).collect(),
    })
}
