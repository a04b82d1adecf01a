//! Does the vehicle touch anything: exact footprint against polylines, at one pose or swept between two.
//!
//! The footprint is the vehicle's rectangle, not necessarily symmetric about its axis. "Free with inflation r" means
//! that every obstacle is more than `r` away from it, so inflated corners are round. Touching is a collision, a vehicle
//! inside a solid polygon is one, and so is a reference point outside the bounds or a pose that is not finite.
//!
//! A [`CollisionChecker`] is made once for a problem. Most questions are answered by a distance field that never
//! overstates the room there is; the others by exact geometry with the few obstacle segments nearby.

mod field;
mod shape;

use motion::{Point2, VehicleInfo};
use thiserror::Error;

use crate::interruption::Patience;
use crate::pose::PlanarPose;
use crate::problem::Problem;
use crate::tolerance::{BORDER_M, MAX_COORDINATE_M, SWEEP_BULGE_M, TOUCH_M};
use field::ObstacleField;
pub(crate) use shape::{Placement, Shape};

/// Why bounds or obstacles were refused.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum ObstacleError {
    /// Not four numbers in order, or beyond [`MAX_COORDINATE_M`].
    #[error(
        "bounds are {bounds:?}, but must be x_min < x_max, y_min < y_max, all within {MAX_COORDINATE_M} m of the origin; correct the region of interest"
    )]
    Bounds {
        /// As given: x_min, x_max, y_min, y_max.
        bounds: [f64; 4],
    },
    /// A vertex that is not finite, or beyond [`MAX_COORDINATE_M`].
    #[error(
        "vertex {vertex} of obstacle {obstacle} is ({x}, {y}), but must be finite and within {MAX_COORDINATE_M} m of the origin; correct the obstacle"
    )]
    Vertex {
        /// Index of the polyline.
        obstacle: usize,
        /// Index of the vertex in it.
        vertex: usize,
        /// As given.
        x: f64,
        /// As given.
        y: f64,
    },
    /// More segments than a planner can look at in time.
    #[error("obstacles have {segments} segments, but at most {limit} are allowed; simplify or crop them")]
    TooMany {
        /// In all polylines together.
        segments: usize,
        /// Largest number allowed.
        limit: usize,
    },
}

/// Corners of the footprint relative to the reference point, from the vehicle's dimensions, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rectangle {
    /// x of the front end, positive.
    pub front_m: f64,
    /// x of the rear end, zero or negative.
    pub rear_m: f64,
    /// y of the left side, positive.
    pub left_m: f64,
    /// y of the right side, negative.
    pub right_m: f64,
}

impl Rectangle {
    /// The footprint of `vehicle`.
    #[must_use]
    pub fn of(vehicle: &VehicleInfo) -> Self {
        Self {
            front_m: vehicle.max_longitudinal_offset_m(),
            rear_m: vehicle.min_longitudinal_offset_m(),
            left_m: vehicle.max_lateral_offset_m(),
            right_m: vehicle.min_lateral_offset_m(),
        }
    }

    /// Counter-clockwise, beginning at the rear right.
    pub(crate) fn corners(&self) -> [Point2; 4] {
        [
            Point2::new(self.rear_m, self.right_m),
            Point2::new(self.front_m, self.right_m),
            Point2::new(self.front_m, self.left_m),
            Point2::new(self.rear_m, self.left_m),
        ]
    }
}

/// Answers whether a vehicle fits among the obstacles of a problem.
#[derive(Clone, Debug)]
pub struct CollisionChecker {
    rectangle: Rectangle,
    footprint: Shape,
    bounds: [f64; 4],
    field: ObstacleField,
}

impl CollisionChecker {
    /// Prepares the bounds and obstacles of `problem` for its vehicle.
    ///
    /// # Errors
    /// Bounds or vertices that are not finite or absurdly far away, bounds without area, too many obstacles.
    pub fn new(problem: &Problem) -> Result<Self, ObstacleError> {
        Self::while_wanted(problem, &mut || false)
    }

    /// The same, for a caller who may lose patience: from then on, where it has not looked there is no room.
    pub(crate) fn while_wanted(
        problem: &Problem,
        patience: &mut dyn Patience,
    ) -> Result<Self, ObstacleError> {
        let bounds = problem.bounds;
        let [x_min, x_max, y_min, y_max] = bounds;
        if !(bounds.iter().all(|b| b.abs() <= MAX_COORDINATE_M) && x_min < x_max && y_min < y_max) {
            return Err(ObstacleError::Bounds { bounds });
        }
        let rectangle = Rectangle::of(&problem.vehicle);
        let footprint = Shape::hull(&rectangle.corners(), 0.0);
        // The middle of the footprint, about which obstacles are looked up, can be this far out of bounds.
        let margin_m = footprint.center().coords.norm();
        let field = ObstacleField::new(bounds, margin_m, footprint.radius_m(), &problem.obstacles, patience)?;
        Ok(Self { rectangle, footprint, bounds, field })
    }

    /// The footprint.
    #[must_use]
    pub fn rectangle(&self) -> Rectangle {
        self.rectangle
    }

    /// x_min, x_max, y_min, y_max of the reference point, m.
    #[must_use]
    pub fn bounds(&self) -> [f64; 4] {
        self.bounds
    }

    /// Whether the pose is finite and its reference point within the bounds; on the border is within.
    #[must_use]
    #[inline]
    pub fn is_within_bounds(&self, pose: &PlanarPose) -> bool {
        self.holds(pose.point()) && pose.yaw.is_finite()
    }

    /// Whether a reference point is within the bounds.
    #[inline]
    pub(crate) fn holds(&self, point: Point2) -> bool {
        let [x_min, x_max, y_min, y_max] = self.bounds;
        let is_within = |at: f64, low: f64, high: f64| at >= low - BORDER_M && at <= high + BORDER_M;
        // Written so that not-a-number fails.
        is_within(point.x, x_min, x_max) && is_within(point.y, y_min, y_max)
    }

    /// Whether the vehicle can stand at `pose`: within bounds, and every obstacle further than `inflation_m` away.
    #[must_use]
    pub fn is_free(&self, pose: &PlanarPose, inflation_m: f64) -> bool {
        self.is_within_bounds(pose) && self.shape_is_free(&Placement::new(pose), &self.footprint, inflation_m)
    }

    /// Smallest distance from the footprint to an obstacle, m: 0 when they touch, overlap or the pose is not finite,
    /// infinite without obstacles. Bounds do not count.
    #[must_use]
    pub fn clearance_m(&self, pose: &PlanarPose) -> f64 {
        if !pose.is_finite() {
            return 0.0;
        }
        let place = Placement::new(pose);
        let center = place.to_world(self.footprint.center());
        if self.field.is_solid(center) {
            return 0.0;
        }
        let nearest = |ids: &[u32]| {
            ids.iter().fold(f64::INFINITY, |best, &id| {
                self.footprint.distance_below(&place.segment_to_local(self.field.segment(id)), best)
            })
        };
        let reach = self.field.reach_m() - self.footprint.radius_m();
        let near = nearest(self.field.near(center, self.field.reach_m()));
        if near <= reach { near } else { nearest(self.field.all()) }
    }

    /// Whether the vehicle can move from one pose to the other along the screw motion that joins them, the shorter
    /// way round: within bounds (at its ends and the cuts), and every obstacle further than `inflation_m` from the area swept.
    ///
    /// Errs to the safe side only: by [`SWEEP_BULGE_M`], and because the hull of both ends stands for the way between
    /// them, by half of how far a corner goes in a piece that bulges no more than that, some centimetres where it turns.
    /// For samples of a smooth path the screw motion is the path but for a term of third order in their distance.
    #[must_use]
    pub fn motion_is_free(&self, from: &PlanarPose, to: &PlanarPose, inflation_m: f64) -> bool {
        if !(self.is_within_bounds(from) && self.is_within_bounds(to)) {
            return false;
        }
        let place = Placement::new(from);
        let end = place.to_local(to.point());
        let turn = from.yaw_to(to);
        let sweep = Shape::sweep(&self.rectangle, &PlanarPose::new(end.x, end.y, turn));
        if sweep.bulge_m() <= SWEEP_BULGE_M {
            return self.shape_is_free(&place, &sweep, inflation_m);
        }
        // Half the turn about the same centre: the chord is that much longer than half of the whole one.
        let quarter = turn / 4.0;
        let half = end.coords / (2.0 * quarter.cos());
        let (sin, cos) = (-quarter).sin_cos();
        let middle = place.to_world(Point2::new(cos * half.x - sin * half.y, sin * half.x + cos * half.y));
        let middle = PlanarPose::new(middle.x, middle.y, from.yaw + turn / 2.0);
        self.motion_is_free(from, &middle, inflation_m) && self.motion_is_free(&middle, to, inflation_m)
    }

    /// Whether `shape`, placed at a pose within bounds, has every obstacle further than `inflation_m` away.
    pub(crate) fn shape_is_free(&self, place: &Placement, shape: &Shape, inflation_m: f64) -> bool {
        let reach = inflation_m + shape.bulge_m() + TOUCH_M;
        if shape
            .discs()
            .iter()
            .all(|disc| self.field.room_m(place.to_world(disc.center)) > disc.radius_m + reach)
        {
            return true;
        }
        let center = place.to_world(shape.center());
        !self.field.is_solid(center)
            && self
                .field
                .near(center, shape.radius_m() + reach)
                .iter()
                .all(|&id| shape.is_clear_of(&place.segment_to_local(self.field.segment(id)), reach))
    }

    /// Whether `point` is at least `radius_m` away from every obstacle and in none.
    #[must_use]
    pub fn has_room(&self, point: Point2, radius_m: f64) -> bool {
        self.field.room_m(point) >= radius_m
            || (!self.field.is_solid(point)
                && self.field.near(point, radius_m).iter().all(|&id| {
                    self.field.segment(id).squared_distance_to_point(point) >= radius_m * radius_m
                }))
    }

    /// Distance from `point` to the nearest obstacle, or less, m; 0 within solids. Understates by a few centimetres
    /// near obstacles and by any amount beyond some metres.
    #[must_use]
    pub fn room_m(&self, point: Point2) -> f64 {
        self.field.room_m(point)
    }
}

#[cfg(test)]
mod tests;
