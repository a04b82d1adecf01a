//! The parameters, resolved once for each class of objects, so that judging looks nothing up by name.

use crate::parameters::{
    AssessmentParameters, CollisionCheckParameters, EgoDracAcceleration, ObjectClass, PerClass, Shape,
};
use motion::VehicleInfo;
use motion::occupancy::Outline;

/// Finer sampling than this \[s\] only costs time: slices miss no contact at any resolution.
const MIN_RESOLUTION_S: f64 = 0.01;
/// Slack of the search range \[s\], as upstream has it.
pub(super) const TIME_SLACK_S: f64 = 1e-3;

/// Accelerations of the vehicle that one case tries, and whether it tries any.
#[derive(Debug, Clone, Copy)]
pub(super) struct Case {
    pub(super) is_enabled: bool,
    pub(super) tiers: EgoTiers,
}

/// Accelerations of the vehicle that are tried in turn \[m/s²\], negative.
#[derive(Debug, Clone, Copy)]
pub(super) struct EgoTiers {
    pub(super) safe: f64,
    pub(super) danger: f64,
    pub(super) fatal: f64,
    pub(super) may_abandon: bool,
}

impl EgoTiers {
    /// True if both try the same accelerations.
    pub(super) fn tries_same(&self, other: &Self) -> bool {
        [self.safe, self.danger, self.fatal] == [other.safe, other.danger, other.fatal]
    }
}

/// What holds for one class of objects.
#[derive(Debug, Clone)]
pub(super) struct ClassSettings {
    pub(super) is_vulnerable: bool,
    pub(super) drac_shapes: Vec<Shape>,
    pub(super) rss_shapes: Vec<Shape>,
    /// Ticks that the object may be ahead of the vehicle at one place.
    pub(super) object_earlier_ticks: usize,
    /// Ticks that the vehicle may be ahead.
    pub(super) ego_earlier_ticks: usize,
    pub(super) bias_s: f64,
    /// Place in [`Settings::ego_outlines`].
    pub(super) ego_outline: usize,
    pub(super) braking_delay_s: f64,
    /// Horizon of the motion with constant curvature; `None` if that is not assessed.
    pub(super) arc_horizon_s: Option<f64>,
    pub(super) arc_ego_earlier: Case,
    pub(super) arc_object_earlier: Case,
    pub(super) assesses_paths: bool,
    /// Both standing for longer than this \[ns\] lifts the findings on predicted paths.
    pub(super) arbitration_wait_ns: Option<i64>,
    pub(super) ego_prioritized_ego_earlier: Case,
    pub(super) ego_prioritized_object_earlier: Case,
    pub(super) object_prioritized_ego_earlier: Case,
    pub(super) object_prioritized_object_earlier: Case,
    /// Accelerations of a yielding object \[m/s²\]: safe, low caution.
    pub(super) object_tiers: [f64; 2],
    pub(super) rss: RssSettings,
}

/// Distance assessment of one class.
#[derive(Debug, Clone, Copy)]
pub(super) struct RssSettings {
    pub(super) stop_margin_m: f64,
    pub(super) braking_delay_s: f64,
    pub(super) object_acceleration_mps2: f64,
    pub(super) error_acceleration_mps2: f64,
}

/// All parameters, ready for use.
#[derive(Debug)]
pub(super) struct Settings {
    pub(super) resolution_s: f64,
    classes: Vec<ClassSettings>,
    /// Outlines of the vehicle with the different margins of the classes, in base_link.
    pub(super) ego_outlines: Vec<Outline>,
    /// Outline of the vehicle for the distance assessment.
    pub(super) rss_outline: Outline,
    /// Place of one of the other outlines that holds it.
    pub(super) rss_cover: usize,
    pub(super) ego_stop: (f64, i64),
    pub(super) object_stop: (f64, i64),
    /// True if findings on predicted paths, and on arcs, all have one threshold.
    pub(super) path_threshold_is_one: bool,
    pub(super) arc_threshold_is_one: bool,
}

impl Settings {
    pub(super) fn new(parameters: &CollisionCheckParameters, vehicle: &VehicleInfo) -> Self {
        let drac = &parameters.drac;
        let resolution_s = parameters.global_setting.time_resolution.max(MIN_RESOLUTION_S);
        let ticks = |limit_s: f64| ((limit_s + TIME_SLACK_S) / resolution_s).floor().max(0.0) as usize;
        let mut ego_outlines: Vec<Outline> = Vec::new();
        let mut outline_of = |class: ObjectClass| {
            let margin = &drac.ego_footprint_margin;
            let outline = outline(
                vehicle,
                *margin.lateral.get(class),
                *margin.front.get(class),
                *margin.rear.get(class),
            );
            ego_outlines.iter().position(|known| *known == outline).unwrap_or_else(|| {
                ego_outlines.push(outline);
                ego_outlines.len() - 1
            })
        };
        let cc = &drac.constant_curvature;
        let map = &drac.map_based;
        let classes = ObjectClass::ALL.iter().map(|&class| ClassSettings {
            is_vulnerable: matches!(class, ObjectClass::Pedestrian | ObjectClass::Bicycle),
            drac_shapes: drac.enable_assessment.get(class).clone(),
            rss_shapes: parameters.rss.enable_assessment.get(class).clone(),
            object_earlier_ticks: ticks(*drac.pet_margin.object_earlier.get(class)),
            ego_earlier_ticks: ticks(*drac.pet_margin.ego_earlier.get(class)),
            bias_s: *drac.pet_margin.object_earlier_judgement_bias.get(class),
            ego_outline: outline_of(class),
            braking_delay_s: *drac.ego_reaction_braking_delay.nominal.get(class),
            arc_horizon_s: cc.enable_assessment.get(class).then(|| *cc.object_time_horizon.get(class)),
            // The vehicle's tiers are those of the case in which the object passes first: section of the cases that
            // upstream leaves open.
            arc_ego_earlier: Case {
                is_enabled: *cc.ego_earlier.enable_assessment.get(class),
                tiers: tiers(&cc.object_earlier.ego_drac_acceleration, class),
            },
            arc_object_earlier: case(&cc.object_earlier, class),
            assesses_paths: *map.enable_assessment.get(class),
            arbitration_wait_ns: map
                .mutual_yield_timeout_arbitration
                .enabled
                .get(class)
                .then(|| nanoseconds(*map.mutual_yield_timeout_arbitration.min_wait_time.get(class))),
            ego_prioritized_ego_earlier: case(&map.ego_prioritized_ego_earlier, class),
            ego_prioritized_object_earlier: case(&map.ego_prioritized_object_earlier, class),
            object_prioritized_ego_earlier: Case {
                is_enabled: *map.object_prioritized_ego_earlier.enable_assessment.get(class),
                tiers: tiers(&map.object_prioritized_ego_earlier.ego_drac_acceleration, class),
            },
            object_prioritized_object_earlier: case(&map.object_prioritized_object_earlier, class),
            object_tiers: [
                *map.object_prioritized_ego_earlier.object_drac_acceleration.safe_limit.get(class),
                *map.object_prioritized_ego_earlier.object_drac_acceleration.low_caution_limit.get(class),
            ],
            rss: RssSettings {
                stop_margin_m: *parameters.rss.stop_distance_margin.get(class),
                braking_delay_s: *parameters.rss.ego_total_braking_delay.get(class),
                object_acceleration_mps2: *parameters.rss.object_assumed_acceleration.get(class),
                error_acceleration_mps2: *parameters.rss.error_threshold.ego_acceleration.get(class),
            },
        });
        let classes: Vec<ClassSettings> = classes.collect();
        let path_threshold_is_one = is_one(classes.iter().flat_map(|class| {
            [
                class.ego_prioritized_ego_earlier.tiers.safe,
                class.ego_prioritized_object_earlier.tiers.safe,
                class.object_prioritized_ego_earlier.tiers.safe,
                class.object_prioritized_object_earlier.tiers.safe,
            ]
        }));
        let arc_threshold_is_one = is_one(
            classes
                .iter()
                .flat_map(|class| [class.arc_ego_earlier.tiers.safe, class.arc_object_earlier.tiers.safe]),
        );
        let margin = &parameters.rss.ego_footprint_margin;
        let rss_outline = outline(vehicle, margin.lateral, margin.front, margin.rear);
        let rss_cover =
            ego_outlines.iter().position(|other| other.holds(&rss_outline)).unwrap_or_else(|| {
                ego_outlines.push(rss_outline.clone());
                ego_outlines.len() - 1
            });
        let stop = &drac.stop_tracking;
        Self {
            resolution_s,
            classes,
            ego_outlines,
            rss_outline,
            rss_cover,
            ego_stop: (stop.ego.stopped_velocity_threshold, nanoseconds(stop.ego.history_timeout)),
            object_stop: (stop.object.stopped_velocity_threshold, nanoseconds(stop.object.history_timeout)),
            path_threshold_is_one,
            arc_threshold_is_one,
        }
    }

    pub(super) fn class(&self, class: ObjectClass) -> &ClassSettings {
        &self.classes[class as usize]
    }
}

/// The vehicle with margins. Its true sides: upstream centres the width on base_link, which is the same for a vehicle
/// with equal overhangs and misses a part of any other.
fn outline(vehicle: &VehicleInfo, lateral_m: f64, front_m: f64, rear_m: f64) -> Outline {
    Outline::rectangle(
        vehicle.max_longitudinal_offset_m() + front_m,
        rear_m - vehicle.min_longitudinal_offset_m(),
        vehicle.max_lateral_offset_m() + lateral_m,
        lateral_m - vehicle.min_lateral_offset_m(),
    )
}

fn case(parameters: &AssessmentParameters, class: ObjectClass) -> Case {
    Case {
        is_enabled: *parameters.enable_assessment.get(class),
        tiers: tiers(&parameters.ego_drac_acceleration, class),
    }
}

fn tiers(parameters: &EgoDracAcceleration, class: ObjectClass) -> EgoTiers {
    let value = |values: &PerClass<f64>| *values.get(class);
    EgoTiers {
        safe: value(&parameters.safe_limit),
        danger: value(&parameters.danger_limit),
        fatal: value(&parameters.fatal_limit),
        may_abandon: *parameters.enable_abandon.get(class),
    }
}

/// True if all numbers are the same.
fn is_one(mut numbers: impl Iterator<Item = f64>) -> bool {
    let first = numbers.next();
    numbers.all(|other| Some(other) == first)
}

fn nanoseconds(seconds: f64) -> i64 {
    (seconds * 1e9).round() as i64
}

#[cfg(test)]
mod tests {
    use super::*;
    use motion::VehicleDimensions;

    fn vehicle(left_overhang_m: f64) -> VehicleInfo {
        let front =
            VehicleDimensions { wheel_base_m: 3.0, front_overhang_m: 1.0, ..VehicleDimensions::default() };
        VehicleInfo::new(VehicleDimensions {
            rear_overhang_m: 1.0,
            wheel_tread_m: 2.0,
            left_overhang_m,
            right_overhang_m: 0.0,
            ..front
        })
        .unwrap()
    }

    #[test]
    fn margins_are_added_to_the_outline() {
        let corners = outline(&vehicle(0.0), 0.3, 0.7, 0.5).corners().to_vec();
        let expected = [(4.7, 1.3), (4.7, -1.3), (-1.5, -1.3), (-1.5, 1.3)];
        for (corner, (x, y)) in corners.iter().zip(expected) {
            assert!((corner.x - x).abs() < 1e-12 && (corner.y - y).abs() < 1e-12, "{corner}");
        }
        // unequal overhangs: each side is where it is
        let wide = outline(&vehicle(0.5), 0.0, 0.0, 0.0).corners().to_vec();
        assert!((wide[0].y - 1.5).abs() < 1e-12 && (wide[1].y + 1.0).abs() < 1e-12);
    }

    #[test]
    fn classes_with_equal_margins_share_an_outline() {
        let settings = Settings::new(&CollisionCheckParameters::default(), &vehicle(0.0));
        assert_eq!(settings.ego_outlines.len(), 2);
        let of = |class| settings.class(class).ego_outline;
        assert_eq!(of(ObjectClass::Car), of(ObjectClass::Truck));
        assert_eq!(of(ObjectClass::Pedestrian), of(ObjectClass::Bicycle));
        assert_ne!(of(ObjectClass::Car), of(ObjectClass::Pedestrian));
        assert_eq!(settings.class(ObjectClass::Car).object_earlier_ticks, 10);
        assert_eq!(settings.class(ObjectClass::Car).ego_earlier_ticks, 6);
    }
}
