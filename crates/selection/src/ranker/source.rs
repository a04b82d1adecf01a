//! From the name of a generator to what kind of planner it is.

use crate::parameters::SourceName;

/// One row of the table of generators that may be ranked.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct GeneratorSource {
    /// Beginning of the generator's name. An empty one fits every name.
    pub prefix: String,
    /// What kind of planner it is.
    pub source: SourceName,
}

/// The shipped table: the generators that upstream ranks, in its order.
pub const DEFAULT_SOURCES: [(&str, SourceName); 3] = [
    ("DiffusionPlanner_", SourceName::DiffusionPlanner),
    ("MinimumRuleBasedPlanner_Go", SourceName::BackupPlannerGo),
    ("MinimumRuleBasedPlanner_Stop", SourceName::BackupPlannerStop),
];

/// The shipped table, owned.
#[must_use]
pub fn default_sources() -> Vec<GeneratorSource> {
    let row = |(prefix, source): (&str, _)| GeneratorSource { prefix: prefix.to_owned(), source };
    DEFAULT_SOURCES.map(row).to_vec()
}

/// The source of the first row that fits the name. `None` if no row does: such a generator cannot be ranked.
#[must_use]
pub fn source_of(sources: &[GeneratorSource], generator_name: &str) -> Option<SourceName> {
    sources.iter().find(|row| generator_name.starts_with(&row.prefix)).map(|row| row.source)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_row_that_fits_decides() {
        use SourceName::*;
        let row = |prefix: &str, source| GeneratorSource { prefix: prefix.to_owned(), source };
        let own = [row("Go", BackupPlannerGo), row("", BackupPlannerStop), row("Good", DiffusionPlanner)];
        let cases = [
            (default_sources(), "DiffusionPlanner_0", Some(DiffusionPlanner)),
            (default_sources(), "DiffusionPlanner_", Some(DiffusionPlanner)),
            (default_sources(), "DiffusionPlanner", None),
            (default_sources(), "diffusionplanner_0", None),
            (default_sources(), "My_DiffusionPlanner_0", None),
            (default_sources(), "MinimumRuleBasedPlanner_Go", Some(BackupPlannerGo)),
            (default_sources(), "MinimumRuleBasedPlanner_Stop_2", Some(BackupPlannerStop)),
            (default_sources(), "MinimumRuleBasedPlanner", None),
            (default_sources(), "SafePlanner", None),
            (default_sources(), "", None),
            (own.to_vec(), "Good", Some(BackupPlannerGo)),
            (own.to_vec(), "anything", Some(BackupPlannerStop)),
            (Vec::new(), "DiffusionPlanner_0", None),
        ];
        for (sources, name, expected) in cases {
            assert_eq!(source_of(&sources, name), expected, "{name}");
        }
    }
}
