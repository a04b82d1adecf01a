//! How far a vehicle still travels when it brakes: a reaction delay at its present acceleration, a ramp of constant
//! jerk to the braking deceleration, then that deceleration until it stands.

use crate::tolerance::BRAKING;

/// Distance to standstill \[m\], never negative (`autoware_motion_utils::calculate_stop_distance`).
///
/// * `speed_mps`: forward speed; at zero or below the vehicle already stands.
/// * `acceleration_mps2`: present acceleration, held during the delay. A vehicle that already brakes harder than
///   `deceleration_mps2` keeps doing so.
/// * `deceleration_mps2`, `jerk_mps3`: limits of the braking; their signs do not matter.
/// * `delay_s`: time before braking begins; a negative one is none.
///
/// `None` when these limits never stop the vehicle: a deceleration or jerk of (nearly) zero, or an argument that is
/// not finite (upstream answers 0 m for some of the latter, which would pass for standing still).
#[must_use]
pub fn calculate_stop_distance(
    speed_mps: f64,
    acceleration_mps2: f64,
    deceleration_mps2: f64,
    jerk_mps3: f64,
    delay_s: f64,
) -> Option<f64> {
    let arguments = [speed_mps, acceleration_mps2, deceleration_mps2, jerk_mps3, delay_s];
    if !arguments.iter().all(|argument| argument.is_finite()) {
        return None;
    }
    if speed_mps <= 0.0 {
        return Some(0.0);
    }
    let jerk = -jerk_mps3.abs();
    let braking = (-deceleration_mps2.abs()).min(acceleration_mps2);
    if jerk >= -BRAKING || braking >= -BRAKING {
        return None;
    }

    let delay = delay_s.max(0.0);
    let after_delay =
        Motion { distance: 0.0, speed: speed_mps, acceleration: acceleration_mps2 }.after(delay, 0.0);
    if after_delay.speed <= 0.0 && acceleration_mps2.abs() >= BRAKING {
        let stop = -speed_mps / acceleration_mps2;
        return Some((speed_mps * stop + 0.5 * acceleration_mps2 * stop * stop).max(0.0));
    }

    let ramp = ((braking - acceleration_mps2) / jerk).max(0.0);
    let after_ramp = after_delay.after(ramp, jerk);
    if after_ramp.speed <= 0.0 {
        let discriminant = acceleration_mps2 * acceleration_mps2 - 2.0 * jerk * after_delay.speed;
        if discriminant < 0.0 {
            return None;
        }
        let stop = (-(acceleration_mps2 + discriminant.sqrt()) / jerk).max(0.0);
        return Some(after_delay.after(stop, jerk).distance.max(0.0));
    }
    Some((after_ramp.distance - after_ramp.speed * after_ramp.speed / (2.0 * braking)).max(0.0))
}

/// State of a point moving along a line.
#[derive(Clone, Copy)]
struct Motion {
    distance: f64,
    speed: f64,
    acceleration: f64,
}

impl Motion {
    /// The state `t` seconds later under constant jerk.
    fn after(self, t: f64, jerk: f64) -> Self {
        let Self { distance, speed, acceleration } = self;
        Self {
            distance: distance + speed * t + 0.5 * acceleration * t * t + jerk * t * t * t / 6.0,
            speed: speed + acceleration * t + 0.5 * jerk * t * t,
            acceleration: acceleration + jerk * t,
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn upstream_tables() {
        let close = 1e-9;
        let printed = 5e-7;
        type Row = (f64, f64, f64, f64, f64, Option<f64>, f64);
        let cases: [Row; 25] = [
            // boundary departure checker
            (10.0, 0.0, -4.0, -5.0, 1.0, Some(26.393_333_333_333_334), close),
            (10.0, 0.0, -4.0, -10.0, 1.0, Some(24.473_333_333_333_33), close),
            (10.0, 0.0, -4.0, -5.0, 0.5, Some(21.393_333_333_333_334), close),
            (3.0, -1.0, -4.0, -5.0, 1.0, Some(3.371_25), close),
            (1.0, -2.0, -4.0, -5.0, 1.0, Some(0.25), close),
            (10.0, -6.0, -4.0, -5.0, 0.0, Some(8.333_333_333_333_334), close),
            (5.0, 1.0, -4.0, -5.0, 1.0, Some(13.697_916_666_666_666), close),
            // motion utils, traffic rules
            (5.0, 0.0, 1.0, 1.0, 0.0, Some(14.958_333), printed),
            (5.0, 0.0, 1.0, 1.0, 0.5, Some(17.458_333), printed),
            (5.0, 0.0, 2.0, 2.0, 0.5, Some(11.166_667), printed),
            (5.0, 0.0, 2.8, 5.0, 0.5, Some(8.327_699), printed),
            (10.0, 0.0, 2.8, 5.0, 0.5, Some(25.620_556), printed),
            (10.0, 0.0, 2.0, 2.0, 0.5, Some(34.916_667), printed),
            (10.0, 0.0, 2.0, 2.0, 1.0, Some(39.916_667), printed),
            (10.0, 0.0, 0.5, 5.0, 1.0, Some(110.499_792), printed),
            (2.0, -2.0, 5.0, 2.0, 2.0, Some(1.0), close),
            (1.0, 0.0, 0.0, 2.0, 0.0, None, close),
            (0.0, 0.0, 2.0, 2.0, 0.5, Some(0.0), close),
            (-1.0, 0.0, 2.0, 2.0, 0.5, Some(0.0), close),
            (10.0, 0.0, 0.1, 0.1, 0.0, Some(504.995_833), printed),
            (5.0, -4.0, 2.0, 2.0, 0.5, Some(3.125), close),
            (5.0, 1.5, 2.0, 2.0, 0.5, Some(20.316_081), printed),
            (0.5, 0.0, 2.0, 2.0, 0.5, Some(0.485_702), printed),
            // all but coasting, and standing before the delay is over: no ramp fits
            (1e-4, -5e-4, 4.0, 5.0, 1.0, None, close),
            (2.0, -2.0, 5.0, 2.0, -3.0, calculate_stop_distance(2.0, -2.0, 5.0, 2.0, 0.0), close),
        ];
        for (v, a, decel, jerk, delay, expected, tolerance) in cases {
            let actual = calculate_stop_distance(v, a, decel, jerk, delay);
            let row = (v, a, decel, jerk, delay);
            match (actual, expected) {
                (Some(actual), Some(expected)) => {
                    assert!(
                        (actual - expected).abs() <= tolerance,
                        "{row:?}: {actual} instead of {expected}"
                    );
                }
                _ => assert_eq!(actual, expected, "{row:?}"),
            }
        }
    }

    #[test]
    fn limits_that_never_stop_give_none() {
        for (decel, jerk) in [(1e-3, 1.0), (1.0, 1e-3), (0.0, 0.0)] {
            assert_eq!(calculate_stop_distance(1.0, 0.0, decel, jerk, 0.0), None);
        }
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            for at in 0..5 {
                let mut x = [1.0, 0.0, 1.0, 1.0, 0.1];
                x[at] = bad;
                assert_eq!(
                    calculate_stop_distance(x[0], x[1], x[2], x[3], x[4]),
                    None,
                    "argument {at} is {bad}"
                );
            }
        }
    }

    /// Braking simulated in small steps.
    fn simulated(v: f64, a: f64, decel: f64, jerk: f64, delay: f64) -> f64 {
        let dt = 1e-3;
        let braking = (-decel).min(a);
        let (mut x, mut v, mut acceleration, mut t) = (0.0, v, a, 0.0);
        while v > 0.0 {
            let before = acceleration;
            if t >= delay {
                acceleration = (acceleration - jerk * dt).max(braking);
            }
            let mean = 0.5 * (before + acceleration);
            x += v * dt + 0.5 * mean * dt * dt;
            v += mean * dt;
            t += dt;
        }
        x
    }

    proptest! {
        #[test]
        fn agrees_with_a_simulation(
            v in 0.1..20.0_f64, a in -6.0..2.0_f64, decel in 0.5..8.0_f64, jerk in 0.5..10.0_f64, delay in 0.0..1.5_f64,
        ) {
            let exact = calculate_stop_distance(v, a, decel, jerk, delay).unwrap();
            prop_assert!((exact - simulated(v, a, decel, jerk, delay)).abs() < 0.05 + 1e-3 * exact);
        }

        #[test]
        fn grows_with_speed_and_delay(
            v in 0.0..30.0_f64, dv in 0.0..10.0_f64, a in -6.0..3.0_f64,
            decel in 0.1..8.0_f64, jerk in 0.1..10.0_f64, delay in 0.0..2.0_f64,
        ) {
            let slow = calculate_stop_distance(v, a, decel, jerk, delay).unwrap();
            let fast = calculate_stop_distance(v + dv, a, decel, jerk, delay).unwrap();
            prop_assert!(slow <= fast + 1e-9, "{slow} m from {v} m/s, {fast} m from {} m/s", v + dv);
            prop_assert!(slow >= 0.0);
            let late = calculate_stop_distance(v, a, decel, jerk, delay + 0.5).unwrap();
            prop_assert!(slow <= late + 1e-9);
        }

        #[test]
        fn signs_of_the_limits_do_not_matter(v in 0.0..30.0_f64, decel in 0.1..8.0_f64, jerk in 0.1..10.0_f64) {
            prop_assert_eq!(
                calculate_stop_distance(v, 0.0, decel, jerk, 0.5),
                calculate_stop_distance(v, 0.0, -decel, -jerk, 0.5)
            );
        }
    }
}
