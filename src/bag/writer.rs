//! Writes a recording as MCAP that other tools read.
//!
//! The caller hands messages over through a bounded channel; encoding, compression and writing happen on a thread of
//! their own. When the channel is full the caller waits: no message is ever lost. Bytes go to the file only in whole
//! chunks, appended, so the file is readable up to the last of them at any moment. The same calls give the same bytes:
//! no clock, no random number, one compression thread.

use std::{
    collections::BTreeSet,
    fs::File,
    io,
    path::{Path, PathBuf},
    sync::{Arc, OnceLock},
    thread::{self, JoinHandle},
};

use crossbeam_channel::Sender;

use super::{
    BagError, QosProfile,
    encoder::{self, Finished, Job},
    mcap_file::MAX_CHUNK_BYTES,
};

/// Largest payload, in bytes: its chunk stays within what the reader takes.
const MAX_PAYLOAD_BYTES: usize = MAX_CHUNK_BYTES as usize / 2;

/// How to write.
#[derive(Debug, Clone, Copy)]
pub struct WriterOptions {
    /// A chunk is closed when it holds this many bytes before compression. Smaller chunks lose less when the power
    /// fails and compress worse.
    pub chunk_bytes: u64,
    /// Messages that may wait for the writing thread before the caller waits.
    pub queue_messages: usize,
}

impl Default for WriterOptions {
    fn default() -> Self {
        Self { chunk_bytes: 768 << 10, queue_messages: 256 }
    }
}

/// A topic of the output.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct TopicId(u16);

/// What was written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Summary {
    /// The file.
    pub path: PathBuf,
    /// Topics in the order they were added, each with its number of messages.
    pub messages: Vec<(String, u64)>,
    /// Length of the file in bytes.
    pub bytes: u64,
    /// SHA-256 of the file, 64 lower-case hexadecimal digits.
    pub sha256: String,
}

/// Writes one MCAP file.
///
/// Dropped without [`finish`](Self::finish), it still writes what it was given, but no summary: readers see that the
/// recording was not ended.
#[derive(Debug)]
pub struct McapWriter {
    path: PathBuf,
    topics: Vec<(String, u64)>,
    names: BTreeSet<String>,
    jobs: Option<Sender<Job>>,
    failure: Arc<OnceLock<BagError>>,
    thread: Option<JoinHandle<Option<Finished>>>,
}

impl McapWriter {
    /// Creates or overwrites the file at `path`.
    ///
    /// # Errors
    /// The path is a folder, or cannot be created.
    pub fn create(path: impl AsRef<Path>, options: WriterOptions) -> Result<Self, BagError> {
        let path = path.as_ref().to_path_buf();
        if path.is_dir() {
            return Err(BagError::IsFolder { path });
        }
        let create_error = |error| BagError::Create { path: path.clone(), source: Arc::new(error) };
        let file = File::create(&path).map_err(create_error)?;
        let (jobs, queue) = crossbeam_channel::bounded(options.queue_messages);
        let failure = Arc::new(OnceLock::new());
        let (reported, name) = (failure.clone(), path.clone());
        let thread = thread::Builder::new()
            .name("bag-writer".to_owned())
            .spawn(move || {
                encoder::run(name, file, options.chunk_bytes, &queue).unwrap_or_else(|error| {
                    let _ = reported.set(error); // set nowhere else
                    None
                })
            })
            .map_err(create_error)?;
        let (topics, names) = (Vec::new(), BTreeSet::new());
        Ok(Self { path, topics, names, jobs: Some(jobs), failure, thread: Some(thread) })
    }

    /// Adds a topic. `type_name` is `pkg/msg/Name`; `schema_text` is its definition in `.msg` form, followed by those
    /// it depends on, each after a line of 80 `=` and a line `MSG: pkg/Name`.
    ///
    /// # Errors
    /// A topic added twice, too many topics, or an earlier failure to write.
    pub fn add_topic(
        &mut self,
        topic: &str,
        type_name: &str,
        schema_text: &str,
        qos: QosProfile,
    ) -> Result<TopicId, BagError> {
        self.check()?;
        let reject = |what| BagError::Rejected { path: self.path.clone(), topic: topic.to_owned(), what };
        if self.names.contains(topic) {
            return Err(reject("was added before; use the id that was returned then"));
        }
        let id = u16::try_from(self.topics.len()).map_err(|_| reject("a file holds at most 65536 topics"))?;
        let (topic, type_name) = (topic.to_owned(), type_name.to_owned());
        let job = Job::Topic { topic: topic.clone(), type_name, schema_text: schema_text.to_owned(), qos };
        self.send(job)?;
        self.names.insert(topic.clone());
        self.topics.push((topic, 0));
        Ok(TopicId(id))
    }

    /// Hands over a message: log time and publish time in nanoseconds since the epoch, and its serialized form
    /// (encapsulation and CDR). Waits only while the queue is full.
    ///
    /// # Errors
    /// An unknown topic, a negative time, a payload above 512 MiB (the file stays good), or an earlier failure to write.
    pub fn write(
        &mut self,
        topic: TopicId,
        log_time_ns: i64,
        publish_time_ns: i64,
        payload: impl Into<Vec<u8>>,
    ) -> Result<(), BagError> {
        self.check()?;
        let name = self.topics.get(usize::from(topic.0)).map(|(name, _)| name.as_str());
        let reject = |what| BagError::Rejected {
            path: self.path.clone(),
            topic: name.map_or_else(|| topic.0.to_string(), ToOwned::to_owned),
            what,
        };
        if name.is_none() {
            return Err(reject("was not added to this file"));
        }
        let (Ok(log_time_ns), Ok(publish_time_ns)) =
            (u64::try_from(log_time_ns), u64::try_from(publish_time_ns))
        else {
            return Err(reject("a time before 1970 cannot be recorded"));
        };
        let payload = payload.into();
        if payload.len() > MAX_PAYLOAD_BYTES {
            return Err(reject("a message above 512 MiB cannot be recorded"));
        }
        self.send(Job::Message { topic: topic.0, log_time_ns, publish_time_ns, payload })?;
        self.topics[usize::from(topic.0)].1 += 1;
        Ok(())
    }

    /// Writes the rest and the summary, and waits until the operating system has it all.
    ///
    /// # Errors
    /// The first failure to write, if there was one: what is safe is in it.
    pub fn finish(mut self) -> Result<Summary, BagError> {
        self.send(Job::Finish)?;
        self.jobs = None;
        let finished = self.thread.take().and_then(|thread| thread.join().ok()).flatten();
        let Some(Finished { bytes, sha256 }) = finished else { return Err(self.failure()) };
        Ok(Summary {
            path: std::mem::take(&mut self.path),
            messages: std::mem::take(&mut self.topics),
            bytes,
            sha256,
        })
    }

    /// The first failure to write, at every call after it.
    fn check(&self) -> Result<(), BagError> {
        self.failure.get().map_or(Ok(()), |error| Err(error.clone()))
    }

    fn send(&self, job: Job) -> Result<(), BagError> {
        self.check()?;
        let sent = self.jobs.as_ref().is_some_and(|jobs| jobs.send(job).is_ok());
        if sent { Ok(()) } else { Err(self.failure()) }
    }

    /// Why the writing thread is gone.
    fn failure(&self) -> BagError {
        self.failure.get().cloned().unwrap_or_else(|| BagError::Write {
            path: self.path.clone(),
            safe_bytes: 0,
            safe_messages: 0,
            source: Arc::new(io::Error::other("the writing thread died")),
        })
    }
}

impl Drop for McapWriter {
    fn drop(&mut self) {
        self.jobs = None; // the thread sees the end of the queue
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}
