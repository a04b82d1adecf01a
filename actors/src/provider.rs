//! Runs the open-space provider beside the selector: plans on a thread of its own.

mod planning_thread;

#[cfg(test)]
mod exploration;
#[cfg(test)]
mod stand_ins;
#[cfg(test)]
mod tests;

/// What the planning thread is made of; its exploration puts other primitives in their place.
mod sync {
    pub(super) use std::sync::atomic::{AtomicBool, Ordering};
    pub(super) use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
    pub(super) use std::thread::{Builder, JoinHandle};
}

pub use planning_thread::{MakePlanner, PlanJob, PlanningThread};
