//! Parking scenes of the shared data, with the best paths known for them.

#[path = "scene_files.rs"]
mod scene_files;

use std::fs;
use std::path::{Path, PathBuf};

use open_space::{Arc, CoarsePath, GearPart, PlanarPose, Problem};
use scene_files::parse;
use serde_json::Value;

/// A scene and what is known about it.
pub(crate) struct Scene {
    pub(crate) name: String,
    pub(crate) problem: Problem,
    /// The best path known: arcs within the curvature limit, often at it, with a centimetre of clearance.
    pub(crate) best: Option<CoarsePath>,
    /// Changes of gear of the path with the fewest of them that is known.
    pub(crate) fewest_gear_changes: Option<u64>,
}

/// All scenes by name, or none with a word about it where the data is absent.
pub(crate) fn scenes() -> Vec<Scene> {
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared");
    let shared = std::env::var_os("SELECTOR_SHARED").map_or(beside, PathBuf::from);
    let folder = shared.join("data/parking");
    let Ok(index) = fs::read_to_string(folder.join("index.json")) else {
        eprintln!("skipped: no parking scenes in {}", folder.display());
        return Vec::new();
    };
    let index: Value = serde_json::from_str(&index).unwrap();
    let mut scenes: Vec<Scene> =
        index["scenes"].as_array().unwrap().iter().map(|e| read(&folder, e)).collect();
    scenes.sort_by(|a, b| a.name.cmp(&b.name));
    scenes
}

fn read(folder: &Path, entry: &Value) -> Scene {
    let name = entry["name"].as_str().unwrap().to_owned();
    let problem = parse(&fs::read_to_string(folder.join(format!("{name}.yaml"))).unwrap());
    let best = entry["best_path"].as_array().filter(|arcs| !arcs.is_empty()).map(|arcs| {
        let number = |value: &Value| value.as_f64().unwrap();
        let arcs = arcs.iter().map(|arc| Arc::new(number(&arc[0]), number(&arc[1])));
        let inflation_m = (number(&entry["clearance_m"]) - 0.003).max(0.0);
        coarse_path(&problem, arcs, inflation_m)
    });
    Scene { name, problem, best, fewest_gear_changes: entry["fewest_gear_changes"].as_u64() }
}

fn coarse_path(problem: &Problem, arcs: impl Iterator<Item = Arc>, inflation_m: f64) -> CoarsePath {
    let mut parts: Vec<GearPart> = Vec::new();
    let mut pose = problem.start;
    for arc in arcs.filter(|arc| arc.length_m != 0.0) {
        if parts.last().is_none_or(|part| part.gear != arc.gear()) {
            parts.push(GearPart { gear: arc.gear(), poses: vec![pose], arcs: Vec::new() });
        }
        pose = arc.end(&pose);
        let part = parts.last_mut().unwrap();
        part.poses.push(pose);
        part.arcs.push(arc);
    }
    // The lengths are rounded to micrometres.
    let last = parts.last_mut().unwrap().poses.last_mut().unwrap();
    *last = PlanarPose { yaw: last.yaw + last.yaw_to(&problem.goal), ..problem.goal };
    CoarsePath { parts, cost_m: 0.0, inflation_m, expansions: 0 }
}
