//! Small maps for the pictures, and the scene on them.

use super::NOW;
use lanelet_map::{MapBuilder, MapError, Member};
use messages::autoware_perception_msgs::{
    ObjectClassification, PredictedObject, PredictedObjects, PredictedPath, Shape, TrafficLightElement,
    TrafficLightGroup, TrafficLightGroupArray,
};
use messages::autoware_planning_msgs::{LaneletRoute, LaneletSegment};
use messages::builtin_interfaces::Duration;
use messages::geometry_msgs::{AccelWithCovarianceStamped, Point, Pose, Quaternion};
use messages::nav_msgs::Odometry;
use messages::std_msgs::Header;
use messages::unique_identifier_msgs::Uuid;
use motion::VehicleInfo;
use selection::Scene;
use selection::scene::{Epoch, HdMap};
use std::sync::Arc;

/// The lane of the vehicle: y from the right to the left edge.
pub(super) const LANE: [f64; 2] = [-1.75, 1.75];
/// Left edge of the oncoming lane.
pub(super) const FAR_EDGE: f64 = 5.25;
/// Lanelet that the route goes along.
const ROUTE: i64 = 1;
const FIRST_LINE: i64 = 100;

/// A map in the making, and who is on it.
#[derive(Debug)]
pub(super) struct Street {
    builder: MapBuilder,
    next: i64,
    objects: Vec<PredictedObject>,
    signals: Vec<TrafficLightGroup>,
}

/// Lines of a street by what they are.
#[derive(Debug, Clone, Copy)]
pub(super) enum Line {
    Border,
    Edge,
    Divider,
    /// Not painted.
    Virtual,
    Stop,
    Marking,
}

impl Line {
    fn attributes(self) -> &'static [(&'static str, &'static str)] {
        match self {
            Self::Border => &[("type", "road_border")],
            Self::Edge => &[("type", "line_thin"), ("subtype", "solid")],
            Self::Divider => &[("type", "line_thin"), ("subtype", "dashed")],
            Self::Virtual => &[("type", "virtual")],
            Self::Stop => &[("type", "stop_line")],
            Self::Marking => &[("type", "pedestrian_marking")],
        }
    }
}

impl Street {
    pub(super) fn new() -> Self {
        Self { builder: MapBuilder::new(), next: FIRST_LINE, objects: Vec::new(), signals: Vec::new() }
    }

    /// A line through places; its id.
    pub(super) fn line(&mut self, kind: Line, places: &[(f64, f64)]) -> Result<i64, MapError> {
        let id = self.next;
        self.next += 1;
        let places: Vec<[f64; 3]> = places.iter().map(|&(x, y)| [x, y, 0.0]).collect();
        self.builder.line_string_at(id, &places, kind.attributes())?;
        Ok(id)
    }

    /// A piece of road between two lines; the first one is that of the route.
    pub(super) fn lane(&mut self, left: i64, right: i64) -> Result<(), MapError> {
        let is_first = self.next < 2 * FIRST_LINE;
        let id = if is_first { ROUTE } else { self.next };
        self.next = self.next.max(2 * FIRST_LINE) + 1;
        self.builder.lanelet(id, left, right, &[("subtype", "road")])
    }

    /// Two lanes along x with these lines at the right edge, in the middle and at the left edge.
    pub(super) fn two_lanes(&mut self, [right, middle, left]: [Line; 3]) -> Result<(), MapError> {
        let along = |y: f64| [(-30.0, y), (90.0, y)];
        let right = self.line(right, &along(LANE[0]))?;
        let middle = self.line(middle, &along(LANE[1]))?;
        let left = self.line(left, &along(FAR_EDGE))?;
        self.lane(middle, right)?;
        self.lane(left, middle)
    }

    /// A crosswalk over both lanes with a stop line before it.
    pub(super) fn crosswalk(&mut self, [from_x, to_x]: [f64; 2], stop_x: f64) -> Result<(), MapError> {
        let ends = [LANE[0] - 0.6, FAR_EDGE + 0.6];
        let bounds = [from_x, to_x].map(|x| self.line(Line::Marking, &ends.map(|y| (x, y))));
        let [left, right] = bounds;
        let (left, right) = (left?, right?);
        let stop_line = self.line(Line::Stop, &LANE.map(|y| (stop_x, y)))?;
        self.builder.lanelet(2, left, right, &[("subtype", "crosswalk")])?;
        let members = [("refers", Member::Lanelet(2)), ("ref_line", Member::LineString(stop_line))];
        self.builder.regulatory_element(20, &members, &[("subtype", "crosswalk")])?;
        self.builder.attach(ROUTE, 20)
    }

    /// A red light with its stop line.
    pub(super) fn red_light(&mut self, stop_x: f64) -> Result<(), MapError> {
        let stop_line = self.line(Line::Stop, &LANE.map(|y| (stop_x, y)))?;
        let members = [("ref_line", Member::LineString(stop_line))];
        self.builder.regulatory_element(21, &members, &[("subtype", "traffic_light")])?;
        let element = TrafficLightElement {
            color: TrafficLightElement::RED,
            shape: TrafficLightElement::CIRCLE,
            status: TrafficLightElement::SOLID_ON,
            confidence: 1.0,
        };
        self.signals.push(TrafficLightGroup {
            traffic_light_group_id: 21,
            elements: vec![element],
            ..TrafficLightGroup::default()
        });
        self.builder.attach(ROUTE, 21)
    }

    /// A car that goes straight on, and is expected to.
    pub(super) fn car(&mut self, x: f64, y: f64, yaw: f64, speed_mps: f64) {
        let mut car = object(1, ObjectClassification::CAR, [x, y, yaw], [4.5, 1.8]);
        car.kinematics.initial_twist_with_covariance.twist.linear.x = speed_mps;
        let after = |step: i32| {
            let way_m = 0.5 * f64::from(step) * speed_mps;
            pose(x + way_m * yaw.cos(), y + way_m * yaw.sin(), yaw)
        };
        car.kinematics.predicted_paths = vec![PredictedPath {
            path: (0..=10).map(after).collect(),
            time_step: Duration { sec: 0, nanosec: 500_000_000 },
            confidence: 1.0,
        }];
        self.objects.push(car);
    }

    /// Somebody who stands.
    pub(super) fn pedestrian(&mut self, x: f64, y: f64) {
        self.objects.push(object(2, ObjectClassification::PEDESTRIAN, [x, y, 1.57], [0.7, 0.7]));
    }

    /// The scene with the vehicle at the origin, driving along x.
    pub(super) fn scene(self, speed_mps: f64) -> Result<Scene, MapError> {
        let header = Header { stamp: NOW, frame_id: "map".to_owned() };
        let mut scene = Scene::empty(NOW, Arc::new(VehicleInfo::default()));
        let mut odometry = Odometry { header: header.clone(), ..Odometry::default() };
        odometry.twist.twist.linear.x = speed_mps;
        scene.odometry = Some(Arc::new(odometry));
        scene.acceleration =
            Some(Arc::new(AccelWithCovarianceStamped { header: header.clone(), ..Default::default() }));
        scene.objects = Some(Arc::new(PredictedObjects { header, objects: self.objects }));
        let signals = TrafficLightGroupArray { stamp: NOW, traffic_light_groups: self.signals };
        scene.traffic_signals = Some(Arc::new(signals));
        let map = Arc::new(self.builder.build()?);
        scene.map = Some(Epoch { number: 1, value: HdMap::new("map".into(), map) });
        let mut segment = LaneletSegment::default();
        segment.preferred_primitive.id = ROUTE;
        let route = LaneletRoute { segments: vec![segment], ..LaneletRoute::default() };
        scene.route = Some(Epoch { number: 1, value: Arc::new(route) });
        Ok(scene)
    }
}

fn pose(x: f64, y: f64, yaw: f64) -> Pose {
    Pose { position: Point { x, y, z: 0.0 }, orientation: Quaternion::from_yaw(yaw) }
}

fn object(id: u8, label: u8, [x, y, yaw]: [f64; 3], [length_m, width_m]: [f64; 2]) -> PredictedObject {
    let mut object = PredictedObject { object_id: Uuid { uuid: [id; 16] }, ..PredictedObject::default() };
    object.classification = vec![ObjectClassification { label, probability: 1.0 }];
    object.shape.r#type = Shape::BOUNDING_BOX;
    (object.shape.dimensions.x, object.shape.dimensions.y) = (length_m, width_m);
    object.kinematics.initial_pose_with_covariance.pose = pose(x, y, yaw);
    object
}
