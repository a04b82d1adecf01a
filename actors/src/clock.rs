//! The node's clock: the machine's time, or a time that somebody sets.
//!
//! Everything that depends on time asks a clock that it was given. A recorded drive and a test step the clock by hand,
//! and no cycle takes any time on it. In a graph the clock is ROS time: the machine's time, or what `/clock` says, which
//! may stand still or go back.

use messages::builtin_interfaces::Time;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicI64, Ordering};
use std::time::{Duration, SystemTime, UNIX_EPOCH};
use tokio::sync::Notify;

/// Where the node's time comes from. Clones of a stepped clock show the same time.
#[derive(Debug, Clone)]
pub enum Clock {
    /// Wall-clock time since the Unix epoch.
    System,
    /// Time that is set from outside, nanoseconds since the epoch of its source. Whoever sets it also wakes the timer.
    Stepped(Arc<AtomicI64>),
    /// Time of a ROS graph.
    Ros(Arc<RosClock>),
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
            Self::System => machine_time(),
            Self::Stepped(nanoseconds) => Time::from_nanoseconds(nanoseconds.load(Ordering::Acquire)),
            Self::Ros(clock) => clock.now(),
        }
    }

    /// Sets a stepped clock, forward or back. Other clocks are not set this way: nothing happens.
    pub fn set(&self, now: Time) {
        if let Self::Stepped(nanoseconds) = self {
            nanoseconds.store(now.nanoseconds(), Ordering::Release);
        }
    }

    /// True if time passes without somebody who wakes the timer at each step.
    pub(crate) fn runs_by_itself(&self) -> bool {
        !matches!(self, Self::Stepped(_))
    }

    /// Returns when `deadline` may have been reached, or when time may have gone back. May return early; the caller
    /// looks at the clock.
    pub(crate) async fn may_reach(&self, deadline: Time) {
        match self {
            Self::System => sleep_until(deadline).await,
            Self::Stepped(_) => std::future::pending().await,
            Self::Ros(clock) if clock.is_simulated() => clock.moved.notified().await,
            Self::Ros(clock) => {
                tokio::select! {
                    () = sleep_until(deadline) => {}
                    () = clock.moved.notified() => {}
                }
            }
        }
    }
}

/// ROS time: the machine's time, or while the graph is simulated the newest time on `/clock`, 0 until the first one.
#[derive(Debug, Default)]
pub struct RosClock {
    simulated: AtomicBool,
    simulated_ns: AtomicI64,
    /// Told at every move of simulated time; one waits, the timer.
    moved: Notify,
}

impl RosClock {
    /// Simulated time standing at 0, or the machine's time.
    #[must_use]
    pub fn new(simulated: bool) -> Self {
        Self { simulated: AtomicBool::new(simulated), ..Self::default() }
    }

    /// True while time is what [`RosClock::set`] says.
    #[must_use]
    pub fn is_simulated(&self) -> bool {
        self.simulated.load(Ordering::Acquire)
    }

    /// Takes time from elsewhere, from 0 on, or from the machine again. The clock jumps.
    pub fn simulate(&self, simulated: bool) {
        if self.simulated.swap(simulated, Ordering::AcqRel) != simulated {
            self.simulated_ns.store(0, Ordering::Release);
            self.moved.notify_one();
        }
    }

    /// A time on `/clock`, forward or back. Without effect on the machine's time.
    pub fn set(&self, now: Time) {
        if self.is_simulated() {
            self.simulated_ns.store(now.nanoseconds(), Ordering::Release);
            self.moved.notify_one();
        }
    }

    /// Now.
    #[must_use]
    pub fn now(&self) -> Time {
        if self.is_simulated() {
            Time::from_nanoseconds(self.simulated_ns.load(Ordering::Acquire))
        } else {
            machine_time()
        }
    }
}

fn machine_time() -> Time {
    let since_epoch = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    Time::from_nanoseconds(i64::try_from(since_epoch.as_nanos()).unwrap_or(i64::MAX))
}

/// Sleeps for as long as the machine's clock lacks to the deadline.
async fn sleep_until(deadline: Time) {
    let wait_ns = deadline.nanoseconds().saturating_sub(machine_time().nanoseconds());
    tokio::time::sleep(Duration::from_nanos(u64::try_from(wait_ns).unwrap_or(0))).await;
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
    fn simulated_time_is_zero_until_it_is_set_and_may_go_back() {
        let clock = RosClock::new(true);
        assert_eq!(clock.now(), Time::default());
        for sec in [7, 7, 3] {
            clock.set(Time { sec, nanosec: 1 });
            assert_eq!(clock.now(), Time { sec, nanosec: 1 });
        }
    }

    #[test]
    fn switching_simulation_jumps_to_the_machines_time_and_back_to_zero() {
        let clock = RosClock::new(true);
        clock.set(Time { sec: 7, nanosec: 0 });
        clock.simulate(false);
        clock.set(Time { sec: 8, nanosec: 0 });
        assert!(clock.now().sec > 1_577_836_800, "the machine's time is not set by messages");
        clock.simulate(true);
        assert_eq!(clock.now(), Time::default());
    }

    #[test]
    fn the_system_clock_is_past_2020_and_cannot_be_set() {
        Clock::System.set(Time::default());
        assert!(Clock::System.now().sec > 1_577_836_800);
    }
}
