//! A map described by the fields of `expected.json`.

#![allow(unreachable_pub)]
use std::collections::BTreeMap;

use lanelet_map::{Attributes, Map, Parameter, Polyline};
use serde_json::{Value, json};

use crate::shared::fnv;

/// Fields that an archive and an OSM file have in common.
pub fn describe(map: &Map) -> Value {
    let mut rules = BTreeMap::new();
    let mut parameters = BTreeMap::new();
    for rule in map.regulatory_elements() {
        *rules.entry(rule.subtype().to_owned()).or_insert(0) += 1;
        for role in rule.roles() {
            for parameter in role.parameters() {
                let key = format!("{}/{}/{}", rule.subtype(), role.name(), kind(parameter));
                *parameters.entry(key).or_insert(0) += 1;
            }
        }
    }
    let mut subtypes = BTreeMap::new();
    for lanelet in map.lanelets() {
        *subtypes.entry(lanelet.subtype().unwrap_or("").to_owned()).or_insert(0) += 1;
    }
    json!({
        "layers": {
            "points": layer(map.points().map(|e| e.id())),
            "linestrings": layer(map.line_strings().map(|e| e.id())),
            "polygons": layer(map.polygons().map(|e| e.id())),
            "areas": layer(map.areas().map(|e| e.id())),
            "lanelets": layer(map.lanelets().map(|e| e.id())),
            "regulatory_elements": layer(map.regulatory_elements().map(|e| e.id())),
        },
        "attribute_counts": {
            "points": count(map.points().map(|e| e.attributes())),
            "linestrings": count(map.line_strings().map(|e| e.attributes())),
            "polygons": count(map.polygons().map(|e| e.attributes())),
            "areas": count(map.areas().map(|e| e.attributes())),
            "lanelets": count(map.lanelets().map(|e| e.attributes())),
            "regulatory_elements": count(map.regulatory_elements().map(|e| e.attributes())),
        },
        "lanelet_subtypes": subtypes,
        "lanelets_with_centerline": map.lanelets().filter(|l| l.centerline().is_some()).count(),
        "inverted_bounds": map.lanelets()
            .map(|l| u32::from(l.left().is_inverted()) + u32::from(l.right().is_inverted()))
            .sum::<u32>(),
        "regulatory_element_subtypes": rules,
        "regulatory_element_parameters": parameters,
    })
}

/// `coordinate_range` and `sample_points`.
pub fn coordinates(map: &Map) -> (Value, Value) {
    let mut range: Vec<[f64; 2]> = vec![[f64::INFINITY, f64::NEG_INFINITY]; 3];
    for point in map.points() {
        for (limits, value) in range.iter_mut().zip(point.position()) {
            *limits = [limits[0].min(value), limits[1].max(value)];
        }
    }
    let points: Vec<_> = map.points().collect();
    let samples: Vec<Value> = spread(&points, 5)
        .into_iter()
        .map(|point| {
            let [x, y, z] = point.position();
            json!([point.id(), x, y, z])
        })
        .collect();
    (if points.is_empty() { Value::Null } else { json!(range) }, json!(samples))
}

/// `sample_lanelets`.
pub fn sample_lanelets(map: &Map) -> Value {
    let lanelets: Vec<_> = map.lanelets().collect();
    let samples: Vec<Value> = spread(&lanelets, 3)
        .into_iter()
        .map(|lanelet| {
            let rules: Vec<i64> = lanelet.regulatory_elements().map(|rule| rule.id()).collect();
            let centerline = lanelet.centerline().map(|line| {
                let stored = if line.is_inverted() { line.inverted() } else { line };
                json!({
                    "inverted": line.is_inverted(),
                    "xyz_first": stored.positions().next(),
                    "xyz_last": stored.positions().next_back(),
                    "points": line.len(),
                })
            });
            json!({
                "id": lanelet.id(), "inverted": lanelet.is_inverted(), "subtype": lanelet.subtype(),
                "left": bound(lanelet.left()), "right": bound(lanelet.right()),
                "regulatory_elements": rules, "centerline": centerline,
            })
        })
        .collect();
    json!(samples)
}

fn bound(line: Polyline<'_>) -> Value {
    json!({"id": line.id(), "inverted": line.is_inverted(), "points": line.len()})
}

fn kind(parameter: Parameter<'_>) -> &'static str {
    match parameter {
        Parameter::Point(_) => "point",
        Parameter::LineString(_) => "linestring",
        Parameter::Polygon(_) => "polygon",
        Parameter::Lanelet(_) => "lanelet",
        Parameter::Area(_) => "area",
    }
}

fn layer(ids: impl Iterator<Item = i64>) -> Value {
    let ids: Vec<i64> = ids.collect();
    json!({
        "count": ids.len(),
        "id_sum": ids.iter().fold(0_i64, |sum, id| sum.wrapping_add(*id)),
        "ids_hash": fnv(ids.iter().flat_map(|id| id.to_le_bytes())),
        "first_ids": &ids[..ids.len().min(3)],
        "last_id": ids.last(),
    })
}

fn count<'m>(attributes: impl Iterator<Item = Attributes<'m>>) -> usize {
    attributes.map(|a| a.len()).sum()
}

/// `n` items spread evenly, with the first and the last.
fn spread<T: Copy>(items: &[T], n: usize) -> Vec<T> {
    if items.len() <= n {
        return items.to_vec();
    }
    (0..n).map(|k| items[(items.len() - 1) * k / (n - 1)]).collect()
}
