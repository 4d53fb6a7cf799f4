//! What the servers share: a listening socket with random bytes for its token, and a thread of their own.

use std::net::{SocketAddr, TcpListener};
use std::sync::Arc;

use node_shell::{Node, NodeFailure};
use tokio::sync::oneshot;

use super::ViewError;

/// A socket that listens, and the random bytes of its token.
pub(super) struct OwnServer {
    pub(super) listener: TcpListener,
    pub(super) address: SocketAddr,
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
        Ok(Self { listener, address, random })
    }
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
