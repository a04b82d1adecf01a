//! One MCAP file: its bytes, and the messages of one chunk.
//!
//! What lies where is found by [`scan`](super::mcap_scan); this part reads and unpacks it. A chunk is handed out only
//! after its size, its checksum and every record in it were checked.

use std::{
    collections::BTreeMap,
    io::{self, BufReader, Read, Seek, SeekFrom},
    path::Path,
    sync::Arc,
};

use super::{
    BagError,
    block::{Block, Entry, Loaded},
    records::{self, ChannelRecord, ChunkHeader, Fault, Fields, MESSAGE_HEADER_LEN, op},
};

/// Largest chunk, in bytes before compression. Recorders make chunks of about 1 MB; one huge message makes one huge chunk.
pub(super) const MAX_CHUNK_BYTES: u64 = 1 << 30;
/// Read-ahead while hopping from record to record.
const READ_AHEAD_BYTES: usize = 16 << 10;

/// Where the bytes of a recording come from.
pub(super) trait Bytes: Read + Seek + Send {}
impl<T: Read + Seek + Send> Bytes for T {}

pub(super) struct McapFile {
    pub(super) path: Arc<Path>,
    pub(super) len: u64,
    source: BufReader<Box<dyn Bytes>>,
    position: u64,
    /// Channels by id, each with the number of its connection among this file's connections.
    pub(super) channels: BTreeMap<u16, (ChannelRecord, u32)>,
    zstd: zstd::bulk::Decompressor<'static>,
}

impl std::fmt::Debug for McapFile {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("McapFile").field("path", &self.path).field("len", &self.len).finish_non_exhaustive()
    }
}

impl McapFile {
    pub(super) fn new(path: Arc<Path>, mut source: Box<dyn Bytes>) -> Result<Self, BagError> {
        let prepared = source
            .seek(SeekFrom::End(0))
            .and_then(|len| source.rewind().map(|()| len))
            .and_then(|len| Ok((len, zstd::bulk::Decompressor::new()?)));
        let (len, zstd) = prepared.map_err(|error| read_error(&path, 0, error))?;
        let source = BufReader::with_capacity(READ_AHEAD_BYTES, source);
        Ok(Self { path, len, source, position: 0, channels: BTreeMap::new(), zstd })
    }

    pub(super) fn damaged(&self, offset: u64, what: Fault) -> BagError {
        BagError::Damaged { path: self.path.to_path_buf(), offset, what: what.to_owned() }
    }

    /// Fills `buffer` from `offset` on.
    pub(super) fn read_at(&mut self, offset: u64, buffer: &mut [u8]) -> Result<(), BagError> {
        let distance = i64::try_from(i128::from(offset) - i128::from(self.position));
        let moved = match distance {
            Ok(distance) => self.source.seek_relative(distance),
            Err(_) => self.source.seek(SeekFrom::Start(offset)).map(|_| ()),
        };
        moved.and_then(|()| self.source.read_exact(buffer)).map_err(|error| {
            // The position is unknown now: go back to a known one before the next read.
            self.position = self.source.seek(SeekFrom::Start(0)).unwrap_or(0);
            read_error(&self.path, offset, error)
        })?;
        self.position = offset + buffer.len() as u64;
        Ok(())
    }

    /// Reads `len` bytes that the caller has checked to lie inside the file.
    pub(super) fn read_vec(&mut self, offset: u64, len: u64) -> Result<Vec<u8>, BagError> {
        let mut bytes = self.reserve(offset, len, "a record")?;
        bytes.resize(len as usize, 0);
        self.read_at(offset, &mut bytes)?;
        Ok(bytes)
    }

    fn reserve(&self, offset: u64, len: u64, what: &'static str) -> Result<Vec<u8>, BagError> {
        let mut bytes = Vec::new();
        let reserved = usize::try_from(len).ok().and_then(|len| bytes.try_reserve_exact(len).ok());
        reserved.map(|()| bytes).ok_or_else(|| BagError::TooLarge {
            path: self.path.to_path_buf(),
            offset,
            what,
            claimed: len,
            limit: MAX_CHUNK_BYTES,
            remedy: "this machine has no memory for it",
        })
    }

    /// The records of a chunk, or of a run of messages outside chunks.
    pub(super) fn unpack(&mut self, block: &Block) -> Result<Vec<u8>, BagError> {
        let raw = self.read_vec(block.start, block.len)?;
        let (opcode, body) = Fields(&raw).record().map_err(|fault| self.damaged(block.start, fault))?;
        if opcode != op::CHUNK {
            return Ok(raw);
        }
        let mut fields = Fields(body);
        let chunk =
            records::parse_chunk_header(&mut fields).map_err(|fault| self.damaged(block.start, fault))?;
        let records = self.decompress(block.start, &chunk, fields.0)?;
        if records.len() as u64 != chunk.uncompressed_len {
            return Err(self.damaged(block.start, "the chunk unpacks to another size than it says"));
        }
        let computed = if chunk.crc == 0 { 0 } else { crc32fast::hash(&records) };
        if computed != chunk.crc {
            let path = self.path.to_path_buf();
            return Err(BagError::ChunkCrc { path, offset: block.start, expected: chunk.crc, computed });
        }
        Ok(records)
    }

    fn decompress(
        &mut self,
        offset: u64,
        chunk: &ChunkHeader<'_>,
        packed: &[u8],
    ) -> Result<Vec<u8>, BagError> {
        let mut records = self.reserve(offset, chunk.uncompressed_len, "a chunk")?;
        let unpacked = match chunk.compression {
            "" => {
                records.extend_from_slice(packed);
                Ok(())
            }
            "zstd" => self.zstd.decompress_to_buffer(packed, &mut records).map(|_| ()),
            "lz4" => lz4::Decoder::new(packed)
                .and_then(|decoder| decoder.take(chunk.uncompressed_len).read_to_end(&mut records))
                .map(|_| ()),
            other => {
                return Err(BagError::Unsupported {
                    path: self.path.to_path_buf(),
                    what: format!("chunk compression {other:?} at byte {offset}"),
                    remedy: "rewrite the file with zstd chunks: `mcap compress`",
                });
            }
        };
        unpacked.map(|()| records).map_err(|error| BagError::Damaged {
            path: self.path.to_path_buf(),
            offset,
            what: format!("the chunk cannot be unpacked: {error}"),
        })
    }

    /// The messages of a block in log-time order; messages of the same time in file order.
    pub(super) fn load(&mut self, block: &Block) -> Result<Loaded, BagError> {
        let bytes = self.unpack(block)?;
        let entries = self.entries(&bytes).map_err(|fault| self.damaged(block.start, fault))?;
        Ok(Loaded::sorted(bytes, entries))
    }

    fn entries(&self, bytes: &[u8]) -> Result<Vec<Entry>, Fault> {
        let mut entries = Vec::new();
        let mut fields = Fields(bytes);
        while !fields.0.is_empty() {
            let (opcode, body) = fields.record()?;
            match opcode {
                op::MESSAGE => {
                    let header = records::parse_message_header(body)?;
                    let (_, connection) =
                        self.channels.get(&header.channel).ok_or("a message names an unknown channel")?;
                    let len = body.len() - MESSAGE_HEADER_LEN;
                    entries.push(Entry {
                        log_time_ns: header.log_time_ns,
                        publish_time_ns: header.publish_time_ns,
                        connection: *connection,
                        start: bytes.len() - fields.0.len() - len,
                        len,
                    });
                }
                op::CHANNEL => {
                    let (id, channel) = records::parse_channel(body)?;
                    if self.channels.get(&id).is_some_and(|(known, _)| *known != channel) {
                        return Err("a channel is defined twice and differently");
                    }
                }
                _ => {}
            }
        }
        Ok(entries)
    }
}

fn read_error(path: &Path, offset: u64, error: io::Error) -> BagError {
    BagError::Read { path: path.to_path_buf(), offset, source: Arc::new(error) }
}
