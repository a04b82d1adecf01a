//! The stages of a cycle, in the order in which it passes them.

use selector_actors::cycle::{CycleReport, CycleTimes, Outcome, Trigger};
use std::time::Duration;

/// Stages one after the other, as named in results; together they are the cycle.
pub const IN_TURN: [&str; 10] =
    ["receive", "buffer", "wait", "snapshot", "observe", "judge", "rank", "report", "publish", HAND_OVER];

/// What the stages leave of the cycle: the ways between the owners, waking the pool.
const HAND_OVER: &str = "hand_over";
/// All stages together.
pub const CYCLE: &str = "cycle";

/// What of `publish` the middleware took.
const SEND: &str = "send";
/// What of the cycle is neither waiting for an earlier one, nor judging, nor the middleware's.
const OWN: &str = "own";

/// The name of a filter's stage: its time in a cycle over all candidates and threads.
#[must_use]
pub fn of_filter(filter: &str) -> String {
    format!("filter.{filter}")
}

/// Tells how long each stage of a cycle took; a stage that the cycle did not pass is left out.
pub fn of_cycle(report: &CycleReport, times: CycleTimes, mut tell: impl FnMut(&str, Duration)) {
    let cycle = &report.cycle;
    let mut rest = times.cycle;
    let mut tell_in_turn = |stage: &str, took: Duration| {
        rest = rest.saturating_sub(took);
        tell(stage, took);
    };
    if cycle.trigger == Trigger::Anchor {
        tell_in_turn("receive", cycle.receive);
        tell_in_turn("buffer", cycle.buffer);
    }
    tell_in_turn("wait", cycle.wait());
    tell_in_turn("snapshot", cycle.snapshot);
    if let Outcome::Judged(judged) = &report.outcome {
        tell_in_turn("observe", judged.observe);
        tell_in_turn("judge", judged.judge);
        tell_in_turn("rank", judged.rank + judged.adapt);
        tell_in_turn("report", judged.report);
    }
    tell_in_turn("publish", times.publish);
    tell(HAND_OVER, rest);
    tell(CYCLE, times.cycle);
    if let Outcome::Judged(judged) = &report.outcome {
        // The first summary is the data-validity check, which has no time of its own.
        for (filter, &took) in judged.filters[1..].iter().zip(&judged.filter_times) {
            tell(&of_filter(filter.name), took);
        }
    }
}

/// Tells what of a cycle that judged was spent in the middleware, and what was the node's own.
pub fn of_sending(
    report: &CycleReport,
    times: CycleTimes,
    sending: Duration,
    mut tell: impl FnMut(&str, Duration),
) {
    if let Outcome::Judged(judged) = &report.outcome {
        tell(SEND, sending);
        let others = report.cycle.wait() + judged.observe + judged.judge + sending;
        tell(OWN, times.cycle.saturating_sub(others));
    }
}
