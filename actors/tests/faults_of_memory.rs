//! For an hour every message comes from planners that nobody has heard of: the node's memory stays level.
//!
//! The whole process is measured, by counting what is allocated and not given back.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

#[path = "support/faulty.rs"]
mod faulty;
#[path = "support/inputs.rs"]
mod inputs;

use faulty::{START, Setup, after, parameters};
use inputs::candidate_set;
use messages::autoware_internal_planning_msgs::CandidateTrajectories;
use messages::autoware_perception_msgs::{PredictedObject, PredictedObjects};
use messages::autoware_planning_msgs::TrajectoryPoint;
use messages::builtin_interfaces::{Duration as Span, Time};
use messages::nav_msgs::Odometry;
use messages::std_msgs::Header;
use messages::unique_identifier_msgs::Uuid;
use motion::VehicleInfo;
use selection::Validator;
use selection::filters::CLASSES;
use selection::parameters::ValidatorParameters;
use selector_actors::Input;
use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

static LIVE: AtomicUsize = AtomicUsize::new(0);

struct Counting;

// SAFETY: every call is handed on to the system's allocator unchanged.
#[allow(unsafe_code, reason = "an allocator cannot be written without; it only counts")]
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        LIVE.fetch_add(layout.size(), Ordering::Relaxed);
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        LIVE.fetch_sub(layout.size(), Ordering::Relaxed);
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Number of cycles of an hour at 10 Hz.
const HOUR: u32 = 36_000;
/// The buffers of a thread that had nothing to do in the first minute. A leak of 30 bytes in each cycle is more.
const SLACK_BYTES: usize = 1 << 20;

/// Two planners that were never there before, one of which stamps its candidates ahead, so that they stay for a while.
fn strangers(number: u32, now: Time) -> Arc<CandidateTrajectories> {
    let points = |speed: f64| -> Vec<TrajectoryPoint> {
        let point = |index: i64| {
            let mut point = TrajectoryPoint {
                time_from_start: Span::from_nanoseconds(index * 100_000_000),
                longitudinal_velocity_mps: speed as f32,
                ..TrajectoryPoint::default()
            };
            point.pose.position.x = 5.0 + 0.1 * speed * index as f64;
            point
        };
        (0..8).map(point).collect()
    };
    let name = |kind: &str| format!("{kind}{number}");
    let generators = [(1, name("DiffusionPlanner_")), (2, name("Stranger"))];
    let mut set = candidate_set(now, generators, [(1, points(3.0)), (2, points(4.0))]);
    let message = Arc::make_mut(&mut set);
    for (index, candidate) in message.candidate_trajectories.iter_mut().enumerate() {
        let id = Uuid { uuid: (u128::from(number) << 8 | index as u128).to_be_bytes() };
        let candidate = Arc::make_mut(candidate);
        candidate.generator_id = id;
        candidate.header.stamp = after(now, index as i64 * 700);
        message.generator_info[index].generator_id = id;
    }
    set
}

/// Where the vehicle is, and an object that was never there before.
fn sensors(number: u32, now: Time) -> [Input; 2] {
    let object_id = Uuid { uuid: u128::from(number).to_be_bytes() };
    let mut object = PredictedObject { object_id, ..PredictedObject::default() };
    object.kinematics.initial_pose_with_covariance.pose.position.x = 200.0;
    object.shape.dimensions.x = 4.0;
    object.shape.dimensions.y = 2.0;
    let header = Header { stamp: now, frame_id: "map".to_owned() };
    let odometry = Odometry { header: header.clone(), ..Odometry::default() };
    let objects = PredictedObjects { header, objects: vec![object] };
    [Input::Odometry(Arc::new(odometry)), Input::Objects(Arc::new(objects))]
}

fn live_after(threads: usize) -> [usize; 3] {
    let filter_names = CLASSES.iter().map(|class| class.class_name.to_owned()).collect();
    let parameters = ValidatorParameters { filter_names, ..parameters() };
    let validator = Validator::new(parameters, &VehicleInfo::default()).unwrap();
    let node = Setup { validator, ..Setup::new(threads) }.start();
    let mut live = Vec::new();
    for number in 1..=HOUR {
        let now = after(START, 100 * i64::from(number));
        node.system.advance_to(now).unwrap();
        sensors(number, now).into_iter().for_each(|input| node.system.deliver(input).unwrap());
        let seen = node.cycle(&strangers(number, now));
        // More than are judged inline.
        assert!(number < 20 || seen.judged().is_some_and(|judged| judged.verdicts.len() > 8));
        drop(seen);
        if [HOUR / 60, HOUR / 2, HOUR].contains(&number) {
            live.push(LIVE.load(Ordering::Relaxed));
        }
    }
    let state = node.system.stop().unwrap();
    assert_eq!((state.cycles, state.coalesced), (u64::from(HOUR), 0), "and the timer never fired");
    live.try_into().unwrap()
}

#[test]
fn planners_and_objects_with_new_ids_in_every_message_fill_no_memory() {
    // One after the other: the whole process is measured.
    for threads in [1, 2] {
        let [minute, half_hour, hour] = live_after(threads);
        eprintln!(
            "{threads} threads: {minute} bytes after a minute, {half_hour} after half an hour, {hour} after an hour"
        );
        let level = minute + minute / 50 + SLACK_BYTES;
        assert!(half_hour <= level && hour <= level);
    }
}
