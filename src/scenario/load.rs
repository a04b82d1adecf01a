//! Generated load: as many candidates, road users and predicted paths as asked for, the same for the same seed.
//!
//! The ego drives in its lane before a crosswalk and a green light. Its surroundings are made once; each cycle gets them
//! anew with the stamps of that cycle, so that a run of any length needs the memory of one cycle and every cycle costs
//! the same. A third of the candidates keep the lane at different speeds, a third shift sideways within it, the rest
//! stop, swerve over the lane's edge, ignore the rules or race. Three scenes:
//!
//! * `road`: road users along the whole road, on it and beside it,
//! * `intersection`: half of them on a street that crosses behind the light,
//! * `dense`: all of them within 60 m of the ego.

use super::driver::{Driver, Goal, Motion};
use super::map::{self, CROSSING_S_M, LANE_WIDTH_M, ROAD_LENGTH_M};
use super::planners::{Manoeuvre, Planner};
use super::random::Random;
use super::road::{Track, heading, pose_at};
use super::script::Script;
use super::traffic::{Behaviour, PREDICTED_POSES, PREDICTION_STEP_S, RoadUser, predicted_path};
use super::world::{EGO_CRUISING_MPS, World};
use super::{acceleration, header, map_message, odometry, time};
use messages::autoware_internal_planning_msgs::{CandidateTrajectories, CandidateTrajectory};
use messages::autoware_map_msgs::LaneletMapBin;
use messages::autoware_perception_msgs::{
    ObjectClassification, PredictedObject, PredictedObjects, PredictedPath, TrafficLightGroupArray,
};
use messages::autoware_planning_msgs::LaneletRoute;
use messages::builtin_interfaces::Time;
use messages::geometry_msgs::AccelWithCovarianceStamped;
use messages::nav_msgs::Odometry;
use messages::unique_identifier_msgs::Uuid;
use selector_actors::Input;
use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

const USERS_STREAM: u64 = 110;
const MANOEUVRES_STREAM: u64 = 111;
/// Reach of the dense scene around the ego.
const DENSE_REACH_M: f64 = 60.0;
/// Road users keep this distance along the road from the ego's place, where they are in its lane.
const FREE_IN_LANE_M: f64 = 14.0;
/// How an object's predicted paths differ: acceleration of each, m/s²; after the last from the start again.
const PATH_ACCELERATIONS_MPS2: [f64; 5] = [0.0, -1.5, 0.8, -0.6, -3.0];

/// Where the load is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LoadScene {
    /// Along a road.
    Road,
    /// Around an intersection.
    Intersection,
    /// Around the ego.
    Dense,
}

impl LoadScene {
    /// Every scene.
    pub const ALL: [Self; 3] = [Self::Road, Self::Intersection, Self::Dense];

    /// Name as typed.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Road => "road",
            Self::Intersection => "intersection",
            Self::Dense => "dense",
        }
    }
}

/// How much of everything.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Load {
    /// Where.
    pub scene: LoadScene,
    /// Candidates in each anchor, over all generators.
    pub candidates: usize,
    /// Points of each candidate, 0.1 s apart.
    pub points: usize,
    /// Road users.
    pub objects: usize,
    /// Predicted paths of each.
    pub paths: usize,
    /// Generators among which the candidates are dealt out.
    pub generators: usize,
    /// Seed of places, speeds and manoeuvres.
    pub seed: u64,
}

/// The messages of a load, ready to be stamped.
#[derive(Debug)]
pub struct LoadMessages {
    map: Arc<LaneletMapBin>,
    route: Arc<LaneletRoute>,
    odometry: Odometry,
    acceleration: AccelWithCovarianceStamped,
    objects: PredictedObjects,
    signals: TrafficLightGroupArray,
    candidates: CandidateTrajectories,
}

impl Load {
    /// Makes the messages.
    #[must_use]
    pub fn messages(&self) -> LoadMessages {
        let world = World::simulate(Script::without_pedestrian(), Vec::new(), 0.0);
        let ego_s_m = world.ego_at(0).s_m;
        LoadMessages {
            map: Arc::new(map_message(&world.road, self.scene == LoadScene::Intersection)),
            route: Arc::new(map::route(&world.road, header(0))),
            odometry: odometry(&world, 0),
            acceleration: acceleration(&world, 0),
            objects: PredictedObjects {
                header: header(0),
                objects: (0..self.objects).map(|number| self.object(&world, ego_s_m, number)).collect(),
            },
            signals: world.signals(0, time(0)),
            candidates: world.candidates(&self.planners(), &[], 0),
        }
    }

    fn planners(&self) -> Vec<Planner> {
        let generators = self.generators.clamp(1, self.candidates.max(1));
        let planner = |generator: usize| {
            let mut id = *b"load     planner";
            id[5..9].copy_from_slice(&(generator as u32).to_be_bytes());
            let samples = (generator..self.candidates).step_by(generators);
            Planner {
                id: Uuid { uuid: id },
                name: format!("DiffusionPlanner_{generator}"),
                points: self.points,
                manoeuvres: samples.map(|number| self.manoeuvre(number)).collect(),
            }
        };
        (0..generators).map(planner).collect()
    }

    fn manoeuvre(&self, number: usize) -> Manoeuvre {
        let mut random = Random::of(self.seed, MANOEUVRES_STREAM, number as u64);
        let spread = random.around_zero(1.0);
        let keeps = Manoeuvre::keep_lane(EGO_CRUISING_MPS + 3.0 * spread);
        match number % 9 {
            0 => Manoeuvre::keep_lane(EGO_CRUISING_MPS),
            1 | 2 => keeps,
            3..=5 => Manoeuvre { swerve_m: 0.7 * spread, ..keeps },
            6 => Manoeuvre::stop(2.2 + spread),
            7 => Manoeuvre { swerve_m: 5.0 * spread, heeds_rules: false, ..keeps },
            _ => {
                let driver =
                    Driver { goal: Goal::Cruise(14.0), acceleration_mps2: 3.0 + spread, jerk_mps3: 10.0 };
                Manoeuvre { driver, heeds_rules: false, ..keeps }
            }
        }
    }

    fn object(&self, world: &World, ego_s_m: f64, number: usize) -> PredictedObject {
        use ObjectClassification as Label;
        let mut random = Random::of(self.seed, USERS_STREAM, number as u64);
        let place = random.around_zero(1.0);
        let s_m = match self.scene {
            LoadScene::Dense => ego_s_m + DENSE_REACH_M * place,
            _ => ROAD_LENGTH_M * (0.5 + 0.5 * place),
        };
        let crosses = self.scene == LoadScene::Intersection && number.is_multiple_of(2);
        let speed_mps = 8.0 + random.around_zero(3.0);
        let lane_m = LANE_WIDTH_M / 2.0;
        let (label, size_m, mut track, speed_mps) = match number % 5 {
            0 => (Label::CAR, [4.5, 1.8, 1.5], Track::oncoming(lane_m), speed_mps),
            1 => (Label::CAR, [4.7, 1.9, 1.7], Track::forward(-lane_m), speed_mps),
            2 => (Label::BICYCLE, [1.8, 0.6, 1.7], Track::oncoming(LANE_WIDTH_M - 0.6), 4.5),
            3 => (Label::TRUCK, [8.0, 2.5, 3.2], Track::forward(-LANE_WIDTH_M - 1.8), 0.0),
            _ => (Label::PEDESTRIAN, [0.6, 0.6, 1.75], Track::oncoming(LANE_WIDTH_M + 1.5), 1.3),
        };
        // Nobody stands where the ego is.
        if track.offset_m == -lane_m && (s_m - ego_s_m).abs() < FREE_IN_LANE_M {
            track = Track::oncoming(lane_m);
        }
        let user = RoadUser::new(number as u32, label, size_m, track, s_m, Behaviour::Parked);
        let motion = Motion { s_m, speed_mps, acceleration_mps2: 0.0 };
        let count = self.paths.max(1);
        let accelerations = PATH_ACCELERATIONS_MPS2.into_iter().cycle().take(count);
        let paths: Vec<PredictedPath> = accelerations
            .enumerate()
            .map(|(index, acceleration_mps2)| {
                // The likeliest first; they add up to less than 1.
                let confidence = 0.5_f32.powi(i32::try_from(index + 1).unwrap_or(i32::MAX)).max(0.01);
                if crosses {
                    crossing_path(world, 30.0 * place, speed_mps, acceleration_mps2, confidence)
                } else {
                    world.driven_path(&track, &motion, acceleration_mps2, confidence)
                }
            })
            .collect();
        let mut object = user.perceived(speed_mps, 0.0, paths, [0.0; 2]);
        if self.paths == 0 {
            object.kinematics.predicted_paths.clear();
        }
        object
    }
}

/// Along the crossing street, from the right to the left of the road; begins `before_m` before its middle.
fn crossing_path(
    world: &World,
    before_m: f64,
    mut speed_mps: f64,
    acceleration_mps2: f64,
    confidence: f32,
) -> PredictedPath {
    let yaw_rad = heading(CROSSING_S_M) + FRAC_PI_2;
    let mut offset_m = before_m - 10.0;
    let poses = (0..PREDICTED_POSES).map(|_| {
        let pose = pose_at(world.road.position(CROSSING_S_M + LANE_WIDTH_M / 2.0, offset_m), yaw_rad);
        let next_mps = (speed_mps + acceleration_mps2 * PREDICTION_STEP_S).max(0.0);
        offset_m += 0.5 * (speed_mps + next_mps) * PREDICTION_STEP_S;
        speed_mps = next_mps;
        pose
    });
    predicted_path(poses.collect(), confidence)
}

impl LoadMessages {
    /// When a run on this load begins.
    #[must_use]
    pub fn start() -> Time {
        time(0)
    }

    /// What a node needs once.
    #[must_use]
    pub fn once(&self) -> [Input; 2] {
        [Input::Map(self.map.clone()), Input::Route(self.route.clone())]
    }

    /// What the sensors say at a time.
    #[must_use]
    pub fn sensors(&self, now: Time) -> [Input; 4] {
        let mut odometry = self.odometry.clone();
        let mut acceleration = self.acceleration.clone();
        let mut objects = self.objects.clone();
        let mut signals = self.signals.clone();
        odometry.header.stamp = now;
        acceleration.header.stamp = now;
        objects.header.stamp = now;
        signals.stamp = now;
        [
            Input::Odometry(Arc::new(odometry)),
            Input::Acceleration(Arc::new(acceleration)),
            Input::Objects(Arc::new(objects)),
            Input::TrafficSignals(Arc::new(signals)),
        ]
    }

    /// The anchor at a time: the first `count` of the candidates, or all if there are fewer.
    #[must_use]
    pub fn anchor(&self, now: Time, count: usize) -> Input {
        let stamped = |candidate: &Arc<CandidateTrajectory>| {
            let mut candidate = CandidateTrajectory::clone(candidate);
            candidate.header.stamp = now;
            candidate.turn_indicators_command.stamp = now;
            Arc::new(candidate)
        };
        Input::Generative(Arc::new(CandidateTrajectories {
            candidate_trajectories: self
                .candidates
                .candidate_trajectories
                .iter()
                .take(count)
                .map(stamped)
                .collect(),
            generator_info: self.candidates.generator_info.clone(),
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn load() -> Load {
        Load {
            scene: LoadScene::Road,
            candidates: 20,
            points: 30,
            objects: 11,
            paths: 3,
            generators: 3,
            seed: 1,
        }
    }

    #[test]
    fn there_is_as_much_of_everything_as_asked_for() {
        for scene in LoadScene::ALL {
            let messages = Load { scene, ..load() }.messages();
            let candidates = &messages.candidates.candidate_trajectories;
            assert_eq!((candidates.len(), messages.candidates.generator_info.len()), (20, 3));
            assert!(candidates.iter().all(|candidate| candidate.points.len() == 30));
            assert_eq!(messages.objects.objects.len(), 11);
            for object in &messages.objects.objects {
                assert_eq!(object.kinematics.predicted_paths.len(), 3);
            }
        }
    }

    #[test]
    fn no_paths_and_one_candidate_are_a_load_too() {
        let messages = Load { paths: 0, candidates: 1, generators: 9, ..load() }.messages();
        assert_eq!(messages.candidates.candidate_trajectories.len(), 1);
        assert_eq!(messages.candidates.generator_info.len(), 1);
        assert!(messages.objects.objects.iter().all(|object| object.kinematics.predicted_paths.is_empty()));
    }

    #[test]
    fn the_anchor_is_stamped_and_cut() {
        let messages = load().messages();
        let now = Time { sec: 7, nanosec: 5 };
        let Input::Generative(anchor) = messages.anchor(now, 4) else { panic!("an anchor is generative") };
        assert_eq!(anchor.candidate_trajectories.len(), 4);
        assert!(anchor.candidate_trajectories.iter().all(|candidate| candidate.header.stamp == now));
    }

    #[test]
    fn ids_of_objects_and_generators_differ() {
        let messages = Load { objects: 700, candidates: 300, generators: 300, ..load() }.messages();
        let objects: std::collections::BTreeSet<_> =
            messages.objects.objects.iter().map(|object| object.object_id.uuid).collect();
        let generators: std::collections::BTreeSet<_> =
            messages.candidates.generator_info.iter().map(|info| info.generator_id.uuid).collect();
        assert_eq!((objects.len(), generators.len()), (700, 300));
    }

    #[test]
    fn dense_is_near_the_ego() {
        let messages = Load { scene: LoadScene::Dense, objects: 40, ..load() }.messages();
        let ego = messages.odometry.pose.pose.position;
        for object in &messages.objects.objects {
            let at = object.kinematics.initial_pose_with_covariance.pose.position;
            assert!((at.x - ego.x).hypot(at.y - ego.y) < DENSE_REACH_M + 12.0);
        }
    }
}
