//! ROS arguments, as `rcl` takes them: everything between `--ros-args` and `--` (or the end) of a command line.
//!
//! Promises one typed value for all blocks together, in command-line order, and the arguments outside the blocks
//! untouched. Anything that is no ROS argument inside a block is an error that names the argument.

mod rules;

use std::ffi::{OsStr, OsString};
use std::path::PathBuf;

use super::logging::Severity;
use super::names::NameFault;

/// Begins a block of ROS arguments.
const BEGIN: &str = "--ros-args";
/// Ends a block.
const END: &str = "--";

/// A command line taken apart.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct CommandLine {
    /// The arguments outside the blocks, the name of the program included, in their order.
    pub program: Vec<OsString>,
    /// The arguments inside the blocks; `None` when there is no block.
    pub ros: Option<RosArguments>,
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

impl RemapRule {
    /// True when the rule is for the node with this name, or for all.
    #[must_use]
    pub fn is_for(&self, node_name: &str) -> bool {
        self.node.as_deref().is_none_or(|node| node == node_name)
    }
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
    /// A flag at the end of the command line that needs something behind it.
    #[error("`{flag}` needs {wanted} behind it")]
    MissingValue {
        /// The flag.
        flag: &'static str,
        /// What it needs.
        wanted: &'static str,
    },
    /// Bytes that are no text.
    #[error("`{flag} {argument}` is not valid UTF-8")]
    NotText {
        /// The flag.
        flag: &'static str,
        /// What can be read of the argument.
        argument: String,
    },
    /// A rule without its middle.
    #[error("`{flag} {argument}` has no `:=`; write {wanted}")]
    NoAssignment {
        /// The flag.
        flag: &'static str,
        /// The argument.
        argument: String,
        /// The form of the argument.
        wanted: &'static str,
    },
    /// Nothing where something must stand.
    #[error("`{flag} {argument}` has nothing {side} `:=`")]
    EmptySide {
        /// The flag.
        flag: &'static str,
        /// The argument.
        argument: String,
        /// Which side.
        side: &'static str,
    },
    /// A name in a rule that ROS does not allow.
    #[error("`{flag} {argument}`: `{name}` {fault}")]
    BadName {
        /// The flag.
        flag: &'static str,
        /// The argument.
        argument: String,
        /// The name.
        name: String,
        /// What is wrong with it.
        fault: NameFault,
    },
    /// Wildcards and back references, which the design of ROS has and no implementation takes.
    #[error("`{flag} {argument}`: `{sign}` is not supported in remap rules")]
    Wildcard {
        /// The flag.
        flag: &'static str,
        /// The argument.
        argument: String,
        /// The wildcard or back reference.
        sign: char,
    },
    /// A level that does not exist.
    #[error("`{flag} {argument}`: `{level}` is no level; one of debug, info, warn, error, fatal, unset")]
    BadLevel {
        /// The flag.
        flag: &'static str,
        /// The argument.
        argument: String,
        /// The level.
        level: String,
    },
}

/// Takes a command line apart. The first argument is the name of the program.
///
/// # Errors
/// The first ROS argument that is wrong.
pub fn parse(arguments: impl IntoIterator<Item = OsString>) -> Result<CommandLine, ArgumentError> {
    let mut line = CommandLine::default();
    let mut arguments = arguments.into_iter();
    let mut inside = false;
    while let Some(argument) = arguments.next() {
        if argument == BEGIN {
            inside = true;
            line.ros.get_or_insert_default();
        } else if !inside {
            line.program.push(argument);
        } else if argument == END {
            inside = false;
        } else {
            line.ros.get_or_insert_default().take(&argument, &mut arguments)?;
        }
    }
    Ok(line)
}

impl RosArguments {
    /// One flag, with what belongs to it.
    fn take(&mut self, flag: &OsStr, rest: &mut impl Iterator<Item = OsString>) -> Result<(), ArgumentError> {
        let unknown = || ArgumentError::Unknown { argument: flag.to_string_lossy().into_owned() };
        match flag.to_str().ok_or_else(unknown)? {
            "-r" => self.remaps.push(rules::remap("-r", &text("-r", rules::REMAP, rest)?)?),
            "--remap" => self.remaps.push(rules::remap("--remap", &text("--remap", rules::REMAP, rest)?)?),
            "-p" => self.parameters.push(rules::parameter("-p", &text("-p", rules::PARAMETER, rest)?)?),
            "--param" => {
                let rule = text("--param", rules::PARAMETER, rest)?;
                self.parameters.push(rules::parameter("--param", &rule)?);
            }
            "--params-file" => {
                let file = value("--params-file", "a file", rest)?;
                self.parameters.push(ParameterArgument::File(file.into()));
            }
            "--log-level" => {
                let rule = text("--log-level", rules::LOG_LEVEL, rest)?;
                self.log_levels.push(rules::log_level("--log-level", &rule)?);
            }
            "--enable-rosout-logs" => self.rosout_logs = Some(true),
            "--disable-rosout-logs" => self.rosout_logs = Some(false),
            "--enable-stdout-logs" => self.stdout_logs = Some(true),
            "--disable-stdout-logs" => self.stdout_logs = Some(false),
            flag @ ("--enable-external-lib-logs" | "--disable-external-lib-logs") => {
                self.ignored.push(flag.to_owned());
            }
            "--log-config-file" => self.ignore("--log-config-file", "a file", rest)?,
            "--log-file-name" => self.ignore("--log-file-name", "the beginning of a file name", rest)?,
            "-e" => self.ignore("-e", "an enclave", rest)?,
            "--enclave" => self.ignore("--enclave", "an enclave", rest)?,
            _ => return Err(unknown()),
        }
        Ok(())
    }

    fn ignore(
        &mut self,
        flag: &'static str,
        wanted: &'static str,
        rest: &mut impl Iterator<Item = OsString>,
    ) -> Result<(), ArgumentError> {
        let value = value(flag, wanted, rest)?;
        self.ignored.push(format!("{flag} {}", value.to_string_lossy()));
        Ok(())
    }
}

/// The argument behind a flag.
fn value(
    flag: &'static str,
    wanted: &'static str,
    rest: &mut impl Iterator<Item = OsString>,
) -> Result<OsString, ArgumentError> {
    rest.next().ok_or(ArgumentError::MissingValue { flag, wanted })
}

/// The argument behind a flag, as text.
fn text(
    flag: &'static str,
    wanted: &'static str,
    rest: &mut impl Iterator<Item = OsString>,
) -> Result<String, ArgumentError> {
    value(flag, wanted, rest)?.into_string().map_err(|argument| ArgumentError::NotText {
        flag,
        argument: argument.to_string_lossy().into_owned(),
    })
}

#[cfg(test)]
mod tests;
