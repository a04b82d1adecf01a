//! Plans on a thread of its own: the newest job wins, at most one result waits to be taken, nothing spins.
//!
//! Everything that both sides see lies on one desk under one lock, so a result is handed over together with what it
//! continues. The primitives come from the parent module: the exploration puts this file on others and tries its
//! interleavings.

use super::desk::Desk;
use super::sync::{Arc, AtomicBool, Builder, Condvar, JoinHandle, Mutex, MutexGuard, Ordering, PoisonError};
use open_space::provider::{
    Job, Outcome, PlanFailure, Planned, PlanningWorker, WorkerNotStarted, WorkerState,
};
use open_space::{Interruption, Watch, watched_by};
use selection::panics::caught;
use std::time::{Duration, Instant};

/// Plans one job; asks often whether planning was called off. Stays on the planning thread.
pub type PlanJob = Box<dyn FnMut(&Job, &Watch) -> Result<Outcome, PlanFailure> + Send>;

/// Makes a planner; called on the planning thread for the first job and for the one after a panic.
pub type MakePlanner = Arc<dyn Fn() -> PlanJob + Send + Sync>;

/// The planning thread and its desk.
pub struct PlanningThread {
    make_planner: MakePlanner,
    time_limit: Option<Duration>,
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

struct Shared {
    desk: Mutex<Desk>,
    /// Told when there is something to do: a job came, or planning was called off.
    changed: Condvar,
    /// Set once, under the lock of the desk.
    cancelled: AtomicBool,
}

impl Shared {
    fn new() -> Self {
        Self { desk: Mutex::new(Desk::default()), changed: Condvar::new(), cancelled: AtomicBool::new(false) }
    }

    /// The desk is whole after every statement, so a panic that poisoned the lock has not harmed it.
    fn desk(&self) -> MutexGuard<'_, Desk> {
        self.desk.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn is_cancelled(&self) -> bool {
        self.cancelled.load(Ordering::Acquire)
    }

    /// Waits for a job that may be planned now; `None` when planning was called off.
    fn next_job(&self) -> Option<Job> {
        let mut desk = self.desk();
        while !self.is_cancelled() {
            if let Some(job) = desk.next_job() {
                return Some(job);
            }
            desk = self.changed.wait(desk).unwrap_or_else(PoisonError::into_inner);
        }
        None
    }
}

impl PlanningThread {
    /// A planning thread that is not running yet.
    #[must_use]
    pub fn new(make_planner: MakePlanner) -> Self {
        Self { make_planner, time_limit: None, shared: Arc::new(Shared::new()), thread: None }
    }

    /// The same, with a limit to the time that a plan may take.
    #[must_use]
    pub fn with_time_limit(mut self, time_limit: Duration) -> Self {
        self.time_limit = Some(time_limit);
        self
    }
}

impl PlanningWorker for PlanningThread {
    fn start(&mut self) -> Result<(), WorkerNotStarted> {
        self.stop();
        let (make_planner, limit, shared) = (self.make_planner.clone(), self.time_limit, self.shared.clone());
        let work = move || work(&make_planner, limit, &shared);
        let thread = Builder::new().name("open-space".to_owned()).spawn(work);
        self.thread = Some(thread.map_err(|error| WorkerNotStarted { why: error.to_string() })?);
        Ok(())
    }

    fn submit(&mut self, job: Job) {
        let replaced = self.shared.desk().job.replace(job);
        self.shared.changed.notify_one();
        // Not while the planning thread waits for the desk.
        drop(replaced);
    }

    fn take_planned(&mut self) -> Option<Planned> {
        self.shared.desk().take_planned()
    }

    fn take_failure(&mut self) -> Option<PlanFailure> {
        self.shared.desk().failure.take()
    }

    fn state(&self) -> WorkerState {
        self.shared.desk().state()
    }

    fn request_stop(&mut self) {
        {
            // Under the lock, lest the thread goes to sleep between its look at the flag and the wake-up.
            let _desk = self.shared.desk();
            self.shared.cancelled.store(true, Ordering::Release);
        }
        self.shared.changed.notify_one();
    }

    fn stop(&mut self) {
        self.request_stop();
        if let Some(thread) = self.thread.take()
            && thread.join().is_err()
        {
            tracing::error!("the planning thread has ended by a panic outside of the planner");
        }
        self.shared = Arc::new(Shared::new());
    }
}

impl Drop for PlanningThread {
    fn drop(&mut self) {
        self.stop();
    }
}

impl std::fmt::Debug for PlanningThread {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("PlanningThread").field("running", &self.thread.is_some()).finish_non_exhaustive()
    }
}

/// The thread: plans job after job until planning is called off.
fn work(make_planner: &MakePlanner, time_limit: Option<Duration>, shared: &Arc<Shared>) {
    let mut planner = None;
    while let Some(job) = shared.next_job() {
        let started = Instant::now();
        let asked = shared.clone();
        let watch = within(started, time_limit, move || asked.is_cancelled());
        let outcome = plan(make_planner, &mut planner, &job, &watch);
        let latency_ms = started.elapsed().as_secs_f64() * 1e3;
        shared.desk().put(job, outcome, latency_ms);
    }
}

/// Interrupts what is called off, and what takes longer than it may.
pub(super) fn within(
    started: Instant,
    time_limit: Option<Duration>,
    is_cancelled: impl Fn() -> bool + Send + Sync + 'static,
) -> Watch {
    // An end too far for the clock is none.
    let end = time_limit.and_then(|limit| started.checked_add(limit));
    watched_by(move || {
        if is_cancelled() {
            return Some(Interruption::Cancelled);
        }
        end.filter(|end| Instant::now() >= *end).map(|_| Interruption::OutOfTime)
    })
}

/// Plans a job, making the planner if there is none. One that panics is thrown away, so nobody sees what it left half
/// done; the next job starts with a fresh one.
pub(super) fn plan(
    make_planner: &MakePlanner,
    planner: &mut Option<PlanJob>,
    job: &Job,
    watch: &Watch,
) -> Result<Outcome, PlanFailure> {
    let planning = || planner.get_or_insert_with(|| make_planner())(job, watch);
    caught(planning).unwrap_or_else(|message| {
        *planner = None;
        Err(PlanFailure::Panicked { message })
    })
}
