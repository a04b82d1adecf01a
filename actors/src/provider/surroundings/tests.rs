use super::*;
use lanelet_map::{Map, MapBuilder};
use messages::builtin_interfaces::Time;
use messages::geometry_msgs::{Point, Point32, Pose, Quaternion, Vector3};
use selection::scene::Epoch;

const MAP: &str = "map";

fn surroundings(obstacles_from: ObstacleSource) -> Surroundings {
    let parameters = RegionParameters { obstacles_from, ..RegionParameters::default() };
    Surroundings::new(parameters, VehicleInfo::default(), Arc::default())
}

fn pose(x: f64, y: f64, yaw: f64) -> Pose {
    Pose { position: Point { x, y, z: 0.0 }, orientation: Quaternion::from_yaw(yaw) }
}

fn goal(x: f64, y: f64, frame_id: &str) -> PoseStamped {
    let mut goal = PoseStamped { pose: pose(x, y, 0.0), ..PoseStamped::default() };
    frame_id.clone_into(&mut goal.header.frame_id);
    goal
}

/// 40 m by 40 m from the origin, all free.
fn grid(frame_id: &str) -> OccupancyGrid {
    let mut grid = OccupancyGrid { data: vec![0; 1600], ..OccupancyGrid::default() };
    (grid.info.resolution, grid.info.width, grid.info.height) = (1.0, 40, 40);
    frame_id.clone_into(&mut grid.header.frame_id);
    grid
}

fn scene() -> Scene {
    Scene::empty(Time::default(), Arc::new(VehicleInfo::default()))
}

fn region(of: &mut Surroundings, scene: &Scene) -> Result<Arc<Region>, NoRegion> {
    of.region(scene, PlanarPose::new(10.0, 20.0, 0.0), MAP).unwrap()
}

#[test]
fn without_a_goal_there_is_nothing_to_do() {
    let mut surroundings = surroundings(ObstacleSource::OccupancyGrid);
    surroundings.slots.put_grid(grid(MAP));
    assert!(surroundings.region(&scene(), PlanarPose::default(), MAP).is_none());
}

#[test]
fn what_is_missing_or_elsewhere_is_named() {
    let mut at = surroundings(ObstacleSource::OccupancyGrid);
    assert!(at.set_goal(&goal(30.0, 20.0, MAP)));
    let frame = |what| NoRegion::Frame { what, found: "odom".to_owned(), expected: MAP.to_owned() };
    assert_eq!(region(&mut at, &scene()).unwrap_err(), NoRegion::Missing("occupancy grid"));
    at.slots.put_grid(grid("odom"));
    assert_eq!(region(&mut at, &scene()).unwrap_err(), frame("occupancy grid"));
    at.slots.put_grid(OccupancyGrid { data: vec![0; 1599], ..grid(MAP) });
    assert!(matches!(region(&mut at, &scene()), Err(NoRegion::Region(RegionError::Grid { .. }))));
    at.slots.put_grid(grid(MAP));
    assert!(region(&mut at, &scene()).is_ok());
    assert!(at.set_goal(&goal(50.0, 20.0, MAP)));
    assert!(matches!(region(&mut at, &scene()), Err(NoRegion::Region(RegionError::Outside { .. }))));
    assert!(at.set_goal(&goal(30.0, 20.0, "odom")));
    assert_eq!(region(&mut at, &scene()).unwrap_err(), frame("goal"));
    let mut at = surroundings(ObstacleSource::ParkingLot);
    assert!(at.set_goal(&goal(30.0, 20.0, MAP)));
    assert_eq!(region(&mut at, &scene()).unwrap_err(), NoRegion::Missing("message with objects"));
}

#[test]
fn a_goal_that_is_sent_again_or_is_none_changes_nothing() {
    let mut surroundings = surroundings(ObstacleSource::OccupancyGrid);
    assert!(surroundings.set_goal(&goal(30.0, 20.0, MAP)));
    assert!(!surroundings.set_goal(&goal(30.0, 20.0, MAP)));
    assert!(!surroundings.set_goal(&goal(f64::NAN, 20.0, MAP)));
    assert!(surroundings.set_goal(&goal(30.0, 20.1, MAP)));
    assert!(surroundings.set_goal(&goal(30.0, 20.1, "odom")));
}

#[test]
fn a_newer_grid_makes_a_new_region_and_the_same_one_none() {
    let mut surroundings = surroundings(ObstacleSource::OccupancyGrid);
    surroundings.set_goal(&goal(30.0, 20.0, MAP));
    surroundings.slots.put_grid(grid(MAP));
    let first = region(&mut surroundings, &scene()).unwrap();
    let again = region(&mut surroundings, &scene()).unwrap();
    assert!(Arc::ptr_eq(&first, &again));
    let way = [PlanarPose::new(10.0, 20.0, 0.0), PlanarPose::new(25.0, 20.0, 0.0)];
    assert!(!surroundings.is_blocked(&first, &way));
    let mut newer = grid(MAP);
    newer.data[20 * 40 + 20] = 100;
    surroundings.slots.put_grid(newer);
    let second = region(&mut surroundings, &scene()).unwrap();
    assert_eq!(second.obstacles.len(), first.obstacles.len() + 1);
    assert!(surroundings.is_blocked(&second, &way));
    assert!(!surroundings.is_blocked(&second, &way[..1]));
}

/// A parking lot of 40 m by 40 m from the origin, and another polygon about it that is none.
fn lot() -> Map {
    let mut builder = MapBuilder::new();
    for (id, x, y) in [(1, 0.0, 0.0), (2, 40.0, 0.0), (3, 40.0, 40.0), (4, 0.0, 40.0), (5, -9.0, -9.0)] {
        builder.point(id, [x, y, 0.0], &[]).unwrap();
    }
    builder.polygon(10, &[5, 2, 3, 4], &[("type", "hatched_road_markings")]).unwrap();
    builder.polygon(11, &[1, 2, 3, 4], &[("type", "parking_lot")]).unwrap();
    builder.build().unwrap()
}

fn object(x: f64, speed_mps: f64) -> PredictedObject {
    let mut object = PredictedObject::default();
    object.shape.dimensions = Vector3 { x: 4.0, y: 2.0, z: 1.5 };
    object.kinematics.initial_pose_with_covariance.pose = pose(x, 20.0, 0.5);
    object.kinematics.initial_twist_with_covariance.twist.linear.x = speed_mps;
    object
}

#[test]
fn in_a_parking_lot_what_stands_is_an_obstacle() {
    let mut surroundings = surroundings(ObstacleSource::ParkingLot);
    surroundings.set_goal(&goal(30.0, 20.0, MAP));
    let map = HdMap::new(MAP.into(), Arc::new(lot()));
    let mut scene = Scene { map: Some(Epoch { number: 1, value: map }), ..scene() };
    let objects = |objects| Some(Arc::new(PredictedObjects { objects, ..PredictedObjects::default() }));
    scene.objects = objects(vec![object(20.0, 0.0), object(25.0, 3.0), object(22.0, f64::NAN)]);
    let of_lot = region(&mut surroundings, &scene).unwrap();
    let solids = of_lot.obstacles.iter().filter(|line| line.first() == line.last()).count();
    assert_eq!(solids, 2, "the moving one is watched instead");
    let way = [PlanarPose::new(10.0, 20.0, 0.0), PlanarPose::new(25.0, 20.0, 0.0)];
    assert!(surroundings.is_blocked(&of_lot, &way));
    scene.objects = objects(Vec::new());
    let empty = region(&mut surroundings, &scene).unwrap();
    assert!(!surroundings.is_blocked(&empty, &way));
    // Over the border of the lot.
    assert!(surroundings.is_blocked(&empty, &[PlanarPose::new(38.0, 20.0, 0.0)]));
    scene.objects = objects(vec![object(f64::INFINITY, 0.0)]);
    assert_eq!(region(&mut surroundings, &scene).unwrap_err(), RegionError::Object.into());
    surroundings.set_goal(&goal(-2.0, -2.0, MAP));
    assert_eq!(region(&mut surroundings, &scene).unwrap_err(), NoRegion::NoParkingLot);
}

#[test]
fn an_outline_holds_the_whole_object() {
    let mut box_shaped = object(20.0, 0.0);
    let mut round = box_shaped.clone();
    round.shape.r#type = Shape::CYLINDER;
    let mut polygon = box_shaped.clone();
    polygon.shape.r#type = Shape::POLYGON;
    let corners = [(2.0, 1.0), (-2.0, 1.0), (-2.0, -1.0), (2.0, -1.0)];
    polygon.shape.footprint.points = corners.map(|(x, y)| Point32 { x, y, z: 0.0 }).to_vec();
    let (sin, cos) = 0.5_f64.sin_cos();
    let place = |x: f64, y: f64| Point2::new(20.0 + x * cos - y * sin, 20.0 + x * sin + y * cos);
    for object in [&box_shaped, &polygon] {
        let outline = outline(object);
        assert_eq!(outline.len(), 4);
        for (x, y) in [(1.99, 0.99), (-1.99, 0.99), (-1.99, -0.99), (1.99, -0.99)] {
            assert!(polygon_contains(&outline, place(x, y)));
        }
        assert!(!polygon_contains(&outline, place(2.01, 0.0)));
    }
    let outline_of_round = outline(&round);
    for step in 0..360 {
        let (sin, cos) = f64::from(step).to_radians().sin_cos();
        assert!(polygon_contains(&outline_of_round, place(2.0 * cos, 2.0 * sin)), "{step} degrees");
        assert!(!polygon_contains(&outline_of_round, place(2.05 * cos, 2.05 * sin)), "{step} degrees");
    }
    box_shaped.shape.dimensions.x = f64::NAN;
    assert!(outline(&box_shaped)[0].x.is_nan(), "what is no size is no outline");
}
