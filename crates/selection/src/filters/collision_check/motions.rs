//! The vehicle's motions on one candidate and what it covers on each: as planned, and braking in every way that was
//! asked for. Each is made once for a candidate, when it is first needed and as far as it is.

use super::ego::{Braking, EgoMotion, EgoPath};
use super::settings::Settings;
use motion::occupancy::{Bounds, Outline, Sweep};

/// The vehicle's motions on one candidate.
#[derive(Debug, Default)]
pub(super) struct EgoMotions {
    pub(super) path: EgoPath,
    pub(super) planned: EgoMotion,
    /// What the planned motion covers, for each outline of the settings; empty if not needed yet.
    planned_sweeps: Vec<Sweep>,
    /// Box around the planned motion with the largest outline.
    pub(super) bounds: Option<Bounds>,
    /// Braking motions; the first `braked_used` are of this candidate.
    braked: Vec<Braked>,
    braked_used: usize,
}

/// A motion that brakes.
#[derive(Debug)]
struct Braked {
    braking: Braking,
    motion: EgoMotion,
    /// For each outline of the settings; empty if not needed yet.
    covers: Vec<Cover>,
}

/// What the vehicle covers, as far as somebody wanted to know.
#[derive(Debug)]
pub(super) struct Cover {
    pub(super) sweep: Sweep,
    /// Box around all of it, if it goes to the end of the motion.
    pub(super) bounds: Option<Bounds>,
}

impl EgoMotions {
    /// Starts a candidate whose points are in `path`.
    pub(super) fn restart(&mut self, settings: &Settings, horizon_s: f64) {
        self.planned.sample(&self.path, None, settings.resolution_s, horizon_s);
        self.planned_sweeps.resize_with(settings.ego_outlines.len(), Sweep::default);
        self.planned_sweeps.iter_mut().for_each(Sweep::clear);
        self.braked_used = 0;
        let radius_m = settings.ego_outlines.iter().map(Outline::radius_m).fold(0.0, f64::max);
        // The path itself may bend out of the straight lines between the samples.
        let points = self.planned.poses.iter().chain(self.path.poses()).map(|pose| pose.position);
        self.bounds = Some(Bounds::around(points).grown(radius_m));
    }

    /// Makes what the vehicle covers as planned, with one of the outlines.
    pub(super) fn plan_sweep(&mut self, settings: &Settings, outline: usize) {
        if self.planned_sweeps[outline].is_empty() {
            self.planned.sweep(&settings.ego_outlines[outline], &mut self.planned_sweeps[outline]);
        }
    }

    /// What the vehicle covers as planned, with one of the outlines; empty until it was made.
    pub(super) fn planned_sweep(&self, outline: usize) -> &Sweep {
        &self.planned_sweeps[outline]
    }

    /// What the vehicle covers on the braking motion at a place, with one of the outlines: so many slices at least, or
    /// all.
    #[inline]
    pub(super) fn braked(
        &mut self,
        place: usize,
        settings: &Settings,
        outline: usize,
        slices: usize,
    ) -> &Cover {
        let Braked { motion, covers, .. } = &mut self.braked[place];
        let cover = &mut covers[outline];
        if cover.bounds.is_none() && cover.sweep.len() < slices {
            motion.extend(&self.path, slices + 1);
            motion.extend_sweep(&settings.ego_outlines[outline], &mut cover.sweep);
            cover.bounds = motion.is_complete().then(|| Bounds::around_all(cover.sweep.groups()));
        }
        cover
    }

    /// Place of the motion that brakes in this way.
    pub(super) fn place_of(&mut self, braking: Braking, settings: &Settings, horizon_s: f64) -> usize {
        let used = &self.braked[..self.braked_used];
        if let Some(place) = used.iter().position(|braked| braked.braking == braking) {
            return place;
        }
        let place = self.braked_used;
        if place == self.braked.len() {
            self.braked.push(Braked { braking, motion: EgoMotion::default(), covers: Vec::new() });
        }
        let braked = &mut self.braked[place];
        braked.braking = braking;
        braked.motion.begin(&self.path, Some(braking), settings.resolution_s, horizon_s);
        let nothing = || Cover { sweep: Sweep::default(), bounds: None };
        braked.covers.resize_with(settings.ego_outlines.len(), nothing);
        for cover in &mut braked.covers {
            cover.sweep.clear();
            cover.bounds = None;
        }
        self.braked_used += 1;
        place
    }
}
