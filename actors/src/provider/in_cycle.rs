//! Plans while the cycle waits: for whoever would rather have each plan at once than have cycles on time.

use super::planning_thread::{MakePlanner, PlanJob, plan, within};
use open_space::provider::{Job, Outcome, PlanFailure, SynchronousPlanner};
use open_space::unwatched;
use std::time::{Duration, Instant};

/// Planning within the cycle.
pub(super) struct InCycle {
    make_planner: MakePlanner,
    planner: Option<PlanJob>,
    /// Longest time of a plan; `None` where the clock is stepped and planning takes no time on it.
    time_limit: Option<Duration>,
}

impl InCycle {
    pub(super) fn new(make_planner: MakePlanner, time_limit: Option<Duration>) -> Self {
        Self { make_planner, planner: None, time_limit }
    }
}

impl SynchronousPlanner for InCycle {
    fn plan(&mut self, job: &Job) -> (Result<Outcome, PlanFailure>, f64) {
        let Some(time_limit) = self.time_limit else {
            return (plan(&self.make_planner, &mut self.planner, job, &unwatched()), 0.0);
        };
        let started = Instant::now();
        let watch = within(started, Some(time_limit), || false);
        let outcome = plan(&self.make_planner, &mut self.planner, job, &watch);
        (outcome, started.elapsed().as_secs_f64() * 1e3)
    }
}

#[cfg(test)]
mod tests {
    use super::super::stand_ins::{job, point};
    use super::*;
    use open_space::Interruption;
    use open_space::stitcher::DiscretizedTrajectory;
    use std::sync::Arc;

    #[test]
    fn plans_fails_and_breaks_down_within_the_call() {
        let make: MakePlanner = Arc::new(|| {
            Box::new(|job, watch| match job.submitted_s as u32 {
                1 => Ok(Outcome::Planned(DiscretizedTrajectory { points: vec![point(0.0, 1.0)] })),
                2 => panic!("job 2"),
                _ => {
                    while watch() != Some(Interruption::OutOfTime) {
                        std::thread::yield_now();
                    }
                    Ok(Outcome::Skipped)
                }
            })
        });
        let limit = Duration::from_millis(5);
        let mut planner = InCycle::new(make.clone(), Some(limit));
        assert!(matches!(planner.plan(&job(1)).0, Ok(Outcome::Planned(_))));
        assert_eq!(planner.plan(&job(2)).0, Err(PlanFailure::Panicked { message: "job 2".to_owned() }));
        let (outcome, latency_ms) = planner.plan(&job(3));
        assert_eq!(outcome, Ok(Outcome::Skipped));
        assert!(latency_ms >= 5.0, "{latency_ms}");
        assert_eq!(InCycle::new(make, None).plan(&job(1)).1, 0.0, "no time on a clock that is stepped");
    }
}
