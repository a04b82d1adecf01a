//! What can be wrong with a scene file, and where.

use std::fmt;

use motion::VehicleError;
use open_space::ObstacleError;
use thiserror::Error;

use crate::settings::{Position, ProblemKind};

/// Why a scene is refused: everything that is wrong, at once.
#[derive(Clone, Debug, PartialEq, Error)]
pub struct SceneError {
    /// The file, or what stands for it.
    pub origin: String,
    /// Never empty; in the order they were found.
    pub problems: Vec<SceneProblem>,
}

impl fmt::Display for SceneError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (k, problem) in self.problems.iter().enumerate() {
            if k > 0 {
                f.write_str("\n")?;
            }
            f.write_str(&self.origin)?;
            if let Some(Position { line, column }) = problem.position {
                write!(f, ":{line}:{column}")?;
            }
            write!(f, ": {problem}")?;
        }
        Ok(())
    }
}

/// One thing that is wrong.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneProblem {
    /// Place in the file; none for the file as a whole.
    pub position: Option<Position>,
    /// The key that it is about, with its groups: `start.yaw`.
    pub key: Option<String>,
    /// What is wrong.
    pub kind: SceneProblemKind,
}

impl fmt::Display for SceneProblem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.key {
            Some(key) => write!(f, "`{key}` {}", self.kind),
            None => self.kind.fmt(f),
        }
    }
}

/// Kinds of problems. The texts complete "`<key>` ..." where they are about a key.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum SceneProblemKind {
    /// The file cannot be read.
    #[error("cannot be read: {reason}")]
    Unreadable {
        /// Text of the operating system.
        reason: String,
    },
    /// The file is larger than any scene.
    #[error("is larger than {limit} bytes: this is no scene file")]
    TooLarge {
        /// The limit.
        limit: u64,
    },
    /// The text is no YAML, or YAML that no file of ours needs.
    #[error(transparent)]
    Yaml(ProblemKind),
    /// There is nothing in it.
    #[error("has no content; a scene needs `bounds`, `start` and `goal`")]
    NoContent,
    /// A key that a scene does not have.
    #[error("is no key of a scene (allowed: {allowed}{})", .nearest.map(|n| format!("; did you mean `{n}`?")).unwrap_or_default())]
    UnknownKey {
        /// The keys there are.
        allowed: String,
        /// The one that is spelled most alike.
        nearest: Option<&'static str>,
    },
    /// The same key twice.
    #[error("is given twice, first in line {first_line}")]
    Duplicate {
        /// Line of the first.
        first_line: usize,
    },
    /// A key that must be there is not.
    #[error("is missing")]
    Missing,
    /// A value is not what its key needs.
    #[error("must be {expected}")]
    WrongType {
        /// What it should be.
        expected: &'static str,
    },
    /// NaN or an infinity.
    #[error("is {value}, which is not a finite number")]
    NotFinite {
        /// As given.
        value: f64,
    },
    /// A limit that lets hardly anything move.
    #[error("is {value}, but must be at least {least}")]
    TooSmall {
        /// As given.
        value: f64,
        /// Smallest limit.
        least: f64,
    },
    /// Dimensions that no vehicle has.
    #[error(transparent)]
    Vehicle(VehicleError),
    /// Bounds or obstacles that nothing can be planned in.
    #[error(transparent)]
    Obstacles(ObstacleError),
    /// Start or goal is out of bounds.
    #[error("is outside the bounds {bounds:?}; move it or widen them")]
    OutsideBounds {
        /// x_min, x_max, y_min, y_max.
        bounds: [f64; 4],
    },
    /// The vehicle touches an obstacle.
    #[error("is in collision: the vehicle touches an obstacle there")]
    InCollision,
    /// The vehicle starts faster than it may drive.
    #[error("is {speed_mps} m/s, but the limits allow -{reverse_mps} to {forward_mps} m/s")]
    StartSpeed {
        /// As given.
        speed_mps: f64,
        /// Limit in reverse.
        reverse_mps: f64,
        /// Limit forward.
        forward_mps: f64,
    },
}
