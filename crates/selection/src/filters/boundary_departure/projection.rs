//! How far a side of the vehicle is from a border segment, measured where one is beside the other.
//!
//! Not the distance of two segments: two ends that are near each other without either being beside the other segment
//! do not count. So a border that ends ahead is no lateral departure.

use motion::{Point2, Segment, Vector2};

/// A side of the vehicle beside a border segment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Projection {
    /// Distance, never negative.
    pub(super) lateral_m: f64,
    /// From the front corner back along the side to the place that is nearest to the border.
    pub(super) offset_m: f64,
    /// From the vehicle to the border.
    pub(super) to_border: Vector2,
}

impl Projection {
    /// A border crosses the vehicle.
    pub(super) fn crossing(offset_m: f64) -> Self {
        Self { lateral_m: 0.0, offset_m, to_border: Vector2::zeros() }
    }
}

/// The nearest place of a line to a point, if that is beside the line; nothing is beside a line without length.
#[inline]
fn foot(point: Point2, line: &Segment) -> Option<Point2> {
    let vector = line.vector();
    let along = vector.dot(&(point - line.start));
    let whole = vector.norm_squared();
    (0.0 <= along && along <= whole && whole > 0.0).then(|| line.start + vector * (along / whole))
}

/// Projects a side (front corner first) and a border segment on each other; 0 where they cross. `None` if neither has
/// an end beside the other. A border without length is beside nothing; its neighbours share its place.
pub(super) fn project(side: &Segment, border: &Segment) -> Option<Projection> {
    match side.intersection(border) {
        Some(crossing) => Some(Projection::crossing((crossing - side.start).norm())),
        None => project_apart(side, border),
    }
}

/// As [`project`] for a side and a border that do not cross.
pub(super) fn project_apart(side: &Segment, border: &Segment) -> Option<Projection> {
    if border.start == border.end {
        return None;
    }
    // Both places, on the vehicle and on the border: from both corners, then to both ends.
    let of_corner = |corner: Point2| foot(corner, border).map(|place| (corner, place));
    let of_end = |end: Point2| foot(end, side).map(|place| (place, end));
    let pairs = [of_corner(side.start), of_corner(side.end), of_end(border.start), of_end(border.end)];
    let mut nearest: Option<(f64, Point2, Vector2)> = None;
    for (on_vehicle, on_border) in pairs.into_iter().flatten() {
        let to_border = on_border - on_vehicle;
        let squared_m2 = to_border.norm_squared();
        if nearest.is_none_or(|(nearest_m2, ..)| squared_m2 < nearest_m2) {
            nearest = Some((squared_m2, on_vehicle, to_border));
        }
    }
    nearest.map(|(squared_m2, on_vehicle, to_border)| Projection {
        lateral_m: squared_m2.sqrt(),
        offset_m: (on_vehicle - side.start).norm(),
        to_border,
    })
}
