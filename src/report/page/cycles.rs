//! What moves and what is judged: one record for each cycle, in the few digits that the viewer reads.
//!
//! Paths, texts and metric names are written once and referred to by number, because the same candidate is judged again
//! as long as it is fresh.

use std::collections::{BTreeMap, HashMap};

use messages::autoware_perception_msgs::{ObjectClassification, PredictedObject, PredictedPath, Shape};
use messages::geometry_msgs::Pose as PoseMessage;
use motion::Point2;
use selection::candidate::pose_of;
use selection::{Candidate, Judgement, Validator, Verdict, data_validity};
use selector_actors::cycle::{Cycle, CycleReport, CycleTimes, Outcome, Trigger};
use serde::{Serialize, Serializer};

use super::Strings;
use super::codes::{Origin, centimetres, milliradians};
use super::scenery::colour;

/// Predicted paths are drawn in steps of about this, s.
const PREDICTION_STEP_S: f64 = 0.5;

/// The records so far.
#[derive(Debug, Default)]
pub(super) struct Cycles {
    first_ns: Option<i64>,
    generators: Strings,
    texts: Strings,
    metrics: Strings,
    objects: Strings,
    path_numbers: HashMap<Vec<i64>, usize>,
    paths: Vec<Vec<i64>>,
    signals: BTreeMap<i64, u8>,
    cycles: Vec<CycleOnPage>,
}

#[derive(Debug, Serialize)]
pub(super) struct CyclesOnPage {
    generators: Vec<String>,
    texts: Vec<String>,
    metrics: Vec<String>,
    objects: Vec<String>,
    paths: Vec<Vec<i64>>,
    cycles: Vec<CycleOnPage>,
}

/// Keys are short because there are thousands of them; the viewer names them.
#[derive(Debug, Serialize)]
struct CycleOnPage {
    /// Number.
    n: u64,
    /// 1 if an anchor started it, 0 if the timer did.
    a: u8,
    /// Time since the first cycle, ms.
    t: i64,
    /// Trigger to last output, µs.
    us: u64,
    /// Why nothing was judged.
    #[serde(skip_serializing_if = "Option::is_none")]
    why: Option<&'static str>,
    /// Vehicle: x, y \[cm\], yaw \[mrad\], speed \[cm/s\].
    #[serde(skip_serializing_if = "Option::is_none")]
    ego: Option<[i64; 4]>,
    /// Road users.
    o: Vec<ObjectOnPage>,
    /// Lights that changed, by rule.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    s: BTreeMap<i64, u8>,
    /// Which of the candidates is to be driven.
    #[serde(skip_serializing_if = "Option::is_none")]
    pick: Option<usize>,
    /// Candidates in order.
    c: Vec<CandidateOnPage>,
}

/// `[id, class, x, y, yaw, outline, [[step ms, path], ...]]`; the outline is `[length, width]` for boxes, `[diameter]`
/// for cylinders, a line in the object's frame for polygons.
#[derive(Debug, Serialize)]
struct ObjectOnPage(usize, u8, i64, i64, i64, Vec<i64>, Vec<(i64, Vec<i64>)>);

/// `[generator, sample, state, path, judgements]`; state 0 rejected, 1 accepted, 2 accepted though a shadow filter
/// objects, 3 not judged in time.
#[derive(Debug, Serialize)]
struct CandidateOnPage(usize, u32, u8, usize, Vec<JudgementOnPage>);

/// `[state, text or -1, [[metric, value, limit, risk], ...], evidence]`; state 0 objects, 1 feasible, 2 not assessed;
/// evidence `[x, y, yaw, ms, map element, object or -1]` or nothing.
#[derive(Debug, Serialize)]
struct JudgementOnPage(u8, i64, Vec<(usize, Short, Short, u8)>, Option<(i64, i64, i64, i64, i64, i64)>);

/// A number in four digits; infinities are their names, what is no number is null.
#[derive(Debug)]
struct Short(f64);

impl Serialize for Short {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self.0 {
            f64::INFINITY => return serializer.serialize_str("inf"),
            f64::NEG_INFINITY => return serializer.serialize_str("-inf"),
            value if value.is_nan() => return serializer.serialize_none(),
            _ => {}
        }
        let digits = 3 - self.0.abs().max(1e-9).log10().floor() as i32;
        let scale = 10_f64.powi(digits.clamp(0, 12));
        let short = (self.0 * scale).round() / scale;
        if short.fract() == 0.0 && short.abs() < 1e15 {
            serializer.serialize_i64(short as i64)
        } else {
            serializer.serialize_f64(short)
        }
    }
}

impl Cycles {
    pub(super) fn add(
        &mut self,
        report: &CycleReport,
        times: CycleTimes,
        validator: &Validator,
        origin: Origin,
    ) {
        let cycle = &report.cycle;
        let now_ns = cycle.scene.now.nanoseconds();
        let first_ns = *self.first_ns.get_or_insert(now_ns);
        let candidates = match &report.outcome {
            Outcome::Judged(judged) => {
                let judged = cycle.concatenated.candidates.iter().zip(&judged.verdicts);
                judged
                    .map(|(candidate, verdict)| self.candidate(candidate, verdict, validator, origin))
                    .collect()
            }
            _ => Vec::new(),
        };
        let record = CycleOnPage {
            n: cycle.number,
            a: u8::from(cycle.trigger == Trigger::Anchor),
            t: (now_ns - first_ns) / 1_000_000,
            us: u64::try_from(times.cycle.as_micros()).unwrap_or(u64::MAX),
            why: report.outcome.early_return(),
            ego: ego(cycle, origin),
            o: self.objects(cycle, origin),
            s: self.changed_signals(cycle),
            pick: chosen(&report.outcome),
            c: candidates,
        };
        self.cycles.push(record);
    }

    pub(super) fn finish(self) -> CyclesOnPage {
        CyclesOnPage {
            generators: self.generators.all,
            texts: self.texts.all,
            metrics: self.metrics.all,
            objects: self.objects.all,
            paths: self.paths,
            cycles: self.cycles,
        }
    }

    fn candidate(
        &mut self,
        candidate: &Candidate,
        verdict: &Verdict,
        validator: &Validator,
        origin: Origin,
    ) -> CandidateOnPage {
        let state = match (verdict.is_judged(), verdict.accepted, verdict.feasible) {
            (false, ..) => 3,
            (true, false, _) => 0,
            (true, true, true) => 1,
            (true, true, false) => 2,
        };
        let validity = &verdict.data_validity;
        let mut judgements =
            vec![self.judgement(validity, data_validity::explain(validity), candidate, origin)];
        for (filter, said) in validator.filters().iter().zip(&verdict.judgements) {
            judgements.push(self.judgement(said, filter.explain(said), candidate, origin));
        }
        let generator = self.generators.number(&candidate.generator_name);
        let path = self.path(origin.line(candidate.points.iter().map(|point| point.pose.point())));
        CandidateOnPage(generator, verdict.key.sample, state, path, judgements)
    }

    fn path(&mut self, path: Vec<i64>) -> usize {
        let next = self.paths.len();
        let number = *self.path_numbers.entry(path.clone()).or_insert(next);
        if number == next {
            self.paths.push(path);
        }
        number
    }

    fn judgement(
        &mut self,
        said: &Judgement,
        text: Option<String>,
        candidate: &Candidate,
        origin: Origin,
    ) -> JudgementOnPage {
        let state = match (&said.failure, said.feasible) {
            (Some(_), _) => 2,
            (None, true) => 1,
            (None, false) => 0,
        };
        let text = text.map_or(-1, |text| as_code(self.texts.number(&text)));
        let metrics = said.metrics.iter().map(|metric| {
            (
                self.metrics.number(metric.name),
                Short(metric.value),
                Short(metric.threshold),
                metric.risk as u8,
            )
        });
        let metrics = metrics.collect();
        let evidence = said.evidence.map(|at| {
            let [x, y] = origin.code(Point2::new(at.x_m, at.y_m));
            let yaw = candidate.points.get(at.index).map_or(0.0, |point| point.pose.yaw());
            let milliseconds = (at.time_s * 1000.0).round() as i64;
            let object = at.object_id.map_or(-1, |id| as_code(self.objects.number(&id.to_string())));
            (x, y, milliradians(yaw), milliseconds, at.element_id.unwrap_or(0), object)
        });
        JudgementOnPage(state, text, metrics, evidence)
    }

    fn objects(&mut self, cycle: &Cycle, origin: Origin) -> Vec<ObjectOnPage> {
        let Some(objects) = &cycle.scene.objects else { return Vec::new() };
        objects.objects.iter().map(|object| self.object(object, origin)).collect()
    }

    fn object(&mut self, object: &PredictedObject, origin: Origin) -> ObjectOnPage {
        let pose = pose_of(&object.kinematics.initial_pose_with_covariance.pose);
        let [x, y] = origin.code(pose.point());
        let likeliest = object.classification.iter().max_by(|a, b| a.probability.total_cmp(&b.probability));
        let class = likeliest.map_or(ObjectClassification::UNKNOWN, |class| class.label);
        let paths = object.kinematics.predicted_paths.iter().map(|path| prediction(path, origin)).collect();
        let id = self.objects.number(&object.object_id.to_string());
        ObjectOnPage(id, class, x, y, milliradians(pose.yaw()), outline(&object.shape), paths)
    }

    /// The lights that show something else than in the cycle before.
    fn changed_signals(&mut self, cycle: &Cycle) -> BTreeMap<i64, u8> {
        let Some(signals) = &cycle.scene.traffic_signals else { return BTreeMap::new() };
        let shown = signals
            .traffic_light_groups
            .iter()
            .map(|group| (group.traffic_light_group_id, colour(&group.elements)));
        let changed: BTreeMap<_, _> =
            shown.filter(|(id, colour)| self.signals.get(id) != Some(colour)).collect();
        self.signals.extend(&changed);
        changed
    }
}

/// Place of the candidate whose trajectory was put out.
fn chosen(outcome: &Outcome) -> Option<usize> {
    let Outcome::Judged(judged) = outcome else { return None };
    let best = judged.ranking.best()?;
    judged.selected.is_some().then_some(best.index)
}

fn as_code(number: usize) -> i64 {
    i64::try_from(number).unwrap_or(-1)
}

fn ego(cycle: &Cycle, origin: Origin) -> Option<[i64; 4]> {
    let odometry = cycle.scene.odometry.as_ref()?;
    let pose = pose_of(&odometry.pose.pose);
    let [x, y] = origin.code(pose.point());
    Some([x, y, milliradians(pose.yaw()), centimetres(odometry.twist.twist.linear.x)])
}

fn outline(shape: &Shape) -> Vec<i64> {
    match shape.r#type {
        Shape::CYLINDER => vec![centimetres(shape.dimensions.x)],
        Shape::POLYGON => {
            let corners = shape.footprint.points.iter();
            Origin::default().line(corners.map(|corner| Point2::new(corner.x.into(), corner.y.into())))
        }
        _ => vec![centimetres(shape.dimensions.x), centimetres(shape.dimensions.y)],
    }
}

/// Every so many poses, so that the steps are long enough to be seen.
fn prediction(path: &PredictedPath, origin: Origin) -> (i64, Vec<i64>) {
    let step_s = path.time_step.seconds();
    let every = if step_s > 0.0 { (PREDICTION_STEP_S / step_s).round().max(1.0) as usize } else { 1 };
    let point = |pose: &PoseMessage| Point2::new(pose.position.x, pose.position.y);
    let points = path.path.iter().map(point).filter(|point| point.x.is_finite() && point.y.is_finite());
    let line = origin.steps(points.step_by(every));
    ((step_s * every as f64 * 1000.0).round() as i64, line)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_keep_four_digits() {
        let short = |value| serde_json::to_string(&Short(value)).unwrap();
        for (value, expected) in [
            (0.0, "0"),
            (12.0, "12"),
            (1.234_567, "1.235"),
            (-0.012_345, "-0.01235"),
            (123_456.7, "123457"),
            (f64::NAN, "null"),
            (f64::INFINITY, "\"inf\""),
            (f64::NEG_INFINITY, "\"-inf\""),
            (1e-30, "0"),
        ] {
            assert_eq!(short(value), expected, "{value}");
        }
    }
}
