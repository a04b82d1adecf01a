//! Candidates that go to the end of the world cost no more than others, and none of them gets through.
//!
//! A planner that divides by almost nothing sends points a million metres away, or as far as numbers go. No filter may
//! take long over them, or much memory, or lose them to an overflow: what cannot be measured is not accepted.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

#[path = "../../lanelet-map/tests/support/allocations.rs"]
mod allocations;
#[path = "street_support/world.rs"]
mod world;

use lanelet_map::{Map, MapBuilder};
use messages::autoware_planning_msgs::TrajectoryPoint;
use messages::builtin_interfaces::Duration;
use motion::VehicleInfo;
use selection::data_validity::{self, Defect};
use selection::filters::{CLASSES, Filter};
use selection::parameters::ValidatorParameters;
use selection::{Candidate, Scene, Scratch, Validator};
use std::time::Instant;
use world::*;

#[global_allocator]
static ALLOCATOR: allocations::Counting = allocations::Counting;

/// Far more than any candidate takes, far less than a walk over what lies between.
const MOST_BYTES: usize = 32 << 20;
const MOST_SECONDS: f64 = 2.0;

/// What is done to the points, given how far away.
type Change = fn(&mut [TrajectoryPoint], f64);

const CHANGES: &[(&str, Change)] = &[
    ("one point far away", |points, far| points[15].pose.position.x += far),
    ("the last point far away", |points, far| points[30].pose.position.y = far),
    ("from here to there", |points, far| points[10..].iter_mut().for_each(|p| p.pose.position.y -= far)),
    ("diagonally there and back", |points, far| {
        points.iter_mut().skip(1).step_by(2).for_each(|p| {
            p.pose.position.x += far;
            p.pose.position.y -= far;
        });
    }),
    ("from side to side", |points, far| {
        points.iter_mut().step_by(2).for_each(|p| p.pose.position.x -= far);
        points.iter_mut().skip(1).step_by(2).for_each(|p| p.pose.position.x += far);
    }),
    ("all of it far away", |points, far| points.iter_mut().for_each(|p| p.pose.position.x += far)),
    ("far up", |points, far| points[15..].iter_mut().for_each(|p| p.pose.position.z = far)),
    ("ever farther", |points, far| {
        let count = points.len() as f64;
        (0..).zip(points).for_each(|(k, p)| p.pose.position.x += far * f64::from(k) / count);
    }),
];

const DISTANCES_M: [f64; 8] = [1e4, 1e6, 1e7, 1e9, 1e15, 1e100, 1e154, 1e300];

/// A town of 2,500 lanelets whose bounds wind a little, 100 m by 1,000 m.
fn town() -> Map {
    let mut builder = MapBuilder::new();
    let place = |column: i64, row: i64, part: i64| {
        let x = 20.0 * column as f64 - 100.0 + 2.0 * part as f64;
        [x, 2.5 * (row as f64 - 10.0) + 0.2 * (0.4 * x).sin(), 0.0]
    };
    let line_id = |column: i64, row: i64| 10_000 + 100 * column + row;
    for (column, row) in (0..50).flat_map(|column| (0..51).map(move |row| (column, row))) {
        let places: Vec<[f64; 3]> = (0..=10).map(|part| place(column, row, part)).collect();
        let kind = if row % 2 == 0 { "road_border" } else { "line_thin" };
        builder.line_string_at(line_id(column, row), &places, &[("type", kind)]).unwrap();
    }
    for (column, row) in (0..50).flat_map(|column| (0..50).map(move |row| (column, row))) {
        let (left, right) = (line_id(column, row + 1), line_id(column, row));
        builder.lanelet(1 + 100 * column + row, left, right, &[("subtype", "road")]).unwrap();
    }
    builder.build().unwrap()
}

/// Slow enough for the limits of the vehicle, so that other filters decide.
fn calm_points() -> Vec<TrajectoryPoint> {
    let point = |index: i64| TrajectoryPoint {
        time_from_start: Duration::from_nanoseconds(index * 100_000_000),
        pose: pose(0.5 * index as f64, 0.0, 0.0),
        longitudinal_velocity_mps: 5.0,
        ..TrajectoryPoint::default()
    };
    (0..=30).map(point).collect()
}

fn judge_within_bounds(filter: &dyn Filter, scene: &Scene, candidate: &Candidate, place: &str) {
    let mut scratch = Scratch::default();
    let start = Instant::now();
    let (_, peak) = allocations::peak_of(|| filter.judge(scene, candidate, &mut scratch));
    let spent_s = start.elapsed().as_secs_f64();
    assert!(spent_s < MOST_SECONDS, "{place}: {spent_s:.1} s");
    assert!(peak < MOST_BYTES, "{place}: {peak} bytes");
}

fn far_candidates<const N: usize>(distances_m: [f64; N]) -> impl Iterator<Item = (String, Candidate)> {
    CHANGES.iter().flat_map(move |&(name, change)| {
        distances_m.into_iter().map(move |far| {
            let mut points = calm_points();
            change(&mut points, far);
            (format!("{name}, {far:e} m"), candidate_of(START_S, points))
        })
    })
}

fn scenes() -> [Scene; 2] {
    let mut large = world(START_S);
    large.map = map(1, town());
    [world(START_S), large]
}

#[test]
fn no_filter_takes_long_over_far_candidates() {
    let (parameters, vehicle) = (ValidatorParameters::default(), VehicleInfo::default());
    for (number, scene) in scenes().iter().enumerate() {
        for class in CLASSES {
            let mut filter = (class.make)(&parameters, &vehicle);
            filter.observe(scene);
            for (name, candidate) in far_candidates(DISTANCES_M) {
                let place = format!("{}, scene {number}: {name}", class.short_name);
                judge_within_bounds(&*filter, scene, &candidate, &place);
            }
        }
    }
}

/// The road check and the check of the data are enough. Nobody looks at heights: they may be anything on a map.
#[test]
fn none_of_them_gets_through() {
    let parameters = ValidatorParameters {
        filter_names: vec!["safety::OutOfLaneFilter".to_owned()],
        shadow_mode_filter_names: Vec::new(),
        ..ValidatorParameters::default()
    };
    for (number, scene) in scenes().iter().enumerate() {
        let mut validator = Validator::new(parameters.clone(), &VehicleInfo::default()).unwrap();
        validator.observe(scene);
        let mut scratch = Scratch::default();
        let mut is_accepted =
            |candidate: &Candidate| validator.judge(scene, candidate, &mut scratch, || 0, &mut []).accepted;
        assert!(is_accepted(&candidate_of(START_S, calm_points())), "scene {number}");
        for (name, candidate) in far_candidates(DISTANCES_M).filter(|(name, _)| !name.starts_with("far up")) {
            assert!(!is_accepted(&candidate), "scene {number}: {name}");
        }
    }
}

#[test]
fn beyond_any_map_no_filter_is_needed() {
    for (name, candidate) in far_candidates([1e9, 1e15, 1e100, 1e154, 1e300]) {
        let defect = data_validity::find_defect(&world(START_S), &candidate);
        assert_eq!(defect.map(|(defect, _)| defect), Some(Defect::NoPlace), "{name}");
    }
}
