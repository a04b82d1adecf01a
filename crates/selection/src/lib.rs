//! From many candidate trajectories to those that are safe, as functions of values.
//!
//! Nothing here knows threads, clocks, files, sockets or logging: time is an argument, the world is a [`Scene`], and
//! the same arguments give the same verdicts on any thread, in any order. The stages, in the order of a cycle:
//!
//! 1. [`Concatenator`] keeps the newest candidates of every generator and gives out those that are still fresh.
//! 2. [`Validator`] judges every candidate with every loaded [`Filter`], after the mandatory data-validity check.
//! 3. [`Ranker`] scores what the enforced filters accepted, and says which candidate is best.
//! 4. [`adapter`] makes the messages that drive the vehicle from the best candidate.
//!
//! [`Pipeline`] joins 2 to 4 to one step; [`report`] puts the verdicts into the messages that leave the node beside it.

pub mod adapter;
pub mod candidate;
pub mod concatenator;
pub mod data_validity;
pub mod filters;
pub mod panics;
pub mod parameters;
pub mod pipeline;
pub mod ranker;
pub mod report;
pub mod scene;
mod survey;
pub mod validator;
pub mod verdict;

#[cfg(test)]
mod test_scene;

pub use candidate::{Candidate, CandidateKey, Points};
pub use concatenator::{Concatenated, Concatenator};
pub use filters::{Filter, Scratch};
pub use pipeline::Pipeline;
pub use ranker::{Rank, Ranker, Ranking};
pub use scene::{MissingInput, Scene};
pub use validator::{Enforcement, Validator};
pub use verdict::{Evidence, Judgement, Memo, Metric, RiskLevel, Verdict};
