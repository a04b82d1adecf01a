//! A failure as the user and scripts see it: a stable code, a text, a place, an exit code.

use crate::bag::BagError;
use crate::drive::DriveError;
use crate::parking_scene::SceneError;
use crate::ros::environment::EnvironmentError;
use crate::ros::graph::{GraphError, WriteError};
use crate::ros::names::NameError;
use crate::ros::node::NodeError;
use crate::settings::SettingsError;
use lanelet_map::MapError;
use selection::validator::UnknownFilter;
use selector_actors::SystemError;
use serde::Serialize;
use std::fmt;

/// The command could not do its work.
const FAILED: u8 = 1;
/// The command line or the settings are wrong.
const USAGE: u8 = 2;
/// The command did its work, and the result is not what was required.
const REQUIREMENT: u8 = 3;

/// What went wrong, or is odd.
#[derive(Debug, Clone, Serialize)]
pub struct Failure {
    /// Stable name for scripts.
    pub code: &'static str,
    /// What happened and what the user can do.
    pub message: String,
    /// File, topic or parameter; null where the message says it all.
    #[serde(rename = "where")]
    pub place: Option<String>,
    /// Exit code that it leads to, if it is an error.
    #[serde(skip)]
    pub exit_code: u8,
}

impl Failure {
    fn new(code: &'static str, exit_code: u8, message: impl fmt::Display) -> Self {
        Self { code, message: message.to_string(), place: None, exit_code }
    }

    /// Wrong usage.
    #[must_use]
    pub fn usage(message: String) -> Self {
        Self::new("usage", USAGE, message)
    }

    /// Wrong settings or files.
    #[must_use]
    pub fn settings(message: String) -> Self {
        Self::new("settings", USAGE, message)
    }

    /// Nothing can be written there.
    #[must_use]
    pub fn output(message: String) -> Self {
        Self::new("output", FAILED, message)
    }

    /// The machine does not give what is needed, or a defect of the program.
    #[must_use]
    pub fn internal(message: String) -> Self {
        Self::new("internal", FAILED, message)
    }

    /// Nothing that came in can be decoded.
    #[must_use]
    pub fn malformed(message: String) -> Self {
        Self::new("malformed_message", FAILED, message)
    }

    /// The work is done, the result is not what was required.
    #[must_use]
    pub fn requirement(message: String) -> Self {
        Self::new("requirement", REQUIREMENT, message)
    }

    /// A scene that cannot be planned.
    #[must_use]
    pub fn no_plan(reason: &str) -> Self {
        Self::new("no_plan", FAILED, reason)
    }

    /// Something odd that does not stop anything.
    #[must_use]
    pub fn note(code: &'static str, message: String) -> Self {
        Self::new(code, 0, message)
    }

    /// The same with its place.
    #[must_use]
    pub fn at(mut self, place: impl fmt::Display) -> Self {
        self.place = Some(place.to_string());
        self
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let severity = if self.exit_code == 0 { "warning" } else { "error" };
        write!(f, "{severity}: {}", self.message)
    }
}

impl From<BagError> for Failure {
    fn from(error: BagError) -> Self {
        let code = match &error {
            BagError::NotFound { .. } => "not_found",
            BagError::Truncated { .. } => "truncated",
            BagError::NotABag { .. } | BagError::NoBagInFolder { .. } | BagError::Empty { .. } => "no_bag",
            BagError::Create { .. } | BagError::IsFolder { .. } | BagError::Write { .. } => "output",
            _ => "bag",
        };
        Self::new(code, FAILED, error)
    }
}

impl From<DriveError> for Failure {
    fn from(error: DriveError) -> Self {
        match error {
            DriveError::Bag(error) => error.into(),
            DriveError::NoMap { .. } => Self::new("no_map", USAGE, error),
            DriveError::WrongType { .. } | DriveError::NotCdr { .. } => {
                Self::new("wrong_type", FAILED, error)
            }
            DriveError::NoInputs { .. } => Self::new("no_inputs", FAILED, error),
        }
    }
}

impl From<SettingsError> for Failure {
    fn from(error: SettingsError) -> Self {
        Self::settings(error.to_string())
    }
}

impl From<NameError> for Failure {
    fn from(error: NameError) -> Self {
        Self::usage(error.to_string())
    }
}

impl From<EnvironmentError> for Failure {
    fn from(error: EnvironmentError) -> Self {
        Self::new("environment", USAGE, error)
    }
}

impl From<NodeError> for Failure {
    fn from(error: NodeError) -> Self {
        match error {
            NodeError::Graph(error) => Self::new("graph", FAILED, error),
            NodeError::Vehicle(error) => error.into(),
            NodeError::Filter(error) => error.into(),
            NodeError::System(error) => error.into(),
            NodeError::Dead | NodeError::Estranged { .. } => Self::internal(error.to_string()),
        }
    }
}

impl From<GraphError> for Failure {
    fn from(error: GraphError) -> Self {
        NodeError::from(error).into()
    }
}

impl From<WriteError> for Failure {
    fn from(error: WriteError) -> Self {
        Self::internal(error.to_string())
    }
}

impl From<motion::VehicleError> for Failure {
    fn from(error: motion::VehicleError) -> Self {
        Self::settings(error.to_string())
    }
}

impl From<UnknownFilter> for Failure {
    fn from(error: UnknownFilter) -> Self {
        Self::settings(error.to_string()).at("filter_names")
    }
}

impl From<SceneError> for Failure {
    fn from(error: SceneError) -> Self {
        Self::new("scene", USAGE, error)
    }
}

impl From<MapError> for Failure {
    fn from(error: MapError) -> Self {
        Self::new("map", FAILED, error)
    }
}

impl From<super::verify::VerifyError> for Failure {
    fn from(error: super::verify::VerifyError) -> Self {
        Self::new("scenes", FAILED, error)
    }
}

impl From<SystemError> for Failure {
    fn from(error: SystemError) -> Self {
        let code = match error {
            SystemError::Parameters(_) => return Self::settings(error.to_string()),
            SystemError::Sink(_) => "output",
            SystemError::NoThread(_) | SystemError::ActorGone(_) => "internal",
        };
        Self::new(code, FAILED, error)
    }
}
