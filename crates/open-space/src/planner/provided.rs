//! The planner as the provider's optimizer knows it.

use super::{PlanError, Planner, Supervisor};
use crate::interruption::{Interruption, Watch};
use crate::problem::Problem;
use crate::provider::{PlanFailure, ProblemPlanner};
use crate::trajectory::Trajectory;

/// Asks nothing but the watch.
struct Watched<'a>(&'a Watch);

impl Supervisor for Watched<'_> {
    fn interruption(&mut self) -> Option<Interruption> {
        (self.0)()
    }

    fn watch(&self) -> Option<Watch> {
        Some(self.0.clone())
    }
}

impl ProblemPlanner for Planner {
    fn plan(&mut self, problem: &Problem, watch: &Watch) -> Result<Trajectory, PlanFailure> {
        let plan = Self::plan(self, problem, &mut Watched(watch))?;
        Ok(plan.trajectory)
    }
}

impl From<PlanError> for PlanFailure {
    fn from(error: PlanError) -> Self {
        let why = error.to_string();
        match error {
            PlanError::Input { field, .. } => {
                Self::InputNotReady { field, fault: "is not a number that it may be" }
            }
            PlanError::Obstacles(_) | PlanError::Search(_) | PlanError::BlockedAhead { .. } => {
                Self::Search { why }
            }
            PlanError::RollingAgainstGear { .. } | PlanError::Speed(_) => Self::Smoothing { why },
            PlanError::Invalid(_) => Self::Refused { why },
            PlanError::Cancelled => Self::Cancelled,
        }
    }
}
