//! `top`: the selector at work, on a terminal - over a recorded drive in this process, or elsewhere in a graph.

use super::node::graph_options;
use super::recording::RecordingArguments;
use super::{Common, Failure, JudgeArguments};
use crate::recorder::Recorder;
use crate::report::summary::Input;
use crate::ros::environment::Environment;
use crate::ros::names::Names;
use crate::ros::node::NodeError;
use crate::ros::watcher::Watcher;
use crate::session::{BadRate, Ended, Rate, Session};
use crate::top::Told;
use crate::top::screen::{self, Screen, Wish};
use clap::Args;
use crossbeam_channel::{Sender, bounded};
use selector_actors::topics::NODE_NAME;
use serde::Serialize;
use std::collections::BTreeMap;
use std::io::{self, IsTerminal, Write};
use std::net::IpAddr;
use std::path::PathBuf;
use std::thread::JoinHandle;
use tokio::runtime::Runtime;
use tokio::signal::unix::{SignalKind, signal};
use tracing::level_filters::LevelFilter;

/// What may wait for the screen: many times what comes between two frames.
const MAX_UNSEEN: usize = 8192;

/// Keys that may wait for the screen.
const MAX_WISHES: usize = 64;

/// Arguments of `top`.
#[derive(Debug, Args)]
pub struct TopArguments {
    /// The recording to play: a .mcap file, a rosbag2 folder, or a .db3 file.
    #[arg(value_name = "DRIVE", required_unless_present = "node")]
    pub drive: Option<PathBuf>,
    /// Watch a running node instead, by its full name.
    #[arg(
        long,
        value_name = "NAME",
        num_args = 0..=1,
        require_equals = true,
        default_missing_value = "/trajectory_selector_node",
        conflicts_with = "drive"
    )]
    pub node: Option<String>,
    /// Seconds of the drive per second.
    #[arg(long, default_value = "1", value_name = "X", value_parser = parse_pace)]
    pub rate: f64,
    /// What every command that judges takes.
    #[command(flatten)]
    pub judge: JudgeArguments,
    /// How the recording is taken.
    #[command(flatten)]
    pub recording: RecordingArguments,
    /// Address of a network interface to use with --node; may be given more than once [default: all].
    #[arg(long, value_name = "ADDRESS")]
    pub interface_address: Vec<IpAddr>,
}

/// At full speed nobody could watch, and nothing would take any time on the node's clock.
fn parse_pace(text: &str) -> Result<f64, BadRate> {
    match text.parse()? {
        Rate::Times(rate) => Ok(rate),
        Rate::Max => Err(BadRate(text.to_owned())),
    }
}

/// What was seen.
#[derive(Debug, Serialize)]
pub struct TopReport {
    /// What every command says.
    #[serde(flatten)]
    pub common: Common,
    /// Drive or node.
    pub source: String,
    /// Cycles by what started them.
    pub cycles: BTreeMap<String, u64>,
}

/// Shows the selector at work until somebody quits.
///
/// # Errors
/// There is no terminal, or nothing to watch.
pub fn run(arguments: &TopArguments, level: Option<LevelFilter>) -> Result<TopReport, Failure> {
    if !io::stdout().is_terminal() {
        let text = "error: `top` draws on a terminal, and stdout is none; \
                    `replay DRIVE --report FILE.html` writes a page to be looked at later";
        return Err(Failure::usage(text.to_owned()));
    }
    let (told, heard) = bounded(MAX_UNSEEN);
    // A line of the log in the middle of the screen would garble it.
    let _ = tracing_subscriber::fmt()
        .with_max_level(level.unwrap_or(LevelFilter::WARN))
        .with_writer({
            let told = told.clone();
            move || LogLine(told.clone())
        })
        .with_ansi(false)
        .without_time()
        .with_target(false)
        .try_init();
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(1)
        .thread_name("graph")
        .enable_all()
        .build()
        .map_err(|error| Failure::internal(format!("the runtime cannot be started: {error}")))?;
    let (wishes, wished) = bounded(MAX_WISHES);
    quit_at_signals(&runtime, &wishes)?;
    let source = Source::start(arguments, &runtime, &told)?;
    let gone = |error: io::Error| Failure::output(format!("the terminal cannot be drawn on: {error}"));
    let board = {
        let mut screen = Screen::open(told).map_err(gone)?;
        screen::listen(wishes).map_err(gone)?;
        screen.show(source.name(), &heard, &wished).map_err(gone)?
    };
    let name = source.name().to_owned();
    let common = Common::new("top", source.finish(), Vec::new());
    // The reading tasks do not end on their own.
    runtime.shutdown_background();
    Ok(TopReport { common, source: name, cycles: board.triggers })
}

/// What is watched.
enum Source {
    Drive { name: String, thread: JoinHandle<Result<Ended, Failure>> },
    Node { name: String, _watcher: Box<Watcher> },
}

impl Source {
    fn start(arguments: &TopArguments, runtime: &Runtime, told: &Sender<Told>) -> Result<Self, Failure> {
        match &arguments.node {
            Some(node) => Self::watch(node, arguments, runtime, told),
            None => Self::play(arguments, told.clone()),
        }
    }

    fn watch(
        node: &str,
        arguments: &TopArguments,
        runtime: &Runtime,
        told: &Sender<Told>,
    ) -> Result<Self, Failure> {
        let (namespace, name) = node.rsplit_once('/').unwrap_or(("", node));
        let name = if name.is_empty() { NODE_NAME } else { name };
        let names = Names::new(name, namespace, &[])?;
        let environment = Environment::read(|name| std::env::var_os(name))?;
        let options = graph_options(&arguments.interface_address, &environment);
        // The middleware starts tasks of its own.
        let _entered = runtime.enter();
        let watcher = Watcher::join(&options, &names, runtime.handle(), told).map_err(NodeError::from)?;
        Ok(Self::Node { name: names.fully_qualified().to_owned(), _watcher: Box::new(watcher) })
    }

    fn play(arguments: &TopArguments, told: Sender<Told>) -> Result<Self, Failure> {
        let path = arguments.drive.as_deref().ok_or_else(|| Failure::usage("error: no DRIVE".to_owned()))?;
        let settings = arguments.judge.settings()?;
        let map = arguments.recording.map()?;
        let drive = arguments.recording.open(path)?;
        let odd = settings.warnings().iter().map(ToString::to_string);
        for odd in odd.chain(drive.warnings().iter().map(ToString::to_string)) {
            let _ = told.try_send(Told::Warning(odd));
        }
        let session = Session {
            input: Input { name: path.display().to_string(), seed: None },
            interface: drive.interface(),
            span: (drive.start(), drive.end()),
            threads: arguments.judge.threads(),
            rate: Rate::Times(arguments.rate),
            output: None,
            map,
            watch: None,
            page: false,
            markers: false,
            progress: false,
        };
        let recorder = Recorder::counting();
        recorder.lock().tap = Some(told.clone());
        let drive = move || {
            let ended = session.measure(&recorder, &settings, drive);
            let error = match &ended {
                Ok(ended) => ended.errors.first(),
                Err(error) => Some(error),
            };
            let text = error.map_or("the drive is over".to_owned(), ToString::to_string);
            let _ = told.try_send(Told::Ended(text));
            ended
        };
        let thread = std::thread::Builder::new().name("drive".to_owned()).spawn(drive);
        let thread =
            thread.map_err(|error| Failure::internal(format!("no thread for the drive: {error}")))?;
        Ok(Self::Drive { name: path.display().to_string(), thread })
    }

    fn name(&self) -> &str {
        match self {
            Self::Drive { name, .. } | Self::Node { name, .. } => name,
        }
    }

    /// What failed. A drive that is still running writes nothing, and ends with the program.
    fn finish(self) -> Vec<Failure> {
        match self {
            Self::Drive { thread, .. } if thread.is_finished() => match thread.join() {
                Ok(Ok(ended)) => ended.errors,
                Ok(Err(failure)) => vec![failure],
                Err(_) => vec![Failure::internal("the drive ended by a panic".to_owned())],
            },
            Self::Drive { .. } | Self::Node { .. } => Vec::new(),
        }
    }
}

/// Being asked to end is a wish like others.
fn quit_at_signals(runtime: &Runtime, wishes: &Sender<Wish>) -> Result<(), Failure> {
    let _entered = runtime.enter();
    for kind in [SignalKind::interrupt(), SignalKind::terminate(), SignalKind::hangup()] {
        let mut signal = signal(kind)
            .map_err(|error| Failure::internal(format!("signals cannot be received: {error}")))?;
        let wishes = wishes.clone();
        runtime.spawn(async move {
            while signal.recv().await.is_some() {
                let _ = wishes.try_send(Wish::Quit);
            }
        });
    }
    Ok(())
}

/// A line of the log on its way to the board. The subscriber writes each line in one go.
struct LogLine(Sender<Told>);

impl Write for LogLine {
    fn write(&mut self, line: &[u8]) -> io::Result<usize> {
        let _ = self.0.try_send(Told::Warning(String::from_utf8_lossy(line).trim().to_owned()));
        Ok(line.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pace_is_a_number() {
        assert_eq!(parse_pace("2.5"), Ok(2.5));
        for bad in ["max", "0", "-1", "fast"] {
            assert!(parse_pace(bad).is_err(), "{bad}");
        }
    }
}
