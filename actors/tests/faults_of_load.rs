//! More than anybody planned for: ten times the rate, ten thousand candidates, a candidate of a hundred thousand points,
//! five thousand objects. What fits is judged, what does not is left in and reported, and the next cycle is normal.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

#[path = "support/faulty.rs"]
mod faulty;
#[path = "support/inputs.rs"]
mod inputs;

use faulty::{
    DIFFUSION, Node, START, Scripted, Seen, Setup, THREADS, after, anchor, number_of, parameters, validator,
};
use inputs::candidate_set;
use messages::autoware_internal_planning_msgs::{CandidateTrajectories, CandidateTrajectory, GeneratorInfo};
use messages::autoware_perception_msgs::{
    ObjectClassification, PredictedObject, PredictedObjects, PredictedPath,
};
use messages::autoware_planning_msgs::{LaneletRoute, LaneletSegment, TrajectoryPoint};
use messages::builtin_interfaces::Duration as Span;
use messages::diagnostic_msgs::DiagnosticStatus;
use messages::nav_msgs::Odometry;
use messages::std_msgs::{Header, Text};
use messages::unique_identifier_msgs::Uuid;
use motion::VehicleInfo;
use selection::filters::CLASSES;
use selection::parameters::ValidatorParameters;
use selection::{Candidate, Judgement, Validator};
use selector_actors::{Input, Outcome, Trigger};
use std::sync::Arc;
use std::time::{Duration, Instant};

#[test]
fn at_ten_times_the_rate_every_message_has_its_cycle() {
    for threads in THREADS {
        let node = Setup::new(threads).start();
        for hundredth in 1..=3000 {
            let now = after(START, 10 * hundredth);
            node.system.advance_to(now).unwrap();
            let seen = node.cycle(&anchor(now, 12));
            assert_eq!(seen.report.cycle.trigger, Trigger::Anchor);
            seen.assert_normal(12, "in time");
        }
        let state = node.system.settle().unwrap();
        assert_eq!((state.cycles, state.coalesced), (3000, 0), "no cycle of the timer between them");
    }
}

#[test]
fn ten_thousand_candidates_are_all_judged_where_there_is_time() {
    for threads in THREADS {
        let judge = |candidate: &Candidate| Judgement {
            feasible: number_of(&candidate.message.points).is_multiple_of(2),
            ..Judgement::default()
        };
        let filter = Scripted { judge: Arc::new(judge), ..Scripted::default() };
        let node = Setup { validator: validator(filter), ..Setup::new(threads) }.start();
        let seen = node.cycle(&anchor(START, 10_000));
        assert_eq!(seen.validated(), Some((0..10_000).filter(|number| number % 2 == 0).collect()));
        assert_eq!(seen.driven(), Some(0));
        assert_eq!(seen.told()[0], (DiagnosticStatus::WARN, "At least one trajectory is infeasible"));
        node.cycle(&anchor(START, 1)).assert_normal(1, "the next cycle");
    }
}

#[test]
fn of_ten_thousand_candidates_those_without_time_are_left_in() {
    for threads in THREADS {
        let slowly = |candidate: &Candidate| {
            let until = Instant::now() + Duration::from_micros(50);
            while Instant::now() < until && number_of(&candidate.message.points) > 0 {
                std::hint::spin_loop();
            }
            Judgement::feasible([])
        };
        let filter = Scripted { judge: Arc::new(slowly), ..Scripted::default() };
        let budget = Some(Duration::from_millis(20));
        let node = Setup { validator: validator(filter), budget, ..Setup::new(threads) }.start();
        let many = anchor(START, 10_000);
        // A machine that is busy with other things may give the cycle up, and then nothing leaves, which `cycle` holds it
        // to. What a cut says, where time is not so scarce, stands in `deadline.rs`.
        let seen = node.cycle(&many);
        match seen.judged() {
            Some(judged) => {
                assert!(judged.not_judged() > 0, "10,000 candidates of 50 us each do not fit into 20 ms");
                assert_eq!(judged.validated.candidate_trajectories.len(), 10_000 - judged.not_judged());
                assert_eq!(seen.value("candidates.not_judged"), Some(&judged.not_judged().to_string()[..]));
                assert_eq!(seen.told()[0], (DiagnosticStatus::WARN, "At least one trajectory is infeasible"));
            }
            None => assert_eq!(seen.told()[0].0, DiagnosticStatus::ERROR, "{:?}", seen.told()),
        }
        let next = (0..1_000_000).map(|_| node.cycle(&anchor(START, 1))).find(|seen| seen.judged().is_some());
        next.unwrap().assert_normal(1, "the next cycle");
    }
}

#[test]
fn of_ten_thousand_generators_the_newest_are_kept() {
    for threads in THREADS {
        let node = Setup::new(threads).start();
        let id = |number: u32| Uuid { uuid: u128::from(number).to_be_bytes() };
        let template = anchor(START, 1).candidate_trajectories[0].clone();
        let candidate = |number: u32| {
            let mut candidate = CandidateTrajectory::clone(&template);
            candidate.generator_id = id(number);
            candidate.points[0].longitudinal_velocity_mps = number as f32;
            Arc::new(candidate)
        };
        let name = |number: u32| Text { data: format!("DiffusionPlanner_{number}") };
        let info = |number| GeneratorInfo { generator_id: id(number), generator_name: name(number) };
        let message = CandidateTrajectories {
            candidate_trajectories: (0..10_000).map(candidate).collect(),
            generator_info: (0..10_000).map(info).collect(),
        };
        let seen = node.cycle(&Arc::new(message));
        assert_eq!(seen.validated(), Some((10_000 - 1024..10_000).rev().collect()));
        assert_eq!(seen.value("generators.evicted"), Some("8976"));
        // Too old for the next cycle.
        node.system.jump_to(after(START, 1000)).unwrap();
        node.seen();
        node.assert_normal("the next cycle");
    }
}

/// Every filter that there is, enforced.
fn every_filter() -> Validator {
    let filter_names = CLASSES.iter().map(|class| class.class_name.to_owned()).collect();
    let parameters = ValidatorParameters { filter_names, ..parameters() };
    Validator::new(parameters, &VehicleInfo::default()).unwrap()
}

fn point(index: usize, step_m: f64, step_ms: i64) -> TrajectoryPoint {
    let mut point = TrajectoryPoint {
        time_from_start: Span::from_nanoseconds(index as i64 * step_ms * 1_000_000),
        longitudinal_velocity_mps: (step_m * 1000.0 / step_ms as f64) as f32,
        ..TrajectoryPoint::default()
    };
    point.pose.position.x = 5.0 + index as f64 * step_m;
    point.pose.orientation.w = 1.0;
    point
}

/// Candidates along the road at 2, 3, ... m/s.
fn drivers(count: usize) -> Vec<(u8, Vec<TrajectoryPoint>)> {
    let points = |speed: f64| (0..40).map(|index| point(index, 0.1 * speed, 100)).collect();
    (0..count).map(|driver| (1, points(2.0 + driver as f64))).collect()
}

fn set_of(candidates: Vec<(u8, Vec<TrajectoryPoint>)>) -> Arc<CandidateTrajectories> {
    candidate_set(START, [(1, DIFFUSION.to_owned())], candidates)
}

/// A node with every filter, on a road with a route, and how many of its drivers are accepted.
fn drive(threads: usize, budget: Option<Duration>) -> (Node, usize) {
    let node = Setup { validator: every_filter(), budget, ..Setup::new(threads) }.start();
    let header = Header { stamp: START, frame_id: "map".to_owned() };
    let mut odometry = Odometry { header, ..Odometry::default() };
    odometry.pose.pose.position.x = 5.0;
    odometry.pose.pose.orientation.w = 1.0;
    odometry.twist.twist.linear.x = 6.0;
    node.system.deliver(Input::Odometry(Arc::new(odometry))).unwrap();
    let mut route = LaneletRoute::default();
    let mut segment = LaneletSegment::default();
    segment.preferred_primitive.id = 21;
    segment.primitives = vec![segment.preferred_primitive.clone()];
    route.segments = vec![segment];
    node.system.deliver(Input::Route(Arc::new(route))).unwrap();
    node.system.deliver(objects(0)).unwrap();
    let seen = node.cycle(&set_of(drivers(6)));
    let accepted = seen.validated().unwrap().len();
    assert!(accepted > 0, "{:?} {:#?}", seen.told(), seen.judged().unwrap().verdicts);
    (node, accepted)
}

/// Cars that drive along beside the road, each with three predicted paths; every tenth stands on the road.
fn objects(count: usize) -> Input {
    let object = |number: usize| {
        let object_id = Uuid { uuid: (number as u128).to_be_bytes() };
        let mut object =
            PredictedObject { object_id, existence_probability: 1.0, ..PredictedObject::default() };
        let (row, column) = ((number / 100) as f64, (number % 100) as f64);
        let stands = number.is_multiple_of(10);
        let pose = &mut object.kinematics.initial_pose_with_covariance.pose;
        pose.position.x = if stands { 12.0 } else { column * 5.0 - 200.0 };
        pose.position.y = if stands { 0.0 } else { 8.0 + row * 4.0 };
        pose.orientation.w = 1.0;
        let start = *pose;
        object.kinematics.initial_twist_with_covariance.twist.linear.x = if stands { 0.0 } else { 5.0 };
        object.classification =
            vec![ObjectClassification { label: ObjectClassification::CAR, probability: 1.0 }];
        object.shape.dimensions.x = 4.5;
        object.shape.dimensions.y = 1.8;
        object.shape.dimensions.z = 1.5;
        let path = |share: usize| {
            let mut path =
                PredictedPath { time_step: Span::from_nanoseconds(500_000_000), ..PredictedPath::default() };
            path.confidence = 1.0;
            path.path = (0..17)
                .map(|step| {
                    let mut pose = start;
                    pose.position.x += if stands { 0.0 } else { step as f64 * 0.5 * (3.0 + share as f64) };
                    pose
                })
                .collect();
            path
        };
        object.kinematics.predicted_paths = (0..3).map(path).collect();
        object
    };
    let header = Header { stamp: START, frame_id: "map".to_owned() };
    Input::Objects(Arc::new(PredictedObjects { header, objects: (0..count).map(object).collect() }))
}

fn describe(seen: &Seen) -> String {
    match &seen.report.outcome {
        Outcome::Judged(judged) => {
            let times: Vec<_> =
                judged.filters.iter().skip(1).map(|filter| filter.name).zip(&judged.filter_times).collect();
            format!("observe {:?}, judge {:?}, {times:?}", judged.observe, judged.judge)
        }
        other => format!("{other:?}"),
    }
}

#[test]
fn a_candidate_of_a_hundred_thousand_points_costs_itself() {
    for threads in THREADS {
        let (node, accepted) = drive(threads, None);
        let mut candidates = drivers(6);
        // Ten times as fine as the others, and ten seconds of every kilometre: most of it is far from any map.
        candidates.push((1, (0..100_000).map(|index| point(index, 0.03, 10)).collect()));
        let seen = node.cycle(&set_of(candidates));
        eprintln!("{threads} threads: {}", describe(&seen));
        assert_eq!(seen.validated().map(|set| set.len()), Some(accepted), "the others are judged as ever");
        let verdict = &seen.judged().unwrap().verdicts[6];
        assert!(!verdict.accepted && verdict.judgements.is_empty(), "no filter lost its time over it");
        assert_eq!(seen.value("data_validity.rejected"), Some("1"));
        let next = node.cycle(&set_of(drivers(6)));
        assert_eq!(next.validated().map(|set| set.len()), Some(accepted), "the next cycle");
    }
}

#[test]
fn five_thousand_objects_are_all_looked_at() {
    for threads in THREADS {
        let (node, accepted) = drive(threads, None);
        node.system.deliver(objects(5000)).unwrap();
        let seen = node.cycle(&set_of(drivers(6)));
        eprintln!("{threads} threads: {}", describe(&seen));
        let validated = seen.validated().unwrap().len();
        assert!(validated < accepted, "{validated} of {accepted} pass although cars stand in the way");
        assert_eq!(seen.told()[0].0, DiagnosticStatus::ERROR);
        node.system.deliver(objects(0)).unwrap();
        let next = node.cycle(&set_of(drivers(6)));
        assert_eq!(next.validated().map(|set| set.len()), Some(accepted), "the next cycle");
    }
}
