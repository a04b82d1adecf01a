//! Rules between parameters that no single range can express.

use thiserror::Error;

/// A broken rule. Names are complete ROS parameter names.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum RuleViolation {
    /// Two lists that belong together differ in length.
    #[error(
        "has {length} entries but `{other}` has {other_length}: entry i of one belongs to entry i of the other"
    )]
    UnequalLengths {
        /// The list reported.
        parameter: String,
        /// Its length.
        length: usize,
        /// The list it belongs to.
        other: String,
        /// Length of that list.
        other_length: usize,
    },
    /// An entry occurs twice in a list that must not repeat.
    #[error("names `{entry}` more than once")]
    Repeated {
        /// The list.
        parameter: String,
        /// The repeated entry.
        entry: String,
    },
    /// A list that switches a check off by being empty.
    #[error(
        "names nothing, which would switch the check off without a word; remove the filter from the filter lists instead"
    )]
    NamesNothing {
        /// The list.
        parameter: String,
    },
    /// An empty list where `[""]` must be written to switch a class off.
    #[error("is empty; write [\"\"] to switch the assessment off")]
    EmptyBase {
        /// The list.
        parameter: String,
    },
    /// The switch-off entry `""` beside others.
    #[error("mixes \"\" with other entries; [\"\"] alone switches the assessment off")]
    MixedSwitchOff {
        /// The list.
        parameter: String,
    },
    /// All weights of a weighted sum are zero.
    #[error("is 0 like {others}: at least one of them must be positive")]
    NoPositiveWeight {
        /// The weight reported.
        parameter: String,
        /// The other weights of the sum.
        others: String,
    },
    /// A braking limit too weak to stop with.
    #[error("is {value:?}, with which the vehicle never stops: its magnitude must exceed 0.001")]
    NeverStops {
        /// The limit.
        parameter: String,
        /// Its value.
        value: f64,
    },
    /// A limit that must brake at least as hard as another one.
    #[error("is {value:?}, weaker braking than `{milder}` ({milder_value:?}): it must not be greater")]
    MilderThan {
        /// The limit that should be the stronger one.
        parameter: String,
        /// Its value.
        value: f64,
        /// The limit that should be the milder one.
        milder: String,
        /// Value of that limit.
        milder_value: f64,
    },
}

impl RuleViolation {
    /// ROS name of the parameter the violation is reported at.
    #[must_use]
    pub fn parameter(&self) -> &str {
        match self {
            Self::UnequalLengths { parameter, .. }
            | Self::Repeated { parameter, .. }
            | Self::NamesNothing { parameter }
            | Self::EmptyBase { parameter }
            | Self::MixedSwitchOff { parameter }
            | Self::NoPositiveWeight { parameter, .. }
            | Self::NeverStops { parameter, .. }
            | Self::MilderThan { parameter, .. } => parameter,
        }
    }

    /// The other parameter of the rule, if it has one.
    #[must_use]
    pub fn other_parameter(&self) -> Option<&str> {
        match self {
            Self::UnequalLengths { other, .. } => Some(other),
            Self::MilderThan { milder, .. } => Some(milder),
            _ => None,
        }
    }
}
