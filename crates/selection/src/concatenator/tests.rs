//! The upstream test cases of the concatenator, ours for its traps, and the order of its output.

use super::*;
use messages::std_msgs::{Header, Text};
use proptest::prelude::*;

fn id(number: u8) -> Uuid {
    let mut uuid = [0; 16];
    uuid[0] = number;
    Uuid { uuid }
}

fn info(generator: u8) -> GeneratorInfo {
    GeneratorInfo {
        generator_id: id(generator),
        generator_name: Text { data: format!("generator_{generator}") },
    }
}

fn trajectory(generator: u8, stamp_s: f64) -> Arc<CandidateTrajectory> {
    let stamp = Time::from_nanoseconds((stamp_s * 1e9).round() as i64);
    let header = Header { stamp, frame_id: "map".to_owned() };
    Arc::new(CandidateTrajectory { header, generator_id: id(generator), ..CandidateTrajectory::default() })
}

fn message(generators: &[u8], trajectories: &[(u8, f64)]) -> CandidateTrajectories {
    CandidateTrajectories {
        candidate_trajectories: trajectories
            .iter()
            .map(|&(generator, stamp)| trajectory(generator, stamp))
            .collect(),
        generator_info: generators.iter().copied().map(info).collect(),
    }
}

fn at(seconds: f64) -> Time {
    Time::from_nanoseconds((seconds * 1e9).round() as i64)
}

/// Numbers of trajectories and generators at `now`.
fn counts(concatenator: &mut Concatenator, now: f64) -> (usize, usize) {
    let result = concatenator.get(at(now));
    (result.candidates.len(), result.generators.len())
}

fn order(result: &Concatenated) -> Vec<u8> {
    result.generators.iter().map(|info| info.generator_id.uuid[0]).collect()
}

#[test]
fn empty_buffer_returns_empty() {
    assert_eq!(counts(&mut Concatenator::new(1.0), 10.0), (0, 0));
}

/// Window, what is added as `(generator, stamp)`, time of reading, expected trajectories and generators.
type Case = (&'static str, f64, &'static [(u8, f64)], f64, (usize, usize));

const CASES: &[Case] = &[
    ("FreshTrajectoryIsReturned", 1.0, &[(1, 9.5)], 10.0, (1, 1)),
    ("StaleTrajectoryIsExcluded", 1.0, &[(1, 5.0)], 10.0, (0, 0)),
    ("MixedFreshAndStale_OnlyFreshSurvives", 1.0, &[(1, 9.5), (1, 5.0)], 10.0, (1, 1)),
    ("AllTrajectoriesStale_GeneratorRemovedFromResult", 1.0, &[(1, 5.0), (1, 6.0)], 10.0, (0, 0)),
    ("TwoGeneratorsBothFresh", 1.0, &[(1, 9.5), (2, 9.6)], 10.0, (2, 2)),
    ("TwoGeneratorsOneFreshOneStale", 1.0, &[(1, 9.5), (2, 5.0)], 10.0, (1, 1)),
    ("TwoGeneratorsBothStale", 1.0, &[(1, 4.0), (2, 5.0)], 10.0, (0, 0)),
    ("ExactlyAtBoundary_TrajectoryIsStillFresh", 1.0, &[(1, 9.0)], 10.0, (1, 1)),
    ("FutureStampsNeverExpire", 1.0, &[(1, 1e6)], 10.0, (1, 1)),
    ("ZeroNowPrunesNothing", 0.2, &[(1, 1.75e9)], 0.0, (1, 1)),
    ("ExactlyTheWindowAtPresentEpochIsStale", 0.2, &[(1, 1_750_000_000.1)], 1_750_000_000.3, (0, 0)),
];

#[test]
fn upstream_cases() {
    for &(name, window, trajectories, now, expected) in CASES {
        let mut generators: Vec<u8> = trajectories.iter().map(|&(generator, _)| generator).collect();
        generators.dedup();
        let mut concatenator = Concatenator::new(window);
        concatenator.add(&message(&generators, trajectories));
        assert_eq!(counts(&mut concatenator, now), expected, "{name}");
    }
}

#[test]
fn mixed_fresh_and_stale_keeps_the_fresh_one() {
    let mut concatenator = Concatenator::new(1.0);
    concatenator.add(&message(&[1], &[(1, 9.5), (1, 5.0)]));
    let result = concatenator.get(at(10.0));
    assert_eq!(result.candidates[0].message.header.stamp.sec, 9);
    assert_eq!(result.stale, [Stale { generator_name: "generator_1".into(), stamp: at(5.0), age_s: 5.0 }]);
}

#[test]
fn add_candidate_twice_overwrites_buffer_for_same_generator() {
    let mut concatenator = Concatenator::new(1.0);
    concatenator.add(&message(&[1], &[(1, 9.5)]));
    concatenator.add(&message(&[1], &[(1, 9.8)]));
    let result = concatenator.get(at(10.0));
    assert_eq!(result.candidates.len(), 1);
    assert!(result.candidates[0].message.header.stamp.nanosec > 700_000_000);
}

#[test]
fn pruned_generator_absent_on_subsequent_call() {
    let mut concatenator = Concatenator::new(1.0);
    concatenator.add(&message(&[1], &[(1, 5.0)]));
    assert_eq!(counts(&mut concatenator, 10.0), (0, 0));
    // Removed, not hidden: an earlier time does not bring it back.
    assert_eq!(counts(&mut concatenator, 5.5), (0, 0));
    assert_eq!(concatenator.generators(), 0);
}

#[test]
fn alternating_fresh_stale_fresh_updates_correctly() {
    let mut concatenator = Concatenator::new(1.0);
    concatenator.add(&message(&[1], &[(1, 9.5)]));
    assert_eq!(counts(&mut concatenator, 10.0).0, 1);
    assert_eq!(counts(&mut concatenator, 20.0).0, 0);
    concatenator.add(&message(&[1], &[(1, 20.0)]));
    assert_eq!(counts(&mut concatenator, 20.0).0, 1);
}

#[test]
fn one_of_two_generators_becomes_stale_the_other_survives_across_calls() {
    let mut concatenator = Concatenator::new(1.0);
    concatenator.add(&message(&[1, 2], &[(1, 9.2), (2, 9.9)]));
    assert_eq!(counts(&mut concatenator, 10.0), (2, 2));
    assert_eq!(counts(&mut concatenator, 10.5), (1, 1));
}

#[test]
fn window_changes_take_effect_at_the_next_reading() {
    let mut concatenator = Concatenator::new(1.0);
    concatenator.add(&message(&[1], &[(1, 9.5)]));
    concatenator.set_duration_time_s(0.1);
    assert_eq!(counts(&mut concatenator, 10.0), (0, 0), "shorter window");
    concatenator.add(&message(&[1], &[(1, 5.0)]));
    concatenator.set_duration_time_s(10.0);
    assert_eq!(counts(&mut concatenator, 10.0), (1, 1), "longer window before the first reading");
}

#[test]
fn empty_generator_info_produces_no_buffer_entry() {
    let mut concatenator = Concatenator::new(1.0);
    concatenator.add(&message(&[], &[(1, 9.5)]));
    assert_eq!(concatenator.generators(), 0);
    assert_eq!(concatenator.get(at(10.0)).oddities.unannounced, 1);
}

#[test]
fn trajectory_with_mismatched_generator_id_is_ignored() {
    let mut concatenator = Concatenator::new(1.0);
    concatenator.add(&message(&[1], &[(2, 9.5)]));
    let result = concatenator.get(at(10.0));
    assert_eq!((result.candidates.len(), result.oddities.unannounced), (0, 1));
    assert_eq!(concatenator.get(at(10.0)).oddities, Oddities::default(), "told once");
}

#[test]
fn announcement_without_trajectories_clears_the_generator_and_leaves_the_others() {
    let mut concatenator = Concatenator::new(1.0);
    concatenator.add(&message(&[1, 2], &[(1, 9.5), (2, 9.5)]));
    concatenator.add(&message(&[1], &[]));
    assert_eq!(order(&concatenator.get(at(10.0))), [2]);
}

#[test]
fn generator_announced_twice_keeps_its_trajectories_and_the_last_name() {
    let mut twice = message(&[1, 1], &[(1, 9.5), (1, 9.6)]);
    twice.generator_info[1].generator_name.data = "renamed".to_owned();
    let mut concatenator = Concatenator::new(1.0);
    concatenator.add(&twice);
    let result = concatenator.get(at(10.0));
    assert_eq!(result.oddities.announced_twice, 1);
    assert_eq!((result.candidates.len(), result.generators.len()), (2, 1));
    assert_eq!(&*result.candidates[0].generator_name, "renamed");
}

#[test]
fn newest_inserted_generator_comes_first() {
    let mut concatenator = Concatenator::new(1.0);
    concatenator.add(&message(&[1, 2], &[(1, 9.5), (2, 9.9)]));
    assert_eq!(order(&concatenator.get(at(10.0))), [2, 1], "the last announced is the newest");
    concatenator.add(&message(&[3, 1], &[(3, 9.9), (1, 9.5)]));
    assert_eq!(order(&concatenator.get(at(10.0))), [3, 2, 1], "an overwritten one keeps its place");
    concatenator.get(at(10.6));
    concatenator.add(&message(&[1], &[(1, 10.6)]));
    assert_eq!(order(&concatenator.get(at(10.6))), [1, 3, 2], "one that comes back is new");
}

#[test]
fn samples_are_numbered_by_generator_in_message_order() {
    let mut concatenator = Concatenator::new(1.0);
    concatenator.add(&message(&[1, 2], &[(1, 9.1), (2, 9.2), (1, 9.3)]));
    let keys: Vec<_> = concatenator
        .get(at(10.0))
        .candidates
        .iter()
        .map(|candidate| (candidate.key.generator.uuid[0], candidate.key.sample))
        .collect();
    assert_eq!(keys, [(2, 0), (1, 0), (1, 1)]);
}

#[test]
fn reading_does_not_consume() {
    let mut concatenator = Concatenator::new(1.0);
    concatenator.add(&message(&[1], &[(1, 9.5)]));
    assert_eq!(counts(&mut concatenator, 10.0), counts(&mut concatenator, 10.1));
}

#[test]
fn the_number_of_generators_is_bounded_and_the_oldest_goes() {
    let mut concatenator = Concatenator::new(1.0);
    for number in 0..MAX_GENERATORS + 5 {
        let mut one = message(&[0], &[(0, 1e9)]);
        let uuid = Uuid { uuid: (number as u128).to_le_bytes() };
        one.generator_info[0].generator_id = uuid;
        let mut trajectory = (*one.candidate_trajectories[0]).clone();
        trajectory.generator_id = uuid;
        one.candidate_trajectories[0] = Arc::new(trajectory);
        concatenator.add(&one);
    }
    let newest = Uuid { uuid: ((MAX_GENERATORS + 4) as u128).to_le_bytes() };
    let result = concatenator.get(at(10.0));
    assert_eq!((result.generators.len(), result.oddities.evicted), (MAX_GENERATORS, 5));
    assert_eq!(result.generators[0].generator_id, newest);
}

proptest! {
    /// Whatever is added and read: every trajectory out is fresh, announced, and each generator is listed once.
    #[test]
    fn every_reading_is_consistent(
        events in prop::collection::vec((0_u8..6, prop::collection::vec((0_u8..6, 0.0..20.0_f64), 0..6)), 1..12),
        window in 0.0..5.0_f64,
    ) {
        let mut concatenator = Concatenator::new(window);
        for (step, (generators, trajectories)) in events.iter().enumerate() {
            let announced: Vec<u8> = (0..*generators).collect();
            concatenator.add(&message(&announced, trajectories));
            let now = at(step as f64);
            let result = concatenator.get(now);
            for candidate in &result.candidates {
                prop_assert!(now.seconds() - candidate.message.header.stamp.seconds() <= window);
                let id = candidate.key.generator;
                prop_assert_eq!(result.generators.iter().filter(|info| info.generator_id == id).count(), 1);
            }
            prop_assert!(result.generators.len() <= result.candidates.len());
        }
    }
}
