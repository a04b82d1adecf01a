//! Distance to what stands or drives on the path now (responsibility-sensitive safety).
//!
//! Only objects that touch the swept path count, at their present place. The distance is that along the path to the
//! end of the slice that touches first; what remains of it after the reaction time and the margin, and with what the
//! object itself needs to stop, must be enough to stop in.

use super::objects::Object;
use super::settings::RssSettings;
use crate::candidate::Candidate;
use motion::Vector2;
use motion::trajectory::yaw_deviation_from;

/// Fastest speed that is believed of an object driving ahead \[m/s\].
const MAX_OBJECT_SPEED_MPS: f64 = 30.0;

/// Speed of an object along the path \[m/s\], negative against it. The direction of the path is that of its segment
/// nearest to the object; a path without length faces as its first pose.
pub(super) fn longitudinal_velocity_mps(candidate: &Candidate, object: &Object) -> f64 {
    let points = &*candidate.points;
    let ends = points.first().zip(points.last());
    let has_length = ends.is_some_and(|(first, last)| {
        (last.pose.point() - first.pose.point()).norm() >= motion::tolerance::DIRECTION_M
    });
    let along_path = if has_length { yaw_deviation_from(points, &object.pose) } else { None };
    let yaw_rad = along_path
        .or_else(|| ends.map(|(first, _)| motion::pose::yaw_deviation(&first.pose, &object.pose)))
        .unwrap_or(0.0);
    object.velocity.dot(&Vector2::new(yaw_rad.cos(), -yaw_rad.sin()))
}

/// Acceleration \[m/s²\] that a vehicle at `speed_mps` needs so as not to come too near to an object `distance_m`
/// ahead that drives at `object_mps` and may brake: zero or negative, minus infinity when the distance is already
/// gone.
pub(super) fn required_acceleration_mps2(
    speed_mps: f64,
    distance_m: f64,
    object_mps: f64,
    settings: &RssSettings,
) -> f64 {
    let object_mps = object_mps.clamp(0.0, MAX_OBJECT_SPEED_MPS);
    let object_stop_m = object_mps * object_mps / (2.0 * -settings.object_acceleration_mps2);
    let free_m = distance_m - settings.stop_margin_m + object_stop_m - speed_mps * settings.braking_delay_s;
    if free_m <= 0.0 { f64::NEG_INFINITY } else { -(speed_mps * speed_mps) / (2.0 * free_m) }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SHIPPED: RssSettings = RssSettings {
        stop_margin_m: 2.0,
        braking_delay_s: 0.4,
        object_acceleration_mps2: -4.0,
        error_acceleration_mps2: -4.0,
    };

    #[test]
    fn required_accelerations() {
        for (speed, distance, object, expected) in [
            (10.0, 31.0, 0.0, -2.0),
            (10.0, 6.0, 0.0, f64::NEG_INFINITY),
            (10.0, 6.0 + 1e-3, 0.0, -50_000.0),
            (10.0, 18.5, 10.0, -2.0),
            (10.0, 18.5, -10.0, -4.0),
            (10.0, 0.0, 100.0, -100.0 / (2.0 * 106.5)),
        ] {
            let actual = required_acceleration_mps2(speed, distance, object, &SHIPPED);
            assert!(
                actual == expected || (actual - expected).abs() < 1e-6 * expected.abs(),
                "{speed} {distance} {object}: {actual} instead of {expected}"
            );
        }
    }

    #[test]
    fn velocity_along_the_path() {
        use crate::test_scene::candidate_of;
        use motion::occupancy::Outline;
        use motion::{Pose, TrajectoryPoint};

        let object = |yaw_rad: f64| Object {
            id: Default::default(),
            class: crate::parameters::ObjectClass::Car,
            outline: Outline::rectangle(1.0, 1.0, 1.0, 1.0),
            pose: Pose::from_xy_yaw(0.5, 0.0, yaw_rad),
            velocity: Vector2::new(2.0, 0.0),
            mutual_standing_ns: 0,
        };
        let along = |xs: [f64; 2], yaw_deg: f64, object_deg: f64| {
            let points = xs.map(|x| TrajectoryPoint {
                pose: Pose::from_xy_yaw(x, 0.0, yaw_deg.to_radians()),
                ..TrajectoryPoint::default()
            });
            longitudinal_velocity_mps(&candidate_of(points.to_vec()), &object(object_deg.to_radians()))
        };
        for (path, yaw_deg, object_deg, expected) in [
            ([0.0, 1.0], 90.0, 0.0, 2.0),
            ([0.0, 0.0], 60.0, 30.0, 2.0 * 30_f64.to_radians().cos()),
            ([0.0, 1.0], 0.0, 180.0, -2.0),
        ] {
            assert!((along(path, yaw_deg, object_deg) - expected).abs() < 1e-9, "{path:?}");
        }
    }
}
