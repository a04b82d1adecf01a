//! What looking on costs: the report page, the drawings in the recording, and the terminal's tap, asked for and not.
//!
//! Drives the generated drive of `demo` through the node as fast as it goes, once for each way of looking on in turn,
//! and prints the processor time of a cycle and its latency, each as the median over the rounds, and over that of a sink
//! that counts and can do nothing else. "not asked for" is the recorder of every command with all of it left off. The
//! latency ends before pages and drawings are made; the processor time has all of it.
//!
//! Run: `cargo bench --bench looking_on`; `-- count WAY` drives one way once, for an instruction count with
//! `valgrind --tool=callgrind --callgrind-out-file=/dev/null`.
#![allow(
    missing_docs,
    clippy::unwrap_used,
    clippy::panic,
    reason = "a benchmark is a program of its own and fails by panicking"
)]

use messages::Interface;
use motion::VehicleInfo;
use selection::{Pipeline, Ranker, Validator};
use selector_actors::cycle::{CycleReport, CycleTimes};
use selector_actors::publisher::PublishedTimes;
use selector_actors::{Clock, Config, Publication, SelectorSystem, Sink, SinkError};
use std::path::Path;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};
use trajectory_selector::drive::TimedInput;
use trajectory_selector::recorder::{Drawing, Recorder};
use trajectory_selector::report::markers::Markers;
use trajectory_selector::report::markers::scene_updates::SceneUpdates;
use trajectory_selector::report::page::Page;
use trajectory_selector::report::statistics::Statistics;
use trajectory_selector::report::usage::cpu_s;
use trajectory_selector::scenario::Scenario;
use trajectory_selector::settings::{DEFAULT_NODE_NAME, Settings};

const ROUNDS: usize = 15;
const BUDGET: Duration = Duration::from_millis(100);

/// Ways of looking on; the first is what the others are compared with.
const WAYS: [&str; 6] = ["only counted", "not asked for", "tap", "page", "recording", "recording, drawn"];

/// Counts, and can do nothing else.
struct Counter(Arc<Mutex<Statistics>>);

impl Sink for Counter {
    fn publish(&mut self, _: Publication) -> Result<(), SinkError> {
        Ok(())
    }

    fn observe(&mut self, report: &CycleReport, times: CycleTimes) {
        self.0.lock().unwrap().add(report, times);
    }
}

/// Of one round: per cycle.
#[derive(Clone, Copy)]
struct Cost {
    cpu_us: f64,
    /// Seconds of the drive per second.
    speed: f64,
    latency_us: f64,
}

struct Bench {
    settings: Settings,
    inputs: Vec<TimedInput>,
    scenario_s: f64,
    folder: tempfile::TempDir,
}

impl Bench {
    fn validator(&self) -> Validator {
        Validator::new(self.settings.validator.clone(), &VehicleInfo::default()).unwrap()
    }

    fn round(&self, way: &str) -> Cost {
        let output = self.folder.path().join("out.mcap");
        let counted = Arc::new(Mutex::new(Statistics::default()));
        if way == WAYS[0] {
            let (began, cpu) = (Instant::now(), cpu_s().unwrap());
            self.drive(Box::new(Counter(counted.clone())));
            return self.cost(&counted.lock().unwrap(), began, cpu);
        }
        let recorder = match way {
            "recording" | "recording, drawn" => {
                Recorder::writing(Path::new(&output), Interface::V0_53).unwrap()
            }
            _ => Recorder::counting(),
        };
        let (told, heard) = crossbeam_channel::unbounded();
        match way {
            "not asked for" | "recording" => {}
            "tap" => recorder.lock().tap = Some(told),
            "page" => recorder.lock().page = Some(Page::new(self.validator(), BUDGET)),
            "recording, drawn" => {
                let (markers, updates) =
                    (Markers::new(self.validator()), SceneUpdates::new(self.validator()));
                recorder.lock().drawing = Some(Drawing { markers, updates });
            }
            other => panic!("there is no way `{other}`; there are {WAYS:?}"),
        }
        let (began, cpu) = (Instant::now(), cpu_s().unwrap());
        self.drive(Box::new(recorder.clone()));
        recorder.finish().unwrap();
        let cost = self.cost(&recorder.lock().statistics, began, cpu);
        drop(heard);
        cost
    }

    fn cost(&self, statistics: &Statistics, began: Instant, cpu: f64) -> Cost {
        let cycles = statistics.cycles.values().sum::<u64>() as f64;
        Cost {
            cpu_us: (cpu_s().unwrap() - cpu) * 1e6 / cycles,
            speed: self.scenario_s / began.elapsed().as_secs_f64(),
            latency_us: statistics.latency["cycle"].quantile_us(0.5),
        }
    }

    fn drive(&self, sink: Box<dyn Sink>) {
        let settings = &self.settings;
        let config = Config {
            clock: Clock::stepped(self.inputs[0].time),
            threads: 1,
            fallback_period_ms: settings.selector.fallback_period_ms,
            duration_time_s: settings.concatenator.duration_time,
            cycle_budget: None,
            vehicle: VehicleInfo::default(),
            pipeline: Pipeline::new(
                self.validator(),
                Ranker::new(settings.ranker.clone(), settings.selector.sources()),
            ),
            interface: Interface::V0_53,
            published_times: PublishedTimes::Zero,
            count_allocations: None,
        };
        let system = SelectorSystem::start(config, sink).unwrap();
        for timed in &self.inputs {
            system.advance_to(timed.time).unwrap();
            system.deliver(timed.input.clone()).unwrap();
        }
        system.stop().unwrap();
    }
}

fn main() {
    let scenario = Scenario::road(1);
    let (begin, end) = scenario.span();
    let bench = Bench {
        settings: Settings::load(DEFAULT_NODE_NAME, &[]).unwrap(),
        inputs: scenario.drive().collect(),
        scenario_s: (end.nanoseconds() - begin.nanoseconds()) as f64 * 1e-9,
        folder: tempfile::tempdir().unwrap(),
    };
    let arguments: Vec<String> = std::env::args().skip(1).filter(|argument| argument != "--bench").collect();
    if let [count, way] = &arguments[..]
        && count == "count"
    {
        bench.round(way);
        return;
    }
    println!("{:.0} s drive, {ROUNDS} rounds, one thread judges; medians of a cycle in µs", bench.scenario_s);
    println!(
        "{:18} {:>9} {:>7} {:>9} {:>7} {:>10}",
        "", "processor", "ratio", "latency", "ratio", "real time"
    );
    // In turn, so that whatever else the machine does falls on all of them.
    let mut costs: Vec<Vec<Cost>> = vec![Vec::new(); WAYS.len()];
    for _ in 0..ROUNDS {
        for (way, costs) in WAYS.iter().zip(&mut costs) {
            costs.push(bench.round(way));
        }
    }
    let median = |costs: &[Cost], of: fn(&Cost) -> f64| {
        let mut values: Vec<f64> = costs.iter().map(of).collect();
        values.sort_by(f64::total_cmp);
        values[values.len() / 2]
    };
    let of = |costs: &[Cost]| {
        [
            median(costs, |cost| cost.cpu_us),
            median(costs, |cost| cost.latency_us),
            median(costs, |cost| cost.speed),
        ]
    };
    let [cpu, latency, _] = of(&costs[0]);
    for (way, costs) in WAYS.iter().zip(&costs) {
        let [way_cpu, way_latency, speed] = of(costs);
        println!(
            "{way:18} {way_cpu:>9.0} {:>7.3} {way_latency:>9.0} {:>7.3} {speed:>9.0}x",
            way_cpu / cpu,
            way_latency / latency,
        );
    }
}
