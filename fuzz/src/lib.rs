//! What is done with fuzzed bytes: one function for each target.
//!
//! Each hands the bytes to one door of the program, and checks what comes through it. None needs more than the stable
//! toolchain, so `tests/fuzz_regressions_stay_fixed.rs` replays with them what was once found.

mod messages_on_the_wire;
mod open_space_scene;
mod recordings;
mod road_scene;
mod texts;

use lanelet_map::archive;
use lanelet_map::osm::{self, OsmOptions};
use lanelet_map::projection::Projector;

pub use messages_on_the_wire::{KINDS, cdr};
pub use open_space_scene::open_space;
pub use recordings::{bag_folder, mcap, sqlite};
pub use road_scene::cycle;
pub use texts::{parameter_files, parking_scene, ros_arguments, verify_scene};

/// A target: it panics where a promise is broken.
pub type Target = fn(&[u8]);

/// Every target by name.
pub const TARGETS: [(&str, Target); 12] = [
    ("bag_folder", bag_folder),
    ("cdr", cdr),
    ("cycle", cycle),
    ("map_archive", map_archive),
    ("mcap", mcap),
    ("open_space", open_space),
    ("osm", osm),
    ("parameter_files", parameter_files),
    ("parking_scene", parking_scene),
    ("ros_arguments", ros_arguments),
    ("sqlite", sqlite),
    ("verify_scene", verify_scene),
];

/// Whether these bytes are one input in so many. Bytes that differ a little are another input: a flag among them would be
/// kept by what the fuzzer makes of them, and what was meant to be seldom would be most of what it runs.
fn are_one_in(many: u64, bytes: &[u8]) -> bool {
    let hash = bytes.iter().fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| {
        (hash ^ u64::from(*byte)).wrapping_mul(0x0000_0100_0000_01b3)
    });
    // The lowest bits know little of the whole.
    (hash >> 32).is_multiple_of(many)
}

/// An archive of a map. What is read is written and read to the same bytes.
pub fn map_archive(bytes: &[u8]) {
    let Ok((map, _)) = archive::decode_with_info(bytes) else { return };
    let written = archive::encode(&map);
    let again = archive::decode(&written).expect("what we write we can read");
    assert!(archive::encode(&again) == written, "reading and writing once more changes it");
}

/// An OSM file, behind a byte that chooses how it is read.
pub fn osm(bytes: &[u8]) {
    let Some((&choice, text)) = bytes.split_first() else { return };
    let options = OsmOptions {
        projector: (choice & 1 != 0).then_some(Projector::Local),
        strict: choice & 2 != 0,
        centerline_resolution_m: (choice & 4 != 0).then_some(osm::CENTERLINE_RESOLUTION_M),
    };
    // Two tiles, if wanted, that are cut in the middle.
    let (first, second) = text.split_at(if choice & 8 != 0 { text.len() / 2 } else { text.len() });
    let tiles: &[&[u8]] = if second.is_empty() { &[first] } else { &[first, second] };
    let Ok(loaded) = osm::read(tiles.iter().copied(), &options) else { return };
    let written = archive::encode(&loaded.map);
    archive::decode(&written).expect("a map that was read can be written and read");
}
