use super::cells::{is_occupied, obstacles};
use super::*;
use crate::collision::CollisionChecker;
use crate::problem::{Limits, Problem};
use crate::scenes::{SceneKind, scene};
use crate::{Interruption, OpenSpaceParameters, Planner, Supervisor};
use proptest::prelude::*;
use std::collections::BTreeSet;

fn vehicle() -> VehicleInfo {
    VehicleInfo::default()
}

/// A manoeuvre that stays where it is.
fn at(x: f64, y: f64) -> Manoeuvre {
    let pose = PlanarPose::new(x, y, 0.0);
    Manoeuvre { begin: pose, vehicle: pose, goal: pose }
}

fn problem(region: &Region, pose: PlanarPose) -> Problem {
    Problem {
        vehicle: vehicle(),
        limits: Limits::default(),
        bounds: region.bounds,
        obstacles: region.obstacles.clone(),
        start: region.to_region(pose),
        start_speed_mps: 0.0,
        start_acceleration_mps2: 0.0,
        start_curvature: None,
        goal: region.goal,
    }
}

fn is_covered(obstacles: &[Vec<Point2>], point: Point2) -> bool {
    obstacles.iter().any(|solid| polygon_contains(&solid[1..], point))
}

/// Points of a cell, up to its very edge.
fn points_of(column: usize, row: usize, resolution_m: f64) -> impl Iterator<Item = Point2> {
    const PLACES: [f64; 3] = [1e-6, 0.5, 1.0 - 1e-6];
    let at = move |cell: usize, place: f64| (cell as f64 + place) * resolution_m;
    PLACES.into_iter().flat_map(move |x| PLACES.map(|y| Point2::new(at(column, x), at(row, y))))
}

fn grids() -> impl Strategy<Value = (usize, Vec<i8>)> {
    let cells = |columns: usize, rows: usize| {
        let value = prop_oneof![6 => Just(0_i8), 1 => Just(-1_i8), 2 => any::<i8>()];
        proptest::collection::vec(value, columns * rows)
    };
    (1..30_usize, 1..30_usize).prop_flat_map(move |(columns, rows)| (Just(columns), cells(columns, rows)))
}

proptest! {
    #[test]
    fn an_occupied_cell_is_covered_and_no_other(
        (columns, cells) in grids(),
        resolution_m in 0.02..1.0_f64,
        unknown_is_occupied: bool,
        occupied_from in 1..=100_u32,
    ) {
        let parameters =
            RegionParameters { unknown_is_occupied, occupied_from, ..RegionParameters::default() };
        let grid = OccupancyGrid { origin: PlanarPose::default(), resolution_m, columns, cells: &cells };
        let everything = AxisAlignedBox::around([Point2::origin(), Point2::new(100.0, 100.0)]);
        let found = obstacles(&parameters, &grid, everything);
        for (index, &value) in cells.iter().enumerate() {
            let (column, row) = (index % columns, index / columns);
            if is_occupied(&parameters, value) {
                for point in points_of(column, row, resolution_m) {
                    prop_assert!(is_covered(&found, point), "{value} at {column}, {row}");
                }
            } else {
                let centre = points_of(column, row, resolution_m).nth(4).unwrap();
                prop_assert!(!is_covered(&found, centre), "{value} at {column}, {row}");
            }
        }
    }

    /// Through the whole of it: wherever the grid lies, a vehicle that fits has no occupied cell under it.
    #[test]
    fn a_vehicle_stands_on_no_occupied_cell(
        (columns, cells) in grids(),
        [x, y, yaw] in [-1e4..1e4, -1e4..1e4, -4.0..4.0_f64],
        [along, across, turned] in [0.0..1.0, 0.0..1.0, -4.0..4.0_f64],
    ) {
        let parameters = RegionParameters { unknown_is_occupied: false, ..RegionParameters::default() };
        let resolution_m = 0.8;
        let grid = OccupancyGrid { origin: PlanarPose::new(x, y, yaw), resolution_m, columns, cells: &cells };
        let rows = cells.len() / columns;
        let frame = empty(grid.origin, &at(x, y));
        let place = |along: f64, cells: usize| along * cells as f64 * resolution_m;
        let pose = frame.to_map(PlanarPose::new(place(along, columns), place(across, rows), turned));
        let manoeuvre = Manoeuvre { begin: pose, vehicle: pose, goal: pose };
        let Ok(region) = from_grid(&parameters, &vehicle(), &manoeuvre, &grid) else {
            return Ok(());
        };
        let problem = problem(&region, pose);
        let is_free = CollisionChecker::new(&problem).unwrap().is_free(&problem.start, 0.0);
        prop_assert_eq!(is_free, first_blocked(&region, &vehicle(), &[pose]).is_none());
        if is_free {
            let (sin, cos) = problem.start.yaw.sin_cos();
            let rectangle = Rectangle::of(&vehicle());
            for (index, &value) in cells.iter().enumerate().filter(|(_, value)| **value >= 50) {
                for point in points_of(index % columns, index / columns, resolution_m) {
                    let v = point - problem.start.point();
                    let (ahead, left) = (v.x * cos + v.y * sin, v.y * cos - v.x * sin);
                    let inside = (rectangle.rear_m..=rectangle.front_m).contains(&ahead)
                        && (rectangle.right_m..=rectangle.left_m).contains(&left);
                    prop_assert!(!inside, "{} under the vehicle at {:?}", value, point);
                }
            }
        }
    }

    /// The look at a way agrees with the checker that plans are made with.
    #[test]
    fn a_blocked_way_is_found_where_the_planner_finds_one(
        [x, y] in [2.0..18.0_f64, 0.0..20.0],
        [yaw, curvature] in [-4.0..4.0_f64, -0.15..0.15],
    ) {
        let pillar = [[8.0, 8.0], [9.0, 8.2], [8.6, 9.0]].map(|[x, y]| Point2::new(x, y)).to_vec();
        let area = [[0.0, 0.0], [20.0, 0.0], [20.0, 20.0], [0.0, 20.0]].map(|[x, y]| Point2::new(x, y));
        let parameters = RegionParameters::default();
        let from = at(10.0, 15.0);
        let region = from_area(&parameters, &vehicle(), &from, &area, &[pillar]).unwrap();
        let arc = crate::Arc::new(curvature, 0.1);
        let mut way = vec![PlanarPose::new(x, y, yaw)];
        for step in 0..60 {
            way.push(arc.end(&way[step]));
        }
        let checker = CollisionChecker::new(&problem(&region, way[0])).unwrap();
        let local: Vec<_> = way.iter().map(|pose| region.to_region(*pose)).collect();
        let expected = (0..local.len()).find(|&at| {
            !checker.is_free(&local[at], 0.0) && checker.is_within_bounds(&local[at])
                || at > 0 && checker.is_within_bounds(&local[at]) && !checker.motion_is_free(&local[at - 1], &local[at], 0.0)
        });
        let found = first_blocked(&region, &vehicle(), &way);
        if let Some(expected) = expected {
            // The checker sees an arc, the look a polygon: they may differ by one step where the vehicle grazes.
            prop_assert!(found.is_some_and(|found| found.abs_diff(expected) <= 1) || graze(&checker, &local[expected]));
        }
        if let Some(found) = found {
            prop_assert!(expected.is_some() || !checker.is_within_bounds(&local[found]) || graze(&checker, &local[found]));
        }
    }
}

/// Whether a pose comes so near to an obstacle that either answer is right.
fn graze(checker: &CollisionChecker, pose: &PlanarPose) -> bool {
    checker.clearance_m(pose) < 0.01 && checker.is_free(pose, -0.01)
}

#[test]
fn what_is_too_much_for_a_planner_is_covered_by_larger_cells() {
    let columns = 400;
    let mut state = 1_u32;
    let mut noise = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        if state >> 24 < 100 { 100_i8 } else { 0 }
    };
    let cells: Vec<i8> = (0..columns * columns).map(|_| noise()).collect();
    let grid = OccupancyGrid { origin: PlanarPose::default(), resolution_m: 0.1, columns, cells: &cells };
    let everything = AxisAlignedBox::around([Point2::origin(), Point2::new(40.0, 40.0)]);
    let found = obstacles(&RegionParameters::default(), &grid, everything);
    assert!(found.len() <= 2_000, "{} rectangles", found.len());
    for (index, _) in cells.iter().enumerate().filter(|(_, value)| **value == 100).step_by(97) {
        assert!(points_of(index % columns, index / columns, 0.1).all(|point| is_covered(&found, point)));
    }
}

#[test]
fn grids_that_are_none_are_refused() {
    let parameters = RegionParameters::default();
    let good =
        OccupancyGrid { origin: PlanarPose::default(), resolution_m: 1.0, columns: 20, cells: &[0; 400] };
    let refused = |grid: &OccupancyGrid<'_>| {
        from_grid(&parameters, &vehicle(), &at(10.0, 10.0), grid).unwrap_err().to_string()
    };
    for (grid, what) in [
        (OccupancyGrid { resolution_m: 0.0, ..good }, "without a size"),
        (OccupancyGrid { resolution_m: f64::NAN, ..good }, "without a size"),
        (OccupancyGrid { columns: 0, ..good }, "no cells"),
        (OccupancyGrid { cells: &[], ..good }, "no cells"),
        (OccupancyGrid { columns: 19, ..good }, "does not fit its width"),
        (OccupancyGrid { origin: PlanarPose::new(f64::INFINITY, 0.0, 0.0), ..good }, "no place of the map"),
        (OccupancyGrid { resolution_m: 1e9, ..good }, "no place of the map"),
    ] {
        assert!(refused(&grid).contains(what), "{}", refused(&grid));
    }
    assert!(from_grid(&parameters, &vehicle(), &at(10.0, 10.0), &good).is_ok());
}

#[test]
fn what_is_not_known_about_is_named() {
    let parameters = RegionParameters::default();
    let grid =
        OccupancyGrid { origin: PlanarPose::default(), resolution_m: 1.0, columns: 20, cells: &[0; 400] };
    let inside = at(10.0, 10.0);
    let outside = PlanarPose::new(21.0, 10.0, 0.0);
    let nowhere = PlanarPose::new(f64::NAN, 10.0, 0.0);
    for (manoeuvre, what) in [
        (Manoeuvre { begin: outside, ..inside }, "the beginning of the manoeuvre"),
        (Manoeuvre { vehicle: nowhere, ..inside }, "the vehicle"),
        (Manoeuvre { goal: outside, ..inside }, "the goal"),
    ] {
        let of = "the occupancy grid";
        let error = from_grid(&parameters, &vehicle(), &manoeuvre, &grid).unwrap_err();
        assert_eq!(error, RegionError::Outside { what, of });
    }
    // An area with a bay that the goal is not in.
    let area =
        [[0.0, 0.0], [20.0, 0.0], [20.0, 20.0], [10.0, 5.0], [0.0, 20.0]].map(|[x, y]| Point2::new(x, y));
    let error = from_area(&parameters, &vehicle(), &at(10.0, 15.0), &area, &[]).unwrap_err();
    assert_eq!(error, RegionError::Outside { what: "the beginning of the manoeuvre", of: PARKING_AREA });
    let error = from_area(&parameters, &vehicle(), &at(10.0, 3.0), &area[..2], &[]).unwrap_err();
    assert_eq!(error, RegionError::Area { fault: "has fewer than three corners" });
    let broken = vec![vec![Point2::new(f64::NAN, 0.0)]];
    let error = from_area(&parameters, &vehicle(), &at(10.0, 3.0), &area, &broken).unwrap_err();
    assert_eq!(error, RegionError::Object);
}

/// Nobody knows what is beyond the grid, so the vehicle must not even hang over its edge.
#[test]
fn the_edge_of_what_is_known_is_a_wall() {
    let grid =
        OccupancyGrid { origin: PlanarPose::default(), resolution_m: 1.0, columns: 20, cells: &[0; 400] };
    let square =
        [[0.0, 0.0], [20.0, 0.0], [20.0, 20.0], [0.0, 20.0], [0.0, 0.0]].map(|[x, y]| Point2::new(x, y));
    let parameters = RegionParameters::default();
    let middle = at(10.0, 10.0);
    let of_grid = from_grid(&parameters, &vehicle(), &middle, &grid).unwrap();
    let of_area = from_area(&parameters, &vehicle(), &middle, &square, &[]).unwrap();
    for region in [of_grid, of_area] {
        let front_m = vehicle().max_longitudinal_offset_m();
        for (x, is_free) in [(10.0, true), (19.99 - front_m, true), (20.01 - front_m, false), (19.9, false)] {
            let pose = PlanarPose::new(x, 10.0, 0.0);
            let problem = problem(&region, pose);
            assert_eq!(CollisionChecker::new(&problem).unwrap().is_free(&problem.start, 0.0), is_free, "{x}");
            assert_eq!(first_blocked(&region, &vehicle(), &[pose]).is_none(), is_free, "{x}");
        }
    }
}

#[test]
fn the_region_is_no_larger_than_its_margin() {
    let parameters = RegionParameters { region_margin: 5.0, ..RegionParameters::default() };
    let cells = vec![0; 1_000_000];
    let grid = OccupancyGrid {
        origin: PlanarPose::new(-100.0, -100.0, 0.0),
        resolution_m: 0.2,
        columns: 1000,
        cells: &cells,
    };
    let manoeuvre = Manoeuvre { goal: PlanarPose::new(10.0, 3.0, 1.0), ..at(0.0, 0.0) };
    let region = from_grid(&parameters, &vehicle(), &manoeuvre, &grid).unwrap();
    assert_eq!(region.bounds, [95.0, 115.0, 95.0, 108.0]);
    assert!(region.goal_in_map().distance_m(&manoeuvre.goal) < 1e-9);
}

struct Patient;

impl Supervisor for Patient {
    fn interruption(&mut self) -> Option<Interruption> {
        None
    }
}

/// The cells that a polyline passes, and those in it if it is a solid.
fn draw(line: &[Point2], cells: &mut [i8], columns: usize, low: Point2, resolution_m: f64) {
    let mut passed = BTreeSet::new();
    for side in line.windows(2) {
        let steps = ((side[1] - side[0]).norm() / (0.1 * resolution_m)).ceil().max(1.0) as usize;
        for step in 0..=steps {
            let v = side[0] + (side[1] - side[0]) * (step as f64 / steps as f64) - low;
            passed.insert(((v.x / resolution_m).floor() as i64, (v.y / resolution_m).floor() as i64));
        }
    }
    let rows = cells.len() / columns;
    for row in 0..rows {
        for column in 0..columns {
            let centre =
                low + motion::geometry::Vector2::new(column as f64 + 0.5, row as f64 + 0.5) * resolution_m;
            let is_in = line.len() > 3 && line.first() == line.last() && polygon_contains(&line[1..], centre);
            if is_in || passed.contains(&(column as i64, row as i64)) {
                cells[row * columns + column] = 100;
            }
        }
    }
}

/// A parking scene drawn into a grid: the vehicle parks, and comes near to nothing that was drawn.
#[test]
fn a_slot_that_is_seen_as_cells_is_parked_in() {
    let mut scene = scene(SceneKind::PerpendicularReverse, 0.2, 1, 0).problem;
    let resolution_m = 0.1;
    let [x_min, x_max, y_min, y_max] = scene.bounds;
    let low = Point2::new(x_min - 5.0, y_min - 5.0);
    let (columns, rows) =
        (((x_max - x_min + 10.0) / resolution_m) as usize, ((y_max - y_min + 10.0) / resolution_m) as usize);
    let mut cells = vec![0_i8; columns * rows];
    for line in &scene.obstacles {
        draw(line, &mut cells, columns, low, resolution_m);
    }
    let grid =
        OccupancyGrid { origin: PlanarPose::new(low.x, low.y, 0.0), resolution_m, columns, cells: &cells };
    let manoeuvre = Manoeuvre { begin: scene.start, vehicle: scene.start, goal: scene.goal };
    let region = from_grid(&RegionParameters::default(), &scene.vehicle, &manoeuvre, &grid).unwrap();
    let seen = Problem {
        bounds: region.bounds,
        obstacles: region.obstacles.clone(),
        start: region.to_region(scene.start),
        goal: region.goal,
        ..scene.clone()
    };
    let plan = Planner::new(OpenSpaceParameters::default()).plan(&seen, &mut Patient).unwrap();
    let way: Vec<_> = plan.trajectory.points.iter().map(|point| region.to_map(point.pose)).collect();
    assert_eq!(first_blocked(&region, &scene.vehicle, &way), None);
    // The drawing does not know the bounds of the scene.
    scene.bounds = [-1e3, 1e3, -1e3, 1e3];
    let checker = CollisionChecker::new(&scene).unwrap();
    assert!(way.windows(2).all(|pair| checker.motion_is_free(&pair[0], &pair[1], 0.0)));
}
