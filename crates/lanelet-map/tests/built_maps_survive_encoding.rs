//! Maps made in code are the same after encoding and decoding.
#![allow(clippy::unwrap_used, clippy::panic)] // A test that cannot go on should stop.

#[path = "support/fixture.rs"]
mod fixture;

use lanelet_map::archive::{decode, decode_with_info, encode};
use lanelet_map::dump::dump;
use lanelet_map::{Map, MapBuilder, Parameter};
use proptest::prelude::*;

#[test]
fn every_kind_of_element() {
    let map = fixture::every_kind();
    let (again, info) = decode_with_info(&encode(&map)).unwrap();
    assert!(map == again);
    assert_eq!(info.unfamiliar_types, 0);
    assert_eq!(dump(&map), dump(&again));
    assert_eq!(map.id_counter(), again.id_counter());
    let rule = again.lanelet(21).unwrap().regulatory_elements().next().unwrap();
    assert_eq!(rule.id(), 41);
    let kinds: Vec<&str> = rule
        .roles()
        .flat_map(|role| role.parameters().collect::<Vec<_>>())
        .map(|parameter| match parameter {
            Parameter::Point(_) => "point",
            Parameter::LineString(_) => "line string",
            Parameter::Polygon(_) => "polygon",
            Parameter::Lanelet(_) => "lanelet",
            Parameter::Area(_) => "area",
        })
        .collect();
    assert_eq!(kinds, ["line string", "line string", "point", "lanelet", "polygon", "lanelet", "area"]);
    let centerline = again.lanelet(22).unwrap().centerline().unwrap();
    assert_eq!(centerline.points().map(|p| p.id()).collect::<Vec<_>>(), [4, 2]);
    let name = again.point(-7).unwrap();
    assert_eq!(name.attribute(""), Some("empty key"));
    assert!(name.position()[2].is_sign_negative());
}

#[test]
fn the_dump_of_every_kind_is_as_documented() {
    let text = dump(&fixture::every_kind());
    for line in [
        "P -7 40f86a0000000000 c0f86a0000000000 8000000000000000 {=empty key|empty=|name=新宿 é\\p\\e\\\\\\n\\t}",
        "L 12+ {type=road_border} [4,3,]",
        "G 12+ {area=yes|type=detection_area} [5,6,7,]",
        "A 31 {} outer=16-,17+, inner=16+,17-,;; re=41,",
        "W 21+ {subtype=road|type=lanelet} left=11+ {subtype=solid|type=line_thin} [1,2,] right=12- {type=road_border} [3,4,] re=41,42, center=none",
        "R 41 {subtype=no_such_rule|type=regulatory_element} :L13+, bulbs:L14+, pole:P-7, refers:W22+,G12+, yield:W21+, zone:A31,",
        "R 42 {}",
    ] {
        assert!(text.lines().any(|found| found == line), "missing: {line}\n{text}");
    }
}

#[test]
fn an_empty_map_has_101_bytes() {
    let map = MapBuilder::new().build().unwrap();
    let bytes = encode(&map);
    assert_eq!(bytes.len(), 101);
    let (again, info) = decode_with_info(&bytes).unwrap();
    assert_eq!((info.objects, info.max_depth, again.id_counter()), (0, 0, 1000));
}

fn arbitrary_map() -> impl Strategy<Value = Map> {
    let points = prop::collection::btree_map(
        any::<i64>(),
        (prop::array::uniform3(-1e6_f64..1e6), prop::collection::vec(("[a-c|=]{0,2}", "\\PC{0,5}"), 0..4)),
        2..20,
    );
    let lines = prop::collection::vec(prop::collection::vec(any::<prop::sample::Index>(), 0..6), 2..10);
    let lanelets = prop::collection::vec((any::<prop::sample::Index>(), any::<prop::sample::Index>()), 0..6);
    (points, lines, lanelets).prop_map(|(points, lines, lanelets)| {
        let mut b = MapBuilder::new();
        let ids: Vec<i64> = points.keys().copied().collect();
        for (id, (position, attributes)) in &points {
            let attributes: Vec<(&str, &str)> =
                attributes.iter().map(|(key, value)| (key.as_str(), value.as_str())).collect();
            b.point(*id, *position, &attributes).unwrap();
        }
        for (id, line) in (0..).zip(&lines) {
            let line: Vec<i64> = line.iter().map(|at| *at.get(&ids)).collect();
            b.line_string(id, &line, &[]).unwrap();
        }
        for (id, (left, right)) in (0..).zip(&lanelets) {
            let (left, right) = (left.index(lines.len()) as i64, right.index(lines.len()) as i64);
            b.lanelet(id, left, right, &[]).unwrap();
        }
        b.build().unwrap()
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn arbitrary_maps(map in arbitrary_map()) {
        let bytes = encode(&map);
        let again = decode(&bytes).unwrap();
        prop_assert_eq!(dump(&map), dump(&again));
        prop_assert_eq!(bytes, encode(&again));
    }
}
