//! Planning within the cycle.

use super::*;

/// Answers with what the test left for it.
struct Fixed(Result<Outcome, PlanFailure>);

impl SynchronousPlanner for Fixed {
    fn plan(&mut self, _: &Job) -> (Result<Outcome, PlanFailure>, f64) {
        (self.0.clone(), 40.0)
    }
}

fn provider_that_gets(outcome: Result<Outcome, PlanFailure>) -> Provider {
    let execution = Execution::Synchronous(Box::new(Fixed(outcome)));
    Provider::new(ProviderParameters::default(), execution).unwrap()
}

#[test]
fn a_plan_is_loaded_in_the_cycle_that_asked_for_it() {
    let provision =
        provider_that_gets(Ok(Outcome::Planned(straight(5)))).process(&frame(7.0, &region(), None));
    assert_eq!((&provision.status, provision.source), (&Status::Done, Source::Planned));
    assert_eq!((provision.trajectory.points.len(), provision.latency_ms), (51, Some(40.0)));
    // No time has passed on the clock of the cycles: the plan begins where it was asked to begin.
    assert_eq!(provision.trajectory.points[0].relative_time_s, 0.1);
}

#[test]
fn a_skip_is_fine_and_empty() {
    let provision = provider_that_gets(Ok(Outcome::Skipped)).process(&frame(7.0, &region(), None));
    assert_eq!(
        provision.status.message(),
        "Planning init point is close to destination, skip new trajectory generation"
    );
    assert_eq!((provision.status.code(), provision.source), (Code::Ok, Source::Nothing));
    assert!(provision.trajectory.points.is_empty() && !provision.success());
}

#[test]
fn a_failure_is_the_cycles_failure_and_empty() {
    let provision = provider_that_gets(Err(search_failure())).process(&frame(7.0, &region(), None));
    assert_eq!(provision.status.message(), "State warm start problem failed to solve");
    assert_eq!((provision.status.code(), provision.source), (Code::PlanningError, Source::Nothing));
    assert_eq!((provision.failure, provision.latency_ms), (Some(search_failure()), Some(40.0)));
}

/// Arriving holds the vehicle but does not end planning.
#[test]
fn near_destination_does_not_latch() {
    let mut provider = provider_that_gets(Ok(Outcome::Planned(straight(5))));
    let region = region();
    let there = Frame { vehicle: vehicle_at(20.0, 0.0, 0.0), ..frame(0.0, &region, None) };
    assert_stop(&provider.process(&there), &Status::NearDestination);
    assert!(!provider.state().generation_stopped);
    assert_eq!(provider.process(&frame(0.1, &region, None)).source, Source::Planned);
}

#[test]
fn stopping_ends_nothing() {
    let mut provider = provider_that_gets(Ok(Outcome::Planned(straight(5))));
    provider.stop();
    assert_eq!(provider.process(&frame(0.0, &region(), None)).source, Source::Planned);
}
