//! A box around places, and lower bounds of distances from it.

use motion::{Point2, Segment, Vector2};

/// The smaller of two numbers; `f64::min` also has to think of not-a-number.
#[inline]
pub(super) fn smaller(a: f64, b: f64) -> f64 {
    if b < a { b } else { a }
}

/// The larger of two numbers.
#[inline]
pub(super) fn larger(a: f64, b: f64) -> f64 {
    if b > a { b } else { a }
}

/// A box along an axis. Local coordinates are along and across that axis, from an origin in the box.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bounds {
    origin: Point2,
    axis: Vector2,
    low: Vector2,
    high: Vector2,
}

impl Bounds {
    /// Only the origin, with an axis along `forward`. Any axis will do if that has no length.
    #[inline]
    pub(super) fn at(origin: Point2, forward: Vector2) -> Self {
        let length = forward.norm();
        let axis = if length > 0.0 { forward / length } else { Vector2::new(1.0, 0.0) };
        Self { origin, axis, low: Vector2::zeros(), high: Vector2::zeros() }
    }

    /// Grows to hold a place.
    #[inline]
    pub(super) fn include(&mut self, place: Point2) {
        let local = self.local(place);
        self.low = Vector2::new(smaller(self.low.x, local.x), smaller(self.low.y, local.y));
        self.high = Vector2::new(larger(self.high.x, local.x), larger(self.high.y, local.y));
    }

    /// Local coordinates of a place.
    #[inline]
    pub(super) fn local(&self, place: Point2) -> Vector2 {
        let v = place - self.origin;
        Vector2::new(self.axis.dot(&v), self.axis.perp(&v))
    }

    /// The box is at least this far from the line; negative if that cannot be told.
    #[inline]
    pub(super) fn gap_m(&self, line: &Segment) -> f64 {
        self.gap_between_m(self.local(line.start), self.local(line.end))
    }

    /// As [`Self::gap_m`], for a line between two places in local coordinates.
    #[inline]
    pub(super) fn gap_between_m(&self, a: Vector2, b: Vector2) -> f64 {
        let along = larger(smaller(a.x, b.x) - self.high.x, self.low.x - larger(a.x, b.x));
        let across = larger(smaller(a.y, b.y) - self.high.y, self.low.y - larger(a.y, b.y));
        larger(along, across)
    }
}
