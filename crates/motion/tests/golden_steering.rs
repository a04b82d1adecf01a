//! Steering of recorded trajectories against the answers of the upstream vehicle constraint filter.

#![allow(clippy::unwrap_used, reason = "a test that meets an odd file should fail")]

use std::path::PathBuf;

use motion::trajectory::{FIRST_SMOOTHED_INDEX, smoothed_steering_angles};
use motion::{Pose, TimeFromStart, TrajectoryPoint};
use serde_json::Value;

/// Default limits of the filter.
const MAX_ANGLE_RAD: f64 = 0.8;
const MAX_RATE_RPS: f64 = 0.3;

fn golden(folder: &str) -> Option<PathBuf> {
    let root = std::env::var_os("SELECTOR_SHARED")
        .map_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared"), PathBuf::from);
    let path = root.join("golden").join(folder);
    path.is_dir().then_some(path)
}

/// A number, also one of the strings that stand for what JSON cannot write.
fn number(value: &Value) -> f64 {
    value.as_f64().or_else(|| value.as_str()?.parse().ok()).unwrap()
}

fn points(candidate: &Value, columns: &[Value]) -> Vec<TrajectoryPoint> {
    let column = |name: &str| columns.iter().position(|c| c == name);
    let rows = candidate["points"].as_array().unwrap();
    rows.iter()
        .map(|row| {
            let get = |name: &str| column(name).and_then(|i| row.get(i)).map_or(0.0, number);
            let mut pose = Pose::from_xy_yaw(get("x"), get("y"), get("yaw"));
            pose.position.z = get("z");
            let nanos = (get("t") * 1e9).round() as i64;
            TrajectoryPoint { time_from_start: TimeFromStart::from_nanos(nanos), pose, ..Default::default() }
        })
        .collect()
}

/// Largest violating angle and rate, 0 where nothing violates: the two metrics of the filter.
fn violations(points: &[TrajectoryPoint], angles: &[f64], max_angle: f64, max_rate: f64) -> (f64, f64) {
    let above =
        |limit: f64| move |worst: f64, value: f64| if value > limit { worst.max(value) } else { worst };
    let worst_angle = angles.iter().map(|a| a.abs()).fold(0.0, above(max_angle));
    let rates = angles.windows(2).zip(points.windows(2).skip(FIRST_SMOOTHED_INDEX)).map(|(angle, pair)| {
        let dt = pair[1].time_from_start.seconds() - pair[0].time_from_start.seconds();
        if dt > 0.0 { (angle[1] - angle[0]).abs() / dt } else { 0.0 }
    });
    (worst_angle, rates.fold(0.0, above(max_rate)))
}

fn check_folder(folder: &str) -> usize {
    let Some(path) = golden(folder) else {
        eprintln!("skipped: no golden files in ../shared/golden/{folder}");
        return 0;
    };
    let mut angles = Vec::new();
    let mut violated = 0;
    for entry in std::fs::read_dir(path).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|e| e != "json") {
            continue;
        }
        let file: Value = serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
        let columns = file["columns"].as_array().unwrap();
        let wheel_base = file["vehicle"]["wheel_base"].as_f64().unwrap();
        let (mut max_angle, mut max_rate) = (MAX_ANGLE_RAD, MAX_RATE_RPS);
        let mut set = |params: &Value| {
            let limit = |name: &str| params["vehicle_constraint"].get(name).map(number);
            max_angle = limit("max_steering_angle").unwrap_or(max_angle);
            max_rate = limit("max_steering_rate").unwrap_or(max_rate);
            (max_angle, max_rate)
        };
        set(&file["params"]);
        for (c, cycle) in file["cycles"].as_array().unwrap().iter().enumerate() {
            let (max_angle, max_rate) = set(&cycle["params"]);
            for (k, candidate) in cycle["candidates"].as_array().unwrap().iter().enumerate() {
                let points = points(candidate, columns);
                smoothed_steering_angles(&points, wheel_base, &mut angles);
                let (angle, rate) = violations(&points, &angles, max_angle, max_rate);
                let metrics = &file["expected"][c][k]["vehicle_constraint_filter"]["metrics"];
                for (metric, actual) in [(3, angle), (4, rate)] {
                    let expected = number(&metrics[metric][1]);
                    assert!(
                        (actual - expected).abs() <= 1e-6 * expected.abs(),
                        "{} cycle {c} candidate {k}: {} is {actual}, upstream {expected}",
                        path.display(),
                        metrics[metric][0]
                    );
                    violated += usize::from(expected > 0.0);
                }
            }
        }
    }
    violated
}

#[test]
fn steering_metrics_equal_upstream() {
    if golden("open").is_some() {
        assert!(check_folder("open") > 1000, "violations were compared");
        assert!(check_folder("bench") > 50, "violations were compared");
    } else {
        eprintln!("skipped: no golden files in ../shared/golden");
    }
}
