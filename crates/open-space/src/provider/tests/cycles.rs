//! What else a cycle may be: the worker's start, reuse, skips, a stop before an obstacle, unusable inputs; and what
//! holds over any sequence of cycles.

use proptest::prelude::*;

use super::*;

#[test]
fn the_worker_is_started_once_on_first_entry() {
    let (mut provider, worker) = provider(ProviderParameters::default());
    assert_eq!(worker.desk().starts, 0);
    assert!(!provider.state().thread_started);
    for tenth in 0..5 {
        provider.process(&frame(f64::from(tenth) * 0.1, &region(), None));
    }
    assert_eq!((worker.desk().starts, worker.desk().jobs.len()), (1, 5));
    assert!(provider.state().thread_started);
}

#[test]
fn the_last_result_is_reused_while_the_next_is_planned() {
    let (mut provider, worker) = provider(ProviderParameters::default());
    let region = region();
    provider.process(&frame(0.0, &region, None));
    worker.finish(5);
    let loaded = provider.process(&frame(0.1, &region, None));
    assert_eq!((&loaded.status, loaded.source), (&Status::Done, Source::Planned));
    let mut previous = left_by(&loaded);
    for now_s in [0.2, 0.3, 0.4] {
        let reused = provider.process(&frame(now_s, &region, Some(&previous)));
        assert_eq!((&reused.status, reused.source), (&Status::Waiting, Source::Reused));
        assert_eq!(
            reused.status.message(),
            "Waiting for open_space_trajectory_optimizer in open_space_trajectory_provider"
        );
        // Times are not shifted here: they still count from the header they counted from.
        assert_eq!((&reused.trajectory, reused.header_time_s), (&loaded.trajectory, loaded.header_time_s));
        assert!(reused.success());
        previous = left_by(&reused);
    }
}

/// A skip leaves the previous result in use.
#[test]
fn a_skip_changes_nothing_but_its_flag() {
    let (mut provider, worker) = provider(ProviderParameters::default());
    let region = region();
    provider.process(&frame(0.0, &region, None));
    worker.finish(5);
    let loaded = provider.process(&frame(0.1, &region, None));
    worker.desk_mut().skips += 1;
    let after = provider.process(&frame(0.2, &region, Some(&left_by(&loaded))));
    assert_eq!((&after.status, &after.trajectory), (&Status::Waiting, &loaded.trajectory));
    let state = provider.state();
    assert!(state.worker.trajectory_skipped && state.failures == 0);
}

/// A failure leaves the previous result in use, too.
#[test]
fn a_failure_is_reported_while_the_last_result_is_reused() {
    let (mut provider, worker) = provider(ProviderParameters::default());
    let region = region();
    provider.process(&frame(0.0, &region, None));
    worker.finish(5);
    let loaded = provider.process(&frame(0.1, &region, None));
    worker.fail();
    assert!(provider.state().worker.trajectory_error);
    let after = provider.process(&frame(0.2, &region, Some(&left_by(&loaded))));
    assert_eq!((after.status, after.failure), (Status::Waiting, Some(search_failure())));
    assert!(!provider.state().worker.trajectory_error, "taken");
}

/// A result outranks a failure that came with it; the failure is told in the next cycle.
#[test]
fn a_result_comes_before_a_failure() {
    let (mut provider, worker) = provider(ProviderParameters::default());
    let region = region();
    provider.process(&frame(0.0, &region, None));
    worker.finish(5);
    worker.fail();
    assert_eq!(provider.process(&frame(0.1, &region, None)).source, Source::Planned);
    assert_eq!(provider.process(&frame(0.2, &region, None)).failure, Some(search_failure()));
}

/// Slower than 0.1 m/s and accelerating less than 0.1 m/s², both strict, after a cycle on fallback.
#[test]
fn a_vehicle_stopped_before_an_obstacle_starts_anew() {
    let region = region();
    for (fallback, speed, acceleration, anew) in [
        (true, 0.0, 0.0, true),
        (true, 0.099_999, -0.099_999, true),
        (true, -0.099_999, 0.099_999, true),
        (true, 0.1, 0.0, false),
        (true, -0.1, 0.0, false),
        (true, 0.0, 0.1, false),
        (true, 0.0, -0.1, false),
        (false, 0.0, 0.0, false),
    ] {
        let (mut provider, worker) = provider(ProviderParameters::default());
        let previous = PreviousFrame {
            stitched: PublishedTrajectory { trajectory: straight(10), header_time_s: 0.0 },
            fallback,
            provider_success: true,
        };
        let vehicle =
            VehicleState { speed_mps: speed, acceleration_mps2: acceleration, ..vehicle_at(0.5, 0.0, 0.0) };
        let provision = provider.process(&Frame { vehicle, ..frame(0.5, &region, Some(&previous)) });
        assert_eq!(provision.restarted, anew, "fallback {fallback}, v {speed}, a {acceleration}");
        let desk = worker.desk();
        let start = desk.jobs[0].stitching.points.last().unwrap();
        if anew {
            assert_eq!(desk.jobs[0].stitching.points.len(), 1);
            assert_eq!((start.relative_time_s, start.path_point.unwrap().pose), (0.1, vehicle.pose));
        } else {
            assert!(
                (start.relative_time_s - 4.0).abs() < 1e-9,
                "four seconds ahead on the previous trajectory"
            );
        }
    }
}

/// O9: where a stitch fails the vehicle is predicted by one cycle; the switch brings the planning period back.
#[test]
fn o9_reinit_cycle_and_its_switch() {
    let region = region();
    for (switch, horizon_s) in [(false, 0.1), (true, 4.0)] {
        let parameters =
            ProviderParameters { reinit_uses_stitching_period: switch, ..ProviderParameters::default() };
        let (mut provider, worker) = provider(parameters);
        let vehicle = VehicleState { speed_mps: 1.0, ..vehicle_at(0.0, 0.0, 0.0) };
        let provision = provider.process(&Frame { vehicle, ..frame(0.0, &region, None) });
        assert_eq!(provision.replan, Some(ReplanReason::NoPrevious));
        let start = worker.desk().jobs[0].stitching.points[0];
        assert_eq!(start.relative_time_s, horizon_s);
        assert!((start.path_point.unwrap().pose.x - horizon_s).abs() < 1e-9);
    }
}

/// O2: the first cycle has none before it.
#[test]
fn o2_no_previous_frame_is_no_previous_trajectory() {
    let (mut provider, worker) = provider(ProviderParameters::default());
    let provision = provider.process(&frame(0.0, &region(), None));
    assert_eq!(provision.replan, Some(ReplanReason::NoPrevious));
    assert_eq!(worker.desk().jobs[0].stitching.points.len(), 1);
}

/// O10: a vehicle that is nowhere cannot even be told to stop there.
#[test]
fn o10_inputs_that_are_not_finite_are_an_error_without_a_trajectory() {
    let (mut provider, worker) = provider(ProviderParameters::default());
    let region = region();
    let good = frame(0.0, &region, None);
    let nan = f64::NAN;
    let bad = [
        Frame { now_s: nan, ..good },
        Frame { vehicle: vehicle_at(nan, 0.0, 0.0), ..good },
        Frame { vehicle: VehicleState { speed_mps: f64::INFINITY, ..good.vehicle }, ..good },
        Frame { vehicle: VehicleState { acceleration_mps2: nan, ..good.vehicle }, ..good },
        Frame { vehicle: VehicleState { curvature: nan, ..good.vehicle }, in_check_stage: true, ..good },
    ];
    for frame in bad {
        let provision = provider.process(&frame);
        assert_eq!(provision.status.message(), "OpenSpaceTrajectoryOptimizer input data not ready");
        assert_eq!(provision.status.code(), Code::PlanningError);
        assert_eq!((provision.source, provision.trajectory.points.len()), (Source::Nothing, 0));
    }
    assert!(worker.desk().jobs.is_empty());
}

/// O12: a configuration that makes no sense is refused with all its faults.
#[test]
fn o12_invalid_parameters_are_refused_all_at_once() {
    let parameters = ProviderParameters {
        planning_loop_rate: 0.0,
        open_space_planning_period: f64::NAN,
        ..ProviderParameters::default()
    };
    let execution = Execution::Threaded(Box::new(FakeWorker::default()));
    let refused = Provider::new(parameters, execution).unwrap_err();
    let names: Vec<_> = refused.iter().map(|fault| fault.parameter.as_str()).collect();
    assert_eq!(names, ["open_space_planning_period", "planning_loop_rate"]);
}

#[derive(Clone, Copy, Debug)]
enum Event {
    Nothing,
    Plan,
    Fail,
    Skip,
    Arrive,
    Check,
    Stop,
    Restart,
}

fn any_event() -> impl Strategy<Value = Event> {
    prop_oneof![
        6 => Just(Event::Nothing), 4 => Just(Event::Plan), 4 => Just(Event::Fail), 2 => Just(Event::Skip),
        1 => Just(Event::Arrive), 1 => Just(Event::Check), 1 => Just(Event::Stop), 2 => Just(Event::Restart),
    ]
}

proptest! {
    /// Whatever happens: there is always a trajectory, only a plan is ever reused, after the end only stops follow
    /// until a restart, and failures are counted as they come.
    #[test]
    fn any_sequence_of_cycles(events in prop::collection::vec(any_event(), 1..60)) {
        let parameters = ProviderParameters { error_count_limit: 3, ..ProviderParameters::default() };
        let (mut provider, worker) = provider(parameters);
        let region = region();
        let mut previous: Option<PreviousFrame> = None;
        let (mut over, mut failures) = (false, 0);
        for (cycle, event) in (0_u32..).zip(events) {
            let mut vehicle = vehicle_at(0.0, 0.0, 0.0);
            let mut in_check_stage = false;
            match event {
                Event::Plan if !worker.desk().jobs.is_empty() => worker.finish(5),
                Event::Fail => worker.fail(),
                Event::Skip => worker.desk_mut().skips += 1,
                Event::Arrive => vehicle.pose.x = 20.0,
                Event::Check => in_check_stage = true,
                Event::Stop => { provider.stop(); over = true; failures = 0; }
                Event::Restart => { provider.restart(); over = false; failures = 0; }
                Event::Plan | Event::Nothing => {}
            }
            let waiting = worker.desk().failure.is_some() && worker.desk().planned.is_none();
            let asked = Frame {
                vehicle, in_check_stage, ..frame(f64::from(cycle) * 0.1, &region, previous.as_ref())
            };
            let provision = provider.process(&asked);
            prop_assert!(!provision.trajectory.points.is_empty());
            prop_assert!(provision.trajectory.points.windows(2).all(|p| p[0].relative_time_s < p[1].relative_time_s));
            prop_assert!(provision.source != Source::Reused || previous.as_ref().is_some_and(|p| p.provider_success));
            if over && !in_check_stage {
                prop_assert_eq!(&provision.status, &Status::ParkingFinished);
            }
            if provision.destination_reached {
                over = true;
            }
            let acted = !over && !in_check_stage;
            if acted && provision.source == Source::Planned { failures = 0; }
            if acted && waiting { failures += 1; }
            prop_assert_eq!(provider.state().failures, failures);
            if acted && waiting {
                prop_assert_eq!(provision.status.code() == Code::PlanningError, failures > 3);
            }
            previous = Some(left_by(&provision));
        }
    }
}
