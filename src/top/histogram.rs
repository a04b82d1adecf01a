//! Latencies for looking at: quantiles to three digits, and as many bars as a terminal has room for.

use crate::report::statistics::Latency;
use std::time::Duration;

/// Upper ends of the bars, µs; what is longer falls into one more.
pub(super) const EDGES_US: [u64; 12] =
    [50, 100, 200, 500, 1_000, 2_000, 5_000, 10_000, 20_000, 50_000, 100_000, 200_000];
/// The same for people, ms where nothing else is said; not all of them have room.
pub(super) const LABELS: [&str; 13] =
    ["50µ", ".1", ".2", ".5", "1ms", "2", "5", "10", "20", "50", "100", "", "∞"];

/// Latencies of one stage.
#[derive(Debug, Clone, Default)]
pub(super) struct Histogram {
    all: Latency,
    bars: [u64; EDGES_US.len() + 1],
}

impl Histogram {
    pub(super) fn add(&mut self, took: Duration) {
        self.all.record(took);
        let microseconds = u64::try_from(took.as_micros()).unwrap_or(u64::MAX);
        self.bars[EDGES_US.partition_point(|edge| *edge < microseconds)] += 1;
    }

    pub(super) fn bars(&self) -> &[u64] {
        &self.bars
    }

    pub(super) fn count(&self) -> u64 {
        self.all.count()
    }

    pub(super) fn quantile_us(&self, share: f64) -> f64 {
        self.all.quantile_us(share)
    }

    pub(super) fn max_us(&self) -> f64 {
        self.all.max_us()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_latency_falls_into_the_bar_whose_end_it_does_not_exceed() {
        let mut histogram = Histogram::default();
        for microseconds in [0, 50, 51, 1_000, 200_000, 200_001, 90_000_000] {
            histogram.add(Duration::from_micros(microseconds));
        }
        assert_eq!(histogram.bars(), [2, 1, 0, 0, 1, 0, 0, 0, 0, 0, 0, 1, 2]);
        assert_eq!(histogram.count(), 7);
        assert_eq!(LABELS.len(), histogram.bars().len());
    }
}
