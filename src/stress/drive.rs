//! A recorded drive as a load: its messages at another pace, its candidates cut or multiplied.

use super::{Heap, Memory, Pace, Stressed};
use crate::commands::Failure;
use crate::drive::{Drive, Event};
use crate::recorder::Recorder;
use crate::report::summary::Input as InputSummary;
use crate::report::usage;
use crate::ros::encoder::Encoder;
use crate::session::{Rate, Session, page_of};
use crate::settings::Settings;
use messages::autoware_internal_planning_msgs::CandidateTrajectories;
use selector_actors::Input;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

/// A run of a drive.
#[derive(Debug, Clone, Copy)]
pub struct DriveStress<'a> {
    /// The recording; it holds its map.
    pub path: &'a Path,
    /// Candidates in each anchor; `None`: as recorded.
    pub candidates: Option<usize>,
    /// Anchors after which the run ends; `None`: the whole drive.
    pub cycles: Option<u64>,
    /// How fast anchors come.
    pub pace: Pace,
    /// Threads that judge.
    pub threads: usize,
    /// A cycle is missed if it ends later; at a rate it is cut then.
    pub deadline: Option<Duration>,
    /// Whether to gather the report page.
    pub page: bool,
}

impl DriveStress<'_> {
    /// Runs the drive.
    ///
    /// # Errors
    /// The drive cannot be started.
    pub fn run(&self, settings: &Settings) -> Result<Stressed, Failure> {
        let drive = Drive::open(self.path, &[], None, true)?;
        let warnings: Vec<Failure> =
            drive.warnings().iter().map(|odd| Failure::note("bag", odd.to_string())).collect();
        let recorder = Recorder::counting();
        {
            let mut recording = recorder.lock();
            recording.encoder = Some(Encoder::new(drive.interface()));
            recording.deadline = self.deadline;
            recording.page = self.page.then(|| page_of(settings)).transpose()?;
        }
        let mut settings = settings.clone();
        if let Some(deadline) = self.deadline {
            settings.selector.cycle_budget_ms = i64::try_from(deadline.as_millis()).unwrap_or(i64::MAX);
        }
        let session = Session {
            input: InputSummary { name: self.path.display().to_string(), seed: None },
            interface: drive.interface(),
            span: (drive.start(), drive.end()),
            threads: self.threads,
            rate: match self.pace {
                Pace::Max => Rate::Max,
                Pace::Hertz(rate_hz) => Rate::Times(rate_hz / drive.anchor_rate_hz().unwrap_or(rate_hz)),
            },
            output: None,
            map: None,
            watch: None,
            page: false,
            markers: false,
            progress: false,
        };
        let mut memory_mb = Memory { start: usage::resident_memory_mb(), ..Memory::default() };
        let mut ended = session.measure(&recorder, &settings, self.changed(drive))?;
        memory_mb.end = usage::resident_memory_mb();
        ended.warnings.extend(warnings);
        let mut recording = recorder.lock();
        ended.page = recording.page.take().or(ended.page);
        Ok(Stressed {
            ended,
            missed: recording.missed,
            memory_mb,
            heap_mb: Heap::default(),
            most_waiting: None,
        })
    }

    /// The events up to the last wanted anchor, with as many candidates as wanted.
    fn changed(&self, drive: Drive) -> impl Iterator<Item = Event> {
        let (candidates, mut left) = (self.candidates, self.cycles.unwrap_or(u64::MAX));
        drive.map_while(move |mut event| {
            if let Event::Input(timed) = &mut event
                && let Input::Generative(message) = &mut timed.input
            {
                left = left.checked_sub(1)?;
                if let Some(count) = candidates {
                    *message = Arc::new(with_candidates(message, count));
                }
            }
            Some(event)
        })
    }
}

/// The message with so many candidates: the first ones, or all of them and then copies under generators of their own.
fn with_candidates(message: &CandidateTrajectories, count: usize) -> CandidateTrajectories {
    let recorded = &message.candidate_trajectories;
    let mut changed = CandidateTrajectories::default();
    let copies = count.div_ceil(recorded.len().max(1)).max(1);
    for copy in 0..copies {
        let number = u32::try_from(copy).unwrap_or(u32::MAX).to_be_bytes();
        let mark = |id: &mut [u8; 16]| id.iter_mut().zip(number).for_each(|(byte, number)| *byte ^= number);
        let left = count - changed.candidate_trajectories.len().min(count);
        for candidate in recorded.iter().take(left) {
            let mut candidate = candidate.clone();
            if copy > 0 {
                mark(&mut Arc::make_mut(&mut candidate).generator_id.uuid);
            }
            changed.candidate_trajectories.push(candidate);
        }
        for info in &message.generator_info {
            let mut info = info.clone();
            mark(&mut info.generator_id.uuid);
            changed.generator_info.push(info);
        }
    }
    changed
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::load::{Load, LoadMessages, LoadScene};
    use std::collections::BTreeSet;

    #[test]
    fn candidates_are_cut_or_copied_under_generators_of_their_own() {
        let load = Load {
            scene: LoadScene::Road,
            candidates: 10,
            points: 3,
            objects: 0,
            paths: 0,
            generators: 4,
            seed: 1,
        };
        let Input::Generative(message) = load.messages().anchor(LoadMessages::start(), 10) else {
            panic!("an anchor is generative")
        };
        for count in [0, 3, 10, 25] {
            let changed = with_candidates(&message, count);
            assert_eq!(changed.candidate_trajectories.len(), count);
            let announced: Vec<_> =
                changed.generator_info.iter().map(|info| info.generator_id.uuid).collect();
            let distinct: BTreeSet<_> = announced.iter().collect();
            assert_eq!(distinct.len(), announced.len());
            let of = changed.candidate_trajectories.iter().map(|candidate| candidate.generator_id.uuid);
            assert!(of.clone().all(|id| announced.contains(&id)));
        }
    }
}
