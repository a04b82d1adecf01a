//! Hybrid A*: a coarse, drivable path from start to goal.
//!
//! Nodes are poses in cells of a lattice, reached by short arcs of several steering angles in both gears; from every
//! node that is expanded the search tries to reach the end by a Reeds-Shepp word, in ascending cost until one is free.
//! The heuristic is the greater of the way round obstacles for a point and the cheapest word without obstacles.
//!
//! What makes tight places hard differs from scene to scene, so several such searches take turns: from the start and
//! from the goal (out of a slot is easier found than into it), with much and with little distance to obstacles, on
//! coarser and, where those run dry, finer lattices. The turns are counted in expansions: the same problem gives the
//! same path on every machine unless the caller interrupts.

mod attempt;
mod lattice;
mod motion_check;
mod parameters;
mod path;
mod portfolio;
mod shortcut;

use std::sync::LazyLock;

use thiserror::Error;

use crate::collision::{CollisionChecker, ObstacleError};
use crate::grid_heuristic::GridHeuristic;
use crate::interruption::Interruption;
use crate::pose::PlanarPose;
use crate::problem::Problem;
use crate::provider::{OutOfRange, out_of_ranges, ranges};
use crate::tolerance::{END_M, END_RAD};
use attempt::Costs;
pub use parameters::SearchParameters;
pub use path::{CoarsePath, GearPart};
use portfolio::{Found, Portfolio};
use shortcut::Shortcuts;

/// A path that keeps less room is taken when it is cheaper by this, m.
const TIGHTER_WORTH_M: f64 = 1.0;

/// Of the parameters, made once: it takes longer than some searches.
static RANGES: LazyLock<serde_json::Value> = LazyLock::new(ranges::<SearchParameters>);

/// Why there is no path.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum SearchError {
    /// Bounds or obstacles are no input for a search.
    #[error(transparent)]
    Obstacles(#[from] ObstacleError),
    /// A number of the parameters is out of its range.
    #[error(transparent)]
    Parameter(#[from] OutOfRange),
    /// Start or goal is not finite.
    #[error("the {end} pose ({}, {}, {}) is not finite", .pose.x, .pose.y, .pose.yaw)]
    NotFinite {
        /// Which one.
        end: End,
        /// As given.
        pose: PlanarPose,
    },
    /// Start or goal is out of bounds.
    #[error("the {end} at ({}, {}) is outside the bounds {bounds:?}; move it or widen the region", .pose.x, .pose.y)]
    OutsideBounds {
        /// Which one.
        end: End,
        /// As given.
        pose: PlanarPose,
        /// x_min, x_max, y_min, y_max.
        bounds: [f64; 4],
    },
    /// The vehicle touches an obstacle at start or goal.
    #[error("the vehicle touches an obstacle at the {end} ({}, {}, {})", .pose.x, .pose.y, .pose.yaw)]
    InCollision {
        /// Which one.
        end: End,
        /// As given.
        pose: PlanarPose,
    },
    /// Every reachable node was expanded, on the finest lattice with the least inflation.
    #[error("no path: all {expansions} reachable nodes were expanded; the space is too tight or closed off")]
    Exhausted {
        /// Nodes expanded.
        expansions: usize,
    },
    /// The number of expansions allowed was used up.
    #[error("no path within {expansions} expansions; allow more or simplify the scene")]
    OutOfExpansions {
        /// Nodes expanded.
        expansions: usize,
    },
    /// The caller's time is up.
    #[error("no path in the time allowed ({expansions} expansions)")]
    OutOfTime {
        /// Nodes expanded.
        expansions: usize,
    },
    /// The caller cancelled.
    #[error("cancelled after {expansions} expansions")]
    Cancelled {
        /// Nodes expanded.
        expansions: usize,
    },
}

/// One end of the path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// Where the vehicle stands.
    Start,
    /// Where it shall stand.
    Goal,
}

impl std::fmt::Display for End {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Start => "start",
            Self::Goal => "goal",
        })
    }
}

/// A search that is ready to begin.
#[derive(Debug)]
pub struct Search<'a> {
    problem: &'a Problem,
    checker: &'a CollisionChecker,
    parameters: &'a SearchParameters,
    to_goal: GridHeuristic,
    to_start: GridHeuristic,
}

impl<'a> Search<'a> {
    /// Looks at the input and calculates the heuristics of a search from start to goal of `problem`, whose bounds and
    /// obstacles `checker` was made from.
    ///
    /// # Errors
    /// Input that no path can be searched for, an interruption.
    pub fn prepare(
        problem: &'a Problem,
        checker: &'a CollisionChecker,
        parameters: &'a SearchParameters,
        interruption: &mut dyn FnMut() -> Option<Interruption>,
    ) -> Result<Self, SearchError> {
        if let Some(wrong) = out_of_ranges(parameters, &RANGES).into_iter().next() {
            return Err(wrong.into());
        }
        check_end(checker, End::Start, problem.start)?;
        check_end(checker, End::Goal, problem.goal)?;
        let mut grid = |target: PlanarPose| {
            let (resolution_m, radius_m) = (parameters.grid_a_star_xy_resolution, parameters.node_radius);
            let mut ended = interruption();
            let mut patience = || {
                ended = ended.or_else(&mut *interruption);
                ended.is_some()
            };
            let grid = GridHeuristic::new(checker, target.point(), resolution_m, radius_m, &mut patience);
            go_on(&mut || ended, 0)?;
            Ok::<_, SearchError>(grid)
        };
        let (to_goal, to_start) = (grid(problem.goal)?, grid(problem.start)?);
        Ok(Self { problem, checker, parameters, to_goal, to_start })
    }

    /// Searches.
    ///
    /// `interruption` is asked every few dozen expansions whether to end early. Once there is a path it is handed out
    /// even then.
    ///
    /// # Errors
    /// Why no path was found.
    pub fn run(
        &self,
        interruption: &mut dyn FnMut() -> Option<Interruption>,
    ) -> Result<CoarsePath, SearchError> {
        let Self { problem, checker, parameters, .. } = *self;
        if problem.start.distance_m(&problem.goal) <= END_M
            && problem.start.yaw_to(&problem.goal).abs() <= END_RAD
        {
            return Ok(CoarsePath { parts: Vec::new(), cost_m: 0.0, inflation_m: 0.0, expansions: 0 });
        }
        let mut portfolio = Portfolio::new(problem, checker, (&self.to_goal, &self.to_start), parameters);
        let found = portfolio.run(interruption)?;
        let costs = Costs::of(parameters);
        let mut shortcuts = Shortcuts { checker, start: &problem.start, costs: &costs, interruption };
        let mut best = shortcuts.shorten(&found);
        // Room and curvature that the search set aside are worth it where they spare a detour.
        let tighter = shortcuts.shorten(&Found {
            arcs: best.arcs.clone(),
            inflation_m: portfolio.less_inflation_m().min(best.inflation_m),
            max_curvature: problem.vehicle.max_curvature(),
        });
        if costs.path(&tighter.arcs) + TIGHTER_WORTH_M < costs.path(&best.arcs) {
            best = tighter;
        }
        Ok(CoarsePath {
            parts: path::parts(&problem.start, &problem.goal, &best.arcs, parameters.pose_spacing),
            cost_m: costs.path(&best.arcs),
            inflation_m: best.inflation_m,
            expansions: portfolio.expansions(),
        })
    }
}

/// An error where the caller wants no more.
fn go_on(
    interruption: &mut dyn FnMut() -> Option<Interruption>,
    expansions: usize,
) -> Result<(), SearchError> {
    match interruption() {
        Some(Interruption::Cancelled) => Err(SearchError::Cancelled { expansions }),
        Some(Interruption::OutOfTime) => Err(SearchError::OutOfTime { expansions }),
        None => Ok(()),
    }
}

fn check_end(checker: &CollisionChecker, end: End, pose: PlanarPose) -> Result<(), SearchError> {
    if !pose.is_finite() {
        return Err(SearchError::NotFinite { end, pose });
    }
    if !checker.is_within_bounds(&pose) {
        return Err(SearchError::OutsideBounds { end, pose, bounds: checker.bounds() });
    }
    if !checker.is_free(&pose, 0.0) {
        return Err(SearchError::InCollision { end, pose });
    }
    Ok(())
}

#[cfg(test)]
mod tests;
