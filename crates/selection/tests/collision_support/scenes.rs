//! Scenes, objects and candidates for the tests of the collision check.

#![allow(dead_code, reason = "every test program uses its own part")]

use lanelet_map::MapBuilder;
use messages::autoware_internal_planning_msgs::CandidateTrajectory;
use messages::autoware_perception_msgs::{
    ObjectClassification, PredictedObject, PredictedObjects, PredictedPath, Shape,
};
use messages::autoware_planning_msgs::TrajectoryPoint;
use messages::builtin_interfaces::{Duration, Time};
use messages::geometry_msgs::{Point, Pose, Quaternion};
use messages::nav_msgs::Odometry;
use messages::std_msgs::Header;
use messages::unique_identifier_msgs::Uuid;
use motion::{VehicleDimensions, VehicleInfo};
use selection::filters::collision_check::CollisionCheckFilter;
use selection::parameters::CollisionCheckParameters;
use selection::scene::{Epoch, HdMap};
use selection::{Candidate, Filter, Judgement, Scene, Scratch};
use std::sync::Arc;

pub(crate) const STAMP: Time = Time { sec: 100, nanosec: 0 };

/// Front 4 m, rear 1 m, 2 m wide: the vehicle of the published cases.
pub(crate) fn vehicle() -> VehicleInfo {
    sized_vehicle(1.0)
}

/// The same, scaled.
pub(crate) fn sized_vehicle(scale: f64) -> VehicleInfo {
    VehicleInfo::new(VehicleDimensions {
        wheel_base_m: 3.0 * scale,
        front_overhang_m: scale,
        rear_overhang_m: scale,
        wheel_tread_m: 2.0 * scale,
        left_overhang_m: 0.0,
        right_overhang_m: 0.0,
        ..VehicleDimensions::default()
    })
    .unwrap()
}

pub(crate) fn header() -> Header {
    Header { stamp: STAMP, frame_id: "map".to_owned() }
}

pub(crate) fn pose(x: f64, y: f64, yaw: f64) -> Pose {
    Pose { position: Point { x, y, z: 0.0 }, orientation: Quaternion::from_yaw(yaw) }
}

pub(crate) fn duration(seconds: f64) -> Duration {
    Duration::from_nanoseconds((seconds * 1e9).round() as i64)
}

/// A motion on a circle (or a line): start, speed, turn per metre.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Arc2 {
    pub(crate) x: f64,
    pub(crate) y: f64,
    pub(crate) yaw: f64,
    pub(crate) curvature: f64,
}

impl Arc2 {
    pub(crate) fn line(x: f64, y: f64, yaw: f64) -> Self {
        Self { x, y, yaw, curvature: 0.0 }
    }

    /// x, y, yaw after a distance.
    pub(crate) fn at(&self, s: f64) -> (f64, f64, f64) {
        let turn = self.curvature * s;
        let (forward, left) = if turn.abs() < 1e-9 {
            (s, 0.0)
        } else {
            (turn.sin() / self.curvature, (1.0 - turn.cos()) / self.curvature)
        };
        let (sin, cos) = self.yaw.sin_cos();
        (self.x + cos * forward - sin * left, self.y + sin * forward + cos * left, self.yaw + turn)
    }
}

/// `count` points 0.1 s apart at constant speed.
pub(crate) fn candidate(arc: Arc2, speed: f64, count: usize) -> Candidate {
    let points = (0..count)
        .map(|i| {
            let t = 0.1 * i as f64;
            let (x, y, yaw) = arc.at(speed * t);
            TrajectoryPoint {
                time_from_start: duration(t),
                pose: pose(x, y, yaw),
                longitudinal_velocity_mps: speed as f32,
                ..TrajectoryPoint::default()
            }
        })
        .collect();
    candidate_of(CandidateTrajectory { header: header(), points, ..CandidateTrajectory::default() })
}

pub(crate) fn candidate_of(message: CandidateTrajectory) -> Candidate {
    Candidate::new(Arc::new(message), "planner".into(), 0)
}

/// With its turn indicators set.
pub(crate) fn indicating(candidate: &Candidate, command: u8) -> Candidate {
    let mut message = (*candidate.message).clone();
    message.turn_indicators_command.command = command;
    candidate_of(message)
}

/// A box.
pub(crate) fn object(id: u8, label: u8, arc: Arc2, speed: f64, length: f64, width: f64) -> PredictedObject {
    let mut object = PredictedObject { object_id: Uuid { uuid: [id; 16] }, ..PredictedObject::default() };
    object.classification = vec![ObjectClassification { label, probability: 1.0 }];
    object.kinematics.initial_pose_with_covariance.pose = pose(arc.x, arc.y, arc.yaw);
    let twist = &mut object.kinematics.initial_twist_with_covariance.twist;
    twist.linear.x = speed;
    twist.angular.z = arc.curvature * speed;
    object.shape.r#type = Shape::BOUNDING_BOX;
    (object.shape.dimensions.x, object.shape.dimensions.y) = (length, width);
    object
}

/// Adds a predicted path along an arc, 0.5 s steps.
pub(crate) fn predicted(mut object: PredictedObject, arc: Arc2, speed: f64, steps: usize) -> PredictedObject {
    let path = (0..steps)
        .map(|i| {
            let (x, y, yaw) = arc.at(speed * 0.5 * i as f64);
            pose(x, y, yaw)
        })
        .collect();
    object.kinematics.predicted_paths.push(PredictedPath { path, time_step: duration(0.5), confidence: 1.0 });
    object
}

/// A scene at the stamp, the vehicle at this speed.
pub(crate) fn scene(speed: f64, objects: Vec<PredictedObject>) -> Scene {
    let mut scene = Scene::empty(STAMP, Arc::new(vehicle()));
    let mut odometry = Odometry { header: header(), ..Odometry::default() };
    odometry.twist.twist.linear.x = speed;
    scene.odometry = Some(Arc::new(odometry));
    scene.objects = Some(Arc::new(PredictedObjects { header: header(), objects }));
    let map = Arc::new(MapBuilder::new().build().unwrap());
    scene.map = Some(Epoch { number: 1, value: HdMap::new("map".into(), map) });
    scene
}

/// Observes once, judges once.
pub(crate) fn judge(
    scene: &Scene,
    candidate: &Candidate,
    parameters: &CollisionCheckParameters,
) -> Judgement {
    judge_as(&vehicle(), scene, candidate, parameters)
}

pub(crate) fn judge_as(
    vehicle: &VehicleInfo,
    scene: &Scene,
    candidate: &Candidate,
    parameters: &CollisionCheckParameters,
) -> Judgement {
    let mut filter = CollisionCheckFilter::new(parameters, vehicle);
    filter.observe(scene);
    filter.judge(scene, candidate, &mut Scratch::default())
}
