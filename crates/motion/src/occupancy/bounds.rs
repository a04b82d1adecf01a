//! Boxes along the map axes: the cheapest test that two things are apart.

use crate::geometry::Point2;
use wide::f64x2;

/// A box along the map axes \[m\]. Starts out empty: an empty box meets nothing.
// Laid out so that a corner is read at once.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(16))]
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
        if cfg!(target_arch = "x86_64") {
            // Here the first one of two is given only if it is smaller, or larger: not if one of them is no number.
            return Self {
                min: point(pair(other.min).fast_min(pair(self.min))),
                max: point(pair(other.max).fast_max(pair(self.max))),
            };
        }
        self.joined_plainly(other)
    }

    /// The same on any processor.
    #[inline]
    fn joined_plainly(&self, other: &Self) -> Self {
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

    /// True when a gap is between the boxes; not if a number is none.
    #[must_use]
    #[inline]
    pub fn is_apart_from(&self, other: &Self) -> bool {
        (self.min.x > other.max.x)
            | (other.min.x > self.max.x)
            | (self.min.y > other.max.y)
            | (other.min.y > self.max.y)
    }

    /// True when another box lies inside or on the border.
    #[must_use]
    #[inline]
    pub fn contains(&self, other: &Self) -> bool {
        (self.min.x <= other.min.x)
            & (other.max.x <= self.max.x)
            & (self.min.y <= other.min.y)
            & (other.max.y <= self.max.y)
    }

    /// True when the boxes overlap or touch.
    #[must_use]
    #[inline]
    pub fn meets(&self, other: &Self) -> bool {
        // Both coordinates at once, and no short cuts: the comparisons are cheaper than a branch that is guessed wrong.
        let begins = pair(self.min).simd_le(pair(other.max));
        let ends = pair(other.min).simd_le(pair(self.max));
        (begins & ends).to_bitmask() == 0b11
    }

    /// Square of the distance from a point to the box \[m²\], 0 inside. All numbers are some.
    #[must_use]
    #[inline]
    pub fn squared_distance_to(&self, point: Point2) -> f64 {
        let point = pair(point);
        let way = (pair(self.min) - point).fast_max(point - pair(self.max)).fast_max(f64x2::ZERO);
        let [x, y] = (way * way).to_array();
        x + y
    }
}

#[inline]
fn pair(point: Point2) -> f64x2 {
    f64x2::new([point.x, point.y])
}

#[inline]
fn point(pair: f64x2) -> Point2 {
    let [x, y] = pair.to_array();
    Point2::new(x, y)
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
        let unknown = Bounds { min: Point2::new(f64::NAN, 9.0), max: Point2::new(f64::NAN, 0.5) };
        for other in [bounds(1.0, 1.0, 1.0), bounds(1.1, 0.0, 1.0), bounds(0.0, -1.1, 1.0), Bounds::EMPTY] {
            assert_ne!(a.meets(&other), a.is_apart_from(&other));
        }
        assert!(!a.meets(&unknown) && a.is_apart_from(&unknown));
        assert!(!a.is_apart_from(&Bounds { min: Point2::new(f64::NAN, 0.0), ..a }));
        assert!(a.contains(&a) && a.grown(0.1).contains(&a) && !a.contains(&a.grown(0.1)));
        assert!(!a.contains(&bounds(0.5, 0.0, 1.0)) && !a.contains(&bounds(0.0, 0.5, 1.0)));
        assert!(a.grown(0.2).meets(&bounds(1.1, 0.0, 1.0)));
    }

    /// Both coordinates at once or one by one: the same, whatever the numbers are.
    #[test]
    fn boxes_of_any_numbers_meet_if_their_sides_do() {
        let numbers = [0.0, -0.0, 1.0, -2.5, 1e300, f64::INFINITY, f64::NEG_INFINITY, f64::NAN];
        let points: Vec<Point2> =
            numbers.iter().flat_map(|&x| numbers.iter().map(move |&y| Point2::new(x, y))).collect();
        for (at, &min) in points.iter().enumerate() {
            for (other_at, &max) in points.iter().enumerate() {
                let a = Bounds { min, max };
                let b = Bounds { min: points[other_at / 2], max: points[at / 3] };
                let meets =
                    a.min.x <= b.max.x && b.min.x <= a.max.x && a.min.y <= b.max.y && b.min.y <= a.max.y;
                assert_eq!(a.meets(&b), meets, "{a:?} {b:?}");
                let bits = |all: Bounds| {
                    [all.min.x, all.min.y, all.max.x, all.max.y]
                        .map(|side| if side.is_nan() { u64::MAX } else { side.to_bits() })
                };
                assert_eq!(bits(a.joined(&b)), bits(a.joined_plainly(&b)), "{a:?} {b:?}");
            }
        }
    }

    #[test]
    fn distances_to_a_box() {
        let a = bounds(0.0, 0.0, 2.0);
        for (x, y, squared) in [(1.0, 1.0, 0.0), (2.0, 0.0, 0.0), (5.0, 1.0, 9.0), (-3.0, 6.0, 25.0)] {
            assert_eq!(a.squared_distance_to(Point2::new(x, y)), squared);
        }
        assert_eq!(Bounds::EMPTY.squared_distance_to(Point2::origin()), f64::INFINITY);
    }

    #[test]
    fn boxes_join() {
        let boxes = [bounds(0.0, 0.0, 1.0), Bounds::around([Point2::new(6.0, -2.0), Point2::new(5.0, -1.0)])];
        let all = Bounds { min: Point2::new(0.0, -2.0), max: Point2::new(6.0, 1.0) };
        assert_eq!(Bounds::around_all(&boxes), all);
        assert_eq!(Bounds::around_all(&[]), Bounds::EMPTY);
    }
}
