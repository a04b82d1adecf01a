//! What is measured of the vehicle, and where a kinematic bicycle at constant acceleration and curvature carries it.
//!
//! The reference point is the middle of the rear axle. The model keeps curvature and acceleration, lets the speed
//! change its sign and does not normalise the heading.

use crate::pose::{Gear, PlanarPose};

/// Length of an integration step, s.
const STEP_S: f64 = 0.06;

/// A remainder shorter than this (s) is added to the step before it.
const REMAINDER_S: f64 = 1e-8;

/// No prediction goes further than this, s: bounds the work for any argument.
pub const LONGEST_HORIZON_S: f64 = 10_000.0;

/// Below this speed (m/s) a yaw rate says nothing about curvature.
const CURVATURE_SPEED_MPS: f64 = 0.1;

/// Motion of the vehicle as measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VehicleState {
    /// Pose of the middle of the rear axle.
    pub pose: PlanarPose,
    /// Height of that point, m.
    pub z: f64,
    /// Curvature of its path, positive to the left, 1/m.
    pub curvature: f64,
    /// Along the heading, negative in reverse, m/s.
    pub speed_mps: f64,
    /// Rate of change of the speed, m/s².
    pub acceleration_mps2: f64,
    /// Gear that is engaged.
    pub gear: Gear,
    /// Whether the vehicle drives itself; false in manual driving.
    pub automatic: bool,
}

impl VehicleState {
    /// Standing at a pose on level ground, wheels straight, in forward gear, about to drive itself.
    #[must_use]
    pub fn standing_at(pose: PlanarPose) -> Self {
        Self {
            pose,
            z: 0.0,
            curvature: 0.0,
            speed_mps: 0.0,
            acceleration_mps2: 0.0,
            gear: Gear::Forward,
            automatic: true,
        }
    }

    /// Whether pose, curvature, speed and acceleration are finite.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        self.pose.is_finite()
            && [self.z, self.curvature, self.speed_mps, self.acceleration_mps2]
                .iter()
                .all(|number| number.is_finite())
    }
}

/// Curvature \[1/m\] of the path of a vehicle that turns at a yaw rate \[rad/s\] while it drives at a speed \[m/s\]; 0
/// below 0.1 m/s, where the ratio is noise.
#[must_use]
pub fn curvature_from_yaw_rate(yaw_rate_rps: f64, speed_mps: f64) -> f64 {
    if speed_mps.abs() < CURVATURE_SPEED_MPS { 0.0 } else { yaw_rate_rps / speed_mps }
}

/// The state after `horizon_s` seconds. A horizon that is not positive changes nothing; one beyond
/// [`LONGEST_HORIZON_S`] is cut there.
#[must_use]
pub fn predict(horizon_s: f64, state: &VehicleState) -> VehicleState {
    let mut predicted = *state;
    if horizon_s.is_nan() || horizon_s <= 0.0 {
        return predicted;
    }
    let mut remaining_s = horizon_s.min(LONGEST_HORIZON_S);
    let step_s = STEP_S.min(remaining_s);
    loop {
        let left_s = remaining_s - step_s;
        if left_s < REMAINDER_S {
            // The last step lands on the horizon exactly.
            advance(&mut predicted, remaining_s);
            return predicted;
        }
        advance(&mut predicted, step_s);
        remaining_s = left_s;
    }
}

fn advance(state: &mut VehicleState, step_s: f64) {
    let (v, a, curvature) = (state.speed_mps, state.acceleration_mps2, state.curvature);
    let distance_m = step_s * (v + 0.5 * step_s * a);
    let middle_yaw = state.pose.yaw + 0.5 * step_s * v * curvature;
    state.pose.x += distance_m * middle_yaw.cos();
    state.pose.y += distance_m * middle_yaw.sin();
    state.pose.yaw += distance_m * curvature;
    state.speed_mps = v + step_s * a;
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn state(x: f64, y: f64, yaw: f64, v: f64, a: f64, curvature: f64) -> VehicleState {
        VehicleState {
            pose: PlanarPose::new(x, y, yaw),
            z: 0.5,
            curvature,
            speed_mps: v,
            acceleration_mps2: a,
            gear: Gear::Forward,
            automatic: true,
        }
    }

    fn assert_state(actual: &VehicleState, [x, y, yaw, v]: [f64; 4], tolerance: f64) {
        let found = [actual.pose.x, actual.pose.y, actual.pose.yaw, actual.speed_mps];
        for (found, expected) in found.into_iter().zip([x, y, yaw, v]) {
            assert!((found - expected).abs() < tolerance, "{found} instead of {expected} in {actual:?}");
        }
    }

    #[test]
    fn known_predictions_over_a_tenth_of_a_second() {
        let left = predict(0.1, &state(0.0, 0.0, 0.0, 1.0, 1.0, 0.1));
        assert_state(&left, [0.104_998_233_885, 0.000_543_955_605, 0.0105, 1.1], 1e-12);
        let reverse = predict(0.1, &state(10.0, -3.0, 1.0, -1.0, 0.5, -0.15));
        assert_state(&reverse, [9.947_926_545_987, -3.082_428_667_805, 1.014_625, -0.95], 1e-12);
        assert_eq!((left.z, left.curvature, left.acceleration_mps2), (0.5, 0.1, 1.0));
    }

    /// A recorded state and the one that was measured a tenth of a second later: within 2 cm, 2 cm/s and 1e-3 rad.
    #[test]
    fn recorded_drive() {
        let curvature = curvature_from_yaw_rate(-0.163_961_347_742_344_33, 1.613_888_9);
        let before = state(
            587_202.105_197_985_2,
            4_141_420.786_899_511_7,
            -0.396_601_758_018_448_9,
            1.613_888_9,
            -0.030_965_788_190_627_622,
            curvature,
        );
        let after = predict(1_548_201_255.95 - 1_548_201_255.85, &before);
        let found = [after.pose.x, after.pose.y, after.pose.yaw];
        let ours = [587_202.253_400_689_8, 4_141_420.723_401_190_2, -0.412_982_186_5];
        let measured = [587_202.257_076_572_3, 4_141_420.735_782_941_3, -0.413_778_940_293_078_7];
        for (i, tolerance) in [2e-2, 2e-2, 1e-3].into_iter().enumerate() {
            assert!((found[i] - ours[i]).abs() < 1e-8, "{found:?}");
            assert!((found[i] - measured[i]).abs() < tolerance, "{found:?}");
        }
        assert!((after.speed_mps - 1.610_792_3).abs() < 1e-7);
    }

    #[test]
    fn a_yaw_rate_at_walking_pace_and_below() {
        for (speed, expected) in [(0.1, 0.5), (-0.1, -0.5), (0.099_999, 0.0), (-0.05, 0.0), (0.0, 0.0)] {
            assert_eq!(curvature_from_yaw_rate(0.05, speed), expected, "at {speed} m/s");
        }
    }

    #[test]
    fn no_time_no_motion_and_no_endless_loop() {
        let start = state(1.0, 2.0, 3.0, 1.0, 0.0, 0.0);
        for horizon_s in [0.0, -1.0, f64::NAN, f64::NEG_INFINITY] {
            assert_eq!(predict(horizon_s, &start), start);
        }
        assert_eq!(predict(f64::INFINITY, &start), predict(LONGEST_HORIZON_S, &start));
    }

    proptest! {
        #[test]
        fn speed_and_turn_follow_from_time_alone(
            horizon_s in 1e-6..5.0_f64, v in -3.0..3.0_f64, a in -2.0..2.0_f64, curvature in -0.2..0.2_f64,
        ) {
            let end = predict(horizon_s, &state(0.0, 0.0, 0.3, v, a, curvature));
            prop_assert!((end.speed_mps - (v + a * horizon_s)).abs() < 1e-9);
            let distance_m = v * horizon_s + 0.5 * a * horizon_s * horizon_s;
            prop_assert!((end.pose.yaw - 0.3 - distance_m * curvature).abs() < 1e-9);
        }

        #[test]
        fn a_steady_turn_stays_on_its_circle(
            horizon_s in 1e-3..5.0_f64, v in 0.2..3.0_f64, radius_m in 5.0..50.0_f64,
        ) {
            let end = predict(horizon_s, &state(0.0, 0.0, 0.0, v, 0.0, 1.0 / radius_m));
            // Chords of 6 hundredths of a second are shorter than their arcs by a part in 1e5 at most.
            prop_assert!((end.pose.x.hypot(end.pose.y - radius_m) - radius_m).abs() < 1e-4 * v * horizon_s);
        }

        #[test]
        fn moving_the_scene_moves_the_prediction(
            horizon_s in 1e-3..3.0_f64, v in -3.0..3.0_f64, a in -1.0..1.0_f64, curvature in -0.2..0.2_f64,
            turn in -3.0..3.0_f64, x in -1e3..1e3_f64,
        ) {
            let here = predict(horizon_s, &state(0.0, 0.0, 0.0, v, a, curvature)).pose;
            let there = predict(horizon_s, &state(x, -x, turn, v, a, curvature)).pose;
            prop_assert!((there.x - (x + here.x * turn.cos() - here.y * turn.sin())).abs() < 1e-9);
            prop_assert!((there.y - (-x + here.x * turn.sin() + here.y * turn.cos())).abs() < 1e-9);
        }
    }
}
