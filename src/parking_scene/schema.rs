//! JSON schema of scene files, made from the tables that the reader reads by, for editors that complete and check.

use serde_json::{Map, Value, json};

use super::reader::{GOAL_KEYS, LIMIT_FIELDS, START_KEYS, VEHICLE_FIELDS};
use open_space::Limits;

/// The schema.
#[must_use]
pub fn schema() -> Value {
    let vehicle = VEHICLE_FIELDS.map(|(name, _)| name);
    let limits = LIMIT_FIELDS.map(|(name, _)| name);
    json!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "Parking scene",
        "description": "A scene for `park`: metres, radians, seconds; poses are those of the middle of the rear axle.",
        "type": "object",
        "additionalProperties": false,
        "required": ["bounds", "start", "goal"],
        "properties": {
            "name": { "type": "string", "description": "What the scene is called; else the name of its file." },
            "vehicle": group(&vehicle, &[], &json!({ "type": "number" }), "Dimensions that differ from the configured vehicle."),
            "bounds": {
                "type": "array", "minItems": 4, "maxItems": 4, "items": { "type": "number" },
                "description": "x_min, x_max, y_min, y_max of the reference point.",
            },
            "obstacles": {
                "type": "array",
                "description": "Polylines: a closed one (first point = last) is a solid polygon, an open one a wall.",
                "items": {
                    "type": "array", "minItems": 2,
                    "items": { "type": "array", "minItems": 2, "maxItems": 2, "items": { "type": "number" } },
                },
            },
            "start": group(&START_KEYS, &GOAL_KEYS, &json!({ "type": "number" }), "Where the vehicle is, and its speed along the heading."),
            "goal": group(&GOAL_KEYS, &GOAL_KEYS, &json!({ "type": "number" }), "Where it shall stand."),
            "limits": group(&limits, &[], &json!({ "type": "number", "minimum": Limits::SMALLEST }), "Limits that differ from the configured ones."),
        },
    })
}

fn group(keys: &[&str], required: &[&str], number: &Value, description: &str) -> Value {
    let properties: Map<String, Value> = keys.iter().map(|key| ((*key).to_owned(), number.clone())).collect();
    json!({
        "type": "object",
        "additionalProperties": false,
        "description": description,
        "required": required,
        "properties": properties,
    })
}

#[cfg(test)]
mod tests {
    use super::super::reader::SCENE_KEYS;
    use super::*;

    #[test]
    fn the_schema_knows_the_keys_of_the_reader() {
        let schema = schema();
        let mut keys: Vec<&str> =
            schema["properties"].as_object().unwrap().keys().map(String::as_str).collect();
        let mut read = SCENE_KEYS.to_vec();
        keys.sort_unstable();
        read.sort_unstable();
        assert_eq!(keys, read);
        assert_eq!(schema["properties"]["vehicle"]["properties"].as_object().unwrap().len(), 10);
    }
}
