//! The fastest motion from rest to rest under limits of speed, acceleration and jerk, in closed form.

use super::{SpeedLimits, SpeedProfile, SpeedState};

/// Fastest motion over `length_m` (positive) from rest to rest: up to seven pieces, symmetric in time.
pub(crate) fn rest_to_rest(length_m: f64, limits: &SpeedLimits) -> SpeedProfile {
    let (a, j) = (limits.max_acceleration_mps2, limits.max_jerk_mps3);
    let top = limits.max_speed_mps.min(reachable_speed(length_m, a, j));
    let (ramp_s, hold_s) = if top * j >= a * a { (a / j, top / a - a / j) } else { ((top / j).sqrt(), 0.0) };
    // Speeding up and slowing down together cover top * (time of one of them).
    let cruise_s = (length_m / top - (2.0 * ramp_s + hold_s)).max(0.0);
    let pieces =
        [(ramp_s, j), (hold_s, 0.0), (ramp_s, -j), (cruise_s, 0.0), (ramp_s, -j), (hold_s, 0.0), (ramp_s, j)];
    let profile = SpeedProfile::new(SpeedState::default(), pieces.into_iter().filter(|piece| piece.0 > 0.0));
    let end = SpeedState { position_m: length_m, ..SpeedState::default() };
    SpeedProfile { end, ..profile }
}

/// Highest speed between two rests `length_m` apart.
fn reachable_speed(length_m: f64, a: f64, j: f64) -> f64 {
    let without_hold = (length_m * length_m * j / 4.0).cbrt();
    if without_hold * j <= a * a {
        return without_hold;
    }
    let ramp_s = a / j;
    a / 2.0 * ((ramp_s * ramp_s + 4.0 * length_m / a).sqrt() - ramp_s)
}
