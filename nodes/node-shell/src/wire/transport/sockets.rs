//! The UDP sockets of this process, which the DDS library keeps to itself: what the kernel grants and
//! drops is read from the kernel, and what it did not grant is requested again where possible.

use std::collections::BTreeMap;

#[cfg(target_os = "linux")]
use nix::libc;

use super::datagram_filter::Instruction;

/// One UDP socket, as the kernel lists it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct UdpSocketEntry {
    pub(super) port: u16,
    pub(super) inode: u64,
    /// Datagrams that found the receive buffer full.
    pub(super) dropped: u64,
}

/// Reads the kernel's list of UDP sockets. Lines that are not understood are ignored.
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

/// The UDP sockets of the network that this thread is on, each once, as the kernel lists them.
///
/// # Errors
/// Where the kernel has no such list.
pub(super) fn list() -> std::io::Result<Vec<UdpSocketEntry>> {
    whole_list(one_reading)
}

/// One reading of the kernel's list, which may name a socket twice or leave one out while sockets come and go. It costs by the
/// number of all sockets of the network.
///
/// # Errors
/// Where the kernel has no such list.
pub(super) fn one_reading() -> std::io::Result<Vec<UdpSocketEntry>> {
    Ok(parse_list(&std::fs::read_to_string("/proc/thread-self/net/udp")?))
}

/// How often the list is read at most, where sockets come and go all the time.
const MOST_READINGS: usize = 10;

/// Joins readings of the kernel's list until one names the same sockets as the one before. The list is read in
/// parts that the kernel counts off from its start: a socket that comes or goes meanwhile makes it name another
/// twice, or leave one out.
fn whole_list(
    mut reading: impl FnMut() -> std::io::Result<Vec<UdpSocketEntry>>,
) -> std::io::Result<Vec<UdpSocketEntry>> {
    let by_inode = |entries: Vec<UdpSocketEntry>| -> BTreeMap<u64, UdpSocketEntry> {
        entries.into_iter().map(|entry| (entry.inode, entry)).collect()
    };
    let mut last = by_inode(reading()?);
    let mut joined = last.clone();
    for _ in 1..MOST_READINGS {
        let next = by_inode(reading()?);
        let is_settled = next.keys().eq(last.keys());
        joined.extend(&next);
        last = next;
        if is_settled {
            break;
        }
    }
    Ok(joined.into_values().collect())
}

/// The sockets of this process, by inode, with their numbers.
///
/// # Errors
/// Where the kernel does not list them.
pub(super) fn own() -> std::io::Result<BTreeMap<u64, i32>> {
    let mut own = BTreeMap::new();
    for entry in std::fs::read_dir("/proc/self/fd")? {
        let entry = entry?;
        // A socket that was closed meanwhile is not the participant's.
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

/// Another handle of one of this process' sockets: the library does not hand out its own.
#[cfg(target_os = "linux")]
#[derive(Debug)]
pub(super) struct SocketHandle(std::os::fd::OwnedFd);

#[cfg(target_os = "linux")]
impl SocketHandle {
    /// A handle of the socket that has this number.
    ///
    /// # Errors
    /// Where there is none available, as in some containers.
    pub(super) fn of(number: i32) -> std::io::Result<Self> {
        use rustix::process::{PidfdFlags, PidfdGetfdFlags, getpid, pidfd_getfd, pidfd_open};

        let process = pidfd_open(getpid(), PidfdFlags::empty())?;
        Ok(Self(pidfd_getfd(process, number, PidfdGetfdFlags::empty())?))
    }

    /// The receive buffer, in bytes.
    ///
    /// # Errors
    /// Where the kernel does not report it.
    pub(super) fn receive_buffer(&self) -> std::io::Result<usize> {
        // Linux reports the double, for its bookkeeping.
        Ok(rustix::net::sockopt::socket_recv_buffer_size(&self.0)? / 2)
    }

    /// The receive buffer after asking the kernel for `wanted` bytes beyond its limit when it granted less;
    /// that needs the right to administrate the network.
    ///
    /// # Errors
    /// Where the kernel does not report it.
    pub(super) fn grown_receive_buffer(&self, wanted: usize) -> std::io::Result<Grown> {
        let before = self.receive_buffer()?;
        if before >= wanted
            || rustix::net::sockopt::set_socket_recv_buffer_size_force(&self.0, wanted).is_err()
        {
            return Ok(Grown { bytes: before, forced: false });
        }
        Ok(Grown { bytes: self.receive_buffer()?, forced: true })
    }

    /// The data that wait to be read, in bytes of the kernel's memory, as it counts them against the receive buffer
    /// (socket(7), `SO_MEMINFO`). Data that were read can count for a while longer, up to a quarter of the buffer: none do once
    /// the socket is empty.
    ///
    /// # Errors
    /// Where the kernel does not report it: before Linux 4.12.
    pub(super) fn waiting_bytes(&self) -> std::io::Result<u64> {
        use nix::sys::socket::GetSockOpt;

        Ok(WaitingBytes.get(&self.0)?.into())
    }

    /// Sets the receive buffer: beyond the kernel's limit where that may be had, up to it otherwise.
    ///
    /// # Errors
    /// Where the kernel refuses.
    pub(super) fn set_receive_buffer(&self, bytes: usize) -> std::io::Result<()> {
        use rustix::net::sockopt;

        sockopt::set_socket_recv_buffer_size_force(&self.0, bytes)
            .or_else(|_| sockopt::set_socket_recv_buffer_size(&self.0, bytes))?;
        Ok(())
    }

    /// Lets the kernel judge by this program what arrives.
    ///
    /// # Errors
    /// Where the kernel refuses the program, or has no memory for it.
    pub(super) fn attach_filter(&self, program: &[Instruction]) -> std::io::Result<()> {
        let instruction = |one: &Instruction| {
            socket2::SockFilter::new(one.code, one.if_true, one.if_false, one.operand)
        };
        let program: Vec<_> = program.iter().map(instruction).collect();
        socket2::SockRef::from(&self.0).attach_filter(&program)
    }

    /// Accepts only datagrams from this interface.
    ///
    /// # Errors
    /// Where the kernel refuses: before Linux 5.7 it takes the right to use raw sockets.
    pub(super) fn bind_to(&self, interface: &str) -> std::io::Result<()> {
        socket2::SockRef::from(&self.0).bind_device(Some(interface.as_bytes()))
    }
}

/// The first of the counts that the kernel reports of a socket's memory.
#[cfg(target_os = "linux")]
#[derive(Clone, Copy)]
struct WaitingBytes;

#[cfg(target_os = "linux")]
nix::getsockopt_impl!(
    WaitingBytes,
    libc::SOL_SOCKET,
    libc::SO_MEMINFO,
    u32,
    nix::sys::socket::sockopt::GetStruct<u32>
);

/// Elsewhere there is no such handle.
#[cfg(not(target_os = "linux"))]
#[derive(Debug)]
pub(super) enum SocketHandle {}

#[cfg(not(target_os = "linux"))]
impl SocketHandle {
    pub(super) fn of(_number: i32) -> std::io::Result<Self> {
        Err(std::io::ErrorKind::Unsupported.into())
    }

    pub(super) fn receive_buffer(&self) -> std::io::Result<usize> {
        match *self {}
    }

    pub(super) fn grown_receive_buffer(&self, _wanted: usize) -> std::io::Result<Grown> {
        match *self {}
    }

    pub(super) fn waiting_bytes(&self) -> std::io::Result<u64> {
        match *self {}
    }

    pub(super) fn set_receive_buffer(&self, _bytes: usize) -> std::io::Result<()> {
        match *self {}
    }

    pub(super) fn attach_filter(&self, _program: &[Instruction]) -> std::io::Result<()> {
        match *self {}
    }

    pub(super) fn bind_to(&self, _interface: &str) -> std::io::Result<()> {
        match *self {}
    }
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
/// When there is no socket available.
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
