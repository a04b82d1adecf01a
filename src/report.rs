//! What a person or a script looks at after a run.

pub mod comparison;
mod document;
pub mod explanation;
pub mod filter_pictures;
pub mod markers;
pub mod page;
pub mod parking;
pub mod parking_page;
pub mod picture;
mod road;
mod road_users;
pub mod samples;
pub mod stages;
pub mod statistics;
pub mod summary;
pub mod table;
pub mod trace;
pub mod usage;
