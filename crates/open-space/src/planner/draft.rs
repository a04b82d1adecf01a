//! A coarse path on its way to a trajectory. At every moment something can be made of it that can be driven.

use super::runs::{Run, Timing, arcs_of, join};
use super::{OpenSpaceParameters, PartFallback, Plan, PlanError, Stage};
use crate::arc::Arc;
use crate::collision::CollisionChecker;
use crate::hybrid_a_star::{CoarsePath, GearPart};
use crate::interruption::Patience;
use crate::path_profile::PathProfile;
use crate::pose::PlanarPose;
use crate::problem::Problem;
use crate::smoother::{PartToSmooth, SmoothingError, smooth_part};
use crate::speed::{SpeedError, SpeedState};
use crate::verification::{Violation, verify};

/// Passes spent on a part with all its pieces, in units of those allowed for one.
const PASSES_WITH_PIECES: usize = 2;

/// What is known so far of a plan.
#[derive(Debug)]
pub(super) struct Draft<'a> {
    problem: &'a Problem,
    checker: &'a CollisionChecker,
    parameters: &'a OpenSpaceParameters,
    coarse: &'a CoarsePath,
    /// What each part is driven as: one smooth path, or several with stops between them.
    paths: Vec<Vec<PathProfile>>,
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
        let paths = coarse.parts.iter().map(arcs_of).collect();
        Self { problem, checker, parameters, coarse, paths, fallbacks: Vec::new(), passes: 0 }
    }

    /// Smooths every part; false when stopped before the last one was done.
    pub(super) fn smooth(&mut self, patience: &mut dyn Patience) -> bool {
        for (index, part) in self.coarse.parts.iter().enumerate() {
            if patience.ends() {
                return false;
            }
            let max_passes = self.passes + PASSES_WITH_PIECES * self.parameters.smoother.max_passes as usize;
            let mut reason = None;
            let paths = self.smooth_piece(part, max_passes, &mut reason, patience);
            let stops = paths.len().saturating_sub(1);
            self.paths[index] = paths;
            match reason {
                Some(SmoothingError::Stopped { .. }) => return false,
                Some(reason) => self.fallbacks.push(PartFallback { part: index, stops, reason }),
                None => {}
            }
        }
        true
    }

    /// Smooths a piece of a part. Where that fails it is cut in two where the steering jumps most, until each piece has
    /// its smooth path, if only an arc, or `max_passes` are used up. The last failure is the `reason`.
    fn smooth_piece(
        &mut self,
        piece: &GearPart,
        max_passes: usize,
        reason: &mut Option<SmoothingError>,
        patience: &mut dyn Patience,
    ) -> Vec<PathProfile> {
        let arcs = arcs_of(piece);
        if arcs.len() < 2 || self.passes >= max_passes {
            return arcs;
        }
        let (parameters, inflation_m) = (&self.parameters.smoother, self.coarse.inflation_m);
        let max_curvature = self.problem.vehicle.max_curvature();
        // Only the first piece begins with the wheels of a rolling vehicle.
        let begins = piece.poses.first() == Some(&self.problem.start) && self.problem.start_speed_mps != 0.0;
        let start_curvature = self.problem.start_curvature.filter(|_| begins);
        let piece_of = PartToSmooth { part: piece, inflation_m, start_curvature, max_curvature };
        match smooth_part(&piece_of, self.checker, parameters, patience) {
            Ok(smoothed) => {
                self.passes += smoothed.passes;
                vec![smoothed.path]
            }
            Err(error) => {
                self.passes += error.passes();
                *reason = Some(error);
                let (first, second) = cut(piece);
                let mut paths = self.smooth_piece(&first, max_passes, reason, patience);
                paths.extend(self.smooth_piece(&second, max_passes, reason, patience));
                paths
            }
        }
    }

    /// The runs of the draft, timed; `None` when stopped.
    pub(super) fn runs(
        &self,
        timing: Timing,
        patience: &mut dyn Patience,
    ) -> Result<Option<Vec<Run>>, PlanError> {
        let mut runs = Vec::new();
        let speed_mps = self.problem.start_speed_mps;
        if speed_mps != 0.0 && self.paths.iter().all(Vec::is_empty) {
            return Err(SpeedError::CannotStop { speed_mps: speed_mps.abs(), length_m: 0.0 }.into());
        }
        for path in self.paths.iter().flatten() {
            if patience.ends() {
                return Ok(None);
            }
            let start = if runs.is_empty() { self.start_along(path)? } else { SpeedState::default() };
            runs.push(Run::new(path.clone(), start, self.problem, &self.parameters.speed, timing, patience)?);
        }
        if patience.ends() {
            return Ok(None);
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
        Ok(SpeedState { position_m: 0.0, speed_mps: speed_mps + 0.0, acceleration_mps2 })
    }

    /// The plan that `runs` make, once it has passed the last check.
    pub(super) fn plan(&self, runs: &[Run], stage: Stage) -> Result<Plan, Violation> {
        let trajectory = join(runs, self.problem);
        let measures = verify(&trajectory, self.problem, self.checker)?;
        Ok(Plan {
            trajectory,
            stage,
            held_back: None,
            measures,
            fallbacks: self.fallbacks.clone(),
            coarse_length_m: self.coarse.length_m(),
            expansions: self.coarse.expansions,
            passes: self.passes,
        })
    }
}

/// The two pieces of a part on either side of its largest jump of curvature.
fn cut(part: &GearPart) -> (GearPart, GearPart) {
    let jump = |k: usize| (part.arcs[k].curvature - part.arcs[k - 1].curvature).abs();
    let at = (1..part.arcs.len()).max_by(|a, b| jump(*a).total_cmp(&jump(*b))).unwrap_or(0);
    let piece = |poses: &[PlanarPose], arcs: &[Arc]| GearPart {
        gear: part.gear,
        poses: poses.to_vec(),
        arcs: arcs.to_vec(),
    };
    (piece(&part.poses[..=at], &part.arcs[..at]), piece(&part.poses[at..], &part.arcs[at..]))
}
