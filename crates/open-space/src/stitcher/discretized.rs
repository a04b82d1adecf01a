//! Trajectories as the provider hands them on: points with an arc length and a time relative to a header, and the
//! questions asked of them.

use motion::Point2;
use motion::pose::normalize_radian;

use crate::pose::PlanarPose;
use crate::tolerance::{SAME_TIME_S, TIME_SLACK_S};
use crate::trajectory::Trajectory;

/// The geometric half of a point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PathPoint {
    /// Pose of the middle of the rear axle.
    pub pose: PlanarPose,
    /// Height, m.
    pub z: f64,
    /// Curvature, positive to the left in both gears, 1/m.
    pub curvature: f64,
    /// Its derivative along the path, 1/m².
    pub curvature_rate: f64,
    /// Its second derivative along the path, 1/m³.
    pub curvature_acceleration: f64,
    /// Arc length, m; where it starts and whether it falls in reverse is said by whoever made the trajectory.
    pub s_m: f64,
}

/// One point of a trajectory.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DiscretizedPoint {
    /// Where; a publisher may have left it out.
    pub path_point: Option<PathPoint>,
    /// Along the heading, negative in reverse, m/s.
    pub speed_mps: f64,
    /// Rate of change of the speed, m/s².
    pub acceleration_mps2: f64,
    /// Rate of change of the acceleration, m/s³.
    pub jerk_mps3: f64,
    /// Angle of the front wheels, positive to the left, rad.
    pub steer_rad: f64,
    /// Time after the header of the trajectory, s; negative in its past.
    pub relative_time_s: f64,
}

impl DiscretizedPoint {
    /// Whether every number in it is finite; a missing path point is.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        let of_path = self.path_point.is_none_or(|p| {
            p.pose.is_finite()
                && [p.z, p.curvature, p.curvature_rate, p.curvature_acceleration, p.s_m]
                    .iter()
                    .all(|number| number.is_finite())
        });
        let own =
            [self.speed_mps, self.acceleration_mps2, self.jerk_mps3, self.steer_rad, self.relative_time_s];
        of_path && own.iter().all(|number| number.is_finite())
    }
}

/// Points in order of time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DiscretizedTrajectory {
    /// The points.
    pub points: Vec<DiscretizedPoint>,
}

/// A trajectory and the time its relative times count from.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PublishedTrajectory {
    /// The points.
    pub trajectory: DiscretizedTrajectory,
    /// Time of the header, s, on the clock that the provider is asked with.
    pub header_time_s: f64,
}

/// A point was to be appended that is not later than the last one.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("a point at {appended_s} s cannot follow one at {last_s} s: times must strictly increase")]
pub struct NotLater {
    /// Time of the refused point, s.
    pub appended_s: f64,
    /// Time of the last point, s.
    pub last_s: f64,
}

impl DiscretizedTrajectory {
    /// A plan as it leaves the planner: arc length from 0 and growing in both gears, times as planned.
    #[must_use]
    pub fn from_plan(plan: &Trajectory) -> Self {
        let mut s_m = 0.0;
        let mut before: Option<PlanarPose> = None;
        let point = |planned: &crate::trajectory::TrajectoryPoint| {
            s_m += before.map_or(0.0, |pose| pose.distance_m(&planned.pose));
            before = Some(planned.pose);
            DiscretizedPoint {
                path_point: Some(PathPoint {
                    pose: planned.pose,
                    curvature: planned.curvature,
                    s_m,
                    ..PathPoint::default()
                }),
                speed_mps: planned.speed_mps,
                acceleration_mps2: planned.acceleration_mps2,
                steer_rad: planned.steer_rad,
                relative_time_s: planned.time_s,
                ..DiscretizedPoint::default()
            }
        };
        Self { points: plan.points.iter().map(point).collect() }
    }

    /// Appends a point.
    ///
    /// # Errors
    /// It is not later than the last one; nothing is appended.
    pub fn append(&mut self, point: DiscretizedPoint) -> Result<(), NotLater> {
        if let Some(last) = self.points.last()
            && (point.relative_time_s <= last.relative_time_s || point.relative_time_s.is_nan())
        {
            return Err(NotLater { appended_s: point.relative_time_s, last_s: last.relative_time_s });
        }
        self.points.push(point);
        Ok(())
    }

    /// From the first point to the last, s; 0 without points.
    #[must_use]
    pub fn temporal_length_s(&self) -> f64 {
        match (self.points.first(), self.points.last()) {
            (Some(first), Some(last)) => last.relative_time_s - first.relative_time_s,
            _ => 0.0,
        }
    }

    /// From the first point to the last along the path, m; 0 without points or where an end has no path point.
    #[must_use]
    pub fn spatial_length_m(&self) -> f64 {
        let end = |point: Option<&DiscretizedPoint>| point?.path_point.map(|p| p.s_m);
        match (end(self.points.first()), end(self.points.last())) {
            (Some(first), Some(last)) => last - first,
            _ => 0.0,
        }
    }

    /// Index of the first point that is not earlier than `time_s` (with a slack of 10 µs), the last one if all are;
    /// `None` without points.
    #[must_use]
    pub fn lower_bound(&self, time_s: f64) -> Option<usize> {
        let last = self.points.len().checked_sub(1)?;
        if time_s >= self.points[last].relative_time_s {
            return Some(last);
        }
        Some(self.points.partition_point(|point| point.relative_time_s + TIME_SLACK_S < time_s).min(last))
    }

    /// Index of the point nearest to a place, of equals the first; points without a path point are passed over.
    #[must_use]
    pub fn nearest(&self, place: Point2) -> Option<usize> {
        let mut best: Option<(usize, f64)> = None;
        for (index, squared_m2) in self.squared_distances(place) {
            if best.is_none_or(|(_, least)| squared_m2 < least) {
                best = Some((index, squared_m2));
            }
        }
        best.map(|(index, _)| index)
    }

    /// As [`Self::nearest`], but a later point that is at most `buffer_m2` farther (in squared distance) than the best
    /// so far takes its place, so that of near-equals the last wins.
    #[must_use]
    pub fn nearest_with_buffer(&self, place: Point2, buffer_m2: f64) -> Option<usize> {
        let mut best: Option<(usize, f64)> = None;
        for (index, squared_m2) in self.squared_distances(place) {
            if best.is_none_or(|(_, least)| squared_m2 < least + buffer_m2) {
                best = Some((index, squared_m2));
            }
        }
        best.map(|(index, _)| index)
    }

    fn squared_distances(&self, place: Point2) -> impl Iterator<Item = (usize, f64)> + '_ {
        self.points.iter().enumerate().filter_map(move |(index, point)| {
            let offset = point.path_point?.pose.point() - place;
            Some((index, offset.norm_squared()))
        })
    }

    /// The point at a time: linear between two points, angles the shorter way round, held beyond the ends; `None`
    /// without points. Between a point with and one without a path point there is none.
    #[must_use]
    pub fn evaluate(&self, time_s: f64) -> Option<DiscretizedPoint> {
        let after = self.points.partition_point(|point| point.relative_time_s < time_s);
        if after == 0 {
            return self.points.first().copied();
        }
        match self.points.get(after) {
            Some(later) => Some(between(&self.points[after - 1], later, time_s)),
            None => self.points.last().copied(),
        }
    }
}

fn between(a: &DiscretizedPoint, b: &DiscretizedPoint, time_s: f64) -> DiscretizedPoint {
    let (t0, t1) = (a.relative_time_s, b.relative_time_s);
    let ratio = if (t1 - t0).abs() <= SAME_TIME_S { 0.0 } else { (time_s - t0) / (t1 - t0) };
    let linear = |from: f64, to: f64| from + (to - from) * ratio;
    let angle = |from: f64, to: f64| interpolated_angle(from, t0, to, t1, time_s);
    DiscretizedPoint {
        path_point: a.path_point.zip(b.path_point).map(|(p, q)| PathPoint {
            pose: PlanarPose::new(
                linear(p.pose.x, q.pose.x),
                linear(p.pose.y, q.pose.y),
                angle(p.pose.yaw, q.pose.yaw),
            ),
            z: linear(p.z, q.z),
            curvature: linear(p.curvature, q.curvature),
            curvature_rate: linear(p.curvature_rate, q.curvature_rate),
            curvature_acceleration: linear(p.curvature_acceleration, q.curvature_acceleration),
            s_m: linear(p.s_m, q.s_m),
        }),
        speed_mps: linear(a.speed_mps, b.speed_mps),
        acceleration_mps2: linear(a.acceleration_mps2, b.acceleration_mps2),
        jerk_mps3: linear(a.jerk_mps3, b.jerk_mps3),
        steer_rad: angle(a.steer_rad, b.steer_rad),
        relative_time_s: time_s,
    }
}

/// Angle at `t` on the shorter way from `a0` at `t0` to `a1` at `t1`, in [-π, π) \[rad\]; `a0` where the times are one.
#[must_use]
pub fn interpolated_angle(a0: f64, t0: f64, a1: f64, t1: f64, t: f64) -> f64 {
    let from = normalize_radian(a0);
    if (t1 - t0).abs() <= SAME_TIME_S {
        return from;
    }
    let turn = normalize_radian(normalize_radian(a1) - from);
    normalize_radian(from + turn * ((t - t0) / (t1 - t0)))
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use proptest::prelude::*;

    use super::*;

    fn point(time_s: f64, x: f64, y: f64) -> DiscretizedPoint {
        DiscretizedPoint {
            path_point: Some(PathPoint { pose: PlanarPose::new(x, y, 0.0), s_m: x, ..PathPoint::default() }),
            speed_mps: x,
            relative_time_s: time_s,
            ..DiscretizedPoint::default()
        }
    }

    fn line() -> DiscretizedTrajectory {
        DiscretizedTrajectory {
            points: (0..=10).map(|i| f64::from(i) * 0.1).map(|t| point(t, t, 0.0)).collect(),
        }
    }

    #[test]
    fn look_up_by_time() {
        for (time_s, index) in [
            (-1.0, 0),
            (0.0, 0),
            (1e-5, 0),
            (1.1e-5, 1),
            (0.25, 3),
            (0.300_009, 3),
            (0.300_02, 4),
            (1.0, 10),
            (99.0, 10),
        ] {
            assert_eq!(line().lower_bound(time_s), Some(index), "{time_s} s");
        }
        assert_eq!(DiscretizedTrajectory::default().lower_bound(0.0), None);
    }

    #[test]
    fn of_equally_near_points_the_first_or_with_a_buffer_the_last() {
        let mut trajectory = line();
        trajectory.points.extend([point(1.1, 0.3, 1e-4), point(1.2, 0.3, 2e-3)]);
        let place = Point2::new(0.3, 0.0);
        assert_eq!(trajectory.nearest(place), Some(3));
        // 1e-8 m² farther is within the buffer, 4e-6 m² is not
        assert_eq!(trajectory.nearest_with_buffer(place, 1e-6), Some(11));
        assert_eq!(trajectory.nearest_with_buffer(place, 0.0), Some(3));
        assert_eq!(DiscretizedTrajectory::default().nearest(place), None);
    }

    #[test]
    fn a_point_without_a_place_is_never_the_nearest() {
        let mut trajectory = line();
        trajectory.points[3].path_point = None;
        assert_ne!(trajectory.nearest(Point2::new(0.3, 0.0)), Some(3));
    }

    #[test]
    fn values_between_and_beyond_points() {
        let trajectory = line();
        let middle = trajectory.evaluate(0.25).unwrap();
        assert!(
            (middle.speed_mps - 0.25).abs() < 1e-12 && (middle.path_point.unwrap().s_m - 0.25).abs() < 1e-12
        );
        assert_eq!(trajectory.evaluate(-5.0), trajectory.points.first().copied());
        assert_eq!(trajectory.evaluate(5.0), trajectory.points.last().copied());
        assert_eq!(DiscretizedTrajectory::default().evaluate(0.0), None);
        let mut gap = line();
        gap.points[3].path_point = None;
        assert_eq!(gap.evaluate(0.25).unwrap().path_point, None);
        assert!((gap.evaluate(0.25).unwrap().speed_mps - 0.25).abs() < 1e-12);
    }

    #[test]
    fn angles_take_the_shorter_way() {
        let at = |t| interpolated_angle(PI - 0.1, 0.0, -PI + 0.1, 1.0, t);
        assert!((at(0.25) - (PI - 0.05)).abs() < 1e-12 && (at(0.75) - (-PI + 0.05)).abs() < 1e-12);
        assert_eq!(interpolated_angle(7.0, 1.0, 1.0, 1.0 + 1e-11, 1.0), normalize_radian(7.0));
    }

    #[test]
    fn lengths_and_appending() {
        let mut trajectory = line();
        assert!((trajectory.temporal_length_s() - 1.0).abs() < 1e-12);
        assert!((trajectory.spatial_length_m() - 1.0).abs() < 1e-12);
        assert_eq!(DiscretizedTrajectory::default().temporal_length_s(), 0.0);
        for time_s in [1.0, 0.5, f64::NAN] {
            assert!(trajectory.append(point(time_s, 2.0, 0.0)).is_err(), "{time_s}");
        }
        trajectory.append(point(1.1, 2.0, 0.0)).unwrap();
        assert_eq!(trajectory.points.len(), 12);
    }

    proptest! {
        #[test]
        fn the_lower_bound_is_the_first_that_is_not_earlier(
            gaps in prop::collection::vec(0.0..0.5_f64, 1..40), time_s in -1.0..12.0_f64,
        ) {
            let mut now = 0.0;
            let points: Vec<_> = gaps.iter().map(|gap| { now += gap; point(now, 0.0, 0.0) }).collect();
            let found = DiscretizedTrajectory { points: points.clone() }.lower_bound(time_s).unwrap();
            let by_scan = points
                .iter()
                .position(|p| p.relative_time_s + 1e-5 >= time_s)
                .filter(|_| time_s < points[points.len() - 1].relative_time_s)
                .unwrap_or(points.len() - 1);
            prop_assert_eq!(found, by_scan);
        }

        #[test]
        fn evaluation_meets_every_point(gaps in prop::collection::vec(0.01..0.5_f64, 1..30)) {
            let mut now = 0.0;
            let points: Vec<_> = gaps.iter().map(|gap| { now += gap; point(now, gap * 3.0, *gap) }).collect();
            let trajectory = DiscretizedTrajectory { points };
            for p in &trajectory.points {
                let found = trajectory.evaluate(p.relative_time_s).unwrap();
                prop_assert!((found.speed_mps - p.speed_mps).abs() < 1e-12);
                prop_assert!((found.path_point.unwrap().pose.x - p.path_point.unwrap().pose.x).abs() < 1e-12);
            }
        }
    }
}
