//! What each filter costs for a candidate, on recorded scenes.
//!
//! Without arguments: times of every filter on every scene of `golden/bench`, medians of many cycles. With
//! `count SCENE.json FILTER` one single cycle in the function [`counted_cycle`], for a profiler that counts
//! instructions (see `benches/instructions/run.sh`). A cycle is what the filter does in a running node: take in the
//! scene, judge all candidates, remember them. Before it is measured, a cycle of the moment before warms buffers and
//! what is made once for a map. `FILTER` is a short name, `data_validity` (which makes the points of the message ready
//! first), `all` (everything together, as the validator runs it) or `nothing` (the cost of measuring). With `count
//! SCENE.json FILTER FAR` there are so many road users more, all of them kilometres away from the candidates.
//!
//! Run: `cargo bench --bench filters`
#![allow(
    missing_docs,
    clippy::unwrap_used,
    clippy::panic,
    reason = "a benchmark is a program of its own and fails by panicking"
)]

use messages::builtin_interfaces::Time;
use messages::geometry_msgs::Point;
use motion::VehicleInfo;
use selection::filters::{CLASSES, FilterClass};
use selection::parameters::ValidatorParameters;
use selection::{Candidate, Filter, Judgement, Scene, Scratch, Validator, data_validity};
use std::hint::black_box;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;
use trajectory_selector::golden::{Maps, Sequence, sequence_files};

const ROUNDS: usize = 25;
/// From one cycle to the next.
const PERIOD_NS: i64 = 100_000_000;
/// Road users that are added are at least so far away, east and south \[m\].
const NEAREST_FAR_M: f64 = 2_000.0;

/// What is measured.
enum Judge {
    Nothing,
    DataValidity,
    One(Box<dyn Filter>),
    All(Box<Validator>),
}

impl Judge {
    fn of(name: &str, parameters: &ValidatorParameters, vehicle: &VehicleInfo) -> Self {
        match name {
            "nothing" => Self::Nothing,
            data_validity::NAME => Self::DataValidity,
            "all" => {
                let mut parameters = parameters.clone();
                parameters.filter_names = CLASSES.iter().map(|class| class.class_name.to_owned()).collect();
                Self::All(Box::new(Validator::new(parameters, vehicle).unwrap()))
            }
            name => {
                let is_wanted = |class: &&FilterClass| class.short_name == name;
                let class = CLASSES.iter().find(is_wanted).unwrap_or_else(|| panic!("no filter {name}"));
                Self::One((class.make)(parameters, vehicle))
            }
        }
    }

    /// Filters get points that are ready: that work is the data validity check's, which comes first.
    fn wants_ready_points(&self) -> bool {
        !matches!(self, Self::DataValidity | Self::All(_))
    }

    /// One cycle; gives the number of feasible candidates.
    fn cycle(&mut self, scene: &Scene, candidates: &[Candidate], scratch: &mut Scratch) -> usize {
        match self {
            Self::Nothing => black_box(candidates).len(),
            Self::DataValidity => {
                let judgements = candidates.iter().map(|candidate| data_validity::judge(scene, candidate));
                judgements.filter(|judgement| black_box(judgement).feasible).count()
            }
            Self::One(filter) => {
                filter.announce(candidates);
                filter.observe(scene);
                let judge = |candidate| filter.judge(scene, candidate, scratch);
                let judgements: Vec<Judgement> = candidates.iter().map(judge).collect();
                let judged: Vec<_> = candidates.iter().zip(&judgements).collect();
                filter.remember(&judged);
                judgements.iter().filter(|judgement| judgement.feasible).count()
            }
            Self::All(validator) => {
                validator.announce(candidates);
                validator.observe(scene);
                let judge = |candidate| validator.judge(scene, candidate, scratch, || 0, &mut []);
                let verdicts: Vec<_> = candidates.iter().map(judge).collect();
                validator.remember(candidates, &verdicts);
                verdicts.iter().filter(|verdict| verdict.feasible).count()
            }
        }
    }
}

/// The profiler counts what happens in here.
#[inline(never)]
fn counted_cycle(judge: &mut Judge, scene: &Scene, candidates: &[Candidate], scratch: &mut Scratch) -> usize {
    judge.cycle(scene, candidates, scratch)
}

fn read(path: &Path, maps: &mut Maps) -> Sequence {
    Sequence::read(path, maps).unwrap_or_else(|error| panic!("{error}"))
}

fn later(time: &mut Time, cycles: i64) {
    *time = Time::from_nanoseconds(time.nanoseconds() + cycles * PERIOD_NS);
}

/// The same scene some cycles later: new messages, so that nothing of a cycle can be kept from the one before.
fn scene_later(scene: &Scene, cycles: i64) -> Scene {
    let mut scene = scene.clone();
    later(&mut scene.now, cycles);
    if let Some(odometry) = &mut scene.odometry {
        later(&mut Arc::make_mut(odometry).header.stamp, cycles);
    }
    if let Some(acceleration) = &mut scene.acceleration {
        later(&mut Arc::make_mut(acceleration).header.stamp, cycles);
    }
    if let Some(objects) = &mut scene.objects {
        later(&mut Arc::make_mut(objects).header.stamp, cycles);
    }
    if let Some(signals) = &mut scene.traffic_signals {
        later(&mut Arc::make_mut(signals).stamp, cycles);
    }
    scene
}

/// New candidates like the given ones, some cycles later.
fn candidates_later(candidates: &[Candidate], cycles: i64, ready: bool) -> Vec<Candidate> {
    let later = candidates.iter().map(|candidate| {
        let mut message = (*candidate.message).clone();
        later(&mut message.header.stamp, cycles);
        let later = Candidate::new(Arc::new(message), candidate.generator_name.clone(), candidate.key.sample);
        if ready {
            black_box(later.points.len());
        }
        later
    });
    later.collect()
}

/// Runs warm-up and measured cycles; each is handed to `measure`.
fn run(sequence: &Sequence, name: &str, cycles: usize, mut measure: impl FnMut(&mut dyn FnMut())) -> usize {
    let first = &sequence.cycles[0];
    let mut judge = Judge::of(name, &sequence.parameters, &sequence.vehicle);
    let mut scratch = Scratch::default();
    let mut feasible = 0;
    for cycle in 0..=cycles as i64 {
        let scene = scene_later(&first.scene, cycle - 1);
        let candidates = candidates_later(&first.candidates, cycle - 1, judge.wants_ready_points());
        if cycle == 0 {
            judge.cycle(&scene, &candidates, &mut scratch);
        } else {
            measure(&mut || feasible = counted_cycle(&mut judge, &scene, &candidates, &mut scratch));
        }
    }
    feasible
}

/// Adds road users like those that are there, kilometres away.
fn add_far(scene: &mut Scene, far: usize) {
    let Some(objects) = &mut scene.objects else { return };
    let objects = &mut Arc::make_mut(objects).objects;
    let near = objects.len();
    for number in 0..far {
        let mut object = objects[number % near].clone();
        object.object_id.uuid[..8].copy_from_slice(&(number as u64 + 1).to_be_bytes());
        let away_m = NEAREST_FAR_M + 5.0 * number as f64;
        let move_away =
            |position: &mut Point| (position.x, position.y) = (position.x + away_m, position.y - away_m);
        move_away(&mut object.kinematics.initial_pose_with_covariance.pose.position);
        let paths = object.kinematics.predicted_paths.iter_mut();
        paths.flat_map(|path| &mut path.path).for_each(|pose| move_away(&mut pose.position));
        objects.push(object);
    }
}

fn count(path: &Path, name: &str, far: usize) {
    let mut sequence = read(path, &mut Maps::default());
    add_far(&mut sequence.cycles[0].scene, far);
    let feasible = run(&sequence, name, 1, |cycle| cycle());
    println!("candidates {} feasible {feasible}", sequence.cycles[0].candidates.len());
}

fn times(folder: &Path) {
    println!("{:<26} {:<40} {:>9} {:>9} {:>14}", "scene", "filter", "feasible", "rejected", "µs/candidate");
    let mut maps = Maps::default();
    for file in sequence_files(&[folder.to_owned()]).unwrap_or_else(|error| panic!("{error}")) {
        let sequence = read(&file, &mut maps);
        let names = [data_validity::NAME].into_iter().chain(CLASSES.iter().map(|class| class.short_name));
        for name in names.chain(["all"]) {
            let mut spent_us = Vec::new();
            let feasible = run(&sequence, name, ROUNDS, |cycle| {
                let start = Instant::now();
                cycle();
                spent_us.push(start.elapsed().as_secs_f64() * 1e6);
            });
            spent_us.sort_unstable_by(f64::total_cmp);
            let candidates = sequence.cycles[0].candidates.len();
            let each_us = spent_us[spent_us.len() / 2] / candidates as f64;
            let rejected = candidates - feasible;
            println!("{:<26} {name:<40} {feasible:>9} {rejected:>9} {each_us:>14.2}", sequence.name);
        }
    }
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|argument| argument != "--bench").collect();
    match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["count", scene, filter] => count(Path::new(scene), filter, 0),
        ["count", scene, filter, far] => count(Path::new(scene), filter, far.parse().unwrap()),
        [] => {
            let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared");
            let shared = std::env::var_os("SELECTOR_SHARED").map_or(beside, PathBuf::from);
            times(&shared.join("golden/bench"));
        }
        _ => panic!("usage: filters [count SCENE.json FILTER [FAR]]"),
    }
}
