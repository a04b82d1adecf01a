//! Candidates for the pictures: a way through the plane, and how fast it is driven.

use super::NOW;
use messages::autoware_internal_planning_msgs::CandidateTrajectory;
use messages::autoware_planning_msgs::TrajectoryPoint;
use messages::builtin_interfaces::Duration;
use messages::geometry_msgs::{Point, Pose, Quaternion};
use messages::std_msgs::Header;
use messages::unique_identifier_msgs::Uuid;
use selection::Candidate;
use std::sync::Arc;

const STEP_S: f64 = 0.1;
const STEP_NS: i64 = 100_000_000;
/// Steps of the integration along a way, m.
const GRAIN_M: f64 = 0.01;

/// A stretch of a way: its length, and the curvature at its end, which is reached linearly. Metres, left positive.
pub(super) type Stretch = (f64, f64);

/// How fast a way is driven: from the first speed on with this deceleration, for so long.
#[derive(Debug, Clone, Copy)]
pub(super) struct Speed {
    pub(super) start_mps: f64,
    pub(super) deceleration_mps2: f64,
    pub(super) duration_s: f64,
}

impl Speed {
    pub(super) fn constant(start_mps: f64, duration_s: f64) -> Self {
        Self { start_mps, deceleration_mps2: 0.0, duration_s }
    }

    /// Stops after this way, and stands for as long as the rest of the time.
    pub(super) fn stop_after(start_mps: f64, distance_m: f64, duration_s: f64) -> Self {
        Self { start_mps, deceleration_mps2: start_mps * start_mps / (2.0 * distance_m), duration_s }
    }

    /// Speed and way after a time.
    fn at(&self, time_s: f64) -> (f64, f64) {
        let braking_s = if self.deceleration_mps2 > 0.0 {
            time_s.min(self.start_mps / self.deceleration_mps2)
        } else {
            time_s
        };
        let speed_mps = self.start_mps - self.deceleration_mps2 * braking_s;
        (speed_mps.max(0.0), 0.5 * (self.start_mps + speed_mps) * braking_s)
    }
}

/// Poses along a way from the origin along x, a grain apart.
fn walk(way: &[Stretch]) -> Vec<(f64, f64, f64)> {
    let (mut x, mut y, mut yaw, mut curvature) = (0.0_f64, 0.0_f64, 0.0_f64, 0.0_f64);
    let mut poses = vec![(x, y, yaw)];
    for &(length_m, end) in way {
        let steps = (length_m / GRAIN_M).round().max(1.0);
        let change = (end - curvature) / steps;
        for _ in 0..steps as u32 {
            curvature += change;
            yaw += curvature * GRAIN_M;
            x += yaw.cos() * GRAIN_M;
            y += yaw.sin() * GRAIN_M;
            poses.push((x, y, yaw));
        }
    }
    poses
}

/// A point every tenth of a second; what goes beyond the way goes straight on.
pub(super) fn points(way: &[Stretch], speed: Speed) -> Vec<TrajectoryPoint> {
    let poses = walk(way);
    let pose_after = |way_m: f64| {
        let index = ((way_m / GRAIN_M).round() as usize).min(poses.len() - 1);
        let (x, y, yaw) = poses[index];
        let beyond_m = (way_m - index as f64 * GRAIN_M).max(0.0);
        let position = Point { x: x + beyond_m * yaw.cos(), y: y + beyond_m * yaw.sin(), z: 0.0 };
        Pose { position, orientation: Quaternion::from_yaw(yaw) }
    };
    let point = |index: u32| {
        let (speed_mps, way_m) = speed.at(f64::from(index) * STEP_S);
        let acceleration_mps2 = if speed_mps > 0.0 { -speed.deceleration_mps2 } else { 0.0 };
        TrajectoryPoint {
            time_from_start: Duration::from_nanoseconds(i64::from(index) * STEP_NS),
            pose: pose_after(way_m),
            longitudinal_velocity_mps: speed_mps as f32,
            acceleration_mps2: acceleration_mps2 as f32,
            ..TrajectoryPoint::default()
        }
    };
    (0..=(speed.duration_s / STEP_S).round() as u32).map(point).collect()
}

/// A candidate; its name is written in the picture.
pub(super) fn candidate(name: &str, points: Vec<TrajectoryPoint>) -> Candidate {
    let message = CandidateTrajectory {
        header: Header { stamp: NOW, frame_id: "map".to_owned() },
        generator_id: Uuid { uuid: [name.len() as u8; 16] },
        points,
        ..CandidateTrajectory::default()
    };
    Candidate::new(Arc::new(message), name.into(), 0)
}
