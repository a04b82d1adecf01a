//! `demo`: a generated drive through the node. Needs no input.

use super::{Failure, JudgeArguments, summarise};
use crate::drive::Event;
use crate::report::summary::{Input, RunSummary};
use crate::scenario::Scenario;
use crate::session::{Rate, Session};
use clap::Args;
use messages::Interface;
use std::io::IsTerminal;
use std::path::PathBuf;

/// Arguments of `demo`.
#[derive(Debug, Args)]
pub struct DemoArguments {
    /// Folder for the recording of what the node publishes, with markers for RViz and Foxglove.
    #[arg(long, value_name = "DIR", default_value = "out")]
    pub output: PathBuf,
    /// Seed of the road's traffic.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
    /// Write the run as one HTML page to this file: every cycle, every verdict, every reason.
    #[arg(long, value_name = "FILE.html")]
    pub report: Option<PathBuf>,
    /// What every command that judges takes.
    #[command(flatten)]
    pub judge: JudgeArguments,
}

/// Runs the generated drive.
///
/// # Errors
/// The drive cannot be started. What goes wrong on the way is in the summary.
pub fn run(arguments: &DemoArguments, progress: bool) -> Result<RunSummary, Failure> {
    let settings = arguments.judge.settings()?;
    std::fs::create_dir_all(&arguments.output).map_err(|error| {
        Failure::output(format!(
            "{} cannot be made: {error}; choose another --output",
            arguments.output.display()
        ))
    })?;
    let scenario = Scenario::road(arguments.seed);
    let threads = arguments.judge.threads();
    let session = Session {
        input: Input { name: scenario.name().to_owned(), seed: Some(arguments.seed) },
        interface: Interface::V0_53,
        span: scenario.span(),
        threads,
        rate: Rate::Max,
        output: Some(arguments.output.join("demo.mcap")),
        map: None,
        watch: None,
        page: arguments.report.is_some(),
        markers: true,
        progress: progress && std::io::stderr().is_terminal(),
    };
    let ended = session.run(&settings, scenario.drive().map(Event::Input))?;
    summarise("demo", ended, Vec::new(), &settings, threads, arguments.report.as_deref())
}
