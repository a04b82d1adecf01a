//! Who waits at a crosswalk: the road users that a candidate has to yield to, once per cycle for all candidates.

use super::route::Crosswalk;
use crate::parameters::{CrosswalkParameters, ObjectClass};
use messages::autoware_perception_msgs::{ObjectClassification, PredictedObject, PredictedObjects};
use messages::geometry_msgs::{Point, Vector3};
use messages::unique_identifier_msgs::Uuid;
use motion::{Point2, Pose, Vector2};
use std::ops::Range;

/// From this confidence on a predicted path decides where somebody goes.
const SURE: f32 = 0.5;
/// Below this speed somebody stands and may start in any direction \[m/s\].
const STANDING_MPS: f64 = 0.1;
/// How far the squared length of a quaternion may be from 1.
const QUATERNION_NORM_TOLERANCE: f64 = 0.1;

/// Somebody who waits at a crosswalk in this cycle.
#[derive(Debug, Clone, Copy)]
pub(super) struct Person {
    pub(super) id: Uuid,
    /// First class of the message, not the likeliest one: this is how a person with a new id is recognised.
    pub(super) label: u8,
    pub(super) position: Point,
}

/// The people who wait at each crosswalk of the route.
#[derive(Debug, Default)]
pub(super) struct People {
    all: Vec<Person>,
    at: Vec<Range<usize>>,
}

impl People {
    /// Those at one crosswalk, in message order.
    pub(super) fn at(&self, crosswalk: usize) -> &[Person] {
        self.at.get(crosswalk).map_or(&[], |range| &self.all[range.clone()])
    }

    /// Nobody waits anywhere.
    pub(super) fn clear(&mut self) {
        self.all.clear();
        self.at.clear();
    }

    /// Finds the people of a message.
    pub(super) fn find(&mut self, objects: &PredictedObjects, crosswalks: &[Crosswalk], classes: Classes) {
        self.clear();
        for crosswalk in crosswalks {
            let start = self.all.len();
            for object in objects.objects.iter().filter(|object| classes.contain(object)) {
                if waits_at(crosswalk, object) {
                    let label =
                        object.classification.first().map_or(ObjectClassification::UNKNOWN, |c| c.label);
                    let position = object.kinematics.initial_pose_with_covariance.pose.position;
                    self.all.push(Person { id: object.object_id, label, position });
                }
            }
            self.at.push(start..self.all.len());
        }
    }
}

/// The classes of road users to yield to, one bit for each label.
#[derive(Debug, Clone, Copy)]
pub(super) struct Classes(u32);

impl Classes {
    pub(super) fn new(parameters: &CrosswalkParameters) -> Self {
        Self(parameters.object_types.iter().fold(0, |bits, class| bits | 1 << label_of(*class)))
    }

    /// True if the likeliest class of an object is one of these; the first one wins a tie, none is unknown.
    fn contain(self, object: &PredictedObject) -> bool {
        let classes = object.classification.iter();
        let likeliest =
            classes.reduce(|best, next| if next.probability > best.probability { next } else { best });
        let label = likeliest.map_or(ObjectClassification::UNKNOWN, |class| class.label);
        label < 32 && self.0 & (1 << label) != 0
    }
}

fn label_of(class: ObjectClass) -> u8 {
    match class {
        ObjectClass::Unknown => ObjectClassification::UNKNOWN,
        ObjectClass::Car => ObjectClassification::CAR,
        ObjectClass::Truck => ObjectClassification::TRUCK,
        ObjectClass::Bus => ObjectClassification::BUS,
        ObjectClass::Trailer => ObjectClassification::TRAILER,
        ObjectClass::Motorcycle => ObjectClassification::MOTORCYCLE,
        ObjectClass::Bicycle => ObjectClassification::BICYCLE,
        ObjectClass::Pedestrian => ObjectClassification::PEDESTRIAN,
        ObjectClass::Animal => ObjectClassification::ANIMAL,
        ObjectClass::Hazard => ObjectClassification::HAZARD,
        ObjectClass::OverDrivable => ObjectClassification::OVER_DRIVABLE,
        ObjectClass::UnderDrivable => ObjectClassification::UNDER_DRIVABLE,
    }
}

/// True if somebody is in a detection area and does not go elsewhere. Where the message makes no sense (numbers that
/// are none, a path without points, an orientation that is no rotation) the person waits.
fn waits_at(crosswalk: &Crosswalk, object: &PredictedObject) -> bool {
    let kinematics = &object.kinematics;
    let pose = crate::candidate::pose_of(&kinematics.initial_pose_with_covariance.pose);
    let place = pose.point();
    if !is_finite(place) {
        return true;
    }
    if !crosswalk.is_waiting_place(place) {
        return false;
    }
    let paths = kinematics.predicted_paths.iter();
    let mut sure = paths.filter(|path| path.confidence >= SURE && !path.path.is_empty()).peekable();
    if sure.peek().is_some() {
        let mut places = sure.flat_map(|path| &path.path).map(|p| Point2::new(p.position.x, p.position.y));
        return places.any(|place| !is_finite(place) || crosswalk.covers(place));
    }
    goes_towards(crosswalk.nearest_entry(place), &pose, kinematics.initial_twist_with_covariance.twist.linear)
}

/// True unless somebody moves away from the entry, or along it.
fn goes_towards(entry: Option<Point2>, pose: &Pose, velocity: Vector3) -> bool {
    let q = pose.orientation;
    let norm = q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w;
    let Some(entry) = entry.filter(|_| (norm - 1.0).abs() <= QUATERNION_NORM_TOLERANCE) else { return true };
    if velocity.x.abs() < STANDING_MPS {
        return true;
    }
    let ahead = pose.heading();
    let motion = ahead * velocity.x + Vector2::new(-ahead.y, ahead.x) * velocity.y;
    let goes_away = motion.dot(&(entry - pose.point())) <= 0.0;
    !goes_away
}

fn is_finite(place: Point2) -> bool {
    place.x.is_finite() && place.y.is_finite()
}
