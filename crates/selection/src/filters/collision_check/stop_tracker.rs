//! For how long the vehicle and the objects have been standing.
//!
//! Memory from sensors, updated once per cycle. A gap in observation up to the timeout does not end a stop; a longer
//! one does. Time going back forgets everything.

use messages::unique_identifier_msgs::Uuid;
use std::collections::HashMap;

/// More standing objects than this are not tracked; an untracked one counts as moving, the careful side.
pub(super) const MAX_TRACKED: usize = 4096;

#[derive(Debug, Clone, Copy)]
struct Record {
    stopped_since_ns: i64,
    last_seen_ns: i64,
}

/// Standing times, by identity.
#[derive(Debug, Default)]
pub(super) struct StopTracker {
    last_update_ns: Option<i64>,
    standing: HashMap<Uuid, Record>,
}

/// A thing at one instant: who, and how fast over ground \[m/s\] forward and left.
pub(super) type Observation = (Uuid, [f64; 2]);

impl StopTracker {
    /// Takes what was seen at a time. The same time again changes nothing.
    pub(super) fn update(
        &mut self,
        now_ns: i64,
        (threshold_mps, timeout_ns): (f64, i64),
        seen: impl Iterator<Item = Observation>,
    ) {
        match self.last_update_ns {
            Some(last_ns) if last_ns == now_ns => return,
            Some(last_ns) if now_ns < last_ns => self.standing.clear(),
            _ => {}
        }
        self.last_update_ns = Some(now_ns);
        self.standing.retain(|_, record| now_ns - record.last_seen_ns <= timeout_ns);
        for (id, [forward_mps, left_mps]) in seen {
            let is_standing = forward_mps * forward_mps + left_mps * left_mps < threshold_mps * threshold_mps;
            if !is_standing {
                self.standing.remove(&id);
            } else if let Some(record) = self.standing.get_mut(&id) {
                record.last_seen_ns = now_ns;
            } else if self.standing.len() < MAX_TRACKED {
                self.standing.insert(id, Record { stopped_since_ns: now_ns, last_seen_ns: now_ns });
            }
        }
    }

    /// How long something has been standing at the last update \[ns\]; 0 if it is not.
    pub(super) fn standing_ns(&self, id: &Uuid) -> i64 {
        match (self.standing.get(id), self.last_update_ns) {
            (Some(record), Some(last_ns)) => last_ns - record.stopped_since_ns,
            _ => 0,
        }
    }

    /// Number of things that stand.
    pub(super) fn len(&self) -> usize {
        self.standing.len()
    }

    #[cfg(test)]
    fn is_tracked(&self, id: &Uuid) -> bool {
        self.standing.contains_key(id)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ID: Uuid = Uuid { uuid: [7; 16] };
    const SECOND: i64 = 1_000_000_000;

    fn see(tracker: &mut StopTracker, now_ns: i64, velocity: [f64; 2]) {
        tracker.update(now_ns, (0.1, SECOND), std::iter::once((ID, velocity)));
    }

    fn see_nothing(tracker: &mut StopTracker, now_ns: i64) {
        tracker.update(now_ns, (0.1, SECOND), std::iter::empty());
    }

    #[test]
    fn standing_time_grows_to_the_nanosecond() {
        let mut tracker = StopTracker::default();
        for now in [10 * SECOND, 11 * SECOND, 12 * SECOND, 12_999_999_999] {
            see(&mut tracker, now, [0.0, 0.0]);
        }
        assert_eq!(tracker.standing_ns(&ID), 2_999_999_999);
        see(&mut tracker, 13 * SECOND, [0.0, 0.0]);
        assert_eq!(tracker.standing_ns(&ID), 3 * SECOND);
    }

    #[test]
    fn the_threshold_itself_is_moving_and_both_axes_count() {
        for (velocity, is_tracked) in
            [([0.1, 0.0], false), ([0.06, 0.06], true), ([0.08, 0.08], false), ([0.0, -0.099], true)]
        {
            let mut tracker = StopTracker::default();
            see(&mut tracker, SECOND, velocity);
            assert_eq!(tracker.is_tracked(&ID), is_tracked, "{velocity:?}");
        }
        let mut tracker = StopTracker::default();
        see(&mut tracker, SECOND, [0.0, 0.0]);
        see(&mut tracker, 2 * SECOND, [0.5, 0.0]);
        assert_eq!(tracker.standing_ns(&ID), 0, "a moving object is forgotten");
    }

    #[test]
    fn a_gap_up_to_the_timeout_is_bridged() {
        let mut tracker = StopTracker::default();
        see(&mut tracker, 10 * SECOND, [0.0, 0.0]);
        see_nothing(&mut tracker, 11 * SECOND);
        assert_eq!(tracker.standing_ns(&ID), SECOND);
        see_nothing(&mut tracker, 11 * SECOND + 1);
        assert!(!tracker.is_tracked(&ID));
        see(&mut tracker, 12 * SECOND, [0.0, 0.0]);
        assert_eq!(tracker.standing_ns(&ID), 0, "starts anew");
        see(&mut tracker, 13 * SECOND + 1, [0.0, 0.0]);
        assert_eq!(tracker.standing_ns(&ID), 0, "unseen for longer than the timeout");
    }

    #[test]
    fn time_going_back_forgets_and_the_same_time_changes_nothing() {
        let mut tracker = StopTracker::default();
        see(&mut tracker, 10 * SECOND, [0.0, 0.0]);
        see(&mut tracker, 10 * SECOND + 5, [0.0, 0.0]);
        see(&mut tracker, 10 * SECOND + 5, [9.0, 0.0]);
        assert_eq!(tracker.standing_ns(&ID), 5);
        see(&mut tracker, 9 * SECOND, [0.0, 0.0]);
        assert_eq!(tracker.standing_ns(&ID), 0);
    }

    #[test]
    fn the_number_of_records_is_bounded() {
        let mut tracker = StopTracker::default();
        let crowd = (0..MAX_TRACKED as u64 + 10).map(|n| {
            let mut uuid = [0; 16];
            uuid[..8].copy_from_slice(&n.to_le_bytes());
            (Uuid { uuid }, [0.0, 0.0])
        });
        tracker.update(SECOND, (0.1, SECOND), crowd);
        assert_eq!(tracker.standing.len(), MAX_TRACKED);
    }
}
