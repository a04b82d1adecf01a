//! Judges the candidates of golden scenes with the boundary departure filter, again and again:
//! `time_boundary_departure <golden folder> [scene] [rounds]`. Prints nanoseconds per candidate, the work of `observe`
//! included; for instructions, run it under callgrind with `--toggle-collect='*judge_once*'`.

#[path = "../tests/support/golden.rs"]
mod golden;

use std::hint::black_box;
use std::path::PathBuf;
use std::time::Instant;

use selection::filters::boundary_departure::UncrossableBoundaryDepartureFilter;
use selection::{Filter, Scratch};

/// One cycle; gives the number of accepted candidates.
#[inline(never)]
fn judge_once(
    filter: &mut UncrossableBoundaryDepartureFilter,
    cycle: &golden::Cycle,
    scratch: &mut Scratch,
) -> usize {
    filter.observe(&cycle.scene);
    let judge = |candidate| filter.judge(&cycle.scene, candidate, &mut *scratch).feasible;
    cycle.candidates.iter().map(judge).filter(|feasible| *feasible).count()
}

fn main() {
    let mut arguments = std::env::args().skip(1);
    let Some(golden) = arguments.next().map(PathBuf::from) else {
        eprintln!(
            "usage: time_boundary_departure <golden folder> [part of a scene's name] [rounds] [warm-up rounds]"
        );
        return;
    };
    let wanted = arguments.next().unwrap_or_default();
    let mut count = || arguments.next().and_then(|text| text.parse().ok());
    let (rounds, warm_up) = (count().unwrap_or(25), count().unwrap_or(1));
    let mut maps = golden::Maps::default();
    for path in golden::sequence_paths(&golden.join("bench")) {
        if !path.to_string_lossy().contains(&wanted) {
            continue;
        }
        let sequence = golden::read(&golden, &path, &mut maps);
        let cycle = &sequence.cycles[0];
        let mut filter = UncrossableBoundaryDepartureFilter::new(cycle.parameters.clone(), sequence.vehicle);
        let mut scratch = Scratch::default();
        filter.observe(&cycle.scene);
        for _ in 0..warm_up {
            for candidate in &cycle.candidates {
                black_box(filter.judge(&cycle.scene, candidate, &mut scratch));
            }
        }
        let mut times_ns = Vec::new();
        let mut accepted = 0;
        for _ in 0..rounds {
            let started = Instant::now();
            accepted = judge_once(&mut filter, cycle, black_box(&mut scratch));
            times_ns.push(started.elapsed().as_nanos() as usize / cycle.candidates.len());
        }
        times_ns.sort_unstable();
        println!(
            "{}: {accepted} of {} accepted, {} ns per candidate (median), {} (least)",
            sequence.name,
            cycle.candidates.len(),
            times_ns[times_ns.len() / 2],
            times_ns[0]
        );
    }
}
