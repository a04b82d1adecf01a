//! The named tolerances of this crate, each with the question it decides.

/// Shapes at most this far apart (m) touch, and touching is a collision.
pub const TOUCH_M: f64 = 1e-10;

/// How far (m) a swept hull may reach beyond the true swept area before the motion is cut in two.
pub const SWEEP_BULGE_M: f64 = 1e-3;

/// Coordinates beyond this (m) are refused: far outside every map grid, and cross products would lose the millimetre.
pub const MAX_COORDINATE_M: f64 = 1e7;
