//! The HD map of the generated road and a route on it, with the elements and names that Autoware's maps have.

use super::road::{ELEVATION_M, Road, Track};
use lanelet_map::{Bound, Map, MapBuilder, MapError, Member};
use messages::autoware_planning_msgs::{LaneletPrimitive, LaneletRoute, LaneletSegment};
use messages::std_msgs::Header;
use messages::unique_identifier_msgs::Uuid;

/// Length of the road.
pub(crate) const ROAD_LENGTH_M: f64 = LANELETS as f64 * LANELET_LENGTH_M;
/// Width of each of the two lanes.
pub(crate) const LANE_WIDTH_M: f64 = 3.5;
/// Front of a vehicle that waits at the crosswalk must not pass this.
pub(crate) const CROSSWALK_STOP_LINE_S_M: f64 = 104.0;
/// Same for oncoming vehicles.
pub(crate) const ONCOMING_STOP_LINE_S_M: f64 = 112.0;
/// Middle of the crosswalk.
pub(crate) const CROSSWALK_S_M: f64 = 108.0;
/// Stop line of the traffic light.
pub(crate) const LIGHT_STOP_LINE_S_M: f64 = 130.0;
/// Id of the traffic light, as the signals name it.
pub(crate) const LIGHT_RULE: i64 = 500;

/// Middle of the street that crosses, where there is one.
pub(crate) const CROSSING_S_M: f64 = 150.0;
/// How far it reaches to both sides.
const CROSSING_REACH_M: f64 = 80.0;

const LANELETS: i64 = 18;
const LANELET_LENGTH_M: f64 = 25.0;
const POINT_DISTANCE_M: f64 = 5.0;
const CROSSWALK_HALF_LENGTH_M: f64 = 4.0;
const CROSSWALK_HALF_WIDTH_M: f64 = 2.0;
/// Lanelet on which crosswalk and stop line lie.
const CROSSWALK_AT: i64 = 4;
/// Lanelet on which the light's stop line lies.
const LIGHT_AT: i64 = 5;
/// First and last lanelet of the route.
const ROUTE: std::ops::RangeInclusive<i64> = 2..=16;

// Ids: one range for each kind.
const FORWARD: i64 = 100;
const ONCOMING: i64 = 200;
const CROSSWALK: i64 = 300;
const CROSSWALK_POLYGON: i64 = 301;
const CROSSWALK_RULE: i64 = 400;
const RIGHT_BORDER: i64 = 1000;
const MIDDLE: i64 = 1100;
const LEFT_BORDER: i64 = 1200;
const FORWARD_CENTERLINE: i64 = 1300;
const ONCOMING_CENTERLINE: i64 = 1400;
const CROSSWALK_LEFT: i64 = 1500;
const CROSSWALK_RIGHT: i64 = 1501;
const CROSSWALK_STOP_LINE: i64 = 1502;
const ONCOMING_STOP_LINE: i64 = 1503;
const LIGHT_STOP_LINE: i64 = 1510;
const LIGHT: i64 = 1511;
const LIGHT_BULBS: i64 = 1512;
const CROSSING: i64 = 600;
const CROSSING_BOUND: i64 = 1600;
const FIRST_POINT: i64 = 10_000;

const ROAD_ATTRIBUTES: &[(&str, &str)] = &[
    ("type", "lanelet"),
    ("subtype", "road"),
    ("location", "urban"),
    ("one_way", "yes"),
    ("participant:vehicle", "yes"),
    ("speed_limit", "40"),
];

/// Adds elements to the map under construction.
struct Draft<'r> {
    road: &'r Road,
    builder: MapBuilder,
    next_point: i64,
}

impl Draft<'_> {
    fn point(
        &mut self,
        s_m: f64,
        offset_m: f64,
        height_m: f64,
        attributes: &[(&str, &str)],
    ) -> Result<i64, MapError> {
        let id = self.next_point;
        self.next_point += 1;
        let [x, y] = self.road.position(s_m, offset_m);
        self.builder.point(id, [x, y, ELEVATION_M + height_m], attributes)?;
        Ok(id)
    }

    /// A straight line on the ground between two places, each `s` and offset.
    fn line(&mut self, id: i64, ends: [(f64, f64); 2], attributes: &[(&str, &str)]) -> Result<(), MapError> {
        let points =
            [self.point(ends[0].0, ends[0].1, 0.0, &[])?, self.point(ends[1].0, ends[1].1, 0.0, &[])?];
        self.builder.line_string(id, &points, attributes)
    }

    /// A line along the whole road, one line string for each lanelet; neighbours share their end point.
    fn strip(&mut self, first_id: i64, offset_m: f64, attributes: &[(&str, &str)]) -> Result<(), MapError> {
        let per_lanelet = (LANELET_LENGTH_M / POINT_DISTANCE_M) as usize;
        let count = per_lanelet * LANELETS as usize + 1;
        let points = (0..count)
            .map(|index| self.point(index as f64 * POINT_DISTANCE_M, offset_m, 0.0, &[]))
            .collect::<Result<Vec<_>, _>>()?;
        for (id, start) in (first_id..).zip((0..count - 1).step_by(per_lanelet)) {
            self.builder.line_string(id, &points[start..=start + per_lanelet], attributes)?;
        }
        Ok(())
    }

    fn lanes(&mut self) -> Result<(), MapError> {
        self.strip(RIGHT_BORDER, -LANE_WIDTH_M, &[("type", "road_border")])?;
        self.strip(MIDDLE, 0.0, &[("type", "line_thin"), ("subtype", "dashed")])?;
        self.strip(LEFT_BORDER, LANE_WIDTH_M, &[("type", "road_border")])?;
        self.strip(FORWARD_CENTERLINE, -LANE_WIDTH_M / 2.0, &[])?;
        self.strip(ONCOMING_CENTERLINE, LANE_WIDTH_M / 2.0, &[])?;
        for at in 0..LANELETS {
            self.builder.lanelet(FORWARD + at, MIDDLE + at, RIGHT_BORDER + at, ROAD_ATTRIBUTES)?;
            self.builder.centerline(FORWARD + at, FORWARD_CENTERLINE + at)?;
            let [left, right] = [MIDDLE + at, LEFT_BORDER + at].map(Bound::inverted);
            self.builder.lanelet(ONCOMING + at, left, right, ROAD_ATTRIBUTES)?;
            self.builder.centerline(ONCOMING + at, Bound::inverted(ONCOMING_CENTERLINE + at))?;
        }
        Ok(())
    }

    fn stop_line(&mut self, id: i64, s_m: f64, offsets_m: [f64; 2]) -> Result<(), MapError> {
        self.line(
            id,
            offsets_m.map(|offset_m| (s_m, offset_m)),
            &[("type", "stop_line"), ("subtype", "solid")],
        )
    }

    fn crosswalk(&mut self) -> Result<(), MapError> {
        let marking = [("type", "pedestrian_marking")];
        let mut corners = Vec::new();
        // Walked from right to left, so that smaller s is on the left.
        for (id, side) in [(CROSSWALK_LEFT, -1.0), (CROSSWALK_RIGHT, 1.0)] {
            let s_m = CROSSWALK_S_M + side * CROSSWALK_HALF_WIDTH_M;
            self.line(id, [-1.0, 1.0].map(|end| (s_m, end * CROSSWALK_HALF_LENGTH_M)), &marking)?;
            corners.push([self.next_point - 2, self.next_point - 1]);
        }
        let attributes = [
            ("type", "lanelet"),
            ("subtype", "crosswalk"),
            ("location", "urban"),
            ("one_way", "no"),
            ("participant:pedestrian", "yes"),
        ];
        self.builder.lanelet(CROSSWALK, CROSSWALK_LEFT, CROSSWALK_RIGHT, &attributes)?;
        let ring = [corners[0][0], corners[0][1], corners[1][1], corners[1][0]];
        self.builder.polygon(CROSSWALK_POLYGON, &ring, &[("type", "crosswalk_polygon"), ("area", "yes")])?;
        self.stop_line(CROSSWALK_STOP_LINE, CROSSWALK_STOP_LINE_S_M, [-LANE_WIDTH_M, -0.1])?;
        self.stop_line(ONCOMING_STOP_LINE, ONCOMING_STOP_LINE_S_M, [0.1, LANE_WIDTH_M])?;
        let members = [
            ("refers", Member::Lanelet(CROSSWALK)),
            ("crosswalk_polygon", Member::Polygon(CROSSWALK_POLYGON)),
            ("ref_line", Member::LineString(CROSSWALK_STOP_LINE)),
            ("ref_line", Member::LineString(ONCOMING_STOP_LINE)),
        ];
        self.rule(CROSSWALK_RULE, &members, "crosswalk", &[FORWARD + CROSSWALK_AT, ONCOMING + CROSSWALK_AT])
    }

    fn traffic_light(&mut self) -> Result<(), MapError> {
        self.stop_line(LIGHT_STOP_LINE, LIGHT_STOP_LINE_S_M, [-LANE_WIDTH_M, -0.1])?;
        // On a pole behind the stop line, right of the road, facing traffic.
        let (s_m, left_m, right_m, height_m) = (LIGHT_STOP_LINE_S_M + 6.0, -4.0, -5.2, 4.8);
        let base = [self.point(s_m, left_m, height_m, &[])?, self.point(s_m, right_m, height_m, &[])?];
        let attributes = [("type", "traffic_light"), ("subtype", "red_yellow_green"), ("height", "0.45")];
        self.builder.line_string(LIGHT, &base, &attributes)?;
        let mut bulbs = Vec::new();
        for (color, offset_m) in [("green", -4.2), ("yellow", -4.6), ("red", -5.0)] {
            bulbs.push(self.point(s_m, offset_m, height_m + 0.225, &[("color", color)])?);
        }
        let light = LIGHT.to_string();
        let attributes = [("type", "light_bulbs"), ("traffic_light_id", light.as_str())];
        self.builder.line_string(LIGHT_BULBS, &bulbs, &attributes)?;
        let members = [
            ("refers", Member::LineString(LIGHT)),
            ("ref_line", Member::LineString(LIGHT_STOP_LINE)),
            ("light_bulbs", Member::LineString(LIGHT_BULBS)),
        ];
        self.rule(LIGHT_RULE, &members, "traffic_light", &[FORWARD + LIGHT_AT])
    }

    /// A street with one lane to each side that crosses the road at a right angle.
    fn crossing(&mut self) -> Result<(), MapError> {
        let reach_m = CROSSING_REACH_M;
        for (line, side) in (CROSSING_BOUND..).zip([-1.0, 0.0, 1.0]) {
            let s_m = CROSSING_S_M + side * LANE_WIDTH_M;
            self.line(line, [(s_m, -reach_m), (s_m, reach_m)], &[("type", "line_thin")])?;
        }
        // To the left of the road on the far side, to the right on the near side.
        self.builder.lanelet(CROSSING, CROSSING_BOUND + 1, CROSSING_BOUND + 2, ROAD_ATTRIBUTES)?;
        let [left, right] = [CROSSING_BOUND + 1, CROSSING_BOUND].map(Bound::inverted);
        self.builder.lanelet(CROSSING + 1, left, right, ROAD_ATTRIBUTES)
    }

    fn rule(
        &mut self,
        id: i64,
        members: &[(&str, Member)],
        subtype: &str,
        lanelets: &[i64],
    ) -> Result<(), MapError> {
        let attributes = [("type", "regulatory_element"), ("subtype", subtype)];
        self.builder.regulatory_element(id, members, &attributes)?;
        lanelets.iter().try_for_each(|lanelet| self.builder.attach(*lanelet, id))
    }
}

/// The map of the road.
///
/// # Errors
/// None that can happen: the ids above are unique, and every element is added before it is named.
pub(crate) fn build(road: &Road, with_crossing: bool) -> Result<Map, MapError> {
    let mut draft = Draft { road, builder: MapBuilder::new(), next_point: FIRST_POINT };
    draft.lanes()?;
    draft.crosswalk()?;
    draft.traffic_light()?;
    if with_crossing {
        draft.crossing()?;
    }
    draft.builder.build()
}

/// The way along the road in the forward lane.
pub(crate) fn route(road: &Road, header: Header) -> LaneletRoute {
    let lane = Track::forward(-LANE_WIDTH_M / 2.0);
    let end = |lanelet: i64| road.pose(&lane, (lanelet as f64 + 0.5) * LANELET_LENGTH_M);
    let segment = |at: i64| {
        let lane = LaneletPrimitive { id: FORWARD + at, primitive_type: "lane".to_owned() };
        LaneletSegment { preferred_primitive: lane.clone(), primitives: vec![lane] }
    };
    LaneletRoute {
        header,
        start_pose: end(*ROUTE.start()),
        goal_pose: end(*ROUTE.end()),
        segments: ROUTE.map(segment).collect(),
        uuid: Uuid { uuid: *b"generated  route" },
        allow_modification: false,
    }
}
