use super::*;

const SCENE: &str = "\
name: bay
vehicle: {wheel_base: 2.8, max_steer_angle: 0.6}
bounds: [-14.0, 18.0, -6, 8.0]
obstacles:
  - [[-14.0, 0.0], [0.0, 0.0], [0.0, -5.5], [3.2, -5.5], [3.2, 0.0], [18.0, 0.0]]
  - [[5.0, 6.0], [6.0, 6.0], [6.0, 7.0], [5.0, 6.0]]
start: {x: -4.0, y: 3.0, yaw: 0.0, v: 0.5}
goal: {x: 1.6, y: -4.1, yaw: 1.5625}
limits: {max_speed_forward: 1.5, max_jerk: 3}
";

fn parse(text: &str) -> Result<ParkingScene, SceneError> {
    ParkingScene::parse(text, "scene.yaml", "stem", &VehicleInfo::default(), &Limits::default())
}

#[test]
fn a_scene_is_read_in_full() {
    let scene = parse(SCENE).unwrap();
    let problem = &scene.problem;
    assert_eq!(scene.name, "bay");
    assert_eq!(problem.vehicle.wheel_base_m(), 2.8);
    assert_eq!(problem.vehicle.dimensions().max_steer_angle_rad, 0.6);
    assert_eq!(problem.vehicle.front_overhang_m(), VehicleInfo::default().front_overhang_m());
    assert_eq!(problem.bounds, [-14.0, 18.0, -6.0, 8.0]);
    assert_eq!(problem.obstacles.iter().map(Vec::len).collect::<Vec<_>>(), [6, 4]);
    assert_eq!(problem.start, PlanarPose::new(-4.0, 3.0, 0.0));
    assert_eq!(problem.start_speed_mps, 0.5);
    assert_eq!(problem.goal, PlanarPose::new(1.6, -4.1, 1.5625));
    assert_eq!(problem.limits.max_speed_forward_mps, 1.5);
    assert_eq!(problem.limits.max_jerk_mps3, 3.0);
    assert_eq!(problem.limits.max_speed_reverse_mps, Limits::default().max_speed_reverse_mps);
}

#[test]
fn what_may_be_missing_has_defaults() {
    let text = "bounds: [-9, 9, -9, 9]\nstart: {x: 0, y: 0, yaw: 0}\ngoal: {x: 5, y: 0, yaw: -31.4}\n";
    let scene = parse(text).unwrap();
    assert_eq!(scene.name, "stem");
    assert_eq!(scene.problem.vehicle, VehicleInfo::default());
    assert_eq!(scene.problem.limits, Limits::default());
    assert!(scene.problem.obstacles.is_empty());
    assert_eq!(scene.problem.start_speed_mps, 0.0);
}

/// One change to the scene, the place and the text of the one error it makes.
#[test]
fn what_is_wrong_is_reported_with_its_place() {
    let cases = [
        ("goal:", "gaol:", "8:1: `gaol` is no key of a scene"),
        ("yaw: 0.0", "heading: 0.0", "7:26: `start.heading` is no key of a scene"),
        ("wheel_base", "wheelbase", "did you mean `wheel_base`?"),
        ("max_jerk", "max_jork", "9:34: `limits.max_jork`"),
        ("limits:", "start:", "9:1: `start` is given twice, first in line 7"),
        ("v: 0.5", "x: 0.5", "7:36: `start.x` is given twice"),
        ("x: 1.6, ", "", "8:7: `goal.x` is missing"),
        ("yaw: 1.5625", "yaw: north", "8:30: `goal.yaw` must be a number"),
        ("yaw: 1.5625", "yaw: .nan", "8:30: `goal.yaw` is NaN"),
        ("y: 3.0", "y: .inf", "7:21: `start.y` is inf"),
        ("-6, 8.0]", "-6]", "3:9: `bounds` must be a list of four numbers"),
        ("-6, 8.0]", "8, -6.0]", "3:9: bounds are"),
        ("-6, 8.0]", "-6, 1e9]", "3:9: bounds are"),
        ("[5.0, 6.0], [6.0, 6.0]", "[5.0], [6.0, 6.0]", "6:6: `obstacles[1]` must be"),
        ("[5.0, 6.0], [6.0, 6.0]", "[.nan, 6.0], [6.0, 6.0]", "6:7: `obstacles[1]` is NaN"),
        (
            "  - [[5.0, 6.0], [6.0, 6.0], [6.0, 7.0], [5.0, 6.0]]",
            "  - [[5.0, 6.0]]",
            "6:5: `obstacles[1]` must be",
        ),
        ("y: 3.0", "y: 9.0", "7:8: `start` is outside the bounds"),
        ("y: 3.0", "y: 0.5", "7:8: `start` is in collision"),
        ("x: 1.6", "x: 0.9", "8:7: `goal` is in collision"),
        ("v: 0.5", "v: 1.6", "7:8: `start.v` is 1.6 m/s"),
        ("v: 0.5", "v: -1.1", "7:8: `start.v` is -1.1 m/s"),
        ("max_jerk: 3", "max_jerk: 0", "9:9: `limits.max_jerk` is 0"),
        ("max_speed_forward: 1.5", "max_speed_forward: -1", "`limits.max_speed_forward` is -1"),
        ("max_steer_angle: 0.6", "max_steer_angle: 35", "2:10: `vehicle`"),
        ("name: bay", "name: [bay]", "1:7: `name` must be a text"),
        ("name: bay", "name: 'bay", "not valid YAML"),
        ("limits: {", "limits: 5 #{", "9:9: `limits` must be a map"),
    ];
    let mut wrong = Vec::new();
    for (from, to, expected) in cases {
        assert!(SCENE.contains(from), "{from}");
        let text = SCENE.replacen(from, to, 1);
        let message = parse(&text).map_or_else(|error| error.to_string(), |_| "no error".to_owned());
        if !(message.contains(expected) && message.starts_with("scene.yaml:")) {
            wrong.push(format!("{to}: {message}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn everything_that_is_wrong_comes_at_once() {
    let text = "bonds: [1, 2]\nstart: {x: a}\nlimits: {max_jerk: .inf}\n";
    let error = parse(text).unwrap_err();
    let keys: Vec<_> = error.problems.iter().map(|p| p.key.clone().unwrap_or_default()).collect();
    assert_eq!(keys, ["bonds", "bounds", "start.x", "start.y", "start.yaw", "goal", "limits.max_jerk"]);
}

#[test]
fn empty_and_foreign_files_are_refused() {
    for text in ["", "# nothing\n", "~\n"] {
        let error = parse(text).unwrap_err();
        assert_eq!(error.problems[0].kind, SceneProblemKind::NoContent, "{text:?}");
    }
    assert!(parse("- 1\n- 2\n").is_err());
    let missing =
        ParkingScene::load(Path::new("/no/such/scene.yaml"), &VehicleInfo::default(), &Limits::default())
            .unwrap_err();
    assert!(matches!(missing.problems[0].kind, SceneProblemKind::Unreadable { .. }));
    assert!(missing.to_string().starts_with("/no/such/scene.yaml: cannot be read"));
}

/// The example scenes of the configuration folder and the shared ones can be read.
#[test]
fn shipped_scenes_are_fine() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let shared = std::env::var_os("SELECTOR_SHARED").map_or_else(|| root.join("../shared"), Into::into);
    for (folder, least) in [(root.join("config/scenes"), 7), (shared.join("data/parking"), 60)] {
        let Ok(entries) = std::fs::read_dir(&folder) else {
            eprintln!("skipped: {} is absent", folder.display());
            continue;
        };
        let is_scene = |path: &std::path::PathBuf| path.extension().is_some_and(|e| e == "yaml");
        let paths: Vec<_> = entries.map(|entry| entry.unwrap().path()).filter(is_scene).collect();
        assert!(paths.len() >= least, "{} scenes in {}", paths.len(), folder.display());
        for path in paths {
            let scene = ParkingScene::load(&path, &VehicleInfo::default(), &Limits::default());
            assert!(scene.is_ok(), "{}", scene.unwrap_err());
        }
    }
}
