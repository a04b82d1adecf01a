//! Who is recognised, what is remembered, and when it is forgotten.

use super::*;

fn at_line() -> Candidate {
    drive(8.0, 80.0, 5.0)
}

fn one_crosswalk(people: &[PredictedObject]) -> Scene {
    scene(map_with(&[(10, 10.0)]), 0.0, people)
}

/// Waits half a second for one person, then half a second and a bit for another one. True if the second one was taken
/// for the first one, so that the waiting is over.
fn recognises(first: PredictedObject, second: PredictedObject) -> bool {
    let mut filter = filter();
    let mut scene = one_crosswalk(&[first]);
    assert!(!waits_no_more(&mut filter, &mut scene, 100.0, &at_line()));
    set_people(&mut scene, &[second]);
    // The first one, if unknown by now, is forgotten on the way.
    assert!(!waits_no_more(&mut filter, &mut scene, 100.5, &at_line()));
    waits_no_more(&mut filter, &mut scene, 101.2, &at_line())
}

#[test]
fn people_are_recognised_by_id_or_by_class_and_place() {
    use ObjectClassification as C;
    let first = || pedestrian(1, 10.0, -7.0);
    let with_classes = |classes: &[C]| PredictedObject { classification: classes.to_vec(), ..first() };
    let other_id = |object: PredictedObject| PredictedObject { object_id: uuid(2), ..object };
    let both = [class(C::BICYCLE, 0.2), class(C::PEDESTRIAN, 0.8)];
    let cases = [
        ("same id, same place", first(), first(), true),
        ("same id, far away", first(), pedestrian(1, 12.0, 7.0), true),
        ("same id, other class", first(), with_classes(&[class(C::BICYCLE, 1.0)]), true),
        ("new id, same place", first(), pedestrian(2, 10.0, -7.0), true),
        ("new id, 0.29 m away", first(), pedestrian(2, 10.29, -7.0), true),
        ("new id, 0.3 m away", first(), pedestrian(2, 10.3, -7.0), false),
        ("new id, other class", first(), other_id(with_classes(&[class(C::BICYCLE, 1.0)])), false),
        ("first listed class differs, likeliest is equal", first(), other_id(with_classes(&both)), false),
        ("both listed", with_classes(&both), other_id(with_classes(&both)), true),
    ];
    for (name, a, b, expected) in cases {
        assert_eq!(recognises(a, b), expected, "{name}");
    }
}

#[test]
fn an_empty_class_list_is_the_class_unknown() {
    use ObjectClassification as C;
    let mut filter = filter_with(|p| p.object_types = vec![crate::parameters::ObjectClass::Unknown]);
    let unnamed = PredictedObject { classification: Vec::new(), ..pedestrian(1, 10.0, -7.0) };
    let unknown =
        PredictedObject { classification: vec![class(C::UNKNOWN, 1.0)], ..pedestrian(2, 10.0, -7.0) };
    let mut scene = one_crosswalk(&[unnamed]);
    assert!(!waits_no_more(&mut filter, &mut scene, 100.0, &at_line()));
    set_people(&mut scene, &[unknown]);
    assert!(waits_no_more(&mut filter, &mut scene, 101.2, &at_line()));
}

#[test]
fn the_class_is_that_of_the_first_sight() {
    use ObjectClassification as C;
    let as_bicycle =
        |id| PredictedObject { classification: vec![class(C::BICYCLE, 1.0)], ..pedestrian(id, 10.0, -7.0) };
    let mut filter = filter();
    let mut scene = one_crosswalk(&[pedestrian(1, 10.0, -7.0)]);
    assert!(!waits_no_more(&mut filter, &mut scene, 100.0, &at_line()));
    set_people(&mut scene, &[as_bicycle(1)]);
    assert!(!waits_no_more(&mut filter, &mut scene, 100.2, &at_line()));
    // A new id: the class to compare with is still pedestrian, not what the id was called last.
    set_people(&mut scene, &[as_bicycle(2)]);
    assert!(!waits_no_more(&mut filter, &mut scene, 101.2, &at_line()));
}

#[test]
fn an_id_goes_before_a_place() {
    let mut filter = filter();
    let mut scene = one_crosswalk(&[pedestrian(1, 9.0, -7.0)]);
    assert!(!waits_no_more(&mut filter, &mut scene, 100.0, &at_line()));
    assert!(waits_no_more(&mut filter, &mut scene, 101.2, &at_line()));
    set_people(&mut scene, &[pedestrian(1, 9.0, -7.0), pedestrian(2, 11.0, -7.0)]);
    assert!(!waits_no_more(&mut filter, &mut scene, 101.3, &at_line()), "for 2 the waiting begins");
    // Now 2 stands where 1 stood. It is still 2, and the waiting for 2 is not over.
    set_people(&mut scene, &[pedestrian(2, 9.0, -7.0)]);
    assert!(!waits_no_more(&mut filter, &mut scene, 101.4, &at_line()));
}

#[test]
fn who_is_out_of_sight_for_a_moment_keeps_the_waiting_time() {
    for (gap_s, known) in [(0.3, true), (0.301, false)] {
        let mut filter = filter();
        let mut scene = one_crosswalk(&[pedestrian(1, 10.0, -7.0)]);
        assert!(!waits_no_more(&mut filter, &mut scene, 100.0, &at_line()));
        set_people(&mut scene, &[]);
        let nobody = waits_no_more(&mut filter, &mut scene, 100.0 + gap_s, &at_line());
        assert_eq!(nobody, !known, "lost people are waited for as long as they are remembered");
        set_people(&mut scene, &[pedestrian(1, 10.0, -7.0)]);
        assert_eq!(waits_no_more(&mut filter, &mut scene, 101.1, &at_line()), known, "{gap_s} s");
    }
}

#[test]
fn a_candidate_forgets_the_crosswalks_that_it_does_not_meet() {
    let people = [pedestrian(1, 10.0, -7.0)];
    let cases = [
        ("another crosswalk wipes", drive(20.0, 80.0, 5.0), false),
        ("no crosswalk wipes nothing", drive(50.0, 80.0, 5.0), true),
    ];
    for (name, between, remembered) in cases {
        let mut filter = filter();
        let mut scene = scene(map_with(&[(10, 10.0), (20, 30.0)]), 0.0, &people);
        assert!(!waits_no_more(&mut filter, &mut scene, 100.0, &at_line()));
        waits_no_more(&mut filter, &mut scene, 100.6, &between);
        assert_eq!(waits_no_more(&mut filter, &mut scene, 101.2, &at_line()), remembered, "{name}");
    }
}

#[test]
fn keys_do_not_share_their_memory() {
    let mut filter = filter();
    let mut scene = scene(map_with(&[(10, 10.0), (20, 30.0)]), 0.0, &[pedestrian(1, 10.0, -7.0)]);
    let waiting = || keyed(at_line(), 1, 0);
    let elsewhere = || keyed(drive(20.0, 80.0, 5.0), 1, 1);
    let far = || keyed(drive(0.0, 80.0, 5.0), 2, 0);
    for now_s in [100.0, 100.6] {
        set_odometry(&mut scene, now_s, 0.0);
        assert!(!cycle(&mut filter, &scene, &[elsewhere(), waiting(), far()])[1].feasible);
    }
    set_odometry(&mut scene, 101.2, 0.0);
    let verdicts = cycle(&mut filter, &scene, &[elsewhere(), far(), waiting()]);
    assert!(verdicts[2].feasible, "a sibling that meets another crosswalk does not wipe");
    assert!(!verdicts[1].feasible, "one that starts 10 m before the line has not waited");
    let other = keyed(at_line(), 3, 0);
    set_odometry(&mut scene, 101.3, 0.0);
    assert!(!cycle(&mut filter, &scene, &[other])[0].feasible, "a new generator has not waited");
}

#[test]
fn judging_changes_nothing_until_it_is_remembered() {
    let mut filter = filter();
    let mut scene = one_crosswalk(&[pedestrian(1, 10.0, -7.0)]);
    assert!(!waits_no_more(&mut filter, &mut scene, 100.0, &at_line()));
    set_odometry(&mut scene, 101.2, 0.0);
    filter.observe(&scene);
    let mut scratch = Scratch::default();
    let judged = [(); 3].map(|()| filter.judge(&scene, &at_line(), &mut scratch));
    assert!(judged[0].feasible);
    assert_eq!(format!("{:?}", judged[0]), format!("{:?}", judged[2]));
    // The cycle was cut: nothing is remembered, so the waiting was not over.
    set_odometry(&mut scene, 101.3, 2.0);
    assert!(!judge(&mut filter, &scene, &at_line()).feasible);
}

#[test]
fn a_new_map_begins_anew_and_a_new_route_keeps_what_it_still_passes() {
    let people = [pedestrian(1, 10.0, -7.0)];
    let resumes = |change: &dyn Fn(&mut Scene)| {
        let mut filter = filter();
        let mut scene = one_crosswalk(&people);
        assert!(!waits_no_more(&mut filter, &mut scene, 100.0, &at_line()));
        change(&mut scene);
        waits_no_more(&mut filter, &mut scene, 101.2, &at_line())
    };
    assert!(resumes(&|_| ()));
    assert!(!resumes(&|scene| scene.map.as_mut().unwrap().number = 2), "same ids in a new map");
    assert!(resumes(&|scene| scene.route = Some(route(2, &[ROAD]))), "same crosswalk on a new route");
    let mut filter = filter();
    let mut scene = one_crosswalk(&people);
    assert!(!waits_no_more(&mut filter, &mut scene, 100.0, &at_line()));
    scene.route = Some(route(2, &[11]));
    assert!(waits_no_more(&mut filter, &mut scene, 100.6, &at_line()), "the route passes no crosswalk");
    assert_eq!(filter.timers.len(), 0);
    scene.route = Some(route(3, &[ROAD]));
    assert!(!waits_no_more(&mut filter, &mut scene, 101.2, &at_line()));
}

#[test]
fn a_new_map_brings_its_own_crosswalks() {
    let mut filter = filter();
    let mut scene = one_crosswalk(&[pedestrian(1, 10.0, -7.0)]);
    assert!(!judge(&mut filter, &scene, &at_line()).feasible);
    let empty = HdMap::new("map".into(), Arc::new(map_with(&[])));
    scene.map = Some(Epoch { number: 2, value: empty });
    let judgement = judge(&mut filter, &scene, &at_line());
    assert!(judgement.feasible && judgement.metrics.is_empty());
}

#[test]
fn changed_parameters_act_and_keep_the_memory() {
    let mut filter = filter();
    let mut scene = one_crosswalk(&[pedestrian(1, 10.0, -7.0)]);
    assert!(!waits_no_more(&mut filter, &mut scene, 100.0, &at_line()));
    let crosswalk = CrosswalkParameters { lon_detection_margin: 1.5, ..parameters() };
    filter.configure(&ValidatorParameters { crosswalk, ..ValidatorParameters::default() });
    assert!(waits_no_more(&mut filter, &mut scene, 101.2, &at_line()), "still in the area, still waited for");
    set_people(&mut scene, &[pedestrian(2, 10.0, -7.6)]);
    assert!(waits_no_more(&mut filter, &mut scene, 102.0, &at_line()), "beyond the smaller area");
}

#[test]
fn errors_leave_the_memory_alone() {
    let mut filter = filter();
    let mut scene = one_crosswalk(&[pedestrian(1, 10.0, -7.0)]);
    assert!(!waits_no_more(&mut filter, &mut scene, 100.0, &at_line()));
    let objects = scene.objects.take();
    set_odometry(&mut scene, 100.5, 0.0);
    assert!(judge(&mut filter, &scene, &at_line()).failure.is_some());
    scene.objects = objects;
    assert!(waits_no_more(&mut filter, &mut scene, 101.2, &at_line()));
}

#[test]
fn keys_that_stay_away_are_forgotten() {
    for (away_s, remembered) in [(10.0, 1), (10.001, 0)] {
        let mut filter = filter();
        let mut scene = one_crosswalk(&[pedestrian(1, 10.0, -7.0)]);
        assert!(!waits_no_more(&mut filter, &mut scene, 100.0, &at_line()));
        set_odometry(&mut scene, 100.0 + away_s, 0.0);
        cycle(&mut filter, &scene, &[]);
        assert_eq!(filter.timers.len(), remembered, "{away_s} s");
    }
    let mut patient = filter_with(|p| p.stop_duration = 20.0);
    let mut scene = one_crosswalk(&[pedestrian(1, 10.0, -7.0)]);
    assert!(!waits_no_more(&mut patient, &mut scene, 100.0, &at_line()));
    set_odometry(&mut scene, 115.0, 0.0);
    cycle(&mut patient, &scene, &[]);
    assert_eq!(patient.timers.len(), 1, "kept as long as it can still matter");
}

#[test]
fn a_key_in_use_is_kept_though_it_meets_no_crosswalk() {
    let mut filter = filter_with(|p| p.object_clear_time_th = 60.0);
    let mut scene = one_crosswalk(&[pedestrian(1, 10.0, -7.0)]);
    assert!(!waits_no_more(&mut filter, &mut scene, 100.0, &at_line()));
    for k in 1..=9 {
        assert!(waits_no_more(&mut filter, &mut scene, 100.0 + 8.0 * f64::from(k), &drive(50.0, 80.0, 5.0)));
        assert_eq!(filter.timers.len(), 1, "{k}");
    }
}

#[test]
fn generators_with_ever_new_ids_wait_for_ever_and_fill_no_memory() {
    let mut filter = filter();
    let mut scene = one_crosswalk(&[pedestrian(1, 10.0, -7.0)]);
    let mut number = 0_u64;
    for cycle_number in 0..6 {
        set_odometry(&mut scene, 100.0 + f64::from(cycle_number), 0.0);
        let fresh = |_| {
            let mut candidate = at_line();
            number += 1;
            candidate.key.generator.uuid[..8].copy_from_slice(&number.to_le_bytes());
            candidate
        };
        let candidates: Vec<_> = (0..1000).map(fresh).collect();
        assert!(cycle(&mut filter, &scene, &candidates).iter().all(|judgement| !judgement.feasible));
        assert!(filter.timers.len() <= timers::MAX_KEYS);
    }
    assert_eq!(filter.timers.len(), timers::MAX_KEYS, "the limit was reached");
}

#[test]
fn the_keys_unseen_for_longest_give_way() {
    let mut filter = filter();
    let mut scene = one_crosswalk(&[pedestrian(1, 10.0, -7.0)]);
    let keep = || keyed(at_line(), 9, 9);
    set_odometry(&mut scene, 100.0, 0.0);
    cycle(&mut filter, &scene, &[keep()]);
    for round in 0..5_u32 {
        set_odometry(&mut scene, 100.2 + 0.2 * f64::from(round), 0.0);
        let mut candidates = vec![keep()];
        candidates.extend((0..1000).map(|sample| keyed(at_line(), 1, 1000 * round + sample)));
        cycle(&mut filter, &scene, &candidates);
    }
    set_odometry(&mut scene, 101.2, 0.0);
    assert!(cycle(&mut filter, &scene, &[keep()])[0].feasible);
}

#[test]
fn people_with_ever_new_ids_are_known_by_place_and_else_waited_for() {
    for (step_m, feasible) in [(0.0, true), (0.31, false)] {
        let mut filter = filter();
        let mut scene = one_crosswalk(&[]);
        for k in 0..20_u8 {
            let offset = if k % 2 == 0 { 0.0 } else { step_m };
            set_people(&mut scene, &[pedestrian(k, 10.0 + offset, -7.0)]);
            let now_s = 100.0 + 0.4 * f64::from(k);
            let verdict = waits_no_more(&mut filter, &mut scene, now_s, &at_line());
            assert_eq!(verdict, feasible && k > 2, "{step_m} m, message {k}");
        }
    }
}

#[test]
fn crowds_with_ever_new_ids_fill_no_memory() {
    let mut filter = filter_with(|p| {
        p.object_clear_time_th = 1e9;
        p.distance_hysteresis_th = 0.0;
    });
    let mut scene = one_crosswalk(&[]);
    let mut number = 0_u32;
    for k in 0..40 {
        let fresh = |_| {
            let mut person = pedestrian(0, 10.0, -7.0);
            number += 1;
            person.object_id.uuid[..4].copy_from_slice(&number.to_le_bytes());
            person
        };
        let people: Vec<_> = (0..50).map(fresh).collect();
        set_people(&mut scene, &people);
        assert!(!waits_no_more(&mut filter, &mut scene, 100.0 + 0.1 * f64::from(k), &at_line()));
        let mut waits = Vec::new();
        filter.timers.copy(at_line().key, 10, &mut waits);
        assert!((50..=50 + 256).contains(&waits.len()), "{}", waits.len());
    }
}
