//! One rosbag2 sqlite3 file (`.db3`), read only.
//!
//! The time, size and topic of every row are listed once, straight from the table: neither the order nor the counts
//! depend on the file's index. Payloads are fetched in blocks of a few megabytes.

use std::{collections::BTreeMap, fs::File, io::Read, path::Path, sync::Arc};

use rusqlite::{OpenFlags, Row, config::DbConfig, types::ValueRef};

use super::{
    BagError, Connection, SchemaText,
    block::{Block, Contents, Entry, Loaded},
};

/// A block ends when its payloads reach this size, in bytes, or at [`BLOCK_ROWS`].
const BLOCK_BYTES: u64 = 4 << 20;
const BLOCK_ROWS: u64 = 512;
/// The fixed part at the front of every sqlite3 file.
const HEADER_LEN: usize = 100;
pub(super) const MAGIC: &[u8; 16] = b"SQLite format 3\0";

#[derive(Debug, Clone, Copy)]
struct RowInfo {
    log_time_ns: i64,
    id: i64,
    connection: u32,
    len: u32,
}

#[derive(Debug)]
pub(super) struct SqliteFile {
    path: Arc<Path>,
    database: rusqlite::Connection,
    /// In order of log time, then id.
    rows: Vec<RowInfo>,
}

/// Opens the database `file`, called `path` in messages to the user.
pub(super) fn scan(path: Arc<Path>, file: &Path) -> Result<(SqliteFile, Contents), BagError> {
    check_length(&path, file)?;
    let database = connect(&path, file)?;
    let (mut connections, numbers) =
        topics(&database).map_err(|error| sqlite_error(&path, "reading the topics", error))?;
    let schemas = message_definitions(&database)
        .map_err(|error| sqlite_error(&path, "reading the message definitions", error))?;
    for connection in &mut connections {
        connection.schema = schemas.get(&*connection.type_name).cloned();
    }
    let mut rows = list_rows(&path, &database, &numbers)?;
    for row in &rows {
        connections[row.connection as usize].message_count += 1;
    }
    rows.sort_unstable_by_key(|row| (row.log_time_ns, row.id));
    let contents = Contents { connections, blocks: blocks(&rows), ..Contents::default() };
    Ok((SqliteFile { path, database, rows }, contents))
}

/// sqlite3 notices a missing tail only when it gets there; the header tells at once.
fn check_length(path: &Path, file: &Path) -> Result<(), BagError> {
    let read_error = |error| BagError::Read { path: path.to_path_buf(), offset: 0, source: Arc::new(error) };
    let mut handle = File::open(file).map_err(read_error)?;
    let len = handle.metadata().map_err(read_error)?.len();
    let mut header = [0; HEADER_LEN];
    if handle.read_exact(&mut header).is_err() {
        return Err(BagError::Truncated { path: path.to_path_buf(), offset: len, messages_read: 0 });
    }
    let number = |at: usize| u32::from_be_bytes([header[at], header[at + 1], header[at + 2], header[at + 3]]);
    let page_len = match u16::from_be_bytes([header[16], header[17]]) {
        1 => 65_536,
        len => u64::from(len),
    };
    // Writers too old to keep the page count leave a different change counter beside it.
    let count_is_valid = number(24) == number(92);
    if count_is_valid && len < page_len * u64::from(number(28)) {
        return Err(BagError::Truncated { path: path.to_path_buf(), offset: len, messages_read: 0 });
    }
    Ok(())
}

fn connect(path: &Path, file: &Path) -> Result<rusqlite::Connection, BagError> {
    let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_NO_MUTEX;
    let open = |target: &Path, flags| {
        let database = rusqlite::Connection::open_with_flags(target, flags)?;
        // A view in place of a table can have rows without end; and what a schema calls is not trusted either.
        database.set_db_config(DbConfig::SQLITE_DBCONFIG_ENABLE_VIEW, false)?;
        database.set_db_config(DbConfig::SQLITE_DBCONFIG_TRUSTED_SCHEMA, false)?;
        database.query_row("select count(*) from sqlite_master", [], |_| Ok(()))?; // opening alone reads nothing
        Ok(database)
    };
    let name = file.to_string_lossy();
    let log_is_empty =
        std::fs::metadata(format!("{name}-wal")).map_or(true, |information| information.len() == 0);
    let opened = open(file, flags).or_else(|error| {
        if !log_is_empty {
            return Err(error);
        }
        // A database in write-ahead mode wants to make files beside it. Where the folder forbids that, and nothing
        // waits in the log, the file alone is the whole recording.
        let escaped = name.replace('%', "%25").replace('?', "%3f").replace('#', "%23");
        let target = format!("file:{escaped}?immutable=1");
        open(Path::new(&target), flags | OpenFlags::SQLITE_OPEN_URI)
    });
    opened.map_err(|error| sqlite_error(path, "opening the database", error))
}

fn columns(database: &rusqlite::Connection, table: &str) -> rusqlite::Result<Vec<String>> {
    let mut statement = database.prepare("select name from pragma_table_info(?1)")?;
    let names = statement.query_map([table], |row| row.get(0))?;
    names.collect()
}

/// The topics, and the number of each by its id.
fn topics(database: &rusqlite::Connection) -> rusqlite::Result<(Vec<Connection>, BTreeMap<i64, u32>)> {
    // Older recorders have no QoS column.
    let has_qos = columns(database, "topics")?.iter().any(|name| name == "offered_qos_profiles");
    let qos = if has_qos { "offered_qos_profiles" } else { "null" };
    let mut statement = database
        .prepare(&format!("select id, name, type, serialization_format, {qos} from topics order by id"))?;
    let mut rows = statement.query([])?;
    let (mut connections, mut numbers) = (Vec::new(), BTreeMap::new());
    while let Some(row) = rows.next()? {
        numbers.insert(row.get(0)?, connections.len() as u32);
        let offered_qos: Option<String> = row.get(4)?;
        connections.push(Connection {
            topic: row.get::<_, String>(1)?.into(),
            type_name: row.get::<_, String>(2)?.into(),
            serialization: row.get(3)?,
            schema: None,
            offered_qos: offered_qos.filter(|text| !text.is_empty()),
            message_count: 0,
        });
    }
    Ok((connections, numbers))
}

/// Schema texts by type name; recorders before Iron store none.
fn message_definitions(
    database: &rusqlite::Connection,
) -> rusqlite::Result<BTreeMap<String, Arc<SchemaText>>> {
    if columns(database, "message_definitions")?.is_empty() {
        return Ok(BTreeMap::new());
    }
    let mut statement = database.prepare(
        "select topic_type, encoding, encoded_message_definition from message_definitions order by id",
    )?;
    let definitions = statement
        .query_map([], |row| Ok((row.get(0)?, SchemaText { encoding: row.get(1)?, text: row.get(2)? })))?;
    definitions
        .filter(|definition| !matches!(definition, Ok((_, schema)) if schema.text.is_empty()))
        .map(|definition| definition.map(|(type_name, schema)| (type_name, Arc::new(schema))))
        .collect()
}

fn list_rows(
    path: &Path,
    database: &rusqlite::Connection,
    numbers: &BTreeMap<i64, u32>,
) -> Result<Vec<RowInfo>, BagError> {
    let failed = |error| sqlite_error(path, "listing the messages", error);
    // "not indexed": an index that lost rows must not hide them.
    let mut statement = database
        .prepare("select id, topic_id, timestamp, length(data) from messages not indexed")
        .map_err(failed)?;
    let mut rows = statement.query([]).map_err(failed)?;
    let mut listed = Vec::new();
    while let Some(row) = rows.next().map_err(failed)? {
        let id = row.get(0).map_err(failed)?;
        listed.push(row_info(row, id, numbers).map_err(failed)?.map_err(|what| damaged_row(path, id, what))?);
    }
    Ok(listed)
}

fn row_info(
    row: &Row<'_>,
    id: i64,
    numbers: &BTreeMap<i64, u32>,
) -> rusqlite::Result<Result<RowInfo, &'static str>> {
    let topic: i64 = row.get(1)?;
    let log_time_ns: i64 = row.get(2)?;
    let len: Option<i64> = row.get(3)?;
    let Some(&connection) = numbers.get(&topic) else { return Ok(Err("the message names an unknown topic")) };
    let Some(len) = len.and_then(|len| u32::try_from(len).ok()) else {
        return Ok(Err("the message has no payload"));
    };
    if log_time_ns < 0 {
        return Ok(Err("the message was logged before 1970"));
    }
    Ok(Ok(RowInfo { log_time_ns, id, connection, len }))
}

fn blocks(rows: &[RowInfo]) -> Vec<Block> {
    let mut blocks: Vec<Block> = Vec::new();
    let mut bytes = u64::MAX; // forces a first block
    for (number, row) in rows.iter().enumerate() {
        match blocks.last_mut() {
            Some(block) if bytes < BLOCK_BYTES && block.len < BLOCK_ROWS => {
                block.len += 1;
                block.end_ns = row.log_time_ns;
                bytes += u64::from(row.len);
            }
            _ => {
                let time_ns = row.log_time_ns;
                blocks.push(Block { start_ns: time_ns, end_ns: time_ns, start: number as u64, len: 1 });
                bytes = u64::from(row.len);
            }
        }
    }
    blocks
}

impl SqliteFile {
    /// The messages of a block; payloads of connections that are not wanted stay empty.
    pub(super) fn load(&self, block: &Block, wanted: impl Fn(u32) -> bool) -> Result<Loaded, BagError> {
        let failed = |error| sqlite_error(&self.path, "reading a message", error);
        let mut fetch =
            self.database.prepare_cached("select data from messages where id = ?1").map_err(failed)?;
        let rows = self.rows.iter().skip(block.start as usize).take(block.len as usize);
        let (mut bytes, mut entries) = (Vec::new(), Vec::with_capacity(block.len as usize));
        for row in rows {
            let start = bytes.len();
            if wanted(row.connection) {
                let found = fetch.query_row([row.id], |found| {
                    Ok(match found.get_ref(0)? {
                        ValueRef::Blob(data) | ValueRef::Text(data) => {
                            bytes.extend_from_slice(data);
                            true
                        }
                        _ => false,
                    })
                });
                if !found.map_err(failed)? {
                    return Err(damaged_row(&self.path, row.id, "the payload is not bytes"));
                }
            }
            entries.push(Entry {
                log_time_ns: row.log_time_ns,
                publish_time_ns: row.log_time_ns,
                connection: row.connection,
                start,
                len: bytes.len() - start,
            });
        }
        Ok(Loaded { bytes, entries })
    }
}

fn damaged_row(path: &Path, id: i64, what: &str) -> BagError {
    BagError::Damaged { path: path.to_path_buf(), offset: id.unsigned_abs(), what: what.to_owned() }
}

fn sqlite_error(path: &Path, doing: &'static str, error: rusqlite::Error) -> BagError {
    BagError::Sqlite { path: path.to_path_buf(), doing, source: Arc::new(error) }
}
