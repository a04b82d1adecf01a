//! Lets a text through at most once per period, on the node's clock.

use messages::builtin_interfaces::Time;
use std::collections::BTreeMap;

/// Texts remembered at once. There are a few dozen fixed ones; panic texts could be without end.
const MAX_TEXTS: usize = 256;
const NANOSECONDS_PER_MILLISECOND: i64 = 1_000_000;

/// One throttle for each text of each source.
#[derive(Debug, Default)]
pub(super) struct Throttle {
    last_ns: BTreeMap<(&'static str, String), i64>,
}

impl Throttle {
    /// True if the text was not let through within the last `period_ms`. A clock that goes back starts anew.
    pub(super) fn allows(&mut self, now: Time, period_ms: i64, source: &'static str, text: &str) -> bool {
        let now_ns = now.nanoseconds();
        if let Some(last_ns) = self.last_ns.get_mut(&(source, text.to_owned())) {
            let since_ns = now_ns - *last_ns;
            if (0..period_ms * NANOSECONDS_PER_MILLISECOND).contains(&since_ns) {
                return false;
            }
            *last_ns = now_ns;
            return true;
        }
        if self.last_ns.len() >= MAX_TEXTS {
            self.last_ns.clear();
        }
        self.last_ns.insert((source, text.to_owned()), now_ns);
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(milliseconds: i64) -> Time {
        Time::from_nanoseconds(milliseconds * NANOSECONDS_PER_MILLISECOND)
    }

    #[test]
    fn once_per_period_and_text() {
        let mut throttle = Throttle::default();
        assert!(throttle.allows(at(0), 1000, "a", "x"));
        assert!(!throttle.allows(at(999), 1000, "a", "x"));
        assert!(throttle.allows(at(999), 1000, "a", "y"), "another text has its own period");
        assert!(throttle.allows(at(999), 1000, "b", "x"), "another source too");
        assert!(throttle.allows(at(1000), 1000, "a", "x"));
    }

    #[test]
    fn time_going_back_starts_anew() {
        let mut throttle = Throttle::default();
        assert!(throttle.allows(at(5000), 1000, "a", "x"));
        assert!(throttle.allows(at(4000), 1000, "a", "x"));
    }

    #[test]
    fn memory_is_bounded() {
        let mut throttle = Throttle::default();
        for number in 0..10 * MAX_TEXTS {
            throttle.allows(at(0), 1000, "a", &number.to_string());
        }
        assert!(throttle.last_ns.len() <= MAX_TEXTS);
    }
}
