//! Settings in the making: applies sources to values, collects every problem, builds the structs at the end.

use std::collections::HashSet;
use std::io::Read as _;
use std::path::Path;

use super::open_space::OpenSpaceSettings;
use selection::parameters::{FilterClass, ValidatorParameters};
use serde::de::DeserializeOwned;

use super::file::{self, Assignment, Target};
use super::group::Group;
use super::{
    Component, Location, ParameterDescriptor, ParameterKind, ParameterValue, Problem, ProblemKind, Settings,
    SettingsError, Source, Undeclared, Warning, parameter_table, table,
};

/// Largest parameter file that is read, in bytes.
const MAX_FILE_BYTES: u64 = 4 << 20;

/// Names that every node accepts and that are none of ours.
pub(super) const FOREIGN_PREFIX: &str = "qos_overrides.";

pub(super) fn default_values() -> Vec<ParameterValue> {
    parameter_table().iter().map(|d| d.default.clone()).collect()
}

/// Parameters in the making.
pub(super) struct Draft {
    /// In the order of the table.
    pub(super) values: Vec<ParameterValue>,
    /// Last place of every parameter that was given, by index.
    given: Vec<(usize, Option<Location>)>,
    pub(super) problems: Vec<Problem>,
}

impl Draft {
    /// Nothing given yet.
    pub(super) fn new(values: Vec<ParameterValue>) -> Self {
        Self { values, given: Vec::new(), problems: Vec::new() }
    }

    /// Applies the sources to the defaults. Returns beside it, for each source, whether it was of no use.
    pub(super) fn load(target: Target<'_>, sources: &[Source]) -> (Self, Vec<Option<Warning>>) {
        let mut draft = Self::new(default_values());
        let useless =
            sources.iter().enumerate().map(|(index, source)| draft.apply(index, source, target)).collect();
        (draft, useless)
    }

    fn apply(&mut self, index: usize, source: &Source, target: Target<'_>) -> Option<Warning> {
        match source {
            Source::File(path) => {
                let origin = path.display().to_string();
                match read_file(path) {
                    Ok(text) => self.apply_text(index, &origin, &text, target),
                    Err(kind) => {
                        let location = Location { source: index, origin, position: None };
                        self.problems.push(Problem::at(location, kind));
                        None
                    }
                }
            }
            Source::Text { origin, text } => self.apply_text(index, origin, text, target),
            Source::Override { name, value, origin } => {
                let location = Location { source: index, origin: origin.clone(), position: None };
                match file::read_value(value) {
                    Ok(value) => self.assign(name, value, Some(location)),
                    Err(kind) => self.problem(Some(location), name, kind),
                }
                None
            }
        }
    }

    fn apply_text(&mut self, source: usize, origin: &str, text: &str, target: Target<'_>) -> Option<Warning> {
        let content = file::read(text, source, origin, target);
        let useless = !content.matched && content.problems.is_empty();
        self.problems.extend(content.problems);
        for Assignment { name, value, location } in content.assignments {
            self.assign(&name, value, Some(location));
        }
        useless.then(|| Warning::NoBlockForNode {
            origin: origin.to_owned(),
            node: target.name().to_owned(),
            found: content.patterns.iter().map(|p| format!("`{p}`")).collect::<Vec<_>>().join(", "),
        })
    }

    pub(super) fn assign(&mut self, name: &str, value: ParameterValue, location: Option<Location>) {
        if name.starts_with(FOREIGN_PREFIX) {
            return;
        }
        let Some(index) = table::find(name) else {
            let members = table::group_members(name);
            let is_group = !members.is_empty();
            self.problems.push(Problem {
                location,
                key: Some(name.to_owned()),
                kind: if is_group { ProblemKind::IsAGroup } else { ProblemKind::Unknown },
                allowed: None,
                nearest: members.first().map(|n| (*n).to_owned()).or_else(|| table::nearest_name(name)),
            });
            return;
        };
        let descriptor = &parameter_table()[index];
        match descriptor.accept(value) {
            Ok(value) => {
                self.values[index] = value;
                self.given.push((index, location));
            }
            Err((kind, nearest)) => self.problems.push(Problem {
                location,
                key: Some(name.to_owned()),
                allowed: Some(allowed_instead(descriptor, &kind)),
                kind,
                nearest,
            }),
        }
    }

    /// Takes out the problems that are only names of other nodes: neither in a group of ours nor spelled like ours.
    pub(super) fn take_undeclared(&mut self) -> Vec<Undeclared> {
        let foreign = self.problems.extract_if(.., |problem| {
            let in_our_group = |name: &str| {
                name.split_once('.').is_some_and(|(group, _)| !table::group_members(group).is_empty())
            };
            problem.kind == ProblemKind::Unknown
                && problem.nearest.is_none()
                && !problem.key.as_deref().is_some_and(in_our_group)
        });
        let mut undeclared: Vec<Undeclared> = Vec::new();
        for Problem { key, location, .. } in foreign {
            let name = key.unwrap_or_default();
            if !undeclared.iter().any(|known| known.name == name) {
                undeclared.push(Undeclared { name, location });
            }
        }
        undeclared
    }

    pub(super) fn problem(&mut self, location: Option<Location>, name: &str, kind: ProblemKind) {
        let allowed = table::find(name).map(|index| parameter_table()[index].allowed());
        let allowed = allowed.filter(|_| !matches!(kind, ProblemKind::ReadOnly));
        self.problems.push(Problem { location, key: Some(name.to_owned()), kind, allowed, nearest: None });
    }

    fn location_of(&self, name: &str) -> Option<Location> {
        let index = table::find(name)?;
        self.given.iter().rev().find(|(given, _)| *given == index)?.1.clone()
    }

    /// The settings, if nothing is wrong.
    pub(super) fn finish(mut self) -> Result<Settings, SettingsError> {
        match self.build() {
            Ok(settings) => {
                self.check_rules(&settings);
                if self.problems.is_empty() {
                    return Ok(settings);
                }
            }
            Err(problem) => self.problems.push(*problem),
        }
        // Stable: problems of one place keep their order; those without a place come last.
        self.problems.sort_by_key(|problem| {
            problem.location.as_ref().map_or((usize::MAX, None), |l| (l.source, l.position))
        });
        Err(SettingsError { problems: self.problems })
    }

    fn build(&self) -> Result<Settings, Box<Problem>> {
        let mut settings = Settings {
            node: self.component(Component::Node)?,
            selector: self.component(Component::Selector)?,
            concatenator: self.component(Component::Concatenator)?,
            validator: self.component(Component::Validator)?,
            ranker: self.component(Component::Ranker)?,
            open_space: self.component::<OpenSpaceSettings>(Component::OpenSpace)?.open_space,
            vehicle: self.component(Component::VehicleInfo)?,
            values: self.values.clone(),
            warnings: Vec::new(),
        };
        settings.warnings = filter_warnings(&settings.validator);
        let without = settings.selector.sources().into_iter().filter(|row| row.source.is_none());
        settings.warnings.extend(without.map(|row| Warning::GeneratorWithoutSource { entry: row.prefix }));
        settings.warnings.extend(self.vehicle_warning());
        Ok(settings)
    }

    /// The struct of a component from its values.
    fn component<T: DeserializeOwned + Default>(&self, component: Component) -> Result<T, Box<Problem>> {
        let group = Group::of(component, &self.values);
        // Most components of most loads: there are hundreds of parameters.
        if group.is_as_shipped() {
            return Ok(T::default());
        }
        T::deserialize(group).map_err(|error| {
            Box::new(Problem {
                location: None,
                key: Some(component.name().to_owned()),
                kind: ProblemKind::Defect { reason: error.to_string() },
                allowed: None,
                nearest: None,
            })
        })
    }

    /// Rules between parameters, except where one of the parameters has a problem of its own already.
    fn check_rules(&mut self, settings: &Settings) {
        let faulty: HashSet<String> = self.problems.iter().filter_map(|p| p.key.clone()).collect();
        let violations = settings.validator.violations().into_iter().chain(settings.ranker.violations());
        for violation in violations {
            let names = [Some(violation.parameter()), violation.other_parameter()];
            if names.iter().flatten().any(|name| faulty.contains(*name)) {
                continue;
            }
            let location = names.iter().flatten().find_map(|name| self.location_of(name));
            self.problems.push(Problem {
                location,
                key: Some(violation.parameter().to_owned()),
                kind: violation.into(),
                allowed: None,
                nearest: None,
            });
        }
    }
}

impl Draft {
    /// Names the dimensions of the vehicle that no source gave.
    fn vehicle_warning(&self) -> Option<Warning> {
        let given = |index: usize| self.given.iter().any(|(other, _)| *other == index);
        let missing: Vec<_> = parameter_table()
            .iter()
            .enumerate()
            .filter(|(index, d)| d.component == Component::VehicleInfo && !given(*index))
            .map(|(_, d)| d.name.as_str())
            .collect();
        (!missing.is_empty()).then(|| Warning::VehicleDimensionsAssumed { names: missing.join(", ") })
    }
}

/// What would have been right; for a text in place of which a number was written, that quotes are needed.
fn allowed_instead(descriptor: &ParameterDescriptor, kind: &ProblemKind) -> String {
    let unquoted = descriptor.kind == ParameterKind::String
        && matches!(kind, ProblemKind::WrongType { given, .. } if !given.is_array());
    let allowed = descriptor.allowed();
    if unquoted {
        format!("{allowed}, written in quotes")
    } else if matches!(kind, ProblemKind::WrongType { .. }) && allowed != descriptor.kind.name() {
        format!("{}, {allowed}", descriptor.kind)
    } else {
        allowed
    }
}

fn filter_warnings(validator: &ValidatorParameters) -> Vec<Warning> {
    let count =
        |list: &[String], class: FilterClass| list.iter().filter(|name| *name == class.class_name()).count();
    let mut warnings = Vec::new();
    for class in FilterClass::ALL {
        let class_name = || class.class_name().to_owned();
        let enforced = count(&validator.filter_names, class);
        let shadow = count(&validator.shadow_mode_filter_names, class);
        if enforced > 0 && shadow > 0 {
            warnings.push(Warning::FilterInBothLists { class_name: class_name() });
        }
        for (count, list) in [(enforced, "filter_names"), (shadow, "shadow_mode_filter_names")] {
            if count > 1 {
                warnings.push(Warning::FilterRepeated { class_name: class_name(), list });
            }
        }
    }
    warnings
}

/// Text of a file, unless it is larger than any parameter file.
fn read_file(path: &Path) -> Result<String, ProblemKind> {
    let unreadable = |error: std::io::Error| ProblemKind::Unreadable { reason: error.to_string() };
    let file = std::fs::File::open(path).map_err(unreadable)?;
    let mut text = String::new();
    file.take(MAX_FILE_BYTES + 1).read_to_string(&mut text).map_err(unreadable)?;
    if text.len() as u64 > MAX_FILE_BYTES {
        return Err(ProblemKind::TooLarge { limit: MAX_FILE_BYTES });
    }
    Ok(text)
}
