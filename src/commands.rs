//! The command line: what can be asked for, and how an answer or a failure leaves the program.
//!
//! Results go to stdout, everything for people's eyes alone to stderr. With `--json` exactly one JSON object goes to
//! stdout, also on failure. Exit codes: 0 done, 1 failed, 2 usage or settings, 3 requirement missed.

pub mod check;
pub mod demo;
pub mod doctor;
pub mod explain;
pub mod failure;
pub mod node;
pub mod park;
pub mod profile;
pub mod recording;
pub mod replay;
pub mod stress;
pub mod top;
pub mod verify;

pub use failure::Failure;

use crate::report::page::Page;
use crate::report::summary::{Common, RunSummary};
use crate::report::table;
use crate::ros::arguments::{self, CommandLine};
use crate::session::Ended;
use crate::settings::{Settings, Source};
use clap::{Args, Parser, Subcommand};
use selector_actors::topics::NODE_NAME;
use serde::Serialize;
use std::fmt::Display;
use std::io::{ErrorKind, IsTerminal, Write};
use std::path::{Path, PathBuf};
use tracing::level_filters::LevelFilter;

/// Validates candidate trajectories in parallel and hands on those that are safe.
#[derive(Debug, Parser)]
#[command(name = "trajectory-selector", version, about, max_term_width = 100)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
    /// Print one JSON object on stdout instead of a table.
    #[arg(long, global = true)]
    pub json: bool,
    /// Lowest level of log lines on stderr [default: info for a node, else error].
    #[arg(long, global = true, value_name = "error|warn|info|debug")]
    pub log_level: Option<LevelFilter>,
}

/// What the program can do.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Drive 20 s along a generated road with lights, crossings and traffic, and validate every candidate.
    Demo(demo::DemoArguments),
    /// Run as a node in a ROS 2 graph.
    Node(node::NodeArguments),
    /// Run a recorded drive through the node.
    Replay(replay::ReplayArguments),
    /// Put load on the selector: latencies, allocations, and how many candidates it bears.
    Stress(stress::StressArguments),
    /// Show where the time goes in a recorded drive, and hold two such profiles against each other.
    Profile(profile::ProfileArguments),
    /// Check parameter files and maps: all problems at once.
    Check(CheckArguments),
    /// Tell why each candidate of one cycle of a drive was accepted or rejected.
    Explain(explain::ExplainArguments),
    /// Look whether this host is fit to run the node: network, domain, buffers, clock, cores.
    Doctor,
    /// Watch a recorded drive or a running node on the terminal: rate, verdicts, latencies, warnings.
    Top(top::TopArguments),
    /// Plan a parking manoeuvre: search, smooth, time, check, and draw it.
    Park(park::ParkArguments),
    /// Hold the filters against recorded scenes with known verdicts.
    Verify(VerifyArguments),
}

impl Command {
    /// Name as typed.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::Node(_) => "node",
            Self::Demo(_) => "demo",
            Self::Replay(_) => "replay",
            Self::Stress(_) => "stress",
            Self::Profile(_) => "profile",
            Self::Check(_) => "check",
            Self::Explain(_) => "explain",
            Self::Doctor => "doctor",
            Self::Top(_) => "top",
            Self::Park(_) => "park",
            Self::Verify(_) => "verify",
        }
    }
}

/// What every command that judges takes.
#[derive(Debug, Args)]
pub struct JudgeArguments {
    /// Parameter file in ROS form; later files win.
    #[arg(long, value_name = "FILE")]
    pub params: Vec<PathBuf>,
    /// Threads that judge [default: the cores].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=256))]
    pub threads: Option<u16>,
}

impl JudgeArguments {
    /// Defaults overlaid with the files.
    ///
    /// # Errors
    /// Everything that is wrong in the files, at once.
    pub fn settings(&self) -> Result<Settings, Failure> {
        let sources: Vec<_> = self.params.iter().cloned().map(Source::File).collect();
        Ok(Settings::load(&format!("/{NODE_NAME}"), &sources)?)
    }

    /// Threads that judge.
    #[must_use]
    pub fn threads(&self) -> usize {
        self.threads.map_or_else(cores, usize::from)
    }
}

/// Threads that judge when nothing is said.
pub(crate) fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

/// Arguments of `check`.
#[derive(Debug, Args)]
pub struct CheckArguments {
    /// Parameter files (.yaml) and maps (.bin, .osm).
    #[arg(required = true, value_name = "FILE")]
    pub files: Vec<PathBuf>,
}

/// Arguments of `verify`.
#[derive(Debug, Args)]
pub struct VerifyArguments {
    /// Files of recorded scenes, or folders of them.
    #[arg(required = true, value_name = "PATH")]
    pub paths: Vec<PathBuf>,
    /// Folder of the maps [default: `maps` beside the scenes' folder].
    #[arg(long, value_name = "DIR")]
    pub maps: Option<PathBuf>,
    /// Only this filter; may be given more than once.
    #[arg(long, value_name = "NAME")]
    pub filter: Vec<String>,
}

/// Parses the command line, does what it says, and gives the exit code.
#[must_use]
pub fn main() -> u8 {
    let wants_json = std::env::args_os().any(|argument| argument == "--json");
    let CommandLine { program, ros } = match arguments::parse(std::env::args_os()) {
        Ok(line) => line,
        Err(error) => return answer_failure("", Failure::usage(error.to_string()), wants_json),
    };
    let cli = match Cli::try_parse_from(program) {
        Ok(cli) => cli,
        Err(usage) => return answer_usage(&usage, wants_json),
    };
    if !matches!(cli.command, Command::Node(_) | Command::Top(_)) {
        // A second subscriber cannot be there: this runs once.
        let _ = tracing_subscriber::fmt()
            .with_max_level(cli.log_level.unwrap_or(LevelFilter::ERROR))
            .with_writer(std::io::stderr)
            .with_ansi(std::io::stderr().is_terminal())
            .without_time()
            .with_target(false)
            // It would panic where nobody reads stderr any more.
            .log_internal_errors(false)
            .try_init();
    }
    let name = cli.command.name();
    if ros.is_some() && !matches!(cli.command, Command::Node(_)) {
        let failure = Failure::usage(format!("error: `{name}` is no node; --ros-args is for `node`"));
        return answer_failure(name, failure, cli.json);
    }
    let answer = match cli.command {
        Command::Node(arguments) => {
            let output = node::Output { json: cli.json, level: cli.log_level };
            node::run(&arguments, &ros.unwrap_or_default(), &output)
        }
        Command::Demo(arguments) => demo::run(&arguments, !cli.json),
        Command::Replay(arguments) => replay::run(&arguments, !cli.json),
        Command::Stress(arguments) => return answer_stress(&arguments, cli.json),
        Command::Profile(arguments) => return answer_profile(&arguments, cli.json),
        Command::Check(arguments) => return answer_check(&arguments, cli.json),
        Command::Explain(arguments) => return answer_explain(&arguments, cli.json),
        Command::Doctor => return answer_doctor(cli.json),
        Command::Top(arguments) => return answer_top(&arguments, cli.log_level, cli.json),
        Command::Park(arguments) => return answer_park(&arguments, cli.json),
        Command::Verify(arguments) => return answer_verify(arguments, cli.json),
    };
    match answer {
        Ok(summary) => answer_run(&summary, cli.json),
        Err(failure) => answer_failure(name, failure, cli.json),
    }
}

/// A command that could not do its work.
fn answer_failure(command: &'static str, failure: Failure, json: bool) -> u8 {
    tell(&failure);
    let common = Common::new(command, vec![failure], Vec::new());
    if json { print_json(&common, common.exit_code) } else { common.exit_code }
}

fn answer_explain(arguments: &explain::ExplainArguments, json: bool) -> u8 {
    match explain::run(arguments) {
        Ok(explanation) => answer_report("explain", Vec::new(), Vec::new(), &explanation, json),
        Err(failure) => answer_failure("explain", failure, json),
    }
}

fn answer_stress(arguments: &stress::StressArguments, json: bool) -> u8 {
    match stress::run(arguments, !json) {
        Ok(report) => answer_measured(&report.summary.common, &report, json),
        Err(failure) => answer_failure("stress", failure, json),
    }
}

fn answer_profile(arguments: &profile::ProfileArguments, json: bool) -> u8 {
    if !arguments.compare.is_empty() {
        return match profile::compare(&arguments.compare) {
            Ok((comparison, warnings)) => {
                warnings.iter().for_each(tell);
                answer_report("profile", Vec::new(), warnings, &comparison, json)
            }
            Err(failure) => answer_failure("profile", failure, json),
        };
    }
    match profile::run(arguments) {
        Ok(report) => answer_measured(&report.summary.common, &report, json),
        Err(failure) => answer_failure("profile", failure, json),
    }
}

/// The screen was the answer; what is left is whether all went well.
fn answer_top(arguments: &top::TopArguments, level: Option<LevelFilter>, json: bool) -> u8 {
    match top::run(arguments, level) {
        Ok(report) => {
            report.common.errors.iter().for_each(tell);
            let exit_code = report.common.exit_code;
            if json { print_json(&report, exit_code) } else { exit_code }
        }
        Err(failure) => answer_failure("top", failure, json),
    }
}

/// A report with a summary of its own is the answer.
fn answer_measured<R: Serialize + Display>(common: &Common, report: &R, json: bool) -> u8 {
    common.warnings.iter().chain(&common.errors).for_each(tell);
    let exit_code = common.exit_code;
    if json { print_json(report, exit_code) } else { print(&report.to_string(), exit_code) }
}

fn answer_park(arguments: &park::ParkArguments, json: bool) -> u8 {
    match park::run(arguments) {
        Ok(park::Answer { common, report }) => {
            common.warnings.iter().chain(&common.errors).for_each(tell);
            answer(common, &report, json)
        }
        Err(failure) => answer_failure("park", failure, json),
    }
}

/// A report is the answer, whether the command is content with it or not.
fn answer_report<R: Serialize + Display>(
    command: &'static str,
    errors: Vec<Failure>,
    warnings: Vec<Failure>,
    report: &R,
    json: bool,
) -> u8 {
    answer(Common::new(command, errors, warnings), report, json)
}

fn answer<R: Serialize + Display>(common: Common, report: &R, json: bool) -> u8 {
    let exit_code = common.exit_code;
    if json {
        print_json(&Answer { common, report }, exit_code)
    } else {
        print(&report.to_string(), exit_code)
    }
}

/// Help and version are answers, everything else is wrong usage.
fn answer_usage(usage: &clap::Error, wants_json: bool) -> u8 {
    let failure = Failure::usage(usage.to_string());
    // Nothing can be done if the terminal is gone.
    let _ = usage.print();
    if !usage.use_stderr() {
        return 0;
    }
    let common = Common::new("", vec![failure], Vec::new());
    if wants_json { print_json(&common, common.exit_code) } else { common.exit_code }
}

fn answer_run(summary: &RunSummary, json: bool) -> u8 {
    summary.common.warnings.iter().chain(&summary.common.errors).for_each(tell);
    let exit_code = summary.common.exit_code;
    if json {
        return print_json(summary, exit_code);
    }
    let mut text = String::new();
    // Writing to a string cannot fail.
    let _ = table::write(summary, &mut text);
    print(&text, exit_code)
}

fn answer_check(arguments: &CheckArguments, json: bool) -> u8 {
    let report = check::run(&arguments.files, None, check::check_map);
    let problems: usize = report.files.iter().map(|file| file.problems.len()).sum();
    let errors = if report.ok() {
        Vec::new()
    } else {
        vec![Failure::settings(format!("{problems} problems in {} files", report.files.len()))]
    };
    answer_report("check", errors, Vec::new(), &report, json)
}

fn answer_doctor(json: bool) -> u8 {
    let report = doctor::run(Path::new("/"), |name| std::env::var_os(name));
    let told = |check: &doctor::Check| {
        let advice = check.advice.as_deref().unwrap_or_default();
        (format!("{}: {advice}", check.found), check.name)
    };
    let failure = |check| {
        let (message, name) = told(check);
        Failure::requirement(message).at(name)
    };
    let note = |check| {
        let (message, name) = told(check);
        Failure::note("host", message).at(name)
    };
    let errors = report.with(doctor::Status::Fail).map(failure).collect();
    let warnings = report.with(doctor::Status::Warn).map(note).collect();
    answer(Common::new("doctor", errors, warnings), &report, json)
}

fn answer_verify(arguments: VerifyArguments, json: bool) -> u8 {
    let VerifyArguments { paths, maps, filter: filters } = arguments;
    let report = match verify::run(&verify::Options { paths, maps, filters }) {
        Ok(report) => report,
        Err(error) => return answer_failure("verify", error.into(), json),
    };
    let errors = match report.exit_code() {
        0 => Vec::new(),
        _ => vec![Failure::requirement("verdicts differ that are not listed as deviations".to_owned())],
    };
    errors.iter().for_each(tell);
    answer_report("verify", errors, Vec::new(), &report, json)
}

/// The result of a command beside what every command says.
#[derive(Serialize)]
struct Answer<'a, T> {
    #[serde(flatten)]
    common: Common,
    #[serde(flatten)]
    report: &'a T,
}

/// The summary of a session that has ended, well or not; its page goes to the file.
pub(crate) fn summarise(
    command: &'static str,
    ended: Ended,
    mut warnings: Vec<Failure>,
    settings: &Settings,
    threads: usize,
    page_file: Option<&Path>,
) -> Result<RunSummary, Failure> {
    warnings.extend(settings.warnings().iter().map(|warning| Failure::note("settings", warning.to_string())));
    warnings.extend(ended.warnings);
    let mut common = Common::new(command, ended.errors, warnings);
    common.settings_hash = Some(settings.settings_hash());
    common.threads = Some(threads);
    let summary = RunSummary::new(common, ended.result);
    if let (Some(page), Some(file)) = (ended.page, page_file) {
        write_page(page, &summary, file)?;
    }
    Ok(summary)
}

fn write_page(page: Page, summary: &RunSummary, file: &Path) -> Result<(), Failure> {
    let failed = |error: &dyn Display| {
        Failure::output(format!("{} cannot be written: {error}; choose another --report", file.display()))
    };
    let page = page.finish(summary).map_err(|error| failed(&error))?;
    std::fs::write(file, page).map_err(|error| failed(&error))
}

fn tell(failure: &Failure) {
    // With nobody left to read it, nothing can be done.
    let _ = writeln!(std::io::stderr(), "{failure}");
}

/// Prints the answer; gives the exit code, which is another if that fails.
fn print_json(value: &impl Serialize, exit_code: u8) -> u8 {
    match serde_json::to_string_pretty(value) {
        Ok(text) => print(&format!("{text}\n"), exit_code),
        Err(error) => not_printed(&error, exit_code),
    }
}

/// The same of a text. A reader that has enough (a pipe into `head`) is no failure, a full disk is.
fn print(text: &str, exit_code: u8) -> u8 {
    let mut stdout = std::io::stdout();
    match stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => not_printed(&error, exit_code),
        _ => exit_code,
    }
}

/// An answer that nobody gets is a failure, unless there was one that says more.
fn not_printed(error: &dyn Display, exit_code: u8) -> u8 {
    let failure = Failure::output(format!("the result cannot be written to stdout: {error}"));
    tell(&failure);
    if exit_code == 0 { failure.exit_code } else { exit_code }
}
