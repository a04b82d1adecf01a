//! Boxes along the map axes: the cheap test before every exact one.

use super::{Point2, Vector2};

/// The part of the map plane between two corners, borders included.
///
/// The empty box holds nothing and overlaps nothing. Not-a-number coordinates do not widen a box, but in the tests
/// they are never apart from anything: the exact test decides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisAlignedBox {
    /// Smallest x and y \[m\].
    pub min: Point2,
    /// Largest x and y \[m\].
    pub max: Point2,
}

impl AxisAlignedBox {
    /// The box around nothing.
    pub const EMPTY: Self = Self {
        min: Point2::new(f64::INFINITY, f64::INFINITY),
        max: Point2::new(f64::NEG_INFINITY, f64::NEG_INFINITY),
    };

    /// The smallest box around all points.
    #[must_use]
    #[inline]
    pub fn around(points: impl IntoIterator<Item = Point2>) -> Self {
        points.into_iter().fold(Self::EMPTY, Self::with)
    }

    /// This box, grown to hold a point.
    #[must_use]
    #[inline]
    pub fn with(self, point: Point2) -> Self {
        // Plain comparisons: half the instructions of `f64::min`, which must treat not-a-number.
        let smaller = |a: f64, b: f64| if b < a { b } else { a };
        let larger = |a: f64, b: f64| if b > a { b } else { a };
        Self {
            min: Point2::new(smaller(self.min.x, point.x), smaller(self.min.y, point.y)),
            max: Point2::new(larger(self.max.x, point.x), larger(self.max.y, point.y)),
        }
    }

    /// This box with its borders moved outwards \[m\].
    #[must_use]
    #[inline]
    pub fn widened(self, margin_m: f64) -> Self {
        let margin = Vector2::new(margin_m, margin_m);
        Self { min: self.min - margin, max: self.max + margin }
    }

    /// True when a point lies in the box or on its border.
    #[must_use]
    #[inline]
    pub fn contains(&self, point: Point2) -> bool {
        let apart =
            point.x < self.min.x || point.x > self.max.x || point.y < self.min.y || point.y > self.max.y;
        !apart
    }

    /// True when two boxes overlap or touch.
    #[must_use]
    #[inline]
    pub fn overlaps(&self, other: &Self) -> bool {
        let apart = other.max.x < self.min.x
            || other.min.x > self.max.x
            || other.max.y < self.min.y
            || other.min.y > self.max.y;
        !apart
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn around(points: &[(f64, f64)]) -> AxisAlignedBox {
        AxisAlignedBox::around(points.iter().map(|&(x, y)| Point2::new(x, y)))
    }

    #[test]
    fn borders_belong_to_the_box() {
        let unit = around(&[(1.0, 0.0), (0.0, 1.0)]);
        assert!(unit.contains(Point2::new(1.0, 1.0)) && unit.contains(Point2::new(0.0, 0.5)));
        assert!(!unit.contains(Point2::new(1.0 + 1e-12, 0.5)));
        assert!(unit.overlaps(&around(&[(1.0, 1.0), (2.0, 2.0)])));
        assert!(!unit.overlaps(&around(&[(1.1, 0.0), (2.0, 1.0)])));
        assert!(unit.widened(0.2).overlaps(&around(&[(1.1, 0.0), (2.0, 1.0)])));
    }

    #[test]
    fn the_box_around_nothing_overlaps_nothing() {
        let everything = around(&[(-1e9, -1e9), (1e9, 1e9)]);
        assert!(!AxisAlignedBox::EMPTY.overlaps(&everything));
        assert!(!AxisAlignedBox::EMPTY.contains(Point2::origin()));
    }

    #[test]
    fn not_a_number_is_left_to_the_exact_test() {
        let nan = Point2::new(f64::NAN, f64::NAN);
        let unit = around(&[(0.0, 0.0), (1.0, 1.0)]);
        assert!(unit.contains(nan) && unit.overlaps(&AxisAlignedBox { min: nan, max: nan }));
        assert_eq!(unit.with(nan), unit);
    }

    proptest! {
        #[test]
        fn a_box_holds_its_points_and_overlaps_what_shares_one(
            points in prop::collection::vec((-9.0..9.0_f64, -9.0..9.0_f64), 1..9),
            others in prop::collection::vec((-9.0..9.0_f64, -9.0..9.0_f64), 1..9),
        ) {
            let a = around(&points);
            prop_assert!(points.iter().all(|&(x, y)| a.contains(Point2::new(x, y))));
            let shared = [&points[..1], &others[..]].concat();
            prop_assert!(a.overlaps(&around(&shared)));
            prop_assert_eq!(a.overlaps(&around(&others)), around(&others).overlaps(&a));
        }
    }
}
