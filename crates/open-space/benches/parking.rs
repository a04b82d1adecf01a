//! What a whole plan costs, scene by scene, and how good it is.
//!
//! Run: `cargo bench -p open-space --bench parking` (with `-- --known` the best paths known are refined instead of
//! searched ones; any other word picks the scenes whose names contain it).
#![allow(
    missing_docs,
    clippy::unwrap_used,
    reason = "a benchmark is a program of its own and fails by panicking"
)]

#[path = "../tests/support/scenes.rs"]
mod scenes;

use std::time::{Duration, Instant};

use open_space::CollisionChecker;
use open_space::planner::{OpenSpaceParameters, Plan, PlanError, Planner, Step, Supervisor};
use scenes::{Scene, letters, scenes};

/// Notes when each step begins.
#[derive(Default)]
struct Stopwatch(Vec<(Step, Instant)>);

impl Supervisor for Stopwatch {
    fn stop(&mut self) -> bool {
        false
    }

    fn begin(&mut self, step: Step) {
        self.0.push((step, Instant::now()));
    }
}

impl Stopwatch {
    /// Time spent in `step`, ms, when all ended at `end`.
    fn spent_ms(&self, step: Step, end: Instant) -> f64 {
        let ends = self.0.iter().skip(1).map(|(_, at)| *at).chain([end]);
        let spent = self.0.iter().zip(ends).filter(|((s, _), _)| *s == step);
        spent.map(|((_, begin), end)| end.duration_since(*begin)).sum::<Duration>().as_secs_f64() * 1e3
    }
}

fn plan(planner: &Planner, scene: &Scene, stopwatch: &mut Stopwatch) -> Result<Plan, PlanError> {
    let checker = CollisionChecker::new(&scene.problem).unwrap();
    let best = scene.best.as_ref().unwrap();
    planner.refine(&scene.problem, &checker, best, stopwatch)
}

fn main() {
    let words: Vec<String> = std::env::args().skip(1).filter(|word| !word.starts_with("--")).collect();
    let planner = Planner::new(OpenSpaceParameters::default());
    let mut totals = Vec::new();
    println!(
        "scene                      parts        known m  plan m   time s  room m  smooth ms speed ms check ms  passes  arcs"
    );
    for scene in scenes() {
        if scene.best.is_none() || !words.iter().all(|word| scene.name.contains(word)) {
            continue;
        }
        let known = scene.best.as_ref().unwrap();
        let mut stopwatch = Stopwatch::default();
        let begin = Instant::now();
        let plan = plan(&planner, &scene, &mut stopwatch);
        let end = Instant::now();
        totals.push(end.duration_since(begin).as_secs_f64() * 1e3);
        match plan {
            Ok(plan) => println!(
                "{:<26} {:<12} {:>7.2} {:>7.2} {:>8.1} {:>7.3} {:>9.1} {:>8.1} {:>8.1} {:>7}  {}",
                scene.name,
                letters(known),
                known.length_m(),
                plan.measures.length_m,
                plan.measures.duration_s,
                plan.measures.min_clearance_m,
                stopwatch.spent_ms(Step::Smoothing, end),
                stopwatch.spent_ms(Step::Speed, end),
                stopwatch.spent_ms(Step::Check, end),
                plan.passes,
                plan.fallbacks.iter().map(|f| format!("{}: {}; ", f.part, f.reason)).collect::<String>(),
            ),
            Err(error) => println!("{:<26} {:<12} {error}", scene.name, letters(known)),
        }
    }
    totals.sort_by(f64::total_cmp);
    if let (Some(middle), Some(last)) = (totals.get(totals.len() / 2), totals.last()) {
        println!("{} scenes, median {middle:.1} ms, worst {last:.1} ms", totals.len());
    }
}
