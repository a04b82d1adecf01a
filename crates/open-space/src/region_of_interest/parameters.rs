//! Parameters of the region of interest.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How the surroundings of a vehicle become the region that it is planned in.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct RegionParameters {
    /// What is taken for obstacles: occupied cells of the occupancy grid, or in a parking lot of the map its border
    /// and the objects that stand in it. Objects that move are watched in either case.
    pub obstacles_from: ObstacleSource,
    /// Way that the vehicle may take to each side of where it comes from and goes to.
    #[schemars(range(min = 1.0, max = 200.0), extend("x-unit" = "m"))]
    pub region_margin: f64,
    /// Cells of the occupancy grid from this value on are obstacles.
    #[schemars(range(min = 1, max = 100))]
    pub occupied_from: u32,
    /// Cells whose value nobody knows are obstacles, too.
    pub unknown_is_occupied: bool,
}

/// Where obstacles come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ObstacleSource {
    /// The newest occupancy grid.
    #[default]
    OccupancyGrid,
    /// Objects, and the parking lots of the map.
    ParkingLot,
}

impl Default for RegionParameters {
    fn default() -> Self {
        Self {
            obstacles_from: ObstacleSource::default(),
            region_margin: 15.0,
            occupied_from: 50,
            unknown_is_occupied: true,
        }
    }
}
