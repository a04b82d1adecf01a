//! Rectangles at any angle: the shape of vehicles and most objects, and the inner loop of every collision test.

use super::{Point2, Vector2};
use crate::pose::Pose;

/// A rectangle at any angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OrientedBox {
    /// Middle of the box \[m\].
    pub center: Point2,
    /// Unit vector of its length.
    pub axis: Vector2,
    /// Half of its length, along the axis \[m\], zero or more.
    pub half_length_m: f64,
    /// Half of its width, across the axis \[m\], zero or more.
    pub half_width_m: f64,
}

impl OrientedBox {
    /// The box around a pose: `front_m` ahead of it, `rear_m` behind, `left_m` and `right_m` to its sides, each a
    /// distance from the pose (for a vehicle all positive). Only the yaw of the pose counts.
    #[must_use]
    #[inline]
    pub fn around(pose: &Pose, front_m: f64, rear_m: f64, left_m: f64, right_m: f64) -> Self {
        let axis = pose.heading();
        let ahead = axis * ((front_m - rear_m) * 0.5);
        let aside = Vector2::new(-axis.y, axis.x) * ((left_m - right_m) * 0.5);
        Self {
            center: pose.point() + ahead + aside,
            axis,
            half_length_m: (front_m + rear_m) * 0.5,
            half_width_m: (left_m + right_m) * 0.5,
        }
    }

    /// Corners clockwise: front left, front right, rear right, rear left \[m\].
    #[must_use]
    #[inline]
    pub fn corners(&self) -> [Point2; 4] {
        let ahead = self.axis * self.half_length_m;
        let left = Vector2::new(-self.axis.y, self.axis.x) * self.half_width_m;
        let (front, rear) = (self.center + ahead, self.center - ahead);
        [front + left, front - left, rear - left, rear + left]
    }

    /// True when the boxes overlap or touch: exact test of the four axes that can separate two rectangles.
    #[must_use]
    #[inline]
    pub fn overlaps(&self, other: &Self) -> bool {
        let between = other.center - self.center;
        let cos = self.axis.dot(&other.axis).abs();
        let sin = self.axis.perp(&other.axis).abs();
        // Comparisons are "apart if", so that a not-a-number counts as an overlap, the careful side.
        let apart = |a: &Self, b: &Self| {
            let along = a.axis.dot(&between).abs();
            let across = a.axis.perp(&between).abs();
            along > a.half_length_m + b.half_length_m * cos + b.half_width_m * sin
                || across > a.half_width_m + b.half_length_m * sin + b.half_width_m * cos
        };
        !apart(self, other) && !apart(other, self)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::{convex_overlap, signed_area};
    use super::*;

    #[test]
    fn corners_of_a_turned_vehicle() {
        let b = OrientedBox::around(
            &Pose::from_xy_yaw(10.0, 20.0, std::f64::consts::FRAC_PI_2),
            4.0,
            1.0,
            2.0,
            1.0,
        );
        let expected = [(8.0, 24.0), (11.0, 24.0), (11.0, 19.0), (8.0, 19.0)];
        for (corner, (x, y)) in b.corners().iter().zip(expected) {
            assert!((corner - Point2::new(x, y)).norm() < 1e-12, "{corner}");
        }
        assert!((signed_area(&b.corners()) + 15.0).abs() < 1e-12);
    }

    #[test]
    fn contact_counts() {
        let at = |x, y, yaw| OrientedBox::around(&Pose::from_xy_yaw(x, y, yaw), 1.0, 1.0, 1.0, 1.0);
        for k in -4..=4 {
            let gap = 1e-6 * f64::from(k);
            assert_eq!(at(0.0, 0.0, 0.0).overlaps(&at(2.0 + gap, 0.5, 0.0)), k <= 0, "edge, gap {gap}");
            assert_eq!(
                at(0.0, 0.0, 0.0).overlaps(&at(2.0 + gap, 2.0 + gap, 0.0)),
                k <= 0,
                "corner, gap {gap}"
            );
        }
        // diagonal of a square: reaches sqrt(2), not 2
        let turned = at(2.42, 0.0, std::f64::consts::FRAC_PI_4);
        assert!(!at(0.0, 0.0, 0.0).overlaps(&turned));
        assert!(at(0.01, 0.0, 0.0).overlaps(&turned));
    }

    #[test]
    fn not_a_number_is_no_way_past() {
        let good = OrientedBox::around(&Pose::default(), 1.0, 1.0, 1.0, 1.0);
        let bad = OrientedBox::around(&Pose::from_xy_yaw(f64::NAN, 100.0, 0.0), 1.0, 1.0, 1.0, 1.0);
        assert!(good.overlaps(&OrientedBox { center: Point2::new(f64::NAN, f64::NAN), ..good }));
        assert!(bad.overlaps(&OrientedBox { center: Point2::new(0.0, 100.0), ..good }));
    }

    prop_compose! {
        fn any_box()(
            x in -5.0..5.0_f64, y in -5.0..5.0_f64, yaw in -7.0..7.0_f64,
            front in 0.0..4.0_f64, rear in 0.0..2.0_f64, left in 0.0..2.0_f64, right in 0.0..2.0_f64,
        ) -> OrientedBox {
            OrientedBox::around(&Pose::from_xy_yaw(x, y, yaw), front, rear, left, right)
        }
    }

    fn widened(b: &OrientedBox, by_m: f64) -> OrientedBox {
        OrientedBox { half_length_m: b.half_length_m + by_m, half_width_m: b.half_width_m + by_m, ..*b }
    }

    proptest! {
        #[test]
        fn equals_the_polygon_test(a in any_box(), b in any_box()) {
            let overlap = a.overlaps(&b);
            prop_assert_eq!(overlap, b.overlaps(&a));
            // away from exact contact, where rounding decides
            if a.overlaps(&widened(&b, 1e-9)) == overlap && (!overlap || b.half_width_m > 1e-8) {
                prop_assert_eq!(convex_overlap(&a.corners(), &b.corners()), overlap);
            }
        }

        #[test]
        fn rigid_motion_changes_nothing(
            a in any_box(), b in any_box(), x in -1e4..1e4_f64, y in -1e4..1e4_f64, turn in -4.0..4.0_f64,
        ) {
            let rotation = nalgebra::Rotation2::new(turn);
            let moved = |c: &OrientedBox| OrientedBox {
                center: rotation * c.center + Vector2::new(x, y),
                axis: rotation * c.axis,
                ..*c
            };
            let overlap = a.overlaps(&b);
            if a.overlaps(&widened(&b, 1e-6)) == overlap && (!overlap || a.overlaps(&widened(&b, -1e-6))) {
                prop_assert_eq!(moved(&a).overlaps(&moved(&b)), overlap);
            }
        }
    }
}
