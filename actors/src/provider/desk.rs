//! Where the provider and its planner leave things for each other.

use open_space::provider::{Job, Outcome, PlanFailure, Planned, WorkerState};

/// One job that waits, one result, one failure. Whole after every statement.
#[derive(Default)]
pub(super) struct Desk {
    pub(super) job: Option<Job>,
    planned: Option<Planned>,
    pub(super) failure: Option<PlanFailure>,
    skips: u64,
}

impl Desk {
    /// The job that may be planned now: none while a result waits.
    pub(super) fn next_job(&mut self) -> Option<Job> {
        if self.planned.is_some() { None } else { self.job.take() }
    }

    /// Leaves what came of a job, together with what the plan continues.
    pub(super) fn put(&mut self, job: Job, outcome: Result<Outcome, PlanFailure>, latency_ms: f64) {
        let Job { stitching, submitted_s, .. } = job;
        match outcome {
            Ok(Outcome::Planned(optimized)) => {
                self.planned = Some(Planned { optimized, stitching, submitted_s, latency_ms });
            }
            Ok(Outcome::Skipped) => self.skips += 1,
            Err(failure) => self.failure = Some(failure),
        }
    }

    pub(super) fn take_planned(&mut self) -> Option<Planned> {
        let planned = self.planned.take()?;
        // It was made while this result waited; the next cycle knows better where to start.
        self.job = None;
        Some(planned)
    }

    pub(super) fn state(&self) -> WorkerState {
        WorkerState {
            data_ready: self.job.is_some(),
            trajectory_updated: self.planned.is_some(),
            trajectory_skipped: self.skips > 0,
            trajectory_error: self.failure.is_some(),
            skips: self.skips,
        }
    }
}
