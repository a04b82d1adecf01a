//! `node`: the selector as a node in a ROS 2 graph, until it is told to stop.

use super::{Failure, summarise};
use crate::report::summary::{Input, Received, RunResult, RunSummary};
use crate::ros::arguments::{LogLevel, RosArguments};
use crate::ros::environment::{Discovery, Environment, ServiceMapping};
use crate::ros::estranged::Estranged;
use crate::ros::graph::GraphOptions;
use crate::ros::logging::{Levels, RosLog, Severity, rosout_queue};
use crate::ros::names::Names;
use crate::ros::node::{Ended, Node, NodeError, Start};
use crate::ros::parameter_files;
use crate::session;
use clap::{Args, ValueEnum};
use crossbeam_channel::Receiver;
use messages::rcl_interfaces::Log;
use selector_actors::topics::NODE_NAME;
use selector_actors::{DropReason, InputTopic, Tally};
use std::collections::BTreeMap;
use std::net::{IpAddr, Ipv4Addr};
use std::sync::{Arc, PoisonError};
use std::time::Instant;
use tokio::runtime::Runtime;
use tokio::signal::unix::{Signal, SignalKind, signal};
use tracing::level_filters::LevelFilter;
use tracing::{Level, debug, info, warn};

/// Receive buffer that the middleware asks for, bytes.
const WANTED_RECEIVE_BUFFER: u64 = 8 << 20;

/// Arguments of `node` beside those of ROS.
#[derive(Debug, Args)]
#[command(
    after_help = "ROS arguments follow --ros-args: -r FROM:=TO, -p NAME:=VALUE, --params-file FILE, --log-level LEVEL."
)]
pub struct NodeArguments {
    /// Threads that judge [default: the cores].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=256))]
    pub threads: Option<u16>,
    /// Address of a network interface to use; may be given more than once [default: all].
    #[arg(long, value_name = "ADDRESS")]
    pub interface_address: Vec<IpAddr>,
    /// How services find their replies [default: as RMW_IMPLEMENTATION says].
    #[arg(long, value_name = "MAPPING")]
    pub service_mapping: Option<Mapping>,
}

/// How services find their replies.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub enum Mapping {
    /// As rmw_fastrtps.
    Enhanced,
    /// As rmw_cyclonedds.
    Cyclone,
}

/// Runs the node.
///
/// # Errors
/// It cannot be started; nothing was left running.
pub fn run(arguments: &NodeArguments, ros: &RosArguments, cli: &Output) -> Result<RunSummary, Failure> {
    let started = Instant::now();
    let names = Names::new(NODE_NAME, "", &ros.remaps)?;
    let environment = Environment::read(|name| std::env::var_os(name))?;
    let estranged = Estranged::default();
    let rosout = log(&names, &environment, ros, cli, &estranged)?;
    let parameters = parameter_files::load(&names, &ros.parameters)?;
    ros.ignored.iter().for_each(|argument| debug!("{argument} has no effect here"));
    parameters
        .undeclared
        .iter()
        .for_each(|parameter| debug!("{} is no parameter of this node", parameter.name));
    for note in &environment.notes {
        match note.severity() {
            Severity::Debug | Severity::Info => info!("{note}"),
            Severity::Warn | Severity::Error | Severity::Fatal => warn!("{note}"),
        }
    }
    let settings = Arc::new(parameters.settings);
    settings.warnings().iter().for_each(|warning| warn!("{warning}"));
    warn_of_small_buffers();

    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(1)
        .thread_name("graph")
        .enable_all()
        .build()
        .map_err(|error| Failure::internal(format!("the runtime cannot be started: {error}")))?;
    let threads = arguments.threads.map_or_else(super::cores, usize::from);
    let start = Start {
        graph: graph_options(&arguments.interface_address, &environment),
        mapping: mapping(arguments, &environment),
        settings: settings.clone(),
        threads,
        names: names.clone(),
        rosout,
        statistics: Arc::default(),
        estranged,
    };
    let ran = stay_in_graph(start, &runtime)?;
    info!("{} has left the graph", names.fully_qualified());
    summary(&names, &settings, threads, ran, started)
}

/// What a node has done in all.
struct Ran {
    /// Its last time in the graph, with the statistics of all.
    last: Ended,
    messages: BTreeMap<String, Received>,
    coalesced: u64,
}

/// Runs the node until it is told to stop, or cannot go on. One that has lost living peers joins the graph anew, with the
/// parameters that it had.
fn stay_in_graph(mut start: Start, runtime: &Runtime) -> Result<Ran, Failure> {
    let signals = runtime.block_on(async { Signals::listen() })?;
    let mut end = Box::pin(signals.first());
    let (mut messages, mut coalesced) = (BTreeMap::<String, Received>::new(), 0);
    loop {
        let node = Node::start(start.clone(), runtime.handle())?;
        let last = runtime.block_on(node.run(&mut end));
        for (topic, more) in received(&last.tally) {
            messages.entry(topic).or_default().add(&more);
        }
        coalesced += last.coalesced;
        let Some(error @ NodeError::Estranged { .. }) = &last.error else {
            return Ok(Ran { last, messages, coalesced });
        };
        warn!("{error}; the node joins the graph anew");
        start.settings = last.settings;
    }
}

/// What the program's own arguments say about its output.
#[derive(Debug, Clone, Copy)]
pub struct Output {
    /// Only JSON goes to stdout.
    pub json: bool,
    /// Lowest level of log lines, if given.
    pub level: Option<LevelFilter>,
}

/// Takes in the log lines of the process; gives those that are for `/rosout`.
fn log(
    names: &Names,
    environment: &Environment,
    ros: &RosArguments,
    output: &Output,
    estranged: &Estranged,
) -> Result<Option<Receiver<Log>>, Failure> {
    let own = output.level.and_then(severity).map(|level| LogLevel { logger: None, level: Some(level) });
    let levels: Vec<LogLevel> = own.into_iter().chain(ros.log_levels.iter().cloned()).collect();
    let mut console = environment.console.clone();
    console.to_stdout &= !output.json;
    let console = ros.stdout_logs.unwrap_or(true).then_some(&console);
    let (sender, receiver) = rosout_queue();
    let to_rosout = ros.rosout_logs.unwrap_or(true);
    RosLog::new(&names.logger(), Levels::new(&levels), console, to_rosout.then_some(sender))
        .install(estranged)
        .map_err(|error| Failure::internal(error.to_string()))?;
    Ok(to_rosout.then_some(receiver))
}

fn severity(level: LevelFilter) -> Option<Severity> {
    Some(match level.into_level()? {
        Level::ERROR => Severity::Error,
        Level::WARN => Severity::Warn,
        Level::INFO => Severity::Info,
        _ => Severity::Debug,
    })
}

pub(super) fn graph_options(addresses: &[IpAddr], environment: &Environment) -> GraphOptions {
    let interfaces = match environment.discovery {
        _ if !addresses.is_empty() => addresses.to_vec(),
        Discovery::Localhost => vec![IpAddr::V4(Ipv4Addr::LOCALHOST)],
        Discovery::Subnet => Vec::new(),
    };
    GraphOptions { domain_id: environment.domain_id, interfaces }
}

fn mapping(arguments: &NodeArguments, environment: &Environment) -> ServiceMapping {
    match arguments.service_mapping {
        Some(Mapping::Enhanced) => ServiceMapping::Enhanced,
        Some(Mapping::Cyclone) => ServiceMapping::Cyclone,
        None => environment.service_mapping,
    }
}

/// The kernel grants less than is asked for without a word, and maps then arrive seconds late.
fn warn_of_small_buffers() {
    const LIMIT: &str = "/proc/sys/net/core/rmem_max";
    let granted = std::fs::read_to_string(LIMIT).ok().and_then(|text| text.trim().parse::<u64>().ok());
    if let Some(granted) = granted.filter(|granted| *granted < WANTED_RECEIVE_BUFFER) {
        warn!(
            "Receive buffers are limited to {granted} bytes, large messages will be slow; \
             raise the limit with `sysctl -w net.core.rmem_max={WANTED_RECEIVE_BUFFER}`"
        );
    }
}

/// The two ways of asking a process to end.
struct Signals {
    interrupt: Signal,
    terminate: Signal,
}

impl Signals {
    fn listen() -> Result<Self, Failure> {
        let listen = |kind| {
            signal(kind).map_err(|error| Failure::internal(format!("signals cannot be received: {error}")))
        };
        Ok(Self { interrupt: listen(SignalKind::interrupt())?, terminate: listen(SignalKind::terminate())? })
    }

    /// Returns at the first signal. At the second one the process ends at once, whatever it is doing.
    async fn first(mut self) {
        self.next().await;
        info!("Stopping");
        tokio::spawn(async move {
            self.next().await;
            std::process::exit(1);
        });
    }

    async fn next(&mut self) {
        tokio::select! {
            _ = self.interrupt.recv() => {}
            _ = self.terminate.recv() => {}
        }
    }
}

fn summary(
    names: &Names,
    settings: &crate::settings::Settings,
    threads: usize,
    ran: Ran,
    started: Instant,
) -> Result<RunSummary, Failure> {
    let Ran { last, messages, coalesced } = ran;
    let statistics = std::mem::take(&mut *last.statistics.lock().unwrap_or_else(PoisonError::into_inner));
    let result = RunResult {
        input: Input { name: names.fully_qualified().to_owned(), seed: None },
        interface: crate::ros::node::interface_of(settings).name(),
        statistics,
        messages,
        coalesced,
        output: None,
        wall: started.elapsed(),
    };
    let errors = last.error.iter().map(|error| Failure::internal(error.to_string())).collect();
    let ended = session::Ended { result, watched: None, page: None, errors, warnings: Vec::new() };
    summarise("node", ended, Vec::new(), settings, threads, None)
}

/// What came in on each topic, and what of it was dropped. Topics of the open-space provider are told of if anything
/// came.
pub(crate) fn received(tally: &Tally) -> BTreeMap<String, Received> {
    let of = |topic: InputTopic| {
        let dropped = DropReason::ALL
            .into_iter()
            .map(|reason| (reason.name(), tally.dropped(topic, reason)))
            .filter(|(_, count)| *count > 0);
        (topic.full_name(), Received { received: tally.received(topic), dropped: dropped.collect() })
    };
    let is_used = |topic: &InputTopic| tally.received(*topic) > 0;
    let provider = InputTopic::OPEN_SPACE.into_iter().filter(is_used);
    InputTopic::ALL.into_iter().chain(provider).map(of).collect()
}
