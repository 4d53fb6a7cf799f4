//! An endpoint's own view of the graph.

use rustdds::GUID;

use super::Graph;
use crate::graph::exchange::EndpointId;

/// An endpoint of the node, until it is dropped.
pub(crate) struct OpenEndpoint {
    id: EndpointId,
    graph: Graph,
}

impl OpenEndpoint {
    pub(crate) fn new(id: EndpointId, graph: &Graph) -> Self {
        Self { id, graph: graph.clone() }
    }

    pub(crate) fn id(&self) -> EndpointId {
        self.id
    }

    /// How many peers it has, wherever they are.
    pub(crate) fn peers(&self) -> usize {
        self.graph.peers(self.id)
    }

    /// How many peers it has in its own host.
    pub(crate) fn peers_in_host(&self) -> usize {
        self.graph.exchange.counterparts(self.id)
    }

    /// How many peers it has on the network.
    pub(crate) fn peers_outside(&self) -> usize {
        self.graph.outside_peers(self.id)
    }

    /// Waits until it has at least `least` peers.
    pub(crate) async fn wait_for_peers(&self, least: usize) {
        self.graph.wait_for_peers(self.id, least).await;
    }

    /// Whether `peer` sends another type than this reads.
    pub(crate) fn is_foreign(&self, peer: GUID) -> bool {
        self.graph.is_foreign(self.id, peer)
    }

    /// Whether `peer` is of the same host, and so has handed its messages over already.
    pub(crate) fn is_sibling(&self, peer: GUID) -> bool {
        self.graph.siblings.contain(peer)
    }
}

impl Drop for OpenEndpoint {
    fn drop(&mut self) {
        self.graph.leave(self.id);
    }
}
