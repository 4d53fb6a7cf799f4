//! The UDP sockets of this process, which the DDS library keeps to itself: what the kernel grants and
//! drops is read from the kernel, and what it did not grant is asked for again where that may be had.

use std::collections::BTreeMap;

/// One UDP socket, as the kernel lists it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct UdpSocketEntry {
    pub(super) port: u16,
    pub(super) inode: u64,
    /// Datagrams that found the receive buffer full.
    pub(super) dropped: u64,
}

/// Reads the kernel's list of UDP sockets. Lines that are not understood are passed over.
pub(super) fn parse_list(list: &str) -> Vec<UdpSocketEntry> {
    list.lines().skip(1).filter_map(parse_line).collect()
}

fn parse_line(line: &str) -> Option<UdpSocketEntry> {
    let mut fields = line.split_ascii_whitespace();
    let port = fields.nth(1)?.rsplit_once(':')?.1;
    Some(UdpSocketEntry {
        port: u16::from_str_radix(port, 16).ok()?,
        inode: fields.nth(7)?.parse().ok()?,
        dropped: fields.nth(2)?.parse().ok()?,
    })
}

/// The kernel's list of the UDP sockets of the network that this thread is on.
///
/// # Errors
/// Where the kernel has no such list.
pub(super) fn list() -> std::io::Result<Vec<UdpSocketEntry>> {
    Ok(parse_list(&std::fs::read_to_string("/proc/thread-self/net/udp")?))
}

/// The sockets of this process, by inode, with their numbers.
///
/// # Errors
/// Where the kernel does not list them.
pub(super) fn own() -> std::io::Result<BTreeMap<u64, i32>> {
    let mut own = BTreeMap::new();
    for entry in std::fs::read_dir("/proc/self/fd")? {
        let entry = entry?;
        // What was closed meanwhile is no socket of the participant.
        let Ok(target) = std::fs::read_link(entry.path()) else { continue };
        let inode = target
            .to_str()
            .and_then(|target| target.strip_prefix("socket:[")?.strip_suffix(']')?.parse().ok());
        let number = entry.file_name().to_str().and_then(|name| name.parse().ok());
        if let (Some(inode), Some(number)) = (inode, number) {
            own.insert(inode, number);
        }
    }
    Ok(own)
}

/// The UDP sockets of this process that are bound to one of `ports`, each with its number, but for those
/// that were there `before`.
///
/// # Errors
/// Where the kernel does not list them.
pub(super) fn own_at(
    ports: &[u16],
    before: &BTreeMap<u64, i32>,
) -> std::io::Result<Vec<(UdpSocketEntry, i32)>> {
    let mut own = own()?;
    own.retain(|inode, _| !before.contains_key(inode));
    let listed = list()?.into_iter().filter(|entry| ports.contains(&entry.port));
    Ok(listed.filter_map(|entry| own.get(&entry.inode).map(|number| (entry, *number))).collect())
}

/// The receive buffer of one of this process' sockets, after asking the kernel for `wanted` bytes
/// beyond its limit when it granted less; that needs the right to administrate the network.
///
/// # Errors
/// Where another handle of the socket cannot be had, as in some containers.
#[cfg(target_os = "linux")]
pub(super) fn grown_receive_buffer(number: i32, wanted: usize) -> std::io::Result<Grown> {
    use rustix::net::sockopt;
    use rustix::process::{PidfdFlags, PidfdGetfdFlags, getpid, pidfd_getfd, pidfd_open};

    // Another handle of the same socket: the library does not hand out its own.
    let process = pidfd_open(getpid(), PidfdFlags::empty())?;
    let socket = pidfd_getfd(process, number, PidfdGetfdFlags::empty())?;
    // Linux reports the double, for its bookkeeping.
    let granted = || sockopt::socket_recv_buffer_size(&socket).map(|reported| reported / 2);
    let before = granted()?;
    if before >= wanted || sockopt::set_socket_recv_buffer_size_force(&socket, wanted).is_err() {
        return Ok(Grown { bytes: before, forced: false });
    }
    Ok(Grown { bytes: granted()?, forced: true })
}

/// Elsewhere there is no such handle.
#[cfg(not(target_os = "linux"))]
pub(super) fn grown_receive_buffer(_number: i32, _wanted: usize) -> std::io::Result<Grown> {
    Err(std::io::ErrorKind::Unsupported.into())
}

/// A receive buffer, and whether it was grown beyond the kernel's limit.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Grown {
    pub(super) bytes: usize,
    pub(super) forced: bool,
}

/// Asks a new socket for a buffer and reads back what it got: the kernel clamps in silence.
///
/// # Errors
/// When there is no socket to be had.
pub(super) fn read_back(wanted: usize) -> std::io::Result<usize> {
    use socket2::{Domain, Protocol, Socket, Type};

    let socket = Socket::new(Domain::IPV4, Type::DGRAM, Some(Protocol::UDP))?;
    // macOS refuses what it does not grant, where Linux clamps: then the default stands.
    let _ = socket.set_recv_buffer_size(wanted);
    let reported = socket.recv_buffer_size()?;
    Ok(if cfg!(target_os = "linux") { reported / 2 } else { reported })
}

#[cfg(test)]
mod tests;
