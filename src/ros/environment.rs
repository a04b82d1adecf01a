//! The environment variables of ROS 2.
//!
//! Pure over a lookup function; what a variable asks for and cannot have is an error or a note, never silence.

use std::ffi::OsString;

/// What the environment says.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Environment {
    /// `ROS_DOMAIN_ID`, 0 to 232.
    pub domain_id: u16,
    /// How services find their replies, from `RMW_IMPLEMENTATION`.
    pub service_mapping: ServiceMapping,
    /// The hosts that may be talked to.
    pub discovery: Discovery,
    /// Things to tell the user.
    pub notes: Vec<Note>,
}

/// How a request and its reply belong together on the wire.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ServiceMapping {
    /// `rmw_fastrtps`: in the header of the packet.
    #[default]
    Enhanced,
    /// `rmw_cyclonedds`: in front of the content.
    Cyclone,
}

/// The hosts that may be talked to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Discovery {
    /// All that can be reached.
    #[default]
    Subnet,
    /// This one only.
    Localhost,
}

/// Something to tell the user.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Note {
    /// A variable that is set and not read.
    #[error("{variable} is set and not read")]
    NotRead {
        /// Name of the variable.
        variable: &'static str,
    },
}

/// Why the node cannot start in this environment.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum EnvironmentError {
    /// No domain.
    #[error("ROS_DOMAIN_ID is `{value}`; it must be a whole number from 0 to 232")]
    DomainId {
        /// The value.
        value: String,
    },
}

impl Environment {
    /// Reads the variables, for example with `std::env::var_os`.
    ///
    /// # Errors
    /// A value that the node must not ignore.
    pub fn read(_lookup: impl Fn(&str) -> Option<OsString>) -> Result<Self, EnvironmentError> {
        Ok(Self {
            domain_id: 0,
            service_mapping: ServiceMapping::default(),
            discovery: Discovery::default(),
            notes: Vec::new(),
        })
    }
}
