//! A ROS 2 node: its name, its parameters, its endpoints, and its participant on the network.

mod endpoints;
pub(crate) mod host;
mod own_tasks;
pub(crate) mod program;
pub(crate) mod stage_report;
pub(crate) mod steps;
pub(crate) mod transforms;

use std::sync::Arc;

use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::endpoints::counters::Counters;
use crate::endpoints::network::Network;
use crate::graph::survey::{self, DiscoveredEndpoint};
use crate::graph::{Graph, Match};
use crate::node::host::Host;
use crate::process::shutdown::Shutdown;
use crate::services::clock::NodeClock;
use crate::services::lifecycle::{Life, Lifecycle, LifecycleServices};
use crate::services::parameter_services::{LiveParameters, ParameterServices};
use crate::settings::arguments::RosArguments;
use crate::settings::names::NodeIdentity;
use crate::settings::parameters::{self, NodeParameters, ParameterError, Switches};
use crate::wire::error::ShellError;
use crate::wire::transport::{GrantedBuffer, Transport};

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
    network: Option<Network>,
}

impl Node {
    /// Starts a node on the network that the environment names, alone in its process. From then on SIGINT
    /// and SIGTERM trigger its [`Node::shutdown_signal`].
    ///
    /// # Errors
    /// When names, environment or network do not allow it. Must be called within a tokio runtime.
    pub fn start(default_name: &str, arguments: &RosArguments) -> Result<Self, ShellError> {
        Self::start_on(Transport::from_environment()?, default_name, arguments)
    }

    /// Starts a node on a given network, alone in its process.
    ///
    /// # Errors
    /// As [`Node::start`].
    pub fn start_on(
        transport: Transport,
        default_name: &str,
        arguments: &RosArguments,
    ) -> Result<Self, ShellError> {
        Host::on(transport)?.node(default_name, arguments)
    }

    /// Starts a node of a host.
    pub(crate) fn of(
        host: &Host,
        default_name: &str,
        arguments: &RosArguments,
    ) -> Result<Self, ShellError> {
        let identity = arguments.identity(default_name)?;
        let switches = parameters::switches(&identity, &arguments.parameters)?;
        let graph = Graph::new(Arc::clone(host.exchange()), host.siblings().clone());
        let network = match host.transport() {
            None => None,
            Some(transport) => Some(Network::join(transport, &identity, &graph, host)?),
        };
        let node = Self {
            identity,
            arguments: arguments.clone(),
            graph,
            counters: Counters::default(),
            host: host.clone(),
            clock: NodeClock::new(switches.use_sim_time),
            switches,
            life: Life::default(),
            network,
        };
        node.start_clock()?;
        node.start_diagnostics()?;
        node.start_rosout()?;
        Ok(node)
    }

    /// The node's name with its namespace.
    #[must_use]
    pub fn full_name(&self) -> String {
        self.identity.full_name()
    }

    /// The node's parameters: the defaults of `P`, with the values of parameter files and of the
    /// command line laid over them.
    ///
    /// # Errors
    /// When a file or a value cannot be used.
    pub fn parameters<P>(&self) -> Result<P, ParameterError>
    where
        P: Serialize + DeserializeOwned + Default,
    {
        parameters::of_node(&self.identity, &self.arguments.parameters)
    }

    /// Lets others read the node's parameters and set those that may change, as long as the node runs; logs their values.
    ///
    /// # Errors
    /// When a name is none, or the library refuses.
    pub fn serve_parameters<P: NodeParameters>(
        &self,
        parameters: &P,
    ) -> Result<LiveParameters<P>, ShellError> {
        let Some(network) = &self.network else { return Ok(LiveParameters::fixed()) };
        let (services, live) = ParameterServices::open(self, parameters)?;
        network.spawn(|stop| services.run(stop));
        Ok(live)
    }

    /// The time that the node goes by: the wall clock's or, with `use_sim_time`, that of `/clock`.
    #[must_use]
    pub fn clock(&self) -> NodeClock {
        self.clock.clone()
    }

    /// Lets others manage the node as long as it runs; see [`Lifecycle`]. The node is active from the start unless its
    /// parameter `autostart` is false.
    ///
    /// # Errors
    /// When a name is none, or the library refuses.
    pub fn manage(&self) -> Result<Lifecycle, ShellError> {
        let Some(network) = &self.network else { return Ok(Lifecycle::unmanaged()) };
        let (services, lifecycle) =
            LifecycleServices::open(self, &self.life, self.switches.autostart)?;
        network.spawn(|stop| services.run(stop));
        Ok(lifecycle)
    }

    pub(crate) fn switches(&self) -> Switches {
        self.switches
    }

    #[cfg(test)]
    pub(crate) fn life(&self) -> &Life {
        &self.life
    }

    #[cfg(test)]
    pub(crate) fn graph(&self) -> &Graph {
        &self.graph
    }

    /// What the node counts of itself; it appears on `/diagnostics`.
    #[must_use]
    pub fn counters(&self) -> Counters {
        self.counters.clone()
    }

    /// Every publisher and subscription of the node with the number of its peers.
    #[must_use]
    pub fn matches(&self) -> Vec<Match> {
        self.graph.matches()
    }

    /// Every publisher and subscription of other processes that was discovered so far.
    #[must_use]
    pub fn survey(&self) -> Vec<DiscoveredEndpoint> {
        self.network.as_ref().map_or_else(Vec::new, |network| {
            survey::of(&network.context.domain_participant(), &self.graph)
        })
    }

    /// The receive buffer that the kernel grants, and so what size of message arrives whole; none for a
    /// node on no network.
    #[must_use]
    pub fn granted_buffer(&self) -> Option<GrantedBuffer> {
        self.network.as_ref().map(|network| network.granted)
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
