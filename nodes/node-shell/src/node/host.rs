//! One process' place in the ROS graph: its nodes, and what they hand to each other without a network.

use std::sync::Arc;
#[cfg(feature = "zenoh")]
use std::sync::{Mutex, PoisonError, Weak};

use crate::endpoints::network::Network;
use crate::graph::Graph;
use crate::graph::exchange::Exchange;
use crate::graph::siblings::Siblings;
use crate::process::shutdown::Shutdown;
use crate::process::{allocator, descriptors, memory};
use crate::settings::names::NodeIdentity;
use crate::settings::waiting_cycles;
use crate::wire::error::ShellError;
#[cfg(feature = "zenoh")]
use crate::wire::rmw_zenoh::session::Session;
use crate::wire::transport::{NetworkWatch, Transport};

/// Lets the other tasks of the runtime run before a node goes on: to be awaited after each step that publishes. The peer that a
/// message wakes is next on this thread, and no other thread may take it from there: a node that always has input would keep it
/// waiting, and its cycles would be dropped as those of a slow node.
pub async fn let_peers_run() {
    tokio::task::yield_now().await;
}

/// Several nodes in one process. A message between two of them is a shared pointer; only who is outside
/// gets it over DDS, and it is encoded only for them. Neither the publisher nor the subscription knows
/// which of the two it is.
///
/// Each node has a DDS participant of its own: within one participant the readers and writers of a topic
/// share one cache, whose bound is that of the largest among them. On Zenoh all have one session.
#[derive(Clone)]
pub struct Host {
    transport: Option<Transport>,
    exchange: Arc<Exchange>,
    siblings: Siblings,
    shutdown: Shutdown,
    networks: NetworkWatch,
    is_started_again: bool,
    max_waiting_cycles: usize,
    /// Of all nodes, where the transport is Zenoh; open as long as one of them is.
    #[cfg(feature = "zenoh")]
    session: Arc<Mutex<Weak<Session>>>,
}

impl Host {
    /// A host whose nodes join a network. SIGINT and SIGTERM trigger the shutdown of all of its nodes.
    ///
    /// # Errors
    /// When the process may not handle signals, or there is no tokio runtime.
    pub fn on(transport: Transport) -> Result<Self, ShellError> {
        tokio::runtime::Handle::try_current().map_err(|_| ShellError::NoRuntime)?;
        let shutdown = Shutdown::new();
        shutdown.trigger_on_signals().map_err(ShellError::Process)?;
        descriptors::allow_all();
        // Without its limits the process takes more memory, and works.
        let _ = allocator::limit();
        let ceiling = memory::ceiling_bytes().map_err(ShellError::Setting)?;
        if let Some(bytes) = ceiling {
            memory::keep_below(bytes, &shutdown).map_err(ShellError::Process)?;
        }
        if memory::is_unbounded(ceiling) {
            tracing::warn!(
                "the system does not report this process' memory (is /proc mounted?): it has no ceiling, and a crafted datagram or a map \
                 without end can use up this machine's"
            );
        }
        let networks = NetworkWatch::start(&transport, &shutdown).map_err(ShellError::Process)?;
        let wanted = std::env::var(waiting_cycles::VARIABLE).ok();
        let max_waiting_cycles =
            waiting_cycles::parse(wanted.as_deref()).map_err(ShellError::Setting)?;
        let transport = Some(transport);
        Ok(Self { transport, shutdown, networks, max_waiting_cycles, ..Self::in_process() })
    }

    /// A host on no network: its nodes are connected only to each other. It needs no runtime, takes no signals, and
    /// what arrives depends on nothing but what was published.
    #[must_use]
    pub fn in_process() -> Self {
        Self {
            transport: None,
            exchange: Arc::new(Exchange::new()),
            siblings: Siblings::default(),
            shutdown: Shutdown::new(),
            networks: NetworkWatch::default(),
            is_started_again: false,
            max_waiting_cycles: waiting_cycles::EVERY,
            #[cfg(feature = "zenoh")]
            session: Arc::default(),
        }
    }

    /// Joins the network that the host is on, if any, as a node.
    pub(crate) fn join(
        &self,
        identity: &NodeIdentity,
        graph: &Graph,
    ) -> Result<Option<Network>, ShellError> {
        let Some(transport) = &self.transport else { return Ok(None) };
        #[cfg(feature = "zenoh")]
        if let Some(settings) = transport.zenoh() {
            let mut session = self.session.lock().unwrap_or_else(PoisonError::into_inner);
            let open = match session.upgrade() {
                Some(open) => open,
                None => {
                    let domain_id = transport.domain_id();
                    let opened = Session::open(domain_id, settings, &self.shutdown);
                    Arc::new(opened.map_err(ShellError::Zenoh)?)
                }
            };
            *session = Arc::downgrade(&open);
            return Network::join_zenoh(&open, identity, graph).map(Some);
        }
        Network::join(transport, identity, graph, &self.siblings).map(Some)
    }

    /// The same, with this many cycles that may wait before a node of it; live 2, on no network 50.
    #[must_use]
    pub fn with_max_waiting_cycles(self, max_waiting_cycles: usize) -> Self {
        Self { max_waiting_cycles: max_waiting_cycles.max(1), ..self }
    }

    /// The same, of a process that serves a robot and is started again where it fails: once the network has changed, and a node hears
    /// nothing for it, the process ends so.
    #[must_use]
    pub fn started_again(self) -> Self {
        Self { is_started_again: true, ..self }
    }

    pub(crate) fn is_started_again(&self) -> bool {
        self.is_started_again
    }

    /// How the machine's networks differ from those that the nodes have joined.
    pub(crate) fn networks(&self) -> &NetworkWatch {
        &self.networks
    }

    /// Whether the process is to end; all nodes of the host share it.
    #[must_use]
    pub fn shutdown_signal(&self) -> Shutdown {
        self.shutdown.clone()
    }

    pub(crate) fn max_waiting_cycles(&self) -> usize {
        self.max_waiting_cycles
    }

    pub(crate) fn exchange(&self) -> &Arc<Exchange> {
        &self.exchange
    }

    pub(crate) fn siblings(&self) -> &Siblings {
        &self.siblings
    }
}
