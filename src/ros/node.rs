//! The running node: joins the graph, connects it with the actors, answers for its parameters, and leaves in order.
//!
//! Messages are taken in on a thread of the runtime; the map, which takes long to copy and decode, on a thread of its
//! own. Everything else - services, changes of parameters, the end - happens in [`Node::run`], one thing after another.

use super::environment::ServiceMapping;
use super::estranged::Estranged;
use super::events;
use super::graph::{Graph, GraphError, GraphOptions, Reader, Writer, participant_of};
use super::names::Names;
use super::parameters::{Change, ParameterStore};
use super::payload::Payload;
use super::publications::{GraphSink, Listeners};
use super::qos::Qos;
use super::rosout::Rosout;
use super::services::{Reply, Server};
use super::subscriptions::{self, Throttle};
use crate::report::markers::Markers;
use crate::report::statistics::Statistics;
use crate::session::vehicle_of;
use crate::settings::{AutowareInterface, OpenSpaceGroup, Settings};
use crossbeam_channel::Receiver;
use futures::stream::SelectAll;
use futures::{FutureExt, Stream, StreamExt, pin_mut};
use messages::rcl_interfaces::{Log, ParameterEvent};
use messages::rosgraph_msgs::Clock as ClockMessage;
use messages::{Interface, Message};
use motion::VehicleInfo;
use open_space::{Limits, Planner};
use rustdds::GUID;
use rustdds::no_key::DeserializedCacheChange;
use selection::{Pipeline, Ranker, Validator};
use selector_actors::provider::{ProviderConfig, planner_of};
use selector_actors::publisher::PublishedTimes;
use selector_actors::{
    Clock, Config, InputTopic, OutputTopic, Parameters, RosClock, SelectorSystem, SystemError, Tally,
};
use std::pin::Pin;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};
use tokio::runtime::Handle;
use tokio::sync::{oneshot, watch};
use tokio::task::JoinSet;
use tracing::{info, warn};

pub(super) const ROSOUT_TOPIC: &str = "/rosout";
const CLOCK_TOPIC: &str = "/clock";
const PARAMETER_EVENTS_TOPIC: &str = "/parameter_events";

/// How long a reply waits for its client.
const REPLY_PATIENCE: Duration = Duration::from_secs(1);
/// How often it is looked for.
const REPLY_INTERVAL: Duration = Duration::from_millis(5);
/// How often it is looked whether the middleware still works.
const MIDDLEWARE_INTERVAL: Duration = Duration::from_millis(500);
/// A node that has joined the graph stays for so long, whoever is not heard.
const SHORTEST_STAY: Duration = Duration::from_secs(15);
/// Replies that wait at once; further ones are sent into the blue.
const MAX_WAITING: usize = 64;

/// Everything that a node is started with, and started anew.
#[derive(Debug, Clone)]
pub struct Start {
    /// Its names.
    pub names: Names,
    /// Its parameters.
    pub settings: Arc<Settings>,
    /// Where its graph is.
    pub graph: GraphOptions,
    /// How services find their replies.
    pub mapping: ServiceMapping,
    /// Threads that judge.
    pub threads: usize,
    /// Log lines for `/rosout`, if they are to go there.
    pub rosout: Option<Receiver<Log>>,
    /// Counts and latencies; those that are there already stay.
    pub statistics: Arc<Mutex<Statistics>>,
    /// Peers that were lost and live, as far as the log is overheard.
    pub estranged: Estranged,
}

/// Why a node cannot start or cannot go on.
#[derive(Debug, thiserror::Error)]
pub enum NodeError {
    /// Not in the graph.
    #[error(transparent)]
    Graph(#[from] GraphError),
    /// No dimensions of a vehicle.
    #[error(transparent)]
    Vehicle(#[from] motion::VehicleError),
    /// A filter that does not exist.
    #[error(transparent)]
    Filter(#[from] selection::validator::UnknownFilter),
    /// The actors.
    #[error(transparent)]
    System(#[from] SystemError),
    /// Inputs are no longer taken in.
    #[error("the selector no longer takes messages; see the log for a panic")]
    Dead,
    /// Joining anew helps.
    #[error("{peer} lives and is not heard any more, as it was silent for too long")]
    Estranged {
        /// Number of the peer's participant.
        peer: String,
    },
}

/// What a node has done when it ends.
#[derive(Debug)]
pub struct Ended {
    /// Counts and latencies.
    pub statistics: Arc<Mutex<Statistics>>,
    /// Messages by input.
    pub tally: Arc<Tally>,
    /// Triggers merged into a later cycle.
    pub coalesced: u64,
    /// Its parameters at the end.
    pub settings: Arc<Settings>,
    /// What ended it, if not whoever was asked to.
    pub error: Option<NodeError>,
}

/// A node in its graph.
pub struct Node {
    // The order of the fields is the order of leaving: first no more messages in, then none out, then the graph.
    feeds: Feeds,
    system: SelectorSystem,
    servers: Vec<Server>,
    events: Writer,
    store: ParameterStore,
    clock: Arc<RosClock>,
    statistics: Arc<Mutex<Statistics>>,
    listeners: Listeners,
    estranged: Estranged,
    rosout: Option<Rosout>,
    graph: Graph,
}

/// A reply that waits until its client can be reached: others often ask before both sides know of each other.
struct Waiting {
    server: usize,
    reply: Reply,
    until: Instant,
}

impl std::fmt::Debug for Node {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Node").field("store", &self.store).finish_non_exhaustive()
    }
}

impl Node {
    /// Joins the graph and starts everything. Tasks run on the runtime.
    ///
    /// # Errors
    /// The network, a name or a parameter cannot be used; nothing is left running.
    pub fn start(start: Start, runtime: &Handle) -> Result<Self, NodeError> {
        let Start { names, settings, graph, mapping, threads, rosout, statistics, estranged } = start;
        estranged.clear();
        let vehicle = vehicle_of(&settings)?;
        let validator = Validator::new(settings.validator.clone(), &vehicle)?;
        let ranker = Ranker::new(settings.ranker.clone(), settings.selector.sources());
        let filters: Vec<_> =
            validator.filters().iter().map(selection::validator::LoadedFilter::name).collect();
        let interface = interface_of(&settings);
        let mut graph = Graph::join(&graph, names.namespace(), names.name())?;

        let listeners = Listeners::default();
        let provider = provider_of(&settings, &vehicle);
        let mut topics = OutputTopic::all(interface, &filters);
        topics.extend(provider.is_some().then_some(OutputTopic::OpenSpaceTrajectory));
        let markers = Markers::new(Validator::new(settings.validator.clone(), &vehicle)?);
        let (seen, counts) = (listeners.clone(), statistics.clone());
        let sink = GraphSink::advertise(&mut graph, &names, &topics, markers, interface, seen, counts)?;
        let events = graph.advertise(PARAMETER_EVENTS_TOPIC, ParameterEvent::TYPE_NAME, Qos::PARAMETERS)?;
        let rosout = match rosout {
            Some(lines) => {
                let writer = graph.advertise(ROSOUT_TOPIC, Log::TYPE_NAME, Qos::ROSOUT)?;
                let started = Rosout::start(writer, lines);
                Some(started.map_err(|error| SystemError::NoThread(error.to_string()))?)
            }
            None => None,
        };
        let servers = Server::open_all(&mut graph, &names, mapping)?;
        let mut readers = Vec::new();
        for topic in inputs_of(&settings) {
            let name = names.topic(&topic.ros_name()).map_err(GraphError::from)?;
            readers.push((topic, graph.subscribe(&name, topic.type_name(), Qos::of_input(topic))?));
        }

        let clock = Arc::new(RosClock::new(settings.node.use_sim_time));
        let parameters = parameters_of(&settings);
        let config = Config {
            clock: Clock::Ros(clock.clone()),
            threads,
            fallback_period_ms: parameters.fallback_period_ms,
            duration_time_s: parameters.duration_time_s,
            cycle_budget: parameters.cycle_budget,
            vehicle,
            pipeline: Pipeline::new(validator, ranker),
            interface,
            published_times: PublishedTimes::Measured,
            count_allocations: None,
        };
        let system = SelectorSystem::start_with_provider(config, provider, Box::new(sink))?;
        let mut feeds = Feeds::new(runtime.clone());
        let watch = events::watch(
            graph.participant().clone(),
            graph.endpoints().clone(),
            listeners.clone(),
            system.inlets().tally().clone(),
            estranged.clone(),
        );
        feeds.spawn(async move {
            watch.await;
        });
        for (topic, reader) in readers {
            feeds.feed(subscriptions::feed(reader, topic, interface, system.inlets().clone()), topic);
        }
        let store = ParameterStore::new(names.fully_qualified(), settings);
        let mut node = Self {
            feeds,
            system,
            servers,
            events,
            store,
            clock,
            statistics,
            listeners,
            estranged,
            rosout,
            graph,
        };
        if node.clock.is_simulated() {
            node.follow_clock()?;
        }
        node.graph.announce();
        node.publish_event(&node.store.declared(node.clock.now()));
        info!(
            "{} is in domain {} with {} filters on {threads} threads, interface {interface}",
            names.fully_qualified(),
            node.graph.participant().domain_id(),
            filters.len(),
        );
        Ok(node)
    }

    /// Counts and latencies so far.
    #[must_use]
    pub fn statistics(&self) -> Arc<Mutex<Statistics>> {
        self.statistics.clone()
    }

    /// Runs until `end` is ready, then lets the running cycle end and leaves the graph.
    pub async fn run(mut self, end: impl Future<Output = ()>) -> Ended {
        let servers = std::mem::take(&mut self.servers);
        let mut faults = Throttle::every(Duration::from_secs(1));
        let mut waiting = Vec::new();
        let error = {
            let mut requests = requests_of(&servers);
            let joined = Instant::now();
            let mut look = tokio::time::interval(MIDDLEWARE_INTERVAL);
            look.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
            pin_mut!(end);
            loop {
                tokio::select! {
                    () = &mut end => break None,
                    () = self.feeds.one_ended() => break Some(NodeError::Dead),
                    dead = self.system.death() => break Some(dead.into()),
                    Some((server, request)) = requests.next() => {
                        if let Some(reply) = self.serve(&servers[server], request, &mut faults) {
                            waiting.push(Waiting { server, reply, until: Instant::now() + REPLY_PATIENCE });
                        }
                    }
                    () = tokio::time::sleep(REPLY_INTERVAL), if !waiting.is_empty() => {}
                    _ = look.tick() => if let Err(error) = self.look_after_graph(joined) { break Some(error) },
                }
                self.reply(&servers, &mut waiting, &mut faults);
            }
        };
        drop(servers);
        self.leave(error).await
    }

    /// Whether the middleware works, and hears whoever is there.
    fn look_after_graph(&self, joined: Instant) -> Result<(), NodeError> {
        self.graph.check()?;
        if joined.elapsed() < SHORTEST_STAY {
            return Ok(());
        }
        self.estranged.any(Instant::now()).map_or(Ok(()), |peer| Err(NodeError::Estranged { peer }))
    }

    async fn leave(self, error: Option<NodeError>) -> Ended {
        let Self { feeds, system, events, store, statistics, rosout, graph, .. } = self;
        feeds.end().await;
        let tally = system.inlets().tally().clone();
        let (coalesced, error) = match system.stop() {
            Ok(state) => (state.coalesced, error),
            Err(SystemError::Sink(lost)) => {
                warn!("some outputs were lost, first: {lost}");
                (0, error)
            }
            Err(stopped) => (0, error.or(Some(stopped.into()))),
        };
        drop(events);
        if let Some(rosout) = rosout {
            rosout.end();
        }
        drop(graph);
        Ended { statistics, tally, coalesced, settings: store.settings().clone(), error }
    }

    fn serve(&mut self, server: &Server, request: Request, faults: &mut Throttle) -> Option<Reply> {
        let served = match request {
            Ok(request) => server.serve(&request, &mut self.store, self.clock.now()),
            Err(error) => {
                faults.warn(|| format!("a request cannot be read: {error}"));
                return None;
            }
        };
        match served {
            Ok((reply, change)) => {
                if let Some(change) = change {
                    self.apply(&change);
                }
                Some(reply)
            }
            Err(error) => {
                faults.warn(|| error.to_string());
                None
            }
        }
    }

    /// Sends the replies whose clients can be reached, and those that have waited long enough.
    fn reply(&self, servers: &[Server], waiting: &mut Vec<Waiting>, faults: &mut Throttle) {
        let now = Instant::now();
        let too_many = waiting.len() > MAX_WAITING;
        let ready = |waiting: &mut Waiting| {
            let readers = self.listeners.of(servers[waiting.server].replies().guid());
            let client = waiting.reply.client();
            too_many || now >= waiting.until || readers.iter().any(|reader| participant_of(reader) == client)
        };
        for Waiting { server, reply, .. } in waiting.extract_if(.., ready) {
            let server = &servers[server];
            let is_near = self.graph.are_near(&self.listeners.of(server.replies().guid()));
            if let Err(error) = server.send(reply, is_near) {
                faults.warn(|| error.to_string());
            }
        }
    }

    /// Takes over changed parameters: the actors between two cycles, the clock at once.
    fn apply(&mut self, change: &Change) {
        self.system.configure(parameters_of(&change.settings));
        if let Some(simulated) = change.use_sim_time {
            self.clock.simulate(simulated);
            if simulated {
                if let Err(error) = self.follow_clock() {
                    warn!("time stands still: {error}");
                }
            } else if let Some(reader) = self.feeds.stop_clock() {
                self.graph.forget(reader);
            }
            self.graph.announce();
        }
        change.events.iter().for_each(|event| self.publish_event(event));
        info!("Parameters are updated.");
    }

    fn follow_clock(&mut self) -> Result<(), GraphError> {
        let reader = self.graph.subscribe(CLOCK_TOPIC, ClockMessage::TYPE_NAME, Qos::CLOCK)?;
        self.feeds.follow_clock(reader, self.clock.clone());
        Ok(())
    }

    fn publish_event(&self, event: &ParameterEvent) {
        if let Err(error) = self.events.send(event.to_cdr(Interface::default())) {
            warn!("{error}");
        }
    }
}

type Request = rustdds::dds::ReadResult<DeserializedCacheChange<Payload>>;
type Requests<'a> = SelectAll<Pin<Box<dyn Stream<Item = (usize, Request)> + Send + 'a>>>;

/// All requests of all services, with the number of the service.
fn requests_of(servers: &[Server]) -> Requests<'_> {
    let mut requests = SelectAll::new();
    for (number, server) in servers.iter().enumerate() {
        let stream = server.requests.reader.as_async_stream().map(move |request| (number, request));
        requests.push(Box::pin(stream) as Pin<Box<dyn Stream<Item = _> + Send + '_>>);
    }
    requests
}

/// The tasks that bring messages.
struct Feeds {
    runtime: Handle,
    tasks: JoinSet<()>,
    clock: Option<(GUID, tokio::task::AbortHandle)>,
    /// Set to true when the map's thread is to end.
    ending: watch::Sender<bool>,
    map_thread: Option<std::thread::JoinHandle<()>>,
}

impl Feeds {
    fn new(runtime: Handle) -> Self {
        let (tasks, ending) = (JoinSet::new(), watch::Sender::new(false));
        Self { runtime, tasks, clock: None, ending, map_thread: None }
    }

    fn spawn(&mut self, task: impl Future<Output = ()> + Send + 'static) -> tokio::task::AbortHandle {
        self.tasks.spawn_on(task, &self.runtime)
    }

    fn feed(&mut self, task: impl Future<Output = ()> + Send + 'static, topic: InputTopic) {
        if topic != InputTopic::Map {
            self.spawn(task);
            return;
        }
        let (runtime, mut ending) = (self.runtime.clone(), self.ending.subscribe());
        let (alive, gone) = oneshot::channel::<()>();
        let thread = std::thread::Builder::new().name("map-inlet".to_owned()).spawn(move || {
            let _alive = alive;
            runtime.block_on(async {
                tokio::select! {
                    () = task => {}
                    // An error means that the node is gone.
                    _ = ending.wait_for(|ending| *ending) => {}
                }
            });
        });
        match thread {
            Ok(thread) => self.map_thread = Some(thread),
            Err(error) => warn!("no map will be received: {error}"),
        }
        // The thread stands among the tasks: one that ends before its time ends the node.
        self.spawn(async {
            let _ = gone.await;
        });
    }

    fn follow_clock(&mut self, reader: Reader, clock: Arc<RosClock>) {
        self.stop_clock();
        let guid = reader.reader.guid();
        let task = self.spawn(follow_clock(reader, clock));
        self.clock = Some((guid, task));
    }

    /// The reader that is gone now, if there was one.
    fn stop_clock(&mut self) -> Option<GUID> {
        let (reader, task) = self.clock.take()?;
        task.abort();
        Some(reader)
    }

    /// Returns when a task has ended that should have gone on.
    async fn one_ended(&mut self) {
        loop {
            match self.tasks.join_next().await {
                // The clock was switched off.
                Some(Err(error)) if error.is_cancelled() => {}
                Some(_) => return,
                None => std::future::pending().await,
            }
        }
    }

    async fn end(mut self) {
        self.ending.send_replace(true);
        self.tasks.shutdown().await;
        if let Some(thread) = self.map_thread.take()
            && thread.join().is_err()
        {
            warn!("the thread that receives maps has panicked");
        }
    }
}

/// Sets the clock from `/clock` for as long as the task lives.
async fn follow_clock(reader: Reader, clock: Arc<RosClock>) {
    let mut malformed = Throttle::every(Duration::from_secs(1));
    let stream = reader.reader.as_async_stream();
    pin_mut!(stream);
    while let Some(sample) = stream.next().await {
        let mut newest = sample;
        while let Some(Some(next)) = stream.next().now_or_never() {
            newest = next;
        }
        match newest {
            Ok(change) => {
                let bytes = change.sample.as_bytes();
                match ClockMessage::from_cdr(bytes, Interface::default(), CLOCK_TOPIC) {
                    Ok(message) => clock.set(message.clock),
                    Err(error) => malformed.warn(|| error.to_string()),
                }
            }
            Err(error) => malformed.warn(|| format!("{CLOCK_TOPIC}: a message cannot be read: {error}")),
        }
    }
}

/// What of the settings takes effect in the actors.
fn parameters_of(settings: &Settings) -> Parameters {
    Parameters {
        fallback_period_ms: settings.selector.fallback_period_ms,
        duration_time_s: settings.concatenator.duration_time,
        cycle_budget: Some(settings.selector.cycle_budget()),
        validator: settings.validator.clone(),
        ranker: settings.ranker.clone(),
        sources: settings.selector.sources(),
    }
}

/// What the node listens to.
fn inputs_of(settings: &Settings) -> impl Iterator<Item = InputTopic> {
    let provider = settings.open_space.enable.then_some(InputTopic::OPEN_SPACE);
    InputTopic::ALL.into_iter().chain(provider.into_iter().flatten())
}

/// The open-space provider, if it is switched on.
fn provider_of(settings: &Settings, vehicle: &VehicleInfo) -> Option<ProviderConfig> {
    let OpenSpaceGroup { enable, region, provider, planner, partition, fallback } =
        settings.open_space.clone();
    let limits = Limits::from(planner.limits);
    let near_m = provider.is_near_destination_threshold;
    let make_planner = planner_of(move || Planner::new(planner.clone()), *vehicle, limits, near_m);
    enable.then_some(ProviderConfig { provider, partition, fallback, region, make_planner })
}

/// The wire form of candidates.
pub(crate) fn interface_of(settings: &Settings) -> Interface {
    match settings.selector.autoware_interface {
        AutowareInterface::V0_52 => Interface::V0_52,
        AutowareInterface::V0_53 => Interface::V0_53,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[allow(clippy::panic, reason = "it is what is looked for")]
    fn whatever_no_longer_brings_messages_is_noticed() {
        let runtime =
            tokio::runtime::Builder::new_multi_thread().worker_threads(1).enable_time().build().unwrap();
        for topic in [InputTopic::Odometry, InputTopic::Map] {
            let mut feeds = Feeds::new(runtime.handle().clone());
            feeds.feed(std::future::pending(), topic);
            assert!(feeds.one_ended().now_or_never().is_none(), "{topic:?}");
            feeds.feed(async { panic!("of a test") }, topic);
            let noticed = runtime
                .block_on(async { tokio::time::timeout(Duration::from_secs(60), feeds.one_ended()).await });
            assert!(noticed.is_ok(), "{topic:?}");
            runtime.block_on(feeds.end());
        }
    }
}
