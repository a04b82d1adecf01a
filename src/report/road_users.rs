//! What every drawing wants to know about the other road users: what they are called, what they cover, where they will be.

use messages::autoware_perception_msgs::{ObjectClassification, PredictedObject, PredictedPath, Shape};
use motion::{Point2, Pose};
use selection::Scene;
use selection::candidate::pose_of;

/// Corners of the circle that stands for a cylinder.
const CIRCLE_CORNERS: u32 = 16;

/// All of a scene.
pub(super) fn objects(scene: &Scene) -> &[PredictedObject] {
    scene.objects.as_ref().map_or(&[], |message| &message.objects)
}

/// The likeliest class.
pub(super) fn label(object: &PredictedObject) -> u8 {
    let classes = object.classification.iter();
    let likeliest =
        classes.reduce(|best, next| if next.probability > best.probability { next } else { best });
    likeliest.map_or(ObjectClassification::UNKNOWN, |class| class.label)
}

/// What a person calls it.
pub(super) fn name(object: &PredictedObject) -> &'static str {
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

/// Along the ground, m/s.
pub(super) fn speed_mps(object: &PredictedObject) -> f64 {
    let twist = &object.kinematics.initial_twist_with_covariance.twist.linear;
    twist.x.hypot(twist.y)
}

/// The likeliest predicted paths, the likeliest first.
pub(super) fn likeliest_paths(object: &PredictedObject, most: usize) -> impl Iterator<Item = &PredictedPath> {
    let mut paths: Vec<&PredictedPath> = object.kinematics.predicted_paths.iter().collect();
    paths.sort_by(|a, b| b.confidence.total_cmp(&a.confidence));
    paths.into_iter().take(most)
}

/// Where it is now.
pub(super) fn pose_now(object: &PredictedObject) -> Pose {
    pose_of(&object.kinematics.initial_pose_with_covariance.pose)
}

/// Corners of a road user at a pose.
pub(super) fn outline(object: &PredictedObject, pose: &Pose) -> Vec<Point2> {
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
pub(super) fn pose_after(object: &PredictedObject, time_s: f64) -> Option<Pose> {
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
