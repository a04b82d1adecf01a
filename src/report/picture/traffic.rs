//! Other road users: where they are, where they are expected to go, and where the one that a candidate meets is then.

use super::camera::Camera;
use super::svg::Svg;
use crate::report::road_users::{
    self, label, likeliest_paths, name, objects, pose_after, pose_now, speed_mps,
};
use messages::autoware_perception_msgs::{ObjectClassification, PredictedObject};
use motion::Point2;
use selection::Scene;
use selection::candidate::pose_of;

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
        for path in likeliest_paths(object, MOST_PATHS) {
            let runs = camera.runs(path.path.iter().map(|pose| pose_of(pose).point()));
            svg.lines(&format!("way {}", kind(object)), runs.iter().map(Vec::as_slice));
        }
    }
}

/// Draws everybody, and the one who is met once more at the time of the meeting.
pub(super) fn draw(svg: &mut Svg, camera: &Camera, scene: &Scene, meeting: Option<Meeting<'_>>) {
    for object in objects(scene) {
        let now = pose_now(object);
        let Some(outline) = camera.shape(road_users::outline(object, &now).into_iter()) else { continue };
        let met = meeting.filter(|meeting| object.object_id.to_string() == meeting.object);
        if let Some(then) = met.and_then(|meeting| pose_after(object, meeting.time_s))
            && let Some(ghost) = camera.shape(road_users::outline(object, &then).into_iter())
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
    Some(pose_now(object).point())
}

fn name_and_speed(object: &PredictedObject) -> String {
    let (name, speed) = (name(object), speed_mps(object));
    if speed > STANDING_MPS { format!("{name}, {speed:.0} m/s") } else { name.to_owned() }
}
