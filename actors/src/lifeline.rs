//! Notices the death of an owner, so that the node says so and ends instead of going quiet.
//!
//! The runtime drops an actor whose handler panics without a word to the others: the scheduler would wait for ever for
//! the end of a cycle. What is left of such an actor's state cannot be trusted, so it is not started anew. What this
//! module promises: when a holder of a [`Lifeline`] dies of a panic, all actors stop, and whoever drives the node is told
//! whose panic it was.

use actix::System;
use std::sync::{Arc, OnceLock};
use tokio::sync::watch;
use tracing::error;

/// All lifelines of a system.
#[derive(Debug, Clone)]
pub(crate) struct Lifelines(Arc<Lines>);

#[derive(Debug)]
struct Lines {
    /// Whose panic ended the system.
    dead: watch::Sender<Option<&'static str>>,
    system: OnceLock<System>,
}

impl Default for Lifelines {
    fn default() -> Self {
        Self(Arc::new(Lines { dead: watch::Sender::new(None), system: OnceLock::new() }))
    }
}

impl Lifelines {
    /// Says which system is to be stopped.
    pub(crate) fn hold(&self, system: System) {
        // There is one system for all lifelines.
        let _ = self.0.system.set(system);
    }

    /// A line for the owner of this name.
    pub(crate) fn line(&self, whose: &'static str) -> Lifeline {
        Lifeline { whose, lines: self.clone() }
    }

    /// Stops everything, on the death of the owner of this name.
    pub(crate) fn cut(&self, whose: &'static str) {
        let is_first = self.0.dead.send_if_modified(|dead| {
            let is_first = dead.is_none();
            dead.get_or_insert(whose);
            is_first
        });
        if is_first {
            error!("the {whose} has panicked; the selector stops, nothing more will be published");
        }
        if let Some(system) = self.0.system.get() {
            system.stop();
        }
    }

    /// Who died, if anybody did.
    pub(crate) fn dead(&self) -> Option<&'static str> {
        *self.0.dead.borrow()
    }

    /// Returns when somebody has died.
    pub(crate) async fn death(&self) -> &'static str {
        loop {
            // The sender lives as long as these lines, so the waiting cannot fail.
            let mut dead = self.0.dead.subscribe();
            if let Ok(whose) = dead.wait_for(Option::is_some).await
                && let Some(whose) = *whose
            {
                return whose;
            }
        }
    }
}

/// Held by an owner for as long as it lives.
#[derive(Debug)]
pub(crate) struct Lifeline {
    whose: &'static str,
    lines: Lifelines,
}

impl Drop for Lifeline {
    fn drop(&mut self) {
        if std::thread::panicking() {
            self.lines.cut(self.whose);
        }
    }
}
