//! The process' memory, and a ceiling on it: a process that grows without end must not take the machine with it.

use std::time::Duration;

use super::shutdown::Shutdown;

/// The variable that names another ceiling, in MiB; 0 for none.
const VARIABLE: &str = "STILLMAP_MEMORY_LIMIT_MIB";

/// The share of the machine's memory, or of the container's, that a process may have unless the variable says otherwise.
const SHARE: u64 = 2;

/// How often memory is looked at. A datagram that gets past the filter was measured to cost 330 MB a second.
const LOOK: Duration = Duration::from_millis(100);

/// How long the process may take to end in order, and by which part of the ceiling it may grow meanwhile: a map of gigabytes is
/// written within it. Then it is cut off.
const LONGEST_END: Duration = Duration::from_secs(10);
const OVERSHOOT: u64 = 4;

/// `EX_SOFTWARE` of `sysexits.h`: who starts the process again does so on any code but 0.
const EXIT_CODE: i32 = 70;

/// The resident memory of this process, where the system reports it.
pub(crate) fn resident_bytes() -> Option<u64> {
    let statm = std::fs::read_to_string("/proc/self/statm").ok()?;
    let pages: u64 = statm.split_whitespace().nth(1)?.parse().ok()?;
    Some(pages.saturating_mul(rustix::param::page_size() as u64))
}

/// The ceiling of this process; `None` where there is none, or where the system does not report the memory.
///
/// # Errors
/// When the variable is no number of MiB.
pub(crate) fn ceiling_bytes() -> Result<Option<u64>, String> {
    let (machine, container) = (
        std::fs::read_to_string("/proc/meminfo").unwrap_or_default(),
        std::fs::read_to_string("/sys/fs/cgroup/memory.max").unwrap_or_default(),
    );
    ceiling(std::env::var(VARIABLE).ok().as_deref(), &machine, &container)
}

fn ceiling(wanted: Option<&str>, machine: &str, container: &str) -> Result<Option<u64>, String> {
    if let Some(text) = wanted.filter(|text| !text.is_empty()) {
        let mib: u64 = text.parse().map_err(|_| {
            format!("{VARIABLE}={text}: a number of MiB is accepted, 0 for no limit")
        })?;
        return Ok((mib > 0).then(|| mib.saturating_mul(1 << 20)));
    }
    let of_machine = machine
        .lines()
        .find_map(|line| line.strip_prefix("MemTotal:")?.split_whitespace().next()?.parse().ok())
        .map(|kib: u64| kib.saturating_mul(1024));
    // "max" where the container has none.
    let of_container = container.trim().parse().ok();
    Ok(of_machine.into_iter().chain(of_container).min().map(|bytes: u64| bytes / SHARE))
}

/// Ends the process once it has grown beyond `ceiling_bytes`: in order if it can, with what there is saved; and with a failure, so
/// that it is started again.
///
/// # Errors
/// When no thread can be started.
pub(crate) fn keep_below(ceiling_bytes: u64, shutdown: &Shutdown) -> std::io::Result<()> {
    let shutdown = shutdown.downgrade();
    let body = move || {
        let mut over_for = Duration::ZERO;
        loop {
            std::thread::sleep(LOOK);
            let (Some(shutdown), Some(bytes)) = (shutdown.upgrade(), resident_bytes()) else {
                return;
            };
            if bytes <= ceiling_bytes && over_for.is_zero() {
                continue;
            }
            if over_for.is_zero() {
                let mb = |bytes: u64| bytes / 1_000_000;
                let reason = format!(
                    "the process has grown to {} MB, beyond its ceiling of {} MB ({VARIABLE} sets another): it ends, to be started again",
                    mb(bytes),
                    mb(ceiling_bytes)
                );
                tracing::error!("{reason}");
                shutdown.fail(reason);
            }
            over_for += LOOK;
            if over_for > LONGEST_END || bytes > ceiling_bytes + ceiling_bytes / OVERSHOOT {
                std::process::exit(EXIT_CODE);
            }
        }
    };
    std::thread::Builder::new().name("memory ceiling".to_owned()).spawn(body).map(drop)
}

#[cfg(test)]
mod tests {
    use super::*;

    const MACHINE: &str = "MemTotal:        8000000 kB\nMemFree:          100000 kB\n";

    #[test]
    fn the_ceiling_is_half_of_what_there_is_or_what_is_asked_for() {
        assert_eq!(ceiling(None, MACHINE, "max\n"), Ok(Some(4_096_000_000)));
        assert_eq!(ceiling(None, MACHINE, "1000000000\n"), Ok(Some(500_000_000)));
        assert_eq!(ceiling(None, "", ""), Ok(None));
        assert_eq!(ceiling(Some(""), "", "2"), Ok(Some(1)));
        assert_eq!(ceiling(Some("300"), MACHINE, ""), Ok(Some(300 << 20)));
        assert_eq!(ceiling(Some("0"), MACHINE, ""), Ok(None));
        assert!(
            ceiling(Some("much"), MACHINE, "")
                .unwrap_err()
                .contains("STILLMAP_MEMORY_LIMIT_MIB=much")
        );
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn the_process_has_memory() {
        assert!(resident_bytes().unwrap() > 1_000_000);
        assert!(
            ceiling(None, &std::fs::read_to_string("/proc/meminfo").unwrap(), "")
                .unwrap()
                .is_some()
        );
    }
}
