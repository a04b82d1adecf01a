//! Finds out what an MCAP file holds: chunks, channels, counts, and where it ends.
//!
//! The file is walked record by record without unpacking, so that the list of chunks never depends on an index that
//! may be missing, cut off or wrong. The summary gives channels and counts where it is complete and agrees with the
//! walk; otherwise every chunk is unpacked once to learn them.

use std::{collections::BTreeMap, path::Path, sync::Arc};

use super::{
    BagError, Connection, SchemaText,
    block::{Block, Contents},
    mcap_file::{Bytes, MAX_CHUNK_BYTES, McapFile},
    records::{
        self, ChannelRecord, Fault, Fields, MAGIC, MESSAGE_HEADER_LEN, PREFIX_LEN, SchemaRecord, Statistics,
        op,
    },
};

/// Largest schema, channel or statistics record, in bytes.
const MAX_DEFINITION_BYTES: u64 = 64 << 20;
/// Bytes of a chunk record that hold its front; compression names are short.
const CHUNK_FRONT_BYTES: u64 = 128;
/// Messages outside chunks are loaded in runs of about this size, in bytes.
const RUN_BYTES: u64 = 1 << 20;
/// Read at once for a checksum, in bytes.
const CRC_BUFFER_BYTES: u64 = 256 << 10;
const FOOTER_LEN: u64 = 20;

#[derive(Debug, Default)]
struct Definitions {
    schemas: BTreeMap<u16, SchemaRecord>,
    channels: BTreeMap<u16, ChannelRecord>,
}

impl Definitions {
    /// Takes in a schema or channel record; others are none of its business.
    fn learn(&mut self, opcode: u8, body: &[u8]) -> Result<(), Fault> {
        match opcode {
            op::SCHEMA => {
                let (id, schema) = records::parse_schema(body)?;
                let known = self.schemas.entry(id).or_insert_with(|| schema.clone());
                (*known == schema).then_some(()).ok_or("a schema is defined twice and differently")
            }
            op::CHANNEL => {
                let (id, channel) = records::parse_channel(body)?;
                let known = self.channels.entry(id).or_insert_with(|| channel.clone());
                (*known == channel).then_some(()).ok_or("a channel is defined twice and differently")
            }
            _ => Ok(()),
        }
    }
}

/// What the walk over the records has seen.
#[derive(Debug, Default)]
struct Walk {
    blocks: Vec<Block>,
    chunks: u32,
    /// Messages outside chunks, by channel.
    bare: BTreeMap<u16, u64>,
    /// The last block is a run that the next message may join.
    in_run: bool,
    data: Definitions,
    summary: Definitions,
    statistics: Option<Statistics>,
    /// Offset and checksum of the record that ends the data.
    data_end: Option<(u64, u32)>,
    /// The footer names a summary, and its checksum, if any, is right.
    has_summary: bool,
    warnings: Vec<BagError>,
}

impl Walk {
    fn summary_is_complete(&self) -> bool {
        let Some(statistics) = &self.statistics else { return false };
        let schemas_known =
            self.summary.channels.values().all(|channel| {
                channel.schema_id == 0 || self.summary.schemas.contains_key(&channel.schema_id)
            });
        let counted: u64 = statistics.per_channel.values().fold(0, |sum, count| sum.saturating_add(*count));
        self.has_summary
            && schemas_known
            && statistics.channels as usize == self.summary.channels.len()
            && statistics.chunks == self.chunks
            && statistics.messages == counted
    }

    fn add_message(&mut self, offset: u64, end: u64, header: records::MessageHeader) {
        *self.bare.entry(header.channel).or_default() += 1;
        let time_ns = header.log_time_ns;
        match self.blocks.last_mut() {
            Some(run) if self.in_run && run.len < RUN_BYTES => {
                run.len = end - run.start;
                run.start_ns = run.start_ns.min(time_ns);
                run.end_ns = run.end_ns.max(time_ns);
            }
            _ => self.blocks.push(Block {
                start_ns: time_ns,
                end_ns: time_ns,
                start: offset,
                len: end - offset,
            }),
        }
        self.in_run = true;
    }
}

/// Opens an MCAP file and lists its contents.
pub(super) fn scan(path: Arc<Path>, source: Box<dyn Bytes>) -> Result<(McapFile, Contents), BagError> {
    let mut file = McapFile::new(path, source)?;
    check_magic(&mut file)?;
    let mut walk = Walk::default();
    let mut offset = MAGIC.len() as u64;
    let mut end = loop {
        match step(&mut file, &mut walk, offset) {
            Ok(Some(next)) => offset = next,
            Ok(None) => break None,
            Err(error) => break Some(error),
        }
    };

    if let Some(BagError::Truncated { offset, .. }) = end
        && ends_well(&mut file)?
    {
        end = Some(file.damaged(offset, "a record runs past the end, though the file was not cut off"));
    }
    let complete = walk.summary_is_complete();
    if !walk.bare.is_empty() {
        // Where framing is lost, messages outside chunks may be cut in the wrong places.
        if let Some(error) = end.take_if(|error| !matches!(error, BagError::Truncated { .. })) {
            return Err(error);
        }
        check_data_crc(&mut file, &walk)?; // nothing else protects messages outside chunks
    }
    let (definitions, counts) = if complete {
        let counts = walk.statistics.as_ref().map(|statistics| statistics.per_channel.clone());
        (std::mem::take(&mut walk.summary), counts.unwrap_or_default())
    } else {
        let surveyed = survey(&mut file, &mut walk);
        end = end.or_else(|| check_data_crc(&mut file, &walk).err());
        surveyed
    };

    let promised = walk.statistics.map(|statistics| statistics.messages);
    let connections = connect(&mut file, definitions, &counts);
    Ok((file, Contents { connections, blocks: walk.blocks, promised, end, warnings: walk.warnings }))
}

fn check_magic(file: &mut McapFile) -> Result<(), BagError> {
    if file.len == 0 {
        return Err(BagError::Empty { path: file.path.to_path_buf() });
    }
    let front = file.read_vec(0, file.len.min(MAGIC.len() as u64))?;
    if front == MAGIC {
        return Ok(());
    }
    let path = file.path.to_path_buf();
    Err(if MAGIC.starts_with(&front) {
        BagError::Truncated { path, offset: 0, messages_read: 0 }
    } else {
        BagError::NotABag { path, found: format!("\"{}\"", front.escape_ascii()) }
    })
}

/// Whether the end mark is where it belongs.
fn ends_well(file: &mut McapFile) -> Result<bool, BagError> {
    let len = MAGIC.len() as u64;
    Ok(file.read_vec(file.len.saturating_sub(len), len.min(file.len))? == MAGIC)
}

/// Looks at the record at `offset` and gives the offset of the next one, or `None` behind the footer.
fn step(file: &mut McapFile, walk: &mut Walk, offset: u64) -> Result<Option<u64>, BagError> {
    let cut = BagError::Truncated { path: file.path.to_path_buf(), offset, messages_read: 0 };
    if file.len - offset < PREFIX_LEN {
        return Err(cut);
    }
    let mut prefix = [0; PREFIX_LEN as usize];
    file.read_at(offset, &mut prefix)?;
    let [opcode, len @ ..] = prefix;
    let (len, body) = (u64::from_le_bytes(len), offset + PREFIX_LEN);
    let Some(next) = body.checked_add(len).filter(|next| *next <= file.len) else { return Err(cut) };

    let in_summary = walk.data_end.is_some();
    if opcode != op::MESSAGE || in_summary {
        walk.in_run = false;
    }
    match opcode {
        op::CHUNK if !in_summary => {
            let block = chunk_block(file, offset, len)?;
            walk.blocks.push(block);
            walk.chunks += 1;
        }
        op::MESSAGE if !in_summary => {
            let front = file.read_vec(body, len.min(MESSAGE_HEADER_LEN as u64))?;
            let header =
                records::parse_message_header(&front).map_err(|fault| file.damaged(offset, fault))?;
            walk.add_message(offset, next, header);
        }
        op::SCHEMA | op::CHANNEL | op::STATISTICS => {
            let body = definition(file, body, len)?;
            let learned = match opcode {
                op::STATISTICS => {
                    records::parse_statistics(&body).map(|parsed| walk.statistics = Some(parsed))
                }
                _ if in_summary => walk.summary.learn(opcode, &body),
                _ => walk.data.learn(opcode, &body),
            };
            learned.map_err(|fault| file.damaged(offset, fault))?;
        }
        op::DATA_END => {
            let front = file.read_vec(body, len.min(4))?;
            let crc = Fields(&front).u32().map_err(|fault| file.damaged(offset, fault))?;
            walk.data_end = Some((offset, crc));
        }
        op::FOOTER => return end_of_file(file, walk, offset, len).map(|()| None),
        _ => {} // indexes, attachments, metadata, and whatever a later version adds
    }
    Ok(Some(next))
}

fn chunk_block(file: &mut McapFile, offset: u64, len: u64) -> Result<Block, BagError> {
    let front = file.read_vec(offset + PREFIX_LEN, len.min(CHUNK_FRONT_BYTES))?;
    let mut fields = Fields(&front);
    let chunk = records::parse_chunk_header(&mut fields).map_err(|fault| file.damaged(offset, fault))?;
    let front_len = (front.len() - fields.0.len()) as u64;
    if chunk.compressed_len != len - front_len {
        return Err(file.damaged(offset, "a chunk's sizes contradict each other"));
    }
    let claimed = chunk.uncompressed_len.max(len);
    if claimed > MAX_CHUNK_BYTES {
        return Err(BagError::TooLarge {
            path: file.path.to_path_buf(),
            offset,
            what: "a chunk",
            claimed,
            limit: MAX_CHUNK_BYTES,
            remedy: "if the file is sound, rewrite it with smaller chunks: `mcap compress --chunk-size`",
        });
    }
    Ok(Block { start_ns: chunk.start_ns, end_ns: chunk.end_ns, start: offset, len: PREFIX_LEN + len })
}

fn definition(file: &mut McapFile, body: u64, len: u64) -> Result<Vec<u8>, BagError> {
    if len > MAX_DEFINITION_BYTES {
        return Err(BagError::TooLarge {
            path: file.path.to_path_buf(),
            offset: body - PREFIX_LEN,
            what: "a definition",
            claimed: len,
            limit: MAX_DEFINITION_BYTES,
            remedy: "the file is damaged here, or not a recording of ROS messages",
        });
    }
    file.read_vec(body, len)
}

/// Checks footer, end magic and the checksum of the summary.
fn end_of_file(file: &mut McapFile, walk: &mut Walk, offset: u64, len: u64) -> Result<(), BagError> {
    let path = file.path.to_path_buf();
    let body = file.read_vec(offset + PREFIX_LEN, len.min(FOOTER_LEN))?;
    let mut fields = Fields(&body);
    let parsed =
        (|| Ok((fields.u64()?, fields.u64()?, fields.u32()?)))().map_err(|fault| file.damaged(offset, fault));
    let (summary_start, _, expected) = parsed?;
    let end = offset + PREFIX_LEN + len;
    let tail = file.read_vec(end, (file.len - end).min(MAGIC.len() as u64))?;
    if tail != MAGIC {
        return Err(if MAGIC.starts_with(&tail) {
            BagError::Truncated { path, offset: end, messages_read: 0 }
        } else {
            file.damaged(end, "the end mark is not that of an MCAP file")
        });
    }
    if file.len > end + MAGIC.len() as u64 {
        walk.warnings
            .push(file.damaged(end + MAGIC.len() as u64, "there are bytes behind the end of the recording"));
    }
    let Some((data_end, _)) = walk.data_end else {
        return Err(file.damaged(offset, "the record that ends the data is missing"));
    };
    walk.has_summary = summary_start > data_end && summary_start < offset;
    // The checksum covers the summary and the footer up to the checksum itself.
    let covered = offset + PREFIX_LEN + FOOTER_LEN - 4;
    if walk.has_summary && expected != 0 && crc(file, summary_start, covered)? != expected {
        walk.has_summary = false;
        walk.statistics = None;
        walk.warnings.push(file.damaged(summary_start, "the summary's checksum is wrong; it was not used"));
    }
    Ok(())
}

fn check_data_crc(file: &mut McapFile, walk: &Walk) -> Result<(), BagError> {
    let Some((end, expected)) = walk.data_end.filter(|(_, expected)| *expected != 0) else { return Ok(()) };
    let computed = crc(file, 0, end)?;
    if computed == expected {
        return Ok(());
    }
    Err(BagError::DataCrc { path: file.path.to_path_buf(), expected, computed })
}

fn crc(file: &mut McapFile, mut from: u64, to: u64) -> Result<u32, BagError> {
    let mut hasher = crc32fast::Hasher::new();
    let mut buffer = vec![0; to.saturating_sub(from).min(CRC_BUFFER_BYTES) as usize];
    while from < to {
        let len = (to - from).min(buffer.len() as u64) as usize;
        file.read_at(from, &mut buffer[..len])?;
        hasher.update(&buffer[..len]);
        from += len as u64;
    }
    Ok(hasher.finalize())
}

/// Unpacks every chunk once to learn channels, counts and times.
///
/// A chunk that cannot be unpacked is left as it is: reading reports it when its turn comes.
fn survey(file: &mut McapFile, walk: &mut Walk) -> (Definitions, BTreeMap<u16, u64>) {
    let mut definitions = std::mem::take(&mut walk.data);
    let mut counts = BTreeMap::new();
    for block in &mut walk.blocks {
        if let Ok(records) = file.unpack(block) {
            // A fault stops this chunk here, and again when it is read.
            let _ = survey_block(&records, block, &mut definitions, &mut counts);
        }
    }
    (definitions, counts)
}

fn survey_block(
    bytes: &[u8],
    block: &mut Block,
    definitions: &mut Definitions,
    counts: &mut BTreeMap<u16, u64>,
) -> Result<(), Fault> {
    let mut times: Option<(i64, i64)> = None;
    let mut found: BTreeMap<u16, u64> = BTreeMap::new();
    let mut fields = Fields(bytes);
    while !fields.0.is_empty() {
        let (opcode, body) = fields.record()?;
        definitions.learn(opcode, body)?;
        if opcode == op::MESSAGE {
            let header = records::parse_message_header(body)?;
            let time_ns = header.log_time_ns;
            times = Some(
                times.map_or((time_ns, time_ns), |(first, last)| (first.min(time_ns), last.max(time_ns))),
            );
            *found.entry(header.channel).or_default() += 1;
        }
    }
    for (channel, count) in found {
        *counts.entry(channel).or_default() += count;
    }
    (block.start_ns, block.end_ns) = times.unwrap_or((block.start_ns, block.end_ns));
    Ok(())
}

fn connect(file: &mut McapFile, definitions: Definitions, counts: &BTreeMap<u16, u64>) -> Vec<Connection> {
    let shared = |schema: SchemaRecord| -> (Arc<str>, Option<Arc<SchemaText>>) {
        let text = String::from_utf8_lossy(&schema.text).into_owned();
        let text = (!text.is_empty()).then(|| Arc::new(SchemaText { encoding: schema.encoding, text }));
        (schema.name.into(), text)
    };
    // Made once for each schema: thousands of channels may name the same one.
    let schemas: BTreeMap<u16, _> =
        definitions.schemas.into_iter().map(|(id, schema)| (id, shared(schema))).collect();
    let mut connections = Vec::with_capacity(definitions.channels.len());
    for (id, channel) in definitions.channels {
        let (type_name, schema) = schemas.get(&channel.schema_id).cloned().unwrap_or(("".into(), None));
        connections.push(Connection {
            topic: channel.topic.as_str().into(),
            type_name,
            serialization: channel.encoding.clone(),
            schema,
            offered_qos: channel.metadata.get("offered_qos_profiles").cloned(),
            message_count: counts.get(&id).copied().unwrap_or(0),
        });
        file.channels.insert(id, (channel, connections.len() as u32 - 1));
    }
    connections
}
