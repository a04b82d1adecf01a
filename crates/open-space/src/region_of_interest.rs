//! The region of interest: from what is known of a vehicle's surroundings to the region that it is planned in.
//!
//! Surroundings are an occupancy grid, or a parking area with what stands in it. Errs to the side of obstacles: every
//! occupied cell lies in an obstacle, and what nobody knows anything about - beyond the grid, beyond the area - lies
//! behind a wall. Pure; poses and polygons come in the map's frame, cells in the grid's.

mod cells;
mod parameters;

#[cfg(test)]
mod tests;

pub use parameters::{ObstacleSource, RegionParameters};

use motion::geometry::{AxisAlignedBox, convex_overlap_within, polygon_contains};
use motion::{Point2, VehicleInfo};
use thiserror::Error;

use crate::collision::Rectangle;
use crate::pose::PlanarPose;
use crate::provider::Region;
use crate::tolerance::{MAX_COORDINATE_M, TOUCH_M};

/// Travel of the vehicle between two looks at whether a way is free, m.
const LOOK_M: f64 = 0.05;
/// The same for its turning, rad.
const LOOK_RAD: f64 = 0.02;
/// Most looks between two poses; those of a trajectory need few.
const MAX_LOOKS: f64 = 1000.0;
/// Half a turn that is none: sines of it are as good as it is, rad.
const STRAIGHT_RAD: f64 = 1e-6;

/// Why there is no region.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum RegionError {
    /// The grid is none.
    #[error("the occupancy grid {fault}; correct its publisher")]
    Grid {
        /// What is wrong with it.
        fault: &'static str,
    },
    /// The area is none.
    #[error("the parking area {fault}; correct the map")]
    Area {
        /// What is wrong with it.
        fault: &'static str,
    },
    /// A number of something that stands in the area is none.
    #[error("the outline of an object is not finite; correct the perception")]
    Object,
    /// Nothing is known about a place that matters.
    #[error("{what} is outside of {of}; move it, or enlarge that")]
    Outside {
        /// What is outside.
        what: &'static str,
        /// Of what.
        of: &'static str,
    },
}

/// The poses that a region must hold, in the map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Manoeuvre {
    /// Where it began.
    pub begin: PlanarPose,
    /// Where the vehicle is.
    pub vehicle: PlanarPose,
    /// Where it shall come to rest.
    pub goal: PlanarPose,
}

impl Manoeuvre {
    fn poses(&self) -> [(&'static str, PlanarPose); 3] {
        [
            ("the beginning of the manoeuvre", self.begin),
            ("the vehicle", self.vehicle),
            ("the goal", self.goal),
        ]
    }
}

/// Square cells, each with the probability that something is there.
#[derive(Clone, Copy, Debug)]
pub struct OccupancyGrid<'a> {
    /// Corner of the first cell in the map; the first row runs along its heading.
    pub origin: PlanarPose,
    /// Side of a cell, m.
    pub resolution_m: f64,
    /// Cells in a row.
    pub columns: usize,
    /// Row by row: 0 to 100 percent, negative where nobody knows.
    pub cells: &'a [i8],
}

impl OccupancyGrid<'_> {
    fn rows(&self) -> usize {
        self.cells.len() / self.columns.max(1)
    }

    fn check(&self) -> Result<(), RegionError> {
        let fault = |fault| Err(RegionError::Grid { fault });
        if !(self.resolution_m > 0.0 && self.resolution_m.is_finite()) {
            return fault("has cells without a size");
        }
        if self.columns == 0 || self.cells.is_empty() {
            return fault("has no cells");
        }
        if !self.cells.len().is_multiple_of(self.columns) {
            return fault("has a number of cells that does not fit its width");
        }
        let far = |cells: usize| cells as f64 * self.resolution_m > MAX_COORDINATE_M;
        if !is_on_map(&self.origin) || far(self.columns) || far(self.rows()) {
            return fault("is in no place of the map");
        }
        Ok(())
    }
}

fn is_on_map(pose: &PlanarPose) -> bool {
    pose.is_finite() && pose.x.abs() <= MAX_COORDINATE_M && pose.y.abs() <= MAX_COORDINATE_M
}

/// The region about a manoeuvre in an occupancy grid. Its frame is that of the grid.
///
/// # Errors
/// The grid is malformed, or does not hold the manoeuvre.
pub fn from_grid(
    parameters: &RegionParameters,
    vehicle: &VehicleInfo,
    manoeuvre: &Manoeuvre,
    grid: &OccupancyGrid<'_>,
) -> Result<Region, RegionError> {
    grid.check()?;
    let mut region = empty(grid.origin, manoeuvre);
    let (width, height) = (grid.columns as f64 * grid.resolution_m, grid.rows() as f64 * grid.resolution_m);
    let extent = AxisAlignedBox::around([Point2::origin(), Point2::new(width, height)]);
    region.bounds = window(&region, parameters, manoeuvre, &extent, "the occupancy grid")?;
    let corners = [[0.0, 0.0], [width, 0.0], [width, height], [0.0, height]].map(|[x, y]| Point2::new(x, y));
    region.obstacles = walls(&corners);
    region.obstacles.extend(cells::obstacles(parameters, grid, within_reach(&region, vehicle)));
    Ok(region)
}

/// The region about a manoeuvre in a parking area, given as a polygon, among what stands in it, each the outline of a
/// solid. Its frame has the directions of the map.
///
/// # Errors
/// The area is malformed or does not hold the manoeuvre, or an outline is not finite.
pub fn from_area(
    parameters: &RegionParameters,
    vehicle: &VehicleInfo,
    manoeuvre: &Manoeuvre,
    area: &[Point2],
    standing: &[Vec<Point2>],
) -> Result<Region, RegionError> {
    let area = match area {
        [first, rest @ .., last] if first == last && !rest.is_empty() => &area[..area.len() - 1],
        open => open,
    };
    let fault = |fault| Err(RegionError::Area { fault });
    if area.len() < 3 {
        return fault("has fewer than three corners");
    }
    let is_far = |point: &Point2| !(point.x.abs() <= MAX_COORDINATE_M && point.y.abs() <= MAX_COORDINATE_M);
    if area.iter().any(is_far) {
        return fault("is in no place of the map");
    }
    if standing.iter().flatten().any(is_far) {
        return Err(RegionError::Object);
    }
    let mut region = empty(PlanarPose::new(area[0].x, area[0].y, 0.0), manoeuvre);
    let shifted =
        |points: &[Point2]| points.iter().map(|point| *point - region.origin.coords).collect::<Vec<_>>();
    let area = shifted(area);
    for (what, pose) in manoeuvre.poses() {
        if !polygon_contains(&area, region.to_region(pose).point()) {
            return Err(RegionError::Outside { what, of: PARKING_AREA });
        }
    }
    let solids: Vec<_> = standing.iter().map(|outline| shifted(outline)).collect();
    let extent = AxisAlignedBox::around(area.iter().copied());
    region.bounds = window(&region, parameters, manoeuvre, &extent, PARKING_AREA)?;
    region.obstacles = walls(&area);
    let reach = within_reach(&region, vehicle);
    let near =
        solids.into_iter().filter(|solid| AxisAlignedBox::around(solid.iter().copied()).overlaps(&reach));
    region.obstacles.extend(near.map(closed));
    Ok(region)
}

const PARKING_AREA: &str = "the parking area";

fn empty(frame: PlanarPose, manoeuvre: &Manoeuvre) -> Region {
    let mut region = Region {
        origin: frame.point(),
        heading_rad: frame.yaw,
        goal: PlanarPose::default(),
        bounds: [0.0; 4],
        obstacles: Vec::new(),
    };
    region.goal = region.to_region(manoeuvre.goal);
    region
}

/// The box about the manoeuvre with its margin, no larger than what is known.
fn window(
    region: &Region,
    parameters: &RegionParameters,
    manoeuvre: &Manoeuvre,
    extent: &AxisAlignedBox,
    of: &'static str,
) -> Result<[f64; 4], RegionError> {
    for (what, pose) in manoeuvre.poses() {
        // Not-a-number is nowhere.
        if !is_on_map(&pose) || !extent.contains(region.to_region(pose).point()) {
            return Err(RegionError::Outside { what, of });
        }
    }
    let poses = manoeuvre.poses().map(|(_, pose)| region.to_region(pose).point());
    let window = AxisAlignedBox::around(poses).widened(parameters.region_margin);
    let (low, high) = (window.min.sup(&extent.min), window.max.inf(&extent.max));
    Ok([low.x, high.x, low.y, high.y])
}

/// Where the vehicle's outline can be while its reference point is within bounds.
fn within_reach(region: &Region, vehicle: &VehicleInfo) -> AxisAlignedBox {
    let [x_min, x_max, y_min, y_max] = region.bounds;
    let reach_m =
        Rectangle::of(vehicle).corners().iter().map(|corner| corner.coords.norm()).fold(0.0, f64::max);
    AxisAlignedBox::around([Point2::new(x_min, y_min), Point2::new(x_max, y_max)]).widened(reach_m)
}

/// The sides of a polygon of at least three corners as walls: a closed polyline would be a solid.
fn walls(corners: &[Point2]) -> Vec<Vec<Point2>> {
    let (first, second) = corners.split_at(corners.len() / 2 + 1);
    let turn = first.last().copied();
    let back = turn.into_iter().chain(second.iter().copied()).chain(corners.first().copied()).collect();
    vec![first.to_vec(), back]
}

fn closed(mut outline: Vec<Point2>) -> Vec<Point2> {
    if let (Some(&first), Some(&last)) = (outline.first(), outline.last())
        && first != last
    {
        outline.push(first);
    }
    outline
}

/// The first of the poses, given in the map, that the vehicle cannot reach from the one before (the first: cannot stand
/// at) without touching an obstacle of the region. Poses follow each other closely, as those of a trajectory do.
#[must_use]
pub fn first_blocked(region: &Region, vehicle: &VehicleInfo, poses: &[PlanarPose]) -> Option<usize> {
    let rectangle = Rectangle::of(vehicle).corners();
    let poses: Vec<_> = poses.iter().map(|pose| region.to_region(*pose)).collect();
    let way = AxisAlignedBox::around(poses.iter().map(PlanarPose::point));
    let reach_m = rectangle.iter().map(|corner| corner.coords.norm()).fold(0.0, f64::max);
    let swept = way.widened(reach_m + TOUCH_M);
    let near: Vec<_> = region
        .obstacles
        .iter()
        .map(|line| (AxisAlignedBox::around(line.iter().copied()), line))
        .filter(|(extent, _)| extent.overlaps(&swept))
        .collect();
    let is_free = |pose: &PlanarPose| {
        let (sin, cos) = pose.yaw.sin_cos();
        let footprint =
            rectangle.map(|p| Point2::new(pose.x + p.x * cos - p.y * sin, pose.y + p.x * sin + p.y * cos));
        let extent = AxisAlignedBox::around(footprint).widened(TOUCH_M);
        near.iter().all(|(place, line)| !place.overlaps(&extent) || !touches(&footprint, line))
    };
    (0..poses.len()).find(|&at| !poses[at].is_finite() || !between(&poses, at).all(|pose| is_free(&pose)))
}

/// Whether a footprint touches a polyline, or lies in the solid that a closed one is.
fn touches(footprint: &[Point2; 4], line: &[Point2]) -> bool {
    let is_solid = line.len() > 3 && line.first() == line.last();
    line.windows(2).any(|side| convex_overlap_within(footprint, side, TOUCH_M))
        || (line.len() == 1 && convex_overlap_within(footprint, line, TOUCH_M))
        || (is_solid && polygon_contains(&line[1..], footprint[0]))
}

/// The pose with this index, which is finite as the one before, and before it some on the screw motion from the one before.
fn between(poses: &[PlanarPose], at: usize) -> impl Iterator<Item = PlanarPose> + use<> {
    let to = poses[at];
    let from = at.checked_sub(1).map_or(to, |before| poses[before]);
    let turn_rad = from.yaw_to(&to);
    let chord = to.point() - from.point();
    let looks = (chord.norm() / LOOK_M).max(turn_rad.abs() / LOOK_RAD).ceil().clamp(1.0, MAX_LOOKS) as u32;
    (1..=looks).map(move |look| {
        if look == looks {
            return to;
        }
        let share = f64::from(look) / f64::from(looks);
        // The chord of the part lies ahead of that of the whole by half of what is left to turn.
        let (sin, cos) = (0.5 * (share - 1.0) * turn_rad).sin_cos();
        let half = 0.5 * turn_rad;
        let length = if half.abs() < STRAIGHT_RAD { share } else { (share * half).sin() / half.sin() };
        PlanarPose::new(
            from.x + length * (chord.x * cos - chord.y * sin),
            from.y + length * (chord.x * sin + chord.y * cos),
            from.yaw + turn_rad * share,
        )
    })
}
