//! Which lights belong to a route, and what the map says about them.

use super::*;
use lanelet_map::{MapBuilder, Member};
use messages::autoware_planning_msgs::{LaneletPrimitive, LaneletSegment};
use proptest::prelude::*;

fn route(ids: &[i64]) -> LaneletRoute {
    let segment = |id: &i64| LaneletSegment {
        preferred_primitive: LaneletPrimitive { id: *id, primitive_type: "lane".to_owned() },
        primitives: vec![LaneletPrimitive { id: 99, primitive_type: "lane".to_owned() }],
    };
    LaneletRoute { segments: ids.iter().map(segment).collect(), ..LaneletRoute::default() }
}

/// Lanelets 11 (turns left) and 12 (turns right) with points 1 to 4 and a stop line 5 of points 1 and 4.
fn builder() -> MapBuilder {
    let mut builder = MapBuilder::new();
    let places = [[0.0, 0.0, 0.0], [10.0, 0.0, 0.0], [0.0, 3.0, 0.0], [10.0, 3.0, 0.0]];
    for (id, place) in (1..).zip(places) {
        let attributes: &[_] = if id == 3 { &[("color", "green"), ("arrow", "up")] } else { &[] };
        builder.point(id, place, attributes).unwrap();
    }
    for (id, points) in [(5, [1, 4]), (6, [1, 2]), (7, [3, 4]), (8, [1, 2])] {
        let subtype = if id == 6 { "red_yellow_green" } else { "left_arrow_red" };
        builder.line_string(id, &points, &[("type", "stop_line"), ("subtype", subtype)]).unwrap();
    }
    builder.line_string(9, &[], &[]).unwrap();
    builder.line_string(10, &[4], &[]).unwrap();
    for (id, turn) in [(11, "left"), (12, "right"), (13, "u_turn")] {
        builder.lanelet(id, 7, 6, &[("turn_direction", turn)]).unwrap();
    }
    builder.lanelet(14, 7, 6, &[]).unwrap();
    builder
}

fn light(builder: &mut MapBuilder, id: i64, lanelet: i64, members: &[(&str, Member)]) {
    builder.regulatory_element(id, members, &[("subtype", "traffic_light")]).unwrap();
    builder.attach(lanelet, id).unwrap();
}

const STOP_LINE: (&str, Member) = ("ref_line", Member::LineString(5));

#[test]
fn the_first_lanelet_of_the_route_decides() {
    let mut builder = builder();
    light(&mut builder, 20, 12, &[STOP_LINE]);
    builder.attach(11, 20).unwrap();
    let map = builder.build().unwrap();
    for (ids, turn) in [([11, 12], TurnDirection::Left), ([12, 11], TurnDirection::Right)] {
        let lights = RouteLights::new(&map, &route(&ids)).unwrap();
        assert_eq!(lights.get(20).unwrap().turn, turn);
    }
    let lights = RouteLights::new(&map, &route(&[14])).unwrap();
    assert!(lights.get(20).is_none(), "no light of this route");
    assert!(RouteLights::new(&map, &route(&[])).unwrap().get(20).is_none());
}

#[test]
fn only_known_turns_matter() {
    let mut builder = builder();
    light(&mut builder, 20, 13, &[STOP_LINE]);
    light(&mut builder, 21, 14, &[STOP_LINE]);
    let lights = RouteLights::new(&builder.build().unwrap(), &route(&[13, 14])).unwrap();
    assert_eq!(lights.get(20).unwrap().turn, TurnDirection::Other);
    assert_eq!(lights.get(21).unwrap().turn, TurnDirection::Other);
}

#[test]
fn a_route_that_leaves_the_map_names_the_lanelet() {
    let map = builder().build().unwrap();
    assert_eq!(RouteLights::new(&map, &route(&[11, 77, 88])).unwrap_err(), UnknownLanelet(77));
    let empty = MapBuilder::new().build().unwrap();
    assert_eq!(RouteLights::new(&empty, &route(&[11])).unwrap_err(), UnknownLanelet(11));
}

#[test]
fn other_rules_and_lights_without_a_stop_line_do_not_count() {
    let mut builder = builder();
    builder.regulatory_element(20, &[STOP_LINE], &[("subtype", "crosswalk")]).unwrap();
    builder.attach(11, 20).unwrap();
    light(&mut builder, 21, 11, &[]);
    light(&mut builder, 22, 11, &[("ref_line", Member::LineString(9))]);
    light(&mut builder, 23, 11, &[("ref_line", Member::LineString(10)), STOP_LINE]);
    let lights = RouteLights::new(&builder.build().unwrap(), &route(&[11])).unwrap();
    assert!(lights.get(20).is_none() && lights.get(21).is_none() && lights.get(22).is_none());
    let single = lights.get(23).unwrap();
    assert_eq!(single.stop_line.id, 10, "the first of several lines");
    assert_eq!(single.stop_line.distance_m(Point2::new(13.0, 7.0)), 5.0);
    let over = Segment::new(Point2::new(10.0, 0.0), Point2::new(10.0, 4.0));
    assert_eq!(single.stop_line.first_contact(&over), Some(Point2::new(10.0, 3.0)));
}

#[test]
fn arrows_are_told_by_shapes_and_bulbs() {
    let cases: &[(&[(&str, Member)], bool)] = &[
        (&[STOP_LINE], false),
        (&[STOP_LINE, ("refers", Member::LineString(6))], false),
        (&[STOP_LINE, ("refers", Member::LineString(6)), ("refers", Member::LineString(8))], true),
        (&[STOP_LINE, ("light_bulbs", Member::LineString(6))], false),
        (&[STOP_LINE, ("light_bulbs", Member::LineString(7))], true),
    ];
    for (members, expected) in cases {
        let mut builder = builder();
        light(&mut builder, 20, 11, members);
        let lights = RouteLights::new(&builder.build().unwrap(), &route(&[11])).unwrap();
        assert_eq!(lights.get(20).unwrap().has_arrow, *expected, "{members:?}");
    }
}

fn line_through(points: &[(f64, f64)]) -> StopLine {
    let mut builder = MapBuilder::new();
    let ids: Vec<i64> = (1..=points.len() as i64).collect();
    for (id, (x, y)) in ids.iter().zip(points) {
        builder.point(*id, [*x, *y, 0.0], &[]).unwrap();
    }
    builder.line_string(1, &ids, &[]).unwrap();
    StopLine::new(builder.build().unwrap().line_string(1).unwrap()).unwrap()
}

#[test]
fn of_several_contacts_the_nearest_to_the_start_counts() {
    let hook = line_through(&[(5.0, -1.0), (5.0, 1.0), (3.0, 1.0), (3.0, -1.0)]);
    let piece = Segment::new(Point2::new(0.0, 0.0), Point2::new(10.0, 0.0));
    assert_eq!(hook.first_contact(&piece), Some(Point2::new(3.0, 0.0)));
    let back = Segment::new(piece.end, piece.start);
    assert_eq!(hook.first_contact(&back), Some(Point2::new(5.0, 0.0)));
    let along = line_through(&[(7.0, 0.0), (4.0, 0.0)]);
    assert_eq!(along.first_contact(&piece), Some(Point2::new(4.0, 0.0)));
}

proptest! {
    /// The box only ever saves work.
    #[test]
    fn the_broad_phase_loses_nothing(
        places in prop::collection::vec((-9.0..9.0_f64, -9.0..9.0_f64), 1..5),
        start in (-9.0..9.0_f64, -9.0..9.0_f64), end in (-9.0..9.0_f64, -9.0..9.0_f64),
    ) {
        let line = line_through(&places);
        let piece = Segment::new(Point2::new(start.0, start.1), Point2::new(end.0, end.1));
        let exhaustive = line.segments.iter().any(|segment| piece.first_contact(segment).is_some());
        prop_assert_eq!(line.first_contact(&piece).is_some(), exhaustive);
    }
}
