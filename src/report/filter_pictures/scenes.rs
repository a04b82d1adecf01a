//! The scenes themselves. The vehicle starts at the origin and drives along x, in the right one of two lanes.

use super::Still;
use super::course::{Speed, Stretch, candidate, points};
use super::street::{FAR_EDGE, LANE, Line, Street};
use lanelet_map::MapError;
use selection::{Candidate, Scene};
use std::f64::consts::FRAC_PI_2;

/// Usual speed of the vehicle, m/s.
const SPEED_MPS: f64 = 8.0;
/// From the reference point to the front bumper of the shipped vehicle, m.
const FRONT_M: f64 = 3.79;

/// Filter, title, and what makes the scene.
type Plan = (&'static str, &'static str, fn() -> Made);
type Made = Result<(Scene, [Candidate; 2]), MapError>;

pub(super) fn all() -> Vec<Still> {
    let stills: [Plan; 7] = [
        ("collision_check_filter", "A car crosses the vehicle's way", crossing_car),
        ("crosswalk_filter", "Somebody waits at a crosswalk without lights", waiting_pedestrian),
        ("data_validity", "The times of a candidate go back", spliced_plan),
        ("out_of_lane_filter", "A candidate leaves the road", off_the_road),
        ("traffic_light_filter", "The light is red", red_light),
        ("uncrossable_boundary_departure_filter", "A candidate crosses a border", over_the_border),
        ("vehicle_constraint_filter", "A candidate turns more sharply than the vehicle can", sharp_turn),
    ];
    let made = stills.into_iter().map(|(filter, title, make)| {
        // Cannot fail: ids are counted up, every line that is named was made, and the places are finite constants.
        let (scene, candidates) = make().expect("the elements of these maps are fixed");
        Still { filter, title, scene, candidates: candidates.to_vec() }
    });
    made.collect()
}

/// To the left by an offset, within a length, and then straight on.
fn shift(start_m: f64, length_m: f64, offset_m: f64) -> Vec<Stretch> {
    // Two bends of opposite direction; the curvature of each rises and falls linearly over a quarter of the length.
    let quarter = length_m / 4.0;
    let curvature = offset_m / (2.0 * quarter * quarter);
    vec![(start_m, 0.0), (quarter, curvature), (quarter, 0.0), (quarter, -curvature), (quarter, 0.0)]
}

fn drives_on() -> Candidate {
    candidate("drives on", points(&[], Speed::constant(SPEED_MPS, 6.0)))
}

fn keeps_its_lane() -> Candidate {
    candidate("keeps its lane", points(&[], Speed::constant(SPEED_MPS, 5.0)))
}

/// Stops with the front bumper at this x.
fn stops_at(name: &str, bumper_m: f64) -> Candidate {
    candidate(name, points(&[], Speed::stop_after(SPEED_MPS, bumper_m - FRONT_M, 6.0)))
}

fn crossing_car() -> Made {
    let mut street = Street::new();
    let (west, east, far, near) = (14.5, 25.5, 24.0, -26.0);
    // Lanelets go through the junction, their painted edges do not.
    let along = |y: f64| [(-30.0, y), (90.0, y)];
    let edges = [LANE[0], LANE[1], FAR_EDGE].map(|y| street.line(Line::Virtual, &along(y)));
    let [right, middle, left] = edges;
    let (right, middle, left) = (right?, middle?, left?);
    street.lane(middle, right)?;
    street.lane(left, middle)?;
    let across = [west, 20.0, east].map(|x| street.line(Line::Virtual, &[(x, near), (x, far)]));
    let [a, b, c] = across;
    let (a, b, c) = (a?, b?, c?);
    street.lane(a, b)?;
    street.lane(b, c)?;
    for (end, corner) in [(-30.0, west), (90.0, east)] {
        street.line(Line::Border, &[(end, LANE[0]), (corner, LANE[0]), (corner, near)])?;
        street.line(Line::Border, &[(end, FAR_EDGE), (corner, FAR_EDGE), (corner, far)])?;
    }
    street.car(22.7, -17.5, FRAC_PI_2, SPEED_MPS);
    let gives_way = stops_at("gives way", 13.5);
    let drives_on = candidate("drives on", points(&[], Speed::constant(SPEED_MPS, 5.0)));
    Ok((street.scene(SPEED_MPS)?, [drives_on, gives_way]))
}

fn waiting_pedestrian() -> Made {
    let mut street = Street::new();
    street.two_lanes([Line::Border, Line::Divider, Line::Border])?;
    street.crosswalk([25.0, 29.0], 22.5)?;
    street.pedestrian(27.0, -3.4);
    Ok((street.scene(SPEED_MPS)?, [drives_on(), stops_at("waits", 21.5)]))
}

fn red_light() -> Made {
    let mut street = Street::new();
    street.two_lanes([Line::Border, Line::Divider, Line::Border])?;
    street.red_light(24.0)?;
    Ok((street.scene(SPEED_MPS)?, [drives_on(), stops_at("stops", 23.0)]))
}

fn off_the_road() -> Made {
    let mut street = Street::new();
    street.two_lanes([Line::Edge, Line::Divider, Line::Edge])?;
    let drifts = candidate("drifts", points(&shift(6.0, 24.0, -2.8), Speed::constant(SPEED_MPS, 5.0)));
    Ok((street.scene(SPEED_MPS)?, [drifts, keeps_its_lane()]))
}

fn over_the_border() -> Made {
    let mut street = Street::new();
    street.two_lanes([Line::Border, Line::Border, Line::Border])?;
    let swerves = candidate("swerves", points(&shift(3.0, 24.0, 3.5), Speed::constant(SPEED_MPS, 5.0)));
    Ok((street.scene(SPEED_MPS)?, [swerves, keeps_its_lane()]))
}

fn sharp_turn() -> Made {
    let mut street = Street::new();
    let (west, east) = (15.0, 26.0);
    let right = street.line(Line::Border, &[(-30.0, LANE[0]), (east, LANE[0])])?;
    let middle = street.line(Line::Virtual, &[(-30.0, LANE[1]), (east, LANE[1])])?;
    let left = street.line(Line::Virtual, &[(-30.0, FAR_EDGE), (east, FAR_EDGE)])?;
    street.lane(middle, right)?;
    street.lane(left, middle)?;
    let far_side = street.line(Line::Virtual, &[(west, LANE[0]), (west, 40.0)])?;
    let near_side = street.line(Line::Border, &[(east, LANE[0]), (east, 40.0)])?;
    street.lane(far_side, near_side)?;
    street.line(Line::Border, &[(-30.0, FAR_EDGE), (west, FAR_EDGE), (west, 40.0)])?;
    let speed = Speed::constant(3.0, 9.0);
    // A bend whose curvature rises over one length, stays for another and falls again turns by (rise + stay) / radius.
    let bend = |start_m: f64, rise_m: f64, radius_m: f64| {
        let stay_m = FRAC_PI_2 * radius_m - rise_m;
        let curvature = 1.0 / radius_m;
        points(&[(start_m, 0.0), (rise_m, curvature), (stay_m, curvature), (rise_m, 0.0)], speed)
    };
    let candidates =
        [candidate("cuts the corner", bend(17.0, 1.0, 2.0)), candidate("turns", bend(9.0, 5.0, 8.5))];
    Ok((street.scene(3.0)?, candidates))
}

/// After two seconds the candidate goes on with points of an older plan.
fn spliced_plan() -> Made {
    let mut street = Street::new();
    street.two_lanes([Line::Border, Line::Divider, Line::Border])?;
    let mut spliced = points(&[], Speed::constant(SPEED_MPS, 2.5));
    let older = points(&shift(0.0, 12.0, 2.4), Speed::constant(SPEED_MPS, 4.5));
    spliced.extend(older.into_iter().skip(13));
    Ok((street.scene(SPEED_MPS)?, [candidate("two plans in one", spliced), keeps_its_lane()]))
}
