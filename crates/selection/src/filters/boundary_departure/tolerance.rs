//! The named tolerances of this filter.

/// A side that came nearer to a border than this has passed it: from then on distances on the wrong side of a border
/// are negative. Upstream's constant, independent of the lateral margin.
pub(super) const PASSED_M: f64 = 0.01;

/// Slack of every bound that spares work: far more than rounding can move a distance at coordinates within
/// [`FARTHEST_M`].
pub(super) const ROUNDING_M: f64 = 1e-7;

/// Lines farther apart than this do not cross, whatever slack the crossing test has.
pub(super) const CONTACT_M: f64 = 1e-5;

/// Coordinates beyond this are on no map, projected or not; nothing can be judged there.
pub(super) const FARTHEST_M: f64 = 2e7;
