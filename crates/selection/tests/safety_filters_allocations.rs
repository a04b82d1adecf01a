//! Judging allocates nothing once the buffers have grown.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

#[path = "../../lanelet-map/tests/support/allocations.rs"]
mod allocations;
#[path = "collision_support/scenes.rs"]
mod scenes;

use messages::autoware_perception_msgs::{ObjectClassification, PredictedObject};
use scenes::*;
use selection::filters::collision_check::CollisionCheckFilter;
use selection::filters::out_of_lane::OutOfLaneFilter;
use selection::parameters::{CollisionCheckParameters, OutOfLaneParameters};
use selection::scene::{Epoch, HdMap};
use selection::{Candidate, Filter, Scene, Scratch};
use std::sync::Arc;

#[global_allocator]
static ALLOCATOR: allocations::Counting = allocations::Counting;

/// Twenty objects around the vehicle, each with two predicted paths.
fn traffic() -> Vec<PredictedObject> {
    (0..20_u8)
        .map(|id| {
            let (k, lane) = (f64::from(id / 2), f64::from(id % 2));
            let arc = Arc2::line(-20.0 + 9.0 * k, 3.5 * lane - 0.4 * k, 0.1 * lane);
            let label =
                if id % 5 == 0 { ObjectClassification::PEDESTRIAN } else { ObjectClassification::CAR };
            let object = object(id + 1, label, arc, 3.0 + k, 4.5, 1.8);
            let bend = Arc2 { curvature: 0.02, ..arc };
            predicted(predicted(object, arc, 3.0 + k, 17), bend, 3.0 + k, 17)
        })
        .collect()
}

fn candidates() -> Vec<Candidate> {
    (0..40)
        .map(|k| {
            let k = f64::from(k);
            let arc =
                Arc2 { x: 0.0, y: 0.2 * (k % 7.0), yaw: 0.01 * (k % 5.0), curvature: 0.001 * (k - 20.0) };
            candidate(arc, 6.0 + 0.2 * k, 50)
        })
        .collect()
}

fn road() -> Arc<lanelet_map::Map> {
    let mut builder = lanelet_map::MapBuilder::new();
    for (id, x, y) in [(1, -50.0, 4.0), (2, 200.0, 4.0), (3, -50.0, -4.0), (4, 200.0, -4.0)] {
        builder.point(id, [x, y, 0.0], &[]).unwrap();
    }
    builder.line_string(10, &[1, 2], &[]).unwrap();
    builder.line_string(11, &[3, 4], &[]).unwrap();
    builder.lanelet(20, 10, 11, &[("subtype", "road")]).unwrap();
    Arc::new(builder.build().unwrap())
}

fn check(mut filter: impl Filter, scene: &Scene) {
    filter.observe(scene);
    let mut scratch = Scratch::default();
    let candidates = candidates();
    let verdicts: Vec<bool> =
        candidates.iter().map(|candidate| filter.judge(scene, candidate, &mut scratch).feasible).collect();
    let start = std::time::Instant::now();
    for candidate in &candidates {
        let (judgement, peak) = allocations::peak_of(|| filter.judge(scene, candidate, &mut scratch));
        assert_eq!(judgement.failure, None);
        assert_eq!(peak, 0, "{} bytes", filter.name());
    }
    let each_us = start.elapsed().as_secs_f64() * 1e6 / candidates.len() as f64;
    let rejected = verdicts.iter().filter(|&&feasible| !feasible).count();
    eprintln!(
        "{}: {each_us:.1} us for each candidate, {rejected} of {} rejected",
        filter.name(),
        candidates.len()
    );
}

#[test]
fn judging_allocates_nothing() {
    let mut scene = scene(10.0, traffic());
    scene.map = Some(Epoch { number: 1, value: HdMap { frame_id: "map".into(), map: road() } });
    check(CollisionCheckFilter::new(&CollisionCheckParameters::default(), &vehicle()), &scene);
    check(OutOfLaneFilter::new(OutOfLaneParameters::default(), &vehicle()), &scene);
    let mut filter = CollisionCheckFilter::new(&CollisionCheckParameters::default(), &vehicle());
    filter.observe(&scene);
    let start = std::time::Instant::now();
    filter.observe(&scene);
    eprintln!("observing 20 objects: {:.1} us", start.elapsed().as_secs_f64() * 1e6);
}
