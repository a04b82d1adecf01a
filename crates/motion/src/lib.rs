//! How a vehicle and its trajectories move: vehicle dimensions, poses, plane geometry, trajectories, footprints and
//! stopping distances.
//!
//! Everything here is a pure function of its arguments: no threads, clocks, files or logging, and no allocation in
//! functions that work on one point (functions over a whole trajectory write to buffers of the caller).
//!
//! Conventions: SI units (m, rad, s, m/s); right-handed map frame with z up; yaw counter-clockwise from the x axis;
//! base_link is the middle of the rear axle on the ground, x forward, y to the left; curvature, steering and lateral
//! distances are positive to the left. Unless a function says otherwise it looks at x and y only.
//!
//! Where a function has a counterpart in Autoware its name is given, and thresholds and edge cases are the same. One
//! difference holds everywhere: plane distances are `sqrt(dx² + dy²)` rather than `hypot`, equal up to the last bit.

pub mod footprint;
pub mod geometry;
pub mod occupancy;
pub mod pose;
pub mod stopping;
pub mod tolerance;
pub mod trajectory;
pub mod vehicle;

pub use footprint::Footprint;
pub use geometry::{AxisAlignedBox, OrientedBox, Point2, Point3, Segment, Vector2};
pub use pose::{Pose, Quaternion};
pub use stopping::calculate_stop_distance;
pub use trajectory::{Posed, TimeFromStart, TrajectoryPoint};
pub use vehicle::{VehicleDimensions, VehicleError, VehicleInfo};
