//! The properties of the machine that the figures depend on.

use serde::Serialize;

/// The machine. Unknown properties are absent.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub(in crate::bench) struct Machine {
    pub(super) cores: usize,
    pub(super) processor: Option<String>,
    pub(super) kernel: Option<String>,
    /// The largest receive buffer that a socket of an ordinary user gets (`net.core.rmem_max`).
    pub(super) largest_buffer_bytes: Option<usize>,
    /// The largest datagram of the loopback.
    pub(super) loopback_mtu: Option<usize>,
}

impl Machine {
    pub(in crate::bench) fn here() -> Self {
        let line =
            |path: &str| std::fs::read_to_string(path).ok().map(|text| text.trim().to_owned());
        let number = |path: &str| line(path)?.parse().ok();
        Self {
            cores: std::thread::available_parallelism().map_or(1, usize::from),
            processor: line("/proc/cpuinfo").and_then(|text| processor(&text)),
            kernel: line("/proc/sys/kernel/osrelease"),
            largest_buffer_bytes: number("/proc/sys/net/core/rmem_max"),
            loopback_mtu: number("/sys/class/net/lo/mtu"),
        }
    }
}

fn processor(cpuinfo: &str) -> Option<String> {
    let line = cpuinfo.lines().find(|line| line.starts_with("model name"))?;
    Some(line.split_once(':')?.1.trim().to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_processor_is_the_first_that_has_a_name() {
        let text = "processor\t: 0\nmodel name\t: Some CPU @ 2 GHz\nmodel name\t: Other\n";
        assert_eq!(processor(text).as_deref(), Some("Some CPU @ 2 GHz"));
        assert_eq!(processor("Hardware : BCM2835"), None);
    }

    #[test]
    fn this_machine_has_a_core() {
        assert!(Machine::here().cores >= 1);
    }
}
