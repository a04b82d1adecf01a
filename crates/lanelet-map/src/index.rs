//! Spatial queries.
