//! The six metrics of the quality score: what each says about every sample of a candidate.
//!
//! All values are 32-bit and between 0 and 1: the magnitude of a quantity over the `maximum` that counts as 1. A
//! maximum of practically zero switches a metric off: all its values are 0. Deviations, where smaller is better, are
//! everything but the distance travelled.

use super::history::{Chosen, History};
use super::preferred_lanes::PreferredLanes;
use super::sampling::samples;
use crate::candidate::Candidate;
use crate::parameters::{EvaluationParameters, QualityMetric};
use motion::trajectory::{find_nearest_segment, longitudinal_offset_to_segment};
use motion::{Point2, Pose, Posed, TrajectoryPoint};

/// Smallest step of time that is divided by \[s\].
const MIN_STEP_S: f64 = 1e-3;
/// A smaller maximum switches a metric off; in the metric's unit.
const MIN_MAXIMUM: f64 = 1e-3;
/// The same for the consistency with earlier trajectories \[m\].
const MIN_CONSISTENCY_MAXIMUM_M: f64 = 1e-6;
/// How far ahead the place lies that the vehicle steers to \[m\].
const LOOKAHEAD_M: f64 = 10.0;
/// Curvature towards a place straight ahead \[1/m\].
const STRAIGHT_CURVATURE: f32 = 1e-9;

/// What all candidates of a cycle are measured against.
#[derive(Debug, Clone, Copy)]
pub struct Surroundings<'a> {
    /// Where the vehicle is.
    pub ego: &'a Pose,
    /// Distance between its axles \[m\].
    pub wheel_base_m: f64,
    /// Where the route would have it.
    pub lanes: &'a PreferredLanes,
    /// What was chosen before.
    pub history: &'a History,
    /// Sampling and maxima.
    pub parameters: &'a EvaluationParameters,
}

/// A candidate's samples, ready to be measured.
#[derive(Debug)]
pub struct Measured<'a> {
    surroundings: Surroundings<'a>,
    candidate: &'a Candidate,
    samples: Vec<TrajectoryPoint>,
}

impl<'a> Measured<'a> {
    /// Samples a candidate. `None` if the vehicle is nowhere near it, so that there is nothing to measure.
    #[must_use]
    pub fn new(surroundings: Surroundings<'a>, candidate: &'a Candidate) -> Option<Self> {
        let samples = samples(&candidate.points, surroundings.ego, surroundings.parameters);
        (!samples.is_empty()).then_some(Self { surroundings, candidate, samples })
    }

    /// The values of a metric, one for each sample.
    #[must_use]
    pub fn values(&self, metric: QualityMetric) -> Vec<f32> {
        let parameters = self.surroundings.parameters;
        let maximum = parameters.of(metric).maximum;
        let smallest = match metric {
            QualityMetric::TrajectoryConsistency => MIN_CONSISTENCY_MAXIMUM_M,
            _ => MIN_MAXIMUM,
        };
        if maximum < smallest {
            return vec![0.0; self.samples.len()];
        }
        let step_s = parameters.sampling_resolution.max(MIN_STEP_S) as f32;
        let mut values = match metric {
            QualityMetric::LateralAcceleration => {
                let speeds = self.samples.iter().map(|sample| sample.lateral_velocity_mps);
                rates(&speeds.collect::<Vec<_>>(), step_s)
            }
            QualityMetric::LongitudinalJerk => {
                let speeds = self.samples.iter().map(|sample| sample.longitudinal_velocity_mps);
                rates(&rates(&speeds.collect::<Vec<_>>(), step_s), step_s)
            }
            QualityMetric::TravelDistance => self.distances(),
            QualityMetric::LateralDeviation => self.lateral_deviations(),
            QualityMetric::SteeringConsistency => self.steering_changes(),
            QualityMetric::TrajectoryConsistency => self.spread(),
        };
        values.iter_mut().for_each(|value| *value = share(*value, maximum as f32));
        values
    }

    fn distances(&self) -> Vec<f32> {
        let mut lengths = Vec::new();
        motion::trajectory::cumulative_arc_length(&self.samples, &mut lengths);
        lengths.into_iter().map(|length| length as f32).collect()
    }

    fn lateral_deviations(&self) -> Vec<f32> {
        let lanes = self.surroundings.lanes;
        let deviation = |sample: &TrajectoryPoint| lanes.lateral_deviation_m(&sample.pose).unwrap_or(0.0);
        self.samples.iter().map(|sample| deviation(sample) as f32).collect()
    }

    /// Difference between the steering angles towards the place ahead on this candidate and on the previous trajectory.
    fn steering_changes(&self) -> Vec<f32> {
        let Surroundings { history, wheel_base_m, parameters, .. } = self.surroundings;
        let sampled = |chosen: &Chosen| samples(&chosen.points, &chosen.ego, parameters);
        let previous = history.previous().map(sampled).unwrap_or_default();
        if previous.is_empty() {
            return vec![0.0; self.samples.len()];
        }
        let angle = |path: &[TrajectoryPoint], pose: &Pose| {
            let curvature = place_ahead(path, pose.point()).map_or(0.0, |place| curvature_to(pose, place));
            (wheel_base_m * f64::from(curvature)).atan()
        };
        let change = |pose: &Pose| angle(&self.samples, pose) - angle(&previous, pose);
        self.samples.iter().map(|sample| change(&sample.pose) as f32).collect()
    }

    /// The same value for all samples.
    fn spread(&self) -> Vec<f32> {
        let Surroundings { history, parameters, .. } = self.surroundings;
        let horizon_s = parameters.trajectory_consistency.time_horizon;
        let stamp = self.candidate.message.header.stamp;
        let spread_m = history.spread_m(stamp, &self.candidate.points, horizon_s).unwrap_or(0.0);
        vec![spread_m as f32; self.samples.len()]
    }
}

/// Changes per time from each value to the next; the last one is repeated. Zeros for fewer than two values.
fn rates(values: &[f32], step_s: f32) -> Vec<f32> {
    let mut rates: Vec<f32> = values.windows(2).map(|pair| (pair[1] - pair[0]) / step_s).collect();
    let last = rates.last().copied().unwrap_or(0.0);
    rates.resize(values.len(), last);
    rates
}

/// Magnitude as a share of the maximum, at most 1. Not-a-number stays so.
fn share(value: f32, maximum: f32) -> f32 {
    let share = value.abs() / maximum;
    if share > 1.0 { 1.0 } else { share }
}

/// The place on a path [`LOOKAHEAD_M`] ahead of the projection of `from`; the end of the path if that is past it, or if
/// the projection lies so far before the start that nothing is ahead.
fn place_ahead(path: &[TrajectoryPoint], from: Point2) -> Option<Point2> {
    let end = path.last()?.point();
    let segment = find_nearest_segment(path, from)?;
    let mut rest = longitudinal_offset_to_segment(path, segment, from).unwrap_or(0.0) + LOOKAHEAD_M;
    if rest < 0.0 {
        return Some(end);
    }
    for pair in path[segment..].windows(2) {
        let (start, along) = (pair[0].point(), pair[1].point() - pair[0].point());
        let length = along.norm();
        if rest <= length && length > 0.0 {
            return Some(start + along * (rest / length));
        }
        rest -= length;
    }
    Some(end)
}

/// Curvature of the circle from a pose through a place \[1/m\], positive to the left.
fn curvature_to(pose: &Pose, place: Point2) -> f32 {
    let ahead = place - pose.point();
    // Yaw and curvature are 32-bit in the original, which shows at short distances.
    let (sin, cos) = f64::from(pose.yaw() as f32).sin_cos();
    let left_m = cos * ahead.y - sin * ahead.x;
    if left_m == 0.0 { STRAIGHT_CURVATURE } else { (2.0 * left_m / ahead.norm_squared()) as f32 }
}
