//! The node's place in the graph: its participant, its endpoints, and what it tells others about them.
//!
//! Topics and services have their names on the wire as every ROS 2 node has them. Endpoints are made on the middleware
//! directly, because only there payloads can pass undecoded; the node announces them itself on `ros_discovery_info`, in
//! the form of the distribution that the program is built for, so that `ros2 node info` shows them. Leaving the graph
//! is said, too: peers see the endpoints go at once instead of after a lease.

use super::middleware::MiddlewareThreads;
use super::payload::{Payload, PayloadAdapter};
use super::qos::Qos;
use futures::{Stream, StreamExt};
use ros2_client::entities_info::{NodeEntitiesInfo, ParticipantEntitiesInfo};
use ros2_client::{Gid, MessageTypeName, NodeName, builtin_topics};
use rustdds::no_key::{DataWriter, DataWriterCdr, DeserializedCacheChange, SimpleDataReader};
use rustdds::{
    DomainParticipant, DomainParticipantBuilder, GUID, Publisher, QosPolicies, RTPSEntity, Subscriber,
    Timestamp, Topic, TopicDescription, TopicKind, WriteOptions, WriteOptionsBuilder,
};
use std::collections::{BTreeMap, BTreeSet};
use std::net::{IpAddr, SocketAddr, UdpSocket};

/// Why the node cannot be in the graph.
#[derive(Debug, thiserror::Error)]
pub enum GraphError {
    /// No participant.
    #[error("domain {domain} cannot be joined: {reason}; is there a network interface, and a free UDP port?")]
    Join {
        /// ROS domain.
        domain: u16,
        /// What the middleware says.
        reason: String,
    },
    /// A topic or service has a name that ROS does not allow.
    #[error(transparent)]
    TopicName(#[from] super::names::NameError),
    /// The middleware does not take the name of the node.
    #[error("the node cannot be named {node}: {reason}")]
    Name {
        /// Fully qualified name.
        node: String,
        /// What the middleware says.
        reason: String,
    },
    /// No endpoint.
    #[error("{topic} cannot be opened: {reason}")]
    Endpoint {
        /// Topic or service.
        topic: String,
        /// What the middleware says.
        reason: String,
    },
    /// The middleware no longer works.
    #[error(
        "the middleware's thread {thread:?} has ended, so that nothing is sent or received any more; \
         see the log for its reason, and start the node again"
    )]
    Dead {
        /// Its name, as far as the system keeps it.
        thread: String,
    },
}

/// Where to join.
#[derive(Debug, Clone, Default)]
pub struct GraphOptions {
    /// ROS domain, 0 to 232.
    pub domain_id: u16,
    /// Addresses of the network interfaces to use; all when empty.
    pub interfaces: Vec<IpAddr>,
}

/// Which endpoint it is that an event of the middleware is about.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Endpoint {
    /// Topic, or service with its direction, as ROS names it.
    pub topic: String,
    /// Type on the wire.
    pub type_name: String,
    /// True if the node writes there.
    pub is_writer: bool,
}

/// A subscription.
pub struct Reader {
    /// Topic as ROS names it.
    pub topic: String,
    pub(super) reader: SimpleDataReader<Payload, PayloadAdapter>,
}

impl Reader {
    /// Everything that comes and can be read; ends with the subscription.
    pub fn payloads(&self) -> impl Stream<Item = Payload> {
        let samples = self.reader.as_async_stream();
        samples.filter_map(|sample| std::future::ready(sample.ok().map(DeserializedCacheChange::into_value)))
    }
}

impl std::fmt::Debug for Reader {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Reader").field("topic", &self.topic).finish_non_exhaustive()
    }
}

/// A publication.
pub struct Writer {
    /// Topic as ROS names it.
    pub topic: String,
    writer: DataWriter<Payload, PayloadAdapter>,
}

/// The middleware does not take a message.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{topic}: the message is not sent: {reason}")]
pub struct WriteError {
    /// Topic as ROS names it.
    pub topic: String,
    /// What the middleware says.
    pub reason: String,
}

impl std::fmt::Debug for Writer {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Writer").field("topic", &self.topic).finish_non_exhaustive()
    }
}

impl Writer {
    /// Sends a message, or what `Message::to_cdr` gives of one. Never waits.
    ///
    /// # Errors
    /// A peer has not acknowledged anything for so long that no more can be kept for it.
    pub fn send(&self, message: impl Into<Payload>) -> Result<(), WriteError> {
        self.send_with(message.into(), WriteOptions::from(Some(Timestamp::now())))
    }

    /// Sends an answer to a request: `related` says in the packet's header which one.
    pub(super) fn answer(&self, cdr: Vec<u8>, related: rustdds::SampleIdentity) -> Result<(), WriteError> {
        let options = WriteOptionsBuilder::new()
            .source_timestamp(Timestamp::now())
            .related_sample_identity(related)
            .build();
        self.send_with(Payload::from(cdr), options)
    }

    fn send_with(&self, payload: Payload, options: WriteOptions) -> Result<(), WriteError> {
        let sent = self.writer.write_with_options(payload, options);
        sent.map(|_| ()).map_err(|error| {
            let reason = match error {
                rustdds::dds::WriteError::WouldBlock { .. } => {
                    "a subscriber has acknowledged nothing for too long".to_owned()
                }
                other => other.to_string(),
            };
            WriteError { topic: self.topic.clone(), reason }
        })
    }

    /// Identity on the wire.
    #[must_use]
    pub fn guid(&self) -> GUID {
        self.writer.guid()
    }
}

/// The node in the graph.
pub struct Graph {
    participant: DomainParticipant,
    publisher: Publisher,
    subscriber: Subscriber,
    node: NodeName,
    announcer: DataWriterCdr<ParticipantEntitiesInfo>,
    endpoints: BTreeMap<GUID, Endpoint>,
    threads: MiddlewareThreads,
}

impl std::fmt::Debug for Graph {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Graph").field("node", &self.node).finish_non_exhaustive()
    }
}

impl Graph {
    /// Joins. `namespace` begins with a slash.
    ///
    /// # Errors
    /// The network or the name cannot be used.
    pub fn join(options: &GraphOptions, namespace: &str, name: &str) -> Result<Self, GraphError> {
        let domain = options.domain_id;
        let refuse =
            |error: rustdds::dds::CreateError| GraphError::Join { domain, reason: error.to_string() };
        let node = NodeName::new(namespace, name).map_err(|error| GraphError::Name {
            node: format!("{}/{name}", namespace.trim_end_matches('/')),
            reason: error.to_string(),
        })?;
        let mut builder = DomainParticipantBuilder::new(domain);
        if !options.interfaces.is_empty() {
            builder = builder.with_only_networks(options.interfaces.iter().copied());
        }
        let others = MiddlewareThreads::now();
        let participant = builder.build().map_err(refuse)?;
        let threads = MiddlewareThreads::since(&others);
        let publisher = participant.create_publisher(&Qos::reliable(1).for_writer()).map_err(refuse)?;
        let subscriber = participant.create_subscriber(&Qos::reliable(1).for_reader()).map_err(refuse)?;
        let discovery = participant
            .create_topic(
                builtin_topics::ros_discovery::TOPIC_NAME.to_owned(),
                builtin_topics::ros_discovery::TYPE_NAME.to_owned(),
                &builtin_topics::ros_discovery::QOS_PUB,
                TopicKind::NoKey,
            )
            .map_err(refuse)?;
        let announcer = publisher.create_datawriter_no_key_cdr(&discovery, None).map_err(refuse)?;
        let endpoints = BTreeMap::new();
        Ok(Self { participant, publisher, subscriber, node, announcer, endpoints, threads })
    }

    /// Opens a subscription on a topic with an absolute name; `type_name` is `package/msg/Name`.
    ///
    /// # Errors
    /// The middleware cannot open it.
    pub fn subscribe(&mut self, topic: &str, type_name: &str, qos: Qos) -> Result<Reader, GraphError> {
        self.open_reader(topic, &format!("rt{topic}"), &dds_type(type_name), qos)
    }

    /// Opens a publication on a topic with an absolute name; `type_name` is `package/msg/Name`.
    ///
    /// # Errors
    /// The middleware cannot open it.
    pub fn advertise(&mut self, topic: &str, type_name: &str, qos: Qos) -> Result<Writer, GraphError> {
        self.open_writer(topic, &format!("rt{topic}"), &dds_type(type_name), qos)
    }

    pub(super) fn open_reader(
        &mut self,
        topic: &str,
        dds_topic: &str,
        dds_type: &str,
        qos: Qos,
    ) -> Result<Reader, GraphError> {
        let policies = qos.for_reader();
        let handle = self.topic(topic, dds_topic, dds_type, &policies)?;
        let reader = self
            .subscriber
            .create_simple_datareader_no_key(&handle, Some(policies))
            .map_err(|error| refused(topic, &error))?;
        self.remember(reader.guid(), topic, &handle, false);
        Ok(Reader { topic: topic.to_owned(), reader })
    }

    pub(super) fn open_writer(
        &mut self,
        topic: &str,
        dds_topic: &str,
        dds_type: &str,
        qos: Qos,
    ) -> Result<Writer, GraphError> {
        let policies = qos.for_writer();
        let handle = self.topic(topic, dds_topic, dds_type, &policies)?;
        let writer = self
            .publisher
            .create_datawriter_no_key(&handle, Some(policies))
            .map_err(|error| refused(topic, &error))?;
        let writer = Writer { topic: topic.to_owned(), writer };
        self.remember(writer.guid(), topic, &handle, true);
        Ok(writer)
    }

    fn topic(
        &self,
        topic: &str,
        dds_topic: &str,
        dds_type: &str,
        policies: &QosPolicies,
    ) -> Result<Topic, GraphError> {
        self.participant
            .create_topic(dds_topic.to_owned(), dds_type.to_owned(), policies, TopicKind::NoKey)
            .map_err(|error| refused(topic, &error))
    }

    fn remember(&mut self, guid: GUID, topic: &str, handle: &Topic, is_writer: bool) {
        let type_name = handle.get_type().name().to_owned();
        self.endpoints.insert(guid, Endpoint { topic: topic.to_owned(), type_name, is_writer });
    }

    /// The endpoint is gone; the next announcement leaves it out.
    pub fn forget(&mut self, guid: GUID) {
        self.endpoints.remove(&guid);
    }

    /// Tells the graph which endpoints are this node's. To be called after endpoints have come or gone.
    pub fn announce(&self) {
        let mut node = NodeEntitiesInfo::new(self.node.clone());
        node.add_writer(Gid::from(self.announcer.guid()));
        for (&guid, endpoint) in &self.endpoints {
            if endpoint.is_writer { node.add_writer(guid.into()) } else { node.add_reader(guid.into()) }
        }
        self.broadcast(vec![node]);
    }

    fn broadcast(&self, nodes: Vec<NodeEntitiesInfo>) {
        let participant = Gid::from(self.participant.guid());
        let announced =
            self.announcer.write(ParticipantEntitiesInfo::new(participant, nodes), Some(Timestamp::now()));
        if let Err(error) = announced {
            tracing::warn!("the node cannot announce itself; tools may not list it: {error}");
        }
    }

    /// Looks whether the middleware still works.
    ///
    /// # Errors
    /// It does not: nothing is sent any more, though it is taken, and nothing is received.
    pub fn check(&self) -> Result<(), GraphError> {
        self.threads.ended().map_or(Ok(()), |thread| Err(GraphError::Dead { thread: thread.to_owned() }))
    }

    /// All endpoints, by their identity on the wire.
    #[must_use]
    pub fn endpoints(&self) -> &BTreeMap<GUID, Endpoint> {
        &self.endpoints
    }

    /// True if all these readers of other nodes can be reached on this machine.
    #[must_use]
    pub fn are_near(&self, readers: &BTreeSet<GUID>) -> bool {
        let known = self.participant.discovered_readers();
        readers.iter().all(|guid| {
            known.iter().find(|known| known.reader_proxy.remote_reader_guid == *guid).is_some_and(|reader| {
                reader.reader_proxy.unicast_locator_list.iter().any(|&locator| {
                    let address = SocketAddr::from(locator);
                    // An address is one of this machine if a socket can have it.
                    UdpSocket::bind((address.ip(), 0)).is_ok()
                })
            })
        })
    }

    /// The participant, for whoever watches the graph.
    #[must_use]
    pub fn participant(&self) -> &DomainParticipant {
        &self.participant
    }
}

impl Drop for Graph {
    fn drop(&mut self) {
        self.broadcast(Vec::new());
    }
}

/// The part of an endpoint's identity that its participant has, too.
pub(super) fn participant_of(guid: &GUID) -> [u8; 12] {
    let mut prefix = [0; 12];
    prefix.copy_from_slice(&guid.to_bytes()[..12]);
    prefix
}

fn refused(topic: &str, error: &rustdds::dds::CreateError) -> GraphError {
    GraphError::Endpoint { topic: topic.to_owned(), reason: error.to_string() }
}

/// `package::msg::dds_::Name_` of `package/msg/Name`.
fn dds_type(type_name: &str) -> String {
    let package = type_name.split('/').next().unwrap_or_default();
    let name = type_name.rsplit('/').next().unwrap_or_default();
    MessageTypeName::new(package, name).dds_msg_type()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Tools of a release find the endpoints of a node only by ids of their own length.
    #[test]
    fn ids_have_the_length_of_the_release() {
        let expected = if cfg!(feature = "humble") { 24 } else { 16 };
        assert_eq!(size_of::<Gid>(), expected);
    }

    #[test]
    fn types_are_named_as_on_the_wire() {
        assert_eq!(dds_type("nav_msgs/msg/Odometry"), "nav_msgs::msg::dds_::Odometry_");
    }
}
