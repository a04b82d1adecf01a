//! Every OSM file with known content is read as Autoware reads it.
#![allow(clippy::unwrap_used, clippy::panic)] // A test that cannot go on should stop.

#[path = "support/describe.rs"]
mod describe;
#[path = "support/shared.rs"]
mod shared;

use std::collections::BTreeMap;

use lanelet_map::osm::{self, OsmOptions};
use lanelet_map::projection::{GeoPoint, Projector};
use lanelet_map::{IssueKind, Map, MapError, archive};
use serde_json::Value;

/// Largest deviation of a projected coordinate in metres.
const TOLERANCE_M: f64 = 1e-6;

/// Maps that Autoware loads and we refuse in strict mode, and why.
const ACROSS_SQUARES: [&str; 1] = ["synthetic/edge_broken"];

fn projector(text: &str) -> Projector {
    match text {
        "local" => Projector::Local,
        "mgrs" => Projector::Mgrs,
        other => {
            let (latitude, longitude) = other.strip_prefix("utm:").unwrap().split_once(',').unwrap();
            let origin = GeoPoint {
                latitude_deg: latitude.parse().unwrap(),
                longitude_deg: longitude.parse().unwrap(),
            };
            Projector::LocalCartesianUtm { origin }
        }
    }
}

fn assert_close(found: &Value, expected: &Value, what: &str) {
    match (found, expected) {
        (Value::Array(found), Value::Array(expected)) => {
            assert_eq!(found.len(), expected.len(), "{what}");
            for (found, expected) in found.iter().zip(expected) {
                assert_close(found, expected, what);
            }
        }
        (Value::Object(found), Value::Object(expected)) => {
            assert_eq!(found.len(), expected.len(), "{what}");
            for (key, expected) in expected {
                assert_close(&found[key], expected, what);
            }
        }
        (Value::Number(a), Value::Number(b)) if a.is_f64() || b.is_f64() => {
            let error = (a.as_f64().unwrap() - b.as_f64().unwrap()).abs();
            assert!(error <= TOLERANCE_M, "{what}: {a} instead of {b}");
        }
        _ => assert_eq!(found, expected, "{what}"),
    }
}

#[test]
fn every_comparable_field_of_every_file() {
    let Some(dir) = shared::shared("every_comparable_field_of_every_file") else { return };
    for expected in shared::expected_maps(&dir) {
        let name = &expected.name;
        let bytes = std::fs::read(&expected.osm).unwrap();
        // Two archives were written as loaded, without generated centerlines.
        let as_loaded = matches!(name.as_str(), "synthetic/tiny" | "synthetic/edge_local_area");
        let options = OsmOptions {
            projector: Some(projector(expected.values["projector"].as_str().unwrap())),
            strict: false,
            centerline_resolution_m: (!as_loaded).then_some(osm::CENTERLINE_RESOLUTION_M),
        };
        let loaded = osm::read([bytes.as_slice()], &options).unwrap_or_else(|e| panic!("{name}: {e}"));
        let map = &loaded.map;
        let mut found = describe::describe(map);
        let (range, samples) = describe::coordinates(map);
        found["coordinate_range"] = range;
        found["sample_points"] = samples;
        found["sample_lanelets"] = describe::sample_lanelets(map);
        let mut wanted = expected.values.clone();
        if name == "synthetic/edge_local_area" {
            // Deliberate: the area is put together with the coordinates in place.
            assert_eq!(map.areas().len(), 1);
            for field in ["layers", "attribute_counts"] {
                wanted[field]["areas"] = found[field]["areas"].clone();
            }
        }
        for (field, value) in found.as_object().unwrap() {
            assert_close(value, &wanted[field], &format!("{name}: {field}"));
        }
        let defects =
            loaded.issues.iter().filter(|issue| !matches!(issue.kind, IssueKind::GridChange { .. })).count();
        let wanted_defects = expected.values["load_errors"].as_u64().unwrap();
        if name != "synthetic/edge_local_area" {
            assert_eq!(defects > 0, wanted_defects > 0, "{name}: {:?}", loaded.issues);
        }
        let crosses = loaded.issues.len() > defects;
        assert_eq!(crosses, ACROSS_SQUARES.contains(&name.as_str()), "{name}: {:?}", loaded.issues);
        let strict = osm::read([bytes.as_slice()], &OsmOptions { strict: true, ..options });
        match strict {
            Ok(strict) => assert!(loaded.issues.is_empty() && strict.map == loaded.map, "{name}"),
            Err(MapError::Refused { issues }) => assert_eq!(issues, loaded.issues, "{name}"),
            Err(error) => panic!("{name}: {error}"),
        }
        let again = archive::decode(&archive::encode(map)).unwrap();
        assert!(*map == again, "{name}");
    }
}

/// Everything but ids of generated centerlines, lanelet by lanelet and point by point.
fn compare(from_osm: &Map, from_archive: &Map, what: &str) {
    assert_eq!(describe::describe(from_osm), describe::describe(from_archive), "{what}");
    for (a, b) in from_osm.points().zip(from_archive.points()) {
        assert_eq!(a.id(), b.id(), "{what}");
        for (x, y) in a.position().iter().zip(b.position()) {
            assert!((x - y).abs() <= TOLERANCE_M, "{what}: point {}", a.id());
        }
        assert!(a.attributes().iter().eq(b.attributes().iter()), "{what}: point {}", a.id());
    }
    for (a, b) in from_osm.line_strings().zip(from_archive.line_strings()) {
        assert!(a.points().map(|p| p.id()).eq(b.points().map(|p| p.id())), "{what}: line {}", a.id());
        assert!(a.attributes().iter().eq(b.attributes().iter()), "{what}: line {}", a.id());
    }
    for (a, b) in from_osm.lanelets().zip(from_archive.lanelets()) {
        let id = a.id();
        assert_eq!(id, b.id(), "{what}");
        assert!(a.attributes().iter().eq(b.attributes().iter()), "{what}: lanelet {id}");
        for (l, r) in [(a.left(), b.left()), (a.right(), b.right())] {
            assert_eq!((l.id(), l.is_inverted()), (r.id(), r.is_inverted()), "{what}: lanelet {id}");
        }
        let rules = |l: lanelet_map::Lanelet<'_>| l.regulatory_elements().map(|r| r.id()).collect::<Vec<_>>();
        assert_eq!(rules(a), rules(b), "{what}: lanelet {id}");
        match (a.centerline(), b.centerline()) {
            (None, None) => {}
            (Some(a), Some(b)) => {
                assert_eq!(a.len(), b.len(), "{what}: lanelet {id}");
                for (p, q) in a.positions().flatten().zip(b.positions().flatten()) {
                    assert!((p - q).abs() <= TOLERANCE_M, "{what}: centerline of lanelet {id}");
                }
            }
            _ => panic!("{what}: lanelet {id} has a centerline on one side only"),
        }
    }
    let mut differing = BTreeMap::new();
    for (a, b) in from_osm.regulatory_elements().zip(from_archive.regulatory_elements()) {
        let text = |r: lanelet_map::RegulatoryElement<'_>| {
            r.roles()
                .map(|role| format!("{}: {:?}", role.name(), role.parameters().collect::<Vec<_>>()))
                .collect::<Vec<_>>()
        };
        if text(a) != text(b) {
            differing.insert(a.id(), (text(a), text(b)));
        }
    }
    assert!(differing.is_empty(), "{what}: {differing:#?}");
}

#[test]
fn files_and_archives_give_the_same_map() {
    let Some(dir) = shared::shared("files_and_archives_give_the_same_map") else { return };
    for expected in shared::expected_maps(&dir) {
        if expected.name == "synthetic/edge_local_area" {
            continue;
        }
        let options = OsmOptions {
            projector: Some(projector(expected.values["projector"].as_str().unwrap())),
            strict: false,
            centerline_resolution_m: (expected.name != "synthetic/tiny").then_some(5.0),
        };
        let from_osm = Map::load(&expected.osm, &options).unwrap().map;
        let from_archive = Map::load(&expected.bin, &options).unwrap().map;
        compare(&from_osm, &from_archive, &expected.name);
    }
}

#[test]
fn the_golden_maps_are_the_same_in_both_formats() {
    let Some(dir) = shared::shared("the_golden_maps_are_the_same_in_both_formats") else { return };
    for path in shared::golden_maps(&dir) {
        let options =
            OsmOptions { projector: Some(Projector::Local), strict: false, centerline_resolution_m: None };
        let from_osm = Map::load(&path.with_extension("osm"), &options).unwrap().map;
        let from_archive = Map::load(&path.with_extension("bin"), &options).unwrap().map;
        compare(&from_osm, &from_archive, &path.display().to_string());
    }
}
