//! `replay`: a recorded drive through the node.

use super::recording::RecordingArguments;
use super::{Failure, JudgeArguments, summarise};
use crate::report::summary::{Input, RunSummary};
use crate::session::{Rate, Session};
use clap::Args;
use std::io::IsTerminal;
use std::path::PathBuf;

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
    /// How the recording is taken.
    #[command(flatten)]
    pub recording: RecordingArguments,
    /// Seconds of the drive per second, or as fast as possible.
    #[arg(long, default_value = "max", value_name = "max|X")]
    pub rate: Rate,
}

/// Runs the drive.
///
/// # Errors
/// The drive cannot be started. What goes wrong on the way is in the summary.
pub fn run(arguments: &ReplayArguments, progress: bool) -> Result<RunSummary, Failure> {
    let settings = arguments.judge.settings()?;
    let map = arguments.recording.map()?;
    let drive = arguments.recording.open(&arguments.drive)?;
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
