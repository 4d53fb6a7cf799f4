//! The CPU time and memory of a process.

use std::time::Duration;

use rustix::param::clock_ticks_per_second;
use rustix::time::{ClockId, clock_gettime};
use serde::{Deserialize, Serialize};

/// The resources that a process has used so far.
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize, Deserialize)]
pub(super) struct Usage {
    /// CPU time on all cores.
    pub(super) cpu_s: f64,
    /// The peak memory; absent if the system does not report it.
    pub(super) rss_peak_bytes: Option<u64>,
    /// The present memory.
    pub(super) rss_bytes: Option<u64>,
}

impl Usage {
    /// Of this process.
    pub(super) fn of_this_process() -> Self {
        let (rss_peak_bytes, rss_bytes) = memory("self");
        Self { cpu_s: own_cpu().as_secs_f64(), rss_peak_bytes, rss_bytes }
    }

    /// Of another process; `None` after its end, or where the system does not report it.
    pub(super) fn of(process: u32) -> Option<Self> {
        let stat = std::fs::read_to_string(format!("/proc/{process}/stat")).ok()?;
        let cpu_s = cpu_ticks(&stat)? as f64 / clock_ticks_per_second() as f64;
        let (rss_peak_bytes, rss_bytes) = memory(&process.to_string());
        // A zombie process has no memory.
        rss_bytes.map(|_| Self { cpu_s, rss_peak_bytes, rss_bytes })
    }
}

/// The open files and sockets of a process; `None` as [`Usage::of`].
pub(super) fn descriptors_of(process: u32) -> Option<usize> {
    Some(std::fs::read_dir(format!("/proc/{process}/fd")).ok()?.count())
}

/// The threads of a process; `None` as [`Usage::of`].
pub(super) fn threads_of(process: u32) -> Option<usize> {
    Some(std::fs::read_dir(format!("/proc/{process}/task")).ok()?.count())
}

/// The CPU time of this process on all cores.
pub(super) fn own_cpu() -> Duration {
    let time = clock_gettime(ClockId::ProcessCPUTime);
    Duration::new(u64::try_from(time.tv_sec).unwrap_or(0), u32::try_from(time.tv_nsec).unwrap_or(0))
}

/// Ticks in user and in system mode, from a line of `/proc/PID/stat`.
fn cpu_ticks(stat: &str) -> Option<u64> {
    // The name of the program is in parentheses and may contain any characters, even parentheses.
    let (_, after_name) = stat.rsplit_once(')')?;
    let mut fields = after_name.split_whitespace().skip(FIELDS_BEFORE_TICKS);
    let mut ticks = || fields.next()?.parse::<u64>().ok();
    ticks()?.checked_add(ticks()?)
}

/// Fields between the program's name and its ticks.
const FIELDS_BEFORE_TICKS: usize = 11;

fn memory(process: &str) -> (Option<u64>, Option<u64>) {
    // Only on Linux; elsewhere the table has a gap.
    match std::fs::read_to_string(format!("/proc/{process}/status")) {
        Ok(status) => (status_bytes(&status, "VmHWM:"), status_bytes(&status, "VmRSS:")),
        Err(_) => (None, None),
    }
}

/// A line of `/proc/PID/status`, as `VmHWM:     1234 kB`.
fn status_bytes(status: &str, name: &str) -> Option<u64> {
    let value = status.lines().find_map(|line| line.strip_prefix(name))?;
    let kib: u64 = value.trim().strip_suffix("kB")?.trim().parse().ok()?;
    kib.checked_mul(1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_is_read_as_linux_writes_it() {
        let status = "Name:\tstillmap\nVmHWM:\t   12345 kB\nVmRSS:\t   42 kB\nThreads:\t3\n";
        assert_eq!(status_bytes(status, "VmHWM:"), Some(12345 * 1024));
        assert_eq!(status_bytes(status, "VmRSS:"), Some(42 * 1024));
        assert_eq!(status_bytes(status, "VmSwap:"), None);
        assert_eq!(status_bytes("VmHWM:\t99999999999999999999 kB", "VmHWM:"), None);
    }

    #[test]
    fn ticks_are_read_behind_whatever_name() {
        let stat = "42 (a) b) (c) S 1 42 42 0 -1 4194560 8000 0 0 0 123 45 0 0 20 0 9 0 5000 1 2";
        assert_eq!(cpu_ticks(stat), Some(168));
        assert_eq!(cpu_ticks("42 (a) S 1 2"), None);
        assert_eq!(cpu_ticks(""), None);
    }

    #[test]
    fn this_process_takes_what_it_uses() {
        let before = Usage::of_this_process();
        let mut block = vec![1_u8; 32 << 20];
        for byte in &mut block {
            *byte = std::hint::black_box(*byte).wrapping_mul(3);
        }
        let after = Usage::of_this_process();
        std::hint::black_box(&block);
        assert!(after.cpu_s > before.cpu_s);
        if let (Some(before), Some(after)) = (before.rss_peak_bytes, after.rss_peak_bytes) {
            assert!(after >= before && after >= 32 << 20);
        }
    }
}
