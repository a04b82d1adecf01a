//! The part of a candidate that is held against stop lines.
//!
//! It begins at the first point that is not in the past, and ends with the first point beyond the look-ahead or at
//! which the vehicle is planned to stand, whichever comes first; that point belongs to it. A candidate that stands at
//! its first point only has not begun yet, so the first point never is the stop. From the last point the front bumper
//! sticks out along the vehicle.

use super::route_lights::StopLine;
use motion::trajectory::Posed;
use motion::{AxisAlignedBox, Point2, Segment, TrajectoryPoint};

/// The checked part of a candidate, seen from above.
#[derive(Debug)]
pub(super) struct CheckedPath<'a> {
    /// Its points, at least two.
    points: &'a [TrajectoryPoint],
    /// Index of the first of them in the candidate.
    first_index: usize,
    /// Arc length from the first point to each point, m.
    lengths_m: &'a [f64],
    /// Length of what lies before it, in the past, m. The gap between the two parts is in neither.
    backward_length_m: f64,
    /// Front bumper at the last point, if it is ahead of the pose.
    bumper: Option<Point2>,
    /// Whether the last point is a planned stop.
    stops: bool,
    extent: AxisAlignedBox,
}

/// How much of the path is looked at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Reach {
    /// Up to the last pose.
    LastPose,
    /// Up to the front bumper at the last pose.
    Bumper,
}

/// Where the path first meets a stop line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Crossing {
    /// The place.
    pub place: Point2,
    /// Arc length from the first point, m.
    pub distance_m: f64,
    /// Index of the point of the path from which the crossing piece starts.
    from: usize,
    /// Length from that point to the place, m.
    beyond_m: f64,
}

/// The vehicle reaching a place with its front bumper.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Arrival {
    /// Index of the point of the candidate at or just before it.
    pub index: usize,
    /// Time from the start of the candidate, s.
    pub time_s: f64,
}

/// Number of leading points in the past. Times never decrease, so they are a prefix.
fn past(points: &[TrajectoryPoint]) -> usize {
    points.iter().take_while(|point| point.time_from_start.nanos() < 0).count()
}

fn distance_m(from: &TrajectoryPoint, to: &TrajectoryPoint) -> f64 {
    (to.point() - from.point()).norm()
}

/// Whether anything of a candidate is left to check: at least two points that are not in the past.
pub(super) fn has_future(points: &[TrajectoryPoint]) -> bool {
    points.len() >= 2 && points[points.len() - 2].time_from_start.nanos() >= 0
}

impl<'a> CheckedPath<'a> {
    /// The checked part of a candidate, `None` if that is fewer than two points.
    ///
    /// * `lengths_m`: buffer for the arc lengths.
    /// * `look_ahead_m`: length beyond which nothing is checked.
    /// * `stop_speed_mps`: a point this slow or slower, or in reverse, is a planned stop.
    /// * `front_offset_m`: front bumper ahead of the pose.
    pub(super) fn new(
        candidate: &'a [TrajectoryPoint],
        lengths_m: &'a mut Vec<f64>,
        look_ahead_m: f64,
        stop_speed_mps: f64,
        front_offset_m: f64,
    ) -> Option<Self> {
        if !has_future(candidate) {
            return None;
        }
        let first_index = past(candidate);
        let (past, future) = candidate.split_at(first_index);
        let mut previous = future[0].point();
        let mut extent = AxisAlignedBox::around([previous]);
        let (mut length_m, mut stops) = (0.0, false);
        lengths_m.clear();
        lengths_m.push(0.0);
        for point in &future[1..] {
            let place = point.point();
            length_m += (place - previous).norm();
            lengths_m.push(length_m);
            extent = extent.with(place);
            previous = place;
            stops = length_m > 0.0 && f64::from(point.longitudinal_velocity_mps) <= stop_speed_mps;
            if stops || length_m > look_ahead_m {
                break;
            }
        }
        let points = &future[..lengths_m.len()];
        let heading = points[points.len() - 1].pose.heading();
        let bumper = (front_offset_m > 0.0).then(|| previous + heading * front_offset_m);
        let extent = bumper.map_or(extent, |bumper| extent.with(bumper));
        let backward_length_m = past.windows(2).map(|pair| distance_m(&pair[0], &pair[1])).sum();
        Some(Self { points, first_index, lengths_m, backward_length_m, bumper, stops, extent })
    }

    /// Length of the candidate's part in the past, m.
    pub(super) fn backward_length_m(&self) -> f64 {
        self.backward_length_m
    }

    /// The first point.
    pub(super) fn first(&self) -> &TrajectoryPoint {
        &self.points[0]
    }

    /// Whether the candidate plans to stand at the end of the path.
    pub(super) fn stops(&self) -> bool {
        self.stops
    }

    /// Whether the candidate plans to stand with its front at most this far from a line, on either side.
    pub(super) fn stops_within(&self, line: &StopLine, margin_m: f64) -> bool {
        let place = self.bumper.unwrap_or_else(|| self.points[self.points.len() - 1].point());
        self.stops && line.distance_m(place) <= margin_m
    }

    /// Where the path first meets a line.
    pub(super) fn crossing(&self, line: &StopLine, reach: Reach) -> Option<Crossing> {
        if !self.extent.overlaps(line.extent()) {
            return None;
        }
        let bumper = self.bumper.filter(|_| reach == Reach::Bumper);
        let mut start = self.points[0].point();
        for (from, end) in self.points[1..].iter().map(Posed::point).chain(bumper).enumerate() {
            if let Some(place) = line.first_contact(&Segment::new(start, end)) {
                let beyond_m = (place - start).norm();
                let distance_m = self.lengths_m[from] + beyond_m;
                return Some(Crossing { place, distance_m, from, beyond_m });
            }
            start = end;
        }
        None
    }

    /// Time and speed with which the pose reaches a crossing: the time interpolated on the crossing piece, the speed of
    /// the point before it. \[s, m/s\]
    pub(super) fn time_and_speed(&self, crossing: &Crossing) -> (f64, f64) {
        let start = &self.points[crossing.from];
        let time_s = self.time_at(crossing.from, crossing.beyond_m);
        (time_s, f64::from(start.longitudinal_velocity_mps))
    }

    /// When the front bumper reaches a crossing; at once if it is past it already.
    pub(super) fn front_arrival(&self, crossing: &Crossing, front_offset_m: f64) -> Arrival {
        let driven_m = (crossing.distance_m - front_offset_m).max(0.0);
        let reached = self.lengths_m.partition_point(|length_m| *length_m <= driven_m);
        let from = reached.saturating_sub(1);
        Arrival {
            index: self.first_index + from,
            time_s: self.time_at(from, driven_m - self.lengths_m[from]),
        }
    }

    /// Time at a length beyond a point; that of the point where the piece after it has no length or is the bumper.
    fn time_at(&self, from: usize, beyond_m: f64) -> f64 {
        let start = &self.points[from];
        let start_s = start.time_from_start.seconds();
        let Some(end) = self.points.get(from + 1) else { return start_s };
        let piece_m = distance_m(start, end);
        let ratio = if piece_m > 0.0 { (beyond_m / piece_m).min(1.0) } else { 0.0 };
        start_s + ratio * (end.time_from_start.seconds() - start_s)
    }
}
