//! Generated drives: typed inputs as a vehicle would receive them, the same for the same seed, without any clock.
//!
//! The drive `road` lasts 20 s. The ego follows its lane on a gently curving two-way road (right-hand traffic), stops
//! for a pedestrian at a crosswalk and at a red light, and drives on. There are a car ahead, three oncoming cars, a
//! cyclist, and a truck parked beside the road. By stamp, in seconds from the start:
//!
//! | t | event |
//! |---|---|
//! | 0 | map and route, stamped 12 s and 2 s before; odometry, acceleration, objects and signals begin; light green |
//! | 0.1 | candidates begin |
//! | 0.8 | the pedestrian is near the crosswalk: from now on drivers yield; stands at the kerb from about 1.6 |
//! | 3.0-3.2 | sample 2 is stale: stamped 0.35 s before its message |
//! | 4.2 ± 0.2 | the pedestrian steps on the road |
//! | 4.9-5.5 | planner hiccup: no generative message stamped strictly between (0.6 s) |
//! | about 6.2 | the ego stands at the crosswalk |
//! | 6.5-6.7 | sample 1 has a speed that is not a number |
//! | about 7.9 | the pedestrian has left the ego's lane, the ego drives on |
//! | 10.5 | light amber |
//! | 12.0-12.2 | sample 2 has one point only |
//! | 13.5 | light red |
//! | 14.0-14.2 | the times of sample 3 go back |
//! | about 15.7 | the ego stands at the light |
//! | 17.0 | light green, the ego drives on |
//!
//! `DiffusionPlanner_0` proposes eight samples: 0 keeps the lane, 1 slower, 2 faster; 3 stops comfortably wherever that
//! ends; 4 swerves left across the oncoming lane and the border, 5 swerves right over the border; 6 ignores
//! pedestrian and light; 7 accelerates beyond the limits. 0 to 2 heed pedestrian, light and the vehicle ahead, 6 only
//! the vehicle, the others nothing. `MinimumRuleBasedPlanner_Go` is a slower sample 0, `MinimumRuleBasedPlanner_Stop`
//! a harder sample 3. Every candidate begins at the ego's state of its stamp.
//!
//! Received minus stamp: odometry and acceleration 3 ms, objects 60 ± 10 ms, signals and candidates 40 ± 10 ms by seed.
//! Stamps count from 1 800 000 000 s.
//!
//! A drive is a world (road, script, road users: all simulated once) and planners (manoeuvres, number of points); its messages are made one at a time while it is walked through.

mod driver;
pub mod load;
mod map;
mod planners;
pub(crate) mod random;
mod road;
mod script;
mod traffic;
mod world;

use crate::drive::TimedInput;
use messages::autoware_map_msgs::LaneletMapBin;
use messages::autoware_planning_msgs::LaneletRoute;
use messages::builtin_interfaces::Time;
use messages::geometry_msgs::AccelWithCovarianceStamped;
use messages::nav_msgs::Odometry;
use messages::std_msgs::Header;
use planners::{FaultPeriod, Planner};
use random::Random;
use road::Road;
use script::Script;
use selector_actors::{Input, InputTopic};
use std::sync::Arc;
use world::{World, ego_track};

/// Start of every drive.
const EPOCH_NS: i64 = 1_800_000_000 * SECOND_NS;
const SECOND_NS: i64 = 1_000_000_000;
const MILLISECOND_NS: i64 = 1_000_000;
/// No generative message is stamped strictly between these.
const HICCUP_NS: [i64; 2] = [4_900 * MILLISECOND_NS, 5_500 * MILLISECOND_NS];

// Streams of random numbers; those of a topic's delays have the topic's own number.
const SCRIPT_STREAM: u64 = 100;
const TRAFFIC_STREAM: u64 = 101;
const NOISE_STREAM: u64 = 102;

/// When the messages of a topic are made and how long they take to arrive.
#[derive(Debug, Clone, Copy)]
struct Cadence {
    topic: InputTopic,
    first_ns: i64,
    period_ns: i64,
    delay_ns: i64,
    jitter_ns: i64,
}

impl Cadence {
    const fn new(topic: InputTopic, first_ms: i64, period_ms: i64, delay_ms: i64, jitter_ms: i64) -> Self {
        Self {
            topic,
            first_ns: first_ms * MILLISECOND_NS,
            period_ns: period_ms * MILLISECOND_NS,
            delay_ns: delay_ms * MILLISECOND_NS,
            jitter_ns: jitter_ms * MILLISECOND_NS,
        }
    }
}

/// Jitter is less than half a period, so that messages of a topic never overtake each other.
const CADENCES: [Cadence; 6] = [
    Cadence::new(InputTopic::Odometry, 0, 20, 3, 0),
    Cadence::new(InputTopic::Acceleration, 0, 20, 3, 0),
    Cadence::new(InputTopic::Objects, 0, 100, 60, 10),
    Cadence::new(InputTopic::TrafficSignals, 0, 100, 40, 10),
    Cadence::new(InputTopic::Generative, 100, 100, 40, 10),
    Cadence::new(InputTopic::Backup, 150, 100, 40, 10),
];

/// A message to be made: both times in nanoseconds from the start.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Planned {
    received_ns: i64,
    topic: InputTopic,
    stamp_ns: i64,
}

/// A generated drive.
#[derive(Debug)]
pub struct Scenario {
    name: &'static str,
    seed: u64,
    duration_ns: i64,
    world: World,
    map: Arc<LaneletMapBin>,
    route: Arc<LaneletRoute>,
    generative: Vec<Planner>,
    backup: Vec<Planner>,
    faults: &'static [FaultPeriod],
}

impl Scenario {
    /// The drive `road`, see the module. The seed varies other road users, the pedestrian, noise and delays.
    #[must_use]
    pub fn road(seed: u64) -> Self {
        let duration_ns = 20 * SECOND_NS;
        let script = Script::new(Random::of(seed, SCRIPT_STREAM, 0).around_zero(0.2));
        let users = traffic::road_users(&mut Random::of(seed, TRAFFIC_STREAM, 0));
        let world = World::simulate(script, users, seconds(duration_ns));
        Self {
            name: "road",
            seed,
            duration_ns,
            map: Arc::new(map_message(&world.road, false)),
            route: Arc::new(map::route(&world.road, header(-2 * SECOND_NS))),
            world,
            generative: planners::generative(),
            backup: planners::backup(),
            faults: planners::FAULTS,
        }
    }

    /// Name of the drive.
    #[must_use]
    pub fn name(&self) -> &str {
        self.name
    }

    /// When the drive begins and ends; every message is received before its end.
    #[must_use]
    pub fn span(&self) -> (Time, Time) {
        (time(0), time(self.duration_ns))
    }

    /// The messages in the order in which they are received.
    pub fn drive(&self) -> impl Iterator<Item = TimedInput> {
        self.schedule().into_iter().map(|planned| TimedInput {
            time: time(planned.received_ns),
            topic: planned.topic,
            input: self.message(planned),
        })
    }

    fn schedule(&self) -> Vec<Planned> {
        let mut schedule: Vec<_> = [InputTopic::Map, InputTopic::Route]
            .into_iter()
            .map(|topic| Planned { received_ns: 0, topic, stamp_ns: 0 })
            .chain(CADENCES.into_iter().flat_map(|cadence| self.periodic(cadence)))
            .filter(|planned| planned.received_ns < self.duration_ns)
            .collect();
        schedule.sort_unstable();
        schedule
    }

    fn periodic(&self, cadence: Cadence) -> impl Iterator<Item = Planned> {
        let Cadence { topic, first_ns, period_ns, delay_ns, jitter_ns } = cadence;
        let is_sent = move |stamp_ns: &i64| {
            topic != InputTopic::Generative || *stamp_ns <= HICCUP_NS[0] || *stamp_ns >= HICCUP_NS[1]
        };
        (first_ns..self.duration_ns).step_by(period_ns as usize).filter(is_sent).map(move |stamp_ns| {
            let mut random = Random::of(self.seed, topic as u64, stamp_ns as u64);
            let jitter_ns = random.around_zero(jitter_ns as f64) as i64;
            Planned { received_ns: stamp_ns + delay_ns + jitter_ns, topic, stamp_ns }
        })
    }

    fn message(&self, Planned { topic, stamp_ns, .. }: Planned) -> Input {
        match topic {
            InputTopic::Map => Input::Map(self.map.clone()),
            InputTopic::Route => Input::Route(self.route.clone()),
            InputTopic::Odometry => Input::Odometry(Arc::new(odometry(&self.world, stamp_ns))),
            InputTopic::Acceleration => Input::Acceleration(Arc::new(acceleration(&self.world, stamp_ns))),
            InputTopic::Objects => {
                let mut random = Random::of(self.seed, NOISE_STREAM, stamp_ns as u64);
                Input::Objects(Arc::new(self.world.objects(stamp_ns, header(stamp_ns), &mut random)))
            }
            InputTopic::TrafficSignals => {
                Input::TrafficSignals(Arc::new(self.world.signals(stamp_ns, time(stamp_ns))))
            }
            InputTopic::Generative => {
                Input::Generative(Arc::new(self.world.candidates(&self.generative, self.faults, stamp_ns)))
            }
            InputTopic::Backup => Input::Backup(Arc::new(self.world.candidates(&self.backup, &[], stamp_ns))),
            // Scheduled in no scene: nobody parks.
            InputTopic::GoalPose => Input::GoalPose(Arc::default()),
            InputTopic::OccupancyGrid => Input::OccupancyGrid(Arc::default()),
        }
    }
}

/// Pose and velocity of the ego at a time from the start.
fn odometry(world: &World, stamp_ns: i64) -> Odometry {
    let ego = world.ego_at(stamp_ns);
    let mut odometry =
        Odometry { header: header(stamp_ns), child_frame_id: "base_link".to_owned(), ..Odometry::default() };
    odometry.pose.pose = world.road.pose(&ego_track(), ego.s_m);
    odometry.pose.covariance = traffic::diagonal(1e-4);
    odometry.twist.twist.linear.x = ego.speed_mps;
    odometry.twist.twist.angular.z = ego.speed_mps * Road::track_curvature(&ego_track(), ego.s_m);
    odometry.twist.covariance = traffic::diagonal(1e-4);
    odometry
}

/// Acceleration of the ego at a time from the start.
fn acceleration(world: &World, stamp_ns: i64) -> AccelWithCovarianceStamped {
    let mut acceleration = AccelWithCovarianceStamped {
        header: Header { stamp: time(stamp_ns), frame_id: "base_link".to_owned() },
        ..AccelWithCovarianceStamped::default()
    };
    acceleration.accel.accel.linear.x = world.ego_at(stamp_ns).acceleration_mps2;
    acceleration.accel.covariance = traffic::diagonal(1e-4);
    acceleration
}

fn map_message(road: &Road, with_crossing: bool) -> LaneletMapBin {
    // Cannot fail: the elements are fixed, and the tests build the very same map.
    let map =
        map::build(road, with_crossing).expect("the generated map has unique ids and names only what it has");
    LaneletMapBin {
        header: header(-12 * SECOND_NS),
        version_map_format: String::new(),
        version_map: String::new(),
        name_map: "generated road".to_owned(),
        data: lanelet_map::archive::encode(&map),
    }
}

/// A time from the start as a stamp.
fn time(ns: i64) -> Time {
    Time::from_nanoseconds(EPOCH_NS + ns)
}

/// A header in frame `map`.
fn header(ns: i64) -> Header {
    Header { stamp: time(ns), frame_id: "map".to_owned() }
}

fn seconds(ns: i64) -> f64 {
    ns as f64 / SECOND_NS as f64
}

#[cfg(test)]
mod tests;
