//! `check`: is a file what the program would accept?
//!
//! Parameter files are loaded together in the order given, as the node would, and every problem is reported at its
//! file. Other kinds of files have checkers of their own, chosen by the ending of the name ([`FileKind::of`]).

use std::fmt;
use std::path::{Path, PathBuf};

use lanelet_map::Map;
use lanelet_map::osm::OsmOptions;
use serde::Serialize;

use crate::settings::{DEFAULT_NODE_NAME, Problem, Settings, Source, write_hints};

/// What a file is taken for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum FileKind {
    /// ROS 2 parameters, in YAML.
    Parameters,
    /// HD map: the binary of a map message (`.bin`) or OpenStreetMap XML (`.osm`).
    Map,
}

impl FileKind {
    /// The kind by the ending of the name: what is no map is a parameter file.
    #[must_use]
    pub fn of(path: &Path) -> Self {
        match path.extension().and_then(|ending| ending.to_str()) {
            Some("bin" | "osm") => Self::Map,
            _ => Self::Parameters,
        }
    }
}

/// What is wrong with a file.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct FileProblem {
    /// Line from 1, none when the problem has no place in the file.
    pub line: Option<usize>,
    /// Column from 1, like the line.
    pub column: Option<usize>,
    /// Parameter or key it is about.
    pub key: Option<String>,
    /// What is wrong.
    pub message: String,
    /// What would be right.
    pub allowed: Option<String>,
    /// The valid name or choice that was probably meant.
    pub nearest: Option<String>,
}

/// The result for one file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct CheckedFile {
    /// Path as it was given.
    pub path: String,
    /// What the file was taken for.
    pub kind: FileKind,
    /// Everything that is wrong, in the order of the file. Empty when the file is accepted.
    pub problems: Vec<FileProblem>,
}

/// The result of `check`. Its `Display` form is for people: `file:line:column: message (allowed: ..)`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct CheckReport {
    /// The files in the order given.
    pub files: Vec<CheckedFile>,
}

impl CheckReport {
    /// True when no file has a problem.
    #[must_use]
    pub fn ok(&self) -> bool {
        self.files.iter().all(|file| file.problems.is_empty())
    }
}

/// Checks files. Parameters are those of the node with this name (default: the node's own name), in whatever
/// namespace. `check_map` checks one file of kind [`FileKind::Map`].
pub fn run(
    paths: &[PathBuf],
    node: Option<&str>,
    check_map: impl Fn(&Path) -> Vec<FileProblem>,
) -> CheckReport {
    let mut files: Vec<CheckedFile> = paths
        .iter()
        .map(|path| {
            let kind = FileKind::of(path);
            let problems = match kind {
                FileKind::Parameters => Vec::new(),
                FileKind::Map => check_map(path),
            };
            CheckedFile { path: path.display().to_string(), kind, problems }
        })
        .collect();

    let parameter_files: Vec<usize> =
        (0..files.len()).filter(|index| files[*index].kind == FileKind::Parameters).collect();
    let sources: Vec<Source> =
        parameter_files.iter().map(|index| Source::File(paths[*index].clone())).collect();
    for problem in Settings::check(node.unwrap_or(DEFAULT_NODE_NAME), &sources) {
        // A broken rule between defaults has no file; it cannot be, but if it were, the last file shows it.
        let source = problem.location.as_ref().map_or(usize::MAX, |location| location.source);
        let file = parameter_files.get(source).or(parameter_files.last());
        if let Some(index) = file {
            files[*index].problems.push(problem.into());
        }
    }
    CheckReport { files }
}

/// Checks a map as the node would read it. Autoware refuses a map with any defect, and so do we.
#[must_use]
pub fn check_map(path: &Path) -> Vec<FileProblem> {
    let options = OsmOptions { strict: false, ..OsmOptions::default() };
    let problem = |message: String| FileProblem { message, ..FileProblem::default() };
    match Map::load(path, &options) {
        Ok(loaded) if loaded.map.lanelets().len() == 0 => vec![problem("the map has no lanelet".to_owned())],
        Ok(loaded) => loaded.issues.iter().map(|issue| problem(issue.to_string())).collect(),
        Err(error) => vec![problem(error.to_string())],
    }
}

impl From<Problem> for FileProblem {
    fn from(problem: Problem) -> Self {
        let position = problem.location.as_ref().and_then(|location| location.position);
        Self {
            line: position.map(|position| position.line),
            column: position.map(|position| position.column),
            message: problem.message(),
            key: problem.key,
            allowed: problem.allowed,
            nearest: problem.nearest,
        }
    }
}

impl fmt::Display for CheckReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for file in &self.files {
            if file.problems.is_empty() {
                writeln!(f, "{}: ok", file.path)?;
            }
            for problem in &file.problems {
                f.write_str(&file.path)?;
                if let (Some(line), Some(column)) = (problem.line, problem.column) {
                    write!(f, ":{line}:{column}")?;
                }
                writeln!(f, ": {problem}")?;
            }
        }
        Ok(())
    }
}

impl fmt::Display for FileProblem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)?;
        write_hints(f, self.allowed.as_deref(), self.nearest.as_deref())
    }
}
