//! Reads sequences of the format `trajectory-filters/2` as far as the boundary departure filter needs them.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]
#![allow(dead_code, unreachable_pub)] // Shared by several programs, each of which uses its own part.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use lanelet_map::Map;
use messages::autoware_internal_planning_msgs::CandidateTrajectory;
use messages::builtin_interfaces::Time;
use messages::geometry_msgs::{AccelWithCovarianceStamped, Quaternion};
use messages::nav_msgs::Odometry;
use messages::unique_identifier_msgs::Uuid;
use motion::{Pose, TimeFromStart, TrajectoryPoint, VehicleDimensions, VehicleInfo};
use selection::parameters::BoundaryDepartureParameters;
use selection::scene::{Epoch, HdMap};
use selection::{Candidate, CandidateKey, Scene};
use serde_json::Value;

/// The directory with the golden files: `$SELECTOR_SHARED`, or `shared` beside the workspace. Says so where it is
/// absent, and the caller skips its test.
pub fn golden(test: &str) -> Option<PathBuf> {
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared");
    let dir = std::env::var_os("SELECTOR_SHARED").map_or(beside, PathBuf::from).join("golden");
    if dir.join("open").is_dir() {
        return Some(dir);
    }
    eprintln!("skipped: {test}: no golden files in {}", dir.display());
    None
}

/// Every sequence of a folder, in the order of names.
pub fn sequence_paths(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).unwrap();
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "json"));
    paths.sort();
    paths
}

/// Maps by name, each decoded once.
#[derive(Default)]
pub struct Maps(HashMap<String, Arc<Map>>);

impl Maps {
    pub fn get(&mut self, golden: &Path, osm_name: &str) -> Arc<Map> {
        let decode = || {
            let path = golden.join("maps").join(osm_name).with_extension("bin");
            Arc::new(lanelet_map::archive::decode(&std::fs::read(path).unwrap()).unwrap())
        };
        Arc::clone(self.0.entry(osm_name.to_owned()).or_insert_with(decode))
    }
}

pub struct Sequence {
    pub name: String,
    pub vehicle: VehicleInfo,
    pub cycles: Vec<Cycle>,
}

pub struct Cycle {
    pub scene: Scene,
    pub parameters: BoundaryDepartureParameters,
    pub candidates: Vec<Candidate>,
    /// What upstream says about each candidate, and whether its data is valid.
    pub expected: Vec<(Value, bool)>,
}

/// Reads one sequence.
pub fn read(golden: &Path, path: &Path, maps: &mut Maps) -> Sequence {
    let root: Value = serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
    let vehicle = vehicle_of(&root["vehicle"]);
    let map = maps.get(golden, root["map"].as_str().unwrap());
    let mut parameters = BoundaryDepartureParameters::default();
    override_with(&mut parameters, &root["params"]);
    let columns: Vec<&str> =
        root["columns"].as_array().unwrap().iter().map(|c| c.as_str().unwrap()).collect();
    let cycles = root["cycles"].as_array().unwrap().iter().zip(root["expected"].as_array().unwrap());
    let cycles = cycles.map(|(cycle, expected)| {
        override_with(&mut parameters, &cycle["params"]);
        let candidates = cycle["candidates"].as_array().unwrap();
        Cycle {
            scene: scene_of(cycle, &map, vehicle),
            parameters: parameters.clone(),
            candidates: candidates.iter().map(|candidate| candidate_of(candidate, &columns)).collect(),
            expected: expected
                .as_array()
                .unwrap()
                .iter()
                .cloned()
                .zip(candidates.iter().map(is_valid))
                .collect(),
        }
    });
    let cycles = cycles.collect();
    Sequence { name: root["name"].as_str().unwrap().to_owned(), vehicle, cycles }
}

fn is_valid(candidate: &Value) -> bool {
    candidate["valid"].as_bool() != Some(false)
}

/// A number, which may be one that JSON cannot write.
pub fn number(value: &Value) -> f64 {
    match value.as_str() {
        Some("nan") => f64::NAN,
        Some("inf") => f64::INFINITY,
        Some("-inf") => f64::NEG_INFINITY,
        _ => value.as_f64().unwrap_or(0.0),
    }
}

fn vehicle_of(value: &Value) -> VehicleInfo {
    let at = |name: &str| number(&value[name]);
    let dimensions = VehicleDimensions {
        wheel_radius_m: at("wheel_radius"),
        wheel_width_m: at("wheel_width"),
        wheel_base_m: at("wheel_base"),
        wheel_tread_m: at("wheel_tread"),
        front_overhang_m: at("front_overhang"),
        rear_overhang_m: at("rear_overhang"),
        left_overhang_m: at("left_overhang"),
        right_overhang_m: at("right_overhang"),
        vehicle_height_m: at("vehicle_height"),
        max_steer_angle_rad: at("max_steer_angle"),
    };
    VehicleInfo::new(dimensions).unwrap()
}

fn override_with(parameters: &mut BoundaryDepartureParameters, groups: &Value) {
    let Some(group) = groups.get("boundary_departure").and_then(Value::as_object) else { return };
    let mut all = serde_json::to_value(&*parameters).unwrap();
    for (name, value) in group {
        assert!(all.get(name).is_some(), "unknown parameter {name}");
        all[name] = value.clone();
    }
    *parameters = serde_json::from_value(all).unwrap();
}

fn scene_of(cycle: &Value, map: &Arc<Map>, vehicle: VehicleInfo) -> Scene {
    let stamp = Time::from_nanoseconds((number(&cycle["time"]) * 1e9).round() as i64);
    let mut scene = Scene::empty(stamp, Arc::new(vehicle));
    scene.map = Some(Epoch { number: 1, value: HdMap { frame_id: "map".into(), map: Arc::clone(map) } });
    if let Some(given) = cycle.get("odometry").filter(|given| !given.is_null()) {
        let mut odometry = Odometry::default();
        odometry.header.stamp = stamp;
        let pose = &mut odometry.pose.pose;
        (pose.position.x, pose.position.y, pose.position.z) =
            (number(&given["x"]), number(&given["y"]), number(&given["z"]));
        pose.orientation = Quaternion::from_yaw(number(&given["yaw"]));
        odometry.twist.twist.linear.x = number(&given["vx"]);
        scene.odometry = Some(Arc::new(odometry));
    }
    if let Some(given) = cycle.get("acceleration").filter(|given| !given.is_null()) {
        let mut acceleration = AccelWithCovarianceStamped::default();
        acceleration.header.stamp = stamp;
        acceleration.accel.accel.linear.x = number(&given["ax"]);
        scene.acceleration = Some(Arc::new(acceleration));
    }
    scene
}

fn candidate_of(value: &Value, columns: &[&str]) -> Candidate {
    let hex = value["generator"].as_str().unwrap();
    let byte = |at: usize| u8::from_str_radix(&hex[2 * at..2 * at + 2], 16).unwrap();
    let generator = Uuid { uuid: std::array::from_fn(byte) };
    let points = value["points"].as_array().unwrap().iter().map(|row| point_of(row, columns));
    Candidate {
        key: CandidateKey { generator, sample: value["sample"].as_u64().unwrap_or(0) as u32 },
        generator_name: "golden".into(),
        message: Arc::new(CandidateTrajectory::default()),
        points: Arc::new(points.collect()),
    }
}

fn point_of(row: &Value, columns: &[&str]) -> TrajectoryPoint {
    let at = |name: &str| columns.iter().position(|c| *c == name).map_or(0.0, |column| number(&row[column]));
    let mut pose = Pose::from_xy_yaw(at("x"), at("y"), at("yaw"));
    pose.position.z = at("z");
    TrajectoryPoint {
        time_from_start: TimeFromStart::from_nanos((at("t") * 1e9).round() as i64),
        pose,
        longitudinal_velocity_mps: at("v") as f32,
        lateral_velocity_mps: at("vy") as f32,
        acceleration_mps2: at("a") as f32,
        ..TrajectoryPoint::default()
    }
}
