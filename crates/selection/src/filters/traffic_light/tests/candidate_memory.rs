//! What a candidate's own past does to it: refused ambers, the look-ahead floor, and when both are forgotten.

use super::*;

/// Every metre from 0 at 5 m/s.
fn dense(until: i32) -> Vec<TrajectoryPoint> {
    (0..=until).map(|x| point(f64::from(x) / 5.0, f64::from(x), 5.0)).collect()
}

fn sample(number: u32, points: Vec<TrajectoryPoint>) -> Candidate {
    let mut candidate = candidate_of(points);
    candidate.key = CandidateKey { generator: Uuid::default(), sample: number };
    candidate
}

fn feasible(judgements: &[Judgement]) -> Vec<bool> {
    judgements.iter().map(|judgement| judgement.feasible).collect()
}

#[test]
fn without_hysteresis_a_refusal_lasts_for_its_stamp_only_and_for_its_candidate_only() {
    let mut world = World::new(20.0, base(), 0.0);
    let (stoppable, passable) = (traj(0.0, 30.0, 5.0), traj(15.0, 30.0, 10.0));
    let both = [sample(0, stoppable.clone()), sample(1, passable.clone())];
    assert_eq!(feasible(&world.shows(AMBER).cycle(&both)), [false, true]);
    let swapped = [sample(0, passable.clone()), sample(1, passable.clone())];
    assert_eq!(feasible(&world.cycle(&swapped)), [false, true], "same stamp: age 0 is within 0");
    assert_eq!(feasible(&world.at(100.000_000_001).cycle(&swapped)), [true, true]);
}

#[test]
fn a_standing_vehicle_is_not_forced_but_keeps_the_refusal() {
    let mut world = World::new(20.0, with(|p| p.amber_rejection.hysteresis_duration = 5.0), 0.0);
    assert!(!world.shows(AMBER).ok(traj(0.0, 30.0, 5.0)));
    assert!(world.ego(0.005, 0.0).at(101.0).ok(traj(15.0, 30.0, 10.0)));
    assert!(!world.ego(0.01, 0.0).at(102.0).ok(traj(15.0, 30.0, 10.0)), "0.01 m/s is not standing");
}

#[test]
fn an_allowed_crossing_leaves_the_refusal_as_it_is() {
    let parameters = with(|p| {
        (p.amber_rejection.hysteresis_duration, p.crossing_time_limit) = (2.0, 9.0);
        p.allow_if_cannot_stop_distance = 8.0;
        p.checked_trajectory_length = CheckedTrajectoryLength { deceleration_limit: 2.0, jerk_limit: 2.0 };
    });
    let mut world = World::new(20.0, parameters, 0.0);
    assert!(!world.shows(AMBER).ok(traj(0.0, 30.0, 5.0)), "refused at 100 s");
    // 5 m ahead, where it could stop only if it drove at 1 m/s; allowed because of the odometry.
    assert!(world.ego(10.0, 0.0).at(101.5).ok(traj(15.0, 30.0, 1.0)));
    assert!(!world.at(102.0).ok(traj(11.0, 30.0, 10.0)), "still refused");
    assert!(world.at(102.1).ok(traj(11.0, 30.0, 10.0)), "but not anew");
}

#[test]
fn stops_are_remembered_also_when_the_line_is_never_reached() {
    let parameters = with(|p| {
        p.amber_rejection = AmberRejection { hysteresis_duration: 5.0, reject_if_stop_detected: true };
        p.crossing_time_limit = 9.0;
    });
    let mut world = World::new(20.0, parameters.clone(), 0.0);
    let stops_early = vec![point(0.0, 0.0, 5.0), point(1.0, 4.0, 0.0)];
    assert!(world.shows(AMBER).ok(stops_early));
    assert!(!world.ego(10.0, 0.0).ok(traj(15.0, 30.0, 10.0)));

    // Whoever just does not come so far plans no stop.
    let mut world = World::new(20.0, parameters.clone(), 0.0);
    assert!(world.shows(AMBER).ok(traj(0.0, 4.0, 5.0)));
    assert!(world.ego(10.0, 0.0).ok(traj(15.0, 30.0, 10.0)));

    // Crossing with a stop beyond the margin is no detected stop; here it is passable and leaves nothing.
    let mut world = World::new(20.0, parameters, 0.0);
    let stops_late = vec![point(0.0, 15.0, 10.0), point(1.0, 30.0, 0.0)];
    assert!(world.ego(10.0, 0.0).shows(AMBER).ok(stops_late));
    assert!(world.ok(traj(15.0, 30.0, 10.0)));
}

#[test]
fn a_violation_is_looked_for_as_far_as_it_was_found() {
    // From 5 m/s the look-ahead is half a metre and the point beyond; the first candidate has a long first step.
    let mut world = World::new(30.0, base(), 0.0);
    assert!(world.shows(RED).ok(dense(40)), "nobody looks that far");
    assert!(!world.at(100.1).ok(traj(0.0, 40.0, 5.0)));
    assert!(!world.at(100.2).ok(dense(40)), "now it is looked for up to 30 m");
    assert!(!world.at(100.3).ok(dense(40)));
    assert!(!world.at(101.0).shows(RED_AND_AMBER).ok(dense(40)), "while it is red");
    assert!(world.at(101.1).shows(GREEN).ok(dense(40)));
    assert!(world.at(101.2).shows(RED).ok(dense(40)), "green forgets it");
}

#[test]
fn the_look_ahead_floor_counts_what_is_past_but_the_path_does_not() {
    // 5 m of the candidate are past, in steps of 1 m; the step from the past to the present counts nowhere.
    let past = |to: f64| {
        let mut points: Vec<_> = (-6..0).map(|x| point(f64::from(x), f64::from(x), 5.0)).collect();
        points.extend(traj(0.0, to, 5.0));
        points
    };
    let mut world = World::new(30.0, base(), 0.0);
    assert!(!world.shows(RED).ok(past(40.0)));
    world.scene.map = Some(Epoch {
        number: 1,
        value: HdMap::new("map".into(), Arc::new(road(35.5, None, "red_yellow_green"))),
    });
    // Same map number, same light, but the line is farther: at 35 m of floor, 36 m is the last length looked at.
    world.scene.route = Some(Epoch { number: 2, value: Arc::new(route(&[LANELET])) });
    assert!(!world.at(100.1).ok(dense(60)), "30 m ahead and 5 m past make a floor of 35 m");
    let mut world = World::new(30.0, base(), 0.0);
    assert!(!world.shows(RED).ok(traj(0.0, 40.0, 5.0)));
    world.scene.map = Some(Epoch {
        number: 1,
        value: HdMap::new("map".into(), Arc::new(road(31.5, None, "red_yellow_green"))),
    });
    world.scene.route = Some(Epoch { number: 2, value: Arc::new(route(&[LANELET])) });
    assert!(world.at(100.1).ok(dense(60)), "without a past the floor is 30 m and 31 m the last length");
}

#[test]
fn a_candidate_in_the_past_keeps_its_refusals_but_not_its_floor() {
    let over = || vec![point(-2.0, 0.0, 5.0), point(-1.0, 5.0, 5.0), point(0.0, 10.0, 5.0)];
    let mut world = World::new(30.0, base(), 0.0);
    assert!(!world.shows(RED).ok(traj(0.0, 40.0, 5.0)));
    assert!(world.at(100.1).shows(GREEN).ok(over()), "the floor goes although nothing was checked");
    assert!(world.at(100.2).shows(RED).ok(dense(40)));
}

#[test]
fn another_map_forgets_refusals_floors_and_where_amber_came_from() {
    let replace = |world: &mut World, number| {
        let map = Arc::new(road(20.0, Some("left"), "left_arrow"));
        world.scene.map = Some(Epoch { number, value: HdMap::new("map".into(), map) });
    };
    let parameters = with(|p| p.amber_rejection.hysteresis_duration = 60.0);
    let mut world = World::new(20.0, parameters.clone(), 0.0);
    assert!(!world.shows(AMBER).ok(traj(0.0, 30.0, 5.0)));
    replace(&mut world, 2);
    assert!(world.at(100.1).ok(traj(15.0, 30.0, 10.0)), "the refusal belonged to a light of the old map");

    let mut world = World::new(20.0, parameters, 0.0);
    replace(&mut world, 1);
    world.shows(GREEN).cycle(&[]);
    assert!(world.at(100.1).shows(AMBER).ok(traj(0.0, 30.0, 5.0)), "amber after green on a turning lane");
    replace(&mut world, 2);
    assert!(!world.at(100.2).ok(traj(0.0, 30.0, 5.0)), "this light may be another one");
}

#[test]
fn another_map_does_not_set_a_red_light_free() {
    let mut world = World::new(5.0, with(|p| p.stable_duration_threshold_red = 1.0), 0.0);
    world.shows(RED).cycle(&[]);
    assert!(!world.at(101.0).ok(traj(0.0, 10.0, 5.0)));
    world.scene.map.as_mut().unwrap().number = 2;
    assert!(!world.at(101.1).ok(traj(0.0, 10.0, 5.0)), "it need not become stable again");
}

#[test]
fn another_route_keeps_what_is_known_of_its_lights() {
    let mut world = World::new(30.0, with(|p| p.amber_rejection.hysteresis_duration = 60.0), 0.0);
    assert!(!world.shows(AMBER).ok(traj(0.0, 40.0, 5.0)));
    world.scene.route = Some(Epoch { number: 2, value: Arc::new(route(&[LANELET, LANELET])) });
    assert!(!world.at(100.1).ok(traj(25.0, 40.0, 10.0)), "refused on the route before");
    world.scene.route = Some(Epoch { number: 3, value: Arc::new(route(&[])) });
    assert!(world.at(100.2).ok(dense(40)), "this route has no light");
    world.scene.route = Some(Epoch { number: 4, value: Arc::new(route(&[LANELET])) });
    assert!(world.at(100.3).shows(RED).ok(dense(40)), "and so the floor is gone");
}

#[test]
fn a_small_step_back_in_time_forces_and_a_restarted_clock_does_so_for_the_hysteresis() {
    let mut world = World::new(20.0, with(|p| p.amber_rejection.hysteresis_duration = 0.5), 0.0);
    assert!(!world.shows(AMBER).ok(traj(0.0, 30.0, 5.0)));
    assert!(!world.at(99.9).ok(traj(15.0, 30.0, 10.0)), "refused in the future is refused");
    assert!(!world.at(5.0).ok(traj(15.0, 30.0, 10.0)));
    assert!(!world.at(5.5).ok(traj(15.0, 30.0, 10.0)));
    assert!(world.at(5.6).ok(traj(15.0, 30.0, 10.0)), "and not for another ninety seconds");
}

#[test]
fn a_red_seen_before_a_restart_of_the_clock_is_red_after_it() {
    let mut world = World::new(5.0, with(|p| p.stable_duration_threshold_red = 1.0), 0.0);
    world.shows(GREEN).cycle(&[]);
    world.at(100.5).shows(RED).cycle(&[]);
    assert!(world.at(3.0).ok(traj(0.0, 10.0, 5.0)), "not seen for a second");
    assert!(!world.at(4.0).ok(traj(0.0, 10.0, 5.0)), "a second by the new clock");
}
