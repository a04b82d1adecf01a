//! Hybrid A*: a coarse, drivable path from start to goal.

mod path;

pub use path::{CoarsePath, GearPart};
