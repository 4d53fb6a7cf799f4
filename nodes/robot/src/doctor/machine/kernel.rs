//! The kernel's limits, and its counters of dropped datagrams.

use std::path::Path;

/// Where Linux reports both; on other systems nothing is read, and nothing is found.
const PROC: &str = "/proc";

/// The kernel's limits, as far as they can be read.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(crate) struct KernelLimits {
    /// The largest receive buffer that a socket is granted.
    pub(crate) rmem_max_bytes: Option<u64>,
    /// The largest send buffer that a socket is granted.
    pub(crate) wmem_max_bytes: Option<u64>,
    /// The memory for datagrams that have arrived in part.
    pub(crate) ipfrag_high_thresh_bytes: Option<u64>,
    /// How long the kernel waits for the rest of a datagram.
    pub(crate) ipfrag_time_s: Option<u64>,
    /// The ports that the kernel gives to any socket that names none.
    pub(crate) ephemeral_ports: Option<(u16, u16)>,
}

/// What the kernel dropped since it started, in this network namespace.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(crate) struct KernelDrops {
    /// Datagrams that were dropped because a receive buffer was full.
    pub(crate) receive_buffer_full: u64,
    /// Datagrams that were refused because a send buffer was full.
    pub(crate) send_buffer_full: u64,
    /// Datagrams of which fragments were missing.
    pub(crate) reassembly_failures: u64,
}

impl KernelLimits {
    pub(crate) fn read() -> Self {
        Self::read_below(Path::new(PROC))
    }

    fn read_below(proc: &Path) -> Self {
        let text = |name: &str| std::fs::read_to_string(proc.join("sys/net").join(name)).ok();
        let number = |name: &str| text(name)?.trim().parse().ok();
        let ephemeral_ports = text("ipv4/ip_local_port_range").and_then(|range| {
            let mut ports = range.split_whitespace().map(str::parse);
            Some((ports.next()?.ok()?, ports.next()?.ok()?))
        });
        Self {
            rmem_max_bytes: number("core/rmem_max"),
            wmem_max_bytes: number("core/wmem_max"),
            ipfrag_high_thresh_bytes: number("ipv4/ipfrag_high_thresh"),
            ipfrag_time_s: number("ipv4/ipfrag_time"),
            ephemeral_ports,
        }
    }
}

impl KernelDrops {
    /// What was dropped so far; `None` if the kernel does not report it.
    pub(crate) fn read() -> Option<Self> {
        std::fs::read_to_string(Path::new(PROC).join("net/snmp"))
            .ok()
            .map(|text| Self::parse(&text))
    }

    /// What was dropped since `earlier`.
    pub(crate) fn since(&self, earlier: &Self) -> Self {
        let more = |of: fn(&Self) -> u64| of(self).saturating_sub(of(earlier));
        Self {
            receive_buffer_full: more(|drops| drops.receive_buffer_full),
            send_buffer_full: more(|drops| drops.send_buffer_full),
            reassembly_failures: more(|drops| drops.reassembly_failures),
        }
    }

    /// Each protocol has two lines: the names of its counters, and their values.
    fn parse(text: &str) -> Self {
        let counter = |protocol: &str, name: &str| {
            let mut lines = text.lines().filter_map(|line| line.strip_prefix(protocol));
            let (names, values) = (lines.next()?, lines.next()?);
            let column = names.split_whitespace().position(|one| one == name)?;
            values.split_whitespace().nth(column)?.parse().ok()
        };
        Self {
            receive_buffer_full: counter("Udp:", "RcvbufErrors").unwrap_or(0),
            send_buffer_full: counter("Udp:", "SndbufErrors").unwrap_or(0),
            reassembly_failures: counter("Ip:", "ReasmFails").unwrap_or(0),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_that_are_missing_are_none() {
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| {
            let path = folder.path().join("sys/net").join(name);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, text).unwrap();
        };
        assert_eq!(KernelLimits::read_below(folder.path()), KernelLimits::default());
        write("core/rmem_max", "212992\n");
        write("core/wmem_max", "many\n");
        write("ipv4/ip_local_port_range", "32768\t60999\n");
        let limits = KernelLimits::read_below(folder.path());
        assert_eq!(limits.rmem_max_bytes, Some(212_992));
        assert_eq!(limits.wmem_max_bytes, None);
        assert_eq!(limits.ephemeral_ports, Some((32_768, 60_999)));
    }

    #[test]
    fn drops_are_found_by_the_names_of_their_columns() {
        let text = "Ip: Forwarding ReasmReqds ReasmFails\nIp: 1 20 7\n\
                    Udp: InDatagrams RcvbufErrors SndbufErrors\nUdp: 100 12 3\n\
                    UdpLite: InDatagrams RcvbufErrors\nUdpLite: 0 99\n";
        let drops = KernelDrops::parse(text);
        let expected =
            KernelDrops { receive_buffer_full: 12, send_buffer_full: 3, reassembly_failures: 7 };
        assert_eq!(drops, expected);
        assert_eq!(KernelDrops::parse("Udp: RcvbufErrors\n"), KernelDrops::default());
        let before = KernelDrops { receive_buffer_full: 10, ..KernelDrops::default() };
        assert_eq!(drops.since(&before).receive_buffer_full, 2);
    }
}
