//! The running selector on a terminal: how often it runs, what starts a cycle, who is accepted and who objects, how long
//! it takes, and what it warns of.
//!
//! Everything that is shown comes from what the node publishes, whether it runs in this process over a recorded drive
//! or elsewhere in a graph; so both look the same. Counting ([`board`]) and drawing ([`view`]) are pure; the terminal
//! ([`screen`]) is given back as it was found, however the program ends.

pub mod board;
mod histogram;
pub mod screen;
pub mod view;

use selector_actors::OutputTopic;
use selector_actors::topics::OutputMessage;

/// Something that the selector said.
#[derive(Debug, Clone)]
pub enum Told {
    /// It published.
    Published(OutputTopic, OutputMessage),
    /// It wrote a warning, or an error, into its log.
    Warning(String),
    /// It will say no more, and why.
    Ended(String),
}

/// Whether the board counts what is published on a topic.
#[must_use]
pub fn is_counted(topic: OutputTopic) -> bool {
    matches!(
        topic,
        OutputTopic::Diagnostics
            | OutputTopic::ValidationReports
            | OutputTopic::FilterProcessingTime(_)
            | OutputTopic::ProcessingTimeTree
    )
}
