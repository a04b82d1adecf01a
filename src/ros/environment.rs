//! The environment variables of ROS 2.
//!
//! Pure over a lookup function; what a variable asks for and cannot have is an error or a note, never silence.
//! An empty variable is one that is not set.

use std::ffi::OsString;
use std::fmt;

use super::logging::Severity;

/// Highest domain that leaves room for the ports of DDS.
const MAX_DOMAIN_ID: u16 = 232;

/// Releases of ROS 2 whose endpoint ids have 24 bytes; newer ones have 16.
const LONG_ID_RELEASES: [&str; 3] = ["foxy", "galactic", "humble"];

/// Whether the ids of this build are the long ones.
const HAS_LONG_IDS: bool = cfg!(feature = "humble");

/// Settings of other middlewares, which this one does not read.
const OTHER_MIDDLEWARE: [&str; 3] =
    ["CYCLONEDDS_URI", "FASTRTPS_DEFAULT_PROFILES_FILE", "FASTDDS_DEFAULT_PROFILES_FILE"];

/// What the environment says.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Environment {
    /// `ROS_DOMAIN_ID`, 0 to 232.
    pub domain_id: u16,
    /// How services find their replies, from `RMW_IMPLEMENTATION`.
    pub service_mapping: ServiceMapping,
    /// The hosts that may be talked to, from `ROS_LOCALHOST_ONLY` and `ROS_AUTOMATIC_DISCOVERY_RANGE`.
    pub discovery: Discovery,
    /// How log lines look on the console.
    pub console: Console,
    /// Things to tell the user, once, when logging is up.
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
    /// This one only: the node may use no network but 127.0.0.1.
    Localhost,
}

/// How log lines look on the console.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Console {
    /// `RCUTILS_CONSOLE_OUTPUT_FORMAT`; `None` is the form of ROS.
    pub format: Option<String>,
    /// `RCUTILS_COLORIZED_OUTPUT`, or no where `NO_COLOR` is set; `None` asks the terminal.
    pub coloured: Option<bool>,
    /// `RCUTILS_LOGGING_USE_STDOUT`: standard output instead of standard error.
    pub to_stdout: bool,
}

/// Something to tell the user.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Note {
    /// A middleware that this node does not know.
    #[error("RMW_IMPLEMENTATION is `{0}`: services are offered as rmw_fastrtps_cpp would")]
    UnknownMiddleware(String),
    /// A setting of another middleware.
    #[error(
        "{0} is set, but this node's middleware does not read it; name network addresses on the command line if it \
         selects an interface"
    )]
    OtherMiddleware(&'static str),
    /// Peers that will not be asked.
    #[error("ROS_STATIC_PEERS is ignored: this node finds others by multicast and on its own host")]
    StaticPeers,
    /// A switch with another value than 0 and 1.
    #[error("{variable} is `{value}`; it is taken as if it were not set, write 0 or 1")]
    NoSwitch {
        /// Name of the variable.
        variable: &'static str,
        /// Its value.
        value: String,
    },
    /// A range that ROS does not have.
    #[error(
        "ROS_AUTOMATIC_DISCOVERY_RANGE is `{0}`, which is none of SUBNET, LOCALHOST, OFF, SYSTEM_DEFAULT: LOCALHOST \
         is assumed"
    )]
    UnknownRange(String),
    /// `ROS_LOCALHOST_ONLY` beside a range that says otherwise.
    #[error("ROS_LOCALHOST_ONLY is 1: ROS_AUTOMATIC_DISCOVERY_RANGE is ignored")]
    RangeIgnored,
    /// A release of ROS with another length of ids.
    #[error(
        "ROS_DISTRO is `{0}`, whose endpoint ids have another length than this program's: `ros2 node` and `ros2 topic \
         info` of that release will not show this node properly; messages are not affected. Build the program with \
         {hint}", hint = if HAS_LONG_IDS { "default features" } else { "`--no-default-features --features humble`" }
    )]
    Release(String),
}

impl Note {
    /// How loud to tell it.
    #[must_use]
    pub fn severity(&self) -> Severity {
        match self {
            Self::OtherMiddleware(_) => Severity::Info,
            _ => Severity::Warn,
        }
    }
}

/// Why the node cannot start in this environment.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum EnvironmentError {
    /// No domain.
    #[error("ROS_DOMAIN_ID is `{0}`; it must be a whole number from 0 to {MAX_DOMAIN_ID}")]
    DomainId(String),
    /// No discovery at all.
    #[error(
        "ROS_AUTOMATIC_DISCOVERY_RANGE is OFF, which this node's middleware cannot do; set it to LOCALHOST to keep to \
         this host"
    )]
    DiscoveryOff,
}

impl Environment {
    /// Reads the variables, for example with `|name| std::env::var_os(name)`.
    ///
    /// # Errors
    /// A value that the node must not ignore.
    pub fn read(lookup: impl Fn(&str) -> Option<OsString>) -> Result<Self, EnvironmentError> {
        let variables = Variables(lookup);
        let mut notes = Vec::new();
        let domain_id = variables.text("ROS_DOMAIN_ID").map_or(Ok(0), |text| domain_id(&text))?;
        let service_mapping = service_mapping(variables.text("RMW_IMPLEMENTATION").as_deref(), &mut notes);
        let discovery = discovery(&variables, &mut notes)?;
        let console = Console {
            format: variables.text("RCUTILS_CONSOLE_OUTPUT_FORMAT"),
            coloured: variables
                .switch("RCUTILS_COLORIZED_OUTPUT", &mut notes)
                .or_else(|| variables.text("NO_COLOR").map(|_| false)),
            to_stdout: variables.switch("RCUTILS_LOGGING_USE_STDOUT", &mut notes).unwrap_or(false),
        };
        let set = |name: &&'static str| variables.text(name).is_some();
        notes.extend(set(&"ROS_STATIC_PEERS").then_some(Note::StaticPeers));
        notes.extend(OTHER_MIDDLEWARE.into_iter().filter(set).map(Note::OtherMiddleware));
        let is_other = |name: &String| LONG_ID_RELEASES.contains(&name.as_str()) != HAS_LONG_IDS;
        let release = variables.text("ROS_DISTRO").filter(is_other);
        notes.extend(release.map(Note::Release));
        Ok(Self { domain_id, service_mapping, discovery, console, notes })
    }
}

/// Variables with a value.
struct Variables<L>(L);

impl<L: Fn(&str) -> Option<OsString>> Variables<L> {
    /// The value; what is no text in it is replaced, and then fits nothing.
    fn text(&self, name: &str) -> Option<String> {
        let value = (self.0)(name)?;
        (!value.is_empty()).then(|| value.to_string_lossy().into_owned())
    }

    /// The value of a variable that may be 0 or 1.
    fn switch(&self, variable: &'static str, notes: &mut Vec<Note>) -> Option<bool> {
        match self.text(variable)?.as_str() {
            "0" => Some(false),
            "1" => Some(true),
            other => {
                notes.push(Note::NoSwitch { variable, value: other.to_owned() });
                None
            }
        }
    }
}

fn domain_id(text: &str) -> Result<u16, EnvironmentError> {
    let digits = text.bytes().all(|byte| byte.is_ascii_digit());
    text.parse()
        .ok()
        .filter(|id| digits && *id <= MAX_DOMAIN_ID)
        .ok_or_else(|| EnvironmentError::DomainId(text.to_owned()))
}

fn service_mapping(middleware: Option<&str>, notes: &mut Vec<Note>) -> ServiceMapping {
    match middleware {
        Some("rmw_cyclonedds_cpp") => ServiceMapping::Cyclone,
        None | Some("rmw_fastrtps_cpp" | "rmw_fastrtps_dynamic_cpp") => ServiceMapping::Enhanced,
        Some(other) => {
            notes.push(Note::UnknownMiddleware(other.to_owned()));
            ServiceMapping::Enhanced
        }
    }
}

fn discovery<L: Fn(&str) -> Option<OsString>>(
    variables: &Variables<L>,
    notes: &mut Vec<Note>,
) -> Result<Discovery, EnvironmentError> {
    let range = variables.text("ROS_AUTOMATIC_DISCOVERY_RANGE");
    if variables.switch("ROS_LOCALHOST_ONLY", notes) == Some(true) {
        notes.extend(range.filter(|range| range != "LOCALHOST").map(|_| Note::RangeIgnored));
        return Ok(Discovery::Localhost);
    }
    match range.as_deref() {
        None | Some("SUBNET" | "SYSTEM_DEFAULT") => Ok(Discovery::Subnet),
        Some("LOCALHOST") => Ok(Discovery::Localhost),
        Some("OFF") => Err(EnvironmentError::DiscoveryOff),
        // The narrower range: who mistypes it must not be heard further than wanted.
        Some(other) => {
            notes.push(Note::UnknownRange(other.to_owned()));
            Ok(Discovery::Localhost)
        }
    }
}

impl fmt::Display for ServiceMapping {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Enhanced => "rmw_fastrtps",
            Self::Cyclone => "rmw_cyclonedds",
        })
    }
}

impl fmt::Display for Discovery {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Subnet => "SUBNET",
            Self::Localhost => "LOCALHOST",
        })
    }
}

#[cfg(test)]
mod tests;
