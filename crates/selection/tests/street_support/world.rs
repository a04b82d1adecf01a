//! A street that holds a danger for each filter, and the candidate that runs into all of them.

#![allow(dead_code, reason = "every test program uses its own part")]

use lanelet_map::{Map, MapBuilder, Member};
use messages::autoware_internal_planning_msgs::CandidateTrajectory;
use messages::autoware_perception_msgs::{
    ObjectClassification, PredictedObject, PredictedObjects, PredictedPath, Shape, TrafficLightElement,
    TrafficLightGroup, TrafficLightGroupArray,
};
use messages::autoware_planning_msgs::{LaneletRoute, LaneletSegment, TrajectoryPoint};
use messages::builtin_interfaces::{Duration, Time};
use messages::geometry_msgs::{AccelWithCovarianceStamped, Point, Pose, Quaternion};
use messages::nav_msgs::Odometry;
use messages::std_msgs::Header;
use messages::unique_identifier_msgs::Uuid;
use motion::VehicleInfo;
use selection::scene::{Epoch, HdMap};
use selection::{Candidate, Scene};
use std::sync::Arc;

pub(crate) const START_S: i32 = 1_000;
/// Lanelets of the road: with the light and the crosswalk, and a turn-off without either.
pub(crate) const ROAD: i64 = 1;
pub(crate) const TURN_OFF: i64 = 2;
pub(crate) const LIGHT: i64 = 500;

/// A road along x, 5 m wide, with borders; a crosswalk behind the stop line at x = 18 and, if wanted, a light at 20.
pub(crate) fn street(has_light: bool) -> Map {
    let mut builder = MapBuilder::new();
    let mut line = |id: i64, from: [f64; 2], to: [f64; 2], kind: &str| {
        let places = [from, to].map(|[x, y]| [x, y, 0.0]);
        builder.line_string_at(id, &places, &[("type", kind)]).unwrap();
    };
    line(10, [-20.0, 2.5], [100.0, 2.5], "road_border");
    line(11, [-20.0, -2.5], [100.0, -2.5], "road_border");
    line(12, [0.0, 40.0], [50.0, 40.0], "line_thin");
    line(13, [0.0, 36.0], [50.0, 36.0], "line_thin");
    line(14, [22.0, -6.0], [22.0, 6.0], "pedestrian_marking");
    line(15, [26.0, -6.0], [26.0, 6.0], "pedestrian_marking");
    line(16, [18.0, -5.0], [18.0, 5.0], "stop_line");
    line(17, [20.0, -5.0], [20.0, 5.0], "stop_line");
    builder.lanelet(ROAD, 10, 11, &[("subtype", "road")]).unwrap();
    builder.lanelet(TURN_OFF, 12, 13, &[("subtype", "road")]).unwrap();
    builder.lanelet(3, 14, 15, &[("subtype", "crosswalk")]).unwrap();
    let crosswalk = [("refers", Member::Lanelet(3)), ("ref_line", Member::LineString(16))];
    builder.regulatory_element(600, &crosswalk, &[("subtype", "crosswalk")]).unwrap();
    builder.attach(ROAD, 600).unwrap();
    if has_light {
        let light = [("ref_line", Member::LineString(17))];
        builder.regulatory_element(LIGHT, &light, &[("subtype", "traffic_light")]).unwrap();
        builder.attach(ROAD, LIGHT).unwrap();
    }
    builder.build().unwrap()
}

pub(crate) fn header(sec: i32) -> Header {
    Header { stamp: Time { sec, nanosec: 0 }, frame_id: "map".to_owned() }
}

pub(crate) fn pose(x: f64, y: f64, yaw: f64) -> Pose {
    Pose { position: Point { x, y, z: 0.0 }, orientation: Quaternion::from_yaw(yaw) }
}

/// Stands still, and is predicted to go to the other side of the road.
pub(crate) fn object(id: u8, label: u8, x: f64, y: f64, size: [f64; 2]) -> PredictedObject {
    let mut object = PredictedObject { object_id: Uuid { uuid: [id; 16] }, ..PredictedObject::default() };
    object.classification = vec![ObjectClassification { label, probability: 1.0 }];
    object.shape.r#type = Shape::BOUNDING_BOX;
    (object.shape.dimensions.x, object.shape.dimensions.y) = (size[0], size[1]);
    object.kinematics.initial_pose_with_covariance.pose = pose(x, y, 0.0);
    object.kinematics.predicted_paths = vec![PredictedPath {
        path: (0..10).map(|step| pose(x, y + f64::from(step), 0.0)).collect(),
        time_step: Duration { sec: 0, nanosec: 500_000_000 },
        confidence: 1.0,
    }];
    object
}

pub(crate) fn route(number: u64, lanelets: &[i64]) -> Option<Epoch<Arc<LaneletRoute>>> {
    let segment = |id: &i64| {
        let mut segment = LaneletSegment::default();
        segment.preferred_primitive.id = *id;
        segment
    };
    let route = LaneletRoute { segments: lanelets.iter().map(segment).collect(), ..LaneletRoute::default() };
    Some(Epoch { number, value: Arc::new(route) })
}

pub(crate) fn map(number: u64, map: Map) -> Option<Epoch<HdMap>> {
    Some(Epoch { number, value: HdMap::new("map".into(), Arc::new(map)) })
}

pub(crate) fn red_light(id: i64) -> Vec<TrafficLightGroup> {
    let element = TrafficLightElement {
        color: TrafficLightElement::RED,
        shape: TrafficLightElement::CIRCLE,
        status: TrafficLightElement::SOLID_ON,
        confidence: 1.0,
    };
    vec![TrafficLightGroup {
        traffic_light_group_id: id,
        elements: vec![element],
        ..TrafficLightGroup::default()
    }]
}

/// The world with all dangers at a time.
pub(crate) fn world(sec: i32) -> Scene {
    let mut scene = Scene::empty(Time { sec, nanosec: 0 }, Arc::new(VehicleInfo::default()));
    let mut odometry = Odometry { header: header(sec), ..Odometry::default() };
    odometry.twist.twist.linear.x = 5.0;
    scene.odometry = Some(Arc::new(odometry));
    scene.acceleration =
        Some(Arc::new(AccelWithCovarianceStamped { header: header(sec), ..Default::default() }));
    let objects = vec![
        object(1, ObjectClassification::CAR, 13.0, -1.0, [4.0, 1.8]),
        object(2, ObjectClassification::PEDESTRIAN, 24.0, -7.0, [0.6, 0.6]),
    ];
    scene.objects = Some(Arc::new(PredictedObjects { header: header(sec), objects }));
    let signals =
        TrafficLightGroupArray { stamp: Time { sec, nanosec: 0 }, traffic_light_groups: red_light(LIGHT) };
    scene.traffic_signals = Some(Arc::new(signals));
    scene.map = map(1, street(true));
    scene.route = route(1, &[ROAD]);
    scene
}

/// Points of the one candidate: from `x` on 18 m/s, to the right off the road, for 3 s.
pub(crate) fn points(x: f64) -> Vec<TrajectoryPoint> {
    let point = |index: i64| {
        let time_s = index as f64 * 0.1;
        let distance_m = 18.0 * time_s;
        TrajectoryPoint {
            time_from_start: Duration::from_nanoseconds(index * 100_000_000),
            pose: pose(x + distance_m * 0.1_f64.cos(), -distance_m * 0.1_f64.sin(), -0.1),
            longitudinal_velocity_mps: 18.0,
            ..TrajectoryPoint::default()
        }
    };
    (0..=30).map(point).collect()
}

/// A candidate with these points.
pub(crate) fn candidate_of(sec: i32, points: Vec<TrajectoryPoint>) -> Candidate {
    let message = CandidateTrajectory { header: header(sec), points, ..CandidateTrajectory::default() };
    Candidate::new(Arc::new(message), "planner".into(), 0)
}

/// The one candidate.
pub(crate) fn candidate(sec: i32, x: f64) -> Candidate {
    candidate_of(sec, points(x))
}
