//! Where the provider is to go, and what stands about: from messages to the region that is planned in.
//!
//! The region follows what is known: a newer grid, or newer objects and a newer map, make a new one for the same goal.

use super::inputs::planar;
use crate::inlets::SensorSlots;
use messages::autoware_perception_msgs::{PredictedObject, PredictedObjects, Shape};
use messages::geometry_msgs::PoseStamped;
use messages::nav_msgs::OccupancyGrid;
use motion::geometry::polygon_contains;
use motion::{Point2, VehicleInfo};
use open_space::PlanarPose;
use open_space::provider::Region;
use open_space::region_of_interest::{
    self as roi, Manoeuvre, ObstacleSource, RegionError, RegionParameters, first_blocked,
};
use selection::Scene;
use selection::scene::HdMap;
use std::sync::Arc;

/// Objects slower than this (m/s) stand: they are part of the region. Faster ones are watched while driving.
const STANDING_MPS: f64 = 0.5;

/// Corners of the polygon around a cylinder.
const CYLINDER_CORNERS: u32 = 16;

/// A goal that differs by no more than this (m, rad) is the same goal sent again.
const SAME_GOAL: f64 = 1e-6;

/// Why there is no region although there is a goal.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub(super) enum NoRegion {
    #[error("the {what} is in frame \"{found}\", but the vehicle in \"{expected}\"; send it in that frame")]
    Frame { what: &'static str, found: String, expected: String },
    #[error("no {0} was received yet")]
    Missing(&'static str),
    #[error("the goal is in no parking lot of the map; move it, or take obstacles from an occupancy grid")]
    NoParkingLot,
    #[error(transparent)]
    Region(#[from] RegionError),
}

/// What is known of the vehicle's surroundings, and what is to be done in them.
#[derive(Debug)]
pub(super) struct Surroundings {
    parameters: RegionParameters,
    vehicle: VehicleInfo,
    slots: Arc<SensorSlots>,
    task: Task,
    grid: Option<Arc<OccupancyGrid>>,
}

#[derive(Debug)]
enum Task {
    Nothing,
    /// By whoever holds the system.
    Given(Arc<Region>),
    /// By a message.
    Goal(Goal),
}

#[derive(Debug)]
struct Goal {
    frame_id: String,
    pose: PlanarPose,
    /// Where the vehicle was when it was first taken up.
    begin: Option<PlanarPose>,
    made: Option<Made>,
}

#[derive(Debug)]
struct Made {
    of: Source,
    region: Arc<Region>,
}

/// What a region was made of.
#[derive(Debug, Clone)]
enum Source {
    Grid(Arc<OccupancyGrid>),
    Lot(Arc<PredictedObjects>, u64),
}

impl Source {
    fn is_same(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Grid(one), Self::Grid(other)) => Arc::ptr_eq(one, other),
            (Self::Lot(one, map), Self::Lot(other, other_map)) => Arc::ptr_eq(one, other) && map == other_map,
            _ => false,
        }
    }
}

impl Surroundings {
    pub(super) fn new(parameters: RegionParameters, vehicle: VehicleInfo, slots: Arc<SensorSlots>) -> Self {
        Self { parameters, vehicle, slots, task: Task::Nothing, grid: None }
    }

    pub(super) fn give(&mut self, region: Option<Arc<Region>>) {
        self.task = region.map_or(Task::Nothing, Task::Given);
    }

    /// Takes up a goal; false if it is the one that there is, or none at all.
    pub(super) fn set_goal(&mut self, goal: &PoseStamped) -> bool {
        let pose = planar(&goal.pose);
        if !pose.is_finite() {
            tracing::warn!("a goal that is no place is ignored: {:?}", goal.pose);
            return false;
        }
        let frame_id = goal.header.frame_id.clone();
        if let Task::Goal(known) = &self.task
            && known.frame_id == frame_id
            && known.pose.distance_m(&pose) <= SAME_GOAL
            && known.pose.yaw_to(&pose).abs() <= SAME_GOAL
        {
            return false;
        }
        self.task = Task::Goal(Goal { frame_id, pose, begin: None, made: None });
        true
    }

    /// The region to plan in now, or why there is none; nothing without a goal.
    pub(super) fn region(
        &mut self,
        scene: &Scene,
        vehicle: PlanarPose,
        frame_id: &str,
    ) -> Option<Result<Arc<Region>, NoRegion>> {
        self.slots.take_grid_into(&mut self.grid);
        let goal = match &mut self.task {
            Task::Nothing => return None,
            Task::Given(region) => return Some(Ok(region.clone())),
            Task::Goal(goal) => goal,
        };
        let begin = *goal.begin.get_or_insert(vehicle);
        let manoeuvre = Manoeuvre { begin, vehicle, goal: goal.pose };
        let look = Look { parameters: &self.parameters, vehicle: &self.vehicle, manoeuvre, frame_id };
        let made = check_frame("goal", &goal.frame_id, frame_id)
            .and_then(|()| look.source(self.grid.as_ref(), scene))
            .and_then(|of| match goal.made.take() {
                Some(known) if known.of.is_same(&of) && holds(&known.region, vehicle) => Ok(known),
                _ => look.region(&of, scene).map(|region| Made { of, region: Arc::new(region) }),
            });
        Some(made.map(|made| {
            let region = made.region.clone();
            goal.made = Some(made);
            region
        }))
    }

    /// Whether something that was not known when the way was planned is in it. A given region does not change.
    pub(super) fn is_blocked(&self, region: &Region, way: &[PlanarPose]) -> bool {
        matches!(self.task, Task::Goal(_)) && first_blocked(region, &self.vehicle, way).is_some()
    }
}

fn holds(region: &Region, vehicle: PlanarPose) -> bool {
    let [x_min, x_max, y_min, y_max] = region.bounds;
    let place = region.to_region(vehicle);
    (x_min..=x_max).contains(&place.x) && (y_min..=y_max).contains(&place.y)
}

fn check_frame(what: &'static str, found: &str, expected: &str) -> Result<(), NoRegion> {
    if found == expected {
        return Ok(());
    }
    Err(NoRegion::Frame { what, found: found.to_owned(), expected: expected.to_owned() })
}

/// One look at the surroundings.
struct Look<'a> {
    parameters: &'a RegionParameters,
    vehicle: &'a VehicleInfo,
    manoeuvre: Manoeuvre,
    frame_id: &'a str,
}

impl Look<'_> {
    fn source(&self, grid: Option<&Arc<OccupancyGrid>>, scene: &Scene) -> Result<Source, NoRegion> {
        match self.parameters.obstacles_from {
            ObstacleSource::OccupancyGrid => {
                let grid = grid.ok_or(NoRegion::Missing("occupancy grid"))?;
                check_frame("occupancy grid", &grid.header.frame_id, self.frame_id)?;
                Ok(Source::Grid(grid.clone()))
            }
            ObstacleSource::ParkingLot => {
                let objects = scene.objects.clone().ok_or(NoRegion::Missing("message with objects"))?;
                let map = scene.map.as_ref().ok_or(NoRegion::Missing("map"))?;
                check_frame("map", &map.value.frame_id, self.frame_id)?;
                Ok(Source::Lot(objects, map.number))
            }
        }
    }

    fn region(&self, source: &Source, scene: &Scene) -> Result<Region, NoRegion> {
        match source {
            Source::Grid(grid) => {
                let info = &grid.info;
                // A width that does not fit the cells is refused with the grid.
                let columns = info.width as usize;
                let rows = info.height as usize;
                if columns.checked_mul(rows) != Some(grid.data.len()) {
                    let fault = "has a number of cells that does not fit its size";
                    return Err(RegionError::Grid { fault }.into());
                }
                let cells = roi::OccupancyGrid {
                    origin: planar(&info.origin),
                    resolution_m: f64::from(info.resolution),
                    columns,
                    cells: &grid.data,
                };
                Ok(roi::from_grid(self.parameters, self.vehicle, &self.manoeuvre, &cells)?)
            }
            Source::Lot(objects, _) => {
                let map = scene.map.as_ref().ok_or(NoRegion::Missing("map"))?;
                let lot = lot_of(&map.value, self.manoeuvre.goal.point()).ok_or(NoRegion::NoParkingLot)?;
                let standing: Vec<_> =
                    objects.objects.iter().filter(|object| stands(object)).map(outline).collect();
                Ok(roi::from_area(self.parameters, self.vehicle, &self.manoeuvre, &lot, &standing)?)
            }
        }
    }
}

/// The parking lot of the map that a place is in.
fn lot_of(map: &HdMap, place: Point2) -> Option<Vec<Point2>> {
    let corners = |polygon: lanelet_map::Polyline<'_>| -> Vec<Point2> {
        polygon.positions().map(|[x, y, _]| Point2::new(x, y)).collect()
    };
    map.map
        .polygons()
        .filter(|polygon| polygon.attribute("type") == Some("parking_lot"))
        .map(corners)
        .find(|lot| polygon_contains(lot, place))
}

fn stands(object: &PredictedObject) -> bool {
    let velocity = object.kinematics.initial_twist_with_covariance.twist.linear;
    let speed_mps = velocity.x.hypot(velocity.y);
    // An object of unknown speed stands as well.
    speed_mps.is_nan() || speed_mps < STANDING_MPS
}

/// The outline of an object in the map; it holds the whole of it.
fn outline(object: &PredictedObject) -> Vec<Point2> {
    let shape = &object.shape;
    let at = planar(&object.kinematics.initial_pose_with_covariance.pose);
    let (sin, cos) = at.yaw.sin_cos();
    let place = |x: f64, y: f64| Point2::new(at.x + x * cos - y * sin, at.y + x * sin + y * cos);
    let (x, y) = (0.5 * shape.dimensions.x, 0.5 * shape.dimensions.y);
    match shape.r#type {
        Shape::POLYGON => {
            shape.footprint.points.iter().map(|p| place(f64::from(p.x), f64::from(p.y))).collect()
        }
        Shape::CYLINDER => {
            let step_rad = std::f64::consts::TAU / f64::from(CYLINDER_CORNERS);
            let radius_m = x.max(y) / (0.5 * step_rad).cos();
            let corner = |k: u32| {
                let (sin, cos) = (f64::from(k) * step_rad).sin_cos();
                place(radius_m * cos, radius_m * sin)
            };
            (0..CYLINDER_CORNERS).map(corner).collect()
        }
        _ => [(x, y), (-x, y), (-x, -y), (x, -y)].map(|(x, y)| place(x, y)).to_vec(),
    }
}

#[cfg(test)]
mod tests;
