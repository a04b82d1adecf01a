//! The outline of a body in its own frame, and where that frame lies in the plane.

use super::bounds::Bounds;
use crate::geometry::{OrientedBox, Point2, Vector2, convex_hull};
use crate::pose::Pose;

/// Above this cosine (angles below 0.064 rad) two headings are interpolated along the chord: less than 5e-6 rad off.
const CHORD_COSINE: f64 = 0.998;

/// Position and direction in the map plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlanarPose {
    /// Origin of the body's frame \[m\].
    pub position: Point2,
    /// Unit vector of the body's x axis.
    pub heading: Vector2,
}

impl From<&Pose> for PlanarPose {
    /// Position and yaw of a pose in space.
    #[inline]
    fn from(pose: &Pose) -> Self {
        Self { position: pose.point(), heading: pose.heading() }
    }
}

impl PlanarPose {
    /// From a position \[m\] and a yaw \[rad\].
    #[must_use]
    pub fn new(x: f64, y: f64, yaw_rad: f64) -> Self {
        let (sin, cos) = yaw_rad.sin_cos();
        Self { position: Point2::new(x, y), heading: Vector2::new(cos, sin) }
    }

    /// A point of the body's frame in the map plane \[m\].
    #[must_use]
    #[inline]
    pub fn apply(&self, local: Point2) -> Point2 {
        let h = self.heading;
        Point2::new(
            self.position.x + h.x * local.x - h.y * local.y,
            self.position.y + h.y * local.x + h.x * local.y,
        )
    }

    /// The pose at a ratio of the way to `other`: position linear, yaw along the shorter arc. Not clamped.
    #[must_use]
    #[inline]
    pub fn between(&self, other: &Self, ratio: f64) -> Self {
        let position = self.position + (other.position - self.position) * ratio;
        let cos = self.heading.dot(&other.heading);
        let heading = if cos > CHORD_COSINE {
            (self.heading + (other.heading - self.heading) * ratio).normalize()
        } else {
            let turn = self.heading.perp(&other.heading).atan2(cos) * ratio;
            let (sin, cos) = turn.sin_cos();
            let h = self.heading;
            Vector2::new(h.x * cos - h.y * sin, h.x * sin + h.y * cos)
        };
        Self { position, heading }
    }

    /// This pose, `distance_m` further along its own heading.
    #[must_use]
    #[inline]
    pub fn ahead(&self, distance_m: f64) -> Self {
        Self { position: self.position + self.heading * distance_m, heading: self.heading }
    }

    /// True if all numbers are equal: `==`, in few instructions.
    #[must_use]
    #[inline]
    pub fn is_same(&self, other: &Self) -> bool {
        let numbers = |pose: &Self| [pose.position.x, pose.position.y, pose.heading.x, pose.heading.y];
        numbers(self) == numbers(other)
    }

    /// Unsigned angle to the heading of another pose \[rad\].
    #[must_use]
    pub fn turn_to(&self, other: &Self) -> f64 {
        self.heading.perp(&other.heading).atan2(self.heading.dot(&other.heading)).abs()
    }
}

/// A convex outline in the frame of a body.
#[derive(Clone, Debug, PartialEq)]
pub struct Outline {
    corners: Vec<Point2>,
    center: Point2,
    half: Vector2,
    radius_m: f64,
    is_rectangle: bool,
}

impl Outline {
    /// A rectangle: distances from the origin to its sides \[m\].
    #[must_use]
    pub fn rectangle(front_m: f64, rear_m: f64, left_m: f64, right_m: f64) -> Self {
        let at = Point2::new;
        let corners =
            vec![at(front_m, left_m), at(front_m, -right_m), at(-rear_m, -right_m), at(-rear_m, left_m)];
        Self { is_rectangle: true, ..Self::of(corners) }
    }

    /// The convex hull of any points. No points are the origin itself: a body without extent still is somewhere.
    #[must_use]
    pub fn hull_of(points: &[Point2]) -> Self {
        let mut sorted = points.to_vec();
        let mut hull = Vec::with_capacity(points.len());
        convex_hull(&mut sorted, &mut hull);
        Self::of(hull)
    }

    fn of(mut corners: Vec<Point2>) -> Self {
        if corners.is_empty() {
            corners.push(Point2::origin());
        }
        let none = Bounds::EMPTY;
        let (min, max) = corners.iter().fold((none.min, none.max), |(min, max), c| (min.inf(c), max.sup(c)));
        let radius_m = corners.iter().map(|corner| corner.coords.norm()).fold(0.0, f64::max);
        let (center, half) = (min + (max - min) * 0.5, (max - min) * 0.5);
        Self { corners, center, half, radius_m, is_rectangle: false }
    }

    /// Corners in the body's frame \[m\].
    #[must_use]
    pub fn corners(&self) -> &[Point2] {
        &self.corners
    }

    /// True if these are the corners.
    #[must_use]
    #[inline]
    pub(super) fn has_corners(&self, corners: &[Point2]) -> bool {
        let pairs = self.corners.iter().zip(corners);
        self.corners.len() == corners.len()
            && pairs.fold(true, |same, (a, b)| same & (a.x == b.x) & (a.y == b.y))
    }

    /// True if this is a rectangle, and another outline lies in it or on its border.
    #[must_use]
    pub fn holds(&self, other: &Self) -> bool {
        let (min, max) = (self.center - self.half, self.center + self.half);
        let bounds = Bounds { min, max };
        self.is_rectangle && (self == other || other.corners.iter().all(|&corner| bounds.holds(corner)))
    }

    /// True if the outline is the box around it.
    #[must_use]
    #[inline]
    pub(super) fn is_rectangle(&self) -> bool {
        self.is_rectangle
    }

    /// Largest distance of a corner from the origin of the body's frame \[m\].
    #[must_use]
    #[inline]
    pub fn radius_m(&self) -> f64 {
        self.radius_m
    }

    /// The rectangle around the outline, placed in the map plane; the outline itself if that is a rectangle.
    #[must_use]
    #[inline]
    pub fn box_at(&self, pose: &PlanarPose) -> OrientedBox {
        OrientedBox {
            center: self.center_at(pose),
            axis: pose.heading,
            half_length_m: self.half.x,
            half_width_m: self.half.y,
        }
    }

    /// The box along the map axes around the placed outline.
    #[must_use]
    #[inline]
    pub fn bounds_at(&self, pose: &PlanarPose) -> Bounds {
        let center = self.center_at(pose);
        let half = self.reach_along(pose.heading);
        Bounds { min: center - half, max: center + half }
    }

    /// The box along an axis (unit vector) around the placed outline, in coordinates of that axis: along, across.
    #[must_use]
    #[inline]
    pub(super) fn bounds_along(&self, pose: &PlanarPose, axis: Vector2) -> Bounds {
        let center = self.center_at(pose).coords;
        let center = Point2::new(axis.dot(&center), axis.perp(&center));
        let half = self.reach_along(Vector2::new(axis.dot(&pose.heading), axis.perp(&pose.heading)));
        Bounds { min: center - half, max: center + half }
    }

    /// The middle of the rectangle around the placed outline.
    #[must_use]
    #[inline]
    pub(super) fn center_at(&self, pose: &PlanarPose) -> Point2 {
        pose.apply(self.center)
    }

    /// Half extents along two axes of the rectangle turned by `heading` against them.
    #[must_use]
    #[inline]
    pub(super) fn reach_along(&self, heading: Vector2) -> Vector2 {
        let (cos, sin) = (heading.x.abs(), heading.y.abs());
        Vector2::new(self.half.x * cos + self.half.y * sin, self.half.x * sin + self.half.y * cos)
    }

    /// Adds the placed corners to `points`.
    pub fn place(&self, pose: &PlanarPose, points: &mut Vec<Point2>) {
        points.extend(self.corners.iter().map(|&corner| pose.apply(corner)));
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn a_rectangle_has_the_corners_of_the_box_around_its_pose() {
        let pose = Pose::from_xy_yaw(3.0, -1.0, 0.7);
        let outline = Outline::rectangle(4.7, 1.5, 1.3, 1.2);
        let mut corners = Vec::new();
        outline.place(&PlanarPose::from(&pose), &mut corners);
        let expected = OrientedBox::around(&pose, 4.7, 1.5, 1.3, 1.2);
        for (corner, expected) in corners.iter().zip(expected.corners()) {
            assert!((corner - expected).norm() < 1e-12);
        }
        let placed = outline.box_at(&PlanarPose::from(&pose));
        assert!((placed.center - expected.center).norm() < 1e-12);
        assert_eq!((placed.half_length_m, placed.half_width_m), (3.1, 1.25));
        assert!((outline.radius_m() - 4.7_f64.hypot(1.3)).abs() < 1e-12);
    }

    #[test]
    fn a_body_without_extent_is_at_its_origin() {
        let nothing = Outline::hull_of(&[]);
        let bounds = nothing.bounds_at(&PlanarPose::new(2.0, 3.0, 1.0));
        assert_eq!((bounds.min, bounds.max), (Point2::new(2.0, 3.0), Point2::new(2.0, 3.0)));
    }

    proptest! {
        #[test]
        fn bounds_hold_every_corner(
            x in -1e3..1e3_f64, y in -1e3..1e3_f64, yaw in -4.0..4.0_f64, axis in -4.0..4.0_f64,
            points in proptest::collection::vec((-5.0..5.0_f64, -5.0..5.0_f64), 1..9),
        ) {
            let points: Vec<Point2> = points.into_iter().map(|(x, y)| Point2::new(x, y)).collect();
            let outline = Outline::hull_of(&points);
            let pose = PlanarPose::new(x, y, yaw);
            let axis = Vector2::new(axis.cos(), axis.sin());
            let (bounds, along) = (outline.bounds_at(&pose).grown(1e-9), outline.bounds_along(&pose, axis).grown(1e-9));
            for point in points {
                let p = pose.apply(point);
                prop_assert!(bounds.holds(p));
                let q = Point2::new(axis.dot(&p.coords), axis.perp(&p.coords));
                prop_assert!(along.holds(q));
            }
        }

        #[test]
        fn yaw_turns_evenly(yaw in -3.0..3.0_f64, turn in -3.0..3.0_f64, ratio in 0.0..1.0_f64) {
            let (a, b) = (PlanarPose::new(0.0, 0.0, yaw), PlanarPose::new(1.0, 2.0, yaw + turn));
            let c = a.between(&b, ratio);
            let expected = PlanarPose::new(ratio, 2.0 * ratio, yaw + turn * ratio);
            prop_assert!((c.heading - expected.heading).norm() < 5e-6);
            prop_assert!((c.position - expected.position).norm() < 1e-12);
        }
    }
}
