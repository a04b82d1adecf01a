//! Log lines in the forms of ROS: on the console, and as messages for `/rosout`.
//!
//! Levels are per logger, floods of one line are thinned out, and no caller ever waits.

/// Severity of a log line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Severity {
    /// For developers.
    Debug,
    /// Worth knowing.
    Info,
    /// Odd.
    Warn,
    /// Something failed.
    Error,
    /// The end.
    Fatal,
}
