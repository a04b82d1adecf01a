//! What the middleware tells about other nodes: who fits and who does not.
//!
//! A peer that does not fit is the commonest reason why a graph stays silent, and the middleware is silent about it.
//! Here each such peer is one warning, with the topic, the peer, and what to change.

use super::estranged::Estranged;
use super::graph::{Endpoint, participant_of};
use super::publications::Listeners;
use super::qos;
use super::subscriptions::{Throttle, peer};
use futures::{StreamExt, pin_mut};
use rustdds::{
    DomainParticipant, DomainParticipantStatusEvent, EndpointDescription, GUID, QosPolicies, RTPSEntity,
    StatusEvented,
};
use selector_actors::Tally;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::time::{Duration, Instant};
use tracing::{info, warn};

/// Peers that a warning was given about; after so many it is given again.
const MAX_WARNED: usize = 1024;
/// Departures that are told of in a period: of a whole vehicle's nodes, all.
const DEPARTURES: u32 = 100;
const DEPARTURES_PERIOD: Duration = Duration::from_secs(10);

/// Watches the graph until the task is dropped. `endpoints` are the node's own.
pub async fn watch(
    participant: DomainParticipant,
    endpoints: BTreeMap<GUID, Endpoint>,
    listeners: Listeners,
    tally: Arc<Tally>,
    estranged: Estranged,
) {
    let own = participant_of(&participant.guid());
    let listener = participant.status_listener();
    drop(participant);
    let departures = Throttle::at_most(DEPARTURES, DEPARTURES_PERIOD);
    let mut watcher = Watcher { own, endpoints, listeners, tally, warned: BTreeSet::new(), departures };
    let events = listener.as_async_status_stream();
    pin_mut!(events);
    while let Some(event) = events.next().await {
        estranged.take(&event, |reader| watcher.is_input(reader), Instant::now());
        watcher.take(event);
    }
}

struct Watcher {
    own: [u8; 12],
    endpoints: BTreeMap<GUID, Endpoint>,
    listeners: Listeners,
    tally: Arc<Tally>,
    warned: BTreeSet<(String, GUID)>,
    /// For peers that leave: a crowd of them must not fill the log.
    departures: Throttle,
}

impl Watcher {
    /// True for readers of topics; those of services hear only questions.
    fn is_input(&self, reader: GUID) -> bool {
        self.endpoints.get(&reader).is_some_and(|own| own.type_name.contains("::msg::"))
    }

    fn take(&mut self, event: DomainParticipantStatusEvent) {
        match event {
            DomainParticipantStatusEvent::RemoteReaderMatched { local_writer, remote_reader } => {
                self.listeners.add(local_writer, remote_reader);
            }
            DomainParticipantStatusEvent::ReaderLost { guid, .. } => self.listeners.remove(guid),
            DomainParticipantStatusEvent::RemoteWriterQosIncompatible {
                local_reader,
                remote_writer,
                requested_qos,
                offered_qos,
            } => self.incompatible(local_reader, remote_writer, &offered_qos, &requested_qos),
            DomainParticipantStatusEvent::RemoteReaderQosIncompatible {
                local_writer,
                remote_reader,
                requested_qos,
                offered_qos,
            } => self.incompatible(local_writer, remote_reader, &offered_qos, &requested_qos),
            DomainParticipantStatusEvent::WriterDetected { writer } => self.compare_type(&writer, false),
            DomainParticipantStatusEvent::ReaderDetected { reader } => self.compare_type(&reader, true),
            DomainParticipantStatusEvent::ParticipantLost { id, reason } => {
                let line = || format!("The participant {id:?} has left the graph: {reason:?}");
                if let Some(line) = self.departures.pass(Instant::now(), line) {
                    info!("{line}");
                }
            }
            _ => {}
        }
    }

    fn incompatible(&mut self, own: GUID, remote: GUID, offered: &QosPolicies, requested: &QosPolicies) {
        let Some(endpoint) = self.endpoints.get(&own) else { return };
        let topic = endpoint.topic.clone();
        let (who, effect) = if endpoint.is_writer {
            ("subscriber", "it gets no message from this node")
        } else {
            ("publisher", "this node gets no message from it")
        };
        if self.is_new(&topic, remote) {
            self.tally.count_incompatible_peer();
            let what = qos::differences(offered, requested);
            let what = if what.is_empty() { "its profile differs".to_owned() } else { what };
            warn!(
                "{topic}: the quality of service of {who} {} does not fit ({what}); {effect}",
                peer(remote)
            );
        }
    }

    /// A type of another name never matches, and nobody says so.
    fn compare_type(&mut self, remote: &EndpointDescription, is_reader: bool) {
        if participant_of(&remote.guid) == self.own {
            return;
        }
        let Some(topic) = remote.topic_name.strip_prefix("rt") else { return };
        let ours = self.endpoints.values().find(|own| {
            own.is_writer == is_reader && own.topic == topic && own.type_name != remote.type_name
        });
        let Some(ours) = ours else { return };
        let who = if is_reader { "subscriber" } else { "publisher" };
        let text = format!(
            "{topic}: {who} {} has the type {}, this node {}; no message passes between them",
            peer(remote.guid),
            remote.type_name,
            ours.type_name
        );
        if self.is_new(topic, remote.guid) {
            self.tally.count_incompatible_peer();
            warn!("{text}");
        }
    }

    fn is_new(&mut self, topic: &str, remote: GUID) -> bool {
        if self.warned.len() >= MAX_WARNED {
            self.warned.clear();
        }
        self.warned.insert((topic.to_owned(), remote))
    }
}
