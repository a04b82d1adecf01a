//! One cycle as a picture: the road, everybody on it, all candidates by verdict, and where and why the one that is
//! looked at first goes wrong.
//!
//! The picture is an SVG of its own: no other file is needed to show it, and it has its own background, so that it can
//! be read on light and dark pages. It is turned so that the vehicle drives to the right. The same input gives the same
//! bytes.

mod camera;
mod candidates;
mod caption;
mod ground;
mod svg;
mod traffic;

use self::camera::{Camera, WIDTH_PX};
use self::candidates::Told;
use self::caption::{Caption, TITLE_PX};
use self::svg::{Svg, escaped, number};
use self::traffic::Meeting;
use super::explanation::{ExplainedCandidate, ExplainedEvidence, Explanation};
use motion::{Point2, Pose};
use selection::candidate::pose_of;
use selection::{Candidate, Scene};
use std::fmt::Write as _;

const STYLE: &str = include_str!("picture/style.css");

/// What is drawn.
#[derive(Debug, Clone, Copy)]
pub struct Subject<'a> {
    /// Line above the picture.
    pub title: &'a str,
    /// The world.
    pub scene: &'a Scene,
    /// The candidates of the cycle.
    pub candidates: &'a [Candidate],
    /// What was said about each of them, in the same order.
    pub explanation: &'a Explanation,
    /// Place in `candidates` of the one that is looked at closely; one that is not there leaves that out.
    pub focus: usize,
}

/// The candidate that is worth a closer look: the first that was rejected, else the first to which anybody objects,
/// else the first.
#[must_use]
pub fn worst(explanation: &Explanation) -> usize {
    let find = |wanted: &str| {
        explanation.candidates.iter().position(|candidate| candidates::verdict(candidate) == wanted)
    };
    find("rejected").or_else(|| find("doubted")).unwrap_or(0)
}

/// Draws a picture: the text of an SVG file.
#[must_use]
pub fn draw(subject: &Subject<'_>) -> String {
    let Subject { title, scene, candidates, explanation, focus } = *subject;
    let all: Vec<Told<'_>> = candidates.iter().zip(&explanation.candidates).collect();
    let focused = all.get(focus);
    let violation = focused.and_then(|(_, explained)| first_violation(explained));
    let ego = ego_pose(scene, candidates);
    let mut places: Vec<Point2> = scene.vehicle.footprint(0.0, 0.0).placed_at(&ego).corners().to_vec();
    places.extend(focused.iter().flat_map(|(candidate, _)| candidates::places(scene, candidate)));
    places.extend(ground::road_beside(scene, &places));
    places.extend(violation.and_then(place));
    let met = violation.and_then(|evidence| evidence.object_id.as_deref());
    places.extend(met.and_then(|id| traffic::place_of(scene, id)));
    let camera = Camera::new(&ego, places.into_iter());

    let has_ways = scene
        .objects
        .iter()
        .flat_map(|message| &message.objects)
        .any(|object| object.kinematics.predicted_paths.iter().any(|path| path.path.len() > 1));
    let explained: Vec<&ExplainedCandidate> = all.iter().map(|(_, explained)| *explained).collect();
    let name_of = |id: &str| traffic::name_of(scene, id);
    let caption = Caption::new(&explained, focused.map(|(_, explained)| *explained), has_ways, name_of);
    let height_px = TITLE_PX + camera.height_px() + caption.height_px();

    let mut svg = Svg::default();
    svg.rectangle("page", [0.5, 0.5], [WIDTH_PX - 1.0, height_px - 1.0], 10.0);
    caption::write_title(&mut svg, title);
    svg.open(&format!("transform=\"translate(0 {TITLE_PX})\" clip-path=\"url(#c)\""));
    svg.rectangle("ground", [0.0, 0.0], [WIDTH_PX, camera.height_px()], 0.0);
    ground::draw(&mut svg, &camera, scene);
    if let Some(id) = violation.and_then(|evidence| evidence.element_id) {
        ground::highlight(&mut svg, &camera, scene, id);
    }
    traffic::draw_paths(&mut svg, &camera, scene);
    candidates::draw(&mut svg, &camera, scene, &all, focus, violation);
    traffic::draw(&mut svg, &camera, scene, violation.and_then(meeting));
    candidates::draw_ego(&mut svg, &camera, scene, &ego);
    if let Some(evidence) = violation {
        candidates::mark(&mut svg, &camera, evidence);
    }
    candidates::names(&mut svg, &camera, scene, &all);
    caption::scale(&mut svg, &camera);
    svg.close();
    caption.draw(&mut svg, TITLE_PX + camera.height_px());
    page(title, height_px, camera.height_px(), &svg.into_body())
}

fn page(title: &str, height_px: f64, drawing_px: f64, body: &str) -> String {
    let (width, height, drawing) = (number(WIDTH_PX), number(height_px), number(drawing_px));
    let mut text = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" role=\"img\">\n<title>{}</title>\n",
        escaped(title)
    );
    // Writing to a string cannot fail.
    let _ = write!(
        text,
        "<style>{}</style>\n<clipPath id=\"c\"><rect width=\"{width}\" height=\"{drawing}\"/></clipPath>\n{body}</svg>\n",
        STYLE.trim_end()
    );
    text
}

/// Where the vehicle is; without odometry where its first candidate begins.
fn ego_pose(scene: &Scene, candidates: &[Candidate]) -> Pose {
    let known = scene.odometry.as_ref().map(|odometry| pose_of(&odometry.pose.pose));
    let is_finite =
        |pose: &Pose| pose.position.x.is_finite() && pose.position.y.is_finite() && pose.yaw().is_finite();
    let starts = candidates.iter().filter_map(|candidate| candidate.points.first().map(|point| point.pose));
    known.into_iter().chain(starts).find(is_finite).unwrap_or_default()
}

/// The earliest objection that has a place, those that count before those of shadow filters.
fn first_violation(explained: &ExplainedCandidate) -> Option<&ExplainedEvidence> {
    let objections = |enforced: bool| {
        let judgements = explained.judgements.iter();
        let of_kind =
            judgements.filter(move |judgement| !judgement.feasible && judgement.enforced == enforced);
        let evidence =
            of_kind.filter_map(|judgement| judgement.evidence.as_ref()).filter(|at| place(at).is_some());
        evidence.min_by(|a, b| time_s(a).total_cmp(&time_s(b)))
    };
    objections(true).or_else(|| objections(false))
}

fn time_s(evidence: &ExplainedEvidence) -> f64 {
    evidence.time_s.map_or(f64::INFINITY, |time| time.0)
}

fn place(evidence: &ExplainedEvidence) -> Option<Point2> {
    let place = Point2::new(evidence.x?.0, evidence.y?.0);
    (place.x.is_finite() && place.y.is_finite()).then_some(place)
}

fn meeting(evidence: &ExplainedEvidence) -> Option<Meeting<'_>> {
    Some(Meeting { object: evidence.object_id.as_deref()?, time_s: evidence.time_s?.0 })
}

#[cfg(test)]
mod tests;
