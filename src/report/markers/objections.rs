//! Where and why one filter objects, and how often all of them do.

use messages::geometry_msgs::{Point, Pose, Vector3};
use messages::std_msgs::ColorRgba;
use messages::visualization_msgs::{Marker, MarkerArray};
use selection::validator::{Enforcement, LoadedFilter};
use selection::{Candidate, Evidence, Scene};
use selector_actors::cycle::{Cycle, Judged};

use super::canvas::{Canvas, SHORT_LIVED, colour};
use super::header;
use crate::report::road_users::{objects, outline, pose_after};

const ENFORCED: ColorRgba = colour(0.9, 0.15, 0.15, 0.9);
const SHADOW: ColorRgba = colour(0.95, 0.6, 0.1, 0.9);
const MET: ColorRgba = colour(0.9, 0.2, 0.9, 0.9);
const WHITE: ColorRgba = colour(1.0, 1.0, 1.0, 0.999);

/// Height of the letters of a reason, m.
const REASON_M: f64 = 0.5;
/// Height of the letters of the text above the vehicle, m, as upstream has it.
const TEXT_M: f64 = 0.4;

/// The first violation of each candidate that the filter objects to: the vehicle there, the road user that it meets,
/// the map element that is involved, and the reason in words.
pub(super) fn of_filter(cycle: &Cycle, judged: &Judged, filter: &LoadedFilter, at: usize) -> MarkerArray {
    let scene = &*cycle.scene;
    let shade = match filter.enforcement() {
        Enforcement::Enforced => ENFORCED,
        Enforcement::Shadow => SHADOW,
    };
    let mut canvas = Canvas::new(header(scene), SHORT_LIVED);
    for (candidate, verdict) in cycle.concatenated.candidates.iter().zip(&judged.verdicts) {
        let Some(said) = verdict.judgements.get(at).filter(|said| !said.feasible) else { continue };
        let Some(evidence) = &said.evidence else { continue };
        let height_m = candidate.points.get(evidence.index).map_or(0.0, |point| point.pose.position.z);
        draw_vehicle(&mut canvas, scene, candidate, evidence, shade);
        draw_element(&mut canvas, scene, evidence, shade);
        draw_met(&mut canvas, scene, evidence);
        if let Some(reason) = filter.explain(said) {
            let place = Point { x: evidence.x_m, y: evidence.y_m, z: height_m + 1.0 };
            let text = format!("{} {}: {reason}", candidate.generator_name, candidate.key.sample);
            canvas.text("reasons", WHITE, REASON_M, place, text);
        }
    }
    canvas.finish()
}

fn draw_vehicle(
    canvas: &mut Canvas,
    scene: &Scene,
    candidate: &Candidate,
    evidence: &Evidence,
    shade: ColorRgba,
) {
    if let Some(point) = candidate.points.get(evidence.index) {
        let footprint = scene.vehicle.footprint(0.0, 0.0).placed_at(&point.pose);
        canvas.outline("violations", shade, 0.1, footprint.corners(), point.pose.position.z);
    }
}

fn draw_element(canvas: &mut Canvas, scene: &Scene, evidence: &Evidence, shade: ColorRgba) {
    let map = scene.map.as_ref().map(|map| &map.value.map);
    if let Some(line) = evidence.element_id.and_then(|id| map?.line_string(id)) {
        canvas.line("map_elements", shade, 0.3, line.positions().map(|[x, y, z]| Point { x, y, z }));
    }
}

/// The road user where it is expected to be at that time.
fn draw_met(canvas: &mut Canvas, scene: &Scene, evidence: &Evidence) {
    let met = evidence.object_id.and_then(|id| objects(scene).iter().find(|object| object.object_id == id));
    if let Some(object) = met
        && let Some(pose) = pose_after(object, evidence.time_s)
    {
        canvas.outline("met_road_users", MET, 0.1, &outline(object, &pose), pose.position.z);
    }
}

/// The text that upstream shows above the vehicle.
pub(super) fn text(cycle: &Cycle, judged: &Judged) -> MarkerArray {
    let mut text = format!("{:^50}\n", "--- Trajectory Validator Filtering Result ---");
    // The first summary is the data-validity check, which upstream does not have.
    let filters = &judged.filters[1.min(judged.filters.len())..];
    for filter in filters.iter().filter(|filter| filter.rejected > 0) {
        text += &format!("- {}: {} path(s) filtered\n", filter.name, filter.rejected);
    }
    let silent = filters.iter().filter(|filter| filter.rejected == 0).count();
    text += &"\n".repeat(silent);
    text += &"-".repeat(35);
    let markers = cycle.scene.odometry.iter().map(|odometry| {
        let mut pose = Pose { position: odometry.pose.pose.position, ..Pose::default() };
        pose.position.z += cycle.scene.vehicle.vehicle_height_m();
        Marker {
            header: header(&cycle.scene),
            ns: "plugin_report".to_owned(),
            r#type: Marker::TEXT_VIEW_FACING,
            action: Marker::ADD,
            pose,
            scale: Vector3 { z: TEXT_M, ..Vector3::default() },
            color: WHITE,
            lifetime: SHORT_LIVED,
            frame_locked: true,
            text: text.clone(),
            ..Marker::default()
        }
    });
    MarkerArray { markers: markers.collect() }
}
