//! The fixture of all tests: one straight road along x that crosswalks cross.
//!
//! Unless a test says otherwise the crosswalk lies at x = 10, the front bumper is at base_link, nobody moves, and the
//! vehicle has to wait one second. The detection areas are 2 m long: y from -8 to -6 and from 6 to 8, and reach 1 m
//! beyond the crosswalk on each side.

mod cases;
mod hard_inputs;
mod memory;
mod properties;
mod rules;

use super::*;
use crate::candidate::CandidateKey;
use crate::scene::{Epoch, HdMap};
use crate::test_scene::candidate_of;
use lanelet_map::{Map, MapBuilder, Member};
use messages::autoware_perception_msgs::{
    ObjectClassification, PredictedObject, PredictedObjects, PredictedPath,
};
use messages::autoware_planning_msgs::{LaneletRoute, LaneletSegment};
use messages::builtin_interfaces::Time;
use messages::geometry_msgs::{AccelWithCovarianceStamped, Point, Pose as PoseMessage, Quaternion};
use messages::nav_msgs::Odometry;
use messages::unique_identifier_msgs::Uuid;
use motion::{Pose, TimeFromStart, VehicleInfo};
use std::sync::Arc;

/// Id of the road lanelet.
const ROAD: i64 = 1;

/// A map with one road and, for each crosswalk, its id and x of its middle. The crosswalk's lanelet has the id plus 1,
/// its stop line the id plus 2.
fn map_with(crosswalks: &[(i64, f64)]) -> Map {
    let mut builder = Sketch::new();
    for &(id, x) in crosswalks {
        builder.crosswalk(id, x);
        builder.stop_line(id + 2, &[(x, -5.0), (x, 5.0)]);
        builder.rule(id, &[id + 2]);
    }
    builder.0.build().unwrap()
}

/// A map in the making.
struct Sketch(MapBuilder);

impl Sketch {
    fn new() -> Self {
        let mut sketch = Self(MapBuilder::new());
        let bounds = [2.0, -2.0].map(|y| sketch.line(&[(-50.0, y), (200.0, y)]));
        sketch.0.lanelet(ROAD, bounds[0], bounds[1], &[("subtype", "road")]).unwrap();
        sketch
    }

    fn points(&mut self, places: &[(f64, f64)]) -> Vec<i64> {
        let mut point = |&(x, y): &(f64, f64)| {
            let id = self.0.next_id().max(100_000);
            self.0.point(id, [x, y, 0.0], &[]).unwrap();
            id
        };
        places.iter().map(&mut point).collect()
    }

    fn line(&mut self, places: &[(f64, f64)]) -> i64 {
        let points = self.points(places);
        let id = self.0.next_id();
        self.0.line_string(id, &points, &[]).unwrap();
        id
    }

    fn stop_line(&mut self, id: i64, places: &[(f64, f64)]) {
        let points = self.points(places);
        self.0.line_string(id, &points, &[]).unwrap();
    }

    /// The lanelet of a crosswalk.
    fn crosswalk(&mut self, id: i64, x: f64) {
        let bounds = [x - 2.0, x + 2.0].map(|x| self.line(&[(x, -6.0), (x, 6.0)]));
        self.0.lanelet(id + 1, bounds[0], bounds[1], &[("subtype", "crosswalk")]).unwrap();
    }

    /// The regulatory element of a crosswalk.
    fn rule(&mut self, id: i64, stop_lines: &[i64]) {
        let mut members = vec![("refers", Member::Lanelet(id + 1))];
        members.extend(stop_lines.iter().map(|line| ("ref_line", Member::LineString(*line))));
        self.0.regulatory_element(id, &members, &[("subtype", "crosswalk")]).unwrap();
        self.0.attach(ROAD, id).unwrap();
    }

    fn light(&mut self, id: i64, lanelet: i64) {
        self.0.regulatory_element(id, &[], &[("subtype", "traffic_light")]).unwrap();
        self.0.attach(lanelet, id).unwrap();
    }
}

/// The vehicle at the origin with a speed, on a route over the road, with these people around.
fn scene(map: Map, speed_mps: f64, people: &[PredictedObject]) -> Scene {
    let mut scene = Scene::empty(Time::default(), Arc::new(VehicleInfo::default()));
    scene.map = Some(Epoch { number: 1, value: HdMap::new("map".into(), Arc::new(map)) });
    scene.route = Some(route(1, &[ROAD]));
    scene.acceleration = Some(Arc::new(AccelWithCovarianceStamped::default()));
    scene.objects =
        Some(Arc::new(PredictedObjects { objects: people.to_vec(), ..PredictedObjects::default() }));
    set_odometry(&mut scene, 100.0, speed_mps);
    scene
}

fn route(epoch: u64, lanelets: &[i64]) -> Epoch<Arc<LaneletRoute>> {
    let segment = |id: &i64| {
        let mut segment = LaneletSegment::default();
        segment.preferred_primitive.id = *id;
        segment
    };
    let segments = lanelets.iter().map(segment).collect();
    Epoch { number: epoch, value: Arc::new(LaneletRoute { segments, ..LaneletRoute::default() }) }
}

fn nanoseconds(seconds: f64) -> i64 {
    (seconds * 1e9).round() as i64
}

fn set_odometry(scene: &mut Scene, now_s: f64, speed_mps: f64) {
    let mut odometry = Odometry::default();
    odometry.header.stamp = Time::from_nanoseconds(nanoseconds(now_s));
    odometry.twist.twist.linear.x = speed_mps;
    scene.odometry = Some(Arc::new(odometry));
}

fn set_people(scene: &mut Scene, people: &[PredictedObject]) {
    scene.objects =
        Some(Arc::new(PredictedObjects { objects: people.to_vec(), ..PredictedObjects::default() }));
}

fn uuid(number: u8) -> Uuid {
    let mut uuid = [0; 16];
    uuid[0] = number;
    Uuid { uuid }
}

/// Somebody standing at a place, without predicted paths.
fn pedestrian(number: u8, x: f64, y: f64) -> PredictedObject {
    let mut object = PredictedObject { object_id: uuid(number), ..PredictedObject::default() };
    object.classification = vec![class(ObjectClassification::PEDESTRIAN, 1.0)];
    object.kinematics.initial_pose_with_covariance.pose.position = Point { x, y, z: 0.5 };
    object
}

fn class(label: u8, probability: f32) -> ObjectClassification {
    ObjectClassification { label, probability }
}

/// Somebody going in a direction.
fn walking(mut object: PredictedObject, yaw_deg: f64, speed_mps: f64) -> PredictedObject {
    let kinematics = &mut object.kinematics;
    let orientation = Quaternion::from_yaw(yaw_deg.to_radians());
    kinematics.initial_pose_with_covariance.pose.orientation = orientation;
    kinematics.initial_twist_with_covariance.twist.linear.x = speed_mps;
    object
}

/// Somebody with one more predicted path.
fn with_path(mut object: PredictedObject, confidence: f32, places: &[(f64, f64)]) -> PredictedObject {
    let pose =
        |&(x, y): &(f64, f64)| PoseMessage { position: Point { x, y, z: 0.0 }, ..PoseMessage::default() };
    let path = places.iter().map(pose).collect();
    object.kinematics.predicted_paths.push(PredictedPath { path, confidence, ..PredictedPath::default() });
    object
}

/// x, speed and time of the points of a candidate along the road.
type Row = (f64, f32, f64);

fn candidate(rows: &[Row]) -> Candidate {
    let point = |&(x, speed, time_s): &Row| TrajectoryPoint {
        time_from_start: TimeFromStart::from_nanos(nanoseconds(time_s)),
        pose: Pose::from_xy_yaw(x, 0.0, 0.0),
        longitudinal_velocity_mps: speed,
        ..TrajectoryPoint::default()
    };
    candidate_of(rows.iter().map(point).collect())
}

/// Two points, constant speed.
fn drive(from_m: f64, to_m: f64, speed_mps: f32) -> Candidate {
    candidate(&[(from_m, speed_mps, 0.0), (to_m, speed_mps, (to_m - from_m).abs() / f64::from(speed_mps))])
}

fn keyed(mut candidate: Candidate, generator: u8, sample: u32) -> Candidate {
    candidate.key = CandidateKey { generator: uuid(generator), sample };
    candidate
}

fn parameters() -> CrosswalkParameters {
    CrosswalkParameters { overshoot_tolerance: 0.0, stop_duration: 1.0, ..CrosswalkParameters::default() }
}

fn filter() -> CrosswalkFilter {
    CrosswalkFilter::new(parameters(), 0.0)
}

fn filter_with(change: impl FnOnce(&mut CrosswalkParameters)) -> CrosswalkFilter {
    let mut parameters = parameters();
    change(&mut parameters);
    CrosswalkFilter::new(parameters, 0.0)
}

/// One whole cycle.
fn cycle(filter: &mut CrosswalkFilter, scene: &Scene, candidates: &[Candidate]) -> Vec<Judgement> {
    filter.observe(scene);
    let mut scratch = Scratch::default();
    let judgements: Vec<_> =
        candidates.iter().map(|candidate| filter.judge(scene, candidate, &mut scratch)).collect();
    let judged: Vec<_> =
        candidates.iter().zip(&judgements).filter(|(_, judgement)| judgement.failure.is_none()).collect();
    filter.remember(&judged);
    judgements
}

/// One whole cycle with one candidate.
fn judge(filter: &mut CrosswalkFilter, scene: &Scene, candidate: &Candidate) -> Judgement {
    cycle(filter, scene, std::slice::from_ref(candidate)).remove(0)
}

/// One whole cycle with one candidate, at a time, for a standing vehicle: feasible?
fn waits_no_more(filter: &mut CrosswalkFilter, scene: &mut Scene, now_s: f64, candidate: &Candidate) -> bool {
    set_odometry(scene, now_s, 0.0);
    judge(filter, scene, candidate).feasible
}
