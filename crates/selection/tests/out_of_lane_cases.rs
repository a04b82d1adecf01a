//! The out-of-lane check on roads whose answer is known by hand, and against a slow reference.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

use lanelet_map::{Map, MapBuilder};
use messages::autoware_internal_planning_msgs::CandidateTrajectory;
use messages::autoware_planning_msgs::TrajectoryPoint;
use messages::builtin_interfaces::{Duration, Time};
use messages::geometry_msgs::{Point, Pose, Quaternion};
use messages::std_msgs::Header;
use motion::VehicleInfo;
use proptest::prelude::*;
use selection::filters::out_of_lane::OutOfLaneFilter;
use selection::parameters::OutOfLaneParameters;
use selection::scene::{Epoch, HdMap};
use selection::{Candidate, Filter, Judgement, RiskLevel, Scene, Scratch};
use std::sync::Arc;

/// Strips of lanelets: rows of points across the road, every lanelet between two columns and two rows.
fn road(rows: &[Vec<[f64; 2]>], subtype: &str) -> Map {
    let mut builder = MapBuilder::new();
    let columns = rows[0].len();
    let id = |row: usize, column: usize| 1000 + (row * columns + column) as i64;
    for (row, points) in rows.iter().enumerate() {
        for (column, [x, y]) in points.iter().enumerate() {
            builder.point(id(row, column), [*x, *y, 0.0], &[]).unwrap();
        }
    }
    for row in 0..rows.len() - 1 {
        for column in 0..columns {
            let line = 100_000 + id(row, column);
            builder.line_string(line, &[id(row, column), id(row + 1, column)], &[]).unwrap();
        }
        for column in 0..columns - 1 {
            let (left, right) = (100_000 + id(row, column), 100_000 + id(row, column + 1));
            builder.lanelet(id(row, column), left, right, &[("subtype", subtype)]).unwrap();
        }
    }
    builder.build().unwrap()
}

/// Two lanes of 3 m, y from -3 to 3, x from -20 to 120, cut every 7 m.
fn straight_road() -> Map {
    let rows: Vec<_> = (0..=20)
        .map(|k| -20.0 + 7.0 * f64::from(k))
        .map(|x| [3.0, 0.0, -3.0].map(|y| [x, y]).to_vec())
        .collect();
    road(&rows, "road")
}

fn scene(map: Map, number: u64) -> Scene {
    let stamp = Time { sec: 100, nanosec: 0 };
    let mut scene = Scene::empty(stamp, Arc::new(VehicleInfo::default()));
    scene.map = Some(Epoch { number, value: HdMap::new("map".into(), Arc::new(map)) });
    scene
}

/// Points at x, y, yaw, `step` seconds apart from `first` on.
fn candidate(poses: &[(f64, f64, f64)], first: f64, step: f64) -> Candidate {
    let points = poses.iter().enumerate().map(|(k, &(x, y, yaw))| TrajectoryPoint {
        time_from_start: Duration::from_nanoseconds(((first + step * k as f64) * 1e9).round() as i64),
        pose: Pose { position: Point { x, y, z: 0.0 }, orientation: Quaternion::from_yaw(yaw) },
        ..TrajectoryPoint::default()
    });
    let message = CandidateTrajectory {
        header: Header::default(),
        points: points.collect(),
        ..CandidateTrajectory::default()
    };
    Candidate::new(Arc::new(message), "planner".into(), 0)
}

fn judge_with(scene: &Scene, candidate: &Candidate, min_value: f64) -> (Judgement, Option<String>) {
    let parameters = OutOfLaneParameters { min_value, ..OutOfLaneParameters::default() };
    let mut filter = OutOfLaneFilter::new(parameters, &VehicleInfo::default());
    filter.observe(scene);
    let judgement = filter.judge(scene, candidate, &mut Scratch::default());
    let line = filter.explain(&judgement);
    (judgement, line)
}

fn excess(poses: &[(f64, f64, f64)]) -> f64 {
    judge_with(&scene(straight_road(), 1), &candidate(poses, 0.0, 0.1), 0.0).0.metrics[0].value
}

#[test]
fn excess_of_known_poses() {
    // The vehicle is 1.896 m wide, its front 3.79 m ahead, its rear 1.1 m behind.
    for (name, pose, expected) in [
        ("in the lane", (10.0, 1.5, 0.0), 0.0),
        ("over the line between lanes", (10.0, 0.0, 0.3), 0.0),
        ("flush with the border", (10.0, 3.0 - 0.948, 0.0), 0.0),
        ("half a metre out", (10.0, 3.5 - 0.948, 0.0), 0.5),
        ("out at the right", (10.0, -3.5 + 0.948, 0.0), 0.5),
        ("beyond the end", (118.0, 0.0, 0.0), 1.79),
        ("all outside", (10.0, 20.0, 0.0), 17.948),
        ("past the corner", (120.0, 5.0, 0.0), 3.79_f64.hypot(2.948)),
    ] {
        let value = excess(&[pose, pose]);
        assert!((value - expected).abs() < 1e-6, "{name}: {value} instead of {expected}");
    }
}

#[test]
fn the_verdict_says_where_and_when() {
    let scene = scene(straight_road(), 1);
    let poses: Vec<_> = (0..20).map(|k| (f64::from(k), 0.2 * f64::from(k), 0.0)).collect();
    let (judgement, line) = judge_with(&scene, &candidate(&poses, 0.0, 0.1), 0.0);
    assert!(!judgement.feasible);
    assert_eq!(
        (judgement.metrics[0].name, judgement.metrics[0].risk),
        ("check_out_of_lane", RiskLevel::Danger)
    );
    assert!((judgement.metrics[0].value - (3.8 + 0.948 - 3.0)).abs() < 1e-6);
    let at = judgement.evidence.unwrap();
    // 0.2 k + 0.948 > 3 first for k = 11; the way there leaves after point 10
    assert_eq!(at.index, 10);
    assert!(at.element_id.is_some());
    assert!(line.unwrap().starts_with("leaves the road by up to 1.75 m, first after 1.0 s"));
    let tolerant = judge_with(&scene, &candidate(&poses, 0.0, 0.1), 1.8).0;
    assert!(tolerant.feasible && tolerant.metrics[0].value > 1.7);
    let (_, line) = judge_with(&scene, &candidate(&poses[15..], 0.0, 0.1), 0.0);
    assert!(line.unwrap().starts_with("starts outside: "));
}

#[test]
fn only_the_horizon_counts() {
    let scene = scene(straight_road(), 1);
    let mut poses = vec![(0.0, 0.0, 0.0); 40];
    poses[0].1 = 30.0;
    // at 0.1 s steps from -0.1 s the first point is before the start, and point 32 is beyond 3 s
    poses[32].1 = 30.0;
    assert!(judge_with(&scene, &candidate(&poses, -0.1, 0.1), 0.0).0.feasible);
    poses[31].1 = 30.0;
    assert!(!judge_with(&scene, &candidate(&poses, -0.1, 0.1), 0.0).0.feasible);
}

#[test]
fn what_lies_between_two_points_counts() {
    // A notch in the road between the two poses, which are 20 m apart.
    let rows: Vec<_> = [(0.0, 3.0), (24.0, 3.0), (25.0, 0.5), (26.0, 3.0), (60.0, 3.0)]
        .map(|(x, y)| vec![[x, y], [x, -3.0]])
        .to_vec();
    let scene = scene(road(&rows, "road"), 1);
    let (judgement, _) = judge_with(&scene, &candidate(&[(10.0, 0.0, 0.0), (35.0, 0.0, 0.0)], 0.0, 0.1), 0.0);
    assert!(!judgement.feasible);
    assert!(judgement.metrics[0].value > 0.1 && judgement.metrics[0].value < 0.448);
}

#[test]
fn lanelets_of_other_subtypes_are_no_road() {
    let rows = vec![vec![[0.0, 3.0], [0.0, -3.0]], vec![[50.0, 3.0], [50.0, -3.0]]];
    let here = candidate(&[(10.0, 0.0, 0.0), (11.0, 0.0, 0.0)], 0.0, 0.1);
    for (subtype, is_road) in [("road", true), ("road_shoulder", true), ("crosswalk", false)] {
        let (judgement, _) = judge_with(&scene(road(&rows, subtype), 1), &here, 0.0);
        assert_eq!(judgement.feasible, is_road, "{subtype}");
        assert_eq!(judgement.failure.is_some(), !is_road, "{subtype}");
    }
}

#[test]
fn the_map_is_needed_and_may_change() {
    let mut filter = OutOfLaneFilter::new(OutOfLaneParameters::default(), &VehicleInfo::default());
    let here = candidate(&[(10.0, 0.0, 0.0), (11.0, 0.0, 0.0)], 0.0, 0.1);
    let mut judge = |scene: &Scene| {
        filter.observe(scene);
        filter.judge(scene, &here, &mut Scratch::default())
    };
    let mut nothing = scene(straight_road(), 1);
    nothing.map = None;
    assert_eq!(judge(&nothing).reason().unwrap(), "lanelet map is not available");
    assert!(judge(&scene(straight_road(), 1)).feasible);
    let away = vec![vec![[500.0, 3.0], [500.0, -3.0]], vec![[550.0, 3.0], [550.0, -3.0]]];
    assert!(!judge(&scene(road(&away, "road"), 2)).feasible);
    assert!(judge(&nothing).failure.is_some());
}

/// Distance of a point from the road by looking at every lanelet: inside by crossings of a ray, else nearest edge.
fn reference_distance(map: &Map, x: f64, y: f64) -> f64 {
    map.lanelets()
        .map(|lanelet| {
            let corners: Vec<[f64; 3]> = lanelet.outline().collect();
            let mut inside = false;
            let mut nearest = f64::INFINITY;
            for k in 0..corners.len() {
                let (a, b) = (corners[k], corners[(k + 1) % corners.len()]);
                if (a[1] > y) != (b[1] > y) && x < (b[0] - a[0]) * (y - a[1]) / (b[1] - a[1]) + a[0] {
                    inside = !inside;
                }
                let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
                let t = (((x - a[0]) * dx + (y - a[1]) * dy) / (dx * dx + dy * dy)).clamp(0.0, 1.0);
                nearest = nearest.min((x - a[0] - t * dx).hypot(y - a[1] - t * dy));
            }
            if inside { 0.0 } else { nearest }
        })
        .fold(f64::INFINITY, f64::min)
}

/// A winding road of two lanes with uneven widths, and the excess of a pose by looking at 2000 places of its outline.
fn winding_road() -> Map {
    let rows: Vec<_> = (0..30)
        .map(|k| {
            let s = 4.0 * f64::from(k);
            let (x, y, yaw) = (s, 6.0 * (s / 20.0).sin(), (0.3 * (s / 20.0).cos()).atan());
            let half = 3.0 + 0.5 * (s / 9.0).sin();
            [half, 0.1, -half].map(|d| [x - yaw.sin() * d, y + yaw.cos() * d]).to_vec()
        })
        .collect();
    road(&rows, "road")
}

fn reference_excess(map: &Map, (x, y, yaw): (f64, f64, f64)) -> f64 {
    let (sin, cos) = yaw.sin_cos();
    let corners = [(3.79, 0.948), (3.79, -0.948), (-1.1, -0.948), (-1.1, 0.948)]
        .map(|(u, v)| (x + cos * u - sin * v, y + sin * u + cos * v));
    (0..4)
        .flat_map(|k| (0..500).map(move |i| (k, f64::from(i) / 500.0)))
        .map(|(k, t)| {
            let (a, b) = (corners[k], corners[(k + 1) % 4]);
            reference_distance(map, a.0 + t * (b.0 - a.0), a.1 + t * (b.1 - a.1))
        })
        .fold(0.0, f64::max)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn the_excess_equals_the_reference(x in 4.0..108.0_f64, d in -5.0..5.0_f64, yaw in -0.8..0.8_f64) {
        let pose = (x, 6.0 * (x / 20.0).sin() + d, yaw);
        let map = winding_road();
        let expected = reference_excess(&map, pose);
        let value = judge_with(&scene(map, 1), &candidate(&[pose, pose], 0.0, 0.1), 0.0).0.metrics[0].value;
        prop_assert!(value >= expected - 1e-6 && value <= expected + 0.01, "{value}, reference {expected}");
    }

    /// The same scene elsewhere and turned has the same excess.
    #[test]
    fn moving_the_scene_changes_nothing(
        (s, d, yaw) in (4.0..100.0_f64, -5.0..5.0_f64, -0.8..0.8_f64),
        (x, y, turn) in (-5e3..5e3_f64, -5e3..5e3_f64, -3.0..3.0_f64),
    ) {
        let (sin, cos) = turn.sin_cos();
        let moved = |[u, v]: [f64; 2]| [x + cos * u - sin * v, y + sin * u + cos * v];
        let rows: Vec<Vec<[f64; 2]>> = (0..30)
            .map(|k| 4.0 * f64::from(k))
            .map(|u| [3.0, 0.1, -3.0].map(|v| [u, v + 3.0 * (u / 20.0).sin()]).to_vec())
            .collect();
        let moved_rows: Vec<Vec<[f64; 2]>> =
            rows.iter().map(|row| row.iter().map(|&point| moved(point)).collect()).collect();
        let [mx, my] = moved([s, d]);
        let value = |rows: &[Vec<[f64; 2]>], pose: (f64, f64, f64)| {
            let scene = scene(road(rows, "road"), 1);
            judge_with(&scene, &candidate(&[pose, pose], 0.0, 0.1), 0.0).0.metrics[0].value
        };
        let (here, there) = (value(&rows, (s, d, yaw)), value(&moved_rows, (mx, my, yaw + turn)));
        prop_assert!((here - there).abs() < 2e-6, "{here}, moved {there}");
    }
}
