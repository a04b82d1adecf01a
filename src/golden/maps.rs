//! Maps by name, each decoded once.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use lanelet_map::Map;
use lanelet_map::osm::OsmOptions;
use lanelet_map::projection::Projector;

use super::GoldenError;

/// Name of the folder of the maps, beside that of the sequences.
const FOLDER: &str = "maps";

/// The maps that were asked for so far.
#[derive(Debug, Default)]
pub struct Maps {
    folder: Option<PathBuf>,
    decoded: HashMap<PathBuf, Arc<Map>>,
    only: Option<Arc<Map>>,
}

impl Maps {
    /// Maps in this folder; without one, in the folder `maps` beside the folder of each sequence.
    #[must_use]
    pub fn new(folder: Option<PathBuf>) -> Self {
        Self { folder, ..Self::default() }
    }

    /// One map, whatever it is called; no file is looked for.
    #[must_use]
    pub fn of_one(map: Arc<Map>) -> Self {
        Self { only: Some(map), ..Self::default() }
    }

    /// The map that a sequence names. Of a map `name.osm` the archive `name.bin` is read where there is one: it holds
    /// the same map and is read faster. An OSM file's positions are its tags `local_x` and `local_y`.
    ///
    /// # Errors
    /// [`GoldenError::Map`] with the path that was tried.
    pub fn get(&mut self, sequence: &Path, name: &str) -> Result<Arc<Map>, GoldenError> {
        if let Some(map) = &self.only {
            return Ok(map.clone());
        }
        let named = self.folder_of(sequence).join(name);
        if let Some(map) = self.decoded.get(&named) {
            return Ok(map.clone());
        }
        let archive = named.with_extension("bin");
        let path = if archive.is_file() { archive } else { named.clone() };
        let options =
            OsmOptions { projector: Some(Projector::Local), strict: false, centerline_resolution_m: None };
        let loaded = Map::load(&path, &options).map_err(|source| GoldenError::Map { path, source })?;
        let map = Arc::new(loaded.map);
        self.decoded.insert(named, map.clone());
        Ok(map)
    }

    fn folder_of(&self, sequence: &Path) -> PathBuf {
        // A path like `sequence.json` has no parent that could be joined to; `..` is right for all of them.
        self.folder
            .clone()
            .unwrap_or_else(|| sequence.parent().unwrap_or(Path::new("")).join("..").join(FOLDER))
    }
}
