//! What the filter does not look at changes nothing: scenes drawn at random, judged by the filter and by a loop that
//! looks at every way of every object, in the order of the message, as if nothing were known.

use super::*;
use crate::parameters::{ObjectClass, PerClass};
use crate::scene::Epoch;
use crate::test_scene::{candidate_of, scene};
use lanelet_map::MapBuilder;
use messages::autoware_perception_msgs::{ObjectClassification, PredictedObject, PredictedPath, Shape};
use messages::builtin_interfaces::Duration;
use messages::geometry_msgs::{Point, Pose, Quaternion};
use messages::std_msgs::Header;
use motion::{TimeFromStart, TrajectoryPoint};
use proptest::prelude::*;

/// Looks at everything: no way is passed over, and no braking is spared.
fn plainly(filter: &CollisionCheckFilter, candidate: &Candidate, work: &mut Workspace) -> Judgement {
    let (cycle, priority) = (filter.cycle.as_ref().unwrap(), filter.priority.as_ref().unwrap());
    let situation = filter.situation(cycle, priority, candidate, 0.0, work);
    let mut findings = Findings::new(&filter.settings);
    findings.memo.without_predicted_path = filter.objects.lack_path;
    let nothing = Findings::new(&filter.settings);
    for course in &filter.objects.courses {
        let object = &filter.objects.objects[course.object];
        let resolution_s = filter.settings.resolution_s;
        let known = Known { findings: &nothing, number: course.place + 1, lifts_paths: false, resolution_s };
        work.ego.plan_sweep(&filter.settings, course.ego_outline);
        let turn = Turn::at_once(course);
        match situation.assess((object, course), turn, &mut work.ego, &mut work.drac, known) {
            Outcome::Clear => {}
            Outcome::Known => panic!("nothing is known"),
            Outcome::NotAssessed(method) => findings.leave_open(method),
            Outcome::Evaluated(evaluation) => {
                if !(evaluation.method.is_map_based() && filter.lifts_paths(object)) {
                    filter.take((object, course), &evaluation, work, &mut findings);
                }
            }
        }
    }
    filter.assess_distances(cycle, candidate, work, &mut findings);
    judgement(candidate, 0.0, &findings)
}

/// A place after a distance along an arc.
fn along((x, y, yaw): (f64, f64, f64), turn: f64, distance_m: f64) -> (f64, f64, f64) {
    let half = 0.5 * turn * distance_m;
    let chord = if half.abs() < 1e-9 { distance_m } else { distance_m * half.sin() / half };
    (x + chord * (yaw + half).cos(), y + chord * (yaw + half).sin(), yaw + 2.0 * half)
}

#[derive(Debug, Clone)]
struct User {
    place: (f64, f64, f64),
    speed_mps: f64,
    turns: Vec<f64>,
    label: u8,
    size: (f64, f64),
    id: u8,
}

impl User {
    fn message(&self) -> PredictedObject {
        let pose = |(x, y, yaw): (f64, f64, f64)| Pose {
            position: Point { x, y, z: 0.0 },
            orientation: Quaternion::from_yaw(yaw),
        };
        let mut object =
            PredictedObject { object_id: Uuid { uuid: [self.id; 16] }, ..PredictedObject::default() };
        object.classification = vec![ObjectClassification { label: self.label, probability: 1.0 }];
        object.kinematics.initial_pose_with_covariance.pose = pose(self.place);
        let twist = &mut object.kinematics.initial_twist_with_covariance.twist;
        twist.linear.x = self.speed_mps;
        twist.angular.z = self.turns.first().map_or(0.0, |turn| turn * self.speed_mps);
        object.shape.r#type = Shape::BOUNDING_BOX;
        (object.shape.dimensions.x, object.shape.dimensions.y) = self.size;
        object.kinematics.predicted_paths = self
            .turns
            .iter()
            .map(|&turn| PredictedPath {
                path: (0..17)
                    .map(|k| pose(along(self.place, turn, self.speed_mps * 0.5 * f64::from(k))))
                    .collect(),
                time_step: Duration::from_nanoseconds(500_000_000),
                confidence: 1.0,
            })
            .collect();
        object
    }
}

fn observed(users: &[User], speed_mps: f64) -> Scene {
    let mut scene = scene();
    let header = Header { stamp: scene.now, frame_id: "map".to_owned() };
    let map = Arc::new(MapBuilder::new().build().unwrap());
    scene.map = Some(Epoch { number: 1, value: HdMap::new("map".into(), map) });
    let mut odometry = Odometry { header: header.clone(), ..Odometry::default() };
    odometry.twist.twist.linear.x = speed_mps;
    scene.odometry = Some(Arc::new(odometry));
    let objects = users.iter().map(User::message).collect();
    scene.objects = Some(Arc::new(PredictedObjects { header, objects }));
    scene
}

fn candidate(speed_mps: f64, acceleration_mps2: f64, turn: f64, command: u8) -> Candidate {
    let mut distance_m = 0.0;
    let points = (0..80).map(|k| {
        let speed = (speed_mps + 0.1 * acceleration_mps2 * f64::from(k)).max(0.0);
        let (x, y, yaw) = along((0.0, 0.0, 0.0), turn, distance_m);
        distance_m += 0.1 * speed;
        TrajectoryPoint {
            time_from_start: TimeFromStart::from_nanos(i64::from(k) * 100_000_000),
            pose: motion::Pose::from_xy_yaw(x, y, yaw),
            longitudinal_velocity_mps: speed as f32,
            ..TrajectoryPoint::default()
        }
    });
    let mut candidate = candidate_of(points.collect());
    let mut message = (*candidate.message).clone();
    message.turn_indicators_command.command = command;
    candidate.message = Arc::new(message);
    candidate
}

prop_compose! {
    fn any_user()(
        ahead in -10.0..60.0_f64, aside in prop_oneof![-4.0..4.0_f64, -30.0..30.0_f64],
        yaw in prop_oneof![Just(0.0), Just(1.6), Just(-1.6), Just(3.1), -3.2..3.2_f64],
        speed_mps in prop_oneof![Just(0.0), 0.0..14.0_f64],
        turns in proptest::collection::vec(-0.05..0.05_f64, 0..3),
        label in 0..12_u8, size in (0.3..6.0_f64, 0.3..2.5_f64), id in 0..6_u8,
    ) -> User {
        User { place: (ahead, aside, yaw), speed_mps, turns, label, size, id }
    }
}

prop_compose! {
    /// Cases switched on and off, thresholds that differ by class, cases that may be given up, margins.
    fn any_parameters()(
        is_shipped in any::<bool>(),
        on in proptest::collection::vec(any::<bool>(), 6),
        (base, own) in (-2.5..-0.5_f64, -2.5..-0.5_f64),
        same_threshold in any::<bool>(),
        bias in prop_oneof![Just(0.0), Just(0.0), -1.0..1.5_f64],
        waits in any::<bool>(),
    ) -> CollisionCheckParameters {
        let mut parameters = CollisionCheckParameters::default();
        if is_shipped {
            return parameters;
        }
        let drac = &mut parameters.drac;
        let map = &mut drac.map_based;
        drac.constant_curvature.ego_earlier.enable_assessment = PerClass::all(on[0]);
        map.ego_prioritized_ego_earlier.enable_assessment = PerClass::all(on[1]);
        map.object_prioritized_object_earlier.enable_assessment =
            PerClass::all(true).with(ObjectClass::Truck, on[2]);
        map.object_prioritized_ego_earlier.enable_assessment = PerClass::all(true).with(ObjectClass::Bus, on[3]);
        let given_up = PerClass::all(false).with(ObjectClass::Car, on[4]).with(ObjectClass::Bicycle, on[5]);
        map.object_prioritized_object_earlier.ego_drac_acceleration.enable_abandon = given_up;
        if !same_threshold {
            map.object_prioritized_object_earlier.ego_drac_acceleration.safe_limit =
                PerClass::all(base).with(ObjectClass::Pedestrian, own);
            drac.constant_curvature.object_earlier.ego_drac_acceleration.safe_limit =
                PerClass::all(own).with(ObjectClass::Car, base);
        }
        drac.pet_margin.object_earlier_judgement_bias = PerClass::all(bias);
        map.mutual_yield_timeout_arbitration.enabled = PerClass::all(waits);
        map.mutual_yield_timeout_arbitration.min_wait_time = PerClass::all(-1.0);
        parameters
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn what_is_passed_over_changes_nothing(
        users in proptest::collection::vec(any_user(), 1..14),
        parameters in any_parameters(),
        (speed_mps, acceleration_mps2, turn) in (0.0..14.0_f64, -1.5..1.5_f64, -0.03..0.03_f64),
        command in 0..3_u8,
    ) {
        let scene = observed(&users, speed_mps);
        let mut filter = CollisionCheckFilter::new(&parameters, &VehicleInfo::default());
        filter.observe(&scene);
        let candidate = candidate(speed_mps, acceleration_mps2, turn, command);
        let mut scratch = Scratch::default();
        let judged = filter.judge(&scene, &candidate, &mut scratch);
        let plain = plainly(&filter, &candidate, &mut scratch.collision_check);
        prop_assert_eq!(format!("{judged:?}"), format!("{plain:?}"));
    }
}

/// Where the path first touches an object, every sample swept and looked at.
fn touch_plainly(filter: &CollisionCheckFilter, place: usize, work: &mut Workspace) -> Option<Touch> {
    let (outline, standing) = (&filter.settings.rss_outline, &filter.objects.standing);
    let Workspace { ego, rss_slice, rss_tail, hulls, .. } = work;
    let object = &filter.objects.objects[place].outline;
    let mut touches = |sweep: &Sweep, at| slices_meet((outline, sweep, at), (object, standing, place), hulls);
    let planned = &ego.planned;
    let touch = |sample: usize, step: usize| Touch {
        distance_m: planned.distances_m[sample],
        time_s: step as f64 * filter.settings.resolution_s,
        place: planned.poses[step],
    };
    rss_slice.clear();
    rss_slice.push(outline, planned.poses[0], planned.poses[0], &Deviation::default());
    if touches(rss_slice, 0) {
        return Some(touch(0, 0));
    }
    for step in 0..planned.steps() {
        planned.sweep_step(step, outline, rss_slice);
        if touches(rss_slice, 0) {
            return Some(touch(step + 1, step));
        }
    }
    let slice = (0..rss_tail.len()).find(|&slice| touches(rss_tail, slice))?;
    let (distance_m, time_s) = ego.path.distance_and_time(filter.first_tail_point(ego) + slice);
    Some(Touch { distance_m, time_s, place: rss_tail.slice(slice).start })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    /// Samples that are not swept, since boxes show that they come near to nothing, touch nothing.
    #[test]
    fn samples_that_are_passed_over_touch_nothing(
        users in proptest::collection::vec(any_user(), 1..14),
        (speed_mps, acceleration_mps2, turn) in (0.0..14.0_f64, -1.5..1.5_f64, -0.3..0.3_f64),
        margins in proptest::array::uniform3(0.0..1.5_f64),
        far_m in prop_oneof![Just(0.0), Just(1e6)],
    ) {
        let mut parameters = CollisionCheckParameters::default();
        let margin = &mut parameters.rss.ego_footprint_margin;
        [margin.lateral, margin.front, margin.rear] = margins;
        let mut candidate = candidate(speed_mps, acceleration_mps2, turn, 0);
        let mut points = candidate.points.to_vec();
        points.iter_mut().for_each(|point| point.pose.position.y += far_m);
        candidate = candidate_of(points);
        let users: Vec<User> = users
            .into_iter()
            .map(|user| User { place: (user.place.0, user.place.1 + far_m, user.place.2), ..user })
            .collect();
        let mut filter = CollisionCheckFilter::new(&parameters, &VehicleInfo::default());
        filter.observe(&observed(&users, speed_mps));
        let mut work = Workspace::default();
        let (cycle, priority) = (filter.cycle.as_ref().unwrap(), filter.priority.as_ref().unwrap());
        filter.situation(cycle, priority, &candidate, 0.0, &mut work);
        let bounds = filter.sweep_path(&mut work);
        for (place, object) in filter.objects.objects.iter().enumerate() {
            let touch = filter.first_touch(place, object, &bounds, &mut work);
            prop_assert_eq!(touch, touch_plainly(&filter, place, &mut work));
        }
    }
}

fn standing_apart(users: &[User], apart_m: f64) -> Vec<User> {
    let pushed = |(k, user): (usize, &User)| {
        let (x, y, yaw) = user.place;
        User { place: (x + apart_m * (k % 3) as f64, y - apart_m * (k % 4) as f64, yaw), ..user.clone() }
    };
    users.iter().enumerate().map(pushed).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    /// Ways that are left out because no announced candidate comes near change nothing, however near or far they are.
    #[test]
    fn what_is_out_of_reach_changes_nothing(
        users in proptest::collection::vec(any_user(), 1..14),
        apart_m in prop_oneof![Just(0.0), 5.0..60.0_f64, Just(1e6)],
        parameters in any_parameters(),
        speeds in proptest::collection::vec(0.0..14.0_f64, 1..4),
        turn in -0.03..0.03_f64,
        reverses in any::<bool>(),
    ) {
        let users = standing_apart(&users, apart_m);
        let scene = observed(&users, speeds[0]);
        let mut candidates: Vec<Candidate> =
            speeds.iter().map(|&speed_mps| candidate(speed_mps, 0.5, turn, 0)).collect();
        if reverses {
            let mut points: Vec<TrajectoryPoint> = candidates[0].points.to_vec();
            for point in &mut points {
                point.longitudinal_velocity_mps *= -1.0;
            }
            candidates[0] = candidate_of(points);
        }
        let mut filter = CollisionCheckFilter::new(&parameters, &VehicleInfo::default());
        let mut judge = |is_announced: bool| {
            if is_announced {
                filter.announce(&candidates);
            }
            filter.observe(&scene);
            let horizon_s = filter.objects.horizon_s;
            let mut scratch = Scratch::default();
            let judged = candidates.iter().map(|candidate| filter.judge(&scene, candidate, &mut scratch));
            (judged.map(|judged| format!("{judged:?}")).collect::<Vec<_>>(), horizon_s)
        };
        prop_assert_eq!(judge(true), judge(false));
    }

    /// All that an object covers on a way lies in the box by which ways are left out.
    #[test]
    fn ways_stay_in_their_boxes(user in any_user(), resolution in 0.02..0.5_f64) {
        let mut parameters = CollisionCheckParameters::default();
        parameters.global_setting.time_resolution = resolution;
        let mut filter = CollisionCheckFilter::new(&parameters, &VehicleInfo::default());
        filter.observe(&observed(&[user], 1.0));
        let place = |pose: &PlanarPose| Bounds { min: pose.position, max: pose.position };
        for course in &filter.objects.courses {
            let object = &filter.objects.objects[course.object];
            let places = match &course.way {
                objects::Way::Arc { start, .. } => {
                    reach::bounds_around(start.position, course.speed_mps * course.horizon_s)
                }
                objects::Way::Path(poses) => filter.objects.path_poses[poses.clone()]
                    .iter()
                    .fold(Bounds::EMPTY, |all, pose| all.joined(&place(pose))),
            };
            let around = reach::bounds_of_way(&places, course.speed_mps, &object.outline, resolution);
            prop_assert!(around.contains(&course.bounds), "{around:?} {:?}", course.bounds);
        }
    }
}

#[test]
fn far_objects_cost_no_ways_and_strangers_are_not_judged() {
    let user = |x| User {
        place: (x, 0.0, 0.0),
        speed_mps: 5.0,
        turns: vec![0.0, 0.01],
        label: ObjectClassification::CAR,
        size: (4.0, 2.0),
        id: 1,
    };
    let scene = observed(&[user(20.0), user(400.0), user(-1e5)], 8.0);
    let mut filter = CollisionCheckFilter::new(&CollisionCheckParameters::default(), &VehicleInfo::default());
    filter.announce(&[candidate(8.0, 0.0, 0.0, 0)]);
    filter.observe(&scene);
    assert_eq!((filter.objects.courses.len(), filter.objects.on_paths.len()), (3, 1));
    let mut scratch = Scratch::default();
    let known = filter.judge(&scene, &candidate(8.0, 0.0, 0.0, 0), &mut scratch);
    assert_eq!(known.failure, None);
    let stranger = filter.judge(&scene, &candidate(30.0, 0.0, 0.0, 0), &mut scratch);
    assert!(stranger.failure.is_some() && !stranger.feasible);
    // What was announced is forgotten with the next cycle.
    filter.observe(&scene);
    assert_eq!(filter.objects.courses.len(), 9);
    assert_eq!(filter.judge(&scene, &candidate(30.0, 0.0, 0.0, 0), &mut scratch).failure, None);
}

/// The scenes above would show nothing if hardly any of them had findings.
#[test]
fn most_scenes_have_findings() {
    use proptest::strategy::ValueTree;
    let mut runner = proptest::test_runner::TestRunner::deterministic();
    let mut with_findings = 0;
    for _ in 0..100 {
        let users = proptest::collection::vec(any_user(), 10).new_tree(&mut runner).unwrap().current();
        let scene = observed(&users, 8.0);
        let mut filter =
            CollisionCheckFilter::new(&CollisionCheckParameters::default(), &VehicleInfo::default());
        filter.observe(&scene);
        let judged = filter.judge(&scene, &candidate(8.0, 0.0, 0.0, 0), &mut Scratch::default());
        with_findings += usize::from(judged.evidence.is_some());
    }
    assert!(with_findings > 50, "{with_findings}");
}
