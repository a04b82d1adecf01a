//! The vehicle's outline on the ground: a parallelogram, a rectangle unless the vehicle rolls or pitches.

use motion::occupancy::Bounds;
use motion::{Footprint, Point2, Pose, Segment};

/// What the quick tests leave to the exact ones, as a ratio of the vehicle's length or width, or of a segment's length.
const SLACK: f64 = 1e-6;

/// The outline at a pose.
#[derive(Debug, Clone, Copy)]
pub(super) struct Quad {
    /// Front left, front right, rear right, rear left.
    pub(super) corners: [Point2; 4],
    pub(super) bounds: Bounds,
}

impl Quad {
    /// The outline of a vehicle with this footprint. The centre points of its sides add nothing.
    pub(super) fn new(footprint: &Footprint, pose: &Pose) -> Self {
        let to_map = pose.planar_transform();
        let corners =
            [footprint.front_left(), footprint.front_right(), footprint.rear_right(), footprint.rear_left()]
                .map(|corner| to_map.apply(corner));
        Self { corners, bounds: Bounds::around(corners) }
    }

    /// The middle of the outline.
    pub(super) fn center(&self) -> Point2 {
        self.corners[0] + (self.corners[2] - self.corners[0]) * 0.5
    }

    /// A point as ratios of the way from the rear to the front and from the left to the right; not a number for a
    /// vehicle without extent.
    #[inline]
    fn ratios(&self) -> impl Fn(Point2) -> (f64, f64) + use<> {
        let [front_left, front_right, _, rear_left] = self.corners;
        let (ahead, right) = (front_left - rear_left, front_right - front_left);
        let per_area = 1.0 / ahead.perp(&right);
        move |point| {
            let from = point - rear_left;
            (from.perp(&right) * per_area, ahead.perp(&from) * per_area)
        }
    }

    /// False if a segment meets the outline, and perhaps if it nearly does.
    #[inline]
    pub(super) fn is_clearly_apart_from(&self, segment: &Segment) -> bool {
        let ratios = self.ratios();
        let ((a, b), (c, d)) = (ratios(segment.start), ratios(segment.end));
        let beyond = |u: f64, v: f64| (u < -SLACK && v < -SLACK) || (u > 1.0 + SLACK && v > 1.0 + SLACK);
        beyond(a, c) || beyond(b, d) || self.is_beside(segment)
    }

    /// True if all corners are clearly on one side of the line through a segment.
    #[inline]
    fn is_beside(&self, segment: &Segment) -> bool {
        let along = segment.vector();
        let slack = SLACK * (along.x.abs() + along.y.abs());
        let sides = self.corners.map(|corner| along.perp(&(corner - segment.start)));
        sides.iter().all(|&side| side > slack) || sides.iter().all(|&side| side < -slack)
    }

    /// True only if the outline holds a point.
    #[inline]
    pub(super) fn clearly_holds(&self, point: Point2) -> bool {
        let (ahead, right) = self.ratios()(point);
        let is_inside = |ratio: f64| ratio > SLACK && ratio < 1.0 - SLACK;
        is_inside(ahead) && is_inside(right)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use motion::VehicleInfo;
    use motion::geometry::{convex_contains, convex_overlap_within};
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2000))]

        #[test]
        fn the_quick_tests_never_contradict_the_exact_ones(
            (x, y, yaw) in (-5.0..5.0_f64, -5.0..5.0_f64, -3.2..3.2_f64),
            (ax, ay, bx, by) in (-9.0..9.0_f64, -9.0..9.0_f64, -9.0..9.0_f64, -9.0..9.0_f64),
        ) {
            let quad = Quad::new(&VehicleInfo::default().footprint(0.0, 0.0), &Pose::from_xy_yaw(x, y, yaw));
            let segment = Segment::new(Point2::new(ax, ay), Point2::new(bx, by));
            let meets = convex_overlap_within(&quad.corners, &[segment.start, segment.end], 0.0);
            prop_assert!(!(meets && quad.is_clearly_apart_from(&segment)));
            let holds = convex_contains(&quad.corners, segment.start);
            prop_assert_eq!(quad.clearly_holds(segment.start), holds, "up to a hair");
            prop_assert!(quad.bounds.holds(quad.center()) && quad.clearly_holds(quad.center()));
        }
    }

    #[test]
    fn contact_is_left_to_the_exact_test() {
        let quad = Quad::new(&VehicleInfo::default().footprint(0.0, 0.0), &Pose::default());
        let front_m = quad.corners[0].x;
        for (x, apart) in [(front_m, false), (front_m + 1e-9, false), (front_m + 1e-3, true)] {
            let across = Segment::new(Point2::new(x, -5.0), Point2::new(x, 5.0));
            assert_eq!(quad.is_clearly_apart_from(&across), apart, "{x}");
        }
    }

    #[test]
    fn a_vehicle_without_extent_is_left_to_the_exact_tests() {
        let corners = [Point2::origin(); 4];
        let nothing = Quad { corners, bounds: Bounds::around(corners) };
        assert!(!nothing.clearly_holds(Point2::origin()));
        assert!(!nothing.is_clearly_apart_from(&Segment::new(Point2::new(-1.0, 0.0), Point2::new(1.0, 0.0))));
    }
}
