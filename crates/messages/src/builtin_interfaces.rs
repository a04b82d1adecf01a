//! `builtin_interfaces`: points in time and spans of time.

use crate::define::message;

const NANOSECONDS_PER_SECOND: i64 = 1_000_000_000;

message! {
    /// A point in time since the epoch of its clock.
    #[derive(Copy, Eq, Hash, PartialOrd, Ord, Default)]
    Time = "builtin_interfaces/msg/Time" {
        /// Whole seconds.
        sec: i32,
        /// Nanoseconds on top, less than 10^9 in a well-formed stamp.
        nanosec: u32,
    }
}

message! {
    /// A span of time; negative spans have a negative `sec` and a non-negative `nanosec`.
    #[derive(Copy, Eq, Hash, PartialOrd, Ord, Default)]
    Duration = "builtin_interfaces/msg/Duration" {
        /// Whole seconds, rounded towards minus infinity.
        sec: i32,
        /// Nanoseconds on top, less than 10^9 in a well-formed span.
        nanosec: u32,
    }
}

macro_rules! conversions {
    ($type:ident) => {
        impl $type {
            /// From nanoseconds; saturates at the ends of the 32-bit seconds.
            #[must_use]
            pub fn from_nanoseconds(nanoseconds: i64) -> Self {
                let sec = nanoseconds.div_euclid(NANOSECONDS_PER_SECOND);
                let nanosec = nanoseconds.rem_euclid(NANOSECONDS_PER_SECOND);
                match i32::try_from(sec) {
                    // The remainder is below 10^9 and fits.
                    Ok(sec) => Self { sec, nanosec: nanosec as u32 },
                    Err(_) if sec < 0 => Self { sec: i32::MIN, nanosec: 0 },
                    Err(_) => Self { sec: i32::MAX, nanosec: 999_999_999 },
                }
            }

            /// All of it in nanoseconds. Cannot overflow.
            #[must_use]
            pub fn nanoseconds(self) -> i64 {
                i64::from(self.sec) * NANOSECONDS_PER_SECOND + i64::from(self.nanosec)
            }

            /// `sec + nanosec * 1e-9` in f64, the formula that upstream uses for stamps and durations. At present-day
            /// epochs its resolution is about 0.24 microseconds, and comparisons depend on it.
            #[must_use]
            pub fn seconds(self) -> f64 {
                f64::from(self.sec) + f64::from(self.nanosec) * 1e-9
            }
        }
    };
}

conversions!(Time);
conversions!(Duration);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nanoseconds_round_trip_on_both_sides_of_zero() {
        for nanoseconds in [0, 1, -1, 999_999_999, -300_000_000, 1_750_000_000_300_000_000] {
            assert_eq!(Time::from_nanoseconds(nanoseconds).nanoseconds(), nanoseconds);
        }
        assert_eq!(Duration::from_nanoseconds(-300_000_000), Duration { sec: -1, nanosec: 700_000_000 });
    }

    #[test]
    fn what_does_not_fit_saturates() {
        assert_eq!(Time::from_nanoseconds(i64::MAX).sec, i32::MAX);
        assert_eq!(Time::from_nanoseconds(i64::MIN).sec, i32::MIN);
    }

    #[test]
    fn seconds_have_the_resolution_of_f64() {
        let now = Time { sec: 1_750_000_000, nanosec: 300_000_000 };
        let stamp = Time { sec: 1_750_000_000, nanosec: 100_000_000 };
        assert!(now.seconds() - stamp.seconds() > 0.2, "exactly 200 ms apart, yet more than 0.2 s in f64");
    }
}
