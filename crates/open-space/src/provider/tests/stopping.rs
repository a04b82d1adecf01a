//! The causes of a stop trajectory, and its values.

use super::*;

/// A vehicle that stands is held like one that rolls forward.
#[test]
fn stop_trajectory_values() {
    for (speed, acceleration) in
        [(1.0, -0.3), (0.0, -0.3), (-1e-6, -0.3), (-1e-5, -0.3), (-1e-4, 0.3), (-2.0, 0.3)]
    {
        let vehicle = VehicleState { speed_mps: speed, z: 4.0, curvature: 0.1, ..vehicle_at(3.0, -2.0, 1.5) };
        let stop = stop_trajectory(&vehicle, 0.3);
        assert_eq!(stop.points.len(), 10);
        for (i, point) in (0_i32..).zip(&stop.points) {
            assert_eq!(
                point.path_point,
                Some(PathPoint { pose: PlanarPose::new(3.0, -2.0, 1.5), ..PathPoint::default() })
            );
            assert_eq!((point.speed_mps, point.acceleration_mps2, point.steer_rad), (0.0, acceleration, 0.0));
            assert!((point.relative_time_s - 0.1 * f64::from(i)).abs() < 1e-15);
        }
    }
}

/// Times are accumulated, as upstream accumulates them: the fourth is a hair above 0.3.
#[test]
fn stop_trajectory_times_are_sums() {
    let stop = stop_trajectory(&vehicle_at(0.0, 0.0, 0.0), 0.0);
    assert_eq!(stop.points[3].relative_time_s, 0.1 + 0.1 + 0.1);
    assert!(stop.points[3].relative_time_s > 0.3);
}

/// Cause 1: while a parked vehicle is checked before it leaves, it is held and nothing else happens.
#[test]
fn cause_1_park_and_go_check() {
    let (mut provider, worker) = provider(ProviderParameters::default());
    let region = region();
    let checked = Frame { in_check_stage: true, ..frame(0.0, &region, None) };
    for _ in 0..3 {
        assert_stop(&provider.process(&checked), &Status::Done);
    }
    assert_eq!((worker.desk().starts, worker.desk().jobs.len()), (0, 0));
    assert!(!provider.state().thread_started);
    assert_eq!((Status::Done.message().as_str(), Status::Done.code()), ("", Code::Ok));
}

/// Cause 2: the vehicle arrives. Cause 3: from then on parking is finished, wherever it goes, until a restart.
#[test]
fn causes_2_and_3_near_destination_latches_until_restart() {
    let (mut provider, worker) = provider(ProviderParameters::default());
    let region = region();
    let there = Frame { vehicle: vehicle_at(20.05, 0.0, 0.01), ..frame(0.0, &region, None) };
    let arrived = provider.process(&there);
    assert_stop(&arrived, &Status::NearDestination);
    assert!(arrived.destination_reached);
    assert_eq!(arrived.status.message(), "Vehicle is near to destination");
    // The job was handed over before the look at the goal, and planning was called off after it.
    assert_eq!((worker.desk().jobs.len(), worker.desk().stop_requests), (1, 1));
    worker.finish(5);
    for now_s in [0.1, 0.2, 30.0] {
        let later = provider.process(&frame(now_s, &region, Some(&left_by(&arrived))));
        assert_stop(&later, &Status::ParkingFinished);
        assert!(!later.destination_reached);
        assert_eq!(later.status.message(), "Parking finished");
    }
    assert_eq!((worker.desk().starts, worker.desk().jobs.len()), (1, 1));
    assert!(provider.state().generation_stopped);
    provider.restart();
    let again = provider.process(&frame(31.0, &region, None));
    assert_stop(&again, &Status::StopUnfinished);
    assert_eq!(worker.desk().starts, 2);
}

#[test]
fn the_destination_is_near_strictly_within_both_limits() {
    let turned = Region {
        origin: Point2::new(10.0, 5.0),
        heading_rad: std::f64::consts::FRAC_PI_2,
        goal: PlanarPose::new(2.0, 1.0, 3.0),
        ..(*region()).clone()
    };
    // One ahead of the origin and one to its left, with the region's x axis along the map's y axis.
    let goal = PlanarPose::new(9.0, 7.0, 3.0 + std::f64::consts::FRAC_PI_2);
    assert!(turned.goal_in_map().distance_m(&goal) < 1e-12);
    let region = Arc::new(turned);
    for (dx, dyaw, speed, near) in [
        (0.0, 0.0, 0.0, true),
        (0.0999, 0.0499, 0.0, true),
        (0.1001, 0.0, 0.0, false),
        (0.0, 0.0501, 0.0, false),
        (0.0, -0.0501, 0.0, false),
        (0.0, std::f64::consts::TAU, 0.0, true),
    ] {
        let (mut provider, _) = provider(ProviderParameters::default());
        let vehicle = VehicleState { speed_mps: speed, ..vehicle_at(goal.x + dx, goal.y, goal.yaw + dyaw) };
        let provision = provider.process(&Frame { vehicle, ..frame(0.0, &region, None) });
        assert_eq!(provision.destination_reached, near, "{dx} m, {dyaw} rad");
    }
    // Exactly at a limit is not near: numbers that a computer holds exactly.
    let parameters = ProviderParameters {
        is_near_destination_threshold: 0.25,
        is_near_destination_theta_threshold: 0.5,
        ..ProviderParameters::default()
    };
    let region = super::region();
    for (x, yaw, near) in
        [(20.25, 0.0, false), (20.0, 0.5, false), (20.0, -0.5, false), (20.125, 0.375, true)]
    {
        let (mut provider, _) = provider_with(&parameters);
        let provision =
            provider.process(&Frame { vehicle: vehicle_at(x, 0.0, yaw), ..frame(0.0, &region, None) });
        assert_eq!(provision.destination_reached, near, "{x} m, {yaw} rad");
    }
}

/// A vehicle that rolls past its goal to come back to it has not arrived; as upstream has it, it may.
#[test]
fn a_vehicle_that_rolls_past_its_destination_has_not_arrived() {
    let upstream =
        ProviderParameters { is_near_destination_speed_threshold: 10.0, ..ProviderParameters::default() };
    for (parameters, speed_mps, arrived) in [
        (ProviderParameters::default(), 0.2, true),
        (ProviderParameters::default(), -0.2, true),
        (ProviderParameters::default(), 0.201, false),
        (ProviderParameters::default(), -0.201, false),
        (upstream, -3.0, true),
    ] {
        let (mut provider, _) = provider_with(&parameters);
        let region = region();
        let goal = region.goal_in_map();
        let vehicle = VehicleState { speed_mps, ..vehicle_at(goal.x, goal.y, goal.yaw) };
        let provision = provider.process(&Frame { vehicle, ..frame(0.0, &region, None) });
        assert_eq!(provision.destination_reached, arrived, "{speed_mps} m/s");
        assert_eq!(provider.state().generation_stopped, arrived, "{speed_mps} m/s");
    }
}

fn provider_with(parameters: &ProviderParameters) -> (Provider, FakeWorker) {
    provider(parameters.clone())
}

/// Cause 4, by count: a thousand failures are borne, one more is an error, with the vehicle held.
#[test]
fn cause_4_error_limit_by_count_1000_and_1001() {
    let (mut provider, worker) = provider(ProviderParameters::default());
    let region = region();
    for i in 1_u32..=1001 {
        worker.fail();
        let provision = provider.process(&frame(f64::from(i) * 1e-3, &region, None));
        assert_eq!(provision.failure, Some(search_failure()));
        if i <= 1000 {
            assert_stop(&provision, &Status::StopUnfinished);
            assert_eq!((provision.status.code(), provider.state().failures), (Code::Ok, i));
        } else {
            assert!(
                matches!(provision.status, Status::TooManyFailures { count: 1001, .. }),
                "{:?}",
                provision.status
            );
            assert_eq!(provision.status.message(), "open_space_optimizer failed too many times");
            assert_eq!(provision.status.code(), Code::PlanningError);
            assert_stop(&provision, &provision.status.clone());
        }
    }
}

/// Cause 4, by time: more than ten seconds of nothing but failures.
#[test]
fn cause_4_error_limit_by_duration_of_ten_seconds() {
    let (mut provider, worker) = provider(ProviderParameters::default());
    let region = region();
    for tenth in 0_u32..=101 {
        worker.fail();
        // Eighths, so that ten seconds are exactly ten seconds.
        let provision = provider.process(&frame(f64::from(tenth) * 0.125, &region, None));
        let expected = if f64::from(tenth) * 0.125 > 10.0 { Code::PlanningError } else { Code::Ok };
        assert_eq!(provision.status.code(), expected, "cycle {tenth}");
        assert_eq!(provision.source, Source::Stop);
    }
}

/// A cycle in which no failure is reported is no error, however often planning failed before.
#[test]
fn past_the_limit_only_a_new_failure_is_an_error() {
    let parameters = ProviderParameters { error_count_limit: 2, ..ProviderParameters::default() };
    let (mut provider, worker) = provider(parameters);
    let region = region();
    for (i, expected) in [(1.0, Code::Ok), (2.0, Code::Ok), (3.0, Code::PlanningError)] {
        worker.fail();
        assert_eq!(provider.process(&frame(i, &region, None)).status.code(), expected);
    }
    assert_stop(&provider.process(&frame(4.0, &region, None)), &Status::StopUnfinished);
}

#[test]
fn a_plan_a_stop_and_a_restart_each_forgive_the_failures() {
    type Forgive = fn(&mut Provider, &FakeWorker, &Arc<Region>);
    let ways: [Forgive; 2] = [
        |provider, worker, region| {
            worker.finish(5);
            assert_eq!(provider.process(&frame(9.0, region, None)).source, Source::Planned);
        },
        |provider, _, _| provider.restart(),
    ];
    for forgive in ways {
        let parameters = ProviderParameters { error_count_limit: 3, ..ProviderParameters::default() };
        let (mut provider, worker) = provider(parameters);
        let region = region();
        for now_s in [0.0, 4.0, 8.0] {
            worker.fail();
            assert_eq!(provider.process(&frame(now_s, &region, None)).status.code(), Code::Ok);
        }
        assert_eq!(provider.state().failures, 3);
        forgive(&mut provider, &worker, &region);
        assert_eq!(provider.state().failures, 0);
        for now_s in [10.0, 11.0, 12.0] {
            worker.fail();
            assert_eq!(provider.process(&frame(now_s, &region, None)).status.code(), Code::Ok, "at {now_s}");
        }
    }
}

/// A skipped job, a long silence or a clock set back: failures before and after are no stretch of failures.
#[test]
fn interrupted_failures_do_not_add_up_to_a_duration() {
    for (first, second, skips) in [(0.0, 11.0, 0), (100.0, 50.0, 0), (0.0, 9.0, 1)] {
        let (mut provider, worker) = provider(ProviderParameters::default());
        let region = region();
        worker.fail();
        provider.process(&frame(first, &region, None));
        worker.desk_mut().skips = skips;
        for now_s in [second, second + 5.0, second + 10.0] {
            worker.fail();
            assert_eq!(provider.process(&frame(now_s, &region, None)).status.code(), Code::Ok, "at {now_s}");
        }
        worker.fail();
        let beyond = provider.process(&frame(second + 10.125, &region, None));
        assert_eq!(beyond.status.code(), Code::PlanningError);
    }
}

/// Cause 5: nothing planned yet, and the cycle before had no plan either.
#[test]
fn cause_5_previous_frame_failed() {
    let (mut provider, _) = provider(ProviderParameters::default());
    let region = region();
    let first = provider.process(&frame(0.0, &region, None));
    assert_stop(&first, &Status::StopUnfinished);
    assert_eq!(first.status.message(), "Stop due to computation not finished");
    assert_eq!(first.status.code(), Code::Ok);
    let second = provider.process(&frame(0.1, &region, Some(&left_by(&first))));
    assert_stop(&second, &Status::StopUnfinished);
}

#[test]
fn a_stopped_provider_holds_the_vehicle_until_a_restart() {
    let (mut provider, worker) = provider(ProviderParameters::default());
    let region = region();
    provider.process(&frame(0.0, &region, None));
    worker.finish(5);
    provider.stop();
    assert_eq!(worker.desk().stops, 1);
    assert!(provider.state().thread_started && provider.state().generation_stopped);
    assert_stop(&provider.process(&frame(0.1, &region, None)), &Status::ParkingFinished);
    provider.restart();
    assert_stop(&provider.process(&frame(0.2, &region, None)), &Status::StopUnfinished);
    assert_eq!(worker.desk().starts, 2);
    worker.finish(5);
    assert_eq!(provider.process(&frame(0.3, &region, None)).source, Source::Planned);
}

/// A worker that was never started is not waited for.
#[test]
fn stopping_before_the_first_cycle_and_dropping() {
    let (mut provider, worker) = provider(ProviderParameters::default());
    provider.stop();
    assert_eq!(worker.desk().stops, 0);
    provider.restart();
    provider.process(&frame(0.0, &region(), None));
    drop(provider);
    assert_eq!(worker.desk().stops, 1, "a drop ends planning");
}

#[test]
fn without_a_thread_the_vehicle_is_held_and_the_next_cycle_tries_again() {
    let (mut provider, worker) = provider(ProviderParameters::default());
    worker.desk_mut().refuse_start = true;
    let region = region();
    let provision = provider.process(&frame(0.0, &region, None));
    assert_stop(&provision, &Status::NoWorker(WorkerNotStarted { why: "no threads left".to_owned() }));
    assert_eq!(provision.status.code(), Code::PlanningError);
    worker.desk_mut().refuse_start = false;
    assert_stop(&provider.process(&frame(0.1, &region, None)), &Status::StopUnfinished);
}
