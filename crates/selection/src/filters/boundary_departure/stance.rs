//! Where the vehicle's corners are at each point of a candidate.

use motion::footprint::Footprint;
use motion::{Point2, Segment, TrajectoryPoint};

use super::tolerance::FARTHEST_M;

/// A side of the vehicle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Side {
    Left,
    Right,
}

impl Side {
    pub(super) const BOTH: [Self; 2] = [Self::Left, Self::Right];
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
    /// No part of the vehicle has moved farther than this since the first point: the sum over the steps of the largest
    /// movement of a corner.
    pub(super) moved_m: f64,
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
    let mut before: Option<(Point2, Stance)> = None;
    out.extend(points.iter().map(|point| {
        let placed = outline.placed_at(&point.pose);
        let position = point.pose.point();
        let mut stance = Stance {
            front_left: placed.front_left(),
            front_right: placed.front_right(),
            rear_left: placed.rear_left(),
            rear_right: placed.rear_right(),
            z_m: point.pose.position.z,
            along_m: 0.0,
            time_s: point.time_from_start.seconds(),
            moved_m: 0.0,
        };
        let corners = stance.corners();
        in_range &= corners.iter().all(|corner| corner.x.abs() < FARTHEST_M && corner.y.abs() < FARTHEST_M);
        if let Some((from, last)) = before {
            let steps = corners.iter().zip(last.corners()).map(|(to, from)| (to - from).norm_squared());
            stance.moved_m = last.moved_m + steps.fold(0.0, f64::max).sqrt();
            stance.along_m = last.along_m + (position - from).norm();
        }
        before = Some((position, stance));
        stance
    }));
    in_range
}
