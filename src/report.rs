//! What a person or a script looks at after a run.

pub mod explanation;
pub mod filter_pictures;
pub mod markers;
pub mod page;
pub mod picture;
mod road;
mod road_users;
pub mod statistics;
pub mod summary;
pub mod table;
mod usage;
