//! How a caller ends planning before it is done.
//!
//! Planning asks the caller between its steps. A single convex program may take tens of milliseconds, and its solver
//! cannot hold on to the caller: it is given a [`Watch`] that it asks between its iterations.

use std::sync::Arc;

/// Why the caller wants planning to end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Interruption {
    /// Nobody needs the result any more.
    Cancelled,
    /// It has taken too long.
    OutOfTime,
}

/// Whether planning shall end, and why. Answers at once, on any thread; once it has interrupted it does so for good.
pub type Watch = Arc<dyn Fn() -> Option<Interruption> + Send + Sync>;

/// Interrupts when `asked` says so.
pub fn watched_by(asked: impl Fn() -> Option<Interruption> + Send + Sync + 'static) -> Watch {
    Arc::new(asked)
}

/// Never interrupts.
#[must_use]
pub fn unwatched() -> Watch {
    watched_by(|| None)
}

/// Whether a watch, if there is one, says that nobody needs the result any more.
pub(crate) fn is_cancelled(watch: Option<&Watch>) -> bool {
    watch.is_some_and(|watch| watch() == Some(Interruption::Cancelled))
}

/// Asked while a path is refined whether to make do with what there is.
pub trait Patience {
    /// Whether it is over.
    fn ends(&mut self) -> bool;

    /// Breaks a solve off that nobody needs any more. One that is only late runs to its end: its result is worth more
    /// than the milliseconds.
    fn watch(&self) -> Option<Watch> {
        None
    }
}

impl<F: FnMut() -> bool> Patience for F {
    fn ends(&mut self) -> bool {
        self()
    }
}
