//! The traffic lights of a route with what the map says about them: stop line, turn of the lane, arrows.
//!
//! Made anew for every map and route. A light belongs to the first preferred lanelet of the route that it rules; lights
//! of other lanelets do not concern the route.

use super::lamps::TurnDirection;
use lanelet_map::{Lanelet, Map, Polyline, RegulatoryElement};
use messages::autoware_planning_msgs::LaneletRoute;
use motion::{AxisAlignedBox, Point2, Segment};
use std::collections::BTreeMap;
use std::sync::Arc;

/// A stop line: at least one segment, which may be a point.
#[derive(Debug)]
pub(super) struct StopLine {
    /// Id of the line string.
    pub id: i64,
    segments: Vec<Segment>,
    extent: AxisAlignedBox,
}

impl StopLine {
    /// `None` for a line without points.
    fn new(line: Polyline<'_>) -> Option<Self> {
        let points: Vec<Point2> = line.positions().map(|[x, y, _]| Point2::new(x, y)).collect();
        let segments = match points[..] {
            [] => return None,
            [point] => vec![Segment::new(point, point)],
            _ => points.windows(2).map(|pair| Segment::new(pair[0], pair[1])).collect(),
        };
        Some(Self { id: line.id(), extent: AxisAlignedBox::around(points), segments })
    }

    /// The box around the line.
    #[inline]
    pub(super) fn extent(&self) -> &AxisAlignedBox {
        &self.extent
    }

    /// Distance of a point from the line, m.
    pub(super) fn distance_m(&self, point: Point2) -> f64 {
        let squared = self.segments.iter().map(|segment| segment.squared_distance_to_point(point));
        squared.fold(f64::INFINITY, f64::min).sqrt()
    }

    /// The point of the line that a piece of a path meets first.
    #[inline]
    pub(super) fn first_contact(&self, piece: &Segment) -> Option<Point2> {
        if !self.extent.overlaps(&AxisAlignedBox::around([piece.start, piece.end])) {
            return None;
        }
        let contacts = self.segments.iter().filter_map(|segment| piece.first_contact(segment));
        contacts.min_by(|a, b| {
            let from_start = |point: &Point2| (point - piece.start).norm_squared();
            from_start(a).total_cmp(&from_start(b))
        })
    }
}

/// A light of the route.
#[derive(Debug)]
pub(super) struct RouteLight {
    /// Where the lane that it rules turns.
    pub turn: TurnDirection,
    /// Whether the light has an arrow of its own, lit or not.
    pub has_arrow: bool,
    /// Where to stop for it.
    pub stop_line: Arc<StopLine>,
}

impl RouteLight {
    /// `None` for a light without a stop line: nobody has to stop anywhere for it.
    fn new(light: RegulatoryElement<'_>, lanelet: Lanelet<'_>) -> Option<Self> {
        Some(Self {
            turn: TurnDirection::from_attribute(lanelet.attribute("turn_direction")),
            has_arrow: has_arrow(light),
            stop_line: light.line_strings("ref_line").next().and_then(StopLine::new).map(Arc::new)?,
        })
    }
}

/// The map tells of arrows by the subtype of the lit shape, or by an attribute of a bulb.
fn has_arrow(light: RegulatoryElement<'_>) -> bool {
    let mut shapes = light.line_strings("refers");
    let mut bulbs = light.line_strings("light_bulbs").flat_map(|bulbs| bulbs.points());
    shapes.any(|shape| shape.attribute("subtype").is_some_and(|subtype| subtype.contains("arrow")))
        || bulbs.any(|bulb| bulb.attribute("arrow").is_some())
}

/// A preferred lanelet of the route that the map does not have.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct UnknownLanelet(pub i64);

/// The lights of a route by id; `None` for one without a stop line.
#[derive(Debug, Default)]
pub(super) struct RouteLights {
    lights: BTreeMap<i64, Option<RouteLight>>,
}

impl RouteLights {
    /// The lights along the preferred lanelets.
    pub(super) fn new(map: &Map, route: &LaneletRoute) -> Result<Self, UnknownLanelet> {
        let mut lights = BTreeMap::new();
        for segment in &route.segments {
            let id = segment.preferred_primitive.id;
            let lanelet = map.lanelet(id).ok_or(UnknownLanelet(id))?;
            for rule in lanelet.regulatory_elements().filter(|rule| rule.subtype() == "traffic_light") {
                lights.entry(rule.id()).or_insert_with(|| {
                    map.regulatory_element(rule.id()).and_then(|light| RouteLight::new(light, lanelet))
                });
            }
        }
        Ok(Self { lights })
    }

    /// The light with this id, if it is on the route and has a stop line.
    pub(super) fn get(&self, light_id: i64) -> Option<&RouteLight> {
        self.lights.get(&light_id)?.as_ref()
    }
}

#[cfg(test)]
mod tests;
