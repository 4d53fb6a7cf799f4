//! The node `live_view` with its server: the topics of the suite in, a page for browsers out.
//!
//! The node and its server have a thread of their own, with a runtime of its own: the other nodes of the process share no task with
//! them. While nobody looks, nothing is subscribed to and nothing is made. What a browser asks for (a map to be saved, a parameter to
//! be set) goes to the services of the nodes as it would from any ROS 2 client.

mod browsers;
mod commands;
mod connection;
mod feed;
mod foxglove;
mod own_thread;
mod server;
mod shared;
mod status;

use std::net::SocketAddr;
use std::sync::Arc;

use msgs::rcl_interfaces::ParameterDescriptor;
use node_shell::{Node, NodeFailure};

use self::own_thread::{OwnServer, on_own_thread};
use self::shared::Shared;
use crate::Access;

pub use self::foxglove::{FOXGLOVE_ADDRESS, FOXGLOVE_NODE, FoxgloveServer};

/// The name of the node.
pub const NODE: &str = "live_view";

/// Where the page is served by default: this machine alone.
pub const DEFAULT_ADDRESS: &str = "127.0.0.1:8642";

/// A node whose parameters the page shows.
#[derive(Clone, PartialEq, Debug)]
pub struct ShownNode {
    /// Its name, relative to the namespace of the view.
    pub name: String,
    /// The declarations of its parameters.
    pub parameters: Vec<ParameterDescriptor>,
    /// Whether the suite may run without it: then it is left out while it is not in the graph.
    pub may_be_absent: bool,
}

/// Where the nodes are that are shown.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum GraphOf {
    /// In the process of the view: values come as they are.
    ThisProcess,
    /// Elsewhere: messages come over the network.
    OtherProcesses,
}

/// The server cannot be had.
#[derive(Debug, thiserror::Error)]
pub enum ViewError {
    /// The address cannot be listened on.
    #[error("cannot serve viewers on {address}: {source}")]
    Listen {
        /// The address.
        address: SocketAddr,
        /// The system's error.
        source: std::io::Error,
    },
    /// The system gives no random bytes for the token.
    #[error("there are no random bytes for the token of viewers: {0}")]
    Random(getrandom::Error),
}

/// A server that listens, and does not answer yet.
pub struct LiveView {
    listener: std::net::TcpListener,
    shown: SocketAddr,
    access: Access,
}

impl LiveView {
    /// Listens on an address; port 0 is one that is free.
    ///
    /// # Errors
    /// When the address cannot be listened on.
    pub fn bind(address: SocketAddr) -> Result<Self, ViewError> {
        let OwnServer { listener, address, shown, random } = OwnServer::bind(address)?;
        Ok(Self { listener, shown, access: Access::on(address.ip(), random) })
    }

    /// The address of the page, with the token where it needs one.
    #[must_use]
    pub fn url(&self) -> String {
        match &self.access {
            Access::ThisMachine => format!("http://{}/", self.shown),
            Access::WithToken(token) => format!("http://{}/?token={}", self.shown, token.text()),
        }
    }

    /// Serves as `node` until the process is to end, on a thread of its own, and leaves the network.
    ///
    /// # Errors
    /// When a topic cannot be had, or the server fails.
    pub async fn serve(
        self,
        node: Node,
        graph: GraphOf,
        nodes: Vec<ShownNode>,
    ) -> Result<(), NodeFailure> {
        on_own_thread(NODE, node, move |node| self.run(node, graph, nodes)).await
    }

    fn run(
        self,
        node: &Arc<Node>,
        graph: GraphOf,
        nodes: Vec<ShownNode>,
    ) -> Result<(), NodeFailure> {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
        let shared = Arc::new(Shared::new(self.access, Arc::clone(node), nodes)?);
        let shutdown = node.shutdown_signal();
        runtime.block_on(async {
            let listener = tokio::net::TcpListener::from_std(self.listener)?;
            tokio::select! {
                served = server::serve(listener, Arc::clone(&shared)) => served,
                fed = feed::feed(node, graph, &shared) => fed,
                () = shutdown.wait() => Ok(()),
            }
        })
    }
}
