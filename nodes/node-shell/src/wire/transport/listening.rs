//! Receives multicast announcements, for a participant that has its multicast barred.

use std::collections::BTreeSet;
use std::net::{IpAddr, Ipv4Addr, SocketAddrV4, UdpSocket};

use socket2::{Domain, Protocol, Socket, Type};

use super::{MULTICAST_GROUP, ports};

/// How many machines are remembered. Those beyond are found by what they hear themselves.
const MOST_MACHINES: usize = 256;

/// How many datagrams are looked at in one go: more than a full site sends between two looks.
const MOST_DATAGRAMS: usize = 4096;

/// The start of every message, and where the sender's name is in it.
const PROTOCOL: &[u8] = b"RTPS";
const SENDER: std::ops::Range<usize> = 8..20;

/// Listens for announcements. It does not read them: the sender is announced to in turn, and so
/// finds this participant, and answers it directly.
#[derive(Debug)]
pub(super) struct MulticastListener {
    socket: UdpSocket,
    /// The participant's own name, by which its own announcements are known.
    own: [u8; 12],
    /// The machine's own addresses: peers on this machine are found by other means.
    here: Vec<Ipv4Addr>,
    machines: BTreeSet<Ipv4Addr>,
}

impl MulticastListener {
    /// Listens on the interfaces with the addresses `here`.
    pub(super) fn open(domain: u16, own: [u8; 12], here: &[Ipv4Addr]) -> std::io::Result<Self> {
        let socket = Socket::new(Domain::IPV4, Type::DGRAM, Some(Protocol::UDP))?;
        socket.set_reuse_address(true)?;
        #[cfg(unix)]
        socket.set_reuse_port(true)?;
        socket.set_nonblocking(true)?;
        let port = ports::discovery_multicast(domain);
        socket.bind(&SocketAddrV4::new(Ipv4Addr::UNSPECIFIED, port).into())?;
        for interface in here {
            socket.join_multicast_v4(&MULTICAST_GROUP, interface)?;
        }
        let machines = BTreeSet::new();
        Ok(Self { socket: socket.into(), own, here: here.to_vec(), machines })
    }

    /// The machines that have announced a participant so far, and whether there are new ones among them.
    pub(super) fn machines(&mut self) -> (&BTreeSet<Ipv4Addr>, bool) {
        let known = self.machines.len();
        let mut start = [0; SENDER.end];
        for _ in 0..MOST_DATAGRAMS {
            // What is longer is cut; what cannot be received now is announced again.
            let Ok((length, sender)) = self.socket.recv_from(&mut start) else { break };
            if let IpAddr::V4(address) = sender.ip()
                && length == SENDER.end
                && start.starts_with(PROTOCOL)
                && start[SENDER] != self.own
                && !address.is_loopback()
                && !self.here.contains(&address)
                && self.machines.len() < MOST_MACHINES
            {
                self.machines.insert(address);
            }
        }
        (&self.machines, self.machines.len() > known)
    }
}

#[cfg(test)]
mod tests {
    use free_domain::FreeDomain;

    use super::*;
    use crate::wire::transport::interfaces;

    fn datagram(sender: u8) -> Vec<u8> {
        let mut datagram = b"RTPS\x02\x04\x01\x12".to_vec();
        datagram.extend([sender; 12]);
        datagram.extend([0; 40]);
        datagram
    }

    /// Sends to the listener's port, which takes what is sent to this machine alone as well.
    #[test]
    fn only_machines_that_announce_others_are_remembered() {
        let domain = FreeDomain::new();
        let Some(address) = interfaces::of_this_machine()
            .iter()
            .flat_map(|one| one.addresses.clone())
            .find(|address| !address.is_loopback())
        else {
            println!("skipped: this machine has the loopback alone, which is not listened to");
            return;
        };
        let mut listener = MulticastListener::open(domain.number(), [1; 12], &[]).unwrap();
        let sender = UdpSocket::bind((address, 0)).unwrap();
        let to = SocketAddrV4::new(address, ports::discovery_multicast(domain.number()));
        for nothing in [datagram(1), b"RTPS".to_vec(), vec![0; 100], Vec::new()] {
            sender.send_to(&nothing, to).unwrap();
        }
        assert_eq!(listener.machines(), (&BTreeSet::new(), false));
        sender.send_to(&datagram(2), to).unwrap();
        assert_eq!(listener.machines(), (&BTreeSet::from([address]), true));
        sender.send_to(&datagram(3), to).unwrap();
        assert_eq!(listener.machines(), (&BTreeSet::from([address]), false));
        drop(listener);
        let mut here = MulticastListener::open(domain.number(), [1; 12], &[]).unwrap();
        here.here.push(address);
        sender.send_to(&datagram(2), to).unwrap();
        assert_eq!(here.machines(), (&BTreeSet::new(), false));
    }
}
