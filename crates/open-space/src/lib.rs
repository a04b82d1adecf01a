//! The open-space trajectory provider: plans parking and tight manoeuvres, and keeps a vehicle safe while a plan is
//! missing.
//!
//! Pure: no threads, clocks, files or logging. Time is an argument, deadlines are a question the caller answers.
//!
//! Conventions: SI units; poses are those of the middle of the rear axle; yaw counter-clockwise; curvature and steering
//! positive to the left; arc lengths, speeds and accelerations along the vehicle's heading, so reverse motion has
//! negative speed, and curvature = dyaw/ds = tan(steering angle) / wheel base holds in both gears.

pub mod arc;
pub mod collision;
mod convex_program;
pub mod fallback;
pub mod grid_heuristic;
pub mod hybrid_a_star;
pub mod interruption;
#[cfg(test)]
mod manoeuvre;
pub mod partition;
pub mod path_profile;
pub mod planner;
pub mod pose;
pub mod problem;
pub mod provider;
pub mod reeds_shepp;
pub mod region_of_interest;
pub mod scenes;
pub mod smoother;
pub mod speed;
pub mod stage;
pub mod stitcher;
pub mod tolerance;
pub mod trajectory;
pub mod vehicle_model;
pub mod verification;

pub use arc::Arc;
pub use collision::{CollisionChecker, ObstacleError};
pub use grid_heuristic::GridHeuristic;
pub use hybrid_a_star::{CoarsePath, GearPart, Search, SearchError, SearchParameters};
pub use interruption::{Interruption, Patience, Watch, unwatched, watched_by};
pub use path_profile::PathProfile;
pub use planner::{OpenSpaceParameters, Plan, PlanError, Planner, Supervisor};
pub use pose::{Gear, PlanarPose};
pub use problem::{Limits, Problem};
pub use speed::{SpeedError, SpeedLimits, SpeedParameters, SpeedProfile};
pub use trajectory::{Trajectory, TrajectoryPoint};
pub use verification::{Measures, Violation};
