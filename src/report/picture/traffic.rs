//! Other road users: where they are, where they are expected to go, and where the one that a candidate meets is then.

use super::camera::Camera;
use super::svg::Svg;
use messages::autoware_perception_msgs::{ObjectClassification, PredictedObject, PredictedPath, Shape};
use motion::{Point2, Pose};
use selection::Scene;
use selection::candidate::pose_of;

/// Corners of the circle that stands for a cylinder.
const CIRCLE_CORNERS: u32 = 16;
/// Where there are more road users than these only the one who is met is named.
const MOST_LABELS: usize = 8;
/// Slower than this a road user stands, m/s.
const STANDING_MPS: f64 = 0.1;
/// No more predicted paths than these are drawn for one road user, the likeliest first.
const MOST_PATHS: usize = 3;

/// The road user that a candidate meets, and when, s from the start.
#[derive(Debug, Clone, Copy)]
pub(super) struct Meeting<'a> {
    /// Id as 32 hexadecimal digits.
    pub(super) object: &'a str,
    pub(super) time_s: f64,
}

/// Draws where everybody is expected to go.
pub(super) fn draw_paths(svg: &mut Svg, camera: &Camera, scene: &Scene) {
    for object in objects(scene) {
        let mut paths: Vec<&PredictedPath> = object.kinematics.predicted_paths.iter().collect();
        paths.sort_by(|a, b| b.confidence.total_cmp(&a.confidence));
        for path in paths.into_iter().take(MOST_PATHS) {
            let runs = camera.runs(path.path.iter().map(|pose| pose_of(pose).point()));
            svg.lines(&format!("way {}", kind(object)), runs.iter().map(Vec::as_slice));
        }
    }
}

/// Draws everybody, and the one who is met once more at the time of the meeting.
pub(super) fn draw(svg: &mut Svg, camera: &Camera, scene: &Scene, meeting: Option<Meeting<'_>>) {
    for object in objects(scene) {
        let now = pose_of(&object.kinematics.initial_pose_with_covariance.pose);
        let Some(outline) = camera.shape(outline(object, &now).into_iter()) else { continue };
        let met = meeting.filter(|meeting| object.object_id.to_string() == meeting.object);
        if let Some(then) = met.and_then(|meeting| pose_after(object, meeting.time_s))
            && let Some(ghost) = camera.shape(self::outline(object, &then).into_iter())
            && (then.point() - now.point()).norm() > 0.5
        {
            svg.polygon(&format!("ghost {}", kind(object)), &ghost);
        }
        svg.polygon(&format!("body {}", kind(object)), &outline);
        if met.is_none() && objects(scene).len() > MOST_LABELS {
            continue;
        }
        let top = outline.iter().map(|corner| corner[1]).fold(f64::INFINITY, f64::min);
        let [x, _] = camera.at(now.point());
        let place = [x, if top > 24.0 { top - 7.0 } else { outline_bottom(&outline) + 17.0 }];
        if camera.shows(place, -8.0) {
            svg.text("label", place, &name_and_speed(object));
        }
    }
}

fn outline_bottom(outline: &[[f64; 2]]) -> f64 {
    outline.iter().map(|corner| corner[1]).fold(f64::NEG_INFINITY, f64::max)
}

fn objects(scene: &Scene) -> &[PredictedObject] {
    scene.objects.as_ref().map_or(&[], |message| &message.objects)
}

fn label(object: &PredictedObject) -> u8 {
    let classes = object.classification.iter();
    let likeliest =
        classes.reduce(|best, next| if next.probability > best.probability { next } else { best });
    likeliest.map_or(ObjectClassification::UNKNOWN, |class| class.label)
}

/// Class of the style sheet.
fn kind(object: &PredictedObject) -> &'static str {
    match label(object) {
        ObjectClassification::PEDESTRIAN | ObjectClassification::BICYCLE | ObjectClassification::ANIMAL => {
            "person"
        }
        _ => "vehicle",
    }
}

/// What the road user with this id is called.
pub(super) fn name_of(scene: &Scene, id: &str) -> Option<&'static str> {
    objects(scene).iter().find(|object| object.object_id.to_string() == id).map(name)
}

/// Where the road user with this id is.
pub(super) fn place_of(scene: &Scene, id: &str) -> Option<Point2> {
    let object = objects(scene).iter().find(|object| object.object_id.to_string() == id)?;
    Some(pose_of(&object.kinematics.initial_pose_with_covariance.pose).point())
}

fn name(object: &PredictedObject) -> &'static str {
    match label(object) {
        ObjectClassification::CAR => "car",
        ObjectClassification::TRUCK => "truck",
        ObjectClassification::BUS => "bus",
        ObjectClassification::TRAILER => "trailer",
        ObjectClassification::MOTORCYCLE => "motorcycle",
        ObjectClassification::BICYCLE => "bicycle",
        ObjectClassification::PEDESTRIAN => "pedestrian",
        ObjectClassification::ANIMAL => "animal",
        ObjectClassification::HAZARD => "hazard",
        _ => "unknown object",
    }
}

fn name_and_speed(object: &PredictedObject) -> String {
    let (name, speed) = (name(object), speed_mps(object));
    if speed > STANDING_MPS { format!("{name}, {speed:.0} m/s") } else { name.to_owned() }
}

fn speed_mps(object: &PredictedObject) -> f64 {
    let twist = &object.kinematics.initial_twist_with_covariance.twist.linear;
    twist.x.hypot(twist.y)
}

/// Corners of a road user at a pose.
fn outline(object: &PredictedObject, pose: &Pose) -> Vec<Point2> {
    let (x, y) = (0.5 * object.shape.dimensions.x, 0.5 * object.shape.dimensions.y);
    let local: Vec<Point2> = match object.shape.r#type {
        Shape::CYLINDER => (0..CIRCLE_CORNERS)
            .map(|corner| {
                let angle = f64::from(corner) / f64::from(CIRCLE_CORNERS) * std::f64::consts::TAU;
                Point2::new(x * angle.cos(), x * angle.sin())
            })
            .collect(),
        Shape::POLYGON => {
            let corners = object.shape.footprint.points.iter();
            corners.map(|corner| Point2::new(f64::from(corner.x), f64::from(corner.y))).collect()
        }
        _ => [(x, y), (x, -y), (-x, -y), (-x, y)].map(|(x, y)| Point2::new(x, y)).to_vec(),
    };
    let transform = pose.planar_transform();
    local.into_iter().map(|corner| transform.apply(corner)).collect()
}

/// Where a road user is expected to be: on its likeliest path, else straight on as it moves now.
fn pose_after(object: &PredictedObject, time_s: f64) -> Option<Pose> {
    let paths = object.kinematics.predicted_paths.iter().filter(|path| path.path.len() > 1);
    let likeliest = paths.reduce(|best, next| if next.confidence > best.confidence { next } else { best });
    let Some(path) = likeliest else {
        let now = pose_of(&object.kinematics.initial_pose_with_covariance.pose);
        let twist = &object.kinematics.initial_twist_with_covariance.twist.linear;
        let place = now.planar_transform().apply(Point2::new(twist.x * time_s, twist.y * time_s));
        return Some(Pose { position: motion::Point3::new(place.x, place.y, now.position.z), ..now });
    };
    let step = (time_s / path.time_step.seconds()).clamp(0.0, (path.path.len() - 1) as f64);
    let before = (step as usize).min(path.path.len() - 2);
    let ends = [before, before + 1].map(|at| pose_of(&path.path[at]));
    let place = ends[0].point() + (ends[1].point() - ends[0].point()) * (step - before as f64);
    let orientation = ends[0].orientation.slerp(&ends[1].orientation, step - before as f64);
    let position = motion::Point3::new(place.x, place.y, ends[0].position.z);
    (place.x.is_finite() && place.y.is_finite()).then_some(Pose { position, orientation })
}
