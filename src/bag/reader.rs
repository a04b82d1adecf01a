//! Reads a recording in log-time order, whatever it consists of.
//!
//! All files are cut into blocks with a known earliest time. A block is loaded when no message that is already loaded
//! is older than it could be; the oldest loaded message comes out next.

use std::{
    collections::{BTreeMap, VecDeque},
    fs::File,
    io::{Read, Seek},
    path::{Path, PathBuf},
    sync::Arc,
};

use tempfile::NamedTempFile;

use super::{
    BagError, Connection, RawMessage,
    block::{Block, Contents, Entry, Loaded},
    folder,
    mcap_file::McapFile,
    mcap_scan,
    sqlite_file::{self, SqliteFile},
};

/// Most memory for blocks whose times overlap, in bytes.
const MAX_OPEN_BYTES: u64 = 4 << 30;
/// Largest message after unpacking message-level compression, in bytes.
const MAX_MESSAGE_BYTES: u64 = 1 << 30;
const ZSTD_MAGIC: [u8; 4] = [0x28, 0xb5, 0x2f, 0xfd];

#[derive(Debug)]
enum Storage {
    Mcap(Box<McapFile>),
    Sqlite(SqliteFile),
}

/// One file of the recording.
#[derive(Debug)]
struct Source {
    path: Arc<Path>,
    storage: Storage,
    /// Number among the recording's connections, by number among the file's.
    connections: Vec<usize>,
    promised: Option<u64>,
    end: Option<BagError>,
    messages_read: u64,
    /// Keeps an unpacked copy alive.
    _unpacked: Option<NamedTempFile>,
}

/// A loaded block and how far it was read.
#[derive(Debug)]
struct OpenBlock {
    source: usize,
    offset: u64,
    loaded: Loaded,
    next: usize,
}

/// A recording, read message by message: an iterator in log-time order.
///
/// An error in the middle ends the iteration: what came before it is complete, what follows is unknown. Conditions of
/// the recording as a whole ([`BagError::Truncated`], [`BagError::WrongCount`], damage between chunks) come as the last
/// items, after all intact messages. [`BagError::data_before`] tells what an error means for what came before.
#[derive(Debug)]
pub struct Reader {
    path: PathBuf,
    connections: Vec<Connection>,
    wanted: Vec<bool>,
    sources: Vec<Source>,
    /// Blocks not yet loaded with their source and place in file order; the earliest is the last.
    pending: Vec<(Block, usize, usize)>,
    /// Loaded blocks by the time of their next message, then by file order.
    open: BTreeMap<(i64, usize), OpenBlock>,
    open_bytes: u64,
    last_time_ns: i64,
    /// Number of messages that `metadata.yaml` promises.
    promised: Option<u64>,
    compressed_messages: bool,
    warnings: Vec<BagError>,
    /// Set when all messages are out: what is still to be told.
    closing: Option<VecDeque<BagError>>,
}

impl Reader {
    pub(super) fn open(path: &Path) -> Result<Self, BagError> {
        let information = std::fs::metadata(path).map_err(|error| match error.kind() {
            std::io::ErrorKind::NotFound => BagError::NotFound { path: path.to_path_buf() },
            _ => BagError::Read { path: path.to_path_buf(), offset: 0, source: Arc::new(error) },
        })?;
        let mut reader = Self::empty(path.to_path_buf());
        let mut file_order = Vec::new();
        if information.is_dir() {
            let folder = folder::open(path)?;
            reader.promised = folder.message_count;
            reader.compressed_messages = folder.compressed_messages;
            for file in &folder.files {
                reader.add_file(file, &mut file_order)?;
            }
        } else {
            reader.add_file(path, &mut file_order)?;
        }
        Ok(reader.ready(file_order))
    }

    /// Reads MCAP from any source of bytes, for example from memory; `name` stands for the path in errors.
    ///
    /// # Errors
    /// As [`open`](super::open).
    pub fn from_mcap(
        name: impl AsRef<Path>,
        source: impl Read + Seek + Send + 'static,
    ) -> Result<Self, BagError> {
        let path: Arc<Path> = name.as_ref().into();
        let mut reader = Self::empty(path.to_path_buf());
        let (file, contents) = mcap_scan::scan(path.clone(), Box::new(source))?;
        let mut file_order = Vec::new();
        reader.add(path, Storage::Mcap(Box::new(file)), contents, None, &mut file_order);
        Ok(reader.ready(file_order))
    }

    fn empty(path: PathBuf) -> Self {
        Self {
            path,
            connections: Vec::new(),
            wanted: Vec::new(),
            sources: Vec::new(),
            pending: Vec::new(),
            open: BTreeMap::new(),
            open_bytes: 0,
            last_time_ns: i64::MIN,
            promised: None,
            compressed_messages: false,
            warnings: Vec::new(),
            closing: None,
        }
    }

    fn add_file(&mut self, path: &Path, file_order: &mut Vec<(Block, usize)>) -> Result<(), BagError> {
        let unpacked = if front(path)?.starts_with(&ZSTD_MAGIC) { Some(folder::unpack(path)?) } else { None };
        let file: &Path = unpacked.as_ref().map_or(path, NamedTempFile::path);
        let path: Arc<Path> = path.into();
        let front = front(file)?;
        let (storage, contents) = if front.starts_with(sqlite_file::MAGIC) {
            let (sqlite, contents) = sqlite_file::scan(path.clone(), file)?;
            (Storage::Sqlite(sqlite), contents)
        } else {
            let source = File::open(file).map_err(|error| read_error(&path, error))?;
            let (mcap, contents) = mcap_scan::scan(path.clone(), Box::new(source))?;
            (Storage::Mcap(Box::new(mcap)), contents)
        };
        self.add(path, storage, contents, unpacked, file_order);
        Ok(())
    }

    fn add(
        &mut self,
        path: Arc<Path>,
        storage: Storage,
        contents: Contents,
        unpacked: Option<NamedTempFile>,
        file_order: &mut Vec<(Block, usize)>,
    ) {
        let source = self.sources.len();
        file_order.extend(contents.blocks.into_iter().map(|block| (block, source)));
        let connections = contents.connections.into_iter().map(|connection| self.join(connection)).collect();
        self.warnings.extend(contents.warnings);
        self.sources.push(Source {
            path,
            storage,
            connections,
            promised: contents.promised,
            end: contents.end,
            messages_read: 0,
            _unpacked: unpacked,
        });
    }

    /// The number of a connection; files of one recording repeat each other's.
    fn join(&mut self, connection: Connection) -> usize {
        if let Some(number) = self.connections.iter().position(|known| known.is_like(&connection)) {
            self.connections[number].message_count += connection.message_count;
            return number;
        }
        self.connections.push(connection);
        self.connections.len() - 1
    }

    fn ready(mut self, file_order: Vec<(Block, usize)>) -> Self {
        self.wanted = vec![true; self.connections.len()];
        let numbered = file_order.into_iter().enumerate();
        self.pending = numbered.map(|(place, (block, source))| (block, source, place)).collect();
        self.pending.sort_by_key(|(block, _, place)| std::cmp::Reverse((block.start_ns, *place)));
        self
    }

    /// The path that was opened.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The recording's connections. Two publishers of one topic may be two connections.
    #[must_use]
    pub fn connections(&self) -> &[Connection] {
        &self.connections
    }

    /// Findings that cost no message, for example a damaged summary.
    #[must_use]
    pub fn warnings(&self) -> &[BagError] {
        &self.warnings
    }

    /// Number of messages of the wanted connections.
    #[must_use]
    pub fn message_count(&self) -> u64 {
        let wanted = self.connections.iter().zip(&self.wanted).filter(|(_, wanted)| **wanted);
        wanted.map(|(connection, _)| connection.message_count).sum()
    }

    /// First and last log time of what is not yet read, in nanoseconds since the epoch; from the index, for display.
    #[must_use]
    pub fn time_range_ns(&self) -> Option<(i64, i64)> {
        let first = self.pending.iter().map(|(block, ..)| block.start_ns).min()?;
        let last = self.pending.iter().map(|(block, ..)| block.end_ns).max()?;
        Some((first, last))
    }

    /// From now on gives only messages of the connections for which `keep` is true.
    pub fn select(&mut self, keep: impl Fn(&Connection) -> bool) {
        self.wanted = self.connections.iter().map(keep).collect();
    }

    /// Loads every block that may hold a message as old as the oldest one loaded.
    fn load_due(&mut self) -> Result<(), BagError> {
        while let Some((block, source, place)) = self.pending.pop() {
            if self.open.first_key_value().is_some_and(|((time_ns, _), _)| block.start_ns > *time_ns) {
                self.pending.push((block, source, place));
                return Ok(());
            }
            let file = &mut self.sources[source];
            let loaded = match &mut file.storage {
                Storage::Mcap(mcap) => mcap.load(&block)?,
                Storage::Sqlite(sqlite) => {
                    sqlite.load(&block, |local| self.wanted[file.connections[local as usize]])?
                }
            };
            let Some(first) = loaded.entries.first() else { continue };
            self.open_bytes += loaded.footprint();
            if self.open_bytes > MAX_OPEN_BYTES {
                return Err(BagError::TooLarge {
                    path: file.path.to_path_buf(),
                    offset: block.start,
                    what: "the chunks whose times overlap: together their memory",
                    claimed: self.open_bytes,
                    limit: MAX_OPEN_BYTES,
                    remedy: "sort the recording first: `mcap sort`",
                });
            }
            let key = (first.log_time_ns, place);
            self.open.insert(key, OpenBlock { source, offset: block.start, loaded, next: 0 });
        }
        Ok(())
    }

    /// The oldest message that is wanted, or `None` when there is no other.
    fn advance(&mut self) -> Result<Option<RawMessage>, BagError> {
        loop {
            self.load_due()?;
            let Some(((time_ns, place), mut block)) = self.open.pop_first() else { return Ok(None) };
            let entry = block.loaded.entries[block.next];
            let source = &mut self.sources[block.source];
            if time_ns < self.last_time_ns {
                return Err(BagError::Damaged {
                    path: source.path.to_path_buf(),
                    offset: block.offset,
                    what: "the chunk holds messages older than it says".to_owned(),
                });
            }
            self.last_time_ns = time_ns;
            source.messages_read += 1;
            let connection = source.connections[entry.connection as usize];
            let message = self.wanted[connection].then(|| self.message(&block, entry, connection));
            block.next += 1;
            match block.loaded.entries.get(block.next).map(|entry| entry.log_time_ns) {
                Some(next_ns) => drop(self.open.insert((next_ns, place), block)),
                None => self.open_bytes -= block.loaded.footprint(),
            }
            if let Some(message) = message {
                return message.map(Some);
            }
        }
    }

    fn message(&self, block: &OpenBlock, entry: Entry, connection: usize) -> Result<RawMessage, BagError> {
        let packed = &block.loaded.bytes[entry.start..entry.start + entry.len];
        let data = if self.compressed_messages {
            unpack_message(packed).map_err(|what| BagError::Damaged {
                path: self.sources[block.source].path.to_path_buf(),
                offset: block.offset,
                what,
            })?
        } else {
            packed.to_vec()
        };
        let (log_time_ns, publish_time_ns) = (entry.log_time_ns, entry.publish_time_ns);
        Ok(RawMessage { connection, log_time_ns, publish_time_ns, data })
    }

    /// What is to be said when all messages are out.
    fn close(&mut self) -> VecDeque<BagError> {
        let mut findings = VecDeque::new();
        for source in &mut self.sources {
            let read = source.messages_read;
            match source.end.take() {
                Some(BagError::Truncated { path, offset, .. }) => {
                    findings.push_back(BagError::Truncated { path, offset, messages_read: read });
                }
                Some(error) => findings.push_back(error),
                None => findings.extend(wrong_count(&source.path, source.promised, read)),
            }
        }
        if findings.is_empty() {
            let read = self.sources.iter().map(|source| source.messages_read).sum();
            findings.extend(wrong_count(&self.path, self.promised, read));
        }
        findings
    }
}

impl Iterator for Reader {
    type Item = Result<RawMessage, BagError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.closing.is_none() {
            match self.advance() {
                Ok(Some(message)) => return Some(Ok(message)),
                Ok(None) => self.closing = Some(self.close()),
                Err(error) => {
                    self.closing = Some(VecDeque::from([error]));
                    self.open.clear();
                    self.pending.clear();
                }
            }
        }
        self.closing.as_mut().and_then(VecDeque::pop_front).map(Err)
    }
}

impl std::iter::FusedIterator for Reader {}

fn wrong_count(path: &Path, promised: Option<u64>, read: u64) -> Option<BagError> {
    let expected = promised.filter(|expected| *expected != read)?;
    Some(BagError::WrongCount { path: path.to_path_buf(), expected, read })
}

fn unpack_message(packed: &[u8]) -> Result<Vec<u8>, String> {
    let mut data = Vec::new();
    zstd::Decoder::new(packed)
        .and_then(|decoder| decoder.take(MAX_MESSAGE_BYTES + 1).read_to_end(&mut data))
        .map_err(|error| format!("a message cannot be unpacked: {error}"))?;
    if data.len() as u64 > MAX_MESSAGE_BYTES {
        return Err(format!("a message unpacks to more than {MAX_MESSAGE_BYTES} bytes"));
    }
    Ok(data)
}

/// The first bytes of a file, enough to tell its kind.
fn front(path: &Path) -> Result<Vec<u8>, BagError> {
    let mut front = Vec::with_capacity(sqlite_file::MAGIC.len());
    let read = File::open(path).and_then(|file| file.take(front.capacity() as u64).read_to_end(&mut front));
    read.map_err(|error| read_error(path, error))?;
    Ok(front)
}

fn read_error(path: &Path, error: std::io::Error) -> BagError {
    BagError::Read { path: path.to_path_buf(), offset: 0, source: Arc::new(error) }
}
