//! The closed loop through the whole selector: a vehicle with noise, delay and lag drives what the selector hands on,
//! candidates of the open-space provider judged by enforced filters, until it stands in the slot: in the scenes that come
//! with the program, and in generated ones. `SELECTOR_SEEDS` says how many drives, or with two numbers (40..41) which, and
//! `SELECTOR_SCENES` picks those whose names contain it; with `TRACE` each cycle is told.

#![allow(clippy::unwrap_used, clippy::panic, clippy::float_cmp_const, reason = "a test fails by panicking")]

#[path = "support/inputs.rs"]
mod inputs;
#[path = "../../crates/open-space/tests/closed_loop/random.rs"]
#[allow(dead_code, reason = "shared with other drives")]
mod random;
#[path = "../../crates/open-space/tests/support/scene_files.rs"]
mod scene_files;
#[path = "../../crates/open-space/tests/closed_loop/vehicle.rs"]
mod vehicle;

use crossbeam_channel::{Receiver, Sender, unbounded};
use inputs::one_lanelet;
use messages::Interface;
use messages::autoware_perception_msgs::PredictedObjects;
use messages::autoware_planning_msgs::Trajectory;
use messages::autoware_trajectory_validator::{RiskLevel, ValidationReportArray};
use messages::builtin_interfaces::Time;
use messages::geometry_msgs::{AccelWithCovarianceStamped, Quaternion};
use messages::nav_msgs::Odometry;
use messages::std_msgs::Header;
use motion::Point2;
use open_space::fallback::FallbackParameters;
use open_space::partition::{Part, PartitionParameters};
use open_space::provider::{ProviderParameters, Region, stop_trajectory};
use open_space::region_of_interest::RegionParameters;
use open_space::scenes::{SceneKind, scene};
use open_space::stage::Command;
use open_space::stitcher::{DiscretizedPoint, DiscretizedTrajectory, PathPoint};
use open_space::vehicle_model::VehicleState;
use open_space::{CollisionChecker, Gear, OpenSpaceParameters, PlanarPose, Planner, Problem};
use random::Random;
use scene_files::example_scenes;
use selection::parameters::{RankerParameters, ValidatorParameters, VehicleConstraintParameters};
use selection::ranker::GeneratorSource;
use selection::{Pipeline, Ranker, Validator};
use selector_actors::provider::{ProviderConfig, planner_of};
use selector_actors::publisher::PublishedTimes;
use selector_actors::topics::OutputMessage;
use selector_actors::{Clock, Config, Input, Publication, SelectorSystem, Sink, SinkError};
use std::ops::Range;
use std::sync::Arc;
use vehicle::{Controller, Imperfection, TICK_S, Vehicle};

const USUAL: Imperfection =
    Imperfection { delay_ticks: 10, position_m: 0.01, yaw_rad: 0.003, speed_mps: 0.01 };

/// Ticks from cycle to cycle: ten cycles a second.
const CYCLE_TICKS: u32 = 10;

/// Longest drive, s.
const PATIENCE_S: f64 = 240.0;

fn seeds(few: u64) -> Range<u64> {
    let wanted = std::env::var("SELECTOR_SEEDS").unwrap_or_default();
    let (first, end) = wanted.split_once("..").unwrap_or(("0", &wanted));
    first.parse().unwrap()..end.parse().unwrap_or(few)
}

struct Collector(Sender<Publication>);

impl Sink for Collector {
    fn publish(&mut self, publication: Publication) -> Result<(), SinkError> {
        self.0.send(publication).map_err(|gone| SinkError(Arc::new(std::io::Error::other(gone.to_string()))))
    }
}

fn system(problem: &Problem) -> (SelectorSystem, Receiver<Publication>) {
    let (sender, outputs) = unbounded();
    let dimensions = problem.vehicle.dimensions();
    let validator = ValidatorParameters {
        filter_names: ["safety::VehicleConstraintFilter", "safety::CollisionCheckFilter"]
            .map(str::to_owned)
            .into(),
        shadow_mode_filter_names: Vec::new(),
        vehicle_constraint: VehicleConstraintParameters {
            max_speed: 1.02 * problem.limits.max_speed_forward_mps,
            max_acceleration: 1.02 * problem.limits.max_acceleration_mps2,
            // The brake before a road user, too.
            max_deceleration: 1.02 * FallbackParameters::default().max_deceleration,
            max_steering_angle: 1.02 * dimensions.max_steer_angle_rad,
            // The filter estimates the rate from places. At the ends of a move these lie a millimetre apart and less, and
            // the estimate is several times what the wheels do (0.53 rad/s at most).
            max_steering_rate: 4.0,
        },
        ..ValidatorParameters::default()
    };
    let sources = GeneratorSource::table(&[
        "OpenSpacePlanner_Stop=backup_planner_stop",
        "OpenSpacePlanner=backup_planner_go",
    ]);
    let config = Config {
        clock: Clock::stepped(Time::default()),
        threads: 1,
        fallback_period_ms: 100,
        duration_time_s: 1.0,
        cycle_budget: None,
        vehicle: problem.vehicle,
        pipeline: Pipeline::new(
            Validator::new(validator, &problem.vehicle).unwrap(),
            Ranker::new(RankerParameters::default(), sources),
        ),
        interface: Interface::V0_53,
        published_times: PublishedTimes::Zero,
        count_allocations: None,
    };
    let parameters =
        ProviderParameters { open_space_planning_period: 1000.0, ..ProviderParameters::default() };
    let make = || Planner::new(OpenSpaceParameters::default());
    let provider = ProviderConfig {
        make_planner: planner_of(
            make,
            problem.vehicle,
            problem.limits,
            parameters.is_near_destination_threshold,
        ),
        provider: parameters,
        partition: PartitionParameters::default(),
        fallback: FallbackParameters::default(),
        region: RegionParameters::default(),
    };
    let system =
        SelectorSystem::start_with_provider(config, Some(provider), Box::new(Collector(sender))).unwrap();
    (system, outputs)
}

fn sense(system: &SelectorSystem, now: Time, state: &VehicleState) {
    let header = Header { stamp: now, frame_id: "map".to_owned() };
    let mut odometry = Odometry { header: header.clone(), ..Odometry::default() };
    odometry.pose.pose.position.x = state.pose.x;
    odometry.pose.pose.position.y = state.pose.y;
    odometry.pose.pose.orientation = Quaternion::from_yaw(state.pose.yaw);
    odometry.twist.twist.linear.x = state.speed_mps;
    odometry.twist.twist.angular.z = state.speed_mps * state.curvature;
    let mut acceleration = AccelWithCovarianceStamped::default();
    acceleration.accel.accel.linear.x = state.acceleration_mps2;
    let objects = PredictedObjects { header, ..PredictedObjects::default() };
    system.deliver(Input::Objects(Arc::new(objects))).unwrap();
    system.deliver(Input::Odometry(Arc::new(odometry))).unwrap();
    system.deliver(Input::Acceleration(Arc::new(acceleration))).unwrap();
}

/// What the filters object to.
fn objections(reports: &ValidationReportArray) -> Option<String> {
    let metrics = reports.reports.iter().flat_map(|report| &report.metrics);
    let objections: Vec<_> = metrics
        .filter(|metric| metric.risk.level >= RiskLevel::HIGH_CAUTION)
        .map(|metric| format!("{}/{} {:.3}", metric.validator_name, metric.metric_name, metric.metric_value))
        .collect();
    (!objections.is_empty()).then(|| objections.join(", "))
}

/// What the vehicle's controller makes of a trajectory that was handed on.
fn command_of(trajectory: &Trajectory, problem: &Problem, state: &VehicleState) -> Command {
    let Some(moving) = trajectory.points.iter().find(|point| point.longitudinal_velocity_mps != 0.0) else {
        // Nothing moves: it stands, and turns its wheels where it is told to.
        let turns = trajectory.points.iter().any(|point| point.front_wheel_angle_rad != 0.0);
        return if turns {
            Command::Follow(part_of(trajectory, problem, state.gear))
        } else {
            Command::Stop(Some(stop_trajectory(state, 0.3)))
        };
    };
    let gear = if moving.longitudinal_velocity_mps > 0.0 { Gear::Forward } else { Gear::Reverse };
    Command::Follow(part_of(trajectory, problem, gear))
}

fn part_of(trajectory: &Trajectory, problem: &Problem, gear: Gear) -> Part {
    let point = |point: &messages::autoware_planning_msgs::TrajectoryPoint| {
        let q = point.pose.orientation;
        let yaw = motion::Quaternion { x: q.x, y: q.y, z: q.z, w: q.w }.yaw();
        let steer_rad = f64::from(point.front_wheel_angle_rad);
        DiscretizedPoint {
            path_point: Some(PathPoint {
                pose: PlanarPose::new(point.pose.position.x, point.pose.position.y, yaw),
                curvature: problem.vehicle.curvature_from_steering_angle(steer_rad),
                ..PathPoint::default()
            }),
            speed_mps: f64::from(point.longitudinal_velocity_mps),
            steer_rad,
            relative_time_s: point.time_from_start.seconds(),
            ..DiscretizedPoint::default()
        }
    };
    let points = trajectory.points.iter().map(point).collect();
    Part { trajectory: DiscretizedTrajectory { points }, gear, first: 0 }
}

/// A trajectory in a line.
fn told(trajectory: Option<&Trajectory>) -> String {
    let Some(points) = trajectory.map(|trajectory| &trajectory.points) else { return "nothing".to_owned() };
    let ends = [points.first(), points.last()].map(|point| {
        point.map(|p| (p.time_from_start.seconds(), p.longitudinal_velocity_mps, p.front_wheel_angle_rad))
    });
    format!("{} points, time, speed and steering of the ends {ends:?}", points.len())
}

/// Drives until the vehicle stands near the goal; why not, otherwise. Also the least clearance, m, and the cycles in
/// which nothing was handed on.
fn drive(problem: &Problem, seed: u64) -> Result<(f64, u32), String> {
    let (system, outputs) = system(problem);
    system.deliver(Input::ReadyMap(Arc::new(one_lanelet()), "map".into())).unwrap();
    let region = Arc::new(Region {
        origin: Point2::new(-40.0, 25.0),
        heading_rad: 0.7,
        goal: problem.goal,
        bounds: problem.bounds,
        obstacles: problem.obstacles.clone(),
    });
    system.set_region(Some(region.clone()));
    let checker = CollisionChecker::new(problem).unwrap();
    let mut random = Random::new(seed);
    let mut vehicle = Vehicle::standing(problem.vehicle, region.to_map(problem.start), USUAL);
    let mut controller = Controller::new(problem.vehicle, 0.12 + 0.01 * USUAL.delay_ticks as f64);
    let (mut least_m, mut silent, mut stood_s, mut tick) = (f64::INFINITY, 0, 0.0, 0_u32);
    let (mut objection, trace) = (None, std::env::var_os("TRACE").is_some());
    loop {
        let now_s = f64::from(tick) * TICK_S;
        let state = vehicle.measured(&mut random);
        if tick.is_multiple_of(CYCLE_TICKS) {
            let now = Time::from_nanoseconds(i64::from(tick) * 10_000_000);
            sense(&system, now, &state);
            system.advance_to(now).unwrap();
            let mut driven = None;
            for output in outputs.try_iter() {
                match output.message {
                    OutputMessage::Trajectory(trajectory) => driven = Some(trajectory),
                    OutputMessage::Reports(reports) => objection = objections(&reports).or(objection),
                    _ => {}
                }
            }
            if trace {
                eprintln!("{now_s:6.1} {:?}", region.to_region(vehicle.pose));
                eprintln!(
                    "       {:.3} m/s {:?} {}",
                    vehicle.speed_mps,
                    vehicle.gear,
                    told(driven.as_deref())
                );
            }
            match driven {
                Some(trajectory) => controller.take(now_s, &command_of(&trajectory, problem, &state)),
                None => silent += 1,
            }
        }
        let (speed_mps, steer_rad, gear) = controller.control(now_s, &state);
        vehicle.advance(speed_mps, steer_rad, gear);
        let pose = region.to_region(vehicle.pose);
        if !checker.is_free(&pose, 0.0) {
            return Err(format!(
                "collision at {pose:?} after {now_s:.1} s, {silent} silent cycles, {objection:?}"
            ));
        }
        if tick.is_multiple_of(CYCLE_TICKS) {
            least_m = least_m.min(checker.clearance_m(&pose));
        }
        stood_s = if vehicle.speed_mps.abs() < 0.005 { stood_s + TICK_S } else { 0.0 };
        let is_there = pose.distance_m(&problem.goal) < 0.2 && pose.yaw_to(&problem.goal).abs() < 0.07;
        if is_there && stood_s > 3.0 {
            return Ok((least_m, silent));
        }
        if now_s > PATIENCE_S {
            return Err(format!("still at {pose:?}, {silent} silent cycles, {objection:?}"));
        }
        tick += 1;
    }
}

/// Drives every scene with every seed; all must end in the slot.
fn assert_parked(scenes: &[(String, Problem)], seeds: &Range<u64>) {
    let wanted = std::env::var("SELECTOR_SCENES").unwrap_or_default();
    let (mut failed, mut count, mut least_m, mut silent) = (Vec::new(), 0, f64::INFINITY, 0);
    for (name, problem) in scenes.iter().filter(|(name, _)| name.contains(&wanted)) {
        for seed in seeds.clone() {
            count += 1;
            match drive(problem, seed) {
                Ok((clearance_m, cycles)) => {
                    (least_m, silent) = (f64::min(least_m, clearance_m), silent + cycles);
                }
                Err(why) => failed.push(format!("{name} {seed}: {why}")),
            }
        }
    }
    eprintln!(
        "{count} drives, least clearance {least_m:.3} m, {silent} cycles without a trajectory, {} not parked",
        failed.len()
    );
    assert!(failed.is_empty(), "{}", failed.join("\n"));
}

fn generated_scenes() -> Vec<(String, Problem)> {
    let generated = SceneKind::ALL.into_iter().map(|kind| scene(kind, 0.2, 1, 0));
    generated.map(|scene| (scene.name, scene.problem)).collect()
}

#[test]
fn what_the_selector_hands_on_parks_the_vehicle() {
    assert_parked(&generated_scenes(), &seeds(1));
}

#[test]
fn the_scenes_of_the_program_are_driven_into_the_slot() {
    assert_eq!(example_scenes().len(), 7);
    assert_parked(&example_scenes(), &seeds(2));
}

#[test]
#[ignore = "some minutes: 1,600 drives"]
fn a_hundred_noisy_vehicles_park_in_every_scene() {
    assert_parked(&[example_scenes(), generated_scenes()].concat(), &seeds(100));
}
