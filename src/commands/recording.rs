//! How a recorded drive is taken: what every command that plays one is told about it.

use super::Failure;
use crate::drive::{Drive, Remap};
use clap::Args;
use lanelet_map::Map;
use lanelet_map::osm::OsmOptions;
use messages::Interface;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// What every command that plays a recording takes.
#[derive(Debug, Args)]
pub struct RecordingArguments {
    /// Wire form of candidates.
    #[arg(long, default_value = "auto", value_parser = parse_interface, value_name = "auto|0.52|0.53")]
    pub interface: InterfaceChoice,
    /// Take a recorded topic for another, for example /planning/candidates:=~/input/trajectories_generative.
    #[arg(long, value_name = "A:=B")]
    pub remap: Vec<Remap>,
    /// HD map, for recordings that lack the latched map message.
    #[arg(long, value_name = "FILE.bin|FILE.osm")]
    pub map: Option<PathBuf>,
}

impl RecordingArguments {
    /// The map that was named, if one was.
    ///
    /// # Errors
    /// It cannot be read.
    pub fn map(&self) -> Result<Option<Arc<Map>>, Failure> {
        self.map.as_deref().map(load_map).transpose()
    }

    /// Opens the recording at `path`, which must have a map of its own unless one was named.
    ///
    /// # Errors
    /// It cannot be read, or lacks what a drive needs.
    pub fn open(&self, path: &Path) -> Result<Drive, Failure> {
        let InterfaceChoice(interface) = self.interface;
        Ok(Drive::open(path, &self.remap, interface, self.map.is_none())?)
    }
}

/// Wire form of candidates, or to be found out.
#[derive(Debug, Clone, Copy)]
pub struct InterfaceChoice(Option<Interface>);

fn parse_interface(text: &str) -> Result<InterfaceChoice, messages::UnknownInterface> {
    if text == "auto" { Ok(InterfaceChoice(None)) } else { text.parse().map(Some).map(InterfaceChoice) }
}

fn load_map(path: &Path) -> Result<Arc<Map>, Failure> {
    let loaded =
        Map::load(path, &OsmOptions::default()).map_err(|error| Failure::from(error).at(path.display()))?;
    Ok(Arc::new(loaded.map))
}
