//! How far a body gets over time, and along which arc.

use super::outline::PlanarPose;
use crate::geometry::Vector2;

/// Samples closer in time than this \[s\] are one.
const SAMPLE_GAP_S: f64 = 1e-3;
/// Slower than this \[m/s\] a body has no direction of motion.
const DIRECTION_SPEED_MPS: f64 = 1e-6;
/// Arcs of smaller angles \[rad\] are developed into a series.
const SERIES_ANGLE_RAD: f64 = 1e-4;

/// Constant speed up to a lag, then constant acceleration; braking ends at standstill.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpeedProfile {
    /// Speed at time 0, zero or more \[m/s\].
    pub speed_mps: f64,
    /// Time until the acceleration sets in \[s\].
    pub lag_s: f64,
    /// Acceleration from then on, negative for braking \[m/s²\].
    pub acceleration_mps2: f64,
}

impl SpeedProfile {
    /// Constant speed.
    #[must_use]
    pub fn constant(speed_mps: f64) -> Self {
        Self { speed_mps, lag_s: 0.0, acceleration_mps2: 0.0 }
    }

    /// When braking ends \[s\]; `None` if nothing brakes.
    #[must_use]
    pub fn stop_time_s(&self) -> Option<f64> {
        (self.acceleration_mps2 < 0.0).then(|| self.lag_s + self.speed_mps / -self.acceleration_mps2)
    }

    /// Distance travelled since time 0 \[m\].
    #[must_use]
    #[inline]
    pub fn distance_m(&self, time_s: f64) -> f64 {
        let Self { speed_mps, lag_s, acceleration_mps2 } = *self;
        if speed_mps <= 0.0 {
            return 0.0;
        }
        if time_s < lag_s {
            return speed_mps * time_s;
        }
        if self.stop_time_s().is_some_and(|stop_s| time_s >= stop_s) {
            return speed_mps * (lag_s + 0.5 * speed_mps / -acceleration_mps2);
        }
        let braking_s = time_s - lag_s;
        speed_mps * time_s + 0.5 * acceleration_mps2 * braking_s * braking_s
    }

    /// Writes the times at which to sample the motion from `start_s` to `end_s`: both ends, the multiples of
    /// `resolution_s` between them, and the stop, after which nothing happens until the end. A body that does not move
    /// has one sample. `times` is cleared first.
    pub fn sample_times(&self, start_s: f64, end_s: f64, resolution_s: f64, times: &mut Vec<f64>) {
        times.clear();
        times.push(start_s);
        if self.speed_mps <= 0.0 || start_s >= end_s {
            return;
        }
        let mut last_s = start_s;
        let mut add = |time_s: f64| {
            if time_s <= end_s && time_s >= last_s + SAMPLE_GAP_S {
                times.push(time_s);
                last_s = time_s;
            }
        };
        let stop_s = self.stop_time_s();
        let mut tick = (start_s / resolution_s).floor() + 1.0;
        loop {
            let time_s = tick * resolution_s;
            if time_s >= end_s {
                break;
            }
            if let Some(stop_s) = stop_s
                && time_s > stop_s
            {
                add(stop_s);
                break;
            }
            add(time_s);
            tick += 1.0;
        }
        add(end_s);
    }
}

/// Direction of motion in the body's frame (unit vector) and turn per metre \[rad/m\] of a body with this velocity in
/// its own frame \[m/s\] and yaw rate \[rad/s\]. Both are zero for a body at rest.
#[must_use]
pub fn turn_per_metre(velocity: Vector2, yaw_rate_rps: f64) -> (Vector2, f64) {
    let speed = velocity.norm();
    if speed <= DIRECTION_SPEED_MPS {
        return (Vector2::zeros(), 0.0);
    }
    (velocity / speed, yaw_rate_rps / speed)
}

/// Where a body is after `distance_m` of an arc: direction of motion and turn per metre as [`turn_per_metre`] gives
/// them.
#[must_use]
pub fn arc_pose(start: &PlanarPose, direction: Vector2, turn_rad_per_m: f64, distance_m: f64) -> PlanarPose {
    let angle = turn_rad_per_m * distance_m;
    let (sin, cos) = angle.sin_cos();
    let (a, b) = if angle.abs() < SERIES_ANGLE_RAD {
        (1.0 - angle * angle / 6.0, angle / 2.0 - angle * angle * angle / 24.0)
    } else {
        (sin / angle, (1.0 - cos) / angle)
    };
    let along = direction * distance_m;
    let local = nalgebra::Point2::new(a * along.x - b * along.y, b * along.x + a * along.y);
    let h = start.heading;
    PlanarPose {
        position: start.apply(local),
        heading: Vector2::new(h.x * cos - h.y * sin, h.x * sin + h.y * cos),
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};

    use super::*;

    fn sampled(speed: f64, lag: f64, acceleration: f64, end: f64) -> (SpeedProfile, Vec<f64>) {
        let profile = SpeedProfile { speed_mps: speed, lag_s: lag, acceleration_mps2: acceleration };
        let mut times = Vec::new();
        profile.sample_times(0.0, end, 0.1, &mut times);
        (profile, times)
    }

    fn close(a: f64, b: f64) {
        assert!((a - b).abs() < 1e-9, "{a} instead of {b}");
    }

    #[test]
    fn published_motion_profiles() {
        let (profile, times) = sampled(0.0, 1.0, 1.0, 5.0);
        assert_eq!((times.as_slice(), profile.distance_m(0.0)), ([0.0].as_slice(), 0.0));

        let (profile, times) = sampled(10.0, 1.0, 0.0, 3.05);
        assert_eq!(times.len(), 32);
        assert_eq!(*times.last().unwrap(), 3.05);
        for (i, &t) in times[..31].iter().enumerate() {
            close(t, 0.1 * i as f64);
            close(profile.distance_m(t), 10.0 * t);
        }

        let (profile, times) = sampled(5.0, 1.0, 2.0, 2.05);
        for &t in &times {
            let late = (t - 1.0).max(0.0);
            close(profile.distance_m(t), if t < 1.0 { 5.0 * t } else { 5.0 + 5.0 * late + late * late });
        }

        let (profile, times) = sampled(10.0, 1.0, -5.0, 5.0);
        assert!(times.iter().any(|t| (t - 3.0).abs() < 1e-9), "{times:?}");
        close(profile.distance_m(*times.last().unwrap()), 20.0);

        let (profile, times) = sampled(5.0, 5.0, -10.0, 2.05);
        times.iter().for_each(|&t| close(profile.distance_m(t), 5.0 * t));

        let (_, times) = sampled(10.0, 1.0, -10.0 / 1.97, 2.95);
        assert!(times.windows(2).all(|pair| pair[0] < pair[1]));
        assert_eq!((times[0], *times.last().unwrap()), (0.0, 2.95));
        assert!(!times.contains(&2.97));
    }

    #[test]
    fn a_stop_inside_the_horizon_is_a_sample_and_then_nothing_until_the_end() {
        let (_, times) = sampled(10.0, 0.0, -8.0, 5.0);
        let tail = &times[times.len() - 3..];
        close(tail[0], 1.2);
        assert_eq!(tail[1..], [1.25, 5.0]);
    }

    #[test]
    fn published_twists() {
        let (direction, turn) = turn_per_metre(Vector2::new(3.0, 4.0), 10.0);
        close(direction.x, 0.6);
        close(direction.y, 0.8);
        close(turn, 2.0);
        assert_eq!(turn_per_metre(Vector2::new(1e-7, 0.0), 5.0), (Vector2::zeros(), 0.0));
    }

    #[test]
    fn published_arcs() {
        let origin = PlanarPose::new(0.0, 0.0, 0.0);
        let x = Vector2::new(1.0, 0.0);
        let check = |pose: PlanarPose, (px, py, yaw): (f64, f64, f64)| {
            close(pose.position.x, px);
            close(pose.position.y, py);
            assert!((pose.heading - Vector2::new(yaw.cos(), yaw.sin())).norm() < 1e-9);
        };
        check(arc_pose(&origin, x, 0.0, 2.0), (2.0, 0.0, 0.0));
        check(arc_pose(&origin, x, FRAC_PI_2, 1.0), (2.0 / PI, 2.0 / PI, FRAC_PI_2));
        let north = PlanarPose::new(1000.0, 2000.0, FRAC_PI_2);
        for d in [0.0, 1.0, 2.0] {
            check(arc_pose(&north, x, 0.0, d), (1000.0, 2000.0 + d, FRAC_PI_2));
            let turned = arc_pose(&north, Vector2::new(0.8, 0.6), FRAC_PI_4, d);
            let yaw = FRAC_PI_2 + FRAC_PI_4 * d;
            assert!((turned.heading - Vector2::new(yaw.cos(), yaw.sin())).norm() < 1e-9);
        }
        let r = 4.0 / PI;
        let on_circle = PlanarPose::new(r / 2_f64.sqrt(), r / 2_f64.sqrt(), 3.0 * FRAC_PI_4);
        check(arc_pose(&on_circle, x, FRAC_PI_4, 1.0), (0.0, r, PI));
        check(
            arc_pose(&on_circle, x, FRAC_PI_4, 2.0),
            (-r / 2_f64.sqrt(), r / 2_f64.sqrt(), 5.0 * FRAC_PI_4),
        );
        // the series meets the closed form
        let (below, above) =
            (arc_pose(&origin, x, 0.999_999e-4, 1.0), arc_pose(&origin, x, 1.000_001e-4, 1.0));
        assert!((below.position - above.position).norm() < 1e-9);
    }
}
