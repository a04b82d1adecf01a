//! The edges of each rule: what is inclusive, what is measured from where, and the outcome of odd inputs.

use super::*;

/// One ulp more.
fn up(value: f64) -> f64 {
    value.next_up()
}

#[test]
fn what_a_light_must_show_to_constrain() {
    let circle = |color| (color, Element::CIRCLE);
    let (red, amber) = (Some(RED_METRIC), Some(AMBER_METRIC));
    let arrow: Lamp = (Element::RED, Element::LEFT_ARROW);
    let cases: &[(&str, &[Lamp], bool, Option<&str>)] = &[
        ("nothing", &[], true, None),
        ("white", &[circle(Element::WHITE)], true, None),
        ("red arrow", &[arrow], true, None),
        ("red over amber", RED_AND_AMBER, false, red),
        ("green over red", &[RED[0], GREEN[0]], true, None),
        ("amber and unknown", &[AMBER[0], UNKNOWN[0]], true, red),
        ("amber and untreated unknown", &[AMBER[0], UNKNOWN[0]], false, amber),
        ("unknown circle", &[circle(Element::UNKNOWN)], true, red),
    ];
    for (name, lamps, treat_unknown, expected) in cases {
        let mut world = World::new(20.0, with(|p| p.treat_unknown_light_as_red_light = *treat_unknown), 0.0);
        assert_eq!(violated(&world.shows(lamps).judge(traj(0.0, 30.0, 5.0))), *expected, "{name}");
    }
}

#[test]
fn lights_that_are_not_on_the_route_do_not_matter() {
    let mut world = World::new(5.0, base(), 0.0);
    assert!(world.signals(vec![group(4711, RED), group(-1, RED)]).ok(traj(0.0, 10.0, 5.0)), "unknown ids");
    world.scene.route = Some(Epoch { number: 2, value: Arc::new(route(&[])) });
    assert!(world.shows(RED).ok(traj(0.0, 10.0, 5.0)), "an empty route");
}

#[test]
fn of_contradicting_groups_of_one_light_the_red_one_counts() {
    let mut world = World::new(5.0, base(), 0.0);
    assert!(!world.signals(vec![group(LIGHT, RED), group(LIGHT, GREEN)]).ok(traj(0.0, 10.0, 5.0)));
    assert!(!world.at(100.1).signals(vec![group(LIGHT, GREEN), group(LIGHT, RED)]).ok(traj(0.0, 10.0, 5.0)));
}

#[test]
fn a_route_that_leaves_the_map_is_judged_by_nobody_until_it_is_replaced() {
    let mut world = World::new(5.0, base(), 0.0);
    world.scene.route = Some(Epoch { number: 2, value: Arc::new(route(&[LANELET, 7])) });
    assert_eq!(world.shows(GREEN).failure(), "lanelet 7 is not in the map");
    world.scene.route = Some(Epoch { number: 3, value: Arc::new(route(&[LANELET])) });
    assert!(world.ok(traj(0.0, 10.0, 5.0)));
    assert!(!world.shows(RED).ok(traj(0.0, 10.0, 5.0)), "the next route has its lights");
}

#[test]
fn before_the_first_scene_nothing_is_judged() {
    let world = World::new(5.0, base(), 0.0);
    let judgement =
        world.filter.judge(&world.scene, &candidate_of(traj(0.0, 10.0, 5.0)), &mut Scratch::default());
    assert!(!judgement.feasible && judgement.failure.is_some());
}

#[test]
fn numbers_that_are_none_are_not_judged_with() {
    for bad in [f64::NAN, f64::INFINITY] {
        for (speed, acceleration) in [(bad, 0.0), (5.0, bad)] {
            let mut world = World::new(5.0, base(), 0.0);
            assert!(world.ego(speed, acceleration).failure().contains("not finite"));
        }
    }
}

#[test]
fn a_map_without_lights_constrains_nobody() {
    let mut builder = MapBuilder::new();
    builder.point(1, [0.0; 3], &[]).unwrap();
    builder.line_string(1, &[1], &[]).unwrap();
    builder.lanelet(LANELET, 1, 1, &[]).unwrap();
    let mut world = World::on(builder.build().unwrap(), base(), 0.0);
    assert!(world.shows(RED).ok(traj(0.0, 10.0, 5.0)));
}

#[test]
fn the_tracker_advances_while_other_inputs_are_missing() {
    let mut world = World::new(5.0, with(|p| p.stable_duration_threshold_red = 1.0), 0.0);
    let acceleration = world.scene.acceleration.take();
    world.at(100.0).shows(RED).failure();
    world.scene.acceleration = acceleration;
    assert!(!world.at(101.0).ok(traj(0.0, 10.0, 5.0)));
}

#[test]
fn the_tracker_advances_in_cycles_without_candidates() {
    let mut world = World::new(5.0, with(|p| p.stable_duration_threshold_red = 1.0), 0.0);
    world.at(100.0).shows(RED).cycle(&[]);
    assert!(!world.at(101.0).ok(traj(0.0, 10.0, 5.0)));
}

#[test]
fn the_bumper_crosses_red_lines_but_not_amber_ones() {
    for (lamps, ok) in [(RED, false), (AMBER, true)] {
        let world = |x| World::new(x, with(|p| p.crossing_time_limit = 0.0), 4.0);
        assert_eq!(world(12.0).shows(lamps).ok(traj(0.0, 10.0, 5.0)), ok);
        assert!(!world(9.0).shows(lamps).ok(traj(0.0, 10.0, 5.0)), "the pose crosses both");
    }
    let mut reversing = traj(0.0, 10.0, 5.0);
    reversing[1].pose = Pose::from_xy_yaw(10.0, 0.0, std::f64::consts::PI);
    assert!(World::new(12.0, base(), 4.0).shows(RED).ok(reversing), "it sticks out where the vehicle faces");
}

#[test]
fn touching_the_line_is_crossing_it() {
    assert!(!World::new(10.0, base(), 0.0).shows(RED).ok(traj(0.0, 10.0, 5.0)), "with the last point");
    assert!(World::new(up(10.0), base(), 0.0).shows(RED).ok(traj(0.0, 10.0, 5.0)));
    assert!(!World::new(0.0, base(), 0.0).shows(RED).ok(traj(0.0, 10.0, 5.0)), "with the first");
    let beside = |y| {
        let mut points = traj(0.0, 10.0, 5.0);
        points.iter_mut().for_each(|point| point.pose = Pose::from_xy_yaw(point.pose.position.x, y, 0.0));
        points
    };
    assert!(!World::new(5.0, base(), 0.0).shows(RED).ok(beside(5.0)), "at its end");
    assert!(World::new(5.0, base(), 0.0).shows(RED).ok(beside(up(5.0))));
}

#[test]
fn a_stop_may_overshoot_by_the_margin_inclusive() {
    let stopping_at = |x: f64| vec![point(0.0, 0.0, 5.0), point(5.0, x, 0.0)];
    for (front_offset_m, lamps) in [(0.0, RED), (0.0, AMBER), (2.0, RED), (2.0, AMBER)] {
        let mut world = World::new(10.0, base(), front_offset_m);
        world.shows(lamps);
        assert!(world.ok(stopping_at(10.5 - front_offset_m)), "exactly the margin past the line");
        let farther = stopping_at(10.5_f64.next_up() - front_offset_m);
        // With a bumper of 2 m the pose stays before the line; amber looks at the pose only.
        assert_eq!(world.ok(farther), (front_offset_m, lamps) == (2.0, AMBER));
    }
}

#[test]
fn a_stop_is_at_or_below_the_threshold_in_f32_and_ends_the_path() {
    let pausing =
        |speed_mps: f64| vec![point(0.0, 0.0, 5.0), point(1.0, 2.0, speed_mps), point(3.0, 30.0, 5.0)];
    let look_far = |threshold: f64| {
        with(|p| (p.ego_stopped_velocity_threshold, p.min_lookahead_distance) = (threshold, 100.0))
    };
    let as_f32 = f64::from(0.1_f32);
    for (threshold, speed_mps, stops) in
        [(as_f32, 0.1, true), (0.1, 0.1, false), (0.1, 0.0, true), (0.1, -3.0, true), (0.1, 0.2, false)]
    {
        let mut world = World::new(20.0, look_far(threshold), 0.0);
        let hidden = world.shows(RED).ok(pausing(speed_mps));
        assert_eq!(hidden, stops, "threshold {threshold}, speed {speed_mps}");
    }
}

#[test]
fn standing_at_the_first_point_or_at_its_place_is_no_stop() {
    let look_far = with(|p| p.min_lookahead_distance = 100.0);
    let departing = vec![point(0.0, 0.0, 0.0), point(1.0, 0.0, 0.0), point(3.0, 30.0, 5.0)];
    assert!(!World::new(20.0, look_far.clone(), 0.0).shows(RED).ok(departing));
    let standing = || vec![point(0.0, 0.0, 0.0); 3];
    assert!(!World::new(3.0, look_far.clone(), 4.0).shows(RED).ok(standing()), "the bumper is over the line");
    assert!(World::new(5.0, look_far, 4.0).shows(RED).ok(standing()));
}

#[test]
fn the_path_ends_with_the_first_point_beyond_the_look_ahead() {
    let dense = || (0..=40).map(|x| point(f64::from(x) / 5.0, f64::from(x), 5.0)).collect::<Vec<_>>();
    let parameters = with(|p| p.min_lookahead_distance = 20.0);
    for (x, ok) in [(20.5, false), (21.0, false), (21.5, true)] {
        let mut world = World::new(x, parameters.clone(), 0.0);
        assert_eq!(world.shows(RED).ok(dense()), ok, "a length of 20 m is not beyond 20 m, line at {x}");
    }
    // The stopping distance looks farther: 11.17 m and the margin from 5 m/s, so 12 m is the last length.
    let braking = with(|p| {
        p.checked_trajectory_length = CheckedTrajectoryLength { deceleration_limit: 2.0, jerk_limit: 2.0 };
    });
    for (x, ok) in [(11.5, false), (12.5, true)] {
        assert_eq!(World::new(x, braking.clone(), 0.0).shows(RED).ok(dense()), ok, "line at {x}");
    }
    let sparse = traj(0.0, 400.0, 5.0);
    assert!(!World::new(300.0, base(), 0.0).shows(RED).ok(sparse), "two points are always looked at");
}

#[test]
fn what_is_past_is_not_checked_and_not_measured() {
    let parameters = || with(|p| p.min_lookahead_distance = 20.0);
    let path = |now: f64| -> Vec<TrajectoryPoint> {
        (0..=40).map(|x| point((f64::from(x) - now) / 5.0, f64::from(x), 5.0)).collect()
    };
    assert!(World::new(5.0, parameters(), 0.0).shows(RED).ok(path(6.0)), "a line passed in the past");
    assert!(!World::new(26.5, parameters(), 0.0).shows(RED).ok(path(6.0)), "20 m count from the present");
    assert!(World::new(27.5, parameters(), 0.0).shows(RED).ok(path(6.0)));
    assert!(World::new(20.0, parameters(), 0.0).shows(RED).ok(path(40.0)), "one point left");
    assert!(World::new(20.0, parameters(), 0.0).shows(RED).ok(path(50.0)), "none left");
    let judgement = World::new(10.0, parameters(), 2.0).shows(RED).judge(path(6.0));
    let evidence = judgement.evidence.unwrap();
    assert_eq!((evidence.index, evidence.x_m), (8, 10.0), "the bumper is there when the pose is at 8 m");
    assert!((evidence.time_s - 0.4).abs() < 1e-9);
}

#[test]
fn amber_can_stop_within_exactly_its_distance() {
    // Upstream's acceleration is 32-bit: with 0.1 the vehicle stops a little later than with the 64-bit number.
    let stop_m = |acceleration: f64| calculate_stop_distance(5.0, acceleration, 2.8, 5.0, 0.5).unwrap();
    let (exact_m, rounded_m) = (stop_m(0.1), stop_m(f64::from(0.1_f32)));
    assert!(rounded_m > exact_m);
    let path = |line: f64| {
        let mut points = vec![point(0.0, 0.0, 5.0), point(0.1, line, 5.0), point(0.2, 2.0 * line, 5.0)];
        points[0].acceleration_mps2 = 0.1;
        points
    };
    for (line, ok) in [(rounded_m, false), (rounded_m.next_down(), true), (exact_m, true)] {
        let mut world = World::new(line, base(), 0.0);
        assert_eq!(world.shows(AMBER).ok(path(line)), ok, "line at {line}");
    }
    // Measured from the front bumper, and with the speed of the candidate, not of the odometry.
    let far = with(|p| p.crossing_time_limit = 100.0);
    let mut world = World::new(10.0, far, 2.0);
    assert!(world.ego(0.5, 0.0).shows(AMBER).ok(traj(0.0, 20.0, 5.0)), "8.33 m do not fit into 8 m");
}

#[test]
fn amber_is_passable_up_to_its_time_limit_less_the_time_seen() {
    let limit = |limit_s: f64| with(|p| p.crossing_time_limit = limit_s);
    // Line at 10 m with 20 m/s: after 0.5 s; with a bumper of 5 m a quarter of a second earlier.
    for (front_offset_m, limit_s, ok) in [
        (0.0, 0.5, true),
        (0.0, 0.5_f64.next_down(), false),
        (5.0, 0.25, true),
        (5.0, 0.25_f64.next_down(), false),
        (12.0, 0.0, true),
    ] {
        let mut world = World::new(10.0, limit(limit_s), front_offset_m);
        let judged = world.shows(AMBER).ok(traj(0.0, 20.0, 20.0));
        assert_eq!(judged, ok, "bumper {front_offset_m}, limit {limit_s}");
    }
    let mut world = World::new(10.0, limit(1.0), 0.0);
    world.shows(AMBER).cycle(&[]);
    assert!(world.at(100.5).ok(traj(0.0, 20.0, 20.0)), "half a second seen, half a second to go");
    assert!(!world.at(100.500_000_001).ok(traj(0.0, 20.0, 20.0)));
}

#[test]
fn the_bumper_is_brought_forward_at_a_millimetre_per_second_at_least() {
    // The pose is at the line after 3 s, and the bumper of 2 mm at half that speed would be 4 s earlier.
    let path = || vec![point(0.0, 0.0, 5e-4), point(6.0, 20.0, 5.0)];
    for (limit_s, ok) in [(0.9, false), (1.1, true)] {
        let parameters = with(|p| (p.crossing_time_limit, p.deceleration_limit) = (limit_s, 0.0));
        assert_eq!(World::new(10.0, parameters, 0.002).shows(AMBER).ok(path()), ok);
    }
}

#[test]
fn a_crossing_on_a_piece_without_length_has_the_time_of_its_start() {
    let parameters = with(|p| (p.crossing_time_limit, p.deceleration_limit) = (1.0, 0.0));
    let path = vec![point(0.5, 0.0, 5.0), point(9.0, 0.0, 5.0), point(9.5, 5.0, 5.0)];
    assert!(World::new(0.0, parameters, 0.0).shows(AMBER).ok(path));
}

#[test]
fn the_allowance_is_strict_and_needs_a_stop_beyond_the_margin() {
    // From 10 m/s with 2/2 and half a second: 34.917 m.
    let parameters = |allow_m: f64, margin_m: f64| {
        with(|p| {
            (p.allow_if_cannot_stop_distance, p.stop_overshoot_margin) = (allow_m, margin_m);
            p.checked_trajectory_length =
                CheckedTrajectoryLength { deceleration_limit: 2.0, jerk_limit: 2.0 };
        })
    };
    let stop_m = calculate_stop_distance(10.0, 0.0, 2.0, 2.0, 0.5).unwrap();
    let path = |line: f64| vec![point(0.0, 0.0, 10.0), point(1.0, line, 10.0), point(20.0, 100.0, 10.0)];
    for (name, line, allow_m, margin_m, ok) in [
        ("nearer than allowed", 20.0, up(20.0), 0.5, true),
        ("as near as allowed", 20.0, 20.0, 0.5, false),
        ("cannot stop", stop_m.next_down(), 90.0, 0.0, true),
        ("just stops", stop_m, 90.0, 0.0, false),
        ("stops within the margin", stop_m - 2.0, 90.0, 2.0, false),
        ("cannot stop within the margin", stop_m - 2.1, 90.0, 2.0, true),
        ("below a millimetre it is off", 5e-4, 9e-4, 0.5, false),
    ] {
        for lamps in [RED, AMBER] {
            let mut parameters = parameters(allow_m, margin_m);
            parameters.crossing_time_limit = -1.0;
            let mut world = World::new(line, parameters, 0.0);
            assert_eq!(world.ego(10.0, 0.0).shows(lamps).ok(path(line)), ok, "{name} {lamps:?}");
        }
    }
}

#[test]
fn violations_are_explained_in_words() {
    let explain = |world: &mut World, points| {
        let judgement = world.judge(points);
        world.filter.explain(&judgement).unwrap()
    };
    let mut world = World::new(30.0, with(|p| p.min_lookahead_distance = 100.0), 4.0);
    assert_eq!(
        explain(world.shows(RED), traj(0.0, 50.0, 10.0)),
        "front bumper crosses stop line 5 of red light 1000 at 2.6 s, 26.0 m ahead"
    );
    assert_eq!(
        explain(world.shows(AMBER), traj(0.0, 50.0, 10.0)),
        "front bumper crosses stop line 5 of amber light 1000 at 2.6 s, 26.0 m ahead"
    );
    let mut world = World::new(3.0, with(|p| p.treat_amber_light_as_red_light = true), 4.0);
    assert_eq!(
        explain(world.shows(AMBER), traj(0.0, 50.0, 10.0)),
        "front bumper is 1.0 m past stop line 5 of amber light (treated as red) 1000 and drives on"
    );
}

#[test]
fn changed_parameters_act_and_keep_what_was_seen() {
    let mut world = World::new(5.0, with(|p| p.stable_duration_threshold_red = 9.0), 0.0);
    assert!(world.shows(RED).ok(traj(0.0, 10.0, 5.0)));
    let mut parameters = ValidatorParameters { traffic_light: base(), ..ValidatorParameters::default() };
    parameters.traffic_light.stable_duration_threshold_red = 1.0;
    world.filter.configure(&parameters);
    assert!(!world.at(101.0).ok(traj(0.0, 10.0, 5.0)));
}
