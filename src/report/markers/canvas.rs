//! A marker array in the making.

use messages::builtin_interfaces::Duration;
use messages::geometry_msgs::{Point, Pose, Vector3};
use messages::std_msgs::{ColorRgba, Header};
use messages::visualization_msgs::{Marker, MarkerArray};
use motion::Point2;

/// What moves vanishes after this, if no later cycle removes it before.
pub(super) const SHORT_LIVED: Duration = Duration { sec: 0, nanosec: 500_000_000 };
/// For what stands still.
pub(super) const FOREVER: Duration = Duration { sec: 0, nanosec: 0 };

/// A colour.
pub(super) const fn colour(r: f32, g: f32, b: f32, a: f32) -> ColorRgba {
    ColorRgba { r, g, b, a }
}

/// Collects markers that share header and lifetime.
#[derive(Debug)]
pub(super) struct Canvas {
    header: Header,
    lifetime: Duration,
    markers: Vec<Marker>,
}

impl Canvas {
    /// Begins by removing what the topic drew before.
    pub(super) fn new(header: Header, lifetime: Duration) -> Self {
        let clear = Marker { header: header.clone(), action: Marker::DELETEALL, ..Marker::default() };
        Self { header, lifetime, markers: vec![clear] }
    }

    /// A connected line. Places that are no numbers are left out; of fewer than two nothing remains.
    pub(super) fn line(
        &mut self,
        ns: &str,
        colour: ColorRgba,
        width_m: f64,
        points: impl IntoIterator<Item = Point>,
    ) {
        let points: Vec<Point> = points.into_iter().filter(is_finite).collect();
        if points.len() > 1 {
            self.push(ns, Marker { points, ..lines(Marker::LINE_STRIP, colour, width_m) });
        }
    }

    /// A closed outline on the plane at height `z`.
    pub(super) fn outline(&mut self, ns: &str, colour: ColorRgba, width_m: f64, corners: &[Point2], z: f64) {
        let closed = corners.iter().chain(corners.first());
        self.line(ns, colour, width_m, closed.map(|corner| Point { x: corner.x, y: corner.y, z }));
    }

    /// Separate lines, two points each.
    pub(super) fn segments(&mut self, ns: &str, colour: ColorRgba, width_m: f64, points: Vec<Point>) {
        if !points.is_empty() {
            self.push(ns, Marker { points, ..lines(Marker::LINE_LIST, colour, width_m) });
        }
    }

    /// A text that faces whoever looks, its letters `height_m` high.
    pub(super) fn text(&mut self, ns: &str, colour: ColorRgba, height_m: f64, position: Point, text: String) {
        if is_finite(&position) {
            let scale = Vector3 { z: height_m, ..Vector3::default() };
            let pose = Pose { position, ..Pose::default() };
            let r#type = Marker::TEXT_VIEW_FACING;
            self.push(ns, Marker { r#type, pose, scale, color: colour, text, ..Marker::default() });
        }
    }

    fn push(&mut self, ns: &str, marker: Marker) {
        let id = i32::try_from(self.markers.len()).unwrap_or(i32::MAX);
        let (header, lifetime, ns) = (self.header.clone(), self.lifetime, ns.to_owned());
        self.markers.push(Marker { header, lifetime, ns, id, action: Marker::ADD, ..marker });
    }

    pub(super) fn finish(self) -> MarkerArray {
        MarkerArray { markers: self.markers }
    }
}

fn lines(r#type: i32, color: ColorRgba, width_m: f64) -> Marker {
    Marker { r#type, color, scale: Vector3 { x: width_m, ..Vector3::default() }, ..Marker::default() }
}

fn is_finite(point: &Point) -> bool {
    point.x.is_finite() && point.y.is_finite() && point.z.is_finite()
}
