//! The writing thread: turns jobs into MCAP records and appends whole chunks to the file.

use std::{
    cell::RefCell,
    collections::BTreeMap,
    fs::File,
    io::{self, Seek, SeekFrom, Write},
    path::PathBuf,
    rc::Rc,
    sync::Arc,
};

use crossbeam_channel::Receiver;
use mcap::{Compression, WriteOptions, records::MessageHeader};
use sha2::{Digest, Sha256};

use super::{BagError, QosProfile};

/// Fixed, so that the bytes do not depend on what the library calls its default.
const ZSTD_LEVEL: u32 = 3;
const LIBRARY: &str = concat!("trajectory-selector ", env!("CARGO_PKG_VERSION"));

/// What the thread is asked to do.
pub(super) enum Job {
    /// Topics are numbered in the order in which they arrive.
    Topic {
        topic: String,
        type_name: String,
        schema_text: String,
        qos: QosProfile,
    },
    Message {
        topic: u16,
        log_time_ns: u64,
        publish_time_ns: u64,
        payload: Vec<u8>,
    },
    Finish,
}

/// Length and digest of a finished file.
#[derive(Debug)]
pub(super) struct Finished {
    pub(super) bytes: u64,
    /// Lower-case hexadecimal.
    pub(super) sha256: String,
}

/// Works until told to finish, or until nobody can send any more: then all messages are in the file, without summary.
pub(super) fn run(
    path: PathBuf,
    file: File,
    chunk_bytes: u64,
    jobs: &Receiver<Job>,
) -> Result<Option<Finished>, BagError> {
    let outbox = Outbox::default();
    let mut sink = Sink { path, file, outbox: outbox.clone(), digest: Sha256::new(), bytes: 0, messages: 0 };
    let options = WriteOptions::new()
        .profile("ros2")
        .library(LIBRARY)
        .compression(Some(Compression::Zstd))
        .compression_level(ZSTD_LEVEL)
        .compression_threads(0) // several threads would cut the stream at places that vary
        .chunk_size(Some(chunk_bytes))
        .disable_seeking(true);
    let mut writer = options.create(outbox).map_err(|error| sink.encode_error(error))?;
    let mut topics: Vec<(u16, u32)> = Vec::new();
    let mut accepted = 0;
    sink.drain(accepted)?;
    for job in jobs {
        match job {
            Job::Topic { topic, type_name, schema_text, qos } => {
                let metadata = BTreeMap::from([("offered_qos_profiles".to_owned(), qos.to_string())]);
                let channel = writer
                    .add_schema(&type_name, "ros2msg", schema_text.as_bytes())
                    .and_then(|schema| writer.add_channel(schema, &topic, "cdr", &metadata))
                    .map_err(|error| sink.encode_error(error))?;
                topics.push((channel, 0));
            }
            Job::Message { topic, log_time_ns, publish_time_ns, payload } => {
                let Some((channel_id, sequence)) = topics.get_mut(usize::from(topic)) else { continue };
                let header = MessageHeader {
                    channel_id: *channel_id,
                    sequence: *sequence,
                    log_time: log_time_ns,
                    publish_time: publish_time_ns,
                };
                *sequence = sequence.wrapping_add(1);
                writer.write_to_known_channel(&header, &payload).map_err(|error| sink.encode_error(error))?;
                // If this closed a chunk, that chunk ends just before this message.
                sink.drain(accepted)?;
                accepted += 1;
            }
            Job::Finish => {
                writer.finish().map_err(|error| sink.encode_error(error))?;
                sink.drain(accepted)?;
                return Ok(Some(sink.finish()));
            }
        }
    }
    writer.flush().map_err(|error| sink.encode_error(error))?;
    drop(writer.into_inner()); // a plain drop would write a summary: the recording would look ended
    sink.drain(accepted)?;
    Ok(None)
}

/// The file, and what is known to be safe in it.
struct Sink {
    path: PathBuf,
    file: File,
    outbox: Outbox,
    digest: Sha256,
    bytes: u64,
    messages: u64,
}

impl Sink {
    /// Appends what the library has put out: complete records that hold the first `messages` messages.
    fn drain(&mut self, messages: u64) -> Result<(), BagError> {
        let mut waiting = self.outbox.waiting.borrow_mut();
        if waiting.is_empty() {
            return Ok(());
        }
        self.file.write_all(&waiting).map_err(|error| BagError::Write {
            path: self.path.clone(),
            safe_bytes: self.bytes,
            safe_messages: self.messages,
            source: Arc::new(error),
        })?;
        self.digest.update(waiting.as_slice());
        self.bytes += waiting.len() as u64;
        self.messages = messages;
        waiting.clear();
        Ok(())
    }

    fn encode_error(&self, error: mcap::McapError) -> BagError {
        BagError::Encode {
            path: self.path.clone(),
            safe_bytes: self.bytes,
            safe_messages: self.messages,
            source: Arc::new(error),
        }
    }

    fn finish(self) -> Finished {
        let sha256 = self.digest.finalize().iter().map(|byte| format!("{byte:02x}")).collect();
        Finished { bytes: self.bytes, sha256 }
    }
}

/// Memory that the MCAP library writes to. Thus the library never meets a failing disk, and the file never holds a
/// record that is not complete unless the disk itself fails in the middle of it.
#[derive(Clone, Default)]
struct Outbox {
    waiting: Rc<RefCell<Vec<u8>>>,
    position: u64,
}

impl Write for Outbox {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.waiting.borrow_mut().extend_from_slice(bytes);
        self.position += bytes.len() as u64;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Seek for Outbox {
    /// Only tells the position: the library is told not to seek.
    fn seek(&mut self, target: SeekFrom) -> io::Result<u64> {
        match target {
            SeekFrom::Current(0) => Ok(self.position),
            _ => Err(io::ErrorKind::Unsupported.into()),
        }
    }
}
