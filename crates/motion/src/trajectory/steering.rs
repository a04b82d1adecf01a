//! The steering that the geometry of a trajectory asks for, whatever its wheel-angle fields say.

use super::Posed;
use crate::geometry::menger_curvature;

/// Index of the first trajectory point that has a smoothed steering angle.
pub const FIRST_SMOOTHED_INDEX: usize = 2;

/// Trajectories shorter than this have no smoothed steering angle.
const MIN_POINTS: usize = 5;

/// Smoothed front-wheel angles \[rad\], positive to the left, of the points 2 to n - 3; `out` is cleared first and its
/// entry k belongs to point k + [`FIRST_SMOOTHED_INDEX`]. Empty below five points.
///
/// The angle of one point is `atan(wheel_base · κ)` with the Menger curvature κ of it and its neighbours, 0 where two
/// of the three coincide; the first and last point have none. Smoothed is the mean over the point and two neighbours
/// to each side, as far as these have angles (vehicle constraint filter of `autoware_trajectory_validator`). The
/// direction of travel is not considered.
///
/// A coordinate that is not a number makes up to seven entries not a number; check those before comparing.
pub fn smoothed_steering_angles<P: Posed>(points: &[P], wheel_base_m: f64, out: &mut Vec<f64>) {
    out.clear();
    let n = points.len();
    if n < MIN_POINTS {
        return;
    }
    // Entry j holds the angle of point j first (none for point 0). The mean of point i goes to entry i - 2, which no
    // later window reads.
    out.reserve(n - 1);
    out.push(0.0);
    out.extend(points.windows(3).map(|w| {
        menger_curvature(w[0].point(), w[1].point(), w[2].point())
            .map_or(0.0, |curvature| (wheel_base_m * curvature).atan())
    }));
    out[0] = mean(&out[1..=(n - 2).min(4)]);
    for i in 3..n - 3 {
        out[i - FIRST_SMOOTHED_INDEX] = mean(&out[i - 2..i + 3]);
    }
    if n > MIN_POINTS {
        out[n - 5] = mean(&out[n - 5..=n - 2]);
    }
    out.truncate(n - 4);
}

#[inline]
fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::pose::Pose;

    fn smoothed(points: &[(f64, f64)], wheel_base_m: f64) -> Vec<f64> {
        let poses: Vec<_> = points.iter().map(|&(x, y)| Pose::from_xy_yaw(x, y, 0.3)).collect();
        let mut out = vec![7.0; 3];
        smoothed_steering_angles(&poses, wheel_base_m, &mut out);
        out
    }

    #[track_caller]
    fn assert_close(actual: &[f64], expected: &[f64]) {
        assert_eq!(actual.len(), expected.len(), "{actual:?}");
        for (a, e) in actual.iter().zip(expected) {
            assert!((a - e).abs() < 1e-15, "{actual:?} instead of {expected:?}");
        }
    }

    #[test]
    fn upstream_tables() {
        let angle = [(0, 0), (1, 0), (2, 0), (2, 1), (2, 2), (1, 2), (0, 2)];
        let rate = [(0, 0), (1, 0), (2, 0), (3, 0), (3, 1), (3, 2), (3, 3), (2, 3), (1, 3)];
        let float =
            |p: &[(i32, i32)]| p.iter().map(|&(x, y)| (f64::from(x), f64::from(y))).collect::<Vec<_>>();
        assert_close(
            &smoothed(&float(&angle), 2.5),
            &[0.647_576_763_789_315_6, 0.518_061_411_031_452_5, 0.647_576_763_789_315_6],
        );
        assert_close(
            &smoothed(&float(&rate), 2.5),
            &[
                0.323_788_381_894_657_8,
                0.259_030_705_515_726_27,
                0.518_061_411_031_452_5,
                0.518_061_411_031_452_5,
                0.323_788_381_894_657_8,
            ],
        );
        assert_close(&smoothed(&[(0.0, 0.0), (1.0, 0.0), (2.0, 0.0)], 2.5), &[]);
        assert_close(&smoothed(&[(0.0, 0.0), (1.0, 0.0), (2.0, 0.01), (3.0, 0.02)], 2.5), &[]);
    }

    #[test]
    fn windows_are_clipped_at_both_ends() {
        // one corner, seen by the window that reaches it only
        let corner = |n: i32, at: i32| {
            (0..n).map(|k| (f64::from(k.min(at)), f64::from((k - at).max(0)))).collect::<Vec<_>>()
        };
        let delta = (2.5 * 2_f64.sqrt()).atan();
        assert_close(&smoothed(&corner(5, 2), 2.5), &[delta / 3.0]);
        assert_close(&smoothed(&corner(7, 1), 2.5), &[delta / 4.0, delta / 5.0, 0.0]);
        assert_close(&smoothed(&corner(7, 5), 2.5), &[0.0, delta / 5.0, delta / 4.0]);
        assert_close(&smoothed(&corner(6, 4), 2.5), &[delta / 4.0, delta / 4.0]);
        assert_close(&smoothed(&corner(8, 3), 2.5), &[delta / 4.0, delta / 5.0, delta / 5.0, delta / 4.0]);
    }

    #[test]
    fn standing_points_steer_straight() {
        assert_close(&smoothed(&[(1.0, 1.0); 9], 2.5), &[0.0; 5]);
    }

    #[test]
    fn a_point_that_is_no_number_shows() {
        let mut points: Vec<_> = (0..12).map(|k| (f64::from(k), 0.0)).collect();
        points[6].0 = f64::NAN;
        let nans = smoothed(&points, 2.5).iter().map(|d| d.is_nan()).collect::<Vec<_>>();
        // points 5 to 7 lose their angle, hence 3 to 9 their mean
        assert_eq!(nans, [false, true, true, true, true, true, true, true]);
    }

    /// The definition word by word.
    fn reference(points: &[(f64, f64)], wheel_base_m: f64) -> Vec<f64> {
        let n = points.len();
        let raw = |i: usize| {
            let [a, b, c] = [i - 1, i, i + 1].map(|k| points[k]);
            let d = |p: (f64, f64), q: (f64, f64)| (q.0 - p.0).hypot(q.1 - p.1);
            let sides = d(a, b) * d(b, c) * d(c, a);
            let cross = (b.0 - a.0) * (c.1 - a.1) - (b.1 - a.1) * (c.0 - a.0);
            if sides < 1e-10 { 0.0 } else { (wheel_base_m * 2.0 * cross / sides).atan() }
        };
        (2..n.saturating_sub(2))
            .map(|i| {
                let window = (if i > 2 { i - 2 } else { 1 })..=(n - 2).min(i + 2);
                let count = window.clone().count() as f64;
                window.map(raw).sum::<f64>() / count
            })
            .collect()
    }

    proptest! {
        #[test]
        fn equals_the_definition(
            points in prop::collection::vec((-9.0..9.0_f64, -9.0..9.0_f64), 0..14), wheel_base in 1.0..6.0_f64,
        ) {
            let (fast, slow) = (smoothed(&points, wheel_base), reference(&points, wheel_base));
            prop_assert_eq!(fast.len(), slow.len());
            for (f, s) in fast.iter().zip(&slow) {
                prop_assert!((f - s).abs() < 1e-12, "{} {}", f, s);
            }
        }

        #[test]
        fn a_circle_needs_its_ackermann_angle(radius in 3.0..100.0_f64, left in any::<bool>(), n in 5..20_i32) {
            let sign = if left { 1.0 } else { -1.0 };
            let points: Vec<_> = (0..n)
                .map(|k| 0.5 / radius * f64::from(k))
                .map(|a| (radius * a.sin(), sign * radius * (1.0 - a.cos())))
                .collect();
            for angle in smoothed(&points, 2.79) {
                prop_assert!((angle - sign * (2.79 / radius).atan()).abs() < 1e-9);
            }
        }

        #[test]
        fn rigid_motion_changes_nothing(
            points in prop::collection::vec((-9.0..9.0_f64, -9.0..9.0_f64), 5..14),
            x in -1e4..1e4_f64, y in -1e4..1e4_f64, turn in -4.0..4.0_f64,
        ) {
            let (sin, cos) = turn.sin_cos();
            let moved: Vec<_> =
                points.iter().map(|&(u, v)| (x + u * cos - v * sin, y + u * sin + v * cos)).collect();
            for (a, b) in smoothed(&points, 2.79).iter().zip(smoothed(&moved, 2.79)) {
                prop_assert!((a - b).abs() < 1e-5);
            }
        }
    }
}
