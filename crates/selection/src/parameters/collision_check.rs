//! Parameters of the collision check: required braking against predicted paths (DRAC) and distance to objects on
//! the path (RSS). Most values may differ by the class of the object.

mod rss;

pub use rss::{RssErrorThreshold, RssFootprintMargin, RssParameters};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{ObjectClass, PerClass, RuleViolation};

/// Parameters of the collision check.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct CollisionCheckParameters {
    /// What both assessments share.
    pub global_setting: GlobalSetting,
    /// Deceleration required to avoid a predicted collision.
    pub drac: DracParameters,
    /// Responsibility-sensitive distance to objects on the path.
    pub rss: RssParameters,
}

/// What both assessments share.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct GlobalSetting {
    /// Sampling time of paths and of the search for a contact.
    #[schemars(range(max = 1.0), extend("exclusiveMinimum" = 0.0, "x-unit" = "s"))]
    pub time_resolution: f64,
}

impl Default for GlobalSetting {
    fn default() -> Self {
        Self { time_resolution: 0.1 }
    }
}

/// Shape of a perceived object, as an entry of a list of assessed shapes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Shape {
    /// No shape: alone in a list it switches the assessment off.
    #[serde(rename = "")]
    Nothing,
    /// Box.
    Bbox,
    /// Polygon.
    Polygon,
    /// Cylinder, assessed as the square around it.
    Cylinder,
}

/// Parameters of the required-braking assessment.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct DracParameters {
    /// When the vehicle and objects count as stopped.
    pub stop_tracking: StopTrackingParameters,
    /// Assessed shapes; [""] switches the assessment off for the class.
    pub enable_assessment: PerClass<Vec<Shape>>,
    /// Times between the passages of one place that still count as a conflict.
    pub pet_margin: PetMargin,
    /// Margins around the vehicle.
    pub ego_footprint_margin: FootprintMargin,
    /// Time before the vehicle brakes.
    pub ego_reaction_braking_delay: BrakingDelay,
    /// Assessment against the object's motion with constant curvature.
    pub constant_curvature: ConstantCurvatureParameters,
    /// Assessment against the predicted paths on the map.
    pub map_based: MapBasedParameters,
}

impl Default for DracParameters {
    fn default() -> Self {
        let off = || vec![Shape::Nothing];
        Self {
            stop_tracking: StopTrackingParameters::default(),
            enable_assessment: PerClass::all(vec![Shape::Bbox, Shape::Cylinder])
                .with(ObjectClass::Unknown, off())
                .with(ObjectClass::OverDrivable, off())
                .with(ObjectClass::UnderDrivable, off()),
            pet_margin: PetMargin::default(),
            ego_footprint_margin: FootprintMargin::default(),
            ego_reaction_braking_delay: BrakingDelay::default(),
            constant_curvature: ConstantCurvatureParameters::default(),
            map_based: MapBasedParameters::default(),
        }
    }
}

/// When the vehicle and objects count as stopped.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct StopTrackingParameters {
    /// The vehicle itself.
    pub ego: StopTracking,
    /// Perceived objects.
    pub object: StopTracking,
}

/// When something counts as stopped.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StopTracking {
    /// Slower than this is stopped.
    #[schemars(extend("exclusiveMinimum" = 0.0, "x-unit" = "m/s"))]
    pub stopped_velocity_threshold: f64,
    /// Unseen for longer than this is forgotten.
    #[schemars(range(min = 0.0), extend("x-unit" = "s"))]
    pub history_timeout: f64,
}

impl Default for StopTrackingParameters {
    fn default() -> Self {
        Self {
            ego: StopTracking { stopped_velocity_threshold: 0.01, history_timeout: 0.3 },
            object: StopTracking { stopped_velocity_threshold: 0.3, history_timeout: 0.3 },
        }
    }
}

/// Times between the passages of one place that still count as a conflict.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct PetMargin {
    /// Search range when the vehicle passes first.
    #[schemars(extend("minimum" = 0.0, "maximum" = 60.0, "x-unit" = "s"))]
    pub ego_earlier: PerClass<f64>,
    /// Search range when the object passes first.
    #[schemars(extend("minimum" = 0.0, "maximum" = 60.0, "x-unit" = "s"))]
    pub object_earlier: PerClass<f64>,
    /// Up to this lead of the vehicle the object counts as passing first.
    #[schemars(extend("minimum" = -60.0, "maximum" = 60.0, "x-unit" = "s"))]
    pub object_earlier_judgement_bias: PerClass<f64>,
}

impl Default for PetMargin {
    fn default() -> Self {
        Self {
            ego_earlier: PerClass::all(0.6),
            object_earlier: PerClass::all(1.0),
            object_earlier_judgement_bias: PerClass::all(0.0),
        }
    }
}

/// Margins around the vehicle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct FootprintMargin {
    /// Added on each side.
    #[schemars(extend("minimum" = 0.0, "x-unit" = "m"))]
    pub lateral: PerClass<f64>,
    /// Added in front.
    #[schemars(extend("minimum" = 0.0, "x-unit" = "m"))]
    pub front: PerClass<f64>,
    /// Added behind.
    #[schemars(extend("minimum" = 0.0, "x-unit" = "m"))]
    pub rear: PerClass<f64>,
}

impl Default for FootprintMargin {
    fn default() -> Self {
        Self {
            lateral: PerClass::all(0.3).with(ObjectClass::Pedestrian, 0.5).with(ObjectClass::Bicycle, 0.5),
            front: PerClass::all(1.0),
            rear: PerClass::all(0.0),
        }
    }
}

/// Time before the vehicle brakes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct BrakingDelay {
    /// While driving.
    #[schemars(extend("minimum" = 0.0, "x-unit" = "s"))]
    pub nominal: PerClass<f64>,
    /// Declared for compatibility; nothing depends on it.
    #[schemars(extend("minimum" = 0.0, "x-unit" = "s"))]
    pub departure: PerClass<f64>,
}

impl Default for BrakingDelay {
    fn default() -> Self {
        Self { nominal: PerClass::all(0.5), departure: PerClass::all(1.0) }
    }
}

/// Assessment against the object's motion with constant curvature.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ConstantCurvatureParameters {
    /// Assess this motion.
    pub enable_assessment: PerClass<bool>,
    /// How far the motion is predicted.
    #[schemars(extend("minimum" = 0.0, "maximum" = 60.0, "x-unit" = "s"))]
    pub object_time_horizon: PerClass<f64>,
    /// The vehicle passes first.
    pub ego_earlier: AssessmentParameters,
    /// The object passes first.
    pub object_earlier: AssessmentParameters,
}

impl Default for ConstantCurvatureParameters {
    fn default() -> Self {
        Self {
            enable_assessment: PerClass::all(true),
            object_time_horizon: PerClass::all(1.0)
                .with(ObjectClass::Pedestrian, 1.5)
                .with(ObjectClass::Bicycle, 1.5),
            ego_earlier: AssessmentParameters::disabled(),
            object_earlier: AssessmentParameters::default(),
        }
    }
}

/// Assessment against the predicted paths on the map.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct MapBasedParameters {
    /// Assess predicted paths.
    pub enable_assessment: PerClass<bool>,
    /// How the vehicle and an object that wait for each other get away.
    pub mutual_yield_timeout_arbitration: MutualYieldParameters,
    /// The vehicle has priority and passes first.
    pub ego_prioritized_ego_earlier: AssessmentParameters,
    /// The vehicle has priority, the object passes first.
    pub ego_prioritized_object_earlier: AssessmentParameters,
    /// The object has priority, the vehicle passes first.
    pub object_prioritized_ego_earlier: YieldingAssessmentParameters,
    /// The object has priority and passes first.
    pub object_prioritized_object_earlier: AssessmentParameters,
}

impl Default for MapBasedParameters {
    fn default() -> Self {
        Self {
            enable_assessment: PerClass::all(true),
            mutual_yield_timeout_arbitration: MutualYieldParameters::default(),
            ego_prioritized_ego_earlier: AssessmentParameters::disabled(),
            ego_prioritized_object_earlier: AssessmentParameters::disabled(),
            object_prioritized_ego_earlier: YieldingAssessmentParameters::default(),
            object_prioritized_object_earlier: AssessmentParameters::default(),
        }
    }
}

/// How the vehicle and an object that wait for each other get away.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct MutualYieldParameters {
    /// Accept the map-based findings about an object once both have stood long enough.
    pub enabled: PerClass<bool>,
    /// How long both must have stood.
    #[schemars(extend("minimum" = 0.0, "x-unit" = "s"))]
    pub min_wait_time: PerClass<f64>,
}

impl Default for MutualYieldParameters {
    fn default() -> Self {
        Self {
            enabled: PerClass::all(false)
                .with(ObjectClass::Pedestrian, true)
                .with(ObjectClass::Bicycle, true),
            min_wait_time: PerClass::all(3.0),
        }
    }
}

/// One case of the assessment: who passes first, who has priority.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct AssessmentParameters {
    /// Assess this case; otherwise it is reported as not assessed.
    pub enable_assessment: PerClass<bool>,
    /// Braking of the vehicle.
    pub ego_drac_acceleration: EgoDracAcceleration,
}

impl Default for AssessmentParameters {
    fn default() -> Self {
        Self { enable_assessment: PerClass::all(true), ego_drac_acceleration: EgoDracAcceleration::default() }
    }
}

impl AssessmentParameters {
    fn disabled() -> Self {
        Self { enable_assessment: PerClass::all(false), ..Self::default() }
    }
}

/// A case in which braking of the object is considered first.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct YieldingAssessmentParameters {
    /// Assess this case; otherwise it is reported as not assessed.
    pub enable_assessment: PerClass<bool>,
    /// Braking of the vehicle.
    pub ego_drac_acceleration: EgoDracAcceleration,
    /// Braking of the object.
    pub object_drac_acceleration: ObjectDracAcceleration,
}

impl Default for YieldingAssessmentParameters {
    fn default() -> Self {
        Self {
            enable_assessment: PerClass::all(true),
            ego_drac_acceleration: EgoDracAcceleration::default(),
            object_drac_acceleration: ObjectDracAcceleration::default(),
        }
    }
}

/// Accelerations of the vehicle that are tried in turn; negative, each at least as hard as the one before.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct EgoDracAcceleration {
    /// Enough up to here: safe.
    #[schemars(extend("minimum" = -50.0, "exclusiveMaximum" = 0.0, "x-unit" = "m/s2"))]
    pub safe_limit: PerClass<f64>,
    /// Enough up to here: danger.
    #[schemars(extend("minimum" = -50.0, "exclusiveMaximum" = 0.0, "x-unit" = "m/s2"))]
    pub danger_limit: PerClass<f64>,
    /// Enough up to here: fatal; not enough: unavoidable.
    #[schemars(extend("minimum" = -50.0, "exclusiveMaximum" = 0.0, "x-unit" = "m/s2"))]
    pub fatal_limit: PerClass<f64>,
    /// Report an unavoidable collision as low caution. Accepts candidates that collide: leave it off.
    pub enable_abandon: PerClass<bool>,
}

impl Default for EgoDracAcceleration {
    fn default() -> Self {
        Self {
            safe_limit: PerClass::all(-1.5),
            danger_limit: PerClass::all(-3.0),
            fatal_limit: PerClass::all(-6.0),
            enable_abandon: PerClass::all(false),
        }
    }
}

/// Accelerations of the object that are tried in turn; negative, each at least as hard as the one before.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ObjectDracAcceleration {
    /// Enough up to here: safe.
    #[schemars(extend("minimum" = -50.0, "exclusiveMaximum" = 0.0, "x-unit" = "m/s2"))]
    pub safe_limit: PerClass<f64>,
    /// Enough up to here: low caution.
    #[schemars(extend("minimum" = -50.0, "exclusiveMaximum" = 0.0, "x-unit" = "m/s2"))]
    pub low_caution_limit: PerClass<f64>,
}

impl Default for ObjectDracAcceleration {
    fn default() -> Self {
        Self { safe_limit: PerClass::all(-0.5), low_caution_limit: PerClass::all(-1.5) }
    }
}

impl CollisionCheckParameters {
    pub(super) fn check(&self, found: &mut Vec<RuleViolation>) {
        check_shapes("collision_check.drac.enable_assessment", &self.drac.enable_assessment, found);
        check_shapes("collision_check.rss.enable_assessment", &self.rss.enable_assessment, found);

        let cc = &self.drac.constant_curvature;
        let map = &self.drac.map_based;
        let yielding = &map.object_prioritized_ego_earlier;
        for (case, ego) in [
            ("constant_curvature.ego_earlier", &cc.ego_earlier.ego_drac_acceleration),
            ("constant_curvature.object_earlier", &cc.object_earlier.ego_drac_acceleration),
            ("map_based.ego_prioritized_ego_earlier", &map.ego_prioritized_ego_earlier.ego_drac_acceleration),
            (
                "map_based.ego_prioritized_object_earlier",
                &map.ego_prioritized_object_earlier.ego_drac_acceleration,
            ),
            ("map_based.object_prioritized_ego_earlier", &yielding.ego_drac_acceleration),
            (
                "map_based.object_prioritized_object_earlier",
                &map.object_prioritized_object_earlier.ego_drac_acceleration,
            ),
        ] {
            let group = format!("collision_check.drac.{case}.ego_drac_acceleration");
            check_order(&group, ("safe_limit", &ego.safe_limit), ("danger_limit", &ego.danger_limit), found);
            check_order(
                &group,
                ("danger_limit", &ego.danger_limit),
                ("fatal_limit", &ego.fatal_limit),
                found,
            );
        }
        let object = &yielding.object_drac_acceleration;
        check_order(
            "collision_check.drac.map_based.object_prioritized_ego_earlier.object_drac_acceleration",
            ("safe_limit", &object.safe_limit),
            ("low_caution_limit", &object.low_caution_limit),
            found,
        );
    }
}

fn check_shapes(group: &str, shapes: &PerClass<Vec<Shape>>, found: &mut Vec<RuleViolation>) {
    for (class, list) in shapes.named() {
        let parameter = || format!("{group}.{class}");
        if list.is_empty() {
            found.push(RuleViolation::EmptyBase { parameter: parameter() });
        } else if list.len() > 1 && list.contains(&Shape::Nothing) {
            found.push(RuleViolation::MixedSwitchOff { parameter: parameter() });
        }
    }
}

/// Reports every class whose `harder` limit brakes less than its `milder` one; once at the base if it is that.
fn check_order(
    group: &str,
    (milder_name, milder): (&str, &PerClass<f64>),
    (harder_name, harder): (&str, &PerClass<f64>),
    found: &mut Vec<RuleViolation>,
) {
    let mut check = |class: &str, harder: f64, milder: f64| {
        if harder > milder {
            found.push(RuleViolation::MilderThan {
                parameter: format!("{group}.{harder_name}.{class}"),
                value: harder,
                milder: format!("{group}.{milder_name}.{class}"),
                milder_value: milder,
            });
        }
    };
    check("base", harder.base, milder.base);
    for class in ObjectClass::ALL {
        if harder.own(*class).is_some() || milder.own(*class).is_some() {
            check(class.name(), *harder.get(*class), *milder.get(*class));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn violations(parameters: &CollisionCheckParameters) -> Vec<String> {
        let mut found = Vec::new();
        parameters.check(&mut found);
        found.iter().map(|v| v.parameter().to_owned()).collect()
    }

    #[test]
    fn the_switch_off_entry_stands_alone() {
        let mut parameters = CollisionCheckParameters::default();
        parameters.drac.enable_assessment.car = Some(vec![Shape::Bbox, Shape::Nothing]);
        parameters.rss.enable_assessment.base = vec![];
        assert_eq!(
            violations(&parameters),
            ["collision_check.drac.enable_assessment.car", "collision_check.rss.enable_assessment.base"]
        );
    }

    #[test]
    fn limits_grow_harder_in_turn_for_every_class() {
        let mut parameters = CollisionCheckParameters::default();
        let ego = &mut parameters.drac.constant_curvature.object_earlier.ego_drac_acceleration;
        ego.danger_limit.bus = Some(-1.0);
        ego.fatal_limit.base = -2.0;
        let group = "collision_check.drac.constant_curvature.object_earlier.ego_drac_acceleration";
        assert_eq!(
            violations(&parameters),
            [format!("{group}.danger_limit.bus"), format!("{group}.fatal_limit.base"),]
        );
    }

    #[test]
    fn equal_limits_are_allowed() {
        let mut parameters = CollisionCheckParameters::default();
        parameters.drac.constant_curvature.object_earlier.ego_drac_acceleration.danger_limit.base = -1.5;
        assert_eq!(violations(&parameters), Vec::<String>::new());
    }
}
