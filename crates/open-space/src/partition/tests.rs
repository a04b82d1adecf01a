//! Cutting a plan, finding the vehicle on it, and moving on from part to part.

use std::f64::consts::PI;

use proptest::prelude::*;

use super::*;

/// Points of a motion at constant curvature from a pose, at rest at both ends, a tenth of a second apart.
fn motion(
    start: PlanarPose,
    gear: Gear,
    curvature: f64,
    length_m: f64,
    from_s: f64,
) -> Vec<DiscretizedPoint> {
    let sign = gear.sign();
    // Half the way speeding up with 1 m/s², half of it slowing down.
    let half_s = length_m.sqrt();
    let travelled = |t: f64| {
        if t < half_s { 0.5 * t * t } else { length_m - 0.5 * (2.0 * half_s - t).max(0.0).powi(2) }
    };
    let mut points = Vec::new();
    let mut t = 0.0;
    loop {
        let t_now = f64::min(t, 2.0 * half_s);
        let s = sign * travelled(t_now);
        let yaw = start.yaw + s * curvature;
        let chord = if curvature == 0.0 { s } else { 2.0 * (0.5 * s * curvature).sin() / curvature };
        let middle = start.yaw + 0.5 * s * curvature;
        points.push(DiscretizedPoint {
            path_point: Some(PathPoint {
                pose: PlanarPose::new(start.x + chord * middle.cos(), start.y + chord * middle.sin(), yaw),
                curvature,
                ..PathPoint::default()
            }),
            speed_mps: sign * if t_now < half_s { t_now } else { 2.0 * half_s - t_now },
            acceleration_mps2: sign * if t_now < half_s { 1.0 } else { -1.0 },
            steer_rad: (curvature * VehicleInfo::default().wheel_base_m()).atan(),
            relative_time_s: from_s + t_now,
            ..DiscretizedPoint::default()
        });
        if t >= 2.0 * half_s {
            return points;
        }
        t += 0.1;
    }
}

/// Motions one after the other, from the origin; a cusp belongs to the motion that leaves it. Arc length grows.
fn plan_of(motions: &[(Gear, f64, f64)]) -> DiscretizedTrajectory {
    let mut points: Vec<DiscretizedPoint> = Vec::new();
    for &(gear, curvature, length_m) in motions {
        let cusp = points.pop();
        let start = cusp.map_or(PlanarPose::default(), |p| p.path_point.unwrap().pose);
        let from_s = cusp.map_or(0.0, |p| p.relative_time_s);
        points.extend(motion(start, gear, curvature, length_m, from_s));
    }
    let mut s_m = 0.0;
    for i in 1..points.len() {
        s_m += points[i - 1].path_point.unwrap().pose.distance_m(&points[i].path_point.unwrap().pose);
        points[i].path_point.as_mut().unwrap().s_m = s_m;
    }
    DiscretizedTrajectory { points }
}

/// Forward 4 m, back 5 m to the left, forward again 3 m.
fn three_parts() -> DiscretizedTrajectory {
    plan_of(&[(Gear::Forward, 0.0, 4.0), (Gear::Reverse, 0.15, 5.0), (Gear::Forward, -0.1, 3.0)])
}

fn pose_of(point: &DiscretizedPoint) -> PlanarPose {
    point.path_point.unwrap().pose
}

fn at(pose: PlanarPose, gear: Gear, speed_mps: f64) -> VehicleState {
    VehicleState { speed_mps, gear, ..VehicleState::standing_at(pose) }
}

fn partitioner() -> Partitioner {
    Partitioner::new(PartitionParameters::default(), VehicleInfo::default())
}

/// A partitioner that has been following the first part of a plan.
fn underway(plan: &DiscretizedTrajectory) -> Partitioner {
    let mut partitioner = partitioner();
    partitioner.follow(plan, 0.0, &at(pose_of(&plan.points[0]), Gear::Forward, 0.0)).unwrap();
    partitioner
}

#[test]
fn a_plan_is_cut_where_its_gear_changes() {
    let plan = three_parts();
    let parts = gear_parts(&plan).unwrap();
    let gears: Vec<_> = parts.iter().map(|part| part.gear).collect();
    assert_eq!(gears, [Gear::Forward, Gear::Reverse, Gear::Forward]);
    for (part, (length_m, curvature)) in parts.iter().zip([(4.0, 0.0), (-5.0, 0.15), (3.0, -0.1)]) {
        let points = &part.trajectory.points;
        assert_eq!(points[0].path_point.unwrap().s_m, 0.0, "arc length restarts");
        let end = points.last().unwrap().path_point.unwrap();
        assert!((end.s_m - length_m).abs() < 1e-3, "{} instead of {length_m}", end.s_m);
        assert!(points.iter().all(|p| p.path_point.unwrap().curvature == curvature), "up to the end");
        let steer = points[0].steer_rad;
        assert!(points.iter().all(|p| p.steer_rad == steer));
        assert!(
            points
                .windows(2)
                .all(|p| part.gear.sign() * (p[1].path_point.unwrap().s_m - p[0].path_point.unwrap().s_m)
                    > 0.0)
        );
        for (i, point) in points.iter().enumerate() {
            let planned = &plan.points[part.first + i];
            assert_eq!((pose_of(point), point.relative_time_s), (pose_of(planned), planned.relative_time_s));
        }
    }
    for pair in parts.windows(2) {
        let (end, start) = (pair[0].trajectory.points.last().unwrap(), pair[1].trajectory.points[0]);
        assert_eq!(pose_of(end), pose_of(&start), "the cusp is shared");
        assert_eq!((end.speed_mps, end.acceleration_mps2), (0.0, 0.0));
    }
    let points: usize = parts.iter().map(|part| part.trajectory.points.len()).sum();
    assert_eq!(points, plan.points.len() + 2);
}

/// Steps of less than a millimetre have no direction to speak of: the sign of the speed says which gear they are in.
#[test]
fn short_steps_and_stands() {
    let gears = |steps: &[(f64, f64)]| {
        let mut x = 0.0;
        let points: Vec<_> = steps
            .iter()
            .enumerate()
            .map(|(i, &(dx, speed_mps))| {
                x += dx;
                DiscretizedPoint {
                    path_point: Some(PathPoint {
                        pose: PlanarPose::new(x, 0.0, 0.0),
                        ..PathPoint::default()
                    }),
                    speed_mps,
                    relative_time_s: i as f64,
                    ..DiscretizedPoint::default()
                }
            })
            .collect();
        let parts = gear_parts(&DiscretizedTrajectory { points }).unwrap();
        parts.iter().map(|part| (part.gear, part.first)).collect::<Vec<_>>()
    };
    // A stand before the motion belongs to it.
    assert_eq!(gears(&[(0.0, 0.0), (0.0, 0.0), (-0.2, -1.0)]), [(Gear::Reverse, 0)]);
    // A short step back is one by its speed; a stand at the change belongs to the motion after it.
    assert_eq!(
        gears(&[(0.0, 0.5), (0.1, 0.0), (0.0, 0.0), (-0.000_3, -0.006), (-0.1, -0.5)]),
        [(Gear::Forward, 0), (Gear::Reverse, 1)]
    );
    // A long step has the direction that it has, whatever the speed says.
    assert_eq!(gears(&[(0.0, -0.5), (0.1, -0.5)]), [(Gear::Forward, 0)]);
    // A stand at the end, and between two motions in one gear.
    assert_eq!(gears(&[(0.0, -0.5), (-0.1, 0.0), (0.0, 0.0)]), [(Gear::Reverse, 0)]);
    assert_eq!(gears(&[(0.0, 0.5), (0.1, 0.0), (0.0, 0.0), (0.1, 0.5)]), [(Gear::Forward, 0)]);
    // Nothing moves.
    assert_eq!(gears(&[(0.0, 0.0), (0.0, 0.0)]), [(Gear::Forward, 0)]);
}

#[test]
fn what_is_no_motion_is_refused() {
    let mut without_pose = three_parts();
    without_pose.points[5].path_point = None;
    let mut single = three_parts();
    single.points.truncate(1);
    for (plan, points) in [(DiscretizedTrajectory::default(), 0), (single, 1), (without_pose, 5)] {
        let error =
            partitioner().follow(&plan, 0.0, &at(PlanarPose::default(), Gear::Forward, 0.0)).unwrap_err();
        assert_eq!(error, PartitionError::TooShort { points });
    }
}

/// The first plan is followed from its first point if the vehicle is there, whatever is due and whatever gear is
/// engaged; so is the first after a restart. Where the vehicle has moved on meanwhile it is put on the first part.
#[test]
fn a_first_plan_is_followed_from_its_beginning() {
    let plan = three_parts();
    let mut partitioner = partitioner();
    for (x, gear, place) in [(0.01, Gear::Reverse, 0), (-0.3, Gear::Forward, 0), (0.31, Gear::Forward, 8)] {
        let vehicle = at(PlanarPose::new(x, 0.0, 0.0), gear, 0.0);
        let followed = partitioner.follow(&plan, 7.0, &vehicle).unwrap();
        assert_eq!((followed.part_index, followed.place, followed.parts), (0, place, 3), "at {x} m");
        partitioner.follow(&plan, 0.0, &at(PlanarPose::new(2.0, 0.0, 0.0), Gear::Forward, 1.0)).unwrap();
        partitioner.restart();
    }
    let away = at(PlanarPose::new(-2.0, 0.1, 0.0), Gear::Forward, 0.0);
    assert_eq!(partitioner.follow(&plan, 0.0, &away), Err(PartitionError::NothingNear { range_m: 2.0 }));
}

/// The vehicle's place has time and arc length 0 in the part and in the plan; the plan's arc length grows in reverse.
#[test]
fn part_and_plan_are_retimed_from_the_vehicles_place() {
    let plan = three_parts();
    let mut partitioner = underway(&plan);
    let parts = gear_parts(&plan).unwrap();
    let cusp = pose_of(&plan.points[parts[1].first]);
    partitioner.follow(&plan, 4.0, &at(cusp, Gear::Forward, 0.0)).unwrap();
    let place = parts[1].first + 20;
    let vehicle = at(pose_of(&plan.points[place]), Gear::Reverse, -1.0);
    let due_s = plan.points[place].relative_time_s;
    let followed = partitioner.follow(&plan, due_s, &vehicle).unwrap();
    assert_eq!((followed.part_index, followed.place), (1, 20));
    let here = followed.part.trajectory.points[20];
    assert_eq!((here.relative_time_s, here.path_point.unwrap().s_m), (0.0, 0.0));
    assert_eq!(followed.part.trajectory.points[21].path_point.unwrap().s_m.signum(), -1.0);
    let here = followed.stitched.points[place];
    assert_eq!((here.relative_time_s, here.path_point.unwrap().s_m), (0.0, 0.0));
    assert_eq!(followed.stitched.points.len(), plan.points.len());
    for (ours, planned) in followed.stitched.points.iter().zip(&plan.points) {
        assert!((planned.relative_time_s - due_s - ours.relative_time_s).abs() < 1e-12);
        assert_eq!(pose_of(ours), pose_of(planned));
    }
}

/// Of points that fit equally well the one that is due, so that a vehicle that has not moved yet is not held for ever
/// at the first of them.
#[test]
fn a_vehicle_that_sets_off_keeps_time() {
    let plan = three_parts();
    let mut partitioner = underway(&plan);
    for (due_s, place) in [(0.0, 0), (0.1, 1), (0.2, 2)] {
        let vehicle = at(PlanarPose::new(0.001, 0.0, 0.0), Gear::Forward, 0.0);
        assert_eq!(partitioner.follow(&plan, due_s, &vehicle).unwrap().place, place, "due {due_s}");
    }
    // At 0.8 s it should be 32 cm ahead; it stands, so time is taken back to where it is.
    let late = partitioner.follow(&plan, 0.8, &at(PlanarPose::default(), Gear::Forward, 0.0)).unwrap();
    assert_eq!(late.place, 2, "the last point within an indistinguishable 2.4 cm");
}

/// What lies behind is not matched, unless it is as good as here.
#[test]
fn the_place_lies_ahead() {
    let plan = three_parts();
    let mut partitioner = underway(&plan);
    // between the points at 1.445 m and 1.62 m
    let x = 1.5;
    let found =
        partitioner.follow(&plan, 1.7, &at(PlanarPose::new(x, 0.0, 0.0), Gear::Forward, 1.7)).unwrap();
    let matched = pose_of(&followed_point(&found));
    assert!(matched.x >= x && matched.x < x + 0.2, "{matched:?}");
}

fn followed_point(followed: &Followed) -> DiscretizedPoint {
    followed.part.trajectory.points[followed.place]
}

/// The vehicle stands at the end of its part if it is within every limit, all of them strict.
#[test]
fn the_next_part_is_taken_up_at_the_end_of_this_one() {
    let plan = three_parts();
    let end = pose_of(&plan.points[gear_parts(&plan).unwrap()[1].first]);
    for (dx, dy, dyaw, speed, gear, next) in [
        (0.0, 0.0, 0.0, 0.0, Gear::Forward, true),
        (-0.19, 0.0, 0.0, 0.0, Gear::Forward, true),
        (0.19, 0.0, 0.0, 0.0, Gear::Forward, true),
        (-0.21, 0.0, 0.0, 0.0, Gear::Forward, false),
        (0.0, 0.15, 0.0, 0.0, Gear::Forward, true),
        // lateral limit 0.5 m, but the overlap is below 0.75 before that
        (0.0, 0.4, 0.0, 0.0, Gear::Forward, false),
        (0.0, 0.0, 0.1, 0.0, Gear::Forward, true),
        (0.0, 0.0, 0.4, 0.0, Gear::Forward, false),
        (0.0, 0.0, 0.0, 0.199, Gear::Forward, true),
        (0.0, 0.0, 0.0, -0.199, Gear::Forward, true),
        (0.0, 0.0, 0.0, 0.2, Gear::Forward, false),
        // in reverse gear already
        (0.0, 0.0, 0.0, 0.0, Gear::Reverse, true),
    ] {
        let mut partitioner = underway(&plan);
        let pose = PlanarPose::new(end.x + dx, end.y + dy, end.yaw + dyaw);
        let followed = partitioner.follow(&plan, 4.0, &at(pose, gear, speed)).unwrap();
        let case = format!("{dx} {dy} {dyaw} {speed} {gear:?}");
        assert_eq!(followed.part_index, usize::from(next), "{case}");
        if next {
            assert_eq!(followed.place, 0, "{case}");
        }
    }
}

#[test]
fn the_overlap_limit_decides_within_wide_limits() {
    let plan = three_parts();
    let end = pose_of(&plan.points[gear_parts(&plan).unwrap()[1].first]);
    let vehicle = at(PlanarPose::new(end.x, end.y + 0.25, end.yaw), Gear::Forward, 0.0);
    // 1.646 m of 2.146 m
    for (limit, next) in [(0.76, true), (0.77, false)] {
        let parameters = PartitionParameters {
            vehicle_box_iou_threshold_to_midpoint: limit,
            ..PartitionParameters::default()
        };
        let mut partitioner = Partitioner { parameters, ..underway(&plan) };
        assert_eq!(
            partitioner.follow(&plan, 4.0, &vehicle).unwrap().part_index,
            usize::from(next),
            "{limit}"
        );
    }
}

#[test]
fn at_the_end_of_the_last_part_it_stays_there() {
    let plan = plan_of(&[(Gear::Forward, 0.0, 2.0)]);
    let mut partitioner = underway(&plan);
    for _ in 0..3 {
        let vehicle = at(PlanarPose::new(1.99, 0.0, 0.0), Gear::Forward, 0.0);
        let followed = partitioner.follow(&plan, 9.0, &vehicle).unwrap();
        assert_eq!((followed.part_index, followed.place), (0, plan.points.len() - 1));
    }
}

/// Two metres ahead, two seconds at rest there to turn the wheels, and two metres on.
fn with_a_stop() -> DiscretizedTrajectory {
    let mut points = motion(PlanarPose::default(), Gear::Forward, 0.0, 2.0, 0.0);
    let stop = points[points.len() - 1];
    let begin_s = stop.relative_time_s;
    let wait = |tenth: u32| DiscretizedPoint {
        speed_mps: 0.0,
        relative_time_s: begin_s + 0.1 * f64::from(tenth),
        ..stop
    };
    points.extend((1..=20).map(wait));
    points.extend(motion(pose_of(&stop), Gear::Forward, 0.0, 2.0, begin_s + 2.0).into_iter().skip(1));
    DiscretizedTrajectory { points }
}

/// A centimetre or a few decides whether the vehicle is before or behind the place where it has to stand; it has to
/// stand all the same.
#[test]
fn a_stop_on_the_way_is_kept_until_it_is_over_wherever_exactly_the_vehicle_stands() {
    let plan = with_a_stop();
    let begin_s = 2.0 * 2.0_f64.sqrt();
    for x in [1.9, 1.96, 2.0, 2.04, 2.1] {
        let mut partitioner = underway(&plan);
        let vehicle = at(PlanarPose::new(x, 0.0, 0.0), Gear::Forward, 0.0);
        for (due_s, place_s) in [(begin_s + 0.35, 0.3), (begin_s + 1.95, 1.9), (begin_s + 2.0 + 1e-9, 2.0)] {
            let followed = partitioner.follow(&plan, due_s, &vehicle).unwrap();
            let found_s = plan.points[followed.place].relative_time_s;
            if place_s < 2.0 {
                assert!((found_s - begin_s - place_s).abs() < 1e-9, "{x} m, {due_s} s: {found_s} s");
            } else {
                assert!(found_s >= begin_s + 2.0 - 1e-9, "{x} m, {due_s} s: {found_s} s");
            }
        }
    }
}

/// A plan that comes in while the vehicle rolls begins where it was: it stands some decimetres beyond the stop when that
/// is due, cycle by cycle, each counting from where the one before has put it.
#[test]
fn a_vehicle_that_stands_beyond_a_stop_goes_on_when_it_is_over() {
    for x in [2.22, 2.3, 2.6] {
        let mut partitioner = underway(&with_a_stop());
        let vehicle = at(PlanarPose::new(x, 0.0, 0.0), Gear::Forward, 0.0);
        let mut followed = partitioner.follow(&with_a_stop(), 2.0, &vehicle).unwrap();
        assert!((pose_of(&followed_point(&followed)).x - 2.0).abs() < 0.03, "first it has to stand");
        let stands_s = (1..100).find(|_| {
            followed = partitioner.follow(&followed.stitched, 0.12, &vehicle).unwrap();
            pose_of(&followed_point(&followed)).x > 2.0 + 1e-9
        });
        assert!((15..25).contains(&stands_s.unwrap_or(0)), "{x} m: {stands_s:?} tenths of a second");
    }
}

#[test]
fn what_may_be_driven_ends_at_the_next_stop() {
    let plan = with_a_stop();
    let part = gear_parts(&plan).unwrap().remove(0);
    let begin_s = 2.0 * 2.0_f64.sqrt();
    let range = |time_s| {
        let range = part.until_stop(time_s);
        let time = |index: usize| part.trajectory.points[index].relative_time_s;
        (time(range.start), time(range.end - 1))
    };
    assert_eq!(range(0.0), (0.0, begin_s));
    let (from_s, until_s) = range(begin_s + 0.95);
    assert!((from_s - begin_s - 1.0).abs() < 1e-9 && (until_s - begin_s - 2.0).abs() < 1e-9);
    let (from_s, until_s) = range(begin_s + 2.05);
    assert!((from_s - begin_s - 2.1).abs() < 1e-9 && (until_s - 2.0 * begin_s - 2.0).abs() < 1e-9);
}

/// Fast past the stop: the vehicle is told to be there, not beyond.
#[test]
fn a_stop_on_the_way_is_not_passed_in_motion() {
    let plan = with_a_stop();
    let vehicle = at(PlanarPose::new(2.3, 0.0, 0.0), Gear::Forward, 0.5);
    let followed = underway(&plan).follow(&plan, 2.9, &vehicle).unwrap();
    assert!((pose_of(&followed_point(&followed)).x - 2.0).abs() < 1e-9);
}

#[test]
fn a_part_shorter_than_the_reach_of_its_end_is_driven() {
    let plan = plan_of(&[(Gear::Forward, 0.0, 2.0), (Gear::Reverse, 0.0, 0.1), (Gear::Forward, 0.0, 1.0)]);
    let mut partitioner = underway(&plan);
    let begin_s = 2.0 * 2.0_f64.sqrt();
    let vehicle = at(PlanarPose::new(2.0, 0.0, 0.0), Gear::Forward, 0.0);
    for (due_s, part) in [(begin_s, 1), (begin_s + 0.3, 1), (begin_s + 0.64, 2)] {
        let followed = partitioner.follow(&plan, due_s, &vehicle).unwrap();
        assert_eq!(followed.part_index, part, "{due_s} s");
    }
}

#[test]
fn the_last_part_is_driven_to_its_end() {
    let plan = plan_of(&[(Gear::Forward, 0.0, 2.0)]);
    let mut partitioner = underway(&plan);
    let end_s = 2.0 * 2.0_f64.sqrt();
    let vehicle = at(PlanarPose::new(1.85, 0.0, 0.0), Gear::Forward, 0.15);
    let last = plan.points.len() - 1;
    assert!(partitioner.follow(&plan, end_s - 0.3, &vehicle).unwrap().place < last);
    assert_eq!(partitioner.follow(&plan, end_s, &vehicle).unwrap().place, last);
}

/// Taken up once: a vehicle that still stands at the cusp keeps time on the next part instead of starting over.
#[test]
fn a_part_is_not_taken_up_twice() {
    let plan = three_parts();
    let mut partitioner = underway(&plan);
    let cusp = gear_parts(&plan).unwrap()[1].first;
    let vehicle = |gear| at(pose_of(&plan.points[cusp]), gear, 0.0);
    let switch = partitioner.follow(&plan, 4.0, &vehicle(Gear::Forward)).unwrap();
    assert_eq!((switch.part_index, switch.place), (1, 0));
    // the gear takes a while to engage, the part's time goes on
    for (due_s, gear, place) in [(0.1, Gear::Forward, 1), (0.12, Gear::Reverse, 1)] {
        let followed = partitioner.follow(&switch.stitched, due_s, &vehicle(gear)).unwrap();
        assert_eq!((followed.part_index, followed.place), (1, place), "due {due_s}");
    }
}

/// Straight to an end, and then by a new plan that takes a run-up to the same end.
#[test]
fn a_new_plan_to_the_same_end_is_driven_from_its_beginning() {
    let straight = plan_of(&[(Gear::Forward, 0.0, 3.0)]);
    let run_up = plan_of(&[(Gear::Reverse, 0.0, 1.0), (Gear::Forward, 0.0, 4.0)]);
    let end = |plan: &DiscretizedTrajectory| pose_of(plan.points.last().unwrap());
    let mut run_up_to_end = run_up.clone();
    *run_up_to_end.points.last_mut().unwrap() = DiscretizedPoint {
        path_point: straight.points.last().unwrap().path_point,
        ..*run_up.points.last().unwrap()
    };
    assert!(end(&straight).distance_m(&end(&run_up)) < 1e-9);
    let mut partitioner = underway(&straight);
    let vehicle = at(PlanarPose::default(), Gear::Forward, 0.0);
    let followed = partitioner.follow(&run_up_to_end, 0.0, &vehicle).unwrap();
    assert_eq!((followed.part_index, followed.part.gear), (0, Gear::Reverse));
}

/// Forward, back and forward again over the same ground: the third part is not taken up before the second is done, and
/// the first never again.
#[test]
fn parts_are_followed_in_their_order() {
    let plan = plan_of(&[(Gear::Forward, 0.0, 4.0), (Gear::Reverse, 0.0, 4.0), (Gear::Forward, 0.0, 4.2)]);
    let parts = gear_parts(&plan).unwrap();
    let mut partitioner = underway(&plan);
    let mut visited = vec![0];
    // From place to place along the plan, just as the vehicle would be found.
    for (i, point) in plan.points.iter().enumerate().skip(1) {
        let index = parts.iter().rposition(|part| part.first < i).unwrap();
        let vehicle = at(pose_of(point), parts[index].gear, point.speed_mps);
        let followed = partitioner.follow(&plan, point.relative_time_s, &vehicle).unwrap();
        if visited.last() != Some(&followed.part_index) {
            visited.push(followed.part_index);
        }
        if followed.part_index == index {
            let off_m = pose_of(&followed_point(&followed)).distance_m(&vehicle.pose);
            assert!(off_m < 0.15, "{off_m} m off at point {i}");
        }
    }
    assert_eq!(visited, [0, 1, 2]);
}

/// A new plan over the same ground: what was left behind is recognised by its end, what is new is found by place.
#[test]
fn a_new_plan_is_matched_by_place() {
    let plan = plan_of(&[(Gear::Forward, 0.0, 4.0), (Gear::Reverse, 0.1, 4.0)]);
    let mut partitioner = underway(&plan);
    let other = plan_of(&[(Gear::Forward, 0.0, 4.5), (Gear::Reverse, 0.1, 4.0)]);
    let vehicle = at(PlanarPose::new(2.0, 0.05, 0.0), Gear::Forward, 1.0);
    let followed = partitioner.follow(&other, 0.0, &vehicle).unwrap();
    assert_eq!(followed.part_index, 0);
    assert!((pose_of(&followed_point(&followed)).x - 2.0).abs() < 0.25);
}

/// The second part is being driven when a new plan comes in that still begins with the first one, over the same ground,
/// and goes on by another: the first is left behind for good.
#[test]
fn a_part_that_was_left_behind_is_not_taken_up_again() {
    let plan = plan_of(&[(Gear::Forward, 0.0, 4.0), (Gear::Reverse, 0.0, 4.0)]);
    let mut partitioner = underway(&plan);
    let cusp = gear_parts(&plan).unwrap()[1].first;
    let standing = at(pose_of(&plan.points[cusp]), Gear::Reverse, 0.0);
    let cusp_s = plan.points[cusp].relative_time_s;
    assert_eq!(partitioner.follow(&plan, cusp_s, &standing).unwrap().part_index, 1);
    let other = plan_of(&[(Gear::Forward, 0.0, 4.0), (Gear::Reverse, 0.02, 4.0)]);
    // Just where the first part would have it, too.
    let vehicle = at(PlanarPose::new(2.0, 0.0, 0.0), Gear::Forward, 0.0);
    let followed = partitioner.follow(&other, 2.0, &vehicle).unwrap();
    assert_eq!((followed.part_index, followed.part.gear), (1, Gear::Reverse));
}

/// Ready to reverse before the vehicle has gone forward: the part that goes back over the same place has to wait.
#[test]
fn a_gear_that_is_not_engaged_yet_skips_no_part() {
    let plan = plan_of(&[(Gear::Forward, 0.0, 4.0), (Gear::Reverse, 0.0, 4.0)]);
    let vehicle = at(PlanarPose::new(1.0, 0.0, 0.0), Gear::Reverse, 0.0);
    assert_eq!(underway(&plan).follow(&plan, 1.4, &vehicle).unwrap().part_index, 0);
}

/// A vehicle that is heading elsewhere is still put on its part; one that is far away is not.
#[test]
fn fail_safe_search() {
    let plan = three_parts();
    let turned = at(PlanarPose::new(2.0, 0.0, 1.2), Gear::Forward, 0.5);
    let followed = underway(&plan).follow(&plan, 2.0, &turned).unwrap();
    assert!((pose_of(&followed_point(&followed)).x - 2.0).abs() < 0.25);
    let away = at(PlanarPose::new(4.0, -2.01, 0.0), Gear::Forward, 0.5);
    let error = underway(&plan).follow(&plan, 2.0, &away).unwrap_err();
    assert!(error.to_string().starts_with("Fail to find nearest trajectory point to follow"), "{error}");
}

#[test]
fn what_is_remembered_is_bounded() {
    let mut partitioner = partitioner();
    for i in 0..200 {
        let plan = plan_of(&[(Gear::Forward, 0.0, 1.0 + f64::from(i) * 1e-6)]);
        partitioner.follow(&plan, 0.0, &at(PlanarPose::default(), Gear::Forward, 0.0)).unwrap();
    }
    assert_eq!(partitioner.followed.len(), REMEMBERED_PARTS);
}

proptest! {
    /// Wherever the vehicle is near its part, its place is one of those that overlap it best, and time and arc length
    /// are 0 there; moving the whole scene changes nothing.
    #[test]
    fn the_place_overlaps_best(
        along in 0.0..4.0_f64, aside in -0.3..0.3_f64, turn in -0.2..0.2_f64, due_s in 0.0..5.0_f64,
        x in -500.0..500.0_f64, y in -500.0..500.0_f64, yaw in -PI..PI,
    ) {
        let moved = |pose: PlanarPose| {
            let (sin, cos) = yaw.sin_cos();
            PlanarPose::new(x + pose.x * cos - pose.y * sin, y + pose.x * sin + pose.y * cos, pose.yaw + yaw)
        };
        let here = three_parts();
        let mut there = three_parts();
        for point in &mut there.points {
            let path_point = point.path_point.as_mut().unwrap();
            path_point.pose = moved(path_point.pose);
        }
        let pose = PlanarPose::new(along, aside, turn);
        let vehicle = at(pose, Gear::Forward, 0.8);
        let found = underway(&here).follow(&here, due_s, &vehicle).unwrap();
        let found_there = underway(&there).follow(&there, due_s, &at(moved(pose), Gear::Forward, 0.8)).unwrap();
        prop_assert_eq!(found.part_index, found_there.part_index);
        let point = followed_point(&found);
        prop_assert_eq!((point.relative_time_s, point.path_point.unwrap().s_m), (0.0, 0.0));
        if found.part_index == 0 {
            let info = VehicleInfo::default();
            let ratio = |p: &DiscretizedPoint| {
                intersection_over_union(&outline(&info, &pose_of(p)), &outline(&info, &pose))
            };
            let ahead = found.part.trajectory.points.iter().filter(|p| {
                let d = pose_of(p);
                let towards = (d.y - pose.y).atan2(d.x - pose.x);
                normalize_radian(towards - turn).abs() < 1.57 && pose.distance_m(&d) < 2.0
            });
            let best = ahead.map(ratio).fold(0.0, f64::max);
            prop_assert!(ratio(&point) >= best - 0.01 - 1e-9, "{} of {best}", ratio(&point));
        }
    }
}
