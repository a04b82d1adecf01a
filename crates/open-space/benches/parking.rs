//! What a whole plan costs, stage by stage, and how good it is: the scenes with known best paths, or generated ones.
//!
//! Times are processor time of the planning thread, ms. Every plan is judged by code of its own; a fault is printed and
//! ends the program with an error.
//!
//! Run: `cargo bench -p open-space --bench parking -- [--known | --generated N] [--seed N] [--set GROUP.NAME=NUMBER] [WORD...]`
//!
//! * nothing: the scenes of the shared data; words pick those whose names contain all of them
//! * `--known`: their best known paths are refined, nothing is searched
//! * `--generated N`: N scenes of each kind from the generator instead
//! * `--set search.clearance=0.05`: with another value of a parameter
#![allow(
    missing_docs,
    clippy::unwrap_used,
    reason = "a benchmark is a program of its own and fails by panicking"
)]

#[path = "../tests/support/judge.rs"]
mod judge;
#[path = "../tests/support/scenes.rs"]
mod scenes;

use std::process::ExitCode;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use open_space::planner::{OpenSpaceParameters, Plan, PlanError, Planner, Stage, Step, Supervisor};
use open_space::{CollisionChecker, Interruption, Watch};
use rustix::time::{ClockId, clock_gettime};
use scenes::{Scene, scenes};
use serde_json::Value;

const STEPS: [(Step, &str); 5] = [
    (Step::Heuristic, "heur"),
    (Step::Search, "search"),
    (Step::Smoothing, "smooth"),
    (Step::Speed, "speed"),
    (Step::Check, "check"),
];

/// Processor time of this thread.
fn now() -> Duration {
    clock_gettime(ClockId::ThreadCPUTime).try_into().unwrap()
}

/// Notes when each step begins, and how long an interruption would have to wait.
struct Stopwatch {
    steps: Vec<(Step, Duration)>,
    questions: Arc<Mutex<Questions>>,
}

struct Questions {
    asked: Duration,
    longest_wait: Duration,
}

impl Questions {
    fn note(&mut self) {
        let now = now();
        self.longest_wait = self.longest_wait.max(now - self.asked);
        self.asked = now;
    }
}

impl Supervisor for Stopwatch {
    fn interruption(&mut self) -> Option<Interruption> {
        self.note();
        None
    }

    fn watch(&self) -> Option<Watch> {
        let questions = self.questions.clone();
        Some(Arc::new(move || {
            questions.lock().unwrap().note();
            None
        }))
    }

    fn begin(&mut self, step: Step) {
        self.steps.push((step, now()));
    }
}

impl Stopwatch {
    fn new() -> Self {
        let questions = Questions { asked: now(), longest_wait: Duration::ZERO };
        Self { steps: Vec::new(), questions: Arc::new(Mutex::new(questions)) }
    }

    fn note(&self) {
        self.questions.lock().unwrap().note();
    }

    fn longest_wait_ms(&self) -> f64 {
        self.questions.lock().unwrap().longest_wait.as_secs_f64() * 1e3
    }

    /// Time spent in `step`, ms, when all ended at `end`.
    fn spent_ms(&self, step: Step, end: Duration) -> f64 {
        let ends = self.steps.iter().skip(1).map(|(_, at)| *at).chain([end]);
        let spent = self.steps.iter().zip(ends).filter(|((s, _), _)| *s == step);
        spent.map(|((_, begin), end)| end - *begin).sum::<Duration>().as_secs_f64() * 1e3
    }
}

/// What the caller asks for.
#[derive(Default)]
struct Wishes {
    known: bool,
    generated: Option<u32>,
    changes: Vec<(String, String, Value)>,
    seed: u64,
    words: Vec<String>,
}

impl Wishes {
    fn read() -> Self {
        let mut wishes = Self { seed: 1, ..Self::default() };
        let mut arguments = std::env::args().skip(1).filter(|word| word != "--bench");
        while let Some(word) = arguments.next() {
            if word == "--set" {
                wishes.changes.push(change(&arguments.next().expect("GROUP.NAME=NUMBER")));
                continue;
            }
            let mut number = || arguments.next().and_then(|word| word.parse().ok()).expect("a number");
            match word.as_str() {
                "--known" => wishes.known = true,
                "--generated" => wishes.generated = Some(number()),
                "--seed" => wishes.seed = u64::from(number()),
                _ => wishes.words.push(word),
            }
        }
        wishes
    }

    fn scenes(&self) -> Vec<Scene> {
        let mut all = match self.generated {
            Some(per_kind) => open_space::scenes::suite(self.seed, per_kind)
                .map(|s| Scene { name: s.name, problem: s.problem, best: None, fewest_gear_changes: None })
                .collect(),
            None => scenes(),
        };
        all.retain(|scene| self.words.iter().all(|word| scene.name.contains(word)));
        all
    }

    fn parameters(&self) -> OpenSpaceParameters {
        let mut values = serde_json::to_value(OpenSpaceParameters::default()).unwrap();
        for (group, name, value) in &self.changes {
            values[group][name] = value.clone();
        }
        serde_json::from_value(values).unwrap()
    }

    fn plan(&self, scene: &Scene, stopwatch: &mut Stopwatch) -> Option<Result<Plan, PlanError>> {
        let planner = Planner::new(self.parameters());
        if !self.known {
            return Some(planner.plan(&scene.problem, stopwatch));
        }
        let checker = CollisionChecker::new(&scene.problem).unwrap();
        scene.best.as_ref().map(|best| planner.refine(&scene.problem, &checker, best, stopwatch))
    }
}

/// `GROUP.NAME=NUMBER`.
fn change(word: &str) -> (String, String, Value) {
    let (name, value) = word.split_once('=').unwrap();
    let (group, name) = name.split_once('.').unwrap();
    (group.to_owned(), name.to_owned(), value.parse().unwrap())
}

/// Figures of one quantity over all scenes.
#[derive(Default)]
struct Series(Vec<f64>);

impl Series {
    /// The value below which `share` of the values lie.
    fn quantile(&self, share: f64) -> f64 {
        let mut values = self.0.clone();
        values.sort_by(f64::total_cmp);
        let index = (share * values.len() as f64) as usize;
        values.get(index.min(values.len().saturating_sub(1))).copied().unwrap_or(f64::NAN)
    }

    fn sum(&self) -> f64 {
        self.0.iter().sum()
    }

    fn print(&self, name: &str) {
        let [median, p90, p99, most] = [0.5, 0.9, 0.99, 1.0].map(|share| self.quantile(share));
        println!("{name:<24} {median:>9.3} {p90:>9.3} {p99:>9.3} {most:>9.3}");
    }
}

#[derive(Default)]
struct Summary {
    scenes: usize,
    planned: usize,
    faults: usize,
    best_efforts: usize,
    steps_ms: [Series; 5],
    total_ms: Series,
    waits_ms: Series,
    ratios: Series,
    durations_s: Series,
    clearances_m: Series,
    stops: usize,
    gear_changes: usize,
    /// Of the best paths known, and of those with the fewest changes, for the scenes that were planned and have one.
    known_changes: usize,
    fewest_changes: usize,
    changes_where_known: usize,
}

impl Summary {
    fn add(&mut self, scene: &Scene, plan: &Result<Plan, PlanError>, stopwatch: &Stopwatch, end: Duration) {
        self.scenes += 1;
        let spent = STEPS.map(|(step, _)| stopwatch.spent_ms(step, end));
        for (series, ms) in self.steps_ms.iter_mut().zip(spent) {
            series.0.push(ms);
        }
        self.total_ms.0.push(spent.iter().sum());
        self.waits_ms.0.push(stopwatch.longest_wait_ms());
        let known_m = scene.best.as_ref().map(open_space::CoarsePath::length_m);
        let known_changes = scene.best.as_ref().map_or(0, open_space::CoarsePath::gear_changes);
        print!("{:<26} {:>7.2} {known_changes:>3} ", scene.name, known_m.unwrap_or(f64::NAN));
        let plan = match plan {
            Ok(plan) => plan,
            Err(error) => return println!(" {error} ({:.0} ms)", spent.iter().sum::<f64>()),
        };
        self.planned += 1;
        let measures = &plan.measures;
        print!("{:>7.2} {:>3} {:>6.1} ", measures.length_m, measures.gear_changes, measures.duration_s);
        print!("{:>6.3} {:>5} {:>7} ", measures.min_clearance_m, plan.stops(), plan.expansions);
        println!("{}", spent.map(|ms| format!("{ms:>7.1} ")).concat());
        if plan.stage != Stage::Timed {
            println!("    best effort: {:?}, held back: {:?}", plan.stage, plan.held_back);
            self.best_efforts += 1;
        }
        for fault in judge::faults(&plan.trajectory, &scene.problem) {
            println!("    FAULT: {fault}");
            self.faults += 1;
        }
        self.durations_s.0.push(measures.duration_s);
        self.clearances_m.0.push(measures.min_clearance_m);
        self.stops += plan.stops();
        self.gear_changes += measures.gear_changes;
        if let (Some(known_m), Some(fewest)) = (known_m, scene.fewest_gear_changes) {
            self.ratios.0.push(measures.length_m / known_m);
            self.known_changes += known_changes;
            self.fewest_changes += fewest as usize;
            self.changes_where_known += measures.gear_changes;
        }
    }

    fn print(&self) {
        println!("\n{:<24} {:>9} {:>9} {:>9} {:>9}", "", "median", "p90", "p99", "most");
        for (series, (_, name)) in self.steps_ms.iter().zip(STEPS) {
            series.print(&format!("{name}, ms"));
        }
        self.total_ms.print("whole plan, ms");
        self.waits_ms.print("longest deafness, ms");
        self.ratios.print("length over best known");
        self.durations_s.print("time of driving, s");
        println!(
            "{} of {} planned, {} of them as best effort, {} faults; smallest clearance {:.4} m; {:.0} s of driving; {} stops to steer",
            self.planned,
            self.scenes,
            self.best_efforts,
            self.faults,
            self.clearances_m.quantile(0.0),
            self.durations_s.sum(),
            self.stops,
        );
        println!(
            "{} changes of gear; where a path is known {}, on the best paths {}, on those with the fewest {}",
            self.gear_changes, self.changes_where_known, self.known_changes, self.fewest_changes
        );
    }
}

fn main() -> ExitCode {
    let wishes = Wishes::read();
    let mut summary = Summary::default();
    println!(
        "scene                        known  gc    plan  gc time s room m stops   nodes    heur  search  smooth   speed   check"
    );
    for scene in wishes.scenes() {
        let mut stopwatch = Stopwatch::new();
        if let Some(plan) = wishes.plan(&scene, &mut stopwatch) {
            let end = now();
            stopwatch.note();
            summary.add(&scene, &plan, &stopwatch, end);
        }
    }
    summary.print();
    if summary.faults == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
