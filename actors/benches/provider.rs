//! What the open-space provider costs beside its planning: a cycle, calling a plan off, and doing nothing.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a benchmark fails by panicking")]

use open_space::provider::{
    Execution, Frame, Job, PlanningWorker, PreviousFrame, Provider, ProviderParameters, Region, Source,
};
use open_space::scenes::{Scene, SceneKind, scene};
use open_space::stitcher::{PublishedTrajectory, compute_reinit_stitching_trajectory};
use open_space::vehicle_model::VehicleState;
use open_space::{OpenSpaceParameters, Planner};
use selector_actors::provider::{PlanningThread, planner_of};
use std::sync::Arc;
use std::time::{Duration, Instant};

const CYCLES: u32 = 2000;
const CANCELLATIONS: u32 = 60;
const IDLE: Duration = Duration::from_secs(3);

fn region(scene: &Scene) -> Arc<Region> {
    Arc::new(Region {
        origin: motion::Point2::origin(),
        heading_rad: 0.0,
        goal: scene.problem.goal,
        bounds: scene.problem.bounds,
        obstacles: scene.problem.obstacles.clone(),
    })
}

fn standing(scene: &Scene) -> VehicleState {
    VehicleState::standing_at(scene.problem.start)
}

fn worker(scene: &Scene) -> PlanningThread {
    let make = || Planner::new(OpenSpaceParameters::default());
    PlanningThread::new(planner_of(make, scene.problem.vehicle, scene.problem.limits, 0.1))
}

/// Cycles of a vehicle that drives on its plan while the next ones are made; how long each call took.
fn cycles(scene: &Scene) -> (Vec<Duration>, usize, usize) {
    let (region, mut vehicle) = (region(scene), standing(scene));
    let execution = Execution::Threaded(Box::new(worker(scene)));
    let mut provider = Provider::new(ProviderParameters::default(), execution).unwrap();
    let mut previous: Option<PreviousFrame> = None;
    let (mut times, mut plans, mut points) = (Vec::new(), 0, 0);
    for cycle in 0..CYCLES {
        // Virtual time runs more slowly than that of the planner, so that both are always busy.
        let now_s = f64::from(cycle) * 2e-3;
        let frame =
            Frame { now_s, vehicle, region: &region, in_check_stage: false, previous: previous.as_ref() };
        let began = Instant::now();
        let provision = provider.process(&frame);
        times.push(began.elapsed());
        plans += usize::from(provision.source == Source::Planned);
        points = points.max(provision.trajectory.points.len());
        let provider_success = provision.success();
        if provider_success && let Some(here) = provision.trajectory.evaluate(now_s - provision.header_time_s)
        {
            vehicle.pose = here.path_point.unwrap().pose;
            vehicle.speed_mps = here.speed_mps;
        }
        let stitched =
            PublishedTrajectory { trajectory: provision.trajectory, header_time_s: provision.header_time_s };
        previous = Some(PreviousFrame { stitched, fallback: false, provider_success });
        std::thread::sleep(Duration::from_millis(2));
    }
    (times, plans, points)
}

/// From calling a plan off, after `planning` of it, to the end of its thread.
fn cancellation(scene: &Scene, planning: Duration) -> Duration {
    let mut worker = worker(scene);
    worker.start().unwrap();
    let stitching = compute_reinit_stitching_trajectory(0.1, &standing(scene));
    worker.submit(Job { stitching, region: region(scene), submitted_s: 0.0 });
    std::thread::sleep(planning);
    let began = Instant::now();
    worker.stop();
    began.elapsed()
}

/// Processor time of this program's planning thread, in ticks of a hundredth of a second; `None` where that cannot be
/// read.
fn planning_ticks() -> Option<u64> {
    let tasks = std::fs::read_dir("/proc/self/task").ok()?;
    tasks.flatten().find_map(|task| {
        let stat = std::fs::read_to_string(task.path().join("stat")).ok()?;
        let (name, rest) = stat.split_once('(')?.1.split_once(')')?;
        let fields: Vec<&str> = rest.split_whitespace().collect();
        (name == "open-space")
            .then(|| fields[11].parse::<u64>().unwrap_or(0) + fields[12].parse::<u64>().unwrap_or(0))
    })
}

fn show(what: &str, mut times: Vec<Duration>) {
    times.sort_unstable();
    let at = |part: f64| times[((times.len() - 1) as f64 * part) as usize].as_secs_f64() * 1e6;
    println!(
        "{what}: median {:.1} us, p99 {:.1} us, max {:.1} us of {}",
        at(0.5),
        at(0.99),
        at(1.0),
        times.len()
    );
}

fn main() {
    let scenes: Vec<Scene> = SceneKind::ALL.into_iter().map(|kind| scene(kind, 0.5, 1, 0)).collect();
    let (mut times, mut plans, mut points) = (Vec::new(), 0, 0);
    for scene in &scenes[..3] {
        let (more, planned, longest) = cycles(scene);
        times.extend(more);
        (plans, points) = (plans + planned, points.max(longest));
    }
    show("a cycle beside the planning thread", times);
    println!("  {plans} plans came in; up to {points} points");

    let cancel = |number: u32| {
        let scene = &scenes[number as usize % scenes.len()];
        cancellation(scene, Duration::from_millis(u64::from(number * 7 % 120)))
    };
    show("from calling a plan off to the end of its thread", (0..CANCELLATIONS).map(cancel).collect());

    let mut idle = worker(&scenes[0]);
    idle.start().unwrap();
    std::thread::sleep(Duration::from_millis(100));
    let before = planning_ticks();
    std::thread::sleep(IDLE);
    match planning_ticks().zip(before) {
        Some((after, before)) => {
            println!(
                "processor time of the idle planning thread in {IDLE:?}: {} ticks of 10 ms",
                after - before
            );
        }
        None => println!("processor time of threads cannot be read here"),
    }
}
