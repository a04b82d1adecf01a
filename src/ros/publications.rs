//! What the node publishes, onto its topics in the graph.
//!
//! All topics are advertised at start, so that others find them before the first cycle. Debug topics and all sets of
//! candidates but the first are encoded only while somebody listens, markers only then worked out; everything that
//! others may drive by is always sent. Sending never waits for a peer.

use super::encoder::Encoder;
use super::graph::{Graph, GraphError, Writer};
use super::names::Names;
use super::qos::Qos;
use crate::report::markers::{MarkerTopic, Markers};
use crate::report::statistics::Statistics;
use messages::{Interface, Message};
use rustdds::GUID;
use selector_actors::cycle::{CycleReport, CycleTimes};
use selector_actors::{OutputTopic, Publication, Sink, SinkError};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Who listens to what: kept up to date by the events of the graph.
#[derive(Debug, Clone, Default)]
pub struct Listeners(Arc<Mutex<BTreeMap<GUID, BTreeSet<GUID>>>>);

/// Readers remembered per topic. Whoever has more of them is listened to all the same.
const MAX_LISTENERS: usize = 1024;

/// Generators counted by name.
const MAX_GENERATORS: usize = 4096;

impl Listeners {
    /// A reader of what the writer sends has come.
    pub fn add(&self, writer: GUID, reader: GUID) {
        let mut listeners = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let readers = listeners.entry(writer).or_default();
        if readers.len() < MAX_LISTENERS {
            readers.insert(reader);
        }
    }

    /// A reader has gone.
    pub fn remove(&self, reader: GUID) {
        let mut listeners = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        for readers in listeners.values_mut() {
            readers.remove(&reader);
        }
    }

    /// How many readers the writer has.
    #[must_use]
    pub fn count(&self, writer: GUID) -> usize {
        let listeners = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        listeners.get(&writer).map_or(0, BTreeSet::len)
    }

    /// The readers that the writer has.
    #[must_use]
    pub fn of(&self, writer: GUID) -> BTreeSet<GUID> {
        let listeners = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        listeners.get(&writer).cloned().unwrap_or_default()
    }
}

/// The door out into the graph.
pub struct GraphSink {
    writers: BTreeMap<OutputTopic, Writer>,
    markers: Markers,
    drawings: Vec<(MarkerTopic, Writer)>,
    encoder: Encoder,
    listeners: Listeners,
    statistics: Arc<Mutex<Statistics>>,
    /// Spent in the middleware since the last cycle.
    sending: Duration,
}

impl std::fmt::Debug for GraphSink {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("GraphSink").field("interface", &self.encoder.interface()).finish_non_exhaustive()
    }
}

impl GraphSink {
    /// Advertises the topics under their remapped names. Counts and latencies go to the statistics.
    ///
    /// # Errors
    /// A topic cannot be advertised.
    pub fn advertise(
        graph: &mut Graph,
        names: &Names,
        topics: &[OutputTopic],
        markers: Markers,
        interface: Interface,
        listeners: Listeners,
        statistics: Arc<Mutex<Statistics>>,
    ) -> Result<Self, GraphError> {
        let mut writers = BTreeMap::new();
        for &topic in topics {
            let name = names.topic(&topic.ros_name())?;
            writers.insert(topic, graph.advertise(&name, topic.type_name(), Qos::of_output(topic))?);
        }
        let mut drawings = Vec::new();
        for topic in markers.topics() {
            let name = names.topic(&topic.ros_name())?;
            drawings.push((topic, graph.advertise(&name, MarkerTopic::type_name(), Qos::reliable(1))?));
        }
        let (encoder, sending) = (Encoder::new(interface), Duration::ZERO);
        Ok(Self { writers, markers, drawings, encoder, listeners, statistics, sending })
    }
}

/// Sets of candidates beside the one that others drive by: hundreds of kilobytes in each cycle, which few subscribe to.
fn is_bulky(topic: OutputTopic) -> bool {
    matches!(
        topic,
        OutputTopic::ConcatenatedTrajectories
            | OutputTopic::ValidatedTrajectories
            | OutputTopic::ScoredTrajectories
    )
}

impl Sink for GraphSink {
    fn publish(&mut self, publication: Publication) -> Result<(), SinkError> {
        let Some(writer) = self.writers.get(&publication.topic) else { return Ok(()) };
        let is_optional = publication.topic.is_debug() || is_bulky(publication.topic);
        if is_optional && self.listeners.count(writer.guid()) == 0 {
            return Ok(());
        }
        let payload = self.encoder.encode(&publication.message);
        let began = Instant::now();
        let sent = writer.send(payload);
        self.sending += began.elapsed();
        sent.map_err(|error| SinkError(Arc::new(error)))
    }

    fn observe(&mut self, report: &CycleReport, times: CycleTimes) {
        self.encoder.end_cycle();
        for (topic, writer) in &self.drawings {
            if self.listeners.count(writer.guid()) == 0 {
                continue;
            }
            if let Some(drawing) = self.markers.draw(*topic, report) {
                // Markers are for looking at: one that is lost is followed by the next cycle's.
                let _ = writer.send(drawing.to_cdr(self.encoder.interface()));
            }
        }
        let mut statistics = self.statistics.lock().unwrap_or_else(PoisonError::into_inner);
        statistics.add(report, times);
        statistics.add_sending(report, times, std::mem::take(&mut self.sending));
        // A planner that invents names must not fill the memory of a node that runs for weeks.
        if statistics.generators.len() > MAX_GENERATORS {
            statistics.generators.clear();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn listeners_come_and_go() {
        let listeners = Listeners::default();
        let guid = |byte| GUID::from_bytes([byte; 16]);
        listeners.add(guid(1), guid(10));
        listeners.add(guid(1), guid(10));
        listeners.add(guid(2), guid(10));
        assert_eq!((listeners.count(guid(1)), listeners.count(guid(2)), listeners.count(guid(3))), (1, 1, 0));
        listeners.remove(guid(10));
        assert_eq!((listeners.count(guid(1)), listeners.count(guid(2))), (0, 0));
    }
}
