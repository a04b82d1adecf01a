//! The trajectory that leaves the node passed every enforced filter in that very cycle; without one that did, none
//! leaves, and the diagnostics say so.
//!
//! Seen from outside, in what is recorded: the trajectory is looked up among the candidates of its cycle and in the
//! reports about them. And from inside, with filters whose answers are drawn: what is selected is what an independent
//! reading of the answers selects.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

#[path = "program_support/program.rs"]
mod program;

#[path = "program_support/cycles.rs"]
mod cycles;

use cycles::{Cycle, cycles_of_drive};
use messages::autoware_internal_planning_msgs::{
    CandidateTrajectories, CandidateTrajectory, ScoredCandidateTrajectories,
};
use messages::autoware_planning_msgs::Trajectory;
use messages::autoware_trajectory_validator::{ValidationReport, ValidationReportArray};
use messages::diagnostic_msgs::{DiagnosticArray, DiagnosticStatus};
use program::{read, run, shared};
use proptest::prelude::*;
use selector_actors::InputTopic;
use std::collections::BTreeMap;

/// What the shipped configuration enforces.
const ENFORCED: [&str; 4] = [
    "crosswalk_filter",
    "traffic_light_filter",
    "uncrossable_boundary_departure_filter",
    "vehicle_constraint_filter",
];

fn is_same(candidate: &CandidateTrajectory, trajectory: &Trajectory) -> bool {
    candidate.header == trajectory.header && candidate.points == trajectory.points
}

fn passed(report: &ValidationReport, enforced: &[&str]) -> bool {
    let is_feasible = |filter: &&str| {
        let mut told = report.metrics.iter().filter(|metric| metric.validator_name == *filter);
        told.any(|metric| metric.metric_name == "trajectory_feasibility" && metric.metric_value == 1.0)
    };
    let is_valid = report
        .metrics
        .iter()
        .any(|metric| metric.metric_name == "data_validity" && metric.metric_value == 0.0);
    is_valid && enforced.iter().all(is_feasible)
}

/// Holds one cycle to the promise; gives the generator whose trajectory leaves.
fn check(cycle: &Cycle, enforced: &[&str]) -> Option<String> {
    let all: CandidateTrajectories = cycle.message("/output/concatenated_trajectories").unwrap();
    let Some(reports) = cycle.message::<ValidationReportArray>("/debug/validation_reports") else {
        assert!(cycle.bytes("/output/trajectory").is_none(), "a cycle that judged nothing drives nothing");
        return None;
    };
    let validated: CandidateTrajectories = cycle.message("/output/validated_trajectories").unwrap();
    let scored: ScoredCandidateTrajectories = cycle.message("/output/scored_trajectories").unwrap();
    let trajectory: Option<Trajectory> = cycle.message("/output/trajectory");
    assert_eq!(cycle.bytes("/output/trajectories"), cycle.bytes("/output/validated_trajectories"));
    for beside in ["/output/turn_indicators", "/debug/planning_component_latency_s"] {
        assert_eq!(cycle.bytes(beside).is_some(), trajectory.is_some(), "{beside}");
    }
    let diagnostics: DiagnosticArray = cycle.message("/diagnostics").unwrap();
    let ranker = &diagnostics.status[1];
    assert_eq!(ranker.level == DiagnosticStatus::OK, trajectory.is_some(), "{}", ranker.message);
    let Some(trajectory) = trajectory else {
        assert!(scored.scored_candidate_trajectories.is_empty());
        return None;
    };
    assert!(validated.candidate_trajectories.iter().any(|candidate| is_same(candidate, &trajectory)));
    // The first of the highest scores, and nothing that is not in the validated set has a score.
    let scores = &scored.scored_candidate_trajectories;
    let highest = scores.iter().map(|scored| scored.score).fold(f32::MIN, f32::max);
    let best = &scores.iter().find(|scored| scored.score == highest).unwrap().candidate_trajectory;
    assert!(is_same(best, &trajectory));
    assert!(
        scores.iter().all(|scored| validated.candidate_trajectories.contains(&scored.candidate_trajectory))
    );
    let mut reported = all.candidate_trajectories.iter().zip(&reports.reports);
    let (_, report) = reported.find(|(candidate, _)| *candidate == best).unwrap();
    assert!(passed(report, enforced), "{} was driven: {:?}", report.generator_name, report.metrics);
    Some(report.generator_name.clone())
}

fn check_all(cycles: &[Cycle], enforced: &[&str]) -> BTreeMap<String, u64> {
    let mut driven: BTreeMap<String, u64> = BTreeMap::new();
    for generator in cycles.iter().filter_map(|cycle| check(cycle, enforced)) {
        *driven.entry(generator).or_default() += 1;
    }
    driven
}

#[test]
fn what_is_driven_at_the_intersection_passed_every_enforced_filter() {
    let Some(drive) = shared("data/drives/intersection.mcap") else { return };
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("out.mcap");
    let outcome = run(&["replay", drive.to_str().unwrap(), "--output", output.to_str().unwrap()]);
    assert_eq!(outcome.exit_code, 0, "{}", outcome.stderr);
    let cycles = Cycle::all(read(&output));
    let driven = check_all(&cycles, &ENFORCED);
    println!("{} cycles, driven: {driven:?}", cycles.len());
    assert!(cycles.len() > 150 && driven.values().sum::<u64>() > 150);
    assert!(driven.len() > 3, "more than one planner has its turn");
    // The summary counts the same.
    let selected = outcome.json["selected"].as_object().unwrap();
    for (generator, count) in selected {
        assert_eq!(count.as_u64(), Some(driven.get(generator).copied().unwrap_or(0)), "{generator}");
    }
    assert!(driven.keys().all(|generator| selected.contains_key(generator)));
}

/// Beyond every speed limit.
fn too_fast(candidate: &mut CandidateTrajectory) {
    candidate.points.iter_mut().for_each(|point| point.longitudinal_velocity_mps = 50.0);
}

#[test]
fn with_all_generative_candidates_rejected_the_backup_wins() {
    let only_generative = |topic: InputTopic, candidate: &mut CandidateTrajectory| {
        if topic == InputTopic::Generative {
            too_fast(candidate);
        }
    };
    let cycles = cycles_of_drive(1, 4.0, &[], &only_generative);
    let driven = check_all(&cycles, &ENFORCED);
    assert!(driven.keys().all(|name| name.starts_with("MinimumRuleBasedPlanner_")), "{driven:?}");
    // The first cycle comes before the first backup.
    assert_eq!(driven.values().sum::<u64>(), cycles.len() as u64 - 1, "{driven:?}");
    assert!(cycles.len() > 30);
}

#[test]
fn with_all_candidates_rejected_nothing_is_put_out_and_diagnostics_say_error() {
    let cycles = cycles_of_drive(1, 4.0, &[], &|_, candidate| too_fast(candidate));
    assert_eq!(check_all(&cycles, &ENFORCED), BTreeMap::new());
    for cycle in &cycles {
        let validated: CandidateTrajectories = cycle.message("/output/trajectories").unwrap();
        assert_eq!(validated, CandidateTrajectories::default(), "an empty validated set is published");
        let scored: ScoredCandidateTrajectories = cycle.message("/output/scored_trajectories").unwrap();
        assert_eq!(scored, ScoredCandidateTrajectories::default());
        let told: DiagnosticArray = cycle.message("/diagnostics").unwrap();
        let told: Vec<_> = told.status.iter().map(|status| (status.level, &status.message[..])).collect();
        let error = DiagnosticStatus::ERROR;
        assert_eq!(
            told,
            [(error, "No feasible trajectories found"), (error, "Every candidate was rejected")]
        );
    }
    assert!(cycles.len() > 30);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(6))]
    #[test]
    fn on_random_roads_with_random_limits_nothing_is_driven_that_an_enforced_filter_refused(
        seed in any::<u64>(),
        enforced in prop::sample::subsequence(ENFORCED.to_vec(), 0..=4),
        max_speed in 3.0..15.0_f64,
        max_steering_rate in 0.02..0.3_f64,
        // Every n-th generative message of a second is too fast.
        spoiled in 2..8_u32,
    ) {
        let class_name = |filter: &&str| match *filter {
            "crosswalk_filter" => "traffic_rule::CrosswalkFilter",
            "traffic_light_filter" => "traffic_rule::TrafficLightFilter",
            "vehicle_constraint_filter" => "safety::VehicleConstraintFilter",
            _ => "safety::UncrossableBoundaryDepartureFilter",
        };
        let list = |filters: &mut dyn Iterator<Item = &&str>| {
            format!("[{}]", filters.map(class_name).chain(["\"\""]).collect::<Vec<_>>().join(", "))
        };
        let parameters = [
            ("filter_names", list(&mut enforced.iter())),
            ("shadow_mode_filter_names", list(&mut ENFORCED.iter().filter(|filter| !enforced.contains(filter)))),
            ("vehicle_constraint.max_speed", format!("{max_speed:?}")),
            ("vehicle_constraint.max_steering_rate", format!("{max_steering_rate:?}")),
        ];
        let change = |topic: InputTopic, candidate: &mut CandidateTrajectory| {
            let tenth = candidate.header.stamp.nanosec / 100_000_000;
            if topic == InputTopic::Generative && tenth.is_multiple_of(spoiled) {
                too_fast(candidate);
            }
        };
        let cycles = cycles_of_drive(seed, 5.0, &parameters, &change);
        prop_assert!(cycles.len() > 30);
        check_all(&cycles, &enforced);
    }
}
