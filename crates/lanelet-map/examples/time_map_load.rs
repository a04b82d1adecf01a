//! Times the reading of maps: `time_map_load [--runs N] FILE...` prints one line of JSON for each file with the median,
//! the fastest and the slowest of N (default 15) runs in seconds, reading from memory.

use std::hint::black_box;
use std::time::Instant;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1).peekable();
    let mut runs = 15_usize;
    if arguments.next_if(|argument| argument == "--runs").is_some() {
        runs = arguments.next().ok_or("--runs needs a number")?.parse::<usize>()?.max(1);
    }
    for path in arguments {
        let bytes = std::fs::read(&path)?;
        let mut seconds = (0..runs)
            .map(|_| {
                let start = Instant::now();
                let map = lanelet_map::archive::decode(&bytes)?;
                let elapsed = start.elapsed().as_secs_f64();
                black_box(&map);
                Ok(elapsed)
            })
            .collect::<Result<Vec<f64>, lanelet_map::MapError>>()?;
        seconds.sort_by(f64::total_cmp);
        println!(
            "{{\"file\": {path:?}, \"runs\": {runs}, \"median_s\": {:.6}, \"min_s\": {:.6}, \"max_s\": {:.6}}}",
            seconds[runs / 2],
            seconds[0],
            seconds[runs - 1]
        );
    }
    Ok(())
}
