//! `.osm` files, read the way Autoware's map loader reads them.
//!
//! Three steps: `document` turns XML into nodes, ways and relations; `assemble` makes the elements of the
//! map of them and collects defects as [`LoadIssue`]s; `centerline` adds what Autoware's loader adds before it
//! publishes a map. Elements that Autoware leaves out (rules of unknown subtype or without what their subtype
//! needs, ways with missing nodes) are left out here too, and reported.
//!
//! One difference is deliberate: with the projector `Local`, areas are put together after `local_x` and `local_y` were
//! read. Autoware does it before, when all points coincide, and loses every area.

mod align;
mod area;
mod assemble;
mod centerline;
mod document;
mod rule;
mod xml;

use crate::error::{LoadIssue, MapError};
use crate::map::Map;
use crate::map::load::LoadedMap;
use crate::projection::{Projection, ProjectionError, Projector};

/// Length of the segments of a generated centerline in Autoware, in metres.
pub const CENTERLINE_RESOLUTION_M: f64 = 5.0;

/// Largest OSM text that is read, in bytes.
pub const MAX_OSM_BYTES: usize = 1 << 30;

/// How `.osm` files are read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OsmOptions {
    /// The projector. Without one, [`Map::load`] looks for `map_projector_info.yaml` beside the file; without
    /// that too, it is MGRS if any node has a latitude or longitude other than 0, and Local otherwise.
    pub projector: Option<Projector>,
    /// Whether a map with defects is refused, as Autoware does with all projectors but Local.
    pub strict: bool,
    /// Gives every lanelet a centerline with segments of about this length in metres, and remembers a
    /// centerline of the map's own in the attribute `waypoints`. `None` leaves the map as it is in the file.
    pub centerline_resolution_m: Option<f64>,
}

impl Default for OsmOptions {
    /// As Autoware: strict, centerlines of [`CENTERLINE_RESOLUTION_M`].
    fn default() -> Self {
        Self { projector: None, strict: true, centerline_resolution_m: Some(CENTERLINE_RESOLUTION_M) }
    }
}

/// Reads a map from the texts of one or more `.osm` files; elements of later files replace those with the same
/// id of earlier ones, so tiles that share nodes fit together.
///
/// # Errors
/// [`MapError::Xml`], [`MapError::Projection`], [`MapError::LocalCoordinate`], [`MapError::NonFinitePoint`],
/// [`MapError::TooLarge`], [`MapError::EndlessCenterline`], and [`MapError::Refused`] in strict mode.
pub fn read<'t>(
    texts: impl IntoIterator<Item = &'t [u8]>,
    options: &OsmOptions,
) -> Result<LoadedMap, MapError> {
    let mut document = document::Document::default();
    let mut total = 0_usize;
    for text in texts {
        total = total.saturating_add(text.len());
        if total > MAX_OSM_BYTES {
            return Err(MapError::TooLarge { limit: MAX_OSM_BYTES });
        }
        document.read(text)?;
    }
    let projector = options.projector.unwrap_or_else(|| document.likely_projector());
    let projection = Projection::new(projector)
        .map_err(|problem: ProjectionError| MapError::Projection { node: 0, problem })?;
    let (format_version, map_version) =
        (std::mem::take(&mut document.format_version), std::mem::take(&mut document.map_version));
    let assembled = assemble::assemble(document, projector, &projection)?;
    let (mut store, issues): (_, Vec<LoadIssue>) = (assembled.store, assembled.issues);
    if options.strict && !issues.is_empty() {
        return Err(MapError::Refused { issues });
    }
    if let Some(resolution_m) = options.centerline_resolution_m {
        centerline::add(&mut store, resolution_m)?;
    }
    let map = Map::from_store(store.finish()?);
    Ok(LoadedMap { map, issues, projector: Some(projector), format_version, map_version })
}
