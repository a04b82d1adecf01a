//! Judges a golden scene many times with the crosswalk filter, for counting instructions per candidate:
//!
//! ```text
//! cargo build --release -p selection --example count_crosswalk
//! valgrind --tool=callgrind --collect-atstart=no '--toggle-collect=*cycle_with_crosswalks*' \
//!     target/release/examples/count_crosswalk bench_large_mixed 10
//! ```
//!
//! Each round is a whole cycle: observing the scene, judging every candidate, remembering. Divide by rounds and
//! candidates.

#![allow(clippy::unwrap_used, reason = "a measuring aid, not part of the product")]

#[path = "../tests/golden_crosswalk/reader.rs"]
mod reader;

use selection::filters::crosswalk::CrosswalkFilter;
use selection::{Candidate, Filter, Judgement, Scratch};
use std::time::Instant;

/// A whole cycle. Not inlined, so that it can be named to a profiler; the results live in `judgements`.
#[inline(never)]
fn cycle_with_crosswalks(
    filter: &mut CrosswalkFilter,
    cycle: &reader::Cycle,
    scratch: &mut Scratch,
    judgements: &mut Vec<Judgement>,
) {
    filter.observe(&cycle.scene);
    judgements.clear();
    for candidate in &cycle.candidates {
        judgements.push(filter.judge(&cycle.scene, candidate, scratch));
    }
    let judged: Vec<(&Candidate, &Judgement)> = cycle.candidates.iter().zip(&*judgements).collect();
    filter.remember(&judged);
}

fn main() {
    let mut arguments = std::env::args().skip(1);
    let (Some(scene), rounds) = (arguments.next(), arguments.next()) else {
        eprintln!("usage: count_crosswalk SCENE [ROUNDS]");
        return;
    };
    let rounds: u32 = rounds.map_or(1, |rounds| rounds.parse().unwrap());
    let Some(golden) = reader::golden_folder() else {
        eprintln!("no golden files: set SELECTOR_SHARED");
        return;
    };
    let file = golden.join("bench").join(scene).with_extension("json");
    let sequence = reader::read(&golden, &file, &mut reader::Maps::default());
    let cycle = &sequence.cycles[0];
    let mut filter = CrosswalkFilter::new(cycle.parameters.clone(), sequence.front_m);
    let (mut scratch, mut judgements) = (Scratch::default(), Vec::new());
    let mut times_ns: Vec<u128> = Vec::new();
    for _ in 0..rounds {
        let start = Instant::now();
        cycle_with_crosswalks(&mut filter, cycle, &mut scratch, &mut judgements);
        times_ns.push(start.elapsed().as_nanos());
    }
    times_ns.sort_unstable();
    let rejected = judgements.iter().filter(|judgement| !judgement.feasible).count();
    println!(
        "{}: {} candidates, {rejected} rejected, median {} ns per candidate",
        sequence.name,
        judgements.len(),
        times_ns[times_ns.len() / 2] / judgements.len() as u128
    );
}
