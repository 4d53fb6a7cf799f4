//! What the servers share: a listening socket with random bytes for its token, and a thread of their own.

use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr, TcpListener, UdpSocket};
use std::sync::Arc;

use node_shell::{Node, NodeFailure};
use tokio::sync::oneshot;

use super::ViewError;

/// A socket that listens, and the random bytes of its token.
pub(super) struct OwnServer {
    pub(super) listener: TcpListener,
    pub(super) address: SocketAddr,
    /// Where viewers find it.
    pub(super) shown: SocketAddr,
    pub(super) random: [u8; 16],
}

impl OwnServer {
    pub(super) fn bind(address: SocketAddr) -> Result<Self, ViewError> {
        let failed = |source| ViewError::Listen { address, source };
        let listener = TcpListener::bind(address).map_err(failed)?;
        listener.set_nonblocking(true).map_err(failed)?;
        let address = listener.local_addr().map_err(failed)?;
        let mut random = [0; 16];
        getrandom::fill(&mut random).map_err(ViewError::Random)?;
        Ok(Self { listener, address, shown: reached_at(address), random })
    }
}

/// The address for viewers of other machines: a socket on all addresses is reached at the one by which this machine reaches others.
fn reached_at(listening: SocketAddr) -> SocketAddr {
    if !listening.ip().is_unspecified() {
        return listening;
    }
    // Addresses for documentation (RFC 5737, RFC 3849): a datagram socket is only told its peer, and sends nothing.
    let of_others: [IpAddr; 2] =
        [Ipv4Addr::new(192, 0, 2, 1).into(), Ipv6Addr::new(0x2001, 0xdb8, 0, 0, 0, 0, 0, 1).into()];
    let own_toward = |other: IpAddr| {
        let any: IpAddr = match other {
            IpAddr::V4(_) => Ipv4Addr::UNSPECIFIED.into(),
            IpAddr::V6(_) => Ipv6Addr::UNSPECIFIED.into(),
        };
        let socket = UdpSocket::bind((any, 0)).ok()?;
        socket.connect((other, 9)).ok()?;
        Some(socket.local_addr().ok()?.ip())
    };
    // A socket on `[::]` is reached by IPv4, too.
    let usable = |other: &IpAddr| other.is_ipv4() || listening.is_ipv6();
    let own = of_others.into_iter().filter(usable).find_map(own_toward);
    own.map_or(listening, |own| SocketAddr::new(own, listening.port()))
}

/// Runs a node with its server on a thread of its own until it ends, and takes the node from the network.
pub(super) async fn on_own_thread(
    name: &str,
    node: Node,
    run: impl FnOnce(&Arc<Node>) -> Result<(), NodeFailure> + Send + 'static,
) -> Result<(), NodeFailure> {
    let (sender, ended) = oneshot::channel();
    let span = tracing::Span::current();
    std::thread::Builder::new().name(name.replace('_', "-")).spawn(move || {
        let _named = span.entered();
        let node = Arc::new(node);
        let result = run(&node);
        // The tasks have ended with their runtime, and with them all that held the node. The process may have ended meanwhile.
        let _ = sender.send((Arc::into_inner(node), result));
    })?;
    let (node, result) = ended.await?;
    if let Some(node) = node {
        node.close().await;
    }
    result
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Regression: the page of `--view 0.0.0.0:8642` was announced as `http://0.0.0.0:8642/`, which no other machine can open.
    #[test]
    fn a_server_on_all_addresses_names_one_that_others_reach() {
        let of = |text: &str| text.parse::<SocketAddr>().unwrap();
        assert_eq!(reached_at(of("127.0.0.1:8642")), of("127.0.0.1:8642"));
        assert_eq!(reached_at(of("[::1]:8642")), of("[::1]:8642"));
        // As long as this machine has a way to others.
        let has_a_way = UdpSocket::bind("0.0.0.0:0").unwrap().connect("192.0.2.1:9").is_ok();
        let shown = reached_at(of("0.0.0.0:8642"));
        assert_eq!(shown.port(), 8642);
        assert!(shown.is_ipv4());
        assert_eq!(shown.ip().is_unspecified(), !has_a_way, "{shown}");
    }
}
