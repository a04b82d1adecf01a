//! Golden sequences become the very scenes and candidates that a node would hand to the filters.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may fail loudly")]

use std::fs;
use std::path::PathBuf;

use lanelet_map::{MapBuilder, archive};
use messages::builtin_interfaces::{Duration, Time};
use serde_json::{Value, json};
use trajectory_selector::golden::{ExpectedVerdict, GoldenError, Maps, Sequence, sequence_files};

/// Folders `sequences` and `maps`; the map has no elements.
fn workspace() -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("maps")).unwrap();
    fs::create_dir(folder.path().join("sequences")).unwrap();
    let map = MapBuilder::new().build().unwrap();
    fs::write(folder.path().join("maps/town.bin"), archive::encode(&map)).unwrap();
    let path = folder.path().join("sequences/one.json");
    (folder, path)
}

fn sequence() -> Value {
    json!({
        "format": "trajectory-filters/2", "name": "one", "map": "town.osm", "tags": ["t"], "future_key": 1,
        "vehicle": {
            "wheel_radius": 0.4, "wheel_width": 0.2, "wheel_base": 3.0, "wheel_tread": 1.6, "front_overhang": 1.0,
            "rear_overhang": 1.1, "left_overhang": 0.1, "right_overhang": 0.15, "vehicle_height": 2.5,
            "max_steer_angle": 0.7
        },
        "params": {
            "boundary_departure": {"lateral_margin_m": -0.1},
            "traffic_light": {"amber_rejection": {"hysteresis_duration": 1.5}},
            "crosswalk": {"object_types": ["pedestrian", "motorcycle"]}
        },
        "filters": ["traffic_light_filter", "crosswalk_filter"],
        "columns": ["t", "x", "yaw", "v", "a", "unknown"],
        "cycles": [
            {
                "time": 1690000000.123456,
                "odometry": {"x": 1.0, "y": 2.0, "z": 3.0, "yaw": 0.5, "vx": 4.0},
                "acceleration": {"ax": -0.25},
                "objects": [{
                    "id": "000102030405060708090a0b0c0d0e0f", "classes": [[7, 0.49], [6, 0.5]],
                    "x": 5.0, "y": 6.0, "z": 7.0, "yaw": -1.0, "vx": 1.5,
                    "shape": {"type": 1, "x": 0.6, "y": 0.7, "z": 1.8},
                    "paths": [{"confidence": 0.1, "dt": 0.5, "points": [[5.0, 6.0, -1.0], [5.5, 6.5, -0.9]]}]
                }],
                "signals": [{"id": 42, "elements": [[1, 2, 3, 0.7]]}],
                "route": [10, 11],
                "candidates": [
                    {
                        "generator": "ff000000000000000000000000000001", "sample": 3, "note": "n",
                        "points": [[-0.3, 1.0, 0.0, 16.7, 0.1, 9.0], [0.0, "nan", 0.0, "inf", 0.0, 9.0]],
                        "valid": false, "data_validity": 2
                    }
                ]
            },
            {"time": 0.2, "route": [10, 11], "candidates": [], "params": {"traffic_light": {"amber_rejection": {"reject_if_stop_detected": true}}}},
            {"time": 0.3, "route": [12], "candidates": []}
        ],
        "expected": [
            [{
                "traffic_light_filter": {"throws": "no"},
                "crosswalk_filter": {
                    "feasible": true, "metrics": [],
                    "true_nearest": {
                        "feasible": false, "metrics": [["m", "-inf", 3]],
                        "safety_factors": [["000102030405060708090a0b0c0d0e0f", 5.0, 6.0]]
                    }
                },
                "another_filter": 7,
                "fragile": ["crosswalk_filter"]
            }],
            [],
            []
        ]
    })
}

fn read(file: &Value) -> Result<Sequence, GoldenError> {
    let (_folder, path) = workspace();
    fs::write(&path, file.to_string()).unwrap();
    Sequence::read(&path, &mut Maps::default())
}

#[test]
fn scenes_are_as_a_node_sees_them() {
    let sequence = read(&sequence()).unwrap();
    assert_eq!((sequence.vehicle.wheel_base_m(), sequence.cycles.len()), (3.0, 3));
    let scene = &sequence.cycles[0].scene;
    // The literal is not a whole number of nanoseconds in f64; one multiplication and one rounding define it.
    let now = Time::from_nanoseconds((1_690_000_000.123_456_f64 * 1e9).round() as i64);
    assert_eq!((scene.now, now.sec), (now, 1_690_000_000));
    let odometry = scene.odometry.as_ref().unwrap();
    assert_eq!((odometry.header.stamp, odometry.header.frame_id.as_str()), (now, "map"));
    assert_eq!((odometry.pose.pose.position.z, odometry.twist.twist.linear.x), (3.0, 4.0));
    assert_eq!(odometry.pose.pose.orientation.z.to_bits(), 0.25_f64.sin().to_bits());
    assert_eq!(scene.acceleration.as_ref().unwrap().accel.accel.linear.x, -0.25);

    let object = &scene.objects.as_ref().unwrap().objects[0];
    assert_eq!(object.object_id.uuid, [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15]);
    assert_eq!((object.classification[0].label, object.classification[0].probability), (7, 0.49_f32));
    assert_eq!((object.shape.r#type, object.shape.dimensions.y), (1, 0.7));
    assert_eq!(object.kinematics.initial_twist_with_covariance.twist.linear.x, 1.5);
    let path = &object.kinematics.predicted_paths[0];
    assert_eq!((path.confidence, path.time_step), (0.1_f32, Duration { sec: 0, nanosec: 500_000_000 }));
    assert_eq!((path.path.len(), path.path[1].position.y), (2, 6.5));

    let group = &scene.traffic_signals.as_ref().unwrap().traffic_light_groups[0];
    let element = group.elements[0];
    assert_eq!((group.traffic_light_group_id, element.color, element.shape, element.status), (42, 1, 2, 3));
    assert_eq!(element.confidence, 0.7_f32);
    assert_eq!(scene.frame_id(), Some("map"));
}

#[test]
fn what_a_cycle_lacks_is_not_in_the_scene() {
    let sequence = read(&sequence()).unwrap();
    let scene = &sequence.cycles[1].scene;
    assert!(scene.odometry.is_none() && scene.acceleration.is_none() && scene.objects.is_none());
    assert!(scene.traffic_signals.is_none(), "no message is not an empty message");
}

#[test]
fn a_route_has_a_new_epoch_only_when_it_changes() {
    let sequence = read(&sequence()).unwrap();
    let route = |cycle: usize| sequence.cycles[cycle].scene.route.as_ref().unwrap();
    let number = |cycle: usize| route(cycle).number;
    assert_eq!((number(0), number(1), number(2)), (1, 1, 2));
    let preferred: Vec<i64> =
        route(0).value.segments.iter().map(|segment| segment.preferred_primitive.id).collect();
    assert_eq!(preferred, [10, 11]);
}

#[test]
fn candidates_have_single_precision_and_floored_times() {
    let sequence = read(&sequence()).unwrap();
    let candidate = &sequence.cycles[0].candidates[0];
    assert_eq!(candidate.key.to_string(), "ff000000000000000000000000000001#3");
    let first = candidate.message.points[0];
    assert_eq!(first.time_from_start, Duration { sec: -1, nanosec: 700_000_000 });
    assert_eq!((first.longitudinal_velocity_mps, first.acceleration_mps2), (16.7_f32, 0.1_f32));
    assert_eq!((first.pose.position.x, first.pose.position.y), (1.0, 0.0), "a missing column is zero");
    assert!(candidate.points[1].pose.position.x.is_nan());
    assert_eq!(candidate.points[1].longitudinal_velocity_mps, f32::INFINITY);
    assert_eq!(candidate.message.header.stamp, sequence.cycles[0].scene.now);
}

#[test]
fn parameters_merge_key_by_key_and_may_break_our_ranges() {
    let sequence = read(&sequence()).unwrap();
    let parameters = &sequence.parameters;
    assert_eq!(parameters.boundary_departure.lateral_margin_m, -0.1);
    assert_eq!(parameters.boundary_departure.on_time_buffer_s, 0.15, "the default");
    assert_eq!(parameters.crosswalk.object_types.len(), 2);
    assert!(parameters.filter_names.is_empty() && parameters.shadow_mode_filter_names.is_empty());
    assert!(sequence.cycles[0].parameters.is_none());
    let later = &sequence.cycles[1].parameters.as_ref().unwrap();
    assert_eq!(later.traffic_light.amber_rejection.hysteresis_duration, 1.5, "kept from the file");
    assert!(later.traffic_light.amber_rejection.reject_if_stop_detected);
    assert_eq!(later.boundary_departure.lateral_margin_m, -0.1);
}

#[test]
fn expectations_are_those_that_bind_us() {
    let sequence = read(&sequence()).unwrap();
    let expected = &sequence.cycles[0].expected[0];
    assert_eq!((expected.data_validity, expected.note.as_str()), (2, "n"));
    assert_eq!(expected.fragile, ["crosswalk_filter"]);
    assert_eq!(expected.verdicts.len(), 2, "only the filters of the file");
    assert_eq!(expected.verdicts["traffic_light_filter"], ExpectedVerdict::Error("no".to_owned()));
    let ExpectedVerdict::Judged { feasible, metrics, safety_factors } =
        &expected.verdicts["crosswalk_filter"]
    else {
        panic!("judged")
    };
    assert_eq!((*feasible, metrics[0].value, metrics[0].level), (false, f64::NEG_INFINITY, 3));
    let factor = &safety_factors[0];
    assert_eq!((factor.object_id.uuid[15], factor.x_m, factor.y_m), (15, 5.0, 6.0));
}

#[test]
fn maps_are_decoded_once() {
    let (_folder, path) = workspace();
    fs::write(&path, sequence().to_string()).unwrap();
    let mut maps = Maps::default();
    let [a, b] = [(); 2].map(|()| Sequence::read(&path, &mut maps).unwrap());
    let map = |sequence: &Sequence| sequence.cycles[0].scene.map.clone().unwrap().value.map;
    assert!(std::sync::Arc::ptr_eq(&map(&a), &map(&b)));
}

/// What is changed in the file, and a part of the message.
type Damage = (fn(&mut Value), &'static str);

#[test]
fn files_that_cannot_be_used_say_why() {
    let cases: [Damage; 9] = [
        (|f| f["format"] = "trajectory-ranker/1".into(), "the format is `trajectory-ranker/1`"),
        (|f| drop(f.as_object_mut().unwrap().remove("cycles")), "missing field `cycles`"),
        (|f| f["map"] = "nowhere.osm".into(), "nowhere.osm"),
        (|f| f["vehicle"]["wheel_base"] = 0.into(), "wheel_base"),
        (
            |f| f["params"]["crosswalk"]["nonsense"] = 1.into(),
            "parameters of the file: unknown field `nonsense`",
        ),
        (|f| f["cycles"][1]["params"]["crosswalk"]["stop_duration"] = "long".into(), "parameters of cycle 1"),
        (|f| f["expected"] = json!([]), "expected: not one entry for each cycle"),
        (|f| f["expected"][0] = json!([]), "expected of cycle 0: not one entry for each candidate"),
        (|f| f["expected"][0][0]["crosswalk_filter"] = json!({}), "neither a judgement nor an error"),
    ];
    for (damage, message) in cases {
        let mut file = sequence();
        damage(&mut file);
        let error = read(&file).unwrap_err().to_string();
        assert!(error.contains(message), "`{error}` should say `{message}`");
    }
}

#[test]
fn a_folder_stands_for_its_sequences_in_order() {
    let (folder, path) = workspace();
    assert!(matches!(sequence_files(&[folder.path().join("sequences")]), Err(GoldenError::Empty { .. })));
    fs::write(path.with_file_name("two.json"), "").unwrap();
    fs::write(&path, "").unwrap();
    fs::write(path.with_file_name("notes.md"), "").unwrap();
    let files = sequence_files(&[folder.path().join("sequences"), PathBuf::from("other.json")]).unwrap();
    let names: Vec<_> = files.iter().map(|file| file.file_name().unwrap().to_str().unwrap()).collect();
    assert_eq!(names, ["one.json", "two.json", "other.json"]);
}
