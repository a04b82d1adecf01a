//! What the generated drive promises to those who replay, demonstrate or measure with it.

use super::planners::{Fault, STALE_BY_NS, fault_of};
use super::*;
use lanelet_map::archive;
use map::{CROSSWALK_STOP_LINE_S_M, LIGHT_RULE, LIGHT_STOP_LINE_S_M};
use messages::autoware_internal_planning_msgs::{CandidateTrajectories, CandidateTrajectory};
use messages::autoware_perception_msgs::{PredictedObjects, Shape};
use messages::autoware_planning_msgs::TrajectoryPoint;
use messages::{Interface, Message};
use motion::VehicleInfo;
use selection::filters::vehicle_constraint::VehicleConstraintFilter;
use selection::parameters::VehicleConstraintParameters;
use selection::{Candidate, Filter, Scene, Scratch};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::LazyLock;

/// The drive that most tests look at, made once.
static DRIVE: LazyLock<Vec<TimedInput>> = LazyLock::new(|| Scenario::road(1).drive().collect());

fn bytes(input: &Input) -> Vec<u8> {
    let interface = Interface::V0_53;
    match input {
        Input::Map(message) => message.to_cdr(interface),
        Input::Route(message) => message.to_cdr(interface),
        Input::Generative(message) | Input::Backup(message) => message.to_cdr(interface),
        Input::Odometry(message) => message.to_cdr(interface),
        Input::Acceleration(message) => message.to_cdr(interface),
        Input::Objects(message) => message.to_cdr(interface),
        Input::TrafficSignals(message) => message.to_cdr(interface),
        Input::ReadyMap(..) => panic!("a generated drive sends its map as a message"),
        Input::GoalPose(_) | Input::OccupancyGrid(_) => panic!("nobody parks"),
    }
}

/// Stamp of a message from the start; for candidates that of the last one, which is never stale.
fn stamp_ns(input: &Input) -> i64 {
    let stamp = match input {
        Input::Map(message) => message.header.stamp,
        Input::Route(message) => message.header.stamp,
        Input::Odometry(message) => message.header.stamp,
        Input::Acceleration(message) => message.header.stamp,
        Input::Objects(message) => message.header.stamp,
        Input::TrafficSignals(message) => message.stamp,
        Input::Generative(message) | Input::Backup(message) => {
            message.candidate_trajectories.last().unwrap().header.stamp
        }
        Input::ReadyMap(..) => panic!("a generated drive sends its map as a message"),
        Input::GoalPose(_) | Input::OccupancyGrid(_) => panic!("nobody parks"),
    };
    stamp.nanoseconds() - EPOCH_NS
}

fn generative(drive: &[TimedInput]) -> impl Iterator<Item = (i64, &CandidateTrajectories)> {
    drive.iter().filter_map(|timed| match &timed.input {
        Input::Generative(message) => Some((stamp_ns(&timed.input), &**message)),
        _ => None,
    })
}

fn backup(drive: &[TimedInput]) -> impl Iterator<Item = &CandidateTrajectories> {
    drive.iter().filter_map(|timed| match &timed.input {
        Input::Backup(message) => Some(&**message),
        _ => None,
    })
}

fn objects(drive: &[TimedInput]) -> impl Iterator<Item = &PredictedObjects> {
    drive.iter().filter_map(|timed| match &timed.input {
        Input::Objects(message) => Some(&**message),
        _ => None,
    })
}

#[test]
fn a_seed_gives_the_same_bytes_and_another_seed_others() {
    let drive = |seed| -> Vec<_> {
        Scenario::road(seed).drive().map(|timed| (timed.time, timed.topic, bytes(&timed.input))).collect()
    };
    let (first, second, other) = (drive(1), drive(1), drive(2));
    assert!(first == second);
    assert!(first != other);
    let count = |topic| first.iter().filter(|(_, of, _)| *of == topic).count();
    let counts = InputTopic::ALL.map(count);
    // The last messages of the slow topics would arrive after the end, at 20 s.
    assert_eq!(counts, [1, 1, 194, 199, 1000, 1000, 200, 200]);
}

#[test]
fn the_map_comes_back_from_its_archive_with_its_rules() {
    let Input::Map(message) = &DRIVE[0].input else { panic!("the map comes first") };
    assert_eq!(message.header.frame_id, "map");
    let map = archive::decode(&message.data).unwrap();
    assert_eq!(map, map::build(&Road::new(), false).unwrap());
    let count = |subtype| map.lanelets().filter(|lanelet| lanelet.subtype() == Some(subtype)).count();
    assert_eq!((count("road"), count("crosswalk")), (36, 1));
    let borders = map.line_strings().filter(|line| line.attribute("type") == Some("road_border"));
    assert_eq!(borders.count(), 36);

    let light = map.regulatory_element(LIGHT_RULE).unwrap();
    assert_eq!(light.subtype(), "traffic_light");
    for role in ["refers", "ref_line", "light_bulbs"] {
        assert_eq!(light.line_strings(role).count(), 1, "{role}");
    }
    let crosswalk = map.regulatory_elements().find(|rule| rule.subtype() == "crosswalk").unwrap();
    assert_eq!(crosswalk.lanelets("refers").next().unwrap().subtype(), Some("crosswalk"));
    assert_eq!(crosswalk.line_strings("ref_line").count(), 2);
    assert_eq!(crosswalk.polygons("crosswalk_polygon").count(), 1);
    let ruled = |rule: i64| -> Vec<i64> {
        let has = |lanelet: &lanelet_map::Lanelet<'_>| {
            lanelet.regulatory_elements().any(|element| element.id() == rule)
        };
        map.lanelets().filter(has).map(|lanelet| lanelet.id()).collect()
    };
    assert_eq!(ruled(light.id()), [105]);
    assert_eq!(ruled(crosswalk.id()), [104, 204]);
}

#[test]
fn the_route_follows_the_forward_lane_past_both_rules() {
    let Input::Route(route) = &DRIVE[1].input else { panic!("the route comes second") };
    let Input::Map(message) = &DRIVE[0].input else { panic!("the map comes first") };
    let map = archive::decode(&message.data).unwrap();
    let lanelets: Vec<_> =
        route.segments.iter().map(|s| map.lanelet(s.preferred_primitive.id).unwrap()).collect();
    for pair in lanelets.windows(2) {
        let ends = [pair[0].left(), pair[0].right()].map(|bound| bound.points().last().unwrap().id());
        let starts = [pair[1].left(), pair[1].right()].map(|bound| bound.point(0).unwrap().id());
        assert_eq!(ends, starts);
    }
    let rules: Vec<_> =
        lanelets.iter().flat_map(|l| l.regulatory_elements().map(|rule| rule.subtype().to_owned())).collect();
    assert_eq!(rules, ["crosswalk", "traffic_light"]);
}

#[test]
fn times_are_sorted_and_stamps_of_a_topic_never_decrease() {
    assert!(DRIVE.windows(2).all(|pair| pair[0].time <= pair[1].time));
    let mut newest = BTreeMap::new();
    for timed in &*DRIVE {
        let stamp = stamp_ns(&timed.input);
        let delay_ms = (timed.time.nanoseconds() - EPOCH_NS - stamp) / MILLISECOND_NS;
        let expected_ms = match timed.topic {
            InputTopic::Map => 12_000..=12_000,
            InputTopic::Route => 2_000..=2_000,
            InputTopic::Odometry | InputTopic::Acceleration => 3..=3,
            InputTopic::Objects => 50..=70,
            InputTopic::TrafficSignals | InputTopic::Generative | InputTopic::Backup => 30..=50,
            InputTopic::GoalPose | InputTopic::OccupancyGrid => panic!("nobody parks"),
        };
        assert!(expected_ms.contains(&delay_ms), "{:?} {delay_ms}", timed.topic);
        assert!(newest.insert(timed.topic, stamp).is_none_or(|before| before < stamp), "{:?}", timed.topic);
    }
    assert!(DRIVE.last().unwrap().time < time(20 * SECOND_NS));
}

#[test]
fn the_planner_hiccup_lasts_600_ms() {
    let stamps: Vec<_> = generative(&DRIVE).map(|(stamp, _)| stamp).collect();
    let gaps: Vec<_> = stamps
        .windows(2)
        .filter(|pair| pair[1] - pair[0] != 100 * MILLISECOND_NS)
        .map(|pair| (pair[0] / MILLISECOND_NS, pair[1] / MILLISECOND_NS))
        .collect();
    assert_eq!(gaps, [(4900, 5500)]);
}

fn is_finite(point: &TrajectoryPoint) -> bool {
    let (p, q) = (point.pose.position, point.pose.orientation);
    [p.x, p.y, p.z, q.x, q.y, q.z, q.w].into_iter().all(f64::is_finite)
        && [
            point.longitudinal_velocity_mps,
            point.acceleration_mps2,
            point.heading_rate_rps,
            point.front_wheel_angle_rad,
        ]
        .into_iter()
        .all(f32::is_finite)
}

#[track_caller]
fn assert_sound(candidate: &CandidateTrajectory, points: usize) {
    assert_eq!(candidate.points.len(), points);
    assert!(candidate.points.iter().all(is_finite));
    let times = candidate.points.iter().map(|point| point.time_from_start.nanoseconds());
    assert!(times.eq((0..points as i64).map(|index| index * 100 * MILLISECOND_NS)));
}

#[test]
fn all_candidates_are_sound_but_the_documented_ones() {
    let mut faults = BTreeMap::new();
    for (stamp, message) in generative(&DRIVE) {
        assert_eq!(message.generator_info[0].generator_name.data, "DiffusionPlanner_0");
        assert_eq!(message.candidate_trajectories.len(), 8);
        for (sample, candidate) in message.candidate_trajectories.iter().enumerate() {
            let age_ns = stamp - (candidate.header.stamp.nanoseconds() - EPOCH_NS);
            let fault = fault_of(planners::FAULTS, sample, stamp);
            assert_eq!(age_ns, if fault == Some(Fault::Stale) { STALE_BY_NS } else { 0 });
            let points = &candidate.points;
            let times: Vec<_> = points.iter().map(|point| point.time_from_start).collect();
            match fault {
                None | Some(Fault::Stale) => assert_sound(candidate, 80),
                Some(Fault::NotANumber) => assert_eq!(points.iter().filter(|p| !is_finite(p)).count(), 1),
                Some(Fault::SinglePoint) => assert_eq!(points.len(), 1),
                Some(Fault::TimeGoesBack) => assert!(!times.is_sorted()),
            }
            if let Some(fault) = fault {
                *faults.entry(format!("{fault:?}")).or_insert(0) += 1;
            }
        }
    }
    let counts: Vec<_> = faults.iter().map(|(name, count)| (name.as_str(), *count)).collect();
    assert_eq!(counts, [("NotANumber", 3), ("SinglePoint", 3), ("Stale", 3), ("TimeGoesBack", 3)]);
    for message in backup(&DRIVE) {
        let names: Vec<_> = message.generator_info.iter().map(|info| &*info.generator_name.data).collect();
        assert_eq!(names, ["MinimumRuleBasedPlanner_Go", "MinimumRuleBasedPlanner_Stop"]);
        for candidate in &message.candidate_trajectories {
            assert_sound(candidate, 60);
        }
    }
}

#[test]
fn candidates_start_at_the_state_of_the_ego() {
    let scenario = Scenario::road(1);
    for message in generative(&DRIVE).map(|(_, message)| message).chain(backup(&DRIVE)) {
        for candidate in &message.candidate_trajectories {
            // As odometry tells it; the stamps of stale ones lie between two messages of odometry.
            let ego = odometry(&scenario.world, candidate.header.stamp.nanoseconds() - EPOCH_NS);
            assert_eq!(candidate.points[0].pose, ego.pose.pose);
            assert_eq!(candidate.points[0].longitudinal_velocity_mps, ego.twist.twist.linear.x as f32);
        }
    }
}

/// Velocity and acceleration of a candidate are those of its positions.
#[test]
fn candidates_move_as_they_say() {
    for (_, message) in generative(&DRIVE) {
        for (sample, candidate) in message.candidate_trajectories.iter().enumerate() {
            for pair in candidate.points.windows(2) {
                let [a, b] = [&pair[0], &pair[1]];
                let dt_s = b.time_from_start.seconds() - a.time_from_start.seconds();
                let [v0, v1] = [a, b].map(|point| f64::from(point.longitudinal_velocity_mps));
                let (dx, dy) = (b.pose.position.x - a.pose.position.x, b.pose.position.y - a.pose.position.y);
                let moved_m = dx.hypot(dy);
                // Faulty speeds and times are not what this is about.
                if !v0.is_finite() || !v1.is_finite() || (dt_s - 0.1).abs() > 1e-6 {
                    continue;
                }
                let expected_m = 0.5 * (v0 + v1) * dt_s;
                assert!((moved_m - expected_m).abs() < 0.02, "sample {sample}: {moved_m} {expected_m}");
                let stops = v1 == 0.0;
                let mean = 0.5 * f64::from(a.acceleration_mps2 + b.acceleration_mps2);
                assert!(stops || ((v1 - v0) / dt_s - mean).abs() < 0.6, "sample {sample}: {v0} {v1} {mean}");
            }
        }
    }
}

#[test]
fn all_but_the_racer_keep_the_limits_of_the_vehicle() {
    let vehicle = VehicleInfo::default();
    let scene = Scene::empty(Time::default(), Arc::new(vehicle));
    let filter = VehicleConstraintFilter::new(VehicleConstraintParameters::default(), vehicle.wheel_base_m());
    for seed in 1..6 {
        let drive: Vec<_> = Scenario::road(seed).drive().collect();
        let all = generative(&drive).map(|(_, message)| message).chain(backup(&drive));
        for message in all {
            for (sample, candidate) in message.candidate_trajectories.iter().enumerate() {
                let racer = sample == 7;
                let candidate = Candidate::new(candidate.clone(), "".into(), 0);
                let judgement = filter.judge(&scene, &candidate, &mut Scratch::default());
                let stamp = seconds(candidate.message.header.stamp.nanoseconds() - EPOCH_NS);
                let pushes =
                    judgement.metrics.iter().any(|m| m.name == "check_acceleration" && m.value > 5.0);
                let told = format!("seed {seed}, {stamp} s, sample {sample}: {judgement:?}");
                assert_eq!((judgement.feasible, pushes), (!racer, racer), "{told}");
            }
        }
    }
}

#[test]
fn predicted_paths_have_seventeen_poses_half_a_second_apart() {
    let mut ids = BTreeSet::new();
    let mut paths_per_object = BTreeSet::new();
    for message in objects(&DRIVE) {
        for object in &message.objects {
            ids.insert(object.object_id);
            let kinematics = &object.kinematics;
            paths_per_object.insert(kinematics.predicted_paths.len());
            for path in &kinematics.predicted_paths {
                assert_eq!((path.path.len(), path.time_step.seconds()), (17, 0.5));
                assert_eq!(path.path[0], kinematics.initial_pose_with_covariance.pose);
            }
            let speed_mps = kinematics.initial_twist_with_covariance.twist.linear.x;
            let is_walking = object.shape.r#type == Shape::CYLINDER;
            for pair in kinematics.predicted_paths[0].path.windows(2) {
                let [a, b] = [pair[0].position, pair[1].position];
                let moved_m = (a.x - b.x).hypot(a.y - b.y);
                // The pedestrian is expected to walk, even while waiting.
                let expected_m = if is_walking { 0.7 } else { 0.5 * speed_mps };
                assert!((moved_m - expected_m).abs() < 0.03 * expected_m + 1e-9, "{moved_m} {expected_m}");
            }
        }
    }
    assert_eq!(ids.len(), 7);
    assert_eq!(paths_per_object, BTreeSet::from([1, 2, 3]));
}

/// One line every half second, for failures.
fn timeline(scenario: &Scenario) -> String {
    let mut text = String::from("   t      s  speed  accel  light pedestrian\n");
    for half_s in 0..=40 {
        let t_ns = half_s * SECOND_NS / 2;
        let ego = scenario.world.ego_at(t_ns);
        let script = scenario.world.script;
        text += &format!(
            "{:4.1} {:6.2} {:6.2} {:6.2} {:6} {:6.2}\n",
            seconds(t_ns),
            ego.s_m,
            ego.speed_mps,
            ego.acceleration_mps2,
            script.light(t_ns),
            script.pedestrian(t_ns).0
        );
    }
    text
}

#[test]
fn the_ego_stops_at_the_crosswalk_and_at_the_red_light_and_drives_on() {
    for seed in 0..20 {
        let scenario = Scenario::road(seed);
        let front_m = VehicleInfo::default().max_longitudinal_offset_m();
        // Places and times at which the ego comes to a stand, and at which it leaves.
        let (mut stops, mut was_moving) = (Vec::new(), true);
        for step in 0..2000 {
            let t_ns = step * 10 * MILLISECOND_NS;
            let ego = scenario.world.ego_at(t_ns);
            let moves = ego.speed_mps > 0.0;
            if moves != was_moving {
                stops.push((seconds(t_ns), ego.s_m + front_m));
            }
            was_moving = moves;
        }
        let times: Vec<_> = stops.iter().map(|(t_s, _)| *t_s).collect();
        let places: Vec<_> = stops.iter().map(|(_, s_m)| *s_m).collect();
        let told = format!("seed {seed}: {stops:?}\n{}", timeline(&scenario));
        assert_eq!(stops.len(), 4, "{told}");
        assert!((4.0..7.5).contains(&times[0]) && (7.5..9.0).contains(&times[1]), "{told}");
        assert!((13.5..16.9).contains(&times[2]) && (17.0..17.2).contains(&times[3]), "{told}");
        for (place, line) in [(places[0], CROSSWALK_STOP_LINE_S_M), (places[2], LIGHT_STOP_LINE_S_M)] {
            assert!((0.2..1.6).contains(&(line - place)), "{told}");
        }
        assert!(scenario.world.ego_at(20 * SECOND_NS).speed_mps > 3.0, "{told}");
    }
}

/// Place along the road and offset of a position, by search.
fn locate(road: &Road, position: &messages::geometry_msgs::Point) -> (f64, f64) {
    let offset = |s_m: f64| {
        let [x, y] = road.position(s_m, 0.0);
        let (sin, cos) = road::heading(s_m).sin_cos();
        let (dx, dy) = (position.x - x, position.y - y);
        (dx * cos + dy * sin, dy * cos - dx * sin)
    };
    let mut s_m = 150.0;
    for _ in 0..50 {
        s_m += offset(s_m).0;
    }
    (s_m, offset(s_m).1)
}

#[test]
fn the_bad_samples_are_bad_and_the_good_ones_good() {
    let road = Road::new();
    let ends = |at_ns: i64| -> Vec<(f64, f64)> {
        let (_, message) = generative(&DRIVE).find(|(stamp, _)| *stamp == at_ns).unwrap();
        let end = |candidate: &Arc<CandidateTrajectory>| {
            locate(&road, &candidate.points.last().unwrap().pose.position)
        };
        message.candidate_trajectories.iter().map(end).collect()
    };
    let front_m = VehicleInfo::default().max_longitudinal_offset_m();
    for (at_s, line_m) in
        [(2, CROSSWALK_STOP_LINE_S_M), (7, CROSSWALK_STOP_LINE_S_M), (13, LIGHT_STOP_LINE_S_M)]
    {
        let ends = ends(at_s * SECOND_NS);
        for (sample, (s_m, offset_m)) in ends.iter().enumerate() {
            let expected_m = match sample {
                4 => 3.85,
                5 => -4.35,
                _ => -1.75,
            };
            assert!((offset_m - expected_m).abs() < 1e-6, "{at_s} s, sample {sample}: {offset_m}");
            let stops = s_m + front_m < line_m;
            assert!(stops == (sample < 3) || sample == 3, "{at_s} s, sample {sample}: {s_m}");
        }
    }
    let (_, message) = generative(&DRIVE).next().unwrap();
    let indicators =
        message.candidate_trajectories.iter().map(|candidate| candidate.turn_indicators_command.command);
    assert_eq!(indicators.collect::<Vec<_>>(), [0, 0, 0, 0, 2, 3, 0, 0]);
    let [keeps, slower, faster] = [0, 1, 2].map(|sample| ends(18 * SECOND_NS)[sample].0);
    assert!(slower < keeps && keeps < faster && slower > LIGHT_STOP_LINE_S_M);
}

#[test]
fn nobody_is_hit() {
    let vehicle = VehicleInfo::default();
    for seed in 0..20 {
        let world = Scenario::road(seed).world;
        for t_ns in (0..20 * SECOND_NS).step_by(10_000_000) {
            let ego_s_m = world.ego_at(t_ns).s_m;
            let ego = [ego_s_m - 1.1, ego_s_m + vehicle.max_longitudinal_offset_m()];
            // Lane middle, rear and front along the road, of all who drive.
            let mut driving = vec![(-1.75, ego)];
            for (index, user) in world.users.iter().enumerate() {
                if matches!(user.behaviour, traffic::Behaviour::Drives { .. }) {
                    let (s_m, half_m) = (world.user_at(index, t_ns).s_m, user.length_m / 2.0);
                    driving.push((user.track.offset_m, [s_m - half_m, s_m + half_m]));
                }
            }
            let (walker_m, _) = world.script.pedestrian(t_ns);
            for (index, (lane_m, [rear, front])) in driving.iter().enumerate() {
                let on_crosswalk = *rear < 108.5 && *front > 107.5;
                assert!(
                    !(on_crosswalk && (walker_m - lane_m).abs() < 1.6),
                    "seed {seed}, {t_ns} ns, {index}"
                );
                for (other_lane_m, [other_rear, other_front]) in &driving[index + 1..] {
                    let apart = other_rear - front > 1.0 || rear - other_front > 1.0;
                    assert!(apart || (lane_m - other_lane_m).abs() > 1.5, "seed {seed}, {t_ns} ns, {index}");
                }
            }
        }
    }
}
