//! The arithmetic of the fallback timer, without any clock.

use messages::builtin_interfaces::Time;

const NANOSECONDS_PER_MILLISECOND: i64 = 1_000_000;

/// A periodic timer on the node's clock that can be pushed back.
#[derive(Debug, Clone, Copy)]
pub struct FallbackTimer {
    period_ns: i64,
    armed_at_ns: i64,
    deadline_ns: i64,
}

impl FallbackTimer {
    /// First due one period after `now`. A period below 1 ms counts as 1 ms.
    #[must_use]
    pub fn new(now: Time, period_ms: i64) -> Self {
        let mut timer = Self { period_ns: period_ns(period_ms), armed_at_ns: 0, deadline_ns: 0 };
        timer.reset(now);
        timer
    }

    /// When it is due.
    #[must_use]
    pub fn deadline(&self) -> Time {
        Time::from_nanoseconds(self.deadline_ns)
    }

    /// Next due one period after `now`.
    pub fn reset(&mut self, now: Time) {
        self.armed_at_ns = now.nanoseconds();
        self.deadline_ns = self.armed_at_ns.saturating_add(self.period_ns);
    }

    /// Takes a new period and starts anew with it; true if it differs from the old one, else nothing changes.
    pub fn set_period(&mut self, now: Time, period_ms: i64) -> bool {
        let is_new = self.period_ns != period_ns(period_ms);
        if is_new {
            self.period_ns = period_ns(period_ms);
            self.reset(now);
        }
        is_new
    }

    /// True if the timer is due at `now`; then its deadline moves on by whole periods past `now`, so that missed ones
    /// do not queue up. If the clock went back, the timer starts anew and is not due.
    pub fn fire(&mut self, now: Time) -> bool {
        let now_ns = now.nanoseconds();
        if now_ns < self.armed_at_ns {
            self.reset(now);
            return false;
        }
        if now_ns < self.deadline_ns {
            return false;
        }
        let missed = (now_ns - self.deadline_ns) / self.period_ns;
        self.deadline_ns = self.deadline_ns.saturating_add((missed + 1).saturating_mul(self.period_ns));
        self.armed_at_ns = now_ns;
        true
    }
}

fn period_ns(period_ms: i64) -> i64 {
    period_ms.max(1).saturating_mul(NANOSECONDS_PER_MILLISECOND)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn ms(milliseconds: i64) -> Time {
        Time::from_nanoseconds(milliseconds * NANOSECONDS_PER_MILLISECOND)
    }

    #[test]
    fn first_due_one_period_after_creation() {
        let mut timer = FallbackTimer::new(ms(1000), 150);
        assert!(!timer.fire(ms(1149)));
        assert!(timer.fire(ms(1150)));
        assert_eq!(timer.deadline(), ms(1300));
    }

    #[test]
    fn missed_deadlines_do_not_queue_up() {
        let mut timer = FallbackTimer::new(ms(0), 150);
        assert!(timer.fire(ms(1000)));
        assert_eq!(timer.deadline(), ms(1050), "the phase is kept");
        assert!(!timer.fire(ms(1000)));
    }

    #[test]
    fn a_jump_from_zero_fires_once() {
        let mut timer = FallbackTimer::new(ms(0), 150);
        assert!(timer.fire(ms(1_750_000_000_000)));
        assert!(!timer.fire(ms(1_750_000_000_000)));
    }

    #[test]
    fn reset_counts_from_now() {
        let mut timer = FallbackTimer::new(ms(0), 150);
        timer.reset(ms(140));
        assert!(!timer.fire(ms(289)));
        assert!(timer.fire(ms(290)));
    }

    #[test]
    fn the_same_period_again_changes_nothing() {
        let mut timer = FallbackTimer::new(ms(0), 150);
        assert!(!timer.set_period(ms(100), 150));
        assert_eq!(timer.deadline(), ms(150));
        assert!(timer.set_period(ms(100), 400));
        assert_eq!(timer.deadline(), ms(500));
    }

    #[test]
    fn a_clock_that_goes_back_starts_the_timer_anew() {
        let mut timer = FallbackTimer::new(ms(10_000), 150);
        assert!(!timer.fire(ms(2000)));
        assert_eq!(timer.deadline(), ms(2150));
    }

    proptest! {
        #[test]
        fn the_deadline_is_always_within_one_period_after_firing(
            start in 0_i64..10_000, period in 1_i64..2000, later in 0_i64..1_000_000,
        ) {
            let mut timer = FallbackTimer::new(ms(start), period);
            let now = ms(start + later);
            let due = later >= period;
            prop_assert_eq!(timer.fire(now), due);
            if due {
                let wait = timer.deadline().nanoseconds() - now.nanoseconds();
                prop_assert!(wait > 0 && wait <= period * NANOSECONDS_PER_MILLISECOND);
            }
        }
    }
}
