//! Where the test data that are not part of the repository lie, and what they should say.
#![allow(dead_code, unreachable_pub)] // Shared by several test programs, each of which uses its own part.

use std::path::{Path, PathBuf};

use serde_json::Value;

/// The directory with maps and expectations: `$SELECTOR_SHARED`, or `shared` beside the workspace. Says so where
/// it is absent, and the caller skips its test.
pub fn shared(test: &str) -> Option<PathBuf> {
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared");
    let dir = std::env::var_os("SELECTOR_SHARED").map_or(beside, PathBuf::from);
    if dir.join("data/maps/expected.json").is_file() {
        return Some(dir);
    }
    eprintln!("skipped: {test}: no test maps in {}", dir.display());
    None
}

/// A map with known content.
pub struct Expected {
    pub name: String,
    pub bin: PathBuf,
    pub osm: PathBuf,
    pub values: Value,
}

/// All maps with known content.
pub fn expected_maps(shared: &Path) -> Vec<Expected> {
    let dir = shared.join("data/maps");
    let text = std::fs::read_to_string(dir.join("expected.json")).unwrap();
    let root: Value = serde_json::from_str(&text).unwrap();
    let maps: Vec<Expected> = root["maps"]
        .as_object()
        .unwrap()
        .iter()
        .map(|(name, values)| Expected {
            name: name.clone(),
            bin: dir.join(format!("{name}.bin")),
            osm: dir.join(format!("{name}.osm")),
            values: values.clone(),
        })
        .collect();
    assert!(maps.len() >= 79, "expected.json lists {} maps", maps.len());
    maps
}

/// The 12 maps of the golden sets, as paths without extension.
pub fn golden_maps(shared: &Path) -> Vec<PathBuf> {
    let mut maps: Vec<PathBuf> = std::fs::read_dir(shared.join("golden/maps"))
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|e| e == "bin"))
        .map(|path| path.with_extension(""))
        .collect();
    maps.sort();
    assert_eq!(maps.len(), 12);
    maps
}

/// FNV-1a, 64 bits, as 16 hexadecimal digits.
pub fn fnv(bytes: impl IntoIterator<Item = u8>) -> String {
    let hash = bytes.into_iter().fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
    });
    format!("{hash:016x}")
}
