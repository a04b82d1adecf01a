//! The protocol of provider and planning thread under every order of steps that a scheduler comes upon: the planning
//! thread's source on primitives whose scheduler is random or adversarial.
//!
//! A job is known by the time it was submitted at; its plan must come with that time.

#[path = "planning_thread.rs"]
#[allow(
    clippy::duplicate_mod,
    unreachable_pub,
    dead_code,
    reason = "the same source on other primitives, only for its exploration"
)]
mod planning_thread;

/// The explored primitives.
mod sync {
    pub(super) use shuttle::sync::atomic::{AtomicBool, Ordering};
    pub(super) use shuttle::sync::{Arc, Condvar, Mutex, MutexGuard};
    pub(super) use shuttle::thread::{Builder, JoinHandle};
    pub(super) use std::sync::PoisonError;
}

use super::desk;
use super::stand_ins::{job, planned_for, point, region, vehicle};
use open_space::provider::{
    Execution, Frame, Job, Outcome, PlanFailure, Planned, PlanningWorker, PreviousFrame, Provider,
    ProviderParameters, Source, Status, WorkerState,
};
use open_space::stitcher::{DiscretizedTrajectory, PublishedTrajectory};
use open_space::{Interruption, Watch};
use planning_thread::{MakePlanner, PlanningThread};
use shuttle::thread::yield_now;

/// Schedules of each kind that a scenario is run under.
fn schedules() -> usize {
    std::env::var("SELECTOR_SCHEDULES").ok().and_then(|number| number.parse().ok()).unwrap_or(1000)
}

/// Plans echo their job; every third job is skipped, every fourth fails, and in between others may run.
fn echo(number: f64) -> Result<Outcome, PlanFailure> {
    if number % 4.0 == 0.0 {
        return Err(PlanFailure::Search { why: number.to_string() });
    }
    if number % 3.0 == 0.0 {
        return Ok(Outcome::Skipped);
    }
    Ok(Outcome::Planned(DiscretizedTrajectory { points: vec![point(0.0, number), point(1.0, number)] }))
}

fn planner() -> MakePlanner {
    sync::Arc::new(|| {
        Box::new(|job: &Job, watch: &Watch| {
            yield_now();
            if watch() == Some(Interruption::Cancelled) {
                Err(PlanFailure::Cancelled)
            } else {
                echo(job.submitted_s)
            }
        })
    })
}

fn started() -> PlanningThread {
    let mut worker = PlanningThread::new(planner());
    worker.start().unwrap();
    worker
}

/// Waits for a result; without one the exploration ends in a deadlock or out of steps.
fn await_planned(worker: &mut PlanningThread) -> Planned {
    loop {
        if let Some(planned) = worker.take_planned() {
            return planned;
        }
        yield_now();
    }
}

fn assert_whole(planned: &Planned) {
    assert_eq!(planned_for(&planned.optimized), planned.submitted_s, "another job's plan");
    assert_eq!(planned_for(&planned.stitching), planned.submitted_s, "another job's stitching");
}

/// Random schedules, and schedules that starve a thread at a few chosen steps.
fn explore(scenario: impl Fn() + Send + Sync + Clone + 'static) {
    shuttle::check_random(scenario.clone(), schedules());
    shuttle::check_pct(scenario, schedules(), 3);
}

/// A job that is submitted while nothing waits always leads to a result: no wake-up is lost.
#[test]
fn no_result_is_lost() {
    explore(|| {
        let mut worker = started();
        for number in [1, 2, 5, 7] {
            worker.submit(job(number));
            let planned = await_planned(&mut worker);
            assert_whole(&planned);
            assert_eq!(planned.submitted_s, f64::from(number));
        }
    });
}

/// Of jobs that come faster than they are planned the newest is planned; no result is handed over twice, none is older
/// than one before it, and none was asked for before its predecessor was taken.
#[test]
fn the_newest_job_wins_and_nothing_is_handed_over_twice() {
    explore(|| {
        let mut worker = started();
        let (mut taken_after, mut last) = (0.0, 0.0);
        for number in 1..=8 {
            worker.submit(job(number));
            if let Some(planned) = worker.take_planned() {
                assert_whole(&planned);
                assert!(planned.submitted_s > last, "{} after {last}", planned.submitted_s);
                assert!(planned.submitted_s > taken_after, "a job that should have been discarded");
                (last, taken_after) = (planned.submitted_s, f64::from(number));
            }
            if let Some(PlanFailure::Search { why }) = worker.take_failure() {
                assert_eq!(why.parse::<f64>().unwrap() % 4.0, 0.0);
            }
        }
        // What is submitted last is planned in the end, whatever waits before it.
        let mut patience = 0;
        loop {
            if worker.take_planned().is_some_and(|planned| planned.submitted_s == 11.0) {
                break;
            }
            patience += 1;
            // A result that was taken discards the job behind it: submit it again, as every cycle does.
            worker.submit(job(11));
            assert!(patience < 100_000);
            yield_now();
        }
    });
}

/// Failures and skips do not block what comes after them.
#[test]
fn failures_and_skips_pass() {
    explore(|| {
        let mut worker = started();
        worker.submit(job(4));
        let failure = loop {
            if let Some(failure) = worker.take_failure() {
                break failure;
            }
            yield_now();
        };
        assert_eq!(failure, PlanFailure::Search { why: "4".to_owned() });
        assert_eq!(worker.take_failure(), None, "handed over twice");
        worker.submit(job(3));
        while worker.state().skips == 0 {
            yield_now();
        }
        worker.submit(job(5));
        assert_eq!(await_planned(&mut worker).submitted_s, 5.0);
    });
}

/// Planning is called off at any moment: it ends, leaves nothing behind, and starts again.
#[test]
fn stop_during_planning() {
    explore(|| {
        let mut worker = started();
        worker.submit(job(1));
        worker.submit(job(2));
        worker.stop();
        assert!(worker.take_planned().is_none() && worker.take_failure().is_none());
        assert_eq!(worker.state(), WorkerState::default());
        worker.start().unwrap();
        worker.submit(job(5));
        let planned = await_planned(&mut worker);
        assert_whole(&planned);
        assert_eq!(planned.submitted_s, 5.0, "a plan of the time before");
        worker.submit(job(7));
        worker.request_stop();
        drop(worker);
    });
}

/// The provider's cycles beside its planning thread: what it loads is newer each time and timed from now, what it uses
/// again it has loaded before; when planning is called off it holds the vehicle; restarted, it plans for the new goal.
#[test]
fn the_provider_beside_its_planning_thread() {
    explore(|| {
        let worker = Execution::Threaded(Box::new(PlanningThread::new(planner())));
        let parameters = ProviderParameters { enable_trajectory_stitcher: false, ..Default::default() };
        let mut cycles = Cycles { provider: Provider::new(parameters, worker).unwrap(), previous: None };
        let mut last = 0.0;
        for number in 1..=7 {
            last = cycles.run(f64::from(number), last).unwrap_or(last);
            yield_now();
        }
        cycles.provider.stop();
        assert_eq!(cycles.status(8.0), Status::ParkingFinished);
        cycles.provider.restart();
        cycles.previous = None;
        // Neither a multiple of three nor of four: planned, however long that takes.
        let fresh = (0..).find_map(|cycle| {
            yield_now();
            cycles.run(f64::from(12 * cycle + 13), 8.0)
        });
        assert!(fresh.is_some());
    });
}

/// The provider and what it published last.
struct Cycles {
    provider: Provider,
    previous: Option<PreviousFrame>,
}

impl Cycles {
    fn status(&mut self, now_s: f64) -> Status {
        self.process(now_s).status
    }

    fn process(&mut self, now_s: f64) -> open_space::provider::Provision {
        let region = std::sync::Arc::new(region());
        let (vehicle, previous) = (vehicle(), self.previous.as_ref());
        self.provider.process(&Frame { now_s, vehicle, region: &region, in_check_stage: false, previous })
    }

    /// One cycle; the time of the job whose plan came in.
    fn run(&mut self, now_s: f64, last: f64) -> Option<f64> {
        let provision = self.process(now_s);
        let success = provision.success();
        let loaded = (provision.source == Source::Planned).then(|| {
            let submitted_s = planned_for(&provision.trajectory);
            assert!(submitted_s > last && submitted_s <= now_s, "{submitted_s} after {last} at {now_s}");
            let end_s = provision.trajectory.points[1].relative_time_s;
            assert!((end_s - (0.1 + 1.0 - (now_s - submitted_s))).abs() < 1e-9, "{end_s}");
            submitted_s
        });
        match provision.source {
            Source::Reused => assert_eq!(planned_for(&provision.trajectory), last),
            Source::Stop => assert!(self.previous.as_ref().is_none_or(|previous| !previous.provider_success)),
            Source::Planned => {}
            Source::Nothing => panic!("nothing to drive: {:?}", provision.status),
        }
        let header_time_s = provision.header_time_s;
        let stitched = PublishedTrajectory { trajectory: provision.trajectory, header_time_s };
        self.previous = Some(PreviousFrame { stitched, fallback: false, provider_success: success });
        loaded
    }
}
