//! What all candidates share: the objects, and what each of them covers over time on each course it may take.

use super::reach::{Reach, bounds_around, bounds_of_way, near_of};
use super::settings::{ClassSettings, Settings, TIME_SLACK_S};
use super::windows::{WindowColumns, WindowPlaces, Windows};
use crate::parameters::{ObjectClass, Shape};
use messages::autoware_perception_msgs::{
    ObjectClassification, PredictedObject, PredictedObjects, PredictedPath, Shape as ShapeMessage,
};
use messages::unique_identifier_msgs::Uuid;
use motion::Vector2;
use motion::occupancy::{
    Bounds, Deviation, Outline, PlanarPose, SUBDIVISION_TURN_RAD, SpeedProfile, Sweep, arc_pose,
    turn_per_metre,
};
use motion::{Point2, Pose};
use smallvec::SmallVec;
use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};

/// Longest assessed part of a predicted path \[s\].
const PATH_HORIZON_S: f64 = 8.0;
/// Shortest segment of a predicted path \[m\] that is divided by.
const SEGMENT_LENGTH_M: f64 = 1e-6;
/// Numbers of slices that are kept: horizons are mostly the same.
const MOST_COUNTS: usize = 4;

/// A road user or obstacle, ready to be assessed.
#[derive(Debug)]
pub(super) struct Object {
    pub(super) id: Uuid,
    pub(super) class: ObjectClass,
    pub(super) outline: Outline,
    pub(super) pose: Pose,
    /// Velocity in the object's frame \[m/s\].
    pub(super) velocity: Vector2,
    /// For how long both it and the vehicle have been standing \[ns\]; filled in by the filter.
    pub(super) mutual_standing_ns: i64,
}

/// A way in which an object may go on.
#[derive(Debug, Clone)]
pub(super) enum Way {
    /// With constant curvature: direction of motion in the object's frame, turn per metre.
    Arc { start: PlanarPose, direction: Vector2, turn_rad_per_m: f64 },
    /// Along predicted poses: places in the columns of [`Objects`].
    Path(Range<usize>),
}

/// What an object covers on one of its ways at constant speed. Slice `k` lasts from tick `k` to the next.
#[derive(Debug)]
pub(super) struct Course {
    /// Its own place in [`Objects::courses`].
    pub(super) place: usize,
    /// Place of what takes it in [`Objects::objects`].
    pub(super) object: usize,
    /// Outline of the vehicle that it is compared with, a place in the settings.
    pub(super) ego_outline: usize,
    pub(super) way: Way,
    pub(super) speed_mps: f64,
    pub(super) horizon_s: f64,
    /// Its slices, places in [`Objects::sweep`].
    pub(super) slices: Range<usize>,
    windows: WindowPlaces,
    pub(super) bounds: Bounds,
}

/// All objects of a cycle.
#[derive(Debug, Default)]
pub(super) struct Objects {
    /// No other content, of these or any other objects, has the same number; 0 before the first.
    pub(super) number: u64,
    pub(super) objects: Vec<Object>,
    pub(super) courses: Vec<Course>,
    pub(super) sweep: Sweep,
    windows: WindowColumns,
    /// Objects where they are now: one slice each.
    pub(super) standing: Sweep,
    pub(super) path_poses: Vec<PlanarPose>,
    path_lengths_m: Vec<f64>,
    /// Until when slices of the vehicle can meet anything \[s\].
    pub(super) horizon_s: f64,
    /// True if one of them has no predicted path, though its class's paths are to be assessed.
    pub(super) lack_path: bool,
    buffers: CourseBuffers,
    /// Places of the objects whose distance is to be assessed, but for those out of reach of all candidates.
    pub(super) on_paths: Vec<usize>,
    /// Where these candidates may come; `None` if any may come.
    pub(super) reach: Option<Reach>,
    /// Numbers of slices that were counted: whether a body moves, for how long \[s\].
    slice_counts: SmallVec<[((bool, f64), usize); MOST_COUNTS]>,
}

/// Memory for sampling a course.
#[derive(Debug, Default)]
pub(super) struct CourseBuffers {
    times_s: Vec<f64>,
    samples: Vec<WaySample>,
}

#[derive(Debug, Clone, Copy)]
struct WaySample {
    pose: PlanarPose,
    distance_m: f64,
    /// First pose of the path that is not before the sample.
    next: usize,
}

/// Why the objects of a message cannot be assessed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ObjectDefect {
    NotFinite,
    UnknownShape,
}

impl ObjectDefect {
    pub(super) fn text(self) -> &'static str {
        match self {
            Self::NotFinite => "predicted objects hold a number that is not finite",
            Self::UnknownShape => "predicted objects hold a shape of unknown type",
        }
    }
}

impl Objects {
    /// Takes the objects of a message. Ways that none of the candidates can come near are left out. On an error the
    /// content is not to be used.
    pub(super) fn fill(
        &mut self,
        message: &PredictedObjects,
        settings: &Settings,
        reach: Option<Reach>,
    ) -> Result<(), ObjectDefect> {
        static LAST: AtomicU64 = AtomicU64::new(0);
        self.number = LAST.fetch_add(1, Ordering::Relaxed) + 1;
        self.objects.clear();
        self.courses.clear();
        self.sweep.clear();
        self.windows.clear();
        self.standing.clear();
        self.path_poses.clear();
        self.path_lengths_m.clear();
        self.horizon_s = 0.0;
        self.lack_path = false;
        self.on_paths.clear();
        self.reach = reach;
        self.slice_counts.clear();
        for object in &message.objects {
            self.add(object, settings)?;
        }
        Ok(())
    }

    fn add(&mut self, message: &PredictedObject, settings: &Settings) -> Result<(), ObjectDefect> {
        if !is_finite(message) {
            return Err(ObjectDefect::NotFinite);
        }
        let (shape, outline) = outline_of(&message.shape).ok_or(ObjectDefect::UnknownShape)?;
        let class = class_of(&message.classification);
        let of_class = settings.class(class);
        let pose = crate::candidate::pose_of(&message.kinematics.initial_pose_with_covariance.pose);
        let twist = &message.kinematics.initial_twist_with_covariance.twist;
        let velocity = Vector2::new(twist.linear.x, twist.linear.y);
        let uses_drac = of_class.drac_shapes.contains(&shape);
        let planar = PlanarPose::from(&pose);
        if uses_drac {
            let has_path = message.kinematics.predicted_paths.iter().any(|path| !path.path.is_empty());
            self.lack_path |= of_class.assesses_paths && !has_path;
            if let Some(horizon_s) = of_class.arc_horizon_s {
                let (direction, turn_rad_per_m) = turn_per_metre(velocity, twist.angular.z);
                let speed_mps = velocity.norm();
                // An arc leads no farther from its start than it is long.
                let places = bounds_around(planar.position, speed_mps * horizon_s);
                if self.is_out_of_reach(&places, speed_mps, &outline, settings) {
                    self.pass_over(speed_mps, horizon_s, of_class, settings);
                } else {
                    let way = Way::Arc { start: planar, direction, turn_rad_per_m };
                    self.add_course(way, speed_mps, horizon_s, &outline, of_class, settings);
                }
            }
            if of_class.assesses_paths {
                self.add_paths(message, velocity.norm(), &outline, of_class, settings);
            }
        }
        self.standing.push(&outline, planar, planar, &Deviation::default());
        let uses_rss = of_class.rss_shapes.contains(&shape);
        let place = self.objects.len();
        if uses_rss && !self.stands_out_of_reach(place) {
            self.on_paths.push(place);
        }
        self.objects.push(Object {
            id: message.object_id,
            class,
            outline,
            pose,
            velocity,
            mutual_standing_ns: 0,
        });
        Ok(())
    }

    fn add_paths(
        &mut self,
        message: &PredictedObject,
        speed_mps: f64,
        outline: &Outline,
        of_class: &ClassSettings,
        settings: &Settings,
    ) {
        for path in &message.kinematics.predicted_paths {
            let place = |pose: &messages::geometry_msgs::Pose| Point2::new(pose.position.x, pose.position.y);
            // What follows a path is always between two of its poses.
            let places = Bounds::around(path.path.iter().map(place));
            if self.is_out_of_reach(&places, speed_mps, outline, settings) {
                if !path.path.is_empty() {
                    self.pass_over(speed_mps, path_horizon_s(path), of_class, settings);
                }
            } else {
                let way = self.add_path(path);
                self.add_course(way, speed_mps, path_horizon_s(path), outline, of_class, settings);
            }
        }
    }

    /// True if no candidate comes near to what a body covers whose origin stays in a box.
    fn is_out_of_reach(
        &self,
        places: &Bounds,
        speed_mps: f64,
        outline: &Outline,
        settings: &Settings,
    ) -> bool {
        self.reach.is_some_and(|reach| {
            let covered = bounds_of_way(places, speed_mps, outline, settings.resolution_s);
            covered.is_apart_from(&reach.passages)
        })
    }

    /// True if no candidate comes near to an object where that is now.
    fn stands_out_of_reach(&self, place: usize) -> bool {
        self.reach.is_some_and(|reach| {
            !near_of(&self.standing.bounds()[place], &reach.covered).meets(&reach.covered)
        })
    }

    /// Takes into account for how long a way lasts that is left out.
    fn pass_over(&mut self, speed_mps: f64, horizon_s: f64, of_class: &ClassSettings, settings: &Settings) {
        let slices = self.slice_count(speed_mps, horizon_s, settings.resolution_s);
        self.last_until(slices, of_class, settings);
    }

    fn last_until(&mut self, slices: usize, of_class: &ClassSettings, settings: &Settings) {
        let last_s = (slices + of_class.object_earlier_ticks) as f64 * settings.resolution_s;
        self.horizon_s = self.horizon_s.max(last_s);
    }

    /// How many slices [`Self::sweep_way`] makes at a constant speed.
    fn slice_count(&mut self, speed_mps: f64, horizon_s: f64, resolution_s: f64) -> usize {
        let key = (speed_mps > 0.0, horizon_s);
        if let Some((_, count)) = self.slice_counts.iter().find(|(known, _)| *known == key) {
            return *count;
        }
        let times_s = &mut self.buffers.times_s;
        SpeedProfile::constant(speed_mps).sample_times(0.0, horizon_s, resolution_s, times_s);
        let last_s = times_s[times_s.len() - 1];
        let count = (0_u32..).take_while(|&tick| slice_begins(tick, resolution_s, last_s)).count();
        if self.slice_counts.len() < MOST_COUNTS {
            self.slice_counts.push((key, count));
        }
        count
    }

    fn add_path(&mut self, path: &PredictedPath) -> Way {
        let first = self.path_poses.len();
        let mut length_m = 0.0;
        let mut previous: Option<motion::Point3> = None;
        for pose in &path.path {
            let pose = crate::candidate::pose_of(pose);
            if let Some(previous) = previous {
                length_m += (pose.position - previous).norm();
            }
            previous = Some(pose.position);
            self.path_poses.push(PlanarPose::from(&pose));
            self.path_lengths_m.push(length_m);
        }
        Way::Path(first..self.path_poses.len())
    }

    fn add_course(
        &mut self,
        way: Way,
        speed_mps: f64,
        horizon_s: f64,
        outline: &Outline,
        of_class: &ClassSettings,
        settings: &Settings,
    ) {
        if matches!(&way, Way::Path(poses) if poses.is_empty()) {
            return;
        }
        let profile = SpeedProfile::constant(speed_mps);
        let first = self.sweep.len();
        let (mut sweep, mut buffers) = (std::mem::take(&mut self.sweep), std::mem::take(&mut self.buffers));
        self.sweep_way(&way, &profile, horizon_s, settings.resolution_s, outline, &mut sweep, &mut buffers);
        (self.sweep, self.buffers) = (sweep, buffers);
        let slices = first..self.sweep.len();
        let (before, after) = (of_class.object_earlier_ticks, of_class.ego_earlier_ticks);
        let of_course = &self.sweep.bounds()[slices.clone()];
        let windows = self.windows.push(of_course, before, after);
        let bounds = Bounds::around_all(of_course);
        self.last_until(slices.len(), of_class, settings);
        self.courses.push(Course {
            place: self.courses.len(),
            object: self.objects.len(),
            ego_outline: of_class.ego_outline,
            way,
            speed_mps,
            horizon_s,
            bounds,
            slices,
            windows,
        });
    }

    pub(super) fn windows_of(&self, course: &Course) -> Windows<'_> {
        self.windows.get(&course.windows)
    }

    /// Appends to `sweep` what a body covers on a way, tick by tick, as far as the way was sampled.
    #[expect(clippy::too_many_arguments, reason = "two of them are memory that the caller owns")]
    pub(super) fn sweep_way(
        &self,
        way: &Way,
        profile: &SpeedProfile,
        horizon_s: f64,
        resolution_s: f64,
        outline: &Outline,
        sweep: &mut Sweep,
        buffers: &mut CourseBuffers,
    ) {
        let CourseBuffers { times_s, samples } = buffers;
        profile.sample_times(0.0, horizon_s, resolution_s, times_s);
        samples.clear();
        let mut cursor = 0;
        samples.extend(times_s.iter().map(|&time_s| self.at(way, profile.distance_m(time_s), &mut cursor)));
        let (last_s, before_last) = (times_s[times_s.len() - 1], &times_s[..times_s.len() - 1]);
        let (mut first, mut second) = (0, 0);
        let mut row = sweep.row(outline, &samples[0].pose);
        let mut reached = 0;
        for tick in 0_u32.. {
            let start_s = f64::from(tick) * resolution_s;
            let end_s = f64::from(tick + 1) * resolution_s;
            if !slice_begins(tick, resolution_s, last_s) {
                break;
            }
            // From the last sample not after the start of the slice to the first one not before its end.
            while times_s.get(first + 1).is_some_and(|&next_s| next_s <= start_s + TIME_SLACK_S) {
                first += 1;
            }
            while before_last.get(second).is_some_and(|&at_s| at_s < end_s - TIME_SLACK_S) {
                second += 1;
            }
            let end = second.max(first);
            let (from, to) = (&samples[first], &samples[end]);
            if first != reached {
                row.restart(&from.pose);
            }
            row.go(&to.pose, &self.deviation(way, from, to));
            reached = end;
        }
    }

    fn at(&self, way: &Way, distance_m: f64, cursor: &mut usize) -> WaySample {
        match way {
            Way::Arc { start, direction, turn_rad_per_m } => WaySample {
                pose: arc_pose(start, *direction, *turn_rad_per_m, distance_m),
                distance_m,
                next: 0,
            },
            Way::Path(places) => {
                let (poses, lengths_m) =
                    (&self.path_poses[places.clone()], &self.path_lengths_m[places.clone()]);
                while lengths_m.get(*cursor).is_some_and(|&length_m| length_m <= distance_m) {
                    *cursor += 1;
                }
                let next = *cursor;
                if next == 0 || next == poses.len() {
                    let pose = poses[next.min(poses.len() - 1)];
                    return WaySample { pose, distance_m, next };
                }
                let length_m = (lengths_m[next] - lengths_m[next - 1]).max(SEGMENT_LENGTH_M);
                let ratio = ((distance_m - lengths_m[next - 1]) / length_m).clamp(0.0, 1.0);
                WaySample { pose: poses[next - 1].between(&poses[next], ratio), distance_m, next }
            }
        }
    }

    fn deviation(&self, way: &Way, from: &WaySample, to: &WaySample) -> Deviation {
        let mut deviation = Deviation::default();
        match way {
            Way::Arc { start, direction, turn_rad_per_m } => {
                let length_m = to.distance_m - from.distance_m;
                let angle = (length_m * turn_rad_per_m).abs();
                let parts = (angle / SUBDIVISION_TURN_RAD).ceil().max(1.0);
                for part in 1..parts as u32 {
                    let distance_m = from.distance_m + length_m * f64::from(part) / parts;
                    let via = arc_pose(start, *direction, *turn_rad_per_m, distance_m);
                    deviation.pass(&from.pose, &to.pose, &via);
                }
                // Height of the arc over the chord of one part.
                deviation.position_m += length_m / parts * (angle / parts * 0.25).tan() * 0.5;
            }
            Way::Path(places) => {
                let poses = &self.path_poses[places.clone()];
                let passed = poses.get(from.next..to.next.min(poses.len())).unwrap_or_default();
                for via in passed {
                    deviation.pass(&from.pose, &to.pose, via);
                }
            }
        }
        deviation
    }
}

/// True if a slice begins at a tick when the last sample is at a time \[s\].
fn slice_begins(tick: u32, resolution_s: f64, last_s: f64) -> bool {
    f64::from(tick) * resolution_s <= last_s + TIME_SLACK_S
}

/// How much of a predicted path is assessed \[s\].
fn path_horizon_s(path: &PredictedPath) -> f64 {
    (path.path.len() as f64 * path.time_step.seconds()).min(PATH_HORIZON_S)
}

/// Class of highest probability, the first of equals; unlisted labels and no label are unknown.
fn class_of(classification: &[ObjectClassification]) -> ObjectClass {
    let best = classification
        .iter()
        .reduce(|best, next| if next.probability > best.probability { next } else { best });
    match best.map(|best| best.label) {
        Some(ObjectClassification::CAR) => ObjectClass::Car,
        Some(ObjectClassification::TRUCK) => ObjectClass::Truck,
        Some(ObjectClassification::BUS) => ObjectClass::Bus,
        Some(ObjectClassification::TRAILER) => ObjectClass::Trailer,
        Some(ObjectClassification::MOTORCYCLE) => ObjectClass::Motorcycle,
        Some(ObjectClassification::BICYCLE) => ObjectClass::Bicycle,
        Some(ObjectClassification::PEDESTRIAN) => ObjectClass::Pedestrian,
        Some(ObjectClassification::ANIMAL) => ObjectClass::Animal,
        Some(ObjectClassification::HAZARD) => ObjectClass::Hazard,
        Some(ObjectClassification::OVER_DRIVABLE) => ObjectClass::OverDrivable,
        Some(ObjectClassification::UNDER_DRIVABLE) => ObjectClass::UnderDrivable,
        _ => ObjectClass::Unknown,
    }
}

/// Kind and outline of a shape. A cylinder is the square around it.
fn outline_of(shape: &ShapeMessage) -> Option<(Shape, Outline)> {
    let (half_x, half_y) = (shape.dimensions.x.abs() / 2.0, shape.dimensions.y.abs() / 2.0);
    Some(match shape.r#type {
        ShapeMessage::BOUNDING_BOX => (Shape::Bbox, Outline::rectangle(half_x, half_x, half_y, half_y)),
        ShapeMessage::CYLINDER => (Shape::Cylinder, Outline::rectangle(half_x, half_x, half_x, half_x)),
        ShapeMessage::POLYGON => {
            let corner = |p: &messages::geometry_msgs::Point32| Point2::new(f64::from(p.x), f64::from(p.y));
            let corners: Vec<Point2> = shape.footprint.points.iter().map(corner).collect();
            (Shape::Polygon, Outline::hull_of(&corners))
        }
        _ => return None,
    })
}

fn is_finite(object: &PredictedObject) -> bool {
    let pose_is_finite = |pose: &messages::geometry_msgs::Pose| {
        let (p, q) = (&pose.position, &pose.orientation);
        [p.x, p.y, p.z, q.x, q.y, q.z, q.w].iter().all(|number| number.is_finite())
    };
    let twist = &object.kinematics.initial_twist_with_covariance.twist;
    let corners = &object.shape.footprint.points;
    pose_is_finite(&object.kinematics.initial_pose_with_covariance.pose)
        && [twist.linear.x, twist.linear.y, twist.angular.z].iter().all(|number| number.is_finite())
        && [object.shape.dimensions.x, object.shape.dimensions.y].iter().all(|number| number.is_finite())
        && corners.iter().all(|corner| corner.x.is_finite() && corner.y.is_finite())
        && object.kinematics.predicted_paths.iter().all(|path| path.path.iter().all(pose_is_finite))
}
