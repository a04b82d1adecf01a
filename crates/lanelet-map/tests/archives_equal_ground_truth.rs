//! Every archive with known content decodes to exactly that content.
#![allow(clippy::unwrap_used, clippy::panic)] // A test that cannot go on should stop.

#[path = "support/describe.rs"]
mod describe;
#[path = "support/shared.rs"]
mod shared;

use lanelet_map::archive::{decode, decode_with_info, encode};
use lanelet_map::dump::dump;
use serde_json::{Value, json};
use sha2::{Digest, Sha256};

#[test]
fn every_field_of_every_archive() {
    let Some(dir) = shared::shared("every_field_of_every_archive") else { return };
    for expected in shared::expected_maps(&dir) {
        let bytes = std::fs::read(&expected.bin).unwrap();
        let (map, info) = decode_with_info(&bytes).unwrap_or_else(|e| panic!("{}: {e}", expected.name));
        assert_eq!(info.unfamiliar_types, 0, "{}", expected.name);
        let mut found = describe::describe(&map);
        let (range, samples) = describe::coordinates(&map);
        let text = dump(&map);
        let hash = map.points().flat_map(|point| {
            let mut record = point.id().to_le_bytes().to_vec();
            record.extend(point.position().iter().flat_map(|value| value.to_le_bytes()));
            record
        });
        let rest = json!({
            "projector": expected.values["projector"], "load_errors": expected.values["load_errors"],
            "bytes": bytes.len(),
            "sha256": Sha256::digest(&bytes).iter().map(|b| format!("{b:02x}")).collect::<String>(),
            "library_version": info.library_version,
            "id_counter": map.id_counter(),
            "objects": info.objects,
            "max_depth": info.max_depth,
            "coordinates_hash": shared::fnv(hash),
            "coordinate_range": range,
            "sample_points": samples,
            "sample_lanelets": describe::sample_lanelets(&map),
            "dump_bytes": text.len(),
            "dump_hash": shared::fnv(text.bytes()),
        });
        let Value::Object(rest) = rest else { unreachable!() };
        found.as_object_mut().unwrap().extend(rest);
        for (field, value) in expected.values.as_object().unwrap() {
            assert_eq!(&found[field], value, "{}: {field}", expected.name);
        }
        assert_eq!(found.as_object().unwrap().len(), expected.values.as_object().unwrap().len());
    }
}

#[test]
fn what_is_encoded_decodes_to_the_same_map() {
    let Some(dir) = shared::shared("what_is_encoded_decodes_to_the_same_map") else { return };
    let archives = shared::expected_maps(&dir)
        .into_iter()
        .map(|expected| expected.bin)
        .chain(shared::golden_maps(&dir).into_iter().map(|path| path.with_extension("bin")));
    for path in archives {
        let (map, info) = decode_with_info(&std::fs::read(&path).unwrap()).unwrap();
        let encoded = encode(&map);
        let (again, again_info) = decode_with_info(&encoded).unwrap();
        assert!(map == again, "{}", path.display());
        assert_eq!(dump(&map), dump(&again), "{}", path.display());
        assert_eq!(info.objects, again_info.objects, "{}", path.display());
        assert_eq!(again_info.unfamiliar_types, 0, "{}", path.display());
        assert_eq!(map.id_counter(), again.id_counter());
        assert_eq!(encode(&again), encoded);
    }
}

#[test]
fn the_golden_maps_decode() {
    let Some(dir) = shared::shared("the_golden_maps_decode") else { return };
    for path in shared::golden_maps(&dir) {
        let map = decode(&std::fs::read(path.with_extension("bin")).unwrap()).unwrap();
        assert!(map.lanelets().len() > 0, "{}", path.display());
    }
}
