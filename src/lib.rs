//! The program behind `trajectory-selector`: its commands and its doors to the world.

pub mod allocations;
pub mod bag;
pub mod commands;
pub mod drive;
pub mod golden;
pub mod json;
pub mod parking_scene;
pub mod recorder;
pub mod report;
pub mod ros;
pub mod scenario;
pub mod session;
pub mod settings;
pub mod stress;
pub mod top;
