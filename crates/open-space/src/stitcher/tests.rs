//! The stitcher's rows, one by one, and what holds of every stitch.

use proptest::prelude::*;

use super::*;

fn at(x: f64, y: f64) -> VehicleState {
    VehicleState::standing_at(PlanarPose::new(x, y, 0.0))
}

/// A metre along the x axis in a second, a point every tenth, header at 100 s.
fn line() -> PublishedTrajectory {
    let point = |i: i32| {
        let t = f64::from(i) * 0.1;
        DiscretizedPoint {
            path_point: Some(PathPoint {
                pose: PlanarPose::new(t, 0.0, 0.0),
                s_m: t,
                ..PathPoint::default()
            }),
            speed_mps: 1.0,
            relative_time_s: t,
            ..DiscretizedPoint::default()
        }
    };
    PublishedTrajectory {
        trajectory: DiscretizedTrajectory { points: (0..=10).map(point).collect() },
        header_time_s: 100.0,
    }
}

fn request<'a>(vehicle: &'a VehicleState, previous: &'a PublishedTrajectory) -> StitchRequest<'a> {
    StitchRequest {
        vehicle,
        now_s: 100.25,
        period_s: 0.1,
        reinit_cycle_s: 0.1,
        preserved_points: 0,
        replan_by_offset: false,
        enabled: true,
        offset_limits: OffsetLimits::default(),
        previous: Some(previous),
    }
}

fn times_and_lengths(trajectory: &DiscretizedTrajectory) -> Vec<(f64, f64)> {
    trajectory.points.iter().map(|p| (p.relative_time_s, p.path_point.unwrap().s_m)).collect()
}

fn assert_pairs(found: &[(f64, f64)], expected: &[(f64, f64)]) {
    assert_eq!(found.len(), expected.len(), "{found:?}");
    for (f, e) in found.iter().zip(expected) {
        assert!((f.0 - e.0).abs() < 1e-9 && (f.1 - e.1).abs() < 1e-9, "{found:?} instead of {expected:?}");
    }
}

const MISSED: &str = "replan for previous trajectory missed path point";
const TOO_FAR: &str =
    "the distance between matched point and actual position is too large. Replan is triggered.";

/// Each row of the table, provoked by one change to a request that would be stitched.
#[test]
fn rows_one_to_nine_in_their_order_with_their_texts() {
    type Change = fn(&mut StitchRequest<'_>, &mut VehicleState, &mut PublishedTrajectory);
    let rows: [(&str, String, Change); 11] = [
        ("1", "stitch is disabled by gflag.".into(), |r, _, _| r.enabled = false),
        ("2", "replan for no previous trajectory.".into(), |r, _, _| r.previous = None),
        ("3", "replan for manual mode.".into(), |_, v, _| v.automatic = false),
        ("4", "replan for empty previous trajectory.".into(), |_, _, p| p.trajectory.points.clear()),
        (
            "5",
            "replan for current time smaller than the previous trajectory's first time.".into(),
            |r, _, _| {
                r.now_s = 99.99;
            },
        ),
        ("6", "replan for current time beyond the previous trajectory's last time".into(), |r, _, _| {
            r.now_s = 101.0;
        }),
        ("7", MISSED.into(), |_, _, p| p.trajectory.points[3].path_point = None),
        ("8a", format!("{TOO_FAR} lat_diff = -0.6"), |r, v, _| {
            r.replan_by_offset = true;
            v.pose.y = 0.6;
        }),
        ("8a", format!("{TOO_FAR} lat_diff = 0.75"), |r, v, _| {
            r.replan_by_offset = true;
            v.pose.y = -0.75;
        }),
        ("8b", format!("{TOO_FAR} lon_diff = 3.3"), |r, v, _| {
            r.replan_by_offset = true;
            v.pose.x = -3.0;
        }),
        ("9", MISSED.into(), |_, _, p| p.trajectory.points[4].path_point = None),
    ];
    for (row, text, change) in rows {
        let (mut vehicle, mut previous) = (at(0.3, 0.0), line());
        // The change needs the pieces apart; the request is put together from them afterwards.
        let (unchanged_vehicle, unchanged) = (vehicle, previous.clone());
        let mut changed = request(&unchanged_vehicle, &unchanged);
        change(&mut changed, &mut vehicle, &mut previous);
        let had_previous = changed.previous.is_some();
        let asked =
            StitchRequest { vehicle: &vehicle, previous: had_previous.then_some(&previous), ..changed };
        let stitching = compute_stitching_trajectory(&asked);
        assert_eq!(stitching.replan.map(|reason| reason.to_string()), Some(text), "row {row}");
        assert_eq!(stitching.trajectory, compute_reinit_stitching_trajectory(0.1, &vehicle), "row {row}");
    }
}

/// Every row is provoked at once; taking them away from the front shows that each is tested before the next.
#[test]
fn an_earlier_row_hides_a_later_one() {
    let mut manual = at(0.3, 0.9);
    manual.automatic = false;
    let vehicle = at(0.3, 0.9);
    let (empty, mut gap) = (PublishedTrajectory::default(), line());
    gap.trajectory.points[3].path_point = None;
    let base = StitchRequest { replan_by_offset: true, enabled: false, ..request(&manual, &empty) };
    let on = StitchRequest { enabled: true, ..base };
    let cases = [
        (StitchRequest { previous: None, ..base }, ReplanReason::Disabled),
        (StitchRequest { previous: None, ..on }, ReplanReason::NoPrevious),
        (on, ReplanReason::ManualMode),
        (StitchRequest { vehicle: &vehicle, ..on }, ReplanReason::EmptyPrevious),
        (
            StitchRequest { vehicle: &vehicle, previous: Some(&gap), now_s: 99.0, ..on },
            ReplanReason::BeforePrevious,
        ),
        (
            StitchRequest { vehicle: &vehicle, previous: Some(&gap), now_s: 102.0, ..on },
            ReplanReason::BeyondPrevious,
        ),
        (StitchRequest { vehicle: &vehicle, previous: Some(&gap), ..on }, ReplanReason::MissingPathPoint),
    ];
    for (asked, reason) in cases {
        assert_eq!(compute_stitching_trajectory(&asked).replan, Some(reason));
    }
}

#[test]
fn the_published_check_vectors() {
    let (vehicle, previous) = (at(0.3, 0.0), line());
    let plain = request(&vehicle, &previous);
    let stitched = compute_stitching_trajectory(&plain);
    assert_eq!(stitched.replan, None);
    assert_pairs(&times_and_lengths(&stitched.trajectory), &[(0.05, -0.1), (0.15, 0.0)]);
    let kept = compute_stitching_trajectory(&StitchRequest { preserved_points: 20, ..plain });
    let expected: Vec<_> = (0..5).map(|i| f64::from(i) * 0.1).map(|t| (t - 0.25, t - 0.4)).collect();
    assert_pairs(&times_and_lengths(&kept.trajectory), &expected);
}

/// The number of kept points as upstream counts it: unsigned difference, cast to a signed 32-bit number, not below 0.
#[test]
fn preserved_points_count_as_upstream_counts_them() {
    let (vehicle, previous) = (at(0.5, 0.0), line());
    for preserved in [0_usize, 1, 4, 5, 6, 20, 1_000_000] {
        let matched = 5_usize;
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_possible_wrap,
            reason = "the cast in question"
        )]
        let start = usize::try_from(matched.wrapping_sub(preserved) as i32).unwrap_or(0);
        let asked =
            StitchRequest { now_s: 100.5, preserved_points: preserved, ..request(&vehicle, &previous) };
        let stitched = compute_stitching_trajectory(&asked).trajectory;
        assert_eq!(stitched.points.len(), 6 - start + 1, "{preserved} preserved");
    }
}

#[test]
fn at_the_last_interval_it_stitches_and_at_the_last_time_it_replans() {
    let (vehicle, previous) = (at(0.9, 0.0), line());
    for (now_s, replan) in [
        (100.899_999, None),
        // the slack of 10 µs still finds the point before the last
        (100.900_009, None),
        (100.95, Some(ReplanReason::BeyondPrevious)),
        (101.0, Some(ReplanReason::BeyondPrevious)),
    ] {
        let asked = StitchRequest { now_s, ..request(&vehicle, &previous) };
        assert_eq!(compute_stitching_trajectory(&asked).replan, replan, "at {now_s}");
    }
}

#[test]
fn offset_limits_are_strict() {
    let previous = line();
    for (x, y, replan) in [
        (0.3, 0.5, None),
        (0.3, -0.5, None),
        (0.3, 0.500_001, Some("lat_diff = -0.500001")),
        (0.3, -0.500_001, Some("lat_diff = 0.500001")),
        (-2.2, 0.0, None),
        (-2.200_01, 0.0, Some("lon_diff = 2.50001")),
        (2.8, 0.0, None),
        (2.800_1, 0.0, Some("lon_diff = -2.5001")),
        (f64::NAN, 0.0, Some("lat_diff = NaN")),
    ] {
        let vehicle = at(x, y);
        let asked = StitchRequest { replan_by_offset: true, ..request(&vehicle, &previous) };
        let reason = compute_stitching_trajectory(&asked).replan.map(|reason| reason.to_string());
        assert_eq!(reason, replan.map(|end| format!("{TOO_FAR} {end}")), "at ({x}, {y})");
        let without = StitchRequest { replan_by_offset: false, ..asked };
        assert_eq!(compute_stitching_trajectory(&without).replan, None, "offsets do not count at ({x}, {y})");
    }
}

/// A vehicle far behind schedule keeps the points from where it is.
#[test]
fn the_piece_begins_where_the_vehicle_is_if_that_is_behind_schedule() {
    let (vehicle, previous) = (at(0.1, 0.0), line());
    let asked = StitchRequest { now_s: 100.5, ..request(&vehicle, &previous) };
    let times = times_and_lengths(&compute_stitching_trajectory(&asked).trajectory);
    assert_eq!(times.len(), 6);
    assert!((times[0].0 + 0.4).abs() < 1e-9 && (times[0].1 + 0.5).abs() < 1e-9, "{times:?}");
}

/// A period beyond the end starts the plan at the end.
#[test]
fn a_period_of_a_thousand_seconds_starts_the_plan_at_the_end() {
    let (vehicle, previous) = (at(0.3, 0.0), line());
    let asked = StitchRequest { period_s: 1000.0, ..request(&vehicle, &previous) };
    let stitched = compute_stitching_trajectory(&asked).trajectory;
    assert_eq!(stitched.points.last().unwrap().path_point.unwrap().pose, PlanarPose::new(1.0, 0.0, 0.0));
    assert_eq!(stitched.points.len(), 8);
}

#[test]
fn the_projection_is_positive_to_the_right() {
    let path_point = PathPoint {
        pose: PlanarPose::new(1.0, 2.0, std::f64::consts::FRAC_PI_2),
        s_m: 10.0,
        ..PathPoint::default()
    };
    let right = position_projection(Point2::new(3.0, 5.0), &path_point);
    assert!((right.s_m - 13.0).abs() < 1e-12 && (right.right_m - 2.0).abs() < 1e-12, "{right:?}");
    let left = position_projection(Point2::new(0.0, 1.0), &path_point);
    assert!((left.s_m - 9.0).abs() < 1e-12 && (left.right_m + 1.0).abs() < 1e-12, "{left:?}");
}

/// Standing means slower than 0.1 m/s and accelerating less than 0.4 m/s², both strict.
#[test]
fn a_standing_vehicle_starts_as_it_is_and_a_moving_one_as_predicted() {
    for (v, a, stands) in [
        (0.0, 0.0, true),
        (0.099_999, 0.399_999, true),
        (-0.099_999, -0.399_999, true),
        (0.1, 0.0, false),
        (-0.1, 0.0, false),
        (0.0, 0.4, false),
        (0.0, -0.4, false),
    ] {
        let vehicle =
            VehicleState { speed_mps: v, acceleration_mps2: a, curvature: 0.1, z: 3.0, ..at(1.0, 2.0) };
        let trajectory = compute_reinit_stitching_trajectory(0.1, &vehicle);
        assert_eq!(trajectory.points.len(), 1);
        let point = trajectory.points[0];
        let expected = if stands { vehicle } else { predict(0.1, &vehicle) };
        let path_point = point.path_point.unwrap();
        assert_eq!(path_point.pose, expected.pose, "v {v} a {a}");
        assert_eq!(stands, point.speed_mps == v && path_point.pose == vehicle.pose);
        assert_eq!((path_point.s_m, path_point.z, path_point.curvature), (0.0, 3.0, 0.1));
        assert_eq!((point.relative_time_s, point.steer_rad), (0.1, 0.0));
    }
}

/// The vehicle went 3 m ahead, 1 m to the left and turned left a quarter: what lay 5 m ahead now lies to the right.
#[test]
fn a_published_trajectory_moves_against_the_vehicle() {
    let mut previous = line();
    previous.trajectory.points[0].path_point =
        Some(PathPoint { pose: PlanarPose::new(5.0, 1.0, 0.3), ..PathPoint::default() });
    previous.trajectory.points[1].path_point = None;
    transform_last_published_trajectory(3.0, 1.0, std::f64::consts::FRAC_PI_2, &mut previous);
    let pose = previous.trajectory.points[0].path_point.unwrap().pose;
    assert!(pose.x.abs() < 1e-12 && (pose.y + 2.0).abs() < 1e-12, "{pose:?}");
    assert!((pose.yaw - (0.3 - std::f64::consts::FRAC_PI_2)).abs() < 1e-12);
    assert_eq!(previous.trajectory.points[1].path_point, None);
}

prop_compose! {
    fn any_previous()(
        gaps in prop::collection::vec(0.01..0.4_f64, 2..40),
        turns in prop::collection::vec(-0.3..0.3_f64, 40),
        start_s in -1.0..0.5_f64,
    ) -> PublishedTrajectory {
        let (mut time_s, mut pose, mut s_m) = (start_s, PlanarPose::default(), 0.0);
        let points = gaps.iter().zip(turns).map(|(gap, turn)| {
            time_s += gap;
            pose.yaw += turn;
            pose.x += gap * pose.yaw.cos();
            pose.y += gap * pose.yaw.sin();
            s_m += gap;
            DiscretizedPoint {
                path_point: Some(PathPoint { pose, s_m, ..PathPoint::default() }),
                relative_time_s: time_s,
                ..DiscretizedPoint::default()
            }
        });
        PublishedTrajectory {
            trajectory: DiscretizedTrajectory { points: points.collect() },
            header_time_s: 100.0,
        }
    }
}

proptest! {
    /// Whatever the inputs: at least one point, the last with s = 0; a stitched piece is a copy of consecutive
    /// previous points, shifted in time and arc length as a whole.
    #[test]
    fn a_stitch_is_a_shifted_piece_that_ends_at_zero(
        previous in any_previous(), now_s in 98.0..112.0_f64, period_s in 0.0..8.0_f64,
        preserved in 0_usize..50, x in -3.0..6.0_f64, y in -3.0..3.0_f64,
        replan_by_offset in any::<bool>(),
    ) {
        let vehicle = at(x, y);
        let asked = StitchRequest {
            now_s, period_s, preserved_points: preserved, replan_by_offset, ..request(&vehicle, &previous)
        };
        let Stitching { trajectory, replan } = compute_stitching_trajectory(&asked);
        let last = trajectory.points.last().unwrap();
        prop_assert_eq!(last.path_point.unwrap().s_m, 0.0);
        if replan.is_some() {
            prop_assert_eq!(trajectory.points.len(), 1);
            prop_assert_eq!(last.relative_time_s, 0.1);
            return Ok(());
        }
        let all = &previous.trajectory.points;
        let poses = |points: &[DiscretizedPoint]| -> Vec<_> {
            points.iter().map(|p| p.path_point.unwrap().pose).collect()
        };
        let size = trajectory.points.len();
        let first = all
            .windows(size)
            .position(|window| poses(window) == poses(&trajectory.points));
        prop_assert!(first.is_some(), "not a piece of the previous trajectory");
        let piece = &all[first.unwrap()..first.unwrap() + size];
        for (ours, theirs) in trajectory.points.iter().zip(piece) {
            prop_assert!((ours.relative_time_s + now_s - theirs.relative_time_s - 100.0).abs() < 1e-9);
        }
        // The start of the plan is the first point that is not earlier than the period says, or the last there is.
        let due_s = now_s - 100.0 + period_s;
        let end = first.unwrap() + size - 1;
        prop_assert!(end + 1 == all.len() || all[end].relative_time_s + 1.1e-5 >= due_s);
    }

    #[test]
    fn moving_there_and_back_is_the_identity(
        previous in any_previous(), x in -50.0..50.0_f64, y in -50.0..50.0_f64, turn in -3.0..3.0_f64,
    ) {
        let mut moved = previous.clone();
        transform_last_published_trajectory(x, y, turn, &mut moved);
        // The vehicle's first place seen from its second, turned back.
        let (sin, cos) = turn.sin_cos();
        transform_last_published_trajectory(-(cos * x + sin * y), sin * x - cos * y, -turn, &mut moved);
        for (back, before) in moved.trajectory.points.iter().zip(&previous.trajectory.points) {
            let (back, before) = (back.path_point.unwrap().pose, before.path_point.unwrap().pose);
            prop_assert!(back.distance_m(&before) < 1e-9 && back.yaw_to(&before).abs() < 1e-9);
        }
    }

    /// Moving the whole scene moves the piece and changes no decision.
    #[test]
    fn a_rigid_motion_of_the_scene_moves_the_stitch(
        previous in any_previous(), now_s in 99.0..106.0_f64, x in -2.0..4.0_f64, y in -2.0..2.0_f64,
        dx in -100.0..100.0_f64, dy in -100.0..100.0_f64, turn in -3.0..3.0_f64,
    ) {
        let vehicle = VehicleState { speed_mps: 1.0, ..at(x, y) };
        let asked = StitchRequest { now_s, period_s: 1.0, ..request(&vehicle, &previous) };
        let here = compute_stitching_trajectory(&asked);
        let mut moved_previous = previous.clone();
        transform_last_published_trajectory(dx, dy, turn, &mut moved_previous);
        let mut moved_vehicle = PublishedTrajectory {
            trajectory: DiscretizedTrajectory {
                points: vec![DiscretizedPoint {
                    path_point: Some(PathPoint { pose: vehicle.pose, ..PathPoint::default() }),
                    ..DiscretizedPoint::default()
                }],
            },
            header_time_s: 0.0,
        };
        transform_last_published_trajectory(dx, dy, turn, &mut moved_vehicle);
        let moved_state =
            VehicleState { pose: moved_vehicle.trajectory.points[0].path_point.unwrap().pose, ..vehicle };
        let there = compute_stitching_trajectory(&StitchRequest {
            now_s, period_s: 1.0, ..request(&moved_state, &moved_previous)
        });
        prop_assert_eq!(here.replan, there.replan);
        prop_assert_eq!(here.trajectory.points.len(), there.trajectory.points.len());
    }
}
