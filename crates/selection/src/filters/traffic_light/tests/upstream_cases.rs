//! The cases of upstream's filter and checker tests, numbered as in the specification.

use super::*;

#[test]
fn single_cycles() {
    struct Case {
        row: &'static str,
        x: f64,
        lamps: &'static [Lamp],
        front_offset_m: f64,
        ego: (f64, f64),
        parameters: TrafficLightParameters,
        path: (f64, f64, f64),
        ok: bool,
    }
    let case = |row, x, lamps, path, ok| Case {
        row,
        x,
        lamps,
        front_offset_m: 0.0,
        ego: (5.0, 0.0),
        parameters: base(),
        path,
        ok,
    };
    let allowing = |allow_m: f64, decel: f64, jerk: f64, delay_s: f64| {
        with(|p| {
            p.allow_if_cannot_stop_distance = allow_m;
            p.checked_trajectory_length =
                CheckedTrajectoryLength { deceleration_limit: decel, jerk_limit: jerk };
            p.delay_response_time = delay_s;
        })
    };
    let treat_unknown = |treat| with(|p| p.treat_unknown_light_as_red_light = treat);
    let cases = [
        case("3", 5.0, RED, (0.0, 10.0, 5.0), false),
        case("4", 5.0, GREEN, (0.0, 10.0, 5.0), true),
        case("5", 5.0, RED, (0.0, 4.0, 5.0), true),
        Case { front_offset_m: 2.0, ..case("6", 5.0, RED, (0.0, 4.0, 5.0), false) },
        Case {
            front_offset_m: 2.0,
            parameters: allowing(4.0, 2.0, 2.0, 0.5),
            ..case("7, allow 4", 5.0, RED, (0.0, 10.0, 10.0), true)
        },
        Case {
            front_offset_m: 2.0,
            parameters: allowing(3.0, 2.0, 2.0, 0.5),
            ..case("7, allow 3", 5.0, RED, (0.0, 10.0, 10.0), false)
        },
        Case {
            front_offset_m: 5.0,
            ego: (10.0, 0.0),
            parameters: allowing(3.0, 2.0, 2.0, 1.0),
            ..case("8", 3.0, RED, (0.0, 10.0, 10.0), true)
        },
        Case {
            ego: (2.0, -2.0),
            parameters: allowing(10.0, 5.0, 2.0, 2.0),
            ..case("9", 4.0, RED, (0.0, 5.0, 2.0), false)
        },
        Case {
            ego: (2.0, -2.0),
            parameters: allowing(10.0, 5.0, 2.0, 2.0),
            ..case("10", 0.5, RED, (0.0, 1.0, 2.0), false)
        },
        Case {
            ego: (1.0, 0.0),
            parameters: allowing(10.0, 0.0, 2.0, 0.0),
            ..case("11", 0.25, RED, (0.0, 1.0, 1.0), false)
        },
        Case {
            ego: (10.0, 0.0),
            parameters: allowing(0.0, 2.0, 2.0, 1.0),
            ..case("12", 1.0, RED, (0.0, 2.0, 10.0), false)
        },
        case("13", 20.0, AMBER, (0.0, 30.0, 5.0), false),
        case("14", 5.0, AMBER, (0.0, 10.0, 10.0), true),
        Case {
            parameters: with(|p| {
                p.deceleration_limit = -0.5;
                p.delay_response_time = 1.0;
                p.crossing_time_limit = 1.0;
            }),
            ..case("15", 150.0, AMBER, (0.0, 200.0, 10.0), false)
        },
        Case {
            parameters: with(|p| p.treat_amber_light_as_red_light = true),
            ..case("16", 5.0, AMBER, (0.0, 10.0, 10.0), false)
        },
        Case { parameters: treat_unknown(true), ..case("17", 5.0, UNKNOWN, (0.0, 10.0, 5.0), false) },
        Case { parameters: treat_unknown(false), ..case("17, off", 5.0, UNKNOWN, (0.0, 10.0, 5.0), true) },
    ];
    for case in cases {
        let mut world = World::new(case.x, case.parameters, case.front_offset_m);
        world.ego(case.ego.0, case.ego.1).shows(case.lamps);
        let (from, to, speed) = case.path;
        assert_eq!(world.ok(traj(from, to, speed)), case.ok, "row {}", case.row);
    }
}

#[test]
fn row_1_an_empty_candidate_has_nothing_to_check() {
    assert!(World::new(5.0, base(), 0.0).shows(RED).ok(Vec::new()));
}

#[test]
fn row_2_missing_inputs_are_named_in_order() {
    let mut world = World::new(5.0, base(), 0.0);
    let full = world.scene.clone();
    world.scene = Scene::empty(full.now, Arc::clone(&full.vehicle));
    assert_eq!(world.failure(), "Lanelet map is not set");
    world.scene.map = full.map;
    assert_eq!(world.failure(), "Route is not set");
    world.scene.route = full.route;
    assert_eq!(world.failure(), "Traffic signals are not set");
    world.scene.traffic_signals = full.traffic_signals;
    assert_eq!(world.failure(), "Odometry is not set");
    world.scene.odometry = full.odometry;
    assert_eq!(world.failure(), "Acceleration is not set");
    world.scene.acceleration = full.acceleration;
    assert!(world.ok(traj(0.0, 10.0, 5.0)));
}

/// Rows of several cycles: time, state of the light (or none in the message), whether the candidate is accepted.
#[test]
fn sequences_of_states() {
    type Step = (f64, Option<&'static [Lamp]>, bool);
    let all_one = || {
        with(|p| {
            p.stable_duration_threshold_red = 1.0;
            p.stable_duration_threshold_amber = 1.0;
            p.stable_duration_threshold_unknown = 1.0;
        })
    };
    let unknown_one = |amber_s: f64| {
        with(|p| {
            p.treat_unknown_light_as_red_light = true;
            p.stable_duration_threshold_unknown = 1.0;
            p.stable_duration_threshold_amber = amber_s;
        })
    };
    let cases: &[(&str, TrafficLightParameters, f64, &[Step])] = &[
        ("18", unknown_one(0.0), 5.0, &[(0.0, Some(UNKNOWN), true), (1.1, Some(UNKNOWN), false)]),
        ("19", unknown_one(5.0), 5.0, &[(0.0, Some(UNKNOWN), true), (1.1, Some(UNKNOWN), false)]),
        (
            "20",
            unknown_one(0.0),
            5.0,
            &[
                (0.0, Some(GREEN), true),
                (0.5, Some(UNKNOWN), true),
                (1.4, Some(UNKNOWN), true),
                (1.6, Some(UNKNOWN), false),
            ],
        ),
        ("21", unknown_one(0.0), 0.0, &[(0.0, Some(UNKNOWN), false)]),
        (
            "22",
            unknown_one(5.0),
            5.0,
            &[(0.0, Some(UNKNOWN), true), (1.1, None, true), (1.1, Some(UNKNOWN), true)],
        ),
        (
            "23",
            all_one(),
            5.0,
            &[
                (0.0, Some(GREEN), true),
                (0.0, Some(RED), true),
                (0.5, Some(RED), true),
                (1.1, Some(RED), false),
            ],
        ),
        ("25", all_one(), 5.0, &[(0.0, Some(RED), true), (2.0, None, true), (2.0, Some(RED), true)]),
        (
            "26",
            all_one(),
            5.0,
            &[
                (0.0, Some(AMBER), true),
                (0.5, Some(AMBER), true),
                (0.5, Some(RED), true),
                (1.1, Some(RED), true),
                (1.6, Some(RED), false),
            ],
        ),
    ];
    for (row, parameters, speed_mps, steps) in cases {
        let mut world = World::new(5.0, parameters.clone(), 0.0);
        for (time_s, lamps, expected) in *steps {
            world.ego(*speed_mps, 0.0).at(100.0 + time_s);
            world.signals(lamps.iter().map(|lamps| group(LIGHT, lamps)).collect());
            assert_eq!(world.ok(traj(0.0, 10.0, 5.0)), *expected, "row {row} after {time_s} s");
        }
    }
}

#[test]
fn row_24_an_amber_refused_stays_refused_for_the_hysteresis() {
    let mut world = World::new(20.0, with(|p| p.amber_rejection.hysteresis_duration = 2.0), 0.0);
    assert!(!world.shows(AMBER).ok(traj(0.0, 30.0, 5.0)));
    assert!(!world.at(101.0).ok(traj(15.0, 30.0, 10.0)), "could pass, but was refused");
    assert!(world.at(102.1).ok(traj(15.0, 30.0, 10.0)), "being forced does not renew it");
}

#[test]
fn rows_27_and_28_a_planned_stop_is_remembered_if_asked_for() {
    for reject_if_stop_detected in [true, false] {
        let rejection = AmberRejection { hysteresis_duration: 5.0, reject_if_stop_detected };
        let parameters = with(|p| (p.amber_rejection, p.crossing_time_limit) = (rejection, 100.0));
        let mut world = World::new(5.0, parameters, 0.0);
        world.shows(AMBER);
        assert!(world.ok(vec![point(0.0, 0.0, 5.0), point(1.0, 5.0, 0.0)]));
        let judged = world.ego(10.0, 0.0).ok(traj(0.0, 10.0, 10.0));
        assert_eq!(judged, !reject_if_stop_detected);
    }
}

/// x = 0 to 60 in steps of 1 m at 10 m/s; with a stop, the last point is there.
fn checker_path(stop: Option<f64>) -> Vec<TrajectoryPoint> {
    let last = stop.unwrap_or(60.0);
    let steps = (0..=60).map(f64::from).take_while(|x| *x < last);
    let mut points: Vec<_> = steps.map(|x| point(x / 10.0, x, 10.0)).collect();
    points.push(point(last / 10.0, last, if stop.is_some() { 0.0 } else { 10.0 }));
    points
}

fn checker() -> TrafficLightParameters {
    with(|p| {
        (p.deceleration_limit, p.jerk_limit, p.delay_response_time) = (1.0, 1.0, 0.0);
        (p.crossing_time_limit, p.stop_overshoot_margin, p.min_lookahead_distance) = (0.1, 0.0, 100.0);
        p.checked_trajectory_length =
            CheckedTrajectoryLength { deceleration_limit: 999.0, jerk_limit: 999.0 };
    })
}

#[test]
fn checker_cases() {
    let changed = |change: fn(&mut TrafficLightParameters)| {
        let mut parameters = checker();
        change(&mut parameters);
        parameters
    };
    let (red, amber) = (Some(RED_METRIC), Some(AMBER_METRIC));
    let cases = [
        ("green", GREEN, checker(), None, None),
        ("red", RED, checker(), None, red),
        ("red, stop before", RED, checker(), Some(28.0), None),
        ("red, overshoot", RED, changed(|p| p.stop_overshoot_margin = 1.0), Some(30.5), None),
        ("red, overshoot too far", RED, changed(|p| p.stop_overshoot_margin = 0.4), Some(30.5), red),
        ("amber", AMBER, checker(), None, amber),
        (
            "amber, cannot stop",
            AMBER,
            changed(|p| (p.crossing_time_limit, p.deceleration_limit, p.jerk_limit) = (10.0, 0.1, 0.1)),
            None,
            None,
        ),
        ("amber, stop before", AMBER, checker(), Some(28.0), None),
        ("amber as red", AMBER, changed(|p| p.treat_amber_light_as_red_light = true), None, red),
        ("unknown", UNKNOWN, checker(), None, None),
        ("unknown as red", UNKNOWN, changed(|p| p.treat_unknown_light_as_red_light = true), None, red),
        (
            "red, cannot stop",
            RED,
            changed(|p| {
                p.allow_if_cannot_stop_distance = 40.0;
                p.checked_trajectory_length =
                    CheckedTrajectoryLength { deceleration_limit: 0.1, jerk_limit: 0.1 };
            }),
            None,
            None,
        ),
    ];
    for (name, lamps, parameters, stop, expected) in cases {
        let mut world = World::new(30.0, parameters, 0.0);
        world.ego(10.0, 0.0).shows(lamps);
        let judgement = world.judge(checker_path(stop));
        assert_eq!(violated(&judgement), expected, "{name}");
        if expected.is_some() {
            let evidence = judgement.evidence.unwrap();
            assert_eq!((evidence.regulatory_element_id, evidence.element_id), (Some(LIGHT), Some(STOP_LINE)));
        }
    }
    assert!(World::new(30.0, checker(), 0.0).shows(RED).ok(Vec::new()));
}

#[test]
fn amber_after_green_may_be_passed_on_a_turning_lane_with_an_arrow_light() {
    let amber = Some(AMBER_METRIC);
    let cases = [
        ("green", GREEN, Some("right"), "right_arrow", true, None),
        ("left as well", GREEN, Some("left"), "red_yellow_green_left_arrow", true, None),
        ("red", RED, Some("right"), "right_arrow", true, amber),
        ("first seen", &[], Some("right"), "right_arrow", true, amber),
        ("no turn", GREEN, None, "right_arrow", true, amber),
        ("straight on", GREEN, Some("straight"), "right_arrow", true, amber),
        ("no arrow", GREEN, Some("right"), "red_yellow_green", true, amber),
        ("switched off", GREEN, Some("right"), "right_arrow", false, amber),
    ];
    for (name, before, turn, shape, enabled, expected) in cases {
        let mut parameters = checker();
        parameters.enable_arrow_aware_amber_passing = enabled;
        let mut world = World::on(road(30.0, turn, shape), parameters.clone(), 0.0);
        let short = || checker_path(None).into_iter().take(26).collect();
        assert!(world.ego(10.0, 0.0).at(100.0).shows(before).ok(short()), "{name}");
        assert_eq!(violated(&world.at(100.2).shows(AMBER).judge(checker_path(None))), expected, "{name}");

        // The exception goes before treating amber as red.
        parameters.treat_amber_light_as_red_light = true;
        let mut world = World::on(road(30.0, turn, shape), parameters, 0.0);
        world.ego(10.0, 0.0).at(100.0).shows(before).ok(short());
        let as_red = world.at(100.2).shows(AMBER).judge(checker_path(None));
        assert_eq!(violated(&as_red), expected.map(|_| RED_METRIC), "{name}, amber as red");
    }
}

#[test]
fn a_green_arrow_in_the_direction_of_the_lane_lets_go() {
    let arrow = |shape| [RED[0], (Element::GREEN, shape)];
    let cases = [
        (Some("right"), Element::RIGHT_ARROW, true),
        (Some("left"), Element::LEFT_ARROW, true),
        (Some("straight"), Element::UP_ARROW, true),
        (Some("right"), Element::LEFT_ARROW, false),
        (Some("straight"), Element::UP_LEFT_ARROW, false),
        (Some("u_turn"), Element::LEFT_ARROW, false),
        (None, Element::UP_ARROW, false),
    ];
    for (turn, shape, ok) in cases {
        let mut world = World::on(road(30.0, turn, "red_yellow_green"), checker(), 0.0);
        let judged = world.shows(&arrow(shape)).ok(checker_path(None));
        assert_eq!(judged, ok, "{turn:?} with shape {shape}");
    }
}
