//! Deviations from the original filters that are intended and that the golden sequences show.

use selection::Judgement;

use crate::golden::ExpectedVerdict;

/// A difference that is intended.
#[derive(Clone, Copy, Debug)]
pub struct Deviation {
    /// Its row in `docs/deviations.md`.
    pub row: &'static str,
    /// Short name of the filter.
    pub filter: &'static str,
    /// Whether it explains this difference between our judgement and the expected verdict.
    pub covers: fn(&Judgement, &ExpectedVerdict) -> bool,
}

/// All of them. The expected verdicts already hold most intended deviations, so this list stays short.
pub const LISTED: &[Deviation] = &[];
