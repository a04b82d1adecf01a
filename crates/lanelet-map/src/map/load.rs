//! Maps from files: archive or OSM, told apart by content.

use std::path::{Path, PathBuf};

use super::Map;
use crate::archive;
use crate::error::{LoadIssue, MapError};
use crate::osm::{self, OsmOptions};
use crate::projection::{Projector, read_projector_info};

/// The file beside a map that names its projector.
const PROJECTOR_FILE: &str = "map_projector_info.yaml";

/// A map and what was noticed while it was read.
#[derive(Debug)]
pub struct LoadedMap {
    /// The map.
    pub map: Map,
    /// Defects of an OSM map, in the order they were met; empty in strict mode and for archives.
    pub issues: Vec<LoadIssue>,
    /// The projector that was used; none for archives.
    pub projector: Option<Projector>,
    /// `format_version` of the file; may be empty.
    pub format_version: String,
    /// `map_version` of the file; may be empty.
    pub map_version: String,
}

impl Map {
    /// Reads an archive, an `.osm` file, or a directory of `.osm` files (tiles, merged in the order of names).
    /// Archives are known by their first bytes, whatever the name.
    ///
    /// # Errors
    /// [`MapError::Read`], and those of [`archive::decode`], [`osm::read`] and [`read_projector_info`].
    pub fn load(path: &Path, options: &OsmOptions) -> Result<LoadedMap, MapError> {
        let files = if path.is_dir() { osm_files(path)? } else { vec![path.to_owned()] };
        let contents = files
            .iter()
            .map(|file| std::fs::read(file).map_err(|source| MapError::Read { path: file.clone(), source }))
            .collect::<Result<Vec<_>, _>>()?;
        if let [bytes] = contents.as_slice()
            && archive::is_archive(bytes)
        {
            let map = archive::decode(bytes)?;
            let (format_version, map_version) = (String::new(), String::new());
            return Ok(LoadedMap { map, issues: Vec::new(), projector: None, format_version, map_version });
        }
        let projector = match options.projector {
            Some(projector) => Some(projector),
            None => projector_beside(path)?,
        };
        osm::read(contents.iter().map(Vec::as_slice), &OsmOptions { projector, ..*options })
    }
}

fn osm_files(directory: &Path) -> Result<Vec<PathBuf>, MapError> {
    let fail = |source| MapError::Read { path: directory.to_owned(), source };
    let mut files = Vec::new();
    for entry in std::fs::read_dir(directory).map_err(fail)? {
        let path = entry.map_err(fail)?.path();
        if path.extension().is_some_and(|extension| extension == "osm") {
            files.push(path);
        }
    }
    if files.is_empty() {
        return Err(fail(std::io::Error::new(std::io::ErrorKind::NotFound, "no .osm file in the directory")));
    }
    files.sort();
    Ok(files)
}

/// The projector named by the file beside the map, or in the map's directory.
fn projector_beside(path: &Path) -> Result<Option<Projector>, MapError> {
    let directory = if path.is_dir() { path } else { path.parent().unwrap_or(Path::new(".")) };
    let file = directory.join(PROJECTOR_FILE);
    match std::fs::read_to_string(&file) {
        Ok(text) => read_projector_info(&text).map(Some),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(None),
        Err(source) => Err(MapError::Read { path: file, source }),
    }
}
