//! Reads golden sequences: as much of the format as the crosswalk filter needs.

#![allow(dead_code, reason = "each user of this module leaves another part unused")]

use lanelet_map::{Map, archive};
use messages::autoware_internal_planning_msgs::CandidateTrajectory;
use messages::autoware_perception_msgs::{
    ObjectClassification, PredictedObject, PredictedObjects, PredictedPath,
};
use messages::autoware_planning_msgs::{LaneletRoute, LaneletSegment, TrajectoryPoint};
use messages::builtin_interfaces::{Duration, Time};
use messages::geometry_msgs::{AccelWithCovarianceStamped, Point, Pose, Quaternion};
use messages::nav_msgs::Odometry;
use messages::unique_identifier_msgs::Uuid;
use motion::{VehicleDimensions, VehicleInfo};
use selection::Candidate;
use selection::parameters::CrosswalkParameters;
use selection::scene::{Epoch, HdMap, Scene};
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The folder of golden files, if it is there.
pub(crate) fn golden_folder() -> Option<PathBuf> {
    let workspace = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(2)?;
    let shared =
        std::env::var_os("SELECTOR_SHARED").map_or_else(|| workspace.join("../shared"), PathBuf::from);
    Some(shared.join("golden")).filter(|folder| folder.is_dir())
}

/// The `.json` files of a folder in the order of their names.
pub(crate) fn files(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut files: Vec<_> = entries.filter(|path| path.extension().is_some_and(|e| e == "json")).collect();
    files.sort();
    files
}

/// Maps that were read already, by name.
#[derive(Default)]
pub(crate) struct Maps(BTreeMap<String, Arc<Map>>);

impl Maps {
    fn get(&mut self, golden: &Path, name: &str) -> Arc<Map> {
        let read = || {
            let file = golden.join("maps").join(name).with_extension("bin");
            Arc::new(archive::decode(&std::fs::read(file).unwrap()).unwrap())
        };
        self.0.entry(name.to_owned()).or_insert_with(read).clone()
    }
}

/// One file.
pub(crate) struct Sequence {
    pub(crate) name: String,
    pub(crate) front_m: f64,
    pub(crate) cycles: Vec<Cycle>,
}

/// One cycle with the expected verdicts.
pub(crate) struct Cycle {
    pub(crate) scene: Scene,
    pub(crate) parameters: CrosswalkParameters,
    pub(crate) candidates: Vec<Candidate>,
    /// By candidate; `None` where there is nothing to compare.
    pub(crate) expected: Vec<Option<Value>>,
}

/// Reads a sequence.
pub(crate) fn read(golden: &Path, file: &Path, maps: &mut Maps) -> Sequence {
    let json: Value = serde_json::from_slice(&std::fs::read(file).unwrap()).unwrap();
    let map = maps.get(golden, json["map"].as_str().unwrap());
    let vehicle = Arc::new(vehicle(&json["vehicle"]));
    let mut parameters = CrosswalkParameters::default();
    merge(&mut parameters, &json["params"]["crosswalk"]);
    let mut cycles = Vec::new();
    let mut route_of_last = (0, Value::Null);
    for (cycle, expected) in array(&json["cycles"]).iter().zip(array(&json["expected"])) {
        merge(&mut parameters, &cycle["params"]["crosswalk"]);
        if cycle["route"] != route_of_last.1 {
            route_of_last = (route_of_last.0 + 1, cycle["route"].clone());
        }
        let stamp = Time::from_nanoseconds((number(&cycle["time"]) * 1e9).round() as i64);
        let mut scene = Scene::empty(stamp, vehicle.clone());
        scene.map = Some(Epoch { number: 1, value: HdMap { frame_id: "map".into(), map: map.clone() } });
        scene.odometry = present(&cycle["odometry"]).map(|odometry| Arc::new(odometry_of(odometry, stamp)));
        scene.acceleration = present(&cycle["acceleration"]).map(|a| Arc::new(acceleration_of(a)));
        let objects = array(&cycle["objects"]).iter().map(object_of).collect();
        scene.objects = Some(Arc::new(PredictedObjects { objects, ..PredictedObjects::default() }));
        scene.route = present(&cycle["route"])
            .map(|route| Epoch { number: route_of_last.0, value: Arc::new(route_of(route)) });
        let candidates = array(&cycle["candidates"]);
        cycles.push(Cycle {
            scene,
            parameters: parameters.clone(),
            candidates: candidates
                .iter()
                .map(|candidate| candidate_of(candidate, &json["columns"]))
                .collect(),
            expected: candidates.iter().zip(array(expected)).map(|(c, e)| expectation(c, e)).collect(),
        });
    }
    Sequence {
        name: json["name"].as_str().unwrap().to_owned(),
        front_m: vehicle.max_longitudinal_offset_m(),
        cycles,
    }
}

fn expectation(candidate: &Value, expected: &Value) -> Option<Value> {
    let is_fragile = array(&expected["fragile"]).iter().any(|name| name == "crosswalk_filter");
    let compare = candidate["valid"] != false && !is_fragile;
    present(&expected["crosswalk_filter"]).filter(|_| compare).cloned()
}

fn merge(parameters: &mut CrosswalkParameters, overrides: &Value) {
    let mut all = serde_json::to_value(&*parameters).unwrap();
    for (name, value) in overrides.as_object().into_iter().flatten() {
        assert!(!all[name].is_null(), "unknown parameter {name}");
        all[name] = value.clone();
    }
    *parameters = serde_json::from_value(all).unwrap();
}

fn present(value: &Value) -> Option<&Value> {
    Some(value).filter(|value| !value.is_null())
}

fn array(value: &Value) -> &[Value] {
    value.as_array().map_or(&[], Vec::as_slice)
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| value.as_str().map_or(0.0, |text| text.parse().unwrap()))
}

fn uuid(value: &Value) -> Uuid {
    let digits = value.as_str().unwrap();
    let byte = |at: usize| u8::from_str_radix(&digits[2 * at..2 * at + 2], 16).unwrap();
    Uuid { uuid: std::array::from_fn(byte) }
}

fn vehicle(json: &Value) -> VehicleInfo {
    let of = |name: &str| number(&json[name]);
    VehicleInfo::new(VehicleDimensions {
        wheel_radius_m: of("wheel_radius"),
        wheel_width_m: of("wheel_width"),
        wheel_base_m: of("wheel_base"),
        wheel_tread_m: of("wheel_tread"),
        front_overhang_m: of("front_overhang"),
        rear_overhang_m: of("rear_overhang"),
        left_overhang_m: of("left_overhang"),
        right_overhang_m: of("right_overhang"),
        vehicle_height_m: of("vehicle_height"),
        max_steer_angle_rad: of("max_steer_angle"),
    })
    .unwrap()
}

fn pose(x: f64, y: f64, z: f64, yaw: f64) -> Pose {
    Pose { position: Point { x, y, z }, orientation: Quaternion::from_yaw(yaw) }
}

fn odometry_of(json: &Value, stamp: Time) -> Odometry {
    let of = |name: &str| number(&json[name]);
    let mut odometry = Odometry::default();
    odometry.header.stamp = stamp;
    odometry.pose.pose = pose(of("x"), of("y"), of("z"), of("yaw"));
    odometry.twist.twist.linear.x = of("vx");
    odometry
}

fn acceleration_of(json: &Value) -> AccelWithCovarianceStamped {
    let mut acceleration = AccelWithCovarianceStamped::default();
    acceleration.accel.accel.linear.x = number(&json["ax"]);
    acceleration
}

fn object_of(json: &Value) -> PredictedObject {
    let of = |name: &str| number(&json[name]);
    let mut object = PredictedObject { object_id: uuid(&json["id"]), ..PredictedObject::default() };
    let class = |class: &Value| ObjectClassification {
        label: number(&class[0]) as u8,
        probability: number(&class[1]) as f32,
    };
    object.classification = array(&json["classes"]).iter().map(class).collect();
    let kinematics = &mut object.kinematics;
    kinematics.initial_pose_with_covariance.pose = pose(of("x"), of("y"), of("z"), of("yaw"));
    kinematics.initial_twist_with_covariance.twist.linear.x = of("vx");
    let path = |path: &Value| PredictedPath {
        path: array(&path["points"])
            .iter()
            .map(|p| pose(number(&p[0]), number(&p[1]), of("z"), number(&p[2])))
            .collect(),
        time_step: Duration::from_nanoseconds((number(&path["dt"]) * 1e9).round() as i64),
        confidence: number(&path["confidence"]) as f32,
    };
    kinematics.predicted_paths = array(&json["paths"]).iter().map(path).collect();
    object
}

fn route_of(json: &Value) -> LaneletRoute {
    let segment = |id: &Value| {
        let mut segment = LaneletSegment::default();
        segment.preferred_primitive.id = id.as_i64().unwrap();
        segment
    };
    LaneletRoute { segments: array(json).iter().map(segment).collect(), ..LaneletRoute::default() }
}

fn candidate_of(json: &Value, columns: &Value) -> Candidate {
    let column = |name: &str| array(columns).iter().position(|column| column == name);
    let point = |row: &Value| {
        let of = |name: &str| column(name).map_or(0.0, |at| number(&row[at]));
        TrajectoryPoint {
            time_from_start: Duration::from_nanoseconds((of("t") * 1e9).round() as i64),
            pose: pose(of("x"), of("y"), of("z"), of("yaw")),
            longitudinal_velocity_mps: of("v") as f32,
            lateral_velocity_mps: of("vy") as f32,
            acceleration_mps2: of("a") as f32,
            ..TrajectoryPoint::default()
        }
    };
    let message = CandidateTrajectory {
        generator_id: uuid(&json["generator"]),
        points: array(&json["points"]).iter().map(point).collect(),
        ..CandidateTrajectory::default()
    };
    Candidate::new(Arc::new(message), "golden".into(), json["sample"].as_u64().unwrap() as u32)
}
