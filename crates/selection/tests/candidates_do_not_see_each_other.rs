//! What a filter says about a candidate depends on the scenes and on that candidate's own past, and on nothing else:
//! not on other candidates, their order, the thread's buffers, or the order of objects in a message.
//!
//! Drives of a few cycles on a street with every danger, with random traffic and candidates that change from cycle to
//! cycle.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

#[path = "street_support/world.rs"]
mod world;

use messages::autoware_perception_msgs::{ObjectClassification, PredictedObject, PredictedObjects};
use messages::autoware_planning_msgs::TrajectoryPoint;
use messages::builtin_interfaces::Duration;
use motion::VehicleInfo;
use proptest::prelude::*;
use selection::filters::{CLASSES, FilterClass};
use selection::parameters::ValidatorParameters;
use selection::{Candidate, Judgement, Scene, Scratch};
use std::sync::Arc;
use world::*;

const CYCLES: usize = 3;

/// A road user: is it walking, place, speed, yaw rate.
type User = (bool, (f64, f64), f64, f64);
/// A candidate: place aside, yaw, curvature, speed, does it indicate.
type Way = (f64, f64, f64, f64, bool);

fn user(number: usize, &(is_walking, (x, y), speed_mps, yaw_rate_rps): &User) -> PredictedObject {
    let (label, size) = if is_walking {
        (ObjectClassification::PEDESTRIAN, [0.6, 0.6])
    } else {
        (ObjectClassification::CAR, [4.5, 1.8])
    };
    let mut object = object(number as u8 + 10, label, x, y, size);
    let twist = &mut object.kinematics.initial_twist_with_covariance.twist;
    (twist.linear.x, twist.angular.z) = (speed_mps, yaw_rate_rps);
    object
}

/// In each cycle the users are a little farther and in another order, so that nothing kept about a place among them is
/// true of the next one; in the last cycle one of them is gone.
fn scene_with(cycle: usize, users: &[User]) -> Scene {
    let mut scene = world(START_S + cycle as i32);
    let mut users = users.to_vec();
    users.rotate_left(cycle);
    users.truncate(if cycle + 1 == CYCLES { users.len() - 1 } else { users.len() });
    users.iter_mut().for_each(|(_, (x, _), speed_mps, _)| *x += *speed_mps * cycle as f64);
    let objects = users.iter().enumerate().map(|(number, moved)| user(number, moved)).collect();
    scene.objects = Some(Arc::new(PredictedObjects { header: header(START_S + cycle as i32), objects }));
    scene
}

fn candidates_in(cycle: usize, ways: &[Way]) -> Vec<Candidate> {
    let candidate = |(sample, &(aside, yaw, curvature, speed_mps, indicates)): (u32, &Way)| {
        let point = |index: i64| {
            let distance_m = speed_mps * 0.1 * index as f64 + cycle as f64;
            let across_m = aside + (yaw + 0.5 * curvature * distance_m) * distance_m;
            TrajectoryPoint {
                time_from_start: Duration::from_nanoseconds(index * 100_000_000),
                pose: pose(distance_m, across_m, yaw + curvature * distance_m),
                longitudinal_velocity_mps: speed_mps as f32,
                ..TrajectoryPoint::default()
            }
        };
        let mut message =
            (*candidate_of(START_S + cycle as i32, (0..=40).map(point).collect()).message).clone();
        message.turn_indicators_command.command = if indicates { 2 } else { 1 };
        Candidate::new(Arc::new(message), "planner".into(), sample)
    };
    (0..).zip(ways).map(candidate).collect()
}

/// How one drive differs from another that must say the same.
#[derive(Clone, Copy)]
struct Style {
    /// The last candidate is judged first.
    is_reversed: bool,
    /// One set of buffers for the whole drive, or a new one for each judgement.
    shares_buffers: bool,
    /// Only this candidate is there.
    only: Option<usize>,
}

const PLAIN: Style = Style { is_reversed: false, shares_buffers: false, only: None };

/// What is said in each cycle about each candidate, by sample.
fn drive(class: &FilterClass, scenes: &[Scene], ways: &[Way], style: Style) -> Vec<Vec<(u32, Judgement)>> {
    let mut filter = (class.make)(&ValidatorParameters::default(), &VehicleInfo::default());
    let mut scratch = Scratch::default();
    let cycle = |(cycle, scene): (usize, &Scene)| {
        let mut candidates = candidates_in(cycle, ways);
        candidates.retain(|candidate| style.only.is_none_or(|only| candidate.key.sample as usize == only));
        if style.is_reversed {
            candidates.reverse();
        }
        filter.observe(scene);
        let judge = |candidate| {
            if !style.shares_buffers {
                scratch = Scratch::default();
            }
            filter.judge(scene, candidate, &mut scratch)
        };
        let judgements: Vec<Judgement> = candidates.iter().map(judge).collect();
        let judged: Vec<_> = candidates.iter().zip(&judgements).collect();
        filter.remember(&judged);
        let mut said: Vec<_> =
            candidates.iter().map(|candidate| candidate.key.sample).zip(judgements).collect();
        said.sort_by_key(|(sample, _)| *sample);
        said
    };
    scenes.iter().enumerate().map(cycle).collect()
}

fn users() -> impl Strategy<Value = Vec<User>> {
    let place = (-15.0..35.0_f64, -9.0..6.0_f64);
    proptest::collection::vec((any::<bool>(), place, 0.0..9.0_f64, -0.5..0.5_f64), CYCLES..9)
}

fn ways() -> impl Strategy<Value = Vec<Way>> {
    let way = (-1.8..1.8_f64, -0.15..0.15_f64, -0.02..0.02_f64, 0.0..15.0_f64, any::<bool>());
    proptest::collection::vec(way, 2..6)
}

/// The text of a number tells all of its bits.
fn text(said: &[Vec<(u32, Judgement)>]) -> Vec<String> {
    said.iter().map(|cycle| format!("{cycle:?}")).collect()
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(48) })]

    #[test]
    fn order_company_and_buffers_change_nothing(users in users(), ways in ways()) {
        let scenes: Vec<Scene> = (0..CYCLES).map(|cycle| scene_with(cycle, &users)).collect();
        for class in CLASSES {
            let plain = drive(class, &scenes, &ways, PLAIN);
            for is_reversed in [false, true] {
                let style = Style { is_reversed, shares_buffers: true, only: None };
                let other = drive(class, &scenes, &ways, style);
                prop_assert_eq!(text(&other), text(&plain), "{} reversed: {}", class.short_name, is_reversed);
            }
            let only = ways.len() - 1;
            let alone = drive(class, &scenes, &ways, Style { only: Some(only), ..PLAIN });
            for (alone, together) in alone.iter().zip(&plain) {
                prop_assert_eq!(format!("{:?}", alone[0]), format!("{:?}", together[only]), "{}", class.short_name);
            }
        }
    }

    #[test]
    fn the_order_of_objects_changes_no_verdict(users in users(), ways in ways()) {
        let scenes: Vec<Scene> = (0..CYCLES).map(|cycle| scene_with(cycle, &users)).collect();
        let mut turned = scenes.clone();
        for scene in &mut turned {
            let mut objects = (**scene.objects.as_ref().unwrap()).clone();
            objects.objects.reverse();
            scene.objects = Some(Arc::new(objects));
        }
        for class in CLASSES {
            let verdicts = |scenes: &[Scene]| -> Vec<_> {
                let said = drive(class, scenes, &ways, PLAIN).into_iter().flatten();
                said.map(|(sample, said)| (sample, said.feasible, said.risk(), said.failure)).collect()
            };
            prop_assert_eq!(verdicts(&turned), verdicts(&scenes), "{}", class.short_name);
        }
    }
}
