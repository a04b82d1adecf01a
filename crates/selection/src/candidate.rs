//! A candidate as the filters see it: the message that came in, its points ready to calculate with, and its key.

use messages::autoware_internal_planning_msgs::CandidateTrajectory;
use messages::autoware_planning_msgs::TrajectoryPoint as PointMessage;
use messages::geometry_msgs::Pose as PoseMessage;
use messages::unique_identifier_msgs::Uuid;
use motion::occupancy::Bounds;
use motion::{Point2, Point3, Pose, Quaternion, TimeFromStart, TrajectoryPoint};
use std::fmt;
use std::ops::Deref;
use std::sync::{Arc, OnceLock};

/// Names a candidate over time: its generator, and its position among that generator's candidates in the cycle's set.
///
/// Memory that a filter keeps about candidates is keyed by this, so samples of one generator never share memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct CandidateKey {
    /// The planner.
    pub generator: Uuid,
    /// Position among the planner's candidates, from 0.
    pub sample: u32,
}

impl fmt::Display for CandidateKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}#{}", self.generator, self.sample)
    }
}

/// One trajectory to judge. Cheap to clone: all parts are shared.
#[derive(Debug, Clone)]
pub struct Candidate {
    /// Identity over time.
    pub key: CandidateKey,
    /// Name of the generator.
    pub generator_name: Arc<str>,
    /// The message as it came in; this is what is published.
    pub message: Arc<CandidateTrajectory>,
    /// The same points for calculation, in the frame of the message.
    pub points: Arc<Points>,
}

/// The points of a candidate for calculation. They are made from the message at first use: on a thread that judges,
/// and once, however often the candidate is judged again while it is fresh.
#[derive(Debug)]
pub struct Points {
    message: Arc<CandidateTrajectory>,
    converted: OnceLock<Box<[TrajectoryPoint]>>,
}

impl Points {
    /// The points of this message.
    #[must_use]
    pub fn of(message: Arc<CandidateTrajectory>) -> Self {
        Self { message, converted: OnceLock::new() }
    }
}

impl FromIterator<TrajectoryPoint> for Points {
    /// Points that come from no message.
    fn from_iter<I: IntoIterator<Item = TrajectoryPoint>>(points: I) -> Self {
        Self { message: Arc::default(), converted: OnceLock::from(points.into_iter().collect::<Box<_>>()) }
    }
}

impl Points {
    /// Box around the places of the points, and around where the last speed leads within a time \[s\]. The points are
    /// not made ready for that. Numbers that are not finite are passed over.
    #[must_use]
    pub fn bounds(&self, beyond_s: f64) -> Bounds {
        match self.converted.get() {
            Some(points) => {
                let end = points.last().map_or(0.0, |last| last.longitudinal_velocity_mps);
                bounds_of(points.iter().map(|point| point.pose.point()), end, beyond_s)
            }
            None => {
                let points = &self.message.points;
                let end = points.last().map_or(0.0, |last| last.longitudinal_velocity_mps);
                let place = |point: &PointMessage| Point2::new(point.pose.position.x, point.pose.position.y);
                bounds_of(points.iter().map(place), end, beyond_s)
            }
        }
    }
}

fn bounds_of(places: impl DoubleEndedIterator<Item = Point2>, end_mps: f32, beyond_s: f64) -> Bounds {
    let mut places = places.filter(|place| place.x.is_finite() && place.y.is_finite());
    let Some(last) = places.next_back() else { return Bounds::EMPTY };
    let beyond_m = if end_mps.is_finite() { f64::from(end_mps).abs() * beyond_s } else { 0.0 };
    Bounds::around(places).joined(&Bounds { min: last, max: last }.grown(beyond_m))
}

impl Deref for Points {
    type Target = [TrajectoryPoint];

    fn deref(&self) -> &[TrajectoryPoint] {
        self.converted.get_or_init(|| self.message.points.iter().map(point_of).collect())
    }
}

impl Candidate {
    /// A candidate from its message.
    #[must_use]
    pub fn new(message: Arc<CandidateTrajectory>, generator_name: Arc<str>, sample: u32) -> Self {
        let points = Arc::new(Points::of(message.clone()));
        Self {
            key: CandidateKey { generator: message.generator_id, sample },
            generator_name,
            message,
            points,
        }
    }
}

fn point_of(point: &PointMessage) -> TrajectoryPoint {
    let time = point.time_from_start;
    TrajectoryPoint {
        time_from_start: TimeFromStart::from_parts(time.sec, time.nanosec),
        pose: pose_of(&point.pose),
        longitudinal_velocity_mps: point.longitudinal_velocity_mps,
        lateral_velocity_mps: point.lateral_velocity_mps,
        acceleration_mps2: point.acceleration_mps2,
        heading_rate_rps: point.heading_rate_rps,
        front_wheel_angle_rad: point.front_wheel_angle_rad,
        rear_wheel_angle_rad: point.rear_wheel_angle_rad,
    }
}

/// Pose of a message for calculation.
#[must_use]
pub fn pose_of(pose: &PoseMessage) -> Pose {
    let (position, orientation) = (pose.position, pose.orientation);
    Pose {
        position: Point3::new(position.x, position.y, position.z),
        orientation: Quaternion { x: orientation.x, y: orientation.y, z: orientation.z, w: orientation.w },
    }
}
