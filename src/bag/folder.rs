//! The rosbag2 folder: which files belong to a recording, and how they are packed.

use std::{
    fs::{self, File},
    io::{self, Read, Write},
    path::{Path, PathBuf},
    sync::Arc,
};

use serde::Deserialize;
use tempfile::NamedTempFile;

use super::BagError;

/// Largest `metadata.yaml`, in bytes.
const MAX_METADATA_BYTES: u64 = 64 << 20;
/// Largest file that is unpacked from file-level compression, in bytes.
const MAX_UNPACKED_BYTES: u64 = 64 << 30;
const FILE_NAME: &str = "metadata.yaml";

#[derive(Debug, Deserialize)]
struct Metadata {
    rosbag2_bagfile_information: Information,
}

#[derive(Debug, Deserialize)]
struct Information {
    #[serde(default)]
    relative_file_paths: Vec<String>,
    message_count: Option<u64>,
    #[serde(default)]
    compression_format: String,
    #[serde(default)]
    compression_mode: String,
}

/// What `metadata.yaml` says, as far as it is needed here.
#[derive(Debug)]
pub(super) struct Folder {
    /// The recording's files, in order; they exist.
    pub(super) files: Vec<PathBuf>,
    pub(super) message_count: Option<u64>,
    /// Every payload is compressed on its own.
    pub(super) compressed_messages: bool,
}

pub(super) fn open(folder: &Path) -> Result<Folder, BagError> {
    let path = folder.join(FILE_NAME);
    let information = match File::open(&path) {
        Ok(file) => parse(&path, file)?,
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            return Err(BagError::NoBagInFolder { folder: folder.to_path_buf(), found: contents(folder) });
        }
        Err(error) => return Err(read_error(&path, error)),
    };
    let invalid = |reason: &str| BagError::Metadata { path: path.clone(), reason: reason.to_owned() };
    if information.relative_file_paths.is_empty() {
        return Err(invalid("it lists no files (relative_file_paths)"));
    }
    let compressed_messages = match information.compression_mode.to_ascii_lowercase().as_str() {
        "" | "none" => false,
        mode @ ("file" | "message") if information.compression_format == "zstd" => mode == "message",
        mode => {
            return Err(BagError::Unsupported {
                path,
                what: format!("compression {mode:?} with {:?}", information.compression_format),
                remedy: "convert the recording: `ros2 bag convert`",
            });
        }
    };
    let files =
        information.relative_file_paths.iter().map(|name| locate(folder, name)).collect::<Result<_, _>>()?;
    Ok(Folder { files, message_count: information.message_count, compressed_messages })
}

fn parse(path: &Path, file: File) -> Result<Information, BagError> {
    let mut text = String::new();
    file.take(MAX_METADATA_BYTES).read_to_string(&mut text).map_err(|error| read_error(path, error))?;
    let metadata: Metadata = serde_saphyr::from_str(&text)
        .map_err(|error| BagError::Metadata { path: path.to_path_buf(), reason: error.to_string() })?;
    Ok(metadata.rosbag2_bagfile_information)
}

/// Early recorders wrote the folder's name in front of the file's.
fn locate(folder: &Path, name: &str) -> Result<PathBuf, BagError> {
    let listed = folder.join(name);
    if listed.is_file() {
        return Ok(listed);
    }
    let beside = Path::new(name).file_name().map(|file| folder.join(file)).filter(|path| path.is_file());
    beside.ok_or_else(|| BagError::MissingFile { folder: folder.to_path_buf(), file: name.to_owned() })
}

/// What a folder without metadata holds, in words.
fn contents(folder: &Path) -> String {
    let mut names: Vec<String> = fs::read_dir(folder)
        .into_iter()
        .flatten()
        .flatten()
        .map(|entry| entry.file_name().to_string_lossy().into_owned())
        .filter(|name| [".mcap", ".db3", ".zstd"].iter().any(|ending| name.ends_with(ending)))
        .collect();
    names.sort();
    match names.as_slice() {
        [] => "and no .mcap or .db3 file either".to_owned(),
        [one] => format!("but there is {one}"),
        [first, ..] => format!("but there are {} recording files, the first is {first}", names.len()),
    }
}

/// Unpacks a file that was compressed as a whole into a temporary file, which goes away when dropped.
pub(super) fn unpack(path: &Path) -> Result<NamedTempFile, BagError> {
    let failed = |error| read_error(path, error);
    let mut unpacked = NamedTempFile::new().map_err(failed)?;
    let decoder = File::open(path).and_then(zstd::Decoder::new).map_err(failed)?;
    let mut limited = decoder.take(MAX_UNPACKED_BYTES + 1);
    let len = io::copy(&mut limited, &mut unpacked).map_err(|error| BagError::Damaged {
        path: path.to_path_buf(),
        offset: 0,
        what: format!("the file cannot be unpacked: {error}"),
    })?;
    if len > MAX_UNPACKED_BYTES {
        return Err(BagError::TooLarge {
            path: path.to_path_buf(),
            offset: 0,
            what: "the unpacked file",
            claimed: len,
            limit: MAX_UNPACKED_BYTES,
            remedy: "unpack it with `zstd -d` and open the result",
        });
    }
    unpacked.flush().map_err(failed)?;
    Ok(unpacked)
}

fn read_error(path: &Path, error: io::Error) -> BagError {
    BagError::Read { path: path.to_path_buf(), offset: 0, source: Arc::new(error) }
}
