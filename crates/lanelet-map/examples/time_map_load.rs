//! Times the loading of map files, from opening the file to a map that answers questions by id.
//!
//! `time_map_load [--runs N] [--utm LATITUDE,LONGITUDE] FILE...` prints one line of JSON for each file: median, fastest
//! and slowest of N runs (default 15) in seconds, and what was loaded. OSM files are read as they are, without
//! generated centerlines, with UTM relative to the given origin or else with the projector of the file.

use std::hint::black_box;
use std::path::Path;
use std::time::Instant;

use lanelet_map::osm::OsmOptions;
use lanelet_map::projection::{GeoPoint, Projector};
use lanelet_map::{LoadedMap, Map, MapError};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut options = OsmOptions { projector: None, strict: false, centerline_resolution_m: None };
    let (mut runs, mut files) = (15_usize, Vec::new());
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--runs" => runs = arguments.next().ok_or("--runs needs a number")?.parse::<usize>()?.max(1),
            "--utm" => {
                let value = arguments.next().ok_or("--utm needs LATITUDE,LONGITUDE")?;
                let (latitude, longitude) = value.split_once(',').ok_or("--utm needs LATITUDE,LONGITUDE")?;
                let origin = GeoPoint { latitude_deg: latitude.parse()?, longitude_deg: longitude.parse()? };
                options.projector = Some(Projector::LocalCartesianUtm { origin });
            }
            _ => files.push(argument),
        }
    }
    for file in &files {
        let (seconds, loaded) = time(Path::new(file), &options, runs)?;
        println!(
            "{{\"file\": {file:?}, \"runs\": {runs}, \"median_s\": {:.6}, \"min_s\": {:.6}, \"max_s\": {:.6}, \
             \"points\": {}, \"lanelets\": {}, \"regulatory_elements\": {}}}",
            seconds[runs / 2],
            seconds[0],
            seconds[runs - 1],
            loaded.map.points().len(),
            loaded.map.lanelets().len(),
            loaded.map.regulatory_elements().len(),
        );
    }
    Ok(())
}

/// Sorted times of all runs, and the map of one run more.
fn time(file: &Path, options: &OsmOptions, runs: usize) -> Result<(Vec<f64>, LoadedMap), MapError> {
    let mut seconds = Vec::with_capacity(runs);
    for _ in 0..runs {
        let start = Instant::now();
        let loaded = Map::load(file, options)?;
        seconds.push(start.elapsed().as_secs_f64());
        black_box(&loaded);
    }
    seconds.sort_by(f64::total_cmp);
    Ok((seconds, Map::load(file, options)?))
}
