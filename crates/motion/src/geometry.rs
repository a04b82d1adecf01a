//! Plane geometry: points, segments, polygons, boxes, curvature of three points.
//!
//! Lengths in metres. Contact counts as overlap everywhere.

mod axis_aligned_box;
mod oriented_box;
mod polygon;
mod segment;

pub use axis_aligned_box::AxisAlignedBox;
pub use oriented_box::OrientedBox;
pub use polygon::{
    convex_contains, convex_hull, convex_overlap, convex_overlap_within, polygon_contains, signed_area,
};
pub use segment::Segment;

use crate::tolerance::CURVATURE_SIDES_M3;

/// A point of the map plane \[m\].
pub type Point2 = nalgebra::Point2<f64>;
/// A direction or displacement in the map plane.
pub type Vector2 = nalgebra::Vector2<f64>;
/// A point in space \[m\].
pub type Point3 = nalgebra::Point3<f64>;

/// Curvature \[1/m\] of the circle through three points in the order they are driven, positive for a left turn
/// (Menger curvature, `autoware_utils_geometry::calc_curvature`).
///
/// `None` when two of the points (nearly) coincide, which upstream throws for.
#[must_use]
#[inline]
pub fn menger_curvature(p1: Point2, p2: Point2, p3: Point2) -> Option<f64> {
    let (a, b, c) = (p2 - p1, p3 - p2, p3 - p1);
    // One root of the product instead of a product of three roots.
    let sides = (a.norm_squared() * b.norm_squared() * c.norm_squared()).sqrt();
    if sides < CURVATURE_SIDES_M3 {
        return None;
    }
    Some(2.0 * a.perp(&c) / sides)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn curvature_of_known_circles() {
        let quarter = |sign: f64| {
            menger_curvature(Point2::new(2.0, 0.0), Point2::new(0.0, sign * 2.0), Point2::new(-2.0, 0.0))
        };
        assert!((quarter(1.0).unwrap() - 0.5).abs() < 1e-15, "left turn of radius 2");
        assert!((quarter(-1.0).unwrap() + 0.5).abs() < 1e-15, "right turn of radius 2");
        let straight = menger_curvature(Point2::new(0.0, 0.0), Point2::new(1.0, 1.0), Point2::new(3.0, 3.0));
        assert_eq!(straight, Some(0.0));
    }

    #[test]
    fn coincident_points_have_no_curvature() {
        let (p, q) = (Point2::new(1.0, 1.0), Point2::new(2.0, 1.0));
        assert_eq!(menger_curvature(p, p, q), None);
        assert_eq!(menger_curvature(p, q, q), None);
        assert_eq!(menger_curvature(p, q, p), None);
        // sides 4e-4, 4e-4, 8e-4 have product 1.28e-10, just above the threshold; half of that is below it
        let at =
            |s: f64| menger_curvature(Point2::new(0.0, 0.0), Point2::new(s, 0.0), Point2::new(2.0 * s, 0.0));
        assert_eq!(at(4e-4), Some(0.0));
        assert_eq!(at(3e-4), None);
    }

    proptest! {
        #[test]
        fn curvature_is_that_of_the_circle_wherever_it_lies(
            radius in 1.0..500.0_f64, start in -3.0..3.0_f64, step in 0.01..1.0_f64,
            x in -1e4..1e4_f64, y in -1e4..1e4_f64, left in any::<bool>(),
        ) {
            let sign = if left { 1.0 } else { -1.0 };
            let at = |k: f64| {
                let angle = start + sign * k * step;
                Point2::new(x + radius * angle.cos(), y + radius * angle.sin())
            };
            let k = menger_curvature(at(0.0), at(1.0), at(2.0)).unwrap();
            prop_assert!((k - sign / radius).abs() < 1e-5 / radius + 1e-6);
        }
    }
}
