//! What stands still: the part of the HD map around the way that the vehicle took.

use std::collections::BTreeSet;
use std::sync::Arc;

use lanelet_map::{Map, Polyline};
use messages::autoware_perception_msgs::TrafficLightElement;
use motion::{AxisAlignedBox, Point2};
use selection::Scene;
use serde::Serialize;

use super::codes::Origin;

/// How far from the vehicle's way the map is drawn, m.
const REACH_M: f64 = 90.0;
/// Places of the vehicle are kept this far apart, m.
const PLACE_DISTANCE_M: f64 = 20.0;
/// Kinds of line strings that are drawn; the viewer knows each by this name.
const LINES: [&str; 7] =
    ["road_border", "line_thin", "line_thick", "curbstone", "guard_rail", "wall", "fence"];

/// The maps that were in force, and where the vehicle was.
#[derive(Debug, Default)]
pub(super) struct Scenery {
    maps: Vec<(u64, Arc<Map>)>,
    places: Vec<Point2>,
    vehicle: Option<[f64; 4]>,
}

#[derive(Debug, Default, Serialize)]
pub(super) struct SceneryOnPage {
    /// Lines by kind.
    lines: Vec<(&'static str, Vec<i64>)>,
    /// Outlines of the lanes for vehicles.
    lanes: Vec<Vec<i64>>,
    /// Outlines of crosswalks.
    crosswalks: Vec<Vec<i64>>,
    /// Stop lines with the traffic light rules that hold there.
    stop_lines: Vec<(i64, Vec<i64>, Vec<i64>)>,
    /// Lights by rule: where they hang.
    lights: Vec<(i64, [i64; 2])>,
    /// Front, rear, left and right edge of the own vehicle from its reference point, cm.
    vehicle: [i64; 4],
}

impl Scenery {
    pub(super) fn add(&mut self, scene: &Scene) {
        let vehicle = &scene.vehicle;
        self.vehicle.get_or_insert_with(|| {
            [
                vehicle.max_longitudinal_offset_m(),
                vehicle.min_longitudinal_offset_m(),
                vehicle.max_lateral_offset_m(),
                vehicle.min_lateral_offset_m(),
            ]
        });
        if let Some(map) = &scene.map
            && self.maps.last().is_none_or(|(number, _)| *number != map.number)
        {
            self.maps.push((map.number, map.value.map.clone()));
        }
        if let Some(odometry) = &scene.odometry {
            let position = odometry.pose.pose.position;
            let place = Point2::new(position.x, position.y);
            let is_new = |last: &Point2| (place - last).norm() >= PLACE_DISTANCE_M;
            if place.x.is_finite() && place.y.is_finite() && self.places.last().is_none_or(is_new) {
                self.places.push(place);
            }
        }
    }

    pub(super) fn finish(self, origin: Origin) -> SceneryOnPage {
        let Self { maps, places, vehicle } = self;
        let mut page = SceneryOnPage::default();
        if let Some(edges) = vehicle {
            page.vehicle = edges.map(super::codes::centimetres);
        }
        let nearby = Nearby { places, origin };
        for (_, map) in &maps {
            nearby.draw_lines(map, &mut page);
            nearby.draw_lanes(map, &mut page);
            nearby.draw_rules(map, &mut page);
        }
        page
    }
}

/// Chooses what is near enough to be drawn.
struct Nearby {
    places: Vec<Point2>,
    origin: Origin,
}

impl Nearby {
    /// The line on the page, if it comes near the vehicle's way.
    fn line(&self, points: impl Iterator<Item = [f64; 3]>) -> Option<Vec<i64>> {
        let points: Vec<_> = points.map(|[x, y, _]| Point2::new(x, y)).collect();
        let extent = AxisAlignedBox::around(points.iter().copied());
        // Nothing is near the box around no points.
        let is_near = self.places.iter().any(|place| {
            let dx = (extent.min.x - place.x).max(place.x - extent.max.x).max(0.0);
            let dy = (extent.min.y - place.y).max(place.y - extent.max.y).max(0.0);
            dx.max(dy) <= REACH_M
        });
        is_near.then(|| self.origin.line(points))
    }

    fn draw_lines(&self, map: &Map, page: &mut SceneryOnPage) {
        for string in map.line_strings() {
            let kind = string.attribute("type").and_then(|kind| LINES.iter().find(|known| **known == kind));
            if let Some(kind) = kind
                && let Some(line) = self.line(string.positions())
            {
                page.lines.push((kind, line));
            }
        }
    }

    fn draw_lanes(&self, map: &Map, page: &mut SceneryOnPage) {
        for lanelet in map.lanelets() {
            let outlines = match lanelet.subtype() {
                Some("crosswalk") => &mut page.crosswalks,
                Some("road" | "highway" | "road_shoulder") => &mut page.lanes,
                _ => continue,
            };
            outlines.extend(self.line(lanelet.outline()));
        }
    }

    fn draw_rules(&self, map: &Map, page: &mut SceneryOnPage) {
        let mut drawn = BTreeSet::new();
        for rule in map.regulatory_elements() {
            let is_light = rule.subtype() == "traffic_light";
            for stop_line in rule.line_strings("ref_line") {
                self.draw_stop_line(stop_line, is_light.then(|| rule.id()), page);
                drawn.insert(stop_line.id());
            }
            if is_light && let Some(at) = rule.line_strings("refers").find_map(|light| self.middle(light)) {
                page.lights.push((rule.id(), at));
            }
        }
        for string in map.line_strings() {
            if string.attribute("type") == Some("stop_line") && !drawn.contains(&string.id()) {
                self.draw_stop_line(string, None, page);
            }
        }
    }

    fn draw_stop_line(&self, stop_line: Polyline<'_>, light: Option<i64>, page: &mut SceneryOnPage) {
        match page.stop_lines.iter_mut().find(|(id, ..)| *id == stop_line.id()) {
            Some((_, _, lights)) => lights.extend(light),
            None => {
                if let Some(line) = self.line(stop_line.positions()) {
                    page.stop_lines.push((stop_line.id(), line, light.into_iter().collect()));
                }
            }
        }
    }

    fn middle(&self, light: Polyline<'_>) -> Option<[i64; 2]> {
        self.line(light.positions())?;
        let count = light.len() as f64;
        let sum = light.positions().fold([0.0; 2], |sum, [x, y, _]| [sum[0] + x, sum[1] + y]);
        (count > 0.0).then(|| self.origin.code(Point2::new(sum[0] / count, sum[1] / count)))
    }
}

/// Colour of a light for the page: that of its lit circle, else of its first lamp.
pub(super) fn colour(elements: &[TrafficLightElement]) -> u8 {
    let circle = elements.iter().find(|lamp| lamp.shape == TrafficLightElement::CIRCLE);
    circle.or(elements.first()).map_or(TrafficLightElement::UNKNOWN, |lamp| lamp.color)
}
