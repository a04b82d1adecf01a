//! Parking scenes of the shared data, with the best paths known for them.

use std::collections::HashMap;
use std::fs;
use std::path::{Path, PathBuf};

use motion::{Point2, VehicleDimensions, VehicleInfo};
use open_space::{Arc, CoarsePath, GearPart, Limits, PlanarPose, Problem};
use serde_json::Value;

/// A scene and what is known about it.
pub(crate) struct Scene {
    pub(crate) name: String,
    pub(crate) problem: Problem,
    /// The best path known: arcs within the curvature limit, often at it, with a centimetre of clearance.
    pub(crate) best: Option<CoarsePath>,
    /// Changes of gear of the path with the fewest of them that is known.
    pub(crate) fewest_gear_changes: Option<u64>,
}

/// All scenes by name, or none with a word about it where the data is absent.
pub(crate) fn scenes() -> Vec<Scene> {
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared");
    let shared = std::env::var_os("SELECTOR_SHARED").map_or(beside, PathBuf::from);
    let folder = shared.join("data/parking");
    let Ok(index) = fs::read_to_string(folder.join("index.json")) else {
        eprintln!("skipped: no parking scenes in {}", folder.display());
        return Vec::new();
    };
    let index: Value = serde_json::from_str(&index).unwrap();
    let mut scenes: Vec<Scene> =
        index["scenes"].as_array().unwrap().iter().map(|e| read(&folder, e)).collect();
    scenes.sort_by(|a, b| a.name.cmp(&b.name));
    scenes
}

fn read(folder: &Path, entry: &Value) -> Scene {
    let name = entry["name"].as_str().unwrap().to_owned();
    let problem = parse(&fs::read_to_string(folder.join(format!("{name}.yaml"))).unwrap());
    let best = entry["best_path"].as_array().filter(|arcs| !arcs.is_empty()).map(|arcs| {
        let number = |value: &Value| value.as_f64().unwrap();
        let arcs = arcs.iter().map(|arc| Arc::new(number(&arc[0]), number(&arc[1])));
        let inflation_m = (number(&entry["clearance_m"]) - 0.003).max(0.0);
        coarse_path(&problem, arcs, inflation_m)
    });
    Scene { name, problem, best, fewest_gear_changes: entry["fewest_gear_changes"].as_u64() }
}

fn coarse_path(problem: &Problem, arcs: impl Iterator<Item = Arc>, inflation_m: f64) -> CoarsePath {
    let mut parts: Vec<GearPart> = Vec::new();
    let mut pose = problem.start;
    for arc in arcs.filter(|arc| arc.length_m != 0.0) {
        if parts.last().is_none_or(|part| part.gear != arc.gear()) {
            parts.push(GearPart { gear: arc.gear(), poses: vec![pose], arcs: Vec::new() });
        }
        pose = arc.end(&pose);
        let part = parts.last_mut().unwrap();
        part.poses.push(pose);
        part.arcs.push(arc);
    }
    // The lengths are rounded to micrometres.
    let last = parts.last_mut().unwrap().poses.last_mut().unwrap();
    *last = PlanarPose { yaw: last.yaw + last.yaw_to(&problem.goal), ..problem.goal };
    CoarsePath { parts, cost_m: 0.0, inflation_m, expansions: 0 }
}

/// Just enough YAML for these files: one key to a line, lists as in JSON.
fn parse(text: &str) -> Problem {
    let mut numbers: HashMap<String, f64> = HashMap::new();
    let (mut bounds, mut obstacles, mut group) = (Value::Null, Vec::new(), String::new());
    for line in text.lines() {
        if let Some(list) = line.trim().strip_prefix("- ") {
            obstacles.push(serde_json::from_str::<Vec<[f64; 2]>>(list).unwrap());
            continue;
        }
        let (key, value) = line.split_once(':').unwrap();
        let value = value.trim();
        if key == "bounds" {
            bounds = serde_json::from_str(value).unwrap();
        } else if let Some(map) = value.strip_prefix('{') {
            for pair in map.trim_end_matches('}').split(',') {
                let (name, number) = pair.split_once(':').unwrap();
                numbers.insert(format!("{key}.{}", name.trim()), number.trim().parse().unwrap());
            }
        } else if value.is_empty() {
            key.clone_into(&mut group);
        } else if let Ok(number) = value.parse() {
            numbers.insert(format!("{group}.{}", key.trim()), number);
        }
    }
    let number = |name: &str| numbers.get(name).copied();
    let pose = |group: &str| {
        let of = |name: &str| number(&format!("{group}.{name}")).unwrap();
        PlanarPose::new(of("x"), of("y"), of("yaw"))
    };
    Problem {
        vehicle: vehicle(&number),
        limits: limits(&number),
        bounds: [0, 1, 2, 3].map(|k| bounds[k].as_f64().unwrap()),
        obstacles: obstacles
            .into_iter()
            .map(|line| line.into_iter().map(|[x, y]| Point2::new(x, y)).collect())
            .collect(),
        start: pose("start"),
        start_speed_mps: number("start.v").unwrap_or(0.0),
        start_acceleration_mps2: 0.0,
        goal: pose("goal"),
    }
}

fn vehicle(number: &impl Fn(&str) -> Option<f64>) -> VehicleInfo {
    let mut dimensions = VehicleDimensions::default();
    for (name, field) in [
        ("vehicle.wheel_base", &mut dimensions.wheel_base_m),
        ("vehicle.front_overhang", &mut dimensions.front_overhang_m),
        ("vehicle.rear_overhang", &mut dimensions.rear_overhang_m),
        ("vehicle.wheel_tread", &mut dimensions.wheel_tread_m),
        ("vehicle.left_overhang", &mut dimensions.left_overhang_m),
        ("vehicle.right_overhang", &mut dimensions.right_overhang_m),
        ("vehicle.max_steer_angle", &mut dimensions.max_steer_angle_rad),
    ] {
        *field = number(name).unwrap_or(*field);
    }
    VehicleInfo::new(dimensions).unwrap()
}

fn limits(number: &impl Fn(&str) -> Option<f64>) -> Limits {
    let mut limits = Limits::default();
    for (name, field) in [
        ("limits.max_speed_forward", &mut limits.max_speed_forward_mps),
        ("limits.max_speed_reverse", &mut limits.max_speed_reverse_mps),
        ("limits.max_acceleration", &mut limits.max_acceleration_mps2),
        ("limits.max_jerk", &mut limits.max_jerk_mps3),
        ("limits.max_steer_rate", &mut limits.max_steer_rate_rps),
    ] {
        *field = number(name).unwrap_or(*field);
    }
    limits
}
