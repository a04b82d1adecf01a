//! The open-space provider among the actors: what becomes of its trajectory, in step with a virtual clock.

#![allow(clippy::unwrap_used, clippy::panic, clippy::float_cmp_const, reason = "a test fails by panicking")]

#[path = "support/inputs.rs"]
mod inputs;

use crossbeam_channel::{Receiver, Sender, unbounded};
use inputs::one_lanelet;
use messages::Interface;
use messages::autoware_internal_planning_msgs::{CandidateTrajectories, CandidateTrajectory};
use messages::autoware_perception_msgs::{PredictedObject, PredictedObjects};
use messages::autoware_planning_msgs::Trajectory;
use messages::builtin_interfaces::Time;
use messages::geometry_msgs::{Quaternion, Vector3};
use messages::nav_msgs::Odometry;
use motion::{Point2, VehicleInfo};
use open_space::fallback::FallbackParameters;
use open_space::partition::PartitionParameters;
use open_space::provider::{PlanFailure, ProblemPlanner, ProviderParameters, Region};
use open_space::region_of_interest::RegionParameters;
use open_space::{Gear, Limits, PlanarPose, Problem, Watch};
use selection::parameters::{RankerParameters, ValidatorParameters};
use selection::ranker::GeneratorSource;
use selection::{Pipeline, Ranker, Validator};
use selector_actors::provider::{GENERATOR, ProviderConfig, STOP_GENERATOR, planner_of};
use selector_actors::publisher::PublishedTimes;
use selector_actors::topics::OutputMessage;
use selector_actors::{
    Clock, Config, Input, OutputTopic, Publication, SelectorSystem, Sink, SinkError, SystemError,
};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

const PERIOD_MS: i64 = 100;
const GOAL_M: f64 = 8.0;

/// Straight to the goal with a top speed, but breaks down at its first jobs.
#[derive(Clone)]
struct Straight {
    top_mps: f64,
    breakdowns: Arc<AtomicUsize>,
}

impl ProblemPlanner for Straight {
    fn plan(&mut self, problem: &Problem, _: &Watch) -> Result<open_space::Trajectory, PlanFailure> {
        let left = self.breakdowns.load(Ordering::Relaxed);
        self.breakdowns.store(left.saturating_sub(1), Ordering::Relaxed);
        assert_eq!(left, 0, "broken down");
        let way_m = problem.start.distance_m(&problem.goal);
        let end_s = way_m * std::f64::consts::PI / (2.0 * self.top_mps);
        let steps = (end_s / 0.1).ceil() as u32;
        let at = |step: u32| {
            let time_s = end_s * f64::from(step) / f64::from(steps);
            let (sin, cos) = (std::f64::consts::PI * time_s / end_s).sin_cos();
            let done = 0.5 * (1.0 - cos);
            let (from, to) = (problem.start, problem.goal);
            open_space::TrajectoryPoint {
                time_s,
                pose: PlanarPose::new(
                    from.x + (to.x - from.x) * done,
                    from.y + (to.y - from.y) * done,
                    from.yaw,
                ),
                curvature: 0.0,
                speed_mps: self.top_mps * sin,
                acceleration_mps2: self.top_mps * std::f64::consts::PI / end_s * cos,
                steer_rad: 0.0,
                gear: Gear::Forward,
            }
        };
        Ok(open_space::Trajectory { points: (0..=steps).map(at).collect() })
    }
}

fn planner(top_mps: f64) -> Straight {
    Straight { top_mps, breakdowns: Arc::default() }
}

struct Collector(Sender<Publication>);

impl Sink for Collector {
    fn publish(&mut self, publication: Publication) -> Result<(), SinkError> {
        self.0.send(publication).map_err(|gone| SinkError(Arc::new(std::io::Error::other(gone.to_string()))))
    }
}

fn start(
    threads: usize,
    planner: Straight,
    parameters: ProviderParameters,
) -> Result<(SelectorSystem, Receiver<Publication>), SystemError> {
    let (sender, outputs) = unbounded();
    let vehicle = VehicleInfo::default();
    let validator = ValidatorParameters {
        filter_names: vec!["safety::VehicleConstraintFilter".to_owned()],
        shadow_mode_filter_names: Vec::new(),
        ..ValidatorParameters::default()
    };
    let sources = GeneratorSource::table(&[
        "OpenSpacePlanner_Stop=backup_planner_stop",
        "OpenSpacePlanner=backup_planner_go",
    ]);
    let config = Config {
        clock: Clock::stepped(Time::default()),
        threads,
        fallback_period_ms: PERIOD_MS,
        duration_time_s: 1.0,
        cycle_budget: None,
        vehicle,
        pipeline: Pipeline::new(
            Validator::new(validator, &vehicle).unwrap(),
            Ranker::new(RankerParameters::default(), sources),
        ),
        interface: Interface::V0_53,
        published_times: PublishedTimes::Zero,
        count_allocations: None,
    };
    let near_m = parameters.is_near_destination_threshold;
    let provider = ProviderConfig {
        provider: parameters,
        partition: PartitionParameters::default(),
        fallback: FallbackParameters::default(),
        region: RegionParameters::default(),
        make_planner: planner_of(move || planner.clone(), vehicle, Limits::default(), near_m),
    };
    let system = SelectorSystem::start_with_provider(config, Some(provider), Box::new(Collector(sender)))?;
    Ok((system, outputs))
}

/// Plan once and track.
fn once() -> ProviderParameters {
    ProviderParameters { open_space_planning_period: 1000.0, ..ProviderParameters::default() }
}

fn region() -> Arc<Region> {
    Arc::new(Region {
        origin: Point2::new(5.0, 0.0),
        heading_rad: 0.0,
        goal: PlanarPose::new(GOAL_M, 0.0, 0.0),
        bounds: [-20.0, 20.0, -5.0, 5.0],
        obstacles: Vec::new(),
    })
}

/// A node whose vehicle stands at the origin of the region, all inputs there, a goal set.
struct Node {
    system: SelectorSystem,
    outputs: Receiver<Publication>,
    now_ms: i64,
}

impl Node {
    fn parking(threads: usize, planner: Straight) -> Self {
        Self::parking_with(threads, planner, once())
    }

    fn parking_with(threads: usize, planner: Straight, parameters: ProviderParameters) -> Self {
        let (system, outputs) = start(threads, planner, parameters).unwrap();
        let node = Self { system, outputs, now_ms: 0 };
        node.deliver(Input::ReadyMap(Arc::new(one_lanelet()), "map".into()));
        node.deliver(Input::Objects(Arc::default()));
        node.deliver(Input::Acceleration(Arc::default()));
        node.sense(5.0, 0.0);
        node.system.set_region(Some(region()));
        node
    }

    fn deliver(&self, input: Input) {
        self.system.deliver(input).unwrap();
    }

    fn sense(&self, x: f64, speed_mps: f64) {
        let mut odometry = Odometry::default();
        odometry.header.frame_id = "map".to_owned();
        odometry.pose.pose.position.x = x;
        odometry.pose.pose.orientation = Quaternion::from_yaw(0.0);
        odometry.twist.twist.linear.x = speed_mps;
        self.deliver(Input::Odometry(Arc::new(odometry)));
    }

    /// The outputs of the next cycle.
    fn cycle(&mut self) -> Cycle {
        self.now_ms += PERIOD_MS;
        self.system.advance_to(Time::from_nanoseconds(self.now_ms * 1_000_000)).unwrap();
        Cycle(self.outputs.try_iter().collect())
    }
}

struct Cycle(Vec<Publication>);

impl Cycle {
    fn set(&self, topic: OutputTopic) -> Arc<CandidateTrajectories> {
        let found = self.0.iter().find(|output| output.topic == topic).map(|output| &output.message);
        match found {
            Some(OutputMessage::Candidates(set)) => set.clone(),
            other => panic!("{other:?} on {}", topic.full_name()),
        }
    }

    /// The only candidate and its generator.
    fn candidate(&self) -> (Arc<CandidateTrajectory>, String) {
        let set = self.set(OutputTopic::ConcatenatedTrajectories);
        let [candidate] = &set.candidate_trajectories[..] else { panic!("{set:?}") };
        let [generator] = &set.generator_info[..] else { panic!("{set:?}") };
        assert_eq!(candidate.generator_id, generator.generator_id);
        (candidate.clone(), generator.generator_name.data.clone())
    }

    fn driven(&self) -> Option<Arc<Trajectory>> {
        self.0.iter().find_map(|output| match &output.message {
            OutputMessage::Trajectory(trajectory) => Some(trajectory.clone()),
            _ => None,
        })
    }

    fn validated(&self) -> usize {
        self.set(OutputTopic::ValidatedTrajectories).candidate_trajectories.len()
    }

    fn bytes(&self) -> Vec<(OutputTopic, Vec<u8>)> {
        self.0.iter().map(|output| (output.topic, output.message.to_cdr(Interface::V0_53))).collect()
    }
}

#[test]
fn until_there_is_a_plan_the_vehicle_is_held_by_a_candidate_like_any_other() {
    let mut node = Node::parking(1, planner(1.0));
    let cycle = node.cycle();
    let (stop, generator) = cycle.candidate();
    assert_eq!((generator.as_str(), stop.points.len()), (STOP_GENERATOR, 10));
    assert_eq!(stop.header.stamp, Time::from_nanoseconds(PERIOD_MS * 1_000_000));
    assert_eq!(stop.header.frame_id, "map");
    assert_eq!((cycle.validated(), cycle.driven().unwrap().points.len()), (1, 10));
}

#[test]
fn the_plan_takes_the_place_of_the_stop_and_is_driven() {
    let mut node = Node::parking(1, planner(1.0));
    node.cycle();
    let cycle = node.cycle();
    let (plan, generator) = cycle.candidate();
    assert_eq!(generator, GENERATOR);
    assert_eq!(cycle.validated(), 1);
    assert_eq!(cycle.driven().unwrap().points, plan.points);
    let (first, last) = (plan.points[0], plan.points[plan.points.len() - 1]);
    assert!((first.pose.position.x - 5.0).abs() < 0.05, "{first:?}");
    assert!((last.pose.position.x - 5.0 - GOAL_M).abs() < 1e-9, "{last:?}");
    assert!(last.longitudinal_velocity_mps.abs() < 1e-6);
}

#[test]
fn without_a_planning_thread_the_plan_is_there_in_the_cycle_that_asked_for_it() {
    let waiting = ProviderParameters { enable_open_space_planner_thread: false, ..once() };
    let mut node = Node::parking_with(1, planner(1.0), waiting);
    let cycle = node.cycle();
    let (plan, generator) = cycle.candidate();
    assert_eq!((generator.as_str(), cycle.validated()), (GENERATOR, 1));
    assert_eq!(cycle.driven().unwrap().points, plan.points);
}

/// Every cycle the vehicle is where the trajectory that was driven says.
#[test]
fn the_vehicle_comes_to_the_goal() {
    let mut node = Node::parking(1, planner(1.0));
    let mut driven: Option<Arc<Trajectory>> = None;
    let mut place = 5.0;
    for _ in 0..200 {
        if let Some(trajectory) = &driven {
            let due =
                trajectory.points.iter().find(|p| p.time_from_start.nanoseconds() >= PERIOD_MS * 1_000_000);
            let here = due.or(trajectory.points.last()).unwrap();
            place = here.pose.position.x;
            node.sense(place, f64::from(here.longitudinal_velocity_mps));
        }
        let cycle = node.cycle();
        driven = Some(cycle.driven().expect("in every cycle something may be driven"));
    }
    assert!((place - 5.0 - GOAL_M).abs() < 0.1, "{place}");
    let (stop, generator) = node.cycle().candidate();
    assert_eq!((generator.as_str(), stop.points.len()), (STOP_GENERATOR, 10), "parking has finished");
}

#[test]
fn a_plan_that_the_filters_reject_is_not_driven() {
    let mut node = Node::parking(1, planner(40.0));
    node.cycle();
    let cycle = node.cycle();
    assert_eq!(cycle.candidate().1, GENERATOR);
    assert_eq!((cycle.validated(), cycle.driven()), (0, None));
}

#[test]
fn the_same_drive_gives_the_same_bytes_in_every_run_and_on_any_number_of_threads() {
    let drive = |threads| {
        let mut node = Node::parking(threads, planner(1.0));
        (0..30).flat_map(|_| node.cycle().bytes()).collect::<Vec<_>>()
    };
    let once = drive(1);
    assert!(once.iter().any(|(topic, _)| *topic == OutputTopic::Trajectory));
    assert_eq!(drive(1), once);
    assert_eq!(drive(4), once);
}

#[test]
fn a_planner_that_breaks_down_costs_cycles_and_no_more() {
    let broken = Straight { top_mps: 1.0, breakdowns: Arc::new(AtomicUsize::new(2)) };
    let mut node = Node::parking(1, broken);
    let generators: Vec<_> = (0..5).map(|_| node.cycle().candidate().1).collect();
    assert_eq!(generators, [STOP_GENERATOR, STOP_GENERATOR, STOP_GENERATOR, GENERATOR, GENERATOR]);
}

#[test]
fn without_a_goal_there_is_no_candidate() {
    let mut node = Node::parking(1, planner(1.0));
    node.cycle();
    assert_eq!(node.cycle().candidate().1, GENERATOR);
    node.system.set_region(None);
    let cycle = node.cycle();
    assert!(cycle.driven().is_none());
    assert!(cycle.0.iter().all(|output| output.topic != OutputTopic::ConcatenatedTrajectories));
    node.system.set_region(Some(region()));
    assert_eq!(node.cycle().candidate().1, STOP_GENERATOR);
    assert_eq!(node.cycle().candidate().1, GENERATOR);
}

#[test]
fn a_road_user_in_the_way_is_braked_for() {
    let mut node = Node::parking(1, planner(1.0));
    let mut other = PredictedObject::default();
    other.shape.dimensions = Vector3 { x: 1.0, y: 1.0, z: 1.0 };
    other.kinematics.initial_pose_with_covariance.pose.position.x = 15.0;
    node.deliver(Input::Objects(Arc::new(PredictedObjects { objects: vec![other], ..Default::default() })));
    node.cycle();
    let (plan, generator) = node.cycle().candidate();
    assert_eq!(generator, GENERATOR);
    let end = plan.points[plan.points.len() - 1];
    assert_eq!(end.longitudinal_velocity_mps, 0.0);
    assert!(end.pose.position.x < 15.0 - 1.0 - 4.0, "{end:?}");
}

#[test]
fn parameters_out_of_range_are_refused_by_name() {
    let parameters = ProviderParameters { planning_loop_rate: 0.0, ..once() };
    let refused = start(1, planner(1.0), parameters).unwrap_err();
    assert!(refused.to_string().contains("`planning_loop_rate` is 0"), "{refused}");
}
