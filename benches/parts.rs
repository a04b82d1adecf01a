//! The parts one by one, each with its spread: messages, map, filters, a whole cycle, a parking plan.
//!
//! Everything is generated, so the figures mean the same on every machine: a load of 64 candidates x 80 points and 50
//! road users x 3 paths, a straight road of 1,000 lanelets, a scene of `config/scenes`. What depends on recorded data,
//! counts instructions or compares with others is measured by the other benchmarks of this folder.
//!
//! Run: `cargo bench --bench parts [-- WORD]`; criterion compares with the run before.
#![allow(
    missing_docs,
    clippy::unwrap_used,
    clippy::panic,
    reason = "a benchmark is a program of its own and fails by panicking"
)]

#[path = "../tests/interop_support/road.rs"]
#[allow(dead_code, reason = "messages are not needed")]
mod road;

use criterion::{BatchSize, Criterion, Throughput, criterion_group, criterion_main};
use messages::Interface;
use messages::builtin_interfaces::Time;
use motion::VehicleInfo;
use open_space::planner::{Planner, Unsupervised};
use open_space::{CollisionChecker, Limits, Search};
use selection::filters::{CLASSES, prepare_map};
use selection::parameters::ValidatorParameters;
use selection::scene::{Epoch, HdMap};
use selection::{Candidate, Pipeline, Ranker, Scene, Scratch, Validator};
use selector_actors::publisher::PublishedTimes;
use selector_actors::{Clock, Config, Input, Publication, SelectorSystem, Sink, SinkError};
use std::hint::black_box;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;
use trajectory_selector::parking_scene::ParkingScene;
use trajectory_selector::scenario::load::{Load, LoadMessages, LoadScene};
use trajectory_selector::settings::{DEFAULT_NODE_NAME, Settings};

const INTERFACE: Interface = Interface::V0_53;
const LANELETS: i64 = 1_000;
/// From one cycle to the next.
const PERIOD: Duration = Duration::from_millis(100);

fn load() -> LoadMessages {
    let scene = LoadScene::Intersection;
    Load { scene, candidates: 64, points: 80, objects: 50, paths: 3, generators: 8, seed: 1 }.messages()
}

fn settings() -> Settings {
    Settings::load(&format!("/{DEFAULT_NODE_NAME}"), &[]).unwrap()
}

/// What the filters judge, at the start of the load.
fn moment(load: &LoadMessages) -> (Scene, Vec<Candidate>) {
    let now = LoadMessages::start();
    let mut scene = Scene::empty(now, Arc::new(VehicleInfo::default()));
    let mut candidates = Vec::new();
    for input in load.once().into_iter().chain(load.sensors(now)).chain([load.anchor(now, usize::MAX)]) {
        match input {
            Input::Map(map) => {
                let decoded = Arc::new(lanelet_map::archive::decode(&map.data).unwrap());
                let value = HdMap::new(map.header.frame_id.as_str().into(), decoded);
                scene.map = Some(Epoch { number: 1, value });
            }
            Input::Route(route) => scene.route = Some(Epoch { number: 1, value: route }),
            Input::Odometry(odometry) => scene.odometry = Some(odometry),
            Input::Acceleration(acceleration) => scene.acceleration = Some(acceleration),
            Input::Objects(objects) => scene.objects = Some(objects),
            Input::TrafficSignals(signals) => scene.traffic_signals = Some(signals),
            Input::Generative(set) => {
                let sampled = set.candidate_trajectories.iter().zip(0..);
                let made =
                    sampled.map(|(message, sample)| Candidate::new(message.clone(), "load".into(), sample));
                candidates.extend(made);
            }
            _ => {}
        }
    }
    // Points are made from the message at first use, which is a part of its own.
    for candidate in &candidates {
        black_box(candidate.points.len());
    }
    (scene, candidates)
}

fn wire(criterion: &mut Criterion) {
    let (load, now) = (load(), LoadMessages::start());
    let [_, _, objects, _] = load.sensors(now);
    let mut group = criterion.benchmark_group("wire");
    for (name, input) in [("candidates", load.anchor(now, usize::MAX)), ("objects", objects)] {
        let cdr = input.to_cdr(INTERFACE).unwrap();
        group.throughput(Throughput::Bytes(cdr.len() as u64));
        group.bench_function(format!("encode {name}"), |bencher| bencher.iter(|| input.to_cdr(INTERFACE)));
        let topic = input.topic();
        group.bench_function(format!("decode {name}"), |bencher| {
            bencher.iter(|| topic.decode(&cdr, INTERFACE).unwrap());
        });
    }
    group.finish();
}

fn map(criterion: &mut Criterion) {
    let archive = lanelet_map::archive::encode(&road::road(LANELETS));
    let map = HdMap::new("map".into(), Arc::new(lanelet_map::archive::decode(&archive).unwrap()));
    let parameters = ValidatorParameters::default();
    let mut group = criterion.benchmark_group("map");
    group.throughput(Throughput::Elements(LANELETS.cast_unsigned()));
    group
        .bench_function("decode", |bencher| bencher.iter(|| lanelet_map::archive::decode(&archive).unwrap()));
    group.bench_function("prepare for the filters", |bencher| {
        let fresh = || HdMap::new(map.frame_id.clone(), map.map.clone());
        bencher.iter_batched(fresh, |map| prepare_map(&map, &parameters), BatchSize::LargeInput);
    });
    group.finish();
}

fn filters(criterion: &mut Criterion) {
    let (scene, candidates) = moment(&load());
    let parameters = ValidatorParameters::default();
    let mut group = criterion.benchmark_group("filters");
    group.throughput(Throughput::Elements(candidates.len() as u64));
    for class in CLASSES {
        let (mut filter, mut scratch) = ((class.make)(&parameters, &scene.vehicle), Scratch::default());
        group.bench_function(class.short_name, |bencher| {
            bencher.iter(|| {
                filter.observe(&scene);
                for candidate in &candidates {
                    black_box(filter.judge(&scene, candidate, &mut scratch));
                }
            });
        });
    }
    group.finish();
}

/// Takes outputs and drops them.
struct Nowhere;

impl Sink for Nowhere {
    fn publish(&mut self, _: Publication) -> Result<(), SinkError> {
        Ok(())
    }
}

fn cycle(criterion: &mut Criterion) {
    let (load, vehicle) = (load(), VehicleInfo::default());
    let mut group = criterion.benchmark_group("cycle");
    group.throughput(Throughput::Elements(64));
    for threads in [1, 2] {
        let clock = Clock::stepped(LoadMessages::start());
        let settings = settings();
        let validator = Validator::new(settings.validator.clone(), &vehicle).unwrap();
        let ranker = Ranker::new(settings.ranker.clone(), settings.selector.sources());
        let config = Config {
            clock: clock.clone(),
            threads,
            fallback_period_ms: 150,
            duration_time_s: 0.2,
            cycle_budget: None,
            vehicle,
            pipeline: Pipeline::new(validator, ranker),
            interface: INTERFACE,
            published_times: PublishedTimes::Zero,
            count_allocations: None,
        };
        let system = SelectorSystem::start(config, Box::new(Nowhere)).unwrap();
        let deliver = |input| system.deliver(input).unwrap();
        load.once().into_iter().for_each(deliver);
        group.bench_function(format!("from anchor to output, {threads} threads"), |bencher| {
            let next = || {
                let now = Time::from_nanoseconds(clock.now().nanoseconds() + PERIOD.as_nanos() as i64);
                clock.set(now);
                load.sensors(now).into_iter().for_each(deliver);
                load.anchor(now, usize::MAX)
            };
            bencher.iter_batched(next, deliver, BatchSize::PerIteration);
        });
        system.stop().unwrap();
    }
    group.finish();
}

fn parking(criterion: &mut Criterion) {
    let settings = settings();
    let parameters = settings.open_space.planner.clone();
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("config/scenes/perpendicular_reverse.yaml");
    let limits = Limits::from(parameters.limits);
    let ParkingScene { problem, .. } = ParkingScene::load(&path, &VehicleInfo::default(), &limits).unwrap();
    let mut group = criterion.benchmark_group("parking");
    group.sample_size(20);
    group.bench_function("hybrid A*", |bencher| {
        bencher.iter(|| {
            let checker = CollisionChecker::new(&problem).unwrap();
            let search = Search::prepare(&problem, &checker, &parameters.search, &mut || None).unwrap();
            search.run(&mut || None).unwrap()
        });
    });
    let planner = Planner::new(parameters.clone());
    group.bench_function("whole plan", |bencher| {
        bencher.iter(|| planner.plan(&problem, &mut Unsupervised).unwrap());
    });
    group.finish();
}

criterion_group!(parts, wire, map, filters, cycle, parking);
criterion_main!(parts);
