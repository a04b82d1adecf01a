//! The way out into a file: writes what the node publishes, and counts it. Also the way out where nothing is written:
//! then it only counts, and keeps times for whoever measures.

use crate::allocations;
use crate::bag::{self, BagError, McapWriter, QosProfile, TopicId};
use crate::report::markers::scene_updates::{SceneUpdates, UpdateTopic};
use crate::report::markers::{MarkerTopic, Markers};
use crate::report::page::Page;
use crate::report::samples::Samples;
use crate::report::statistics::Statistics;
use crate::report::trace::Trace;
use crate::ros::encoder::Encoder;
use crate::top::{self, Told};
use crossbeam_channel::Sender;
use messages::{Interface, Message};
use selector_actors::cycle::{CycleReport, CycleTimes};
use selector_actors::{Outcome, OutputTopic, Publication, Sink, SinkError};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// What the recorder has so far; shared with whoever runs the node, because the node owns the recorder.
#[derive(Debug, Default)]
pub struct Recording {
    /// Counts and latencies.
    pub statistics: Statistics,
    /// The cycle that somebody wants to look at, once it has come, with the time that it took.
    pub watched: Option<(CycleReport, CycleTimes)>,
    /// The page for people, if one is wanted.
    pub page: Option<Page>,
    /// Draws into the file, if that is wanted.
    pub drawing: Option<Drawing>,
    /// The time of every stage of every cycle, if wanted.
    pub samples: Option<Samples>,
    /// The trace, if one is wanted.
    pub trace: Option<Trace>,
    /// Cycles that ended later than this after their trigger, or were cut, count as missed.
    pub deadline: Option<Duration>,
    /// Cycles that missed the deadline.
    pub missed: u64,
    /// Everything published is encoded by this, as if all outputs had a subscriber, and then dropped.
    pub encoder: Option<Encoder>,
    /// Whoever looks on is told here what is published. One who does not keep up misses some of it.
    pub tap: Option<Sender<Told>>,
    watch: Option<u64>,
    writer: Option<Writer>,
}

/// Draws cycles for RViz and for Foxglove.
#[derive(Debug)]
pub struct Drawing {
    /// For both.
    pub markers: Markers,
    /// For Foxglove.
    pub updates: SceneUpdates,
}

/// A topic that is drawn on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum DrawnTopic {
    Markers(MarkerTopic),
    Updates(UpdateTopic),
}

#[derive(Debug)]
struct Writer {
    mcap: McapWriter,
    topics: BTreeMap<OutputTopic, TopicId>,
    drawings: BTreeMap<DrawnTopic, TopicId>,
    interface: Interface,
}

/// A handle on a recording.
#[derive(Debug, Clone, Default)]
pub struct Recorder(Arc<Mutex<Recording>>);

impl Recorder {
    /// Only counts.
    #[must_use]
    pub fn counting() -> Self {
        Self::default()
    }

    /// Counts, and writes everything published to an MCAP file.
    ///
    /// # Errors
    /// The file cannot be made.
    pub fn writing(path: &Path, interface: Interface) -> Result<Self, BagError> {
        let mcap = McapWriter::create(path, bag::WriterOptions::default())?;
        let writer = Some(Writer { mcap, topics: BTreeMap::new(), drawings: BTreeMap::new(), interface });
        Ok(Self(Arc::new(Mutex::new(Recording { writer, ..Recording::default() }))))
    }

    /// Keeps the cycle of this number when it comes.
    pub fn watch(&self, cycle: u64) {
        self.lock().watch = Some(cycle);
    }

    /// The recording. A panic elsewhere while it was held leaves it as it is: counts only grow.
    pub fn lock(&self) -> MutexGuard<'_, Recording> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Ends the file, if there is one.
    ///
    /// # Errors
    /// Something could not be written; what is safe stands in the error.
    pub fn finish(&self) -> Result<Option<bag::Summary>, BagError> {
        let writer = self.lock().writer.take();
        writer.map(|writer| writer.mcap.finish()).transpose()
    }
}

impl Writer {
    fn write(&mut self, publication: &Publication) -> Result<(), BagError> {
        let Publication { topic, stamp, message } = publication;
        let id = match self.topics.get(topic) {
            Some(id) => *id,
            None => {
                let id = self.mcap.add_topic(
                    &topic.full_name(),
                    message.type_name(),
                    &message.definition(self.interface),
                    QosProfile::of_output(*topic),
                )?;
                self.topics.insert(*topic, id);
                id
            }
        };
        let nanoseconds = stamp.nanoseconds();
        self.mcap.write(id, nanoseconds, nanoseconds, message.to_cdr(self.interface))
    }

    fn draw(&mut self, drawing: &mut Drawing, report: &CycleReport) -> Result<(), BagError> {
        let now_ns = report.cycle.scene.now.nanoseconds();
        for topic in drawing.markers.topics() {
            if let Some(markers) = drawing.markers.draw(topic, report) {
                self.write_drawn(DrawnTopic::Markers(topic), &topic.full_name(), now_ns, &markers)?;
            }
        }
        for topic in UpdateTopic::ALL {
            if let Some(update) = drawing.updates.update(topic, report) {
                self.write_drawn(DrawnTopic::Updates(topic), &topic.full_name(), now_ns, &update)?;
            }
        }
        Ok(())
    }

    fn write_drawn<M: Message>(
        &mut self,
        topic: DrawnTopic,
        name: &str,
        now_ns: i64,
        drawn: &M,
    ) -> Result<(), BagError> {
        let id = match self.drawings.get(&topic) {
            Some(id) => *id,
            None => {
                let definition = M::definition(self.interface);
                let id = self.mcap.add_topic(name, M::TYPE_NAME, &definition, QosProfile::default())?;
                self.drawings.insert(topic, id);
                id
            }
        };
        self.mcap.write(id, now_ns, now_ns, drawn.to_cdr(self.interface))
    }
}

impl Sink for Recorder {
    fn publish(&mut self, publication: Publication) -> Result<(), SinkError> {
        let mut recording = self.lock();
        if let Some(encoder) = &mut recording.encoder {
            // Kept from being optimised away: the cost is what is wanted.
            std::hint::black_box(encoder.encode(&publication.message));
        }
        if let Some(tap) = recording.tap.as_ref().filter(|_| top::is_counted(publication.topic)) {
            let _ = tap.try_send(Told::Published(publication.topic, publication.message.clone()));
        }
        match &mut recording.writer {
            Some(writer) => writer.write(&publication).map_err(|error| SinkError(Arc::new(error))),
            None => Ok(()),
        }
    }

    fn observe(&mut self, report: &CycleReport, times: CycleTimes) {
        let mut recording = self.lock();
        let recording = &mut *recording;
        recording.statistics.add(report, times);
        if let Some(encoder) = &mut recording.encoder {
            encoder.end_cycle();
        }
        let allocated = allocations::of_this_thread();
        if let (Some(drawing), Some(writer)) = (&mut recording.drawing, &mut recording.writer) {
            // A file that takes no more has been told by `publish`, or will be by `finish`.
            let _ = writer.draw(drawing, report);
        }
        if let Some(deadline) = recording.deadline {
            let is_cut = matches!(&report.outcome, Outcome::Judged(judged) if judged.not_judged() > 0);
            recording.missed += u64::from(is_cut || times.cycle > deadline);
        }
        if let Some(samples) = &mut recording.samples {
            samples.add(report, times);
        }
        if let Some(trace) = &mut recording.trace {
            trace.add(report, times);
        }
        if let Some(page) = &mut recording.page {
            page.add(report, times);
        }
        if recording.watch == Some(report.cycle.number) {
            recording.watched = Some((report.clone(), times));
        }
        recording.statistics.set_aside(allocations::of_this_thread() - allocated);
    }
}
