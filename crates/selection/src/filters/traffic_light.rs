//! Rejects candidates whose front bumper would pass the stop line of a red light, or of an amber light at which the
//! vehicle can still stop.
//!
//! Two metrics, always both, in a fixed order: red and amber. Only lights of the preferred lanelets of the route count.
//! What a light shows is steadied by the [`signal_tracker`]; which lights forbid passing is decided once per cycle; the
//! [`checked_path`] of each candidate is then held against their stop lines. Lights refused at amber stay refused for a
//! while, and a violation is looked for at least as far ahead as it was found before, so that verdicts do not flicker.
//! Both memories are kept for each candidate on its own.
//!
//! Without map, route, signals, odometry or acceleration, or with a route that leaves the map, nothing is judged: no
//! candidate is feasible. Source: `autoware_trajectory_validator`, `TrafficLightFilter` of 0.53.0.

mod checked_path;
mod compliance;
mod lamps;
mod memory;
mod route_lights;
mod signal_tracker;

pub use memory::TrafficLightMemo;

use self::compliance::{Demand, Ego, Findings, Shown};
use self::memory::Memory;
use self::route_lights::{RouteLights, UnknownLanelet};
use self::signal_tracker::{AmberOrigin, Signal, SignalTracker, seconds_between};
use super::{Fill, Filter, Scratch};
use crate::candidate::Candidate;
use crate::parameters::{TrafficLightParameters, ValidatorParameters};
use crate::scene::Scene;
use crate::verdict::{Judgement, Memo, Metric, RiskLevel};
use motion::calculate_stop_distance;
use smallvec::smallvec;
use std::borrow::Cow;
use std::sync::Arc;

/// Name of the filter.
pub const NAME: &str = "traffic_light_filter";
/// Metric of red lights.
pub const RED_METRIC: &str = "check_crossing_red_light";
/// Metric of amber lights.
pub const AMBER_METRIC: &str = "check_crossing_amber_light";

/// A step of the clock back by more than this is a new start, not a message out of order, s.
const CLOCK_RESTART_S: f64 = 1.0;

/// Why nothing can be judged in a cycle.
type Obstacle = Cow<'static, str>;

/// The filter with its parameters and memory.
#[derive(Debug)]
pub struct TrafficLightFilter {
    parameters: TrafficLightParameters,
    front_offset_m: f64,
    tracker: SignalTracker,
    memory: Memory,
    /// Stamp of the newest odometry, ns.
    now_ns: Option<i64>,
    /// Number of the map that ids in memory belong to.
    map_number: Option<u64>,
    /// Lights of the route, with the numbers of map and route that they come from.
    route: Option<((u64, u64), Result<RouteLights, UnknownLanelet>)>,
    cycle: Result<Cycle, Obstacle>,
}

/// What all candidates of a cycle share.
#[derive(Debug)]
struct Cycle {
    ego: Ego,
    /// Lights that must not be passed, in order of the signals.
    red: Vec<Demand>,
    /// Lights that must not be passed unless stopping is impossible, in order of the signals.
    amber: Vec<Demand>,
}

impl Cycle {
    fn constrains(&self, light_id: i64) -> bool {
        self.red.iter().chain(&self.amber).any(|demand| demand.light_id == light_id)
    }
}

impl TrafficLightFilter {
    /// A filter for a vehicle whose front bumper is this far ahead of its reference point, m.
    #[must_use]
    pub fn new(parameters: TrafficLightParameters, front_offset_m: f64) -> Self {
        Self {
            parameters,
            front_offset_m,
            tracker: SignalTracker::default(),
            memory: Memory::default(),
            now_ns: None,
            map_number: None,
            route: None,
            cycle: Err(Obstacle::Borrowed("No scene was observed")),
        }
    }

    /// Forgets what belongs to an old map, and derives the lights of the route anew where map or route changed.
    fn follow_map_and_route(&mut self, scene: &Scene) {
        let Some(map) = &scene.map else { return };
        if self.map_number.is_some_and(|number| number != map.number) {
            self.memory.clear();
            self.tracker.doubt_origins();
        }
        self.map_number = Some(map.number);
        let Some(route) = &scene.route else { return };
        let numbers = (map.number, route.number);
        if self.route.as_ref().is_none_or(|(of, _)| *of != numbers) {
            self.route = Some((numbers, RouteLights::new(&map.value.map, &route.value)));
        }
    }

    /// Advances the tracker if there are signals and odometry.
    fn follow_signals(&mut self, scene: &Scene) {
        let (Some(odometry), Some(signals)) = (&scene.odometry, &scene.traffic_signals) else { return };
        let now_ns = odometry.header.stamp.nanoseconds();
        if self.now_ns.is_some_and(|before| seconds_between(now_ns, before) > CLOCK_RESTART_S) {
            self.tracker.restart_clock(now_ns);
            self.memory.restart_clock(now_ns);
        }
        self.now_ns = Some(now_ns);
        let stopped = self.is_stopped(odometry.twist.twist.linear.x);
        self.tracker.update(&signals.traffic_light_groups, now_ns, stopped, &self.parameters);
    }

    fn is_stopped(&self, speed_mps: f64) -> bool {
        speed_mps.abs() < self.parameters.ego_stopped_velocity_threshold
    }

    /// What the candidates share, or the first thing missing.
    fn prepare(&self, scene: &Scene) -> Result<Cycle, Obstacle> {
        scene.map.as_ref().ok_or("Lanelet map is not set")?;
        scene.route.as_ref().ok_or("Route is not set")?;
        scene.traffic_signals.as_ref().ok_or("Traffic signals are not set")?;
        let odometry = scene.odometry.as_ref().ok_or("Odometry is not set")?;
        let acceleration = scene.acceleration.as_ref().ok_or("Acceleration is not set")?;
        let lights = match &self.route {
            Some((_, Ok(lights))) => lights,
            Some((_, Err(UnknownLanelet(id)))) => {
                return Err(format!("lanelet {id} is not in the map").into());
            }
            None => return Err("Route is not set".into()),
        };
        let speed_mps = odometry.twist.twist.linear.x;
        let acceleration_mps2 = acceleration.accel.accel.linear.x;
        if !(speed_mps.is_finite() && acceleration_mps2.is_finite()) {
            return Err("Odometry or acceleration is not finite".into());
        }
        let (mut red, mut amber) = (Vec::new(), Vec::new());
        for signal in self.tracker.signals() {
            match self.demand(lights, signal) {
                Some(demand) if demand.shown == Shown::Amber => amber.push(demand),
                Some(demand) => red.push(demand),
                None => {}
            }
        }
        let limits = &self.parameters.checked_trajectory_length;
        let ego = Ego {
            now_ns: odometry.header.stamp.nanoseconds(),
            stopped: self.is_stopped(speed_mps),
            front_offset_m: self.front_offset_m,
            stop_distance_m: calculate_stop_distance(
                speed_mps,
                acceleration_mps2,
                limits.deceleration_limit,
                limits.jerk_limit,
                self.parameters.delay_response_time,
            ),
        };
        Ok(Cycle { ego, red, amber })
    }

    /// What a signal demands of everybody on the route; `None` if nothing.
    fn demand(&self, lights: &RouteLights, signal: &Signal) -> Option<Demand> {
        let light = lights.get(signal.light_id)?;
        let (lamps, parameters) = (&signal.lamps, &self.parameters);
        let ends_green_of_arrow_light = parameters.enable_arrow_aware_amber_passing
            && lamps.is_amber()
            && signal.origin == AmberOrigin::FromGreen
            && light.turn.is_to_a_side()
            && light.has_arrow;
        if ends_green_of_arrow_light || lamps.lets_go(light.turn) {
            return None;
        }
        let shown = if lamps.is_red() {
            Shown::Red
        } else if lamps.is_unknown() && parameters.treat_unknown_light_as_red_light {
            Shown::UnknownAsRed
        } else if lamps.is_amber() && parameters.treat_amber_light_as_red_light {
            Shown::AmberAsRed
        } else if lamps.is_amber() {
            Shown::Amber
        } else {
            return None;
        };
        let passing_limit_s = (parameters.crossing_time_limit - signal.duration_s).max(0.0);
        let stop_line = Arc::clone(&light.stop_line);
        Some(Demand { light_id: signal.light_id, shown, stop_line, passing_limit_s })
    }
}

/// Whether a candidate violates lights of a colour. The value says nothing; upstream has it at zero, too.
fn metric(name: &'static str, violated: bool) -> Metric {
    let risk = if violated { RiskLevel::Danger } else { RiskLevel::Safe };
    Metric { name, value: 0.0, threshold: f64::NAN, risk }
}

impl Filter for TrafficLightFilter {
    fn name(&self) -> &'static str {
        NAME
    }

    fn fill(&self) -> Option<Fill> {
        Some(Fill {
            entries: self.tracker.len() + self.memory.len(),
            bound: signal_tracker::MAX_LIGHTS + memory::MAX_CANDIDATES,
        })
    }

    fn configure(&mut self, parameters: &ValidatorParameters) {
        self.parameters = parameters.traffic_light.clone();
    }

    fn observe(&mut self, scene: &Scene) {
        self.follow_map_and_route(scene);
        self.follow_signals(scene);
        self.cycle = self.prepare(scene);
    }

    fn judge(&self, _scene: &Scene, candidate: &Candidate, scratch: &mut Scratch) -> Judgement {
        let cycle = match &self.cycle {
            Ok(cycle) => cycle,
            Err(obstacle) => return Judgement::not_assessed(obstacle.clone()),
        };
        let findings: Findings = compliance::check(
            &candidate.points,
            cycle,
            &self.parameters,
            self.memory.of(&candidate.key),
            &mut scratch.per_point,
        );
        Judgement {
            feasible: !(findings.red || findings.amber),
            failure: None,
            metrics: smallvec![metric(RED_METRIC, findings.red), metric(AMBER_METRIC, findings.amber)],
            evidence: findings.evidence,
            memo: Memo::TrafficLight(findings.memo),
        }
    }

    fn remember(&mut self, judged: &[(&Candidate, &Judgement)]) {
        let Ok(cycle) = &self.cycle else { return };
        let (now_ns, hysteresis_s) = (cycle.ego.now_ns, self.parameters.amber_rejection.hysteresis_duration);
        for (candidate, judgement) in judged {
            if let Memo::TrafficLight(memo) = &judgement.memo {
                self.memory.fold(candidate.key, memo, now_ns, hysteresis_s, |id| cycle.constrains(id));
            }
        }
        self.memory.evict(now_ns, hysteresis_s);
    }

    fn explain(&self, judgement: &Judgement) -> Option<String> {
        compliance::explain(judgement).or_else(|| crate::verdict::explain(judgement))
    }
}

#[cfg(test)]
mod tests;
