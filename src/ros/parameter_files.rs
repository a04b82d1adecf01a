//! The settings of a node at start: shipped defaults, then `--params-file` and `-p` in command-line order.
//!
//! Whatever comes later wins, also over blocks that name the node exactly. Everything that is wrong is reported at
//! once, with file, line and column. Launch files hand the parameters of a whole system to every node, so names that
//! clearly belong to other nodes pass; a name that is spelled like one of ours, or lies in a group of ours, does not:
//! it may be a safety limit that would otherwise keep its default unnoticed.

use super::arguments::ParameterArgument;
use super::names::Names;
use crate::settings::{Settings, SettingsError, Source, Undeclared};

/// What the command line says about the node's parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct StartParameters {
    /// All effective parameters, checked.
    pub settings: Settings,
    /// Parameters of other nodes, each once: ignored, worth one line at debug level.
    pub undeclared: Vec<Undeclared>,
}

/// Loads and checks everything. Values with a node prefix are for the node of that name in whatever namespace.
///
/// # Errors
/// All problems of all files and values, each with its place.
pub fn load(names: &Names, arguments: &[ParameterArgument]) -> Result<StartParameters, SettingsError> {
    let sources: Vec<Source> = arguments.iter().filter_map(|argument| source(names, argument)).collect();
    let (settings, undeclared) = Settings::load_shared(names.fully_qualified(), &sources)?;
    Ok(StartParameters { settings, undeclared })
}

/// The argument as a source of settings, unless it is for another node.
fn source(names: &Names, argument: &ParameterArgument) -> Option<Source> {
    match argument {
        ParameterArgument::File(path) => Some(Source::File(path.clone())),
        ParameterArgument::Value { node, name, value } => {
            let prefix = node.as_ref().map(|node| format!("{node}:")).unwrap_or_default();
            node.as_deref().is_none_or(|node| node == names.name()).then(|| Source::Override {
                name: name.clone(),
                value: value.clone(),
                origin: format!("-p {prefix}{name}:={value}"),
            })
        }
    }
}

#[cfg(test)]
mod tests;
