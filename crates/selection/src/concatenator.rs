//! Keeps the newest candidates of every generator and puts the fresh ones together.
//!
//! Owns the buffer of one node. What it promises: the `generator_info` list of a message drives insertion; a
//! generator's newer message replaces its older one; a trajectory older than `duration_time` is removed when the
//! buffer is read; generators come out newest-inserted first, trajectories of a generator in message order; the number
//! of generators is bounded. Source of the rules: Autoware's `autoware_trajectory_concatenator`.

use crate::candidate::{Candidate, Points};
use messages::autoware_internal_planning_msgs::{CandidateTrajectories, CandidateTrajectory, GeneratorInfo};
use messages::builtin_interfaces::Time;
use messages::unique_identifier_msgs::Uuid;
use std::collections::HashMap;
use std::sync::Arc;

/// Most generators kept at once. Upstream has no limit, and candidates stamped in the future never expire there; a
/// planner with a fresh id in each message would fill the memory.
pub const MAX_GENERATORS: usize = 1024;

/// The newest candidates of every generator.
#[derive(Debug)]
pub struct Concatenator {
    duration_time_s: f64,
    /// Newest-inserted generator first.
    entries: Vec<Entry>,
    /// What was odd about the messages since the last reading.
    oddities: Oddities,
}

#[derive(Debug)]
struct Entry {
    info: GeneratorInfo,
    name: Arc<str>,
    trajectories: Vec<Buffered>,
}

/// A trajectory as it waits; its points for calculation are made once, however often it is given out.
#[derive(Debug, Clone)]
struct Buffered {
    message: Arc<CandidateTrajectory>,
    points: Arc<Points>,
}

/// What was odd about the messages that came in.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Oddities {
    /// Trajectories dropped because their message does not announce their generator.
    pub unannounced: usize,
    /// Generators announced more than once in a message; the last announcement counts.
    pub announced_twice: usize,
    /// Generators that had to go because there are more than [`MAX_GENERATORS`].
    pub evicted: usize,
}

/// A trajectory that was too old when the buffer was read.
#[derive(Debug, Clone, PartialEq)]
pub struct Stale {
    /// Name of its generator.
    pub generator_name: Arc<str>,
    /// Its stamp.
    pub stamp: Time,
    /// How old it was, s.
    pub age_s: f64,
}

/// The fresh candidates at one time.
#[derive(Debug, Clone, Default)]
pub struct Concatenated {
    /// Candidates, newest-inserted generator first.
    pub candidates: Vec<Candidate>,
    /// Generators of the candidates, each once, in the same order.
    pub generators: Vec<GeneratorInfo>,
    /// What was removed as too old at this reading.
    pub stale: Vec<Stale>,
    /// What was odd about the messages since the reading before.
    pub oddities: Oddities,
}

impl Concatenated {
    /// The candidates as a message. Shares the trajectories.
    #[must_use]
    pub fn to_message(&self) -> CandidateTrajectories {
        CandidateTrajectories {
            candidate_trajectories: self
                .candidates
                .iter()
                .map(|candidate| candidate.message.clone())
                .collect(),
            generator_info: self.generators.clone(),
        }
    }
}

impl Concatenator {
    /// An empty buffer that keeps trajectories for `duration_time_s`.
    #[must_use]
    pub fn new(duration_time_s: f64) -> Self {
        Self { duration_time_s, entries: Vec::new(), oddities: Oddities::default() }
    }

    /// Changes how long trajectories are kept; takes effect at the next reading.
    pub fn set_duration_time_s(&mut self, duration_time_s: f64) {
        self.duration_time_s = duration_time_s;
    }

    /// Number of generators in the buffer.
    #[must_use]
    pub fn generators(&self) -> usize {
        self.entries.len()
    }

    /// Puts the trajectories of every generator that the message announces in place of that generator's older ones.
    /// An announcement without trajectories clears the generator. A message without announcements does nothing.
    pub fn add(&mut self, message: &CandidateTrajectories) {
        // One pass over each list, so that a message of many generators costs no more than its length.
        let mut groups: HashMap<Uuid, Vec<Buffered>> = HashMap::new();
        for candidate in &message.candidate_trajectories {
            let points = Arc::new(Points::of(candidate.clone()));
            let buffered = Buffered { message: candidate.clone(), points };
            groups.entry(candidate.generator_id).or_default().push(buffered);
        }
        // Upstream empties a generator that is announced twice; here the last announcement wins and keeps them.
        let infos = message.generator_info.iter().enumerate();
        let last: HashMap<Uuid, usize> = infos.map(|(index, info)| (info.generator_id, index)).collect();
        self.oddities.announced_twice += message.generator_info.len() - last.len();
        for (index, info) in message.generator_info.iter().enumerate() {
            if last.get(&info.generator_id) != Some(&index) {
                continue;
            }
            self.replace(Entry {
                name: Arc::from(info.generator_name.data.as_str()),
                info: info.clone(),
                trajectories: groups.remove(&info.generator_id).unwrap_or_default(),
            });
            self.oddities.evicted += self.entries.len().saturating_sub(MAX_GENERATORS);
            self.entries.truncate(MAX_GENERATORS);
        }
        self.oddities.unannounced += groups.values().map(Vec::len).sum::<usize>();
    }

    /// A known generator keeps its place, a new one goes to the front.
    fn replace(&mut self, entry: Entry) {
        let id = entry.info.generator_id;
        match self.entries.iter_mut().find(|known| known.info.generator_id == id) {
            Some(known) => *known = entry,
            None => self.entries.insert(0, entry),
        }
    }

    /// Removes what is too old at `now` and gives out the rest. Reading does not consume: what stays is given out
    /// again next time.
    ///
    /// Age is the difference of two f64 seconds since the epoch, as upstream computes it; a trajectory whose age equals
    /// `duration_time` stays, one from the future never expires.
    pub fn get(&mut self, now: Time) -> Concatenated {
        let oddities = std::mem::take(&mut self.oddities);
        let mut result = Concatenated { oddities, ..Concatenated::default() };
        for entry in &mut self.entries {
            let name = &entry.name;
            entry.trajectories.retain(|buffered| {
                let stamp = buffered.message.header.stamp;
                let age_s = now.seconds() - stamp.seconds();
                let is_stale = age_s > self.duration_time_s;
                if is_stale {
                    result.stale.push(Stale { generator_name: name.clone(), stamp, age_s });
                }
                !is_stale
            });
        }
        self.entries.retain(|entry| !entry.trajectories.is_empty());
        for entry in &self.entries {
            result.generators.push(entry.info.clone());
            // A message cannot hold 2^32 trajectories: its count is a u32.
            for (sample, buffered) in (0_u32..).zip(&entry.trajectories) {
                result.candidates.push(Candidate {
                    key: crate::CandidateKey { generator: entry.info.generator_id, sample },
                    generator_name: entry.name.clone(),
                    message: buffered.message.clone(),
                    points: buffered.points.clone(),
                });
            }
        }
        result
    }
}

#[cfg(test)]
mod tests;
