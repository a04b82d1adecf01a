//! The trajectories that were chosen last, which the consistency metrics compare with.
//!
//! Bounded twice: by number, and by age on the node's clock, because what was chosen long ago says nothing about where
//! the vehicle means to go. A clock that goes back starts anew.

use crate::candidate::Points;
use messages::builtin_interfaces::Time;
use motion::Pose;
use motion::{Point2, Posed, TrajectoryPoint};
use std::collections::VecDeque;
use std::sync::Arc;

/// Age beyond which a chosen trajectory is forgotten: the length of a long prediction, and as long as filters keep what
/// they know of a candidate.
const MAX_AGE_NS: i64 = 10_000_000_000;

/// A trajectory that was chosen.
#[derive(Debug, Clone)]
pub struct Chosen {
    /// When it was chosen.
    pub at: Time,
    /// The stamp of its header.
    pub stamp: Time,
    /// Its points.
    pub points: Arc<Points>,
    /// Where the vehicle was when it was chosen.
    pub ego: Pose,
}

/// The last chosen trajectories.
#[derive(Debug, Default)]
pub struct History {
    /// Oldest first.
    chosen: VecDeque<Chosen>,
    /// Whether the cycle before this one chose a trajectory.
    has_previous: bool,
}

impl History {
    /// Adds what was chosen and keeps at most `size` (at least 1) trajectories.
    pub fn push(&mut self, chosen: Chosen, size: usize) {
        self.forget_old(chosen.at);
        self.chosen.push_back(chosen);
        while self.chosen.len() > size.max(1) {
            self.chosen.pop_front();
        }
        self.has_previous = true;
    }

    /// A cycle chose nothing: there is no previous trajectory any more. The older ones stay.
    pub fn nothing_chosen(&mut self, at: Time) {
        self.forget_old(at);
        self.has_previous = false;
    }

    /// Forgets what is too old at `now`, or from a future that was taken back.
    pub fn forget_old(&mut self, now: Time) {
        let age_ns = |chosen: &Chosen| now.nanoseconds().saturating_sub(chosen.at.nanoseconds());
        self.chosen.retain(|chosen| (0..=MAX_AGE_NS).contains(&age_ns(chosen)));
        self.has_previous &= !self.chosen.is_empty();
    }

    /// What the cycle before this one chose.
    #[must_use]
    pub fn previous(&self) -> Option<&Chosen> {
        self.chosen.back().filter(|_| self.has_previous)
    }

    /// Number of trajectories remembered.
    #[must_use]
    pub fn len(&self) -> usize {
        self.chosen.len()
    }

    /// True if nothing is remembered.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.chosen.is_empty()
    }

    /// How far apart the remembered trajectories and this one mean the vehicle to be at `horizon_s` after `stamp`: the
    /// standard deviation of the places \[m\]. `None` if there are fewer than two places.
    ///
    /// The place of a trajectory is its first point at or after that time, or its last point. A trajectory whose stamp
    /// is not before that time has none. Times are compared in f64 seconds since the epoch, as upstream does: where a
    /// point is due at that very time, rounding decides whether it counts.
    #[must_use]
    pub fn spread_m(&self, stamp: Time, points: &[TrajectoryPoint], horizon_s: f64) -> Option<f64> {
        let time_s = stamp.seconds() + horizon_s;
        let remembered = self.chosen.iter().filter(|chosen| time_s > chosen.stamp.seconds());
        let places = remembered
            .map(|chosen| (chosen.stamp, &**chosen.points))
            .chain([(stamp, points)])
            .filter_map(|(stamp, points)| place_at(stamp, points, time_s));
        standard_deviation(places)
    }
}

fn place_at(stamp: Time, points: &[TrajectoryPoint], time_s: f64) -> Option<Point2> {
    let stamp_s = stamp.seconds();
    let reached = points.iter().find(|point| stamp_s + point.time_from_start.seconds() >= time_s);
    reached.or(points.last()).map(Posed::point)
}

/// Square root of the sum of both population variances; the same in every frame.
fn standard_deviation(places: impl Iterator<Item = Point2> + Clone) -> Option<f64> {
    let count = places.clone().count();
    if count < 2 {
        return None;
    }
    let sum = places.clone().fold(motion::Vector2::zeros(), |sum, place| sum + place.coords);
    let mean = sum / count as f64;
    let squares: f64 = places.map(|place| (place.coords - mean).norm_squared()).sum();
    Some((squares / count as f64).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_scene::straight;

    fn at_s(seconds: f64) -> Time {
        Time::from_nanoseconds((seconds * 1e9) as i64)
    }

    fn chosen(at: f64, speed_mps: f32) -> Chosen {
        let points = Arc::new(straight(50, speed_mps).into_iter().collect());
        Chosen { at: at_s(at), stamp: at_s(at), points, ego: Pose::default() }
    }

    #[test]
    fn the_number_is_bounded_and_the_oldest_goes() {
        let mut history = History::default();
        for cycle in 0..25 {
            history.push(chosen(f64::from(cycle) * 0.1, 5.0), 10);
            assert_eq!(history.len(), 10.min(cycle as usize + 1));
        }
        assert_eq!(history.chosen[0].at, at_s(1.5));
        history.push(chosen(2.5, 5.0), 3);
        assert_eq!(history.len(), 3, "a smaller size takes effect at once");
        history.push(chosen(2.6, 5.0), 0);
        assert_eq!(history.len(), 1, "one is always kept");
    }

    #[test]
    fn what_is_older_than_ten_seconds_is_forgotten() {
        let mut history = History::default();
        history.push(chosen(0.0, 5.0), 10);
        history.push(chosen(5.0, 5.0), 10);
        history.forget_old(at_s(10.0));
        assert_eq!(history.len(), 2, "ten seconds exactly still count");
        history.forget_old(at_s(10.1));
        assert_eq!(history.len(), 1);
        assert!(history.previous().is_some());
        history.nothing_chosen(at_s(15.1));
        assert!(history.is_empty() && history.previous().is_none());
    }

    #[test]
    fn a_clock_that_goes_back_starts_anew() {
        let mut history = History::default();
        history.push(chosen(100.0, 5.0), 10);
        history.forget_old(at_s(99.9));
        assert!(history.is_empty() && history.previous().is_none());
    }

    #[test]
    fn a_cycle_without_a_choice_leaves_no_previous_but_the_history() {
        let mut history = History::default();
        history.push(chosen(1.0, 5.0), 10);
        assert_eq!(history.previous().unwrap().at, at_s(1.0));
        history.nothing_chosen(at_s(1.1));
        assert!(history.previous().is_none());
        assert_eq!(history.len(), 1);
    }

    #[test]
    fn spread_of_places() {
        let mut history = History::default();
        let own = straight(50, 7.0);
        assert_eq!(history.spread_m(at_s(1.0), &own, 2.0), None, "nothing to compare with");
        history.push(chosen(1.0, 5.0), 10);
        // Both start at x = 0: 10 m and 14 m after two seconds, 2 m on either side of the mean.
        let spread = history.spread_m(at_s(1.0), &own, 2.0).unwrap();
        assert!((spread - 2.0).abs() < 1e-6, "{spread}");
        // Beyond the end of both the last points count: 4.9 s at 5 m/s and at 7 m/s.
        let spread = history.spread_m(at_s(1.0), &own, 60.0).unwrap();
        assert!((spread - 4.9).abs() < 1e-5, "{spread}");
        assert_eq!(history.spread_m(at_s(0.5), &own, 0.5), None, "not yet stamped at that time");
        assert_eq!(history.spread_m(at_s(1.0), &[], 2.0), None, "no points, no place");
    }
}
