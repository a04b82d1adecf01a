//! The vehicle and its candidates: all of them as lines by verdict, the one that is looked at with what it sweeps.

use super::camera::Camera;
use super::svg::Svg;
use crate::report::explanation::{ExplainedCandidate, ExplainedEvidence};
use motion::{Footprint, Point2, Pose, Posed};
use selection::{Candidate, Scene};

/// Outlines of the vehicle along a candidate are at least this far apart, m.
const OUTLINE_DISTANCE_M: f64 = 2.5;
/// No more of them than these are drawn.
const MOST_OUTLINES: usize = 40;
/// Names are written only where there are no more candidates than these.
const MOST_NAMES: usize = 4;
/// Where there are more candidates than these their lines are thin.
const MOST_DISTINCT: usize = 24;
/// Names nearer to each other than this would overlap, px.
const NAME_HEIGHT_PX: f64 = 18.0;

/// What became of a candidate: a class of the style sheet.
pub(super) fn verdict(explained: &ExplainedCandidate) -> &'static str {
    match explained {
        ExplainedCandidate { accepted: false, .. } => "rejected",
        candidate if candidate.judgements.iter().all(|judgement| judgement.feasible) => "accepted",
        _ => "doubted",
    }
}

/// A candidate with what was said about it.
pub(super) type Told<'a> = (&'a Candidate, &'a ExplainedCandidate);

/// Draws all candidates, the one in focus last and with the outlines of the vehicle up to the violation.
pub(super) fn draw(
    svg: &mut Svg,
    camera: &Camera,
    scene: &Scene,
    all: &[Told<'_>],
    focus: usize,
    violation: Option<&ExplainedEvidence>,
) {
    let width = match all.len() {
        count if count <= MOST_NAMES => " few",
        count if count <= MOST_DISTINCT => "",
        _ => " many",
    };
    // Green above red: what may be driven shall be seen.
    for kind in ["rejected", "doubted", "accepted"] {
        let others = all.iter().enumerate().filter(|(index, _)| *index != focus).map(|(_, told)| told);
        let others: Vec<&Candidate> = others
            .filter(|(_, explained)| verdict(explained) == kind)
            .map(|(candidate, _)| *candidate)
            .collect();
        let paths: Vec<_> = others.iter().flat_map(|candidate| runs(camera, candidate)).collect();
        svg.lines(&format!("path {kind}{width}"), paths.iter().map(Vec::as_slice));
        // Where few are drawn, each shows where it leaves the vehicle.
        let ends = others.iter().filter(|_| all.len() <= MOST_NAMES).filter_map(|other| other.points.last());
        let local = scene.vehicle.footprint(0.0, 0.0);
        for end in ends.filter_map(|point| ring(camera, &local, &point.pose)) {
            svg.polygon(&format!("end {kind}"), &end);
        }
    }
    if let Some((candidate, explained)) = all.get(focus) {
        let verdict = verdict(explained);
        outlines(svg, camera, scene, candidate, verdict, violation);
        let path = runs(camera, candidate);
        svg.lines(&format!("path focus {verdict}"), path.iter().map(Vec::as_slice));
    }
}

fn finite_points(candidate: &Candidate) -> impl Iterator<Item = &Pose> {
    let poses = candidate.points.iter().map(Posed::pose);
    poses.filter(|pose| pose.position.x.is_finite() && pose.position.y.is_finite())
}

/// The places that a picture of a candidate must hold.
pub(super) fn places(scene: &Scene, candidate: &Candidate) -> Vec<Point2> {
    let outline = scene.vehicle.footprint(0.0, 0.0);
    finite_points(candidate).flat_map(|pose| outline.placed_at(pose).corners().to_vec()).collect()
}

fn runs(camera: &Camera, candidate: &Candidate) -> Vec<Vec<[f64; 2]>> {
    camera.runs(finite_points(candidate).map(Pose::point))
}

fn outlines(
    svg: &mut Svg,
    camera: &Camera,
    scene: &Scene,
    candidate: &Candidate,
    verdict: &str,
    violation: Option<&ExplainedEvidence>,
) {
    let local = scene.vehicle.footprint(0.0, 0.0);
    let last = violation.and_then(|evidence| evidence.index).unwrap_or(usize::MAX);
    let mut rings = Vec::new();
    let mut before: Option<Point2> = None;
    for pose in candidate.points.iter().take(last).map(Posed::pose) {
        if before.is_none_or(|before| (pose.point() - before).norm() >= OUTLINE_DISTANCE_M) {
            before = Some(pose.point());
            rings.extend(camera.shape(local.placed_at(pose).vertices().iter().copied()));
        }
    }
    rings.truncate(MOST_OUTLINES);
    svg.lines(&format!("swept {verdict}"), rings.iter().map(Vec::as_slice));
    let there = violation.and_then(|evidence| candidate.points.get(evidence.index?));
    if let Some(ring) = there.and_then(|point| ring(camera, &local, &point.pose)) {
        svg.polygon(&format!("there {verdict}"), &ring);
    }
}

fn ring(camera: &Camera, local: &Footprint, pose: &Pose) -> Option<Vec<[f64; 2]>> {
    camera.shape(local.placed_at(pose).corners().iter().copied())
}

/// Draws the vehicle where it is now, with a wedge to its front.
pub(super) fn draw_ego(svg: &mut Svg, camera: &Camera, scene: &Scene, ego: &Pose) {
    let vehicle = &scene.vehicle;
    let Some(body) = ring(camera, &vehicle.footprint(0.0, 0.0), ego) else { return };
    svg.polygon("ego", &body);
    let front = vehicle.max_longitudinal_offset_m();
    let half = 0.3 * vehicle.vehicle_width_m();
    let transform = ego.planar_transform();
    let wedge = [(front - 1.4, half), (front - 0.5, 0.0), (front - 1.4, -half)];
    let wedge = wedge.map(|(x, y)| camera.at(transform.apply(Point2::new(x, y))));
    svg.lines("wedge", [&wedge[..]]);
}

/// Rings the place of the violation and writes when it happens.
pub(super) fn mark(svg: &mut Svg, camera: &Camera, evidence: &ExplainedEvidence) {
    let (Some(x), Some(y)) = (evidence.x, evidence.y) else { return };
    let place = camera.at(Point2::new(x.0, y.0));
    if !camera.shows(place, 0.0) {
        return;
    }
    svg.circle("halo", place, 11.0);
    svg.circle("mark", place, 11.0);
    svg.circle("core", place, 3.0);
    if let Some(time_s) = evidence.time_s.map(|time| time.0).filter(|time_s| time_s.is_finite()) {
        let (x, class) = if place[0] + 70.0 < super::camera::WIDTH_PX {
            (place[0] + 13.0, "hit-label")
        } else {
            (place[0] - 13.0, "hit-label end")
        };
        let y = if place[1] > 30.0 { place[1] - 13.0 } else { place[1] + 25.0 };
        svg.text(class, [x, y], &format!("{time_s:.1} s"));
    }
}

/// Writes the names of the candidates at their ends, where they are few.
pub(super) fn names(svg: &mut Svg, camera: &Camera, scene: &Scene, all: &[Told<'_>]) {
    if all.len() > MOST_NAMES {
        return;
    }
    let mut taken: Vec<[f64; 2]> = Vec::new();
    for (candidate, explained) in all {
        let places = finite_points(candidate).map(|pose| camera.at(pose.point()));
        let Some([x, y]) = places.filter(|place| camera.shows(*place, -10.0)).last() else { continue };
        let half_width = camera.length(0.5 * scene.vehicle.vehicle_width_m());
        let mut place = [x, (y - half_width - 6.0).max(18.0)];
        while taken.iter().any(|t| (t[1] - place[1]).abs() < NAME_HEIGHT_PX && (t[0] - x).abs() < 200.0) {
            place[1] += NAME_HEIGHT_PX;
        }
        taken.push(place);
        let class = format!(
            "name {} {}",
            verdict(explained),
            if x > 0.5 * super::camera::WIDTH_PX { "end" } else { "" }
        );
        svg.text(class.trim_end(), place, &explained.generator);
    }
}
