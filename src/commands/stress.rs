//! `stress`: how much load the selector bears, and what a cycle costs.

use super::{Failure, JudgeArguments, summarise};
use crate::allocations;
use crate::report::statistics::Statistics;
use crate::report::summary::RunSummary;
use crate::report::table;
use crate::scenario::load::{Load, LoadScene};
use crate::settings::Settings;
use crate::stress::drive::DriveStress;
use crate::stress::graph::Carried;
use crate::stress::limit::{self, Limit, Probe};
use crate::stress::{Heap, Memory, PERIOD_NS, Pace, Stress, Stressed};
use clap::{Args, ValueEnum};
use selection::concatenator::MAX_GENERATORS;
use serde::Serialize;
use std::collections::BTreeMap;
use std::fmt;
use std::io::{IsTerminal, Write};
use std::path::PathBuf;
use std::time::Duration;

/// Cycles of a run of which nothing is said.
const CYCLES: u64 = 300;
/// Cycles of each number of candidates that is tried: some seconds.
const CYCLES_OF_PROBE: u64 = 30;
/// Cycles after which the memories of a fresh node have filled: a minute of virtual time.
const CYCLES_OF_FRESH_NODE: u64 = 600;
/// Candidates of an anchor of which nothing is said.
const CANDIDATES: u32 = 64;
/// Where a limit is sought and nothing is said: the pace of planners, and the time that there is for a cycle.
const USUAL_RATE_HZ: f64 = 10.0;
const USUAL_DEADLINE: Duration = Duration::from_millis(100);

/// Arguments of `stress`.
#[derive(Debug, Args)]
pub struct StressArguments {
    /// Candidates in each anchor [default: 64; of a drive: as recorded].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=limit::MOST_CANDIDATES as i64))]
    pub candidates: Option<u32>,
    /// Points of each candidate, 0.1 s apart.
    #[arg(long, value_name = "N", default_value_t = 80, value_parser = clap::value_parser!(u16).range(2..=10_000))]
    pub points: u16,
    /// Road users.
    #[arg(long, value_name = "N", default_value_t = 50)]
    pub objects: u16,
    /// Predicted paths of each road user.
    #[arg(long, value_name = "N", default_value_t = 3)]
    pub paths: u8,
    /// Generators among which the candidates are dealt out.
    #[arg(long, value_name = "N", default_value_t = 8, value_parser = clap::value_parser!(u16).range(1..))]
    pub generators: u16,
    /// Anchors [default: 300; of a drive: all].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    pub cycles: Option<u64>,
    /// Length of the run instead, in hours of the node's clock; the last verdicts are held against those of a fresh node.
    #[arg(long, value_name = "H", conflicts_with = "cycles", value_parser = positive)]
    pub hours: Option<f64>,
    /// Anchors per second, or one as soon as the cycle of the one before has ended [default: max; to find a limit: 10].
    #[arg(long, value_name = "HZ|max")]
    pub rate: Option<Pace>,
    /// Time from the anchor to the last output; a cycle is cut then, and every cycle must hold it.
    #[arg(long, value_name = "MS", value_parser = positive)]
    pub deadline: Option<f64>,
    /// Required: resident memory grows by at most this after the first minute, percent.
    #[arg(long, value_name = "PERCENT", value_parser = positive)]
    pub max_growth: Option<f64>,
    /// Required: 99 of 100 cycles take at most this long.
    #[arg(long, value_name = "MS", value_parser = positive)]
    pub max_p99: Option<f64>,
    /// Seek the largest number of candidates with which every cycle holds the deadline [default: 100 ms at 10 Hz].
    #[arg(long, conflicts_with_all = ["drive", "hours"])]
    pub find_limit: bool,
    /// What is around the ego.
    #[arg(long, default_value = "road", value_parser = parse_scene, value_name = "road|intersection|dense")]
    pub scene: LoadScene,
    /// A recorded drive as the load instead: points, objects and paths are those of the recording.
    #[arg(long, value_name = "DRIVE", conflicts_with_all = ["scene", "points", "objects", "paths", "generators", "seed", "hours"])]
    pub drive: Option<PathBuf>,
    /// Bring the load through the graph: the node with its door, and somebody who plays sensors and planners, on the
    /// loopback interface. Time passes by itself.
    #[arg(long, value_name = "ros", conflicts_with_all = ["drive", "find_limit", "report"])]
    pub through: Option<Way>,
    /// Through the graph: whoever plays sensors and planners leaves it at random and joins anew, in the mean after so long.
    #[arg(long, value_name = "S", requires = "through", value_parser = positive)]
    pub restart_planners: Option<f64>,
    /// Seed of places, speeds and manoeuvres.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
    /// Write the run as one HTML page to this file: every cycle, every verdict, every reason.
    #[arg(long, value_name = "FILE.html")]
    pub report: Option<PathBuf>,
    /// What every command that judges takes.
    #[command(flatten)]
    pub judge: JudgeArguments,
}

/// Another way for the load than straight to the actors.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub enum Way {
    /// Through the middleware.
    Ros,
}

fn parse_scene(text: &str) -> Result<LoadScene, String> {
    let scene = LoadScene::ALL.into_iter().find(|scene| scene.name() == text);
    scene.ok_or_else(|| format!("\"{text}\" is no scene; write road, intersection or dense"))
}

/// Far above any time or share that means something, and far below what a clock cannot count.
const MOST: f64 = 1e9;

fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value > 0.0 && value <= MOST => Ok(value),
        _ => Err(format!("\"{text}\" is no number greater than 0 and up to {MOST:e}")),
    }
}

/// What `stress` gives.
#[derive(Debug, Serialize)]
pub struct StressReport {
    /// Cycles, verdicts, latencies; of the run at the limit where a limit was sought.
    #[serde(flatten)]
    pub summary: RunSummary,
    /// What was asked for; null for a drive.
    pub load: Option<LoadShown>,
    /// Anchors per second; null where one came as soon as the cycle before had ended.
    pub rate_hz: Option<f64>,
    /// Time from the anchor to the last output that every cycle had to hold; null where none was required.
    pub deadline_ms: Option<f64>,
    /// Cycles that took longer or were cut.
    pub deadline_missed: u64,
    /// Resident memory in the course of the run.
    pub memory_mb: Memory,
    /// By how much it grew after its first minute at the most, percent; null where nobody knows.
    pub memory_growth_percent: Option<f64>,
    /// What was allocated and not given back.
    pub heap_mb: Heap,
    /// The most that was ever in a store that grows with its inputs, by its name.
    pub stores: BTreeMap<String, Store>,
    /// Hash over the verdicts of the last cycle in which every candidate was judged.
    pub verdicts_hash: Option<String>,
    /// The same of a fresh node after some seconds of the same load; null where none was run.
    pub fresh_verdicts_hash: Option<String>,
    /// The largest load that held; null where none was sought.
    pub limit: Option<Limit>,
    /// What went through the graph; null where nothing did.
    pub graph: Option<Carried>,
}

/// How much of everything.
#[derive(Debug, Serialize)]
pub struct LoadShown {
    candidates: usize,
    points: usize,
    objects: usize,
    paths: usize,
    generators: usize,
}

/// Fill of one store.
#[derive(Debug, Serialize)]
pub struct Store {
    most: usize,
    /// Null where only the size of a message bounds it.
    bound: Option<usize>,
}

impl StressArguments {
    fn pace(&self) -> Pace {
        let usual = if self.find_limit { Pace::Hertz(USUAL_RATE_HZ) } else { Pace::Max };
        self.rate.unwrap_or(usual)
    }

    fn deadline(&self) -> Option<Duration> {
        let usual = self.find_limit.then_some(USUAL_DEADLINE);
        self.deadline.map(|milliseconds| Duration::from_secs_f64(milliseconds / 1e3)).or(usual)
    }

    fn cycles(&self) -> u64 {
        let rate_hz = match self.pace() {
            Pace::Max => 1e9 / PERIOD_NS as f64,
            Pace::Hertz(rate_hz) => rate_hz,
        };
        let of_hours = self.hours.map(|hours| (hours * 3600.0 * rate_hz).ceil() as u64);
        of_hours.or(self.cycles).unwrap_or(if self.find_limit { CYCLES_OF_PROBE } else { CYCLES })
    }

    fn load(&self) -> Load {
        Load {
            scene: self.scene,
            candidates: self.candidates.unwrap_or(CANDIDATES) as usize,
            points: self.points.into(),
            objects: self.objects.into(),
            paths: self.paths.into(),
            generators: self.generators.into(),
            seed: self.seed,
        }
    }
}

/// Runs the load.
///
/// # Errors
/// It cannot be started. What goes wrong on the way, and requirements that were missed, are in the summary.
pub fn run(arguments: &StressArguments, progress: bool) -> Result<StressReport, Failure> {
    let settings = arguments.judge.settings()?;
    let (threads, deadline, page) =
        (arguments.judge.threads(), arguments.deadline(), arguments.report.is_some());
    let mut stress = Stress {
        load: arguments.load(),
        cycles: arguments.cycles(),
        pace: arguments.pace(),
        threads,
        deadline,
        restart_planners: arguments.restart_planners.map(Duration::from_secs_f64),
        page,
        progress: progress && std::io::stderr().is_terminal(),
    };
    allocations::start_counting();
    let (mut limit, mut graph) = (None, None);
    let stressed = if let Some(path) = &arguments.drive {
        let candidates = arguments.candidates.map(|count| count as usize);
        let (cycles, pace) = (arguments.cycles, arguments.pace());
        DriveStress { path, candidates, cycles, pace, threads, deadline, page }.run(&settings)?
    } else if arguments.find_limit {
        stress.progress = false;
        let (found, at_limit) = limit::find(&stress, &settings, tell_probe)?;
        stress.load.candidates = found.candidates.max(1);
        limit = Some(found);
        at_limit
    } else if let Some(Way::Ros) = arguments.through {
        let (stressed, carried) = stress.run_through_graph(&settings)?;
        graph = Some(carried);
        stressed
    } else {
        stress.run(&settings)?
    };
    let Stressed { mut ended, missed, memory_mb, heap_mb, most_waiting } = stressed;
    let fresh = arguments.hours.is_some().then(|| fresh_verdicts(&stress, &settings)).transpose()?.flatten();
    let last = ended.result.statistics.last_verdicts;
    if ended.errors.is_empty() {
        ended.errors.extend(missed_requirements(arguments, &ended.result, missed, limit.as_ref()));
        ended.errors.extend(grown_too_much(arguments, &memory_mb));
        if arguments.hours.is_some() && last != fresh {
            let text = "at the end the same load is judged in another way than by a fresh node".to_owned();
            ended.errors.push(Failure::requirement(text).at("--hours"));
        }
    }
    let stores = stores_of(&ended.result.statistics, most_waiting);
    let Load { candidates, points, objects, paths, generators, .. } = stress.load;
    let load = LoadShown { candidates, points, objects, paths, generators };
    let summary = summarise("stress", ended, Vec::new(), &settings, threads, arguments.report.as_deref())?;
    Ok(StressReport {
        summary,
        load: arguments.drive.is_none().then_some(load),
        rate_hz: match arguments.pace() {
            Pace::Max => None,
            Pace::Hertz(rate_hz) => Some(rate_hz),
        },
        deadline_ms: deadline.map(|deadline| deadline.as_secs_f64() * 1e3),
        deadline_missed: missed,
        memory_mb,
        memory_growth_percent: memory_mb.growth_percent(),
        heap_mb,
        stores,
        verdicts_hash: last.map(shown_hash),
        fresh_verdicts_hash: fresh.map(shown_hash),
        limit,
        graph,
    })
}

/// What a node that has just been started says about the load, once its memories are filled.
fn fresh_verdicts(stress: &Stress, settings: &Settings) -> Result<Option<u64>, Failure> {
    let fresh = Stress {
        cycles: stress.cycles.min(CYCLES_OF_FRESH_NODE),
        pace: Pace::Max,
        deadline: None,
        restart_planners: None,
        page: false,
        progress: false,
        ..*stress
    };
    Ok(fresh.run(settings)?.ended.result.statistics.last_verdicts)
}

fn shown_hash(hash: u64) -> String {
    format!("{hash:016x}")
}

/// Everything that grows with the inputs.
fn stores_of(statistics: &Statistics, most_waiting: Option<usize>) -> BTreeMap<String, Store> {
    let of_pipeline = statistics
        .fill
        .iter()
        .map(|(name, fill)| (name.clone(), Store { most: fill.entries, bound: Some(fill.bound) }));
    let around = [
        ("buffer_generators", Some(statistics.most_generators), Some(MAX_GENERATORS)),
        ("buffer_candidates", Some(statistics.most_candidates), None),
        ("waiting_messages", most_waiting, None),
    ];
    let around = around
        .into_iter()
        .filter_map(|(name, most, bound)| Some((name.to_owned(), Store { most: most?, bound })));
    around.chain(of_pipeline).collect()
}

fn grown_too_much(arguments: &StressArguments, memory_mb: &Memory) -> Option<Failure> {
    let (most, grown) = (arguments.max_growth?, memory_mb.growth_percent());
    let text = match grown {
        None => "nobody knows how the memory grew".to_owned(),
        Some(grown) if grown > most => format!("the memory grew by {grown:.2} %, not {most} %"),
        Some(_) => return None,
    };
    Some(Failure::requirement(text).at("--max-growth"))
}

/// The bounds that were required and not held. While a limit is sought, missing the deadline is how it is found.
fn missed_requirements(
    arguments: &StressArguments,
    result: &crate::report::summary::RunResult,
    missed: u64,
    limit: Option<&Limit>,
) -> Vec<Failure> {
    let mut failures = Vec::new();
    let mut fail = |text: String, flag: &str| failures.push(Failure::requirement(text).at(flag));
    match (arguments.deadline(), limit) {
        (Some(deadline), Some(limit)) if limit.candidates == 0 => {
            fail(format!("not even one candidate holds the deadline of {deadline:?}"), "--deadline");
        }
        (Some(deadline), None) if missed > 0 => {
            fail(format!("{missed} cycles missed the deadline of {deadline:?}"), "--deadline");
        }
        _ => {}
    }
    let p99_ms = result.statistics.latency.get("cycle").map(|cycle| cycle.quantile_us(0.99) / 1e3);
    match (arguments.max_p99, p99_ms) {
        (Some(_), None) => fail("there was no cycle".to_owned(), "--max-p99"),
        (Some(max_ms), Some(p99_ms)) if p99_ms > max_ms => {
            fail(format!("99 of 100 cycles took up to {p99_ms:.3} ms, not {max_ms} ms"), "--max-p99");
        }
        _ => {}
    }
    failures
}

fn tell_probe(probe: &Probe) {
    let Probe { candidates, held, missed, p50_us, max_us } = probe;
    let (p50_ms, max_ms) = (p50_us / 1e3, max_us / 1e3);
    let verdict = if *held { "held".to_owned() } else { format!("{missed} cycles missed the deadline") };
    // With nobody left to read it, nothing can be done.
    let _ = writeln!(
        std::io::stderr(),
        "{candidates:>7} candidates: p50 {p50_ms:.1} ms, longest {max_ms:.1} ms, {verdict}"
    );
}

impl fmt::Display for StressReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        table::write(&self.summary, f)?;
        writeln!(f)?;
        if let Some(load) = &self.load {
            let LoadShown { candidates, points, objects, paths, generators } = load;
            writeln!(
                f,
                "load: {candidates} candidates of {generators} generators x {points} points, {objects} road users x {paths} paths"
            )?;
        }
        if let Some(deadline_ms) = self.deadline_ms {
            writeln!(f, "deadline of {deadline_ms} ms: {} cycles missed it", self.deadline_missed)?;
        }
        table::write_resources(&self.summary, f)?;
        let Memory { start, warm, most, end } = self.memory_mb;
        let shown = |megabytes: Option<f64>| megabytes.map_or("?".to_owned(), |mb| format!("{mb:.1}"));
        writeln!(
            f,
            "resident memory, MB: {} at the start, {} warm, then at most {}, {} at the end",
            shown(start),
            shown(warm),
            shown(most),
            shown(end)
        )?;
        if let Some(Carried { anchors, answers, restarts }) = self.graph {
            writeln!(
                f,
                "through the graph: {anchors} anchors, {answers} validated sets came back, planners restarted {restarts} times"
            )?;
        }
        if let Some(limit) = &self.limit {
            let Limit { candidates, at_least, deadline_ms, rate_hz, .. } = limit;
            let rate = rate_hz.map_or("at full speed".to_owned(), |rate_hz| format!("at {rate_hz} Hz"));
            let most = if *at_least { "at least" } else { "at most" };
            writeln!(f, "limit: {most} {candidates} candidates hold {deadline_ms} ms {rate}")?;
        }
        Ok(())
    }
}
