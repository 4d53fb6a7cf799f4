//! The receiving sockets of a participant: grown where that may be had, and watched.

use std::collections::{BTreeMap, BTreeSet};

use super::backlog::BacklogWatch;
use super::buffer::GrantedBuffer;
use super::datagram_filter::DatagramFilter;
use super::interfaces::Interface;
use super::sockets::{self, SocketHandle, UdpSocketEntry};
use super::{Transport, ports};

/// How a participant receives.
pub(super) struct Receiving {
    /// The receive buffer that the kernel grants.
    pub(super) granted: GrantedBuffer,
    /// The sockets, where the kernel lists them.
    pub(super) inodes: Option<BTreeSet<u64>>,
    /// The sockets by their numbers in this process.
    pub(super) numbers: Vec<i32>,
    /// Keeps the participant from reading for ever; `None` where its sockets are not available.
    pub(super) backlog: Option<BacklogWatch>,
    /// Whether what arrives is judged before the library gets it.
    pub(super) filter: DatagramFilter,
}

impl Transport {
    /// Filters what arrives, asks for more buffer where possible, and watches the sockets that data arrive on: the sockets that
    /// participant `number` has opened since `before`. With `loopback` only datagrams from the loopback interface are received.
    pub(super) fn receiving(
        &self,
        number: u16,
        before: &BTreeMap<u64, i32>,
        loopback: Option<&Interface>,
    ) -> Receiving {
        let domain = self.domain_id;
        let data: Vec<_> = ports::data_unicast(domain, number)
            .into_iter()
            .chain([ports::data_multicast(domain)])
            .collect();
        let discovery = ports::discovery_unicast(domain, number)
            .into_iter()
            .chain([ports::discovery_multicast(domain)]);
        let ports: Vec<_> = data.iter().copied().chain(discovery).collect();
        let found = sockets::own_at(&ports, before).inspect_err(|error| {
            tracing::debug!("the kernel does not list sockets: {error}");
        });
        let found = found.ok().filter(|found| !found.is_empty());
        let inodes =
            found.as_ref().map(|found| found.iter().map(|(entry, _)| entry.inode).collect());
        let found = found.unwrap_or_default();
        let numbers = found.iter().map(|(_, number)| *number).collect();
        let sockets = handles(&found);
        let filter = DatagramFilter::on(sockets.iter().map(|(_, socket)| socket));
        if let Some(interface) = loopback {
            hear_only(interface, &sockets);
        }
        let bytes = self.grow(&sockets).unwrap_or_else(|| {
            sockets::read_back(self.receive_buffer).unwrap_or_else(|error| {
                tracing::warn!("the receive buffer of a socket could not be read back: {error}");
                0
            })
        });
        Receiving {
            granted: GrantedBuffer::new(bytes, self.receive_buffer, loopback.is_some()),
            inodes,
            numbers,
            backlog: watched(sockets, &data),
            filter,
        }
    }

    /// The least of the sockets' receive buffers, after asking for more; `None` without a socket.
    fn grow(&self, sockets: &[(u16, SocketHandle)]) -> Option<usize> {
        let mut least = None;
        let mut forced = false;
        for (_, socket) in sockets {
            match socket.grown_receive_buffer(self.receive_buffer) {
                Ok(grown) => {
                    forced |= grown.forced;
                    least = Some(least.unwrap_or(usize::MAX).min(grown.bytes));
                }
                Err(error) => tracing::debug!("a socket's receive buffer is not seen: {error}"),
            }
        }
        if forced {
            tracing::info!(
                "the receive buffer is {} KiB, beyond the kernel's net.core.rmem_max, since this \
                 process may administrate the network",
                self.receive_buffer / 1024
            );
        }
        least
    }
}

/// Refuses datagrams from another interface: the library's sockets are open to all.
fn hear_only(interface: &Interface, sockets: &[(u16, SocketHandle)]) {
    for (port, socket) in sockets {
        if let Err(error) = socket.bind_to(&interface.name) {
            tracing::debug!("port {port} is open to other machines: {error}");
        }
    }
}

/// Other handles of the sockets, each with its port.
fn handles(found: &[(UdpSocketEntry, i32)]) -> Vec<(u16, SocketHandle)> {
    let handle = |(entry, number): &(UdpSocketEntry, i32)| {
        let handle = SocketHandle::of(*number)
            .inspect_err(|error| tracing::debug!("a socket is not available: {error}"));
        Some((entry.port, handle.ok()?))
    };
    found.iter().filter_map(handle).collect()
}

/// Watches those of the sockets that data comes by.
fn watched(sockets: Vec<(u16, SocketHandle)>, data: &[u16]) -> Option<BacklogWatch> {
    let of_data = |(port, socket)| data.contains(&port).then_some(socket);
    let sockets: Vec<_> = sockets.into_iter().filter_map(of_data).collect();
    if sockets.is_empty() {
        return None;
    }
    BacklogWatch::start(sockets)
        .inspect_err(|error| {
            tracing::warn!("memory is not bounded where CPU time is short: {error}");
        })
        .ok()
}
