//! Judging allocates nothing once the buffers have grown: for every filter that can be loaded, whatever it says.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

#[path = "../../lanelet-map/tests/support/allocations.rs"]
mod allocations;
#[path = "street_support/world.rs"]
mod world;

use messages::autoware_perception_msgs::{ObjectClassification, PredictedObject, PredictedObjects};
use messages::autoware_planning_msgs::TrajectoryPoint;
use messages::builtin_interfaces::{Duration, Time};
use motion::VehicleInfo;
use selection::filters::{CLASSES, Filter, FilterClass};
use selection::parameters::ValidatorParameters;
use selection::{Candidate, Judgement, Scene, Scratch, data_validity};
use std::sync::Arc;
use world::*;

#[global_allocator]
static ALLOCATOR: allocations::Counting = allocations::Counting;

const CYCLES: i32 = 4;

/// The street with twenty more road users, some of them on the crosswalk.
fn scene(sec: i32) -> Scene {
    let mut scene = world(sec);
    let mut objects = (**scene.objects.as_ref().unwrap()).clone();
    objects.objects.extend((0..20).map(traffic));
    scene.objects = Some(Arc::new(PredictedObjects { header: header(sec), ..objects }));
    scene
}

fn traffic(number: u8) -> PredictedObject {
    let (k, is_walking) = (f64::from(number), number.is_multiple_of(5));
    let (label, x, size) = if is_walking {
        (ObjectClassification::PEDESTRIAN, 22.0 + 0.2 * k, [0.6, 0.6])
    } else {
        (ObjectClassification::CAR, 6.0 * k - 20.0, [4.5, 1.8])
    };
    let mut object = object(number + 3, label, x, 4.0 + 0.3 * k, size);
    let twist = &mut object.kinematics.initial_twist_with_covariance.twist;
    (twist.linear.x, twist.angular.z) = (1.0 + 0.3 * k, 0.02 * k - 0.2);
    let again = object.kinematics.predicted_paths[0].clone();
    object.kinematics.predicted_paths.push(again);
    object
}

/// The one that runs into everything, and others: straight on at any speed, to the left and right, standing.
fn candidates(sec: i32) -> Vec<Candidate> {
    let others = (0..40).map(|number| {
        let (speed_mps, turn) = (f64::from(number % 5) * 2.5, 0.004 * f64::from(number % 9 - 4));
        let point = |index: i64| {
            let distance_m = speed_mps * 0.1 * index as f64;
            TrajectoryPoint {
                time_from_start: Duration::from_nanoseconds(index * 100_000_000),
                pose: pose(distance_m, 0.5 * turn * distance_m * distance_m, turn * distance_m),
                longitudinal_velocity_mps: speed_mps as f32,
                ..TrajectoryPoint::default()
            }
        };
        let mut candidate = candidate_of(sec, (0..80).map(point).collect());
        candidate.key.sample = number as u32 + 1;
        candidate
    });
    std::iter::once(candidate(sec, 0.0)).chain(others).collect()
}

/// Drives some cycles. Gives how many candidates were accepted and rejected in the last one, in which nothing may be
/// allocated while judging.
fn drive(class: &FilterClass) -> [usize; 2] {
    let mut filter = (class.make)(&ValidatorParameters::default(), &VehicleInfo::default());
    let mut scratch = Scratch::default();
    let mut counts = [0; 2];
    for cycle in 0..CYCLES {
        let (scene, candidates) = (scene(START_S + cycle), candidates(START_S + cycle));
        filter.observe(&scene);
        let (judgements, peaks): (Vec<_>, Vec<_>) =
            candidates.iter().map(|candidate| judge(&*filter, &scene, candidate, &mut scratch)).unzip();
        let judged: Vec<_> = candidates.iter().zip(&judgements).collect();
        filter.remember(&judged);
        counts = [true, false].map(|wanted| judgements.iter().filter(|j| j.feasible == wanted).count());
        assert!(judgements.iter().all(|judgement| judgement.failure.is_none()), "{}", class.short_name);
        if cycle > 0 {
            assert_eq!(peaks.iter().max(), Some(&0), "bytes, {}, cycle {cycle}", class.short_name);
        }
    }
    counts
}

fn judge(
    filter: &dyn Filter,
    scene: &Scene,
    candidate: &Candidate,
    scratch: &mut Scratch,
) -> (Judgement, usize) {
    assert!(data_validity::judge(scene, candidate).feasible);
    allocations::peak_of(|| filter.judge(scene, candidate, scratch))
}

#[test]
fn judging_allocates_nothing() {
    for class in CLASSES {
        let [accepted, rejected] = drive(class);
        println!("{}: {accepted} accepted, {rejected} rejected", class.short_name);
        assert!(accepted > 0 && rejected > 0, "both are judged: {}", class.short_name);
    }
}

#[test]
fn checking_data_allocates_nothing() {
    let scene = scene(START_S);
    for candidate in candidates(START_S) {
        assert!(!candidate.points.is_empty(), "this makes the points ready");
        let (judgement, peak) = allocations::peak_of(|| data_validity::judge(&scene, &candidate));
        assert!(judgement.feasible);
        assert_eq!(peak, 0);
    }
}

#[test]
fn the_counter_sees_what_is_allocated() {
    let (_, peak) = allocations::peak_of(|| vec![Time::default(); 100]);
    assert!(peak >= 800);
}
