//! What stands still: the part of the HD map about the vehicle.

use lanelet_map::{Map, Polyline};
use messages::builtin_interfaces::Time;
use messages::geometry_msgs::Point;
use messages::visualization_msgs::MarkerArray;
use motion::{AxisAlignedBox, Point2};
use selection::Scene;

use super::canvas::{Canvas, FOREVER, colour};
use super::header;
use crate::report::road::{is_border, is_for_walking, stop_lines};

/// How far from the vehicle the map is drawn, m, along each axis.
const REACH_M: f64 = 120.0;
/// The vehicle may move this far before the road is drawn anew, m.
const MOVE_M: f64 = 40.0;
/// So often the road is drawn anew though nothing changed, for those who came late, ns.
const REPEAT_NS: i64 = 1_000_000_000;

/// Remembers what was drawn last.
#[derive(Debug, Default)]
pub(super) struct Road {
    drawn: Option<(u64, Point2, Time)>,
}

impl Road {
    /// The road, if it is time to draw it.
    pub(super) fn draw(&mut self, scene: &Scene) -> Option<MarkerArray> {
        let map = scene.map.as_ref()?;
        let position = scene.odometry.as_ref()?.pose.pose.position;
        let centre = Point2::new(position.x, position.y);
        let is_fresh = self.drawn.is_some_and(|(number, place, time)| {
            let age_ns = scene.now.nanoseconds() - time.nanoseconds();
            number == map.number && (centre - place).norm() < MOVE_M && (0..REPEAT_NS).contains(&age_ns)
        });
        if is_fresh {
            return None;
        }
        self.drawn = Some((map.number, centre, scene.now));
        Some(draw(&map.value.map, centre, Canvas::new(header(scene), FOREVER)))
    }
}

fn draw(map: &Map, centre: Point2, mut canvas: Canvas) -> MarkerArray {
    let (mut lanes, mut crosswalks) = (Vec::new(), Vec::new());
    for lanelet in map.lanelets() {
        let lines = if is_for_walking(&lanelet) { &mut crosswalks } else { &mut lanes };
        for bound in [lanelet.left(), lanelet.right()] {
            if !is_border(&bound) {
                add_segments(lines, centre, &bound);
            }
        }
    }
    let (mut borders, mut stops) = (Vec::new(), Vec::new());
    for border in map.line_strings().filter(is_border) {
        add_segments(&mut borders, centre, &border);
    }
    for stop_line in stop_lines(map) {
        add_segments(&mut stops, centre, &stop_line);
    }
    canvas.segments("lanes", colour(0.75, 0.75, 0.75, 0.6), 0.1, lanes);
    canvas.segments("crosswalks", colour(0.8, 0.8, 0.3, 0.6), 0.1, crosswalks);
    canvas.segments("borders", colour(0.55, 0.4, 0.3, 0.9), 0.15, borders);
    canvas.segments("stop_lines", colour(0.95, 0.95, 0.95, 0.9), 0.3, stops);
    canvas.finish()
}

/// The line as separate segments, if it comes near the vehicle.
fn add_segments(segments: &mut Vec<Point>, centre: Point2, line: &Polyline<'_>) {
    let points: Vec<Point> = line.positions().map(|[x, y, z]| Point { x, y, z }).collect();
    let extent = AxisAlignedBox::around(points.iter().map(|point| Point2::new(point.x, point.y)));
    let dx = (extent.min.x - centre.x).max(centre.x - extent.max.x);
    let dy = (extent.min.y - centre.y).max(centre.y - extent.max.y);
    if dx.max(dy) <= REACH_M {
        segments.extend(points.windows(2).flatten());
    }
}
