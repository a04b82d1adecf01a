//! The run as one self-contained HTML page: what the road looked like in each cycle, which candidates there were, and
//! why each of them won or fell.
//!
//! Owns what the page shows; the page itself (`page/body.html`, `page/style.css`, `page/viewer.js`) only draws it.
//! Promises: the page loads nothing from elsewhere; it says the same numbers as the JSON of the run, because both come
//! from the same summary; a drive of 20 s stays below 5 MB, because geometry is thinned to what an eye can tell apart
//! (5 cm) and everything that repeats is written once.

mod codes;
mod cycles;
mod scenery;

use selection::Validator;
use selection::validator::Enforcement;
use selector_actors::cycle::{CycleReport, CycleTimes};
use serde::Serialize;
use std::time::Duration;

use super::document::Document;
use super::summary::RunSummary;
use codes::Origin;
use cycles::{Cycles, CyclesOnPage};
use scenery::{Scenery, SceneryOnPage};

const DOCUMENT: Document = Document {
    style: include_str!("page/style.css"),
    body: include_str!("page/body.html"),
    viewer: include_str!("page/viewer.js"),
};

/// Gathers a run cycle by cycle.
#[derive(Debug)]
pub struct Page {
    validator: Validator,
    budget: Duration,
    focus: Option<usize>,
    origin: Option<Origin>,
    scenery: Scenery,
    cycles: Cycles,
}

/// What the viewer reads. Coordinates are whole centimetres from the origin.
#[derive(Debug, Serialize)]
struct OnPage<'a> {
    summary: &'a RunSummary,
    /// The candidate that is looked at when the page opens, by its place in the first cycle.
    focus: Option<usize>,
    /// A cycle that took longer is marked, µs.
    budget_us: u64,
    origin: [f64; 2],
    filters: Vec<FilterOnPage>,
    scenery: SceneryOnPage,
    #[serde(flatten)]
    cycles: CyclesOnPage,
}

#[derive(Debug, Serialize)]
struct FilterOnPage {
    name: &'static str,
    enforced: bool,
}

impl Page {
    /// An empty page; `validator` names the filters and words their judgements, it judges nothing. A cycle that took
    /// longer than the budget is marked.
    #[must_use]
    pub fn new(validator: Validator, budget: Duration) -> Self {
        Self {
            validator,
            budget,
            focus: None,
            origin: None,
            scenery: Scenery::default(),
            cycles: Cycles::default(),
        }
    }

    /// Takes in one cycle.
    pub fn add(&mut self, report: &CycleReport, times: CycleTimes) {
        let origin = *self.origin.get_or_insert_with(|| Origin::of(&report.cycle));
        self.scenery.add(&report.cycle.scene);
        self.cycles.add(report, times, &self.validator, origin);
    }

    /// The page opens with this candidate of its first cycle selected.
    pub fn focus(&mut self, candidate: usize) {
        self.focus = Some(candidate);
    }

    /// The page, with the result of the whole run.
    ///
    /// # Errors
    /// The result has no JSON form.
    pub fn finish(self, summary: &RunSummary) -> Result<String, serde_json::Error> {
        let origin = self.origin.unwrap_or_default();
        let validity = FilterOnPage { name: selection::data_validity::NAME, enforced: true };
        let loaded = self.validator.filters().iter().map(|filter| FilterOnPage {
            name: filter.name(),
            enforced: filter.enforcement() == Enforcement::Enforced,
        });
        let data = OnPage {
            summary,
            focus: self.focus,
            budget_us: u64::try_from(self.budget.as_micros()).unwrap_or(u64::MAX),
            origin: origin.position(),
            filters: std::iter::once(validity).chain(loaded).collect(),
            scenery: self.scenery.finish(origin),
            cycles: self.cycles.finish(),
        };
        let title = format!("{} – {}", summary.common.command, summary.input.name);
        DOCUMENT.write(&title, &data)
    }
}

/// Numbers repeated strings: each text is on the page once.
#[derive(Debug, Default)]
struct Strings {
    numbers: std::collections::HashMap<String, usize>,
    all: Vec<String>,
}

impl Strings {
    fn number(&mut self, text: &str) -> usize {
        if let Some(&number) = self.numbers.get(text) {
            return number;
        }
        let number = self.all.len();
        self.numbers.insert(text.to_owned(), number);
        self.all.push(text.to_owned());
        number
    }
}

#[cfg(test)]
mod tests;
