//! A vehicle follows the provider's output through partition and re-timing until it stands in the slot: with noise,
//! delay and lag, planning beside the cycles, all in virtual time. `SELECTOR_SEEDS` says how many noisy drives, or with
//! two numbers (40..41) which, and `SELECTOR_SCENES` picks those whose names contain it; with `TRACE` each cycle is told.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

mod drive;
mod random;
#[path = "../support/scene_files.rs"]
mod scene_files;
mod vehicle;

use std::ops::Range;

use drive::{Drive, Ending, Outcome, Setting};
use open_space::provider::ProviderParameters;
use open_space::scenes::{SceneKind, scene};
use open_space::{OpenSpaceParameters, Planner, Problem};
use scene_files::example_scenes;
use vehicle::Imperfection;

const PERFECT: Imperfection = Imperfection { delay_ticks: 0, position_m: 0.0, yaw_rad: 0.0, speed_mps: 0.0 };
const USUAL: Imperfection =
    Imperfection { delay_ticks: 10, position_m: 0.01, yaw_rad: 0.003, speed_mps: 0.01 };

/// Seeds of each noisy drive; more on demand.
fn seeds(few: u64) -> Range<u64> {
    let wanted = std::env::var("SELECTOR_SEEDS").unwrap_or_default();
    let (first, end) = wanted.split_once("..").unwrap_or(("0", &wanted));
    first.parse().unwrap()..end.parse().unwrap_or(few)
}

/// A name and a problem.
type Named = (String, Problem);

fn wanted(scenes: impl Iterator<Item = Named>) -> impl Iterator<Item = Named> {
    let wanted = std::env::var("SELECTOR_SCENES").unwrap_or_default();
    scenes.filter(move |(name, _)| name.contains(&wanted))
}

/// Those that come with the program, and two of every generated kind. In tighter ones the way is planned with millimetres
/// to spare, which no noisy vehicle keeps.
fn scenes() -> impl Iterator<Item = Named> {
    let generated =
        SceneKind::ALL.into_iter().flat_map(|kind| [scene(kind, 0.2, 1, 0), scene(kind, 0.3, 1, 1)]);
    wanted(example_scenes().into_iter().chain(generated.map(|scene| (scene.name, scene.problem))))
}

/// Plan once and track.
fn once() -> ProviderParameters {
    ProviderParameters { open_space_planning_period: 1000.0, ..ProviderParameters::default() }
}

fn setting(imperfection: Imperfection, provider: ProviderParameters, seed: u64) -> Setting {
    Setting { imperfection, provider, seed, start_noise_m: 0.0, blocked_until_s: 0.0 }
}

fn drive(problem: &Problem, setting: Setting) -> Outcome {
    Drive::new(problem, Planner::new(OpenSpaceParameters::default()), setting).run()
}

/// Every drive that did not end in the slot, and a summary of all.
fn assert_parked(drives: impl Iterator<Item = (String, Outcome)>) {
    let (mut failed, mut count, mut least_m, mut plans) = (Vec::new(), 0, f64::INFINITY, 0);
    let mut lost = 0;
    for (case, outcome) in drives {
        (count, plans, lost) = (count + 1, plans + outcome.plans, lost + outcome.lost);
        least_m = f64::min(least_m, outcome.min_clearance_m);
        let parked =
            outcome.ending == Ending::Parked && outcome.goal_error_m < 0.2 && outcome.goal_error_rad < 0.07;
        if !parked {
            failed.push(format!("{case}: {outcome:?}"));
        }
    }
    eprintln!(
        "{count} drives, {plans} plans, least clearance {least_m:.3} m, {lost} times off the plan, {} not parked",
        failed.len()
    );
    assert!(failed.is_empty(), "{}", failed.join("\n"));
}

#[test]
fn a_perfect_vehicle_parks() {
    assert_parked(scenes().map(|(name, problem)| {
        let outcome = drive(&problem, setting(PERFECT, once(), 1));
        (name, outcome)
    }));
}

#[test]
fn a_usual_vehicle_parks() {
    assert_parked(scenes().flat_map(|(name, problem)| {
        seeds(3).map(move |seed| {
            let usual = Setting { start_noise_m: 0.03, ..setting(USUAL, once(), seed) };
            (format!("{name} {seed}"), drive(&problem, usual))
        })
    }));
}

/// One of every kind: here every drive is planned dozens of times.
fn fewer_scenes() -> impl Iterator<Item = Named> {
    let scenes = SceneKind::ALL.into_iter().map(|kind| scene(kind, 0.2, 1, 0));
    wanted(scenes.map(|scene| (scene.name, scene.problem)))
}

#[test]
fn planning_goes_on_while_a_usual_vehicle_drives() {
    assert_parked(fewer_scenes().flat_map(|(name, problem)| {
        seeds(1).map(move |seed| {
            let outcome = drive(&problem, setting(USUAL, ProviderParameters::default(), seed));
            assert!(outcome.plans > 1, "{name}: {outcome:?}");
            (format!("{name} {seed}"), outcome)
        })
    }));
}

#[test]
fn somebody_in_the_way_is_waited_for() {
    assert_parked(fewer_scenes().flat_map(|(name, problem)| {
        seeds(1).map(move |seed| {
            let blocked = Setting { blocked_until_s: 20.0, ..setting(USUAL, once(), seed) };
            let outcome = drive(&problem, blocked);
            assert!(outcome.brakes > 0 && outcome.seconds > 20.0, "{name}: {outcome:?}");
            (format!("{name} {seed}"), outcome)
        })
    }));
}
