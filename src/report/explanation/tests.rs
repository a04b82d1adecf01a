//! Explanations hold every judgement, and say why.

use super::*;

use std::sync::Arc;

use messages::autoware_internal_planning_msgs::CandidateTrajectory;
use messages::autoware_planning_msgs::TrajectoryPoint;
use messages::builtin_interfaces::Duration;
use messages::geometry_msgs::{Point, Pose};
use messages::unique_identifier_msgs::Uuid;
use motion::VehicleInfo;
use selection::parameters::ValidatorParameters;
use selection::{Evidence, Filter, Metric, RiskLevel, Scene, Scratch};
use serde_json::{Value, json};

/// Objects to what is fast at point 1, cannot judge what stands still, and panics on reverse.
struct Guard;

impl Filter for Guard {
    fn name(&self) -> &'static str {
        "a_guard"
    }

    fn configure(&mut self, _: &ValidatorParameters) {}

    fn judge(&self, _: &Scene, candidate: &Candidate, _: &mut Scratch) -> Judgement {
        let speed = candidate.points[1].longitudinal_velocity_mps;
        assert!(speed >= 0.0, "reverse");
        if speed == 0.0 {
            return Judgement::not_assessed("no route");
        }
        let feasible = speed < 10.0;
        let risk = if feasible { RiskLevel::Safe } else { RiskLevel::Danger };
        let metric = Metric { name: "guard", value: f64::from(speed), threshold: f64::NAN, risk };
        let place = Evidence {
            element_id: Some(-7),
            regulatory_element_id: Some(8),
            object_id: Some(Uuid { uuid: [0xab; 16] }),
            ..Evidence::at(candidate, 1)
        };
        Judgement { feasible, evidence: (!feasible).then_some(place), ..Judgement::feasible([metric]) }
    }

    fn explain(&self, judgement: &Judgement) -> Option<String> {
        let at = judgement.evidence?;
        Some(format!("meets the guard at {:.1} s", at.time_s))
    }

    fn not_assessed(&self, judgement: &Judgement) -> Option<String> {
        judgement.feasible.then(|| "what is slow".to_owned())
    }
}

fn candidate(sample: u32, points: usize, speed: f32) -> Candidate {
    let point = |index: usize| TrajectoryPoint {
        time_from_start: Duration::from_nanoseconds(index as i64 * 500_000_000),
        pose: Pose { position: Point { x: index as f64, y: 2.0, z: 0.0 }, ..Pose::default() },
        longitudinal_velocity_mps: speed,
        ..TrajectoryPoint::default()
    };
    let message =
        CandidateTrajectory { points: (0..points).map(point).collect(), ..CandidateTrajectory::default() };
    Candidate::new(Arc::new(message), "planner".into(), sample)
}

fn explained(candidates: &[Candidate]) -> Explanation {
    let vehicle = VehicleInfo::default();
    let parameters = ValidatorParameters {
        filter_names: Vec::new(),
        shadow_mode_filter_names: vec!["safety::VehicleConstraintFilter".to_owned()],
        ..ValidatorParameters::default()
    };
    let mut validator = Validator::new(parameters, &vehicle).unwrap();
    validator.load("test", Enforcement::Enforced, Arc::new(|_: &ValidatorParameters| Box::new(Guard)));
    let stamp = Time { sec: 1_690_000_000, nanosec: 123_456_789 };
    let scene = Scene::empty(stamp, Arc::new(vehicle));
    let mut scratch = Scratch::default();
    let verdicts: Vec<Verdict> = candidates
        .iter()
        .map(|candidate| validator.judge(&scene, candidate, &mut scratch, || 0, &mut []))
        .collect();
    explain(&validator, candidates, &verdicts, 12, "anchor", stamp)
}

/// Fine, beyond both filters, not judged, panic, too short.
fn five() -> Explanation {
    explained(&[
        candidate(0, 2, 5.0),
        candidate(1, 3, 20.0),
        candidate(2, 2, 0.0),
        candidate(3, 2, -1.0),
        candidate(4, 1, 5.0),
    ])
}

#[test]
fn the_keys_are_those_of_the_contract() {
    let value = serde_json::to_value(five()).unwrap();
    assert_eq!((&value["cycle"], &value["trigger"]), (&json!(12), &json!("anchor")));
    assert_eq!(value["stamp_ns"], json!(1_690_000_000_123_456_789_i64));
    assert_eq!(value["stamp"], json!(1_690_000_000.123_456_8));
    let rejected = &value["candidates"][1];
    assert_eq!(
        (&rejected["key"], &rejected["generator"], &rejected["accepted"]),
        (&json!(format!("{}#1", "0".repeat(32))), &json!("planner"), &json!(false))
    );
    assert_eq!(
        rejected["judgements"][1],
        json!({
            "filter": "a_guard", "enforced": true, "feasible": false, "assessed": true, "not_assessed": null,
            "metrics": [{"name": "guard", "value": 20.0, "threshold": "nan", "risk": "danger"}],
            "evidence": {
                "index": 1, "time_s": 0.5, "x": 1.0, "y": 2.0, "element_id": -7, "regulatory_element_id": 8,
                "object_id": "ab".repeat(16), "text": "meets the guard at 0.5 s"
            }
        })
    );
}

#[test]
fn every_judgement_is_there_in_order_of_evaluation() {
    let explanation = five();
    for (candidate, filters) in explanation.candidates.iter().zip([3, 3, 3, 3, 1]) {
        let names: Vec<_> = candidate.judgements.iter().map(|judgement| judgement.filter).collect();
        assert_eq!(names, ["data_validity", "a_guard", "vehicle_constraint_filter"][..filters]);
        assert!(candidate.judgements[0].enforced);
    }
    let accepted: Vec<bool> = explanation.candidates.iter().map(|candidate| candidate.accepted).collect();
    assert_eq!(accepted, [true, false, false, false, false]);
    let shadow = &explanation.candidates[1].judgements[2];
    assert_eq!((shadow.enforced, shadow.feasible, shadow.metrics[0].risk), (false, false, "high_caution"));
}

#[test]
fn what_has_no_place_has_a_text_all_the_same() {
    let explanation = five();
    let guard = |candidate: usize| &explanation.candidates[candidate].judgements[1];
    assert_eq!((&guard(0).evidence, guard(0).not_assessed.as_deref()), (&None, Some("what is slow")));
    for candidate in [2, 3] {
        assert!(!guard(candidate).assessed && !guard(candidate).feasible);
    }
    let value = serde_json::to_value(&explanation).unwrap();
    let short = &value["candidates"][4]["judgements"][0];
    assert_eq!(
        (&short["evidence"]["text"], &short["evidence"]["index"]),
        (&json!("too few points; first at point 0"), &json!(0))
    );
    let nothing_received = explained(&[candidate(0, 0, 1.0)]);
    let value: Value = serde_json::to_value(nothing_received).unwrap();
    assert_eq!(value["candidates"][0]["judgements"][0]["evidence"]["index"], Value::Null);
}

#[test]
fn people_read_one_line_for_each_objection() {
    let key = "0".repeat(32);
    let expected = format!(
        "cycle 12 (anchor, 1690000000.123456789 s): 1 of 5 candidates accepted
  planner {key}#0: accepted
    a_guard, not assessed: what is slow
  planner {key}#1: rejected
    a_guard: meets the guard at 0.5 s
    vehicle_constraint_filter (shadow): check_speed is 20.000, the limit is 16.700; first at point 0 after 0.0 s, (0.0, 2.0)
  planner {key}#2: rejected
    a_guard, not assessed: no route
  planner {key}#3: rejected
    a_guard, not assessed: panic: reverse
  planner {key}#4: rejected
    data_validity: too few points; first at point 0
"
    );
    assert_eq!(five().to_string(), expected);
}
