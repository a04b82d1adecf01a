//! From YAML nodes to a problem, collecting what is wrong on the way.

use std::collections::HashMap;

use motion::{Point2, VehicleDimensions, VehicleInfo};
use open_space::{Limits, PlanarPose, Problem};

use super::error::{SceneProblem, SceneProblemKind as Kind};
use crate::settings::nearest::nearest;
use crate::settings::yaml::{self, Content, Node};
use crate::settings::{ParameterValue, Position};

pub(super) const SCENE_KEYS: [&str; 7] =
    ["name", "vehicle", "bounds", "obstacles", "start", "goal", "limits"];
pub(super) const START_KEYS: [&str; 4] = ["x", "y", "yaw", "v"];
pub(super) const GOAL_KEYS: [&str; 3] = ["x", "y", "yaw"];

/// A number of a group of keys, by its name.
pub(super) type Field<T> = (&'static str, fn(&mut T) -> &mut f64);

pub(super) const VEHICLE_FIELDS: [Field<VehicleDimensions>; 10] = [
    ("wheel_radius", |d| &mut d.wheel_radius_m),
    ("wheel_width", |d| &mut d.wheel_width_m),
    ("wheel_base", |d| &mut d.wheel_base_m),
    ("wheel_tread", |d| &mut d.wheel_tread_m),
    ("front_overhang", |d| &mut d.front_overhang_m),
    ("rear_overhang", |d| &mut d.rear_overhang_m),
    ("left_overhang", |d| &mut d.left_overhang_m),
    ("right_overhang", |d| &mut d.right_overhang_m),
    ("vehicle_height", |d| &mut d.vehicle_height_m),
    ("max_steer_angle", |d| &mut d.max_steer_angle_rad),
];

pub(super) const LIMIT_FIELDS: [Field<Limits>; 5] = [
    ("max_speed_forward", |l| &mut l.max_speed_forward_mps),
    ("max_speed_reverse", |l| &mut l.max_speed_reverse_mps),
    ("max_acceleration", |l| &mut l.max_acceleration_mps2),
    ("max_jerk", |l| &mut l.max_jerk_mps3),
    ("max_steer_rate", |l| &mut l.max_steer_rate_rps),
];

/// Where things are in the file.
#[derive(Debug, Default)]
pub(super) struct Places {
    pub(super) bounds: Option<Position>,
    pub(super) obstacles: Vec<Position>,
    pub(super) start: Option<Position>,
    pub(super) goal: Option<Position>,
}

/// A scene in the making.
#[derive(Debug, Default)]
pub(super) struct Draft {
    pub(super) name: Option<String>,
    /// Only where everything could be read.
    pub(super) problem: Option<Problem>,
    pub(super) places: Places,
    pub(super) problems: Vec<SceneProblem>,
}

impl Draft {
    pub(super) fn read(text: &str, vehicle: &VehicleInfo, limits: &Limits) -> Self {
        let mut draft = Self::default();
        match yaml::parse(text) {
            Err((at, kind)) => draft.report(Some(at), None, Kind::Yaml(kind)),
            Ok(None) => draft.report(None, None, Kind::NoContent),
            Ok(Some(Node { content: Content::Scalar(ParameterValue::NotSet), .. })) => {
                draft.report(None, None, Kind::NoContent);
            }
            Ok(Some(root)) => draft.scene(&root, vehicle, limits),
        }
        draft
    }

    pub(super) fn report(&mut self, at: Option<Position>, key: Option<&str>, kind: Kind) {
        self.problems.push(SceneProblem { position: at, key: key.map(str::to_owned), kind });
    }

    fn scene(&mut self, root: &Node, vehicle: &VehicleInfo, limits: &Limits) {
        let Some(keys) = self.group(root, None, &SCENE_KEYS) else { return };
        if let Some(node) = keys.get("name") {
            match &node.content {
                Content::Scalar(ParameterValue::String(name)) => self.name = Some(name.clone()),
                _ => self.wrong_type(node, "name", "a text"),
            }
        }
        let vehicle = self.vehicle(keys.get("vehicle").copied(), vehicle);
        let bounds = self.needed(&keys, "bounds").and_then(|node| {
            self.places.bounds = Some(node.at);
            self.bounds(node)
        });
        let obstacles = keys.get("obstacles").map_or(Some(Vec::new()), |node| self.obstacles(node));
        let start = self.needed(&keys, "start").and_then(|node| {
            self.places.start = Some(node.at);
            let group = self.group(node, Some("start"), &START_KEYS)?;
            let speed_mps = group.get("v").map_or(Some(0.0), |node| self.number(node, "start.v"));
            Some((self.pose(node, &group, "start")?, speed_mps?))
        });
        let goal = self.needed(&keys, "goal").and_then(|node| {
            self.places.goal = Some(node.at);
            let group = self.group(node, Some("goal"), &GOAL_KEYS)?;
            self.pose(node, &group, "goal")
        });
        let limits = self.limits(keys.get("limits").copied(), limits);
        self.problem = (|| {
            let (start, start_speed_mps) = start?;
            Some(Problem {
                vehicle: vehicle?,
                limits: limits?,
                bounds: bounds?,
                obstacles: obstacles?,
                start,
                start_speed_mps,
                start_acceleration_mps2: 0.0,
                start_curvature: None,
                goal: goal?,
            })
        })();
    }

    /// The values of a map by their keys, which must be among `allowed`.
    fn group<'n>(
        &mut self,
        node: &'n Node,
        group: Option<&str>,
        allowed: &[&'static str],
    ) -> Option<HashMap<&'n str, &'n Node>> {
        let Content::Mapping(entries) = &node.content else {
            self.report(Some(node.at), group, Kind::WrongType { expected: "a map of keys to values" });
            return None;
        };
        let full = |key: &str| group.map_or_else(|| key.to_owned(), |group| format!("{group}.{key}"));
        let mut places: HashMap<&str, Position> = HashMap::new();
        let mut values = HashMap::new();
        for (key, value) in entries {
            let name = key.text.as_str();
            if !allowed.contains(&name) {
                let kind = Kind::UnknownKey {
                    allowed: allowed.join(", "),
                    nearest: nearest(name, allowed.iter().copied()),
                };
                self.report(Some(key.at), Some(&full(name)), kind);
            } else if let Some(first) = places.get(name) {
                let first_line = first.line;
                self.report(Some(key.at), Some(&full(name)), Kind::Duplicate { first_line });
            } else {
                places.insert(name, key.at);
                values.insert(name, value);
            }
        }
        Some(values)
    }

    fn needed<'n>(&mut self, keys: &HashMap<&str, &'n Node>, key: &str) -> Option<&'n Node> {
        let node = keys.get(key).copied();
        if node.is_none() {
            self.report(None, Some(key), Kind::Missing);
        }
        node
    }

    fn wrong_type(&mut self, node: &Node, key: &str, expected: &'static str) {
        self.report(Some(node.at), Some(key), Kind::WrongType { expected });
    }

    fn number(&mut self, node: &Node, key: &str) -> Option<f64> {
        let value = match node.content {
            Content::Scalar(ParameterValue::Double(value)) => value,
            #[expect(clippy::cast_precision_loss, reason = "no scene has coordinates of that size")]
            Content::Scalar(ParameterValue::Integer(value)) => value as f64,
            _ => {
                self.wrong_type(node, key, "a number");
                return None;
            }
        };
        if !value.is_finite() {
            self.report(Some(node.at), Some(key), Kind::NotFinite { value });
            return None;
        }
        Some(value)
    }

    fn pose(&mut self, node: &Node, group: &HashMap<&str, &Node>, name: &str) -> Option<PlanarPose> {
        let numbers = ["x", "y", "yaw"].map(|key| {
            let full = format!("{name}.{key}");
            match group.get(key) {
                Some(node) => self.number(node, &full),
                None => {
                    self.report(Some(node.at), Some(&full), Kind::Missing);
                    None
                }
            }
        });
        let [x, y, yaw] = numbers;
        Some(PlanarPose::new(x?, y?, yaw?))
    }

    fn bounds(&mut self, node: &Node) -> Option<[f64; 4]> {
        let expected = "a list of four numbers: x_min, x_max, y_min, y_max";
        let Content::Sequence(items) = &node.content else {
            self.wrong_type(node, "bounds", expected);
            return None;
        };
        let [a, b, c, d] = items.as_slice() else {
            self.wrong_type(node, "bounds", expected);
            return None;
        };
        let [a, b, c, d] = [a, b, c, d].map(|item| self.number(item, "bounds"));
        Some([a?, b?, c?, d?])
    }

    fn obstacles(&mut self, node: &Node) -> Option<Vec<Vec<Point2>>> {
        let Content::Sequence(lines) = &node.content else {
            self.wrong_type(node, "obstacles", "a list of polylines");
            return None;
        };
        let read: Vec<_> = lines
            .iter()
            .enumerate()
            .map(|(k, line)| {
                self.places.obstacles.push(line.at);
                self.polyline(line, &format!("obstacles[{k}]"))
            })
            .collect();
        read.into_iter().collect()
    }

    fn polyline(&mut self, node: &Node, key: &str) -> Option<Vec<Point2>> {
        let points = match &node.content {
            Content::Sequence(points) if points.len() >= 2 => points,
            _ => {
                self.wrong_type(node, key, "a list of at least two points");
                return None;
            }
        };
        let read: Vec<_> = points.iter().map(|point| self.point(point, key)).collect();
        read.into_iter().collect()
    }

    fn point(&mut self, node: &Node, key: &str) -> Option<Point2> {
        match &node.content {
            Content::Sequence(items) if items.len() == 2 => {
                let (x, y) = (self.number(&items[0], key), self.number(&items[1], key));
                Some(Point2::new(x?, y?))
            }
            _ => {
                self.wrong_type(node, key, "a list of points, each a list of x and y");
                None
            }
        }
    }

    /// Puts the numbers of a group where they belong; none if one is wrong.
    fn fill<T>(&mut self, node: &Node, group: &str, fields: &[Field<T>], mut value: T) -> Option<T> {
        let names: Vec<&'static str> = fields.iter().map(|(name, _)| *name).collect();
        let before = self.problems.len();
        let given = self.group(node, Some(group), &names)?;
        for (name, field) in fields {
            if let Some(node) = given.get(name)
                && let Some(number) = self.number(node, &format!("{group}.{name}"))
            {
                *field(&mut value) = number;
            }
        }
        (self.problems.len() == before).then_some(value)
    }

    fn vehicle(&mut self, node: Option<&Node>, default: &VehicleInfo) -> Option<VehicleInfo> {
        let Some(node) = node else { return Some(*default) };
        let dimensions = self.fill(node, "vehicle", &VEHICLE_FIELDS, *default.dimensions())?;
        match VehicleInfo::new(dimensions) {
            Ok(vehicle) => Some(vehicle),
            Err(error) => {
                self.report(Some(node.at), Some("vehicle"), Kind::Vehicle(error));
                None
            }
        }
    }

    fn limits(&mut self, node: Option<&Node>, default: &Limits) -> Option<Limits> {
        let Some(node) = node else { return Some(*default) };
        let mut limits = self.fill(node, "limits", &LIMIT_FIELDS, *default)?;
        let before = self.problems.len();
        for (name, field) in LIMIT_FIELDS {
            let value = *field(&mut limits);
            if value < Limits::SMALLEST {
                let kind = Kind::TooSmall { value, least: Limits::SMALLEST };
                self.report(Some(node.at), Some(&format!("limits.{name}")), kind);
            }
        }
        (self.problems.len() == before).then_some(limits)
    }
}
