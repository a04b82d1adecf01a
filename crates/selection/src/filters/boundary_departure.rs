//! Rejects candidates that come so near to an uncrossable border that the vehicle cannot stop before it.
//!
//! At every point of a candidate the lateral distance of both sides of the vehicle to the nearest borders is measured.
//! A distance within the margin is critical if it is reached within the braking distance or the cutoff time; other near
//! distances are reported only. A critical finding must last before it rejects and be absent before the rejection ends
//! (hysteresis by candidate key), unless it is due at once. Source: `autoware_boundary_departure_checker` and
//! `UncrossableBoundaryDepartureFilter` of 0.53.0, with the true nearest segments instead of those of a reflected index.

mod borders;
mod bounds;
mod claims;
mod departure;
mod hysteresis;
mod projection;
mod stance;
mod tolerance;

use std::sync::Arc;

use messages::geometry_msgs::Pose;
use motion::footprint::Footprint;
use motion::{VehicleInfo, calculate_stop_distance};
use smallvec::smallvec;

use super::{Fill, Filter, Scratch};
use crate::candidate::Candidate;
use crate::parameters::{BoundaryDepartureParameters, ValidatorParameters};
use crate::scene::{Epoch, HdMap, Scene};
use crate::verdict::{Evidence, Judgement, Memo, Metric, RiskLevel};

pub(crate) use self::borders::Borders;
use self::borders::Neighbourhoods;
use self::claims::Claims;
use self::departure::{Evaluation, Finding, Limits, Watch};
pub use self::hysteresis::Hysteresis;
use self::hysteresis::{Buffers, Memory, Status};
use self::stance::{Side, Stance, stances_along};

/// Name of the filter.
pub const NAME: &str = "uncrossable_boundary_departure_filter";
/// Name of its metric: smallest lateral distance of the findings of both sides \[m\], negative behind a crossed border,
/// `f64::MAX` without any.
pub const METRIC: &str = "lat_dist_to_uncrossable_bound";

/// The filter with its parameters, the borders of the map and the hysteresis of every candidate key.
#[derive(Debug)]
pub struct UncrossableBoundaryDepartureFilter {
    parameters: BoundaryDepartureParameters,
    vehicle: VehicleInfo,
    outline: Footprint,
    map: Option<(u64, Arc<Borders>)>,
    memory: Memory,
    cycle: Result<Cycle, &'static str>,
}

/// What all candidates of a cycle share.
#[derive(Debug)]
struct Cycle {
    borders: Arc<Borders>,
    now_s: f64,
    limits: Limits,
}

/// Buffers of the filter.
#[derive(Debug, Default)]
pub struct Buffer {
    stances: Vec<Stance>,
    neighbourhoods: Neighbourhoods,
    claims: Claims,
    left: Watch,
    right: Watch,
}

impl UncrossableBoundaryDepartureFilter {
    /// A filter for this vehicle; it judges nothing before it has observed a scene.
    #[must_use]
    pub fn new(parameters: BoundaryDepartureParameters, vehicle: VehicleInfo) -> Self {
        Self {
            parameters,
            vehicle,
            outline: vehicle.footprint(0.0, 0.0),
            map: None,
            memory: Memory::default(),
            cycle: Err("no scene was observed"),
        }
    }

    fn buffers(&self) -> Buffers {
        Buffers { on_s: self.parameters.on_time_buffer_s, off_s: self.parameters.off_time_buffer_s }
    }

    /// Everything that the candidates of this scene share, or which input is missing.
    fn prepare(&mut self, scene: &Scene) -> Result<Cycle, &'static str> {
        let borders = self.borders(scene)?;
        let odometry = scene.odometry.as_ref().ok_or("odometry is not available")?;
        let acceleration = scene.acceleration.as_ref().ok_or("acceleration is not available")?;
        let speed_mps = odometry.twist.twist.linear.x;
        let acceleration_mps2 = acceleration.accel.accel.linear.x;
        // No stopping distance counts as 0 below; that must not happen for a vehicle whose motion is not known.
        if !(is_finite(&odometry.pose.pose) && speed_mps.is_finite()) {
            return Err("odometry is not finite");
        }
        if !acceleration_mps2.is_finite() {
            return Err("acceleration is not finite");
        }
        let parameters = &self.parameters;
        let stop_m = calculate_stop_distance(
            speed_mps,
            acceleration_mps2,
            parameters.max_deceleration_mps2,
            parameters.max_jerk_mps3,
            parameters.brake_delay_s,
        );
        let limits = Limits {
            lateral_margin_m: parameters.lateral_margin_m,
            braking_m: self.vehicle.front_overhang_m() + stop_m.unwrap_or(0.0).max(0.0),
            cutoff_s: parameters.time_to_departure_cutoff_s,
        };
        // One division of the whole count: the last bit decides buffers that are met exactly.
        let now_s = odometry.header.stamp.nanoseconds() as f64 / 1e9;
        Ok(Cycle { borders, now_s, limits })
    }

    /// The borders of the scene's map; made anew when the map is replaced.
    fn borders(&mut self, scene: &Scene) -> Result<Arc<Borders>, &'static str> {
        const NO_MAP: &str = "Lanelet map is not available in the context.";
        let Epoch { number, value: map } = scene.map.as_ref().ok_or(NO_MAP)?;
        if map.map.line_strings().len() == 0 {
            return Err(NO_MAP);
        }
        if let Some((_, borders)) = self.map.as_ref().filter(|(made_from, _)| made_from == number) {
            return Ok(Arc::clone(borders));
        }
        let borders = borders_of(map, &self.parameters.boundary_types);
        let borders = borders.ok_or("a border of the map lies beyond the range of coordinates")?;
        self.map = Some((*number, Arc::clone(&borders)));
        Ok(borders)
    }

    /// What both sides find; `None` if no border is near the candidate.
    fn evaluate(&self, cycle: &Cycle, buffer: &mut Buffer) -> Option<Evaluation> {
        let Buffer { stances, neighbourhoods, claims, left, right } = buffer;
        neighbourhoods.attach(&cycle.borders);
        claims.collect(&cycle.borders, neighbourhoods, stances, self.vehicle.vehicle_height_m());
        if claims.left.is_empty() && claims.right.is_empty() {
            return None;
        }
        left.set(&cycle.borders, &claims.left);
        right.set(&cycle.borders, &claims.right);
        let bound_m = left.bound(stances, Side::Left, f64::INFINITY);
        let bound_m = right.bound(stances, Side::Right, bound_m);
        let left = left.walk(stances, Side::Left, &cycle.limits, bound_m);
        let right = right.walk(stances, Side::Right, &cycle.limits, bound_m);
        Some(Evaluation { left, right })
    }

    fn metric(&self, lateral_m: f64, status: Status) -> Metric {
        let near_m = self.parameters.near_boundary_lateral_th_m.max(self.parameters.lateral_margin_m);
        let risk = match status {
            Status::Critical => RiskLevel::Danger,
            Status::Pending => RiskLevel::LowCaution,
            Status::Clear if lateral_m <= near_m => RiskLevel::LowCaution,
            Status::Clear => RiskLevel::Safe,
        };
        Metric { name: METRIC, value: lateral_m, threshold: self.parameters.lateral_margin_m, risk }
    }
}

/// The borders of some types, `None` if one lies beyond the range of coordinates; made unless the map has them already.
pub(super) fn borders_of(map: &HdMap, types: &[String]) -> Option<Arc<Borders>> {
    map.survey.borders.of(types, || Borders::new(&map.map, types).map(Arc::new))
}

/// The point where a candidate is critical for the first time, and the border.
fn evidence(candidate: &Candidate, borders: &Borders, evaluation: &Evaluation) -> Option<Evidence> {
    let first = |a: Finding, b: &Finding| if b.index < a.index { *b } else { a };
    let mut critical = evaluation.critical();
    let finding = critical.next().map(|left| critical.fold(*left, first))?;
    let element_id = Some(borders.line_string(finding.border));
    Some(Evidence { element_id, ..Evidence::at(candidate, finding.index) })
}

fn is_finite(pose: &Pose) -> bool {
    let (position, orientation) = (pose.position, pose.orientation);
    [position.x, position.y, position.z, orientation.x, orientation.y, orientation.z, orientation.w]
        .iter()
        .all(|number| number.is_finite())
}

impl Filter for UncrossableBoundaryDepartureFilter {
    fn name(&self) -> &'static str {
        NAME
    }

    fn fill(&self) -> Option<Fill> {
        Some(Fill { entries: self.memory.len(), bound: hysteresis::MOST_KEYS })
    }

    fn configure(&mut self, parameters: &ValidatorParameters) {
        if self.parameters.boundary_types != parameters.boundary_departure.boundary_types {
            self.map = None;
        }
        self.parameters = parameters.boundary_departure.clone();
    }

    fn observe(&mut self, scene: &Scene) {
        self.cycle = self.prepare(scene);
        if let Ok(cycle) = &self.cycle {
            let now_s = cycle.now_s;
            self.memory.advance(now_s, self.buffers());
        }
    }

    fn judge(&self, _scene: &Scene, candidate: &Candidate, scratch: &mut Scratch) -> Judgement {
        let cycle = match &self.cycle {
            Ok(cycle) => cycle,
            Err(why) => return Judgement::not_assessed(*why),
        };
        let buffer = &mut scratch.boundary_departure;
        if !stances_along(&candidate.points, &self.outline, &mut buffer.stances) {
            return Judgement::not_assessed("a point lies beyond the range of coordinates");
        }
        let evaluation = self.evaluate(cycle, buffer);
        let mut hysteresis = self.memory.recall(candidate.key);
        let status = hysteresis.update(cycle.now_s, evaluation.as_ref(), self.buffers());
        let lateral_m = evaluation.as_ref().map_or(f64::MAX, Evaluation::lateral_m);
        Judgement {
            feasible: status != Status::Critical,
            failure: None,
            metrics: smallvec![self.metric(lateral_m, status)],
            evidence: evaluation
                .filter(|_| status == Status::Critical)
                .and_then(|evaluation| evidence(candidate, &cycle.borders, &evaluation)),
            memo: Memo::BoundaryDeparture(hysteresis),
        }
    }

    fn remember(&mut self, judged: &[(&Candidate, &Judgement)]) {
        for (candidate, judgement) in judged {
            if let Memo::BoundaryDeparture(hysteresis) = judgement.memo {
                self.memory.store(candidate.key, hysteresis);
            }
        }
    }

    fn explain(&self, judgement: &Judgement) -> Option<String> {
        let (Some(metric), false) = (judgement.metrics.first(), judgement.feasible) else {
            return crate::verdict::explain(judgement);
        };
        let Some(Evidence { time_s, x_m, y_m, element_id: Some(border), .. }) = judgement.evidence else {
            return Some("a departure found a moment ago is still held".to_owned());
        };
        let what = if metric.value > 0.0 {
            format!("comes within {:.3} m of", metric.value)
        } else {
            "crosses".to_owned()
        };
        Some(format!("{what} border {border} after {time_s:.1} s, at ({x_m:.1}, {y_m:.1})"))
    }
}

#[cfg(test)]
mod tests;
