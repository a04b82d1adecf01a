//! `Map::load` tells archives from OSM files by their content, merges directories and finds the projector.
#![allow(clippy::unwrap_used, clippy::panic)] // A test that cannot go on should stop.

#[path = "support/fixture.rs"]
mod fixture;

use std::path::PathBuf;

use lanelet_map::osm::OsmOptions;
use lanelet_map::projection::Projector;
use lanelet_map::{Map, MapError, archive};

/// A directory of its own, removed at the end of the test.
struct Directory(PathBuf);

impl Directory {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("lanelet-map-{}-{name}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    fn write(&self, name: &str, content: impl AsRef<[u8]>) -> PathBuf {
        let path = self.0.join(name);
        std::fs::write(&path, content).unwrap();
        path
    }
}

impl Drop for Directory {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

const NODE: &str = "<osm><MetaInfo format_version='1' map_version='12'/>
    <node id='1' lat='35.6' lon='139.7'><tag k='local_x' v='7'/></node></osm>";

#[test]
fn an_archive_is_known_whatever_its_name() {
    let directory = Directory::new("archive");
    let map = fixture::every_kind();
    let path = directory.write("map.osm", archive::encode(&map));
    let loaded = Map::load(&path, &OsmOptions::default()).unwrap();
    assert!(loaded.map == map);
    assert_eq!(loaded.projector, None);
}

#[test]
fn the_projector_is_that_of_the_caller_or_of_the_file_beside_or_guessed() {
    let directory = Directory::new("projector");
    let path = directory.write("map.osm", NODE);
    let load = |options: &OsmOptions| Map::load(&path, options);
    let guessed = load(&OsmOptions::default()).unwrap();
    assert_eq!(guessed.projector, Some(Projector::Mgrs));
    assert_eq!((guessed.format_version.as_str(), guessed.map_version.as_str()), ("1", "12"));
    assert!(guessed.map.point(1).unwrap().position()[0] > 1000.0);

    directory.write("map_projector_info.yaml", "projector_type: Local\n");
    let beside = load(&OsmOptions::default()).unwrap();
    assert_eq!(beside.projector, Some(Projector::Local));
    assert_eq!(beside.map.point(1).unwrap().position(), [7.0, 0.0, 0.0]);

    let chosen = load(&OsmOptions { projector: Some(Projector::Mgrs), ..OsmOptions::default() }).unwrap();
    assert!(chosen.map == guessed.map);

    directory.write("map_projector_info.yaml", "vertical_datum: WGS84\nprojector_type: UTM\n");
    let error = load(&OsmOptions::default()).unwrap_err();
    assert!(matches!(error, MapError::ProjectorInfo { line: 2, .. }), "{error}");

    let flat = directory.write("flat.osm", "<osm><node id='1'><tag k='local_x' v='7'/></node></osm>");
    std::fs::remove_file(directory.0.join("map_projector_info.yaml")).unwrap();
    assert_eq!(Map::load(&flat, &OsmOptions::default()).unwrap().projector, Some(Projector::Local));
}

#[test]
fn a_directory_is_one_map() {
    let directory = Directory::new("tiles");
    assert!(matches!(Map::load(&directory.0, &OsmOptions::default()), Err(MapError::Read { .. })));
    directory.write("a.osm", "<osm><node id='1' lat='35.6' lon='139.7'/></osm>");
    directory.write("b.osm", "<osm><node id='2' lat='35.6' lon='139.7'/></osm>");
    directory.write("notes.txt", "not a map");
    let loaded = Map::load(&directory.0, &OsmOptions::default()).unwrap();
    assert_eq!(loaded.map.points().map(|point| point.id()).collect::<Vec<_>>(), [1, 2]);
}

#[test]
fn a_missing_file_is_named() {
    let error = Map::load("no/such/map.osm".as_ref(), &OsmOptions::default()).unwrap_err();
    assert!(error.to_string().contains("no/such/map.osm"), "{error}");
}
