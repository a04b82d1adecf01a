//! Spatial questions about a map, in the x-y plane.
//!
//! Indexes are built on demand for the elements a filter cares about, own what they answer with, and do not borrow
//! the map: keep them as long as the map they were made of. Questions write into a buffer of the caller and allocate
//! nothing once it has grown. Answers do not depend on the shape of the tree: they are ordered by distance or
//! by id.

mod outlines;
mod planar;
mod segments;
mod tree;

pub use outlines::{Outline, OutlineIndex};
pub use segments::{NearSegment, Segment, SegmentIndex};
