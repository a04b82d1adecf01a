//! The speed of one gear part as a quadratic program over evenly spaced knots with constant jerk between them.

use super::{SpeedLimits, SpeedParameters, SpeedState};
use crate::convex_program::ConvexProgram;
use crate::interruption::Watch;
use crate::tolerance::SOLVER_ROOM;

/// `speed <= value + slope * (position - at)`, with a heavy price on what goes beyond.
#[derive(Clone, Copy, Debug)]
pub(super) struct CapLine {
    pub(super) at_m: f64,
    pub(super) value_mps: f64,
    pub(super) slope_per_s: f64,
}

/// From `start` at position 0 to rest at `length_m` after `intervals * spacing_s`.
#[derive(Clone, Copy, Debug)]
pub(super) struct PiecewiseJerkProblem<'a> {
    pub(super) start: SpeedState,
    pub(super) length_m: f64,
    pub(super) intervals: usize,
    pub(super) spacing_s: f64,
    pub(super) limits: SpeedLimits,
    pub(super) parameters: SpeedParameters,
    /// One for each knot, or none at all.
    pub(super) caps: &'a [CapLine],
}

impl PiecewiseJerkProblem<'_> {
    /// States at the knots, `None` when the horizon is too short, the solver fails or `watch` breaks it off.
    pub(super) fn solve(&self, watch: Option<Watch>) -> Option<Vec<SpeedState>> {
        let knots = self.intervals + 1;
        let mut program = ConvexProgram::new(3 * knots + self.caps.len());
        self.add_costs(&mut program);
        self.add_motion(&mut program);
        self.add_limits(&mut program);
        self.add_caps(&mut program);
        let x = program.solve(watch)?;
        let state = |k| SpeedState {
            position_m: x[position(k)],
            speed_mps: x[speed(k)],
            acceleration_mps2: x[acceleration(k)],
        };
        Some((0..knots).map(state).collect())
    }

    fn add_costs(&self, program: &mut ConvexProgram) {
        let parameters = &self.parameters;
        let jerk = parameters.jerk_weight / (self.spacing_s * self.spacing_s);
        for k in 0..=self.intervals {
            program.add_square(parameters.ref_s_weight, (&[(position(k), 1.0)], -self.length_m));
            program.add_square(parameters.acc_weight, (&[(acceleration(k), 1.0)], 0.0));
        }
        for k in 0..self.intervals {
            let (from, to) = ((acceleration(k), -1.0), (acceleration(k + 1), 1.0));
            if parameters.pjso_drop_jerk_cross_terms {
                program.add_square(jerk, (&[from], 0.0));
                program.add_square(jerk, (&[to], 0.0));
            } else {
                program.add_square(jerk, (&[from, to], 0.0));
            }
        }
    }

    /// Both ends, and what constant jerk makes of each interval.
    fn add_motion(&self, program: &mut ConvexProgram) {
        let (start, last, dt) = (&self.start, self.intervals, self.spacing_s);
        for (variable, value) in [
            (position(0), start.position_m),
            (speed(0), start.speed_mps),
            (acceleration(0), start.acceleration_mps2),
            (position(last), self.length_m),
            (speed(last), 0.0),
            (acceleration(last), 0.0),
        ] {
            program.zero((&[(variable, 1.0)], -value));
        }
        for k in 0..last {
            let (a, next) = (acceleration(k), acceleration(k + 1));
            let half = -dt / 2.0;
            program.zero((&[(speed(k + 1), 1.0), (speed(k), -1.0), (a, half), (next, half)], 0.0));
            program.zero((
                &[
                    (position(k + 1), 1.0),
                    (position(k), -1.0),
                    (speed(k), -dt),
                    (a, -dt * dt / 3.0),
                    (next, -dt * dt / 6.0),
                ],
                0.0,
            ));
        }
    }

    /// The ends are given and have no limits of their own.
    fn add_limits(&self, program: &mut ConvexProgram) {
        let top = self.limits.max_speed_mps * SOLVER_ROOM;
        let most = self.limits.max_acceleration_mps2 * SOLVER_ROOM;
        let step = self.limits.max_jerk_mps3 * SOLVER_ROOM * self.spacing_s;
        for k in 1..self.intervals {
            program.within(speed(k), 0.0, top);
            program.within(acceleration(k), -most, most);
        }
        for k in 0..self.intervals {
            let (from, to) = (acceleration(k), acceleration(k + 1));
            program.not_negative((&[(from, 1.0), (to, -1.0)], step));
            program.not_negative((&[(from, -1.0), (to, 1.0)], step));
        }
    }

    fn add_caps(&self, program: &mut ConvexProgram) {
        // More than all knots together gain from a higher speed at one.
        let price =
            4.0 * self.parameters.ref_s_weight * self.length_m * self.spacing_s * self.intervals as f64;
        for (k, cap) in self.caps.iter().enumerate() {
            let slack = 3 * (self.intervals + 1) + k;
            let slope = cap.slope_per_s;
            let constant = cap.value_mps - slope * cap.at_m;
            program.not_negative((&[(speed(k), -1.0), (position(k), slope), (slack, 1.0)], constant));
            program.not_negative((&[(slack, 1.0)], 0.0));
            program.add_linear(slack, price);
        }
    }
}

fn position(knot: usize) -> usize {
    3 * knot
}

fn speed(knot: usize) -> usize {
    3 * knot + 1
}

fn acceleration(knot: usize) -> usize {
    3 * knot + 2
}
