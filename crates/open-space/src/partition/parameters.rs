//! Parameters of the partition, named as upstream names them.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Where the vehicle is looked for on its plan, and when a part of it is done.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct PartitionParameters {
    /// Distance within which points are looked at.
    #[schemars(range(max = 100.0), extend("exclusiveMinimum" = 0.0, "x-unit" = "m"))]
    pub distance_search_range: f64,
    /// Largest difference between the way a point is driven and the way the vehicle is heading.
    #[schemars(range(max = 3.2), extend("exclusiveMinimum" = 0.0, "x-unit" = "rad"))]
    pub heading_search_range: f64,
    /// Largest angle between the way the vehicle is heading and the direction to a point: points behind are not looked
    /// at.
    #[schemars(range(max = 3.2), extend("exclusiveMinimum" = 0.0, "x-unit" = "rad"))]
    pub heading_track_range: f64,
    /// Distance across the path below which the vehicle is at the end of a part.
    #[schemars(range(max = 100.0), extend("exclusiveMinimum" = 0.0, "x-unit" = "m"))]
    pub lateral_offset_to_midpoint: f64,
    /// Distance along the path below which the vehicle is at the end of a part.
    #[schemars(range(max = 100.0), extend("exclusiveMinimum" = 0.0, "x-unit" = "m"))]
    pub longitudinal_offset_to_midpoint: f64,
    /// Difference of heading below which the vehicle is at the end of a part.
    #[schemars(range(max = 3.2), extend("exclusiveMinimum" = 0.0, "x-unit" = "rad"))]
    pub heading_offset_to_midpoint: f64,
    /// Speed below which the vehicle stands at the end of a part.
    #[schemars(range(max = 10.0), extend("exclusiveMinimum" = 0.0, "x-unit" = "m/s"))]
    pub linear_velocity_threshold_on_ego: f64,
    /// Overlap of the vehicle's outline with that at the end of a part (shared over covered area) above which the
    /// vehicle is there.
    #[schemars(range(min = 0.0, max = 1.0), extend("x-unit" = "1"))]
    pub vehicle_box_iou_threshold_to_midpoint: f64,
}

impl Default for PartitionParameters {
    fn default() -> Self {
        Self {
            distance_search_range: 2.0,
            heading_search_range: 0.79,
            heading_track_range: 1.57,
            lateral_offset_to_midpoint: 0.5,
            longitudinal_offset_to_midpoint: 0.2,
            heading_offset_to_midpoint: 0.79,
            linear_velocity_threshold_on_ego: 0.2,
            vehicle_box_iou_threshold_to_midpoint: 0.75,
        }
    }
}
