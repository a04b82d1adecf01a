//! The last look ahead before a part is followed: would the vehicle meet a moving obstacle? Then it brakes instead.
//!
//! Plans know the walls; what moves is predicted here, box by box over the next seconds.

use motion::pose::normalize_radian;
use motion::{OrientedBox, Pose, VehicleInfo};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::partition::{Part, outline};
use crate::pose::PlanarPose;
use crate::stitcher::{DiscretizedPoint, DiscretizedTrajectory};
use crate::vehicle_model::VehicleState;

/// Interval of the points of a braking trajectory, s.
const INTERVAL_S: f64 = 0.1;

/// Points at rest that end it, and their interval, s.
const REST_POINTS: u32 = 20;
const REST_INTERVAL_S: f64 = 0.5;

/// Mildest brake, m/s²: there is no reason to creep up to an obstacle.
const MILDEST_BRAKE_MPS2: f64 = 0.5;

/// When to brake for moving obstacles, and how.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct FallbackParameters {
    /// How far ahead obstacles are predicted.
    #[schemars(range(max = 60.0), extend("exclusiveMinimum" = 0.0, "x-unit" = "s"))]
    pub open_space_prediction_time_period: f64,
    /// Interval of the prediction.
    #[schemars(range(min = 0.01, max = 10.0), extend("x-unit" = "s"))]
    pub open_space_prediction_time_interval: f64,
    /// Vehicle and obstacle collide where they are in one place within this time of each other.
    #[schemars(range(max = 60.0), extend("exclusiveMinimum" = 0.0, "x-unit" = "s"))]
    pub open_space_fallback_collision_time_buffer: f64,
    /// Hardest brake.
    #[schemars(range(max = 10.0), extend("exclusiveMinimum" = 0.0, "x-unit" = "m/s2"))]
    pub max_deceleration: f64,
    /// Way left to the place of a collision after braking.
    #[schemars(range(min = 0.0, max = 10.0), extend("x-unit" = "m"))]
    pub stop_distance: f64,
    /// Speed that is braked down to at once, as hard as may be.
    #[schemars(range(max = 10.0), extend("exclusiveMinimum" = 0.0, "x-unit" = "m/s"))]
    pub max_fallback_speed: f64,
}

impl Default for FallbackParameters {
    fn default() -> Self {
        Self {
            open_space_prediction_time_period: 5.0,
            open_space_prediction_time_interval: 0.1,
            open_space_fallback_collision_time_buffer: 10.0,
            max_deceleration: 4.0,
            stop_distance: 1.0,
            max_fallback_speed: 1.0,
        }
    }
}

/// Another road user and where it will be.
#[derive(Clone, Debug, PartialEq)]
pub struct PredictedObstacle {
    /// Length of its outline, m.
    pub length_m: f64,
    /// Width of its outline, m.
    pub width_m: f64,
    /// Poses of the middle of its outline by time from now, s, in order of time. It stands where it is first before
    /// the first of them and where it is last after the last.
    pub path: Vec<(f64, PlanarPose)>,
}

impl PredictedObstacle {
    fn pose_at(&self, time_s: f64) -> Option<PlanarPose> {
        let after = self.path.partition_point(|&(t, _)| t < time_s);
        let (Some(&(t1, to)), Some(&(t0, from))) =
            (self.path.get(after), self.path.get(after.wrapping_sub(1)))
        else {
            return self.path.get(after).or(self.path.last()).map(|&(_, pose)| pose);
        };
        let ratio = (time_s - t0) / (t1 - t0);
        Some(PlanarPose::new(
            from.x + (to.x - from.x) * ratio,
            from.y + (to.y - from.y) * ratio,
            normalize_radian(from.yaw + from.yaw_to(&to) * ratio),
        ))
    }

    fn box_at(&self, time_s: f64) -> Option<OrientedBox> {
        let pose = self.pose_at(time_s)?;
        let (half_length_m, half_width_m) = (self.length_m * 0.5, self.width_m * 0.5);
        let at = Pose::from_xy_yaw(pose.x, pose.y, pose.yaw);
        Some(OrientedBox::around(&at, half_length_m, half_length_m, half_width_m, half_width_m))
    }
}

/// Where a part would meet an obstacle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PredictedCollision {
    /// Index of the first point of the part at which the vehicle touches it.
    pub point: usize,
    /// Index of the obstacle.
    pub obstacle: usize,
    /// When the obstacle is there, s from now.
    pub obstacle_time_s: f64,
}

/// What to drive.
#[derive(Clone, Debug, PartialEq)]
pub enum Decision {
    /// Nothing is in the way: the part as it is.
    Clear,
    /// The vehicle brakes along the part; times from now, arc length from where it is.
    Brake {
        /// What for.
        collision: PredictedCollision,
        /// The braking trajectory.
        trajectory: DiscretizedTrajectory,
    },
}

/// Decides whether a part can be driven, given with its times from now, by a vehicle that is where the part is at
/// time 0.
#[must_use]
pub fn decide(
    parameters: &FallbackParameters,
    vehicle_info: &VehicleInfo,
    part: &Part,
    vehicle: &VehicleState,
    obstacles: &[PredictedObstacle],
) -> Decision {
    match first_collision(parameters, vehicle_info, &part.trajectory, obstacles) {
        None => Decision::Clear,
        Some(collision) => {
            Decision::Brake { collision, trajectory: brake(parameters, part, vehicle, collision.point) }
        }
    }
}

/// The first point from now on at which the vehicle would touch an obstacle; where it is now is past deciding.
fn first_collision(
    parameters: &FallbackParameters,
    vehicle_info: &VehicleInfo,
    trajectory: &DiscretizedTrajectory,
    obstacles: &[PredictedObstacle],
) -> Option<PredictedCollision> {
    let boxes = predicted_boxes(parameters, obstacles);
    let ahead = trajectory.points.iter().enumerate().filter(|(_, point)| point.relative_time_s > 0.0);
    for (point, ahead) in ahead {
        let ego = outline(vehicle_info, &ahead.path_point?.pose);
        let met = boxes.iter().find(|(_, time_s, other)| {
            (ahead.relative_time_s - time_s).abs() < parameters.open_space_fallback_collision_time_buffer
                && ego.overlaps(other)
        });
        if let Some(&(obstacle, obstacle_time_s, _)) = met {
            return Some(PredictedCollision { point, obstacle, obstacle_time_s });
        }
    }
    None
}

fn predicted_boxes(
    parameters: &FallbackParameters,
    obstacles: &[PredictedObstacle],
) -> Vec<(usize, f64, OrientedBox)> {
    let interval_s = parameters.open_space_prediction_time_interval;
    let mut boxes = Vec::new();
    for (index, obstacle) in obstacles.iter().enumerate() {
        let mut step = 0.0;
        while step * interval_s <= parameters.open_space_prediction_time_period {
            boxes.extend(obstacle.box_at(step * interval_s).map(|b| (index, step * interval_s, b)));
            step += 1.0;
        }
    }
    boxes
}

/// Braking along a part from where the vehicle is, to rest before the point of a collision if that can be done.
fn brake(
    parameters: &FallbackParameters,
    part: &Part,
    vehicle: &VehicleState,
    collision_point: usize,
) -> DiscretizedTrajectory {
    let sign = part.gear.sign();
    let travelled_m =
        |point: &DiscretizedPoint| point.path_point.map_or(0.0, |path_point| sign * path_point.s_m);
    let points = &part.trajectory.points;
    let start_m = part.trajectory.evaluate(0.0).as_ref().map_or(0.0, travelled_m);
    let way_m = (travelled_m(&points[collision_point]) - start_m - parameters.stop_distance).max(0.0);
    let mut braking = DiscretizedTrajectory::default();
    // A vehicle that rolls against the part's gear has to stand first, too.
    let (mut speed_mps, mut done_m, mut time_s) = ((sign * vehicle.speed_mps).max(0.0), 0.0, 0.0);
    while speed_mps > 0.0 {
        let hardest = parameters.max_deceleration;
        let left_m = way_m - done_m;
        let needed = if left_m > 0.0 { speed_mps * speed_mps / (2.0 * left_m) } else { hardest };
        let brake_mps2 = if speed_mps > parameters.max_fallback_speed {
            hardest
        } else {
            needed.clamp(MILDEST_BRAKE_MPS2.min(hardest), hardest)
        };
        braking.points.push(point_at(part, start_m + done_m, sign * speed_mps, -sign * brake_mps2, time_s));
        let step_s = INTERVAL_S.min(speed_mps / brake_mps2);
        done_m += speed_mps * step_s - 0.5 * brake_mps2 * step_s * step_s;
        speed_mps = if step_s < INTERVAL_S { 0.0 } else { (speed_mps - brake_mps2 * step_s).max(0.0) };
        time_s += step_s;
    }
    for rest in 0..REST_POINTS {
        let later_s = time_s + f64::from(rest) * REST_INTERVAL_S;
        braking.points.push(point_at(part, start_m + done_m, 0.0, 0.0, later_s));
    }
    for point in &mut braking.points {
        if let Some(path_point) = &mut point.path_point {
            path_point.s_m -= sign * start_m;
        }
    }
    braking
}

/// The part's point after `travelled_m` metres, with another motion.
fn point_at(
    part: &Part,
    travelled_m: f64,
    speed_mps: f64,
    acceleration_mps2: f64,
    time_s: f64,
) -> DiscretizedPoint {
    let sign = part.gear.sign();
    let points = &part.trajectory.points;
    let after = points
        .partition_point(|point| {
            point.path_point.is_some_and(|path_point| sign * path_point.s_m < travelled_m)
        })
        .clamp(1, points.len() - 1);
    let (from, to) = (points[after - 1], points[after]);
    let s = |point: &DiscretizedPoint| sign * point.path_point.unwrap_or_default().s_m;
    let step_m = s(&to) - s(&from);
    let ratio = if step_m > 0.0 { ((travelled_m - s(&from)) / step_m).clamp(0.0, 1.0) } else { 1.0 };
    let pair = DiscretizedTrajectory {
        points: vec![
            DiscretizedPoint { relative_time_s: 0.0, ..from },
            DiscretizedPoint { relative_time_s: 1.0, ..to },
        ],
    };
    let place = pair.evaluate(ratio).unwrap_or(to);
    DiscretizedPoint { speed_mps, acceleration_mps2, jerk_mps3: 0.0, relative_time_s: time_s, ..place }
}

#[cfg(test)]
mod tests {
    use motion::pose::normalize_radian as norm;
    use proptest::prelude::*;

    use super::*;
    use crate::partition::gear_parts;
    use crate::pose::Gear;
    use crate::stitcher::PathPoint;

    /// Ten metres along a circle of 20 m radius (or a line), a point every tenth of a second, 1 m/s.
    fn part(gear: Gear, curvature: f64) -> Part {
        let sign = gear.sign();
        let point = |i: i32| {
            let s = f64::from(i) * 0.1;
            let yaw = sign * s * curvature;
            let (x, y) = if curvature == 0.0 {
                (sign * s, 0.0)
            } else {
                (yaw.sin() / curvature, (1.0 - yaw.cos()) / curvature)
            };
            DiscretizedPoint {
                path_point: Some(PathPoint {
                    pose: PlanarPose::new(x, y, norm(yaw)),
                    curvature,
                    s_m: s,
                    ..PathPoint::default()
                }),
                speed_mps: sign,
                relative_time_s: s,
                ..DiscretizedPoint::default()
            }
        };
        let plan = DiscretizedTrajectory { points: (0..=100).map(point).collect() };
        gear_parts(&plan).unwrap().remove(0)
    }

    fn driving(gear: Gear, speed_mps: f64) -> VehicleState {
        let standing = VehicleState::standing_at(PlanarPose::default());
        VehicleState { speed_mps: gear.sign() * speed_mps, gear, ..standing }
    }

    fn standing(x: f64, y: f64) -> PredictedObstacle {
        PredictedObstacle { length_m: 1.0, width_m: 1.0, path: vec![(0.0, PlanarPose::new(x, y, 0.0))] }
    }

    fn decision(part: &Part, vehicle: &VehicleState, obstacles: &[PredictedObstacle]) -> Decision {
        decide(&FallbackParameters::default(), &VehicleInfo::default(), part, vehicle, obstacles)
    }

    #[test]
    fn an_obstacle_is_between_its_poses_in_proportion_to_time() {
        let at = |x: f64, y: f64, yaw: f64| PlanarPose::new(x, y, yaw);
        let path = vec![(1.0, at(2.0, -3.0, 3.0)), (3.0, at(6.0, -4.0, -3.0)), (4.0, at(6.0, 0.0, -3.0))];
        let obstacle = PredictedObstacle { length_m: 4.0, width_m: 2.0, path };
        let half_turn = 0.25 * (std::f64::consts::TAU - 6.0);
        for (time_s, pose) in [
            (0.0, at(2.0, -3.0, 3.0)),
            (1.0, at(2.0, -3.0, 3.0)),
            (1.5, at(3.0, -3.25, 3.0 + half_turn)),
            (3.0, at(6.0, -4.0, -3.0)),
            (3.75, at(6.0, -1.0, -3.0)),
            (9.0, at(6.0, 0.0, -3.0)),
        ] {
            let found = obstacle.pose_at(time_s).unwrap();
            assert!(
                found.distance_m(&pose) < 1e-12 && found.yaw_to(&pose).abs() < 1e-12,
                "{time_s}: {found:?}"
            );
        }
    }

    #[test]
    fn nothing_in_the_way() {
        let part = part(Gear::Forward, 0.0);
        let vehicle = driving(Gear::Forward, 1.0);
        assert_eq!(decision(&part, &vehicle, &[]), Decision::Clear);
        // beside the road, and beyond where the vehicle comes to rest (its front is 3.79 m ahead of its rear axle)
        assert_eq!(decision(&part, &vehicle, &[standing(5.0, 1.5), standing(14.3, 0.0)]), Decision::Clear);
    }

    /// The vehicle's front reaches the obstacle at 6.5 m when its axle is at 2.71 m: at the point at 2.8 m.
    #[test]
    fn brakes_to_rest_a_metre_before_an_obstacle() {
        let part = part(Gear::Forward, 0.0);
        let Decision::Brake { collision, trajectory } =
            decision(&part, &driving(Gear::Forward, 1.0), &[standing(7.0, 0.0)])
        else {
            panic!("the obstacle was overlooked")
        };
        assert_eq!((collision.point, collision.obstacle), (28, 0));
        let end = trajectory.points.last().unwrap();
        assert_eq!(end.speed_mps, 0.0);
        let x = end.path_point.unwrap().pose.x;
        // half a metre a second squared stops within a metre, well before 1.8 m
        assert!((x - 1.0).abs() < 1e-9, "{x}");
    }

    #[test]
    fn brakes_as_hard_as_needed_and_no_harder_than_may_be() {
        let part = part(Gear::Forward, 0.0);
        for (obstacle_x, speed, hardest, rest_x) in [
            // collision at 1.3 m, rest wanted at 0.3 m
            (5.5, 1.0, 1.0 / 0.6, 0.3),
            // collision at 0.3 m: cannot stop in time, brakes with 4 m/s² over 0.125 m
            (4.5, 1.0, 4.0, 0.125),
            // 2 m/s: hard below 1 m/s in three steps over 0.42 m, then gently from 0.8 m/s
            (9.0, 2.0, 4.0, 0.42 + 0.64),
        ] {
            let Decision::Brake { trajectory, .. } =
                decision(&part, &driving(Gear::Forward, speed), &[standing(obstacle_x, 0.0)])
            else {
                panic!("the obstacle was overlooked")
            };
            let hardest_found =
                trajectory.points.iter().map(|point| -point.acceleration_mps2).fold(0.0, f64::max);
            assert!((hardest_found - hardest).abs() < 1e-6, "{hardest_found} instead of {hardest}");
            let x = trajectory.points.last().unwrap().path_point.unwrap().pose.x;
            assert!((x - rest_x).abs() < 0.05, "rests at {x} instead of {rest_x}");
        }
    }

    /// What the vehicle touches already it cannot avoid by braking; what it will touch next it can.
    #[test]
    fn where_the_vehicle_is_now_does_not_count() {
        let mut part = part(Gear::Forward, 0.0);
        part.trajectory.points.truncate(1);
        let there = [standing(3.0, 0.0)];
        assert_eq!(decision(&part, &driving(Gear::Forward, 0.0), &there), Decision::Clear);
    }

    #[test]
    fn an_obstacle_counts_for_ten_seconds_around_its_time() {
        // A point at 9.9 s and an obstacle that leaves after a tenth of a second.
        let part = part(Gear::Forward, 0.0);
        let leaves = PredictedObstacle {
            path: vec![
                (0.0, PlanarPose::new(14.0, 0.0, 0.0)),
                (0.05, PlanarPose::new(14.0, 0.0, 0.0)),
                (0.06, PlanarPose::new(14.0, 50.0, 0.0)),
            ],
            ..standing(0.0, 0.0)
        };
        let with_buffer = |buffer_s: f64| {
            let parameters = FallbackParameters {
                open_space_fallback_collision_time_buffer: buffer_s,
                ..FallbackParameters::default()
            };
            let vehicle = driving(Gear::Forward, 1.0);
            decide(&parameters, &VehicleInfo::default(), &part, &vehicle, std::slice::from_ref(&leaves))
        };
        // The axle is at 9.8 m when the front is at 13.59 m and touches the obstacle's back at 13.5 m.
        assert!(matches!(with_buffer(9.9), Decision::Brake { .. }));
        assert_eq!(with_buffer(9.0), Decision::Clear);
    }

    #[test]
    fn an_obstacle_that_moves_into_the_way_is_seen_coming() {
        let part = part(Gear::Forward, 0.0);
        let crossing = PredictedObstacle {
            path: vec![(0.0, PlanarPose::new(8.0, -6.0, 0.0)), (4.0, PlanarPose::new(8.0, 2.0, 0.0))],
            ..standing(0.0, 0.0)
        };
        let Decision::Brake { collision, .. } = decision(&part, &driving(Gear::Forward, 1.0), &[crossing])
        else {
            panic!("overlooked")
        };
        // It enters the vehicle's lane (half a width each: 1.448 m) after 2.276 s.
        assert!((collision.obstacle_time_s - 2.3).abs() < 1e-9, "{collision:?}");
    }

    proptest! {
        /// Braking follows the part in its gear: speed falls to rest, positions stay on the path, times grow.
        #[test]
        fn a_braking_trajectory_is_drivable(
            gear in prop_oneof![Just(Gear::Forward), Just(Gear::Reverse)],
            curvature in prop_oneof![Just(0.0), Just(0.05), Just(-0.05)],
            speed in 0.0..2.0_f64, collision_point in 1_usize..100,
        ) {
            let part = part(gear, curvature);
            let sign = gear.sign();
            let trajectory =
                brake(&FallbackParameters::default(), &part, &driving(gear, speed), collision_point);
            prop_assert!(trajectory.points.len() >= 20 && trajectory.points.len() < 100);
            for pair in trajectory.points.windows(2) {
                prop_assert!(pair[0].relative_time_s < pair[1].relative_time_s);
                prop_assert!(sign * pair[1].speed_mps <= sign * pair[0].speed_mps + 1e-12);
                let (a, b) = (pair[0].path_point.unwrap(), pair[1].path_point.unwrap());
                prop_assert!(sign * (b.s_m - a.s_m) >= -1e-12);
                let moved_m = a.pose.distance_m(&b.pose);
                prop_assert!((moved_m - (b.s_m - a.s_m).abs()).abs() < 1e-3, "{moved_m} m");
            }
            let end = trajectory.points.last().unwrap().path_point.unwrap();
            if curvature != 0.0 {
                let off_m = (end.pose.x.hypot(end.pose.y - 1.0 / curvature) - (1.0 / curvature).abs()).abs();
                prop_assert!(off_m < 1e-3, "{off_m} m off the circle");
            }
            // It stops before the obstacle wherever four metres a second squared can.
            let way_m = f64::from(u32::try_from(collision_point).unwrap()) * 0.1;
            if speed * speed / 8.0 < way_m - 1.1 {
                prop_assert!(end.s_m.abs() <= way_m - 1.0 + 0.02, "{} of {way_m}", end.s_m);
            }
        }
    }
}
