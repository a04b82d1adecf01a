//! What a person or a script looks at after a run.

pub mod explanation;
pub mod page;
pub mod statistics;
pub mod summary;
pub mod table;
mod usage;
