//! Concatenate, validate, rank and adapt candidate trajectories, as functions of values.

pub mod parameters;
