//! The drive as it happens: the ego and the road users on the road, simulated once in steps of 10 ms.

use super::driver::{Ahead, Driver, Motion};
use super::map::{CROSSWALK_STOP_LINE_S_M, LANE_WIDTH_M, LIGHT_STOP_LINE_S_M, ONCOMING_STOP_LINE_S_M};
use super::road::{Road, Track};
use super::script::Script;
use super::traffic::{Behaviour, RoadUser};
use messages::autoware_perception_msgs::TrafficLightElement;
use motion::VehicleInfo;

/// Length of a simulation step.
pub(crate) const STEP_NS: i64 = 10_000_000;
/// Same in seconds.
pub(crate) const STEP_S: f64 = 0.01;
/// Speed that the ego wants to drive.
pub(crate) const EGO_CRUISING_MPS: f64 = 9.0;
/// The ego's rear axle at the start, and its speed.
const EGO_START: Motion = Motion { s_m: 64.0, speed_mps: 8.0, acceleration_mps2: 0.0 };
/// How far before a line drivers aim to stand, beyond the gap that they keep anyway.
const LINE_MARGIN_M: f64 = 0.3;
/// Tracks nearer to each other than this share a lane.
const SAME_LANE_M: f64 = 1.5;
/// Where the pedestrian no longer bothers the forward lane, and the oncoming lane.
const CLEAR_OFFSETS_M: [f64; 2] = [0.3, LANE_WIDTH_M + 0.2];

/// The simulated drive.
#[derive(Debug)]
pub(crate) struct World {
    /// The road.
    pub(crate) road: Road,
    /// What happens when.
    pub(crate) script: Script,
    /// The own vehicle's dimensions.
    pub(crate) vehicle: VehicleInfo,
    /// Other road users.
    pub(crate) users: Vec<RoadUser>,
    ego: Vec<Motion>,
    /// For each road user, one motion for each step.
    histories: Vec<Vec<Motion>>,
}

/// The ego's lane.
pub(crate) fn ego_track() -> Track {
    Track::forward(-LANE_WIDTH_M / 2.0)
}

impl World {
    /// Simulates `duration_s`.
    pub(crate) fn simulate(script: Script, users: Vec<RoadUser>, duration_s: f64) -> Self {
        let mut world = Self {
            road: Road::new(),
            script,
            vehicle: VehicleInfo::default(),
            ego: vec![EGO_START],
            histories: users.iter().map(|user| vec![user.start]).collect(),
            users,
        };
        for step in 0..(duration_s / STEP_S).round() as i64 {
            world.advance(step * STEP_NS);
        }
        world
    }

    fn advance(&mut self, t_ns: i64) {
        let ego = self.ego_at(t_ns);
        let mut ahead = self.lines_ahead_of_ego(&ego, t_ns);
        ahead.extend(self.vehicle_ahead_of_ego(&ego, t_ns));
        let next = drive(&Driver::cruising(EGO_CRUISING_MPS), &ego_track(), &ego, &ahead);
        let users: Vec<Motion> = (0..self.users.len()).map(|user| self.next_motion(user, t_ns)).collect();
        self.ego.push(next);
        for (history, motion) in self.histories.iter_mut().zip(users) {
            history.push(motion);
        }
    }

    fn next_motion(&self, user: usize, t_ns: i64) -> Motion {
        let (it, motion) = (&self.users[user], self.user_at(user, t_ns));
        let Behaviour::Drives { cruising_mps } = it.behaviour else { return motion };
        let mut ahead = self.lines_ahead(it, &motion, t_ns);
        let direction = it.track.direction();
        ahead.extend(self.nearest_ahead(&it.track, motion.s_m + direction * it.length_m / 2.0, t_ns));
        drive(&Driver::cruising(cruising_mps), &it.track, &motion, &ahead)
    }

    /// Lines that a road user has to stop at.
    fn lines_ahead(&self, user: &RoadUser, motion: &Motion, t_ns: i64) -> Vec<Ahead> {
        let half_m = user.length_m / 2.0;
        if user.track.oncoming {
            let yields = self.script.must_yield(t_ns, CLEAR_OFFSETS_M[1]);
            line(yields, motion.s_m - half_m - ONCOMING_STOP_LINE_S_M).into_iter().collect()
        } else {
            self.forward_lines(motion.s_m + half_m, t_ns)
        }
    }

    /// Lines that the ego has to stop at, as things are at a time from the start.
    pub(crate) fn lines_ahead_of_ego(&self, ego: &Motion, t_ns: i64) -> Vec<Ahead> {
        self.forward_lines(ego.s_m + self.vehicle.max_longitudinal_offset_m(), t_ns)
    }

    fn forward_lines(&self, front_s_m: f64, t_ns: i64) -> Vec<Ahead> {
        let yields = self.script.must_yield(t_ns, CLEAR_OFFSETS_M[0]);
        let red = self.script.light(t_ns) != TrafficLightElement::GREEN;
        [(yields, CROSSWALK_STOP_LINE_S_M), (red, LIGHT_STOP_LINE_S_M)]
            .into_iter()
            .filter_map(|(active, line_s_m)| line(active, line_s_m - front_s_m))
            .collect()
    }

    /// The vehicle that the ego follows at a time from the start.
    pub(crate) fn vehicle_ahead_of_ego(&self, ego: &Motion, t_ns: i64) -> Option<Ahead> {
        self.nearest_ahead(&ego_track(), ego.s_m + self.vehicle.max_longitudinal_offset_m(), t_ns)
    }

    fn nearest_ahead(&self, track: &Track, front_s_m: f64, t_ns: i64) -> Option<Ahead> {
        let shares_lane = |user: &RoadUser| {
            user.track.oncoming == track.oncoming
                && (user.track.offset_m - track.offset_m).abs() < SAME_LANE_M
                && matches!(user.behaviour, Behaviour::Drives { .. })
        };
        self.users
            .iter()
            .enumerate()
            .filter(|(_, user)| shares_lane(user))
            .map(|(index, user)| {
                let motion = self.user_at(index, t_ns);
                let gap_m = track.direction() * (motion.s_m - front_s_m) - user.length_m / 2.0;
                Ahead { gap_m, speed_mps: motion.speed_mps, is_line: false }
            })
            // A road user's own middle lies behind its front.
            .filter(|thing| thing.gap_m > 0.0)
            .min_by(|a, b| a.gap_m.total_cmp(&b.gap_m))
    }

    /// Motion of the ego at a time from the start.
    pub(crate) fn ego_at(&self, t_ns: i64) -> Motion {
        at(&self.ego, t_ns)
    }

    /// Motion of a road user at a time from the start.
    pub(crate) fn user_at(&self, user: usize, t_ns: i64) -> Motion {
        at(&self.histories[user], t_ns)
    }
}

/// The newest motion at a time from the start; the first one before it.
fn at(history: &[Motion], t_ns: i64) -> Motion {
    let step = usize::try_from(t_ns / STEP_NS).unwrap_or(0);
    history[step.min(history.len() - 1)]
}

/// A stop line at a distance from the front bumper; none once the bumper has passed it.
fn line(active: bool, distance_m: f64) -> Option<Ahead> {
    (active && distance_m > 0.0).then_some(Ahead {
        gap_m: distance_m - LINE_MARGIN_M,
        speed_mps: 0.0,
        is_line: true,
    })
}

/// One simulation step of a driver on a track.
pub(crate) fn drive(driver: &Driver, track: &Track, motion: &Motion, ahead: &[Ahead]) -> Motion {
    let (speed_mps, acceleration_mps2, distance_m) = driver.step(motion, ahead, STEP_S);
    Motion { s_m: Road::advance(track, motion.s_m, distance_m), speed_mps, acceleration_mps2 }
}
