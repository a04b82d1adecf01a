//! What can be wrong with parameters, and where.

use std::fmt;

use selection::parameters::RuleViolation;
use thiserror::Error;

use super::value::ParameterKind;

/// A place in a text, counted from 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Position {
    /// Line.
    pub line: usize,
    /// Column, in characters.
    pub column: usize,
}

impl Position {
    /// Beginning of a text.
    pub const START: Self = Self { line: 1, column: 1 };
}

/// Where a parameter was given.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Location {
    /// Index of the source in the list that was loaded.
    pub source: usize,
    /// File name, or what stands for it (for example the command line argument).
    pub origin: String,
    /// Place in the file; none for sources without lines.
    pub position: Option<Position>,
}

impl fmt::Display for Location {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.origin)?;
        match self.position {
            Some(Position { line, column }) => write!(f, ":{line}:{column}"),
            None => Ok(()),
        }
    }
}

/// One thing that is wrong.
#[derive(Clone, Debug, PartialEq)]
pub struct Problem {
    /// Where it was given; none for a change at run time and for defaults.
    pub location: Option<Location>,
    /// Name of the parameter, or the key of the file, that it is about.
    pub key: Option<String>,
    /// What is wrong.
    pub kind: ProblemKind,
    /// What would be right: type, range or choices.
    pub allowed: Option<String>,
    /// The valid name or choice that is spelled most alike.
    pub nearest: Option<String>,
}

impl Problem {
    /// A problem about no particular parameter.
    pub(super) fn at(location: Location, kind: ProblemKind) -> Self {
        Self { location: Some(location), key: None, kind, allowed: None, nearest: None }
    }

    /// What is wrong, without the place.
    #[must_use]
    pub fn message(&self) -> String {
        match (&self.key, self.kind.names_its_key()) {
            (Some(key), false) => format!("`{key}` {}", self.kind),
            _ => self.kind.to_string(),
        }
    }
}

/// `place: message (allowed: .., did you mean ..?)`
impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(location) = &self.location {
            write!(f, "{location}: ")?;
        }
        f.write_str(&self.message())?;
        write_hints(f, self.allowed.as_deref(), self.nearest.as_deref())
    }
}

/// ` (allowed: ..; did you mean ..?)`, or nothing.
pub(crate) fn write_hints(
    f: &mut fmt::Formatter<'_>,
    allowed: Option<&str>,
    nearest: Option<&str>,
) -> fmt::Result {
    match (allowed, nearest) {
        (None, None) => Ok(()),
        (Some(allowed), None) => write!(f, " (allowed: {allowed})"),
        (None, Some(nearest)) => write!(f, " (did you mean `{nearest}`?)"),
        (Some(allowed), Some(nearest)) => write!(f, " (allowed: {allowed}; did you mean `{nearest}`?)"),
    }
}

/// Kinds of problems. The texts complete "`<key>` ...", except where they stand alone.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum ProblemKind {
    /// The file cannot be read.
    #[error("cannot be read: {reason}")]
    Unreadable {
        /// Text of the operating system.
        reason: String,
    },
    /// The file is larger than any parameter file.
    #[error("is larger than {limit} bytes: this is no parameter file")]
    TooLarge {
        /// The limit.
        limit: u64,
    },
    /// The document holds more values than any parameter file.
    #[error("the document holds more than {limit} values, with the copies that anchors and aliases make")]
    TooManyValues {
        /// The limit.
        limit: usize,
    },
    /// The text is no YAML.
    #[error("not valid YAML: {reason}")]
    Syntax {
        /// What the parser says.
        reason: String,
    },
    /// The file has no content.
    #[error("has no content; a parameter file begins with a node name, for example `/**:`")]
    NoContent,
    /// The file has more than one document.
    #[error("more than one YAML document in a file")]
    SeveralDocuments,
    /// A key is a list or a map.
    #[error("a key must be a plain text")]
    KeyNotText,
    /// A value that contradicts its tag, or a tag without meaning here.
    #[error("`{text}` cannot have the tag `!!{tag}`")]
    TagMismatch {
        /// The tag without `!!`.
        tag: String,
        /// The scalar.
        text: String,
    },
    /// A value stands where a node name or `ros__parameters` is expected.
    #[error("must be a node name above `ros__parameters:`, or a namespace above node names")]
    NoParameterBlock,
    /// `ros__parameters` is not a map.
    #[error("must be a map of parameter names to values")]
    NotAMap,
    /// A `*` in a node pattern that is not a whole name.
    #[error("is no node name pattern: `*` and `**` stand for whole names between slashes")]
    BadPattern,
    /// No block of the file is for this node.
    #[error("no block for the node `{node}`; the file has blocks for {found}")]
    NoBlockForNode {
        /// Name of the node.
        node: String,
        /// The patterns of the file.
        found: String,
    },
    /// The same name twice in one block or map.
    #[error("is given twice; first in line {first_line}, again in line {line}")]
    Duplicate {
        /// Line of the first.
        first_line: usize,
        /// Line of the second.
        line: usize,
    },
    /// A list of values of different types.
    #[error("is a list of values of different types")]
    MixedList,
    /// A list with an entry that is no single value.
    #[error("is a list with an entry that is not a single value")]
    NestedList,
    /// A name without a value.
    #[error("has no value")]
    NoValue,
    /// Nothing declares this name.
    #[error("is no parameter of this node")]
    Unknown,
    /// A value is given where a group of parameters is declared.
    #[error("is a group of parameters and has no value of its own")]
    IsAGroup,
    /// The value has another type than the parameter.
    #[error(
        "Wrong parameter type, parameter {{{name}}} is of type {{{declared}}}, setting it to {{{given}}} is not allowed."
    )]
    WrongType {
        /// The parameter.
        name: String,
        /// Its type.
        declared: ParameterKind,
        /// Type of the value.
        given: ParameterKind,
    },
    /// NaN or an infinity.
    #[error("is {value}, which is not a finite number")]
    NotFinite {
        /// The value as text.
        value: String,
    },
    /// A number outside the range.
    #[error("is {value}, outside its range")]
    OutOfRange {
        /// The value as text.
        value: String,
    },
    /// A text that is none of the choices.
    #[error("names `{value}`, which does not exist")]
    NotAChoice {
        /// The text.
        value: String,
    },
    /// A list of the wrong length.
    #[error("has {length} entries")]
    WrongLength {
        /// Its length.
        length: usize,
    },
    /// A change at run time of a parameter that is fixed at start.
    #[error("is read-only: it is fixed at start")]
    ReadOnly,
    /// A rule between parameters is broken.
    #[error(transparent)]
    Rule(#[from] RuleViolation),
    /// The checks let a value pass that the parameter structs refuse: a defect of this program.
    #[error(
        "passed all checks but does not fit the program's structures ({reason}); please report this defect"
    )]
    Defect {
        /// Why the structs refuse.
        reason: String,
    },
}

impl ProblemKind {
    /// Texts that name their parameter or stand alone.
    fn names_its_key(&self) -> bool {
        matches!(
            self,
            Self::WrongType { .. }
                | Self::Syntax { .. }
                | Self::TooManyValues { .. }
                | Self::SeveralDocuments
                | Self::KeyNotText
                | Self::TagMismatch { .. }
                | Self::NoBlockForNode { .. }
        )
    }
}

/// Why parameters are refused: everything that is wrong, at once.
#[derive(Clone, Debug, PartialEq, Error)]
pub struct SettingsError {
    /// All problems, in the order of the sources and lines. Never empty.
    pub problems: Vec<Problem>,
}

impl fmt::Display for SettingsError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.problems.len() {
            1 => f.write_str("1 problem with the parameters:")?,
            n => write!(f, "{n} problems with the parameters:")?,
        }
        self.problems.iter().try_for_each(|problem| write!(f, "\n  {problem}"))
    }
}

/// A parameter of another node that this one was given too.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Undeclared {
    /// Name of the parameter.
    pub name: String,
    /// Where it was given first.
    pub location: Option<Location>,
}

/// `place: name`
impl fmt::Display for Undeclared {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.location {
            Some(location) => write!(f, "{location}: `{}`", self.name),
            None => write!(f, "`{}`", self.name),
        }
    }
}

/// Something to tell the user that does not prevent a start.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum Warning {
    /// A filter in both lists is enforced.
    #[error("`{class_name}` is in filter_names and in shadow_mode_filter_names: it is enforced")]
    FilterInBothLists {
        /// The filter.
        class_name: String,
    },
    /// A filter twice in one list.
    #[error("`{class_name}` is more than once in {list}: it is loaded once")]
    FilterRepeated {
        /// The filter.
        class_name: String,
        /// The list.
        list: &'static str,
    },
    /// A file that says nothing to this node.
    #[error("{origin}: no block for the node `{node}`; the file has blocks for {found}")]
    NoBlockForNode {
        /// The file.
        origin: String,
        /// This node.
        node: String,
        /// The patterns of the file.
        found: String,
    },
    /// A beginning of generator names that says nothing about the planner.
    #[error(
        "`{entry}` in generator_name_prefixes has no source, so what it fits is never chosen: write it as \
         {entry}=diffusion_planner, {entry}=backup_planner_go or {entry}=backup_planner_stop"
    )]
    GeneratorWithoutSource {
        /// The entry.
        entry: String,
    },
    /// Dimensions of the vehicle that nobody gave.
    #[error("no value for {names}: the dimensions of the sample vehicle are used")]
    VehicleDimensionsAssumed {
        /// The missing parameters.
        names: String,
    },
}
