//! The summary of a run for people, on a terminal 100 columns wide.

use super::statistics;
use super::summary::{Allocations, Quantiles, RunSummary};
use std::collections::BTreeMap;
use std::fmt::{self, Write};

/// Width of the first column.
const NAME_WIDTH: usize = 48;

/// Writes the table.
///
/// # Errors
/// The writer fails.
pub fn write(summary: &RunSummary, out: &mut impl Write) -> fmt::Result {
    write_cycles(summary, out)?;
    write_candidates(summary, out)?;
    write_rejections("rejections by enforced filter", &summary.rejections, out)?;
    write_rejections("objections of shadow filters (nothing is removed)", &summary.shadow, out)?;
    write_latencies(&summary.latency_us, out)?;
    write_dropped(summary, out)?;
    let wall_s = summary.wall_s;
    write!(out, "\n{} in {wall_s:.2} s", summary.input.name)?;
    match &summary.output {
        Some(output) => {
            let messages: u64 = output.messages.values().sum();
            writeln!(out, ", {messages} messages written to {}\nsha256 {}", output.path, output.sha256)
        }
        None => writeln!(out),
    }
}

fn write_cycles(summary: &RunSummary, out: &mut impl Write) -> fmt::Result {
    let cycles = &summary.cycles;
    writeln!(out, "{:NAME_WIDTH$} {:>8} {:>8} {:>10}", "cycles", "anchor", "timer", "coalesced")?;
    writeln!(out, "{:NAME_WIDTH$} {:>8} {:>8} {:>10}", "", cycles.anchor, cycles.timer, cycles.coalesced)?;
    for (reason, count) in &cycles.early_return {
        writeln!(
            out,
            "  {:width$} {count:>8}",
            format!("without validation: {reason}"),
            width = NAME_WIDTH - 2
        )?;
    }
    Ok(())
}

fn write_candidates(summary: &RunSummary, out: &mut impl Write) -> fmt::Result {
    writeln!(
        out,
        "\n{:NAME_WIDTH$} {:>8} {:>8} {:>10} {:>8} {:>8}",
        "candidates by generator", "judged", "accepted", "rejected", "stale", "selected"
    )?;
    for (name, tally) in &summary.candidates.by_generator {
        let selected = summary.selected.get(name).copied().unwrap_or(0);
        writeln!(
            out,
            "  {name:width$} {:>8} {:>8} {:>10} {:>8} {selected:>8}",
            tally.judged,
            tally.accepted,
            tally.rejected,
            tally.stale,
            width = NAME_WIDTH - 2
        )?;
    }
    let all = &summary.candidates;
    writeln!(
        out,
        "  {:width$} {:>8} {:>8} {:>10} {:>8} {:>8}",
        "all",
        all.judged,
        all.accepted,
        all.rejected,
        all.stale,
        summary.selected.values().sum::<u64>(),
        width = NAME_WIDTH - 2
    )?;
    for (reason, count) in &all.unranked {
        writeln!(
            out,
            "  {:width$} {count:>8}",
            format!("accepted but not ranked: {reason}"),
            width = NAME_WIDTH - 2
        )?;
    }
    Ok(())
}

fn write_rejections(
    title: &str,
    filters: &BTreeMap<&'static str, BTreeMap<&'static str, u64>>,
    out: &mut impl Write,
) -> fmt::Result {
    if filters.is_empty() {
        return Ok(());
    }
    writeln!(out, "\n{title:NAME_WIDTH$} {:>8}", "count")?;
    for (filter, metrics) in filters {
        if metrics.is_empty() {
            writeln!(out, "  {filter:width$} {:>8}", 0, width = NAME_WIDTH - 2)?;
            continue;
        }
        writeln!(out, "  {filter}")?;
        for (metric, count) in metrics {
            writeln!(out, "    {metric:width$} {count:>8}", width = NAME_WIDTH - 4)?;
        }
    }
    Ok(())
}

fn write_latencies(stages: &BTreeMap<String, Quantiles>, out: &mut impl Write) -> fmt::Result {
    writeln!(
        out,
        "\n{:NAME_WIDTH$} {:>8} {:>8} {:>8} {:>8} {:>8} {:>8}",
        "latency, µs", "count", "p50", "p90", "p99", "p99.9", "max"
    )?;
    for (stage, latency) in stages {
        writeln!(
            out,
            "  {stage:width$} {:>8} {:>8.0} {:>8.0} {:>8.0} {:>8.0} {:>8.0}",
            latency.count,
            latency.p50,
            latency.p90,
            latency.p99,
            latency.p999,
            latency.max,
            width = NAME_WIDTH - 2
        )?;
    }
    Ok(())
}

fn write_dropped(summary: &RunSummary, out: &mut impl Write) -> fmt::Result {
    let dropped = summary.messages.iter().filter(|(_, topic)| !topic.dropped.is_empty());
    for (index, (topic, received)) in dropped.enumerate() {
        if index == 0 {
            writeln!(out, "\n{:NAME_WIDTH$} {:>8}", "messages not used", "count")?;
        }
        for (reason, count) in &received.dropped {
            writeln!(out, "  {:width$} {count:>8}", format!("{topic} {reason}"), width = NAME_WIDTH - 2)?;
        }
    }
    Ok(())
}

/// Writes what the run used of the machine.
///
/// # Errors
/// The writer fails.
pub fn write_resources(summary: &RunSummary, out: &mut impl Write) -> fmt::Result {
    let (wall_s, threads) = (summary.wall_s, summary.common.threads.unwrap_or(1));
    if let Some(cpu_s) = summary.cpu_s {
        writeln!(out, "processor: {cpu_s:.2} s in {wall_s:.2} s")?;
    }
    if let Some(efficiency) = summary.parallel_efficiency {
        writeln!(out, "parallel efficiency of judging on {threads} threads: {efficiency:.3}")?;
    }
    if let Some(allocations) = &summary.allocations {
        let Allocations { per_candidate_judge, per_cycle } = allocations;
        writeln!(
            out,
            "heap allocations: {per_candidate_judge:.3} per candidate while it is judged, {per_cycle:.0} per cycle"
        )?;
    }
    Ok(())
}

/// A short line for a running command.
#[must_use]
pub fn progress_line(statistics: &statistics::Statistics) -> String {
    let total = statistics.total();
    let cycles: u64 = statistics.cycles.values().sum();
    format!("{cycles} cycles, {} of {} candidates accepted", total.accepted, total.judged)
}
