//! What was found about a candidate, and how it is told: metrics, the worst finding with its place, words.

use super::drac::{Evaluation, Method, risk_of};
use super::settings::{EgoTiers, Settings};
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

/// The worst risk of one kind, and the smallest acceleration found. What is taken has a number; in whatever order it
/// is taken, the outcome is as if it were taken in the order of its numbers.
#[derive(Debug, Clone, Copy)]
pub(super) struct Tally {
    pub(super) risk: RiskLevel,
    required_mps2: f64,
    /// What has this risk, and what requires this acceleration: of several the one with the lowest number.
    risk_from: Origin,
    required_from: Origin,
    /// True if all that is taken has the same threshold.
    threshold_is_one: bool,
    lacks_case: bool,
}

/// Where a value comes from.
#[derive(Debug, Clone, Copy)]
struct Origin {
    /// Number of what was taken, from 1; 0 for nothing yet.
    number: usize,
    threshold: f64,
}

impl Tally {
    pub(super) fn new(threshold_is_one: bool) -> Self {
        let nothing = Origin { number: 0, threshold: f64::NAN };
        Self {
            risk: RiskLevel::Safe,
            required_mps2: 0.0,
            risk_from: nothing,
            required_from: nothing,
            threshold_is_one,
            lacks_case: false,
        }
    }

    /// Takes what was found, with its number from 1 on.
    pub(super) fn take(&mut self, risk: RiskLevel, required_mps2: f64, threshold: f64, number: usize) {
        let origin = Origin { number, threshold };
        if risk > self.risk || (risk == self.risk && number < self.risk_from.number) {
            (self.risk, self.risk_from) = (risk, origin);
        }
        let is_earlier = number < self.required_from.number;
        if required_mps2 < self.required_mps2 || (required_mps2 == self.required_mps2 && is_earlier) {
            (self.required_mps2, self.required_from) = (required_mps2, origin);
        }
    }

    /// True if taking this changes nothing that is told.
    fn holds(&self, risk: RiskLevel, required_mps2: f64, number: usize) -> bool {
        // A lower number may change the threshold, unless there is but one.
        let is_later = |equals: bool, origin: &Origin| !equals || number >= origin.number;
        let keeps_origins = self.threshold_is_one
            || (is_later(risk == self.risk, &self.risk_from)
                && is_later(required_mps2 == self.required_mps2, &self.required_from));
        risk <= self.risk && required_mps2 >= self.required_mps2 && keeps_origins
    }

    /// That of the last one, in the order of numbers, which was worse than all before it in risk or acceleration.
    fn threshold(&self) -> f64 {
        let (risk, required) = (&self.risk_from, &self.required_from);
        if risk.number > required.number { risk.threshold } else { required.threshold }
    }

    fn metric(&self, name: &'static str) -> Metric {
        // A value is what was found; not-a-number says that nothing was found, but not everything was looked at.
        let is_unknown = self.lacks_case && self.required_mps2 == 0.0 && self.risk == RiskLevel::Safe;
        let value = if is_unknown { f64::NAN } else { self.required_mps2 };
        Metric { name, value, threshold: self.threshold(), risk: self.risk }
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
    /// Orders findings that have all of the above in common.
    pub(super) number: usize,
    pub(super) cause: CollisionCause,
}

impl Finding {
    /// Worse, or as bad and earlier; ties by object, so that the order of objects does not matter. In whatever order
    /// findings are shown, the same one is left.
    fn comes_before(&self, other: &Self) -> bool {
        (other.risk.cmp(&self.risk))
            .then(self.time_s.total_cmp(&other.time_s))
            .then(self.object.cmp(&other.object))
            .then(self.number.cmp(&other.number))
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
    pub(super) fn new(settings: &Settings) -> Self {
        Self {
            path: Tally::new(settings.path_threshold_is_one),
            arc: Tally::new(settings.arc_threshold_is_one),
            rss: Tally::new(false),
            worst: None,
            memo: CollisionMemo::default(),
        }
    }

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

    /// True if [`Self::leave_open`] was told of this case, or of one that is named rather than it.
    fn has_left_open(&self, method: Method) -> bool {
        let tally = if method.is_map_based() { &self.path } else { &self.arc };
        tally.lacks_case && self.memo.not_assessed.is_some_and(|known| known <= method)
    }

    /// Takes what came out for one way of an object, without showing it; the way's number counts from 1.
    pub(super) fn take(&mut self, evaluation: &Evaluation, number: usize) {
        let Evaluation { risk, required_mps2, safe_mps2, .. } = *evaluation;
        self.tally(evaluation.method).take(risk, required_mps2, safe_mps2, number);
    }

    /// True if neither [`Self::take`] of this nor showing it, which begins at a time \[s\] at the earliest, would change
    /// anything: what is known of its kind is as bad, and what is shown is worse or earlier.
    fn knows(
        &self,
        method: Method,
        (risk, required_mps2): (RiskLevel, f64),
        earliest_s: f64,
        number: usize,
    ) -> bool {
        let tally = if method.is_map_based() { &self.path } else { &self.arc };
        tally.holds(risk, required_mps2, number)
            && (risk == RiskLevel::Safe || !self.may_show(risk, earliest_s))
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

/// What is known when the turn of one way of an object comes: which outcomes would change nothing.
#[derive(Debug, Clone, Copy)]
pub(super) struct Known<'a> {
    pub(super) findings: &'a Findings,
    /// Number of the way, from 1.
    pub(super) number: usize,
    /// True if findings on predicted paths of this object are lifted: they count for nothing.
    pub(super) lifts_paths: bool,
    pub(super) resolution_s: f64,
}

impl Known<'_> {
    /// How many outcomes of the vehicle's braking, counted from the mildest, change nothing, if passages begin with a
    /// slice of the vehicle at the earliest.
    pub(super) fn tries(&self, method: Method, tiers: &EgoTiers, begin: usize) -> usize {
        let EgoTiers { safe, danger, fatal, .. } = *tiers;
        let outcomes = [Some(safe), Some(danger), Some(fatal), Some(fatal), None];
        let changes = |required: Option<f64>| {
            !self.holds(method, risk_of(required, tiers), required.unwrap_or(f64::NEG_INFINITY), begin)
        };
        outcomes.into_iter().position(changes).unwrap_or(outcomes.len())
    }

    /// True if the object's braking, where it counts, changes nothing when it is enough.
    pub(super) fn yielding(&self, method: Method, begin: usize) -> bool {
        !method.object_may_brake()
            || [RiskLevel::Safe, RiskLevel::LowCaution]
                .iter()
                .all(|&risk| self.holds(method, risk, 0.0, begin))
    }

    /// True if it changes nothing that a case is switched off.
    pub(super) fn is_left_open(&self, method: Method) -> bool {
        self.findings.has_left_open(method)
    }

    pub(super) fn is_lifted(&self, method: Method) -> bool {
        self.lifts_paths && method.is_map_based()
    }

    fn holds(&self, method: Method, risk: RiskLevel, required_mps2: f64, begin: usize) -> bool {
        let earliest_s = begin as f64 * self.resolution_s;
        self.is_lifted(method) || self.findings.knows(method, (risk, required_mps2), earliest_s, self.number)
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
