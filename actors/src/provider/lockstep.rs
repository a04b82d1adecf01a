//! Plans without a thread and without the machine's clock: a job is planned when the next one comes, so its plan is
//! there one cycle later, on every machine and in every run.

use super::desk::Desk;
use super::planning_thread::{MakePlanner, PlanJob, plan};
use open_space::provider::{Job, PlanFailure, Planned, PlanningWorker, WorkerNotStarted, WorkerState};
use open_space::unwatched;

/// Planning in step with the cycles.
pub struct Lockstep {
    make_planner: MakePlanner,
    planner: Option<PlanJob>,
    desk: Desk,
    over: bool,
}

impl Lockstep {
    /// One that has not planned anything.
    #[must_use]
    pub fn new(make_planner: MakePlanner) -> Self {
        Self { make_planner, planner: None, desk: Desk::default(), over: false }
    }
}

impl PlanningWorker for Lockstep {
    fn start(&mut self) -> Result<(), WorkerNotStarted> {
        self.stop();
        self.over = false;
        Ok(())
    }

    fn submit(&mut self, job: Job) {
        if !self.over
            && let Some(before) = self.desk.next_job()
        {
            let outcome = plan(&self.make_planner, &mut self.planner, &before, &unwatched());
            // It took no time on the clock of the cycles.
            self.desk.put(before, outcome, 0.0);
        }
        self.desk.job = Some(job);
    }

    fn take_planned(&mut self) -> Option<Planned> {
        self.desk.take_planned()
    }

    fn take_failure(&mut self) -> Option<PlanFailure> {
        self.desk.failure.take()
    }

    fn state(&self) -> WorkerState {
        self.desk.state()
    }

    fn request_stop(&mut self) {
        self.over = true;
    }

    fn stop(&mut self) {
        self.over = true;
        (self.desk, self.planner) = (Desk::default(), None);
    }
}

impl std::fmt::Debug for Lockstep {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Lockstep").field("over", &self.over).finish_non_exhaustive()
    }
}
