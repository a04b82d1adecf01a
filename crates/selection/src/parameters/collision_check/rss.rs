//! Parameters of the distance to objects on the path (RSS).

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{ObjectClass, PerClass, Shape};

/// Parameters of the distance assessment.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct RssParameters {
    /// Assessed shapes; [""] switches the assessment off for the class.
    pub enable_assessment: PerClass<Vec<Shape>>,
    /// Distance to keep after stopping.
    #[schemars(extend("minimum" = 0.0, "x-unit" = "m"))]
    pub stop_distance_margin: PerClass<f64>,
    /// Time before the vehicle brakes.
    #[schemars(extend("minimum" = 0.0, "x-unit" = "s"))]
    pub ego_total_braking_delay: PerClass<f64>,
    /// Margins around the vehicle.
    pub ego_footprint_margin: RssFootprintMargin,
    /// Assumed braking of the object, negative.
    #[schemars(extend("minimum" = -50.0, "exclusiveMaximum" = 0.0, "x-unit" = "m/s2"))]
    pub object_assumed_acceleration: PerClass<f64>,
    /// When the distance is too short.
    pub error_threshold: RssErrorThreshold,
}

impl Default for RssParameters {
    fn default() -> Self {
        let boxes = || vec![Shape::Bbox, Shape::Cylinder];
        let off = || vec![Shape::Nothing];
        Self {
            enable_assessment: PerClass::all(vec![Shape::Bbox, Shape::Polygon, Shape::Cylinder])
                .with(ObjectClass::Motorcycle, boxes())
                .with(ObjectClass::Bicycle, boxes())
                .with(ObjectClass::OverDrivable, off())
                .with(ObjectClass::UnderDrivable, off()),
            stop_distance_margin: PerClass::all(2.0),
            ego_total_braking_delay: PerClass::all(0.4),
            ego_footprint_margin: RssFootprintMargin::default(),
            object_assumed_acceleration: PerClass::all(-4.0),
            error_threshold: RssErrorThreshold::default(),
        }
    }
}

/// Margins around the vehicle, the same for all classes.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct RssFootprintMargin {
    /// Added on each side.
    #[schemars(range(min = 0.0), extend("x-unit" = "m"))]
    pub lateral: f64,
    /// Added in front.
    #[schemars(range(min = 0.0), extend("x-unit" = "m"))]
    pub front: f64,
    /// Added behind.
    #[schemars(range(min = 0.0), extend("x-unit" = "m"))]
    pub rear: f64,
}

/// When the distance is too short.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct RssErrorThreshold {
    /// Harder required braking than this is danger; negative.
    #[schemars(extend("minimum" = -50.0, "exclusiveMaximum" = 0.0, "x-unit" = "m/s2"))]
    pub ego_acceleration: PerClass<f64>,
}

impl Default for RssErrorThreshold {
    fn default() -> Self {
        Self { ego_acceleration: PerClass::all(-4.0) }
    }
}
