//! What the filter takes from map and route: unsignalised crosswalks with stop lines, and the places where people wait.
//!
//! Computed anew when the map, the route or the parameters change, never while judging.

use crate::parameters::CrosswalkParameters;
use lanelet_map::{Lanelet, Map, Polyline, RegulatoryElement};
use messages::autoware_planning_msgs::LaneletRoute;
use motion::geometry::polygon_contains;
use motion::{AxisAlignedBox, Point2, Segment, Vector2};
use smallvec::SmallVec;
use std::borrow::Cow;

/// How far outside a detection area a position still counts as inside \[m\].
const AREA_TOLERANCE_M: f64 = 1e-3;
/// Up to this margin there are no detection areas; a crosswalk's end narrower than this has none \[m\].
const SMALLEST_AREA_M: f64 = 1e-3;

/// A line before which the vehicle has to wait.
#[derive(Debug)]
pub(super) struct StopLine {
    pub(super) id: i64,
    pub(super) points: Vec<Point2>,
    pub(super) extent: AxisAlignedBox,
}

/// An unsignalised crosswalk that a preferred lanelet of the route passes.
#[derive(Debug)]
pub(super) struct Crosswalk {
    /// Id of the regulatory element.
    pub(super) id: i64,
    pub(super) stop_lines: Vec<StopLine>,
    /// Left bound, then the right bound backwards.
    outline: Vec<Point2>,
    outline_extent: AxisAlignedBox,
    /// Where people wait: a quadrangle at each end.
    areas: SmallVec<[[Point2; 4]; 2]>,
    areas_extent: AxisAlignedBox,
    /// The lines over which people step onto the crosswalk, one at each end.
    entries: SmallVec<[Segment; 2]>,
}

/// The unsignalised crosswalks with stop lines along the route, each once, in route order.
///
/// The error says which element the map lacks: a route that cannot be followed hides crosswalks.
pub(super) fn crosswalks_along(
    map: &Map,
    route: &LaneletRoute,
    parameters: &CrosswalkParameters,
) -> Result<Vec<Crosswalk>, Cow<'static, str>> {
    let mut seen: Vec<i64> = Vec::new();
    let mut crosswalks = Vec::new();
    for segment in &route.segments {
        let id = segment.preferred_primitive.id;
        let Some(road) = map.lanelet(id) else {
            return Err(format!("lanelet {id} is not in the map").into());
        };
        for rule in road.regulatory_elements().filter(|rule| rule.subtype() == "crosswalk") {
            if seen.contains(&rule.id()) {
                continue;
            }
            seen.push(rule.id());
            let Some(lanelet) = rule.lanelets("refers").next() else {
                return Err(format!("the lanelet of crosswalk {} is not in the map", rule.id()).into());
            };
            let signalised = lanelet.regulatory_elements().any(|rule| rule.subtype() == "traffic_light");
            let crosswalk = Crosswalk::new(&rule, &lanelet, parameters);
            if !signalised && !crosswalk.stop_lines.is_empty() {
                crosswalks.push(crosswalk);
            }
        }
    }
    Ok(crosswalks)
}

impl Crosswalk {
    fn new(rule: &RegulatoryElement<'_>, lanelet: &Lanelet<'_>, parameters: &CrosswalkParameters) -> Self {
        let (left, right) = (places(&lanelet.left()), places(&lanelet.right()));
        let outline: Vec<_> = left.iter().chain(right.iter().rev()).copied().collect();
        let mut areas = SmallVec::new();
        let mut entries = SmallVec::new();
        if let ([l0, l1, ..], [r0, r1, ..], [.., l2, l3], [.., r2, r3]) = (&*left, &*right, &*left, &*right) {
            areas.extend(waiting_area([*l1, *l0], [*r1, *r0], parameters));
            areas.extend(waiting_area([*l2, *l3], [*r2, *r3], parameters));
            entries.extend([Segment::new(*l0, *r0), Segment::new(*l3, *r3)]);
        }
        let stop_line = |line: Polyline<'_>| {
            let points = places(&line);
            StopLine { id: line.id(), extent: AxisAlignedBox::around(points.iter().copied()), points }
        };
        Self {
            id: rule.id(),
            stop_lines: rule.line_strings("ref_line").map(stop_line).collect(),
            outline_extent: AxisAlignedBox::around(outline.iter().copied()),
            outline,
            areas_extent: AxisAlignedBox::around(areas.iter().copied().flatten()).widened(AREA_TOLERANCE_M),
            areas,
            entries,
        }
    }

    /// True if somebody at this place waits at one end of the crosswalk.
    pub(super) fn is_waiting_place(&self, place: Point2) -> bool {
        let reaches = |area: &[Point2; 4]| {
            let near = |k: usize| {
                Segment::new(area[k], area[(k + 1) % 4]).distance_to_point(place) <= AREA_TOLERANCE_M
            };
            polygon_contains(area, place) || (0..4).any(near)
        };
        self.areas_extent.contains(place) && self.areas.iter().any(reaches)
    }

    /// True if a place is on the crosswalk or its border.
    pub(super) fn covers(&self, place: Point2) -> bool {
        self.outline_extent.contains(place) && polygon_contains(&self.outline, place)
    }

    /// The place nearest to somebody where the crosswalk can be stepped on; the first end wins a tie.
    pub(super) fn nearest_entry(&self, place: Point2) -> Option<Point2> {
        let nearest = self.entries.iter().map(|entry| entry.nearest_point(place));
        nearest.reduce(|first, second| {
            let nearer = (second - place).norm_squared() < (first - place).norm_squared();
            if nearer { second } else { first }
        })
    }
}

fn places(line: &Polyline<'_>) -> Vec<Point2> {
    line.positions().map(|[x, y, _]| Point2::new(x, y)).collect()
}

/// The quadrangle beyond one end of a crosswalk. Each bound is given by its last two points, the end last.
fn waiting_area(
    left: [Point2; 2],
    right: [Point2; 2],
    parameters: &CrosswalkParameters,
) -> Option<[Point2; 4]> {
    let across = right[1] - left[1];
    if parameters.lon_detection_margin <= SMALLEST_AREA_M || across.norm() <= SMALLEST_AREA_M {
        return None;
    }
    let outward = |bound: [Point2; 2]| {
        let direction = (bound[1] - bound[0]).try_normalize(0.0).unwrap_or_else(Vector2::zeros);
        direction * parameters.lon_detection_margin
    };
    let aside = across.normalize() * parameters.lat_detection_margin;
    let (l, r) = (left[1], right[1]);
    Some([l - aside, l + outward(left) - aside, r + outward(right) + aside, r + aside])
}
