use super::*;
use std::fs;
use tempfile::TempDir;

const UP: &str = "0x1043";
const UP_WITHOUT_MULTICAST: &str = "0x43";
const DOWN: &str = "0x1002";
const LOOPBACK: &str = "0x49";

/// A host on which all is well.
fn good_host() -> TempDir {
    let host = tempfile::tempdir().unwrap();
    for (path, text) in [
        ("sys/class/net/lo/flags", LOOPBACK),
        ("sys/class/net/eth0/flags", UP),
        ("sys/class/net/eth1/flags", DOWN),
        ("proc/sys/net/ipv4/ip_local_port_range", "32768\t60999"),
        ("proc/sys/net/core/rmem_max", "8388608"),
        ("sys/devices/system/clocksource/clocksource0/current_clocksource", "tsc"),
        ("proc/self/status", "Name:\tx\nCpus_allowed:\tf\nCpus_allowed_list:\t0-3\nMems_allowed_list:\t0\n"),
        ("sys/fs/cgroup/cpu.max", "max 100000"),
        ("sys/devices/system/cpu/cpu0/cpufreq/scaling_governor", "performance"),
        ("sys/devices/system/cpu/cpu1/cpufreq/scaling_governor", "performance"),
    ] {
        put(&host, path, text);
    }
    host
}

fn put(host: &TempDir, path: &str, text: &str) {
    let path = host.path().join(path);
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    fs::write(path, format!("{text}\n")).unwrap();
}

fn look(host: &TempDir, variables: &[(&str, &str)]) -> DoctorReport {
    run(host.path(), |asked| {
        variables.iter().find(|(name, _)| *name == asked).map(|(_, value)| OsString::from(value))
    })
}

/// The one check that is not well.
fn complaint(host: &TempDir, variables: &[(&str, &str)]) -> Check {
    let report = look(host, variables);
    let unwell: Vec<&Check> = report.checks.iter().filter(|check| check.status != Status::Ok).collect();
    assert_eq!(unwell.len(), 1, "{report}");
    unwell[0].clone()
}

#[test]
fn all_is_well() {
    let report = look(&good_host(), &[]);
    assert!(
        report.checks.iter().all(|check| check.status == Status::Ok && check.advice.is_none()),
        "{report}"
    );
    let found: Vec<(&str, &str)> =
        report.checks.iter().map(|check| (check.name, check.found.as_str())).collect();
    assert_eq!(
        found,
        [
            ("environment", "discovery SUBNET, services as rmw_fastrtps"),
            ("domain", "0 (UDP ports from 7400)"),
            ("interfaces", "up: eth0, lo"),
            ("multicast", "eth0"),
            ("receive_buffer", "8388608 bytes"),
            ("clock_source", "tsc"),
            ("cores", "4"),
            ("cpu_governor", "performance"),
        ]
    );
}

#[test]
fn each_thing_that_is_not_well_is_told_with_advice() {
    for (path, text, name, found, advice) in [
        (
            "proc/sys/net/core/rmem_max",
            "8388607",
            "receive_buffer",
            "8388607 bytes",
            "sysctl -w net.core.rmem_max=8388608",
        ),
        ("proc/sys/net/core/rmem_max", "212992", "receive_buffer", "212992 bytes", "sysctl"),
        (
            "sys/devices/system/clocksource/clocksource0/current_clocksource",
            "hpet",
            "clock_source",
            "hpet",
            "clock",
        ),
        ("proc/self/status", "Cpus_allowed_list: 3", "cores", "1", "one after another"),
        ("sys/fs/cgroup/cpu.max", "150000 100000", "cores", "1", "one after another"),
        (
            "sys/devices/system/cpu/cpu1/cpufreq/scaling_governor",
            "powersave",
            "cpu_governor",
            "performance, powersave",
            "cpupower",
        ),
        ("sys/class/net/eth0/flags", UP_WITHOUT_MULTICAST, "multicast", "none", "only nodes on this host"),
        (
            "proc/sys/net/ipv4/ip_local_port_range",
            "1024 65535",
            "domain",
            "0 (UDP ports from 7400)",
            "up to 0",
        ),
    ] {
        let host = good_host();
        put(&host, path, text);
        let check = complaint(&host, &[]);
        assert_eq!((check.name, check.status, check.found.as_str()), (name, Status::Warn, found));
        assert!(check.advice.as_deref().unwrap().contains(advice), "{check:?}");
    }
}

#[test]
fn domains_beside_the_ports_of_other_programs() {
    let host = good_host();
    for (domain, well) in
        [("101", true), ("102", false), ("150", false), ("214", false), ("215", true), ("232", true)]
    {
        let report = look(&host, &[("ROS_DOMAIN_ID", domain)]);
        let check = report.checks.iter().find(|check| check.name == "domain").unwrap();
        assert_eq!(check.status == Status::Ok, well, "{domain}: {check:?}");
        assert!(check.advice.as_deref().is_none_or(|advice| advice.ends_with("up to 101")), "{check:?}");
    }
    // the ports of one domain lie on both sides
    put(&host, "proc/sys/net/ipv4/ip_local_port_range", "32700 60999");
    let check = complaint(&host, &[("ROS_DOMAIN_ID", "101")]);
    assert!(check.name == "domain" && check.advice.unwrap().ends_with("up to 100"));
}

#[test]
fn networks() {
    let put_interfaces = |lo: &str, eth0: &str| {
        let host = good_host();
        put(&host, "sys/class/net/lo/flags", lo);
        put(&host, "sys/class/net/eth0/flags", eth0);
        host
    };
    let local = [("ROS_LOCALHOST_ONLY", "1")];
    for (lo, eth0, variables, interfaces, multicast) in [
        (LOOPBACK, UP, &[][..], Status::Ok, Status::Ok),
        (LOOPBACK, DOWN, &[], Status::Warn, Status::Warn),
        (DOWN, DOWN, &[], Status::Fail, Status::Warn),
        (LOOPBACK, DOWN, &local, Status::Ok, Status::Ok),
        ("0x1049", DOWN, &[], Status::Warn, Status::Warn), // groups on loopback reach nobody else
        ("0x8", UP, &local, Status::Fail, Status::Ok),
        ("garbage", UP, &[], Status::Ok, Status::Ok),
    ] {
        let report = look(&put_interfaces(lo, eth0), variables);
        let status = |name| report.checks.iter().find(|check| check.name == name).unwrap().status;
        assert_eq!((status("interfaces"), status("multicast")), (interfaces, multicast), "{report}");
    }
}

#[test]
fn an_environment_that_the_node_refuses_is_a_failure() {
    for (variables, status, found) in [
        ([("ROS_DOMAIN_ID", "300")], Status::Fail, "ROS_DOMAIN_ID is `300`"),
        ([("ROS_AUTOMATIC_DISCOVERY_RANGE", "OFF")], Status::Fail, "ROS_AUTOMATIC_DISCOVERY_RANGE is OFF"),
        ([("RMW_IMPLEMENTATION", "rmw_zenoh_cpp")], Status::Warn, "services as rmw_fastrtps"),
    ] {
        let check = complaint(&good_host(), &variables);
        assert_eq!((check.name, check.status), ("environment", status));
        assert!(check.found.contains(found), "{check:?}");
    }
}

#[test]
fn a_system_that_tells_nothing_is_unknown_and_no_failure() {
    let report = look(&tempfile::tempdir().unwrap(), &[]);
    assert_eq!(report.with(Status::Fail).count(), 0, "{report}");
    let unknown: Vec<&str> =
        report.checks.iter().filter(|check| check.found == "unknown").map(|check| check.name).collect();
    assert_eq!(unknown, ["interfaces", "multicast", "receive_buffer", "clock_source", "cores"]);
}

#[test]
fn the_text_for_people() {
    let host = good_host();
    put(&host, "proc/sys/net/core/rmem_max", "4194304");
    let text = look(&host, &[]).to_string();
    assert!(text.contains("ok    clock_source    tsc\n"), "{text}");
    assert!(text.contains("warn  receive_buffer  4194304 bytes\n"), "{text}");
    assert!(
        text.contains("                      wanted: net.core.rmem_max of at least 8388608 bytes\n"),
        "{text}"
    );
}

#[test]
fn the_keys_of_the_json() {
    let host = good_host();
    put(&host, "proc/sys/net/core/rmem_max", "1");
    let json = serde_json::to_value(look(&host, &[])).unwrap();
    let checks = json["checks"].as_array().unwrap();
    for check in checks {
        let keys: Vec<&String> = check.as_object().unwrap().keys().collect();
        assert_eq!(keys, ["name", "status", "found", "wanted", "advice"]);
    }
    let statuses: Vec<&str> = checks.iter().map(|check| check["status"].as_str().unwrap()).collect();
    assert_eq!(statuses, ["ok", "ok", "ok", "ok", "warn", "ok", "ok", "ok"]);
}
