//! What `/diagnostics` says about a cycle.

use super::ranking_log::no_choice;
use crate::cycle::{CycleReport, Judged, Outcome};
use crate::tally::Tally;
use crate::topics::NODE_NAME;
use messages::builtin_interfaces::Time;
use messages::diagnostic_msgs::{DiagnosticArray, DiagnosticStatus, KeyValue};
use messages::std_msgs::Header;
use selection::Enforcement;
use selection::report::FilterSummary;
use std::fmt::Display;

/// One status for the validator, whose level follows from the enforced filters only (shadow filters are values), and
/// one for the ranker of a cycle that came that far.
pub(super) fn of_cycle(report: &CycleReport, tally: &Tally) -> DiagnosticArray {
    let (level, message) = level(&report.outcome);
    let mut values = Vec::new();
    if let Outcome::Judged(judged) = &report.outcome {
        judged.filters.iter().for_each(|filter| add_filter(&mut values, filter));
        let accepted = judged.validated.candidate_trajectories.len();
        add(&mut values, "candidates.accepted", &accepted);
        add(&mut values, "candidates.not_judged", &judged.not_judged());
    }
    add(&mut values, "candidates.input", &report.cycle.concatenated.candidates.len());
    add(&mut values, "candidates.stale", &report.cycle.concatenated.stale.len());
    let oddities = report.cycle.concatenated.oddities;
    add(&mut values, "candidates.unannounced", &oddities.unannounced);
    add(&mut values, "generators.announced_twice", &oddities.announced_twice);
    add(&mut values, "generators.evicted", &oddities.evicted);
    add(&mut values, "cycle.trigger", &report.cycle.trigger.name());
    add_input_ages(&mut values, report);
    for (name, count) in tally.faults() {
        add(&mut values, name, &count);
    }
    let header = Header { stamp: report.cycle.scene.now, frame_id: String::new() };
    let status = DiagnosticStatus {
        level,
        name: format!("{NODE_NAME}: trajectory_validator"),
        message,
        hardware_id: NODE_NAME.to_owned(),
        values,
    };
    let ranker = match &report.outcome {
        Outcome::Judged(judged) => Some(of_ranking(judged)),
        _ => None,
    };
    DiagnosticArray { header, status: [status].into_iter().chain(ranker).collect() }
}

/// Whether there is a trajectory to drive. A node that puts none out must say so, also where the filters found nothing.
fn of_ranking(judged: &Judged) -> DiagnosticStatus {
    let mut values = Vec::new();
    add(&mut values, "candidates.ranked", &judged.ranking.ranked.len());
    add(&mut values, "candidates.unranked", &judged.ranking.unranked.len());
    let (level, message) = match &judged.selected {
        Some(selected) => {
            add(&mut values, "selected.generator", &selected.generator_name);
            add(&mut values, "selected.candidate", &selected.key);
            add(&mut values, "selected.score", &selected.score);
            (DiagnosticStatus::OK, "OK")
        }
        None => (DiagnosticStatus::ERROR, no_choice(judged)),
    };
    if let Some(panic) = &judged.ranking.failure {
        add(&mut values, "ranker.panic", panic);
    }
    DiagnosticStatus {
        level,
        name: format!("{NODE_NAME}: trajectory_ranker"),
        message: message.to_owned(),
        hardware_id: NODE_NAME.to_owned(),
        values,
    }
}

fn level(outcome: &Outcome) -> (u8, String) {
    let judged = match outcome {
        Outcome::NoCandidates => {
            return (DiagnosticStatus::STALE, "No concatenated trajectories received yet".to_owned());
        }
        Outcome::MissingInput(input) => return (DiagnosticStatus::WARN, input.to_string()),
        Outcome::Failed(why) => return (DiagnosticStatus::ERROR, why.clone()),
        Outcome::Judged(judged) => judged,
    };
    let accepted = judged.validated.candidate_trajectories.len();
    if judged.filters.iter().any(|filter| filter.panicked > 0) {
        return (DiagnosticStatus::ERROR, "A filter panicked".to_owned());
    }
    match judged.verdicts.len() {
        all if accepted == all => (DiagnosticStatus::OK, "OK".to_owned()),
        _ if accepted == 0 => (DiagnosticStatus::ERROR, "No feasible trajectories found".to_owned()),
        _ => (DiagnosticStatus::WARN, "At least one trajectory is infeasible".to_owned()),
    }
}

fn add(values: &mut Vec<KeyValue>, key: impl Into<String>, value: &dyn Display) {
    values.push(KeyValue { key: key.into(), value: value.to_string() });
}

fn add_filter(values: &mut Vec<KeyValue>, filter: &FilterSummary) {
    let name = filter.name;
    add(values, name, if filter.rejected == 0 { &"OK" } else { &"NG" });
    add(values, format!("{name}.rejected"), &filter.rejected);
    add(values, format!("{name}.worst_risk"), &filter.worst_risk);
    add(values, format!("{name}.shadow"), &(filter.enforcement == Enforcement::Shadow));
}

/// Inputs never expire, so their age is shown to whoever watches.
fn add_input_ages(values: &mut Vec<KeyValue>, report: &CycleReport) {
    let scene = &report.cycle.scene;
    let inputs = [
        ("odometry", scene.odometry.as_ref().map(|message| message.header.stamp)),
        ("objects", scene.objects.as_ref().map(|message| message.header.stamp)),
        ("acceleration", scene.acceleration.as_ref().map(|message| message.header.stamp)),
        ("traffic_signals", scene.traffic_signals.as_ref().map(|message| message.stamp)),
    ];
    for (input, stamp) in inputs {
        let age =
            stamp.map_or("never received".to_owned(), |stamp| format!("{:.3}", age_s(scene.now, stamp)));
        add(values, format!("input.{input}.age_s"), &age);
    }
}

fn age_s(now: Time, stamp: Time) -> f64 {
    (now.nanoseconds() - stamp.nanoseconds()) as f64 * 1e-9
}
