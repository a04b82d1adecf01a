//! `profile`: where the time goes in a recorded drive.

use super::recording::RecordingArguments;
use super::{Failure, JudgeArguments, summarise};
use crate::allocations;
use crate::recorder::Recorder;
use crate::report::comparison::{Comparison, Profile};
use crate::report::samples::{Samples, WorstCycle};
use crate::report::statistics::{Latency, Statistics};
use crate::report::summary::{Input, RunSummary};
use crate::report::table;
use crate::report::trace::Trace;
use crate::ros::encoder::Encoder;
use crate::session::{Ended, Rate, Session};
use crate::settings::Settings;
use clap::Args;
use lanelet_map::Map;
use serde::Serialize;
use std::collections::BTreeMap;
use std::fmt::{self, Display};
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

/// Samples of a stage in the result, for each run.
const SAMPLES_PER_RUN: usize = 500;

/// Arguments of `profile`.
#[derive(Debug, Args)]
pub struct ProfileArguments {
    /// The recording: a .mcap file, a rosbag2 folder, or a .db3 file.
    #[arg(value_name = "DRIVE", required_unless_present = "compare")]
    pub drive: Option<PathBuf>,
    /// Hold two results of `profile DRIVE --json` against each other instead: did B get faster or slower than A?
    #[arg(long, num_args = 2, value_names = ["A.json", "B.json"], conflicts_with_all = ["drive", "trace", "report"])]
    pub compare: Vec<PathBuf>,
    /// Runs over the drive; a comparison needs several, to know how much runs differ by chance.
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u16).range(1..=1000))]
    pub runs: u16,
    /// Write the last run as a trace for Perfetto or chrome://tracing to this file.
    #[arg(long, value_name = "FILE.json")]
    pub trace: Option<PathBuf>,
    /// Write the last run as one HTML page to this file: every cycle, every verdict, every reason.
    #[arg(long, value_name = "FILE.html")]
    pub report: Option<PathBuf>,
    /// Worst cycles that are told.
    #[arg(long, value_name = "N", default_value_t = 10)]
    pub worst: usize,
    /// What every command that judges takes.
    #[command(flatten)]
    pub judge: JudgeArguments,
    /// How the recording is taken.
    #[command(flatten)]
    pub recording: RecordingArguments,
    /// Seconds of the drive per second, or as fast as possible. At a rate, cycles are cut at their budget as in a node.
    #[arg(long, default_value = "max", value_name = "max|X")]
    pub rate: Rate,
}

/// What `profile` gives.
#[derive(Debug, Serialize)]
pub struct ProfileReport {
    /// The drive, its cycles and latencies: counts of the last run, latencies of all.
    #[serde(flatten)]
    pub summary: RunSummary,
    /// Runs over the drive.
    pub runs: usize,
    /// The cycles that took longest, the worst first.
    pub worst: Vec<WorstCycle>,
    /// Times of the cycles by stage and run.
    pub samples_us: BTreeMap<String, Vec<Vec<f64>>>,
    /// Where the trace is.
    pub trace: Option<String>,
}

/// Runs the drive.
///
/// # Errors
/// The drive cannot be started, or the trace cannot be written. What goes wrong on the way is in the summary.
pub fn run(arguments: &ProfileArguments) -> Result<ProfileReport, Failure> {
    let drive = arguments.drive.as_deref().ok_or_else(|| Failure::usage("error: no DRIVE".to_owned()))?;
    let settings = arguments.judge.settings()?;
    let map = arguments.recording.map()?;
    allocations::start_counting();
    let mut all = AllRuns::default();
    let mut last = None;
    for number in 1..=usize::from(arguments.runs) {
        let is_last = number == usize::from(arguments.runs);
        let (ended, recorder) = run_once(arguments, drive, map.clone(), &settings, is_last)?;
        all.add(&recorder.lock().samples.take().unwrap_or_default(), &ended.result.statistics, number);
        let broke = !ended.errors.is_empty();
        last = Some((ended, recorder));
        if broke {
            break;
        }
    }
    let (mut ended, recorder) = last.ok_or_else(|| Failure::internal("nothing was run".to_owned()))?;
    ended.result.statistics.latency = all.latency;
    all.worst.sort_by(|a, b| b.cycle_us.total_cmp(&a.cycle_us));
    all.worst.truncate(arguments.worst);
    if all.left_out > 0 {
        let text =
            format!("{} cycles are too many to be kept one by one; they count in latency_us", all.left_out);
        ended.warnings.push(Failure::note("thinned", text));
    }
    let trace = match (recorder.lock().trace.take(), &arguments.trace) {
        (Some(trace), Some(path)) => Some(write_trace(&trace, path, &mut ended)?),
        _ => None,
    };
    let (threads, page) = (arguments.judge.threads(), arguments.report.as_deref());
    let summary = summarise("profile", ended, Vec::new(), &settings, threads, page)?;
    Ok(ProfileReport { summary, runs: all.runs, worst: all.worst, samples_us: all.samples_us, trace })
}

/// Holds two profiles against each other.
///
/// # Errors
/// One of them cannot be read.
pub fn compare(files: &[PathBuf]) -> Result<(Comparison, Vec<Failure>), Failure> {
    let [a, b] = files else {
        return Err(Failure::usage("error: --compare takes two files".to_owned()));
    };
    let (a, b) = (read(a)?, read(b)?);
    let mut warnings = Vec::new();
    let mut warn = |text: String| warnings.push(Failure::note("comparison", text));
    if a.input != b.input {
        warn(format!("the profiles are of different drives: {} and {}", a.input.name, b.input.name));
    }
    if a.settings_hash != b.settings_hash {
        warn("the profiles have different parameters".to_owned());
    }
    if a.threads != b.threads {
        warn("the profiles have different numbers of threads".to_owned());
    }
    let few = |profile: &Profile| profile.samples_us.values().any(|runs| runs.len() < 3);
    if few(&a) || few(&b) {
        warn("fewer than three runs do not show how much runs differ by chance; use --runs 5".to_owned());
    }
    Ok((Comparison::of(&a, &b), warnings))
}

fn read(path: &Path) -> Result<Profile, Failure> {
    let failed = |what: &dyn Display| {
        let text = format!("{}: {what}; it must be the output of `profile DRIVE --json`", path.display());
        Failure::settings(text).at(path.display())
    };
    let text = std::fs::read_to_string(path).map_err(|error| failed(&error))?;
    serde_json::from_str(&text).map_err(|error| failed(&error))
}

fn run_once(
    arguments: &ProfileArguments,
    path: &Path,
    map: Option<Arc<Map>>,
    settings: &Settings,
    is_last: bool,
) -> Result<(Ended, Recorder), Failure> {
    let drive = arguments.recording.open(path)?;
    let odd: Vec<Failure> =
        drive.warnings().iter().map(|odd| Failure::note("bag", odd.to_string())).collect();
    let session = Session {
        input: Input { name: path.display().to_string(), seed: None },
        interface: drive.interface(),
        span: (drive.start(), drive.end()),
        threads: arguments.judge.threads(),
        rate: arguments.rate,
        output: None,
        map,
        watch: None,
        page: arguments.report.is_some() && is_last,
        markers: false,
        progress: false,
    };
    let recorder = Recorder::counting();
    {
        let mut recording = recorder.lock();
        recording.samples = Some(Samples::default());
        recording.trace = (arguments.trace.is_some() && is_last).then(|| Trace::new(Instant::now()));
        recording.encoder = Some(Encoder::new(drive.interface()));
    }
    let mut ended = session.measure(&recorder, settings, drive)?;
    ended.warnings.extend(odd);
    Ok((ended, recorder))
}

/// What is gathered over the runs.
#[derive(Debug, Default)]
struct AllRuns {
    runs: usize,
    latency: BTreeMap<String, Latency>,
    samples_us: BTreeMap<String, Vec<Vec<f64>>>,
    worst: Vec<WorstCycle>,
    left_out: u64,
}

/// Worst cycles kept of each run.
const WORST_OF_RUN: usize = 100;

impl AllRuns {
    fn add(&mut self, samples: &Samples, statistics: &Statistics, number: usize) {
        self.runs = number;
        self.left_out += samples.left_out();
        self.worst.extend(samples.worst(WORST_OF_RUN, number));
        for (stage, took_us) in samples.by_stage(SAMPLES_PER_RUN) {
            self.samples_us.entry(stage).or_default().push(took_us);
        }
        for (stage, latency) in &statistics.latency {
            self.latency.entry(stage.clone()).or_default().merge(latency);
        }
    }
}

fn write_trace(trace: &Trace, path: &Path, ended: &mut Ended) -> Result<String, Failure> {
    let failed = |error: std::io::Error| {
        Failure::output(format!("{} cannot be written: {error}; choose another --trace", path.display()))
    };
    let mut file = BufWriter::new(File::create(path).map_err(failed)?);
    trace.write(&mut file).and_then(|()| file.flush()).map_err(failed)?;
    if trace.left_out() > 0 {
        let text = format!("{} cycles are not in the trace; viewers get slow beyond", trace.left_out());
        ended.warnings.push(Failure::note("thinned", text));
    }
    Ok(path.display().to_string())
}

impl Display for ProfileReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        table::write(&self.summary, f)?;
        writeln!(f)?;
        table::write_resources(&self.summary, f)?;
        write!(f, "latencies of {} runs, counts of the last", self.runs)?;
        if let Some(trace) = &self.trace {
            write!(f, "; its trace is {trace}")?;
        }
        writeln!(
            f,
            "\n\n{:>4} {:>7} {:8} {:>10} {:>10}  cause",
            "run", "cycle", "worst", "candidates", "µs"
        )?;
        for worst in &self.worst {
            let WorstCycle { run, cycle, trigger, candidates, cycle_us, cause, excess_us, .. } = worst;
            writeln!(
                f,
                "{run:>4} {cycle:>7} {trigger:8} {candidates:>10} {cycle_us:>10.0}  {cause}, {excess_us:.0} more than usual"
            )?;
        }
        Ok(())
    }
}
