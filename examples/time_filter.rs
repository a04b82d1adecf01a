//! Judges a recorded scene with one filter again and again, for a stopwatch or a counter of instructions:
//!
//! ```text
//! cargo run --release --example time_filter -- crosswalk_filter bench_large_mixed.json 1000
//! valgrind --tool=callgrind --collect-atstart=no '--toggle-collect=*whole_cycle*' \
//!     target/release/examples/time_filter crosswalk_filter bench_large_mixed.json 10
//! ```
//!
//! A round is the first cycle of the file with all its candidates, from `observe` to `remember`. What is done once per
//! map and route falls into the warm-up. Divide counts by rounds and candidates.
#![allow(clippy::unwrap_used, reason = "a measuring aid, not part of the product")]

use std::hint::black_box;
use std::path::Path;
use std::time::Instant;

use selection::filters::CLASSES;
use selection::{Candidate, Filter, Judgement, Scratch};
use trajectory_selector::golden::{Cycle, Maps, Sequence};

/// One cycle. Not inlined, so that it can be named to a profiler; the results live in `judgements`.
#[inline(never)]
fn whole_cycle(
    filter: &mut dyn Filter,
    cycle: &Cycle,
    scratch: &mut Scratch,
    judgements: &mut Vec<Judgement>,
) {
    filter.observe(&cycle.scene);
    judgements.clear();
    judgements
        .extend(cycle.candidates.iter().map(|candidate| filter.judge(&cycle.scene, candidate, scratch)));
    let judged: Vec<(&Candidate, &Judgement)> = cycle.candidates.iter().zip(&*judgements).collect();
    filter.remember(&judged);
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let class = arguments.first().and_then(|name| CLASSES.iter().find(|class| class.short_name == name));
    let (Some(class), Some(file)) = (class, arguments.get(1)) else {
        eprintln!("usage: time_filter FILTER FILE.json [ROUNDS] [WARM-UP ROUNDS]");
        return;
    };
    let count = |at: usize, default: usize| arguments.get(at).map_or(default, |text| text.parse().unwrap());
    let sequence = Sequence::read(Path::new(file), &mut Maps::default()).unwrap();
    let cycle = &sequence.cycles[0];
    let mut filter = (class.make)(&sequence.parameters, &sequence.vehicle);
    let (mut scratch, mut judgements) = (Scratch::default(), Vec::new());
    // One judgement at least: the points of a candidate are converted when they are first looked at.
    filter.observe(&cycle.scene);
    for _ in 0..count(3, 1) {
        for candidate in &cycle.candidates {
            black_box(filter.judge(&cycle.scene, candidate, &mut scratch));
        }
    }
    let mut times_ns: Vec<u128> = Vec::new();
    for _ in 0..count(2, 1).max(1) {
        let start = Instant::now();
        whole_cycle(&mut *filter, black_box(cycle), &mut scratch, &mut judgements);
        times_ns.push(start.elapsed().as_nanos());
    }
    times_ns.sort_unstable();
    let candidates = judgements.len();
    let rejected = judgements.iter().filter(|judgement| !judgement.feasible).count();
    let per_candidate = |time_ns: u128| time_ns / candidates.max(1) as u128;
    println!(
        "{}: {candidates} candidates, {rejected} rejected, {} ns per candidate (median), {} (least)",
        sequence.name,
        per_candidate(times_ns[times_ns.len() / 2]),
        per_candidate(times_ns[0])
    );
}
