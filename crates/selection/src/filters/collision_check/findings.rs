//! What was found about a candidate, and how it is told: metrics, the worst finding with its place, words.

use super::drac::{Evaluation, Method};
use crate::candidate::Candidate;
use crate::verdict::{Evidence, Judgement, Memo, Metric, RiskLevel};
use messages::unique_identifier_msgs::Uuid;
use motion::occupancy::{Outline, PlanarPose, Slice};
use smallvec::smallvec;
use std::fmt;

const PATH_METRIC: &str = "DRAC_map_based_predicted_path";
const ARC_METRIC: &str = "DRAC_constant_curvature_path";
const RSS_METRIC: &str = "RSS";

/// Steps in which the first contact inside a slice is looked for, before bisection.
const CONTACT_STEPS: usize = 16;
const BISECTIONS: usize = 12;

/// What was found against a candidate, beyond the metrics.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct CollisionMemo {
    /// The worst finding.
    pub cause: Option<CollisionCause>,
    /// A case that was hit, but that the parameters switch off: nothing is known about it.
    pub not_assessed: Option<Method>,
    /// True if an object has no predicted path, so that only its present motion was assessed.
    pub without_predicted_path: bool,
}

/// Why a candidate carries a risk.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum CollisionCause {
    /// It passes a place too shortly before or after an object.
    Passage {
        /// The case.
        method: Method,
        /// By how much the object passes later \[s\].
        pet_s: f64,
        /// Acceleration that avoids it \[m/s²\], minus infinity if none does.
        required_mps2: f64,
    },
    /// An object on its path is too near.
    Distance {
        /// Acceleration that stops behind it \[m/s²\], minus infinity if none does.
        required_mps2: f64,
    },
}

impl fmt::Display for CollisionMemo {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let needs = |f: &mut fmt::Formatter<'_>, required_mps2: f64| {
            if required_mps2.is_finite() {
                write!(f, "needs {required_mps2:.1} m/s2")
            } else {
                f.write_str("no braking avoids it")
            }
        };
        match self.cause {
            Some(CollisionCause::Passage { method, pet_s, required_mps2 }) => {
                write!(f, "{method}, passages {:.1} s apart, ", pet_s.abs())?;
                needs(f, required_mps2)?;
            }
            Some(CollisionCause::Distance { required_mps2 }) => {
                f.write_str("on the path and too near, ")?;
                needs(f, required_mps2)?;
            }
            None => f.write_str("no finding")?,
        }
        Ok(())
    }
}

impl CollisionMemo {
    /// What was not looked at, in words; `None` if everything was.
    pub(super) fn left_open(&self) -> Option<String> {
        let case = self.not_assessed.map(|method| format!("{method} (switched off by the parameters)"));
        let way = self
            .without_predicted_path
            .then(|| "more than the present motion of an object with no predicted path".to_owned());
        let parts: Vec<String> = case.into_iter().chain(way).collect();
        (!parts.is_empty()).then(|| parts.join("; "))
    }
}

/// The worst risk of one kind, and the smallest acceleration found.
#[derive(Debug, Clone, Copy)]
pub(super) struct Tally {
    pub(super) risk: RiskLevel,
    pub(super) required_mps2: f64,
    pub(super) threshold: f64,
    pub(super) lacks_case: bool,
}

impl Tally {
    pub(super) const NONE: Self =
        Self { risk: RiskLevel::Safe, required_mps2: 0.0, threshold: f64::NAN, lacks_case: false };

    pub(super) fn take(&mut self, risk: RiskLevel, required_mps2: f64, threshold: f64) {
        if required_mps2 < self.required_mps2 || risk > self.risk {
            self.threshold = threshold;
        }
        self.risk = self.risk.max(risk);
        self.required_mps2 = self.required_mps2.min(required_mps2);
    }

    /// True if taking this changes nothing.
    fn holds(&self, risk: RiskLevel, required_mps2: f64) -> bool {
        risk <= self.risk && required_mps2 >= self.required_mps2
    }

    fn metric(&self, name: &'static str) -> Metric {
        // A value is what was found; not-a-number says that nothing was found, but not everything was looked at.
        let is_unknown = self.lacks_case && self.required_mps2 == 0.0 && self.risk == RiskLevel::Safe;
        let value = if is_unknown { f64::NAN } else { self.required_mps2 };
        Metric { name, value, threshold: self.threshold, risk: self.risk }
    }
}

/// A finding with its place in time, so that the worst one can be shown.
#[derive(Debug, Clone, Copy)]
pub(super) struct Finding {
    pub(super) risk: RiskLevel,
    /// Time after the objects' stamp \[s\].
    pub(super) time_s: f64,
    pub(super) place: PlanarPose,
    pub(super) object: Uuid,
    pub(super) cause: CollisionCause,
}

impl Finding {
    /// Worse, or as bad and earlier; ties by object, so that the order of objects does not matter.
    fn comes_before(&self, other: &Self) -> bool {
        (other.risk.cmp(&self.risk))
            .then(self.time_s.total_cmp(&other.time_s))
            .then(self.object.cmp(&other.object))
            .is_lt()
    }
}

/// All that was found about a candidate.
#[derive(Debug)]
pub(super) struct Findings {
    pub(super) path: Tally,
    pub(super) arc: Tally,
    pub(super) rss: Tally,
    pub(super) worst: Option<Finding>,
    pub(super) memo: CollisionMemo,
}

impl Findings {
    fn tally(&mut self, method: Method) -> &mut Tally {
        if method.is_map_based() { &mut self.path } else { &mut self.arc }
    }

    /// Takes that a case was hit which is switched off.
    pub(super) fn leave_open(&mut self, method: Method) {
        self.tally(method).lacks_case = true;
        // The lowest one, whatever the order of objects.
        let known = self.memo.not_assessed;
        self.memo.not_assessed = Some(known.map_or(method, |known| known.min(method)));
    }

    /// Takes what came out for one way of an object, without showing it.
    pub(super) fn take(&mut self, evaluation: &Evaluation) {
        let Evaluation { risk, required_mps2, safe_mps2, .. } = *evaluation;
        self.tally(evaluation.method).take(risk, required_mps2, safe_mps2);
    }

    /// True if neither [`Self::take`] of this nor showing it, which begins at a time \[s\] at the earliest, would change
    /// anything: what is known of its kind is as bad, and what is shown is worse or earlier.
    pub(super) fn knows(&self, evaluation: &Evaluation, earliest_s: f64) -> bool {
        let Evaluation { method, risk, required_mps2, .. } = *evaluation;
        let tally = if method.is_map_based() { &self.path } else { &self.arc };
        tally.holds(risk, required_mps2) && (risk == RiskLevel::Safe || !self.may_show(risk, earliest_s))
    }

    /// False if no finding of a risk at or after a time \[s\] can come before the one known.
    pub(super) fn may_show(&self, risk: RiskLevel, earliest_s: f64) -> bool {
        self.worst
            .as_ref()
            .is_none_or(|worst| risk > worst.risk || (risk == worst.risk && earliest_s <= worst.time_s))
    }

    pub(super) fn show(&mut self, finding: Finding) {
        if finding.risk > RiskLevel::Safe
            && self.worst.as_ref().is_none_or(|worst| finding.comes_before(worst))
        {
            self.worst = Some(finding);
        }
    }
}

pub(super) fn judgement(candidate: &Candidate, offset_s: f64, findings: &Findings) -> Judgement {
    let metrics = smallvec![
        findings.path.metric(PATH_METRIC),
        findings.arc.metric(ARC_METRIC),
        findings.rss.metric(RSS_METRIC),
    ];
    let risk = findings.path.risk.max(findings.arc.risk).max(findings.rss.risk);
    let mut memo = findings.memo;
    memo.cause = findings.worst.map(|worst| worst.cause);
    Judgement {
        feasible: risk < RiskLevel::Danger,
        failure: None,
        metrics,
        evidence: findings.worst.map(|worst| evidence(candidate, worst.time_s - offset_s, &worst)),
        memo: Memo::CollisionCheck(memo),
    }
}

fn evidence(candidate: &Candidate, time_s: f64, finding: &Finding) -> Evidence {
    let points = &candidate.points;
    let after = points.partition_point(|point| point.time_from_start.seconds() <= time_s);
    Evidence {
        time_s,
        x_m: finding.place.position.x,
        y_m: finding.place.position.y,
        object_id: Some(finding.object),
        ..Evidence::at(candidate, after.saturating_sub(1))
    }
}

/// The part of both slices after which the two bodies first touch, if they are exactly in step. `None` if they do
/// not: the slices meet, the bodies at equal times perhaps do not.
pub(super) fn first_contact(bodies: [(&Outline, &Slice); 2]) -> Option<f64> {
    let box_at = |body: usize, ratio: f64| {
        let (outline, slice) = bodies[body];
        outline.box_at(&slice.start.between(&slice.end, ratio))
    };
    let touch_at = |ratio: f64| box_at(0, ratio).overlaps(&box_at(1, ratio));
    let ratio_of = |step: usize| step as f64 / CONTACT_STEPS as f64;
    let step = (0..=CONTACT_STEPS).find(|&step| touch_at(ratio_of(step)))?;
    if step == 0 {
        return Some(0.0);
    }
    let (mut apart, mut touching) = (ratio_of(step - 1), ratio_of(step));
    for _ in 0..BISECTIONS {
        let middle = 0.5 * (apart + touching);
        if touch_at(middle) {
            touching = middle;
        } else {
            apart = middle;
        }
    }
    Some(touching)
}
