//! From the name of a generator to what kind of planner it is.
//!
//! The table is one list of texts, the parameter `generator_name_prefixes`: beginnings of names that are known by
//! themselves, and `prefix=source` for others.

use super::Unrankable;
use crate::parameters::SourceName;

/// Beginnings of names whose source is known.
const KNOWN: [(&str, SourceName); 4] = [
    ("DiffusionPlanner_", SourceName::DiffusionPlanner),
    ("MLPlanner_", SourceName::DiffusionPlanner),
    ("MinimumRuleBasedPlanner_Go", SourceName::BackupPlannerGo),
    ("MinimumRuleBasedPlanner_Stop", SourceName::BackupPlannerStop),
];

/// One row of the table of generators that may be ranked.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct GeneratorSource {
    /// Beginning of the generator's name. An empty one fits every name.
    pub prefix: String,
    /// What kind of planner it is. Generators with `None` cannot be ranked.
    pub source: Option<SourceName>,
}

impl GeneratorSource {
    /// The row that an entry of the list means: `prefix=source`, or a prefix alone. A text behind `=` that names no
    /// source belongs to the prefix.
    #[must_use]
    pub fn of_entry(entry: &str) -> Self {
        let named = entry.rsplit_once('=').and_then(|(prefix, name)| {
            let source = SourceName::ALL.into_iter().find(|source| source.name() == name)?;
            Some(Self { prefix: prefix.to_owned(), source: Some(source) })
        });
        named.unwrap_or_else(|| {
            let known = KNOWN.into_iter().find(|(prefix, _)| *prefix == entry);
            Self { prefix: entry.to_owned(), source: known.map(|(_, source)| source) }
        })
    }

    /// The rows that the entries of a list mean.
    #[must_use]
    pub fn table<T: AsRef<str>>(entries: &[T]) -> Vec<Self> {
        entries.iter().map(|entry| Self::of_entry(entry.as_ref())).collect()
    }
}

/// The source of the first row that fits the name; the rows behind it are not asked.
///
/// # Errors
/// No row fits, or the one that does has no source: such a generator cannot be ranked.
pub fn source_of(sources: &[GeneratorSource], generator_name: &str) -> Result<SourceName, Unrankable> {
    let row = sources.iter().find(|row| generator_name.starts_with(&row.prefix));
    row.ok_or(Unrankable::UnknownGenerator)?.source.ok_or(Unrankable::GeneratorWithoutSource)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entries_of_the_list() {
        use SourceName::*;
        let cases = [
            ("DiffusionPlanner_", "DiffusionPlanner_", Some(DiffusionPlanner)),
            ("MLPlanner_", "MLPlanner_", Some(DiffusionPlanner)),
            ("MinimumRuleBasedPlanner_Go", "MinimumRuleBasedPlanner_Go", Some(BackupPlannerGo)),
            ("MinimumRuleBasedPlanner_Stop", "MinimumRuleBasedPlanner_Stop", Some(BackupPlannerStop)),
            ("MinimumRuleBasedPlanner", "MinimumRuleBasedPlanner", None),
            ("MyPlanner_=backup_planner_go", "MyPlanner_", Some(BackupPlannerGo)),
            ("a=b=diffusion_planner", "a=b", Some(DiffusionPlanner)),
            ("DiffusionPlanner_=backup_planner_stop", "DiffusionPlanner_", Some(BackupPlannerStop)),
            ("=backup_planner_stop", "", Some(BackupPlannerStop)),
            ("MyPlanner_=backup", "MyPlanner_=backup", None),
            ("", "", None),
        ];
        for (entry, prefix, source) in cases {
            let expected = GeneratorSource { prefix: prefix.to_owned(), source };
            assert_eq!(GeneratorSource::of_entry(entry), expected, "{entry}");
        }
    }

    #[test]
    fn the_first_row_that_fits_decides() {
        use SourceName::*;
        use Unrankable::*;
        let shipped: &[&str] =
            &["DiffusionPlanner_", "MinimumRuleBasedPlanner_Go", "MinimumRuleBasedPlanner_Stop"];
        let own: &[&str] =
            &["Go=backup_planner_go", "Slow", "=backup_planner_stop", "Good=diffusion_planner"];
        let cases = [
            (shipped, "DiffusionPlanner_0", Ok(DiffusionPlanner)),
            (shipped, "DiffusionPlanner_", Ok(DiffusionPlanner)),
            (shipped, "DiffusionPlanner", Err(UnknownGenerator)),
            (shipped, "diffusionplanner_0", Err(UnknownGenerator)),
            (shipped, "My_DiffusionPlanner_0", Err(UnknownGenerator)),
            (shipped, "MinimumRuleBasedPlanner_Go", Ok(BackupPlannerGo)),
            (shipped, "MinimumRuleBasedPlanner_Stop_2", Ok(BackupPlannerStop)),
            (shipped, "MinimumRuleBasedPlanner", Err(UnknownGenerator)),
            (shipped, "SafePlanner", Err(UnknownGenerator)),
            (shipped, "", Err(UnknownGenerator)),
            (own, "Good", Ok(BackupPlannerGo)),
            (own, "Slow_1", Err(GeneratorWithoutSource)),
            (own, "anything", Ok(BackupPlannerStop)),
            (&[], "DiffusionPlanner_0", Err(UnknownGenerator)),
        ];
        for (entries, name, expected) in cases {
            assert_eq!(source_of(&GeneratorSource::table(entries), name), expected, "{name} in {entries:?}");
        }
    }
}
