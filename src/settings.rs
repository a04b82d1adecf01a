//! Parameters of the program: from files and the command line to one checked [`Settings`].
//!
//! The parameter structs (here and in `selection::parameters`) are the single source; the table made from their
//! schemas gives every check its type, range and choices. Sources are applied in order, the last assignment of a
//! name wins. Nothing is accepted by halves: all problems of all sources are collected and returned together, each
//! with its place, what would be right and the nearest valid name, and a change at run time is checked as a whole.
//! Unlike rclcpp, which ignores names that nobody declared, an unknown name in a block for this node is a problem:
//! a misspelled safety limit must not go unnoticed. Only where files are shared with other nodes
//! ([`Settings::load_shared`]) names that clearly belong to them pass.

mod draft;
mod file;
pub mod generate;
mod group;
pub(crate) mod nearest;
mod node;
mod open_space;
mod problem;
mod table;
mod value;
mod vehicle;
pub(crate) mod yaml;

pub use node::{AutowareInterface, NodeParameters, SelectorParameters};
pub use open_space::{OpenSpaceGroup, OpenSpaceSettings};
pub(crate) use problem::write_hints;
pub use problem::{Location, Position, Problem, ProblemKind, SettingsError, Undeclared, Warning};
pub use table::{Bound, Component, ParameterDescriptor, parameter_table};
pub use value::{ParameterKind, ParameterValue};
pub use vehicle::VehicleInfoParameters;

use std::path::PathBuf;

use selection::parameters::{ConcatenatorParameters, RankerParameters, ValidatorParameters};
use sha2::{Digest as _, Sha256};

use draft::{Draft, default_values};
use file::Target;

/// Name of the node where nothing else is said.
pub const DEFAULT_NODE_NAME: &str = "/trajectory_selector_node";

/// Where parameters come from. Sources are applied in the order they are given.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Source {
    /// A parameter file in the form of ROS 2.
    File(PathBuf),
    /// The text of such a file.
    Text {
        /// What it is called in messages.
        origin: String,
        /// The text.
        text: String,
    },
    /// One parameter, as in `-p name:=value`.
    Override {
        /// Name of the parameter.
        name: String,
        /// Value in YAML.
        value: String,
        /// What it is called in messages.
        origin: String,
    },
}

/// All effective parameters, checked. Immutable: a change makes a new one.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// What every ROS 2 node has.
    pub node: NodeParameters,
    /// The selector.
    pub selector: SelectorParameters,
    /// The concatenator.
    pub concatenator: ConcatenatorParameters,
    /// The validator and its filters.
    pub validator: ValidatorParameters,
    /// The ranker.
    pub ranker: RankerParameters,
    /// Planning in open space.
    pub open_space: OpenSpaceGroup,
    /// The vehicle.
    pub vehicle: VehicleInfoParameters,
    values: Vec<ParameterValue>,
    warnings: Vec<Warning>,
}

impl Settings {
    /// Defaults overlaid with the sources, for the node with this fully qualified name (after remapping).
    ///
    /// # Errors
    /// Everything that is wrong in any source, and every broken rule between parameters.
    pub fn load(node: &str, sources: &[Source]) -> Result<Self, SettingsError> {
        let (draft, loaded) = Draft::load(Target::Node(node), sources);
        draft.finish().map(|settings| settings.warned(loaded))
    }

    /// As [`Settings::load`], for a node in a system where parameters are handed to many nodes at once: names that are
    /// neither in a group of ours nor spelled like one of ours belong to other nodes; they are returned, each once.
    ///
    /// # Errors
    /// As [`Settings::load`].
    pub fn load_shared(node: &str, sources: &[Source]) -> Result<(Self, Vec<Undeclared>), SettingsError> {
        let (mut draft, loaded) = Draft::load(Target::Node(node), sources);
        let undeclared = draft.take_undeclared();
        draft.finish().map(|settings| (settings.warned(loaded), undeclared))
    }

    /// With the warnings of the sources before its own.
    fn warned(mut self, loaded: Vec<Option<Warning>>) -> Self {
        self.warnings.splice(0..0, loaded.into_iter().flatten());
        self
    }

    /// Everything that is wrong in the sources, for a node with the last part of this name in whatever namespace.
    /// A file without a block for it is a problem here: it would do nothing.
    #[must_use]
    pub fn check(node: &str, sources: &[Source]) -> Vec<Problem> {
        let (mut draft, loaded) = Draft::load(Target::AnyNamespace(node), sources);
        for (source, warning) in loaded.into_iter().enumerate() {
            if let Some(Warning::NoBlockForNode { origin, node, found }) = warning {
                let location = Location { source, origin, position: Some(Position::START) };
                draft.problems.push(Problem::at(location, ProblemKind::NoBlockForNode { node, found }));
            }
        }
        draft.finish().map_or_else(|error| error.problems, |_| Vec::new())
    }

    /// These settings with some parameters changed, checked as a whole.
    ///
    /// # Errors
    /// Everything that is wrong with the changes; read-only parameters cannot be changed (setting the same value
    /// again is no change), nor can qualities of service.
    pub fn with_changes(&self, changes: &[(String, ParameterValue)]) -> Result<Self, SettingsError> {
        let mut draft = Draft::new(self.values.clone());
        for (name, value) in changes {
            if name.starts_with(draft::FOREIGN_PREFIX) {
                draft.problem(None, name, ProblemKind::ReadOnly);
            }
            let before = table::find(name).map(|index| (index, draft.values[index].clone()));
            draft.assign(name, value.clone(), None);
            if let Some((index, before)) = before
                && parameter_table()[index].read_only
                && draft.values[index] != before
            {
                draft.problem(None, name, ProblemKind::ReadOnly);
            }
        }
        let mut settings = draft.finish()?;
        // Who gave the dimensions of the vehicle does not change at run time.
        settings.warnings.retain(|w| !matches!(w, Warning::VehicleDimensionsAssumed { .. }));
        Ok(settings)
    }

    /// Value of a parameter: not set for a class of objects whose group's base value holds. `None` for a name that
    /// is no parameter.
    #[must_use]
    pub fn get(&self, name: &str) -> Option<&ParameterValue> {
        self.find(name).map(|(_, value)| value)
    }

    /// A parameter and its value; a group of values per class stands for its base value.
    pub(crate) fn find(&self, name: &str) -> Option<(&'static ParameterDescriptor, &ParameterValue)> {
        table::find(name).map(|index| (&parameter_table()[index], &self.values[index]))
    }

    /// All parameters with their values, in the order of the table.
    pub fn iter(&self) -> impl Iterator<Item = (&'static ParameterDescriptor, &ParameterValue)> {
        parameter_table().iter().zip(&self.values)
    }

    /// What the user should know although the parameters are accepted.
    #[must_use]
    pub fn warnings(&self) -> &[Warning] {
        &self.warnings
    }

    /// SHA-256, in hexadecimal, over all effective parameters: lines `name=value` sorted by name, numbers in their
    /// shortest form that reads back equal.
    #[must_use]
    pub fn settings_hash(&self) -> String {
        let mut lines: Vec<_> = self.iter().map(|(d, value)| format!("{}={value}\n", d.name)).collect();
        lines.sort_unstable();
        let digest = Sha256::digest(lines.concat());
        digest.iter().map(|byte| format!("{byte:02x}")).collect()
    }
}

impl Default for Settings {
    /// The shipped configuration. The property that it breaks no rule is tested.
    fn default() -> Self {
        Self {
            node: NodeParameters::default(),
            selector: SelectorParameters::default(),
            concatenator: ConcatenatorParameters::default(),
            validator: ValidatorParameters::default(),
            ranker: RankerParameters::default(),
            open_space: OpenSpaceGroup::default(),
            vehicle: VehicleInfoParameters::default(),
            values: default_values(),
            warnings: Vec::new(),
        }
    }
}
