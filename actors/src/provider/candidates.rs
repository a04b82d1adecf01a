//! From what the provider says to candidates as the buffer takes them.

use super::{GENERATOR, STOP_GENERATOR};
use messages::autoware_internal_planning_msgs::{CandidateTrajectories, CandidateTrajectory, GeneratorInfo};
use messages::autoware_planning_msgs::{Trajectory, TrajectoryPoint};
use messages::builtin_interfaces::{Duration, Time};
use messages::geometry_msgs::{Point, Pose, Quaternion};
use messages::std_msgs::{Header, Text};
use messages::unique_identifier_msgs::Uuid;
use open_space::partition::Part;
use open_space::stage::Command;
use open_space::stitcher::DiscretizedPoint;
use std::sync::Arc;

/// Identities of the two generators, readable in a dump.
const GENERATOR_ID: Uuid = Uuid { uuid: *b"OpenSpacePlanner" };
const STOP_GENERATOR_ID: Uuid = Uuid { uuid: *b"OpenSpacePl_Stop" };

/// Steps of a candidate are at least this long, m, where it moves. Not much longer: its intervals would become uneven, and
/// with them the rates that are estimated from it.
const SHORTEST_STEP_M: f64 = 1e-4;

/// Points that a candidate has at least.
const FEWEST_POINTS: usize = 2;

/// When and where a command holds.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Placement<'a> {
    /// Time that the command's times count from.
    pub(super) stamp: Time,
    /// Frame of its poses.
    pub(super) frame_id: &'a str,
    /// Height of the ground, m.
    pub(super) z: f64,
}

/// The candidate of a command under the generator that it belongs to; the other one's is withdrawn, and both without a
/// command.
pub(super) fn to_message(command: Option<&Command>, at: &Placement<'_>) -> CandidateTrajectories {
    let candidate = match command {
        None | Some(Command::Stop(None)) => None,
        Some(Command::Stop(Some(stop))) => Some((STOP_GENERATOR_ID, stop.points.clone())),
        Some(Command::Follow(part)) => Some((GENERATOR_ID, until_stop(part))),
        Some(Command::Brake { trajectory, .. }) => Some((GENERATOR_ID, trajectory.points.clone())),
    };
    let info = |(generator_id, name): (Uuid, &str)| GeneratorInfo {
        generator_id,
        generator_name: Text { data: name.to_owned() },
    };
    CandidateTrajectories {
        candidate_trajectories: candidate
            .map(|(generator_id, points)| candidate_of(generator_id, &points, at))
            .into_iter()
            .collect(),
        generator_info: [(GENERATOR_ID, GENERATOR), (STOP_GENERATOR_ID, STOP_GENERATOR)].map(info).into(),
    }
}

/// The provider's trajectory in a set of candidates, a stop trajectory included.
pub(crate) fn plan_in(set: &CandidateTrajectories) -> Option<Trajectory> {
    let ids = [GENERATOR_ID, STOP_GENERATOR_ID];
    let candidate =
        set.candidate_trajectories.iter().find(|candidate| ids.contains(&candidate.generator_id))?;
    Some(Trajectory { header: candidate.header.clone(), points: candidate.points.clone() })
}

/// From where the vehicle is up to where it stands next, as far as it moves: points in one place have no direction, and
/// whoever reads curvature from places would see the wheels jump there.
fn until_stop(part: &Part) -> Vec<DiscretizedPoint> {
    let points = &part.trajectory.points[part.until_stop(0.0)];
    let mut moving: Vec<DiscretizedPoint> = Vec::with_capacity(points.len());
    for point in points {
        if moving.last().is_none_or(|before| step_m(before, point) >= SHORTEST_STEP_M) {
            moving.push(*point);
        }
    }
    if moving.len() < FEWEST_POINTS {
        // It stands.
        return points.to_vec();
    }
    if let Some((end, last)) = points.last().zip(moving.last_mut()) {
        // Where it comes to rest, in place of what lies just before.
        *last = *end;
    }
    moving
}

fn step_m(from: &DiscretizedPoint, to: &DiscretizedPoint) -> f64 {
    from.path_point.zip(to.path_point).map_or(0.0, |(from, to)| from.pose.distance_m(&to.pose))
}

fn candidate_of(
    generator_id: Uuid,
    points: &[DiscretizedPoint],
    at: &Placement<'_>,
) -> Arc<CandidateTrajectory> {
    Arc::new(CandidateTrajectory {
        header: Header { stamp: at.stamp, frame_id: at.frame_id.to_owned() },
        generator_id,
        points: points.iter().map(|point| point_of(point, at.z)).collect(),
        ..CandidateTrajectory::default()
    })
}

fn point_of(point: &DiscretizedPoint, z: f64) -> TrajectoryPoint {
    let path_point = point.path_point.unwrap_or_default();
    let pose = path_point.pose;
    TrajectoryPoint {
        time_from_start: Duration::from_nanoseconds((point.relative_time_s * 1e9).round() as i64),
        pose: Pose {
            position: Point { x: pose.x, y: pose.y, z },
            orientation: Quaternion::from_yaw(pose.yaw),
        },
        longitudinal_velocity_mps: point.speed_mps as f32,
        acceleration_mps2: point.acceleration_mps2 as f32,
        heading_rate_rps: (point.speed_mps * path_point.curvature) as f32,
        front_wheel_angle_rad: point.steer_rad as f32,
        ..TrajectoryPoint::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::provider::stand_ins::{point, vehicle};
    use open_space::Gear;
    use open_space::provider::stop_trajectory;
    use open_space::stitcher::DiscretizedTrajectory;

    fn part(times: &[f64]) -> Command {
        let points = times.iter().map(|&time_s| DiscretizedPoint { speed_mps: -0.5, ..point(time_s, 3.0) });
        let trajectory = DiscretizedTrajectory { points: points.collect() };
        Command::Follow(Part { trajectory, gear: Gear::Reverse, first: 0 })
    }

    fn at() -> Placement<'static> {
        Placement { stamp: Time { sec: 7, nanosec: 0 }, frame_id: "map", z: 2.0 }
    }

    #[test]
    fn a_plan_is_a_candidate_from_now_on() {
        let message = to_message(Some(&part(&[-0.2, -0.1, 0.0, 0.1])), &at());
        let names: Vec<_> =
            message.generator_info.iter().map(|info| info.generator_name.data.as_str()).collect();
        assert_eq!(names, [GENERATOR, STOP_GENERATOR]);
        let [candidate] = &message.candidate_trajectories[..] else { panic!("{message:?}") };
        assert_eq!(candidate.generator_id, GENERATOR_ID);
        assert_eq!((candidate.header.stamp, candidate.header.frame_id.as_str()), (at().stamp, "map"));
        let times: Vec<_> =
            candidate.points.iter().map(|point| point.time_from_start.nanoseconds()).collect();
        assert_eq!(times, [0, 100_000_000]);
        let first = candidate.points[0];
        assert_eq!((first.pose.position.x, first.pose.position.z), (3.0, 2.0));
        assert_eq!(first.longitudinal_velocity_mps, -0.5);
    }

    #[test]
    fn a_plan_is_a_candidate_up_to_its_next_stop_as_far_as_it_moves() {
        let place = |(index, x): (usize, f64)| {
            let speed_mps = if x >= 3.0 { 0.0 } else { 1.0 };
            DiscretizedPoint { speed_mps, ..point(index as f64, x) }
        };
        let points = [0.0, 1.0, 2.0, 2.99995, 3.0, 3.0, 3.0].into_iter().enumerate().map(place).collect();
        let mut plan = DiscretizedTrajectory { points };
        plan.points.push(DiscretizedPoint { speed_mps: 1.0, ..point(7.0, 4.0) });
        let follow = |plan: &DiscretizedTrajectory| {
            let part = Part { trajectory: plan.clone(), gear: Gear::Forward, first: 0 };
            let message = to_message(Some(&Command::Follow(part)), &at());
            let points = message.candidate_trajectories[0].points.clone();
            points
                .iter()
                .map(|point| (point.time_from_start.seconds(), point.pose.position.x))
                .collect::<Vec<_>>()
        };
        assert_eq!(follow(&plan), [(0.0, 0.0), (1.0, 1.0), (2.0, 2.0), (4.0, 3.0)]);
        for point in &mut plan.points {
            point.relative_time_s -= 4.5;
        }
        assert_eq!(follow(&plan), [(0.5, 3.0), (1.5, 3.0)], "the wheels turn");
    }

    #[test]
    fn a_stop_is_one_of_the_other_generator() {
        let stop = stop_trajectory(&vehicle(), 0.3);
        let message = to_message(Some(&Command::Stop(Some(stop))), &at());
        let [candidate] = &message.candidate_trajectories[..] else { panic!("{message:?}") };
        assert_eq!((candidate.generator_id, candidate.points.len()), (STOP_GENERATOR_ID, 10));
        assert_eq!(candidate.points[9].acceleration_mps2, -0.3);
    }

    #[test]
    fn without_a_command_both_are_withdrawn() {
        for command in [None, Some(&Command::Stop(None))] {
            let message = to_message(command, &at());
            assert_eq!((message.candidate_trajectories.len(), message.generator_info.len()), (0, 2));
        }
    }
}
