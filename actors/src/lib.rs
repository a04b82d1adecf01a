//! Who owns what in the trajectory selector, and when a cycle runs.
//!
//! Each piece of mutable state has one owner, an actor; all owners live on one arbiter thread and exchange immutable
//! snapshots. Judging, the only heavy work, goes out to a rayon pool and comes back as a message.
//!
//! ```text
//!  anchor, backup ─► buffer ──(anchor added)──► scheduler ─► validation ─► publisher ─► sink
//!                      ▲                         │  ▲ ▲        (rayon)        │
//!                      └────── fresh candidates ─┤  │ └─── cycle ended ───────┘
//!  sensors, map ──► sensors ◄───── snapshot ─────┘  └ fallback timer
//!
//!  goal ──► provider (planning thread) ─ first in a cycle ─► buffer
//! ```

pub mod buffer;
pub mod clock;
pub mod cycle;
pub mod inlets;
#[cfg(test)]
mod interleavings;
mod lifeline;
mod map_decoder;
pub mod provider;
pub mod publisher;
pub mod scheduler;
pub mod sensors;
pub mod system;
pub mod tally;
pub mod time_tree;
pub mod topics;
pub mod validation;

pub use clock::{Clock, RosClock};
pub use cycle::{Cycle, CycleReport, Outcome, Trigger};
pub use inlets::Inlets;
pub use publisher::{Publication, Sink, SinkError};
pub use scheduler::Parameters;
pub use system::{Config, SelectorSystem, SystemError};
pub use tally::{DropReason, Tally};
pub use topics::{Input, InputTopic, OutputTopic};
