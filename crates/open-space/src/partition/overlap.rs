//! How much two rectangles have in common.

use motion::geometry::signed_area;
use motion::{OrientedBox, Point2};

/// Area that two boxes share over the area that they cover together: 1 for equal boxes, 0 for separate ones.
#[must_use]
pub fn intersection_over_union(a: &OrientedBox, b: &OrientedBox) -> f64 {
    let area = |b: &OrientedBox| 4.0 * b.half_length_m * b.half_width_m;
    let shared = intersection_area(a, b);
    let covered = area(a) + area(b) - shared;
    if covered > 0.0 { shared / covered } else { 0.0 }
}

/// Clips one box by the sides of the other (Sutherland and Hodgman), m².
fn intersection_area(a: &OrientedBox, b: &OrientedBox) -> f64 {
    // Twice as many corners as a box has is the most that the overlap can have.
    let (mut kept, mut clipped) = (Vec::with_capacity(8), Vec::with_capacity(8));
    kept.extend(a.corners());
    let sides = b.corners();
    for (i, &from) in sides.iter().enumerate() {
        let to = sides[(i + 1) % 4];
        // Corners run clockwise: inside is to the right.
        let inside = |p: &Point2| -(to - from).perp(&(p - from));
        clipped.clear();
        for (j, p) in kept.iter().enumerate() {
            let q = &kept[(j + 1) % kept.len()];
            let (of_p, of_q) = (inside(p), inside(q));
            if of_p >= 0.0 {
                clipped.push(*p);
            }
            if (of_p >= 0.0) != (of_q >= 0.0) {
                clipped.push(p + (q - p) * (of_p / (of_p - of_q)));
            }
        }
        std::mem::swap(&mut kept, &mut clipped);
    }
    signed_area(&kept).abs()
}

#[cfg(test)]
mod tests {
    use motion::Pose;
    use proptest::prelude::*;

    use super::*;

    fn square(x: f64, y: f64, yaw: f64) -> OrientedBox {
        OrientedBox::around(&Pose::from_xy_yaw(x, y, yaw), 1.0, 1.0, 1.0, 1.0)
    }

    #[test]
    fn known_overlaps() {
        let octagon = 8.0 * (2.0_f64.sqrt() - 1.0);
        for (x, y, yaw, expected) in [
            (0.0, 0.0, 0.0, 1.0),
            (1.0, 0.0, 0.0, 2.0 / 6.0),
            (1.0, 1.0, 0.0, 1.0 / 7.0),
            (2.0, 0.0, 0.0, 0.0),
            (5.0, 5.0, 1.0, 0.0),
            (0.0, 0.0, std::f64::consts::FRAC_PI_2, 1.0),
            (0.0, 0.0, std::f64::consts::FRAC_PI_4, octagon / (8.0 - octagon)),
        ] {
            let found = intersection_over_union(&square(0.0, 0.0, 0.0), &square(x, y, yaw));
            assert!((found - expected).abs() < 1e-12, "{found} instead of {expected} at ({x}, {y}, {yaw})");
        }
    }

    proptest! {
        #[test]
        fn symmetric_bounded_and_positive_exactly_where_boxes_overlap(
            x in -6.0..6.0_f64, y in -6.0..6.0_f64, yaw in -3.0..3.0_f64,
            front in 0.5..4.0_f64, rear in 0.5..2.0_f64, side in 0.3..1.5_f64,
        ) {
            let a = OrientedBox::around(&Pose::from_xy_yaw(0.3, -0.2, 0.7), 3.8, 1.1, 0.95, 0.95);
            let b = OrientedBox::around(&Pose::from_xy_yaw(x, y, yaw), front, rear, side, side);
            let ratio = intersection_over_union(&a, &b);
            prop_assert!((ratio - intersection_over_union(&b, &a)).abs() < 1e-9);
            prop_assert!((0.0..=1.0 + 1e-12).contains(&ratio));
            if ratio > 1e-9 {
                prop_assert!(a.overlaps(&b));
            } else {
                let grown = |c: &OrientedBox| OrientedBox {
                    half_length_m: c.half_length_m - 1e-4, half_width_m: c.half_width_m - 1e-4, ..*c
                };
                prop_assert!(!grown(&a).overlaps(&grown(&b)));
            }
        }

        #[test]
        fn shrinks_as_a_box_moves_away(first in 0.0..2.0_f64, further in 0.01..2.0_f64, way in -3.0..3.0_f64) {
            let at = |d: f64| intersection_over_union(&square(0.0, 0.0, 0.3), &square(d * way.cos(), d * way.sin(), 0.3));
            prop_assert!(at(first + further) <= at(first) + 1e-12);
        }
    }
}
