//! What Linux says about itself in its files.

use std::fs::File;
use std::io::Read as _;
use std::path::Path;

/// More than any of these files holds.
const MAX_BYTES: u64 = 64 << 10;

// Flags of an interface, from the kernel's `if.h`.
const UP: u32 = 0x1;
const LOOPBACK: u32 = 0x8;
const MULTICAST: u32 = 0x1000;

/// A host, described by the files below a folder.
#[derive(Debug)]
pub(super) struct Host<'a> {
    root: &'a Path,
}

/// A network interface.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Interface {
    pub(super) name: String,
    flags: u32,
}

impl Interface {
    pub(super) fn is_up(&self) -> bool {
        self.flags & UP != 0
    }

    pub(super) fn is_loopback(&self) -> bool {
        self.flags & LOOPBACK != 0
    }

    pub(super) fn has_multicast(&self) -> bool {
        self.flags & MULTICAST != 0
    }
}

impl<'a> Host<'a> {
    pub(super) fn new(root: &'a Path) -> Self {
        Self { root }
    }

    /// The text of a file without blanks around it.
    fn read(&self, path: &str) -> Option<String> {
        let mut text = String::new();
        File::open(self.root.join(path)).ok()?.take(MAX_BYTES).read_to_string(&mut text).ok()?;
        Some(text.trim().to_owned())
    }

    /// Names in a folder, sorted.
    fn names(&self, folder: &str) -> Option<Vec<String>> {
        let entries = std::fs::read_dir(self.root.join(folder)).ok()?;
        let mut names: Vec<String> =
            entries.filter_map(|entry| entry.ok()?.file_name().into_string().ok()).collect();
        names.sort_unstable();
        Some(names)
    }

    /// All network interfaces, by name.
    pub(super) fn interfaces(&self) -> Option<Vec<Interface>> {
        let interface = |name: String| {
            let flags = self.read(&format!("sys/class/net/{name}/flags"))?;
            let flags = u32::from_str_radix(flags.strip_prefix("0x")?, 16).ok()?;
            Some(Interface { name, flags })
        };
        Some(self.names("sys/class/net")?.into_iter().filter_map(interface).collect())
    }

    /// Ports that the kernel hands out to programs that ask for any.
    pub(super) fn ephemeral_ports(&self) -> Option<(u32, u32)> {
        let text = self.read("proc/sys/net/ipv4/ip_local_port_range")?;
        let mut ports = text.split_whitespace().map_while(|port| port.parse().ok());
        Some((ports.next()?, ports.next()?))
    }

    /// The largest receive buffer that a socket can have, in bytes.
    pub(super) fn largest_receive_buffer(&self) -> Option<u64> {
        self.read("proc/sys/net/core/rmem_max")?.parse().ok()
    }

    pub(super) fn clock_source(&self) -> Option<String> {
        self.read("sys/devices/system/clocksource/clocksource0/current_clocksource")
    }

    /// Cores that this process may run on, and no more than its share of time allows.
    pub(super) fn usable_cores(&self) -> Option<usize> {
        let status = self.read("proc/self/status")?;
        let allowed = status.lines().find_map(|line| line.strip_prefix("Cpus_allowed_list:"))?;
        let allowed = count(allowed.trim())?;
        Some(self.share_of_time().map_or(allowed, |share| allowed.min(share)))
    }

    /// Whole cores that the control group may use at the same time.
    fn share_of_time(&self) -> Option<usize> {
        let text = self.read("sys/fs/cgroup/cpu.max")?;
        let (quota, period) = text.split_once(' ')?;
        let (quota, period): (usize, usize) = (quota.parse().ok()?, period.parse().ok()?);
        Some(quota.checked_div(period)?.max(1))
    }

    /// The different governors of all cores.
    pub(super) fn governors(&self) -> Vec<String> {
        let cores = self.names("sys/devices/system/cpu").unwrap_or_default();
        let mut governors: Vec<String> = cores
            .iter()
            .filter_map(|core| self.read(&format!("sys/devices/system/cpu/{core}/cpufreq/scaling_governor")))
            .collect();
        governors.sort_unstable();
        governors.dedup();
        governors
    }
}

/// The size of a list of numbers and ranges, as in `0-3,8`.
fn count(list: &str) -> Option<usize> {
    list.split(',').try_fold(0, |sum: usize, part| {
        let (first, last) = part.split_once('-').unwrap_or((part, part));
        let (first, last): (usize, usize) = (first.parse().ok()?, last.parse().ok()?);
        sum.checked_add(last.checked_sub(first)?.checked_add(1)?)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_of_cores() {
        for (list, expected) in [
            ("0", Some(1)),
            ("0-1", Some(2)),
            ("0-3,8,10-11", Some(7)),
            ("", None),
            ("a", None),
            ("3-1", None),
            ("0-18446744073709551615", None),
        ] {
            assert_eq!(count(list), expected, "{list:?}");
        }
    }
}
