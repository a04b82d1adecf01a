//! What can go wrong at the file door, and how much of what was handed out before may be kept.

use std::{io, path::PathBuf, sync::Arc};

/// An error of reading or writing a recorded drive.
///
/// Cheap to clone: the writer reports its first failure at every later call.
#[derive(Debug, Clone, thiserror::Error)]
#[non_exhaustive]
pub enum BagError {
    /// Nothing exists at the path.
    #[error("{path}: there is no such file or folder; check the path")]
    NotFound {
        /// The path as given.
        path: PathBuf,
    },
    /// The operating system refused to open or to read.
    #[error("{path}: cannot read at byte {offset}: {source}; check the permissions and the disk")]
    Read {
        /// The file.
        path: PathBuf,
        /// Byte offset in the file; 0 when opening failed.
        offset: u64,
        /// What the operating system said.
        source: Arc<io::Error>,
    },
    /// The file has no bytes.
    #[error("{path}: the file is empty; the recording was never written or its copy failed")]
    Empty {
        /// The file.
        path: PathBuf,
    },
    /// The file is neither MCAP nor sqlite3.
    #[error(
        "{path}: not a recording: it begins with {found}; expected an .mcap file, a .db3 file or a rosbag2 folder"
    )]
    NotABag {
        /// The file.
        path: PathBuf,
        /// Its first bytes, made printable.
        found: String,
    },
    /// The folder has no `metadata.yaml`.
    #[error(
        "{folder}: not a rosbag2 folder: no metadata.yaml ({found}); name a recording file itself, or run `ros2 bag reindex`"
    )]
    NoBagInFolder {
        /// The folder.
        folder: PathBuf,
        /// What lies there instead, in words.
        found: String,
    },
    /// `metadata.yaml` cannot be understood.
    #[error("{path}: cannot be understood: {reason}; `ros2 bag reindex` writes it anew")]
    Metadata {
        /// The `metadata.yaml`.
        path: PathBuf,
        /// The parser's or our own finding.
        reason: String,
    },
    /// `metadata.yaml` names a file that is not there.
    #[error("{folder}: metadata.yaml lists {file}, which is missing; copy the whole folder")]
    MissingFile {
        /// The rosbag2 folder.
        folder: PathBuf,
        /// The name as listed.
        file: String,
    },
    /// Well-formed, but of a kind this program does not read.
    #[error("{path}: {what} is not supported; {remedy}")]
    Unsupported {
        /// The file.
        path: PathBuf,
        /// The feature that was met.
        what: String,
        /// What the user can do.
        remedy: &'static str,
    },
    /// The file ends early. Comes after every message that is intact.
    #[error(
        "{path}: the recording is cut off at byte {offset}; {messages_read} intact messages were read; `mcap recover` makes a proper file of them"
    )]
    Truncated {
        /// The file.
        path: PathBuf,
        /// Where the first incomplete record begins.
        offset: u64,
        /// Messages of this file that were counted before this was reported.
        messages_read: u64,
    },
    /// Bytes that contradict the format.
    #[error("{path}: damaged at byte {offset}: {what}; copy the file again, or use what was read before")]
    Damaged {
        /// The file.
        path: PathBuf,
        /// Where the offending record begins (rows of a sqlite3 file: the row id).
        offset: u64,
        /// What contradicts the format.
        what: String,
    },
    /// The checksum of one MCAP chunk does not match its contents.
    #[error(
        "{path}: chunk at byte {offset}: checksum is {computed:08x}, the file says {expected:08x}; copy the file again, or use what was read before"
    )]
    ChunkCrc {
        /// The file.
        path: PathBuf,
        /// Where the chunk record begins.
        offset: u64,
        /// The checksum in the file.
        expected: u32,
        /// The checksum of the contents.
        computed: u32,
    },
    /// The checksum over all records does not match.
    #[error(
        "{path}: checksum of the recorded data is {computed:08x}, the file says {expected:08x}: some record is damaged; copy the file again"
    )]
    DataCrc {
        /// The file.
        path: PathBuf,
        /// The checksum in the file.
        expected: u32,
        /// The checksum of the contents.
        computed: u32,
    },
    /// A length above the limit of this program.
    #[error(
        "{path}: at byte {offset}: {what} of {claimed} bytes exceeds the limit of {limit} bytes; {remedy}"
    )]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// Where the claim is made.
        offset: u64,
        /// What is too large.
        what: &'static str,
        /// The size claimed or reached, in bytes.
        claimed: u64,
        /// The limit, in bytes.
        limit: u64,
        /// What the user can do.
        remedy: &'static str,
    },
    /// Fewer or more messages than the recording's own statistics promise. Comes after the last message.
    #[error(
        "{path}: the recording promises {expected} messages, {read} were found; it was changed or damaged after it was made"
    )]
    WrongCount {
        /// The file, or the folder whose `metadata.yaml` promises.
        path: PathBuf,
        /// The number promised.
        expected: u64,
        /// The number found.
        read: u64,
    },
    /// sqlite3 reports an error.
    #[error(
        "{path}: {doing}: {source}; check with `sqlite3 FILE 'pragma integrity_check'`, or copy the file again"
    )]
    Sqlite {
        /// The file.
        path: PathBuf,
        /// What was being read.
        doing: &'static str,
        /// What sqlite3 said.
        source: Arc<rusqlite::Error>,
    },
    /// The output cannot be created.
    #[error("{path}: cannot be created: {source}; choose another output path")]
    Create {
        /// The output path.
        path: PathBuf,
        /// What the operating system said.
        source: Arc<io::Error>,
    },
    /// The output path is a folder.
    #[error("{path}: is a folder and is not overwritten; name a file, for example {path}/out.mcap")]
    IsFolder {
        /// The output path.
        path: PathBuf,
    },
    /// Writing failed, for example on a full disk. Nothing is written after it.
    #[error(
        "{path}: cannot write: {source}; its first {safe_bytes} bytes with {safe_messages} messages stay readable; free space and run again"
    )]
    Write {
        /// The output path.
        path: PathBuf,
        /// Length of the part that holds only complete chunks, in bytes.
        safe_bytes: u64,
        /// Messages in that part.
        safe_messages: u64,
        /// What the operating system said.
        source: Arc<io::Error>,
    },
    /// The MCAP encoder refused a record.
    #[error(
        "{path}: cannot be encoded: {source}; its first {safe_bytes} bytes with {safe_messages} messages stay readable"
    )]
    Encode {
        /// The output path.
        path: PathBuf,
        /// Length of the part that holds only complete chunks, in bytes.
        safe_bytes: u64,
        /// Messages in that part.
        safe_messages: u64,
        /// What the encoder said.
        source: Arc<mcap::McapError>,
    },
    /// A call that the writer cannot carry out. The output stays as it was.
    #[error("{path}: topic {topic}: {what}")]
    Rejected {
        /// The output path.
        path: PathBuf,
        /// The topic, or its number where it has no name.
        topic: String,
        /// What is wrong with the call.
        what: &'static str,
    },
}

/// What an error says about the messages that came before it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DataBefore {
    /// Complete, in order, and what was recorded: it may be used.
    Valid,
    /// In order and unaltered as far as checksums tell, but others may be missing between them.
    Incomplete,
    /// There is none, or it cannot be trusted.
    Nothing,
}

impl BagError {
    /// What may be done with messages read (or written) before this error.
    #[must_use]
    pub fn data_before(&self) -> DataBefore {
        match self {
            Self::Read { offset: 0, .. } => DataBefore::Nothing,
            Self::Read { .. }
            | Self::Truncated { .. }
            | Self::Damaged { .. }
            | Self::ChunkCrc { .. }
            | Self::TooLarge { .. }
            | Self::Sqlite { .. }
            | Self::Write { .. }
            | Self::Encode { .. }
            | Self::Rejected { .. } => DataBefore::Valid,
            Self::WrongCount { .. } => DataBefore::Incomplete,
            Self::NotFound { .. }
            | Self::Empty { .. }
            | Self::NotABag { .. }
            | Self::NoBagInFolder { .. }
            | Self::Metadata { .. }
            | Self::MissingFile { .. }
            | Self::Unsupported { .. }
            | Self::DataCrc { .. }
            | Self::Create { .. }
            | Self::IsFolder { .. } => DataBefore::Nothing,
        }
    }
}
