//! From a problem to a trajectory: search, smooth each gear part, find the speed, join, check.
//!
//! Anytime: once the search has found a path there is always a trajectory to return. Stopped after the search, the
//! vehicle drives the arcs that were found and stands still to steer between them; stopped after the smoothing, it
//! drives the smooth path at a careful speed. A part that cannot be smoothed among its obstacles is cut in pieces that
//! can, the last of them an arc, with stops to steer between them. Nothing is returned that did not pass [`verify`](crate::verification::verify).
//!
//! The same problem, parameters and answers of the supervisor give the same plan, bit for bit.

mod draft;
mod lead_in;
mod parameters;
mod provided;
mod runs;

use thiserror::Error;

use crate::collision::{CollisionChecker, ObstacleError};
use crate::hybrid_a_star::{CoarsePath, Search, SearchError};
use crate::interruption::{Interruption, Patience, Watch};
use crate::problem::{Limits, Problem};
use crate::smoother::SmoothingError;
use crate::speed::SpeedError;
use crate::tolerance::MAX_HEADING_RAD;
use crate::trajectory::Trajectory;
use crate::verification::{Measures, Violation};
use draft::Draft;
use lead_in::LeadIn;
pub use parameters::{LimitParameters, OpenSpaceParameters};
use runs::Timing;

/// What the planner is about to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// Prepare the obstacles and calculate the way round them.
    Heuristic,
    /// Search a coarse path.
    Search,
    /// Smooth its parts.
    Smoothing,
    /// Find the speed.
    Speed,
    /// Join and check the trajectory.
    Check,
}

/// The caller's say while a plan is made. It also owns the clock: the planner has none.
pub trait Supervisor {
    /// Asked often, also between the solves. Out of time, the planner returns the best it has; cancelled, it gives up.
    fn interruption(&mut self) -> Option<Interruption>;

    /// What a solve asks while it runs, whether it is still needed; without one it runs to its end.
    fn watch(&self) -> Option<Watch> {
        None
    }

    /// Told when a step begins.
    fn begin(&mut self, _step: Step) {}
}

/// Lets the planner finish.
#[derive(Clone, Copy, Debug, Default)]
pub struct Unsupervised;

impl Supervisor for Unsupervised {
    fn interruption(&mut self) -> Option<Interruption> {
        None
    }
}

/// How far a plan got.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Stage {
    /// The arcs of the search, with stops to steer.
    Search,
    /// The smooth path, at a careful speed.
    Smoothed,
    /// All the way.
    Timed,
}

/// A part that could not be smoothed in one piece and is driven with stops to steer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PartFallback {
    /// Of the coarse path, counted from 0.
    pub part: usize,
    /// Stops on its way.
    pub stops: usize,
    /// Why the last piece was cut.
    pub reason: SmoothingError,
}

/// A trajectory that may be driven, and how it came about.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// From the start to rest at the goal.
    pub trajectory: Trajectory,
    /// How far the planner got.
    pub stage: Stage,
    /// Why nothing of a later stage is returned although there was one: it did not pass the last check.
    pub held_back: Option<Violation>,
    /// The trajectory in numbers.
    pub measures: Measures,
    /// Parts that could not be smoothed in one piece.
    pub fallbacks: Vec<PartFallback>,
    /// Of the path that the search found, m.
    pub coarse_length_m: f64,
    /// Nodes the search expanded.
    pub expansions: usize,
    /// Programs the smoothing solved.
    pub passes: usize,
}

impl Plan {
    /// Stops to steer, beside those where the gear changes.
    #[must_use]
    pub fn stops(&self) -> usize {
        self.fallbacks.iter().map(|fallback| fallback.stops).sum()
    }
}

/// Why there is no plan.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum PlanError {
    /// A number of the problem that cannot be.
    #[error("`{field}` is {value}, but must be {wanted}; correct the input")]
    Input {
        /// Which one.
        field: &'static str,
        /// As given.
        value: f64,
        /// What it must be.
        wanted: &'static str,
    },
    /// Bounds or obstacles that cannot be.
    #[error(transparent)]
    Obstacles(#[from] ObstacleError),
    /// No path was found, or none can be.
    #[error(transparent)]
    Search(SearchError),
    /// The caller needs no plan any more.
    #[error("planning was cancelled")]
    Cancelled,
    /// A rolling vehicle that cannot stop before something in its way, as its wheels stand.
    #[error(
        "the vehicle rolls at {speed_mps:.3} m/s, and the {length_m:.2} m that it needs to stop as its wheels stand are not free; stop first"
    )]
    BlockedAhead {
        /// Along the heading.
        speed_mps: f64,
        /// Needed, m.
        length_m: f64,
    },
    /// The vehicle rolls one way and the path begins the other way.
    #[error("the vehicle rolls at {speed_mps:.3} m/s, but the path begins in the other gear; stop first")]
    RollingAgainstGear {
        /// Along the heading.
        speed_mps: f64,
    },
    /// A rolling vehicle that cannot follow the path.
    #[error(transparent)]
    Speed(#[from] SpeedError),
    /// What was planned did not pass the last check.
    #[error("the planned trajectory was held back: {0}; report this with the scene")]
    Invalid(#[from] Violation),
}

/// Plans in open space.
#[derive(Clone, Debug)]
pub struct Planner {
    parameters: OpenSpaceParameters,
}

impl Planner {
    /// A planner with these parameters.
    #[must_use]
    pub fn new(parameters: OpenSpaceParameters) -> Self {
        Self { parameters }
    }

    /// Plans a motion from start to rest at the goal of `problem`. A vehicle that stands there already is told to
    /// stay.
    ///
    /// # Errors
    /// Input that cannot be, no path, an interruption before there was one, a rolling start that the path does not
    /// allow.
    pub fn plan(&self, problem: &Problem, supervisor: &mut dyn Supervisor) -> Result<Plan, PlanError> {
        check_input(problem)?;
        supervisor.begin(Step::Heuristic);
        let mut ended = None;
        let mut patience = || {
            ended = ended.or_else(|| supervisor.interruption());
            ended.is_some()
        };
        let checker = CollisionChecker::while_wanted(problem, &mut patience)?;
        let lead_in = LeadIn::of(problem);
        if let Some(blocked) = lead_in.filter(|lead_in| !lead_in.is_free(&checker, 0.0)) {
            let speed_mps = problem.start_speed_mps;
            return Err(PlanError::BlockedAhead { speed_mps, length_m: blocked.length_m() });
        }
        let ahead = lead_in.map(|lead_in| Problem { start: lead_in.end, ..problem.clone() });
        let mut interruption = || ended.or_else(|| supervisor.interruption());
        let search = Search::prepare(
            ahead.as_ref().unwrap_or(problem),
            &checker,
            &self.parameters.search,
            &mut interruption,
        )?;
        supervisor.begin(Step::Search);
        let mut coarse = search.run(&mut || supervisor.interruption())?;
        if let Some(lead_in) = lead_in {
            coarse = lead_in.before(coarse, &checker, self.parameters.search.pose_spacing);
        }
        self.refine(problem, &checker, &coarse, supervisor)
    }

    /// Makes a trajectory of a coarse path that was found for `problem`.
    ///
    /// # Errors
    /// Impossible numbers, a rolling start that the path does not allow, a path that is not what it says it is.
    pub fn refine(
        &self,
        problem: &Problem,
        checker: &CollisionChecker,
        coarse: &CoarsePath,
        supervisor: &mut dyn Supervisor,
    ) -> Result<Plan, PlanError> {
        check_input(problem)?;
        let mut patience = Refining { supervisor, is_cancelled: false };
        let mut draft = Draft::new(problem, checker, &self.parameters, coarse);
        patience.supervisor.begin(Step::Smoothing);
        let smoothed = draft.smooth(&mut patience);
        patience.supervisor.begin(Step::Speed);
        let timed = if smoothed { draft.runs(Timing::Planned, &mut patience) } else { Ok(None) };
        if timed.is_err() {
            // It may have failed of a solve that was broken off.
            patience.ends();
        }
        if patience.is_cancelled {
            return Err(PlanError::Cancelled);
        }
        let (runs, stage) = match (timed, smoothed) {
            (Ok(Some(runs)), _) => (Some(runs), Stage::Timed),
            (Ok(None), true) => (draft.runs(Timing::Quick, &mut || false).ok().flatten(), Stage::Smoothed),
            // A rolling vehicle is too fast for the smooth path: its wheels would have to turn faster than they can.
            (Ok(None), false) | (Err(_), _) => (None, Stage::Search),
        };
        patience.supervisor.begin(Step::Check);
        let held_back = match runs.map(|runs| draft.plan(&runs, stage)) {
            Some(Ok(plan)) => return Ok(plan),
            Some(Err(violation)) => Some(violation),
            None => None,
        };
        // Nothing but the arcs of the search: they are free of collisions by construction.
        let draft = Draft::new(problem, checker, &self.parameters, coarse);
        let runs = draft.runs(Timing::Quick, &mut || false)?.unwrap_or_default();
        Ok(Plan { held_back, ..draft.plan(&runs, Stage::Search)? })
    }
}

impl From<SearchError> for PlanError {
    fn from(error: SearchError) -> Self {
        match error {
            SearchError::Cancelled { .. } => Self::Cancelled,
            error => Self::Search(error),
        }
    }
}

/// A supervisor while a path is refined, and whether it has cancelled.
struct Refining<'a> {
    supervisor: &'a mut dyn Supervisor,
    is_cancelled: bool,
}

impl Patience for Refining<'_> {
    fn ends(&mut self) -> bool {
        let interruption = self.supervisor.interruption();
        self.is_cancelled |= interruption == Some(Interruption::Cancelled);
        interruption.is_some()
    }

    fn watch(&self) -> Option<Watch> {
        self.supervisor.watch()
    }
}

/// Refuses numbers that are not finite, headings without a direction and limits that are not positive.
fn check_input(problem: &Problem) -> Result<(), PlanError> {
    let (start, goal, limits) = (&problem.start, &problem.goal, &problem.limits);
    let states = [
        ("start.x", start.x),
        ("start.y", start.y),
        ("start.yaw", start.yaw),
        ("start.v", problem.start_speed_mps),
        ("start.a", problem.start_acceleration_mps2),
        ("start.curvature", problem.start_curvature.unwrap_or_default()),
        ("goal.x", goal.x),
        ("goal.y", goal.y),
        ("goal.yaw", goal.yaw),
    ];
    if let Some(&(field, value)) = states.iter().find(|(_, value)| !value.is_finite()) {
        return Err(PlanError::Input { field, value, wanted: "a finite number" });
    }
    let headings = [("start.yaw", start.yaw), ("goal.yaw", goal.yaw)];
    if let Some(&(field, value)) = headings.iter().find(|(_, value)| value.abs() > MAX_HEADING_RAD) {
        return Err(PlanError::Input { field, value, wanted: "in radians, within 1000 of 0" });
    }
    let limits = [
        ("limits.max_speed_forward", limits.max_speed_forward_mps),
        ("limits.max_speed_reverse", limits.max_speed_reverse_mps),
        ("limits.max_acceleration", limits.max_acceleration_mps2),
        ("limits.max_jerk", limits.max_jerk_mps3),
        ("limits.max_steer_rate", limits.max_steer_rate_rps),
    ];
    // Written so that not-a-number fails.
    match limits.iter().find(|(_, value)| !(*value >= Limits::SMALLEST && value.is_finite())) {
        Some(&(field, value)) => Err(PlanError::Input { field, value, wanted: "at least 0.01" }),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests;
