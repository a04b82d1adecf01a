//! The other road users and the traffic light, as perception reports them.

use super::driver::Motion;
use super::map::{CROSSWALK_S_M, LANE_WIDTH_M, LIGHT_RULE, ROAD_LENGTH_M};
use super::random::Random;
use super::road::{Road, Shift, Track, heading, pose_at};
use super::script::WALKING_MPS;
use super::world::World;
use messages::autoware_perception_msgs::{
    ObjectClassification, PredictedObject, PredictedObjectKinematics, PredictedObjects, PredictedPath, Shape,
    TrafficLightElement, TrafficLightGroup, TrafficLightGroupArray,
};
use messages::builtin_interfaces::{Duration, Time};
use messages::geometry_msgs::{Pose, Vector3};
use messages::std_msgs::Header;
use messages::unique_identifier_msgs::Uuid;
use std::f64::consts::FRAC_PI_2;

/// Poses of a predicted path.
pub(crate) const PREDICTED_POSES: usize = 17;
/// Time between two of them.
pub(crate) const PREDICTION_STEP_S: f64 = 0.5;
const PREDICTION_STEP_NS: i64 = 500_000_000;
/// Positions are wrong by up to this.
const POSITION_NOISE_M: f64 = 0.03;
/// Speeds are wrong by up to this share.
const SPEED_NOISE: f64 = 0.02;
/// Variances that are reported with the objects.
const POSITION_VARIANCE: f64 = 0.01;
const SPEED_VARIANCE: f64 = 0.04;

/// What a road user does.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Behaviour {
    /// Drives on its track.
    Drives {
        /// Speed that the driver wants.
        cruising_mps: f64,
    },
    /// Stands for the whole drive.
    Parked,
    /// Crosses at the crosswalk, as the script says.
    Crosses,
}

/// A road user.
#[derive(Debug, Clone)]
pub(crate) struct RoadUser {
    /// Number that makes the object id.
    pub(crate) number: u32,
    /// One of the constants of `ObjectClassification`.
    pub(crate) label: u8,
    /// Extent along the direction of travel; the diameter of a pedestrian.
    pub(crate) length_m: f64,
    /// Extent across it.
    pub(crate) width_m: f64,
    /// Extent upwards.
    pub(crate) height_m: f64,
    /// Line that it moves on.
    pub(crate) track: Track,
    /// Its motion at the start; the place is that of the middle of its box.
    pub(crate) start: Motion,
    /// What it does.
    pub(crate) behaviour: Behaviour,
}

impl RoadUser {
    pub(crate) fn new(
        number: u32,
        label: u8,
        size_m: [f64; 3],
        track: Track,
        s_m: f64,
        behaviour: Behaviour,
    ) -> Self {
        let [length_m, width_m, height_m] = size_m;
        let speed_mps = if let Behaviour::Drives { cruising_mps } = behaviour { cruising_mps } else { 0.0 };
        let start = Motion { s_m, speed_mps, acceleration_mps2: 0.0 };
        Self { number, label, length_m, width_m, height_m, track, start, behaviour }
    }

    fn id(&self) -> Uuid {
        let mut uuid = *b"road user   \0\0\0\0";
        uuid[12..].copy_from_slice(&self.number.to_be_bytes());
        Uuid { uuid }
    }

    /// This road user as perception reports it: where its first predicted path begins, off by `noise_m`.
    pub(crate) fn perceived(
        &self,
        speed_mps: f64,
        yaw_rate_rps: f64,
        mut paths: Vec<PredictedPath>,
        noise_m: [f64; 2],
    ) -> PredictedObject {
        for pose in paths.iter_mut().flat_map(|path| &mut path.path) {
            pose.position.x += noise_m[0];
            pose.position.y += noise_m[1];
            pose.position.z += self.height_m / 2.0;
        }
        let mut kinematics = PredictedObjectKinematics::default();
        kinematics.initial_pose_with_covariance.pose = paths[0].path[0];
        kinematics.initial_pose_with_covariance.covariance = diagonal(POSITION_VARIANCE);
        kinematics.initial_twist_with_covariance.twist.linear.x = speed_mps;
        kinematics.initial_twist_with_covariance.twist.angular.z = yaw_rate_rps;
        kinematics.initial_twist_with_covariance.covariance = diagonal(SPEED_VARIANCE);
        kinematics.predicted_paths = paths;
        PredictedObject {
            object_id: self.id(),
            existence_probability: 0.95,
            classification: vec![
                ObjectClassification { label: self.label, probability: 0.9 },
                ObjectClassification { label: ObjectClassification::UNKNOWN, probability: 0.1 },
            ],
            kinematics,
            shape: Shape {
                r#type: match self.label {
                    ObjectClassification::PEDESTRIAN => Shape::CYLINDER,
                    _ => Shape::BOUNDING_BOX,
                },
                dimensions: Vector3 { x: self.length_m, y: self.width_m, z: self.height_m },
                ..Shape::default()
            },
        }
    }
}

/// The traffic of the road drive: a car ahead, three oncoming cars, a cyclist, a parked truck, a pedestrian.
pub(crate) fn road_users(random: &mut Random) -> Vec<RoadUser> {
    use ObjectClassification as Label;
    const CAR_M: [f64; 3] = [4.5, 1.8, 1.5];
    let lane_m = LANE_WIDTH_M / 2.0;
    let mut drives = |number, label, size_m, track, s_m: f64, speed_mps: f64| {
        let cruising_mps = speed_mps + random.around_zero(0.3);
        let s_m = s_m + random.around_zero(1.0);
        RoadUser::new(number, label, size_m, track, s_m, Behaviour::Drives { cruising_mps })
    };
    let (ahead, oncoming) = (Track::forward(-lane_m), Track::oncoming(lane_m));
    vec![
        drives(1, Label::CAR, CAR_M, ahead, 98.0, 9.5),
        drives(2, Label::CAR, CAR_M, oncoming, 118.0, 9.0),
        drives(3, Label::CAR, CAR_M, oncoming, 190.0, 9.0),
        drives(4, Label::CAR, [4.9, 1.9, 1.8], oncoming, 260.0, 10.0),
        drives(5, Label::BICYCLE, [1.8, 0.6, 1.7], Track::oncoming(LANE_WIDTH_M - 0.6), 300.0, 5.0),
        RoadUser::new(
            6,
            Label::TRUCK,
            [8.0, 2.5, 3.2],
            Track::forward(-LANE_WIDTH_M - 1.6),
            160.0,
            Behaviour::Parked,
        ),
        RoadUser::new(
            7,
            Label::PEDESTRIAN,
            [0.6, 0.6, 1.75],
            Track::forward(0.0),
            CROSSWALK_S_M,
            Behaviour::Crosses,
        ),
    ]
}

impl World {
    /// The road users on the road at a time from the start.
    pub(crate) fn objects(&self, t_ns: i64, header: Header, random: &mut Random) -> PredictedObjects {
        let objects = (0..self.users.len()).filter_map(|user| self.object(user, t_ns, random)).collect();
        PredictedObjects { header, objects }
    }

    fn object(&self, user: usize, t_ns: i64, random: &mut Random) -> Option<PredictedObject> {
        let (it, motion) = (&self.users[user], self.user_at(user, t_ns));
        let noise_m = [(); 2].map(|()| random.around_zero(POSITION_NOISE_M));
        let speed_noise = 1.0 + random.around_zero(SPEED_NOISE);
        if !(0.0..=ROAD_LENGTH_M).contains(&motion.s_m) {
            return None;
        }
        let (speed_mps, paths) = match it.behaviour {
            Behaviour::Drives { .. } => (motion.speed_mps, self.driving_paths(it, &motion)),
            Behaviour::Parked => (0.0, vec![self.driven_path(&it.track, &motion, 0.0, 1.0)]),
            Behaviour::Crosses => self.walking_paths(t_ns),
        };
        let yaw_rate_rps = speed_mps * Road::track_curvature(&it.track, motion.s_m);
        let mut object = it.perceived(speed_mps * speed_noise, yaw_rate_rps, paths, noise_m);
        object.kinematics.initial_acceleration_with_covariance.accel.linear.x = motion.acceleration_mps2;
        Some(object)
    }

    /// Goes on, brakes, or (cars ahead) makes room to the right.
    fn driving_paths(&self, user: &RoadUser, motion: &Motion) -> Vec<PredictedPath> {
        let mut paths = vec![
            self.driven_path(&user.track, motion, 0.0, 0.7),
            self.driven_path(&user.track, motion, -1.5, 0.2),
        ];
        if !user.track.oncoming {
            let shift = Shift { from_s_m: motion.s_m, length_m: 30.0, by_m: -0.6 };
            paths.push(self.driven_path(&Track { shift: Some(shift), ..user.track }, motion, 0.0, 0.1));
        }
        paths
    }

    /// Along a track with a constant acceleration until it stands.
    pub(crate) fn driven_path(
        &self,
        track: &Track,
        motion: &Motion,
        acceleration_mps2: f64,
        confidence: f32,
    ) -> PredictedPath {
        let (mut s_m, mut speed_mps) = (motion.s_m, motion.speed_mps);
        let poses = (0..PREDICTED_POSES).map(|_| {
            let pose = self.road.pose(track, s_m);
            let next_mps = (speed_mps + acceleration_mps2 * PREDICTION_STEP_S).max(0.0);
            s_m = Road::advance(track, s_m, 0.5 * (speed_mps + next_mps) * PREDICTION_STEP_S);
            speed_mps = next_mps;
            pose
        });
        predicted_path(poses.collect(), confidence)
    }

    /// Speed of the pedestrian and the two paths: across the road, and not at all or no further.
    fn walking_paths(&self, t_ns: i64) -> (f64, Vec<PredictedPath>) {
        let (offset_m, speed_mps) = self.script.pedestrian(t_ns);
        let yaw_rad = heading(CROSSWALK_S_M) + FRAC_PI_2;
        let path = |walking_mps: f64, confidence| {
            let pose = |index: usize| {
                let walked_m = walking_mps * PREDICTION_STEP_S * index as f64;
                pose_at(self.road.position(CROSSWALK_S_M, offset_m + walked_m), yaw_rad)
            };
            predicted_path((0..PREDICTED_POSES).map(pose).collect(), confidence)
        };
        (speed_mps, vec![path(WALKING_MPS, 0.7), path(0.0, 0.3)])
    }

    /// The traffic light at a time from the start.
    pub(crate) fn signals(&self, t_ns: i64, stamp: Time) -> TrafficLightGroupArray {
        let lamp = TrafficLightElement {
            color: self.script.light(t_ns),
            shape: TrafficLightElement::CIRCLE,
            status: TrafficLightElement::SOLID_ON,
            confidence: 0.95,
        };
        let group = TrafficLightGroup {
            traffic_light_group_id: LIGHT_RULE,
            elements: vec![lamp],
            predictions: Vec::new(),
        };
        TrafficLightGroupArray { stamp, traffic_light_groups: vec![group] }
    }
}

/// A path of poses [`PREDICTION_STEP_S`] apart.
pub(crate) fn predicted_path(path: Vec<Pose>, confidence: f32) -> PredictedPath {
    PredictedPath { path, time_step: Duration::from_nanoseconds(PREDICTION_STEP_NS), confidence }
}

/// A covariance of six independent values of one variance.
pub(crate) fn diagonal(variance: f64) -> [f64; 36] {
    let mut covariance = [0.0; 36];
    covariance.iter_mut().step_by(7).for_each(|entry| *entry = variance);
    covariance
}
