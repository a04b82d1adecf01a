//! `explain`: why each candidate of one cycle was accepted or rejected.

use super::{Failure, JudgeArguments};
use crate::drive::{Drive, Remap};
use crate::report::explanation::{self, Explanation};
use crate::report::summary::Input;
use crate::session::{Rate, Session, validator_of};
use clap::Args;
use selector_actors::Outcome;
use std::path::PathBuf;

/// Arguments of `explain`.
#[derive(Debug, Args)]
pub struct ExplainArguments {
    /// The recording: a .mcap file, a rosbag2 folder, or a .db3 file.
    #[arg(value_name = "DRIVE")]
    pub drive: PathBuf,
    /// Number of the cycle, from 1.
    #[arg(long, value_name = "N")]
    pub cycle: u64,
    /// Only candidates whose generator name or key begins like this.
    #[arg(long, value_name = "NAME")]
    pub candidate: Option<String>,
    /// What every command that judges takes.
    #[command(flatten)]
    pub judge: JudgeArguments,
    /// Take a recorded topic for another.
    #[arg(long, value_name = "A:=B")]
    pub remap: Vec<Remap>,
    /// HD map, for recordings that lack the latched map message.
    #[arg(long, value_name = "FILE.bin|FILE.osm")]
    pub map: Option<PathBuf>,
}

/// Runs the drive up to its end and explains one cycle of it.
///
/// # Errors
/// The drive cannot be run, or has no such cycle, or the cycle judged nothing.
pub fn run(arguments: &ExplainArguments) -> Result<Explanation, Failure> {
    let settings = arguments.judge.settings()?;
    let map = arguments.map.as_deref().map(super::replay::load_map).transpose()?;
    let drive = Drive::open(&arguments.drive, &arguments.remap, None, map.is_none())?;
    let session = Session {
        input: Input { name: arguments.drive.display().to_string(), seed: None },
        interface: drive.interface(),
        span: (drive.start(), drive.end()),
        threads: arguments.judge.threads(),
        rate: Rate::Max,
        output: None,
        map,
        watch: Some(arguments.cycle),
        page: false,
        progress: false,
    };
    let ended = session.run(&settings, drive)?;
    let cycles: u64 = ended.result.statistics.cycles.values().sum();
    let Some(report) = ended.watched else {
        let broken = ended.errors.into_iter().next();
        return Err(broken.unwrap_or_else(|| {
            Failure::usage(format!("there is no cycle {}; the drive has 1 to {cycles}", arguments.cycle))
        }));
    };
    let Outcome::Judged(judged) = &report.outcome else {
        let why = report.outcome.early_return().unwrap_or("unknown");
        return Err(Failure::usage(format!("cycle {} judged nothing: {why}", arguments.cycle)));
    };
    // The run's own validator is gone with the node; one of the same settings names and words things alike.
    let validator = validator_of(&settings)?;
    let cycle = &report.cycle;
    let mut explanation = explanation::explain(
        &validator,
        &cycle.concatenated.candidates,
        &judged.verdicts,
        cycle.number,
        cycle.trigger.name(),
        cycle.scene.now,
    );
    if let Some(wanted) = &arguments.candidate {
        explanation
            .candidates
            .retain(|candidate| candidate.generator.starts_with(wanted) || candidate.key.starts_with(wanted));
    }
    Ok(explanation)
}
