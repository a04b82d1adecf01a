//! `doctor`: is this host fit to run the node?
//!
//! Looks, and changes nothing. Files of the system are read below a root folder and variables through a function, so
//! that any host can be described to it. What cannot be read is said to be unknown, which is no failure.

mod host;

use std::ffi::OsString;
use std::fmt;
use std::path::Path;

use serde::Serialize;

use crate::ros::environment::{Discovery, Environment, EnvironmentError};
use host::{Host, Interface};

/// Receive buffer that the middleware asks for; maps of many megabytes come through it.
const WANTED_RECEIVE_BUFFER_BYTES: u64 = 8 << 20;
/// Cores that the program is made for.
const WANTED_CORES: usize = 2;
/// Clocks that are read without asking the kernel, on the machines that Linux runs on.
const FAST_CLOCKS: [&str; 5] =
    ["tsc", "arch_sys_counter", "kvm-clock", "hyperv_clocksource_tsc_page", "riscv_clocksource"];
/// First UDP port of domain 0 and the ports between domains, by the specification of DDS.
const FIRST_PORT: u32 = 7400;
const PORTS_PER_DOMAIN: u32 = 250;
/// Ports of a domain that are used when 50 nodes run on one host.
const PORTS_IN_USE: u32 = 110;

/// How a check went.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Status {
    /// As it should be.
    Ok,
    /// The node runs, but not as well as it could, or with less than may be expected.
    Warn,
    /// The node does not run, or nobody hears it.
    Fail,
}

/// One thing that was looked at.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Check {
    /// Stable name.
    pub name: &'static str,
    /// How it went.
    pub status: Status,
    /// What there is.
    pub found: String,
    /// What there should be.
    pub wanted: String,
    /// What to do; none when all is well.
    pub advice: Option<String>,
}

/// Everything that was looked at. Its `Display` form is for people.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct DoctorReport {
    /// In a fixed order.
    pub checks: Vec<Check>,
}

impl DoctorReport {
    /// The checks that went like this.
    pub fn with(&self, status: Status) -> impl Iterator<Item = &Check> {
        self.checks.iter().filter(move |check| check.status == status)
    }
}

/// Looks at the host whose file system is at `root` and whose variables `lookup` knows.
pub fn run(root: &Path, lookup: impl Fn(&str) -> Option<OsString>) -> DoctorReport {
    let host = Host::new(root);
    let environment = Environment::read(lookup);
    let discovery = environment.as_ref().map_or(Discovery::default(), |environment| environment.discovery);
    let interfaces = host.interfaces();
    DoctorReport {
        checks: vec![
            check_environment(&environment),
            check_domain(environment.as_ref().map_or(0, |environment| environment.domain_id), &host),
            check_interfaces(interfaces.as_deref(), discovery),
            check_multicast(interfaces.as_deref(), discovery),
            check_receive_buffer(&host),
            check_clock(&host),
            check_cores(&host),
            check_governor(&host),
        ],
    }
}

fn check(name: &'static str, wanted: impl fmt::Display, found: impl fmt::Display) -> Check {
    Check { name, status: Status::Ok, found: found.to_string(), wanted: wanted.to_string(), advice: None }
}

impl Check {
    fn or(self, status: Status, advice: impl fmt::Display) -> Self {
        Self { status, advice: Some(advice.to_string()), ..self }
    }

    /// Where nothing can be read, nothing is known to be wrong.
    fn unknown(name: &'static str, wanted: impl fmt::Display) -> Self {
        check(name, wanted, "unknown")
            .or(Status::Warn, "this system does not tell; see its own documentation")
    }
}

fn check_environment(environment: &Result<Environment, EnvironmentError>) -> Check {
    const NAME: &str = "environment";
    const WANTED: &str = "variables of ROS that the node can follow";
    match environment {
        Err(error) => check(NAME, WANTED, error).or(Status::Fail, "the node does not start like this"),
        Ok(Environment { discovery, service_mapping, notes, .. }) => {
            let found = format!("discovery {discovery}, services as {service_mapping}");
            let notes: Vec<String> = notes.iter().map(ToString::to_string).collect();
            match notes.is_empty() {
                true => check(NAME, WANTED, found),
                false => check(NAME, WANTED, found).or(Status::Warn, notes.join("; ")),
            }
        }
    }
}

/// Ports of a high domain overlap those that the kernel hands out to anybody.
fn check_domain(domain: u16, host: &Host<'_>) -> Check {
    const NAME: &str = "domain";
    let first = FIRST_PORT + PORTS_PER_DOMAIN * u32::from(domain);
    let found = format!("{domain} (UDP ports from {first})");
    let Some((low, high)) = host.ephemeral_ports() else {
        return check(NAME, "ports that the kernel does not hand out", found);
    };
    let wanted = format!("ports that the kernel does not hand out ({low} to {high})");
    if first + PORTS_IN_USE > low && first <= high {
        let highest = low.saturating_sub(FIRST_PORT + PORTS_IN_USE) / PORTS_PER_DOMAIN;
        let advice = format!("other programs may hold these ports: choose a ROS_DOMAIN_ID up to {highest}");
        check(NAME, wanted, found).or(Status::Warn, advice)
    } else {
        check(NAME, wanted, found)
    }
}

fn check_interfaces(interfaces: Option<&[Interface]>, discovery: Discovery) -> Check {
    const NAME: &str = "interfaces";
    let wanted = match discovery {
        Discovery::Subnet => "a network interface that is up besides loopback",
        Discovery::Localhost => "loopback up",
    };
    let Some(interfaces) = interfaces else { return Check::unknown(NAME, wanted) };
    let up: Vec<&Interface> = interfaces.iter().filter(|interface| interface.is_up()).collect();
    let names = |list: &[&Interface]| list.iter().map(|i| i.name.as_str()).collect::<Vec<_>>().join(", ");
    let found = if up.is_empty() { "none up".to_owned() } else { format!("up: {}", names(&up)) };
    let found = check(NAME, wanted, found);
    let loopback = up.iter().any(|interface| interface.is_loopback());
    let network = up.iter().any(|interface| !interface.is_loopback());
    match discovery {
        _ if up.is_empty() => found.or(Status::Fail, "bring an interface up: `ip link set lo up`"),
        Discovery::Localhost if !loopback => {
            found.or(Status::Fail, "discovery is restricted to this host: `ip link set lo up`")
        }
        Discovery::Subnet if !network => found.or(Status::Warn, "other hosts cannot be reached"),
        _ => found,
    }
}

fn check_multicast(interfaces: Option<&[Interface]>, discovery: Discovery) -> Check {
    const NAME: &str = "multicast";
    const WANTED: &str = "an interface that is up and can send to groups";
    if discovery == Discovery::Localhost {
        return check(NAME, "nothing: discovery is restricted to this host", "not needed");
    }
    let Some(interfaces) = interfaces else { return Check::unknown(NAME, WANTED) };
    let able: Vec<&str> = interfaces
        .iter()
        .filter(|interface| interface.is_up() && !interface.is_loopback() && interface.has_multicast())
        .map(|interface| interface.name.as_str())
        .collect();
    if able.is_empty() {
        let advice =
            "only nodes on this host will be found; switch it on with `ip link set DEVICE multicast on`";
        return check(NAME, WANTED, "none").or(Status::Warn, advice);
    }
    check(NAME, WANTED, able.join(", "))
}

fn check_receive_buffer(host: &Host<'_>) -> Check {
    const NAME: &str = "receive_buffer";
    let wanted = format!("net.core.rmem_max of at least {WANTED_RECEIVE_BUFFER_BYTES} bytes");
    match host.largest_receive_buffer() {
        None => Check::unknown(NAME, wanted),
        Some(bytes) if bytes < WANTED_RECEIVE_BUFFER_BYTES => {
            let advice = format!(
                "maps of many megabytes will come seconds late: `sysctl -w net.core.rmem_max={WANTED_RECEIVE_BUFFER_BYTES}`"
            );
            check(NAME, wanted, format!("{bytes} bytes")).or(Status::Warn, advice)
        }
        Some(bytes) => check(NAME, wanted, format!("{bytes} bytes")),
    }
}

fn check_clock(host: &Host<'_>) -> Check {
    const NAME: &str = "clock_source";
    let wanted = format!("a clock that is read without the kernel ({})", FAST_CLOCKS.join(", "));
    match host.clock_source() {
        None => Check::unknown(NAME, wanted),
        Some(clock) if FAST_CLOCKS.contains(&clock.as_str()) => check(NAME, wanted, clock),
        Some(clock) => {
            let advice =
                "every reading of the clock costs a microsecond or more, and there are many in a cycle";
            check(NAME, wanted, clock).or(Status::Warn, advice)
        }
    }
}

fn check_cores(host: &Host<'_>) -> Check {
    const NAME: &str = "cores";
    let wanted = format!("at least {WANTED_CORES}");
    match host.usable_cores() {
        None => Check::unknown(NAME, wanted),
        Some(cores) if cores < WANTED_CORES => {
            let advice = "candidates are judged one after another, and messages wait while they are";
            check(NAME, wanted, cores).or(Status::Warn, advice)
        }
        Some(cores) => check(NAME, wanted, cores),
    }
}

/// Virtual machines and many boards have no governor: the frequency is not theirs to change.
fn check_governor(host: &Host<'_>) -> Check {
    const NAME: &str = "cpu_governor";
    const WANTED: &str = "performance, or none";
    let governors = host.governors();
    let found = if governors.is_empty() { "none".to_owned() } else { governors.join(", ") };
    if governors.iter().all(|governor| governor == "performance") {
        check(NAME, WANTED, found)
    } else {
        let advice = "cycles after a pause start on slow cores: `cpupower frequency-set -g performance`";
        check(NAME, WANTED, found).or(Status::Warn, advice)
    }
}

impl fmt::Display for DoctorReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for Check { name, status, found, wanted, advice } in &self.checks {
            let status = match status {
                Status::Ok => "ok",
                Status::Warn => "warn",
                Status::Fail => "FAIL",
            };
            writeln!(f, "{status:<5} {name:<15} {found}")?;
            if let Some(advice) = advice {
                writeln!(f, "      {:<15} wanted: {wanted}", "")?;
                writeln!(f, "      {:<15} {advice}", "")?;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
