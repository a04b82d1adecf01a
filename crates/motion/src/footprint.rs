//! The outline of the vehicle on the ground: its seven vertices, where it lies at a pose and along a trajectory, and
//! its four sides.
//!
//! Vertices run clockwise and the ring is closed: 0 front left, 1 front right, 2 centre right, 3 rear right,
//! 4 rear left, 5 centre left, 6 = 0 (`autoware_vehicle_info_utils`).

use crate::geometry::{Point2, Segment, signed_area};
use crate::pose::Pose;
use crate::trajectory::Posed;

/// Outline of the vehicle as a closed clockwise ring, in whatever frame it was placed in \[m\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Footprint {
    vertices: [Point2; 7],
}

impl Footprint {
    /// Closes the ring over the six corners, given in the order of the module documentation.
    #[must_use]
    #[inline]
    pub fn new([fl, fr, cr, rr, rl, cl]: [Point2; 6]) -> Self {
        Self { vertices: [fl, fr, cr, rr, rl, cl, fl] }
    }

    /// The closed ring; the last vertex repeats the first.
    #[must_use]
    #[inline]
    pub fn vertices(&self) -> &[Point2; 7] {
        &self.vertices
    }

    /// The six different corners, without the closing one.
    #[must_use]
    #[inline]
    pub fn corners(&self) -> &[Point2] {
        &self.vertices[..6]
    }

    /// Front left corner.
    #[must_use]
    #[inline]
    pub fn front_left(&self) -> Point2 {
        self.vertices[0]
    }

    /// Front right corner.
    #[must_use]
    #[inline]
    pub fn front_right(&self) -> Point2 {
        self.vertices[1]
    }

    /// Rear right corner.
    #[must_use]
    #[inline]
    pub fn rear_right(&self) -> Point2 {
        self.vertices[3]
    }

    /// Rear left corner.
    #[must_use]
    #[inline]
    pub fn rear_left(&self) -> Point2 {
        self.vertices[4]
    }

    /// Left side, from the front to the rear corner.
    #[must_use]
    #[inline]
    pub fn left_side(&self) -> Segment {
        Segment::new(self.front_left(), self.rear_left())
    }

    /// Right side, from the front to the rear corner.
    #[must_use]
    #[inline]
    pub fn right_side(&self) -> Segment {
        Segment::new(self.front_right(), self.rear_right())
    }

    /// Front edge, from the left to the right corner.
    #[must_use]
    #[inline]
    pub fn front_edge(&self) -> Segment {
        Segment::new(self.front_left(), self.front_right())
    }

    /// Rear edge, from the left to the right corner.
    #[must_use]
    #[inline]
    pub fn rear_edge(&self) -> Segment {
        Segment::new(self.rear_left(), self.rear_right())
    }

    /// This outline, given in base_link, placed at a pose. The full orientation counts: roll and pitch shrink the
    /// outline, see [`Pose::planar_transform`].
    #[must_use]
    #[inline]
    pub fn placed_at(&self, pose: &Pose) -> Self {
        let transform = pose.planar_transform();
        let at = |i: usize| transform.apply(self.vertices[i]);
        Self::new([at(0), at(1), at(2), at(3), at(4), at(5)])
    }
}

/// Places the outline `local` (in base_link) at every point; `out` is cleared first.
pub fn footprints_along<P: Posed>(points: &[P], local: &Footprint, out: &mut Vec<Footprint>) {
    out.clear();
    out.extend(points.iter().map(|point| local.placed_at(point.pose())));
}

/// Rectangle around a pose as a closed clockwise ring: `front_m` ahead, `rear_m` behind, `width_m` / 2 to either side
/// (`autoware_utils_geometry::to_footprint`). The left and right overhang of a vehicle cannot differ here.
#[must_use]
pub fn to_footprint(pose: &Pose, front_m: f64, rear_m: f64, width_m: f64) -> [Point2; 5] {
    let transform = pose.planar_transform();
    let half = width_m / 2.0;
    let mut ring = [(front_m, half), (front_m, -half), (-rear_m, -half), (-rear_m, half), (front_m, half)]
        .map(|(x, y)| transform.apply(Point2::new(x, y)));
    // Upside down, or with front behind rear, the same corners run counter-clockwise.
    if signed_area(&ring) > 0.0 {
        ring.reverse();
    }
    ring
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, PI};

    use super::*;
    use crate::pose::Quaternion;
    use crate::vehicle::VehicleInfo;

    fn assert_ring(actual: &[Point2], expected: &[(f64, f64)]) {
        assert_eq!(actual.len(), expected.len());
        for (a, &(x, y)) in actual.iter().zip(expected) {
            assert!((a.x - x).abs() < 1e-9 && (a.y - y).abs() < 1e-9, "{a} instead of ({x}, {y})");
        }
    }

    #[test]
    fn sample_vehicle_footprints() {
        let poses = [
            Pose::from_xy_yaw(0.0, 0.0, 0.0),
            Pose::from_xy_yaw(10.0, 0.0, FRAC_PI_2),
            Pose::from_xy_yaw(0.0, 10.0, PI),
        ];
        let mut rings = Vec::new();
        footprints_along(&poses, &VehicleInfo::default().footprint(0.0, 0.0), &mut rings);
        let half = 0.948;
        let expected = [
            [
                (3.79, half),
                (3.79, -half),
                (1.395, -half),
                (-1.1, -half),
                (-1.1, half),
                (1.395, half),
                (3.79, half),
            ],
            [
                (10.0 - half, 3.79),
                (10.0 + half, 3.79),
                (10.0 + half, 1.395),
                (10.0 + half, -1.1),
                (10.0 - half, -1.1),
                (10.0 - half, 1.395),
                (10.0 - half, 3.79),
            ],
            [
                (-3.79, 10.0 - half),
                (-3.79, 10.0 + half),
                (-1.395, 10.0 + half),
                (1.1, 10.0 + half),
                (1.1, 10.0 - half),
                (-1.395, 10.0 - half),
                (-3.79, 10.0 - half),
            ],
        ];
        assert_eq!(rings.len(), 3);
        for (ring, expected) in rings.iter().zip(&expected) {
            assert_ring(ring.vertices(), expected);
            assert!(signed_area(ring.corners()) < 0.0, "clockwise");
        }
        assert_eq!(rings[0].left_side(), Segment::new(rings[0].vertices()[0], rings[0].vertices()[4]));
        assert_eq!(rings[0].right_side(), Segment::new(rings[0].vertices()[1], rings[0].vertices()[3]));
        assert_eq!(rings[0].front_edge(), Segment::new(rings[0].vertices()[0], rings[0].vertices()[1]));
        assert_eq!(rings[0].rear_edge(), Segment::new(rings[0].vertices()[4], rings[0].vertices()[3]));
    }

    #[test]
    fn front_corner_of_a_turned_wide_vehicle() {
        let wide = crate::vehicle::VehicleDimensions { left_overhang_m: 2.5, ..Default::default() };
        let local = VehicleInfo::new(wide).unwrap().footprint(0.0, 0.0);
        let corner = local.placed_at(&Pose::from_xy_yaw(0.0, -2.5 + 0.0, 0.2)).front_left();
        assert!((corner.x - 3.054_87).abs() < 1e-5 && (corner.y - 1.506_778).abs() < 1e-5, "{corner}");
    }

    #[test]
    fn roll_and_pitch_shrink_the_outline() {
        let local = VehicleInfo::default().footprint(0.0, 0.0);
        let mut pose = Pose::from_xy_yaw(0.0, 0.0, 0.0);
        pose.orientation = Quaternion::from_roll_pitch_yaw(0.3, 0.0, 0.0);
        assert!((local.placed_at(&pose).front_left().y - 0.948 * 0.3_f64.cos()).abs() < 1e-12);
        pose.orientation = Quaternion::from_roll_pitch_yaw(0.0, 0.2, 0.0);
        assert!((local.placed_at(&pose).front_left().x - 3.79 * 0.2_f64.cos()).abs() < 1e-12);
    }

    #[test]
    fn rectangle_is_closed_and_clockwise() {
        let ring = to_footprint(&Pose::from_xy_yaw(1.0, 2.0, 0.0), 4.0, 1.0, 2.0);
        assert_ring(&ring, &[(5.0, 3.0), (5.0, 1.0), (0.0, 1.0), (0.0, 3.0), (5.0, 3.0)]);
        let mut upside_down = Pose::from_xy_yaw(0.0, 0.0, 0.0);
        upside_down.orientation = Quaternion::from_roll_pitch_yaw(PI, 0.0, 0.0);
        assert!(signed_area(&to_footprint(&upside_down, 4.0, 1.0, 2.0)) < 0.0);
    }
}
