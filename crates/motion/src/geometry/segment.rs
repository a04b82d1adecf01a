//! Straight segments between two points.

use super::{Point2, Vector2};
use crate::tolerance::INTERSECTION;

/// A straight segment; start and end may coincide.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment {
    /// First end \[m\].
    pub start: Point2,
    /// Second end \[m\].
    pub end: Point2,
}

impl Segment {
    /// The segment from `start` to `end`.
    #[must_use]
    #[inline]
    pub fn new(start: Point2, end: Point2) -> Self {
        Self { start, end }
    }

    /// From start to end \[m\].
    #[must_use]
    #[inline]
    pub fn vector(&self) -> Vector2 {
        self.end - self.start
    }

    /// Length \[m\].
    #[must_use]
    #[inline]
    pub fn length(&self) -> f64 {
        self.vector().norm()
    }

    /// Where two segments cross or touch (`autoware_utils_geometry::intersect`).
    ///
    /// Parallel segments never intersect, not even where they overlap, and "parallel" is a determinant below
    /// [`INTERSECTION`] whatever the lengths: two centimetre-long segments at a shallow angle count as such. Either
    /// segment may be missed by [`INTERSECTION`] of its length. Not-a-number passes all tests and comes out as such.
    #[must_use]
    #[inline]
    pub fn intersection(&self, other: &Self) -> Option<Point2> {
        let (p1, p2, p3, p4) = (self.start, self.end, other.start, other.end);
        let det = (p1.x - p2.x) * (p4.y - p3.y) - (p4.x - p3.x) * (p1.y - p2.y);
        if det.abs() < INTERSECTION {
            return None;
        }
        let t = ((p4.y - p3.y) * (p4.x - p2.x) + (p3.x - p4.x) * (p4.y - p2.y)) / det;
        let s = ((p2.y - p1.y) * (p4.x - p2.x) + (p1.x - p2.x) * (p4.y - p2.y)) / det;
        #[expect(clippy::manual_range_contains, reason = "a range would turn not-a-number away")]
        let outside = |u: f64| u < -INTERSECTION || u > 1.0 + INTERSECTION;
        if outside(t) || outside(s) {
            return None;
        }
        Some(Point2::new(t * p1.x + (1.0 - t) * p2.x, t * p1.y + (1.0 - t) * p2.y))
    }

    /// The first point of this segment, walking from its start, that lies on `other` as well.
    ///
    /// Unlike [`intersection`](Self::intersection) nothing is missed: touching ends, collinear overlaps, segments of
    /// any length and single points all count, and there is no slack. Chains of segments are watertight: whoever
    /// passes from one side of a chain to the other meets one of its segments, also where the path has a corner on
    /// the chain or the chain one on the path. Not-a-number passes all tests and comes out as such.
    #[must_use]
    #[inline]
    pub fn first_contact(&self, other: &Self) -> Option<Point2> {
        let one_side = |p: f64, q: f64| (p > 0.0 && q > 0.0) || (p < 0.0 && q < 0.0);
        let (along, across) = (self.vector(), other.vector());
        let other_sides = (along.perp(&(other.start - self.start)), along.perp(&(other.end - self.start)));
        if one_side(other_sides.0, other_sides.1) {
            return None;
        }
        let sides = (across.perp(&(self.start - other.start)), across.perp(&(self.end - other.start)));
        if one_side(sides.0, sides.1) {
            return None;
        }
        if sides.0 == sides.1 || other_sides == (0.0, 0.0) {
            return self.first_collinear_contact(other);
        }
        Some(self.start + along * (sides.0 / (sides.0 - sides.1)))
    }

    /// [`first_contact`](Self::first_contact) of two segments on one line; either may be a point.
    fn first_collinear_contact(&self, other: &Self) -> Option<Point2> {
        let along = self.vector();
        let (to_start, to_end) = (other.start - self.start, other.end - self.start);
        let squared = along.norm_squared();
        if squared == 0.0 {
            return (to_start.dot(&to_end) <= 0.0).then_some(self.start);
        }
        let (s, e) = (along.dot(&to_start) / squared, along.dot(&to_end) / squared);
        let (first, last) = (s.min(e).max(0.0), s.max(e).min(1.0));
        (first <= last).then(|| self.start + along * first)
    }

    /// The point of the segment nearest to `point`.
    #[must_use]
    #[inline]
    pub fn nearest_point(&self, point: Point2) -> Point2 {
        let v = self.vector();
        let along = v.dot(&(point - self.start));
        let squared = v.norm_squared();
        if along <= 0.0 {
            self.start
        } else if along >= squared {
            self.end
        } else {
            self.start + v * (along / squared)
        }
    }

    /// Squared distance of a point from the segment \[m²\].
    #[must_use]
    #[inline]
    pub fn squared_distance_to_point(&self, point: Point2) -> f64 {
        (point - self.nearest_point(point)).norm_squared()
    }

    /// Distance of a point from the segment \[m\].
    #[must_use]
    #[inline]
    pub fn distance_to_point(&self, point: Point2) -> f64 {
        self.squared_distance_to_point(point).sqrt()
    }

    /// Squared distance of two segments \[m²\], exactly 0 where they cross.
    #[must_use]
    #[inline]
    pub fn squared_distance(&self, other: &Self) -> f64 {
        if self.crosses(other) {
            return 0.0;
        }
        self.squared_distance_to_point(other.start)
            .min(self.squared_distance_to_point(other.end))
            .min(other.squared_distance_to_point(self.start))
            .min(other.squared_distance_to_point(self.end))
    }

    /// True where the interiors of both segments cross at an angle.
    #[inline]
    fn crosses(&self, other: &Self) -> bool {
        let separates = |line: &Self, s: &Self| {
            let v = line.vector();
            let (a, b) = (v.perp(&(s.start - line.start)), v.perp(&(s.end - line.start)));
            (a > 0.0 && b < 0.0) || (a < 0.0 && b > 0.0)
        };
        separates(self, other) && separates(other, self)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn segment(x1: f64, y1: f64, x2: f64, y2: f64) -> Segment {
        Segment::new(Point2::new(x1, y1), Point2::new(x2, y2))
    }

    #[test]
    fn intersections() {
        let x_axis = segment(0.0, 0.0, 2.0, 0.0);
        let cases = [
            ("cross", segment(1.0, -1.0, 1.0, 1.0), Some((1.0, 0.0))),
            ("touch inside", segment(1.0, 0.0, 1.0, 1.0), Some((1.0, 0.0))),
            ("touch ends", segment(2.0, 0.0, 3.0, 1.0), Some((2.0, 0.0))),
            ("short of it", segment(1.0, 1e-8, 1.0, 1.0), None),
            ("within the slack", segment(1.0, 1e-10, 1.0, 1.0), Some((1.0, 0.0))),
            ("beside", segment(2.1, -1.0, 2.1, 1.0), None),
            ("collinear overlap", segment(1.0, 0.0, 3.0, 0.0), None),
            ("parallel", segment(0.0, 1.0, 2.0, 1.0), None),
            ("point", segment(1.0, 0.0, 1.0, 0.0), None),
            ("tiny", segment(1.0, -1e-10, 1.0, 1e-10), None),
        ];
        for (name, other, expected) in cases {
            for (a, b) in [(&x_axis, &other), (&other, &x_axis)] {
                match (a.intersection(b), expected) {
                    (Some(p), Some((x, y))) => {
                        assert!((p - Point2::new(x, y)).norm() < 1e-9, "{name}: {p}");
                    }
                    (actual, expected) => assert_eq!(actual.is_some(), expected.is_some(), "{name}"),
                }
            }
        }
        let bad = segment(f64::NAN, 0.0, 1.0, 0.0);
        assert!(x_axis.intersection(&bad).is_some_and(|p| p.x.is_nan()));
    }

    #[test]
    fn first_contacts() {
        let x_axis = segment(0.0, 0.0, 2.0, 0.0);
        let cases = [
            ("cross", segment(1.0, -1.0, 1.0, 1.0), Some(1.0)),
            ("touch inside", segment(1.0, 0.0, 1.0, 1.0), Some(1.0)),
            ("touch its end", segment(2.0, 0.0, 3.0, 1.0), Some(2.0)),
            ("touch its start", segment(-1.0, 1.0, 0.0, 0.0), Some(0.0)),
            ("short of it", segment(1.0, 1e-12, 1.0, 1.0), None),
            ("beside", segment(2.1, -1.0, 2.1, 1.0), None),
            ("parallel", segment(0.0, 1.0, 2.0, 1.0), None),
            ("overlap from inside", segment(1.0, 0.0, 3.0, 0.0), Some(1.0)),
            ("overlap from inside, turned", segment(3.0, 0.0, 1.0, 0.0), Some(1.0)),
            ("overlap from before", segment(-1.0, 0.0, 3.0, 0.0), Some(0.0)),
            ("in line, touching", segment(2.0, 0.0, 3.0, 0.0), Some(2.0)),
            ("in line, apart", segment(2.5, 0.0, 3.0, 0.0), None),
            ("in line, before", segment(-2.0, 0.0, -1.0, 0.0), None),
            ("point on it", segment(1.5, 0.0, 1.5, 0.0), Some(1.5)),
            ("point in its line", segment(2.5, 0.0, 2.5, 0.0), None),
            ("point beside", segment(1.0, 0.1, 1.0, 0.1), None),
            ("tiny", segment(1.0, -1e-10, 1.0, 1e-10), Some(1.0)),
        ];
        for (name, other, expected) in cases {
            let contact = x_axis.first_contact(&other);
            assert_eq!(contact, expected.map(|x| Point2::new(x, 0.0)), "{name}");
            assert_eq!(other.first_contact(&x_axis).is_some(), expected.is_some(), "{name}, the other way");
        }
        let point = segment(1.0, 1.0, 1.0, 1.0);
        assert!(point.first_contact(&point).is_some());
        assert!(point.first_contact(&segment(1.0, 1.1, 1.0, 1.1)).is_none());
        let bad = segment(f64::NAN, 0.0, 1.0, 0.0);
        assert!(x_axis.first_contact(&bad).is_some_and(|p| p.x.is_nan()));
    }

    #[test]
    fn distances_to_points() {
        let s = segment(0.0, 0.0, 1.0, 0.0);
        assert_eq!(s.distance_to_point(Point2::new(0.5, 1.0)), 1.0);
        assert_eq!(s.distance_to_point(Point2::new(4.0, 4.0)), 5.0);
        assert_eq!(s.distance_to_point(Point2::new(-3.0, -4.0)), 5.0);
        assert_eq!(segment(1.0, 1.0, 1.0, 1.0).distance_to_point(Point2::new(4.0, 5.0)), 5.0);
    }

    #[test]
    fn distances_of_segments() {
        let cases = [
            (segment(0.0, 0.0, 0.0, 2.0), segment(1.0, 0.0, 1.0, 2.0), 1.0),
            (segment(0.0, 0.0, 1.0, 2.0), segment(1.0, 0.0, 1.0, 2.0), 0.0),
            (segment(0.0, 0.0, 1.0, 0.0), segment(3.0, 2.0, 4.0, 2.0), 8.0),
            (segment(0.0, 0.0, 1.0, 0.0), segment(2.0, 0.0, 3.0, 0.0), 1.0),
            (segment(0.0, 0.0, 3.0, 0.0), segment(2.0, 0.0, 5.0, 0.0), 0.0),
            (segment(0.0, 0.0, 1.1, 1.3), segment(0.1, 1.0, 0.9, 0.2), 0.0),
        ];
        for (a, b, expected) in cases {
            assert_eq!(a.squared_distance(&b), expected, "{a:?} {b:?}");
            assert_eq!(b.squared_distance(&a), expected, "{b:?} {a:?}");
        }
        // which side of the vehicle a border is closer to; a tie belongs to both
        let (left, right) = (segment(2.0, 2.0, 0.0, 2.0), segment(2.0, -2.0, 0.0, -2.0));
        for (y, left_first, right_first) in [(3.0, true, false), (-3.0, false, true), (0.0, true, true)] {
            let border = segment(0.0, y, 2.0, y);
            let (l, r) = (border.squared_distance(&left), border.squared_distance(&right));
            assert_eq!((l <= r, r <= l), (left_first, right_first));
        }
    }

    prop_compose! {
        fn any_segment()(a in -5.0..5.0_f64, b in -5.0..5.0_f64, c in -5.0..5.0_f64, d in -5.0..5.0_f64) -> Segment {
            segment(a, b, c, d)
        }
    }

    proptest! {
        #[test]
        fn squared_distance_is_that_of_dense_samples(a in any_segment(), b in any_segment()) {
            let n = 400;
            let sampled = (0..=n)
                .map(|k| b.squared_distance_to_point(a.start + a.vector() * (f64::from(k) / f64::from(n))))
                .fold(f64::INFINITY, f64::min)
                .sqrt();
            let exact = a.squared_distance(&b).sqrt();
            prop_assert!(exact <= sampled + 1e-9);
            prop_assert!(sampled <= exact + 0.5 * a.length() / f64::from(n) + 1e-9);
            prop_assert_eq!(a.squared_distance(&b), b.squared_distance(&a));
        }

        #[test]
        fn a_contact_is_the_first_common_point(a in any_segment(), b in any_segment()) {
            let contact = a.first_contact(&b);
            prop_assert_eq!(contact.is_some(), b.first_contact(&a).is_some());
            if let Some(p) = contact {
                prop_assert!(a.distance_to_point(p) < 1e-9 && b.distance_to_point(p) < 1e-9 * (1.0 + 1.0 / a.length().min(b.length())));
            } else {
                prop_assert!(a.squared_distance(&b) > 0.0);
            }
        }

        /// A path with a corner exactly on a line, and a line with a corner exactly on a path.
        #[test]
        fn corners_leave_no_gap(
            x in -1e5..1e5_f64, y in -1e5..1e5_f64, yaw in -3.0..3.0_f64, bend in -1.0..1.0_f64, at in 0.1..0.9_f64,
        ) {
            let ray = |angle: f64, r: f64| Vector2::new(r * angle.cos(), r * angle.sin());
            let place = Point2::new(x, y);
            let line = Segment::new(place - ray(yaw, 4.0), place + ray(yaw, 4.0));
            let corner = line.start + line.vector() * at;
            let (before, after) = (corner - ray(yaw + 1.5, 1.0), corner + ray(yaw + 1.5 + bend, 1.0));
            let path = [Segment::new(before, corner), Segment::new(corner, after)];
            prop_assert!(path.iter().any(|piece| piece.first_contact(&line).is_some()));
            prop_assert!(path.iter().any(|piece| line.first_contact(piece).is_some()));
        }

        #[test]
        fn intersecting_segments_share_the_point(a in any_segment(), b in any_segment()) {
            if let Some(p) = a.intersection(&b) {
                prop_assert!(a.distance_to_point(p) < 1e-6 && b.distance_to_point(p) < 1e-6);
            } else {
                prop_assert!(a.squared_distance(&b) > 0.0 || a.vector().perp(&b.vector()).abs() < 1e-6);
            }
        }
    }
}
