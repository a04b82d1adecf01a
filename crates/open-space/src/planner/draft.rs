//! A coarse path on its way to a trajectory. At every moment something can be made of it that can be driven.

use super::runs::{Run, Timing, arcs_of, join};
use super::{OpenSpaceParameters, PartFallback, Plan, PlanError, Stage};
use crate::collision::CollisionChecker;
use crate::hybrid_a_star::CoarsePath;
use crate::path_profile::PathProfile;
use crate::problem::Problem;
use crate::smoother::smooth_part;
use crate::speed::SpeedState;
use crate::verification::{Violation, verify};

/// What is known so far of a plan.
#[derive(Debug)]
pub(super) struct Draft<'a> {
    problem: &'a Problem,
    checker: &'a CollisionChecker,
    parameters: &'a OpenSpaceParameters,
    coarse: &'a CoarsePath,
    /// Smoothed parts; none for those that are driven as the arcs they are.
    smoothed: Vec<Option<PathProfile>>,
    fallbacks: Vec<PartFallback>,
    passes: usize,
}

impl<'a> Draft<'a> {
    /// A draft of nothing but the arcs of `coarse`.
    pub(super) fn new(
        problem: &'a Problem,
        checker: &'a CollisionChecker,
        parameters: &'a OpenSpaceParameters,
        coarse: &'a CoarsePath,
    ) -> Self {
        let smoothed = vec![None; coarse.parts.len()];
        Self { problem, checker, parameters, coarse, smoothed, fallbacks: Vec::new(), passes: 0 }
    }

    /// Smooths every part; false when stopped before the last one.
    pub(super) fn smooth(&mut self, stop: &mut dyn FnMut() -> bool) -> bool {
        let max_curvature = self.problem.vehicle.max_curvature();
        for (index, part) in self.coarse.parts.iter().enumerate() {
            if stop() {
                return false;
            }
            let settings = &self.parameters.smoother;
            let inflation_m = self.coarse.inflation_m;
            match smooth_part(part, inflation_m, max_curvature, self.checker, settings, stop) {
                Ok(part) => {
                    self.passes += part.passes;
                    self.smoothed[index] = Some(part.path);
                }
                Err(reason) => {
                    self.passes += reason.passes();
                    self.fallbacks.push(PartFallback { part: index, reason });
                }
            }
        }
        true
    }

    /// The runs of the draft, timed; stops early with `None`.
    pub(super) fn runs(
        &self,
        timing: Timing,
        stop: &mut dyn FnMut() -> bool,
    ) -> Result<Option<Vec<Run>>, PlanError> {
        let paths =
            self.coarse.parts.iter().zip(&self.smoothed).flat_map(|(part, smoothed)| match smoothed {
                Some(path) => vec![path.clone()],
                None => arcs_of(part),
            });
        let mut runs = Vec::new();
        for path in paths {
            if stop() {
                return Ok(None);
            }
            let start = if runs.is_empty() { self.start_along(&path)? } else { SpeedState::default() };
            runs.push(Run::new(path, start, self.problem, &self.parameters.speed, timing)?);
        }
        Ok(Some(runs))
    }

    /// The state at the start, seen along the travel of the first run.
    fn start_along(&self, first: &PathProfile) -> Result<SpeedState, PlanError> {
        let sign = first.gear().sign();
        let speed_mps = sign * self.problem.start_speed_mps;
        if speed_mps < 0.0 {
            return Err(PlanError::RollingAgainstGear { speed_mps: self.problem.start_speed_mps });
        }
        // A vehicle at rest begins at rest, whatever its accelerometer says.
        let acceleration_mps2 =
            if speed_mps > 0.0 { sign * self.problem.start_acceleration_mps2 } else { 0.0 };
        Ok(SpeedState { position_m: 0.0, speed_mps, acceleration_mps2 })
    }

    /// The plan that `runs` make, once it has passed the last check.
    pub(super) fn plan(&self, runs: &[Run], stage: Stage) -> Result<Plan, Violation> {
        let trajectory = join(runs, self.problem);
        let measures = verify(&trajectory, self.problem, self.checker)?;
        Ok(Plan {
            trajectory,
            stage,
            measures,
            fallbacks: self.fallbacks.clone(),
            coarse_length_m: self.coarse.length_m(),
            expansions: self.coarse.expansions,
            passes: self.passes,
        })
    }
}
