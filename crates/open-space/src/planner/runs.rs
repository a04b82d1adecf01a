//! From paths to a trajectory: runs from rest to rest, joined by pauses in which the front wheels turn.

use motion::VehicleInfo;

use crate::hybrid_a_star::GearPart;
use crate::interruption::Patience;
use crate::path_profile::PathProfile;
use crate::pose::{Gear, PlanarPose};
use crate::problem::{Limits, Problem};
use crate::speed::{
    SpeedCap, SpeedError, SpeedLimits, SpeedParameters, SpeedProfile, SpeedState, plan_speed, rest_to_rest,
};
use crate::trajectory::{Trajectory, TrajectoryPoint};
use crate::verification::{MAX_INTERVAL_S, MAX_SPACING_M};

/// Part of the limit of the steering rate that is made use of: caps are held at instants, not between them.
const STEER_RATE_ROOM: f64 = 0.99;
/// Part of the longest interval and spacing of points that is made use of, so that rounding never exceeds them.
const SAMPLING_ROOM: f64 = 0.95;
/// Points of a run closer than this in time become one, s.
const SHORTEST_INTERVAL_S: f64 = 1e-3;
/// Front wheels this close (rad) are where they should be.
const STEERED_RAD: f64 = 1e-9;
/// Curvatures this close (1/m) are those of one arc.
const SAME_CURVATURE: f64 = 1e-9;
/// Arcs shorter than this (m) are nothing to drive.
const SHORTEST_ARC_M: f64 = 1e-7;

/// How the speed of a run is found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Timing {
    /// At once: never faster than the slowest place of the run allows.
    Quick,
    /// By quadratic programs.
    Planned,
}

/// A path driven from rest, or from a rolling start, to rest.
#[derive(Clone, Debug)]
pub(super) struct Run {
    path: PathProfile,
    profile: SpeedProfile,
}

impl Run {
    /// Times `path` for a vehicle that begins it with `start`, along the travel.
    pub(super) fn new(
        path: PathProfile,
        start: SpeedState,
        problem: &Problem,
        parameters: &SpeedParameters,
        timing: Timing,
        patience: &mut dyn Patience,
    ) -> Result<Self, SpeedError> {
        let limits = limits_in(path.gear(), &problem.limits);
        let steer_rate_rps = STEER_RATE_ROOM * problem.limits.max_steer_rate_rps;
        let caps = path.steering_caps(problem.vehicle.wheel_base_m(), steer_rate_rps, limits.max_speed_mps);
        let cap = SpeedCap::new(path.step_m(), caps, &limits);
        let profile = if timing == Timing::Quick && start.speed_mps == 0.0 {
            rest_to_rest(cap.length_m(), &SpeedLimits { max_speed_mps: cap.lowest_mps(), ..limits })
        } else {
            plan_speed(&cap, start, &limits, parameters, patience)?
        };
        Ok(Self { path, profile })
    }
}

fn limits_in(gear: Gear, limits: &Limits) -> SpeedLimits {
    SpeedLimits {
        max_speed_mps: match gear {
            Gear::Forward => limits.max_speed_forward_mps,
            Gear::Reverse => limits.max_speed_reverse_mps,
        },
        max_acceleration_mps2: limits.max_acceleration_mps2,
        max_jerk_mps3: limits.max_jerk_mps3,
    }
}

/// The arcs of `part` as paths of their own: a vehicle that stops wherever the curvature jumps can drive them as they
/// are.
pub(super) fn arcs_of(part: &GearPart) -> Vec<PathProfile> {
    let mut paths = Vec::new();
    let mut begin = 0;
    while begin < part.arcs.len() {
        let curvature = part.arcs[begin].curvature;
        let same = |k: &usize| (part.arcs[*k].curvature - curvature).abs() <= SAME_CURVATURE;
        let end = (begin..part.arcs.len()).take_while(same).last().map_or(begin + 1, |last| last + 1);
        let length_m = part.arcs[begin..end].iter().map(|arc| arc.length_m.abs()).sum::<f64>();
        if length_m > SHORTEST_ARC_M {
            paths.push(PathProfile::arc(part.gear, part.poses[begin], curvature, length_m, part.poses[end]));
        }
        begin = end;
    }
    paths
}

/// Joins runs, each beginning where the one before ends: between two of them the vehicle stands until its front wheels
/// are where the next one begins.
pub(super) fn join(runs: &[Run], problem: &Problem) -> Trajectory {
    if runs.is_empty() {
        return stay(problem.start);
    }
    let mut points = Vec::new();
    let mut begin_s = 0.0;
    for (k, run) in runs.iter().enumerate() {
        add_run(&mut points, run, begin_s, &problem.vehicle);
        begin_s += run.profile.duration_s();
        if let (Some(next), Some(cusp)) = (runs.get(k + 1), points.last_mut()) {
            cusp.gear = next.path.gear();
            let steer_rad = problem.vehicle.steering_angle_from_curvature(next.path.curvatures()[0]);
            begin_s += add_pause(&mut points, steer_rad, problem);
            // The next run begins with this very point.
            points.pop();
        }
    }
    Trajectory { points }
}

/// Standing where the vehicle stands.
fn stay(pose: PlanarPose) -> Trajectory {
    let point = |time_s| TrajectoryPoint {
        time_s,
        pose,
        curvature: 0.0,
        speed_mps: 0.0,
        acceleration_mps2: 0.0,
        steer_rad: 0.0,
        gear: Gear::Forward,
    };
    Trajectory { points: vec![point(0.0), point(MAX_INTERVAL_S)] }
}

fn add_run(points: &mut Vec<TrajectoryPoint>, run: &Run, begin_s: f64, vehicle: &VehicleInfo) {
    let gear = run.path.gear();
    let sign = gear.sign();
    let first = points.len();
    let top_mps = run.profile.top_speed_mps();
    let longest_s = SAMPLING_ROOM * MAX_INTERVAL_S.min(MAX_SPACING_M / top_mps);
    let end_s = run.profile.duration_s();
    for (time_s, state) in run.profile.samples(longest_s) {
        let (pose, curvature) = run.path.at(state.position_m);
        let point = TrajectoryPoint {
            time_s: begin_s + time_s,
            pose,
            curvature,
            // Adding zero turns minus zero into zero.
            speed_mps: sign * state.speed_mps + 0.0,
            acceleration_mps2: sign * state.acceleration_mps2 + 0.0,
            steer_rad: vehicle.steering_angle_from_curvature(curvature),
            gear,
        };
        match points.get(first..).and_then(<[_]>::last) {
            Some(last) if point.time_s - last.time_s < SHORTEST_INTERVAL_S => {
                if time_s < end_s {
                    continue;
                }
                if points.len() > first + 1 {
                    points.pop();
                }
            }
            _ => {}
        }
        points.push(point);
    }
}

/// Turns the front wheels of a vehicle that stands at the last of `points` to `steer_rad`; returns how long that takes,
/// s. The last point is the one with which the vehicle may go on.
fn add_pause(points: &mut Vec<TrajectoryPoint>, steer_rad: f64, problem: &Problem) -> f64 {
    let Some(cusp) = points.last().copied() else { return 0.0 };
    let turn = steer_rad - cusp.steer_rad;
    if turn.abs() < STEERED_RAD {
        return 0.0;
    }
    let rate_rps = STEER_RATE_ROOM * problem.limits.max_steer_rate_rps;
    let duration_s = (turn.abs() / rate_rps).max(SHORTEST_INTERVAL_S);
    let parts = (duration_s / (SAMPLING_ROOM * MAX_INTERVAL_S)).ceil();
    for k in 1..=parts as usize {
        let ratio = k as f64 / parts;
        let steer_rad = cusp.steer_rad + ratio * turn;
        points.push(TrajectoryPoint {
            time_s: cusp.time_s + ratio * duration_s,
            steer_rad,
            curvature: problem.vehicle.curvature_from_steering_angle(steer_rad),
            ..cusp
        });
    }
    duration_s
}
