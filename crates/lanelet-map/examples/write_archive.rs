//! Writes a map as an archive, the bytes of `LaneletMapBin.data`: `write_archive MAP OUT.bin`. MAP is an archive, an
//! `.osm` file or a directory of them; OSM maps get centerlines as from Autoware's map loader.

use std::path::Path;

use lanelet_map::osm::OsmOptions;
use lanelet_map::{Map, archive};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [map, out] = arguments.as_slice() else { return Err("usage: write_archive MAP OUT.bin".into()) };
    let loaded = Map::load(Path::new(map), &OsmOptions { strict: false, ..OsmOptions::default() })?;
    for issue in &loaded.issues {
        eprintln!("{issue}");
    }
    std::fs::write(out, archive::encode(&loaded.map))?;
    Ok(())
}
