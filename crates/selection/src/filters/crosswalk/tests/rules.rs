//! Each rule of the specification at its edge: what decides, and on which side equality falls.

use super::*;
use crate::parameters::ObjectClass;

const AT: (f64, f64) = (10.0, -7.0);

fn rejects(filter: &mut CrosswalkFilter, person: PredictedObject, candidate: &Candidate) -> bool {
    !judge(filter, &scene(map_with(&[(10, 10.0)]), 5.0, &[person]), candidate).feasible
}

/// True if a person makes a plain drive over the crosswalk infeasible.
fn blocks(person: PredictedObject) -> bool {
    rejects(&mut filter(), person, &drive(0.0, 80.0, 5.0))
}

fn person() -> PredictedObject {
    pedestrian(1, AT.0, AT.1)
}

fn classified(classes: &[ObjectClassification]) -> PredictedObject {
    PredictedObject { classification: classes.to_vec(), ..person() }
}

#[test]
fn the_likeliest_class_decides_whom_to_yield_to() {
    use ObjectClassification as C;
    let cases: [(&str, &[C], bool); 8] = [
        ("pedestrian", &[class(C::PEDESTRIAN, 0.4)], true),
        ("bicycle", &[class(C::BICYCLE, 0.4)], true),
        ("car", &[class(C::CAR, 0.9)], false),
        ("likeliest comes second", &[class(C::CAR, 0.3), class(C::PEDESTRIAN, 0.7)], true),
        ("likeliest comes first", &[class(C::CAR, 0.7), class(C::PEDESTRIAN, 0.3)], false),
        ("first of equals", &[class(C::PEDESTRIAN, 0.5), class(C::CAR, 0.5)], true),
        ("second of equals", &[class(C::CAR, 0.5), class(C::PEDESTRIAN, 0.5)], false),
        ("label from the future", &[class(200, 0.9)], false),
    ];
    for (name, classes, expected) in cases {
        assert_eq!(blocks(classified(classes)), expected, "{name}");
    }
    // The message carries 32 bits: what differs behind them is equal.
    let (a, b) = (0.1_f64 + 0.2, 0.3_f64);
    assert!(a != b);
    assert!(!blocks(classified(&[class(C::CAR, b as f32), class(C::PEDESTRIAN, a as f32)])));
}

#[test]
fn nobody_knows_what_means_unknown() {
    assert!(!blocks(classified(&[])), "unknown objects are not yielded to by default");
    let mut filter = filter_with(|p| p.object_types = vec![ObjectClass::Unknown]);
    assert!(rejects(&mut filter, classified(&[]), &drive(0.0, 80.0, 5.0)));
}
#[test]
fn every_class_can_be_yielded_to() {
    for class in ObjectClass::ALL {
        let label = match class {
            ObjectClass::Unknown => 0,
            ObjectClass::Car => 1,
            ObjectClass::Truck => 2,
            ObjectClass::Bus => 3,
            ObjectClass::Trailer => 4,
            ObjectClass::Motorcycle => 5,
            ObjectClass::Bicycle => 6,
            ObjectClass::Pedestrian => 7,
            ObjectClass::Animal => 8,
            ObjectClass::Hazard => 9,
            ObjectClass::OverDrivable => 10,
            ObjectClass::UnderDrivable => 11,
        };
        for candidate_label in 0..=12 {
            let mut filter = filter_with(|p| p.object_types = vec![*class]);
            let object = classified(&[ObjectClassification { label: candidate_label, probability: 1.0 }]);
            let expected = candidate_label == label;
            assert_eq!(rejects(&mut filter, object, &drive(0.0, 80.0, 5.0)), expected, "{class:?}");
        }
    }
}

#[test]
fn detection_areas_lie_beyond_both_ends_of_the_crosswalk() {
    let cases = [
        ("inside", 10.0, -7.0, true),
        ("corner", 13.0, -8.0, true),
        ("just within the tolerance", 10.0, -8.0 - 0.9e-3, true),
        ("just beyond it", 10.0, -8.0 - 1.1e-3, false),
        ("beside", 13.0 + 1.1e-3, -7.0, false),
        ("on the crosswalk", 10.0, -5.9, false),
        ("at the edge of the crosswalk", 10.0, -6.0, true),
        ("other end", 7.0, 8.0, true),
        ("beyond the other end", 7.0, 8.1, false),
    ];
    for (name, x, y, expected) in cases {
        assert_eq!(blocks(pedestrian(1, x, y)), expected, "{name}");
    }
    let mut off = filter_with(|p| p.lon_detection_margin = 1e-3);
    assert!(!rejects(&mut off, person(), &drive(0.0, 80.0, 5.0)), "no margin, no areas");
    let mut tiny = filter_with(|p| p.lon_detection_margin = 2e-3);
    assert!(rejects(&mut tiny, pedestrian(1, 10.0, -6.001), &drive(0.0, 80.0, 5.0)));
}

#[test]
fn a_sure_path_has_the_last_word() {
    let over = [(10.0, 0.0)];
    let cases = [
        ("0.5 is sure", 0.5, &over[..], true),
        ("just below is not", 0.499_999_97, &over, false),
        ("a point on the border is on the crosswalk", 0.9, &[(8.0, 0.0)], true),
        ("segments do not count, only points", 0.9, &[(10.0, -9.0), (10.0, 9.0)], false),
    ];
    for (name, confidence, places, expected) in cases {
        let away = walking(person(), -90.0, 1.0);
        assert_eq!(blocks(with_path(away, confidence, places)), expected, "{name}");
    }
    assert_eq!((0.499_999_999_f64 as f32).to_bits(), 0.5_f32.to_bits(), "the message rounds it up to sure");
    let standing = with_path(person(), 0.9, &[(10.0, -12.0)]);
    assert!(!blocks(standing), "even for somebody who stands");
    let two = with_path(with_path(person(), 0.6, &[(10.0, -12.0)]), 0.5, &over);
    assert!(blocks(two), "one of several sure paths is enough");
}

#[test]
fn slow_people_wait_and_others_must_come_nearer() {
    let cases = [
        ("below 0.1 m/s", -90.0, 0.099, true),
        ("at 0.1 m/s away", -90.0, 0.1, false),
        ("backwards at 0.1 m/s, facing the road", 90.0, -0.1, false),
        ("backwards at 0.1 m/s, facing away", -90.0, -0.1, true),
        ("a little towards", 1.0, 1.0, true),
        ("a little away", -1.0, 1.0, false),
    ];
    for (name, yaw_deg, speed_mps, expected) in cases {
        assert_eq!(blocks(walking(person(), yaw_deg, speed_mps)), expected, "{name}");
    }
    // Exactly along the entry is not towards it.
    let mut along = person();
    along.kinematics.initial_twist_with_covariance.twist.linear.x = 1.0;
    assert!(!blocks(along.clone()));
    // Sideways speed counts for the direction, but not for standing.
    along.kinematics.initial_twist_with_covariance.twist.linear.y = 0.01;
    assert!(blocks(along.clone()));
    let mut sideways = person();
    sideways.kinematics.initial_twist_with_covariance.twist.linear.y = -5.0;
    assert!(blocks(sideways), "no forward speed: stands");
}

#[test]
fn signalised_crosswalks_and_those_without_stop_line_are_not_targets() {
    let mut signalised = Sketch::new();
    signalised.crosswalk(10, 10.0);
    signalised.stop_line(12, &[(10.0, -5.0), (10.0, 5.0)]);
    signalised.rule(10, &[12]);
    signalised.light(20, 11);
    let mut lineless = Sketch::new();
    lineless.crosswalk(10, 10.0);
    lineless.rule(10, &[]);
    let mut light_on_road = Sketch::new();
    light_on_road.crosswalk(10, 10.0);
    light_on_road.stop_line(12, &[(10.0, -5.0), (10.0, 5.0)]);
    light_on_road.rule(10, &[12]);
    light_on_road.light(20, ROAD);
    for (name, sketch, metrics) in
        [("light", signalised, 0), ("no line", lineless, 0), ("road", light_on_road, 1)]
    {
        let scene = scene(sketch.0.build().unwrap(), 5.0, &[person()]);
        let judgement = judge(&mut filter(), &scene, &drive(0.0, 80.0, 5.0));
        assert_eq!((judgement.metrics.len(), judgement.feasible), (metrics, metrics == 0), "{name}");
    }
}

#[test]
fn of_several_stop_lines_the_first_one_counts() {
    let mut sketch = Sketch::new();
    sketch.crosswalk(10, 10.0);
    sketch.stop_line(12, &[(9.0, -5.0), (9.0, 5.0)]);
    sketch.stop_line(13, &[(7.0, -5.0), (7.0, 0.5), (7.5, 0.5), (7.5, 5.0)]);
    sketch.rule(10, &[12, 13]);
    let scene = scene(sketch.0.build().unwrap(), 5.0, &[person()]);
    let judgement = judge(&mut filter(), &scene, &drive(0.0, 80.0, 5.0));
    let at = judgement.evidence.unwrap();
    assert_eq!((at.element_id, at.regulatory_element_id), (Some(13), Some(10)));
    assert_eq!((at.x_m, at.y_m, at.object_id), (7.0, 0.0, Some(uuid(1))));
    // Met by an earlier segment beats met earlier on the same segment.
    let behind = candidate(&[(8.0, 5.0, 0.0), (9.5, 5.0, 0.3), (20.0, 5.0, 2.4)]);
    assert_eq!(judge(&mut filter(), &scene, &behind).evidence.unwrap().element_id, Some(12));
}

#[test]
fn the_front_bumper_reaches_the_line_by_overhang_and_not_by_a_hair_less() {
    let blocks = |front_m: f64, tolerance: f64, end_m: f64| {
        let mut parameters = parameters();
        parameters.overshoot_tolerance = tolerance;
        let mut filter = CrosswalkFilter::new(parameters, front_m);
        rejects(&mut filter, person(), &drive(0.0, end_m, 5.0))
    };
    assert!(blocks(0.0, 0.0, 10.0), "touching is reaching");
    assert!(!blocks(0.0, 0.0, 9.99));
    assert!(blocks(4.0, 0.0, 6.0));
    assert!(!blocks(4.0, 0.0, 5.99));
    assert!(!blocks(4.0, 0.5, 6.25), "the tolerance is taken off");
    assert!(blocks(4.0, 0.5, 6.5));
}

#[test]
fn a_departure_from_standstill_is_looked_at_only_as_far_as_the_bumper() {
    let departure = candidate(&[(0.0, 1e-6, 0.0), (5.0, 2.0, 3.0), (30.0, 5.0, 8.0)]);
    assert!(!rejects(&mut filter(), person(), &departure));
    let under_way = candidate(&[(0.0, 1.1e-6, 0.0), (5.0, 2.0, 3.0), (30.0, 5.0, 8.0)]);
    assert!(rejects(&mut filter(), person(), &under_way));
    let mut long = CrosswalkFilter::new(parameters(), 10.0);
    assert!(rejects(&mut long, person(), &departure), "the line is under the front already");
}

#[test]
fn nothing_is_looked_at_beyond_the_stopping_distance() {
    let dense: Vec<Row> = (0..80).map(|k| (f64::from(k), 5.0, 0.2 * f64::from(k))).collect();
    let judged = |x: f64, speed_mps: f64, front_m: f64| {
        let scene = scene(map_with(&[(10, x)]), speed_mps, &[pedestrian(1, x, -7.0)]);
        let mut filter = CrosswalkFilter::new(parameters(), front_m);
        let judgement = judge(&mut filter, &scene, &candidate(&dense));
        (judgement.metrics.len(), judgement.feasible)
    };
    // At 5 m/s: 14.96 m to stop and 5 m to arrive. The point beyond is still taken.
    assert_eq!(judged(19.5, 5.0, 0.0), (1, false));
    assert_eq!(judged(20.0, 5.0, 0.0), (1, false));
    assert_eq!(judged(20.1, 5.0, 0.0), (0, true));
    // A front ahead of base_link reaches farther, on a chord to the end of the whole candidate: crosswalks on it are
    // targets, though not all of them are reached.
    assert_eq!(judged(21.0, 5.0, 1.0), (1, false));
    assert_eq!(judged(21.1, 5.0, 1.0), (1, true));
    assert_eq!(judged(80.1, 5.0, 1.0), (0, true));
    assert_eq!(judged(0.5, -1.0, 0.0), (1, false), "going backwards it stands at once");
}

#[test]
fn a_short_path_is_extended_to_the_distance_of_arrival() {
    let judged = |x: f64, end_m: f64| {
        let scene = scene(map_with(&[(10, x)]), 5.0, &[pedestrian(1, x, -7.0)]);
        let judgement = judge(&mut filter(), &scene, &drive(0.0, end_m, 5.0));
        (judgement.metrics.len(), judgement.feasible)
    };
    assert_eq!(judged(5.0, 3.0), (1, true), "watched, but not reached");
    assert_eq!(judged(5.1, 3.0), (0, true));
    assert_eq!(judged(5.1, 5.0), (0, true), "long enough: not extended");
}

#[test]
fn a_candidate_that_does_not_move_blocks_nobody() {
    let creep = |speed| candidate(&[(8.0, speed, 0.0), (12.0, speed, 40.0)]);
    assert!(!rejects(&mut filter(), person(), &creep(0.09)));
    assert!(rejects(&mut filter(), person(), &creep(0.1)), "0.1 as 32 bits is more than 0.1");
    // Points of the past count as motion though they are not on the path.
    let past = candidate(&[(7.0, 3.0, -0.5), (8.0, 0.05, 0.0), (12.0, 0.05, 40.0)]);
    assert!(rejects(&mut filter(), person(), &past));
    let passed = candidate(&[(8.0, 5.0, -0.5), (11.0, 5.0, 0.0), (20.0, 5.0, 2.0)]);
    let judgement = judge(&mut filter(), &scene(map_with(&[(10, 10.0)]), 5.0, &[person()]), &passed);
    assert!(judgement.feasible && judgement.metrics.is_empty(), "the line lies behind");
}

#[test]
fn the_vehicle_has_arrived_at_exactly_the_threshold() {
    for (from_m, speed_mps, feasible) in
        [(5.0, 0.0, true), (4.99, 0.0, false), (5.0, 0.099, true), (5.0, 0.1, false), (5.0, -3.0, true)]
    {
        let mut filter = filter();
        let mut scene = scene(map_with(&[(10, 10.0)]), speed_mps, &[person()]);
        let candidate = drive(from_m, 80.0, 5.0);
        assert!(!judge(&mut filter, &scene, &candidate).feasible);
        set_odometry(&mut scene, 101.2, speed_mps);
        let judgement = judge(&mut filter, &scene, &candidate);
        assert_eq!(judgement.feasible, feasible, "{from_m} m, {speed_mps} m/s");
    }
}

#[test]
fn waiting_is_over_only_beyond_the_duration() {
    let candidate = drive(8.0, 80.0, 5.0);
    for (waited_s, over) in [(1.0, false), (1.001, true)] {
        let mut filter = filter();
        let mut scene = scene(map_with(&[(10, 10.0)]), 0.0, &[person()]);
        assert!(!waits_no_more(&mut filter, &mut scene, 100.0, &candidate));
        assert!(
            waits_no_more(&mut filter, &mut scene, 100.0 + waited_s, &candidate),
            "nothing is left to wait"
        );
        // Moving again starts the waiting anew unless it was over.
        set_odometry(&mut scene, 101.1, 2.0);
        assert_eq!(judge(&mut filter, &scene, &candidate).feasible, over, "{waited_s} s");
    }
}

#[test]
fn less_than_a_millisecond_of_waiting_is_none() {
    for (waited_s, feasible) in [(0.998, false), (0.9995, true)] {
        let mut filter = filter();
        let mut scene = scene(map_with(&[(10, 10.0)]), 0.0, &[person()]);
        let candidate = drive(8.0, 80.0, 5.0);
        assert!(!waits_no_more(&mut filter, &mut scene, 100.0, &candidate));
        assert_eq!(
            waits_no_more(&mut filter, &mut scene, 100.0 + waited_s, &candidate),
            feasible,
            "{waited_s}"
        );
    }
}

#[test]
fn the_time_of_the_candidate_may_count_as_waiting() {
    let late = |start_s: f64| candidate(&[(8.0, 0.05, 0.0), (8.1, 2.0, start_s), (30.0, 5.0, start_s + 9.0)]);
    let by_time = || filter_with(|p| p.use_trajectory_time = true);
    for (start_s, feasible) in [(0.9, false), (1.0, true), (1.1, true)] {
        let scene = scene(map_with(&[(10, 10.0)]), 0.0, &[person()]);
        let judgement = judge(&mut by_time(), &scene, &late(start_s));
        assert_eq!(judgement.feasible, feasible, "starts after {start_s} s");
        assert!(!judge(&mut filter(), &scene, &late(start_s)).feasible, "only if asked for");
    }
    // The first crosswalk is cleared by time, the second one is not: both people are named.
    let mut filter = by_time();
    let people = [pedestrian(1, 10.0, -7.0), pedestrian(2, 30.0, 7.0)];
    let mut scene = scene(map_with(&[(10, 10.0), (20, 30.0)]), 0.0, &people[..1]);
    let over_both = candidate(&[(8.0, 0.05, 0.0), (8.1, 2.0, 0.5), (50.0, 5.0, 9.0)]);
    assert!(!waits_no_more(&mut filter, &mut scene, 100.0, &over_both));
    set_people(&mut scene, &people);
    set_odometry(&mut scene, 100.6, 0.0);
    let judgement = judge(&mut filter, &scene, &over_both);
    let named: Vec<_> = safety_factors(&judgement).iter().map(|factor| factor.object_id).collect();
    assert_eq!(named, [uuid(1), uuid(2)]);
    assert_eq!(judgement.evidence.unwrap().regulatory_element_id, Some(20));
}

#[test]
fn the_first_obstruction_on_the_way_is_reported() {
    let people = [pedestrian(1, 30.0, -7.0), pedestrian(2, 10.0, 7.0), pedestrian(3, 10.0, -7.0)];
    let scene = scene(map_with(&[(10, 30.0), (20, 10.0)]), 12.0, &people);
    let filter = &mut filter();
    let rows = [(0.0, 12.0, 0.0), (6.0, 12.0, 0.5), (18.0, 12.0, 1.5), (80.0, 12.0, 6.6)];
    let judgement = judge(filter, &scene, &candidate(&rows));
    let named: Vec<_> = safety_factors(&judgement).iter().map(|factor| factor.object_id).collect();
    assert_eq!(named, [uuid(2)], "of those who have waited equally long the first one of the message");
    let at = judgement.evidence.unwrap();
    assert_eq!((at.element_id, at.regulatory_element_id, at.object_id), (Some(22), Some(20), Some(uuid(2))));
    assert_eq!((at.x_m, at.y_m, at.index, at.time_s), (10.0, 0.0, 2, 1.5));
    let words = filter.explain(&judgement).unwrap();
    let expected = format!(
        "front bumper reaches stop line 22 of crosswalk 20 after 1.5 s, 10.0 m ahead, but has to wait 1.0 s more for {}",
        uuid(2)
    );
    assert_eq!(words, expected);
    // What one segment meets is taken in the order of the route, which here lists the far crosswalk first.
    let judgement = judge(filter, &scene, &candidate(&[rows[0], rows[3]]));
    assert_eq!(judgement.evidence.unwrap().regulatory_element_id, Some(10));
}

#[test]
fn the_planner_is_told_whom_to_wait_for() {
    let mut scene = scene(map_with(&[(10, 10.0)]), 5.0, &[person()]);
    let judgement = judge(&mut filter(), &scene, &drive(0.0, 80.0, 5.0));
    let factor = planning_factor(&scene, &judgement).unwrap();
    assert_eq!((factor.module.as_str(), factor.behavior), ("crosswalk_filter", 3));
    assert_eq!((factor.is_driving_forward, factor.detail.as_str()), (true, "crosswalk_obstruction"));
    assert_eq!(factor.control_points.len(), 1);
    let [safety] = &factor.safety_factors.factors[..] else { panic!("one person") };
    assert_eq!((safety.object_id, safety.r#type, safety.is_safe), (uuid(1), 2, false));
    assert_eq!(safety.points, [Point { x: AT.0, y: AT.1, z: 0.5 }]);
    set_people(&mut scene, &[]);
    let feasible = judge(&mut filter(), &scene, &drive(0.0, 80.0, 5.0));
    assert!(feasible.feasible && planning_factor(&scene, &feasible).is_none());
}
