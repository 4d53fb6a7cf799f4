//! Makes the participant known to peers that the DDS library does not reach by itself.
//!
//! The library announces its participant by multicast every ten seconds, and on this machine to the first
//! twelve participants. The announcer sends the same message to the further participants of this machine,
//! to the static peers, and by multicast more often: a network that comes back is used within a few seconds.
//! One side is enough: a peer that discovers a participant answers it directly.

use std::collections::BTreeSet;
use std::net::{Ipv4Addr, SocketAddrV4, ToSocketAddrs, UdpSocket};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread::JoinHandle;
use std::time::Duration;

use socket2::{Domain, Protocol, Socket, Type};

use super::announcement::Participant;
use super::listening::MulticastListener;
use super::{MULTICAST_GROUP, StaticPeer, ports};

/// How many participants of this machine the library itself reaches.
const REACHED_BY_THE_LIBRARY: u16 = 12;

/// How many participants of a static peer are announced to; as ROS 2 does for its other DDS
/// implementations.
const PARTICIPANTS_OF_A_PEER: u16 = 32;

/// The pauses after the first announcements: a peer that starts at the same time is found soon.
const FIRST_PAUSES: [Duration; 4] = [
    Duration::from_millis(100),
    Duration::from_millis(300),
    Duration::from_millis(600),
    Duration::from_secs(1),
];

/// The pause between later announcements: a peer that was away is matched again within it.
const PAUSE: Duration = Duration::from_secs(3);

/// How often a name is looked up that could not be found, or may have got another address.
const LOOKUP_PERIOD: Duration = Duration::from_secs(30);

/// The destinations of announcements.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) struct Audience {
    pub(super) domain: u16,
    pub(super) own_number: u16,
    /// Whether to announce on this machine.
    pub(super) this_machine: bool,
    /// The addresses of the interfaces to announce from by multicast.
    pub(super) multicast_from: Vec<Ipv4Addr>,
    /// Whether to listen there too, since the participant does not: for a peer that announces by multicast is
    /// one more destination.
    pub(super) listens: bool,
    pub(super) peers: Vec<StaticPeer>,
}

/// The sending sockets: one for all unicast destinations, and one for each interface that carries multicast.
struct Sockets {
    unicast: UdpSocket,
    multicast: Vec<UdpSocket>,
    listener: Option<MulticastListener>,
}

impl Sockets {
    fn open(participant: &Participant, audience: &Audience) -> std::io::Result<Self> {
        let unicast = UdpSocket::bind((Ipv4Addr::UNSPECIFIED, 0))?;
        // A full send buffer must not stop the thread; what is not sent now is sent in the next round.
        unicast.set_nonblocking(true)?;
        let from = |address: &Ipv4Addr| {
            multicast_socket(*address)
                .inspect_err(|error| tracing::debug!("no multicast from {address}: {error}"))
                .ok()
        };
        let multicast = audience.multicast_from.iter().filter_map(from).collect();
        let listener = audience.listens.then(|| {
            let own = participant.prefix();
            MulticastListener::open(audience.domain, own, &audience.multicast_from)
                .inspect_err(|error| {
                    tracing::warn!("peers that announce by multicast are not received: {error}");
                })
                .ok()
        });
        Ok(Self { unicast, multicast, listener: listener.flatten() })
    }

    fn send(&self, message: &[u8], audience: &Audience, destinations: &[SocketAddrV4]) {
        send(&self.unicast, message, destinations);
        let group = SocketAddrV4::new(MULTICAST_GROUP, ports::discovery_multicast(audience.domain));
        for socket in &self.multicast {
            send(socket, message, &[group]);
        }
    }
}

fn multicast_socket(interface: Ipv4Addr) -> std::io::Result<UdpSocket> {
    let socket = Socket::new(Domain::IPV4, Type::DGRAM, Some(Protocol::UDP))?;
    socket.set_multicast_if_v4(&interface)?;
    socket.set_nonblocking(true)?;
    Ok(socket.into())
}

/// Announces the participant until it is dropped, and then says that the participant leaves. To be
/// dropped before the participant.
#[derive(Debug)]
pub struct Announcer {
    /// Closing it ends the thread.
    stop: Option<Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Announcer {
    pub(super) fn start(participant: Participant, audience: Audience) -> std::io::Result<Self> {
        let mut sockets = Sockets::open(&participant, &audience)?;
        let (stop, stopped) = channel();
        let names = audience.host_names();
        let (resolved, addresses) = channel();
        if !names.is_empty() {
            // It is not joined: a lookup may take many seconds. It ends when nothing receives its results.
            std::thread::Builder::new()
                .name("lookup of static peers".to_owned())
                .spawn(move || look_up(&names, &resolved))?;
        }
        let thread = std::thread::Builder::new()
            .name("announcer".to_owned())
            .spawn(move || announce(&mut sockets, &participant, &audience, &addresses, &stopped))?;
        Ok(Self { stop: Some(stop), thread: Some(thread) })
    }
}

impl Drop for Announcer {
    fn drop(&mut self) {
        drop(self.stop.take());
        if let Some(thread) = self.thread.take()
            && thread.join().is_err()
        {
            tracing::warn!("the thread that announces the participant has failed");
        }
    }
}

impl Audience {
    fn host_names(&self) -> Vec<String> {
        let name = |peer: &StaticPeer| match peer {
            StaticPeer::Host(name) => Some(name.clone()),
            StaticPeer::Address(_) => None,
        };
        self.peers.iter().filter_map(name).collect()
    }

    /// Every destination, with `resolved` in the place of the peers that are names, and those who were
    /// `heard`.
    fn destinations(&self, resolved: &[Ipv4Addr], heard: &BTreeSet<Ipv4Addr>) -> Vec<SocketAddrV4> {
        let given = self.peers.iter().filter_map(|peer| match peer {
            StaticPeer::Address(address) => Some(*address),
            StaticPeer::Host(_) => None,
        });
        let hosts: BTreeSet<_> = given.chain(resolved.iter().chain(heard).copied()).collect();
        let of_peers = hosts.into_iter().flat_map(|host| {
            (0..PARTICIPANTS_OF_A_PEER).map(move |participant| (host, participant))
        });
        let here = REACHED_BY_THE_LIBRARY..ports::PARTICIPANTS_PER_HOST;
        let here = here
            .filter(|participant| self.this_machine && *participant != self.own_number)
            .map(|participant| (Ipv4Addr::LOCALHOST, participant));
        of_peers
            .chain(here)
            .filter_map(|(host, participant)| {
                let port = ports::discovery_unicast(self.domain, participant)?;
                Some(SocketAddrV4::new(host, port))
            })
            .collect()
    }
}

fn announce(
    sockets: &mut Sockets,
    participant: &Participant,
    audience: &Audience,
    addresses: &Receiver<Vec<Ipv4Addr>>,
    stopped: &Receiver<()>,
) {
    let mut resolved = Vec::new();
    let mut destinations = audience.destinations(&resolved, &BTreeSet::new());
    let nobody = BTreeSet::new();
    let mut pauses = FIRST_PAUSES.into_iter();
    let mut count = 0_u32;
    loop {
        let newest = addresses.try_iter().last().filter(|newest| *newest != resolved);
        let listener = sockets.listener.as_mut();
        let (heard, more_heard) = listener.map_or((&nobody, false), MulticastListener::machines);
        if newest.is_some() || more_heard {
            resolved = newest.unwrap_or(resolved);
            destinations = audience.destinations(&resolved, heard);
            // They have heard nothing yet.
            pauses = FIRST_PAUSES.into_iter();
        }
        sockets.send(&participant.announcement(count), audience, &destinations);
        count = count.saturating_add(1);
        match stopped.recv_timeout(pauses.next().unwrap_or(PAUSE)) {
            Err(RecvTimeoutError::Timeout) => {}
            Ok(()) | Err(RecvTimeoutError::Disconnected) => break,
        }
    }
    // By multicast too, as the announcements: see `Participant::farewell`.
    sockets.send(&participant.farewell(count), audience, &destinations);
}

fn send(socket: &UdpSocket, message: &[u8], destinations: &[SocketAddrV4]) {
    for destination in destinations {
        // Most are unused, and a network may be down for a while: the next round tries again.
        if let Err(error) = socket.send_to(message, destination) {
            tracing::trace!("announcement to {destination}: {error}");
        }
    }
}

/// Looks the names up again and again, until their addresses are no longer received.
fn look_up(names: &[String], resolved: &Sender<Vec<Ipv4Addr>>) {
    let mut warned = BTreeSet::new();
    loop {
        let mut addresses = Vec::new();
        for name in names {
            match addresses_of(name) {
                Ok(found) => addresses.extend(found),
                Err(reason) if warned.insert(name) => tracing::warn!(
                    "the static peer {name} is not found: {reason}; it is looked up again every {} s",
                    LOOKUP_PERIOD.as_secs()
                ),
                Err(_) => {}
            }
        }
        addresses.sort_unstable();
        addresses.dedup();
        if resolved.send(addresses).is_err() {
            return;
        }
        std::thread::sleep(LOOKUP_PERIOD);
    }
}

fn addresses_of(name: &str) -> Result<Vec<Ipv4Addr>, String> {
    let found = (name, 0).to_socket_addrs().map_err(|error| error.to_string())?;
    let addresses: Vec<_> = found
        .filter_map(|address| match address.ip() {
            std::net::IpAddr::V4(address) => Some(address),
            std::net::IpAddr::V6(_) => None,
        })
        .collect();
    if addresses.is_empty() { Err("it has no IPv4 address".to_owned()) } else { Ok(addresses) }
}
