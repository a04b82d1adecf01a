//! The hand-over between the provider and whoever plans for it: what a job says, what comes back, and the two ways to
//! have it done.

use std::sync::Arc;

use motion::Point2;
use motion::pose::normalize_radian;

use crate::pose::PlanarPose;
use crate::stitcher::DiscretizedTrajectory;

/// The surroundings of a goal, in a frame of their own. Shared, never changed.
#[derive(Clone, Debug, PartialEq)]
pub struct Region {
    /// Origin of the region's frame in the map, m.
    pub origin: Point2,
    /// Direction of the region's x axis in the map, rad.
    pub heading_rad: f64,
    /// Where the vehicle shall come to rest, in the region's frame.
    pub goal: PlanarPose,
    /// Box that the reference point must not leave, in the region's frame: x_min, x_max, y_min, y_max, m.
    pub bounds: [f64; 4],
    /// Polylines in the region's frame, m. A closed one (first vertex = last) is a solid polygon, an open one a wall.
    pub obstacles: Vec<Vec<Point2>>,
}

impl Region {
    /// A pose of the region's frame in the map, its heading in [-π, π).
    #[must_use]
    pub fn to_map(&self, pose: PlanarPose) -> PlanarPose {
        let (sin, cos) = self.heading_rad.sin_cos();
        PlanarPose::new(
            self.origin.x + pose.x * cos - pose.y * sin,
            self.origin.y + pose.x * sin + pose.y * cos,
            normalize_radian(pose.yaw + self.heading_rad),
        )
    }

    /// A pose of the map in the region's frame, its heading in [-π, π).
    #[must_use]
    pub fn to_region(&self, pose: PlanarPose) -> PlanarPose {
        let (sin, cos) = self.heading_rad.sin_cos();
        let (x, y) = (pose.x - self.origin.x, pose.y - self.origin.y);
        PlanarPose::new(x * cos + y * sin, y * cos - x * sin, normalize_radian(pose.yaw - self.heading_rad))
    }

    /// The goal in the map.
    #[must_use]
    pub fn goal_in_map(&self) -> PlanarPose {
        self.to_map(self.goal)
    }
}

/// What is to be planned.
#[derive(Clone, Debug, PartialEq)]
pub struct Job {
    /// What the plan continues; its last point is the start. Times count from `submitted_s`.
    pub stitching: DiscretizedTrajectory,
    /// Where to go, and between what.
    pub region: Arc<Region>,
    /// When the job was made, s, on the clock of the cycles.
    pub submitted_s: f64,
}

/// How planning ended without a fault.
#[derive(Clone, Debug, PartialEq)]
pub enum Outcome {
    /// A trajectory in the map, times and arc lengths from 0.
    Planned(DiscretizedTrajectory),
    /// The start is at the goal: nothing to plan.
    Skipped,
}

/// A result and what belongs to it.
#[derive(Clone, Debug, PartialEq)]
pub struct Planned {
    /// The plan in the map, times and arc lengths from 0.
    pub optimized: DiscretizedTrajectory,
    /// What it continues, from the job.
    pub stitching: DiscretizedTrajectory,
    /// When the job was made, s.
    pub submitted_s: f64,
    /// How long planning took, ms.
    pub latency_ms: f64,
}

/// Why there is no plan. [`Self::upstream_text`] is the text that log readers know; `Display` says more.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PlanFailure {
    /// The job cannot be planned as it is.
    #[error("OpenSpaceTrajectoryOptimizer input data not ready: {field} {fault}")]
    InputNotReady {
        /// What is wrong.
        field: &'static str,
        /// How it is wrong.
        fault: &'static str,
    },
    /// No way was found.
    #[error("State warm start problem failed to solve: {why}")]
    Search {
        /// The planner's account.
        why: String,
    },
    /// A way was found that could not be made drivable.
    #[error("iterative anchoring smoothing problem failed to solve: {why}")]
    Smoothing {
        /// The planner's account.
        why: String,
    },
    /// The plan does not pass the last check.
    #[error("the planned trajectory is refused: {why}")]
    Refused {
        /// What it violates.
        why: String,
    },
    /// Planning was called off.
    #[error("planning was cancelled")]
    Cancelled,
    /// The planner broke down; it was replaced by a fresh one.
    #[error("the planner panicked: {message}; this is a defect, please report it")]
    Panicked {
        /// The panic's text.
        message: String,
    },
}

impl PlanFailure {
    /// The text as upstream gives it; where upstream has none, ours.
    #[must_use]
    pub fn upstream_text(&self) -> String {
        match self {
            Self::InputNotReady { .. } => "OpenSpaceTrajectoryOptimizer input data not ready".to_owned(),
            Self::Search { .. } => "State warm start problem failed to solve".to_owned(),
            Self::Smoothing { .. } => "iterative anchoring smoothing problem failed to solve".to_owned(),
            other => other.to_string(),
        }
    }
}

/// What a worker has been doing, for whoever watches.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct WorkerState {
    /// A job waits to be planned.
    pub data_ready: bool,
    /// A result waits to be taken.
    pub trajectory_updated: bool,
    /// A job was skipped since the start.
    pub trajectory_skipped: bool,
    /// A failure waits to be taken.
    pub trajectory_error: bool,
    /// Jobs skipped since the start.
    pub skips: u64,
}

/// The planning thread could not be started.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("the planning thread cannot be started: {why}; are there limits on threads or memory?")]
pub struct WorkerNotStarted {
    /// The operating system's answer.
    pub why: String,
}

/// Plans beside the cycles. At most one result waits; while it does nothing is planned, and taking it discards the job
/// that waits behind it. A new job replaces one that waits; a job that is being planned is planned to its end.
pub trait PlanningWorker {
    /// Starts planning.
    ///
    /// # Errors
    /// There is no thread to be had.
    fn start(&mut self) -> Result<(), WorkerNotStarted>;
    /// Leaves a job to be planned; never waits.
    fn submit(&mut self, job: Job);
    /// Takes the result that waits.
    fn take_planned(&mut self) -> Option<Planned>;
    /// Takes the failure that waits; of several the last.
    fn take_failure(&mut self) -> Option<PlanFailure>;
    /// What it has been doing.
    fn state(&self) -> WorkerState;
    /// Calls planning off without waiting for its end.
    fn request_stop(&mut self);
    /// Calls planning off, waits for its end and forgets jobs, results and failures. It can be started again.
    fn stop(&mut self);
}

/// Plans while the cycle waits.
pub trait SynchronousPlanner {
    /// Plans a job; also says how long it took, ms.
    fn plan(&mut self, job: &Job) -> (Result<Outcome, PlanFailure>, f64);
}

/// Who plans.
pub enum Execution {
    /// A worker beside the cycles.
    Threaded(Box<dyn PlanningWorker + Send>),
    /// The cycle itself.
    Synchronous(Box<dyn SynchronousPlanner + Send>),
}

impl std::fmt::Debug for Execution {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Threaded(_) => "Threaded",
            Self::Synchronous(_) => "Synchronous",
        })
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn to_the_region_and_back(
            ox in -1e3..1e3_f64, oy in -1e3..1e3_f64, heading in -4.0..4.0_f64,
            x in -1e3..1e3_f64, y in -1e3..1e3_f64, yaw in -3.1..3.1_f64,
        ) {
            let region = Region {
                origin: Point2::new(ox, oy),
                heading_rad: heading,
                goal: PlanarPose::default(),
                bounds: [0.0; 4],
                obstacles: Vec::new(),
            };
            let pose = PlanarPose::new(x, y, yaw);
            let back = region.to_map(region.to_region(pose));
            prop_assert!(back.distance_m(&pose) < 1e-9 && back.yaw_to(&pose).abs() < 1e-9);
            // A step along the region's x axis is a step along its heading in the map.
            let (a, b) = (region.to_map(PlanarPose::default()), region.to_map(PlanarPose::new(1.0, 0.0, 0.0)));
            prop_assert!((b.x - a.x - heading.cos()).abs() < 1e-9 && (b.y - a.y - heading.sin()).abs() < 1e-9);
        }
    }
}
