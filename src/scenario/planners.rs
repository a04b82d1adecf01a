//! The planners: candidates that start at the ego's state of their stamp, good ones, bad ones and broken ones.

use super::driver::{Ahead, Driver, Goal, Motion, USUAL_ACCELERATION_MPS2, USUAL_JERK_MPS3};
use super::road::{Road, Shift, Track};
use super::world::{EGO_CRUISING_MPS, STEP_NS, STEP_S, World, drive, ego_track};
use messages::autoware_internal_planning_msgs::{CandidateTrajectories, CandidateTrajectory, GeneratorInfo};
use messages::autoware_planning_msgs::TrajectoryPoint;
use messages::autoware_vehicle_msgs::TurnIndicatorsCommand;
use messages::builtin_interfaces::Duration;
use messages::std_msgs::Text;
use messages::unique_identifier_msgs::Uuid;
use std::sync::Arc;

/// Time between two points of a candidate.
const POINT_STEP_NS: i64 = 100_000_000;
/// Steering rate that a swerve comes to, rad/s; within the limits of vehicles, so that its place is what is wrong.
const SWERVE_STEERING_RATE_RPS: f64 = 0.2;

/// What a planner proposes: how fast to drive, where in the road, and what to heed.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Manoeuvre {
    /// Speed control.
    pub(crate) driver: Driver,
    /// Stops for the pedestrian and for red and amber.
    pub(crate) heeds_rules: bool,
    /// Keeps its distance to the vehicle ahead.
    pub(crate) heeds_vehicles: bool,
    /// Swerves by this much, positive to the left.
    pub(crate) swerve_m: f64,
}

impl Manoeuvre {
    pub(crate) fn keep_lane(speed_mps: f64) -> Self {
        let driver = Driver::cruising(speed_mps);
        Self { driver, heeds_rules: true, heeds_vehicles: true, swerve_m: 0.0 }
    }

    pub(crate) fn stop(deceleration_mps2: f64) -> Self {
        let driver = Driver {
            goal: Goal::Stop(deceleration_mps2),
            acceleration_mps2: USUAL_ACCELERATION_MPS2,
            jerk_mps3: USUAL_JERK_MPS3,
        };
        Self { driver, heeds_rules: false, heeds_vehicles: false, swerve_m: 0.0 }
    }

    fn swerve(by_m: f64) -> Self {
        Self {
            heeds_rules: false,
            heeds_vehicles: false,
            swerve_m: by_m,
            ..Self::keep_lane(EGO_CRUISING_MPS)
        }
    }

    fn turn_indicator(&self) -> u8 {
        match self.swerve_m {
            by if by > 0.0 => TurnIndicatorsCommand::ENABLE_LEFT,
            by if by < 0.0 => TurnIndicatorsCommand::ENABLE_RIGHT,
            _ => TurnIndicatorsCommand::NO_COMMAND,
        }
    }
}

/// A planner and what it proposes in each message.
#[derive(Debug, Clone)]
pub(crate) struct Planner {
    /// Its identity.
    pub(crate) id: Uuid,
    /// Its name.
    pub(crate) name: String,
    /// Points of each candidate.
    pub(crate) points: usize,
    /// One candidate for each.
    pub(crate) manoeuvres: Vec<Manoeuvre>,
}

/// The generative planner. The list is that of the module above.
pub(crate) fn generative() -> Vec<Planner> {
    let ignorant = Manoeuvre { heeds_rules: false, ..Manoeuvre::keep_lane(EGO_CRUISING_MPS) };
    let racer = Driver { goal: Goal::Cruise(20.0), acceleration_mps2: 7.0, jerk_mps3: 20.0 };
    let samples = vec![
        Manoeuvre::keep_lane(EGO_CRUISING_MPS),
        Manoeuvre::keep_lane(5.0),
        Manoeuvre::keep_lane(11.0),
        Manoeuvre::stop(1.5),
        Manoeuvre::swerve(5.6),
        Manoeuvre::swerve(-2.6),
        ignorant,
        Manoeuvre { driver: racer, heeds_vehicles: false, ..ignorant },
    ];
    vec![Planner {
        id: Uuid { uuid: *b"generated planA0" },
        name: "DiffusionPlanner_0".to_owned(),
        points: 80,
        manoeuvres: samples,
    }]
}

/// The rule-based planners: one goes on, one stops.
pub(crate) fn backup() -> Vec<Planner> {
    let planner = |id, name: &str, manoeuvre| Planner {
        id: Uuid { uuid: id },
        name: name.to_owned(),
        points: 60,
        manoeuvres: vec![manoeuvre],
    };
    vec![
        planner(
            *b"generated planB0",
            "MinimumRuleBasedPlanner_Go",
            Manoeuvre::keep_lane(0.8 * EGO_CRUISING_MPS),
        ),
        planner(*b"generated planB1", "MinimumRuleBasedPlanner_Stop", Manoeuvre::stop(2.5)),
    ]
}

/// Something wrong with a candidate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Fault {
    /// Made for the ego of [`STALE_BY_NS`] ago, and stamped so.
    Stale,
    /// A speed that is not a number.
    NotANumber,
    /// One point only.
    SinglePoint,
    /// Times that go back in the middle.
    TimeGoesBack,
}

/// How old a stale candidate is when it should be fresh.
pub(crate) const STALE_BY_NS: i64 = 350_000_000;

/// A fault of one sample of the first generative planner, in messages stamped from `from_ns` to `to_ns`, both included.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FaultPeriod {
    /// What is wrong.
    pub(crate) fault: Fault,
    /// Which sample.
    pub(crate) sample: usize,
    /// First stamp, from the start.
    pub(crate) from_ns: i64,
    /// Last stamp, from the start.
    pub(crate) to_ns: i64,
}

/// The faults of the road drive.
pub(crate) const FAULTS: &[FaultPeriod] = &[
    FaultPeriod { fault: Fault::Stale, sample: 2, from_ns: 3_000_000_000, to_ns: 3_200_000_000 },
    FaultPeriod { fault: Fault::NotANumber, sample: 1, from_ns: 6_500_000_000, to_ns: 6_700_000_000 },
    FaultPeriod { fault: Fault::SinglePoint, sample: 2, from_ns: 12_000_000_000, to_ns: 12_200_000_000 },
    FaultPeriod { fault: Fault::TimeGoesBack, sample: 3, from_ns: 14_000_000_000, to_ns: 14_200_000_000 },
];

/// The fault of a sample in the message of a stamp.
pub(crate) fn fault_of(faults: &[FaultPeriod], sample: usize, stamp_ns: i64) -> Option<Fault> {
    let hit = |period: &&FaultPeriod| {
        period.sample == sample && (period.from_ns..=period.to_ns).contains(&stamp_ns)
    };
    faults.iter().find(hit).map(|period| period.fault)
}

fn corrupt(points: &mut Vec<TrajectoryPoint>, fault: Fault) {
    let middle = points.len() / 2;
    let Some(point) = points.get_mut(middle) else { return };
    match fault {
        Fault::Stale => {}
        Fault::NotANumber => point.longitudinal_velocity_mps = f32::NAN,
        Fault::SinglePoint => points.truncate(1),
        Fault::TimeGoesBack => point.time_from_start = Duration::default(),
    }
}

impl World {
    /// What planners propose at a time from the start.
    pub(crate) fn candidates(
        &self,
        planners: &[Planner],
        faults: &[FaultPeriod],
        stamp_ns: i64,
    ) -> CandidateTrajectories {
        let mut message = CandidateTrajectories::default();
        for planner in planners {
            message.generator_info.push(GeneratorInfo {
                generator_id: planner.id,
                generator_name: Text { data: planner.name.clone() },
            });
            for (sample, manoeuvre) in planner.manoeuvres.iter().enumerate() {
                let fault = fault_of(faults, sample, stamp_ns);
                let candidate = self.candidate(planner, manoeuvre, fault, stamp_ns);
                message.candidate_trajectories.push(Arc::new(candidate));
            }
        }
        message
    }

    fn candidate(
        &self,
        planner: &Planner,
        manoeuvre: &Manoeuvre,
        fault: Option<Fault>,
        message_stamp_ns: i64,
    ) -> CandidateTrajectory {
        let age_ns = if fault == Some(Fault::Stale) { STALE_BY_NS } else { 0 };
        let stamp_ns = message_stamp_ns - age_ns;
        let mut points = self.plan(manoeuvre, planner.points, stamp_ns);
        if let Some(fault) = fault {
            corrupt(&mut points, fault);
        }
        let header = super::header(stamp_ns);
        let turn_indicators_command =
            TurnIndicatorsCommand { stamp: header.stamp, command: manoeuvre.turn_indicator() };
        CandidateTrajectory { header, generator_id: planner.id, points, turn_indicators_command }
    }

    /// The points of a manoeuvre that begins at a time from the start; the first is the ego's state then.
    fn plan(&self, manoeuvre: &Manoeuvre, count: usize, stamp_ns: i64) -> Vec<TrajectoryPoint> {
        let mut motion = self.ego_at(stamp_ns);
        let track = self.planned_track(manoeuvre, &motion);
        // Lights and pedestrian stay as they are, the vehicle ahead keeps its speed.
        let lines =
            if manoeuvre.heeds_rules { self.lines_ahead_of_ego(&motion, stamp_ns) } else { Vec::new() };
        let vehicle =
            manoeuvre.heeds_vehicles.then(|| self.vehicle_ahead_of_ego(&motion, stamp_ns)).flatten();
        let start_s_m = motion.s_m;
        let mut ahead: Vec<Ahead> = Vec::with_capacity(lines.len() + 1);
        (0..count)
            .map(|index| {
                let point = self.point(&track, &motion, index as i64 * POINT_STEP_NS);
                for step in 0..POINT_STEP_NS / STEP_NS {
                    let passed_s = (index as i64 * (POINT_STEP_NS / STEP_NS) + step) as f64 * STEP_S;
                    let driven_m = motion.s_m - start_s_m;
                    ahead.clear();
                    ahead.extend(lines.iter().chain(&vehicle).map(|thing| Ahead {
                        gap_m: thing.gap_m + thing.speed_mps * passed_s - driven_m,
                        ..*thing
                    }));
                    motion = drive(&manoeuvre.driver, &track, &motion, &ahead);
                }
                point
            })
            .collect()
    }

    fn planned_track(&self, manoeuvre: &Manoeuvre, motion: &Motion) -> Track {
        if manoeuvre.swerve_m == 0.0 {
            return ego_track();
        }
        // The steering rate of the quintic is largest at its ends: 60 times shift per length cubed, times speed.
        let speed_mps = motion.speed_mps.clamp(3.0, EGO_CRUISING_MPS);
        let rate = 60.0 * manoeuvre.swerve_m.abs() * speed_mps * self.vehicle.wheel_base_m();
        let length_m = (rate / SWERVE_STEERING_RATE_RPS).cbrt();
        Track {
            shift: Some(Shift { from_s_m: motion.s_m, length_m, by_m: manoeuvre.swerve_m }),
            ..ego_track()
        }
    }

    fn point(&self, track: &Track, motion: &Motion, time_ns: i64) -> TrajectoryPoint {
        let curvature = Road::track_curvature(track, motion.s_m);
        TrajectoryPoint {
            time_from_start: Duration::from_nanoseconds(time_ns),
            pose: self.road.pose(track, motion.s_m),
            longitudinal_velocity_mps: motion.speed_mps as f32,
            lateral_velocity_mps: 0.0,
            acceleration_mps2: motion.acceleration_mps2 as f32,
            heading_rate_rps: (motion.speed_mps * curvature) as f32,
            front_wheel_angle_rad: self.vehicle.steering_angle_from_curvature(curvature) as f32,
            rear_wheel_angle_rad: 0.0,
        }
    }
}
