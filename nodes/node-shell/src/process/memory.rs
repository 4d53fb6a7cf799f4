//! The process' memory, and a ceiling on it: a process that grows without end must not take the machine with it.

use std::path::{Path, PathBuf};
use std::time::Duration;

use super::shutdown::Shutdown;

/// The variable that names another ceiling, in MiB; 0 for none.
const VARIABLE: &str = "STILLMAP_MEMORY_LIMIT_MIB";

/// The share of the machine's memory that a process may have unless the variable says otherwise, ...
const SHARE_OF_MACHINE: f64 = 0.5;
/// ... and of what its container or its unit may have: with the [`OVERSHOOT`] it stays below what the kernel kills at.
const SHARE_OF_GROUP: f64 = 0.75;

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
    let read = |path: &Path| std::fs::read_to_string(path).unwrap_or_default();
    let machine = read(Path::new("/proc/meminfo"));
    let files = limit_files(&read(Path::new("/proc/self/cgroup")));
    let limits: Vec<String> = files.iter().map(|file| read(file)).collect();
    ceiling(std::env::var(VARIABLE).ok().as_deref(), &machine, &limits)
}

/// Whether there is to be a ceiling and can be none, since the system reports no memory (`/proc` is not mounted).
pub(crate) fn is_unbounded(ceiling_bytes: Option<u64>) -> bool {
    cannot_be_bounded(ceiling_bytes, resident_bytes(), std::env::var(VARIABLE).ok().as_deref())
}

fn cannot_be_bounded(ceiling: Option<u64>, resident: Option<u64>, wanted: Option<&str>) -> bool {
    let is_wanted = wanted.is_none_or(|text| text.parse() != Ok(0_u64));
    is_wanted && ceiling.and(resident).is_none()
}

/// The files with the limits of a process' control group and of the groups around it, by its `/proc/PID/cgroup` (cgroups(7)): systemd
/// limits a unit's own group; that of a container is the root as seen from inside.
fn limit_files(cgroup: &str) -> Vec<PathBuf> {
    let of_line = |line: &str| {
        let mut parts = line.splitn(3, ':').skip(1);
        let (controllers, own) = (parts.next()?, parts.next()?.trim_start_matches('/'));
        let (root, file) = match controllers {
            "" => ("/sys/fs/cgroup", "memory.max"),
            "memory" => ("/sys/fs/cgroup/memory", "memory.limit_in_bytes"),
            _ => return None,
        };
        let own = Path::new(root).join(own);
        let groups = own.ancestors().take_while(|group| group.starts_with(root));
        Some(groups.map(|group| group.join(file)).collect::<Vec<_>>())
    };
    cgroup.lines().filter_map(of_line).flatten().collect()
}

fn ceiling(wanted: Option<&str>, machine: &str, limits: &[String]) -> Result<Option<u64>, String> {
    if let Some(text) = wanted.filter(|text| !text.is_empty()) {
        let mib: u64 = text.parse().map_err(|_| {
            format!("{VARIABLE}={text}: a number of MiB is accepted, 0 for no limit")
        })?;
        return Ok((mib > 0).then(|| mib.saturating_mul(1 << 20)));
    }
    let of_machine = machine
        .lines()
        .find_map(|line| line.strip_prefix("MemTotal:")?.split_whitespace().next()?.parse().ok())
        .map(|kib: u64| share(kib.saturating_mul(1024), SHARE_OF_MACHINE));
    // "max" where a group has none.
    let of_groups = limits.iter().filter_map(|limit| limit.trim().parse().ok());
    let of_groups = of_groups.map(|bytes| share(bytes, SHARE_OF_GROUP));
    Ok(of_machine.into_iter().chain(of_groups).min())
}

fn share(bytes: u64, share: f64) -> u64 {
    (bytes as f64 * share) as u64
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

    fn of(limits: &[&str]) -> Vec<String> {
        limits.iter().map(|limit| (*limit).to_owned()).collect()
    }

    /// The limit of a systemd unit was not seen: the kernel killed the process, and the map with it.
    #[test]
    fn the_limits_are_those_of_the_own_group_and_of_all_around_it() {
        let of = |cgroup: &str| {
            limit_files(cgroup).iter().map(|file| file.display().to_string()).collect::<Vec<_>>()
        };
        assert_eq!(
            of("0::/system.slice/stillmap.service\n"),
            [
                "/sys/fs/cgroup/system.slice/stillmap.service/memory.max",
                "/sys/fs/cgroup/system.slice/memory.max",
                "/sys/fs/cgroup/memory.max",
            ]
        );
        assert_eq!(of("0::/\n"), ["/sys/fs/cgroup/memory.max"]);
        assert_eq!(
            of("9:name=systemd:/x\n4:memory:/docker\n1:cpu:/y\n"),
            [
                "/sys/fs/cgroup/memory/docker/memory.limit_in_bytes",
                "/sys/fs/cgroup/memory/memory.limit_in_bytes",
            ]
        );
        assert_eq!(of(""), [""; 0]);
    }

    #[test]
    fn the_ceiling_is_half_of_what_there_is_or_what_is_asked_for() {
        assert_eq!(ceiling(None, MACHINE, &of(&["max\n", "max\n"])), Ok(Some(4_096_000_000)));
        assert_eq!(ceiling(None, MACHINE, &of(&["max\n", "1000000000\n"])), Ok(Some(750_000_000)));
        assert_eq!(ceiling(None, "", &[]), Ok(None));
        assert_eq!(ceiling(Some(""), "", &of(&["2"])), Ok(Some(1)));
        assert_eq!(ceiling(Some("300"), MACHINE, &[]), Ok(Some(300 << 20)));
        assert_eq!(ceiling(Some("0"), MACHINE, &[]), Ok(None));
        assert!(
            ceiling(Some("much"), MACHINE, &[])
                .unwrap_err()
                .contains("STILLMAP_MEMORY_LIMIT_MIB=much")
        );
    }

    /// Regression: without `/proc` there was no ceiling, and nothing said so.
    #[test]
    fn a_ceiling_that_cannot_be_kept_is_known() {
        assert!(cannot_be_bounded(None, None, None) && cannot_be_bounded(None, None, Some("")));
        assert!(cannot_be_bounded(Some(300 << 20), None, Some("300")));
        assert!(!cannot_be_bounded(Some(300 << 20), Some(1), Some("300")));
        assert!(!cannot_be_bounded(None, Some(1), Some("0")), "none is wanted");
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn the_process_has_memory() {
        assert!(resident_bytes().unwrap() > 1_000_000);
        assert!(
            ceiling(None, &std::fs::read_to_string("/proc/meminfo").unwrap(), &[])
                .unwrap()
                .is_some()
        );
    }
}
