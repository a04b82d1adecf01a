//! The case table of the specification, column U53.

use super::*;

/// The verdict of one cycle at x of the crosswalk, for a vehicle of this speed.
fn verdict(x: f64, speed_mps: f64, people: &[PredictedObject], candidate: &Candidate) -> Judgement {
    judge(&mut filter(), &scene(map_with(&[(10, x)]), speed_mps, people), candidate)
}

fn risks(judgement: &Judgement) -> Vec<(&'static str, RiskLevel)> {
    judgement.metrics.iter().map(|metric| (metric.name, metric.risk)).collect()
}

const SAFE: &[(&str, RiskLevel)] = &[(METRIC, RiskLevel::Safe)];
const DANGER: &[(&str, RiskLevel)] = &[(METRIC, RiskLevel::Danger)];

#[test]
fn trajectories_that_meet_no_crosswalk_have_no_metric() {
    let waiting = [pedestrian(1, 10.0, -7.0)];
    for empty in [candidate(&[]), candidate(&[(0.0, 5.0, 0.0)])] {
        let judgement = verdict(10.0, 5.0, &waiting, &empty);
        assert!(judgement.feasible && judgement.metrics.is_empty(), "1: no trajectory");
    }
    let without = judge(&mut filter(), &scene(map_with(&[]), 5.0, &waiting), &drive(0.0, 80.0, 5.0));
    assert!(without.feasible && without.metrics.is_empty(), "2: no crosswalk");
    let far = verdict(150.0, 5.0, &[pedestrian(1, 150.0, -7.0)], &drive(0.0, 40.0, 5.0));
    assert!(far.feasible && far.metrics.is_empty(), "3: crosswalk beyond the trajectory");
}

#[test]
fn nobody_there() {
    let judgement = verdict(10.0, 5.0, &[], &drive(0.0, 80.0, 5.0));
    assert!(judgement.feasible, "4");
    assert_eq!(risks(&judgement), SAFE);
}

#[test]
fn somebody_waits() {
    let judgement = verdict(10.0, 5.0, &[pedestrian(1, 10.0, -7.0)], &drive(0.0, 80.0, 5.0));
    assert!(!judgement.feasible, "5");
    assert_eq!(risks(&judgement), DANGER);
    assert_eq!(judgement.metrics[0].value, 0.0);
}

#[test]
fn the_vehicle_may_go_after_it_has_waited() {
    let mut filter = filter();
    let mut scene = scene(map_with(&[(10, 10.0)]), 0.0, &[pedestrian(1, 10.0, -7.0)]);
    let candidate = drive(8.0, 80.0, 5.0);
    assert!(!waits_no_more(&mut filter, &mut scene, 100.0, &candidate), "6 at the start");
    assert!(waits_no_more(&mut filter, &mut scene, 101.2, &candidate), "6 after 1.2 s");
}

#[test]
fn everybody_is_waited_for() {
    let mut filter = filter();
    let mut scene = scene(map_with(&[(10, 10.0)]), 0.0, &[pedestrian(1, 10.0, -7.0)]);
    let candidate = drive(8.0, 80.0, 5.0);
    assert!(!waits_no_more(&mut filter, &mut scene, 100.0, &candidate), "7 first person");
    set_people(&mut scene, &[pedestrian(1, 10.0, -7.0), pedestrian(2, 10.0, 7.0)]);
    assert!(!waits_no_more(&mut filter, &mut scene, 100.8, &candidate), "7 second person");
    assert!(!waits_no_more(&mut filter, &mut scene, 101.5, &candidate), "7 first person waited for");
    assert!(waits_no_more(&mut filter, &mut scene, 102.2, &candidate), "7 both waited for");
}

#[test]
fn paths_and_motion_decide_who_waits() {
    let at = || pedestrian(1, 10.0, -7.0);
    let away = || walking(at(), -90.0, 1.0);
    let toward = || walking(at(), 90.0, 1.0);
    let over = [(10.0, 0.0), (10.0, 3.0)];
    let off = [(10.0, -8.0), (10.0, -12.0)];
    let cases = [
        ("8 away", away(), true),
        ("9 toward", toward(), false),
        ("10 away, but the path leads over", with_path(away(), 0.9, &over), false),
        ("11 toward, but the path leads away", with_path(toward(), 0.9, &off), true),
        ("12 unsure path, away", with_path(away(), 0.2, &over), true),
        ("12 unsure path, toward", with_path(toward(), 0.2, &over), false),
        ("13 standing", walking(at(), -90.0, 0.0), false),
    ];
    for (name, person, feasible) in cases {
        assert_eq!(verdict(10.0, 5.0, &[person], &drive(0.0, 80.0, 5.0)).feasible, feasible, "{name}");
    }
}

/// The rows of the risk-graded line: here the verdict is DANGER wherever that line has a metric above SAFE.
#[test]
fn distance_does_not_soften_the_verdict() {
    assert_eq!(risks(&verdict(10.0, 5.0, &[], &drive(0.0, 80.0, 5.0))), SAFE, "14");
    for (name, x, speed_mps, from_m) in [
        ("15", 10.0, 5.0, 5.0),
        ("16", 10.0, 0.0, 8.0),
        ("17", 8.0833, 5.0, 0.0),
        ("18", 14.3125, 5.0, 0.0),
        ("19", 18.4583, 5.0, 0.0),
    ] {
        let judgement = verdict(x, speed_mps, &[pedestrian(1, x, -7.0)], &drive(from_m, 80.0, 5.0));
        assert_eq!(risks(&judgement), DANGER, "{name}");
    }
    let mut long = CrosswalkFilter::new(parameters(), 4.0);
    let scene = scene(map_with(&[(10, 18.4583)]), 5.0, &[pedestrian(1, 18.4583, -7.0)]);
    assert_eq!(risks(&judge(&mut long, &scene, &drive(0.0, 80.0, 5.0))), DANGER, "20");
}
