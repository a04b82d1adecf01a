//! A vehicle that is not quite what the planner thinks: delayed and lagging actuators, a gear lever that takes its time,
//! noisy sensors. And the controller that drives it along what the stage says.

use std::collections::VecDeque;

use motion::VehicleInfo;
use open_space::stage::Command;
use open_space::stitcher::{DiscretizedPoint, DiscretizedTrajectory};
use open_space::vehicle_model::VehicleState;
use open_space::{Gear, PlanarPose};

use crate::random::Random;

/// Step of the simulation and of the controller, s.
pub(crate) const TICK_S: f64 = 0.01;

const GEAR_CHANGE_S: f64 = 0.4;
const SPEED_LAG_S: f64 = 0.15;
const STEER_LAG_S: f64 = 0.08;
const MAX_STEER_RATE_RPS: f64 = 0.7;

/// How far from perfect a vehicle is.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Imperfection {
    /// From command to actuator, ticks.
    pub delay_ticks: usize,
    /// Standard deviation of a measured position, m.
    pub position_m: f64,
    /// Standard deviation of a measured heading, rad.
    pub yaw_rad: f64,
    /// Standard deviation of a measured speed, m/s.
    pub speed_mps: f64,
}

/// The vehicle.
pub(crate) struct Vehicle {
    info: VehicleInfo,
    imperfection: Imperfection,
    pub pose: PlanarPose,
    pub speed_mps: f64,
    acceleration_mps2: f64,
    steer_rad: f64,
    pub gear: Gear,
    gear_change_left_s: f64,
    /// Commands on their way: speed and steering.
    pipeline: VecDeque<(f64, f64, Gear)>,
}

impl Vehicle {
    pub(crate) fn standing(info: VehicleInfo, pose: PlanarPose, imperfection: Imperfection) -> Self {
        let pipeline = VecDeque::from(vec![(0.0, 0.0, Gear::Forward); imperfection.delay_ticks]);
        Self {
            info,
            imperfection,
            pose,
            speed_mps: 0.0,
            acceleration_mps2: 0.0,
            steer_rad: 0.0,
            gear: Gear::Forward,
            gear_change_left_s: 0.0,
            pipeline,
        }
    }

    /// What its sensors say.
    pub(crate) fn measured(&self, random: &mut Random) -> VehicleState {
        let noise = &self.imperfection;
        let pose = PlanarPose::new(
            self.pose.x + noise.position_m * random.normal(),
            self.pose.y + noise.position_m * random.normal(),
            self.pose.yaw + noise.yaw_rad * random.normal(),
        );
        VehicleState {
            pose,
            z: 0.0,
            curvature: self.info.curvature_from_steering_angle(self.steer_rad),
            speed_mps: self.speed_mps + noise.speed_mps * random.normal(),
            acceleration_mps2: self.acceleration_mps2,
            gear: self.gear,
            automatic: true,
        }
    }

    /// One tick under a command.
    pub(crate) fn advance(&mut self, speed_mps: f64, steer_rad: f64, gear: Gear) {
        self.pipeline.push_back((speed_mps, steer_rad, gear));
        let Some((speed_mps, steer_rad, gear)) = self.pipeline.pop_front() else { return };
        let wanted_mps = self.shift(gear, speed_mps);
        let limit = self.info.dimensions().max_steer_angle_rad;
        let steer_rate = ((steer_rad.clamp(-limit, limit) - self.steer_rad) / STEER_LAG_S)
            .clamp(-MAX_STEER_RATE_RPS, MAX_STEER_RATE_RPS);
        self.acceleration_mps2 = ((wanted_mps - self.speed_mps) / SPEED_LAG_S).clamp(-5.0, 5.0);
        let before_mps = self.speed_mps;
        self.speed_mps += self.acceleration_mps2 * TICK_S;
        self.steer_rad += steer_rate * TICK_S;
        let way_m = 0.5 * (before_mps + self.speed_mps) * TICK_S;
        let turn = way_m * self.info.curvature_from_steering_angle(self.steer_rad);
        let middle = self.pose.yaw + 0.5 * turn;
        self.pose.x += way_m * middle.cos();
        self.pose.y += way_m * middle.sin();
        self.pose.yaw += turn;
    }

    /// The gear changes while the vehicle stands, and no other gear is driven in.
    fn shift(&mut self, gear: Gear, speed_mps: f64) -> f64 {
        if gear != self.gear && self.gear_change_left_s <= 0.0 {
            self.gear_change_left_s = GEAR_CHANGE_S;
        }
        if gear == self.gear {
            self.gear_change_left_s = 0.0;
        } else if self.speed_mps.abs() < 0.02 {
            self.gear_change_left_s -= TICK_S;
            if self.gear_change_left_s <= 0.0 {
                self.gear = gear;
            }
        }
        let drivable = if gear == self.gear { speed_mps * self.gear.sign() } else { 0.0 };
        drivable.max(0.0) * self.gear.sign()
    }
}

/// Follows the newest command between cycles.
pub(crate) struct Controller {
    info: VehicleInfo,
    preview_s: f64,
    command: Option<(f64, DiscretizedTrajectory, Option<Gear>)>,
}

impl Controller {
    /// `preview_s`: how far ahead the controller looks, to make up for delay and lag.
    pub(crate) fn new(info: VehicleInfo, preview_s: f64) -> Self {
        Self { info, preview_s, command: None }
    }

    pub(crate) fn take(&mut self, now_s: f64, command: &Command) {
        self.command = match command {
            Command::Stop(stop) => stop.clone().map(|stop| (now_s, stop, None)),
            Command::Follow(part) => Some((now_s, part.trajectory.clone(), Some(part.gear))),
            Command::Brake { trajectory, gear, .. } => Some((now_s, trajectory.clone(), Some(*gear))),
        };
    }

    /// Speed, steering and gear for a vehicle that is (nearly) at `state`.
    pub(crate) fn control(&self, now_s: f64, state: &VehicleState) -> (f64, f64, Gear) {
        let Some((header_s, trajectory, gear)) = &self.command else { return (0.0, 0.0, state.gear) };
        let Some(gear) = *gear else { return (0.0, 0.0, state.gear) };
        let time_s = now_s - header_s;
        let (Some(here), Some(soon)) =
            (trajectory.evaluate(time_s), trajectory.evaluate(time_s + self.preview_s))
        else {
            return (0.0, 0.0, state.gear);
        };
        let (along_m, left_m, yaw_rad) = errors(&here, &state.pose);
        let sign = gear.sign();
        let ahead = soon.path_point.unwrap_or_default();
        // Behind in the sense of travel means faster; a finished part is held.
        let speed_mps = soon.speed_mps + 1.2 * -along_m;
        let correction = -1.2 * left_m - sign * 2.2 * yaw_rad;
        let steer_rad = self.info.steering_angle_from_curvature(ahead.curvature + correction);
        (speed_mps, steer_rad, gear)
    }
}

/// Of a pose against a point: ahead, to the left, turned left.
fn errors(point: &DiscretizedPoint, pose: &PlanarPose) -> (f64, f64, f64) {
    let at = point.path_point.unwrap_or_default().pose;
    let (sin, cos) = at.yaw.sin_cos();
    let (dx, dy) = (pose.x - at.x, pose.y - at.y);
    (dx * cos + dy * sin, dy * cos - dx * sin, at.yaw_to(pose))
}
