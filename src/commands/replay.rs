//! `replay`: a recorded drive through the node.

use super::{Failure, JudgeArguments, summarise};
use crate::drive::{Drive, Remap};
use crate::report::summary::{Input, RunSummary};
use crate::session::{Rate, Session};
use clap::Args;
use lanelet_map::Map;
use lanelet_map::osm::OsmOptions;
use messages::Interface;
use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Arguments of `replay`.
#[derive(Debug, Args)]
pub struct ReplayArguments {
    /// The recording: a .mcap file, a rosbag2 folder, or a .db3 file.
    #[arg(value_name = "DRIVE")]
    pub drive: PathBuf,
    /// Write what the node publishes to this file.
    #[arg(long, value_name = "OUT.mcap")]
    pub output: Option<PathBuf>,
    /// Draw every cycle into the output, as markers for RViz and Foxglove.
    #[arg(long, requires = "output")]
    pub markers: bool,
    /// Write the run as one HTML page to this file: every cycle, every verdict, every reason.
    #[arg(long, value_name = "FILE.html")]
    pub report: Option<PathBuf>,
    /// What every command that judges takes.
    #[command(flatten)]
    pub judge: JudgeArguments,
    /// Wire form of candidates.
    #[arg(long, default_value = "auto", value_parser = parse_interface, value_name = "auto|0.52|0.53")]
    pub interface: InterfaceChoice,
    /// Seconds of the drive per second, or as fast as possible.
    #[arg(long, default_value = "max", value_name = "max|X")]
    pub rate: Rate,
    /// Take a recorded topic for another, for example /planning/candidates:=~/input/trajectories_generative.
    #[arg(long, value_name = "A:=B")]
    pub remap: Vec<Remap>,
    /// HD map, for recordings that lack the latched map message.
    #[arg(long, value_name = "FILE.bin|FILE.osm")]
    pub map: Option<PathBuf>,
}

/// Wire form of candidates, or to be found out.
#[derive(Debug, Clone, Copy)]
pub struct InterfaceChoice(pub(super) Option<Interface>);

pub(super) fn parse_interface(text: &str) -> Result<InterfaceChoice, messages::UnknownInterface> {
    if text == "auto" { Ok(InterfaceChoice(None)) } else { text.parse().map(Some).map(InterfaceChoice) }
}

/// Runs the drive.
///
/// # Errors
/// The drive cannot be started. What goes wrong on the way is in the summary.
pub fn run(arguments: &ReplayArguments, progress: bool) -> Result<RunSummary, Failure> {
    let settings = arguments.judge.settings()?;
    let map = arguments.map.as_deref().map(load_map).transpose()?;
    let InterfaceChoice(interface) = arguments.interface;
    let drive = Drive::open(&arguments.drive, &arguments.remap, interface, map.is_none())?;
    let warnings = drive.warnings().iter().map(|odd| Failure::note("bag", odd.to_string())).collect();
    let threads = arguments.judge.threads();
    let session = Session {
        input: Input { name: arguments.drive.display().to_string(), seed: None },
        interface: drive.interface(),
        span: (drive.start(), drive.end()),
        threads,
        rate: arguments.rate,
        output: arguments.output.clone(),
        map,
        watch: None,
        page: arguments.report.is_some(),
        markers: arguments.markers,
        progress: progress && std::io::stderr().is_terminal(),
    };
    let ended = session.run(&settings, drive)?;
    summarise("replay", ended, warnings, &settings, threads, arguments.report.as_deref())
}

pub(super) fn load_map(path: &Path) -> Result<Arc<Map>, Failure> {
    let loaded =
        Map::load(path, &OsmOptions::default()).map_err(|error| Failure::from(error).at(path.display()))?;
    Ok(Arc::new(loaded.map))
}
