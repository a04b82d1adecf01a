//! Boxes along the map axes: the cheapest test that two things are apart.

use crate::geometry::Point2;

/// A box along the map axes \[m\]. Starts out empty: an empty box meets nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Smallest x and y.
    pub min: Point2,
    /// Largest x and y.
    pub max: Point2,
}

impl Bounds {
    /// The box around nothing.
    pub const EMPTY: Self = Self {
        min: Point2::new(f64::INFINITY, f64::INFINITY),
        max: Point2::new(f64::NEG_INFINITY, f64::NEG_INFINITY),
    };

    /// The smallest box around all points.
    #[must_use]
    #[inline]
    pub fn around(points: impl IntoIterator<Item = Point2>) -> Self {
        points.into_iter().fold(Self::EMPTY, |all, point| all.joined(&Self { min: point, max: point }))
    }

    /// The box around both.
    ///
    /// A side of `other` that is not a number is passed over.
    #[must_use]
    #[inline]
    pub fn joined(&self, other: &Self) -> Self {
        // Plain comparisons: half the instructions of `f64::min`, which must treat not-a-number on either side.
        let smaller = |a: f64, b: f64| if b < a { b } else { a };
        let larger = |a: f64, b: f64| if b > a { b } else { a };
        Self {
            min: Point2::new(smaller(self.min.x, other.min.x), smaller(self.min.y, other.min.y)),
            max: Point2::new(larger(self.max.x, other.max.x), larger(self.max.y, other.max.y)),
        }
    }

    /// The smallest box around several.
    #[must_use]
    #[inline]
    pub fn around_all(boxes: &[Self]) -> Self {
        boxes.iter().fold(Self::EMPTY, |all, one| all.joined(one))
    }

    /// This box, grown by `by_m` to all sides.
    #[must_use]
    #[inline]
    pub fn grown(&self, by_m: f64) -> Self {
        let by = nalgebra::Vector2::new(by_m, by_m);
        Self { min: self.min - by, max: self.max + by }
    }

    /// True when a point is inside or on the border.
    #[must_use]
    #[inline]
    pub fn holds(&self, point: Point2) -> bool {
        self.meets(&Self { min: point, max: point })
    }

    /// True when the boxes overlap or touch.
    #[must_use]
    #[inline]
    pub fn meets(&self, other: &Self) -> bool {
        // Without short cuts: the four comparisons are cheaper than a branch that is guessed wrong.
        (self.min.x <= other.max.x)
            & (other.min.x <= self.max.x)
            & (self.min.y <= other.max.y)
            & (other.min.y <= self.max.y)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bounds(x: f64, y: f64, size: f64) -> Bounds {
        Bounds { min: Point2::new(x, y), max: Point2::new(x + size, y + size) }
    }

    #[test]
    fn contact_meets_and_nothing_meets_the_empty_box() {
        let a = bounds(0.0, 0.0, 1.0);
        assert!(a.meets(&bounds(1.0, 1.0, 1.0)));
        assert!(!a.meets(&bounds(1.1, 0.0, 1.0)));
        assert!(!a.meets(&bounds(0.0, -1.1, 1.0)));
        assert!(!a.meets(&Bounds::EMPTY) && !Bounds::EMPTY.meets(&a));
        assert!(a.grown(0.2).meets(&bounds(1.1, 0.0, 1.0)));
    }

    #[test]
    fn boxes_join() {
        let boxes = [bounds(0.0, 0.0, 1.0), Bounds::around([Point2::new(6.0, -2.0), Point2::new(5.0, -1.0)])];
        let all = Bounds { min: Point2::new(0.0, -2.0), max: Point2::new(6.0, 1.0) };
        assert_eq!(Bounds::around_all(&boxes), all);
        assert_eq!(Bounds::around_all(&[]), Bounds::EMPTY);
    }
}
