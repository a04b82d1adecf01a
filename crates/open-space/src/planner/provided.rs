//! The planner as the provider's optimizer knows it.

use super::{PlanError, Planner, Supervisor};
use crate::hybrid_a_star::Interruption;
use crate::problem::Problem;
use crate::provider::{PlanFailure, ProblemPlanner};
use crate::trajectory::Trajectory;

/// Asks nothing but whether planning was called off.
struct Cancellation<'a>(&'a dyn Fn() -> bool);

impl Supervisor for Cancellation<'_> {
    fn interruption(&mut self) -> Option<Interruption> {
        (self.0)().then_some(Interruption::Cancelled)
    }
}

impl ProblemPlanner for Planner {
    fn plan(&mut self, problem: &Problem, cancelled: &dyn Fn() -> bool) -> Result<Trajectory, PlanFailure> {
        let plan = Self::plan(self, problem, &mut Cancellation(cancelled))?;
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
            PlanError::Obstacles(_) | PlanError::Search(_) => Self::Search { why },
            PlanError::RollingAgainstGear { .. } | PlanError::Speed(_) => Self::Smoothing { why },
            PlanError::Invalid(_) => Self::Refused { why },
            PlanError::Cancelled => Self::Cancelled,
        }
    }
}
