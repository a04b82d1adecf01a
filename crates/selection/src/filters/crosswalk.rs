//! Rejects candidates that drive over the stop line of an unsignalised crosswalk while people wait at its ends, until
//! the vehicle has stood at the line long enough for every one of them.
//!
//! Who waits where is found once per cycle. A candidate is held against the stop lines that its path meets; how long
//! it has waited for whom is remembered for each candidate key and crosswalk. People on the crosswalk itself,
//! signalised crosswalks and crosswalks without a stop line are not this filter's subject. Source:
//! `autoware_trajectory_validator` 0.53, `CrosswalkFilter`, with memory of one key never shared with another.

mod crossings;
mod people;
mod planning_factor;
mod route;
mod timers;

pub use planning_factor::{SafetyFactor, planning_factor, safety_factors};

pub(crate) use crossings::{Crossing, Path};
pub(crate) use timers::Wait;

use self::crossings::{Outlook, find_crossings};
use self::people::{Classes, People};
use self::route::{Crosswalk, crosswalks_along};
use self::timers::{Clock, Timers};
use super::{Fill, Filter, Scratch};
use crate::candidate::Candidate;
use crate::parameters::{CrosswalkParameters, ValidatorParameters};
use crate::scene::Scene;
use crate::verdict::{Evidence, Judgement, Memo, Metric, RiskLevel};
use messages::autoware_internal_planning_msgs::PlanningFactor;
use motion::{TrajectoryPoint, calculate_stop_distance};
use smallvec::{SmallVec, smallvec};
use std::borrow::Cow;

/// Name of the filter.
pub const NAME: &str = "crosswalk_filter";
/// Name of its metric: 0, at risk DANGER where a candidate does not wait.
pub const METRIC: &str = "check_crosswalk_obstruction";

/// Braking that bounds how far ahead is looked \[m/s²\]; upstream ignores its parameter `nominal_deceleration`.
const LOOKAHEAD_DECELERATION_MPS2: f64 = 1.0;
/// Its jerk \[m/s³\]; upstream ignores its parameter `nominal_jerk`.
const LOOKAHEAD_JERK_MPS3: f64 = 1.0;
/// Below this speed the vehicle stands, and above it a point of a candidate moves \[m/s\].
const STANDING_MPS: f64 = 0.1;

/// The filter with its parameters and its memory.
#[derive(Debug)]
pub struct CrosswalkFilter {
    parameters: CrosswalkParameters,
    /// From base_link to the front bumper \[m\].
    front_m: f64,
    /// What follows from map, route and parameters; `None` until they are there.
    along: Option<AlongRoute>,
    /// People in this cycle, by place of the crosswalk in the route's list.
    people: People,
    /// What else this cycle brought, or why it cannot be judged.
    cycle: Result<Cycle, Cow<'static, str>>,
    timers: Timers,
}

/// The crosswalks of one map and one route.
#[derive(Debug)]
struct AlongRoute {
    map_epoch: u64,
    route_epoch: u64,
    /// The parameters have changed since.
    is_stale: bool,
    crosswalks: Result<Vec<Crosswalk>, Cow<'static, str>>,
}

const NOT_OBSERVED: Cow<'static, str> = Cow::Borrowed("no scene was observed");

/// The vehicle's own state in one cycle.
#[derive(Debug, Clone, Copy)]
struct Cycle {
    clock: Clock,
    outlook: Outlook,
    is_standing: bool,
}

/// What judging a candidate leaves behind.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct CrosswalkMemo {
    /// The crosswalks that the candidate meets.
    met: SmallVec<[Met; 6]>,
    /// Those for whom it would have to wait.
    factors: SmallVec<[SafetyFactor; 2]>,
    /// From the front bumper at the start to the line that the candidate must not cross \[m\].
    distance_m: f64,
    /// How long it still has to wait there \[s\].
    remaining_s: f64,
}

/// A crosswalk that a candidate meets.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Met {
    /// Place in the route's list.
    crosswalk: u32,
    /// The vehicle stands at its stop line.
    at_stop: bool,
}

impl CrosswalkFilter {
    /// A filter for a vehicle whose front bumper is this far ahead of base_link \[m\].
    #[must_use]
    pub fn new(parameters: CrosswalkParameters, front_m: f64) -> Self {
        Self {
            parameters,
            front_m,
            along: None,
            people: People::default(),
            cycle: Err(NOT_OBSERVED),
            timers: Timers::default(),
        }
    }

    /// Brings the crosswalks up to date with map and route, and drops timers that belong to neither.
    fn follow(&mut self, scene: &Scene) -> Result<(), Cow<'static, str>> {
        let map = scene.map.as_ref().ok_or("lanelet map is not available")?;
        let route = scene.route.as_ref().ok_or("route is not available")?;
        if let Some(along) = &self.along {
            let is_same_map = along.map_epoch == map.number;
            if is_same_map && along.route_epoch == route.number && !along.is_stale {
                return Ok(());
            }
            if !is_same_map {
                self.timers.clear();
            }
        }
        let crosswalks = crosswalks_along(&map.value.map, &route.value, &self.parameters);
        let list = crosswalks.as_deref().unwrap_or_default();
        self.timers.keep_crosswalks(|id| list.iter().any(|crosswalk| crosswalk.id == id));
        self.along = Some(AlongRoute {
            map_epoch: map.number,
            route_epoch: route.number,
            is_stale: false,
            crosswalks,
        });
        Ok(())
    }

    /// Inputs are asked for in the order of the specification; what they lack comes after all of them.
    fn begin_cycle(&mut self, scene: &Scene) -> Result<Cycle, Cow<'static, str>> {
        self.follow(scene)?;
        let odometry = scene.odometry.as_ref().ok_or("odometry is not available")?;
        let acceleration = scene.acceleration.as_ref().ok_or("acceleration is not available")?;
        let objects = scene.objects.as_ref().ok_or("predicted objects are not available")?;
        let crosswalks = crosswalks_of(self.along.as_ref())?;
        self.people.find(objects, crosswalks, Classes::new(&self.parameters));
        let clock = Clock::new(odometry.header.stamp.nanoseconds(), &self.parameters);
        // Before anybody is judged: after a long pause nobody is known to have waited in between.
        self.timers.evict(&clock);
        let speed_mps = odometry.twist.twist.linear.x;
        let stop_m = calculate_stop_distance(
            speed_mps,
            acceleration.accel.accel.linear.x,
            LOOKAHEAD_DECELERATION_MPS2,
            LOOKAHEAD_JERK_MPS3,
            0.0,
        );
        let arrived_m = self.parameters.arrived_distance_threshold;
        Ok(Cycle {
            clock,
            outlook: Outlook {
                length_m: stop_m.map_or(f64::INFINITY, |stop_m| stop_m + arrived_m),
                front_m: self.front_m - self.parameters.overshoot_tolerance,
                arrived_m,
            },
            is_standing: speed_mps < STANDING_MPS,
        })
    }

    /// The first crosswalk, in the order of the drive, at which the candidate does not wait as long as it has to.
    fn find_obstruction(
        &self,
        cycle: &Cycle,
        crosswalks: &[Crosswalk],
        candidate: &Candidate,
        scratch: &mut Scratch,
        memo: &mut CrosswalkMemo,
    ) -> Option<Evidence> {
        let start = first_moving(&candidate.points)?;
        let crossed = scratch.crossings.iter().zip(&memo.met);
        for (crossing, met) in crossed.filter(|(crossing, _)| scratch.path.crosses(crossing)) {
            let crosswalk = &crosswalks[crossing.crosswalk];
            let waits = &mut scratch.waits;
            self.timers.copy(candidate.key, crosswalk.id, waits);
            cycle.clock.step(waits, self.people.at(crossing.crosswalk), met.at_stop);
            let Some((wait, remaining_s)) = cycle.clock.remaining(waits) else { continue };
            memo.factors.push(SafetyFactor { object_id: wait.id, position: wait.position });
            if self.parameters.use_trajectory_time && start.time_from_start.seconds() >= remaining_s {
                continue;
            }
            memo.distance_m = crossing.arc_m - self.front_m;
            memo.remaining_s = remaining_s;
            return Some(Evidence {
                x_m: crossing.place.x,
                y_m: crossing.place.y,
                element_id: Some(crossing.stop_line),
                regulatory_element_id: Some(crosswalk.id),
                object_id: Some(wait.id),
                ..Evidence::at(candidate, scratch.path.index_at(memo.distance_m))
            });
        }
        None
    }
}

fn crosswalks_of(along: Option<&AlongRoute>) -> Result<&[Crosswalk], Cow<'static, str>> {
    along.ok_or(NOT_OBSERVED)?.crosswalks.as_deref().map_err(Clone::clone)
}

fn first_moving(points: &[TrajectoryPoint]) -> Option<&TrajectoryPoint> {
    points.iter().find(|point| f64::from(point.longitudinal_velocity_mps) > STANDING_MPS)
}

impl Filter for CrosswalkFilter {
    fn name(&self) -> &'static str {
        NAME
    }

    fn fill(&self) -> Option<Fill> {
        Some(Fill { entries: self.timers.len(), bound: timers::MAX_KEYS })
    }

    fn configure(&mut self, parameters: &ValidatorParameters) {
        self.parameters = parameters.crosswalk.clone();
        // Detection areas depend on the margins.
        if let Some(along) = &mut self.along {
            along.is_stale = true;
        }
    }

    fn observe(&mut self, scene: &Scene) {
        self.people.clear();
        self.cycle = self.begin_cycle(scene);
    }

    fn judge(&self, _scene: &Scene, candidate: &Candidate, scratch: &mut Scratch) -> Judgement {
        let (cycle, crosswalks) = match (&self.cycle, crosswalks_of(self.along.as_ref())) {
            (Ok(cycle), Ok(crosswalks)) => (cycle, crosswalks),
            (Err(why), _) => return Judgement::not_assessed(why.clone()),
            (_, Err(why)) => return Judgement::not_assessed(why),
        };
        find_crossings(
            &candidate.points,
            crosswalks,
            &cycle.outlook,
            &mut scratch.path,
            &mut scratch.crossings,
        );
        if scratch.crossings.is_empty() {
            return Judgement::feasible([]);
        }
        let met = |crossing: &Crossing| Met {
            crosswalk: crossing.crosswalk as u32,
            at_stop: cycle.is_standing && crossing.arc_m - self.front_m <= cycle.outlook.arrived_m,
        };
        let mut memo =
            CrosswalkMemo { met: scratch.crossings.iter().map(met).collect(), ..CrosswalkMemo::default() };
        let evidence = self.find_obstruction(cycle, crosswalks, candidate, scratch, &mut memo);
        let risk = if evidence.is_some() { RiskLevel::Danger } else { RiskLevel::Safe };
        Judgement {
            feasible: evidence.is_none(),
            failure: None,
            metrics: smallvec![Metric { name: METRIC, value: 0.0, threshold: f64::NAN, risk }],
            evidence,
            memo: Memo::Crosswalk(memo),
        }
    }

    fn remember(&mut self, judged: &[(&Candidate, &Judgement)]) {
        let Ok(cycle) = &self.cycle else { return };
        let Ok(crosswalks) = crosswalks_of(self.along.as_ref()) else { return };
        for (candidate, judgement) in judged {
            let Memo::Crosswalk(memo) = &judgement.memo else {
                self.timers.touch(candidate.key, cycle.clock.now_ns);
                continue;
            };
            let met = memo.met.iter().filter_map(|met| {
                let index = met.crosswalk as usize;
                Some((crosswalks.get(index)?.id, self.people.at(index), met.at_stop))
            });
            self.timers.fold(candidate.key, &cycle.clock, met);
        }
        self.timers.evict(&cycle.clock);
    }

    fn explain(&self, judgement: &Judgement) -> Option<String> {
        let (Memo::Crosswalk(memo), Some(at)) = (&judgement.memo, &judgement.evidence) else {
            return crate::verdict::explain(judgement);
        };
        let (stop_line, crosswalk) = (at.element_id?, at.regulatory_element_id?);
        let line = format!("stop line {stop_line} of crosswalk {crosswalk}");
        let where_and_when = if memo.distance_m < 0.0 {
            format!("front bumper stands {:.1} m past {line}", -memo.distance_m)
        } else {
            format!("front bumper reaches {line} after {:.1} s, {:.1} m ahead", at.time_s, memo.distance_m)
        };
        Some(format!(
            "{where_and_when}, but has to wait {:.1} s more for {}",
            memo.remaining_s, at.object_id?
        ))
    }

    fn planning_factor(&self, scene: &Scene, judgement: &Judgement) -> Option<PlanningFactor> {
        planning_factor(scene, judgement)
    }
}

#[cfg(test)]
mod tests;
