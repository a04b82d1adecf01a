//! Check vectors of the piecewise-jerk program, and the promises of finished profiles.

use proptest::prelude::*;

use super::piecewise_jerk::PiecewiseJerkProblem;
use super::*;

const LIMITS: SpeedLimits =
    SpeedLimits { max_speed_mps: 2.0, max_acceleration_mps2: 3.0, max_jerk_mps3: 4.0 };
fn solve(length_m: f64, pjso_drop_jerk_cross_terms: bool) -> Vec<SpeedState> {
    PiecewiseJerkProblem {
        start: SpeedState::default(),
        length_m,
        intervals: (50.0 * length_m) as usize,
        spacing_s: 0.2,
        limits: LIMITS,
        parameters: SpeedParameters { pjso_drop_jerk_cross_terms, ..SpeedParameters::default() },
        caps: &[],
    }
    .solve(None)
    .unwrap()
}

#[test]
fn check_vectors_of_the_program() {
    // length, cross terms dropped, first knot within 0.1 m of the end, highest speed
    let cases = [
        (2.0, false, 14, 1.089),
        (5.0, false, 20, 2.0),
        (10.0, false, 32, 2.0),
        (2.0, true, 24, 0.602),
        (5.0, true, 28, 1.497),
        (10.0, true, 37, 2.0),
    ];
    for (length, drop, arrival, top) in cases {
        let states = solve(length, drop);
        let reached = states.iter().position(|state| length - state.position_m < 0.1).unwrap();
        let highest = states.iter().fold(0.0_f64, |most, state| most.max(state.speed_mps));
        assert_eq!(reached, arrival, "{length} m, dropped {drop}");
        assert!((highest - top).abs() < 1e-3, "{length} m, dropped {drop}: {highest}");
    }
}

#[test]
fn check_vector_of_the_first_knots() {
    let states = solve(5.0, false);
    for (state, expected) in states[1..].iter().zip([0.005333, 0.042667, 0.144, 0.335627, 0.617150]) {
        assert!((state.position_m - expected).abs() < 2e-5, "{} instead of {expected}", state.position_m);
    }
    let range = |dropped| {
        solve(5.0, dropped).iter().fold((0.0_f64, 0.0_f64), |(low, high), state| {
            (low.min(state.acceleration_mps2), high.max(state.acceleration_mps2))
        })
    };
    for (dropped, low, high) in [(false, -1.191, 2.4), (true, -0.48, 1.6)] {
        let found = range(dropped);
        assert!((found.0 - low).abs() < 2e-3 && (found.1 - high).abs() < 2e-3, "{found:?}");
    }
}

#[test]
fn fastest_motions_between_rests() {
    // Limits 2 m/s, 1 m/s², 2 m/s³: length, duration and top speed by hand.
    let limits = SpeedLimits { max_speed_mps: 2.0, max_acceleration_mps2: 1.0, max_jerk_mps3: 2.0 };
    let cases = [
        // only jerk: t = 4 (L / 2j)^(1/3), v = j (t/4)²
        (0.004, 0.4, 0.02),
        // acceleration held: v² / a + v a / j = L
        (1.5, 3.0, 1.0),
        // cruising: two ramps of 2.5 s and 2.5 m, 5 m at 2 m/s
        (10.0, 7.5, 2.0),
    ];
    for (length, duration, top) in cases {
        let profile = rest_to_rest(length, &limits);
        let highest = profile.pieces.iter().fold(0.0_f64, |most, piece| most.max(piece.top_speed()));
        assert!((profile.duration_s() - duration).abs() < 1e-9, "{length} m: {} s", profile.duration_s());
        assert!((highest - top).abs() < 1e-9, "{length} m: {highest} m/s");
        assert_eq!(profile.length_m(), length);
    }
}

/// Every promise of a profile, at instants much closer than it was made with.
fn assert_keeps(profile: &SpeedProfile, cap: &SpeedCap, start: SpeedState, limits: &SpeedLimits) {
    let (first, last) = (profile.samples(0.1).next().unwrap(), profile.samples(0.1).last().unwrap());
    assert_eq!(first, (0.0, start));
    let rest = SpeedState { position_m: cap.length_m(), ..SpeedState::default() };
    assert_eq!(last, (profile.duration_s(), rest));
    let mut before: Option<(f64, SpeedState)> = None;
    for (time_s, state) in profile.samples(0.007) {
        assert!(state.speed_mps >= -1e-6, "{state:?}");
        assert!(state.speed_mps <= limits.max_speed_mps * (1.0 + 1e-9), "{state:?}");
        assert!(state.speed_mps <= 1.01 * cap.at(state.position_m), "{state:?} {}", cap.at(state.position_m));
        assert!(state.acceleration_mps2.abs() <= limits.max_acceleration_mps2 * (1.0 + 1e-9), "{state:?}");
        if let Some((then_s, then)) = before {
            let dt = time_s - then_s;
            assert!(dt > 0.0);
            let jerk = (state.acceleration_mps2 - then.acceleration_mps2) / dt;
            assert!(jerk.abs() <= limits.max_jerk_mps3 * (1.0 + 1e-6) + 1e-4 / dt, "jerk {jerk}");
            let travelled = state.position_m - then.position_m;
            let mean = (state.speed_mps + then.speed_mps) / 2.0;
            assert!((travelled - mean * dt).abs() < 1e-4, "{travelled} m in {dt} s at {mean} m/s");
        }
        before = Some((time_s, state));
    }
}

#[test]
fn caps_slow_the_vehicle_down_only_where_they_are() {
    let limits = SpeedLimits { max_speed_mps: 1.0, max_acceleration_mps2: 1.0, max_jerk_mps3: 2.0 };
    let mut caps = vec![1.0; 60];
    caps[28..32].fill(0.3);
    let cap = SpeedCap::new(0.1, caps, &limits);
    let profile =
        plan_speed(&cap, SpeedState::default(), &limits, &SpeedParameters::default(), &mut || false).unwrap();
    assert_keeps(&profile, &cap, SpeedState::default(), &limits);
    let free_s = rest_to_rest(6.0, &limits).duration_s();
    assert!(profile.duration_s() > free_s);
    assert!(profile.duration_s() < free_s + 3.5, "{} s, {free_s} s without caps", profile.duration_s());
}

#[test]
fn a_rolling_vehicle_stops_or_says_that_it_cannot() {
    let limits = SpeedLimits { max_speed_mps: 2.0, max_acceleration_mps2: 1.0, max_jerk_mps3: 2.0 };
    let start = SpeedState { speed_mps: 0.8, ..SpeedState::default() };
    let cap = SpeedCap::new(0.1, vec![2.0; 40], &limits);
    let profile = plan_speed(&cap, start, &limits, &SpeedParameters::default(), &mut || false).unwrap();
    assert_keeps(&profile, &cap, start, &limits);
    let short = SpeedCap::new(0.1, vec![2.0; 3], &limits);
    assert!(matches!(
        plan_speed(&short, start, &limits, &SpeedParameters::default(), &mut || false),
        Err(SpeedError::CannotStop { .. })
    ));
    let slow = SpeedCap::new(0.1, vec![0.5; 40], &limits);
    assert!(matches!(
        plan_speed(&slow, start, &limits, &SpeedParameters::default(), &mut || false),
        Err(SpeedError::TooFastAtStart { .. })
    ));
}

#[test]
fn stopped_at_once_the_steady_profile_is_the_answer() {
    let limits = SpeedLimits { max_speed_mps: 2.0, max_acceleration_mps2: 1.0, max_jerk_mps3: 2.0 };
    let mut caps = vec![2.0; 60];
    caps[28..32].fill(0.3);
    let cap = SpeedCap::new(0.1, caps, &limits);
    let plan = |patience: &mut dyn Patience| {
        plan_speed(&cap, SpeedState::default(), &limits, &SpeedParameters::default(), patience).unwrap()
    };
    let steady = rest_to_rest(6.0, &SpeedLimits { max_speed_mps: 0.3, ..limits });
    assert_eq!(plan(&mut || true), steady);
    assert!(plan(&mut || false).duration_s() < 0.8 * steady.duration_s());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn profiles_keep_every_limit(
        step in 0.02..0.12_f64,
        caps in prop::collection::vec((1..12_usize, 0.04..2.0_f64), 1..8),
        speed in 0.3..2.5_f64, acceleration in 0.3..2.0_f64, jerk in 0.4..4.0_f64,
    ) {
        let limits =
            SpeedLimits { max_speed_mps: speed, max_acceleration_mps2: acceleration, max_jerk_mps3: jerk };
        let caps = caps.into_iter().flat_map(|(count, cap)| vec![f64::min(cap, speed); count]).collect();
        let cap = SpeedCap::new(step, caps, &limits);
        let profile = plan_speed(&cap, SpeedState::default(), &limits, &SpeedParameters::default(), &mut || false).unwrap();
        assert_keeps(&profile, &cap, SpeedState::default(), &limits);
        // Not slower than creeping at the lowest cap.
        let creep = rest_to_rest(cap.length_m(), &SpeedLimits { max_speed_mps: cap.lowest_mps(), ..limits });
        prop_assert!(profile.duration_s() <= creep.duration_s());
    }

    #[test]
    fn rests_in_closed_form_keep_every_limit(
        length in 1e-4..50.0_f64, speed in 0.1..3.0_f64, acceleration in 0.1..3.0_f64, jerk in 0.1..5.0_f64,
    ) {
        let limits =
            SpeedLimits { max_speed_mps: speed, max_acceleration_mps2: acceleration, max_jerk_mps3: jerk };
        let cap = SpeedCap::new(length, vec![speed], &limits);
        assert_keeps(&rest_to_rest(length, &limits), &cap, SpeedState::default(), &limits);
    }
}
