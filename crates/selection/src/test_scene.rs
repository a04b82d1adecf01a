//! Small scenes and candidates for the tests of this crate.

use crate::candidate::{Candidate, CandidateKey};
use crate::scene::{Epoch, HdMap, Scene};
use lanelet_map::MapBuilder;
use messages::autoware_internal_planning_msgs::CandidateTrajectory;
use messages::builtin_interfaces::Time;
use messages::std_msgs::Header;
use messages::unique_identifier_msgs::Uuid;
use motion::{Pose, TimeFromStart, TrajectoryPoint, VehicleInfo};
use std::sync::Arc;

/// An empty map in frame `map`, and nothing else received.
pub(crate) fn scene() -> Scene {
    let mut scene = Scene::empty(Time { sec: 10, nanosec: 0 }, Arc::new(VehicleInfo::default()));
    let map = Arc::new(MapBuilder::new().build().unwrap());
    scene.map = Some(Epoch { number: 1, value: HdMap::new("map".into(), map) });
    scene
}

/// `count` points along x, 0.1 s apart, at a constant speed.
pub(crate) fn straight(count: usize, speed_mps: f32) -> Vec<TrajectoryPoint> {
    let point = |index: usize| TrajectoryPoint {
        time_from_start: TimeFromStart::from_nanos(index as i64 * 100_000_000),
        pose: Pose::from_xy_yaw(index as f64 * 0.1 * f64::from(speed_mps), 0.0, 0.0),
        longitudinal_velocity_mps: speed_mps,
        ..TrajectoryPoint::default()
    };
    (0..count).map(point).collect()
}

/// A candidate with these points; its message has a header in frame `map` and no points of its own.
pub(crate) fn candidate_of(points: Vec<TrajectoryPoint>) -> Candidate {
    let header = Header { stamp: Time { sec: 10, nanosec: 0 }, frame_id: "map".to_owned() };
    Candidate {
        key: CandidateKey { generator: Uuid::default(), sample: 0 },
        generator_name: "planner".into(),
        message: Arc::new(CandidateTrajectory { header, ..CandidateTrajectory::default() }),
        points: Arc::new(points.into_iter().collect()),
    }
}
