//! What stands behind `-r`, `-p` and `--log-level`.

use super::{ArgumentError, LogLevel, NameScope, ParameterArgument, RemapKind, RemapRule};
use crate::ros::logging::Severity;
use crate::ros::names::{NameFault, check_namespace, check_node_name, check_rule_side, check_token};

/// Separates the sides of a rule.
const ASSIGNMENT: &str = ":=";

/// Form of remap rules.
pub(super) const REMAP: &str = "`[NODE:]FROM:=TO`";
/// Form of parameters.
pub(super) const PARAMETER: &str = "`[NODE:]NAME:=VALUE`";
/// Form of log levels.
pub(super) const LOG_LEVEL: &str = "`[LOGGER:=]LEVEL`";

const SCHEMES: [(&str, NameScope); 2] =
    [("rostopic://", NameScope::Topics), ("rosservice://", NameScope::Services)];

/// An argument and its flag, for messages.
#[derive(Clone, Copy)]
struct Rule<'a> {
    flag: &'static str,
    argument: &'a str,
}

impl<'a> Rule<'a> {
    fn argument(self) -> String {
        self.argument.to_owned()
    }

    /// The two sides, neither of them empty.
    fn sides(self, wanted: &'static str) -> Result<(&'a str, &'a str), ArgumentError> {
        let Some((left, right)) = self.argument.split_once(ASSIGNMENT) else {
            return Err(ArgumentError::NoAssignment { flag: self.flag, argument: self.argument(), wanted });
        };
        for (text, side) in [(left, "before"), (right, "behind")] {
            if text.is_empty() {
                return Err(ArgumentError::EmptySide { flag: self.flag, argument: self.argument(), side });
            }
        }
        Ok((left, right))
    }

    /// The node that the rule is for, and the rest of the left side.
    fn node(self, left: &'a str) -> Result<(Option<String>, &'a str), ArgumentError> {
        if SCHEMES.iter().any(|(scheme, _)| left.starts_with(scheme)) {
            return Ok((None, left));
        }
        match left.split_once(':') {
            Some((node, rest)) => {
                self.accept(node, check_node_name)?;
                Ok((Some(node.to_owned()), rest))
            }
            None => Ok((None, left)),
        }
    }

    fn accept(self, name: &str, check: fn(&str) -> Result<(), NameFault>) -> Result<(), ArgumentError> {
        check(name).map_err(|fault| ArgumentError::BadName {
            flag: self.flag,
            argument: self.argument(),
            name: name.to_owned(),
            fault,
        })
    }
}

/// `[NODE:]FROM:=TO`
pub(super) fn remap(flag: &'static str, argument: &str) -> Result<RemapRule, ArgumentError> {
    let rule = Rule { flag, argument };
    let (left, right) = rule.sides(REMAP)?;
    let (node, from) = rule.node(left)?;
    let kind = match from {
        "__node" | "__name" => {
            rule.accept(right, check_node_name)?;
            RemapKind::NodeName(right.to_owned())
        }
        "__ns" => {
            rule.accept(right, check_namespace)?;
            RemapKind::Namespace(right.to_owned())
        }
        _ => {
            let (scope, from) = SCHEMES
                .iter()
                .find_map(|(scheme, scope)| Some((*scope, from.strip_prefix(scheme)?)))
                .unwrap_or((NameScope::All, from));
            for (side, signs) in [(from, '*'), (right, '\\')] {
                if side.contains(signs) {
                    return Err(ArgumentError::Wildcard { flag, argument: rule.argument(), sign: signs });
                }
                rule.accept(side, check_rule_side)?;
            }
            RemapKind::Name { scope, from: from.to_owned(), to: right.to_owned() }
        }
    };
    Ok(RemapRule { node, kind, text: rule.argument() })
}

/// `[NODE:]NAME:=VALUE`
pub(super) fn parameter(flag: &'static str, argument: &str) -> Result<ParameterArgument, ArgumentError> {
    let rule = Rule { flag, argument };
    let (left, value) = rule.sides(PARAMETER)?;
    let (node, name) = rule.node(left)?;
    rule.accept(name, check_parameter_name)?;
    Ok(ParameterArgument::Value { node, name: name.to_owned(), value: value.to_owned() })
}

/// Words with dots between them; slashes are allowed, as names of topics are parts of some parameters' names
/// (`qos_overrides./topic.publisher.depth`).
fn check_parameter_name(name: &str) -> Result<(), NameFault> {
    if name.is_empty() {
        return Err(NameFault::Empty);
    }
    name.split('.').try_for_each(|part| match part.trim_matches('/') {
        "" => Err(NameFault::EmptyPart),
        words => words.split('/').filter(|word| !word.is_empty()).try_for_each(check_token),
    })
}

/// `[LOGGER:=]LEVEL`
pub(super) fn log_level(flag: &'static str, argument: &str) -> Result<LogLevel, ArgumentError> {
    let rule = Rule { flag, argument };
    let (logger, level) = if argument.contains(ASSIGNMENT) {
        let (logger, level) = rule.sides(LOG_LEVEL)?;
        (Some(logger.to_owned()), level)
    } else {
        (None, argument)
    };
    let level = match level.to_ascii_lowercase().as_str() {
        "unset" => None,
        "debug" => Some(Severity::Debug),
        "info" => Some(Severity::Info),
        "warn" => Some(Severity::Warn),
        "error" => Some(Severity::Error),
        "fatal" => Some(Severity::Fatal),
        _ => {
            let level = level.to_owned();
            return Err(ArgumentError::BadLevel { flag, argument: rule.argument(), level });
        }
    };
    Ok(LogLevel { logger, level })
}
