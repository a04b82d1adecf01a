//! Reads parking scene files.

use std::collections::HashMap;
use std::fs;
use std::path::Path;

use motion::{Point2, VehicleDimensions, VehicleInfo};
use open_space::{Limits, PlanarPose, Problem};
use serde_json::Value;

/// The scenes that come with the program, by name.
#[allow(dead_code, reason = "not every test looks at these")]
pub(crate) fn example_scenes() -> Vec<(String, Problem)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().map(|root| root.join("config/scenes"));
    let folder = folder.into_iter().find(|folder| folder.is_dir()).unwrap();
    let mut files: Vec<_> = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    files
        .iter()
        .filter(|file| file.extension().is_some_and(|ending| ending == "yaml"))
        .map(|file| {
            let name = file.file_stem().unwrap().to_str().unwrap().to_owned();
            (name, parse(&fs::read_to_string(file).unwrap()))
        })
        .collect()
}

/// Just enough YAML for these files: one key to a line, lists as in JSON.
pub(crate) fn parse(text: &str) -> Problem {
    let mut numbers: HashMap<String, f64> = HashMap::new();
    let (mut bounds, mut obstacles, mut group) = (Value::Null, Vec::new(), String::new());
    for line in text.lines().filter(|line| !line.starts_with('#')) {
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
        start_curvature: None,
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
