//! Holds the checked part of a candidate against the stop lines of the lights that forbid passing.

use super::Cycle;
use super::checked_path::{CheckedPath, Crossing, Reach, has_future};
use super::memory::{CandidateMemory, LightMark, TrafficLightMemo};
use super::route_lights::StopLine;
use crate::parameters::TrafficLightParameters;
use crate::verdict::{Evidence, Judgement, Memo};
use motion::{TrajectoryPoint, calculate_stop_distance};
use std::sync::Arc;

/// Below this the exception for vehicles that cannot stop is off, m.
const ALLOWANCE_OFF_M: f64 = 1e-3;

/// Slowest speed by which the time of the front bumper is brought forward, m/s.
const SLOWEST_FRONT_MPS: f64 = 1e-3;

/// What a light shows that forbids passing it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Shown {
    /// A red circle.
    Red,
    /// An unknown colour, to be treated as red.
    UnknownAsRed,
    /// An amber circle, to be treated as red.
    AmberAsRed,
    /// An amber circle.
    Amber,
}

impl Shown {
    fn words(self) -> &'static str {
        match self {
            Self::Red => "red light",
            Self::UnknownAsRed => "light of unknown colour (treated as red)",
            Self::AmberAsRed => "amber light (treated as red)",
            Self::Amber => "amber light",
        }
    }
}

/// A light that forbids passing.
#[derive(Debug)]
pub(super) struct Demand {
    /// Id of the light.
    pub light_id: i64,
    /// What it shows.
    pub shown: Shown,
    /// Where to stop.
    pub stop_line: Arc<StopLine>,
    /// At amber: the line may be passed if it is reached within this time and stopping is impossible, s.
    pub passing_limit_s: f64,
}

/// The vehicle at the start of the cycle.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ego {
    /// Stamp of its odometry, ns.
    pub now_ns: i64,
    /// Whether it stands.
    pub stopped: bool,
    /// Front bumper ahead of the pose, m.
    pub front_offset_m: f64,
    /// How far it still travels when it brakes, if the limits stop it at all, m.
    pub stop_distance_m: Option<f64>,
}

/// The violation that the front bumper comes to first.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct NearestViolation {
    /// What the light shows.
    pub shown: Shown,
    /// How far the line is ahead of the front bumper, negative if it is behind it, m.
    pub ahead_m: f64,
}

/// What was found on a candidate.
#[derive(Debug, Default)]
pub(super) struct Findings {
    /// A light that must not be passed is.
    pub red: bool,
    /// An amber light is passed although stopping is possible.
    pub amber: bool,
    /// The violation that the front bumper comes to first.
    pub evidence: Option<Evidence>,
    /// What to remember.
    pub memo: TrafficLightMemo,
}

/// Checks a candidate against all lights of the cycle.
pub(super) fn check(
    points: &[TrajectoryPoint],
    cycle: &Cycle,
    parameters: &TrafficLightParameters,
    memory: Option<&CandidateMemory>,
    lengths_m: &mut Vec<f64>,
) -> Findings {
    let mut findings = Findings::default();
    findings.memo.checked = has_future(points);
    if !findings.memo.checked || (cycle.red.is_empty() && cycle.amber.is_empty()) {
        return findings;
    }
    let ego = &cycle.ego;
    let remembered_m = memory.map_or(0.0, |memory| memory.farthest_violation_m(|id| cycle.constrains(id)));
    let look_ahead_m = (ego.stop_distance_m.unwrap_or(0.0) + parameters.stop_overshoot_margin)
        .max(parameters.min_lookahead_distance)
        .max(remembered_m);
    let stop_speed_mps = parameters.ego_stopped_velocity_threshold;
    let path = CheckedPath::new(points, lengths_m, look_ahead_m, stop_speed_mps, ego.front_offset_m);
    let Some(path) = path else { return findings };
    let check = Check { ego, parameters, memory, path: &path };
    for demand in &cycle.red {
        if let Some(crossing) = check.violated_red(demand) {
            findings.red = true;
            findings.add_violation(&check, demand, &crossing);
            findings.mark(demand, Some(&crossing), &path, false);
        }
    }
    for demand in &cycle.amber {
        match check.amber(demand) {
            Amber::Passable => {}
            Amber::StopsBefore => findings.mark(demand, None, &path, true),
            Amber::Violated { crossing, refused } => {
                findings.amber = true;
                findings.add_violation(&check, demand, &crossing);
                findings.mark(demand, Some(&crossing), &path, refused);
            }
        }
    }
    findings
}

/// What a candidate does at an amber light.
enum Amber {
    /// Nothing wrong.
    Passable,
    /// It plans a stop, and that shall be remembered.
    StopsBefore,
    /// It passes the line although it must not.
    Violated {
        /// Where.
        crossing: Crossing,
        /// Whether to remember the light as refused.
        refused: bool,
    },
}

/// Everything that the checks of one candidate share.
struct Check<'a> {
    ego: &'a Ego,
    parameters: &'a TrafficLightParameters,
    memory: Option<&'a CandidateMemory>,
    path: &'a CheckedPath<'a>,
}

impl Check<'_> {
    /// Where a light that must not be passed is passed.
    fn violated_red(&self, demand: &Demand) -> Option<Crossing> {
        let crossing = self.path.crossing(&demand.stop_line, Reach::Bumper)?;
        let excused = self.stops_at(demand) || self.is_unavoidable(self.ahead_m(&crossing));
        (!excused).then_some(crossing)
    }

    fn amber(&self, demand: &Demand) -> Amber {
        let crossing = self.path.crossing(&demand.stop_line, Reach::LastPose);
        let Some(crossing) = crossing.filter(|_| !self.stops_at(demand)) else {
            let remembers = self.path.stops() && self.parameters.amber_rejection.reject_if_stop_detected;
            return if remembers { Amber::StopsBefore } else { Amber::Passable };
        };
        let ahead_m = self.ahead_m(&crossing);
        if self.is_unavoidable(ahead_m) {
            return Amber::Passable;
        }
        let can_pass =
            !self.can_stop_within(ahead_m) && self.front_time_s(&crossing) <= demand.passing_limit_s;
        if can_pass && !self.is_forced(demand.light_id) {
            return Amber::Passable;
        }
        Amber::Violated { crossing, refused: !can_pass }
    }

    /// How far a crossing is ahead of the front bumper, m.
    fn ahead_m(&self, crossing: &Crossing) -> f64 {
        crossing.distance_m - self.ego.front_offset_m
    }

    /// Whether the candidate plans to stand at the line.
    fn stops_at(&self, demand: &Demand) -> bool {
        self.path.stops_within(&demand.stop_line, self.parameters.stop_overshoot_margin)
    }

    /// Whether the line is so near that passing it is allowed because the vehicle cannot stop before it.
    fn is_unavoidable(&self, ahead_m: f64) -> bool {
        let allowance_m = self.parameters.allow_if_cannot_stop_distance;
        self.ego.stop_distance_m.is_some_and(|stop_m| {
            allowance_m >= ALLOWANCE_OFF_M
                && ahead_m < allowance_m
                && ahead_m < stop_m - self.parameters.stop_overshoot_margin
        })
    }

    /// Whether the candidate could stop within a distance, braking as the vehicle is expected to at amber.
    fn can_stop_within(&self, ahead_m: f64) -> bool {
        let (first, parameters) = (self.path.first(), self.parameters);
        let stop_m = calculate_stop_distance(
            f64::from(first.longitudinal_velocity_mps),
            f64::from(first.acceleration_mps2),
            parameters.deceleration_limit,
            parameters.jerk_limit,
            parameters.delay_response_time,
        );
        stop_m.is_some_and(|stop_m| stop_m <= ahead_m)
    }

    /// Time at which the front bumper is at a crossing: that of the pose, brought forward at the speed before it, s.
    fn front_time_s(&self, crossing: &Crossing) -> f64 {
        let (time_s, speed_mps) = self.path.time_and_speed(crossing);
        (time_s - self.ego.front_offset_m / speed_mps.max(SLOWEST_FRONT_MPS)).max(0.0)
    }

    /// Whether the light was refused lately. A vehicle that stands may think again.
    fn is_forced(&self, light_id: i64) -> bool {
        let hysteresis_s = self.parameters.amber_rejection.hysteresis_duration;
        let refused = |memory: &CandidateMemory| memory.was_refused(light_id, self.ego.now_ns, hysteresis_s);
        !self.ego.stopped && self.memory.is_some_and(refused)
    }
}

impl Findings {
    fn mark(&mut self, demand: &Demand, violation: Option<&Crossing>, path: &CheckedPath<'_>, refused: bool) {
        let arc_m = violation.map(|crossing| crossing.distance_m + path.backward_length_m());
        let mark = LightMark { light_id: demand.light_id, violation_arc_m: arc_m, refused };
        self.memo.marks.push(mark);
    }

    /// Keeps the violation as evidence if the front bumper comes to it first.
    fn add_violation(&mut self, check: &Check<'_>, demand: &Demand, crossing: &Crossing) {
        let ahead_m = check.ahead_m(crossing);
        if self.memo.nearest_violation.is_some_and(|nearest| nearest.ahead_m <= ahead_m) {
            return;
        }
        let arrival = check.path.front_arrival(crossing, check.ego.front_offset_m);
        self.memo.nearest_violation = Some(NearestViolation { shown: demand.shown, ahead_m });
        self.evidence = Some(Evidence {
            index: arrival.index,
            time_s: arrival.time_s,
            x_m: crossing.place.x,
            y_m: crossing.place.y,
            element_id: Some(demand.stop_line.id),
            regulatory_element_id: Some(demand.light_id),
            object_id: None,
        });
    }
}

/// The nearest violation in one line of plain words.
pub(super) fn explain(judgement: &Judgement) -> Option<String> {
    let Memo::TrafficLight(memo) = &judgement.memo else { return None };
    let (nearest, at) = (memo.nearest_violation?, judgement.evidence?);
    let (line, light) = (at.element_id?, at.regulatory_element_id?);
    let what = nearest.shown.words();
    Some(if nearest.ahead_m < 0.0 {
        format!(
            "front bumper is {:.1} m past stop line {line} of {what} {light} and drives on",
            -nearest.ahead_m
        )
    } else {
        format!(
            "front bumper crosses stop line {line} of {what} {light} at {:.1} s, {:.1} m ahead",
            at.time_s, nearest.ahead_m
        )
    })
}
