//! Whatever the scene: what the shipped rules accept, with every filter enforced, a slow and simple checker finds nothing
//! wrong with.
//!
//! The checker knows nothing of the filters' code. It is written in the road's own frame, in which the scene was drawn,
//! and says for each candidate what is wrong with it beyond doubt: numbers that are none, times that go back, a stamp that
//! is too old, a speed or acceleration beyond the limits, a corner of the vehicle beyond a border at a point that comes
//! within two seconds or the braking distance, a bumper beyond the stop line of a red light, a body that drives into the
//! box of an object at the same time where braking would not avoid it either: at 1.5 m/s2 for an object that moves, at
//! 4 m/s2 for one that stands, which is what the collision check asks for. Each kind has to turn up among the candidates,
//! and many candidates have to pass, or the test says nothing.
//!
//! `SELECTOR_SCENES` says how many scenes.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

use lanelet_map::{Map, MapBuilder, Member};
use messages::autoware_internal_planning_msgs::{CandidateTrajectories, CandidateTrajectory, GeneratorInfo};
use messages::autoware_perception_msgs::{
    ObjectClassification, PredictedObject, PredictedObjects, PredictedPath, Shape, TrafficLightElement,
    TrafficLightGroup, TrafficLightGroupArray,
};
use messages::autoware_planning_msgs::{LaneletRoute, LaneletSegment, TrajectoryPoint};
use messages::builtin_interfaces::{Duration, Time};
use messages::geometry_msgs::{AccelWithCovarianceStamped, Point, Pose, Quaternion};
use messages::nav_msgs::Odometry;
use messages::std_msgs::Header;
use messages::unique_identifier_msgs::Uuid;
use motion::VehicleInfo;
use selection::filters::CLASSES;
use selection::parameters::{RankerParameters, ValidatorParameters};
use selection::pipeline::judge_in_order;
use selection::ranker::GeneratorSource;
use selection::scene::{Epoch, HdMap};
use selection::{Candidate, Concatenator, Pipeline, Ranker, Scene, Scratch, Validator};
use std::collections::BTreeMap;
use std::sync::Arc;

const NOW: Time = Time { sec: 1_000, nanosec: 0 };
const FRESH_S: f64 = 0.2;
/// Half of the road's width: where the borders are.
const BORDER_M: f64 = 2.5;
const ROAD: i64 = 1;
const LIGHT: i64 = 500;
const CANDIDATES: usize = 8;
const STEP_S: f64 = 0.1;
const POINTS: usize = 50;

/// Numbers that look random, the same for the same seed.
struct Random(u64);

impl Random {
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut mixed = self.0;
        mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((mixed ^ (mixed >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    fn chance(&mut self, share: f64) -> bool {
        self.unit() < share
    }

    fn one_of<T: Copy>(&mut self, choices: &[T]) -> T {
        choices[((self.unit() * choices.len() as f64) as usize).min(choices.len() - 1)]
    }
}

/// Where the road lies in the map.
#[derive(Clone, Copy)]
struct Place {
    x: f64,
    y: f64,
    yaw: f64,
}

impl Place {
    fn point(self, x: f64, y: f64) -> [f64; 3] {
        let (sin, cos) = self.yaw.sin_cos();
        [self.x + cos * x - sin * y, self.y + sin * x + cos * y, 0.0]
    }

    fn pose(self, [x, y, yaw]: [f64; 3]) -> Pose {
        let [x, y, z] = self.point(x, y);
        Pose { position: Point { x, y, z }, orientation: Quaternion::from_yaw(self.yaw + yaw) }
    }
}

/// A road user that goes along the road at a constant speed.
#[derive(Debug)]
struct Thing {
    x: f64,
    y: f64,
    speed: f64,
    size: [f64; 2],
    label: u8,
}

/// A plan in the road's frame: pose, speed, acceleration at each point.
type Plan = Vec<([f64; 3], f64, f64)>;

struct World {
    place: Place,
    line_x: f64,
    is_red: bool,
    speed: f64,
    things: Vec<Thing>,
    plans: Vec<Plan>,
    messages: Vec<CandidateTrajectory>,
}

fn street(place: Place, line_x: f64) -> Map {
    let mut builder = MapBuilder::new();
    let mut line = |id: i64, from: [f64; 2], to: [f64; 2], kind: &str| {
        let ends = [from, to].map(|[x, y]| place.point(x, y));
        builder.line_string_at(id, &ends, &[("type", kind)]).unwrap();
    };
    line(10, [-30.0, BORDER_M], [150.0, BORDER_M], "road_border");
    line(11, [-30.0, -BORDER_M], [150.0, -BORDER_M], "road_border");
    line(17, [line_x, -4.0], [line_x, 4.0], "stop_line");
    builder.lanelet(ROAD, 10, 11, &[("subtype", "road")]).unwrap();
    let light = [("ref_line", Member::LineString(17))];
    builder.regulatory_element(LIGHT, &light, &[("subtype", "traffic_light")]).unwrap();
    builder.attach(ROAD, LIGHT).unwrap();
    builder.build().unwrap()
}

/// Constant acceleration up to a standstill, and a soft shift to the side.
fn plan(random: &mut Random, world_speed: f64, y: f64) -> Plan {
    let acceleration =
        if random.chance(0.05) { random.between(-8.0, 8.0) } else { random.between(-4.0, 2.0) };
    let mut speed = if random.chance(0.05) { random.between(14.0, 20.0) } else { world_speed };
    let (shift, length) =
        (if random.chance(0.4) { 0.0 } else { random.between(-3.0, 3.0) }, random.between(15.0, 40.0));
    let mut x = 0.0;
    let mut points = Vec::new();
    for _ in 0..POINTS {
        let share = (x / length).min(1.0);
        let half_turn = std::f64::consts::PI * share;
        let slope =
            if share < 1.0 { shift * 0.5 * half_turn.sin() * std::f64::consts::PI / length } else { 0.0 };
        let is_standing = speed <= 0.0;
        points.push((
            [x, y + shift * 0.5 * (1.0 - half_turn.cos()), slope.atan()],
            speed,
            if is_standing { 0.0 } else { acceleration },
        ));
        let next = (speed + acceleration * STEP_S).max(0.0);
        x += 0.5 * (speed + next) * STEP_S * slope.atan().cos();
        speed = next;
    }
    points
}

fn message(random: &mut Random, place: Place, plan: &Plan) -> CandidateTrajectory {
    let point = |(index, (pose, speed, acceleration)): (usize, &([f64; 3], f64, f64))| TrajectoryPoint {
        time_from_start: Duration::from_nanoseconds((index as f64 * STEP_S * 1e9) as i64),
        pose: place.pose(*pose),
        longitudinal_velocity_mps: *speed as f32,
        acceleration_mps2: *acceleration as f32,
        ..TrajectoryPoint::default()
    };
    let mut message = CandidateTrajectory {
        header: Header { stamp: NOW, frame_id: "map".to_owned() },
        points: plan.iter().enumerate().map(point).collect(),
        ..CandidateTrajectory::default()
    };
    let spoiled = (random.unit() * POINTS as f64) as usize;
    match (random.unit() * 100.0) as u32 {
        0 => message.points[spoiled].pose.position.y = f64::NAN,
        1 => message.points[spoiled].acceleration_mps2 = f32::NEG_INFINITY,
        2 => message.points[spoiled.max(1)].time_from_start = Duration::from_nanoseconds(-1_000_000_000),
        3 => message.header.stamp = Time { sec: NOW.sec - 1, nanosec: 500_000_000 },
        _ => {}
    }
    message
}

impl World {
    fn draw(seed: u64) -> Self {
        let random = &mut Random(seed);
        let place = Place {
            x: random.between(-5e4, 5e4),
            y: random.between(-5e4, 5e4),
            yaw: random.between(-3.1, 3.1),
        };
        let speed = random.between(1.0, 12.0);
        let y = random.between(-0.8, 0.8);
        let thing = |random: &mut Random| Thing {
            x: random.between(10.0, 45.0),
            y: random.between(-2.0, 2.0),
            speed: if random.chance(0.5) { 0.0 } else { random.between(0.5, 3.0) },
            size: [random.between(0.5, 6.0), random.between(0.5, 2.2)],
            label: random.one_of(&[
                ObjectClassification::CAR,
                ObjectClassification::TRUCK,
                ObjectClassification::BICYCLE,
                ObjectClassification::PEDESTRIAN,
            ]),
        };
        let things = (0..random.one_of(&[0, 0, 1, 2])).map(|_| thing(random)).collect();
        let plans: Vec<Plan> = (0..CANDIDATES).map(|_| plan(random, speed, y)).collect();
        let messages = plans.iter().map(|plan| message(random, place, plan)).collect();
        Self {
            place,
            line_x: random.between(9.0, 18.0),
            is_red: random.chance(0.3),
            speed,
            things,
            plans,
            messages,
        }
    }

    fn object(&self, number: usize, thing: &Thing) -> PredictedObject {
        let mut object = PredictedObject {
            object_id: Uuid { uuid: [number as u8 + 1; 16] },
            ..PredictedObject::default()
        };
        object.classification = vec![ObjectClassification { label: thing.label, probability: 1.0 }];
        object.shape.r#type = Shape::BOUNDING_BOX;
        (object.shape.dimensions.x, object.shape.dimensions.y) = (thing.size[0], thing.size[1]);
        let at = |time_s: f64| self.place.pose([thing.x + thing.speed * time_s, thing.y, 0.0]);
        object.kinematics.initial_pose_with_covariance.pose = at(0.0);
        object.kinematics.initial_twist_with_covariance.twist.linear.x = thing.speed;
        object.kinematics.predicted_paths = vec![PredictedPath {
            path: (0..17).map(|step| at(0.5 * f64::from(step))).collect(),
            time_step: Duration { sec: 0, nanosec: 500_000_000 },
            confidence: 1.0,
        }];
        object
    }

    fn scene(&self, vehicle: Arc<VehicleInfo>) -> Scene {
        let header = Header { stamp: NOW, frame_id: "map".to_owned() };
        let mut scene = Scene::empty(NOW, vehicle);
        let mut odometry = Odometry { header: header.clone(), ..Odometry::default() };
        odometry.pose.pose = self.place.pose(self.plans[0][0].0);
        odometry.twist.twist.linear.x = self.speed;
        scene.odometry = Some(Arc::new(odometry));
        scene.acceleration =
            Some(Arc::new(AccelWithCovarianceStamped { header: header.clone(), ..Default::default() }));
        let objects =
            self.things.iter().enumerate().map(|(number, thing)| self.object(number, thing)).collect();
        scene.objects = Some(Arc::new(PredictedObjects { header, objects }));
        let element = TrafficLightElement {
            color: if self.is_red { TrafficLightElement::RED } else { TrafficLightElement::GREEN },
            shape: TrafficLightElement::CIRCLE,
            status: TrafficLightElement::SOLID_ON,
            confidence: 1.0,
        };
        let group = TrafficLightGroup {
            traffic_light_group_id: LIGHT,
            elements: vec![element],
            ..TrafficLightGroup::default()
        };
        let signals = TrafficLightGroupArray { stamp: NOW, traffic_light_groups: vec![group] };
        scene.traffic_signals = Some(Arc::new(signals));
        let map = HdMap::new("map".into(), Arc::new(street(self.place, self.line_x)));
        scene.map = Some(Epoch { number: 1, value: map });
        let mut segment = LaneletSegment::default();
        segment.preferred_primitive.id = ROAD;
        let route = LaneletRoute { segments: vec![segment], ..LaneletRoute::default() };
        scene.route = Some(Epoch { number: 1, value: Arc::new(route) });
        scene
    }
}

/// Corners of a rectangle, counter-clockwise.
fn corners([x, y, yaw]: [f64; 3], rear: f64, front: f64, half_width: f64) -> [[f64; 2]; 4] {
    let (sin, cos) = yaw.sin_cos();
    [[front, half_width], [-rear, half_width], [-rear, -half_width], [front, -half_width]]
        .map(|[along, left]| [x + cos * along - sin * left, y + sin * along + cos * left])
}

/// Whether two convex outlines overlap: no edge of either has the other on its far side.
fn overlap(a: &[[f64; 2]; 4], b: &[[f64; 2]; 4]) -> bool {
    let is_apart = |a: &[[f64; 2]; 4], b: &[[f64; 2]; 4]| {
        (0..4).any(|edge| {
            let (p, q) = (a[edge], a[(edge + 1) % 4]);
            b.iter().all(|r| (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]) < 0.0)
        })
    };
    !is_apart(a, b) && !is_apart(b, a)
}

/// The plan at a time, and how far along it that is.
fn at(plan: &Plan, time_s: f64) -> ([f64; 3], f64) {
    let place = (time_s / STEP_S).clamp(0.0, (plan.len() - 1) as f64);
    let (index, share) = (place.floor() as usize, place.fract());
    let way = |last: usize| -> f64 {
        plan[..=last]
            .windows(2)
            .map(|pair| (pair[1].0[0] - pair[0].0[0]).hypot(pair[1].0[1] - pair[0].0[1]))
            .sum()
    };
    let Some((next, ..)) = plan.get(index + 1) else { return (plan[index].0, way(index)) };
    let pose = std::array::from_fn(|k| plan[index].0[k] + share * (next[k] - plan[index].0[k]));
    (pose, way(index) + share * (way(index + 1) - way(index)))
}

/// The plan so far along.
fn along(plan: &Plan, way_m: f64) -> [f64; 3] {
    let mut left = way_m;
    for pair in plan.windows(2) {
        let piece = (pair[1].0[0] - pair[0].0[0]).hypot(pair[1].0[1] - pair[0].0[1]);
        if left <= piece && piece > 0.0 {
            return std::array::from_fn(|k| pair[0].0[k] + left / piece * (pair[1].0[k] - pair[0].0[k]));
        }
        left -= piece;
    }
    plan[plan.len() - 1].0
}

/// What is wrong with a candidate beyond doubt.
fn violations(
    world: &World,
    vehicle: &VehicleInfo,
    plan: &Plan,
    message: &CandidateTrajectory,
) -> Vec<&'static str> {
    const ROOM_M: f64 = 0.1;
    let mut found = Vec::new();
    let mut note = |is_wrong: bool, what: &'static str| found.extend(is_wrong.then_some(what));
    let numbers = message.points.iter().all(|point| {
        let (p, q) = (point.pose.position, point.pose.orientation);
        [p.x, p.y, p.z, q.x, q.y, q.z, q.w].iter().all(|number| number.is_finite())
            && point.longitudinal_velocity_mps.is_finite()
            && point.acceleration_mps2.is_finite()
    });
    note(!numbers, "not finite");
    note(NOW.seconds() - message.header.stamp.seconds() > FRESH_S + 0.01, "too old");
    let times: Vec<i64> = message.points.iter().map(|point| point.time_from_start.nanoseconds()).collect();
    note(times.windows(2).any(|pair| pair[1] < pair[0]), "time goes back");
    note(plan.iter().any(|(_, speed, _)| *speed > 16.71), "too fast");
    note(plan.iter().any(|(.., acceleration)| acceleration.abs() > 5.01), "too hard");
    let (front, rear) = (vehicle.max_longitudinal_offset_m(), -vehicle.min_longitudinal_offset_m());
    let half_width = vehicle.vehicle_width_m() / 2.0;
    let body = |pose: [f64; 3], room: f64| corners(pose, rear - room, front - room, half_width - room);
    let braking_m = world.speed + world.speed * world.speed / 8.0;
    let mut way_m = 0.0;
    for (index, (pose, ..)) in plan.iter().enumerate() {
        if index > 0 {
            let before = plan[index - 1].0;
            way_m += (pose[0] - before[0]).hypot(pose[1] - before[1]);
        }
        let is_near = index as f64 * STEP_S <= 1.95 || way_m <= braking_m - 0.5;
        if is_near && body(*pose, 0.0).iter().any(|corner| corner[1].abs() > BORDER_M + 0.02) {
            note(true, "over the border");
            break;
        }
    }
    let reach = plan.iter().map(|(pose, ..)| pose[0] + front * pose[2].cos()).fold(f64::MIN, f64::max);
    note(world.is_red && reach > world.line_x + 0.6, "over the line");
    for thing in &world.things {
        let thing_at = |time_s: f64| {
            let [length, width] = thing.size;
            corners([thing.x + thing.speed * time_s, thing.y, 0.0], length / 2.0, length / 2.0, width / 2.0)
        };
        // As planned, and braking: comfortably before what moves, firmly before what stands.
        let moves = thing.speed > 0.0;
        let (reaction_s, braking_mps2) = if moves { (0.5, 1.5) } else { (0.4, 4.0) };
        let (until_m, speed) = if moves {
            (at(plan, reaction_s).1, plan[(reaction_s / STEP_S) as usize].1)
        } else {
            (world.speed * reaction_s, world.speed)
        };
        let braked = |time_s: f64| {
            let braking_s = (time_s - reaction_s).clamp(0.0, speed / braking_mps2);
            let way = until_m + speed * braking_s - 0.5 * braking_mps2 * braking_s * braking_s;
            if time_s < reaction_s { at(plan, time_s).0 } else { along(plan, way) }
        };
        // Only what drives faster runs into the other: a vehicle that has stopped beside a road user is run into.
        let planned_speed = |time_s: f64| plan[((time_s / STEP_S) as usize).min(plan.len() - 1)].1;
        let braked_speed = |time_s: f64| {
            if time_s < reaction_s { speed } else { speed - braking_mps2 * (time_s - reaction_s) }
        };
        let meets = |pose_at: &dyn Fn(f64) -> [f64; 3], speed_at: &dyn Fn(f64) -> f64| {
            (0..90).map(|step| f64::from(step) * 0.05).any(|time_s| {
                speed_at(time_s) > thing.speed && overlap(&body(pose_at(time_s), ROOM_M), &thing_at(time_s))
            })
        };
        if meets(&|time_s| at(plan, time_s).0, &planned_speed) && meets(&braked, &braked_speed) {
            note(true, "into an object");
            break;
        }
    }
    found
}

/// Every filter, enforced, with the shipped parameters.
fn pipeline(vehicle: &VehicleInfo) -> Pipeline {
    let parameters = ValidatorParameters {
        filter_names: CLASSES.iter().map(|class| class.class_name.to_owned()).collect(),
        shadow_mode_filter_names: Vec::new(),
        ..ValidatorParameters::default()
    };
    let sources = GeneratorSource::table(&["DiffusionPlanner_"]);
    Pipeline::new(
        Validator::new(parameters, vehicle).unwrap(),
        Ranker::new(RankerParameters::default(), sources),
    )
}

#[test]
fn what_is_accepted_passes_an_independent_check() {
    let scenes = std::env::var("SELECTOR_SCENES").ok().and_then(|n| n.parse().ok()).unwrap_or(3000_u64);
    let first = std::env::var("SELECTOR_FIRST_SCENE").ok().and_then(|n| n.parse().ok()).unwrap_or(0_u64);
    let vehicle = Arc::new(VehicleInfo::default());
    let (mut judged, mut accepted) = (0_u64, 0_u64);
    let mut seen: BTreeMap<&str, u64> = BTreeMap::new();
    for seed in first..first + scenes {
        let world = World::draw(seed.wrapping_mul(0x2545_F491_4F6C_DD1D));
        let scene = world.scene(vehicle.clone());
        let mut concatenator = Concatenator::new(FRESH_S);
        concatenator.add(&CandidateTrajectories {
            candidate_trajectories: world.messages.iter().cloned().map(Arc::new).collect(),
            generator_info: vec![GeneratorInfo::default()],
        });
        let concatenated = concatenator.get(NOW);
        let judge = |validator: &Validator, scene: &Scene, candidates: &[Candidate]| {
            judge_in_order(validator, scene, candidates, &mut Scratch::default(), || 0)
        };
        let step = pipeline(&vehicle).step(&scene, &concatenated, &judge, || 0);
        let is_published = |message: &CandidateTrajectory| {
            // Points that are no numbers are not equal to themselves, and must not be there anyway.
            step.validated.candidate_trajectories.iter().any(|published| **published == *message)
        };
        let published = step.validated.candidate_trajectories.len();
        let mut matched = 0;
        for (plan, message) in world.plans.iter().zip(&world.messages) {
            let wrong = violations(&world, &vehicle, plan, message);
            judged += 1;
            wrong.iter().for_each(|what| *seen.entry(what).or_default() += 1);
            if is_published(message) {
                matched += 1;
                accepted += 1;
                let told = step.verdicts.iter().zip(&concatenated.candidates);
                let told = told.filter(|(_, candidate)| *candidate.message == *message);
                let told: Vec<_> = told.map(|(verdict, _)| &verdict.judgements).collect();
                assert!(
                    wrong.is_empty(),
                    "scene {seed}: accepted, but {wrong:?}\n{:?}\n{plan:?}\n{told:#?}",
                    world.things
                );
            }
        }
        assert_eq!(matched, published, "scene {seed}: something else is published");
    }
    println!("{scenes} scenes, {accepted} of {judged} candidates accepted, wrong: {seen:?}");
    assert!(
        accepted * 20 > judged,
        "{accepted} of {judged} accepted: the scenes are too hard to say anything"
    );
    let kinds = [
        "into an object",
        "not finite",
        "over the border",
        "over the line",
        "time goes back",
        "too fast",
        "too hard",
        "too old",
    ];
    for kind in kinds {
        assert!(seen.get(kind).is_some_and(|count| *count * 2000 > judged), "{kind} is too rare: {seen:?}");
    }
}
