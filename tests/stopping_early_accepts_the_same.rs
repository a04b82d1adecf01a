//! Whoever wants no full report gets the same accepted candidates and the same trajectory to drive, cycle for cycle: a
//! filter with memory sees every candidate, so no memory is lost. Only what filters would have said about candidates that
//! were rejected already is missing, and the report says so.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

#[path = "program_support/program.rs"]
mod program;

#[path = "program_support/cycles.rs"]
mod cycles;

use cycles::{Cycle, cycles_of_drive};
use messages::autoware_trajectory_validator::ValidationReportArray;

const ALL_FILTERS: &str = "[safety::CollisionCheckFilter, traffic_rule::CrosswalkFilter, safety::OutOfLaneFilter, \
     traffic_rule::TrafficLightFilter, safety::UncrossableBoundaryDepartureFilter, safety::VehicleConstraintFilter]";

/// The whole generated drive, with its crosswalk, its light and its planner hiccup.
fn drive(stop_early: bool, enforce_all: bool) -> Vec<Cycle> {
    let mut parameters = vec![("stop_at_first_rejection", stop_early.to_string())];
    if enforce_all {
        parameters.push(("filter_names", ALL_FILTERS.to_owned()));
    }
    cycles_of_drive(1, 20.0, &parameters, &|_, _| {})
}

/// Filters that were not asked about a candidate, over all reports of a cycle.
fn not_asked(cycle: &Cycle) -> usize {
    let reports: Option<ValidationReportArray> = cycle.message("/debug/validation_reports");
    let metrics = reports.iter().flat_map(|array| &array.reports).flat_map(|report| &report.metrics);
    metrics.filter(|metric| metric.metric_name == "not_assessed").count()
}

#[test]
fn the_same_leaves_the_node() {
    for enforce_all in [false, true] {
        let (full, early) = (drive(false, enforce_all), drive(true, enforce_all));
        assert_eq!(full.len(), early.len());
        assert!(full.len() > 150, "{} cycles", full.len());
        for (number, (full, early)) in full.iter().zip(&early).enumerate() {
            for topic in ["/output/trajectories", "/output/scored_trajectories", "/output/trajectory"] {
                assert!(full.bytes(topic) == early.bytes(topic), "cycle {number}, {topic}");
            }
        }
        assert_eq!(full.iter().map(not_asked).sum::<usize>(), 0);
        assert!(early.iter().map(not_asked).sum::<usize>() > 100, "something was spared");
    }
}
