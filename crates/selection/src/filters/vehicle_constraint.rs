//! Rejects candidates beyond the vehicle's limits of speed, acceleration and steering.
//!
//! Five checks, always all of them, one metric each in a fixed order. A metric's value is the largest observation that
//! violates its limit, 0 if none does; a value equal to its limit passes. Speed is computed in f32 as upstream computes
//! it, so 16.7 m/s on the wire exceeds a limit of 16.7. Steering follows from the geometry of the path (Menger
//! curvature, smoothed over five points); the orientation and wheel-angle fields of the points are not used. Source:
//! `autoware_trajectory_validator`, `VehicleConstraintFilter`.

use super::{Filter, Scratch};
use crate::candidate::Candidate;
use crate::parameters::{ValidatorParameters, VehicleConstraintParameters};
use crate::scene::Scene;
use crate::verdict::{Evidence, Judgement, Memo, Metric, RiskLevel};
use motion::TrajectoryPoint;
use motion::trajectory::{FIRST_SMOOTHED_INDEX, smoothed_steering_angles};

/// Name of the filter.
pub const NAME: &str = "vehicle_constraint_filter";

/// The filter with its limits.
#[derive(Debug)]
pub struct VehicleConstraintFilter {
    limits: VehicleConstraintParameters,
    wheel_base_m: f64,
}

impl VehicleConstraintFilter {
    /// A filter for a vehicle with this wheel base.
    #[must_use]
    pub fn new(limits: VehicleConstraintParameters, wheel_base_m: f64) -> Self {
        Self { limits, wheel_base_m }
    }
}

/// The largest observation beyond one limit, and the first point that is beyond it.
#[derive(Debug, Clone, Copy)]
struct Check {
    name: &'static str,
    limit: f64,
    worst: f64,
    first: Option<usize>,
}

impl Check {
    fn new(name: &'static str, limit: f64) -> Self {
        Self { name, limit, worst: 0.0, first: None }
    }

    #[inline]
    fn observe(&mut self, index: usize, value: f64) {
        if value > self.limit {
            self.worst = self.worst.max(value);
            self.first.get_or_insert(index);
        }
    }

    fn metric(&self) -> Metric {
        let risk = if self.first.is_some() { RiskLevel::HighCaution } else { RiskLevel::Safe };
        Metric { name: self.name, value: self.worst, threshold: self.limit, risk }
    }
}

/// Speed in f32, as the message carries it.
#[inline]
fn speed_mps(point: &TrajectoryPoint) -> f64 {
    let (forward, left) = (point.longitudinal_velocity_mps, point.lateral_velocity_mps);
    f64::from((forward * forward + left * left).sqrt())
}

/// Change of the steering angle per time between two points; 0 where no time passes.
#[inline]
fn rate_rps(angles_rad: [f64; 2], points: &[TrajectoryPoint]) -> f64 {
    let dt_s = points[1].time_from_start.seconds() - points[0].time_from_start.seconds();
    if dt_s > 0.0 { (angles_rad[1] - angles_rad[0]).abs() / dt_s } else { 0.0 }
}

impl Filter for VehicleConstraintFilter {
    fn name(&self) -> &'static str {
        NAME
    }

    fn configure(&mut self, parameters: &ValidatorParameters) {
        self.limits = parameters.vehicle_constraint.clone();
    }

    fn judge(&self, _scene: &Scene, candidate: &Candidate, scratch: &mut Scratch) -> Judgement {
        let points = &*candidate.points;
        let mut speed = Check::new("check_speed", self.limits.max_speed);
        let mut acceleration = Check::new("check_acceleration", self.limits.max_acceleration);
        let mut deceleration = Check::new("check_deceleration", self.limits.max_deceleration);
        for (index, point) in points.iter().enumerate() {
            speed.observe(index, speed_mps(point));
            let along = f64::from(point.acceleration_mps2);
            if along > 0.0 {
                acceleration.observe(index, along);
            } else {
                deceleration.observe(index, -along);
            }
        }

        let mut angle = Check::new("check_steering_angle", self.limits.max_steering_angle);
        let mut rate = Check::new("check_steering_rate", self.limits.max_steering_rate);
        let angles_rad = &mut scratch.per_point;
        smoothed_steering_angles(points, self.wheel_base_m, angles_rad);
        for (offset, angle_rad) in angles_rad.iter().enumerate() {
            angle.observe(offset + FIRST_SMOOTHED_INDEX, angle_rad.abs());
        }
        for (offset, pair) in angles_rad.windows(2).enumerate() {
            let index = offset + FIRST_SMOOTHED_INDEX + 1;
            rate.observe(index, rate_rps([pair[0], pair[1]], &points[index - 1..=index]));
        }

        let checks = [speed, acceleration, deceleration, angle, rate];
        let first = checks.iter().filter_map(|check| check.first).min();
        Judgement {
            feasible: first.is_none(),
            failure: None,
            metrics: checks.iter().map(Check::metric).collect(),
            evidence: first.map(|index| Evidence::at(candidate, index)),
            memo: Memo::Nothing,
        }
    }
}

#[cfg(test)]
mod tests;
