//! A selector's cycles on arbitrary scenes: whatever is accepted, simple checks find nothing wrong with, and no filter
//! panics.

use super::are_one_in;
use super::open_space_scene::Hundredths;
use super::texts::{SCRATCH, no_filter_panicked};
use arbitrary::{Arbitrary, Unstructured};
use lanelet_map::{Map, MapBuilder, Member};
use messages::autoware_internal_planning_msgs::{CandidateTrajectories, CandidateTrajectory, GeneratorInfo};
use messages::autoware_perception_msgs::{
    ObjectClassification, PredictedObject, PredictedObjects, PredictedPath, TrafficLightElement,
    TrafficLightGroup, TrafficLightGroupArray,
};
use messages::autoware_planning_msgs::{LaneletRoute, LaneletSegment, TrajectoryPoint};
use messages::builtin_interfaces::{Duration, Time};
use messages::geometry_msgs::{AccelWithCovarianceStamped, Point, Point32, Pose, Quaternion};
use messages::nav_msgs::Odometry;
use messages::std_msgs::{Header, Text};
use messages::unique_identifier_msgs::Uuid;
use motion::VehicleInfo;
use selection::filters::CLASSES;
use selection::parameters::{RankerParameters, ValidatorParameters};
use selection::pipeline::{Step, judge_in_order};
use selection::ranker::GeneratorSource;
use selection::scene::{Epoch, HdMap};
use selection::{Candidate, Concatenated, Concatenator, Pipeline, Ranker, Scene, Validator};
use std::sync::{Arc, LazyLock};

const START_S: i32 = 1_000;
const FRESH_S: f64 = 0.2;
const ROAD: i64 = 1;
const LIGHT: i64 = 500;
/// One input in so many is cut at [`LONGER`].
const LONG: u64 = 8;
/// Drives and lists are cut here: a run takes a fraction of a millisecond.
const SMALL: Size = Size { moments: 2, list: 4, points: 20 };
/// Here where the hash of the bytes says so.
const LONGER: Size = Size { moments: 4, list: 5, points: 30 };
/// And here in the few runs in a thousand that are drawn so.
const LARGE: Size = Size { moments: 4, list: 12, points: 120 };

/// How long drives and lists may be.
#[derive(Clone, Copy)]
struct Size {
    moments: usize,
    list: usize,
    points: usize,
}

type Metres = Hundredths<4000>;
type Radians = Hundredths<315>;
type Small = Hundredths<800>;

/// A step of a plan.
#[derive(Debug, Arbitrary)]
struct Advance {
    /// Hundredths of a second.
    time: u8,
    /// Of a quarter turn in each direction, over the step.
    turn: i8,
    acceleration: i8,
}

/// A number of a point that is spoiled.
#[derive(Debug, Arbitrary)]
enum Spoiled {
    X(f64),
    Y(f64),
    Z(f64),
    Orientation([f64; 4]),
    Speed(f32),
    Sideways(f32),
    Acceleration(f32),
    Time(i32, u32),
    Steering(f32),
    RearSteering(f32),
    Turning(f32),
}

#[derive(Debug, Arbitrary)]
struct Plan {
    y: Hundredths<300>,
    yaw: Hundredths<50>,
    speed: Hundredths<1800>,
    age: u8,
    /// Another than the map's if all ones.
    frame: u8,
    /// By number; the larger half of the numbers keeps its lane.
    generator: u8,
    steps: Vec<Advance>,
    spoiled: Vec<(u8, Spoiled)>,
    /// The last step again and again, so many times.
    more: u8,
}

#[derive(Debug, Arbitrary)]
struct Thing {
    id: u8,
    x: Metres,
    y: Small,
    yaw: Radians,
    speed: Small,
    shape: u8,
    size: [Small; 3],
    outline: Vec<(i8, i8)>,
    labels: Vec<(u8, u8)>,
    /// Milliseconds between the poses.
    step: u16,
    paths: Vec<Vec<(Metres, Small)>>,
}

#[derive(Debug, Arbitrary)]
struct Moment {
    /// Milliseconds since the moment before.
    passed: i16,
    ego: (Metres, Small, Radians),
    speed: Small,
    acceleration: Small,
    lamps: Vec<(u8, u8, u8)>,
    things: Vec<Thing>,
    plans: Vec<Plan>,
}

#[derive(Debug, Arbitrary)]
struct Drawn {
    /// Large if all ones.
    size: u8,
    has_route: bool,
    is_far_away: bool,
    moments: Vec<Moment>,
}

fn street() -> Map {
    let mut builder = MapBuilder::new();
    let mut line = |id: i64, ends: [[f64; 2]; 2], kind: &str| {
        let ends = ends.map(|[x, y]| [x, y, 0.0]);
        builder.line_string_at(id, &ends, &[("type", kind)]).expect("a line of its own");
    };
    line(10, [[-30.0, 2.5], [100.0, 2.5]], "road_border");
    line(11, [[-30.0, -2.5], [100.0, -2.5]], "road_border");
    line(14, [[22.0, -6.0], [22.0, 6.0]], "pedestrian_marking");
    line(15, [[26.0, -6.0], [26.0, 6.0]], "pedestrian_marking");
    line(16, [[18.0, -5.0], [18.0, 5.0]], "stop_line");
    line(17, [[12.0, -5.0], [12.0, 5.0]], "stop_line");
    let built = || {
        builder.lanelet(ROAD, 10, 11, &[("subtype", "road")])?;
        builder.lanelet(3, 14, 15, &[("subtype", "crosswalk")])?;
        let crosswalk = [("refers", Member::Lanelet(3)), ("ref_line", Member::LineString(16))];
        builder.regulatory_element(600, &crosswalk, &[("subtype", "crosswalk")])?;
        builder.attach(ROAD, 600)?;
        let light = [("ref_line", Member::LineString(17))];
        builder.regulatory_element(LIGHT, &light, &[("subtype", "traffic_light")])?;
        builder.attach(ROAD, LIGHT)?;
        builder.build()
    };
    built().expect("a map that fits together")
}

fn pose(x: f64, y: f64, yaw: f64) -> Pose {
    Pose { position: Point { x, y, z: 0.0 }, orientation: Quaternion::from_yaw(yaw) }
}

fn header(stamp: Time, frame: &str) -> Header {
    Header { stamp, frame_id: frame.to_owned() }
}

impl Plan {
    fn message(&self, size: Size, now: Time, far_m: f64) -> CandidateTrajectory {
        // Of what is drawn at random hardly anything stays on the road for long, so that hardly anything would be accepted.
        let is_steady = self.generator > 127;
        let part = if is_steady { 0.05 } else { 1.0 };
        let (mut x, mut y, mut yaw, mut time_s) = (far_m, part * self.y.0, part * self.yaw.0, 0.0);
        let mut speed = if is_steady { self.speed.0.abs() } else { self.speed.0 };
        let mut points = Vec::new();
        let last = self.steps.last();
        let more = std::iter::repeat_n(last, usize::from(self.more)).flatten();
        for step in self.steps.iter().chain(more).take(size.points) {
            let acceleration = part * f64::from(step.acceleration) / 20.0;
            points.push(TrajectoryPoint {
                time_from_start: Duration::from_nanoseconds((time_s * 1e9) as i64),
                pose: pose(x, y, yaw),
                longitudinal_velocity_mps: speed as f32,
                acceleration_mps2: acceleration as f32,
                ..TrajectoryPoint::default()
            });
            let dt = if is_steady { 0.1 } else { f64::from(step.time) / 100.0 };
            yaw += part * f64::from(step.turn) / 128.0 * std::f64::consts::FRAC_PI_2 * dt;
            (x, y) = (x + speed * dt * yaw.cos(), y + speed * dt * yaw.sin());
            (speed, time_s) = ((speed + acceleration * dt).max(0.0), time_s + dt);
        }
        for (index, spoiled) in self.spoiled.iter().take(size.list) {
            let count = points.len().max(1);
            let Some(point) = points.get_mut(usize::from(*index) % count) else { continue };
            let place = &mut point.pose.position;
            match *spoiled {
                Spoiled::X(x) => place.x = x,
                Spoiled::Y(y) => place.y = y,
                Spoiled::Z(z) => place.z = z,
                Spoiled::Orientation([x, y, z, w]) => point.pose.orientation = Quaternion { x, y, z, w },
                Spoiled::Speed(speed) => point.longitudinal_velocity_mps = speed,
                Spoiled::Sideways(speed) => point.lateral_velocity_mps = speed,
                Spoiled::Acceleration(acceleration) => point.acceleration_mps2 = acceleration,
                Spoiled::Time(sec, nanosec) => point.time_from_start = Duration { sec, nanosec },
                Spoiled::Steering(angle) => point.front_wheel_angle_rad = angle,
                Spoiled::RearSteering(angle) => point.rear_wheel_angle_rad = angle,
                Spoiled::Turning(rate) => point.heading_rate_rps = rate,
            }
        }
        let stamp = Time::from_nanoseconds(now.nanoseconds() - i64::from(self.age) * 1_000_000);
        CandidateTrajectory {
            header: header(stamp, if self.frame == u8::MAX { "odom" } else { "map" }),
            generator_id: Uuid { uuid: [self.generator % 4; 16] },
            points,
            ..CandidateTrajectory::default()
        }
    }
}

impl Thing {
    fn object(&self, size: Size, far_m: f64) -> PredictedObject {
        let mut object =
            PredictedObject { object_id: Uuid { uuid: [self.id; 16] }, ..PredictedObject::default() };
        let labels = self.labels.iter().take(size.list);
        object.classification = labels
            .map(|(label, share)| ObjectClassification {
                label: *label,
                probability: f32::from(*share) / 255.0,
            })
            .collect();
        object.shape.r#type = self.shape % 4;
        let extent = &mut object.shape.dimensions;
        [extent.x, extent.y, extent.z] = [0, 1, 2].map(|k| self.size[k].0);
        let corner = |(x, y): &(i8, i8)| Point32 { x: f32::from(*x) / 16.0, y: f32::from(*y) / 16.0, z: 0.0 };
        object.shape.footprint.points = self.outline.iter().take(size.list).map(corner).collect();
        let kinematics = &mut object.kinematics;
        kinematics.initial_pose_with_covariance.pose = pose(far_m + self.x.0, self.y.0, self.yaw.0);
        kinematics.initial_twist_with_covariance.twist.linear.x = self.speed.0;
        let path = |path: &Vec<(Metres, Small)>| PredictedPath {
            path: path.iter().take(size.list).map(|(x, y)| pose(far_m + x.0, y.0, self.yaw.0)).collect(),
            time_step: Duration::from_nanoseconds(i64::from(self.step) * 1_000_000),
            confidence: 1.0,
        };
        kinematics.predicted_paths = self.paths.iter().take(4).map(path).collect();
        object
    }
}

impl Drawn {
    fn size(&self, bytes: &[u8]) -> Size {
        match self.size {
            u8::MAX => LARGE,
            _ if are_one_in(LONG, bytes) => LONGER,
            _ => SMALL,
        }
    }

    fn scene(&self, size: Size, moment: &Moment, now: Time, far_m: f64) -> Scene {
        // With what filters derive from it: in a vehicle, too, the map is the same for many cycles.
        static STREET: LazyLock<HdMap> = LazyLock::new(|| HdMap::new("map".into(), Arc::new(street())));
        let mut scene = Scene::empty(now, Arc::new(VehicleInfo::default()));
        let mut odometry = Odometry { header: header(now, "map"), ..Odometry::default() };
        odometry.pose.pose = pose(far_m + moment.ego.0.0, moment.ego.1.0, moment.ego.2.0);
        odometry.twist.twist.linear.x = moment.speed.0;
        scene.odometry = Some(Arc::new(odometry));
        let mut acceleration = AccelWithCovarianceStamped {
            header: header(now, "map"),
            ..AccelWithCovarianceStamped::default()
        };
        acceleration.accel.accel.linear.x = moment.acceleration.0;
        scene.acceleration = Some(Arc::new(acceleration));
        let objects = moment.things.iter().take(size.list).map(|thing| thing.object(size, far_m)).collect();
        scene.objects = Some(Arc::new(PredictedObjects { header: header(now, "map"), objects }));
        let lamp = |(color, shape, status): &(u8, u8, u8)| TrafficLightElement {
            color: *color,
            shape: *shape,
            status: *status,
            confidence: 1.0,
        };
        let group = TrafficLightGroup {
            traffic_light_group_id: LIGHT,
            elements: moment.lamps.iter().take(size.list).map(lamp).collect(),
            ..TrafficLightGroup::default()
        };
        let signals = TrafficLightGroupArray { stamp: now, traffic_light_groups: vec![group] };
        scene.traffic_signals = Some(Arc::new(signals));
        scene.map = Some(Epoch { number: 1, value: STREET.clone() });
        if self.has_route {
            let mut segment = LaneletSegment::default();
            segment.preferred_primitive.id = ROAD;
            let route = LaneletRoute { segments: vec![segment], ..LaneletRoute::default() };
            scene.route = Some(Epoch { number: 1, value: Arc::new(route) });
        }
        scene
    }
}

/// Every filter, enforced, with the shipped parameters.
static PARAMETERS: LazyLock<ValidatorParameters> = LazyLock::new(|| ValidatorParameters {
    filter_names: CLASSES.iter().map(|class| class.class_name.to_owned()).collect(),
    shadow_mode_filter_names: Vec::new(),
    ..ValidatorParameters::default()
});

/// Planners by number: two that may be chosen, and one that nobody knows.
const PLANNERS: [&str; 3] = ["DiffusionPlanner_0", "MinimumRuleBasedPlanner_Stop", "Other"];

/// Without memory of anything.
fn pipeline(vehicle: &VehicleInfo, ranks_by_quality: bool) -> Pipeline {
    let validator = Validator::new(PARAMETERS.clone(), vehicle).expect("these filters are built");
    let sources = GeneratorSource::table(&["DiffusionPlanner_", "MinimumRuleBasedPlanner_Stop"]);
    let mut ranking = RankerParameters::default();
    ranking.evaluation.enable = ranks_by_quality;
    Pipeline::new(validator, Ranker::new(ranking, sources))
}

fn known(number: u8) -> GeneratorInfo {
    let generator_name = Text { data: PLANNERS[usize::from(number)].to_owned() };
    GeneratorInfo { generator_id: Uuid { uuid: [number; 16] }, generator_name }
}

/// What is wrong with what was accepted.
fn objection(message: &CandidateTrajectory, now: Time) -> Option<&'static str> {
    let limits = &PARAMETERS.vehicle_constraint;
    let points = &message.points;
    let is_finite = |point: &TrajectoryPoint| {
        let (p, q) = (point.pose.position, point.pose.orientation);
        let numbers = [p.x, p.y, p.z, q.x, q.y, q.z, q.w];
        numbers.iter().all(|number| number.is_finite())
            && [point.longitudinal_velocity_mps, point.lateral_velocity_mps, point.acceleration_mps2]
                .iter()
                .chain(&[point.heading_rate_rps, point.front_wheel_angle_rad, point.rear_wheel_angle_rad])
                .all(|number| number.is_finite())
    };
    let speed = |point: &TrajectoryPoint| {
        f64::from(point.longitudinal_velocity_mps).hypot(point.lateral_velocity_mps.into())
    };
    let (hardest, softest) = (limits.max_acceleration + 1e-3, -limits.max_deceleration - 1e-3);
    let acceleration = |point: &TrajectoryPoint| f64::from(point.acceleration_mps2);
    let times = points.windows(2).map(|pair| [&pair[0], &pair[1]].map(|p| p.time_from_start.nanoseconds()));
    let age_ns = now.nanoseconds() - message.header.stamp.nanoseconds();
    if points.len() < 2 {
        Some("no trajectory")
    } else if !points.iter().all(is_finite) {
        Some("a number that is none")
    } else if times.into_iter().any(|[before, after]| after < before) {
        Some("time goes back")
    } else if points.iter().any(|point| speed(point) > limits.max_speed + 1e-3) {
        Some("too fast")
    } else if !points.iter().all(|point| (softest..=hardest).contains(&acceleration(point))) {
        Some("too hard")
    } else if message.header.frame_id != "map" {
        Some("in another frame")
    } else {
        (age_ns as f64 > (FRESH_S + 1e-6) * 1e9).then_some("too old")
    }
}

/// Nothing leaves a step but what it accepted, as it came in, and scores are numbers.
fn look_at_what_leaves(step: &Step, concatenated: &Concatenated, now: Time) {
    let candidates = &concatenated.candidates;
    assert_eq!(step.ranking.failure, None);
    assert_eq!(step.verdicts.len(), candidates.len());
    assert_eq!(step.reports.reports.len(), candidates.len());
    let judged = candidates.iter().zip(&step.verdicts);
    let accepted: Vec<_> = judged.filter(|(_, verdict)| verdict.accepted).map(|(c, _)| &c.message).collect();
    let validated = &step.validated.candidate_trajectories;
    assert_eq!(validated.len(), accepted.len());
    assert!(validated.iter().zip(&accepted).all(|(message, accepted)| Arc::ptr_eq(message, accepted)));
    for message in validated {
        let objection = objection(message, now);
        assert!(objection.is_none(), "accepted, but {}: {message:#?}", objection.unwrap_or_default());
    }
    for scored in &step.scored.scored_candidate_trajectories {
        assert!(scored.score.is_finite(), "{}", scored.score);
        let message = &scored.candidate_trajectory;
        assert!(accepted.iter().any(|accepted| Arc::ptr_eq(message, accepted)), "scored, but not accepted");
    }
    let Some(selected) = &step.selected else {
        assert!(step.ranking.best().is_none(), "the best is not chosen");
        return;
    };
    assert!(selected.score.is_finite());
    let place = candidates.iter().position(|candidate| candidate.key == selected.key);
    let place = place.filter(|&place| step.verdicts[place].accepted).expect("what is chosen was accepted");
    let message = &candidates[place].message;
    assert!(selected.trajectory.header == message.header && selected.trajectory.points == message.points);
}

/// A drive of some moments.
pub fn cycle(bytes: &[u8]) {
    let Ok(drawn) = Drawn::arbitrary_take_rest(Unstructured::new(bytes)) else { return };
    let size = drawn.size(bytes);
    let far_m = if drawn.is_far_away { 90_000.0 } else { 0.0 };
    let mut pipeline = pipeline(&VehicleInfo::default(), drawn.has_route);
    let mut concatenator = Concatenator::new(FRESH_S);
    let mut now = Time { sec: START_S, nanosec: 0 };
    for moment in drawn.moments.iter().take(size.moments) {
        now = Time::from_nanoseconds(now.nanoseconds() + i64::from(moment.passed) * 1_000_000);
        let scene = drawn.scene(size, moment, now, far_m);
        let plans = moment.plans.iter().take(size.list);
        concatenator.add(&CandidateTrajectories {
            candidate_trajectories: plans.map(|plan| Arc::new(plan.message(size, now, far_m))).collect(),
            generator_info: (0..3).map(known).collect(),
        });
        let concatenated = concatenator.get(now);
        let judge = |validator: &Validator, scene: &Scene, candidates: &[Candidate]| {
            SCRATCH.with_borrow_mut(|scratch| judge_in_order(validator, scene, candidates, scratch, || 0))
        };
        let step = pipeline.step(&scene, &concatenated, &judge, || 0);
        step.verdicts.iter().for_each(no_filter_panicked);
        look_at_what_leaves(&step, &concatenated, now);
    }
}
