//! From the file's numbers to scenes, candidates and expectations.

use std::path::Path;
use std::sync::Arc;

use lanelet_map::Map;
use messages::autoware_internal_planning_msgs::CandidateTrajectory;
use messages::autoware_perception_msgs::{
    ObjectClassification, PredictedObject, PredictedObjects, PredictedPath, Shape, TrafficLightElement,
    TrafficLightGroup, TrafficLightGroupArray,
};
use messages::autoware_planning_msgs::{LaneletPrimitive, LaneletRoute, LaneletSegment, TrajectoryPoint};
use messages::builtin_interfaces::{Duration, Time};
use messages::geometry_msgs::{AccelWithCovarianceStamped, Point, Pose, Quaternion, Vector3};
use messages::nav_msgs::Odometry;
use messages::std_msgs::Header;
use motion::{VehicleDimensions, VehicleInfo};
use selection::parameters::ValidatorParameters;
use selection::scene::{Epoch, HdMap};
use selection::{Candidate, Scene};
use serde::Deserialize as _;
use serde_json::Value;

use super::file::{
    AccelerationFile, CandidateFile, CycleFile, ExpectedFile, FormatOnly, HexId, ObjectFile, OdometryFile,
    SequenceFile, SignalFile, VehicleFile, VerdictFile,
};
use super::{
    Cycle, Expected, ExpectedFactor, ExpectedMetric, ExpectedVerdict, FORMAT, GoldenError, Maps, Sequence,
};
use crate::json::Number;

/// The frame of everything in a sequence.
const FRAME: &str = "map";

/// Reads the text of a sequence.
pub(super) fn sequence(path: &Path, text: &[u8], maps: &mut Maps) -> Result<Sequence, GoldenError> {
    let json = |source| GoldenError::Json { path: path.to_owned(), source };
    let FormatOnly { format } = serde_json::from_slice(text).map_err(json)?;
    if format != FORMAT {
        return Err(GoldenError::Format { path: path.to_owned(), found: format });
    }
    let file: SequenceFile = serde_json::from_slice(text).map_err(json)?;
    let vehicle = VehicleInfo::new(dimensions(&file.vehicle))
        .map_err(|source| GoldenError::Vehicle { path: path.to_owned(), source })?;
    let map = maps.get(path, &file.map)?;
    let mut reader = Reader {
        path,
        map,
        vehicle: Arc::new(vehicle),
        columns: Columns::new(&file.columns),
        filters: &file.filters,
        overrides: Overrides::default(),
        route: None,
    };
    let parameters = reader.parameters("parameters of the file", &file.params)?;
    if file.cycles.len() != file.expected.len() {
        return Err(reader.content("expected".to_owned(), "not one entry for each cycle"));
    }
    let cycles = file.cycles.iter().zip(&file.expected).enumerate();
    let cycles = cycles.map(|(index, (cycle, expected))| reader.cycle(index, cycle, expected));
    let cycles = cycles.collect::<Result<_, _>>()?;
    let vehicle = reader.vehicle;
    Ok(Sequence { name: file.name, tags: file.tags, vehicle, parameters, filters: file.filters, cycles })
}

fn dimensions(file: &VehicleFile) -> VehicleDimensions {
    VehicleDimensions {
        wheel_radius_m: file.wheel_radius.0,
        wheel_width_m: file.wheel_width.0,
        wheel_base_m: file.wheel_base.0,
        wheel_tread_m: file.wheel_tread.0,
        front_overhang_m: file.front_overhang.0,
        rear_overhang_m: file.rear_overhang.0,
        left_overhang_m: file.left_overhang.0,
        right_overhang_m: file.right_overhang.0,
        vehicle_height_m: file.vehicle_height.0,
        max_steer_angle_rad: file.max_steer_angle.0,
    }
}

/// What the cycles of one file share.
struct Reader<'a> {
    path: &'a Path,
    map: Arc<Map>,
    vehicle: Arc<VehicleInfo>,
    columns: Columns,
    filters: &'a [String],
    overrides: Overrides,
    /// The route as of the last cycle that had one.
    route: Option<Epoch<Arc<LaneletRoute>>>,
}

impl Reader<'_> {
    fn content(&self, place: String, what: &'static str) -> GoldenError {
        GoldenError::Content { path: self.path.to_owned(), place, what }
    }

    /// The parameters with these overrides on top of all earlier ones.
    fn parameters(&mut self, place: &str, overrides: &Value) -> Result<ValidatorParameters, GoldenError> {
        self.overrides.apply(overrides).map_err(|source| GoldenError::Parameters {
            path: self.path.to_owned(),
            place: place.to_owned(),
            source,
        })
    }

    fn cycle(
        &mut self,
        index: usize,
        file: &CycleFile,
        expected: &[ExpectedFile],
    ) -> Result<Cycle, GoldenError> {
        if file.candidates.len() != expected.len() {
            return Err(
                self.content(format!("expected of cycle {index}"), "not one entry for each candidate")
            );
        }
        let parameters = match &file.params {
            Some(overrides) => Some(self.parameters(&format!("parameters of cycle {index}"), overrides)?),
            None => None,
        };
        let now = Time::from_nanoseconds(nanoseconds(file.time));
        let scene = self.scene(now, file);
        let candidates =
            file.candidates.iter().map(|candidate| self.columns.candidate(now, candidate)).collect();
        let expected = file
            .candidates
            .iter()
            .zip(expected)
            .map(|(candidate, verdicts)| self.expected(candidate, verdicts))
            .collect::<Result<_, _>>()?;
        Ok(Cycle { parameters, scene, candidates, expected })
    }

    fn scene(&mut self, now: Time, file: &CycleFile) -> Scene {
        let header = header(now);
        Scene {
            now,
            vehicle: self.vehicle.clone(),
            odometry: file.odometry.as_ref().map(|file| Arc::new(odometry(&header, file))),
            acceleration: file.acceleration.as_ref().map(|file| Arc::new(acceleration(&header, file))),
            objects: file.objects.as_ref().map(|objects| {
                let objects = objects.iter().map(object).collect();
                Arc::new(PredictedObjects { header: header.clone(), objects })
            }),
            traffic_signals: file.signals.as_ref().map(|signals| {
                let traffic_light_groups = signals.iter().map(signal).collect();
                Arc::new(TrafficLightGroupArray { stamp: now, traffic_light_groups })
            }),
            map: Some(Epoch { number: 1, value: HdMap::new(FRAME.into(), self.map.clone()) }),
            route: file.route.as_deref().map(|lanelets| self.route(&header, lanelets)),
        }
    }

    /// The route; a new one only where it differs, as a node receives it.
    fn route(&mut self, header: &Header, lanelets: &[i64]) -> Epoch<Arc<LaneletRoute>> {
        let segments: Vec<_> = lanelets.iter().copied().map(segment).collect();
        let number = match &self.route {
            Some(known) if known.value.segments == segments => return known.clone(),
            known => known.as_ref().map_or(1, |known| known.number + 1),
        };
        let route = LaneletRoute { header: header.clone(), segments, ..LaneletRoute::default() };
        self.route.insert(Epoch { number, value: Arc::new(route) }).clone()
    }

    fn expected(&self, candidate: &CandidateFile, verdicts: &ExpectedFile) -> Result<Expected, GoldenError> {
        let json = |source| GoldenError::Json { path: self.path.to_owned(), source };
        let fragile = verdicts.get("fragile").map(Vec::<String>::deserialize).transpose().map_err(json)?;
        let mut expected = Expected {
            note: candidate.note.clone(),
            data_validity: if candidate.valid == Some(false) {
                candidate.data_validity.unwrap_or(0)
            } else {
                0
            },
            verdicts: Default::default(),
            fragile: fragile.unwrap_or_default(),
        };
        for filter in self.filters {
            if let Some(value) = verdicts.get(filter) {
                let verdict = VerdictFile::deserialize(value).map_err(json)?;
                let verdict = verdict_of(verdict).ok_or_else(|| {
                    let place = format!("verdict of {filter} on {}", candidate.note);
                    self.content(place, "neither a judgement nor an error")
                })?;
                expected.verdicts.insert(filter.clone(), verdict);
            }
        }
        Ok(expected)
    }
}

fn verdict_of(file: VerdictFile) -> Option<ExpectedVerdict> {
    if let Some(true_nearest) = file.true_nearest {
        return verdict_of(*true_nearest);
    }
    if let Some(text) = file.error.or(file.throws) {
        return Some(ExpectedVerdict::Error(text));
    }
    let metrics = file.metrics.into_iter();
    let metrics = metrics.map(|(name, Number(value), level)| ExpectedMetric { name, value, level }).collect();
    let factors = file.safety_factors.into_iter();
    let safety_factors =
        factors.map(|(HexId(object_id), x, y)| ExpectedFactor { object_id, x_m: x.0, y_m: y.0 }).collect();
    file.feasible.map(|feasible| ExpectedVerdict::Judged { feasible, metrics, safety_factors })
}

/// All parameters as JSON, with the overrides so far.
struct Overrides(Value);

impl Default for Overrides {
    fn default() -> Self {
        let none = ValidatorParameters {
            filter_names: Vec::new(),
            shadow_mode_filter_names: Vec::new(),
            ..ValidatorParameters::default()
        };
        Self(serde_json::to_value(none).unwrap_or_default())
    }
}

impl Overrides {
    /// Groups merge key by key, values replace.
    fn apply(&mut self, overrides: &Value) -> Result<ValidatorParameters, serde_json::Error> {
        merge(&mut self.0, overrides);
        ValidatorParameters::deserialize(&self.0)
    }
}

fn merge(into: &mut Value, from: &Value) {
    match (into, from) {
        (_, Value::Null) => (),
        (Value::Object(into), Value::Object(from)) => {
            for (key, value) in from {
                merge(into.entry(key.as_str()).or_insert(Value::Null), value);
            }
        }
        (into, from) => *into = from.clone(),
    }
}

/// Where a point's row holds what; none for a column that is missing and reads as zero.
struct Columns {
    t: Option<usize>,
    x: Option<usize>,
    y: Option<usize>,
    z: Option<usize>,
    yaw: Option<usize>,
    v: Option<usize>,
    vy: Option<usize>,
    a: Option<usize>,
}

impl Columns {
    fn new(names: &[String]) -> Self {
        let find = |name: &str| names.iter().position(|column| column == name);
        Self {
            t: find("t"),
            x: find("x"),
            y: find("y"),
            z: find("z"),
            yaw: find("yaw"),
            v: find("v"),
            vy: find("vy"),
            a: find("a"),
        }
    }

    fn candidate(&self, now: Time, file: &CandidateFile) -> Candidate {
        let message = CandidateTrajectory {
            header: header(now),
            generator_id: file.generator.0,
            points: file.points.iter().map(|row| self.point(row)).collect(),
            ..CandidateTrajectory::default()
        };
        Candidate::new(Arc::new(message), file.generator.0.to_string().into(), file.sample)
    }

    fn point(&self, row: &[Number]) -> TrajectoryPoint {
        let get =
            |column: Option<usize>| column.and_then(|index| row.get(index)).copied().unwrap_or_default();
        TrajectoryPoint {
            time_from_start: Duration::from_nanoseconds(nanoseconds(get(self.t))),
            pose: pose(get(self.x), get(self.y), get(self.z), get(self.yaw)),
            longitudinal_velocity_mps: get(self.v).0 as f32,
            lateral_velocity_mps: get(self.vy).0 as f32,
            acceleration_mps2: get(self.a).0 as f32,
            ..TrajectoryPoint::default()
        }
    }
}

/// Whole nanoseconds; all durations of a sequence are differences of these.
fn nanoseconds(seconds: Number) -> i64 {
    (seconds.0 * 1e9).round() as i64
}

fn header(stamp: Time) -> Header {
    Header { stamp, frame_id: FRAME.to_owned() }
}

fn pose(x: Number, y: Number, z: Number, yaw: Number) -> Pose {
    Pose { position: Point { x: x.0, y: y.0, z: z.0 }, orientation: Quaternion::from_yaw(yaw.0) }
}

fn along(x: Number) -> Vector3 {
    Vector3 { x: x.0, y: 0.0, z: 0.0 }
}

fn odometry(header: &Header, file: &OdometryFile) -> Odometry {
    let mut odometry =
        Odometry { header: header.clone(), child_frame_id: "base_link".to_owned(), ..Odometry::default() };
    odometry.pose.pose = pose(file.x, file.y, file.z, file.yaw);
    odometry.twist.twist.linear = along(file.vx);
    odometry
}

fn acceleration(header: &Header, file: &AccelerationFile) -> AccelWithCovarianceStamped {
    let header = Header { frame_id: "base_link".to_owned(), ..header.clone() };
    let mut acceleration = AccelWithCovarianceStamped { header, ..AccelWithCovarianceStamped::default() };
    acceleration.accel.accel.linear = along(file.ax);
    acceleration
}

fn object(file: &ObjectFile) -> PredictedObject {
    let class = |&(label, probability): &(u8, Number)| ObjectClassification {
        label,
        probability: probability.0 as f32,
    };
    let mut object = PredictedObject {
        object_id: file.id.0,
        existence_probability: 1.0,
        classification: file.classes.iter().map(class).collect(),
        shape: Shape {
            r#type: file.shape.r#type,
            dimensions: Vector3 { x: file.shape.x.0, y: file.shape.y.0, z: file.shape.z.0 },
            ..Shape::default()
        },
        ..PredictedObject::default()
    };
    object.kinematics.initial_pose_with_covariance.pose = pose(file.x, file.y, file.z, file.yaw);
    object.kinematics.initial_twist_with_covariance.twist.linear = along(file.vx);
    object.kinematics.predicted_paths = file
        .paths
        .iter()
        .map(|path| PredictedPath {
            // The file gives no heights; a path lies at the height of its object.
            path: path.points.iter().map(|&[x, y, yaw]| pose(x, y, file.z, yaw)).collect(),
            time_step: Duration::from_nanoseconds(nanoseconds(path.dt)),
            confidence: path.confidence.0 as f32,
        })
        .collect();
    object
}

fn signal(file: &SignalFile) -> TrafficLightGroup {
    let element = |&(color, shape, status, confidence): &(u8, u8, u8, Number)| TrafficLightElement {
        color,
        shape,
        status,
        confidence: confidence.0 as f32,
    };
    TrafficLightGroup {
        traffic_light_group_id: file.id,
        elements: file.elements.iter().map(element).collect(),
        ..TrafficLightGroup::default()
    }
}

fn segment(id: i64) -> LaneletSegment {
    let preferred = LaneletPrimitive { id, primitive_type: "lane".to_owned() };
    LaneletSegment { primitives: vec![preferred.clone()], preferred_primitive: preferred }
}
