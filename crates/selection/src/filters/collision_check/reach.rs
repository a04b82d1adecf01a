//! Where the candidates of a cycle may come at all, and what no object of it can come near.
//!
//! Objects far from all candidates are many, and working out what they cover over time costs as much as for those that
//! are near. A candidate is compared with nothing outside the box around its motion; here are boxes around all of these
//! boxes, and around all that an object can cover on a way, without working that out.

use super::settings::Settings;
use crate::candidate::Candidate;
use motion::Point2;
use motion::geometry::OrientedBox;
use motion::occupancy::{Bounds, Outline, Sweep};

/// More than rounding moves anything that is bounded here \[m\], for places up to 1e8 m from the origin.
const ROUNDING_M: f64 = 0.01;
/// The vehicle goes on beyond the last point of a candidate for at most one sample; this many are allowed for.
const SAMPLES_BEYOND: f64 = 2.0;
/// A slice of an object lasts for at most three samples (the ends of a way lie between two of them); this many are
/// allowed for.
const SAMPLES_OF_SLICE: f64 = 4.0;

/// Boxes around all candidates of a cycle.
#[derive(Debug, Clone, Copy)]
pub(super) struct Reach {
    /// Holds the box around the motion of each candidate that objects' ways are compared with.
    pub(super) passages: Bounds,
    /// Holds all that the vehicle covers on each candidate.
    pub(super) covered: Bounds,
}

impl Reach {
    /// That of these candidates.
    pub(super) fn of(candidates: &[Candidate], settings: &Settings) -> Self {
        let outlines = settings.ego_outlines.iter().chain([&settings.rss_outline]);
        let radius_m = outlines.map(Outline::radius_m).fold(0.0, f64::max);
        let mut reach = Self { passages: Bounds::EMPTY, covered: Bounds::EMPTY };
        for candidate in candidates {
            let places = candidate.points.bounds(SAMPLES_BEYOND * settings.resolution_s);
            reach.passages = reach.passages.joined(&places.grown(radius_m + ROUNDING_M));
            // A slice is grown by how far the path strays from the straight line between its ends, which all lie in the
            // box, and by what headings and the rotation add: less than three radii.
            let stray_m = (places.max - places.min).norm();
            reach.covered = reach.covered.joined(&places.grown(stray_m + 4.0 * radius_m + ROUNDING_M));
        }
        reach
    }
}

/// A box that holds all slices of a body whose origin stays in the box `places` and moves at this speed at most. The
/// outline reaches as far as its radius from the origin. A slice is grown by how far its motion strays from the straight
/// line, no farther than the body goes in it, and by what headings and the rotation add, less than three radii.
pub(super) fn bounds_of_way(places: &Bounds, speed_mps: f64, outline: &Outline, resolution_s: f64) -> Bounds {
    places.grown(4.0 * outline.radius_m() + SAMPLES_OF_SLICE * resolution_s * speed_mps + ROUNDING_M)
}

/// A box that holds the origin of a body that starts here and goes no farther than this \[m\].
pub(super) fn bounds_around(start: Point2, distance_m: f64) -> Bounds {
    Bounds { min: start, max: start }.grown(distance_m)
}

/// The box around an object that stands, a little larger: what touches the object meets it, whatever was rounded of
/// either. The other box is around what may touch it.
pub(super) fn near_of(standing: &Bounds, other: &Bounds) -> Bounds {
    standing.grown(rounding_m(&standing.joined(other)))
}

/// The same for the box at an angle around an object that stands, one of several.
pub(super) fn turned_near_of(standing: &Sweep, place: usize, other: &Bounds) -> OrientedBox {
    let turned = standing.bounding_box(place);
    let rounding_m = rounding_m(&standing.bounds()[place].joined(other));
    OrientedBox {
        half_length_m: turned.half_length_m + rounding_m,
        half_width_m: turned.half_width_m + rounding_m,
        ..*turned
    }
}

/// Far more than rounding moves the sides of a box \[m\], far less than matters.
fn rounding_m(bounds: &Bounds) -> f64 {
    let sides = [bounds.min.x, bounds.min.y, bounds.max.x, bounds.max.y];
    sides.iter().fold(1e-6, |most, side| f64::max(most, 1e-9 * side.abs()))
}
