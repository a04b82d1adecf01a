//! Solves the speed program again and again: with caps about where the vehicle is when, and a horizon cut to fit.

use super::piecewise_jerk::{CapLine, PiecewiseJerkProblem};
use super::{SpeedCap, SpeedError, SpeedLimits, SpeedParameters, SpeedProfile, SpeedState};
use crate::interruption::{Patience, Watch, is_cancelled};
use crate::tolerance::SPEED_GAIN;

/// Most programs solved for one profile.
const ROUNDS: usize = 10;
/// Longest time between knots, s.
const SPACING_S: f64 = 0.2;
/// Fewest knots for the shortest possible motion.
const FEWEST_INTERVALS: f64 = 10.0;
/// Distance from the end at which the vehicle has arrived and only has to come to rest, m.
const ARRIVAL_M: f64 = 0.1;
/// Longest horizon that is tried, s.
const LONGEST_HORIZON_S: f64 = 900.0;

/// The data of all rounds.
#[derive(Debug)]
pub(super) struct Rounds<'a> {
    cap: &'a SpeedCap,
    start: SpeedState,
    limits: &'a SpeedLimits,
    parameters: &'a SpeedParameters,
    spacing_s: f64,
}

impl<'a> Rounds<'a> {
    pub(super) fn new(
        cap: &'a SpeedCap,
        start: SpeedState,
        limits: &'a SpeedLimits,
        parameters: &'a SpeedParameters,
    ) -> Self {
        let shortest_s = super::rest_to_rest(cap.length_m(), limits).duration_s();
        Self { cap, start, limits, parameters, spacing_s: SPACING_S.min(shortest_s / FEWEST_INTERVALS) }
    }

    pub(super) fn run(&self, patience: &mut dyn Patience) -> Result<SpeedProfile, SpeedError> {
        let mut positions = self.cap.fastest(self.start.speed_mps, self.limits, self.spacing_s);
        let mut intervals = positions.len() * 3 / 2 + self.intervals(self.settling_s());
        let mut solved_intervals = None;
        let mut caution = 1.0;
        let mut best = self.steady();
        let mut last_s = f64::INFINITY;
        for _ in 0..ROUNDS {
            let watch = patience.watch();
            if is_cancelled(watch.as_ref()) || best.is_some() && patience.ends() {
                break;
            }
            let Some((profile, next)) = self.solve(&positions, intervals, caution, watch) else {
                intervals = match solved_intervals {
                    Some(solved) if intervals + 1 < solved => (intervals + solved).div_ceil(2),
                    Some(_) => break,
                    None => 2 * intervals,
                };
                if intervals as f64 * self.spacing_s > LONGEST_HORIZON_S {
                    break;
                }
                continue;
            };
            positions = next;
            solved_intervals = Some(intervals);
            let arrival = positions.iter().take_while(|s| **s < self.cap.length_m() - ARRIVAL_M).count();
            intervals = intervals.min(arrival + self.intervals(self.settling_s()));
            let excess = profile.excess(self.limits, self.cap);
            let profile = if excess <= 1.0 {
                profile
            } else if self.start.speed_mps == 0.0 {
                profile.stretched(excess)
            } else {
                caution /= 1.02 * excess;
                continue;
            };
            let before_s = last_s;
            last_s = profile.duration_s();
            if best.as_ref().is_none_or(|best| last_s < best.duration_s()) {
                best = Some(profile);
            }
            if last_s > (1.0 - SPEED_GAIN) * before_s {
                break;
            }
        }
        let (speed_mps, length_m) = (self.start.speed_mps, self.cap.length_m());
        best.ok_or(SpeedError::CannotStop { speed_mps, length_m })
    }

    /// From rest, never faster than the slowest place of the path allows. What takes longer is not worth having.
    fn steady(&self) -> Option<SpeedProfile> {
        let limits = SpeedLimits { max_speed_mps: self.cap.lowest_mps(), ..*self.limits };
        (self.start.speed_mps == 0.0).then(|| super::rest_to_rest(self.cap.length_m(), &limits))
    }

    /// Time to come to rest from where the vehicle has arrived, generously, s.
    fn settling_s(&self) -> f64 {
        let by_jerk = (6.0 * ARRIVAL_M / self.limits.max_jerk_mps3).cbrt();
        let by_acceleration = (2.0 * ARRIVAL_M / self.limits.max_acceleration_mps2).sqrt();
        1.3 * by_jerk.max(by_acceleration)
    }

    fn intervals(&self, duration_s: f64) -> usize {
        (duration_s / self.spacing_s).ceil() as usize
    }

    /// One program, with caps taken where the vehicle was at each knot before.
    fn solve(
        &self,
        before: &[f64],
        intervals: usize,
        caution: f64,
        watch: Option<Watch>,
    ) -> Option<(SpeedProfile, Vec<f64>)> {
        let last = before.last().copied().unwrap_or_default();
        let caps: Vec<CapLine> = (0..=intervals)
            .map(|k| {
                let at_m = before.get(k).copied().unwrap_or(last).clamp(0.0, self.cap.length_m());
                let (value_mps, slope_per_s) = self.cap.tangent(at_m);
                CapLine { at_m, value_mps: caution * value_mps, slope_per_s: caution * slope_per_s }
            })
            .collect();
        let problem = PiecewiseJerkProblem {
            start: self.start,
            length_m: self.cap.length_m(),
            intervals,
            spacing_s: self.spacing_s,
            limits: *self.limits,
            parameters: *self.parameters,
            caps: &caps,
        };
        let states = problem.solve(watch)?;
        let jerks = states
            .windows(2)
            .map(|pair| (pair[1].acceleration_mps2 - pair[0].acceleration_mps2) / self.spacing_s);
        let profile = SpeedProfile::new(self.start, jerks.map(|jerk| (self.spacing_s, jerk)));
        let positions = states.iter().map(|state| state.position_m).collect();
        Some((profile.ending_at(self.cap.length_m())?, positions))
    }
}
