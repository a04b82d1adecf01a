//! Smooths one gear part of a coarse path: from arcs that meet with a jerk of the steering wheel to a path of
//! continuous curvature.
//!
//! Iterative anchoring: points on the coarse path are moved by a convex program that straightens them as a bent strip
//! would be, within bounds about their places. Where the vehicle would touch something on the result, bounds shrink,
//! at last to nothing, and the program is solved again. Both end poses stay as they are. What comes out is free of
//! collisions over its whole length, or an error; never a path that still collides.

mod anchoring;
mod parameters;

use motion::{Point2, Vector2};
use thiserror::Error;

use crate::collision::CollisionChecker;
use crate::hybrid_a_star::GearPart;
use crate::interruption::Patience;
use crate::path_profile::PathProfile;
use crate::pose::PlanarPose;
use crate::verification::motion_is_free;
use anchoring::AnchoredPoints;
pub use parameters::SmootherParameters;

/// Why a part was not smoothed.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum SmoothingError {
    /// Too short to be bent.
    #[error("a part of {length_m:.3} m is too short to be smoothed")]
    TooShort {
        /// Of the part.
        length_m: f64,
    },
    /// The program has no solution, or no path of the vehicle's curvature leads along it.
    #[error("no path within the curvature limit was found in pass {pass}")]
    NoPath {
        /// Counted from 1.
        pass: usize,
    },
    /// The vehicle still touches something after the last pass.
    #[error("the smoothed path still collides {at_m:.2} m after its start, after {passes} passes")]
    Colliding {
        /// Travel from the start of the part.
        at_m: f64,
        /// Programs solved.
        passes: usize,
    },
    /// The caller asked to stop.
    #[error("stopped after {passes} passes")]
    Stopped {
        /// Programs solved.
        passes: usize,
    },
}

impl SmoothingError {
    /// Programs solved in vain.
    #[must_use]
    pub fn passes(&self) -> usize {
        match *self {
            Self::TooShort { .. } => 0,
            Self::NoPath { pass } => pass,
            Self::Colliding { passes, .. } | Self::Stopped { passes } => passes,
        }
    }
}

/// A smoothed part.
#[derive(Clone, Debug, PartialEq)]
pub struct SmoothedPart {
    /// From the first to the last pose of the coarse part.
    pub path: PathProfile,
    /// Programs solved for it.
    pub passes: usize,
}

/// Points with fewer intervals than this are not smoothed.
const FEWEST_INTERVALS: f64 = 8.0;
/// Parts shorter than this are left alone, m.
const SHORTEST_PART_M: f64 = 0.05;
/// Neighbours on either side whose bounds shrink along with those of a colliding point.
const NEIGHBOURS: usize = 3;

/// A part of a coarse path, and who drives it.
#[derive(Clone, Copy, Debug)]
pub struct PartToSmooth<'a> {
    /// The part.
    pub part: &'a GearPart,
    /// Distance that it keeps from every obstacle, m.
    pub inflation_m: f64,
    /// Curvature that the smooth path begins with, 1/m; `None` where the wheels turn before it begins.
    pub start_curvature: Option<f64>,
    /// What the vehicle can drive, 1/m.
    pub max_curvature: f64,
}

/// Smooths a part.
///
/// `patience` is asked before each pass.
///
/// # Errors
/// Every reason for which there is no smooth path that is free of collisions; the coarse one is still good then.
pub fn smooth_part(
    &PartToSmooth { part, inflation_m, start_curvature, max_curvature }: &PartToSmooth<'_>,
    checker: &CollisionChecker,
    parameters: &SmootherParameters,
    patience: &mut dyn Patience,
) -> Result<SmoothedPart, SmoothingError> {
    let length_m = part.length_m();
    let (Some(start), Some(end)) = (part.poses.first(), part.poses.last()) else {
        return Err(SmoothingError::TooShort { length_m });
    };
    if length_m < SHORTEST_PART_M {
        return Err(SmoothingError::TooShort { length_m });
    }
    let reference = points_along(part, parameters.interpolated_delta_s);
    let spacing_m = length_m / (reference.len() - 1) as f64;
    let sharpest = part.arcs.iter().fold(0.0_f64, |most, arc| most.max(arc.curvature.abs()));
    let mut bounds = Bounds::new(reference.len(), parameters.default_bound);
    let clearance_m = parameters.clearance.min(inflation_m / 2.0);
    let mut collision_m = 0.0;
    let max_passes = parameters.max_passes as usize;
    for pass in 1..=max_passes {
        if patience.ends() {
            return Err(SmoothingError::Stopped { passes: pass - 1 });
        }
        let points = AnchoredPoints {
            reference: &reference,
            bounds_m: &bounds.bounds_m,
            spacing_m,
            headings: Some([start.yaw, end.yaw].map(|yaw| Vector2::new(yaw.cos(), yaw.sin()))),
            start_curvature,
            curvature_limit: Some(
                (parameters.curvature_ratio * max_curvature).max(sharpest).min(max_curvature),
            ),
            weights: parameters,
        }
        .solve(patience.watch());
        let path = points.as_ref().and_then(|points| {
            PathProfile::through(points, (*start, start_curvature), *end, part.gear, max_curvature)
        });
        let (Some(points), Some(path)) = (points, path) else {
            return Err(SmoothingError::NoPath { pass });
        };
        let collisions: Vec<usize> = path
            .poses()
            .windows(2)
            .enumerate()
            .filter(|(_, pair)| !motion_is_free(&pair[0], &pair[1], checker, clearance_m))
            .map(|(step, _)| step)
            .collect();
        let Some(first) = collisions.first() else {
            return Ok(SmoothedPart { path, passes: pass });
        };
        collision_m = *first as f64 * path.step_m();
        if !bounds.shrink(&collisions, &reference, &points, parameters.collision_decrease_ratio) {
            return Err(SmoothingError::Colliding { at_m: collision_m, passes: pass });
        }
    }
    Err(SmoothingError::Colliding { at_m: collision_m, passes: max_passes })
}

/// Points evenly along a part, `spacing_m` apart or closer.
fn points_along(part: &GearPart, spacing_m: f64) -> Vec<Point2> {
    let length_m = part.length_m();
    let intervals = (length_m / spacing_m).ceil().max(FEWEST_INTERVALS);
    let mut points = Vec::with_capacity(intervals as usize + 1);
    let mut begin_m = 0.0;
    for (pose, arc) in part.poses.iter().zip(&part.arcs) {
        let end_m = begin_m + arc.length_m.abs();
        loop {
            let at_m = length_m * points.len() as f64 / intervals;
            if at_m >= end_m || points.len() as f64 >= intervals {
                break;
            }
            points.push(arc.at(pose, part.gear.sign() * (at_m - begin_m)).point());
        }
        begin_m = end_m;
    }
    points.extend(part.poses.last().map(PlanarPose::point));
    points
}

/// How far each point may move.
#[derive(Debug)]
struct Bounds {
    bounds_m: Vec<f64>,
    collisions: Vec<usize>,
}

impl Bounds {
    /// `bound_m` for all of `count` points but the ends, which stay where they are.
    fn new(count: usize, bound_m: f64) -> Self {
        let mut bounds_m = vec![bound_m; count];
        bounds_m[0] = 0.0;
        bounds_m[count - 1] = 0.0;
        Self { bounds_m, collisions: vec![0; count] }
    }

    /// Shrinks the bounds about the steps that collide, at first to `ratio` of how far points have moved; false when none is left to shrink.
    fn shrink(&mut self, steps: &[usize], reference: &[Point2], moved: &[Point2], ratio: f64) -> bool {
        let count = self.bounds_m.len();
        let mut touched = vec![false; count];
        for &step in steps {
            // Points that cannot move any more give the blame to points further off.
            let stuck =
                self.collisions[step].max(self.collisions[(step + 1).min(count - 1)]).saturating_sub(1);
            let reach = NEIGHBOURS * (1 + stuck);
            touched[step.saturating_sub(reach)..count.min(step + 2 + reach)].fill(true);
        }
        let mut shrunk = false;
        for k in (0..count).filter(|k| touched[*k]) {
            let bound = if self.collisions[k] == 0 {
                let offset = moved[k] - reference[k];
                ratio * self.bounds_m[k].min(offset.x.abs().max(offset.y.abs()))
            } else {
                0.0
            };
            shrunk |= bound < self.bounds_m[k];
            self.bounds_m[k] = bound;
            self.collisions[k] += 1;
        }
        shrunk
    }
}

#[cfg(test)]
mod tests;
