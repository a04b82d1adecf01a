//! Maps made in code, for tests that need no files.
#![allow(dead_code, unreachable_pub)] // Shared by several test programs, each of which uses its own part.

use lanelet_map::{Bound, Map, MapBuilder, Member};

/// A small map with every kind of element, parameter and attribute trouble, and a cycle.
pub fn every_kind() -> Map {
    let mut b = MapBuilder::new();
    for (id, [x, y]) in
        (1..).zip([[0.0, 3.5], [10.0, 3.5], [0.0, 0.0], [10.0, 0.0], [20.0, 0.0], [30.0, 0.0], [30.0, 10.0]])
    {
        b.point(id, [x, y, 0.25], &[("local_x", "1")]).unwrap();
    }
    b.point(-7, [1e5, -1e5, -0.0], &[("name", "新宿 é|=\\\n\t"), ("empty", ""), ("", "empty key")]).unwrap();
    b.line_string(11, &[1, 2], &[("type", "line_thin"), ("subtype", "solid")]).unwrap();
    b.line_string(12, &[4, 3], &[("type", "road_border")]).unwrap();
    b.line_string(13, &[2, 4], &[("type", "stop_line")]).unwrap();
    b.line_string(14, &[5], &[("type", "light_bulbs")]).unwrap();
    b.line_string(15, &[], &[]).unwrap();
    b.line_string(16, &[5, 6, 7], &[]).unwrap();
    b.line_string(17, &[5, 7], &[]).unwrap();
    b.line_string(9_007_199_254_740_993, &[3, 4], &[]).unwrap();
    b.polygon(12, &[5, 6, 7], &[("area", "yes"), ("type", "detection_area")]).unwrap();
    b.lanelet(21, 11, Bound::inverted(12), &[("type", "lanelet"), ("subtype", "road")]).unwrap();
    b.lanelet(22, Bound::inverted(12), 15, &[("subtype", "crosswalk")]).unwrap();
    b.centerline(22, Bound::inverted(13)).unwrap();
    b.area(31, &[Bound::inverted(16), 17.into()], &[&[16.into(), Bound::inverted(17)], &[]], &[]).unwrap();
    let members = [
        ("refers", Member::Lanelet(22)),
        ("refers", Member::Polygon(12)),
        ("zone", Member::Area(31)),
        ("", Member::LineString(13)),
        ("bulbs", Member::LineString(14)),
        ("pole", Member::Point(-7)),
        ("yield", Member::Lanelet(21)),
    ];
    b.regulatory_element(41, &members, &[("type", "regulatory_element"), ("subtype", "no_such_rule")])
        .unwrap();
    b.regulatory_element(42, &[], &[]).unwrap();
    b.attach(21, 41).unwrap();
    b.attach(21, 42).unwrap();
    b.attach(22, 41).unwrap();
    b.attach_to_area(31, 41).unwrap();
    b.build().unwrap()
}

/// Lanelets in a row, each with a rule that names the next one: as deep as an archive can nest.
pub fn chain(lanelets: i64) -> Map {
    let mut b = MapBuilder::new();
    for at in 0..=lanelets {
        let x = at as f64 * 5.0;
        b.point(2 * at + 1, [x, 3.5, 0.0], &[]).unwrap();
        b.point(2 * at + 2, [x, 0.0, 0.0], &[]).unwrap();
    }
    for at in 0..lanelets {
        b.line_string(2 * at + 1, &[2 * at + 1, 2 * at + 3], &[]).unwrap();
        b.line_string(2 * at + 2, &[2 * at + 2, 2 * at + 4], &[]).unwrap();
        b.lanelet(at, 2 * at + 1, 2 * at + 2, &[("subtype", "road")]).unwrap();
    }
    for at in 0..lanelets - 1 {
        let members = [("right_of_way", Member::Lanelet(at)), ("yield", Member::Lanelet(at + 1))];
        b.regulatory_element(CHAIN_RULE + at, &members, &[("subtype", "right_of_way")]).unwrap();
        b.attach(at, CHAIN_RULE + at).unwrap();
    }
    b.build().unwrap()
}

/// Id of the first rule of a [`chain`].
pub const CHAIN_RULE: i64 = 0x0123_4567_0000_0000;
