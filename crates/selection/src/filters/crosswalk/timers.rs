//! For how long the vehicle has waited for whom: one list of people for each candidate key and crosswalk.
//!
//! A candidate is judged with a private copy of its lists; the real ones take the same steps after all candidates were
//! judged. Losing a list only makes the vehicle wait again, so every limit and every doubt empties lists.

use super::people::Person;
use crate::candidate::CandidateKey;
use crate::parameters::CrosswalkParameters;
use messages::geometry_msgs::Point;
use messages::unique_identifier_msgs::Uuid;
use std::collections::BTreeMap;

/// Most candidate keys that are remembered.
pub(super) const MAX_KEYS: usize = 4096;
/// Most people that one list keeps beside those who are there right now.
const MAX_LOST_PEOPLE: usize = 256;
/// Candidate keys are remembered for at least this long \[s\].
const MIN_RETENTION_S: f64 = 10.0;
/// A shorter rest of waiting time is none \[s\].
const NO_TIME_S: f64 = 1e-3;

/// The vehicle's waiting for one person.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Wait {
    pub(super) id: Uuid,
    label: u8,
    pub(super) position: Point,
    /// Stamp from which on the vehicle stands at the line and the person is there.
    first_ns: i64,
    /// Stamp at which the person was last seen.
    last_ns: i64,
    /// The vehicle has waited long enough and may go.
    over: bool,
}

impl Wait {
    fn duration_s(&self) -> f64 {
        seconds(self.last_ns - self.first_ns)
    }
}

/// Differences of stamps are whole nanoseconds before they become seconds.
fn seconds(nanoseconds: i64) -> f64 {
    nanoseconds as f64 / 1e9
}

/// What one step of the timers depends on, beside the people.
#[derive(Debug, Clone, Copy)]
pub(super) struct Clock {
    /// Stamp of the odometry.
    pub(super) now_ns: i64,
    pub(super) stop_duration_s: f64,
    pub(super) clear_time_s: f64,
    pub(super) same_place_m: f64,
}

impl Clock {
    pub(super) fn new(now_ns: i64, parameters: &CrosswalkParameters) -> Self {
        Self {
            now_ns,
            stop_duration_s: parameters.stop_duration,
            clear_time_s: parameters.object_clear_time_th,
            same_place_m: parameters.distance_hysteresis_th,
        }
    }

    /// Takes one list from cycle to cycle. `at_stop` says whether the vehicle stands at the line.
    pub(super) fn step(&self, waits: &mut Vec<Wait>, people: &[Person], at_stop: bool) {
        // Waits from the future are of a time line that ended, such as a replay that was started again. A small step
        // back is left alone: it only lengthens the waiting.
        waits.retain(|wait| seconds(wait.last_ns - self.now_ns) <= self.clear_time_s);
        for person in people {
            match self.recognise(waits, person) {
                Some(wait) => {
                    (wait.id, wait.position, wait.last_ns) = (person.id, person.position, self.now_ns);
                    if !wait.over {
                        if !at_stop {
                            wait.first_ns = self.now_ns;
                        }
                        wait.over = wait.duration_s() > self.stop_duration_s;
                    }
                }
                None => waits.push(Wait {
                    id: person.id,
                    label: person.label,
                    position: person.position,
                    first_ns: self.now_ns,
                    last_ns: self.now_ns,
                    over: false,
                }),
            }
        }
        waits.retain(|wait| seconds(self.now_ns - wait.last_ns) <= self.clear_time_s);
        if waits.len() > people.len() + MAX_LOST_PEOPLE {
            // Somebody new came, or the list would not have grown; whoever is new is waited for longest of all.
            waits.retain(|wait| wait.last_ns == self.now_ns);
        }
    }

    /// The same person: by id, else somebody of the same class at the same place.
    fn recognise<'a>(&self, waits: &'a mut [Wait], person: &Person) -> Option<&'a mut Wait> {
        let by_id = waits.iter().position(|wait| wait.id == person.id);
        let near = |wait: &Wait| {
            let (dx, dy) = (wait.position.x - person.position.x, wait.position.y - person.position.y);
            wait.label == person.label && (dx * dx + dy * dy).sqrt() < self.same_place_m
        };
        let index = by_id.or_else(|| waits.iter().position(near))?;
        waits.get_mut(index)
    }

    /// For whom the vehicle has waited the shortest, and how long it still has to wait \[s\]. `None` if it may go.
    pub(super) fn remaining<'a>(&self, waits: &'a [Wait]) -> Option<(&'a Wait, f64)> {
        let waiting = waits.iter().filter(|wait| !wait.over);
        let shortest = waiting.reduce(|best, next| {
            if next.last_ns - next.first_ns < best.last_ns - best.first_ns { next } else { best }
        })?;
        let remaining_s = self.stop_duration_s - shortest.duration_s().min(self.stop_duration_s);
        (remaining_s >= NO_TIME_S).then_some((shortest, remaining_s))
    }

    fn retention_s(&self) -> f64 {
        MIN_RETENTION_S.max(self.stop_duration_s + self.clear_time_s)
    }
}

/// The lists of one candidate key.
#[derive(Debug, Default)]
struct KeyTimers {
    seen_ns: i64,
    /// By id of the crosswalk. Few: those that the candidate met in the last cycle.
    lists: Vec<(i64, Vec<Wait>)>,
}

/// The lists of all candidate keys. A key without anybody to wait for is not kept.
#[derive(Debug, Default)]
pub(super) struct Timers {
    keys: BTreeMap<CandidateKey, KeyTimers>,
}

impl Timers {
    /// Copies one list, empty if there is none.
    pub(super) fn copy(&self, key: CandidateKey, crosswalk: i64, waits: &mut Vec<Wait>) {
        waits.clear();
        let lists = self.keys.get(&key).map_or(&[][..], |timers| &timers.lists);
        if let Some((_, list)) = lists.iter().find(|(id, _)| *id == crosswalk) {
            waits.extend_from_slice(list);
        }
    }

    /// Notes that a key is still in use though its candidate met no crosswalk.
    pub(super) fn touch(&mut self, key: CandidateKey, now_ns: i64) {
        if let Some(timers) = self.keys.get_mut(&key) {
            timers.seen_ns = now_ns;
        }
    }

    /// Takes the lists of one key a step on; those of crosswalks that the candidate did not meet are dropped.
    pub(super) fn fold<'a>(
        &mut self,
        key: CandidateKey,
        clock: &Clock,
        met: impl Iterator<Item = (i64, &'a [Person], bool)> + Clone,
    ) {
        let timers = self.keys.entry(key).or_default();
        timers.seen_ns = clock.now_ns;
        timers.lists.retain(|(id, _)| met.clone().any(|(crosswalk, _, _)| crosswalk == *id));
        for (crosswalk, people, at_stop) in met {
            let lists = &mut timers.lists;
            let index = lists.iter().position(|(id, _)| *id == crosswalk).unwrap_or_else(|| {
                lists.push((crosswalk, Vec::new()));
                lists.len() - 1
            });
            clock.step(&mut lists[index].1, people, at_stop);
        }
        timers.lists.retain(|(_, list)| !list.is_empty());
        if timers.lists.is_empty() {
            self.keys.remove(&key);
        }
    }

    /// Forgets keys that were not seen for long, and the longest unseen ones beyond [`MAX_KEYS`].
    pub(super) fn evict(&mut self, clock: &Clock) {
        let retention_s = clock.retention_s();
        self.keys.retain(|_, timers| seconds(clock.now_ns - timers.seen_ns).abs() <= retention_s);
        if self.keys.len() > MAX_KEYS {
            let mut by_age: Vec<_> = self.keys.iter().map(|(key, timers)| (timers.seen_ns, *key)).collect();
            by_age.sort_unstable();
            for (_, key) in &by_age[..by_age.len() - MAX_KEYS] {
                self.keys.remove(key);
            }
        }
    }

    /// Keeps only the lists of some crosswalks.
    pub(super) fn keep_crosswalks(&mut self, keep: impl Fn(i64) -> bool) {
        self.keys.retain(|_, timers| {
            timers.lists.retain(|(id, _)| keep(*id));
            !timers.lists.is_empty()
        });
    }

    /// Forgets everything.
    pub(super) fn clear(&mut self) {
        self.keys.clear();
    }

    /// Number of candidate keys with somebody to wait for.
    pub(super) fn len(&self) -> usize {
        self.keys.len()
    }
}
