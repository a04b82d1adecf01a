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
    /// Both places are given: on the vehicle and on the border.
    fn between(on_vehicle: Point2, on_border: Point2, offset_m: f64) -> Self {
        let to_border = on_border - on_vehicle;
        Self { lateral_m: to_border.norm(), offset_m, to_border }
    }
}

/// The nearest place of a line to a point, if that is beside the line. Not-a-number for a line without length.
#[inline]
fn foot(point: Point2, line: &Segment) -> Option<Point2> {
    let vector = line.vector();
    let along = vector.dot(&(point - line.start));
    let whole = vector.norm_squared();
    (0.0 <= along && along <= whole).then(|| line.start + vector * (along / whole))
}

/// Projects a side (front corner first) and a border segment on each other; 0 where they cross. `None` if neither has
/// an end beside the other. A border without length has no distance (not-a-number), as upstream has it: its neighbours
/// share its place.
pub(super) fn project(side: &Segment, border: &Segment) -> Option<Projection> {
    if let Some(crossing) = side.intersection(border) {
        let offset_m = (crossing - side.start).norm();
        return Some(Projection { lateral_m: 0.0, offset_m, to_border: Vector2::zeros() });
    }
    let of_corner = |corner: Point2, offset_m: f64| {
        foot(corner, border).map(|place| Projection::between(corner, place, offset_m))
    };
    let of_end = |end: Point2| {
        foot(end, side).map(|place| Projection::between(place, end, (place - side.start).norm()))
    };
    let options = [
        of_corner(side.start, 0.0),
        of_corner(side.end, side.length()),
        of_end(border.start),
        of_end(border.end),
    ];
    options
        .into_iter()
        .flatten()
        .reduce(|best, other| if other.lateral_m < best.lateral_m { other } else { best })
}
