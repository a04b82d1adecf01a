//! The planning thread as it runs: panics, calling off, and what the provider makes of them.

use super::planning_thread::{MakePlanner, PlanningThread};
use super::stand_ins::{job, planned_for, point, region, vehicle};
use crossbeam_channel::{Receiver, Sender, unbounded};
use open_space::Interruption;
use open_space::provider::{
    Execution, Frame, Outcome, PlanFailure, PlanningWorker, Provider, ProviderParameters, Source, Status,
    WorkerState,
};
use open_space::stitcher::DiscretizedTrajectory;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

const PATIENCE: Duration = Duration::from_secs(20);

/// What the planner does next, from the test; what it began, to the test.
struct Remote {
    answers: Sender<Answer>,
    begun: Receiver<f64>,
    made: Arc<AtomicUsize>,
}

enum Answer {
    Plan,
    Panic,
    UntilInterrupted,
}

/// A planner whose every job waits for its answer.
fn remote() -> (MakePlanner, Remote) {
    let (answers, next) = unbounded();
    let (begin, begun) = unbounded();
    let made = Arc::new(AtomicUsize::new(0));
    let count = made.clone();
    let make: MakePlanner = Arc::new(move || {
        count.fetch_add(1, Ordering::Relaxed);
        let (next, begin) = (next.clone(), begin.clone());
        Box::new(move |job, watch| {
            begin.send(job.submitted_s).unwrap();
            match next.recv_timeout(PATIENCE).unwrap() {
                Answer::Plan => {}
                Answer::Panic => panic!("job {}", job.submitted_s),
                Answer::UntilInterrupted => {
                    let cause = loop {
                        match watch() {
                            None => std::thread::yield_now(),
                            Some(cause) => break cause,
                        }
                    };
                    return Err(match cause {
                        Interruption::Cancelled => PlanFailure::Cancelled,
                        Interruption::OutOfTime => PlanFailure::Search { why: "late".to_owned() },
                    });
                }
            }
            let points = vec![point(0.0, job.submitted_s), point(1.0, job.submitted_s)];
            Ok(Outcome::Planned(DiscretizedTrajectory { points }))
        })
    });
    (make, Remote { answers, begun, made })
}

impl Remote {
    fn answer(&self, answer: Answer) {
        self.answers.send(answer).unwrap();
    }

    fn begun(&self) -> f64 {
        self.begun.recv_timeout(PATIENCE).unwrap()
    }
}

fn eventually<T>(what: &str, mut look: impl FnMut() -> Option<T>) -> T {
    let begin = Instant::now();
    loop {
        if let Some(found) = look() {
            return found;
        }
        assert!(begin.elapsed() < PATIENCE, "{what} never came");
        std::thread::yield_now();
    }
}

#[test]
fn a_panic_is_a_failure_and_the_next_job_has_a_fresh_planner() {
    let (make, remote) = remote();
    let mut worker = PlanningThread::new(make);
    worker.start().unwrap();
    worker.submit(job(1));
    remote.answer(Answer::Panic);
    let failure = eventually("the failure", || worker.take_failure());
    assert_eq!(failure, PlanFailure::Panicked { message: "job 1".to_owned() });
    worker.submit(job(2));
    remote.answer(Answer::Plan);
    let planned = eventually("the plan", || worker.take_planned());
    assert_eq!(planned_for(&planned.optimized), 2.0);
    assert!(planned.latency_ms >= 0.0);
    assert_eq!(remote.made.load(Ordering::Relaxed), 2);
}

#[test]
fn a_planner_that_cannot_be_made_is_a_failure_of_each_job() {
    let mut worker = PlanningThread::new(Arc::new(|| panic!("no memory")));
    worker.start().unwrap();
    for number in 1..=2 {
        worker.submit(job(number));
        let failure = eventually("the failure", || worker.take_failure());
        assert_eq!(failure, PlanFailure::Panicked { message: "no memory".to_owned() });
    }
}

#[test]
fn of_the_jobs_that_wait_only_the_newest_is_planned() {
    let (make, remote) = remote();
    let mut worker = PlanningThread::new(make);
    worker.start().unwrap();
    worker.submit(job(1));
    assert_eq!(remote.begun(), 1.0);
    worker.submit(job(2));
    worker.submit(job(3));
    remote.answer(Answer::Panic);
    assert_eq!(remote.begun(), 3.0);
    remote.answer(Answer::Plan);
    eventually("the plan", || worker.take_planned());
}

#[test]
fn planning_that_is_called_off_ends_and_starts_again_with_nothing_left() {
    let (make, remote) = remote();
    let mut worker = PlanningThread::new(make);
    worker.start().unwrap();
    worker.submit(job(1));
    assert_eq!(remote.begun(), 1.0);
    worker.submit(job(2));
    remote.answer(Answer::UntilInterrupted);
    worker.stop();
    assert_eq!(worker.state(), WorkerState::default());
    worker.start().unwrap();
    worker.submit(job(3));
    assert_eq!(remote.begun(), 3.0);
    remote.answer(Answer::Plan);
    let planned = eventually("the plan", || worker.take_planned());
    assert_eq!(planned.submitted_s, 3.0);
}

#[test]
fn what_takes_too_long_is_interrupted_and_the_next_job_has_its_own_time() {
    let (make, remote) = remote();
    let mut worker = PlanningThread::new(make).with_time_limit(Duration::from_millis(20));
    worker.start().unwrap();
    for number in 1..=2 {
        worker.submit(job(number));
        remote.answer(Answer::UntilInterrupted);
        let failure = eventually("the failure", || worker.take_failure());
        assert_eq!(failure, PlanFailure::Search { why: "late".to_owned() });
    }
}

#[test]
fn after_a_panic_the_provider_holds_the_vehicle_and_says_why() {
    let (make, remote) = remote();
    let execution = Execution::Threaded(Box::new(PlanningThread::new(make)));
    let mut provider = Provider::new(ProviderParameters::default(), execution).unwrap();
    let region = Arc::new(region());
    let mut frame =
        Frame { now_s: 1.0, vehicle: vehicle(), region: &region, in_check_stage: false, previous: None };
    assert_eq!(provider.process(&frame).status, Status::StopUnfinished);
    remote.answer(Answer::Panic);
    let provision = eventually("the failure", || {
        frame.now_s += 0.1;
        let provision = provider.process(&frame);
        provision.failure.is_some().then_some(provision)
    });
    assert_eq!(provision.source, Source::Stop);
    assert_eq!(provision.trajectory.points.len(), 10);
    assert!(matches!(provision.failure, Some(PlanFailure::Panicked { .. })), "{provision:?}");
    // The cycle that reported it has submitted the next job.
    remote.answer(Answer::Plan);
    remote.answer(Answer::Plan);
    let provision = eventually("the plan", || {
        frame.now_s += 0.1;
        let provision = provider.process(&frame);
        remote.answer(Answer::Plan);
        provision.success().then_some(provision)
    });
    assert_eq!(provision.source, Source::Planned);
}
