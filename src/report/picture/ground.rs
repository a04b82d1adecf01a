//! What lies on the ground: lanelets, crosswalks, borders, stop lines and their lights.

use super::camera::Camera;
use super::svg::{Px, Svg};
use crate::report::road::{self, Lamp, is_border, is_for_walking};
use lanelet_map::{Lanelet, Map, Polyline, RegulatoryElement};
use motion::Point2;
use selection::Scene;
use std::collections::BTreeSet;

/// A stripe of a crosswalk and the gap beside it, m.
const STRIPE_M: f64 = 0.6;
/// What is nearer to a way than this lies beside it, m.
const BESIDE_M: f64 = 7.0;
/// From the end of a stop line to its light, px.
const LIGHT_OFFSET_PX: f64 = 20.0;

/// The parts of the road beside a way, which a picture of that way should hold as well.
pub(super) fn road_beside(scene: &Scene, way: &[Point2]) -> Vec<Point2> {
    let Some(map) = scene.map.as_ref().map(|map| &*map.value.map) else { return Vec::new() };
    let roads = map.lanelets().filter(|lanelet| !is_for_walking(lanelet));
    let is_beside = |place: Point2| way.iter().any(|on_way| (on_way - place).norm() < BESIDE_M);
    let edges = roads.flat_map(|lanelet| lanelet.outline().map(planar).collect::<Vec<_>>());
    // Edges have few points where they are straight: it is their sides that lie beside the way, not their ends.
    let mut beside: Vec<Point2> = Vec::new();
    let mut before: Option<Point2> = None;
    for place in edges {
        if let Some(start) = before {
            let steps = ((place - start).norm() / BESIDE_M).clamp(1.0, 200.0).ceil();
            let between = (0..=steps as u32).map(|step| start + (place - start) * (f64::from(step) / steps));
            beside.extend(between.filter(|place| is_beside(*place)));
        }
        before = Some(place);
    }
    beside
}

/// Draws the map of a scene.
pub(super) fn draw(svg: &mut Svg, camera: &Camera, scene: &Scene) {
    let Some(map) = scene.map.as_ref().map(|map| &*map.value.map) else { return };
    let roads = || map.lanelets().filter(|lanelet| !is_for_walking(lanelet));
    for lanelet in roads() {
        if let Some(corners) = camera.shape(lanelet.outline().map(planar)) {
            svg.polygon("road", &corners);
        }
    }
    for lanelet in map.lanelets().filter(is_for_walking) {
        stripes(svg, camera, &lanelet);
    }
    let mut drawn = BTreeSet::new();
    for bound in roads().flat_map(|lanelet| [lanelet.left(), lanelet.right()]) {
        let is_painted = !is_border(&bound) && bound.attribute("type") != Some("virtual");
        if drawn.insert(bound.id()) && is_painted {
            let is_dashed = bound.attribute("subtype") == Some("dashed");
            line(svg, camera, if is_dashed { "lane dashed" } else { "lane" }, &bound);
        }
    }
    for border in map.line_strings().filter(is_border) {
        line(svg, camera, "border", &border);
    }
    for stop_line in road::stop_lines(map) {
        line(svg, camera, "stop", &stop_line);
    }
    lights(svg, camera, scene, map);
}

/// Draws a line string once more, as the one that a candidate violates.
pub(super) fn highlight(svg: &mut Svg, camera: &Camera, scene: &Scene, id: i64) {
    let map = scene.map.as_ref().map(|map| &*map.value.map);
    if let Some(hit) = map.and_then(|map| map.line_string(id)) {
        line(svg, camera, "hit", &hit);
    }
}

fn planar([x, y, _]: [f64; 3]) -> Point2 {
    Point2::new(x, y)
}

fn line(svg: &mut Svg, camera: &Camera, class: &str, line: &Polyline<'_>) {
    let runs = camera.runs(line.positions().map(planar));
    svg.lines(class, runs.iter().map(Vec::as_slice));
}

/// The stripes of a crosswalk: each from one bound to the other, side by side in the direction of walking.
fn stripes(svg: &mut Svg, camera: &Camera, lanelet: &Lanelet<'_>) {
    let bounds =
        [lanelet.left(), lanelet.right()].map(|bound| bound.positions().map(planar).collect::<Vec<_>>());
    let length_m = length(&bounds[0]);
    if camera.shape(lanelet.outline().map(planar)).is_none() || !(STRIPE_M..1e3).contains(&length_m) {
        return;
    }
    let count = (length_m / (2.0 * STRIPE_M)).round().max(1.0);
    for stripe in 0..count as u32 {
        let ends = [0.25, 0.75].map(|part| (f64::from(stripe) + part) / count);
        let corners = [(0, ends[0]), (0, ends[1]), (1, ends[1]), (1, ends[0])];
        let corners = corners.map(|(bound, part)| along(&bounds[bound], part));
        if let Some(corners) = camera.shape(corners.into_iter()) {
            svg.polygon("stripe", &corners);
        }
    }
}

fn length(line: &[Point2]) -> f64 {
    line.windows(2).map(|pair| (pair[1] - pair[0]).norm()).sum()
}

/// The place after this part of a line's length.
fn along(line: &[Point2], part: f64) -> Point2 {
    let mut left_m = part * length(line);
    for pair in line.windows(2) {
        let step = pair[1] - pair[0];
        if step.norm() >= left_m && step.norm() > 0.0 {
            return pair[0] + step * (left_m / step.norm());
        }
        left_m -= step.norm();
    }
    line.last().copied().unwrap_or_default()
}

/// A lamp beside each stop line of a light, as the signals have it.
fn lights(svg: &mut Svg, camera: &Camera, scene: &Scene, map: &Map) {
    for light in map.regulatory_elements().filter(|rule| rule.subtype() == "traffic_light") {
        let Some(place) = lamp_place(camera, &light) else { continue };
        let lamp = match road::lamp(scene, light.id()) {
            Lamp::Red => "red-lamp",
            Lamp::Amber => "amber-lamp",
            Lamp::Green => "green-lamp",
            Lamp::Dark => "dark",
        };
        svg.circle("housing", place, 11.0);
        svg.circle(lamp, place, 7.5);
    }
}

/// Beside the end of the stop line that is lower on the page, to the right of who drives along; at the other end if
/// that one is not on it.
fn lamp_place(camera: &Camera, light: &RegulatoryElement<'_>) -> Option<Px> {
    let stop_line = light.line_strings("ref_line").next()?;
    let places: Vec<Px> = stop_line.positions().map(|place| camera.at(planar(place))).collect();
    let (&a, &b) = (places.first()?, places.last()?);
    let ends = if a[1] > b[1] { [(a, b), (b, a)] } else { [(b, a), (a, b)] };
    ends.into_iter().find_map(|(end, other)| {
        let (dx, dy) = (end[0] - other[0], end[1] - other[1]);
        let length = dx.hypot(dy).max(1.0);
        let place = [end[0] + LIGHT_OFFSET_PX * dx / length, end[1] + LIGHT_OFFSET_PX * dy / length];
        camera.shows(place, -12.0).then_some(place)
    })
}
