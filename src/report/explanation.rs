//! Why was a candidate accepted or rejected? All judgements of one cycle, with their evidence, for people and for JSON.
//!
//! The keys are a contract: they stay and keep their meaning, more may come. The text of a judgement is the filter's
//! own ([`selection::Filter::explain`]); nothing here knows what a filter judges.

use std::fmt;

use messages::builtin_interfaces::Time;
use selection::validator::Enforcement;
use selection::{Candidate, Judgement, Validator, Verdict, data_validity};
use serde::Serialize;

use crate::json::Number;

/// One cycle, explained.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Explanation {
    /// Number of the cycle in the run.
    pub cycle: u64,
    /// What started it.
    pub trigger: String,
    /// Time of the cycle, s. At present-day epochs this has a resolution of 0.2 microseconds.
    pub stamp: f64,
    /// The same in whole nanoseconds.
    pub stamp_ns: i64,
    /// The candidates in message order.
    pub candidates: Vec<ExplainedCandidate>,
}

/// What was said about one candidate.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ExplainedCandidate {
    /// Generator and sample: its identity over time.
    pub key: String,
    /// Name of the generator.
    pub generator: String,
    /// Whether it may be published.
    pub accepted: bool,
    /// The data-validity check, then every loaded filter if the data is valid.
    pub judgements: Vec<ExplainedJudgement>,
}

/// What one filter said.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ExplainedJudgement {
    /// Name of the filter.
    pub filter: &'static str,
    /// Whether its objection counts; false for a shadow filter.
    pub enforced: bool,
    /// Whether it has nothing against the candidate.
    pub feasible: bool,
    /// False where the filter could not judge; then it is not feasible either.
    pub assessed: bool,
    /// What was not assessed although the filter judged, in words; null where that is nothing.
    pub not_assessed: Option<String>,
    /// Measurements in a fixed order.
    pub metrics: Vec<ExplainedMetric>,
    /// Where, when, against what, and in words. None where there is nothing to tell.
    pub evidence: Option<ExplainedEvidence>,
}

/// One measurement.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ExplainedMetric {
    /// Name.
    pub name: &'static str,
    /// Value in the metric's unit.
    pub value: Number,
    /// The limit it is held against; not a number where there is none.
    pub threshold: Number,
    /// How bad it is, for example `danger`.
    pub risk: &'static str,
}

/// The first violation. All but the text is null where a judgement has no place.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ExplainedEvidence {
    /// Index of the point.
    pub index: Option<usize>,
    /// Time from the start of the candidate, s.
    pub time_s: Option<Number>,
    /// Place in the map frame, m.
    pub x: Option<Number>,
    /// Place in the map frame, m.
    pub y: Option<Number>,
    /// Map element involved.
    pub element_id: Option<i64>,
    /// Regulatory element that gives the map element its meaning.
    pub regulatory_element_id: Option<i64>,
    /// Road user involved, as 32 hexadecimal digits.
    pub object_id: Option<String>,
    /// The whole in one line; null where a feasible candidate has a note on its place only.
    pub text: Option<String>,
}

/// Explains the verdicts of one cycle. `verdicts[i]` is what `validator` said about `candidates[i]`.
#[must_use]
pub fn explain(
    validator: &Validator,
    candidates: &[Candidate],
    verdicts: &[Verdict],
    cycle: u64,
    trigger: &str,
    stamp: Time,
) -> Explanation {
    let candidates = candidates.iter().zip(verdicts).map(|(candidate, verdict)| ExplainedCandidate {
        key: verdict.key.to_string(),
        generator: candidate.generator_name.to_string(),
        accepted: verdict.accepted,
        judgements: judgements(validator, verdict),
    });
    Explanation {
        cycle,
        trigger: trigger.to_owned(),
        stamp: stamp.seconds(),
        stamp_ns: stamp.nanoseconds(),
        candidates: candidates.collect(),
    }
}

fn judgements(validator: &Validator, verdict: &Verdict) -> Vec<ExplainedJudgement> {
    let validity = &verdict.data_validity;
    let validity = judgement(data_validity::NAME, true, validity, [data_validity::explain(validity), None]);
    let filters = validator.filters().iter().zip(&verdict.judgements).map(|(loaded, said)| {
        let enforced = loaded.enforcement() == Enforcement::Enforced;
        judgement(loaded.name(), enforced, said, [loaded.explain(said), loaded.not_assessed(said)])
    });
    std::iter::once(validity).chain(filters).collect()
}

/// The words are why it objects, and what it leaves open.
fn judgement(
    filter: &'static str,
    enforced: bool,
    said: &Judgement,
    [text, not_assessed]: [Option<String>; 2],
) -> ExplainedJudgement {
    let metrics = said.metrics.iter().map(|metric| ExplainedMetric {
        name: metric.name,
        value: Number(metric.value),
        threshold: Number(metric.threshold),
        risk: metric.risk.name(),
    });
    let place = said.evidence;
    ExplainedJudgement {
        filter,
        enforced,
        feasible: said.feasible,
        assessed: said.failure.is_none(),
        not_assessed,
        metrics: metrics.collect(),
        evidence: (place.is_some() || text.is_some()).then(|| ExplainedEvidence {
            index: place.map(|at| at.index),
            time_s: place.map(|at| Number(at.time_s)),
            x: place.map(|at| Number(at.x_m)),
            y: place.map(|at| Number(at.y_m)),
            element_id: place.and_then(|at| at.element_id),
            regulatory_element_id: place.and_then(|at| at.regulatory_element_id),
            object_id: place.and_then(|at| at.object_id).map(|id| id.to_string()),
            text,
        }),
    }
}

impl ExplainedJudgement {
    /// Why it objects, in one line.
    fn objection(&self) -> Option<&str> {
        let text = || self.evidence.as_ref().and_then(|evidence| evidence.text.as_deref());
        (!self.feasible).then(|| text().unwrap_or("no reason given"))
    }
}

impl fmt::Display for Explanation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let accepted = self.candidates.iter().filter(|candidate| candidate.accepted).count();
        let (cycle, trigger, of) = (self.cycle, &self.trigger, self.candidates.len());
        let (seconds, nanoseconds) =
            (self.stamp_ns.div_euclid(1_000_000_000), self.stamp_ns.rem_euclid(1_000_000_000));
        writeln!(
            f,
            "cycle {cycle} ({trigger}, {seconds}.{nanoseconds:09} s): {accepted} of {of} candidates accepted"
        )?;
        self.candidates.iter().try_for_each(|candidate| write!(f, "{candidate}"))
    }
}

impl fmt::Display for ExplainedCandidate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let verdict = if self.accepted { "accepted" } else { "rejected" };
        writeln!(f, "  {} {}: {verdict}", self.generator, self.key)?;
        for judgement in &self.judgements {
            let shadow = if judgement.enforced { "" } else { " (shadow)" };
            if let Some(why) = judgement.objection() {
                let kind = if judgement.assessed { "" } else { ", not assessed" };
                writeln!(f, "    {}{shadow}{kind}: {why}", judgement.filter)?;
            }
            if let Some(what) = &judgement.not_assessed {
                writeln!(f, "    {}{shadow}, not assessed: {what}", judgement.filter)?;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
