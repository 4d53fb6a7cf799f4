//! A ROS 2 node: its name, its parameters, its endpoints, and its participant on the network.

pub(crate) mod clock;
pub(crate) mod endpoints;
pub(crate) mod host;
pub(crate) mod life;
pub(crate) mod stamp_check;

use std::sync::Arc;

use msgs::diagnostic_msgs::DiagnosticStatus;
use tokio::sync::watch;
use tracing::Span;

use crate::endpoints::counters::Counters;
use crate::endpoints::network::{Link, Network};
use crate::graph::survey::{self, DiscoveredEndpoint};
use crate::graph::{Graph, Match};
use crate::node::clock::NodeClock;
use crate::node::host::Host;
use crate::node::life::Life;
use crate::process::log::{self, LogOutputs};
use crate::process::shutdown::Shutdown;
use crate::settings::arguments::RosArguments;
use crate::settings::names::NodeIdentity;
use crate::settings::parameters::{self, Switches};
use crate::settings::qos::Qos;
use crate::settings::waiting_cycles;
use crate::wire::error::ShellError;
use crate::wire::rmw_zenoh::ZenohLinks;
use crate::wire::transport::GrantedBuffer;

/// A running node.
pub struct Node {
    identity: NodeIdentity,
    arguments: RosArguments,
    graph: Graph,
    counters: Counters,
    host: Host,
    clock: NodeClock,
    switches: Switches,
    life: Life,
    /// What the node last reported on /diagnostics.
    report: watch::Sender<Option<Arc<DiagnosticStatus>>>,
    network: Option<Network>,
}

impl Node {
    /// A node of a host, which does nothing of its own yet.
    pub(crate) fn of(
        host: &Host,
        identity: NodeIdentity,
        arguments: &RosArguments,
    ) -> Result<Self, ShellError> {
        let switches = parameters::switches(&identity, &arguments.parameters)?;
        let graph = Graph::new(Arc::clone(host.exchange()), host.siblings().clone());
        let network = host.join(&identity, &graph)?;
        Ok(Self {
            identity,
            arguments: arguments.clone(),
            graph,
            counters: Counters::default(),
            host: host.clone(),
            clock: NodeClock::new(switches.use_sim_time),
            switches,
            life: Life::default(),
            report: watch::Sender::new(None),
            network,
        })
    }

    /// The node's name with its namespace.
    #[must_use]
    pub fn full_name(&self) -> String {
        self.identity.full_name()
    }

    pub(crate) fn logger_name(&self) -> String {
        self.identity.logger_name()
    }

    /// The span within which the node works: where nodes share a process, it gives the lines of the log the name of their node.
    #[must_use]
    pub fn span(&self) -> Span {
        log::span_of(&self.logger_name())
    }

    pub(crate) fn log_outputs(&self) -> &LogOutputs {
        &self.arguments.outputs
    }

    /// The time that the node goes by: the wall clock's or, with `use_sim_time`, that of `/clock`.
    #[must_use]
    pub fn clock(&self) -> NodeClock {
        self.clock.clone()
    }

    pub(crate) fn switches(&self) -> Switches {
        self.switches
    }

    pub(crate) fn host(&self) -> &Host {
        &self.host
    }

    /// None where the host is on no network.
    pub(crate) fn network(&self) -> Option<&Network> {
        self.network.as_ref()
    }

    pub(crate) fn life(&self) -> &Life {
        &self.life
    }

    pub(crate) fn graph(&self) -> &Graph {
        &self.graph
    }

    /// The node's counters; they appear on `/diagnostics`.
    #[must_use]
    pub fn counters(&self) -> Counters {
        self.counters.clone()
    }

    /// What the node reports on `/diagnostics`, each time anew; nothing before the first report, and of a node on no network.
    #[must_use]
    pub fn reports(&self) -> watch::Receiver<Option<Arc<DiagnosticStatus>>> {
        self.report.subscribe()
    }

    pub(crate) fn report_sender(&self) -> watch::Sender<Option<Arc<DiagnosticStatus>>> {
        self.report.clone()
    }

    /// Every publisher and subscription of the node with the number of its peers.
    #[must_use]
    pub fn matches(&self) -> Vec<Match> {
        self.graph.matches()
    }

    /// Every publisher and subscription of other processes that was discovered so far.
    #[must_use]
    pub fn survey(&self) -> Vec<DiscoveredEndpoint> {
        match self.network.as_ref().map(|network| &network.link) {
            None => Vec::new(),
            Some(Link::Dds(dds)) => survey::of(&dds.context.domain_participant(), &self.graph),
            #[cfg(feature = "zenoh")]
            Some(Link::Zenoh(_)) => survey::of_tokens(&self.graph),
        }
    }

    /// The receive buffer that the kernel grants, and so what size of message arrives whole; none for a
    /// node on no network, or on Zenoh.
    #[must_use]
    pub fn granted_buffer(&self) -> Option<GrantedBuffer> {
        Some(self.network.as_ref()?.link.dds()?.granted)
    }

    /// What the node is connected to on Zenoh; none on DDS, or on no network.
    #[must_use]
    pub fn zenoh_links(&self) -> Option<ZenohLinks> {
        match &self.network.as_ref()?.link {
            Link::Dds(_) => None,
            #[cfg(feature = "zenoh")]
            Link::Zenoh(node) => Some(node.links()),
        }
    }

    /// How a stage subscribes to the cycles of the one before it. Live, few may wait, and the oldest is dropped; without a network, and
    /// where `STILLMAP_MAX_WAITING_CYCLES` says so, many.
    #[must_use]
    pub fn cycles_qos(&self) -> Qos {
        Qos::reliable(self.host.max_waiting_cycles())
    }

    /// Whether each cycle counts, so that those that wait are to be worked off at the end.
    #[must_use]
    pub fn takes_every_cycle(&self) -> bool {
        self.host.max_waiting_cycles() >= waiting_cycles::EVERY
    }

    /// How many cycles may wait before a stage; `None` where each counts.
    #[must_use]
    pub fn max_waiting_cycles(&self) -> Option<usize> {
        (!self.takes_every_cycle()).then(|| self.host.max_waiting_cycles())
    }

    /// Whether the program is to end.
    #[must_use]
    pub fn shutdown_signal(&self) -> Shutdown {
        self.host.shutdown_signal()
    }

    /// Leaves the network in order, so that peers know at once and need not wait for 50 s. Publishers
    /// and subscriptions must be dropped before.
    pub async fn close(mut self) {
        let Some(mut network) = self.network.take() else { return };
        network.stop().await;
        let open = self.graph.open_endpoints();
        if open > 0 {
            tracing::warn!("the node closes with {open} publishers or subscriptions still open");
        }
        drop(network);
    }
}
