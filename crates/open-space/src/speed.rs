//! How fast along a path of one gear: positions, speeds and accelerations over time, from the start of the path to rest
//! at its exact end.
//!
//! A profile is a chain of pieces of constant jerk. It keeps the limits of speed, acceleration and jerk, and the speed
//! caps along the path (where the steering must move, the vehicle waits for it), at every instant and not only at
//! samples. Everything here is positive along the travel; the gear is the caller's.

mod cap;
mod parameters;
mod piecewise_jerk;
mod rounds;
mod s_curve;

use thiserror::Error;

pub use cap::SpeedCap;
pub use parameters::SpeedParameters;
pub(crate) use s_curve::rest_to_rest;

use crate::interruption::Patience;
use crate::tolerance::PROFILE_END;
use rounds::Rounds;

/// Limits of a motion along a path. All are positive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpeedLimits {
    /// m/s.
    pub max_speed_mps: f64,
    /// Of speeding up and braking, m/s².
    pub max_acceleration_mps2: f64,
    /// m/s³.
    pub max_jerk_mps3: f64,
}

/// Why there is no speed profile.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum SpeedError {
    /// Rolling faster than the limit or than the steering can follow.
    #[error(
        "the vehicle rolls at {speed_mps:.3} m/s, but the path allows {allowed_mps:.3} m/s at its start; brake first"
    )]
    TooFastAtStart {
        /// At the start of the path.
        speed_mps: f64,
        /// There.
        allowed_mps: f64,
    },
    /// The limits of acceleration and jerk do not bring the vehicle to rest before the end of the path.
    #[error(
        "a vehicle at {speed_mps:.3} m/s cannot stop within {length_m:.3} m of path by its limits; brake first or allow more jerk"
    )]
    CannotStop {
        /// At the start of the path.
        speed_mps: f64,
        /// Of the path.
        length_m: f64,
    },
}

/// State along a path at one instant.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SpeedState {
    /// Distance from the start of the path, m.
    pub position_m: f64,
    /// m/s.
    pub speed_mps: f64,
    /// m/s².
    pub acceleration_mps2: f64,
}

impl SpeedState {
    /// State after `time_s` of constant `jerk_mps3`.
    fn after(&self, time_s: f64, jerk_mps3: f64) -> Self {
        let (t, v, a, j) = (time_s, self.speed_mps, self.acceleration_mps2, jerk_mps3);
        Self {
            position_m: self.position_m + t * (v + t * (a / 2.0 + t * j / 6.0)),
            speed_mps: v + t * (a + t * j / 2.0),
            acceleration_mps2: a + t * j,
        }
    }
}

/// A piece of constant jerk.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Piece {
    begin: SpeedState,
    duration_s: f64,
    jerk_mps3: f64,
}

impl Piece {
    /// Highest speed in it.
    fn top_speed(&self) -> f64 {
        let end = self.begin.after(self.duration_s, self.jerk_mps3);
        let ends = self.begin.speed_mps.max(end.speed_mps);
        if self.begin.acceleration_mps2 > 0.0 && end.acceleration_mps2 < 0.0 {
            ends.max(
                self.begin.after(-self.begin.acceleration_mps2 / self.jerk_mps3, self.jerk_mps3).speed_mps,
            )
        } else {
            ends
        }
    }
}

/// Motion along a path over time, ending at rest.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SpeedProfile {
    pieces: Vec<Piece>,
    end: SpeedState,
}

impl SpeedProfile {
    /// From the state at the start and pieces of duration (s) and jerk (m/s³).
    fn new(start: SpeedState, pieces: impl IntoIterator<Item = (f64, f64)>) -> Self {
        let mut end = start;
        let pieces = pieces
            .into_iter()
            .map(|(duration_s, jerk_mps3)| {
                let begin = end;
                end = begin.after(duration_s, jerk_mps3);
                Piece { begin, duration_s, jerk_mps3 }
            })
            .collect();
        Self { pieces, end }
    }

    /// From the start to rest, s.
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        self.pieces.iter().map(|piece| piece.duration_s).sum()
    }

    /// Distance travelled, m.
    #[must_use]
    pub fn length_m(&self) -> f64 {
        self.end.position_m
    }

    /// Highest speed at any time, m/s.
    #[must_use]
    pub fn top_speed_mps(&self) -> f64 {
        self.pieces.iter().fold(0.0, |most, piece| most.max(piece.top_speed()))
    }

    /// Time since the start and state at both ends of each piece and evenly in between, `longest_s` apart at most.
    pub(crate) fn samples(&self, longest_s: f64) -> impl Iterator<Item = (f64, SpeedState)> + '_ {
        let mut elapsed_s = 0.0;
        let end = (self.duration_s(), self.end);
        self.pieces
            .iter()
            .flat_map(move |piece| {
                let begin_s = elapsed_s;
                elapsed_s += piece.duration_s;
                let parts = (piece.duration_s / longest_s).ceil().max(1.0);
                (0..parts as usize).map(move |k| {
                    let time_s = piece.duration_s * k as f64 / parts;
                    let state = piece.begin.after(time_s, piece.jerk_mps3);
                    // The solver may leave a rest that goes back by some micrometres per second.
                    (begin_s + time_s, SpeedState { speed_mps: state.speed_mps.max(0.0), ..state })
                })
            })
            .chain(std::iter::once(end))
    }

    /// The same motion, `factor` times as slow.
    fn stretched(&self, factor: f64) -> Self {
        let stretch = |state: &SpeedState| SpeedState {
            position_m: state.position_m,
            speed_mps: state.speed_mps / factor,
            acceleration_mps2: state.acceleration_mps2 / (factor * factor),
        };
        let pieces = self.pieces.iter().map(|piece| Piece {
            begin: stretch(&piece.begin),
            duration_s: piece.duration_s * factor,
            jerk_mps3: piece.jerk_mps3 / (factor * factor * factor),
        });
        Self { pieces: pieces.collect(), end: stretch(&self.end) }
    }

    /// By how much the motion must be slowed down to keep `limits` and `cap` everywhere; below 1 it has room left.
    fn excess(&self, limits: &SpeedLimits, cap: &SpeedCap) -> f64 {
        let jerk = self.pieces.iter().fold(0.0_f64, |most, piece| most.max(piece.jerk_mps3.abs()));
        let least = (jerk / limits.max_jerk_mps3).cbrt().max(self.top_speed_mps() / limits.max_speed_mps);
        let mut before = SpeedState::default();
        self.samples(EXCESS_STEP_S).fold(least, |most, (_, state)| {
            let acceleration = (state.acceleration_mps2.abs() / limits.max_acceleration_mps2).sqrt();
            // A cap may begin anywhere between two instants.
            let cap = cap.lowest_between(before.position_m, state.position_m);
            let speed = state.speed_mps.max(before.speed_mps) / cap;
            before = state;
            most.max(acceleration).max(speed)
        })
    }

    /// Sets the end to exactly `length_m`, at rest, by scaling what the solver left; `None` when that is more than
    /// its tolerance.
    fn ending_at(mut self, length_m: f64) -> Option<Self> {
        let off = [self.end.position_m - length_m, self.end.speed_mps, self.end.acceleration_mps2];
        if !off.iter().all(|off| off.abs() <= PROFILE_END) {
            return None;
        }
        self.end = SpeedState { position_m: length_m, ..SpeedState::default() };
        Some(self)
    }
}

/// Time between the instants at which a finished profile is held against the caps, s.
const EXCESS_STEP_S: f64 = 0.01;

/// Fastest comfortable motion along the path that `cap` is for, from `start` (at the path's start, moving along it or
/// standing) to rest at its end. `patience` is asked before each program but the first that a rolling start needs: the best
/// there is then is the answer.
///
/// # Errors
/// Rolling too fast for the path, or for stopping before its end. From standstill there is always a profile.
pub fn plan_speed(
    cap: &SpeedCap,
    start: SpeedState,
    limits: &SpeedLimits,
    parameters: &SpeedParameters,
    patience: &mut dyn Patience,
) -> Result<SpeedProfile, SpeedError> {
    let allowed_mps = cap.at(0.0).min(limits.max_speed_mps);
    if start.speed_mps > allowed_mps {
        return Err(SpeedError::TooFastAtStart { speed_mps: start.speed_mps, allowed_mps });
    }
    if start.speed_mps == 0.0 && cap.is_uniform() {
        return Ok(rest_to_rest(cap.length_m(), &SpeedLimits { max_speed_mps: allowed_mps, ..*limits }));
    }
    Rounds::new(cap, start, limits, parameters).run(patience)
}

#[cfg(test)]
mod tests;
