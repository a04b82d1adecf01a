//! The node's clock: the machine's time, or a time that somebody sets.
//!
//! Everything that depends on time asks a clock that it was given. A recorded drive and a test step the clock by hand,
//! and no cycle takes any time on it.

use messages::builtin_interfaces::Time;
use std::sync::Arc;
use std::sync::atomic::{AtomicI64, Ordering};
use std::time::{SystemTime, UNIX_EPOCH};

/// Where the node's time comes from. Clones of a stepped clock show the same time.
#[derive(Debug, Clone)]
pub enum Clock {
    /// Wall-clock time since the Unix epoch.
    System,
    /// Time that is set from outside, nanoseconds since the epoch of its source.
    Stepped(Arc<AtomicI64>),
}

impl Clock {
    /// A clock that stands at `start` until it is set.
    #[must_use]
    pub fn stepped(start: Time) -> Self {
        Self::Stepped(Arc::new(AtomicI64::new(start.nanoseconds())))
    }

    /// Now.
    #[must_use]
    pub fn now(&self) -> Time {
        match self {
            Self::System => {
                let since_epoch = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
                Time::from_nanoseconds(i64::try_from(since_epoch.as_nanos()).unwrap_or(i64::MAX))
            }
            Self::Stepped(nanoseconds) => Time::from_nanoseconds(nanoseconds.load(Ordering::Acquire)),
        }
    }

    /// Sets a stepped clock, forward or back. The machine's clock is not ours to set: nothing happens.
    pub fn set(&self, now: Time) {
        if let Self::Stepped(nanoseconds) = self {
            nanoseconds.store(now.nanoseconds(), Ordering::Release);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clones_of_a_stepped_clock_agree() {
        let clock = Clock::stepped(Time { sec: 1, nanosec: 0 });
        let other = clock.clone();
        clock.set(Time { sec: 2, nanosec: 5 });
        assert_eq!(other.now(), Time { sec: 2, nanosec: 5 });
    }

    #[test]
    fn the_system_clock_is_past_2020_and_cannot_be_set() {
        Clock::System.set(Time::default());
        assert!(Clock::System.now().sec > 1_577_836_800);
    }
}
