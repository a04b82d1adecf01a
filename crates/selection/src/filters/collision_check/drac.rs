//! Deceleration required to avoid a collision (DRAC) with an object on one of its ways.
//!
//! A way counts only if the vehicle, driving as planned, passes a place within the time margins before or after the
//! object. Who passes first and who has priority choose the case; a case says which accelerations are tried. The first
//! that leaves no passage is the required one.

use super::ego::{Braking, EgoMotion, EgoPath};
use super::objects::{Course, Object, Objects, Way};
use super::passage::{Body, Hit, Passages, Search, SearchBuffers, Sought};
use super::priority::{PriorityBuffers, PriorityMap};
use super::settings::{Case, ClassSettings, EgoTiers, Settings};
use super::yielding::YieldingObjects;
use crate::verdict::RiskLevel;
use motion::Point2;
use motion::occupancy::{Bounds, Sweep};
use std::fmt;

/// The case by which an object was assessed. Shown in upstream's words.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Method {
    /// Motion with constant curvature, the vehicle passes first.
    ConstantCurvatureEgoEarlier,
    /// Motion with constant curvature, the object passes first.
    ConstantCurvatureObjectEarlier,
    /// Predicted path, the vehicle has priority and passes first.
    EgoPrioritizedEgoEarlier,
    /// Predicted path, the vehicle has priority, the object passes first.
    EgoPrioritizedObjectEarlier,
    /// Predicted path, the object has priority, the vehicle passes first.
    ObjectPrioritizedEgoEarlier,
    /// Predicted path, the object has priority and passes first.
    ObjectPrioritizedObjectEarlier,
}

impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::ConstantCurvatureEgoEarlier => "constant_curvature, ego earlier",
            Self::ConstantCurvatureObjectEarlier => "constant_curvature, object earlier",
            Self::EgoPrioritizedEgoEarlier => "map_based, ego prioritized, ego earlier",
            Self::EgoPrioritizedObjectEarlier => "map_based, ego prioritized, object earlier",
            Self::ObjectPrioritizedEgoEarlier => "map_based, object prioritized, ego earlier",
            Self::ObjectPrioritizedObjectEarlier => "map_based, object prioritized, object earlier",
        })
    }
}

impl Method {
    /// True if the object's braking is considered before the vehicle's.
    fn object_may_brake(self) -> bool {
        !matches!(self, Self::ConstantCurvatureObjectEarlier | Self::ObjectPrioritizedObjectEarlier)
    }

    pub(super) fn is_map_based(self) -> bool {
        !matches!(self, Self::ConstantCurvatureEgoEarlier | Self::ConstantCurvatureObjectEarlier)
    }
}

/// The assessment of one way of one object.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Evaluation {
    pub(super) method: Method,
    pub(super) risk: RiskLevel,
    /// Acceleration of the vehicle that avoids the collision \[m/s²\]; 0 if the object's braking does, minus infinity
    /// if nothing does.
    pub(super) required_mps2: f64,
    /// Harder braking than this is no longer safe \[m/s²\].
    pub(super) safe_mps2: f64,
    pub(super) passages: Passages,
}

/// What came out for one way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Outcome {
    /// The way is not in conflict with the candidate.
    Clear,
    /// The case is switched off.
    NotAssessed(Method),
    /// The case could have been assessed, but whatever came out would change nothing.
    Known,
    /// The case was assessed.
    Evaluated(Evaluation),
}

/// The vehicle's motions on one candidate.
#[derive(Debug, Default)]
pub(super) struct EgoMotions {
    pub(super) path: EgoPath,
    pub(super) planned: EgoMotion,
    /// What the planned motion covers, for each outline of the settings; empty if not needed yet.
    planned_sweeps: Vec<Sweep>,
    /// Box around the planned motion with the largest outline.
    bounds: Option<Bounds>,
    braking: EgoMotion,
    /// What braking motions cover; the first `trials_used` are of this candidate.
    trials: Vec<Trial>,
    trials_used: usize,
}

#[derive(Debug)]
struct Trial {
    braking: Braking,
    outline: usize,
    sweep: Sweep,
}

impl EgoMotions {
    /// Starts a candidate whose points are in `path`.
    pub(super) fn restart(&mut self, settings: &Settings, horizon_s: f64) {
        self.planned.sample(&self.path, None, settings.resolution_s, horizon_s);
        self.planned_sweeps.resize_with(settings.ego_outlines.len(), Sweep::default);
        self.planned_sweeps.iter_mut().for_each(Sweep::clear);
        self.trials_used = 0;
        let radius_m =
            settings.ego_outlines.iter().map(motion::occupancy::Outline::radius_m).fold(0.0, f64::max);
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

    /// Place of the motion that brakes in this way.
    fn trial(&mut self, settings: &Settings, outline: usize, braking: Braking, horizon_s: f64) -> usize {
        let is_wanted = |trial: &Trial| trial.braking == braking && trial.outline == outline;
        if let Some(place) = self.trials[..self.trials_used].iter().position(is_wanted) {
            return place;
        }
        let place = self.trials_used;
        if place == self.trials.len() {
            self.trials.push(Trial { braking, outline, sweep: Sweep::default() });
        }
        self.braking.sample(&self.path, Some(braking), settings.resolution_s, horizon_s);
        let trial = &mut self.trials[place];
        (trial.braking, trial.outline) = (braking, outline);
        self.braking.sweep(&settings.ego_outlines[outline], &mut trial.sweep);
        self.trials_used += 1;
        place
    }
}

/// Memory of assessments.
#[derive(Debug, Default)]
pub(super) struct DracBuffers {
    search: SearchBuffers,
    yielding: YieldingObjects,
    hull: (Vec<Point2>, Vec<Point2>),
    priority: PriorityBuffers,
}

/// What an assessment needs to know about the cycle and the candidate.
#[derive(Debug, Clone, Copy)]
pub(super) struct Situation<'a> {
    pub(super) settings: &'a Settings,
    pub(super) objects: &'a Objects,
    pub(super) priority: &'a PriorityMap,
    /// Stamp of the odometry after that of the objects \[s\].
    pub(super) odometry_s: f64,
    /// True if the candidate's turn indicators are off: only then the vehicle may have priority.
    pub(super) indicators_are_off: bool,
}

impl Situation<'_> {
    /// Assesses one way of an object. `is_known` says of an evaluation that it would change nothing of what was found:
    /// if that is so for all that may come out, no braking is tried.
    pub(super) fn assess(
        &self,
        object: &Object,
        course: &Course,
        ego: &mut EgoMotions,
        buffers: &mut DracBuffers,
        is_known: impl Fn(&Evaluation) -> bool,
    ) -> Outcome {
        if !ego.bounds.is_some_and(|bounds| bounds.meets(&course.bounds)) {
            return Outcome::Clear;
        }
        let of_class = self.settings.class(object.class);
        ego.plan_sweep(self.settings, of_class.ego_outline);
        let planned = self.ego_body(&ego.planned_sweeps[of_class.ego_outline], of_class);
        let on_course = self.object_body(object, course);
        let windows = self.objects.windows_of(course);
        let search = Search::new(planned, on_course, windows, of_class, &mut buffers.search);
        let Some(passages) = search.passages(self.sought(course, of_class)) else {
            return Outcome::Clear;
        };
        let (method, case) = self.case(object, course, passages, of_class, buffers);
        if !case.is_enabled {
            return Outcome::NotAssessed(method);
        }
        let evaluation = |risk, required_mps2| {
            let safe_mps2 = case.tiers.safe;
            Evaluation { method, risk, required_mps2, safe_mps2, passages }
        };
        let of_braking = |required: Option<f64>| {
            evaluation(risk_of(required, &case.tiers), required.unwrap_or(f64::NEG_INFINITY))
        };
        // All that may come out: the object's braking is enough, the vehicle's, or nothing.
        let EgoTiers { safe, danger, fatal, .. } = case.tiers;
        if [RiskLevel::Safe, RiskLevel::LowCaution].iter().all(|&risk| is_known(&evaluation(risk, 0.0)))
            && [Some(safe), Some(danger), Some(fatal), None].iter().all(|&it| is_known(&of_braking(it)))
        {
            return Outcome::Known;
        }
        if method.object_may_brake()
            && let Some(risk) = self.object_yields(object, course, of_class, ego, buffers)
        {
            return Outcome::Evaluated(evaluation(risk, 0.0));
        }
        Outcome::Evaluated(of_braking(self.required_braking(
            object,
            course,
            &case.tiers,
            of_class,
            ego,
            buffers,
        )))
    }

    fn ego_body<'s>(&'s self, sweep: &'s Sweep, of_class: &ClassSettings) -> Body<'s> {
        Body { outline: &self.settings.ego_outlines[of_class.ego_outline], sweep, slices: 0..sweep.len() }
    }

    fn object_body<'s>(&'s self, object: &'s Object, course: &Course) -> Body<'s> {
        Body { outline: &object.outline, sweep: &self.objects.sweep, slices: course.slices.clone() }
    }

    /// The worst passages decide about priority, and only about that.
    fn sought(&self, course: &Course, of_class: &ClassSettings) -> Sought {
        let asks_map =
            matches!(course.way, Way::Path(_)) && self.indicators_are_off && of_class.is_vulnerable;
        if asks_map { Sought::FirstAndWorst } else { Sought::First }
    }

    fn case(
        &self,
        object: &Object,
        course: &Course,
        passages: Passages,
        of_class: &ClassSettings,
        buffers: &mut DracBuffers,
    ) -> (Method, Case) {
        let pet_s = passages.first.pet_ticks() as f64 * self.settings.resolution_s;
        let ego_is_earlier = pet_s > of_class.bias_s;
        if matches!(course.way, Way::Arc { .. }) {
            return if ego_is_earlier {
                (Method::ConstantCurvatureEgoEarlier, of_class.arc_ego_earlier)
            } else {
                (Method::ConstantCurvatureObjectEarlier, of_class.arc_object_earlier)
            };
        }
        match (self.is_object_prioritized(object, course, passages.worst, of_class, buffers), ego_is_earlier)
        {
            (true, true) => (Method::ObjectPrioritizedEgoEarlier, of_class.object_prioritized_ego_earlier),
            (true, false) => {
                (Method::ObjectPrioritizedObjectEarlier, of_class.object_prioritized_object_earlier)
            }
            (false, true) => (Method::EgoPrioritizedEgoEarlier, of_class.ego_prioritized_ego_earlier),
            (false, false) => (Method::EgoPrioritizedObjectEarlier, of_class.ego_prioritized_object_earlier),
        }
    }

    fn is_object_prioritized(
        &self,
        object: &Object,
        course: &Course,
        worst: Hit,
        of_class: &ClassSettings,
        buffers: &mut DracBuffers,
    ) -> bool {
        if !self.indicators_are_off {
            return true;
        }
        let slice = course.slices.start + worst.object;
        of_class.is_vulnerable && {
            let covered = self.objects.sweep.hull(slice, &object.outline, &mut buffers.hull);
            self.priority.is_prioritized(covered, &mut buffers.priority)
        }
    }

    /// Risk if braking of the object alone clears its way.
    fn object_yields(
        &self,
        object: &Object,
        course: &Course,
        of_class: &ClassSettings,
        ego: &EgoMotions,
        buffers: &mut DracBuffers,
    ) -> Option<RiskLevel> {
        let DracBuffers { search, yielding, .. } = buffers;
        let [safe_mps2, _] = of_class.object_tiers;
        let (_, enough) = of_class.object_tiers.into_iter().enumerate().find(|&(tier, _)| {
            let (sweep, windows) =
                yielding.braking(self.objects, (object, course), tier, of_class, self.settings);
            let braking = Body { outline: &object.outline, sweep, slices: 0..sweep.len() };
            let planned = self.ego_body(&ego.planned_sweeps[of_class.ego_outline], of_class);
            !Search::new(planned, braking, windows, of_class, search).has_passage()
        })?;
        Some(if enough >= safe_mps2 { RiskLevel::Safe } else { RiskLevel::LowCaution })
    }

    /// The first acceleration of the vehicle that leaves no passage; `None` if none does.
    fn required_braking(
        &self,
        object: &Object,
        course: &Course,
        tiers: &EgoTiers,
        of_class: &ClassSettings,
        ego: &mut EgoMotions,
        buffers: &mut DracBuffers,
    ) -> Option<f64> {
        let delay_s = of_class.braking_delay_s;
        let tries =
            [(tiers.safe, delay_s), (tiers.danger, delay_s), (tiers.fatal, delay_s), (tiers.fatal, 0.0)];
        let enough = tries.into_iter().find(|&(acceleration_mps2, delay_s)| {
            let braking = Braking { start_s: self.odometry_s + delay_s, acceleration_mps2 };
            let place = ego.trial(self.settings, of_class.ego_outline, braking, self.objects.horizon_s);
            let braked = self.ego_body(&ego.trials[place].sweep, of_class);
            let (on_course, windows) = (self.object_body(object, course), self.objects.windows_of(course));
            !Search::new(braked, on_course, windows, of_class, &mut buffers.search).has_passage()
        });
        enough.map(|(acceleration_mps2, _)| acceleration_mps2)
    }
}

fn risk_of(required_mps2: Option<f64>, tiers: &EgoTiers) -> RiskLevel {
    match required_mps2 {
        None if tiers.may_abandon => RiskLevel::LowCaution,
        None => RiskLevel::Fatal,
        Some(required) if required >= tiers.safe => RiskLevel::Safe,
        Some(required) if required >= tiers.danger => RiskLevel::Danger,
        Some(_) => RiskLevel::Fatal,
    }
}
