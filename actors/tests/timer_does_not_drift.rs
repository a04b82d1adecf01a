//! Hours without an anchor: the fallback timer fires when it should, to the nanosecond, and an anchor after that arms it
//! anew as on the first day.
//!
//! `SELECTOR_TIMER_HOURS` says how many hours of the node's clock.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

#[path = "support/faulty.rs"]
mod faulty;
#[path = "support/inputs.rs"]
mod inputs;

use faulty::{START, Setup, after, anchor};
use selector_actors::Trigger;

/// The period of the nodes of these tests.
const PERIOD_MS: i64 = 150;
const MINUTE_MS: i64 = 60_000;

#[test]
fn the_timer_fires_at_every_period_of_hours_and_is_armed_anew_by_an_anchor() {
    let hours = std::env::var("SELECTOR_TIMER_HOURS").ok().and_then(|hours| hours.parse().ok()).unwrap_or(1);
    let node = Setup::new(1).start();
    let mut fired: i64 = 0;
    for minute in 1..=60 * hours {
        node.system.advance_to(after(START, minute * MINUTE_MS)).unwrap();
        for seen in node.seen() {
            fired += 1;
            let cycle = &seen.report.cycle;
            assert_eq!((cycle.trigger, cycle.number), (Trigger::Timer, fired.unsigned_abs()));
            assert_eq!(cycle.scene.now, after(START, fired * PERIOD_MS));
        }
    }
    assert_eq!(fired, hours * 60 * MINUTE_MS / PERIOD_MS);
    let end = after(START, hours * 60 * MINUTE_MS + 37);
    node.system.advance_to(end).unwrap();
    node.cycle(&anchor(end, 3)).assert_normal(3, "after hours");
    let state = node.system.settle().unwrap();
    assert_eq!((state.deadline, state.coalesced), (after(end, PERIOD_MS), 0));
}
