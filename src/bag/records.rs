//! The MCAP records this program reads, parsed from bytes that are already in memory.
//!
//! Every length is checked against the bytes at hand before it is used: nothing here allocates more than its input
//! holds, and nothing panics. Layout: <https://mcap.dev/spec>.

use std::collections::BTreeMap;

pub(super) const MAGIC: &[u8; 8] = b"\x89MCAP0\r\n";
/// Opcode (1 byte) and length (8 bytes) in front of every record.
pub(super) const PREFIX_LEN: u64 = 9;
/// Length of a message record in front of its payload.
pub(super) const MESSAGE_HEADER_LEN: usize = 22;

pub(super) mod op {
    pub(crate) const FOOTER: u8 = 0x02;
    pub(crate) const SCHEMA: u8 = 0x03;
    pub(crate) const CHANNEL: u8 = 0x04;
    pub(crate) const MESSAGE: u8 = 0x05;
    pub(crate) const CHUNK: u8 = 0x06;
    pub(crate) const STATISTICS: u8 = 0x0b;
    pub(crate) const DATA_END: u8 = 0x0f;
}

/// What is wrong with a record, in words that follow "damaged: ".
pub(super) type Fault = &'static str;

/// Reads little-endian fields from the front of a slice.
pub(super) struct Fields<'a>(pub(super) &'a [u8]);

impl<'a> Fields<'a> {
    pub(super) fn bytes(&mut self, len: usize) -> Result<&'a [u8], Fault> {
        let (head, tail) = self.0.split_at_checked(len).ok_or("a field runs past the end of its record")?;
        self.0 = tail;
        Ok(head)
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N], Fault> {
        let (head, tail) = self.0.split_first_chunk().ok_or("a field runs past the end of its record")?;
        self.0 = tail;
        Ok(*head)
    }

    pub(super) fn u8(&mut self) -> Result<u8, Fault> {
        Ok(u8::from_le_bytes(self.array()?))
    }

    pub(super) fn u16(&mut self) -> Result<u16, Fault> {
        Ok(u16::from_le_bytes(self.array()?))
    }

    pub(super) fn u32(&mut self) -> Result<u32, Fault> {
        Ok(u32::from_le_bytes(self.array()?))
    }

    pub(super) fn u64(&mut self) -> Result<u64, Fault> {
        Ok(u64::from_le_bytes(self.array()?))
    }

    /// Bytes behind a 32-bit length.
    pub(super) fn block(&mut self) -> Result<&'a [u8], Fault> {
        let len = self.u32()?;
        self.bytes(usize::try_from(len).map_err(|_| "a length does not fit this machine")?)
    }

    pub(super) fn text(&mut self) -> Result<&'a str, Fault> {
        str::from_utf8(self.block()?).map_err(|_| "a text is not UTF-8")
    }

    /// The next record inside a chunk or a run: opcode and body.
    pub(super) fn record(&mut self) -> Result<(u8, &'a [u8]), Fault> {
        let opcode = self.u8()?;
        let len = self.u64()?;
        let body = usize::try_from(len).ok().and_then(|len| self.bytes(len).ok());
        body.map(|body| (opcode, body)).ok_or("a record inside runs past the end")
    }
}

/// A message definition.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct SchemaRecord {
    pub(super) name: String,
    pub(super) encoding: String,
    pub(super) text: Vec<u8>,
}

pub(super) fn parse_schema(body: &[u8]) -> Result<(u16, SchemaRecord), Fault> {
    let mut fields = Fields(body);
    let id = fields.u16()?;
    let name = fields.text()?.to_owned();
    let encoding = fields.text()?.to_owned();
    Ok((id, SchemaRecord { name, encoding, text: fields.block()?.to_vec() }))
}

/// One publisher's stream of messages.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct ChannelRecord {
    pub(super) schema_id: u16,
    pub(super) topic: String,
    pub(super) encoding: String,
    pub(super) metadata: BTreeMap<String, String>,
}

pub(super) fn parse_channel(body: &[u8]) -> Result<(u16, ChannelRecord), Fault> {
    let mut fields = Fields(body);
    let id = fields.u16()?;
    let schema_id = fields.u16()?;
    let topic = fields.text()?.to_owned();
    let encoding = fields.text()?.to_owned();
    let mut entries = Fields(fields.block()?);
    let mut metadata = BTreeMap::new();
    while !entries.0.is_empty() {
        metadata.insert(entries.text()?.to_owned(), entries.text()?.to_owned());
    }
    Ok((id, ChannelRecord { schema_id, topic, encoding, metadata }))
}

/// The fixed front of a message record.
#[derive(Debug, Clone, Copy)]
pub(super) struct MessageHeader {
    pub(super) channel: u16,
    pub(super) log_time_ns: i64,
    pub(super) publish_time_ns: i64,
}

pub(super) fn parse_message_header(body: &[u8]) -> Result<MessageHeader, Fault> {
    let mut fields = Fields(body);
    let channel = fields.u16()?;
    fields.u32()?; // sequence number: nobody counts with it
    let log_time_ns = i64::try_from(fields.u64()?).map_err(|_| "a log time lies beyond the year 2262")?;
    // Some recorders leave nonsense here; it orders nothing, so it may saturate.
    let publish_time_ns = i64::try_from(fields.u64()?).unwrap_or(i64::MAX);
    Ok(MessageHeader { channel, log_time_ns, publish_time_ns })
}

/// The front of a chunk record.
#[derive(Debug, Clone)]
pub(super) struct ChunkHeader<'a> {
    pub(super) start_ns: i64,
    pub(super) end_ns: i64,
    pub(super) uncompressed_len: u64,
    pub(super) crc: u32,
    pub(super) compression: &'a str,
    pub(super) compressed_len: u64,
}

/// Parses the front of a chunk and leaves the compressed records in `fields`.
pub(super) fn parse_chunk_header<'a>(fields: &mut Fields<'a>) -> Result<ChunkHeader<'a>, Fault> {
    Ok(ChunkHeader {
        start_ns: i64::try_from(fields.u64()?).unwrap_or(i64::MAX),
        end_ns: i64::try_from(fields.u64()?).unwrap_or(i64::MAX),
        uncompressed_len: fields.u64()?,
        crc: fields.u32()?,
        compression: fields.text()?,
        compressed_len: fields.u64()?,
    })
}

/// Counts from the summary.
#[derive(Debug, Clone)]
pub(super) struct Statistics {
    pub(super) messages: u64,
    pub(super) channels: u32,
    pub(super) chunks: u32,
    pub(super) per_channel: BTreeMap<u16, u64>,
}

pub(super) fn parse_statistics(body: &[u8]) -> Result<Statistics, Fault> {
    let mut fields = Fields(body);
    let messages = fields.u64()?;
    fields.u16()?; // schemas
    let channels = fields.u32()?;
    fields.u32()?; // attachments
    fields.u32()?; // metadata records
    let chunks = fields.u32()?;
    fields.u64()?; // first log time
    fields.u64()?; // last log time
    let mut counts = Fields(fields.block()?);
    let mut per_channel = BTreeMap::new();
    while !counts.0.is_empty() {
        per_channel.insert(counts.u16()?, counts.u64()?);
    }
    Ok(Statistics { messages, channels, chunks, per_channel })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_length_beyond_the_record_is_a_fault() {
        let mut fields = Fields(&[0xff, 0xff, 0xff, 0xff, 1, 2]);
        assert!(fields.block().is_err());
        let mut record = vec![op::MESSAGE];
        record.extend_from_slice(&u64::MAX.to_le_bytes());
        assert!(Fields(&record).record().is_err());
    }

    #[test]
    fn a_channel_reads_back() {
        let mut body = vec![7, 0, 3, 0];
        for text in ["/a", "cdr"] {
            body.extend_from_slice(&(text.len() as u32).to_le_bytes());
            body.extend_from_slice(text.as_bytes());
        }
        body.extend_from_slice(&10u32.to_le_bytes());
        body.extend_from_slice(&[1, 0, 0, 0, b'k', 1, 0, 0, 0, b'v']);
        let (id, channel) = parse_channel(&body).unwrap();
        assert_eq!((id, channel.schema_id), (7, 3));
        assert_eq!((channel.topic.as_str(), channel.encoding.as_str()), ("/a", "cdr"));
        assert_eq!(channel.metadata.get("k").map(String::as_str), Some("v"));
        for cut in 0..body.len() {
            assert!(parse_channel(&body[..cut]).is_err(), "cut at {cut}");
        }
    }
}
