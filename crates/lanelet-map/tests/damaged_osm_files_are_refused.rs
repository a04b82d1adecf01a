//! Whatever the text: a map or an error, never a panic; strict mode refuses what lenient mode reports.
#![allow(clippy::unwrap_used, clippy::panic)] // A test that cannot go on should stop.

#[path = "support/shared.rs"]
mod shared;

use lanelet_map::osm::{self, OsmOptions};
use lanelet_map::projection::Projector;
use lanelet_map::{IssueKind, LoadedMap, MapError};

const LENIENT: OsmOptions =
    OsmOptions { projector: Some(Projector::Local), strict: false, centerline_resolution_m: Some(5.0) };

fn read(body: &str, options: &OsmOptions) -> Result<LoadedMap, MapError> {
    osm::read([format!("<osm>{body}</osm>").as_bytes()], options)
}

fn node(id: i64, x: f64, y: f64) -> String {
    format!("<node id='{id}'><tag k='local_x' v='{x}'/><tag k='local_y' v='{y}'/></node>")
}

fn square_nodes() -> String {
    [(1, 0.0, 0.0), (2, 10.0, 0.0), (3, 10.0, 10.0), (4, 0.0, 10.0)].map(|(id, x, y)| node(id, x, y)).concat()
}

#[test]
fn every_defect_is_reported_and_refused_in_strict_mode() {
    let cases: &[(&str, IssueKind)] = &[
        ("<way id='9'><nd ref='1'/><nd ref='99'/></way>", IssueKind::MissingNode { node: 99 }),
        ("<way id='9'></way>", IssueKind::EmptyWay),
        (
            "<relation id='9'><member type='way' ref='77' role='left'/><tag k='type' v='lanelet'/></relation>",
            IssueKind::MissingMember { member: 77 },
        ),
        (
            "<way id='5'><nd ref='1'/><nd ref='2'/></way><relation id='9'><member type='way' ref='5' role='left'/><tag k='type' v='lanelet'/></relation>",
            IssueKind::BorderCount { role: "right", found: 0 },
        ),
        (
            "<way id='5'><nd ref='1'/><nd ref='3'/></way><relation id='9'><member type='way' ref='5' role='outer'/><tag k='type' v='multipolygon'/></relation>",
            IssueKind::BrokenRing { role: "outer" },
        ),
        (
            "<relation id='9'><tag k='type' v='multipolygon'/></relation>",
            IssueKind::OuterRingCount { found: 0 },
        ),
        ("<relation id='9'><tag k='type' v='regulatory_element'/></relation>", IssueKind::NoSubtype),
        (
            "<relation id='9'><tag k='type' v='regulatory_element'/><tag k='subtype' v='xyz'/></relation>",
            IssueKind::UnknownSubtype { subtype: "xyz".to_owned() },
        ),
    ];
    for (body, kind) in cases {
        let body = square_nodes() + body;
        let loaded = read(&body, &LENIENT).unwrap();
        let found = loaded.issues.iter().find(|issue| issue.kind == *kind);
        assert_eq!(found.map(|issue| issue.id), Some(9), "{body}: {:?}", loaded.issues);
        match read(&body, &OsmOptions { strict: true, ..LENIENT }) {
            Err(MapError::Refused { issues }) => assert_eq!(issues, loaded.issues),
            other => panic!("{body}: {other:?}"),
        }
    }
}

#[test]
fn rings_are_put_together_and_turned_clockwise() {
    let body = square_nodes()
        + "<way id='5'><nd ref='1'/><nd ref='2'/><nd ref='3'/></way>
           <way id='6'><nd ref='1'/><nd ref='4'/><nd ref='3'/></way>
           <relation id='9'><member type='way' ref='5' role='outer'/><member type='way' ref='6' role='outer'/>
           <tag k='type' v='multipolygon'/></relation>";
    let loaded = read(&body, &LENIENT).unwrap();
    assert_eq!(loaded.issues, []);
    let area = loaded.map.area(9).unwrap();
    let corners: Vec<i64> =
        area.outer().flat_map(|line| line.points().map(|p| p.id()).collect::<Vec<_>>()).collect();
    assert_eq!(corners, [1, 4, 3, 3, 2, 1]);
}

#[test]
fn local_coordinates_must_be_numbers() {
    let body = "<node id='3'><tag k='local_x' v='east'/></node>";
    assert!(matches!(read(body, &LENIENT), Err(MapError::LocalCoordinate { node: 3, key: "local_x" })));
    let body = "<node id='3'><tag k='local_x' v='inf'/></node>";
    assert!(matches!(read(body, &LENIENT), Err(MapError::NonFinitePoint { point: 3 })));
    let mgrs = OsmOptions { projector: Some(Projector::Mgrs), ..LENIENT };
    assert!(read("<node id='3' lat='35' lon='139'><tag k='local_x' v='east'/></node>", &mgrs).is_ok());
    let polar = "<node id='3' lat='89' lon='139'/>";
    assert!(matches!(read(polar, &mgrs), Err(MapError::Projection { node: 3, .. })));
}

#[test]
fn a_map_across_two_mgrs_squares_is_reported() {
    let body = "<node id='1' lat='35.6' lon='139.7'/><node id='2' lat='0' lon='0'/>";
    let mgrs = OsmOptions { projector: Some(Projector::Mgrs), ..LENIENT };
    let issues = read(body, &mgrs).unwrap().issues;
    assert!(matches!(issues.as_slice(), [issue] if issue.id == 2), "{issues:?}");
}

/// Autoware aligns bounds twice, in Local mode three times; bounds that touch are turned each time.
#[test]
fn bounds_that_touch_are_turned_as_often_as_autoware_does() {
    let body = "<node id='1' lat='35.6' lon='139.7'><tag k='local_x' v='1'/></node>
        <node id='2' lat='35.601' lon='139.7'><tag k='local_x' v='9'/></node>
        <way id='5'><nd ref='1'/><nd ref='2'/></way><relation id='9'><member type='way' ref='5' role='left'/>
        <member type='way' ref='5' role='right'/><tag k='type' v='lanelet'/></relation>";
    for (projector, inverted) in [(Projector::Mgrs, false), (Projector::Local, true)] {
        let loaded = read(body, &OsmOptions { projector: Some(projector), ..LENIENT }).unwrap();
        let lanelet = loaded.map.lanelet(9).unwrap();
        let found = (lanelet.left().is_inverted(), lanelet.right().is_inverted());
        assert_eq!(found, (inverted, inverted), "{projector:?}");
    }
}

#[test]
fn tiles_share_their_nodes() {
    let one = "<osm><node id='1' lat='1' lon='1'/><node id='2' lat='1.001' lon='1'/><way id='5'><nd ref='1'/><nd ref='2'/></way></osm>";
    let two = "<osm><node id='2' lat='1.001' lon='1'/><node id='3' lat='1.002' lon='1'/><way id='6'><nd ref='2'/><nd ref='3'/></way></osm>";
    let loaded = osm::read([one.as_bytes(), two.as_bytes()], &OsmOptions::default()).unwrap();
    assert_eq!(loaded.map.points().len(), 3);
    assert_eq!(loaded.map.line_strings().len(), 2);
    assert_eq!(loaded.projector, Some(Projector::Mgrs));
}

#[test]
fn mutants_of_small_files() {
    let Some(dir) = shared::shared("mutants_of_small_files") else { return };
    let mut state = 12_345_u64;
    let mut random = |limit: usize| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % limit.max(1)
    };
    let (mut maps, mut errors) = (0, 0);
    for name in ["edge_all_types", "edge_broken", "tiny", "edge_local_area"] {
        let original = std::fs::read(dir.join(format!("data/maps/synthetic/{name}.osm"))).unwrap();
        for round in 0..500 {
            let mut bytes = original.clone();
            for _ in 0..=random(4) {
                let at = random(bytes.len());
                let end = (at + 1 + random(60)).min(bytes.len());
                match random(5) {
                    0 => bytes[at] = random(256) as u8,
                    1 => drop(bytes.drain(at..end)),
                    2 => {
                        let copy = bytes[at..end].to_vec();
                        bytes.splice(at..at, copy);
                    }
                    3 => bytes[at] = b"<>'\"&/0-9"[random(9)],
                    _ => bytes.swap(at, end - 1),
                }
            }
            let projector = [None, Some(Projector::Local), Some(Projector::Mgrs)][round % 3];
            match osm::read([bytes.as_slice()], &OsmOptions { projector, ..LENIENT }) {
                Ok(loaded) => {
                    maps += 1;
                    let map = loaded.map;
                    assert!(
                        lanelet_map::archive::decode(&lanelet_map::archive::encode(&map)).unwrap() == map
                    );
                }
                Err(_) => errors += 1,
            }
        }
    }
    println!("{maps} mutants were still maps, {errors} were not");
    assert!(maps > 100 && errors > 100);
}
