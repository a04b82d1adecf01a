//! From the scene to what the provider needs to know of vehicle and road users.

use messages::autoware_perception_msgs::{PredictedObject, PredictedObjects, PredictedPath, Shape};
use messages::builtin_interfaces::Time;
use messages::geometry_msgs::{AccelWithCovarianceStamped, Pose};
use messages::nav_msgs::Odometry;
use motion::Quaternion;
use open_space::fallback::PredictedObstacle;
use open_space::vehicle_model::{VehicleState, curvature_from_yaw_rate};
use open_space::{Gear, PlanarPose};

/// A vehicle faster than this (m/s) is in the gear that it rolls in; below it in the one that was commanded.
const ROLLING_MPS: f64 = 0.1;

/// How far ahead an object without a predicted path is thought to go on as it does, s.
const CONSTANT_VELOCITY_S: f64 = 10.0;

/// The vehicle as measured. It is taken to drive itself: the selector is not told otherwise.
pub(super) fn vehicle_state(
    odometry: &Odometry,
    acceleration: &AccelWithCovarianceStamped,
    commanded: Gear,
) -> VehicleState {
    let twist = &odometry.twist.twist;
    let speed_mps = twist.linear.x;
    let gear = if speed_mps > ROLLING_MPS {
        Gear::Forward
    } else if speed_mps < -ROLLING_MPS {
        Gear::Reverse
    } else {
        commanded
    };
    VehicleState {
        pose: planar(&odometry.pose.pose),
        z: odometry.pose.pose.position.z,
        curvature: curvature_from_yaw_rate(twist.angular.z, speed_mps),
        speed_mps,
        acceleration_mps2: acceleration.accel.accel.linear.x,
        gear,
        automatic: true,
    }
}

/// Every way that an object may go, each as an obstacle; times from `now`.
pub(super) fn obstacles(objects: &PredictedObjects, now: Time) -> Vec<PredictedObstacle> {
    let age_s = now.seconds() - objects.header.stamp.seconds();
    objects.objects.iter().flat_map(|object| obstacles_of(object, age_s)).collect()
}

fn obstacles_of(object: &PredictedObject, age_s: f64) -> Vec<PredictedObstacle> {
    let (length_m, width_m) = extent(&object.shape);
    let obstacle = |path| PredictedObstacle { length_m, width_m, path };
    let predicted = &object.kinematics.predicted_paths;
    let paths: Vec<_> = predicted
        .iter()
        .filter(|predicted| !predicted.path.is_empty())
        .map(|predicted| obstacle(timed(predicted, age_s)))
        .collect();
    if paths.is_empty() { vec![obstacle(straight_on(object, age_s))] } else { paths }
}

/// Length and width of a box around the middle of the object, m.
fn extent(shape: &Shape) -> (f64, f64) {
    if shape.r#type != Shape::POLYGON {
        return (shape.dimensions.x, shape.dimensions.y);
    }
    let reach = |of: fn(&messages::geometry_msgs::Point32) -> f32| {
        2.0 * shape.footprint.points.iter().map(|point| f64::from(of(point).abs())).fold(0.0, f64::max)
    };
    (reach(|point| point.x), reach(|point| point.y))
}

fn timed(predicted: &PredictedPath, age_s: f64) -> Vec<(f64, PlanarPose)> {
    let step_s = predicted.time_step.seconds();
    let at = |(index, pose): (usize, &Pose)| (index as f64 * step_s - age_s, planar(pose));
    predicted.path.iter().enumerate().map(at).collect()
}

fn straight_on(object: &PredictedObject, age_s: f64) -> Vec<(f64, PlanarPose)> {
    let kinematics = &object.kinematics;
    let here = planar(&kinematics.initial_pose_with_covariance.pose);
    let velocity = kinematics.initial_twist_with_covariance.twist.linear;
    let (sin, cos) = here.yaw.sin_cos();
    let (x, y) = (velocity.x * cos - velocity.y * sin, velocity.x * sin + velocity.y * cos);
    let there = PlanarPose::new(here.x + x * CONSTANT_VELOCITY_S, here.y + y * CONSTANT_VELOCITY_S, here.yaw);
    vec![(-age_s, here), (CONSTANT_VELOCITY_S - age_s, there)]
}

pub(super) fn planar(pose: &Pose) -> PlanarPose {
    let q = pose.orientation;
    let orientation = Quaternion { x: q.x, y: q.y, z: q.z, w: q.w };
    PlanarPose::new(pose.position.x, pose.position.y, orientation.yaw())
}

#[cfg(test)]
mod tests {
    use super::*;
    use messages::builtin_interfaces::Duration;
    use messages::geometry_msgs::{self, Point, Point32, Vector3};

    fn pose(x: f64, y: f64, yaw: f64) -> Pose {
        Pose { position: Point { x, y, z: 0.5 }, orientation: geometry_msgs::Quaternion::from_yaw(yaw) }
    }

    fn driving(speed_mps: f64, yaw_rate_rps: f64) -> VehicleState {
        let mut odometry = Odometry::default();
        odometry.pose.pose = pose(3.0, 4.0, -2.0);
        odometry.twist.twist.linear.x = speed_mps;
        odometry.twist.twist.angular.z = yaw_rate_rps;
        let mut acceleration = AccelWithCovarianceStamped::default();
        acceleration.accel.accel.linear.x = 0.25;
        vehicle_state(&odometry, &acceleration, Gear::Reverse)
    }

    #[test]
    fn the_vehicle_as_measured() {
        let state = driving(2.0, 0.5);
        assert!(state.pose.distance_m(&PlanarPose::new(3.0, 4.0, 0.0)) < 1e-12);
        assert!((state.pose.yaw + 2.0).abs() < 1e-12);
        assert_eq!((state.z, state.speed_mps, state.acceleration_mps2), (0.5, 2.0, 0.25));
        assert_eq!((state.curvature, state.automatic), (0.25, true));
    }

    #[test]
    fn the_gear_is_that_of_the_motion_or_of_the_command() {
        for (speed_mps, gear) in
            [(0.11, Gear::Forward), (0.09, Gear::Reverse), (0.0, Gear::Reverse), (-0.11, Gear::Reverse)]
        {
            assert_eq!(driving(speed_mps, 0.0).gear, gear, "{speed_mps} m/s");
        }
    }

    fn object(paths: Vec<PredictedPath>) -> PredictedObject {
        let mut object = PredictedObject::default();
        object.shape.dimensions = Vector3 { x: 4.0, y: 2.0, z: 1.5 };
        object.kinematics.initial_pose_with_covariance.pose = pose(10.0, 0.0, std::f64::consts::FRAC_PI_2);
        object.kinematics.initial_twist_with_covariance.twist.linear.x = 2.0;
        object.kinematics.predicted_paths = paths;
        object
    }

    fn seen(object: PredictedObject) -> Vec<PredictedObstacle> {
        let mut objects = PredictedObjects { objects: vec![object], ..PredictedObjects::default() };
        objects.header.stamp = Time { sec: 1, nanosec: 0 };
        obstacles(&objects, Time { sec: 1, nanosec: 500_000_000 })
    }

    #[test]
    fn every_predicted_path_is_an_obstacle_timed_from_now() {
        let path = |y: f64| PredictedPath {
            path: vec![pose(10.0, 0.0, 0.0), pose(10.0, y, 0.0)],
            time_step: Duration { sec: 1, nanosec: 0 },
            confidence: 0.5,
        };
        let found = seen(object(vec![path(1.0), path(-1.0), PredictedPath::default()]));
        assert_eq!(found.len(), 2);
        assert_eq!((found[0].length_m, found[0].width_m), (4.0, 2.0));
        let ends: Vec<_> = found.iter().map(|obstacle| (obstacle.path[1].0, obstacle.path[1].1.y)).collect();
        assert_eq!(ends, [(0.5, 1.0), (0.5, -1.0)]);
    }

    #[test]
    fn without_a_path_an_object_goes_straight_on() {
        let found = seen(object(Vec::new()));
        let (time_s, end) = found[0].path[1];
        assert_eq!(time_s, 9.5);
        assert!(end.distance_m(&PlanarPose::new(10.0, 20.0, 0.0)) < 1e-9, "{end:?}");
    }

    #[test]
    fn a_polygon_is_boxed_around_its_middle() {
        let mut polygon = object(Vec::new());
        polygon.shape.r#type = Shape::POLYGON;
        polygon.shape.footprint.points =
            vec![Point32 { x: -1.0, y: 0.25, z: 0.0 }, Point32 { x: 0.5, y: -0.75, z: 0.0 }];
        let found = seen(polygon);
        assert_eq!((found[0].length_m, found[0].width_m), (2.0, 1.5));
    }
}
