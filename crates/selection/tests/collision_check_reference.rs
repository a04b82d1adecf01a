//! The collision check against an independent reference: dense sampling of closed-form motions, polygons clipped
//! against each other. Random scenes of one object; and properties that hold whatever the scene.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

#[path = "collision_support/scenes.rs"]
mod scenes;

use messages::autoware_perception_msgs::{ObjectClassification, PredictedObject};
use messages::unique_identifier_msgs::Uuid;
use proptest::prelude::*;
use proptest::strategy::ValueTree;
use scenes::*;
use selection::filters::collision_check::CollisionCheckFilter;
use selection::parameters::{CollisionCheckParameters, PerClass};
use selection::{Filter, Judgement, RiskLevel, Scene, Scratch};
use std::f64::consts::PI;

const CAR: u8 = ObjectClassification::CAR;
type Polygon = Vec<(f64, f64)>;

/// Rectangle around a pose: front, rear, half width.
fn rectangle((x, y, yaw): (f64, f64, f64), (front, rear, half): (f64, f64, f64)) -> Polygon {
    let (sin, cos) = yaw.sin_cos();
    [(front, half), (-rear, half), (-rear, -half), (front, -half)]
        .iter()
        .map(|(u, v)| (x + cos * u - sin * v, y + sin * u + cos * v))
        .collect()
}

/// Clips a polygon at the left side of every edge of a counter-clockwise convex one (Sutherland-Hodgman).
fn clipped(subject: &Polygon, clip: &Polygon) -> Polygon {
    let mut result = subject.clone();
    for k in 0..clip.len() {
        let (a, b) = (clip[k], clip[(k + 1) % clip.len()]);
        let side = |p: (f64, f64)| (b.0 - a.0) * (p.1 - a.1) - (b.1 - a.1) * (p.0 - a.0);
        let input = std::mem::take(&mut result);
        for i in 0..input.len() {
            let (p, q) = (input[i], input[(i + 1) % input.len()]);
            let (sp, sq) = (side(p), side(q));
            if sp >= 0.0 {
                result.push(p);
            }
            if (sp >= 0.0) != (sq >= 0.0) {
                let t = sp / (sp - sq);
                result.push((p.0 + t * (q.0 - p.0), p.1 + t * (q.1 - p.1)));
            }
        }
    }
    result
}

fn overlap(a: &Polygon, b: &Polygon) -> bool {
    let (dx, dy) = (a[0].0 - b[0].0, a[0].1 - b[0].1);
    dx * dx + dy * dy < 400.0 && !clipped(a, b).is_empty()
}

#[derive(Debug, Clone, Copy)]
struct Case {
    ego: Arc2,
    speed: f64,
    object: Arc2,
    object_speed: f64,
    length: f64,
    width: f64,
}

/// What is made larger or smaller to bracket the answer.
#[derive(Debug, Clone, Copy)]
struct Slack {
    size_m: f64,
    time_s: f64,
}

const STEP_S: f64 = 0.04;
const EGO_HORIZON_S: f64 = 8.0;

/// Distance after braking from `start` on.
fn braked(speed: f64, t: f64, braking: Option<(f64, f64)>) -> f64 {
    let Some((start, acceleration)) = braking else { return speed * t };
    if t <= start {
        return speed * t;
    }
    let since = (t - start).min(speed / -acceleration);
    speed * start + speed * since + 0.5 * acceleration * since * since
}

impl Case {
    fn ego_at(&self, t: f64, braking: Option<(f64, f64)>, grow: f64) -> Polygon {
        let s = braked(self.speed, t, braking);
        // front 4 + margin 1, rear 1, half width 1 + margin 0.3
        rectangle(self.ego.at(s), (5.0 + grow, 1.0 + grow, 1.3 + grow))
    }

    fn object_at(&self, t: f64) -> Polygon {
        let (l, w) = (self.length / 2.0, self.width / 2.0);
        rectangle(self.object.at(self.object_speed * t), (l, l, w))
    }

    /// Does the vehicle pass a place where the object is up to 1 s earlier or 0.6 s later?
    fn passes(&self, horizon: f64, braking: Option<(f64, f64)>, slack: Slack) -> bool {
        let count = (horizon / STEP_S) as usize + 1;
        let objects: Vec<Polygon> = (0..count).map(|k| self.object_at(k as f64 * STEP_S)).collect();
        let end = EGO_HORIZON_S.min(horizon + 1.0 + slack.time_s);
        (0..=(end / STEP_S) as usize).any(|i| {
            let t = i as f64 * STEP_S;
            let ego = self.ego_at(t, braking, slack.size_m);
            let (from, to) = (t - 1.0 - slack.time_s, t + 0.6 + slack.time_s);
            let first = (from / STEP_S).ceil().max(0.0) as usize;
            let last = ((to / STEP_S).floor().max(-1.0) + 1.0) as usize;
            objects.get(first..last.min(count)).unwrap_or_default().iter().any(|object| overlap(&ego, object))
        })
    }

    fn risk(&self, horizon: f64, slack: Slack) -> RiskLevel {
        if !self.passes(horizon, None, slack) {
            return RiskLevel::Safe;
        }
        for (acceleration, delay, risk) in
            [(-1.5, 0.5, RiskLevel::Safe), (-3.0, 0.5, RiskLevel::Danger), (-6.0, 0.5, RiskLevel::Fatal)]
        {
            if !self.passes(horizon, Some((delay, acceleration)), slack) {
                return risk;
            }
        }
        RiskLevel::Fatal
    }

    /// Distance at which the swept path first touches the object where it is now.
    fn distance(&self, grow: f64) -> Option<f64> {
        let standing = self.object_at(0.0);
        (0..=(self.speed * EGO_HORIZON_S / 0.05) as usize)
            .map(|k| k as f64 * 0.05)
            .find(|&s| overlap(&rectangle(self.ego.at(s), (4.0 + grow, 1.0 + grow, 1.0 + grow)), &standing))
    }

    fn scene(&self) -> Scene {
        let object = object(1, CAR, self.object, self.object_speed, self.length, self.width);
        // the path is the same arc, for as long
        let path_points: Vec<_> =
            (0..=16).map(|k| self.object.at(self.object_speed * 0.5 * f64::from(k))).collect();
        let mut object = predicted(object, self.object, self.object_speed, 17);
        assert_eq!(object.kinematics.predicted_paths[0].path.len(), path_points.len());
        object.existence_probability = 1.0;
        scene(self.speed, vec![object])
    }
}

/// With the object always counting as earlier the risk follows from the required braking alone.
fn always_braking() -> CollisionCheckParameters {
    let mut parameters = CollisionCheckParameters::default();
    parameters.drac.pet_margin.object_earlier_judgement_bias = PerClass::all(60.0);
    parameters
}

prop_compose! {
    fn any_case()(
        (ego_yaw, ego_curvature, speed) in (-PI..PI, -0.03..0.03_f64, 0.0..14.0_f64),
        (along, aside, turn) in (-5.0..50.0_f64, -12.0..12.0_f64, -PI..PI),
        (curvature, object_speed) in (-0.1..0.1_f64, 0.5..12.0_f64),
        (length, width) in (0.3..6.0_f64, 0.3..2.5_f64),
    ) -> Case {
        let ego = Arc2 { x: 1000.0, y: -500.0, yaw: ego_yaw, curvature: ego_curvature };
        let (x, y, yaw) = ego.at(along);
        let (sin, cos) = yaw.sin_cos();
        let object = Arc2 { x: x - sin * aside, y: y + cos * aside, yaw: yaw + turn, curvature };
        Case { ego, speed, object, object_speed, length, width }
    }
}

fn risk_bracket(case: &Case, horizon: f64) -> (RiskLevel, RiskLevel) {
    // Sampled arcs run up to 2 cm inside of the true ones; slices of 0.1 s join what is up to 0.1 s apart, and a
    // predicted path is a polygon whose corners are 0.5 s apart.
    let bend = 0.125 * case.object.curvature.abs() * (0.5 * case.object_speed).powi(2);
    (
        case.risk(horizon, Slack { size_m: -0.05 - bend, time_s: -1e-6 }),
        case.risk(horizon, Slack { size_m: 0.2 + bend, time_s: 0.1 + STEP_S }),
    )
}

#[test]
fn random_scenes_agree_with_the_reference() {
    let mut runner = proptest::test_runner::TestRunner::deterministic();
    let (mut sharp, mut risky, mut total) = (0, 0, 0);
    for _ in 0..150 {
        let case = any_case().new_tree(&mut runner).unwrap().current();
        let judgement = judge(&case.scene(), &candidate(case.ego, case.speed, 81), &always_braking());
        assert_eq!(judgement.failure, None);
        for (metric, horizon) in [(0, 8.0), (1, 1.0)] {
            let (least, most) = risk_bracket(&case, horizon);
            let risk = judgement.metrics[metric].risk;
            assert!(least <= risk && risk <= most, "{least} <= {risk} <= {most}: {case:?} {judgement:?}");
            sharp += i32::from(least == most);
            risky += i32::from(least == most && least > RiskLevel::Safe);
            total += 1;
        }
        let required = |distance: Option<f64>, add: f64| {
            let Some(distance) = distance else { return 0.0 };
            let relative = case.object.yaw - nearest_yaw(&case);
            let object = (case.object_speed * relative.cos()).clamp(0.0, 30.0);
            let free = distance + add - 2.0 + object * object / 8.0 - case.speed * 0.4;
            if free <= 0.0 { f64::NEG_INFINITY } else { -case.speed * case.speed / (2.0 * free) }
        };
        let (hardest, mildest) =
            (required(case.distance(0.05), -0.3), required(case.distance(-0.05), 0.1 * case.speed + 0.3));
        let value = judgement.metrics[2].value;
        assert!(hardest <= value && value <= mildest, "{hardest} <= {value} <= {mildest}: {case:?}");
    }
    eprintln!("{sharp} of {total} risks are known exactly, {risky} of them not safe");
    assert!(
        sharp * 10 > total * 7 && risky * 20 > total,
        "the brackets say too little: {sharp}, {risky} of {total}"
    );
}

/// Yaw of the path where it is nearest to the object.
fn nearest_yaw(case: &Case) -> f64 {
    let squared = |s: f64| {
        let (x, y, _) = case.ego.at(s);
        (x - case.object.x).powi(2) + (y - case.object.y).powi(2)
    };
    let end = (case.speed * EGO_HORIZON_S / 0.05) as usize;
    let best = (0..=end).map(|k| k as f64 * 0.05).min_by(|a, b| squared(*a).total_cmp(&squared(*b)));
    case.ego.at(best.unwrap_or(0.0)).2
}

/// What the reference is sure to hit is hit at every time resolution.
#[test]
fn every_resolution_finds_every_contact() {
    let mut runner = proptest::test_runner::TestRunner::deterministic();
    let mut found = 0;
    for _ in 0..120 {
        let case = any_case().new_tree(&mut runner).unwrap().current();
        let bend = 0.125 * case.object.curvature.abs() * (0.5 * case.object_speed).powi(2);
        let slack = Slack { size_m: -0.05 - bend, time_s: -1e-6 };
        if case.passes(8.0, None, slack) {
            found += 1;
            let least = case.risk(8.0, slack);
            for resolution in [0.02, 0.05, 0.13, 0.25, 0.5, 1.0] {
                let mut parameters = always_braking();
                parameters.global_setting.time_resolution = resolution;
                let judgement = judge(&case.scene(), &candidate(case.ego, case.speed, 81), &parameters);
                // Search ticks are whole multiples of the resolution; only those that reach both limits can promise.
                if [0.02, 0.05].contains(&resolution) {
                    assert!(judgement.metrics[0].risk >= least, "{resolution}: {case:?}");
                }
                assert!(
                    judgement.metrics[0].value < 0.0 || least == RiskLevel::Safe || resolution > 0.2,
                    "{resolution}: {case:?}"
                );
            }
        }
    }
    assert!(found > 20, "{found}");
}

/// Where vehicle and object are in one place at one time, they meet at every resolution, the finest as the coarsest.
#[test]
fn finer_sampling_never_loses_a_contact() {
    let mut runner = proptest::test_runner::TestRunner::deterministic();
    let mut parameters = always_braking();
    parameters.drac.pet_margin.ego_earlier = PerClass::all(0.0);
    parameters.drac.pet_margin.object_earlier = PerClass::all(0.0);
    let mut found = 0;
    for _ in 0..400 {
        let case = any_case().new_tree(&mut runner).unwrap().current();
        let bend = 0.125 * case.object.curvature.abs() * (0.5 * case.object_speed).powi(2);
        let touches = (0..=(EGO_HORIZON_S / STEP_S) as usize).any(|step| {
            let t = step as f64 * STEP_S;
            overlap(&case.ego_at(t, None, -0.05 - bend), &case.object_at(t))
        });
        if !touches {
            continue;
        }
        found += 1;
        for resolution in [1.0, 0.5, 0.25, 0.125, 0.0625, 0.03125] {
            parameters.global_setting.time_resolution = resolution;
            let judgement = judge(&case.scene(), &candidate(case.ego, case.speed, 81), &parameters);
            assert!(judgement.metrics[0].value < 0.0, "{resolution} s: {case:?} {judgement:?}");
        }
    }
    assert!(found > 20, "{found}");
}

fn transformed(case: &Case, x: f64, y: f64, turn: f64) -> Case {
    let (sin, cos) = turn.sin_cos();
    let moved = |arc: Arc2| Arc2 {
        x: x + cos * arc.x - sin * arc.y,
        y: y + sin * arc.x + cos * arc.y,
        yaw: arc.yaw + turn,
        ..arc
    };
    Case { ego: moved(case.ego), object: moved(case.object), ..*case }
}

fn several(cases: &[Case]) -> Vec<PredictedObject> {
    cases
        .iter()
        .zip(1..)
        .map(|(case, id)| {
            let mut object = case.scene().objects.unwrap().objects[0].clone();
            object.object_id = Uuid { uuid: [id; 16] };
            object
        })
        .collect()
}

fn risks(judgement: &Judgement) -> Vec<RiskLevel> {
    judgement.metrics.iter().map(|metric| metric.risk).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]

    #[test]
    fn a_smaller_vehicle_has_no_greater_risk(case in any_case(), scale in 0.3..1.0_f64) {
        let (scene, candidate) = (case.scene(), candidate(case.ego, case.speed, 81));
        let large = judge(&scene, &candidate, &always_braking());
        let small = judge_as(&sized_vehicle(scale), &scene, &candidate, &always_braking());
        for (small, large) in risks(&small).into_iter().zip(risks(&large)) {
            prop_assert!(small <= large);
        }
    }

    #[test]
    fn objects_add_up_in_any_order(cases in proptest::collection::vec(any_case(), 1..5)) {
        let parameters = CollisionCheckParameters::default();
        let objects = several(&cases);
        let candidate = candidate(cases[0].ego, cases[0].speed, 81);
        let speed = cases[0].speed;
        let all = judge(&scene(speed, objects.clone()), &candidate, &parameters);
        let reversed = judge(&scene(speed, objects.iter().rev().cloned().collect()), &candidate, &parameters);
        prop_assert_eq!(format!("{all:?}"), format!("{reversed:?}"));
        let alone = objects.iter().map(|object| judge(&scene(speed, vec![object.clone()]), &candidate, &parameters));
        let mut worst = vec![RiskLevel::Safe; 3];
        for judgement in alone {
            for (worst, risk) in worst.iter_mut().zip(risks(&judgement)) {
                *worst = risk.max(*worst);
            }
        }
        prop_assert_eq!(risks(&all), worst);
    }

    #[test]
    fn candidates_do_not_see_each_other(cases in proptest::collection::vec(any_case(), 2..5)) {
        let mut filter = CollisionCheckFilter::new(&CollisionCheckParameters::default(), &vehicle());
        filter.observe(&scene(cases[0].speed, several(&cases)));
        let scene = scene(0.0, vec![]);
        let candidates: Vec<_> = cases.iter().map(|case| candidate(case.ego, case.speed, 81)).collect();
        let mut shared = Scratch::default();
        for candidate in candidates.iter().chain(candidates.iter().rev()) {
            let with_shared = filter.judge(&scene, candidate, &mut shared);
            let fresh = filter.judge(&scene, candidate, &mut Scratch::default());
            prop_assert_eq!(format!("{with_shared:?}"), format!("{fresh:?}"));
        }
    }

    #[test]
    fn moving_the_scene_changes_no_verdict(
        case in any_case(), (x, y, turn) in (-5e3..5e3_f64, -5e3..5e3_f64, -PI..PI),
    ) {
        // Away from exact contact, where rounding decides: a grain more or less of vehicle gives the same answer.
        let parameters = CollisionCheckParameters::default();
        let at = |case: &Case, grain: f64| {
            let mut parameters = parameters.clone();
            parameters.drac.ego_footprint_margin.lateral = PerClass::all(0.3 + grain);
            parameters.drac.ego_footprint_margin.front = PerClass::all(1.0 + grain);
            judge(&case.scene(), &candidate(case.ego, case.speed, 81), &parameters)
        };
        let here = at(&case, 0.0);
        prop_assume!(risks(&here) == risks(&at(&case, 1e-5)) && risks(&here) == risks(&at(&case, -1e-5)));
        prop_assert_eq!(risks(&here), risks(&at(&transformed(&case, x, y, turn), 0.0)));
    }
}
