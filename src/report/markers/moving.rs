//! What moves: the vehicle, other road users and where they are expected, what the lights show, and all candidates.

use messages::autoware_perception_msgs::PredictedObject;
use messages::geometry_msgs::Point;
use messages::std_msgs::ColorRgba;
use messages::visualization_msgs::MarkerArray;
use selection::candidate::pose_of;
use selection::{Candidate, Scene, Verdict};
use selector_actors::cycle::{CycleReport, Outcome};

use super::canvas::{Canvas, SHORT_LIVED, colour};
use super::header;
use crate::report::road::{Lamp, lamp};
use crate::report::road_users::{likeliest_paths, objects, outline, pose_now};

const ACCEPTED: ColorRgba = colour(0.2, 0.75, 0.3, 0.7);
const DOUBTED: ColorRgba = colour(0.95, 0.6, 0.1, 0.7);
const REJECTED: ColorRgba = colour(0.9, 0.15, 0.15, 0.7);
const NOT_JUDGED: ColorRgba = colour(0.6, 0.6, 0.6, 0.5);
const SELECTED: ColorRgba = colour(0.1, 0.45, 1.0, 1.0);
const EGO: ColorRgba = colour(0.1, 0.45, 1.0, 1.0);
const ROAD_USER: ColorRgba = colour(0.85, 0.85, 0.2, 0.9);
const PREDICTION: ColorRgba = colour(0.85, 0.85, 0.2, 0.35);

/// No more predicted paths than these are drawn for one road user, the likeliest first.
const MOST_PATHS: usize = 3;
/// Lies above the candidates, so that it is seen, m.
const SELECTED_LIFT_M: f64 = 0.1;

pub(super) fn draw(report: &CycleReport) -> MarkerArray {
    let scene = &*report.cycle.scene;
    let mut canvas = Canvas::new(header(scene), SHORT_LIVED);
    draw_lights(&mut canvas, scene);
    draw_road_users(&mut canvas, scene);
    let candidates = &report.cycle.concatenated.candidates;
    match &report.outcome {
        Outcome::Judged(judged) => {
            for (candidate, verdict) in candidates.iter().zip(&judged.verdicts) {
                draw_candidate(&mut canvas, candidate, Some(verdict));
            }
            let best = judged.ranking.best().filter(|_| judged.selected.is_some());
            if let Some(candidate) = best.and_then(|best| candidates.get(best.index)) {
                draw_selected(&mut canvas, candidate);
            }
        }
        _ => {
            for candidate in candidates {
                draw_candidate(&mut canvas, candidate, None);
            }
        }
    }
    draw_vehicle(&mut canvas, scene);
    canvas.finish()
}

pub(super) fn draw_vehicle(canvas: &mut Canvas, scene: &Scene) {
    if let Some(odometry) = &scene.odometry {
        let pose = pose_of(&odometry.pose.pose);
        let footprint = scene.vehicle.footprint(0.0, 0.0).placed_at(&pose);
        canvas.outline("vehicle", EGO, 0.15, footprint.corners(), pose.position.z);
    }
}

/// In the colour of what was found, if anything was.
pub(super) fn draw_candidate(canvas: &mut Canvas, candidate: &Candidate, verdict: Option<&Verdict>) {
    let (namespace, colour) = verdict.map_or(("not_judged", NOT_JUDGED), look);
    canvas.line(namespace, colour, 0.1, points(candidate, 0.0));
}

/// The one to be driven, above the others.
pub(super) fn draw_selected(canvas: &mut Canvas, candidate: &Candidate) {
    canvas.line("selected", SELECTED, 0.3, points(candidate, SELECTED_LIFT_M));
}

/// Namespace and colour of what was found.
pub(super) fn look(verdict: &Verdict) -> (&'static str, ColorRgba) {
    match (verdict.is_judged(), verdict.accepted, verdict.feasible) {
        (false, ..) => ("not_judged", NOT_JUDGED),
        (true, false, _) => ("rejected", REJECTED),
        (true, true, true) => ("accepted", ACCEPTED),
        (true, true, false) => ("doubted", DOUBTED),
    }
}

fn points(candidate: &Candidate, lift_m: f64) -> impl Iterator<Item = Point> {
    let positions = candidate.points.iter().map(|point| point.pose.position);
    positions.map(move |at| Point { x: at.x, y: at.y, z: at.z + lift_m })
}

fn draw_road_users(canvas: &mut Canvas, scene: &Scene) {
    for object in objects(scene) {
        draw_road_user(canvas, object);
    }
}

/// One of them, with where it is expected to be.
pub(super) fn draw_road_user(canvas: &mut Canvas, object: &PredictedObject) {
    let pose = pose_now(object);
    canvas.outline("road_users", ROAD_USER, 0.12, &outline(object, &pose), pose.position.z);
    for path in likeliest_paths(object, MOST_PATHS) {
        canvas.line("predictions", PREDICTION, 0.05, path.path.iter().map(|pose| pose.position));
    }
}

/// Each stop line of a light in the colour that the light shows.
pub(super) fn draw_lights(canvas: &mut Canvas, scene: &Scene) {
    let Some(map) = &scene.map else { return };
    for light in map.value.map.regulatory_elements().filter(|rule| rule.subtype() == "traffic_light") {
        let shade = match lamp(scene, light.id()) {
            Lamp::Red => colour(1.0, 0.1, 0.1, 1.0),
            Lamp::Amber => colour(1.0, 0.7, 0.0, 1.0),
            Lamp::Green => colour(0.1, 0.9, 0.2, 1.0),
            Lamp::Dark => continue,
        };
        for line in light.line_strings("ref_line") {
            canvas.line("lights", shade, 0.4, line.positions().map(|[x, y, z]| Point { x, y, z }));
        }
    }
}
