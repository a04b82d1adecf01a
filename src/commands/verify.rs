//! `verify`: do our filters give the verdicts that are written down?
//!
//! Runs every filter that is built over golden sequences, with its memory, and compares each verdict. The exit code
//! says whether a difference was found that is not one of the listed deviations ([`deviation`]).

mod compare;
mod deviation;

pub use compare::Kind;
pub use deviation::{Deviation, LISTED};

use std::collections::BTreeMap;
use std::fmt;
use std::path::{Path, PathBuf};

use messages::unique_identifier_msgs::Uuid;
use selection::filters::{CLASSES, crosswalk};
use selection::parameters::FilterClass;
use selection::verdict::Failure;
use selection::{Judgement, Scratch, Validator, Verdict, data_validity};
use serde::Serialize;

use crate::golden::{Cycle, Expected, ExpectedVerdict, GoldenError, Maps, Sequence, sequence_files};
use crate::json::Number;
use compare::{Comparison, compare};

/// How many differences are listed one by one.
pub const LISTED_DIFFERENCES: usize = 50;
/// The exit code when a difference is found that is not a listed deviation.
pub const EXIT_DIFFERENT: u8 = 3;

/// Why a verdict is not compared: the filter's verdict hangs on the last bit of a position.
const FRAGILE: &str = "fragile";
/// Why a verdict is not compared: the candidate does not pass the data-validity check.
const INVALID_DATA: &str = "invalid data";
/// Why a verdict is not compared: this program does not have the filter.
const NOT_BUILT: &str = "not built";

/// What to verify.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Options {
    /// Files, and folders of files.
    pub paths: Vec<PathBuf>,
    /// Folder of the maps; without one, the folder `maps` beside that of each file.
    pub maps: Option<PathBuf>,
    /// Short names of the filters to run; empty for all.
    pub filters: Vec<String>,
}

/// Why nothing could be verified.
#[derive(Debug, thiserror::Error)]
pub enum VerifyError {
    /// A file cannot be used.
    #[error(transparent)]
    Golden(#[from] GoldenError),
    /// There is no filter of this name.
    #[error("there is no filter `{name}`; there are: {}", names())]
    UnknownFilter {
        /// The name.
        name: String,
    },
    /// A filter of the table cannot be loaded.
    #[error(transparent)]
    Load(#[from] selection::validator::UnknownFilter),
}

fn names() -> String {
    FilterClass::ALL.map(FilterClass::short_name).join(", ")
}

/// What was found.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct VerifyReport {
    /// Files read.
    pub files: usize,
    /// Cycles in them.
    pub cycles: usize,
    /// By short name; the data-validity check is among them.
    pub filters: BTreeMap<String, FilterReport>,
    /// Differences that are no listed deviation.
    pub unlisted: usize,
    /// The first differences, listed deviations included.
    pub differences: Vec<Difference>,
}

/// What was found for one filter. `judgements` = `equal` + `unequal` + `skipped`.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct FilterReport {
    /// Verdicts in the files.
    pub judgements: usize,
    /// Verdicts that are equal.
    pub equal: usize,
    /// Verdicts that are not.
    pub unequal: usize,
    /// What is unequal, by the gravest difference of each verdict.
    pub unequal_by_kind: BTreeMap<Kind, usize>,
    /// Of the unequal ones: we reject, they accept.
    pub unequal_safe_side: usize,
    /// Of the unequal ones: we accept, they reject.
    pub unequal_unsafe_side: usize,
    /// Verdicts that were not compared.
    pub skipped: usize,
    /// Why not.
    pub skipped_because: BTreeMap<&'static str, usize>,
    /// Largest absolute difference between two values of a metric.
    pub max_metric_difference: Number,
}

impl FilterReport {
    fn skip(&mut self, because: &'static str) {
        self.judgements += 1;
        self.skipped += 1;
        *self.skipped_because.entry(because).or_default() += 1;
    }

    fn add(&mut self, comparison: &Comparison) {
        self.judgements += 1;
        if comparison.metric_difference > self.max_metric_difference.0 {
            self.max_metric_difference = Number(comparison.metric_difference);
        }
        let Some(kind) = comparison.kind else {
            self.equal += 1;
            return;
        };
        self.unequal += 1;
        *self.unequal_by_kind.entry(kind).or_default() += 1;
        self.unequal_safe_side += usize::from(!comparison.ours_feasible && comparison.expected_feasible);
        self.unequal_unsafe_side += usize::from(comparison.ours_feasible && !comparison.expected_feasible);
    }
}

/// One verdict that is not the expected one.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Difference {
    /// The file.
    pub file: String,
    /// Number of the cycle in the file, from 0.
    pub cycle: usize,
    /// Number of the candidate in the cycle, from 0.
    pub candidate: usize,
    /// Its generator and sample.
    pub key: String,
    /// How the candidate was made.
    pub note: String,
    /// The filter.
    pub filter: String,
    /// What is different.
    pub kind: Kind,
    /// Our verdict.
    pub ours: ShownVerdict,
    /// The verdict of the file.
    pub expected: ShownVerdict,
    /// The listed deviation that explains it, if there is one.
    pub listed_deviation: Option<&'static str>,
}

/// A verdict in the form of the files: `{"feasible", "metrics": [[name, value, level]]}`, where somebody has to be
/// waited for with `"safety_factors": [[object, x, y]]`, or `{"error"}`, or `{"panic"}`.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum ShownVerdict {
    /// The filter judged.
    Judged {
        /// Whether the candidate may be driven.
        feasible: bool,
        /// Name, value and level of each measurement.
        metrics: Vec<(String, Number, u8)>,
        /// Those to wait for, and where they are, m.
        #[serde(skip_serializing_if = "Vec::is_empty")]
        safety_factors: Vec<(String, Number, Number)>,
    },
    /// The filter could not judge.
    Error {
        /// Why.
        error: String,
    },
    /// The filter panicked.
    Panic {
        /// Its text.
        panic: String,
    },
}

fn shown_factor(object_id: Uuid, x_m: f64, y_m: f64) -> (String, Number, Number) {
    (object_id.to_string(), Number(x_m), Number(y_m))
}

impl From<&Judgement> for ShownVerdict {
    fn from(judgement: &Judgement) -> Self {
        match &judgement.failure {
            Some(Failure::NotAssessed(why)) => Self::Error { error: why.to_string() },
            Some(Failure::Panicked(what)) => Self::Panic { panic: what.clone() },
            Some(late @ (Failure::OutOfTime | Failure::NotNeeded)) => Self::Error { error: late.to_string() },
            None => {
                let metrics = judgement.metrics.iter();
                let metrics = metrics.map(|m| (m.name.to_owned(), Number(m.value), m.risk as u8)).collect();
                let factors = crosswalk::safety_factors(judgement).iter();
                let factors = factors.map(|f| shown_factor(f.object_id, f.position.x, f.position.y));
                Self::Judged { feasible: judgement.feasible, metrics, safety_factors: factors.collect() }
            }
        }
    }
}

impl From<&ExpectedVerdict> for ShownVerdict {
    fn from(verdict: &ExpectedVerdict) -> Self {
        match verdict {
            ExpectedVerdict::Error(error) => Self::Error { error: error.clone() },
            ExpectedVerdict::Judged { feasible, metrics, safety_factors } => {
                let metrics = metrics.iter();
                let metrics = metrics.map(|m| (m.name.clone(), Number(m.value), m.level)).collect();
                let factors = safety_factors.iter().map(|f| shown_factor(f.object_id, f.x_m, f.y_m));
                Self::Judged { feasible: *feasible, metrics, safety_factors: factors.collect() }
            }
        }
    }
}

impl VerifyReport {
    /// 0 if all differences are listed deviations, else [`EXIT_DIFFERENT`].
    #[must_use]
    pub fn exit_code(&self) -> u8 {
        if self.unlisted == 0 { 0 } else { EXIT_DIFFERENT }
    }
}

/// Runs the filters over the files and compares.
///
/// # Errors
/// The first file that cannot be used, and names of filters that do not exist.
pub fn run(options: &Options) -> Result<VerifyReport, VerifyError> {
    let known = |name: &str| FilterClass::ALL.iter().any(|class| class.short_name() == name);
    if let Some(name) = options.filters.iter().find(|name| !known(name)) {
        return Err(VerifyError::UnknownFilter { name: name.clone() });
    }
    let mut report = VerifyReport::default();
    let mut maps = Maps::new(options.maps.clone());
    for path in sequence_files(&options.paths)? {
        let sequence = Sequence::read(&path, &mut maps)?;
        verify_sequence(&mut report, options, &path, &sequence)?;
    }
    Ok(report)
}

fn verify_sequence(
    report: &mut VerifyReport,
    options: &Options,
    path: &Path,
    sequence: &Sequence,
) -> Result<(), VerifyError> {
    let selected = |name: &str| options.filters.is_empty() || options.filters.iter().any(|f| f == name);
    let filters: Vec<&str> =
        sequence.filters.iter().map(String::as_str).filter(|name| selected(name)).collect();
    let mut validator = validator(sequence, &filters)?;
    let mut scratch = Scratch::default();
    report.files += 1;
    for (number, cycle) in sequence.cycles.iter().enumerate() {
        let verdicts = run_cycle(&mut validator, cycle, &mut scratch);
        report.cycles += 1;
        for (index, (verdict, expected)) in verdicts.iter().zip(&cycle.expected).enumerate() {
            let place = Place { path, cycle: number, candidate: index, verdict, expected };
            check_data_validity(report, &place);
            for filter in &filters {
                check_filter(report, &validator, &place, filter);
            }
        }
    }
    Ok(())
}

/// A validator with those of the filters that are built, all enforced.
fn validator(sequence: &Sequence, filters: &[&str]) -> Result<Validator, VerifyError> {
    let mut parameters = sequence.parameters.clone();
    let built = CLASSES.iter().filter(|class| filters.contains(&class.short_name));
    parameters.filter_names = built.map(|class| class.class_name.to_owned()).collect();
    Ok(Validator::new(parameters, &sequence.vehicle)?)
}

/// One cycle as a node runs it: the verdicts of all candidates.
pub fn run_cycle(validator: &mut Validator, cycle: &Cycle, scratch: &mut Scratch) -> Vec<Verdict> {
    if let Some(parameters) = &cycle.parameters {
        validator.configure(parameters.clone());
    }
    validator.announce(&cycle.candidates);
    validator.observe(&cycle.scene);
    let candidates = cycle.candidates.iter();
    let verdicts: Vec<Verdict> = candidates
        .map(|candidate| validator.judge(&cycle.scene, candidate, scratch, || 0, &mut []))
        .collect();
    validator.remember(&cycle.candidates, &verdicts);
    verdicts
}

/// One candidate of a file.
#[derive(Clone, Copy)]
struct Place<'a> {
    path: &'a Path,
    cycle: usize,
    candidate: usize,
    verdict: &'a Verdict,
    expected: &'a Expected,
}

/// Does the check find the defect, and only that?
fn check_data_validity(report: &mut VerifyReport, place: &Place<'_>) {
    let expected = ExpectedVerdict::Judged {
        feasible: place.expected.data_validity == 0,
        metrics: vec![crate::golden::ExpectedMetric {
            name: data_validity::METRIC.to_owned(),
            value: f64::from(place.expected.data_validity),
            level: if place.expected.data_validity == 0 { 0 } else { 3 },
        }],
        safety_factors: Vec::new(),
    };
    record(report, place, data_validity::NAME, &place.verdict.data_validity, &expected);
}

fn check_filter(report: &mut VerifyReport, validator: &Validator, place: &Place<'_>, filter: &str) {
    let Some(expected) = place.expected.verdicts.get(filter) else { return };
    let judgement = validator.filters().iter().position(|loaded| loaded.name() == filter);
    let because = match judgement {
        None => NOT_BUILT,
        Some(_) if place.expected.data_validity != 0 || !place.verdict.data_validity.feasible => INVALID_DATA,
        Some(_) if place.expected.fragile.iter().any(|fragile| fragile == filter) => FRAGILE,
        Some(index) => {
            if let Some(ours) = place.verdict.judgements.get(index) {
                record(report, place, filter, ours, expected);
            }
            return;
        }
    };
    report.filters.entry(filter.to_owned()).or_default().skip(because);
}

fn record(
    report: &mut VerifyReport,
    place: &Place<'_>,
    filter: &str,
    ours: &Judgement,
    expected: &ExpectedVerdict,
) {
    let comparison = compare(ours, expected);
    report.filters.entry(filter.to_owned()).or_default().add(&comparison);
    let Some(kind) = comparison.kind else { return };
    let listed =
        LISTED.iter().find(|deviation| deviation.filter == filter && (deviation.covers)(ours, expected));
    report.unlisted += usize::from(listed.is_none());
    if report.differences.len() < LISTED_DIFFERENCES {
        report.differences.push(Difference {
            file: place.path.display().to_string(),
            cycle: place.cycle,
            candidate: place.candidate,
            key: place.verdict.key.to_string(),
            note: place.expected.note.clone(),
            filter: filter.to_owned(),
            kind,
            ours: ours.into(),
            expected: expected.into(),
            listed_deviation: listed.map(|deviation| deviation.row),
        });
    }
}

impl fmt::Display for VerifyReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{} files, {} cycles", self.files, self.cycles)?;
        writeln!(
            f,
            "{:<38} {:>10} {:>8} {:>8} {:>8} {:>8} {:>8} {:>12}",
            "filter", "judgements", "equal", "unequal", "safe", "unsafe", "skipped", "max diff"
        )?;
        for (name, filter) in &self.filters {
            write!(
                f,
                "{name:<38} {:>10} {:>8} {:>8} {:>8} {:>8} {:>8} {:>12.3e}",
                filter.judgements,
                filter.equal,
                filter.unequal,
                filter.unequal_safe_side,
                filter.unequal_unsafe_side,
                filter.skipped,
                filter.max_metric_difference.0,
            )?;
            for (kind, count) in &filter.unequal_by_kind {
                write!(f, "  {count} by {kind}")?;
            }
            for (because, count) in &filter.skipped_because {
                write!(f, "  {count} {because}")?;
            }
            writeln!(f)?;
        }
        for difference in &self.differences {
            write!(f, "{difference}")?;
        }
        match (self.unlisted, self.differences.len()) {
            (0, 0) => writeln!(f, "all compared verdicts are equal"),
            (0, _) => writeln!(f, "all differences are listed deviations"),
            (count, _) => writeln!(f, "{count} differences that are no listed deviation"),
        }
    }
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { file, cycle, candidate, key, note, filter, kind, ours, expected, listed_deviation } = self;
        writeln!(f, "{file} cycle {cycle} candidate {candidate} ({key}, {note}): {filter}, {kind}")?;
        writeln!(f, "    ours     {ours}")?;
        writeln!(f, "    expected {expected}")?;
        match listed_deviation {
            Some(row) => writeln!(f, "    listed deviation {row}"),
            None => Ok(()),
        }
    }
}

impl fmt::Display for ShownVerdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Error { error } => write!(f, "error: {error}"),
            Self::Panic { panic } => write!(f, "panic: {panic}"),
            Self::Judged { feasible, metrics, safety_factors } => {
                f.write_str(if *feasible { "accepted" } else { "rejected" })?;
                for (name, value, level) in metrics {
                    write!(f, "  {name} {:?} level {level}", value.0)?;
                }
                safety_factors
                    .iter()
                    .try_for_each(|(object, x, y)| write!(f, "  for {object} at {:?} {:?}", x.0, y.0))
            }
        }
    }
}
