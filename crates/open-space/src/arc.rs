//! Exact motion along a circle or a straight line: what a vehicle does while its steering wheel stands still.

use crate::pose::{Gear, PlanarPose};

/// A piece of path with one curvature.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arc {
    /// dyaw/ds, positive to the left in both gears, 1/m.
    pub curvature: f64,
    /// Along the heading, negative in reverse, m.
    pub length_m: f64,
}

impl Arc {
    /// The arc of `length_m` (negative in reverse) with `curvature`.
    #[must_use]
    pub const fn new(curvature: f64, length_m: f64) -> Self {
        Self { curvature, length_m }
    }

    /// The gear it is driven in; forward for one without length.
    #[must_use]
    pub fn gear(&self) -> Gear {
        if self.length_m < 0.0 { Gear::Reverse } else { Gear::Forward }
    }

    /// Pose at the end of the arc when it begins at `from`. The heading is not normalised, so it is continuous along
    /// a chain of arcs.
    #[must_use]
    #[inline]
    pub fn end(&self, from: &PlanarPose) -> PlanarPose {
        self.at(from, self.length_m)
    }

    /// Pose after `length_m` (negative in reverse) on the circle of this arc through `from`.
    #[must_use]
    #[inline]
    pub fn at(&self, from: &PlanarPose, length_m: f64) -> PlanarPose {
        let turn = self.curvature * length_m;
        // The chord of the arc lies along its middle heading.
        let chord = length_m * sinc(0.5 * turn);
        let (sin, cos) = (from.yaw + 0.5 * turn).sin_cos();
        PlanarPose { x: from.x + chord * cos, y: from.y + chord * sin, yaw: from.yaw + turn }
    }
}

/// sin(x)/x.
fn sinc(x: f64) -> f64 {
    // Below this the first term left out, x^4/120, is less than a last place.
    if x.abs() < 1e-4 { 1.0 - x * x / 6.0 } else { x.sin() / x }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, PI};

    use proptest::prelude::*;

    use super::*;

    fn close(a: &PlanarPose, b: &PlanarPose) -> bool {
        a.distance_m(b) < 1e-9 && (a.yaw - b.yaw).abs() < 1e-9
    }

    #[test]
    fn known_arcs() {
        let origin = PlanarPose::default();
        let cases = [
            (Arc::new(0.0, 2.0), PlanarPose::new(2.0, 0.0, 0.0)),
            (Arc::new(0.0, -2.0), PlanarPose::new(-2.0, 0.0, 0.0)),
            (Arc::new(0.5, PI), PlanarPose::new(2.0, 2.0, FRAC_PI_2)),
            (Arc::new(-0.5, PI), PlanarPose::new(2.0, -2.0, -FRAC_PI_2)),
            (Arc::new(0.5, -PI), PlanarPose::new(-2.0, 2.0, -FRAC_PI_2)),
            (Arc::new(1e-9, 3.0), PlanarPose::new(3.0, 4.5e-9, 3e-9)),
        ];
        for (arc, expected) in cases {
            let end = arc.end(&origin);
            assert!(close(&end, &expected), "{arc:?}: {end:?} instead of {expected:?}");
        }
    }

    proptest! {
        #[test]
        fn arcs_join_and_can_be_driven_back(
            x in -50.0..50.0_f64, y in -50.0..50.0_f64, yaw in -7.0..7.0_f64,
            curvature in -0.4..0.4_f64, length in -20.0..20.0_f64, ratio in 0.0..1.0_f64,
        ) {
            let from = PlanarPose::new(x, y, yaw);
            let arc = Arc::new(curvature, length);
            let end = arc.end(&from);
            let middle = arc.at(&from, ratio * length);
            prop_assert!(close(&arc.at(&middle, (1.0 - ratio) * length), &end));
            prop_assert!(close(&Arc::new(curvature, -length).end(&end), &from));
            // many small steps by the differential equation come to the same place
            let n = 2000;
            let ds = length / f64::from(n);
            let (mut px, mut py, mut pyaw) = (x, y, yaw);
            for _ in 0..n {
                let middle = pyaw + 0.5 * curvature * ds;
                (px, py, pyaw) = (px + ds * middle.cos(), py + ds * middle.sin(), pyaw + curvature * ds);
            }
            prop_assert!(end.distance_m(&PlanarPose::new(px, py, pyaw)) < 1e-4);
        }
    }
}
