//! A finished plan behind the piece that it continues.

use proptest::prelude::*;

use super::*;

/// The part of a ten metre trajectory from one metre behind the planning start to the start, times from the job.
fn piece() -> DiscretizedTrajectory {
    let mut piece = straight(1);
    for point in &mut piece.points {
        point.relative_time_s -= 0.95;
        if let Some(path_point) = &mut point.path_point {
            path_point.s_m -= 1.0;
            path_point.pose.x -= 1.0;
        }
    }
    piece
}

fn planned(stitching: DiscretizedTrajectory) -> Planned {
    Planned { optimized: straight(5), stitching, submitted_s: 100.0, latency_ms: 3.0 }
}

/// The start of the plan replaces the end of the piece: times increase and arc lengths are continuous at the joint.
#[test]
fn at_the_joint_time_increases_and_arc_length_goes_on() {
    let loaded = load_result(100.0, planned(piece())).unwrap();
    assert_eq!(loaded.points.len(), 10 + 51);
    for pair in loaded.points.windows(2) {
        let (a, b) = (pair[0].path_point.unwrap(), pair[1].path_point.unwrap());
        assert!((pair[1].relative_time_s - pair[0].relative_time_s - 0.1).abs() < 1e-9);
        assert!((b.s_m - a.s_m - 0.1).abs() < 1e-9 && (b.pose.x - a.pose.x - 0.1).abs() < 1e-9);
    }
    assert!((loaded.points[10].relative_time_s - 0.05).abs() < 1e-12);
    assert_eq!(loaded.points[10].path_point.unwrap().s_m, 0.0);
}

/// Q2: times counted from when the job was made; on loading they count from now. No latency, no shift.
#[test]
fn q2_times_count_from_the_cycle_that_loads() {
    let at_once = load_result(100.0, planned(piece())).unwrap();
    let later = load_result(101.5, planned(piece())).unwrap();
    for (a, b) in at_once.points.iter().zip(&later.points) {
        assert!((a.relative_time_s - 1.5 - b.relative_time_s).abs() < 1e-12);
        assert_eq!(a.path_point, b.path_point);
    }
    // A clock that was set back meanwhile shifts nothing.
    assert_eq!(load_result(99.0, planned(piece())).unwrap(), at_once);
}

#[test]
fn a_plan_from_the_vehicle_itself_starts_one_cycle_ahead() {
    let stitching = compute_reinit_stitching_trajectory(0.1, &vehicle_at(0.0, 0.0, 0.0));
    let loaded = load_result(100.0, planned(stitching)).unwrap();
    assert_eq!(loaded.points.len(), 51);
    assert_eq!(loaded.points[0].relative_time_s, 0.1);
}

/// A piece that does not end before its plan begins is a defect; the vehicle is held instead.
#[test]
fn a_joint_that_goes_back_in_time_is_refused() {
    let mut stitching = piece();
    stitching.points[9].relative_time_s = 0.06;
    for broken in [stitching, DiscretizedTrajectory::default()] {
        let (mut provider, worker) = provider(ProviderParameters::default());
        let region = region();
        provider.process(&frame(100.0, &region, None));
        worker.desk_mut().planned = Some(planned(broken));
        let provision = provider.process(&frame(100.1, &region, None));
        assert!(
            matches!(provision.status, Status::Failed(PlanFailure::Refused { .. })),
            "{:?}",
            provision.status
        );
        assert_stop(&provision, &provision.status.clone());
    }
}

#[test]
fn a_loaded_plan_says_how_long_it_took() {
    let (mut provider, worker) = provider(ProviderParameters::default());
    let region = region();
    assert_eq!(provider.process(&frame(0.0, &region, None)).latency_ms, None);
    worker.finish(5);
    assert_eq!(provider.process(&frame(0.1, &region, None)).latency_ms, Some(12.5));
}

proptest! {
    /// Any piece of any previous trajectory: strictly increasing times, arc lengths that never fall.
    #[test]
    fn loading_keeps_the_order(
        elapsed_s in 0.0..6.0_f64, period_s in 0.1..6.0_f64, latency_s in 0.0..10.0_f64, x in -1.0..11.0_f64,
    ) {
        let previous = PublishedTrajectory { trajectory: straight(10), header_time_s: 100.0 };
        let vehicle = vehicle_at(x, 0.0, 0.0);
        let stitching = compute_stitching_trajectory(&StitchRequest {
            vehicle: &vehicle,
            now_s: 100.0 + elapsed_s,
            period_s,
            reinit_cycle_s: 0.1,
            preserved_points: 0,
            replan_by_offset: false,
            enabled: true,
            offset_limits: crate::stitcher::OffsetLimits::default(),
            previous: Some(&previous),
        })
        .trajectory;
        let now_s = 100.0 + elapsed_s + latency_s;
        let submitted_s = 100.0 + elapsed_s;
        let loaded = load_result(now_s, Planned { submitted_s, ..planned(stitching) }).unwrap();
        for pair in loaded.points.windows(2) {
            prop_assert!(pair[0].relative_time_s < pair[1].relative_time_s);
            prop_assert!(pair[0].path_point.unwrap().s_m < pair[1].path_point.unwrap().s_m);
        }
    }
}
