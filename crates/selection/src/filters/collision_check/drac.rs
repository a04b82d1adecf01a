//! Deceleration required to avoid a collision (DRAC) with an object on one of its ways.
//!
//! A way counts only if the vehicle, driving as planned, passes a place within the time margins before or after the
//! object. Who passes first and who has priority choose the case; a case says which accelerations are tried. The first
//! that leaves no passage is the required one.

use super::ego::Braking;
use super::findings::Known;
use super::motions::EgoMotions;
use super::objects::{Course, Object, Objects, Way};
use super::passage::{Body, Hit, Passages, Search, SearchBuffers, Sought};
use super::priority::{PriorityBuffers, PriorityMap};
use super::settings::{Case, ClassSettings, EgoTiers, Settings};
use super::yielding::YieldingObjects;
use crate::verdict::RiskLevel;
use motion::Point2;
use motion::occupancy::{GROUP, Sweep};
use smallvec::{SmallVec, smallvec};
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
    pub(super) fn object_may_brake(self) -> bool {
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

/// Brakings of the vehicle that are tried for one way.
const TRIES: usize = 4;
/// The last of these that sets in with delay.
const HARDEST_WITH_DELAY: usize = 2;
/// What may come of the vehicle's braking: the first, the second, ... try is enough, or none is.
const ALL_OUTCOMES: usize = TRIES + 1;

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

/// A course that comes near to the candidate, and the first slice of the vehicle that it may meet.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Turn {
    begin: usize,
    /// Place in [`Objects::courses`].
    pub(super) course: usize,
}

#[cfg(test)]
impl Turn {
    /// The turn of a course of which nothing is known.
    pub(super) fn at_once(course: &Course) -> Self {
        Self { begin: 0, course: course.place }
    }
}

impl Situation<'_> {
    /// Lists the courses that come near to the candidate as planned, the earliest first: what is found on them early
    /// tells that much of what comes later needs no look. No other course has a passage.
    pub(super) fn line_up(&self, ego: &mut EgoMotions, turns: &mut Vec<Turn>) {
        turns.clear();
        let Some(bounds) = ego.bounds else { return };
        for course in self.objects.courses.iter().filter(|course| bounds.meets(&course.bounds)) {
            ego.plan_sweep(self.settings, course.ego_outline);
            let planned = ego.planned_sweep(course.ego_outline);
            if let Some(group) = self.objects.windows_of(course).first_near_group(planned) {
                turns.push(Turn { begin: group * GROUP, course: course.place });
            }
        }
        turns.sort_unstable();
    }

    /// Assesses one way of an object. Where all that may come out is known already, it is not found out.
    pub(super) fn assess(
        &self,
        (object, course): (&Object, &Course),
        turn: Turn,
        ego: &mut EgoMotions,
        buffers: &mut DracBuffers,
        known: Known<'_>,
    ) -> Outcome {
        let of_class = self.settings.class(object.class);
        if self.changes_nothing((object, course), turn, ego, buffers, known) {
            return Outcome::Known;
        }
        let planned = self.ego_body(ego.planned_sweep(of_class.ego_outline), of_class);
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
        // All that may come out: the object's braking is enough, the vehicle's, or nothing.
        let begin = passages.first.ego;
        if known.yielding(method, begin) && known.tries(method, &case.tiers, begin) == ALL_OUTCOMES {
            return Outcome::Known;
        }
        if method.object_may_brake()
            && let Some(risk) = self.object_yields(object, course, of_class, ego, buffers)
        {
            return Outcome::Evaluated(evaluation(risk, 0.0));
        }
        let tries = self.tries(&case.tiers, of_class);
        let enough =
            tries.into_iter().find(|&braking| !self.is_passed((object, course), braking, ego, buffers));
        let required = enough.map(|braking| braking.acceleration_mps2);
        Outcome::Evaluated(evaluation(risk_of(required, &case.tiers), required.unwrap_or(f64::NEG_INFINITY)))
    }

    /// True only if whatever a look at a way finds changes nothing: it is clear; or the case is switched off and that
    /// was noted before; or a braking of the object is enough, or one of the vehicle, up to one that clears the way
    /// beyond doubt, and each of these outcomes is known. Passages begin no earlier than the turn says.
    fn changes_nothing(
        &self,
        (object, course): (&Object, &Course),
        turn: Turn,
        ego: &mut EgoMotions,
        buffers: &mut DracBuffers,
        known: Known<'_>,
    ) -> bool {
        let of_class = self.settings.class(object.class);
        let mut leading = ALL_OUTCOMES;
        let mut tiers: Option<EgoTiers> = None;
        for &(method, case) in self.possible_cases(course, of_class).as_slice() {
            if !case.is_enabled {
                if !known.is_left_open(method) {
                    return false;
                }
                continue;
            }
            leading = leading.min(known.tries(method, &case.tiers, turn.begin));
            // Which motion is tried must not depend on the case.
            let is_other = tiers.is_some_and(|other| !other.tries_same(&case.tiers));
            if leading == 0 || is_other || !known.yielding(method, turn.begin) {
                return false;
            }
            tiers = Some(case.tiers);
        }
        let Some(tiers) = tiers.filter(|_| leading < ALL_OUTCOMES) else { return true };
        // The hardest of them is most likely to clear the way. With full delay it was perhaps tried before.
        let braking = self.tries(&tiers, of_class)[(leading - 1).min(HARDEST_WITH_DELAY)];
        !self.is_passed((object, course), braking, ego, buffers)
    }

    /// The cases that a passage on a course may come to, whoever passes first.
    fn possible_cases(&self, course: &Course, of_class: &ClassSettings) -> SmallVec<[(Method, Case); 4]> {
        if matches!(course.way, Way::Arc { .. }) {
            return smallvec![
                (Method::ConstantCurvatureEgoEarlier, of_class.arc_ego_earlier),
                (Method::ConstantCurvatureObjectEarlier, of_class.arc_object_earlier),
            ];
        }
        let object_prioritized = [
            (Method::ObjectPrioritizedEgoEarlier, of_class.object_prioritized_ego_earlier),
            (Method::ObjectPrioritizedObjectEarlier, of_class.object_prioritized_object_earlier),
        ];
        let ego_prioritized = [
            (Method::EgoPrioritizedEgoEarlier, of_class.ego_prioritized_ego_earlier),
            (Method::EgoPrioritizedObjectEarlier, of_class.ego_prioritized_object_earlier),
        ];
        match (self.indicators_are_off, of_class.is_vulnerable) {
            (false, _) => object_prioritized.into_iter().collect(),
            (true, false) => ego_prioritized.into_iter().collect(),
            (true, true) => object_prioritized.into_iter().chain(ego_prioritized).collect(),
        }
    }

    /// How the vehicle's braking is tried, in this order.
    fn tries(&self, tiers: &EgoTiers, of_class: &ClassSettings) -> [Braking; TRIES] {
        let delayed_s = self.odometry_s + of_class.braking_delay_s;
        [
            (tiers.safe, delayed_s),
            (tiers.danger, delayed_s),
            (tiers.fatal, delayed_s),
            (tiers.fatal, self.odometry_s),
        ]
        .map(|(acceleration_mps2, start_s)| Braking { start_s, acceleration_mps2 })
    }

    /// True if there is a passage although the vehicle brakes.
    fn is_passed(
        &self,
        (object, course): (&Object, &Course),
        braking: Braking,
        ego: &mut EgoMotions,
        buffers: &mut DracBuffers,
    ) -> bool {
        let of_class = self.settings.class(object.class);
        let (on_course, windows) = (self.object_body(object, course), self.objects.windows_of(course));
        // Many a passage is found soon: the motion is followed only so far.
        let place = ego.place_of(braking, self.settings, self.objects.horizon_s);
        for group in 0..windows.groups() {
            let cover = ego.braked(place, self.settings, of_class.ego_outline, (group + 1) * GROUP);
            // Slices lie in the boxes around them all: where those are apart no slice meets another.
            if cover.bounds.is_some_and(|bounds| !bounds.meets(&course.bounds)) {
                return false;
            }
            if !windows.is_near_group(&cover.sweep, group) {
                continue;
            }
            let braked = self.ego_body(&cover.sweep, of_class);
            let is_whole = cover.bounds.is_some();
            let search = Search::of_group(
                group,
                (braked, is_whole),
                on_course.clone(),
                windows,
                of_class,
                &mut buffers.search,
            );
            if search.has_passage() {
                return true;
            }
        }
        false
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
            let planned = self.ego_body(ego.planned_sweep(of_class.ego_outline), of_class);
            !Search::new(planned, braking, windows, of_class, search).has_passage()
        })?;
        Some(if enough >= safe_mps2 { RiskLevel::Safe } else { RiskLevel::LowCaution })
    }
}

pub(super) fn risk_of(required_mps2: Option<f64>, tiers: &EgoTiers) -> RiskLevel {
    match required_mps2 {
        None if tiers.may_abandon => RiskLevel::LowCaution,
        None => RiskLevel::Fatal,
        Some(required) if required >= tiers.safe => RiskLevel::Safe,
        Some(required) if required >= tiers.danger => RiskLevel::Danger,
        Some(_) => RiskLevel::Fatal,
    }
}
