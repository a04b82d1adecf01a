//! What is kept of a candidate, for how long, and that it is bounded.

use super::*;
use messages::unique_identifier_msgs::Uuid;

const SECOND: i64 = 1_000_000_000;

fn key(sample: u32) -> CandidateKey {
    CandidateKey { generator: Uuid::default(), sample }
}

fn memo(marks: &[(i64, Option<f64>, bool)]) -> TrafficLightMemo {
    let marks = marks.iter().map(|&(light_id, violation_arc_m, refused)| LightMark {
        light_id,
        violation_arc_m,
        refused,
    });
    TrafficLightMemo { marks: marks.collect(), checked: true, nearest_violation: None }
}

#[test]
fn of_several_violations_of_a_light_the_last_is_kept() {
    let mut memory = Memory::default();
    memory.fold(key(0), &memo(&[(1, Some(30.0), false), (1, Some(20.0), false)]), 0, 0.0, |_| true);
    assert_eq!(memory.of(&key(0)).unwrap().farthest_violation_m(|_| true), 20.0);
    assert_eq!(memory.of(&key(0)).unwrap().farthest_violation_m(|_| false), 0.0);
    assert!(memory.of(&key(1)).is_none(), "another sample has a memory of its own");
}

#[test]
fn violations_stay_while_their_light_constrains_and_go_with_it() {
    let mut memory = Memory::default();
    memory.fold(key(0), &memo(&[(1, Some(30.0), false), (2, Some(20.0), false)]), 0, 0.0, |_| true);
    memory.fold(key(0), &memo(&[]), SECOND, 0.0, |_| true);
    assert_eq!(
        memory.of(&key(0)).unwrap().farthest_violation_m(|_| true),
        30.0,
        "a clean cycle changes nothing"
    );
    memory.fold(key(0), &memo(&[]), 2 * SECOND, 0.0, |id| id == 2);
    assert_eq!(memory.of(&key(0)).unwrap().farthest_violation_m(|_| true), 20.0);
    memory.fold(key(0), &memo(&[]), 3 * SECOND, 0.0, |_| false);
    assert_eq!(memory.len(), 0);
}

#[test]
fn refusals_act_up_to_their_duration_inclusive() {
    let mut memory = Memory::default();
    memory.fold(key(0), &memo(&[(1, None, true)]), SECOND, 2.0, |_| true);
    let refused = |memory: &Memory, now_ns| memory.of(&key(0)).is_some_and(|m| m.was_refused(1, now_ns, 2.0));
    assert!(refused(&memory, 3 * SECOND) && !refused(&memory, 3 * SECOND + 1));
    assert!(refused(&memory, 0), "after a step back in time it still acts");
    assert!(!memory.of(&key(0)).unwrap().was_refused(2, SECOND, 2.0), "another light");
    memory.fold(key(0), &memo(&[]), 3 * SECOND, 2.0, |_| true);
    assert!(refused(&memory, 3 * SECOND));
    memory.fold(key(0), &TrafficLightMemo::default(), 4 * SECOND, 2.0, |_| true);
    assert_eq!(memory.len(), 1, "nothing was checked, so refusals stay as they are");
    memory.fold(key(0), &memo(&[]), 4 * SECOND, 2.0, |_| true);
    assert_eq!(memory.len(), 0);
}

#[test]
fn unseen_candidates_are_forgotten_after_ten_seconds_or_the_hysteresis() {
    for (hysteresis_s, kept_s) in [(0.0, 10), (60.0, 60)] {
        let mut memory = Memory::default();
        memory.fold(key(0), &memo(&[(1, Some(30.0), false)]), 0, hysteresis_s, |_| true);
        memory.evict(kept_s * SECOND, hysteresis_s);
        assert_eq!(memory.len(), 1);
        memory.evict(kept_s * SECOND + 1, hysteresis_s);
        assert_eq!(memory.len(), 0);
    }
}

#[test]
fn of_too_many_candidates_those_unseen_for_longest_go() {
    let mut memory = Memory::default();
    for sample in 0..MAX_CANDIDATES as u32 + 7 {
        let now_ns = if sample < 3 { SECOND } else { 0 };
        memory.fold(key(sample), &memo(&[(1, Some(30.0), false)]), now_ns, 0.0, |_| true);
    }
    memory.evict(SECOND, 0.0);
    assert_eq!(memory.len(), MAX_CANDIDATES);
    assert!((0..3).all(|sample| memory.of(&key(sample)).is_some()), "the newest stay");
    assert!((3..10).all(|sample| memory.of(&key(sample)).is_none()), "of equal age, the first keys go");
}

#[test]
fn a_restarted_clock_keeps_refusals_for_their_duration_only() {
    let mut memory = Memory::default();
    memory.fold(key(0), &memo(&[(1, None, true)]), 1000 * SECOND, 2.0, |_| true);
    memory.restart_clock(5 * SECOND);
    let candidate = memory.of(&key(0)).unwrap();
    assert!(candidate.was_refused(1, 7 * SECOND, 2.0) && !candidate.was_refused(1, 8 * SECOND, 2.0));
    memory.evict(16 * SECOND, 2.0);
    assert_eq!(memory.len(), 0);
}
