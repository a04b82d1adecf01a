//! `explain`: why each candidate of one cycle was accepted or rejected, in words, as a picture and as a page.

use super::recording::RecordingArguments;
use super::{Failure, JudgeArguments, summarise};
use crate::report::explanation::{self, ExplainedCandidate, Explanation};
use crate::report::picture::{self, Subject};
use crate::report::statistics::Statistics;
use crate::report::summary::Input;
use crate::session::{Rate, Session, page_of, validator_of};
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
    /// Draw the cycle, with the wanted candidate, else the worst one, looked at closely.
    #[arg(long, value_name = "FILE.svg")]
    pub picture: Option<PathBuf>,
    /// Write the cycle as one HTML page to this file: every verdict, every reason, the same candidate selected.
    #[arg(long, value_name = "FILE.html")]
    pub report: Option<PathBuf>,
    /// What every command that judges takes.
    #[command(flatten)]
    pub judge: JudgeArguments,
    /// How the recording is taken.
    #[command(flatten)]
    pub recording: RecordingArguments,
}

/// Runs the drive up to one cycle and explains that.
///
/// # Errors
/// The drive cannot be run, or has no such cycle, or the cycle judged nothing.
pub fn run(arguments: &ExplainArguments) -> Result<Explanation, Failure> {
    if let Some(path) =
        arguments.picture.as_deref().filter(|path| path.extension().is_none_or(|end| end != "svg"))
    {
        let path = path.display();
        return Err(Failure::usage(format!(
            "{path}: pictures are written as SVG; give a name that ends in .svg"
        )));
    }
    let settings = arguments.judge.settings()?;
    let map = arguments.recording.map()?;
    let drive = arguments.recording.open(&arguments.drive)?;
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
        markers: false,
        progress: false,
    };
    let mut ended = session.run(&settings, drive)?;
    let cycles: u64 = ended.result.statistics.cycles.values().sum();
    let Some((report, times)) = ended.watched.take() else {
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
    let wanted = arguments.candidate.as_deref();
    let is_wanted = |candidate: &ExplainedCandidate| {
        wanted.is_none_or(|name| candidate.generator.starts_with(name) || candidate.key.starts_with(name))
    };
    let named = wanted.and_then(|_| explanation.candidates.iter().position(is_wanted));
    let focus = named.unwrap_or_else(|| picture::worst(&explanation));
    if let Some(path) = &arguments.picture {
        let accepted = explanation.candidates.iter().filter(|candidate| candidate.accepted).count();
        let of = explanation.candidates.len();
        let picture = picture::draw(&Subject {
            title: &format!("Cycle {}: {accepted} of {of} candidates accepted", explanation.cycle),
            scene: &cycle.scene,
            candidates: &cycle.concatenated.candidates,
            explanation: &explanation,
            focus,
        });
        std::fs::write(path, picture).map_err(|error| {
            let path = path.display();
            Failure::output(format!("{path}: the picture cannot be written: {error}")).at(path)
        })?;
    }
    if let Some(path) = &arguments.report {
        let mut page = page_of(&settings)?;
        page.add(&report, times);
        page.focus(focus);
        ended.page = Some(page);
        // The page shows one cycle; so do its tables.
        ended.result.statistics = Statistics::default();
        ended.result.statistics.add(&report, times);
        let threads = arguments.judge.threads();
        summarise("explain", ended, Vec::new(), &settings, threads, Some(path))?;
    }
    explanation.candidates.retain(is_wanted);
    Ok(explanation)
}
