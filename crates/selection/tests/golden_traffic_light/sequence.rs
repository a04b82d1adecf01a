//! Reads the files of format `trajectory-filters/2` as far as the traffic light filter looks at them.

use messages::autoware_internal_planning_msgs::CandidateTrajectory;
use messages::autoware_perception_msgs::{TrafficLightElement, TrafficLightGroup, TrafficLightGroupArray};
use messages::autoware_planning_msgs::{LaneletPrimitive, LaneletRoute, LaneletSegment};
use messages::builtin_interfaces::Time;
use messages::geometry_msgs::AccelWithCovarianceStamped;
use messages::nav_msgs::Odometry;
use messages::unique_identifier_msgs::Uuid;
use motion::{Point3, Pose, Quaternion, TimeFromStart, TrajectoryPoint, VehicleDimensions, VehicleInfo};
use selection::filters::FilterClass;
use selection::parameters::ValidatorParameters;
use selection::scene::{Epoch, HdMap};
use selection::{Candidate, CandidateKey, Filter, Scene};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Where the golden files lie, if they are there.
pub(crate) fn shared_folder() -> Option<PathBuf> {
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared");
    let folder = std::env::var_os("SELECTOR_SHARED").map_or(beside, PathBuf::from);
    folder.join("golden/open").is_dir().then_some(folder)
}

/// The sequences of a folder in the order of names.
pub(crate) fn files(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut files: Vec<_> = entries.filter(|path| path.extension().is_some_and(|it| it == "json")).collect();
    files.sort();
    files
}

/// A sequence and the map it drives on.
pub(crate) struct Sequence {
    json: Value,
    map: HdMap,
    vehicle: VehicleInfo,
    parameters: ValidatorParameters,
}

/// One cycle of it.
pub(crate) struct Cycle {
    pub(crate) parameters: ValidatorParameters,
    pub(crate) scene: Scene,
    /// Those whose data is valid.
    pub(crate) candidates: Vec<Candidate>,
    /// What is expected of each of them.
    pub(crate) expected: Vec<Value>,
}

impl Sequence {
    pub(crate) fn read(shared: &Path, file: &Path) -> Self {
        let json: Value = serde_json::from_slice(&std::fs::read(file).unwrap()).unwrap();
        let name = json["map"].as_str().unwrap().replace(".osm", ".bin");
        let archive = std::fs::read(shared.join("golden/maps").join(name)).unwrap();
        let map = Arc::new(lanelet_map::archive::decode(&archive).unwrap());
        let mut parameters = ValidatorParameters::default();
        merge(&mut parameters, &json["params"]);
        let map = HdMap { frame_id: "map".into(), map };
        Self { map, vehicle: vehicle(&json["vehicle"]), parameters, json }
    }

    pub(crate) fn filter(&self) -> Box<dyn Filter> {
        let class = FilterClass::find("traffic_rule::TrafficLightFilter").unwrap();
        (class.make)(&self.parameters, &self.vehicle)
    }

    pub(crate) fn cycles(&self) -> impl Iterator<Item = Cycle> {
        let mut parameters = self.parameters.clone();
        let cycles = self.json["cycles"].as_array().unwrap().iter();
        cycles.zip(self.json["expected"].as_array().unwrap()).map(move |(cycle, expected)| {
            merge(&mut parameters, &cycle["params"]);
            let candidates = cycle["candidates"].as_array().unwrap();
            let valid: Vec<_> = candidates
                .iter()
                .zip(expected.as_array().unwrap())
                .filter(|(candidate, _)| candidate["valid"] != Value::Bool(false))
                .collect();
            Cycle {
                parameters: parameters.clone(),
                scene: self.scene(cycle),
                candidates: valid.iter().map(|(json, _)| self.candidate(json)).collect(),
                expected: valid.iter().map(|(_, expected)| (*expected).clone()).collect(),
            }
        })
    }

    fn scene(&self, cycle: &Value) -> Scene {
        let stamp = Time::from_nanoseconds((cycle["time"].as_f64().unwrap() * 1e9).round() as i64);
        let mut scene = Scene::empty(stamp, Arc::new(self.vehicle));
        scene.map = Some(Epoch { number: 1, value: self.map.clone() });
        scene.odometry = cycle.get("odometry").map(|json| {
            let mut odometry = Odometry::default();
            odometry.header.stamp = stamp;
            odometry.twist.twist.linear.x = number(&json["vx"]);
            Arc::new(odometry)
        });
        scene.acceleration = cycle.get("acceleration").map(|json| {
            let mut acceleration = AccelWithCovarianceStamped::default();
            acceleration.accel.accel.linear.x = number(&json["ax"]);
            Arc::new(acceleration)
        });
        scene.traffic_signals = cycle.get("signals").map(|groups| {
            let traffic_light_groups = groups.as_array().unwrap().iter().map(group).collect();
            Arc::new(TrafficLightGroupArray { stamp, traffic_light_groups })
        });
        scene.route = cycle.get("route").map(|ids| {
            let ids: Vec<i64> = ids.as_array().unwrap().iter().map(|id| id.as_i64().unwrap()).collect();
            // The route may change from cycle to cycle; its ids are as good a number as any.
            let number = ids.iter().fold(7, |hash: u64, id| hash.wrapping_mul(31).wrapping_add(*id as u64));
            Epoch { number, value: Arc::new(route(&ids)) }
        });
        scene
    }

    fn candidate(&self, json: &Value) -> Candidate {
        let columns: Vec<&str> =
            self.json["columns"].as_array().unwrap().iter().map(|column| column.as_str().unwrap()).collect();
        let rows = json["points"].as_array().unwrap().iter();
        let points = Arc::new(rows.map(|row| point(&columns, row)).collect());
        let generator = u128::from_str_radix(json["generator"].as_str().unwrap(), 16).unwrap();
        Candidate {
            key: CandidateKey {
                generator: Uuid { uuid: generator.to_be_bytes() },
                sample: json["sample"].as_u64().unwrap() as u32,
            },
            generator_name: "golden".into(),
            message: Arc::new(CandidateTrajectory::default()),
            points,
        }
    }
}

fn number(json: &Value) -> f64 {
    match json {
        Value::String(text) => text.parse().unwrap(),
        other => other.as_f64().unwrap(),
    }
}

fn point(columns: &[&str], row: &Value) -> TrajectoryPoint {
    let value = |name: &str| {
        let column = columns.iter().position(|column| *column == name);
        column.and_then(|column| row.get(column)).map_or(0.0, number)
    };
    TrajectoryPoint {
        time_from_start: TimeFromStart::from_nanos((value("t") * 1e9).round() as i64),
        pose: Pose {
            position: Point3::new(value("x"), value("y"), value("z")),
            orientation: Quaternion::from_yaw(value("yaw")),
        },
        longitudinal_velocity_mps: value("v") as f32,
        lateral_velocity_mps: value("vy") as f32,
        acceleration_mps2: value("a") as f32,
        ..TrajectoryPoint::default()
    }
}

fn group(json: &Value) -> TrafficLightGroup {
    let byte = |json: &Value| json.as_u64().unwrap() as u8;
    let element = |json: &Value| TrafficLightElement {
        color: byte(&json[0]),
        shape: byte(&json[1]),
        status: byte(&json[2]),
        confidence: number(&json[3]) as f32,
    };
    TrafficLightGroup {
        traffic_light_group_id: json["id"].as_i64().unwrap(),
        elements: json["elements"].as_array().unwrap().iter().map(element).collect(),
        predictions: Vec::new(),
    }
}

fn route(ids: &[i64]) -> LaneletRoute {
    let primitive = |id: &i64| LaneletPrimitive { id: *id, primitive_type: "lane".to_owned() };
    let segment =
        |id: &i64| LaneletSegment { preferred_primitive: primitive(id), primitives: vec![primitive(id)] };
    LaneletRoute { segments: ids.iter().map(segment).collect(), ..LaneletRoute::default() }
}

fn vehicle(json: &Value) -> VehicleInfo {
    VehicleInfo::new(VehicleDimensions {
        wheel_radius_m: number(&json["wheel_radius"]),
        wheel_width_m: number(&json["wheel_width"]),
        wheel_base_m: number(&json["wheel_base"]),
        wheel_tread_m: number(&json["wheel_tread"]),
        front_overhang_m: number(&json["front_overhang"]),
        rear_overhang_m: number(&json["rear_overhang"]),
        left_overhang_m: number(&json["left_overhang"]),
        right_overhang_m: number(&json["right_overhang"]),
        vehicle_height_m: number(&json["vehicle_height"]),
        max_steer_angle_rad: number(&json["max_steer_angle"]),
    })
    .unwrap()
}

/// Puts the given values over the parameters, group by group.
fn merge(parameters: &mut ValidatorParameters, overrides: &Value) {
    if let Some(overrides) = overrides.get("traffic_light") {
        let mut json = serde_json::to_value(&parameters.traffic_light).unwrap();
        merge_json(&mut json, overrides);
        parameters.traffic_light = serde_json::from_value(json).unwrap();
    }
}

fn merge_json(base: &mut Value, overrides: &Value) {
    match (base, overrides) {
        (Value::Object(base), Value::Object(overrides)) => {
            for (key, value) in overrides {
                merge_json(base.get_mut(key).unwrap(), value);
            }
        }
        (base, value) => *base = value.clone(),
    }
}
