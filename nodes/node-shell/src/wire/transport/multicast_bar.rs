//! Keeps a participant from hearing multicast, and so from offering it to its peers.
//!
//! The DDS library sends to a peer that offers multicast by multicast alone. Where the network does not carry
//! it, as many wireless ones do not, such a peer is found and then nothing arrives. The library has no
//! switch for it, but does without multicast when the ports for it are taken.

use std::net::{Ipv4Addr, SocketAddrV4};
use std::time::{Duration, Instant};

use socket2::{Domain, Protocol, Socket, Type};

use super::ports;

/// How long the bar is tried for: another process of this machine may raise one at the same time.
const PATIENCE: Duration = Duration::from_millis(500);
const RETRY: Duration = Duration::from_millis(5);

/// Takes the multicast ports of a domain as long as it lives. It is to live for the few milliseconds in
/// which a participant opens its sockets: a DDS program that opens its own in just these finds the ports
/// taken.
#[derive(Debug)]
pub(super) struct MulticastBar {
    _sockets: [Socket; 2],
}

impl MulticastBar {
    pub(super) fn raise(domain: u16) -> std::io::Result<Self> {
        let end = Instant::now() + PATIENCE;
        loop {
            let taken = take(ports::discovery_multicast(domain))
                .and_then(|first| Ok([first, take(ports::data_multicast(domain))?]));
            match taken {
                Ok(sockets) => return Ok(Self { _sockets: sockets }),
                Err(error) if Instant::now() >= end => return Err(error),
                Err(_) => std::thread::sleep(RETRY),
            }
        }
    }
}

/// Binds a port that others have bound for sharing already, and then shares it no longer.
fn take(port: u16) -> std::io::Result<Socket> {
    let socket = Socket::new(Domain::IPV4, Type::DGRAM, Some(Protocol::UDP))?;
    socket.set_reuse_address(true)?;
    #[cfg(unix)]
    socket.set_reuse_port(true)?;
    socket.bind(&SocketAddrV4::new(Ipv4Addr::UNSPECIFIED, port).into())?;
    socket.set_reuse_address(false)?;
    #[cfg(unix)]
    socket.set_reuse_port(false)?;
    Ok(socket)
}
