//! When a state becomes stable, how long it is held, and where an amber came from.

use super::*;
use messages::autoware_perception_msgs::TrafficLightElement as Element;

const LIGHT: i64 = 42;
const SECOND: f64 = 1e9;

/// Colour, shape, state.
type Lamp = (u8, u8, u8);

const RED: &[Lamp] = &[(Element::RED, Element::CIRCLE, Element::SOLID_ON)];
const AMBER: &[Lamp] = &[(Element::AMBER, Element::CIRCLE, Element::SOLID_ON)];
const GREEN: &[Lamp] = &[(Element::GREEN, Element::CIRCLE, Element::SOLID_ON)];
const UNKNOWN: &[Lamp] = &[(Element::UNKNOWN, Element::UNKNOWN, Element::UNKNOWN)];
const RED_ARROW: &[Lamp] = &[(Element::RED, Element::LEFT_ARROW, Element::SOLID_ON)];
const RED_AND_AMBER: &[Lamp] = &[RED[0], AMBER[0]];
const DARK: &[Lamp] = &[];

fn group(light_id: i64, lamps: &[Lamp]) -> TrafficLightGroup {
    let element = |&(color, shape, status): &Lamp| Element { color, shape, status, confidence: 0.9 };
    TrafficLightGroup {
        traffic_light_group_id: light_id,
        elements: lamps.iter().map(element).collect(),
        predictions: Vec::new(),
    }
}

fn lamps(lamps: &[Lamp]) -> Lamps {
    Lamps::from(&group(0, lamps))
}

fn thresholds(red: f64, amber: f64, unknown: f64) -> TrafficLightParameters {
    TrafficLightParameters {
        stable_duration_threshold_red: red,
        stable_duration_threshold_amber: amber,
        stable_duration_threshold_unknown: unknown,
        ..TrafficLightParameters::default()
    }
}

/// A tracker of which single steps are fed.
struct Run {
    tracker: SignalTracker,
    parameters: TrafficLightParameters,
}

impl Run {
    fn new(red: f64, amber: f64, unknown: f64) -> Self {
        Self { tracker: SignalTracker::default(), parameters: thresholds(red, amber, unknown) }
    }

    fn groups(&mut self, time_s: f64, stopped: bool, groups: &[TrafficLightGroup]) -> Vec<(i64, Lamps)> {
        let now_ns = (time_s * SECOND).round() as i64;
        let signals = self.tracker.update(groups, now_ns, stopped, &self.parameters);
        signals.iter().map(|signal| (signal.light_id, signal.lamps.clone())).collect()
    }

    /// What counts when the message has just this state of the one light.
    fn sees(&mut self, time_s: f64, shown: &[Lamp]) -> Option<Lamps> {
        self.groups(time_s, false, &[group(LIGHT, shown)]).pop().map(|(_, lamps)| lamps)
    }

    /// What counts when the message is empty.
    fn misses(&mut self, time_s: f64) -> Option<Lamps> {
        self.groups(time_s, false, &[]).pop().map(|(_, lamps)| lamps)
    }

    fn duration_s(&self) -> f64 {
        self.tracker.signals()[0].duration_s
    }
}

#[test]
fn where_amber_comes_from() {
    use AmberOrigin::*;
    let arrows: &[Lamp] = &[(Element::GREEN, Element::RIGHT_ARROW, Element::SOLID_ON)];
    let flashing: &[Lamp] = &[(Element::AMBER, Element::CIRCLE, Element::FLASHING)];
    let cases: &[(&str, &[&[Lamp]], AmberOrigin)] = &[
        ("green", &[GREEN], NotAmber),
        ("green, amber", &[GREEN, AMBER], FromGreen),
        ("red, amber", &[RED, AMBER], FromNonGreen),
        ("amber first", &[AMBER], NotAmber),
        ("green, amber, red", &[GREEN, AMBER, RED], NotAmber),
        ("green, amber, amber", &[GREEN, AMBER, AMBER], FromGreen),
        ("kept while the lamps change but stay amber", &[GREEN, AMBER, flashing, RED_AND_AMBER], FromGreen),
        ("kept as well when it was not green", &[RED, AMBER, flashing], FromNonGreen),
        ("first seen as amber, then other amber lamps", &[AMBER, flashing], FromNonGreen),
        ("dark before", &[DARK, AMBER], NotAmber),
        ("dark between", &[GREEN, DARK, AMBER], NotAmber),
        ("a green arrow is no green circle", &[arrows, AMBER], FromNonGreen),
        ("unknown before", &[UNKNOWN, AMBER], FromNonGreen),
    ];
    for (name, states, expected) in cases {
        let mut run = Run::new(0.0, 0.0, 0.0);
        for (step, state) in states.iter().enumerate() {
            run.sees(100.0 + 0.1 * step as f64, state);
        }
        assert_eq!(run.tracker.origin(LIGHT), *expected, "{name}");
        assert_eq!(run.tracker.signals()[0].origin, *expected, "{name}");
    }
}

#[test]
fn the_origin_follows_the_stable_state() {
    let mut run = Run::new(0.0, 1.0, 0.0);
    run.sees(0.0, GREEN);
    assert_eq!(run.sees(0.5, AMBER), Some(lamps(GREEN)));
    assert_eq!(run.tracker.origin(LIGHT), AmberOrigin::NotAmber, "amber does not count yet");
    assert_eq!(run.sees(1.5, AMBER), Some(lamps(AMBER)));
    assert_eq!(run.tracker.origin(LIGHT), AmberOrigin::FromGreen);
}

#[test]
fn states_become_stable_after_their_duration() {
    let arrow_and_unknown: &[Lamp] = &[RED_ARROW[0], UNKNOWN[0]];
    let cases: &[(&str, &[Lamp], f64)] = &[
        ("red", RED, 3.0),
        ("red circle and amber", RED_AND_AMBER, 3.0),
        ("amber", AMBER, 2.0),
        ("unknown", UNKNOWN, 1.0),
        ("amber and unknown", &[AMBER[0], UNKNOWN[0]], 2.0),
        ("a red arrow needs no time", RED_ARROW, 0.0),
        ("unknown beside a red arrow", arrow_and_unknown, 1.0),
        ("green", GREEN, 0.0),
        ("dark", DARK, 0.0),
    ];
    for (name, state, required_s) in cases {
        let mut run = Run::new(3.0, 2.0, 1.0);
        if *required_s > 0.0 {
            assert_eq!(run.sees(0.0, state), None, "{name}: nothing is known yet");
            assert_eq!(run.sees(required_s - 1e-9, state), None, "{name}: one nanosecond early");
        }
        assert_eq!(run.sees(*required_s, state), Some(lamps(state)), "{name}: the duration is inclusive");
    }
}

#[test]
fn the_stable_state_holds_until_another_is_stable() {
    let mut run = Run::new(1.0, 1.0, 1.0);
    assert_eq!(run.sees(0.0, GREEN), Some(lamps(GREEN)));
    assert_eq!(run.sees(0.5, RED), Some(lamps(GREEN)));
    assert_eq!(run.sees(1.4, RED), Some(lamps(GREEN)));
    assert_eq!(run.sees(1.5, RED), Some(lamps(RED)));
    // A flicker starts the clock of the new state, and that of the old one anew.
    assert_eq!(run.sees(1.6, AMBER), Some(lamps(RED)));
    assert_eq!(run.sees(1.7, RED), Some(lamps(RED)));
    assert_eq!(run.sees(1.8, GREEN), Some(lamps(GREEN)), "green needs no time");
}

#[test]
fn state_order_and_number_of_lamps_make_another_state_but_confidence_does_not() {
    let flashing: &[Lamp] = &[(Element::RED, Element::CIRCLE, Element::FLASHING)];
    let amber_and_red: &[Lamp] = &[AMBER[0], RED[0]];
    for (name, before, after, resets) in [
        ("state", RED, flashing, true),
        ("order", RED_AND_AMBER, amber_and_red, true),
        ("number", RED, RED_AND_AMBER, true),
        ("colour", RED, AMBER, true),
        ("same", RED, RED, false),
    ] {
        let mut run = Run::new(0.0, 0.0, 0.0);
        run.sees(0.0, before);
        run.sees(1.0, after);
        assert_eq!(run.duration_s(), if resets { 0.0 } else { 1.0 }, "{name}");
    }
    let mut run = Run::new(0.0, 0.0, 0.0);
    run.sees(0.0, RED);
    let mut unsure = group(LIGHT, RED);
    unsure.elements[0].confidence = 0.1;
    run.groups(1.0, false, &[unsure]);
    assert_eq!(run.duration_s(), 1.0);
}

#[test]
fn the_duration_is_that_of_the_latest_state_also_while_an_older_one_counts() {
    let mut run = Run::new(0.0, 5.0, 0.0);
    run.sees(0.0, GREEN);
    run.sees(1.0, AMBER);
    assert_eq!(run.sees(3.5, AMBER), Some(lamps(GREEN)));
    assert_eq!(run.duration_s(), 2.5);
}

#[test]
fn missing_lights_are_held_as_long_as_their_latest_state_needs() {
    let mut run = Run::new(1.0, 2.0, 0.0);
    run.sees(0.0, RED);
    assert_eq!(run.sees(1.0, RED), Some(lamps(RED)));
    assert_eq!(run.misses(1.5), Some(lamps(RED)));
    assert_eq!(run.misses(2.0), Some(lamps(RED)), "missing for exactly the duration");
    assert_eq!(run.misses(2.0 + 1e-9), None);
    assert_eq!(run.sees(2.1, RED), None, "and then it is unknown again");

    // The latest state decides, not the stable one.
    let mut run = Run::new(1.0, 2.0, 0.0);
    run.sees(0.0, RED);
    run.sees(1.0, RED);
    run.sees(1.1, AMBER);
    assert_eq!(run.misses(3.1), Some(lamps(RED)), "amber needs two seconds");
    run.sees(3.1, GREEN);
    assert_eq!(run.misses(3.2), None, "green needs none");
}

#[test]
fn without_durations_a_missing_light_is_forgotten_when_time_goes_on() {
    let mut run = Run::new(0.0, 0.0, 0.0);
    run.sees(1.0, GREEN);
    assert_eq!(run.misses(1.0), Some(lamps(GREEN)), "no time has passed");
    assert_eq!(run.misses(1.1), None);
    run.sees(1.2, AMBER);
    assert_eq!(run.tracker.origin(LIGHT), AmberOrigin::NotAmber, "that it was green is forgotten as well");
}

#[test]
fn a_standing_vehicle_sees_raw_signals_and_held_ones_of_missing_lights() {
    let mut run = Run::new(1.0, 1.0, 1.0);
    assert_eq!(run.groups(0.0, true, &[group(1, RED)]), [(1, lamps(RED))], "not stable yet");
    run.groups(1.0, true, &[group(1, RED), group(2, RED)]);
    let seen = run.groups(1.1, true, &[group(1, GREEN)]);
    assert_eq!(seen, [(1, lamps(GREEN))], "light 2 never was stable");
    run.groups(2.1, true, &[group(2, RED), group(1, RED)]);
    run.groups(3.1, true, &[group(2, RED), group(1, RED)]);
    let seen = run.groups(3.2, true, &[group(3, AMBER)]);
    assert_eq!(seen, [(3, lamps(AMBER)), (1, lamps(RED)), (2, lamps(RED))], "missing ones last, by id");
}

#[test]
fn a_group_given_twice_is_answered_twice_and_never_loses_a_red() {
    let mut run = Run::new(0.0, 0.0, 0.0);
    let seen = run.groups(0.0, false, &[group(LIGHT, RED), group(LIGHT, GREEN)]);
    assert_eq!(seen, [(LIGHT, lamps(RED)), (LIGHT, lamps(GREEN))]);
    let seen = run.groups(0.1, false, &[group(LIGHT, GREEN), group(LIGHT, RED)]);
    assert_eq!(seen, [(LIGHT, lamps(GREEN)), (LIGHT, lamps(RED))]);
}

#[test]
fn after_a_small_step_back_ages_are_negative_and_nothing_is_dropped() {
    let mut run = Run::new(0.5, 0.5, 0.5);
    run.sees(10.0, RED);
    run.sees(10.5, RED);
    assert_eq!(run.sees(10.4, AMBER), Some(lamps(RED)));
    assert_eq!(run.sees(10.2, AMBER), Some(lamps(RED)), "seen for minus 0.2 s");
    assert_eq!(run.duration_s(), 0.0, "a duration is never negative");
    assert_eq!(run.misses(9.0), Some(lamps(RED)));
}

#[test]
fn a_restarted_clock_holds_what_counted_and_lets_the_rest_become_stable() {
    let mut run = Run::new(1.0, 1.0, 1.0);
    run.sees(1000.0, GREEN);
    run.sees(1001.0, RED);
    run.tracker.restart_clock((5.0 * SECOND) as i64);
    assert_eq!(run.sees(5.0, RED), Some(lamps(GREEN)));
    assert_eq!(run.sees(6.0, RED), Some(lamps(RED)), "not only after a thousand seconds");
}

#[test]
fn doubted_origins_are_not_from_green_but_stable_states_stay() {
    let mut run = Run::new(0.0, 0.0, 0.0);
    run.sees(0.0, GREEN);
    run.sees(0.1, AMBER);
    run.tracker.doubt_origins();
    assert_eq!(run.sees(0.2, AMBER), Some(lamps(AMBER)));
    assert_eq!(run.tracker.origin(LIGHT), AmberOrigin::NotAmber);
}

#[test]
fn the_number_of_lights_is_bounded_and_surplus_ones_pass_as_they_are() {
    let mut run = Run::new(1.0, 1.0, 1.0);
    let flood: Vec<_> = (0..MAX_LIGHTS as i64 + 10).map(|id| group(id, RED)).collect();
    let seen = run.groups(0.0, false, &flood);
    assert_eq!(run.tracker.len(), MAX_LIGHTS);
    assert_eq!(seen.len(), 10, "the others are not stable yet");
    assert!(seen.iter().all(|(id, shown)| *id >= MAX_LIGHTS as i64 && *shown == lamps(RED)));
    run.groups(1.1, false, &[]);
    assert_eq!(run.tracker.len(), 0);
}
