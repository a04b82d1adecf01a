//! The filter as a whole on a straight road with one light: upstream's cases, the edges of each rule, and what must
//! hold for every scene.

mod candidate_memory;
mod properties;
mod rules;
mod upstream_cases;

use super::*;
use crate::candidate::CandidateKey;
use crate::parameters::{AmberRejection, CheckedTrajectoryLength};
use crate::scene::{Epoch, HdMap};
use crate::test_scene::candidate_of;
use lanelet_map::{Map, MapBuilder, Member};
use messages::autoware_perception_msgs::{
    TrafficLightElement as Element, TrafficLightGroup, TrafficLightGroupArray,
};
use messages::autoware_planning_msgs::{LaneletPrimitive, LaneletRoute, LaneletSegment};
use messages::builtin_interfaces::Time;
use messages::geometry_msgs::AccelWithCovarianceStamped;
use messages::nav_msgs::Odometry;
use messages::unique_identifier_msgs::Uuid;
use motion::{Pose, TimeFromStart, TrajectoryPoint, VehicleInfo};

const LANELET: i64 = 100;
const LIGHT: i64 = 1000;
const STOP_LINE: i64 = 5;

/// Colour and shape.
type Lamp = (u8, u8);
const RED: &[Lamp] = &[(Element::RED, Element::CIRCLE)];
const AMBER: &[Lamp] = &[(Element::AMBER, Element::CIRCLE)];
const GREEN: &[Lamp] = &[(Element::GREEN, Element::CIRCLE)];
const UNKNOWN: &[Lamp] = &[(Element::UNKNOWN, Element::UNKNOWN)];
const RED_AND_AMBER: &[Lamp] = &[RED[0], AMBER[0]];

/// A road along x with a light whose stop line is at `x`, from y = -5 to 5.
fn road(x: f64, turn: Option<&str>, shape: &str) -> Map {
    let mut builder = MapBuilder::new();
    let places = [(0.0, 5.0), (500.0, 5.0), (0.0, -5.0), (500.0, -5.0), (x, -5.0), (x, 5.0)];
    for (id, (x, y)) in (1..).zip(places) {
        builder.point(id, [x, y, 0.0], &[]).unwrap();
    }
    builder.line_string(1, &[1, 2], &[]).unwrap();
    builder.line_string(2, &[3, 4], &[]).unwrap();
    builder.line_string(STOP_LINE, &[5, 6], &[("type", "stop_line")]).unwrap();
    builder.line_string(6, &[5, 6], &[("type", "traffic_light"), ("subtype", shape)]).unwrap();
    let turn: Vec<_> = turn.map(|turn| ("turn_direction", turn)).into_iter().collect();
    builder.lanelet(LANELET, 1, 2, &turn).unwrap();
    let members = [("ref_line", Member::LineString(STOP_LINE)), ("refers", Member::LineString(6))];
    builder.regulatory_element(LIGHT, &members, &[("subtype", "traffic_light")]).unwrap();
    builder.attach(LANELET, LIGHT).unwrap();
    builder.build().unwrap()
}

fn route(ids: &[i64]) -> LaneletRoute {
    let segment = |id: &i64| LaneletSegment {
        preferred_primitive: LaneletPrimitive { id: *id, primitive_type: "lane".to_owned() },
        primitives: Vec::new(),
    };
    LaneletRoute { segments: ids.iter().map(segment).collect(), ..LaneletRoute::default() }
}

fn group(light_id: i64, lamps: &[Lamp]) -> TrafficLightGroup {
    let element =
        |&(color, shape): &Lamp| Element { color, shape, status: Element::SOLID_ON, confidence: 1.0 };
    TrafficLightGroup {
        traffic_light_group_id: light_id,
        elements: lamps.iter().map(element).collect(),
        predictions: Vec::new(),
    }
}

/// Parameters of upstream's filter tests.
fn base() -> TrafficLightParameters {
    TrafficLightParameters {
        treat_amber_light_as_red_light: false,
        min_lookahead_distance: 0.0,
        checked_trajectory_length: CheckedTrajectoryLength { deceleration_limit: 999.9, jerk_limit: 999.9 },
        ..TrafficLightParameters::default()
    }
}

fn with(change: impl FnOnce(&mut TrafficLightParameters)) -> TrafficLightParameters {
    let mut parameters = base();
    change(&mut parameters);
    parameters
}

/// A point at time, x and speed, facing along x.
fn point(time_s: f64, x: f64, speed_mps: f64) -> TrajectoryPoint {
    TrajectoryPoint {
        time_from_start: TimeFromStart::from_nanos((time_s * 1e9).round() as i64),
        pose: Pose::from_xy_yaw(x, 0.0, 0.0),
        longitudinal_velocity_mps: speed_mps as f32,
        ..TrajectoryPoint::default()
    }
}

/// Two points at a constant speed.
fn traj(from: f64, to: f64, speed_mps: f64) -> Vec<TrajectoryPoint> {
    vec![point(0.0, from, speed_mps), point((to - from).abs() / speed_mps, to, speed_mps)]
}

/// A filter and the world it sees, cycle after cycle.
struct World {
    filter: TrafficLightFilter,
    scene: Scene,
}

impl World {
    fn new(x: f64, parameters: TrafficLightParameters, front_offset_m: f64) -> Self {
        Self::on(road(x, None, "red_yellow_green"), parameters, front_offset_m)
    }

    fn on(map: Map, parameters: TrafficLightParameters, front_offset_m: f64) -> Self {
        let mut scene = Scene::empty(Time::default(), Arc::new(VehicleInfo::default()));
        scene.map = Some(Epoch { number: 1, value: HdMap::new("map".into(), Arc::new(map)) });
        scene.route = Some(Epoch { number: 1, value: Arc::new(route(&[LANELET])) });
        scene.traffic_signals = Some(Arc::default());
        let mut world = Self { filter: TrafficLightFilter::new(parameters, front_offset_m), scene };
        world.ego(5.0, 0.0);
        world.at(100.0);
        world
    }

    fn ego(&mut self, speed_mps: f64, acceleration_mps2: f64) -> &mut Self {
        let mut odometry = Odometry::default();
        odometry.header.stamp = self.scene.now;
        odometry.twist.twist.linear.x = speed_mps;
        self.scene.odometry = Some(Arc::new(odometry));
        let mut acceleration = AccelWithCovarianceStamped::default();
        acceleration.accel.accel.linear.x = acceleration_mps2;
        self.scene.acceleration = Some(Arc::new(acceleration));
        self
    }

    fn at(&mut self, time_s: f64) -> &mut Self {
        self.scene.now = Time::from_nanoseconds((time_s * 1e9).round() as i64);
        let mut odometry = Odometry::clone(self.scene.odometry.as_ref().unwrap());
        odometry.header.stamp = self.scene.now;
        self.scene.odometry = Some(Arc::new(odometry));
        self
    }

    fn signals(&mut self, groups: Vec<TrafficLightGroup>) -> &mut Self {
        let stamp = self.scene.now;
        self.scene.traffic_signals =
            Some(Arc::new(TrafficLightGroupArray { stamp, traffic_light_groups: groups }));
        self
    }

    fn shows(&mut self, lamps: &[Lamp]) -> &mut Self {
        self.signals(vec![group(LIGHT, lamps)])
    }

    /// One cycle with several candidates.
    fn cycle(&mut self, candidates: &[Candidate]) -> Vec<Judgement> {
        self.filter.observe(&self.scene);
        let mut scratch = Scratch::default();
        let judge = |candidate| self.filter.judge(&self.scene, candidate, &mut scratch);
        let judgements: Vec<_> = candidates.iter().map(judge).collect();
        let judged: Vec<_> =
            candidates.iter().zip(&judgements).filter(|(_, j)| j.failure.is_none()).collect();
        self.filter.remember(&judged);
        judgements
    }

    /// One cycle with one candidate.
    fn judge(&mut self, points: Vec<TrajectoryPoint>) -> Judgement {
        self.cycle(&[candidate_of(points)]).remove(0)
    }

    /// Whether the one candidate of a cycle is feasible; checks that the judgement agrees with itself.
    fn ok(&mut self, points: Vec<TrajectoryPoint>) -> bool {
        let judgement = self.judge(points);
        assert_eq!(judgement.failure, None);
        let names: Vec<_> = judgement.metrics.iter().map(|metric| metric.name).collect();
        assert_eq!(names, [RED_METRIC, AMBER_METRIC]);
        let dangers = judgement.metrics.iter().filter(|metric| metric.risk == RiskLevel::Danger).count();
        assert!(judgement.metrics.iter().all(|metric| metric.value == 0.0));
        assert_eq!(judgement.feasible, dangers == 0);
        assert_eq!(judgement.evidence.is_some(), !judgement.feasible);
        assert_eq!(self.filter.explain(&judgement).is_some(), !judgement.feasible);
        judgement.feasible
    }

    /// Why nothing could be judged.
    fn failure(&mut self) -> String {
        let judgement = self.judge(traj(0.0, 10.0, 5.0));
        assert!(!judgement.feasible && judgement.metrics.is_empty());
        assert_eq!(judgement.risk(), RiskLevel::Danger);
        judgement.failure.unwrap().to_string()
    }
}

/// What the one violation is, by colour.
fn violated(judgement: &Judgement) -> Option<&'static str> {
    let danger = judgement.metrics.iter().find(|metric| metric.risk == RiskLevel::Danger);
    danger.map(|metric| metric.name)
}
