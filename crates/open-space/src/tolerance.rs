//! The named tolerances of this crate, each with the question it decides.

/// Shapes at most this far apart (m) touch, and touching is a collision.
pub const TOUCH_M: f64 = 1e-10;

/// How far (m) a swept hull may reach beyond the true swept area before the motion is cut in two.
pub const SWEEP_BULGE_M: f64 = 1e-3;

/// Coordinates beyond this (m) are refused: far outside every map grid, and cross products would lose the millimetre.
pub const MAX_COORDINATE_M: f64 = 1e7;

/// How far (m) beyond the bounds is still on their border: as far as rounding moves what stands on it.
pub const BORDER_M: f64 = 5e-10;

/// Headings beyond this (rad), some 160 turns, are refused: numbers so large do not tell directions apart any more.
pub const MAX_HEADING_RAD: f64 = 1e3;

/// Part of a limit that the solver is given, so that its own tolerance stays within the limit.
pub const SOLVER_ROOM: f64 = 1.0 - 1e-6;

/// How far a solved speed profile may miss its end: m, m/s and m/s².
pub const PROFILE_END: f64 = 1e-5;

/// Shortest relative gain of time for which the speed is solved once more.
pub const SPEED_GAIN: f64 = 0.02;

/// How far (m) a path may miss its end before curvatures are corrected once more.
pub const PATH_END_M: f64 = 1e-9;

/// The same for its heading, rad.
pub const PATH_END_RAD: f64 = 1e-9;

/// How far (m, or m/s) a trajectory may begin off the start and end off the goal.
pub const END_M: f64 = 1e-3;

/// The same for its headings, rad.
pub const END_RAD: f64 = 1e-3;

/// Part of a limit by which rounding may exceed it.
pub const LIMIT_ROOM: f64 = 1e-6;

/// How far (m, rad or m/s) the way between two points may differ from what their speeds and curvatures tell, which are
/// means over a tenth of a second at most.
pub const KINEMATICS: f64 = 2e-3;

/// Travel (m) between poses of a path whose swept area is checked as one hull; the hull of a turning vehicle reaches
/// beyond what it sweeps by some millimetres for each centimetre.
pub const SWEEP_STEP_M: f64 = 0.01;

/// The same for its heading, rad.
pub const SWEEP_STEP_RAD: f64 = 0.004;

/// Slack (s) of looking up a point of a trajectory by time.
pub const TIME_SLACK_S: f64 = 1e-5;

/// Times closer than this (s) are one.
pub const SAME_TIME_S: f64 = 1e-10;

/// By how much farther (squared distance, m²) a later point of the previous trajectory may be and still be the match.
pub const MATCH_BUFFER_M2: f64 = 1e-6;

/// Steps of a trajectory shorter than this (m) have no direction.
pub const STEP_DIRECTION_M: f64 = 1e-3;

/// A point of a plan slower than this (m/s) is at rest.
pub const STANDSTILL_MPS: f64 = 1e-3;

/// A point closer to the vehicle than this (m) is where the vehicle is, neither ahead nor behind: the noise of a
/// position.
pub const SAME_PLACE_M: f64 = 0.03;

/// Overlaps of outlines (shared over covered area) closer than this are equally good: 2.5 cm along a car.
pub const NEAR_EQUAL_OVERLAP: f64 = 0.01;
