//! Lanelet2 HD maps: reading, asking, writing.
//!
//! Owns the decoded map and the two ways it comes in: the archive of `/map/vector_map`
//! ([`archive`]) and `.osm` files ([`osm`], with [`projection`]). A [`Map`] is immutable, `Send + Sync` and made to
//! be shared as `Arc<Map>`; its elements are `Copy` views that borrow it. [`index`] answers spatial questions,
//! [`dump`] prints a map as canonical text, [`MapBuilder`] makes maps in code.
//!
//! Units are metres in the map frame (x east or as the projector says, y north, z up). Ids are `i64`, unique
//! inside a layer, and may be negative.
//!
//! Promises: no input makes the readers panic, recurse or take memory beyond a small multiple of its size; a map that
//! exists has finite coordinates and unique ids; iteration is in the order of ids, whatever the source.

pub mod archive;
pub mod dump;
mod error;
pub mod index;
mod map;
pub mod osm;
pub mod projection;

pub use error::{
    ArchiveProblem, GridSquare, IssueKind, Layer, LoadIssue, MapError, ProjectorInfoProblem, XmlProblem,
};
pub use map::Map;
pub use map::attributes::{Attribute, Attributes};
pub use map::builder::{Bound, MapBuilder, Member};
pub use map::elements::{Area, Lanelet, Parameter, Point, Polyline, RegulatoryElement, Role};
pub use map::load::LoadedMap;
