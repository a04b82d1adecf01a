//! What a rolling vehicle does first: it goes on as its front wheels stand, for as far as it takes to stop. Whatever is
//! planned from there on, the vehicle can do it; where the way goes on in the same gear, the smoothing makes one curve of
//! it and it need not stop.

use crate::arc::Arc;
use crate::collision::CollisionChecker;
use crate::hybrid_a_star::CoarsePath;
use crate::pose::PlanarPose;
use crate::problem::{Limits, Problem};
use crate::verification::motion_is_free;

/// Part of the distance to stop that is added: the speed is found by a solver, which has knots in time.
const ROOM: f64 = 0.1;
/// The same, m.
const ROOM_M: f64 = 0.1;

/// The first piece of way of a rolling vehicle.
#[derive(Clone, Copy, Debug)]
pub(super) struct LeadIn {
    arc: Arc,
    start: PlanarPose,
    /// Where planning begins.
    pub(super) end: PlanarPose,
}

impl LeadIn {
    /// None for a vehicle at rest, whose wheels turn on the spot, and where it is not known how they stand.
    pub(super) fn of(problem: &Problem) -> Option<Self> {
        let speed_mps = problem.start_speed_mps;
        let curvature = problem.start_curvature.filter(|_| speed_mps != 0.0)?;
        let most = problem.vehicle.max_curvature();
        let speeding_up = problem.start_acceleration_mps2 * speed_mps.signum();
        let length_m =
            (1.0 + ROOM) * stopping_distance_m(speed_mps.abs(), speeding_up, &problem.limits) + ROOM_M;
        let arc = Arc::new(curvature.clamp(-most, most), speed_mps.signum() * length_m);
        Some(Self { arc, start: problem.start, end: arc.end(&problem.start) })
    }

    /// Of the way, positive, m.
    pub(super) fn length_m(&self) -> f64 {
        self.arc.length_m.abs()
    }

    /// Whether the way keeps `inflation_m` from everything.
    pub(super) fn is_free(&self, checker: &CollisionChecker, inflation_m: f64) -> bool {
        motion_is_free(&self.start, &self.end, checker, inflation_m)
    }

    /// `path`, which begins where this ends, with this before it.
    pub(super) fn before(&self, path: CoarsePath, checker: &CollisionChecker, spacing_m: f64) -> CoarsePath {
        let inflation_m = if self.is_free(checker, path.inflation_m) { path.inflation_m } else { 0.0 };
        CoarsePath { inflation_m, ..path }.led_in_by(&self.start, self.arc, spacing_m)
    }
}

/// Travel from a speed (not negative) and an acceleration along it to rest, as hard as `limits` allow, m; what brakes
/// already counts as if it did not.
fn stopping_distance_m(speed_mps: f64, acceleration_mps2: f64, limits: &Limits) -> f64 {
    let (most, jerk) = (limits.max_acceleration_mps2, limits.max_jerk_mps3);
    // Until it does not speed up any more.
    let (a, t) = (acceleration_mps2.max(0.0), acceleration_mps2.max(0.0) / jerk);
    let before_m = t * (speed_mps + t * a / 3.0);
    let speed_mps = speed_mps + a * t / 2.0;
    let duration_s = if speed_mps * jerk < most * most {
        2.0 * (speed_mps / jerk).sqrt()
    } else {
        speed_mps / most + most / jerk
    };
    before_m + speed_mps * duration_s / 2.0
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against driving it out in steps of a tenth of a millisecond.
    #[test]
    fn the_distance_to_stop_is_that_of_braking_as_hard_as_may_be() {
        let limits = Limits { max_acceleration_mps2: 1.0, max_jerk_mps3: 2.0, ..Limits::default() };
        for (speed_mps, acceleration_mps2) in [(0.1, 0.0), (0.5, 0.0), (2.0, 0.0), (0.4, 0.7), (1.5, 1.0)] {
            let (mut s, mut v, mut a) = (0.0, speed_mps, acceleration_mps2);
            let dt = 1e-4;
            while v > 0.0 {
                // Brake harder while that still leaves time to let go of the brake before the stop.
                let lets_go = v <= a * a / (2.0 * limits.max_jerk_mps3) && a < 0.0;
                let jerk = if lets_go { 1.0 } else { -1.0 } * limits.max_jerk_mps3;
                a = (a + jerk * dt).max(-limits.max_acceleration_mps2).min(if lets_go { -1e-3 } else { 9.0 });
                s += v * dt;
                v += a * dt;
            }
            let found = stopping_distance_m(speed_mps, acceleration_mps2, &limits);
            assert!(
                (found - s).abs() < 0.002 + 0.01 * s,
                "{speed_mps} {acceleration_mps2}: {found} instead of {s}"
            );
        }
        let braking = stopping_distance_m(1.0, -0.5, &limits);
        assert_eq!(braking, stopping_distance_m(1.0, 0.0, &limits), "on the safe side");
    }
}
