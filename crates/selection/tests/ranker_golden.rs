//! The six metrics on all recorded sequences of the original, sample by sample, with the history that it had.
//!
//! Recorded is the evaluator of August 2026, which holds the candidates of a cycle against each other in its own way
//! (each compressed metric over the sum of its weights) and chooses the best feasible one. What it makes of the metrics
//! is computed here from ours and compared as well. Not compared: `TimeToCollision`, which does not exist any more, and
//! the seventh score, which is a constant there because the last list of weights was never copied.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

use lanelet_map::Map;
use lanelet_map::osm::OsmOptions;
use lanelet_map::projection::Projector;
use messages::autoware_internal_planning_msgs::CandidateTrajectory;
use messages::autoware_planning_msgs::{LaneletPrimitive, LaneletRoute, LaneletSegment, TrajectoryPoint};
use messages::builtin_interfaces::{Duration, Time};
use messages::geometry_msgs::{Point, Pose, Quaternion};
use messages::std_msgs::Header;
use messages::unique_identifier_msgs::Uuid;
use selection::Candidate;
use selection::candidate::pose_of;
use selection::parameters::{EvaluationParameters, QualityMetric};
use selection::ranker::history::{Chosen, History};
use selection::ranker::metrics::{Measured, Surroundings};
use selection::ranker::preferred_lanes::PreferredLanes;
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Greatest difference of a sample. The lanes in the record have finer centerlines than those of a published map, and
/// the two ways to make them from the borders differ by this much; yaws are 32-bit, which shows at short distances.
fn tolerance(metric: QualityMetric) -> f32 {
    match metric {
        QualityMetric::LateralDeviation => 0.0165,
        QualityMetric::SteeringConsistency => 1e-4,
        _ => 1e-6,
    }
}

/// Greatest difference of a score that is computed from our own values.
const SCORE_TOLERANCE: f32 = 1e-5;
/// Greatest difference of a score that is computed from the recorded values.
const RECORDED_SCORE_TOLERANCE: f32 = 2e-7;
/// Place of the metric in the record that ours do not have.
const TIME_TO_COLLISION: usize = 3;
/// Metrics whose weights were copied in the original; the seventh always scores 1.
const WITH_WEIGHTS: usize = 6;

fn golden() -> Option<PathBuf> {
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared");
    let folder = std::env::var_os("SELECTOR_SHARED").map_or(beside, PathBuf::from).join("golden");
    if folder.join("ranker").is_dir() {
        return Some(folder);
    }
    eprintln!("skipped: no golden files of the ranker in {}", folder.display());
    None
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap()
}

fn list(value: &Value) -> &[Value] {
    value.as_array().unwrap()
}

fn numbers(value: &Value) -> Vec<f64> {
    list(value).iter().map(number).collect()
}

fn singles(value: &Value) -> Vec<f32> {
    list(value).iter().map(|value| number(value) as f32).collect()
}

fn pose(x: f64, y: f64, z: f64, yaw: f64) -> Pose {
    let (z_part, w) = (yaw / 2.0).sin_cos();
    Pose { position: Point { x, y, z }, orientation: Quaternion { x: 0.0, y: 0.0, z: z_part, w } }
}

fn candidate(file: &Value, columns: &[Value], stamp: Time) -> Candidate {
    let column = |name: &str| columns.iter().position(|column| column == name);
    let point = |row: &Value| {
        let row = numbers(row);
        let at = |name: &str| column(name).map_or(0.0, |index| row[index]);
        TrajectoryPoint {
            time_from_start: Duration::from_nanoseconds((at("t") * 1e9).round() as i64),
            pose: pose(at("x"), at("y"), at("z"), at("yaw")),
            longitudinal_velocity_mps: at("v") as f32,
            lateral_velocity_mps: at("vy") as f32,
            acceleration_mps2: at("a") as f32,
            ..TrajectoryPoint::default()
        }
    };
    let id = u128::from_str_radix(file["generator"].as_str().unwrap(), 16).unwrap();
    let message = CandidateTrajectory {
        header: Header { stamp, frame_id: "map".to_owned() },
        generator_id: Uuid { uuid: id.to_be_bytes() },
        points: list(&file["points"]).iter().map(point).collect(),
        ..CandidateTrajectory::default()
    };
    Candidate::new(Arc::new(message), "recorded".into(), 0)
}

fn route(ids: &Value) -> LaneletRoute {
    let segment = |id: &Value| LaneletSegment {
        preferred_primitive: LaneletPrimitive { id: id.as_i64().unwrap(), ..LaneletPrimitive::default() },
        ..LaneletSegment::default()
    };
    LaneletRoute { segments: list(ids).iter().map(segment).collect(), ..LaneletRoute::default() }
}

fn parameters(ranker: &Value, names: &[Value]) -> EvaluationParameters {
    let mut parameters = EvaluationParameters {
        sampling_number: ranker["sample_num"].as_i64().unwrap(),
        sampling_resolution: number(&ranker["resolution"]),
        trajectory_history_size: ranker["trajectory_history_size"].as_i64().unwrap(),
        ..EvaluationParameters::default()
    };
    let maximum =
        |name: &str| number(&ranker["maximum"][names.iter().position(|other| other == name).unwrap()]);
    parameters.lateral_acceleration.maximum = maximum("LateralAcceleration");
    parameters.longitudinal_jerk.maximum = maximum("LongitudinalJerk");
    parameters.travel_distance.maximum = maximum("TravelDistance");
    parameters.lateral_deviation.maximum = maximum("LateralDeviation");
    parameters.steering_consistency.maximum = maximum("SteeringConsistency");
    parameters.trajectory_consistency.maximum = maximum("TrajectoryConsistency");
    parameters
}

/// What the original makes of compressed metrics: a score for each, and the weighted total.
fn evaluated(metrics: &[Vec<f32>], decay: &[f32], weights: &[f32], alone: bool) -> (Vec<f32>, f32) {
    let most: f32 = decay.iter().sum();
    let score = |(index, values): (usize, &Vec<f32>)| {
        if alone || index >= WITH_WEIGHTS {
            return 1.0;
        }
        let compressed: f32 = decay.iter().zip(values).map(|(weight, value)| weight * value).sum();
        // Distance travelled and time to collision: more is better.
        if index == 2 || index == TIME_TO_COLLISION { compressed / most } else { (most - compressed) / most }
    };
    let scores: Vec<f32> = metrics.iter().enumerate().map(score).collect();
    let total = scores.iter().zip(weights).map(|(score, weight)| score * weight).sum();
    (scores, total)
}

/// Largest differences seen, by metric and of scores and totals.
#[derive(Debug, Default)]
struct Differences {
    by_metric: BTreeMap<usize, f32>,
    recorded_score: f32,
    score: f32,
    candidates: usize,
    cycles: usize,
    best: usize,
}

fn greatest(a: &[f32], b: &[f32]) -> f32 {
    assert_eq!(a.len(), b.len());
    a.iter()
        .zip(b)
        .map(|(a, b)| (a - b).abs())
        .fold(0.0, |most, next| if next > most || next.is_nan() { next } else { most })
}

struct Sequence<'a> {
    file: &'a Value,
    names: &'a [Value],
    parameters: EvaluationParameters,
    wheel_base_m: f64,
    history: History,
}

impl Sequence<'_> {
    /// The metrics of all candidates, compared with the record; returns which of the candidates was the best there.
    fn cycle(
        &self,
        candidates: &[Candidate],
        ego: &motion::Pose,
        lanes: &PreferredLanes,
        expected: &Value,
        seen: &mut Differences,
    ) -> usize {
        let surroundings = Surroundings {
            ego,
            wheel_base_m: self.wheel_base_m,
            lanes,
            history: &self.history,
            parameters: &self.parameters,
        };
        let ours: Vec<Vec<Vec<f32>>> = candidates
            .iter()
            .map(|candidate| {
                let measured = Measured::new(surroundings, candidate).unwrap();
                QualityMetric::ALL.map(|metric| measured.values(metric)).to_vec()
            })
            .collect();
        let mut left: Vec<usize> = (0..candidates.len()).collect();
        let mut best = None;
        for (place, ranked) in list(&expected["ranked"]).iter().enumerate() {
            let recorded: Vec<Vec<f32>> = list(&ranked["metrics"]).iter().map(singles).collect();
            let comparable: Vec<&Vec<f32>> = recorded
                .iter()
                .enumerate()
                .filter(|(index, _)| *index != TIME_TO_COLLISION)
                .map(|(_, v)| v)
                .collect();
            // A generator may occur several times: the entry belongs to the candidate whose metrics fit best.
            let name = ranked["generator"].as_str().unwrap();
            let misfit = |index: &usize| {
                let pairs = ours[*index].iter().zip(&comparable).zip(QualityMetric::ALL);
                pairs.map(|((a, b), metric)| greatest(a, b) / tolerance(metric)).fold(0.0_f32, f32::max)
            };
            let same =
                left.iter().copied().filter(|index| candidates[*index].key.generator.to_string() == name);
            let index = same.min_by(|a, b| misfit(a).total_cmp(&misfit(b))).unwrap();
            left.retain(|other| *other != index);
            for (number, (ours, recorded)) in ours[index].iter().zip(&comparable).enumerate() {
                let difference = greatest(ours, recorded);
                let most = seen.by_metric.entry(number).or_default();
                *most = most.max(difference);
                assert!(
                    difference <= tolerance(QualityMetric::ALL[number]),
                    "{} {:?} of {name}, place {place}: {difference}\nours     {ours:?}\nrecorded {recorded:?}",
                    self.file["name"],
                    QualityMetric::ALL[number]
                );
            }
            self.compare_scores(&ours[index], &recorded, ranked, candidates.len() == 1, seen);
            if best.is_none() && ranked["feasible"] == true {
                best = Some(index);
                assert_eq!(expected["best"], name, "the first feasible one is the best");
            }
            seen.candidates += 1;
        }
        best.unwrap()
    }

    fn compare_scores(
        &self,
        ours: &[Vec<f32>],
        recorded: &[Vec<f32>],
        ranked: &Value,
        alone: bool,
        seen: &mut Differences,
    ) {
        let decay = singles(&self.file["ranker"]["time_decay_weight"]);
        let weights = singles(&self.file["ranker"]["score_weight"]);
        let (expected, total) = (singles(&ranked["scores"]), number(&ranked["total"]) as f32);
        let (scores, sum) = evaluated(recorded, &decay, &weights, alone);
        let difference = greatest(&scores, &expected).max((sum - total).abs());
        seen.recorded_score = seen.recorded_score.max(difference);
        assert!(difference <= RECORDED_SCORE_TOLERANCE, "{}: {difference}", self.file["name"]);
        // Ours, with the metric that they do not have and the deviation from lanes as recorded.
        let mut own = ours.to_vec();
        own.insert(TIME_TO_COLLISION, recorded[TIME_TO_COLLISION].clone());
        own[TIME_TO_COLLISION + 1].clone_from(&recorded[TIME_TO_COLLISION + 1]);
        let (scores, sum) = evaluated(&own, &decay, &weights, alone);
        let difference = greatest(&scores, &expected).max((sum - total).abs());
        seen.score = seen.score.max(difference);
        assert!(difference <= SCORE_TOLERANCE, "{}: {difference}", self.file["name"]);
        let names = self.names.len();
        assert_eq!((scores.len(), recorded.len()), (names, names));
    }
}

fn run(file: &Value, map: &Map, seen: &mut Differences) {
    assert_eq!(file["format"], "trajectory-ranker/1");
    let names = list(&file["metric_names"]);
    let mut sequence = Sequence {
        file,
        names,
        parameters: parameters(&file["ranker"], names),
        wheel_base_m: number(&file["vehicle"]["wheel_base"]),
        history: History::default(),
    };
    for (cycle, expected) in list(&file["cycles"]).iter().zip(list(&file["expected_ranker"])) {
        let now = Time::from_nanoseconds((number(&cycle["time"]) * 1e9).round() as i64);
        let at = |key: &str| number(&cycle["odometry"][key]);
        let ego = pose_of(&pose(at("x"), at("y"), at("z"), at("yaw")));
        let candidates: Vec<_> = list(&cycle["candidates"])
            .iter()
            .map(|candidate_file| candidate(candidate_file, list(&file["columns"]), now))
            .collect();
        let lanes = PreferredLanes::along(map, &route(&cycle["route"]));
        let best = sequence.cycle(&candidates, &ego, &lanes, expected, seen);
        let chosen = Chosen { at: now, stamp: now, points: candidates[best].points.clone(), ego };
        sequence.history.push(chosen, sequence.parameters.trajectory_history_size as usize);
        seen.cycles += 1;
        seen.best += 1;
    }
}

#[test]
fn every_metric_equals_the_original() {
    let Some(golden) = golden() else { return };
    let options =
        OsmOptions { projector: Some(Projector::Local), strict: false, centerline_resolution_m: None };
    let mut maps: BTreeMap<String, Map> = BTreeMap::new();
    let mut seen = Differences::default();
    let mut files: Vec<_> =
        std::fs::read_dir(golden.join("ranker/open")).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    for path in &files {
        let file: Value = serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap();
        let name = file["map"].as_str().unwrap().to_owned();
        let map = maps
            .entry(name.clone())
            .or_insert_with(|| Map::load(&golden.join("maps").join(name), &options).unwrap().map);
        run(&file, map, &mut seen);
    }
    println!("{} files: {seen:?}", files.len());
    assert!(files.len() >= 40 && seen.cycles > 150 && seen.candidates > 500, "{seen:?}");
}
