//! How a cycle of the provider ended: a code, and the texts that upstream's log readers know.

use super::planning::{PlanFailure, WorkerNotStarted};

/// How a cycle ended.
#[derive(Clone, Debug, PartialEq)]
pub enum Status {
    /// A plan was loaded, or the vehicle is held for a check.
    Done,
    /// Planning has ended; the vehicle is held.
    ParkingFinished,
    /// The vehicle has just arrived; it is held.
    NearDestination,
    /// The previous result is used while the next is planned.
    Waiting,
    /// Nothing is planned yet; the vehicle is held.
    StopUnfinished,
    /// There was nothing to plan.
    Skipped,
    /// Planning keeps failing; the vehicle is held.
    TooManyFailures {
        /// Failures since the last good plan.
        count: u32,
        /// Time since the first of them, s.
        lasting_s: f64,
        /// The last one.
        last: PlanFailure,
    },
    /// Planning in the cycle failed, or the cycle's inputs cannot be used.
    Failed(PlanFailure),
    /// There is nobody to plan; the vehicle is held.
    NoWorker(WorkerNotStarted),
}

/// Upstream's two codes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Code {
    /// All is well, though there may be no new plan.
    Ok,
    /// The stage must be given up.
    PlanningError,
}

impl Status {
    /// The code.
    #[must_use]
    pub fn code(&self) -> Code {
        match self {
            Self::TooManyFailures { .. } | Self::Failed(_) | Self::NoWorker(_) => Code::PlanningError,
            _ => Code::Ok,
        }
    }

    /// The text, as upstream gives it; empty when all is done.
    #[must_use]
    pub fn message(&self) -> String {
        let text = match self {
            Self::Done => "",
            Self::ParkingFinished => "Parking finished",
            Self::NearDestination => "Vehicle is near to destination",
            Self::Waiting => "Waiting for open_space_trajectory_optimizer in open_space_trajectory_provider",
            Self::StopUnfinished => "Stop due to computation not finished",
            Self::Skipped => "Planning init point is close to destination, skip new trajectory generation",
            Self::TooManyFailures { .. } => "open_space_optimizer failed too many times",
            Self::Failed(failure) => return failure.upstream_text(),
            Self::NoWorker(fault) => return fault.to_string(),
        };
        text.to_owned()
    }
}
