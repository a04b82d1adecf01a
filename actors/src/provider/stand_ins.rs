//! Jobs and plans that carry a number as their place, so that a test can tell whose they are.

use motion::Point2;
use open_space::PlanarPose;
use open_space::provider::{Job, Region};
use open_space::stitcher::{DiscretizedPoint, DiscretizedTrajectory, PathPoint};
use open_space::vehicle_model::VehicleState;

pub(super) fn point(time_s: f64, number: f64) -> DiscretizedPoint {
    let pose = PlanarPose::new(number, 0.0, 0.0);
    DiscretizedPoint {
        path_point: Some(PathPoint { pose, ..PathPoint::default() }),
        relative_time_s: time_s,
        ..DiscretizedPoint::default()
    }
}

/// The number that a trajectory carries.
pub(super) fn planned_for(trajectory: &DiscretizedTrajectory) -> f64 {
    trajectory.points.last().and_then(|point| point.path_point).map_or(f64::NAN, |point| point.pose.x)
}

pub(super) fn region() -> Region {
    Region {
        origin: Point2::origin(),
        heading_rad: 0.0,
        goal: PlanarPose::default(),
        bounds: [-1.0, 1.0, -1.0, 1.0],
        obstacles: Vec::new(),
    }
}

/// A job that is known by the time it was submitted at.
pub(super) fn job(number: u32) -> Job {
    let submitted_s = f64::from(number);
    Job {
        stitching: DiscretizedTrajectory { points: vec![point(0.1, submitted_s)] },
        region: std::sync::Arc::new(region()),
        submitted_s,
    }
}

/// Standing away from the goal.
pub(super) fn vehicle() -> VehicleState {
    VehicleState::standing_at(PlanarPose::new(-500.0, 0.0, 0.0))
}
