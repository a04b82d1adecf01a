//! Judges a golden sequence with the traffic light filter again and again, for a profiler or a stopwatch.
//!
//! `time_traffic_light FILE ROUNDS`: a round is the first cycle of the file with all its candidates, from `observe` to
//! `remember`. Work that is done once per map and route falls into the first round only.

#[expect(clippy::unwrap_used, dead_code, reason = "written for tests, which read more of a sequence")]
#[path = "../tests/golden_traffic_light/sequence.rs"]
mod sequence;

use selection::{Judgement, Scratch};
use sequence::{Cycle, Sequence, shared_folder};
use std::hint::black_box;
use std::path::Path;
use std::time::Instant;

fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let ([_, file, rounds], Some(folder)) = (&arguments[..], shared_folder()) else {
        eprintln!("usage: time_traffic_light FILE ROUNDS, with the golden files in place");
        return;
    };
    let Ok(rounds) = rounds.parse::<u32>() else {
        eprintln!("`{rounds}` is no number of rounds");
        return;
    };
    let sequence = Sequence::read(&folder, Path::new(file));
    let mut filter = sequence.filter();
    let Some(Cycle { scene, candidates, .. }) = sequence.cycles().next() else { return };
    let mut scratch = Scratch::default();
    let started = Instant::now();
    for _ in 0..rounds {
        filter.observe(black_box(&scene));
        let judge = |candidate| filter.judge(&scene, candidate, &mut scratch);
        let judgements: Vec<Judgement> = candidates.iter().map(judge).collect();
        let judged: Vec<_> = candidates.iter().zip(&judgements).collect();
        filter.remember(black_box(&judged));
    }
    let calls = f64::from(rounds) * candidates.len() as f64;
    println!("{:.0} ns per candidate", started.elapsed().as_nanos() as f64 / calls);
}
