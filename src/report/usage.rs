//! What the process has used, as Linux tells it. Where it does not tell, nothing is said.

/// Clock ticks per second of `/proc/self/stat`; the kernel's user interface fixes it.
const TICKS_PER_SECOND: f64 = 100.0;

/// Processor time of all threads so far, s.
#[must_use]
pub fn cpu_s() -> Option<f64> {
    let stat = std::fs::read_to_string("/proc/self/stat").ok()?;
    // The second field is the program's name in parentheses and may contain blanks.
    let mut fields = stat.rsplit_once(')')?.1.split_whitespace().skip(11);
    let (user, system): (f64, f64) = (fields.next()?.parse().ok()?, fields.next()?.parse().ok()?);
    Some((user + system) / TICKS_PER_SECOND)
}

/// Largest resident memory so far, MB (10^6 bytes).
pub(super) fn peak_memory_mb() -> Option<f64> {
    memory_mb("VmHWM:")
}

/// Resident memory now, MB (10^6 bytes).
pub(crate) fn resident_memory_mb() -> Option<f64> {
    memory_mb("VmRSS:")
}

fn memory_mb(key: &str) -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix(key))?;
    let kibibytes: f64 = line.split_whitespace().next()?.parse().ok()?;
    Some(kibibytes * 1024.0 / 1e6)
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::*;

    #[test]
    fn linux_tells() {
        assert!(cpu_s().unwrap() >= 0.0);
        assert!(peak_memory_mb().unwrap() >= resident_memory_mb().unwrap());
        assert!(resident_memory_mb().unwrap() > 0.5);
    }
}
