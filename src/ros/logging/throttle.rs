//! Thins out lines that one place in the code repeats.

use std::collections::HashMap;
use std::time::Duration;

/// Places that are remembered; beyond them the oldest half of the memory is given up.
const MAX_PLACES: usize = 1024;

/// A place in the code: module, file, line.
type Place<'a> = (&'a str, &'a str, u32);

/// Remembers when each place spoke last.
#[derive(Debug)]
pub(super) struct Throttle {
    period: Duration,
    places: HashMap<(String, String, u32), Spoken>,
}

#[derive(Debug)]
struct Spoken {
    last: Duration,
    suppressed: u64,
}

/// What becomes of a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Verdict {
    /// It is shown, and stands for this many that were not.
    Show {
        /// Lines of the same place since the last one that was shown.
        suppressed: u64,
    },
    /// It is not shown.
    Hide,
}

impl Throttle {
    /// One line of a place in each period.
    pub(super) fn new(period: Duration) -> Self {
        Self { period, places: HashMap::new() }
    }

    /// Whether a line of this place is shown now.
    pub(super) fn ask(&mut self, (module, file, line): Place<'_>, now: Duration) -> Verdict {
        let place = (module.to_owned(), file.to_owned(), line);
        if let Some(spoken) = self.places.get_mut(&place) {
            if now.saturating_sub(spoken.last) < self.period {
                spoken.suppressed += 1;
                return Verdict::Hide;
            }
            let suppressed = spoken.suppressed;
            *spoken = Spoken { last: now, suppressed: 0 };
            return Verdict::Show { suppressed };
        }
        if self.places.len() >= MAX_PLACES {
            self.forget();
        }
        self.places.insert(place, Spoken { last: now, suppressed: 0 });
        Verdict::Show { suppressed: 0 }
    }

    fn forget(&mut self) {
        let mut times: Vec<Duration> = self.places.values().map(|spoken| spoken.last).collect();
        let middle = times.len() / 2;
        let (_, median, _) = times.select_nth_unstable(middle);
        let median = *median;
        self.places.retain(|_, spoken| spoken.last > median);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const A: Place<'_> = ("rustdds::rtps", "reader.rs", 7);

    #[test]
    fn the_first_line_passes_then_one_in_each_period() {
        let mut throttle = Throttle::new(Duration::from_secs(5));
        let mut ask = |place, millis| throttle.ask(place, Duration::from_millis(millis));
        let show = |suppressed| Verdict::Show { suppressed };
        assert_eq!(ask(A, 0), show(0));
        for millis in [0, 1, 4999] {
            assert_eq!(ask(A, millis), Verdict::Hide);
        }
        assert_eq!(ask(("rustdds::rtps", "reader.rs", 8), 4999), show(0), "another line of code");
        assert_eq!(ask(("other", "reader.rs", 7), 4999), show(0), "another module");
        assert_eq!(ask(A, 5000), show(3));
        assert_eq!(ask(A, 9999), Verdict::Hide);
        assert_eq!(ask(A, 10_000), show(1));
        assert_eq!(ask(A, 60_000), show(0));
    }

    #[test]
    fn memory_is_bounded_and_keeps_the_newest() {
        let mut throttle = Throttle::new(Duration::from_secs(5));
        let module = |index: u32| format!("module_{index}");
        for index in 0..10 * MAX_PLACES as u32 {
            throttle.ask((&module(index), "", 0), Duration::from_nanos(index.into()));
            assert!(throttle.places.len() <= MAX_PLACES);
        }
        let last = 10 * MAX_PLACES as u32 - 1;
        assert_eq!(throttle.ask((&module(last), "", 0), Duration::from_nanos(last.into())), Verdict::Hide);
        // places that all spoke at the same time
        for index in 0..2 * MAX_PLACES as u32 {
            throttle.ask((&module(index), "x", 0), Duration::from_secs(1));
        }
        assert!(throttle.places.len() <= MAX_PLACES);
    }
}
