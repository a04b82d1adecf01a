//! Where the vehicle's corners are at each point of a candidate.

use motion::footprint::Footprint;
use motion::{Point2, Segment, TrajectoryPoint};

use super::bounds::Bounds;
use super::tolerance::FARTHEST_M;

/// A side of the vehicle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Side {
    Left,
    Right,
}

impl Side {
    pub(super) const BOTH: [Self; 2] = [Self::Left, Self::Right];

    pub(super) fn other(self) -> Self {
        match self {
            Self::Left => Self::Right,
            Self::Right => Self::Left,
        }
    }
}

/// The vehicle at one point of a candidate.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stance {
    pub(super) front_left: Point2,
    pub(super) front_right: Point2,
    pub(super) rear_left: Point2,
    pub(super) rear_right: Point2,
    /// Height of the ground.
    pub(super) z_m: f64,
    /// Length of the path from the first point.
    pub(super) along_m: f64,
    pub(super) time_s: f64,
    /// The box around the vehicle, along its left side.
    pub(super) bounds: Bounds,
}

impl Stance {
    /// From the front to the rear corner of a side.
    #[inline]
    pub(super) fn side(&self, side: Side) -> Segment {
        match side {
            Side::Left => Segment::new(self.front_left, self.rear_left),
            Side::Right => Segment::new(self.front_right, self.rear_right),
        }
    }

    /// From the left to the right front corner.
    #[inline]
    pub(super) fn front_edge(&self) -> Segment {
        Segment::new(self.front_left, self.front_right)
    }

    /// From the left to the right rear corner.
    #[inline]
    pub(super) fn rear_edge(&self) -> Segment {
        Segment::new(self.rear_left, self.rear_right)
    }

    #[inline]
    pub(super) fn corners(&self) -> [Point2; 4] {
        [self.front_left, self.front_right, self.rear_left, self.rear_right]
    }
}

/// Places the vehicle at every point; `outline` is in base_link, `out` is overwritten. False if a corner is so far out
/// that it is on no map.
pub(super) fn stances_along(points: &[TrajectoryPoint], outline: &Footprint, out: &mut Vec<Stance>) -> bool {
    out.clear();
    let mut in_range = true;
    let (mut along_m, mut before) = (0.0, points.first().map(|point| point.pose.point()));
    out.extend(points.iter().map(|point| {
        let position = point.pose.point();
        along_m += before.map_or(0.0, |before| (position - before).norm());
        before = Some(position);
        let placed = outline.placed_at(&point.pose);
        let corners = [placed.front_left(), placed.front_right(), placed.rear_left(), placed.rear_right()];
        let is_on_map = |corner: &Point2| corner.x.abs() < FARTHEST_M && corner.y.abs() < FARTHEST_M;
        in_range &= corners.iter().all(is_on_map);
        let mut bounds = Bounds::at(corners[0], corners[0] - corners[2]);
        for corner in &corners[1..] {
            bounds.include(*corner);
        }
        Stance {
            front_left: corners[0],
            front_right: corners[1],
            rear_left: corners[2],
            rear_right: corners[3],
            z_m: point.pose.position.z,
            along_m,
            time_s: point.time_from_start.seconds(),
            bounds,
        }
    }));
    in_range
}
