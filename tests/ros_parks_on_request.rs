//! A goal pose and an occupancy grid from the graph: the node plans, judges its plan like any other candidate, hands it on
//! and stops when something comes into the way.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

#[path = "interop_support/lab.rs"]
mod lab;
#[path = "interop_support/road.rs"]
mod road;

use lab::{Lab, Node, PATIENCE, Peer, isolated};
use messages::autoware_internal_planning_msgs::CandidateTrajectories;
use messages::autoware_perception_msgs::PredictedObjects;
use messages::autoware_planning_msgs::{Trajectory, TrajectoryPoint};
use messages::geometry_msgs::{AccelWithCovarianceStamped, Point, Pose, PoseStamped, Quaternion};
use messages::nav_msgs::{MapMetaData, OccupancyGrid, Odometry};
use messages::std_msgs::Header;
use messages::{Interface, Message};
use road::road_message;
use selector_actors::provider::{GENERATOR, STOP_GENERATOR};
use selector_actors::{InputTopic, OutputTopic};
use serde_json::json;
use std::path::Path;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

const COLUMNS: usize = 200;
const ROWS: usize = 100;
const CELL_M: f32 = 0.2;
const GOAL: [f64; 2] = [22.0, 4.0];
/// Columns and rows that something stands on, between the vehicle and its goal.
const PILLAR: [std::ops::Range<usize>; 2] = [78..86, 46..54];

fn header() -> Header {
    Header { frame_id: "map".to_owned(), ..Header::default() }
}

fn pose(x: f64, y: f64) -> Pose {
    Pose { position: Point { x, y, z: 0.0 }, orientation: Quaternion::from_yaw(0.0) }
}

/// A message that begins with its stamp, stamped anew: old objects are not judged against.
fn stamped(cdr: &[u8]) -> Vec<u8> {
    let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap();
    let seconds = u32::try_from(now.as_secs()).unwrap().to_le_bytes();
    [&cdr[..4], &seconds, &now.subsec_nanos().to_le_bytes(), &cdr[12..]].concat()
}

/// A place of 40 m by 20 m about (20, 0), with a pillar, and something else on those columns and rows.
fn grid(obstacle: Option<[std::ops::Range<usize>; 2]>) -> Vec<u8> {
    let mut data = vec![0; COLUMNS * ROWS];
    for [columns, rows] in [Some(PILLAR), obstacle].into_iter().flatten() {
        for row in rows {
            data[row * COLUMNS..][columns.clone()].fill(100);
        }
    }
    let info = MapMetaData {
        resolution: CELL_M,
        width: u32::try_from(COLUMNS).unwrap(),
        height: u32::try_from(ROWS).unwrap(),
        origin: pose(0.0, -10.0),
        ..MapMetaData::default()
    };
    OccupancyGrid { header: header(), info, data }.to_cdr(Interface::default())
}

/// The node with everybody around it: a map server, the vehicle, whoever sets goals, and whoever drives.
struct Place {
    node: Node,
    peer: Peer,
    /// What is sent again and again: endpoint and content.
    sensed: Vec<(u64, Vec<u8>)>,
    goal: u64,
    grid: u64,
    validated: u64,
    driven: u64,
    planned: u64,
}

impl Place {
    fn prepare(lab: &Lab) -> Self {
        let parameters = Path::new(env!("CARGO_MANIFEST_DIR")).join("config/parking/parking.param.yaml");
        let node = lab.node(&["--params-file", parameters.to_str().unwrap()]);
        let mut peer = lab.peer();
        let mut write = |topic: InputTopic, transient_local: bool| {
            let qos = json!({"transient_local": transient_local});
            let id = peer.open("write", &topic.full_name(), topic.type_name(), &qos);
            peer.wait_for_peers(id, 1);
            id
        };
        let map = write(InputTopic::Map, true);
        let mut odometry = Odometry { header: header(), ..Odometry::default() };
        odometry.pose.pose = pose(6.0, 0.0);
        let objects = PredictedObjects { header: header(), ..PredictedObjects::default() };
        let interface = Interface::default();
        let sensed = vec![
            (write(InputTopic::Odometry, false), odometry.to_cdr(interface)),
            (write(InputTopic::Acceleration, false), AccelWithCovarianceStamped::default().to_cdr(interface)),
            (write(InputTopic::Objects, false), objects.to_cdr(interface)),
        ];
        let (goal, grid) = (write(InputTopic::GoalPose, false), write(InputTopic::OccupancyGrid, false));
        let mut read = |topic: OutputTopic| {
            let id = peer.open("read", &topic.full_name(), topic.type_name(), &json!({}));
            peer.wait_for_peers(id, 1);
            id
        };
        let validated = read(OutputTopic::ValidatedTrajectories);
        let (driven, planned) = (read(OutputTopic::Trajectory), read(OutputTopic::OpenSpaceTrajectory));
        peer.send(map, &road_message(10));
        node.wait_for_line(&["Map 1:"]);
        Self { node, peer, sensed, goal, grid, validated, driven, planned }
    }

    /// Sends everything until a validated set has a candidate of the generator that fits; gives its points.
    fn until(
        &mut self,
        grid: &[u8],
        generator: &str,
        fits: impl Fn(&[TrajectoryPoint]) -> bool,
    ) -> Vec<TrajectoryPoint> {
        let goal = PoseStamped { header: header(), pose: pose(GOAL[0], GOAL[1]) };
        let goal = goal.to_cdr(Interface::default());
        let until = Instant::now() + PATIENCE;
        loop {
            assert!(Instant::now() < until, "no {generator}:\n{}", self.node.log().join("\n"));
            for (id, cdr) in &self.sensed {
                self.peer.send(*id, &stamped(cdr));
            }
            self.peer.send(self.goal, &goal);
            self.peer.send(self.grid, grid);
            for set in self.peer.take(self.validated, 1, Duration::from_millis(200)) {
                let set = CandidateTrajectories::from_cdr(&set, Interface::default(), "").unwrap();
                let names: Vec<_> = set.generator_info.iter().map(|info| &info.generator_name.data).collect();
                let candidate = set.candidate_trajectories.first().map(|candidate| candidate.points.clone());
                if let Some(points) = candidate.filter(|points| names == [generator] && fits(points)) {
                    return points;
                }
            }
        }
    }

    /// The trajectories that came on a topic, the newest.
    fn newest(&mut self, id: u64) -> Trajectory {
        let cdr = self.peer.take_one(id);
        Trajectory::from_cdr(&cdr, Interface::default(), "").unwrap()
    }
}

/// Whether the vehicle's outline, and be it only about its axis, comes over a cell of the pillar.
fn is_over_pillar(point: &TrajectoryPoint) -> bool {
    let Point { x, y, .. } = point.pose.position;
    let (z, w) = (point.pose.orientation.z, point.pose.orientation.w);
    let (sin, cos) = (2.0 * z.atan2(w)).sin_cos();
    let cell = |along: f64| {
        let (x, y) = (x + along * cos, y + along * sin + 10.0);
        [x, y].map(|place| (place / f64::from(CELL_M)).floor() as usize)
    };
    (0..=30)
        .map(|step| cell(-0.5 + 0.1 * f64::from(step)))
        .any(|[column, row]| PILLAR[0].contains(&column) && PILLAR[1].contains(&row))
}

#[test]
fn a_goal_and_a_grid_make_a_plan_that_is_judged_and_handed_on() {
    isolated("a_goal_and_a_grid_make_a_plan_that_is_judged_and_handed_on", |lab| {
        let mut place = Place::prepare(lab);
        let free = grid(None);
        let ends_at_goal = |points: &[TrajectoryPoint]| {
            points.last().is_some_and(|last| {
                let at = last.pose.position;
                (at.x - GOAL[0]).hypot(at.y - GOAL[1]) < 0.05
            })
        };
        let plan = place.until(&free, GENERATOR, ends_at_goal);
        assert!(plan.last().unwrap().longitudinal_velocity_mps.abs() < 1e-3, "it ends at rest");
        assert!(!plan.iter().any(is_over_pillar), "through the pillar");
        // Nobody else plans, so the plan is what is to be driven; it has a topic of its own, too.
        for id in [place.driven, place.planned] {
            let handed_on = place.newest(id);
            assert_eq!(handed_on.header.frame_id, "map");
            assert!(handed_on.points.len() > 10, "{} points", handed_on.points.len());
        }
        // Something stands where the vehicle wants to go: no plan that leads there is handed on any more.
        let blocked = grid(Some([100..120, 60..80]));
        let stands =
            |points: &[TrajectoryPoint]| points.iter().all(|point| point.longitudinal_velocity_mps == 0.0);
        place.until(&blocked, STOP_GENERATOR, stands);
        for _ in 0..5 {
            let handed_on = place.newest(place.planned);
            let is_safe = stands(&handed_on.points);
            assert!(is_safe, "{:?}", handed_on.points.last());
        }
        let stopped = place.node.stop("INT");
        assert_eq!(stopped.status.code(), Some(0), "{:?}", stopped.log);
        let grids = &stopped.json["messages"][InputTopic::OccupancyGrid.full_name()];
        assert!(grids["received"].as_u64().unwrap() > 0, "{grids}");
    });
}

#[test]
fn a_node_that_is_not_told_to_does_not_plan() {
    isolated("a_node_that_is_not_told_to_does_not_plan", |lab| {
        let node = lab.node(&[]);
        let mut peer = lab.peer();
        let odometry = InputTopic::Odometry;
        let id = peer.open("write", &odometry.full_name(), odometry.type_name(), &json!({}));
        peer.wait_for_peers(id, 1);
        let goal = InputTopic::GoalPose;
        let id = peer.open("write", &goal.full_name(), goal.type_name(), &json!({}));
        assert_eq!(peer.peers(id), 0, "nobody listens to goals");
        assert_eq!(node.stop("INT").status.code(), Some(0));
    });
}
