//! The named tolerances of this package, each with the question it decides. All are Autoware's values: a verdict that
//! hangs on one of them must fall the same way as upstream.

/// Determinant (m²) below which two segments count as parallel, and slack of the segment parameters (dimensionless),
/// in [`Segment::intersection`](crate::geometry::Segment::intersection).
pub const INTERSECTION: f64 = 1e-9;

/// Product of the three side lengths (m³) below which three points have no curvature.
pub const CURVATURE_SIDES_M3: f64 = 1e-10;

/// Two points whose x and y both differ by less than this (m) are the same point of a trajectory.
pub const OVERLAP_M: f64 = 1e-8;

/// An interpolation ratio this close to an end takes that end's orientation.
pub const END_RATIO: f64 = 1e-6;

/// Poses closer than this (m) have no direction of travel between them.
pub const DIRECTION_M: f64 = 1e-3;

/// Smallest segment length (m) that an interpolation divides by.
pub const SEGMENT_LENGTH_M: f64 = 1e-6;

/// Trajectory segments whose squared length (m²) is below this are not interpolated within.
pub const POINT_SEGMENT_M2: f64 = 1e-3;

/// Distance (m) from the first point at which the driving direction of a trajectory is read off.
pub const DRIVING_DIRECTION_M: f64 = 0.01;

/// Jerk (m/s³) and acceleration (m/s²) closer to zero than this cannot stop a vehicle.
pub const BRAKING: f64 = 1e-3;
