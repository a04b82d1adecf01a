//! Convex shapes of at most eight corners: the footprint, and the hull of two footprints.

use motion::geometry::{Segment, Vector2};
use motion::{Point2, pose::normalize_radian};

use super::Rectangle;
use crate::pose::PlanarPose;

/// Two footprints have this many corners.
const MAX_CORNERS: usize = 8;

/// Discs that cover a shape for the quick answer.
const DISCS: usize = 6;

/// A pose with its sine and cosine.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Placement {
    origin: Point2,
    cos: f64,
    sin: f64,
}

impl Placement {
    pub(crate) fn new(pose: &PlanarPose) -> Self {
        let (sin, cos) = pose.yaw.sin_cos();
        Self { origin: pose.point(), cos, sin }
    }

    /// The placement of something placed at `next` in the frame of what is placed here.
    #[inline]
    pub(crate) fn then(self, next: &Self) -> Self {
        Self {
            origin: self.to_world(next.origin),
            cos: self.cos * next.cos - self.sin * next.sin,
            sin: self.sin * next.cos + self.cos * next.sin,
        }
    }

    #[inline]
    pub(crate) fn origin(self) -> Point2 {
        self.origin
    }

    /// Cosine and sine of the heading.
    #[inline]
    pub(crate) fn direction(self) -> Vector2 {
        Vector2::new(self.cos, self.sin)
    }

    #[inline]
    pub(crate) fn to_world(self, local: Point2) -> Point2 {
        Point2::new(
            self.origin.x + self.cos * local.x - self.sin * local.y,
            self.origin.y + self.sin * local.x + self.cos * local.y,
        )
    }

    #[inline]
    pub(crate) fn to_local(self, world: Point2) -> Point2 {
        let v = world - self.origin;
        Point2::new(self.cos * v.x + self.sin * v.y, self.cos * v.y - self.sin * v.x)
    }

    #[inline]
    pub(crate) fn segment_to_local(self, world: &Segment) -> Segment {
        Segment::new(self.to_local(world.start), self.to_local(world.end))
    }
}

/// The points p with `normal · p = offset`; what is to the left of the normal's tip is outside.
#[derive(Clone, Copy, Debug, Default)]
struct Side {
    normal: Vector2,
    offset: f64,
}

impl Side {
    fn beyond(&self, point: Point2) -> f64 {
        self.normal.dot(&point.coords) - self.offset
    }
}

#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Disc {
    pub(crate) center: Point2,
    pub(crate) radius_m: f64,
}

/// A convex polygon, and how far what it stands for may reach beyond it.
#[derive(Clone, Debug)]
pub(crate) struct Shape {
    corners: [Point2; MAX_CORNERS],
    sides: [Side; MAX_CORNERS],
    count: usize,
    discs: [Disc; DISCS],
    center: Point2,
    radius_m: f64,
    bulge_m: f64,
}

impl Shape {
    /// What `rectangle` sweeps on the screw motion from the origin to `end`, in the frame of the origin.
    pub(crate) fn sweep(rectangle: &Rectangle, end: &PlanarPose) -> Self {
        let place = Placement::new(end);
        let quarter_turn = normalize_radian(end.yaw).abs() / 4.0;
        let mut points = [Point2::origin(); MAX_CORNERS];
        let mut bulge_m = 0.0_f64;
        for (k, corner) in rectangle.corners().into_iter().enumerate() {
            let moved = place.to_world(corner);
            (points[2 * k], points[2 * k + 1]) = (corner, moved);
            // The corner runs along an arc over the chord; its sagitta is this.
            bulge_m = bulge_m.max((moved - corner).norm() / 2.0 * quarter_turn.tan());
        }
        Self::hull(&points, bulge_m)
    }

    /// Hull of at most eight points with an area.
    pub(crate) fn hull(points: &[Point2], bulge_m: f64) -> Self {
        let (corners, count) = convex_hull(points);
        let mut sides = [Side::default(); MAX_CORNERS];
        for k in 0..count {
            let edge = corners[(k + 1) % count] - corners[k];
            let normal = Vector2::new(edge.y, -edge.x) / edge.norm();
            sides[k] = Side { normal, offset: normal.dot(&corners[k].coords) };
        }
        let bounds = extent(corners[..count].iter().copied());
        let center = nalgebra::center(&bounds.0, &bounds.1);
        let radius_m = corners[..count].iter().map(|c| (c - center).norm()).fold(0.0, f64::max);
        let discs = cover(&corners[..count], bounds);
        Self { corners, sides, count, discs, center, radius_m, bulge_m }
    }

    /// Middle of the bounding box.
    pub(crate) fn center(&self) -> Point2 {
        self.center
    }

    /// Of the circle about the middle that holds all corners, m.
    pub(crate) fn radius_m(&self) -> f64 {
        self.radius_m
    }

    /// What the shape stands for is within this distance of the polygon, m.
    pub(crate) fn bulge_m(&self) -> f64 {
        self.bulge_m
    }

    /// Discs that together cover the polygon.
    pub(crate) fn discs(&self) -> &[Disc] {
        &self.discs
    }

    /// Whether the polygon and `segment` are further than `reach_m` apart.
    #[inline]
    pub(crate) fn is_clear_of(&self, segment: &Segment, reach_m: f64) -> bool {
        !self.meets_grown(segment, reach_m)
            || (!self.meets_grown(segment, 0.0) && self.squared_distance(segment) > reach_m * reach_m)
    }

    /// Distance between the polygon and `segment`, or `best` if that is smaller, m.
    pub(crate) fn distance_below(&self, segment: &Segment, best: f64) -> f64 {
        let apart = |side: &Side| side.beyond(segment.start).min(side.beyond(segment.end));
        if self.sides().iter().any(|side| apart(side) >= best) {
            return best;
        }
        if self.meets_grown(segment, 0.0) { 0.0 } else { best.min(self.squared_distance(segment).sqrt()) }
    }

    fn sides(&self) -> &[Side] {
        &self.sides[..self.count]
    }

    /// Whether `segment` meets the polygon with every side moved outwards by `reach_m` (corners stay sharp).
    #[inline]
    fn meets_grown(&self, segment: &Segment, reach_m: f64) -> bool {
        let (mut first, mut last) = (0.0_f64, 1.0_f64);
        for side in self.sides() {
            let (start, end) = (side.beyond(segment.start) - reach_m, side.beyond(segment.end) - reach_m);
            if start > 0.0 {
                if end > 0.0 {
                    return false;
                }
                first = first.max(start / (start - end));
            } else if end > 0.0 {
                last = last.min(start / (start - end));
            }
        }
        first <= last
    }

    /// Squared distance of a segment that does not meet the polygon.
    fn squared_distance(&self, segment: &Segment) -> f64 {
        (0..self.count).fold(f64::INFINITY, |best, k| {
            let corner = self.corners[k];
            let edge = Segment::new(corner, self.corners[(k + 1) % self.count]);
            best.min(segment.squared_distance_to_point(corner))
                .min(edge.squared_distance_to_point(segment.start))
                .min(edge.squared_distance_to_point(segment.end))
        })
    }
}

/// Hull of at most eight points, counter-clockwise, by Andrew's chains, without the heap.
fn convex_hull(points: &[Point2]) -> ([Point2; MAX_CORNERS], usize) {
    let mut sorted = [Point2::origin(); MAX_CORNERS];
    let count = points.len().min(MAX_CORNERS);
    sorted[..count].copy_from_slice(&points[..count]);
    let sorted = &mut sorted[..count];
    sorted.sort_unstable_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    // Room for every point once and the leftmost twice.
    let mut hull = [Point2::origin(); MAX_CORNERS + 1];
    let mut len = 0;
    let mut add = |point: Point2, base: usize, len: &mut usize| {
        while *len >= base + 2 {
            let (a, b) = (hull[*len - 2], hull[*len - 1]);
            if (b - a).perp(&(point - a)) > 0.0 {
                break;
            }
            *len -= 1;
        }
        hull[*len] = point;
        *len += 1;
    };
    for &point in sorted.iter() {
        add(point, 0, &mut len);
    }
    let base = len - 1;
    for &point in sorted.iter().rev().skip(1) {
        add(point, base, &mut len);
    }
    let mut corners = [Point2::origin(); MAX_CORNERS];
    corners.copy_from_slice(&hull[..MAX_CORNERS]);
    (corners, len - 1)
}

fn extent(points: impl Iterator<Item = Point2>) -> (Point2, Point2) {
    let far = Point2::new(f64::INFINITY, f64::INFINITY);
    points.fold((far, -far), |(low, high), p| (low.inf(&p), high.sup(&p)))
}

/// Cuts a polygon crosswise into slices of equal length and puts a disc round each.
fn cover(corners: &[Point2], (low, high): (Point2, Point2)) -> [Disc; DISCS] {
    let width = (high.x - low.x) / DISCS as f64;
    std::array::from_fn(|slice| {
        let (from, to) = (low.x + slice as f64 * width, low.x + (slice + 1) as f64 * width);
        let (mut bottom, mut top) = (f64::INFINITY, f64::NEG_INFINITY);
        let mut include = |y: f64| (bottom, top) = (bottom.min(y), top.max(y));
        for (k, a) in corners.iter().enumerate() {
            let b = &corners[(k + 1) % corners.len()];
            if (from..=to).contains(&a.x) {
                include(a.y);
            }
            for x in [from, to] {
                if (a.x < x) != (b.x < x) {
                    include(a.y + (b.y - a.y) * ((x - a.x) / (b.x - a.x)));
                }
            }
        }
        let center = Point2::new(0.5 * (from + to), 0.5 * (bottom + top));
        // A hair more than the slice, for rounding.
        Disc { center, radius_m: (0.5 * width).hypot(0.5 * (top - bottom)) + 1e-9 }
    })
}
