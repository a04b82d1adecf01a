//! The bytes of `LaneletMapBin.data`: a Boost binary archive of a lanelet2 map, read and written.
//!
//! [`decode`] promises, for any input: a value or a [`MapError`], never a panic; no recursion, so any caller
//! thread will do; at most four times the input plus a constant of memory. It accepts every Boost library
//! version from 8 on, follows the tracking flags of the archive, and keeps unknown subtypes, roles and
//! attributes. [`encode`] writes library version 18 (that of Ubuntu 22.04), which all readers since accept.

mod class;
mod decode;
mod encode;
mod reader;

use crate::error::MapError;
use crate::map::Map;

/// The archive's signature, after its length.
const SIGNATURE: &[u8; 22] = b"serialization::archive";

/// Largest archive that is read. Offsets inside a map are 32 bits; a large city has 50 MB.
pub const MAX_ARCHIVE_BYTES: usize = 1 << 30;

/// Facts about an archive that are not part of the map.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ArchiveInfo {
    /// Boost archive library version of the writer.
    pub library_version: u16,
    /// Number of objects with an object id.
    pub objects: usize,
    /// Deepest nesting of objects inside one another; a point of the point layer has depth 1.
    pub max_depth: usize,
    /// Types whose class version or tracking flag is not the one all known writers use. The archive was read by
    /// its own flags; a number above 0 is worth a warning, since a new version may mean something new.
    pub unfamiliar_types: usize,
}

/// Reads a map.
///
/// # Errors
/// [`MapError::Archive`] with the offset where the bytes are damaged, [`MapError::DuplicateId`] and
/// [`MapError::NonFinitePoint`] for maps that must not be used, [`MapError::TooLarge`] above
/// [`MAX_ARCHIVE_BYTES`].
pub fn decode(bytes: &[u8]) -> Result<Map, MapError> {
    decode_with_info(bytes).map(|(map, _)| map)
}

/// As [`decode`], and tells about the archive.
///
/// # Errors
/// As [`decode`].
pub fn decode_with_info(bytes: &[u8]) -> Result<(Map, ArchiveInfo), MapError> {
    decode::decode(bytes)
}

/// Writes a map, so that `decode(&encode(&map))` equals `map`. Layers are written in the order of ids, so
/// equal maps give equal bytes.
#[must_use]
pub fn encode(map: &Map) -> Vec<u8> {
    encode::encode(map.store())
}

/// Whether the bytes begin like an archive (and not like an OSM file).
#[must_use]
pub fn is_archive(bytes: &[u8]) -> bool {
    bytes.get(8..30).is_some_and(|signature| signature == SIGNATURE)
}
