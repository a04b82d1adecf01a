//! The install script lays the program out where `ros2 run`, `ros2 launch` and systemd look for it, and what is laid
//! out fits together: the launch file names files, topics and arguments that exist.
#![cfg(unix)]
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may fail loudly")]

use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};
use selector_actors::topics::{InputTopic, NODE_NAME, OutputTopic};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::os::unix::fs::PermissionsExt as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use tempfile::TempDir;

const PREFIX: &str = "/opt/somewhere";

/// A program that says with which arguments it was started.
const ECHO: &str = "#!/bin/sh\nprintf '<%s>' \"$@\"\n";

struct Installation {
    folder: TempDir,
}

impl Installation {
    fn new() -> Self {
        let installation = Self { folder: tempfile::tempdir().unwrap() };
        let output = installation.install(&["--prefix", PREFIX]);
        assert!(output.status.success(), "{output:?}");
        installation
    }

    fn install(&self, arguments: &[&str]) -> Output {
        let program = self.folder.path().join("program");
        fs::write(&program, ECHO).unwrap();
        fs::set_permissions(&program, fs::Permissions::from_mode(0o755)).unwrap();
        Command::new("sh")
            .arg(source("packaging/install.sh"))
            .args(arguments)
            .arg("--binary")
            .arg(&program)
            .env("DESTDIR", self.folder.path().join("root"))
            .output()
            .unwrap()
    }

    fn path(&self, below_prefix: &str) -> PathBuf {
        self.folder.path().join("root").join(&PREFIX[1..]).join(below_prefix)
    }

    fn text(&self, below_prefix: &str) -> String {
        let path = self.path(below_prefix);
        fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
    }
}

fn source(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

fn is_executable(path: &Path) -> bool {
    fs::metadata(path).is_ok_and(|file| file.is_file() && file.permissions().mode() & 0o111 == 0o111)
}

/// Name and attributes of every element, in document order.
fn elements(xml: &str) -> Vec<(String, BTreeMap<String, String>)> {
    let mut reader = Reader::from_str(xml);
    let mut found = Vec::new();
    let mut read = |start: &BytesStart<'_>| {
        let attributes = start
            .attributes()
            .map(|attribute| attribute.unwrap())
            .map(|attribute| (attribute.key.as_ref().to_owned(), attribute.value.into_owned()))
            .collect();
        found.push((start.name().as_ref().to_owned(), attributes));
    };
    loop {
        match reader.read_event().unwrap() {
            Event::Start(start) | Event::Empty(start) => read(&start),
            Event::Eof => return found,
            _ => {}
        }
    }
}

/// The names in `$(command NAME)` within a value.
fn substitutions<'a>(value: &'a str, command: &str) -> Vec<&'a str> {
    let opening = format!("$({command} ");
    value.split(opening.as_str()).skip(1).map(|rest| rest.split_once(')').unwrap().0).collect()
}

#[test]
fn everything_is_where_ros_and_systemd_look_for_it() {
    let installation = Installation::new();
    for file in [
        "share/ament_index/resource_index/packages/trajectory_selector",
        "share/trajectory_selector/package.xml",
        "share/trajectory_selector/local_setup.sh",
        "share/trajectory_selector/launch/trajectory_selector.launch.xml",
        "share/trajectory_selector/config/selector.param.yaml",
        "share/trajectory_selector/config/concatenator.param.yaml",
        "share/trajectory_selector/config/validator.param.yaml",
        "share/trajectory_selector/config/ranker.param.yaml",
        "share/trajectory_selector/config/vehicle_info.param.yaml",
        "share/trajectory_selector/schema/validator.schema.json",
        "lib/systemd/system/trajectory-selector.service",
        "lib/sysctl.d/60-trajectory-selector.conf",
    ] {
        assert!(installation.path(file).is_file(), "{file}");
        assert!(!is_executable(&installation.path(file)), "{file}");
        assert!(
            !installation.text(file).contains("@PREFIX@") && !installation.text(file).contains("@VERSION@")
        );
    }
    for file in ["bin/trajectory-selector", "lib/trajectory_selector/trajectory_selector_node"] {
        assert!(is_executable(&installation.path(file)), "{file}");
    }
    let package = installation.text("share/trajectory_selector/package.xml");
    let names: Vec<_> = elements(&package).into_iter().map(|(name, _)| name).collect();
    assert_eq!(names, ["package", "name", "version", "description", "maintainer", "license"]);
    assert!(package.contains(&format!("<version>{}</version>", env!("CARGO_PKG_VERSION"))), "{package}");
    assert!(package.contains("<name>trajectory_selector</name>"));
}

#[test]
fn what_ros_starts_is_the_program_as_a_node() {
    let installation = Installation::new();
    let node = installation.path("lib/trajectory_selector/trajectory_selector_node");
    let link = installation.folder.path().join("link");
    std::os::unix::fs::symlink(&node, &link).unwrap();
    for start in [node, link] {
        let output = Command::new(start)
            .args(["--threads", "2", "--ros-args", "-p", "a:=b c", "-r", "__ns:=/x"])
            .output()
            .unwrap();
        let said = String::from_utf8(output.stdout).unwrap();
        assert_eq!(said, "<node><--threads><2><--ros-args><-p><a:=b c><-r><__ns:=/x>");
    }
}

#[test]
fn the_environment_leads_to_the_package() {
    let installation = Installation::new();
    let script = format!(
        ". {}; printf '%s' \"$AMENT_PREFIX_PATH\"",
        installation.path("share/trajectory_selector/local_setup.sh").display()
    );
    for (before, after) in [(None, PREFIX.to_owned()), (Some("/opt/ros"), format!("{PREFIX}:/opt/ros"))] {
        let mut shell = Command::new("sh");
        shell.args(["-euc", &script]).env_remove("AMENT_PREFIX_PATH");
        before.map(|value| shell.env("AMENT_PREFIX_PATH", value));
        assert_eq!(String::from_utf8(shell.output().unwrap().stdout).unwrap(), after);
    }
}

#[test]
fn the_launch_file_names_what_exists() {
    let installation = Installation::new();
    let launch = installation.text("share/trajectory_selector/launch/trajectory_selector.launch.xml");
    let elements = elements(&launch);
    let all =
        |name: &'static str| elements.iter().filter(move |(element, _)| element == name).map(|(_, at)| at);

    let defaults: BTreeMap<&str, &str> =
        all("arg").map(|at| (at["name"].as_str(), at["default"].as_str())).collect();
    let used: BTreeSet<&str> = elements
        .iter()
        .flat_map(|(_, attributes)| attributes.values())
        .flat_map(|value| substitutions(value, "var"))
        .collect();
    assert_eq!(defaults.keys().copied().collect::<BTreeSet<_>>(), used, "arguments declared and used");
    // the names of upstream
    for name in [
        "trajectory_validator_param_path",
        "trajectory_selector_param_path",
        "trajectory_concatenator_param_path",
        "trajectory_ranker_param_path",
        "input_generative_trajectories",
        "input_backup_trajectories",
        "output_trajectories",
        "input_vector_map",
        "input_odometry",
        "input_objects",
        "input_acceleration",
        "input_traffic_signals",
        "input_route",
    ] {
        assert!(defaults.contains_key(name), "{name}");
    }

    let node: Vec<_> = all("node").collect();
    let [node] = node[..] else { panic!("{} nodes", node.len()) };
    assert_eq!(node["name"], NODE_NAME);
    let program = format!("lib/{}/{}", node["pkg"], node["exec"]);
    assert!(is_executable(&installation.path(&program)), "{program}");

    let mut files = 0;
    for parameters in all("param") {
        let [argument] = substitutions(&parameters["from"], "var")[..] else { panic!("{parameters:?}") };
        let (package, file) = defaults[argument].split_once(")/").unwrap();
        assert_eq!(substitutions(&format!("{package})"), "find-pkg-share"), [node["pkg"].as_str()]);
        assert!(installation.path(&format!("share/{}/{file}", node["pkg"])).is_file(), "{file}");
        files += 1;
    }
    assert_eq!(files, 5);

    let private = |name: String| name.replacen(&format!("/{NODE_NAME}/"), "~/", 1);
    let outputs = [
        OutputTopic::Trajectories,
        OutputTopic::ConcatenatedTrajectories,
        OutputTopic::ValidatedTrajectories,
        OutputTopic::ScoredTrajectories,
        OutputTopic::Trajectory,
        OutputTopic::TurnIndicators,
        OutputTopic::OpenSpaceTrajectory,
    ];
    let topics: BTreeSet<String> = InputTopic::every()
        .map(|topic| private(topic.full_name()))
        .chain(outputs.map(|topic| private(topic.full_name())))
        .collect();
    let remapped: Vec<String> = all("remap").map(|at| at["from"].clone()).collect();
    assert_eq!(remapped.iter().cloned().collect::<BTreeSet<_>>(), topics, "every topic can be remapped");
    assert_eq!(remapped.len(), topics.len(), "each once");
}

#[test]
fn the_service_starts_the_program_and_may_do_nothing_else() {
    let installation = Installation::new();
    let unit = installation.text("lib/systemd/system/trajectory-selector.service");
    let settings: Vec<(&str, &str)> =
        unit.lines().filter(|line| !line.starts_with('#')).filter_map(|line| line.split_once('=')).collect();
    let has = |key: &str, value: &str| assert!(settings.contains(&(key, value)), "{key}={value} is missing");
    has("ExecStart", &format!("{PREFIX}/bin/trajectory-selector node $TRAJECTORY_SELECTOR_ARGS"));
    has("Restart", "on-failure");
    has("RestartPreventExitStatus", "2");
    has("CapabilityBoundingSet", "");
    has("RestrictAddressFamilies", "AF_INET AF_INET6 AF_NETLINK AF_UNIX");
    has("ProtectSystem", "strict");
    has("SystemCallFilter", "@system-service");
    for switch in
        ["DynamicUser", "NoNewPrivileges", "PrivateDevices", "ProtectKernelModules", "MemoryDenyWriteExecute"]
    {
        has(switch, "yes");
    }
}

#[test]
fn installing_again_replaces_and_wrong_arguments_are_told() {
    let installation = Installation::new();
    let program = installation.path("bin/trajectory-selector");
    fs::write(&program, "older").unwrap();
    assert!(installation.install(&["--prefix", PREFIX]).status.success());
    assert_eq!(fs::read_to_string(&program).unwrap(), ECHO);
    for (arguments, reason) in [
        (&["--prefix", "relative"][..], "absolute path: relative"),
        (&["--prefix", "/opt/with blank"], "letters, digits"),
        (&["--prefix", "/opt/a|b"], "letters, digits"),
        (&["--prefx", "/opt"], "unknown argument: --prefx"),
    ] {
        let output = installation.install(arguments);
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        assert!(said.contains(reason), "{said}");
    }
    let missing = Command::new("sh")
        .arg(source("packaging/install.sh"))
        .args(["--prefix", PREFIX, "--binary", "/no/such/program"])
        .env("DESTDIR", installation.folder.path())
        .output()
        .unwrap();
    assert_eq!(missing.status.code(), Some(2));
    assert!(String::from_utf8(missing.stderr).unwrap().contains("no program at /no/such/program"));
}
