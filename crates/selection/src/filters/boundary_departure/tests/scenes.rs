//! Random maps with borders and random drives through them.

use std::sync::Arc;

use lanelet_map::MapBuilder;
use messages::builtin_interfaces::Time;
use messages::geometry_msgs::AccelWithCovarianceStamped;
use messages::nav_msgs::Odometry;
use motion::{Pose, Quaternion, TimeFromStart, TrajectoryPoint, VehicleDimensions, VehicleInfo};
use proptest::prelude::*;

use crate::scene::{Epoch, HdMap, Scene};

/// Line strings by their vertices; every fourth one may be crossed.
#[derive(Debug, Clone)]
pub(super) struct MapSketch {
    pub(super) lines: Vec<Vec<[f64; 3]>>,
}

fn turned(x: f64, y: f64, dx: f64, dy: f64, turn: f64) -> (f64, f64) {
    let (sin, cos) = turn.sin_cos();
    (cos * x - sin * y + dx, sin * x + cos * y + dy)
}

impl MapSketch {
    pub(super) fn moved(&self, dx: f64, dy: f64, turn: f64) -> Self {
        let moved = |&[x, y, z]: &[f64; 3]| {
            let (x, y) = turned(x, y, dx, dy, turn);
            [x, y, z]
        };
        Self { lines: self.lines.iter().map(|line| line.iter().map(moved).collect()).collect() }
    }

    /// The map as a snapshot with epoch `number`.
    pub(super) fn map(&self, number: u64) -> Epoch<HdMap> {
        let mut builder = MapBuilder::new();
        let mut next = 1;
        for (at, line) in self.lines.iter().enumerate() {
            let mut ids = Vec::new();
            for position in line {
                builder.point(next, *position, &[]).unwrap();
                ids.push(next);
                next += 1;
            }
            let kind = if at % 4 == 3 { "line_thin" } else { "road_border" };
            builder.line_string(10_000 + at as i64, &ids, &[("type", kind)]).unwrap();
        }
        let map = Arc::new(builder.build().unwrap());
        Epoch { number, value: HdMap::new("map".into(), map) }
    }
}

/// A candidate and the vehicle that is to drive it.
#[derive(Debug, Clone)]
pub(super) struct Drive {
    pub(super) points: Vec<TrajectoryPoint>,
    pub(super) vehicle: VehicleInfo,
    pub(super) speed_mps: f64,
}

impl Drive {
    pub(super) fn moved(&self, dx: f64, dy: f64, turn: f64) -> Self {
        let mut moved = self.clone();
        for point in &mut moved.points {
            let (x, y) = turned(point.pose.position.x, point.pose.position.y, dx, dy, turn);
            (point.pose.position.x, point.pose.position.y) = (x, y);
            let (Quaternion { x, y, z, w }, (sin, cos)) = (point.pose.orientation, (turn / 2.0).sin_cos());
            point.pose.orientation = Quaternion {
                x: cos * x - sin * y,
                y: cos * y + sin * x,
                z: cos * z + sin * w,
                w: cos * w - sin * z,
            };
        }
        moved
    }

    /// The scene in which it is judged, 10 s after the epoch.
    pub(super) fn scene(&self, sketch: &MapSketch) -> Scene {
        scene_at(10.0, self.speed_mps, &self.vehicle, sketch)
    }
}

/// A scene at a time with a vehicle that drives steadily.
pub(super) fn scene_at(time_s: f64, speed_mps: f64, vehicle: &VehicleInfo, sketch: &MapSketch) -> Scene {
    let stamp = Time::from_nanoseconds((time_s * 1e9).round() as i64);
    let mut scene = Scene::empty(stamp, Arc::new(*vehicle));
    let mut odometry = Odometry::default();
    odometry.header.stamp = stamp;
    odometry.twist.twist.linear.x = speed_mps;
    scene.odometry = Some(Arc::new(odometry));
    scene.acceleration = Some(Arc::new(AccelWithCovarianceStamped::default()));
    scene.map = Some(sketch.map(1));
    scene
}

/// A winding line string: start, heading, number of segments, length of each, turn of each.
fn line() -> impl Strategy<Value = Vec<[f64; 3]>> {
    let step = prop_oneof![0.0..0.3_f64, 0.3..2.0_f64, 2.0..30.0_f64];
    let place = (-15.0..55.0_f64, -14.0..14.0_f64, prop_oneof![Just(0.0), -3.2..3.2_f64]);
    let height = prop_oneof![4 => Just(0.0), 1 => Just(2.4), 1 => Just(6.0)];
    (place, 1..25_usize, step, -0.25..0.25_f64, height).prop_map(|((x, y, heading), count, step, turn, z)| {
        let mut vertices = vec![[x, y, z]];
        let (mut x, mut y, mut heading) = (x, y, heading);
        for _ in 0..count {
            (x, y) = (x + step * heading.cos(), y + step * heading.sin());
            vertices.push([x, y, z]);
            heading += turn;
        }
        vertices
    })
}

/// Borders along a road, as maps have them: two long ones at either side, cut in short segments.
fn road() -> impl Strategy<Value = Vec<Vec<[f64; 3]>>> {
    (0.4..4.0_f64, 0.4..4.0_f64, 0.3..4.0_f64).prop_map(|(left, right, step)| {
        let side = |y: f64, step: f64| {
            (0..(80.0 / step) as usize).map(|at| [at as f64 * step - 10.0, y, 0.0]).collect::<Vec<_>>()
        };
        vec![side(0.95 + left, step), side(-0.95 - right, step * 1.3)]
    })
}

pub(super) fn sketch() -> impl Strategy<Value = MapSketch> {
    let wild = prop::collection::vec(line(), 1..14);
    let with_road = (road(), prop::collection::vec(line(), 0..4)).prop_map(|(mut lines, more)| {
        lines.extend(more);
        lines
    });
    prop_oneof![wild, with_road].prop_map(|lines| MapSketch { lines })
}

prop_compose! {
    /// A drive from about the origin along x, with bends, possibly standing, reversing or rolling.
    pub(super) fn drive()(
        count in 2..45_usize,
        step in prop_oneof![Just(0.0), 0.01..0.3_f64, 0.3..2.5_f64, -1.0..0.0_f64],
        slowing in 0.9..1.0_f64,
        (y, yaw, bend) in (-2.0..2.0_f64, prop_oneof![Just(0.0), -0.4..0.4_f64], prop_oneof![Just(0.0), -0.06..0.06_f64]),
        left in prop_oneof![Just(0.128), 0.0..2.5_f64],
        (roll, pitch) in prop_oneof![3 => Just((0.0, 0.0)), 1 => (-0.3..0.3_f64, -0.3..0.3_f64)],
        speed_mps in 0.0..15.0_f64,
    ) -> Drive {
        let vehicle =
            VehicleInfo::new(VehicleDimensions { left_overhang_m: left, ..VehicleDimensions::default() }).unwrap();
        let (mut x, mut y, mut yaw, mut step) = (0.0, y, yaw, step);
        let mut points = Vec::new();
        for index in 0..count {
            let mut pose = Pose::from_xy_yaw(x, y, 0.0);
            pose.orientation = Quaternion::from_roll_pitch_yaw(roll, pitch, yaw);
            let time_from_start = TimeFromStart::from_nanos(index as i64 * 100_000_000);
            points.push(TrajectoryPoint { time_from_start, pose, ..TrajectoryPoint::default() });
            (x, y) = (x + step * f64::cos(yaw), y + step * f64::sin(yaw));
            (yaw, step) = (yaw + bend * step, step * slowing);
        }
        Drive { points, vehicle, speed_mps }
    }
}
