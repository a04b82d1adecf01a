//! Speed caps along a path.

use super::SpeedLimits;

/// Part of the acceleration limit with which caps are looked ahead to; the rest is for the jerk limit's sake.
const LOOK_AHEAD: f64 = 0.7;

/// Highest speed along a path: one number for each of its equal steps.
#[derive(Clone, Debug, PartialEq)]
pub struct SpeedCap {
    step_m: f64,
    steps_mps: Vec<f64>,
    /// Highest speed at the ends of the steps, such that following it keeps the acceleration it was made for.
    ends_mps: Vec<f64>,
}

impl SpeedCap {
    /// Caps for at least one step of `step_m`, all positive.
    #[must_use]
    pub fn new(step_m: f64, steps_mps: Vec<f64>, limits: &SpeedLimits) -> Self {
        let count = steps_mps.len();
        let mut ends_mps: Vec<f64> = (0..=count)
            .map(|k| steps_mps[k.saturating_sub(1)].min(steps_mps[k.min(count.saturating_sub(1))]))
            .collect();
        limit_slope(&mut ends_mps, step_m, LOOK_AHEAD * limits.max_acceleration_mps2);
        Self { step_m, steps_mps, ends_mps }
    }

    /// Of the path, m.
    #[must_use]
    pub fn length_m(&self) -> f64 {
        self.step_m * self.steps_mps.len() as f64
    }

    /// Whether all caps are equal.
    #[must_use]
    pub fn is_uniform(&self) -> bool {
        self.steps_mps.windows(2).all(|pair| pair[0] == pair[1])
    }

    /// Smallest cap, m/s.
    #[must_use]
    pub fn lowest_mps(&self) -> f64 {
        self.steps_mps.iter().fold(f64::INFINITY, |lowest, cap| lowest.min(*cap))
    }

    /// Cap at `position_m`; the first or last one before the start or beyond the end.
    #[must_use]
    pub fn at(&self, position_m: f64) -> f64 {
        self.steps_mps[self.step(position_m)]
    }

    /// Lowest cap from `from_m` to `to_m`, which is not before it.
    pub(super) fn lowest_between(&self, from_m: f64, to_m: f64) -> f64 {
        let steps = &self.steps_mps[self.step(from_m)..=self.step(to_m.max(from_m))];
        steps.iter().fold(f64::INFINITY, |lowest, cap| lowest.min(*cap))
    }

    fn step(&self, position_m: f64) -> usize {
        ((position_m / self.step_m).max(0.0) as usize).min(self.steps_mps.len() - 1)
    }

    /// Tangent of the cap that looks ahead: its value at `position_m`, and its slope there, 1/s.
    pub(super) fn tangent(&self, position_m: f64) -> (f64, f64) {
        let step = self.step(position_m);
        let slope = (self.ends_mps[step + 1] - self.ends_mps[step]) / self.step_m;
        (self.ends_mps[step] + slope * (position_m - step as f64 * self.step_m), slope)
    }

    /// Positions at multiples of `spacing_s` of a vehicle that drives as fast as it may, beginning with
    /// `start_speed_mps` and stopping at the end, with a part of the acceleration limit and no limit of jerk.
    pub(super) fn fastest(&self, start_speed_mps: f64, limits: &SpeedLimits, spacing_s: f64) -> Vec<f64> {
        let acceleration_mps2 = LOOK_AHEAD * limits.max_acceleration_mps2;
        let mut speeds = self.ends_mps.clone();
        if let (Some(first), true) = (speeds.first_mut(), self.ends_mps.len() > 1) {
            *first = first.min(start_speed_mps);
        }
        if let Some(last) = speeds.last_mut() {
            *last = 0.0;
        }
        limit_slope(&mut speeds, self.step_m, acceleration_mps2);
        // A path of one step has no speed at either end.
        let slowest = (acceleration_mps2 * self.step_m).sqrt() / 2.0;
        let (mut positions, mut elapsed_s) = (vec![0.0], 0.0);
        for (k, pair) in speeds.windows(2).enumerate() {
            let mean = if pair[0] + pair[1] > 0.0 { (pair[0] + pair[1]) / 2.0 } else { slowest };
            let end_s = elapsed_s + self.step_m / mean;
            while positions.len() as f64 * spacing_s < end_s {
                let ratio = (positions.len() as f64 * spacing_s - elapsed_s) / (end_s - elapsed_s);
                positions.push((k as f64 + ratio) * self.step_m);
            }
            elapsed_s = end_s;
        }
        positions.push(self.length_m());
        positions
    }
}

/// Lowers speeds at points `step_m` apart until no neighbours differ by more than `acceleration_mps2` allows.
fn limit_slope(speeds: &mut [f64], step_m: f64, acceleration_mps2: f64) {
    let gain = 2.0 * acceleration_mps2 * step_m;
    for k in 1..speeds.len() {
        speeds[k] = speeds[k].min((speeds[k - 1] * speeds[k - 1] + gain).sqrt());
    }
    for k in (1..speeds.len()).rev() {
        speeds[k - 1] = speeds[k - 1].min((speeds[k] * speeds[k] + gain).sqrt());
    }
}
