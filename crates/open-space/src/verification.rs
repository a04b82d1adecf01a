//! The last look at a planned trajectory before it leaves: may this vehicle drive it here?
//!
//! Knows nothing of how the trajectory was made. Looks only at its points, and between them as a vehicle would move:
//! along the screw motion that joins two poses.

use motion::pose::normalize_radian;
use thiserror::Error;

use crate::collision::CollisionChecker;
use crate::pose::PlanarPose;
use crate::problem::Problem;
use crate::tolerance::{END_M, END_RAD, KINEMATICS, LIMIT_ROOM, SWEEP_STEP_M, SWEEP_STEP_RAD};
use crate::trajectory::{Trajectory, TrajectoryPoint};

/// Longest time between points, s.
pub const MAX_INTERVAL_S: f64 = 0.1;
/// Longest distance between points, m.
pub const MAX_SPACING_M: f64 = 0.1;

/// A trajectory in numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Measures {
    /// Distance travelled, positive in both gears, m.
    pub length_m: f64,
    /// How often the gear changes.
    pub gear_changes: usize,
    /// From first to last point, s.
    pub duration_s: f64,
    /// Smallest distance between the footprint and an obstacle at any point, m; infinite without obstacles.
    pub min_clearance_m: f64,
    /// Largest curvature to either side, 1/m.
    pub max_curvature: f64,
    /// Distance of the last point from the goal, m.
    pub end_error_m: f64,
    /// Heading of the last point against the goal's, rad, not negative.
    pub end_error_rad: f64,
}

/// Why a trajectory must not be driven: what is wrong and at which point (counted from 0).
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum Violation {
    /// Fewer than two points.
    #[error("the trajectory has {points} points, but needs two")]
    TooShort {
        /// How many there are.
        points: usize,
    },
    /// Not a number, or infinite.
    #[error("point {index} holds a number that is not finite")]
    NotFinite {
        /// Of the point.
        index: usize,
    },
    /// It does not begin as the vehicle stands or moves.
    #[error(
        "the trajectory begins {distance_m:.4} m, {heading_rad:.4} rad and {speed_mps:.4} m/s off the start"
    )]
    Start {
        /// From the start.
        distance_m: f64,
        /// From the start's.
        heading_rad: f64,
        /// From the start's.
        speed_mps: f64,
    },
    /// It does not end at rest at the goal.
    #[error(
        "the trajectory ends {distance_m:.4} m and {heading_rad:.4} rad off the goal with {speed_mps:.4} m/s"
    )]
    End {
        /// From the goal.
        distance_m: f64,
        /// From the goal's.
        heading_rad: f64,
        /// That is left.
        speed_mps: f64,
    },
    /// Time does not grow, or too much of it passes, or the points are too far apart.
    #[error("point {index} comes {interval_s:.6} s and {spacing_m:.4} m after the one before")]
    Spacing {
        /// Of the later point.
        index: usize,
        /// Time between the two.
        interval_s: f64,
        /// Distance between the two.
        spacing_m: f64,
    },
    /// A limit of the motion is exceeded.
    #[error("{quantity} is {value:.6} at point {index}, but at most {limit:.6} is allowed")]
    Limit {
        /// Of the point.
        index: usize,
        /// Which limit.
        quantity: Quantity,
        /// How much of it.
        value: f64,
        /// How much is allowed.
        limit: f64,
    },
    /// Positions, headings, speeds and steering contradict each other.
    #[error("between point {index} and the next {quantity} is off by {value:.6}")]
    Kinematics {
        /// Of the earlier point.
        index: usize,
        /// Which of them.
        quantity: Quantity,
        /// By how much.
        value: f64,
    },
    /// The gear changes while the vehicle moves.
    #[error("the gear changes at point {index} at {speed_mps:.4} m/s")]
    MovingGearChange {
        /// Of the point.
        index: usize,
        /// There.
        speed_mps: f64,
    },
    /// The vehicle touches an obstacle or leaves the bounds.
    #[error(
        "the vehicle collides or leaves the bounds between point {index} and the next, at ({x:.3}, {y:.3})"
    )]
    Collision {
        /// Of the earlier point.
        index: usize,
        /// Of the earlier point, m.
        x: f64,
        /// Of the earlier point, m.
        y: f64,
    },
}

/// What a [`Violation`] is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// m/s.
    Speed,
    /// m/s².
    Acceleration,
    /// m/s³.
    Jerk,
    /// 1/m.
    Curvature,
    /// rad.
    Steering,
    /// rad/s.
    SteeringRate,
    /// m.
    Travel,
    /// m.
    SidewaysTravel,
    /// rad.
    Heading,
}

impl std::fmt::Display for Quantity {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str(match self {
            Self::Speed => "speed (m/s)",
            Self::Acceleration => "acceleration (m/s²)",
            Self::Jerk => "jerk (m/s³)",
            Self::Curvature => "curvature (1/m)",
            Self::Steering => "steering angle (rad)",
            Self::SteeringRate => "steering rate (rad/s)",
            Self::Travel => "travel (m)",
            Self::SidewaysTravel => "sideways travel (m)",
            Self::Heading => "heading (rad)",
        })
    }
}

/// Checks every promise of a plan: finite numbers, time that grows, start and goal, rest at each cusp and at the end,
/// every limit, motion as a bicycle moves, and no collision of the exact footprint anywhere.
///
/// # Errors
/// The first violation.
pub fn verify(
    trajectory: &Trajectory,
    problem: &Problem,
    checker: &CollisionChecker,
) -> Result<Measures, Violation> {
    let points = &trajectory.points;
    let (Some(first), Some(last), true) = (points.first(), points.last(), points.len() > 1) else {
        return Err(Violation::TooShort { points: points.len() });
    };
    let mut measures = check_ends(first, last, problem)?;
    measures.min_clearance_m = f64::INFINITY;
    for (index, point) in points.iter().enumerate() {
        check_point(index, point, problem)?;
        measures.max_curvature = measures.max_curvature.max(point.curvature.abs());
        measures.min_clearance_m = measures.min_clearance_m.min(checker.clearance_m(&point.pose));
    }
    for (index, pair) in points.windows(2).enumerate() {
        check_step(index, &pair[0], &pair[1], problem)?;
        check_motion(index, &pair[0], &pair[1])?;
        if !motion_is_free(&pair[0].pose, &pair[1].pose, checker, 0.0) {
            let PlanarPose { x, y, .. } = pair[0].pose;
            return Err(Violation::Collision { index, x, y });
        }
        measures.length_m += pair[0].pose.distance_m(&pair[1].pose);
        measures.gear_changes += usize::from(pair[0].gear != pair[1].gear);
    }
    Ok(measures)
}

fn check_ends(
    first: &TrajectoryPoint,
    last: &TrajectoryPoint,
    problem: &Problem,
) -> Result<Measures, Violation> {
    let miss = |pose: &PlanarPose, wanted: &PlanarPose| {
        (pose.distance_m(wanted), normalize_radian(pose.yaw - wanted.yaw).abs())
    };
    let (distance_m, heading_rad) = miss(&first.pose, &problem.start);
    let speed_mps = (first.speed_mps - problem.start_speed_mps).abs();
    // Written so that not-a-number fails.
    if !(distance_m <= END_M && heading_rad <= END_RAD && speed_mps <= END_M) {
        return Err(Violation::Start { distance_m, heading_rad, speed_mps });
    }
    if let Some(curvature) = problem.start_curvature.filter(|_| problem.start_speed_mps != 0.0) {
        let limit = problem.vehicle.max_curvature();
        let steer = |curvature| problem.vehicle.steering_angle_from_curvature(curvature);
        agrees(0, Quantity::Steering, first.steer_rad - steer(curvature.clamp(-limit, limit)))?;
    }
    let (distance_m, heading_rad) = miss(&last.pose, &problem.goal);
    let speed_mps = last.speed_mps;
    if !(distance_m <= END_M && heading_rad <= END_RAD && speed_mps == 0.0) {
        return Err(Violation::End { distance_m, heading_rad, speed_mps });
    }
    let duration_s = last.time_s - first.time_s;
    Ok(Measures { duration_s, end_error_m: distance_m, end_error_rad: heading_rad, ..Measures::default() })
}

fn check_point(index: usize, point: &TrajectoryPoint, problem: &Problem) -> Result<(), Violation> {
    let TrajectoryPoint { time_s, pose, curvature, speed_mps, acceleration_mps2, steer_rad, gear } = *point;
    let numbers = [time_s, pose.x, pose.y, pose.yaw, curvature, speed_mps, acceleration_mps2, steer_rad];
    if !numbers.iter().all(|number| number.is_finite()) {
        return Err(Violation::NotFinite { index });
    }
    let (limits, vehicle) = (&problem.limits, &problem.vehicle);
    let top = if speed_mps >= 0.0 { limits.max_speed_forward_mps } else { limits.max_speed_reverse_mps };
    // The last point of a part bears the gear of the next one, but stands.
    let against = if speed_mps * gear.sign() < 0.0 { 0.0 } else { top };
    within(index, Quantity::Speed, speed_mps.abs(), against)?;
    within(index, Quantity::Acceleration, acceleration_mps2.abs(), limits.max_acceleration_mps2)?;
    within(index, Quantity::Curvature, curvature.abs(), vehicle.max_curvature())?;
    let steer = vehicle.steering_angle_from_curvature(curvature);
    agrees(index, Quantity::Steering, steer - steer_rad)
}

fn check_step(
    index: usize,
    from: &TrajectoryPoint,
    to: &TrajectoryPoint,
    problem: &Problem,
) -> Result<(), Violation> {
    let interval_s = to.time_s - from.time_s;
    let spacing_m = from.pose.distance_m(&to.pose);
    let apart = 1.0 + LIMIT_ROOM;
    if interval_s <= 0.0 || interval_s > MAX_INTERVAL_S * apart || spacing_m > MAX_SPACING_M * apart {
        return Err(Violation::Spacing { index: index + 1, interval_s, spacing_m });
    }
    let limits = &problem.limits;
    let jerk = (to.acceleration_mps2 - from.acceleration_mps2) / interval_s;
    within(index, Quantity::Jerk, jerk.abs(), limits.max_jerk_mps3)?;
    let rate = (to.steer_rad - from.steer_rad) / interval_s;
    within(index, Quantity::SteeringRate, rate.abs(), limits.max_steer_rate_rps)?;
    if from.gear != to.gear && to.speed_mps != 0.0 {
        return Err(Violation::MovingGearChange { index: index + 1, speed_mps: to.speed_mps });
    }
    Ok(())
}

/// Whether speed, acceleration and curvature at two points tell of the way between them.
fn check_motion(index: usize, from: &TrajectoryPoint, to: &TrajectoryPoint) -> Result<(), Violation> {
    let dt = to.time_s - from.time_s;
    let turn = to.pose.yaw - from.pose.yaw;
    let (sin, cos) = (from.pose.yaw + turn / 2.0).sin_cos();
    let (dx, dy) = (to.pose.x - from.pose.x, to.pose.y - from.pose.y);
    let (ahead, aside) = (cos * dx + sin * dy, cos * dy - sin * dx);
    let travel = (from.speed_mps + to.speed_mps) / 2.0 * dt;
    let gain = (from.acceleration_mps2 + to.acceleration_mps2) / 2.0 * dt;
    agrees(index, Quantity::Travel, ahead - travel)?;
    agrees(index, Quantity::SidewaysTravel, aside)?;
    agrees(index, Quantity::Heading, turn - (from.curvature + to.curvature) / 2.0 * ahead)?;
    agrees(index, Quantity::Speed, to.speed_mps - from.speed_mps - gain)
}

/// Whether the vehicle can move from one pose to the next along the screw motion that joins them, with every obstacle
/// further than `inflation_m` away from the area swept.
///
/// In steps so small that the hulls in which the checker encloses them are hardly larger than what is swept.
pub(crate) fn motion_is_free(
    from: &PlanarPose,
    to: &PlanarPose,
    checker: &CollisionChecker,
    inflation_m: f64,
) -> bool {
    let turn = normalize_radian(to.yaw - from.yaw);
    let (sin, cos) = (from.yaw + turn / 2.0).sin_cos();
    let chord = cos * (to.x - from.x) + sin * (to.y - from.y);
    // Sideways motion is not a vehicle's; its chord is checked all the same.
    let aside = cos * (to.y - from.y) - sin * (to.x - from.x);
    let parts = (chord.abs() / SWEEP_STEP_M).max(turn.abs() / SWEEP_STEP_RAD).ceil().max(1.0);
    let at = |k: usize| {
        let ratio = k as f64 / parts;
        // Of the chord to the point at this ratio of the arc, against the whole chord.
        let (sin, cos) = (from.yaw + ratio * turn / 2.0).sin_cos();
        let share = if turn.abs() < 1e-6 { ratio } else { (ratio * turn / 2.0).sin() / (turn / 2.0).sin() };
        let (x, y) = (share * chord, ratio * aside);
        PlanarPose::new(from.x + cos * x - sin * y, from.y + sin * x + cos * y, from.yaw + ratio * turn)
    };
    (0..parts as usize).all(|k| checker.motion_is_free(&at(k), &at(k + 1), inflation_m))
}

fn within(index: usize, quantity: Quantity, value: f64, limit: f64) -> Result<(), Violation> {
    if value <= limit * (1.0 + LIMIT_ROOM) {
        return Ok(());
    }
    Err(Violation::Limit { index, quantity, value, limit })
}

fn agrees(index: usize, quantity: Quantity, off: f64) -> Result<(), Violation> {
    if off.abs() <= KINEMATICS { Ok(()) } else { Err(Violation::Kinematics { index, quantity, value: off }) }
}

#[cfg(test)]
mod tests {
    use motion::Point2;

    use super::*;
    use crate::manoeuvre::manoeuvre;
    use crate::planner::{OpenSpaceParameters, Planner, Unsupervised};
    use crate::pose::Gear;

    fn plan() -> (Problem, Trajectory, Measures) {
        let start = PlanarPose::new(1.0, 2.0, 0.3);
        let (problem, path) = manoeuvre(Gear::Forward, start, &[&[(0.2, 3.0)], &[(-0.2, 2.0), (0.0, 1.0)]]);
        let checker = CollisionChecker::new(&problem).unwrap();
        let planner = Planner::new(OpenSpaceParameters::default());
        let plan = planner.refine(&problem, &checker, &path, &mut Unsupervised).unwrap();
        (problem, plan.trajectory, plan.measures)
    }

    fn judge(problem: &Problem, trajectory: &Trajectory) -> Result<Measures, Violation> {
        verify(trajectory, problem, &CollisionChecker::new(problem).unwrap())
    }

    #[test]
    fn measures_of_a_plan() {
        let (problem, trajectory, measures) = plan();
        assert_eq!(judge(&problem, &trajectory), Ok(measures));
        assert!((measures.length_m - 6.0).abs() < 0.1, "{measures:?}");
        assert_eq!((measures.gear_changes, measures.min_clearance_m), (1, f64::INFINITY));
        assert!(measures.max_curvature > 0.1 && measures.max_curvature < 0.302);
        assert_eq!(measures.duration_s, trajectory.points.last().unwrap().time_s);
        assert!(measures.end_error_m < 1e-9 && measures.end_error_rad < 1e-9);
    }

    #[test]
    fn every_change_for_the_worse_is_found() {
        type Change = fn(&mut Vec<TrajectoryPoint>);
        type Kind = fn(&Violation) -> bool;
        let cases: [(&str, Change, Kind); 16] = [
            ("one point", |p| p.truncate(1), |v| matches!(v, Violation::TooShort { points: 1 })),
            ("no end", |p| p.truncate(p.len() - 10), |v| matches!(v, Violation::End { .. })),
            (
                "rolling end",
                |p| p.last_mut().unwrap().speed_mps = -1e-3,
                |v| matches!(v, Violation::End { .. }),
            ),
            ("no start", |p| drop(p.drain(..10)), |v| matches!(v, Violation::Start { .. })),
            (
                "not a number",
                |p| p[7].steer_rad = f64::NAN,
                |v| matches!(v, Violation::NotFinite { index: 7 }),
            ),
            ("nowhere", |p| p[7].pose.x = f64::INFINITY, |v| matches!(v, Violation::NotFinite { index: 7 })),
            ("no time", |p| p[7].time_s = p[6].time_s, |v| matches!(v, Violation::Spacing { index: 7, .. })),
            ("a gap", |p| drop(p.drain(20..22)), |v| matches!(v, Violation::Spacing { index: 20, .. })),
            (
                "wrong gear",
                |p| p[9].gear = Gear::Reverse,
                |v| matches!(v, Violation::Limit { index: 9, quantity: Quantity::Speed, .. }),
            ),
            (
                "sharp",
                |p| p[9].curvature = -0.31,
                |v| matches!(v, Violation::Limit { index: 9, quantity: Quantity::Curvature, .. }),
            ),
            (
                "steering elsewhere",
                |p| p[9].steer_rad += 0.01,
                |v| matches!(v, Violation::Kinematics { index: 9, quantity: Quantity::Steering, .. }),
            ),
            (
                "a jump forward",
                |p| p[9].pose.x += 0.005,
                |v| matches!(v, Violation::Kinematics { index: 8, quantity: Quantity::Travel, .. }),
            ),
            (
                "a jump aside",
                |p| p[9].pose.y += 0.005,
                |v| matches!(v, Violation::Kinematics { index: 8, .. }),
            ),
            (
                "a turn on the spot",
                |p| p[9].pose.yaw += 0.005,
                |v| matches!(v, Violation::Kinematics { index: 8, .. }),
            ),
            (
                "a kick",
                |p| p[9].acceleration_mps2 += 0.4,
                |v| matches!(v, Violation::Limit { quantity: Quantity::Jerk | Quantity::Acceleration, .. }),
            ),
            (
                "faster than it goes",
                |p| p[9].speed_mps += 0.02,
                |v| {
                    matches!(
                        v,
                        Violation::Kinematics { index: 8, quantity: Quantity::Speed | Quantity::Travel, .. }
                    )
                },
            ),
        ];
        let (problem, trajectory, _) = plan();
        for (name, change, expected) in cases {
            let mut changed = trajectory.clone();
            change(&mut changed.points);
            let violation = judge(&problem, &changed).unwrap_err();
            assert!(expected(&violation), "{name}: {violation:?}");
        }
    }

    #[test]
    fn limits_are_those_of_the_problem() {
        type Change = fn(&mut Problem);
        let cases: [(Quantity, Change); 5] = [
            (Quantity::Speed, |p| p.limits.max_speed_reverse_mps *= 0.3),
            (Quantity::Speed, |p| p.limits.max_speed_forward_mps *= 0.3),
            (Quantity::Acceleration, |p| p.limits.max_acceleration_mps2 *= 0.3),
            (Quantity::Jerk, |p| p.limits.max_jerk_mps3 *= 0.3),
            (Quantity::SteeringRate, |p| p.limits.max_steer_rate_rps *= 0.9),
        ];
        let (problem, trajectory, _) = plan();
        for (wanted, change) in cases {
            let mut changed = problem.clone();
            change(&mut changed);
            let violation = judge(&changed, &trajectory).unwrap_err();
            assert!(
                matches!(violation, Violation::Limit { quantity, .. } if quantity == wanted),
                "{violation:?}"
            );
        }
    }

    #[test]
    fn obstacles_between_two_points_are_found() {
        let (mut problem, trajectory, _) = plan();
        let pose = trajectory.points[30].pose;
        let (sin, cos) = pose.yaw.sin_cos();
        // A needle that the right side only touches.
        let at = |x: f64, y: f64| Point2::new(pose.x + cos * x - sin * y, pose.y + sin * x + cos * y);
        problem.obstacles = vec![vec![at(1.0, -0.947), at(1.0, -3.0)]];
        assert!(matches!(judge(&problem, &trajectory), Err(Violation::Collision { .. })));
        problem.obstacles = vec![vec![at(1.0, -2.5), at(1.0, -3.0)]];
        let measures = judge(&problem, &trajectory).unwrap();
        assert!(measures.min_clearance_m > 0.5 && measures.min_clearance_m < 1.56, "{measures:?}");
        problem.bounds[1] = pose.x;
        assert!(matches!(judge(&problem, &trajectory), Err(Violation::Collision { .. })));
    }

    #[test]
    fn a_gear_change_on_the_move_is_found() {
        let (problem, mut trajectory, _) = plan();
        let cusp = trajectory.points.iter().position(|point| point.gear == Gear::Reverse).unwrap();
        trajectory.points[cusp].speed_mps = -1e-4;
        let violation = judge(&problem, &trajectory).unwrap_err();
        assert!(matches!(violation, Violation::MovingGearChange { .. }), "{violation:?}");
    }
}
