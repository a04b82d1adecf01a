//! The check that comes before all filters: is the candidate a trajectory at all?
//!
//! It always runs, is in no filter list and cannot be put in shadow mode. Its metric is 0 for valid data, otherwise the
//! number of the first defect that is found. A candidate that fails it is judged by no other filter.

use crate::candidate::Candidate;
use crate::scene::Scene;
use crate::verdict::{Evidence, Judgement, Memo, Metric, RiskLevel};
use motion::{Point3, Quaternion, TrajectoryPoint};
use smallvec::smallvec;
use std::fmt;

/// Name of the check and of its metric.
pub const NAME: &str = "data_validity";
/// Its category.
pub const CATEGORY: &str = "data";
/// Name of the metric in reports.
pub const METRIC: &str = "data_validity";

/// Fewest points of a trajectory.
const MIN_POINTS: usize = 2;
/// Most points of a trajectory: a hundred seconds in steps of 10 ms. More is no plan but a defect of a planner, and the
/// time that judging takes for every point is needed for the other candidates of the cycle.
pub const MAX_POINTS: usize = 10_000;
/// How far the squared length of a quaternion may be from 1. Far more than rounding and f32 conversions leave, far less
/// than a quaternion that somebody forgot to fill.
const QUATERNION_NORM_TOLERANCE: f64 = 0.1;
/// No map reaches farther from its origin than this \[m\]: more than twice the way around the Earth. Filters need not
/// care for the overflow of squares, nor for places so coarse that a vehicle has no length.
const MAX_COORDINATE_M: f64 = 1e8;

/// What can be wrong with a candidate's data. The discriminant is the metric's value.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Defect {
    /// Fewer than two points.
    TooFewPoints = 1,
    /// A number that is NaN or infinite.
    NonFinite = 2,
    /// A point whose time is before that of the point before it. Equal times are fine.
    TimeGoesBack = 3,
    /// An orientation that is no rotation, for example a zero quaternion. Footprints would be placed at random.
    NoRotation = 4,
    /// A frame other than the map's. Its coordinates mean another place.
    WrongFrame = 5,
    /// A position that no map has. Its distances from anything overflow, or say nothing.
    NoPlace = 6,
    /// More points than anybody plans; looked for first, so that such a candidate costs no time.
    TooManyPoints = 7,
}

impl Defect {
    /// All of them, in order.
    pub const ALL: [Self; 7] = [
        Self::TooFewPoints,
        Self::NonFinite,
        Self::TimeGoesBack,
        Self::NoRotation,
        Self::WrongFrame,
        Self::NoPlace,
        Self::TooManyPoints,
    ];
}

impl fmt::Display for Defect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::TooFewPoints => "too few points",
            Self::NonFinite => "non-finite number",
            Self::TimeGoesBack => "time goes back",
            Self::NoRotation => "orientation is no rotation",
            Self::WrongFrame => "frame is not the map's",
            Self::NoPlace => "position beyond any map",
            Self::TooManyPoints => "too many points",
        })
    }
}

/// Judges the data of a candidate.
#[must_use]
pub fn judge(scene: &Scene, candidate: &Candidate) -> Judgement {
    let defect = find_defect(scene, candidate);
    let value = defect.map_or(0.0, |(defect, _)| f64::from(defect as u8));
    let risk = if defect.is_some() { RiskLevel::Danger } else { RiskLevel::Safe };
    Judgement {
        feasible: defect.is_none(),
        failure: None,
        metrics: smallvec![Metric { name: METRIC, value, threshold: 0.0, risk }],
        evidence: defect
            .filter(|(defect, index)| *defect != Defect::TooManyPoints && *index < candidate.points.len())
            .map(|(_, index)| Evidence::at(candidate, index)),
        memo: Memo::Nothing,
    }
}

/// One line of plain words on a judgement of this check. `None` if the data is valid.
#[must_use]
pub fn explain(judgement: &Judgement) -> Option<String> {
    let number = judgement.metrics.first()?.value;
    let defect = Defect::ALL.into_iter().find(|defect| f64::from(*defect as u8) == number)?;
    Some(match judgement.evidence {
        Some(at) => format!("{defect}; first at point {}", at.index),
        None => defect.to_string(),
    })
}

/// The first defect in the order in which they are looked for, with the index of the point that has it; an index that
/// there is not where no point has it.
#[must_use]
pub fn find_defect(scene: &Scene, candidate: &Candidate) -> Option<(Defect, usize)> {
    // In the message, so that not even their conversion costs time.
    if candidate.message.points.len() > MAX_POINTS {
        return Some((Defect::TooManyPoints, usize::MAX));
    }
    let points = &*candidate.points;
    if points.len() < MIN_POINTS {
        return Some((Defect::TooFewPoints, 0));
    }
    if let Some(index) = points.iter().position(|point| !is_finite(point)) {
        return Some((Defect::NonFinite, index));
    }
    let goes_back =
        |pair: &[TrajectoryPoint]| pair[1].time_from_start.nanos() < pair[0].time_from_start.nanos();
    if let Some(index) = points.windows(2).position(goes_back) {
        return Some((Defect::TimeGoesBack, index + 1));
    }
    if let Some(index) = points.iter().position(|point| !is_rotation(point.pose.orientation)) {
        return Some((Defect::NoRotation, index));
    }
    let frame = &*candidate.message.header.frame_id;
    // Planners that leave the frame empty are accepted as upstream does; one that names another frame means it.
    if scene.frame_id().is_some_and(|map_frame| !frame.is_empty() && frame != map_frame) {
        return Some((Defect::WrongFrame, 0));
    }
    let index = points.iter().position(|point| !is_on_a_map(point.pose.position))?;
    Some((Defect::NoPlace, index))
}

/// True if every number of the point is finite. A sum is finite only if all of its terms are; overflow of finite terms
/// needs coordinates beyond 10^307 and is as little drivable as infinity.
fn is_finite(point: &TrajectoryPoint) -> bool {
    let (position, orientation) = (point.pose.position, point.pose.orientation);
    let pose =
        position.x + position.y + position.z + orientation.x + orientation.y + orientation.z + orientation.w;
    let motion = point.longitudinal_velocity_mps
        + point.lateral_velocity_mps
        + point.acceleration_mps2
        + point.heading_rate_rps
        + point.front_wheel_angle_rad
        + point.rear_wheel_angle_rad;
    pose.is_finite() && motion.is_finite()
}

fn is_on_a_map(position: Point3) -> bool {
    [position.x, position.y, position.z].iter().all(|coordinate| coordinate.abs() <= MAX_COORDINATE_M)
}

fn is_rotation(q: Quaternion) -> bool {
    (q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w - 1.0).abs() <= QUATERNION_NORM_TOLERANCE
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_scene::{candidate_of, scene, straight};
    use messages::autoware_internal_planning_msgs::CandidateTrajectory;
    use messages::autoware_planning_msgs::TrajectoryPoint as PointMessage;
    use motion::trajectory::TimeFromStart;
    use std::sync::Arc;

    fn defect(change: impl FnOnce(&mut Vec<TrajectoryPoint>)) -> Option<(Defect, usize)> {
        let mut points = straight(10, 5.0);
        change(&mut points);
        find_defect(&scene(), &candidate_of(points))
    }

    #[test]
    fn a_plain_trajectory_is_valid() {
        assert_eq!(defect(|_| ()), None);
        let judgement = judge(&scene(), &candidate_of(straight(2, 5.0)));
        assert!(judgement.feasible);
        assert_eq!(judgement.metrics[0].value.to_bits(), 0.0_f64.to_bits());
    }

    #[test]
    fn fewer_than_two_points_are_no_trajectory() {
        for length in [0, 1] {
            assert_eq!(defect(|points| points.truncate(length)), Some((Defect::TooFewPoints, 0)));
        }
        assert_eq!(defect(|points| points.truncate(2)), None);
    }

    /// A way to put a number into a field of a point.
    type Setter = fn(&mut TrajectoryPoint, f64);

    #[test]
    fn every_field_must_be_finite() {
        let fields: [Setter; 13] = [
            |p, v| p.pose.position.x = v,
            |p, v| p.pose.position.y = v,
            |p, v| p.pose.position.z = v,
            |p, v| p.pose.orientation.x = v,
            |p, v| p.pose.orientation.y = v,
            |p, v| p.pose.orientation.z = v,
            |p, v| p.pose.orientation.w = v,
            |p, v| p.longitudinal_velocity_mps = v as f32,
            |p, v| p.lateral_velocity_mps = v as f32,
            |p, v| p.acceleration_mps2 = v as f32,
            |p, v| p.heading_rate_rps = v as f32,
            |p, v| p.front_wheel_angle_rad = v as f32,
            |p, v| p.rear_wheel_angle_rad = v as f32,
        ];
        for (number, set) in fields.into_iter().enumerate() {
            for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
                let found = defect(|points| set(&mut points[7], value));
                assert_eq!(found, Some((Defect::NonFinite, 7)), "field {number}, {value}");
            }
        }
    }

    #[test]
    fn opposite_infinities_do_not_cancel() {
        let found = defect(|points| {
            points[3].pose.position.x = f64::INFINITY;
            points[3].pose.position.y = f64::NEG_INFINITY;
        });
        assert_eq!(found, Some((Defect::NonFinite, 3)));
    }

    #[test]
    fn time_may_stand_still_but_not_go_back() {
        assert_eq!(defect(|points| points[5].time_from_start = points[4].time_from_start), None);
        let back = defect(|points| points[5].time_from_start = TimeFromStart::from_nanos(399_999_999));
        assert_eq!(back, Some((Defect::TimeGoesBack, 5)));
        // Points of the past are fine.
        let shift = |p: &mut TrajectoryPoint| {
            p.time_from_start = TimeFromStart::from_nanos(p.time_from_start.nanos() - 300_000_000);
        };
        assert_eq!(defect(|points| points.iter_mut().for_each(shift)), None);
    }

    #[test]
    fn an_orientation_must_be_a_rotation() {
        let zero = Quaternion { x: 0.0, y: 0.0, z: 0.0, w: 0.0 };
        assert_eq!(defect(|points| points[2].pose.orientation = zero), Some((Defect::NoRotation, 2)));
        let rounded = Quaternion { x: 0.0, y: 0.0, z: 0.6, w: 0.801 };
        assert_eq!(defect(|points| points[2].pose.orientation = rounded), None);
    }

    #[test]
    fn another_frame_than_the_maps_is_refused() {
        let mut scene = scene();
        for (frame, expected) in [("map", None), ("", None), ("base_link", Some((Defect::WrongFrame, 0)))] {
            let mut candidate = candidate_of(straight(10, 5.0));
            Arc::make_mut(&mut candidate.message).header.frame_id = frame.to_owned();
            assert_eq!(find_defect(&scene, &candidate), expected, "frame \"{frame}\"");
        }
        scene.map = None;
        let mut candidate = candidate_of(straight(10, 5.0));
        Arc::make_mut(&mut candidate.message).header.frame_id = "base_link".to_owned();
        assert_eq!(find_defect(&scene, &candidate), None, "without a map there is nothing to compare with");
    }

    #[test]
    fn a_place_must_be_within_reach_of_a_map() {
        for (value, expected) in
            [(1e8, None), (1.01e8, Some((Defect::NoPlace, 7))), (-1e300, Some((Defect::NoPlace, 7)))]
        {
            let setters: [Setter; 3] =
                [|p, v| p.pose.position.x = v, |p, v| p.pose.position.y = v, |p, v| p.pose.position.z = v];
            for set in setters {
                assert_eq!(defect(|points| set(&mut points[7], value)), expected, "{value}");
            }
        }
    }

    #[test]
    fn the_verdict_is_danger_with_the_number_of_the_defect() {
        let judgement = judge(&scene(), &candidate_of(straight(1, 5.0)));
        assert!(!judgement.feasible);
        assert_eq!((judgement.metrics[0].value as u8, judgement.risk()), (1, RiskLevel::Danger));
        assert_eq!(judgement.evidence.map(|evidence| evidence.index), Some(0));
        assert_eq!(judge(&scene(), &candidate_of(Vec::new())).evidence, None);
    }

    #[test]
    fn more_points_than_anybody_plans_are_a_defect() {
        let message = |count: usize| CandidateTrajectory {
            points: vec![PointMessage::default(); count],
            ..CandidateTrajectory::default()
        };
        for (count, expected) in [(MAX_POINTS, None), (MAX_POINTS + 1, Some(Defect::TooManyPoints))] {
            let candidate = Candidate::new(Arc::new(message(count)), "planner".into(), 0);
            assert_eq!(find_defect(&scene(), &candidate).map(|(defect, _)| defect), expected);
            let judgement = judge(&scene(), &candidate);
            assert_eq!((judgement.feasible, judgement.evidence), (expected.is_none(), None));
        }
    }

    #[test]
    fn every_defect_is_told_in_words() {
        let words = |points| explain(&judge(&scene(), &candidate_of(points)));
        assert_eq!(words(straight(2, 5.0)), None);
        assert_eq!(words(Vec::new()).unwrap(), "too few points");
        let mut points = straight(9, 5.0);
        points[4].pose.position.z = f64::NAN;
        assert_eq!(words(points).unwrap(), "non-finite number; first at point 4");
        assert!((1..).zip(Defect::ALL).all(|(number, defect)| defect as u8 == number));
    }
}
