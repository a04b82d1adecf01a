//! Who has the pipeline, and which cycle is waited for, as a value.
//!
//! There is one pipeline, so there is one cycle at a time. Whoever was given up finds nobody waiting when it comes back.

/// The one thing, here or away.
#[derive(Debug)]
pub(crate) struct Custody<T> {
    here: Option<T>,
    /// The cycle that it is away for and that was not given up.
    awaited: Option<u64>,
}

impl<T> Custody<T> {
    pub(crate) fn of(thing: T) -> Self {
        Self { here: Some(thing), awaited: None }
    }

    /// The thing, if it is here.
    pub(crate) fn here(&mut self) -> Option<&mut T> {
        self.here.as_mut()
    }

    /// Gives it away for a cycle; `None` if it is away.
    pub(crate) fn hand_out(&mut self, cycle: u64) -> Option<T> {
        let thing = self.here.take()?;
        self.awaited = Some(cycle);
        Some(thing)
    }

    /// It comes back from a cycle; false if nobody waits for that cycle any more.
    pub(crate) fn take_back(&mut self, thing: T, cycle: u64) -> bool {
        self.here = Some(thing);
        self.give_up(cycle)
    }

    /// Nobody waits for a cycle any more; false if nobody did.
    pub(crate) fn give_up(&mut self, cycle: u64) -> bool {
        self.awaited.take_if(|awaited| *awaited == cycle).is_some()
    }
}
