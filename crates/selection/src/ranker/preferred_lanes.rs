//! The lanelets that the route prefers, as the lateral deviation needs them. Made when map or route change.

use lanelet_map::{Lanelet, Map, Polyline};
use messages::autoware_planning_msgs::LaneletRoute;
use motion::geometry::polygon_contains;
use motion::pose::{azimuth, normalize_radian};
use motion::{Point2, Pose, Segment};

/// Greatest step between the points of a centerline that is made because the map has none \[m\].
const CENTERLINE_STEP_M: f64 = 0.5;

/// The lanelets that the route prefers.
#[derive(Debug, Default)]
pub struct PreferredLanes {
    lanes: Vec<Lane>,
}

#[derive(Debug)]
struct Lane {
    /// Left bound, then the right bound backwards.
    outline: Vec<Point2>,
    centerline: Vec<Point2>,
}

impl PreferredLanes {
    /// The preferred lanelet of every segment of the route. One that is not in the map is left out.
    #[must_use]
    pub fn along(map: &Map, route: &LaneletRoute) -> Self {
        let ids = route.segments.iter().map(|segment| segment.preferred_primitive.id);
        Self { lanes: ids.filter_map(|id| map.lanelet(id)).map(|lanelet| Lane::of(&lanelet)).collect() }
    }

    /// Distance of a place from the centerline of the nearest lanelet \[m\]; of several lanelets at the same distance,
    /// that whose direction fits the pose best. `None` without lanelets.
    #[must_use]
    pub fn lateral_deviation_m(&self, pose: &Pose) -> Option<f64> {
        let point = pose.point();
        let mut nearest: Option<(&Lane, f64)> = None;
        for lane in &self.lanes {
            let squared = lane.squared_distance(point);
            let is_better = nearest.is_none_or(|(best, best_squared)| {
                squared < best_squared
                    || (squared == best_squared && lane.yaw_deviation(pose) < best.yaw_deviation(pose))
            });
            if is_better {
                nearest = Some((lane, squared));
            }
        }
        Some(nearest?.0.nearest_segment(point)?.distance_to_point(point))
    }
}

impl Lane {
    fn of(lanelet: &Lanelet<'_>) -> Self {
        let stored = lanelet.centerline().map(points).filter(|line| line.len() > 1);
        let middle = || middle_line(&points(lanelet.left()), &points(lanelet.right()));
        let outline = lanelet.outline().map(|[x, y, _]| Point2::new(x, y)).collect();
        Self { outline, centerline: stored.unwrap_or_else(middle) }
    }

    /// Squared distance to the lanelet, 0 inside.
    fn squared_distance(&self, point: Point2) -> f64 {
        if polygon_contains(&self.outline, point) {
            return 0.0;
        }
        let closing =
            self.outline.last().zip(self.outline.first()).map(|(&end, &start)| Segment::new(end, start));
        segments(&self.outline)
            .chain(closing)
            .map(|segment| segment.squared_distance_to_point(point))
            .fold(f64::INFINITY, f64::min)
    }

    fn nearest_segment(&self, point: Point2) -> Option<Segment> {
        let distance = |segment: &Segment| segment.squared_distance_to_point(point);
        segments(&self.centerline).min_by(|a, b| distance(a).total_cmp(&distance(b)))
    }

    fn yaw_deviation(&self, pose: &Pose) -> f64 {
        self.nearest_segment(pose.point()).map_or(std::f64::consts::PI, |segment| {
            normalize_radian(azimuth(segment.start, segment.end) - pose.yaw()).abs()
        })
    }
}

fn points(line: Polyline<'_>) -> Vec<Point2> {
    line.positions().map(|[x, y, _]| Point2::new(x, y)).collect()
}

fn segments(line: &[Point2]) -> impl Iterator<Item = Segment> + '_ {
    line.windows(2).map(|pair| Segment::new(pair[0], pair[1]))
}

fn length(line: &[Point2]) -> f64 {
    segments(line).map(|segment| segment.length()).sum()
}

/// Points half-way between points at the same share of both borders' lengths.
fn middle_line(left: &[Point2], right: &[Point2]) -> Vec<Point2> {
    let steps = (length(left).max(length(right)) / CENTERLINE_STEP_M).ceil().max(1.0) as usize;
    let shares = (0..=steps).map(|step| step as f64 / steps as f64);
    let middle = |share| {
        let (left, right) = (at_share(left, share)?, at_share(right, share)?);
        Some(left + (right - left) * 0.5)
    };
    shares.filter_map(middle).collect()
}

fn at_share(line: &[Point2], share: f64) -> Option<Point2> {
    let mut rest = length(line) * share;
    for segment in segments(line) {
        let length = segment.length();
        if rest <= length && length > 0.0 {
            return Some(segment.start + segment.vector() * (rest / length));
        }
        rest -= length;
    }
    line.last().copied()
}

#[cfg(test)]
mod tests {
    use super::*;
    use lanelet_map::MapBuilder;
    use messages::autoware_planning_msgs::{LaneletPrimitive, LaneletSegment};

    /// Two lanelets of 4 m width, one behind the other along x; over the second a third one across, along y.
    fn map(with_centerline: bool) -> Map {
        let mut builder = MapBuilder::new();
        let lines: [(i64, [(f64, f64); 2]); 7] = [
            (11, [(0.0, 2.0), (50.0, 2.0)]),
            (12, [(0.0, -2.0), (50.0, -2.0)]),
            (21, [(50.0, 2.0), (100.0, 2.0)]),
            (22, [(50.0, -2.0), (100.0, -2.0)]),
            (31, [(68.0, -50.0), (68.0, 50.0)]),
            (32, [(72.0, -50.0), (72.0, 50.0)]),
            (41, [(0.0, 1.0), (50.0, 1.0)]),
        ];
        for (id, ends) in lines {
            for (index, (x, y)) in (0..).zip(ends) {
                builder.point(id * 10 + index, [x, y, 0.0], &[]).unwrap();
            }
            builder.line_string(id, &[id * 10, id * 10 + 1], &[]).unwrap();
        }
        for lanelet in [1, 2, 3] {
            builder.lanelet(lanelet, lanelet * 10 + 1, lanelet * 10 + 2, &[("subtype", "road")]).unwrap();
        }
        if with_centerline {
            builder.centerline(1, 41).unwrap();
        }
        builder.build().unwrap()
    }

    fn lanes(with_centerline: bool, ids: &[i64]) -> PreferredLanes {
        let segment = |&id: &i64| LaneletSegment {
            preferred_primitive: LaneletPrimitive { id, ..LaneletPrimitive::default() },
            ..LaneletSegment::default()
        };
        let route = LaneletRoute { segments: ids.iter().map(segment).collect(), ..LaneletRoute::default() };
        PreferredLanes::along(&map(with_centerline), &route)
    }

    #[track_caller]
    fn check(lanes: &PreferredLanes, pose: (f64, f64, f64), expected_m: f64) {
        let found = lanes.lateral_deviation_m(&Pose::from_xy_yaw(pose.0, pose.1, pose.2)).unwrap();
        assert!((found - expected_m).abs() < 1e-9, "{found} at {pose:?}");
    }

    #[test]
    fn distance_from_the_middle_of_the_nearest_lanelet() {
        let lanes = lanes(false, &[1, 2]);
        check(&lanes, (10.0, 0.0, 0.0), 0.0);
        check(&lanes, (10.0, 1.5, 0.0), 1.5);
        check(&lanes, (10.0, -5.0, 0.0), 5.0);
        check(&lanes, (60.0, 0.25, 0.0), 0.25);
        check(&lanes, (-3.0, 4.0, 0.0), 5.0);
    }

    #[test]
    fn the_maps_own_centerline_counts() {
        check(&lanes(true, &[1, 2]), (10.0, 0.0, 0.0), 1.0);
    }

    #[test]
    fn of_overlapping_lanelets_the_one_in_the_direction_of_the_pose_counts() {
        let lanes = lanes(false, &[1, 2, 3]);
        check(&lanes, (71.0, 0.5, 0.1), 0.5);
        check(&lanes, (71.0, 0.5, 1.5), 1.0);
    }

    #[test]
    fn without_lanelets_there_is_no_deviation() {
        assert_eq!(lanes(false, &[]).lateral_deviation_m(&Pose::default()), None);
        assert_eq!(lanes(false, &[99]).lateral_deviation_m(&Pose::default()), None, "not in the map");
    }
}
