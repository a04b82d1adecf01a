//! Rejects candidates on which the vehicle would have to brake hard to avoid another road user.
//!
//! Two assessments. DRAC: for every object, its motion with constant curvature and each predicted path; if the
//! vehicle passes a place shortly before or after the object, which braking still avoids that? RSS: objects on the
//! swept path now; which braking stops behind them? A candidate is feasible while the worst risk is below DANGER.
//!
//! What the vehicle and the objects cover between two samples is part of the test (swept slices), so no contact is
//! missed at any time resolution. What all candidates share, the objects' courses, is computed once per cycle.
//! Needing a braking that is still comfortable is safe: this is no check for a collision-free plan. The only memory is
//! of sensors: for how long the vehicle and each object have been standing. Source: the newest collision check of the
//! TIER IV fork of Autoware, with its defects mended; see the filter's documentation.

mod drac;
mod ego;
mod findings;
mod motions;
mod objects;
mod passage;
mod priority;
mod reach;
mod rss;
mod settings;
mod stop_tracker;
mod windows;
mod yielding;

pub use drac::Method;
pub use findings::{CollisionCause, CollisionMemo};

use self::drac::{DracBuffers, Evaluation, Outcome, Situation, Turn};
use self::findings::{Finding, Findings, Known, first_contact, judgement};
use self::motions::EgoMotions;
use self::objects::{Course, Object, Objects};
use self::passage::Hit;
pub(crate) use self::priority::PriorityMap;
use self::reach::{Reach, near_of, turned_near_of};
use self::settings::Settings;
use self::stop_tracker::StopTracker;
use super::{Fill, Filter, Scratch};
use crate::candidate::Candidate;
use crate::parameters::{CollisionCheckParameters, ValidatorParameters};
use crate::scene::{HdMap, Scene};
use crate::verdict::{Judgement, Memo, RiskLevel};
use messages::autoware_perception_msgs::PredictedObjects;
use messages::autoware_vehicle_msgs::TurnIndicatorsCommand;
use messages::nav_msgs::Odometry;
use messages::unique_identifier_msgs::Uuid;
use motion::VehicleInfo;
use motion::occupancy::{Bounds, Deviation, HullBuffers, PlanarPose, Sweep, slices_meet};
use std::borrow::Cow;
use std::sync::Arc;

/// Name of the filter.
pub const NAME: &str = "collision_check_filter";

/// Further apart in time \[s\] a candidate and the objects say nothing about each other.
const MAX_STAMP_GAP_S: f64 = 5.0;
/// The path is sampled in time up to here \[s\], or as far as objects are predicted; beyond, its own points do.
const SAMPLED_PATH_S: f64 = 30.0;
/// Buffers of the filter, reused from candidate to candidate.
#[derive(Debug, Default)]
pub struct Workspace {
    ego: EgoMotions,
    drac: DracBuffers,
    turns: Vec<Turn>,
    rss_slice: Sweep,
    rss_tail: Sweep,
    hulls: HullBuffers,
}

/// The filter with its settings, its memory of sensors and what it derived from the scene of this cycle.
#[derive(Debug)]
pub struct CollisionCheckFilter {
    settings: Settings,
    vehicle: VehicleInfo,
    ego_stops: StopTracker,
    object_stops: StopTracker,
    objects: Objects,
    priority: Option<Arc<PriorityMap>>,
    /// Where the announced candidates may come, until the scene is observed.
    announced: Option<Reach>,
    cycle: Result<Cycle, Cow<'static, str>>,
}

/// Numbers of a cycle.
#[derive(Debug, Clone, Copy)]
struct Cycle {
    objects_ns: i64,
    odometry_s: f64,
    speed_mps: f64,
}

impl CollisionCheckFilter {
    /// A filter for this vehicle.
    #[must_use]
    pub fn new(parameters: &CollisionCheckParameters, vehicle: &VehicleInfo) -> Self {
        Self {
            settings: Settings::new(parameters, vehicle),
            vehicle: *vehicle,
            ego_stops: StopTracker::default(),
            object_stops: StopTracker::default(),
            objects: Objects::default(),
            priority: None,
            announced: None,
            cycle: Err(Cow::Borrowed(NO_ODOMETRY)),
        }
    }

    fn observe_inputs(&mut self, scene: &Scene, reach: Option<Reach>) -> Result<Cycle, Cow<'static, str>> {
        // The trackers take what there is, also in cycles that cannot be assessed.
        if let Some(odometry) = &scene.odometry {
            let twist = &odometry.twist.twist.linear;
            let seen = std::iter::once((Uuid::default(), [twist.x, twist.y]));
            self.ego_stops.update(odometry.header.stamp.nanoseconds(), self.settings.ego_stop, seen);
        }
        if let Some(objects) = &scene.objects {
            let seen = objects.objects.iter().map(|object| {
                let twist = &object.kinematics.initial_twist_with_covariance.twist.linear;
                (object.object_id, [twist.x, twist.y])
            });
            self.object_stops.update(objects.header.stamp.nanoseconds(), self.settings.object_stop, seen);
        }
        let odometry = scene.odometry.as_deref().ok_or(NO_ODOMETRY)?;
        let objects = scene.objects.as_deref().ok_or(NO_OBJECTS)?;
        let map = scene.map.as_ref().ok_or(NO_MAP)?;
        check_frame(scene, objects)?;
        self.priority = Some(priority_of(&map.value));
        self.objects.fill(objects, &self.settings, reach).map_err(objects::ObjectDefect::text)?;
        let ego_ns = self.ego_stops.standing_ns(&Uuid::default());
        for object in &mut self.objects.objects {
            object.mutual_standing_ns = ego_ns.min(self.object_stops.standing_ns(&object.id));
        }
        cycle_of(odometry, objects)
    }
}

/// Intersections and crossings; made unless the map has them already.
pub(super) fn priority_of(map: &HdMap) -> Arc<PriorityMap> {
    Arc::clone(map.survey.priority.get_or_init(|| Arc::new(PriorityMap::new(&map.map))))
}

const NO_ODOMETRY: &str = "odometry is not available";
const NO_OBJECTS: &str = "predicted objects are not available";
const NO_MAP: &str = "lanelet map is not available";

fn check_frame(scene: &Scene, objects: &PredictedObjects) -> Result<(), Cow<'static, str>> {
    let frame = objects.header.frame_id.as_str();
    match scene.frame_id() {
        Some(map_frame) if !frame.is_empty() && frame != map_frame => {
            Err(Cow::Owned(format!("predicted objects are in frame `{frame}`, the map is in `{map_frame}`")))
        }
        _ => Ok(()),
    }
}

fn cycle_of(odometry: &Odometry, objects: &PredictedObjects) -> Result<Cycle, Cow<'static, str>> {
    let speed_mps = odometry.twist.twist.linear.x;
    if !speed_mps.is_finite() {
        return Err(Cow::Borrowed("odometry holds a speed that is not finite"));
    }
    let objects_ns = objects.header.stamp.nanoseconds();
    let odometry_s = (odometry.header.stamp.nanoseconds() - objects_ns) as f64 * 1e-9;
    if odometry_s.abs() > MAX_STAMP_GAP_S {
        return Err(Cow::Owned(format!(
            "predicted objects and odometry are {:.1} s apart",
            odometry_s.abs()
        )));
    }
    Ok(Cycle { objects_ns, odometry_s, speed_mps })
}

impl Filter for CollisionCheckFilter {
    fn name(&self) -> &'static str {
        NAME
    }

    fn fill(&self) -> Option<Fill> {
        Some(Fill {
            entries: self.ego_stops.len() + self.object_stops.len(),
            bound: 2 * stop_tracker::MAX_TRACKED,
        })
    }

    fn configure(&mut self, parameters: &ValidatorParameters) {
        self.settings = Settings::new(&parameters.collision_check, &self.vehicle);
        // What was announced and observed with the old settings must not meet the new ones.
        self.announced = None;
        self.cycle = Err(Cow::Borrowed("parameters changed after the scene was observed"));
    }

    fn announce(&mut self, candidates: &[Candidate]) {
        self.announced = Some(Reach::of(candidates, &self.settings));
    }

    fn observe(&mut self, scene: &Scene) {
        self.cycle = Err(Cow::Borrowed("the scene could not be observed"));
        // It holds for one cycle: of the candidates of the next one nothing is known yet.
        let reach = self.announced.take();
        self.cycle = self.observe_inputs(scene, reach);
    }

    fn judge(&self, _scene: &Scene, candidate: &Candidate, scratch: &mut Scratch) -> Judgement {
        let cycle = match &self.cycle {
            Ok(cycle) => cycle,
            Err(why) => return Judgement::not_assessed(why.clone()),
        };
        let Some(priority) = &self.priority else { return Judgement::not_assessed(NO_MAP) };
        let stamp_ns = candidate.message.header.stamp.nanoseconds();
        let offset_s = (stamp_ns - cycle.objects_ns) as f64 * 1e-9;
        if offset_s.abs() > MAX_STAMP_GAP_S {
            return Judgement::not_assessed("candidate and predicted objects are too far apart in time");
        }
        let work = &mut scratch.collision_check;
        let situation = self.situation(cycle, priority, candidate, offset_s, work);
        if !self.is_in_reach(&work.ego) {
            return Judgement::not_assessed("the candidate was not among those announced before the cycle");
        }
        let mut findings = Findings::new(&self.settings);
        findings.memo.without_predicted_path = self.objects.lack_path;
        self.assess_passages(&situation, work, &mut findings);
        self.assess_distances(cycle, candidate, work, &mut findings);
        judgement(candidate, offset_s, &findings)
    }

    fn explain(&self, judgement: &Judgement) -> Option<String> {
        let (Memo::CollisionCheck(memo), Some(at), false) =
            (&judgement.memo, &judgement.evidence, judgement.feasible)
        else {
            return crate::verdict::explain(judgement);
        };
        let object = at.object_id.unwrap_or_default();
        Some(format!("object {object} at ({:.1}, {:.1}) after {:.1} s: {memo}", at.x_m, at.y_m, at.time_s))
    }

    fn not_assessed(&self, judgement: &Judgement) -> Option<String> {
        let Memo::CollisionCheck(memo) = &judgement.memo else { return None };
        memo.left_open()
    }
}

impl CollisionCheckFilter {
    /// Samples the candidate as planned.
    fn situation<'s>(
        &'s self,
        cycle: &Cycle,
        priority: &'s PriorityMap,
        candidate: &Candidate,
        offset_s: f64,
        work: &mut Workspace,
    ) -> Situation<'s> {
        work.ego.path.fill(candidate, offset_s);
        work.ego.restart(&self.settings, SAMPLED_PATH_S.max(self.objects.horizon_s));
        let command = candidate.message.turn_indicators_command.command;
        Situation {
            settings: &self.settings,
            objects: &self.objects,
            priority,
            odometry_s: cycle.odometry_s,
            indicators_are_off: command == TurnIndicatorsCommand::DISABLE,
        }
    }

    /// True if the candidate's motion lies where it was announced: only there all ways of objects are known.
    fn is_in_reach(&self, ego: &EgoMotions) -> bool {
        self.objects
            .reach
            .is_none_or(|reach| ego.bounds.is_some_and(|bounds| reach.passages.contains(&bounds)))
    }

    /// True if the vehicle and an object have been standing for so long that findings on its predicted paths count for
    /// nothing.
    fn lifts_paths(&self, object: &Object) -> bool {
        let wait_ns = self.settings.class(object.class).arbitration_wait_ns;
        wait_ns.is_some_and(|wait_ns| object.mutual_standing_ns > wait_ns)
    }

    fn assess_passages(&self, situation: &Situation<'_>, work: &mut Workspace, findings: &mut Findings) {
        let mut turns = std::mem::take(&mut work.turns);
        situation.line_up(&mut work.ego, &mut turns);
        for &turn in &turns {
            let course = &self.objects.courses[turn.course];
            let object = &self.objects.objects[course.object];
            let known = Known {
                findings,
                number: course.place + 1,
                lifts_paths: self.lifts_paths(object),
                resolution_s: self.settings.resolution_s,
            };
            match situation.assess((object, course), turn, &mut work.ego, &mut work.drac, known) {
                Outcome::Clear | Outcome::Known => {}
                Outcome::NotAssessed(method) => findings.leave_open(method),
                Outcome::Evaluated(evaluation) if known.is_lifted(evaluation.method) => {}
                Outcome::Evaluated(evaluation) => self.take((object, course), &evaluation, work, findings),
            }
        }
        work.turns = turns;
    }

    /// Takes what came out for one way of an object, and shows it if it is the worst.
    fn take(
        &self,
        (object, course): (&Object, &Course),
        evaluation: &Evaluation,
        work: &mut Workspace,
        findings: &mut Findings,
    ) {
        findings.take(evaluation, course.place + 1);
        let begins_s = evaluation.passages.first.ego as f64 * self.settings.resolution_s;
        if evaluation.risk > RiskLevel::Safe && findings.may_show(evaluation.risk, begins_s) {
            findings.show(self.passage_finding((object, course), evaluation, work));
        }
    }

    fn passage_finding(
        &self,
        (object, course): (&Object, &Course),
        evaluation: &Evaluation,
        work: &mut Workspace,
    ) -> Finding {
        let Hit { ego, object: object_slice } = evaluation.passages.first;
        let place = self.settings.class(object.class).ego_outline;
        let ego_slice = work.ego.planned_sweep(place).slice(ego);
        let object_slice = self.objects.sweep.slice(course.slices.start + object_slice);
        let bodies = [(&self.settings.ego_outlines[place], ego_slice), (&object.outline, object_slice)];
        let ratio = first_contact(bodies).unwrap_or(0.0);
        let resolution_s = self.settings.resolution_s;
        Finding {
            risk: evaluation.risk,
            time_s: (ego as f64 + ratio) * resolution_s,
            place: ego_slice.start.between(&ego_slice.end, ratio),
            object: object.id,
            number: course.place + 1,
            cause: CollisionCause::Passage {
                method: evaluation.method,
                pet_s: evaluation.passages.first.pet_ticks() as f64 * resolution_s,
                required_mps2: evaluation.required_mps2,
            },
        }
    }

    fn assess_distances(
        &self,
        cycle: &Cycle,
        candidate: &Candidate,
        work: &mut Workspace,
        findings: &mut Findings,
    ) {
        // Standing still or reversing needs no braking towards anything ahead.
        if cycle.speed_mps <= 0.0 || self.objects.on_paths.is_empty() {
            return;
        }
        let bounds = self.sweep_path(work);
        for &place in &self.objects.on_paths {
            let object = &self.objects.objects[place];
            let Some(touch) = self.first_touch(place, object, &bounds, work) else { continue };
            let Touch { distance_m, time_s, .. } = touch;
            let of_class = &self.settings.class(object.class).rss;
            let object_mps = rss::longitudinal_velocity_mps(candidate, object);
            let required_mps2 =
                rss::required_acceleration_mps2(cycle.speed_mps, distance_m, object_mps, of_class);
            let is_dangerous = required_mps2 < of_class.error_acceleration_mps2;
            let risk = if is_dangerous { RiskLevel::Danger } else { RiskLevel::Safe };
            findings.rss.take(risk, required_mps2, of_class.error_acceleration_mps2, place + 1);
            findings.show(Finding {
                risk,
                time_s,
                place: touch.place,
                object: object.id,
                number: self.objects.courses.len() + place + 1,
                cause: CollisionCause::Distance { required_mps2 },
            });
        }
    }

    /// Sweeps the path, and gives the box around it.
    fn sweep_path(&self, work: &mut Workspace) -> Bounds {
        work.ego.plan_sweep(&self.settings, self.settings.rss_cover);
        self.sweep_tail(work);
        let planned = work.ego.planned_sweep(self.settings.rss_cover).groups();
        Bounds::around_all(planned).joined(&Bounds::around_all(work.rss_tail.groups()))
    }

    /// Sweeps the path from point to point where the samples end before the candidate does.
    fn sweep_tail(&self, work: &mut Workspace) {
        work.rss_tail.clear();
        let tail = self.first_tail_point(&work.ego);
        for pair in work.ego.path.poses().get(tail..).unwrap_or_default().windows(2) {
            work.rss_tail.push(&self.settings.rss_outline, pair[0], pair[1], &Deviation::default());
        }
    }

    /// Index of the last point of the candidate that the samples reach; beyond the end if they reach them all.
    fn first_tail_point(&self, ego: &EgoMotions) -> usize {
        let sampled_s = ego.planned.steps() as f64 * self.settings.resolution_s;
        ego.path.last_point_at(sampled_s)
    }

    /// Where the path first touches an object where that is now: at the first sample, between two samples, or behind
    /// them between two points of the candidate.
    ///
    /// The outline lies in the covering one, so what it covers between two samples lies in the boxes around what that
    /// one covers, but for what is rounded: only samples whose boxes, along the map axes and at an angle, come near the
    /// object are swept and looked at.
    fn first_touch(
        &self,
        place: usize,
        object: &Object,
        bounds: &Bounds,
        work: &mut Workspace,
    ) -> Option<Touch> {
        let (outline, standing) = (&self.settings.rss_outline, &self.objects.standing);
        let around = near_of(&standing.bounds()[place], bounds);
        if !around.meets(bounds) {
            return None;
        }
        let Workspace { ego, rss_slice, rss_tail, hulls, .. } = work;
        let mut touches =
            |sweep: &Sweep, at| slices_meet((outline, sweep, at), (&object.outline, standing, place), hulls);
        let planned = &ego.planned;
        let touch = |sample: usize, step: usize| Touch {
            distance_m: planned.distances_m[sample],
            time_s: step as f64 * self.settings.resolution_s,
            place: planned.poses[step],
        };
        let (cover, turned) =
            (ego.planned_sweep(self.settings.rss_cover), turned_near_of(standing, place, bounds));
        for step in cover.near(&around).filter(|&step| cover.bounding_box(step).overlaps(&turned)) {
            if step == 0 {
                rss_slice.clear();
                rss_slice.push(outline, planned.poses[0], planned.poses[0], &Deviation::default());
                if touches(rss_slice, 0) {
                    return Some(touch(0, 0));
                }
            }
            if step < planned.steps() {
                planned.sweep_step(step, outline, rss_slice);
                if touches(rss_slice, 0) {
                    return Some(touch(step + 1, step));
                }
            }
        }
        let slice = rss_tail.near(&around).find(|&slice| touches(rss_tail, slice))?;
        // The start of a long slice between two points of the candidate.
        let (distance_m, time_s) = ego.path.distance_and_time(self.first_tail_point(ego) + slice);
        Some(Touch { distance_m, time_s, place: rss_tail.slice(slice).start })
    }
}

/// Where a path first touches an object.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Touch {
    distance_m: f64,
    time_s: f64,
    place: PlanarPose,
}

#[cfg(test)]
mod tests;
