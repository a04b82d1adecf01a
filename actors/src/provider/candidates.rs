//! From what the provider says to candidates as the buffer takes them.

use super::{GENERATOR, STOP_GENERATOR};
use messages::autoware_internal_planning_msgs::{CandidateTrajectories, CandidateTrajectory, GeneratorInfo};
use messages::autoware_planning_msgs::TrajectoryPoint;
use messages::builtin_interfaces::{Duration, Time};
use messages::geometry_msgs::{Point, Pose, Quaternion};
use messages::std_msgs::{Header, Text};
use messages::unique_identifier_msgs::Uuid;
use open_space::stage::Command;
use open_space::stitcher::{DiscretizedPoint, DiscretizedTrajectory};
use std::sync::Arc;

/// Identities of the two generators, readable in a dump.
const GENERATOR_ID: Uuid = Uuid { uuid: *b"OpenSpacePlanner" };
const STOP_GENERATOR_ID: Uuid = Uuid { uuid: *b"OpenSpacePl_Stop" };

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
        Some(Command::Stop(Some(stop))) => Some((STOP_GENERATOR_ID, stop)),
        Some(Command::Follow(part)) => Some((GENERATOR_ID, &part.trajectory)),
        Some(Command::Brake { trajectory, .. }) => Some((GENERATOR_ID, trajectory)),
    };
    let info = |(generator_id, name): (Uuid, &str)| GeneratorInfo {
        generator_id,
        generator_name: Text { data: name.to_owned() },
    };
    CandidateTrajectories {
        candidate_trajectories: candidate
            .map(|(generator_id, trajectory)| candidate_of(generator_id, trajectory, at))
            .into_iter()
            .collect(),
        generator_info: [(GENERATOR_ID, GENERATOR), (STOP_GENERATOR_ID, STOP_GENERATOR)].map(info).into(),
    }
}

/// From where the vehicle is; what lies behind it is left out.
fn candidate_of(
    generator_id: Uuid,
    trajectory: &DiscretizedTrajectory,
    at: &Placement<'_>,
) -> Arc<CandidateTrajectory> {
    let ahead = trajectory.points.iter().filter(|point| point.relative_time_s >= 0.0);
    Arc::new(CandidateTrajectory {
        header: Header { stamp: at.stamp, frame_id: at.frame_id.to_owned() },
        generator_id,
        points: ahead.map(|point| point_of(point, at.z)).collect(),
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
    use open_space::partition::Part;
    use open_space::provider::stop_trajectory;

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
