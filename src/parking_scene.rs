//! Parking scene files: a vehicle, bounds, obstacles, start and goal in YAML, read with the place of everything that
//! is wrong.
//!
//! ```yaml
//! name: perpendicular_reverse
//! vehicle: {wheel_base: 2.79, front_overhang: 1.0}   # optional; what is missing is that of the configured vehicle
//! bounds: [-14.0, 18.0, -6.0, 8.0]                   # x_min, x_max, y_min, y_max of the reference point, m
//! obstacles:                                         # a closed polyline is a solid polygon, an open one a wall
//!   - [[-14.0, 0.0], [0.0, 0.0], [0.0, -5.5], [3.2, -5.5], [3.2, 0.0], [18.0, 0.0]]
//! start: {x: -4.0, y: 3.0, yaw: 0.0, v: 0.0}
//! goal: {x: 1.6, y: -4.1, yaw: 1.5707963}
//! limits: {max_speed_forward: 2.0}                   # optional; what is missing is that of the configured limits
//! ```
//!
//! A scene that is read is one that a path can be searched in: numbers are finite, start and goal are free and within
//! the bounds, limits positive. Everything that is wrong is reported at once.

mod error;
mod reader;
mod schema;

use std::fs::File;
use std::io::Read as _;
use std::path::Path;

use motion::VehicleInfo;
use open_space::{CollisionChecker, Limits, ObstacleError, PlanarPose, Problem};

pub use error::{SceneError, SceneProblem, SceneProblemKind};
use reader::Draft;
pub use schema::schema;

/// Largest scene file that is read, bytes.
const MAX_FILE_BYTES: u64 = 4 << 20;

/// A scene, ready to be planned in.
#[derive(Clone, Debug)]
pub struct ParkingScene {
    /// As the file says, or the file's name without its ending.
    pub name: String,
    /// What is to be planned.
    pub problem: Problem,
}

impl ParkingScene {
    /// Reads a scene file. `vehicle` and `limits` stand for what the file says nothing about.
    ///
    /// # Errors
    /// A file that cannot be read, and everything that is wrong in it.
    pub fn load(path: &Path, vehicle: &VehicleInfo, limits: &Limits) -> Result<Self, SceneError> {
        let origin = path.display().to_string();
        let text = read_file(path).map_err(|kind| SceneError {
            origin: origin.clone(),
            problems: vec![SceneProblem { position: None, key: None, kind }],
        })?;
        let stem = path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
        Self::parse(&text, &origin, &stem, vehicle, limits)
    }

    /// Reads the text of a scene file. `origin` is what errors call it, `name` what the scene is called where the
    /// text does not say.
    ///
    /// # Errors
    /// Everything that is wrong.
    pub fn parse(
        text: &str,
        origin: &str,
        name: &str,
        vehicle: &VehicleInfo,
        limits: &Limits,
    ) -> Result<Self, SceneError> {
        let mut draft = Draft::read(text, vehicle, limits);
        let problem = draft.problem.take().filter(|_| draft.problems.is_empty());
        if let Some(problem) = &problem {
            check(problem, &mut draft);
        }
        match problem {
            Some(problem) if draft.problems.is_empty() => {
                Ok(Self { name: draft.name.unwrap_or_else(|| name.to_owned()), problem })
            }
            _ => Err(SceneError { origin: origin.to_owned(), problems: draft.problems }),
        }
    }
}

/// What can only be seen in the whole.
fn check(problem: &Problem, draft: &mut Draft) {
    let checker = match CollisionChecker::new(problem) {
        Ok(checker) => checker,
        Err(error) => {
            let at = match error {
                ObstacleError::Bounds { .. } => draft.places.bounds,
                ObstacleError::Vertex { obstacle, .. } => draft.places.obstacles.get(obstacle).copied(),
                ObstacleError::TooMany { .. } => draft.places.obstacles.first().copied(),
            };
            return draft.report(at, None, SceneProblemKind::Obstacles(error));
        }
    };
    let (start, goal) = (draft.places.start, draft.places.goal);
    for (key, pose, at) in [("start", problem.start, start), ("goal", problem.goal, goal)] {
        if let Some(kind) = standing(&checker, &pose) {
            draft.report(at, Some(key), kind);
        }
    }
    let limits = &problem.limits;
    let allowed = -limits.max_speed_reverse_mps..=limits.max_speed_forward_mps;
    if !allowed.contains(&problem.start_speed_mps) {
        let kind = SceneProblemKind::StartSpeed {
            speed_mps: problem.start_speed_mps,
            reverse_mps: limits.max_speed_reverse_mps,
            forward_mps: limits.max_speed_forward_mps,
        };
        draft.report(start, Some("start.v"), kind);
    }
}

fn standing(checker: &CollisionChecker, pose: &PlanarPose) -> Option<SceneProblemKind> {
    if !checker.is_within_bounds(pose) {
        return Some(SceneProblemKind::OutsideBounds { bounds: checker.bounds() });
    }
    (!checker.is_free(pose, 0.0)).then_some(SceneProblemKind::InCollision)
}

fn read_file(path: &Path) -> Result<String, SceneProblemKind> {
    let unreadable = |error: std::io::Error| SceneProblemKind::Unreadable { reason: error.to_string() };
    let file = File::open(path).map_err(unreadable)?;
    let mut text = String::new();
    file.take(MAX_FILE_BYTES + 1).read_to_string(&mut text).map_err(unreadable)?;
    if text.len() as u64 > MAX_FILE_BYTES {
        return Err(SceneProblemKind::TooLarge { limit: MAX_FILE_BYTES });
    }
    Ok(text)
}

#[cfg(test)]
mod tests;
