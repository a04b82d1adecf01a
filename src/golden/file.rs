//! The shape of the file, as far as it is used.

use std::collections::BTreeMap;

use messages::unique_identifier_msgs::Uuid;
use serde::Deserialize;
use serde::de::{Deserializer, Error};
use serde_json::Value;

use crate::json::Number;

#[derive(Deserialize)]
pub(super) struct SequenceFile {
    pub(super) name: String,
    #[serde(default)]
    pub(super) tags: Vec<String>,
    pub(super) map: String,
    pub(super) vehicle: VehicleFile,
    #[serde(default)]
    pub(super) params: Value,
    pub(super) filters: Vec<String>,
    pub(super) columns: Vec<String>,
    pub(super) cycles: Vec<CycleFile>,
    pub(super) expected: Vec<Vec<ExpectedFile>>,
}

/// Only the format, to tell a file of another kind from a damaged one.
#[derive(Deserialize)]
pub(super) struct FormatOnly {
    pub(super) format: String,
}

#[derive(Deserialize)]
pub(super) struct VehicleFile {
    pub(super) wheel_radius: Number,
    pub(super) wheel_width: Number,
    pub(super) wheel_base: Number,
    pub(super) wheel_tread: Number,
    pub(super) front_overhang: Number,
    pub(super) rear_overhang: Number,
    pub(super) left_overhang: Number,
    pub(super) right_overhang: Number,
    pub(super) vehicle_height: Number,
    pub(super) max_steer_angle: Number,
}

#[derive(Deserialize)]
pub(super) struct CycleFile {
    pub(super) time: Number,
    pub(super) odometry: Option<OdometryFile>,
    pub(super) acceleration: Option<AccelerationFile>,
    pub(super) objects: Option<Vec<ObjectFile>>,
    pub(super) signals: Option<Vec<SignalFile>>,
    pub(super) route: Option<Vec<i64>>,
    pub(super) params: Option<Value>,
    pub(super) candidates: Vec<CandidateFile>,
}

#[derive(Deserialize)]
pub(super) struct OdometryFile {
    pub(super) x: Number,
    pub(super) y: Number,
    pub(super) z: Number,
    pub(super) yaw: Number,
    pub(super) vx: Number,
}

#[derive(Deserialize)]
pub(super) struct AccelerationFile {
    pub(super) ax: Number,
}

#[derive(Deserialize)]
pub(super) struct ObjectFile {
    pub(super) id: HexId,
    pub(super) classes: Vec<(u8, Number)>,
    pub(super) x: Number,
    pub(super) y: Number,
    pub(super) z: Number,
    pub(super) yaw: Number,
    pub(super) vx: Number,
    pub(super) shape: ShapeFile,
    pub(super) paths: Vec<PathFile>,
}

#[derive(Deserialize)]
pub(super) struct ShapeFile {
    pub(super) r#type: u8,
    pub(super) x: Number,
    pub(super) y: Number,
    pub(super) z: Number,
}

#[derive(Deserialize)]
pub(super) struct PathFile {
    pub(super) confidence: Number,
    pub(super) dt: Number,
    pub(super) points: Vec<[Number; 3]>,
}

#[derive(Deserialize)]
pub(super) struct SignalFile {
    pub(super) id: i64,
    pub(super) elements: Vec<(u8, u8, u8, Number)>,
}

#[derive(Deserialize)]
pub(super) struct CandidateFile {
    pub(super) generator: HexId,
    pub(super) sample: u32,
    #[serde(default)]
    pub(super) note: String,
    pub(super) valid: Option<bool>,
    pub(super) data_validity: Option<u8>,
    pub(super) points: Vec<Vec<Number>>,
}

/// Verdicts by filter name, with keys of other kinds between them.
pub(super) type ExpectedFile = BTreeMap<String, Value>;

#[derive(Deserialize)]
pub(super) struct VerdictFile {
    pub(super) feasible: Option<bool>,
    #[serde(default)]
    pub(super) metrics: Vec<(String, Number, u8)>,
    #[serde(default)]
    pub(super) safety_factors: Vec<(HexId, Number, Number)>,
    pub(super) error: Option<String>,
    pub(super) throws: Option<String>,
    pub(super) true_nearest: Option<Box<VerdictFile>>,
}

/// An identity as 32 hexadecimal digits, byte 0 first.
#[derive(Clone, Copy)]
pub(super) struct HexId(pub(super) Uuid);

impl<'de> Deserialize<'de> for HexId {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = String::deserialize(deserializer)?;
        let number = u128::from_str_radix(&text, 16).ok().filter(|_| text.len() == 32);
        let number = number
            .ok_or_else(|| D::Error::custom(format!("`{text}` is not an id of 32 hexadecimal digits")))?;
        Ok(Self(Uuid { uuid: number.to_be_bytes() }))
    }
}
