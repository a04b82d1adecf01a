//! Golden sequences: scenes and candidates with the verdicts that the original filters gave on them.
//!
//! Owns the reading of files in the format `trajectory-filters/2`. A [`Sequence`] is a vehicle, parameters and cycles;
//! each [`Cycle`] is a scene, candidates and what is [expected](Expected) of every filter. What is read is put in the
//! very types that a running node hands to the filters: stamps as whole nanoseconds, motion fields as 32-bit floats,
//! orientations as quaternions about the vertical axis. Parameters go straight into the structs, so a sequence may
//! hold values that a parameter file may not. Maps are decoded once and shared.
//!
//! Unknown keys are ignored; an unknown parameter is an error, because the verdicts depend on it.

mod file;
mod maps;
mod scene;

pub use maps::Maps;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use messages::unique_identifier_msgs::Uuid;
use motion::VehicleInfo;
use selection::parameters::ValidatorParameters;
use selection::{Candidate, Scene};

/// The format that is read.
pub const FORMAT: &str = "trajectory-filters/2";

/// Why a golden file cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum GoldenError {
    /// The file or folder cannot be read.
    #[error("{}: {source}; check the path and its permissions", path.display())]
    Read {
        /// What was to be read.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A folder holds no file that could be a sequence.
    #[error("{}: no .json file in this folder; name the folder of the sequences", path.display())]
    Empty {
        /// The folder.
        path: PathBuf,
    },
    /// The text is not JSON, or not of the expected shape.
    #[error("{}: {source}", path.display())]
    Json {
        /// The file.
        path: PathBuf,
        /// What is wrong, with line and column.
        source: serde_json::Error,
    },
    /// The file says that it is something else.
    #[error("{}: the format is `{found}`, but only `{FORMAT}` can be read", path.display())]
    Format {
        /// The file.
        path: PathBuf,
        /// The format that it names.
        found: String,
    },
    /// The vehicle's dimensions are refused.
    #[error("{}: {source}", path.display())]
    Vehicle {
        /// The file.
        path: PathBuf,
        /// Why.
        source: motion::VehicleError,
    },
    /// An override names a parameter that does not exist, or gives it a value of another type.
    #[error("{}: {place}: {source}", path.display())]
    Parameters {
        /// The file.
        path: PathBuf,
        /// Whose overrides: those of the file or of a cycle.
        place: String,
        /// What is wrong.
        source: serde_json::Error,
    },
    /// The content contradicts itself.
    #[error("{}: {place}: {what}", path.display())]
    Content {
        /// The file.
        path: PathBuf,
        /// Where in the file.
        place: String,
        /// What is wrong.
        what: &'static str,
    },
    /// The map of a sequence cannot be read.
    #[error("map {}: {source}; say where the maps are if not in `maps/` beside the sequences", path.display())]
    Map {
        /// The map.
        path: PathBuf,
        /// Why.
        source: lanelet_map::MapError,
    },
}

/// A drive of some cycles through one map.
#[derive(Debug, Clone)]
pub struct Sequence {
    /// Name that the file gives itself.
    pub name: String,
    /// Theme of the sequence, and notes to readers.
    pub tags: Vec<String>,
    /// The vehicle.
    pub vehicle: Arc<VehicleInfo>,
    /// Parameters at the start; the lists of filters are empty.
    pub parameters: ValidatorParameters,
    /// Short names of the filters whose verdicts the file holds.
    pub filters: Vec<String>,
    /// The cycles in order of time.
    pub cycles: Vec<Cycle>,
}

/// One cycle.
#[derive(Debug, Clone)]
pub struct Cycle {
    /// Parameters that take effect before this cycle, where they change.
    pub parameters: Option<ValidatorParameters>,
    /// The world.
    pub scene: Scene,
    /// The candidates.
    pub candidates: Vec<Candidate>,
    /// What is expected of each candidate, in the same order.
    pub expected: Vec<Expected>,
}

/// What is expected of one candidate.
#[derive(Debug, Clone, PartialEq)]
pub struct Expected {
    /// How the candidate was made.
    pub note: String,
    /// Number of the defect that the data-validity check must find, 0 for none. Verdicts on a candidate with a defect
    /// are those of filters that were called although the check refuses it.
    pub data_validity: u8,
    /// Verdicts by filter.
    pub verdicts: BTreeMap<String, ExpectedVerdict>,
    /// Filters whose verdict flips when positions move by 1e-9 m.
    pub fragile: Vec<String>,
}

/// What is expected of one filter on one candidate. Where the original chose among the wrong border segments, this is
/// the verdict on the right ones.
#[derive(Debug, Clone, PartialEq)]
pub enum ExpectedVerdict {
    /// It judges.
    Judged {
        /// Whether the candidate may be driven.
        feasible: bool,
        /// Measurements in order.
        metrics: Vec<ExpectedMetric>,
        /// Those for whom the vehicle would have to wait, in order.
        safety_factors: Vec<ExpectedFactor>,
    },
    /// It answers with an error, which keeps the candidate in. The text is not binding.
    Error(String),
}

/// One measurement.
#[derive(Debug, Clone, PartialEq)]
pub struct ExpectedMetric {
    /// Name.
    pub name: String,
    /// Value.
    pub value: f64,
    /// Level from 0, safe, to 3, danger.
    pub level: u8,
}

/// A road user named in a planning factor.
#[derive(Debug, Clone, PartialEq)]
pub struct ExpectedFactor {
    /// Who.
    pub object_id: Uuid,
    /// Where, in the map frame, m.
    pub x_m: f64,
    /// Where, in the map frame, m.
    pub y_m: f64,
}

impl Sequence {
    /// Reads a sequence and its map.
    ///
    /// # Errors
    /// Everything in [`GoldenError`].
    pub fn read(path: &Path, maps: &mut Maps) -> Result<Self, GoldenError> {
        let text =
            std::fs::read(path).map_err(|source| GoldenError::Read { path: path.to_owned(), source })?;
        Self::parse(path, &text, maps)
    }

    /// Reads the text of a sequence, and its map. `path` is what errors call it, and where its map is looked for.
    ///
    /// # Errors
    /// Everything in [`GoldenError`].
    pub fn parse(path: &Path, text: &[u8], maps: &mut Maps) -> Result<Self, GoldenError> {
        scene::sequence(path, text, maps)
    }
}

/// The files that the paths name: files as they are, folders as their `.json` files in the order of names.
///
/// # Errors
/// [`GoldenError::Read`], and [`GoldenError::Empty`] for a folder without such files.
pub fn sequence_files(paths: &[PathBuf]) -> Result<Vec<PathBuf>, GoldenError> {
    let mut files = Vec::new();
    for path in paths {
        if !path.is_dir() {
            files.push(path.clone());
            continue;
        }
        let fail = |source| GoldenError::Read { path: path.clone(), source };
        let entries = std::fs::read_dir(path).map_err(fail)?;
        let mut inside = entries
            .map(|entry| entry.map(|entry| entry.path()))
            .collect::<Result<Vec<_>, _>>()
            .map_err(fail)?;
        inside.retain(|file| file.extension().is_some_and(|ending| ending == "json"));
        if inside.is_empty() {
            return Err(GoldenError::Empty { path: path.clone() });
        }
        inside.sort();
        files.append(&mut inside);
    }
    Ok(files)
}
