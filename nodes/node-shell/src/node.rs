//! A ROS 2 node: its name, its parameters, its endpoints, and its participant on the network.

mod own_tasks;

use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Weak};

use msgs::{RosMessage, RosService};
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::arguments::RosArguments;
use crate::clock::NodeClock;
use crate::counters::Counters;
use crate::error::ShellError;
use crate::exchange::TopicKey;
use crate::graph::{Graph, Match, OpenEndpoint, Role};
use crate::host::Host;
use crate::inbox::Queue;
use crate::lifecycle::{Gate, Life, Lifecycle, LifecycleServices};
use crate::names::{self, NodeIdentity};
use crate::network::Network;
use crate::parameter_services::{LiveParameters, ParameterServices};
use crate::parameters::{self, NodeParameters, ParameterError, Switches};
use crate::publisher::{Outlet, Publisher, RawPublisher};
use crate::qos::Qos;
use crate::reader::{MakeReader, Reader};
use crate::service::Service;
use crate::shutdown::Shutdown;
use crate::subscription::Subscription;
use crate::survey::{self, DiscoveredEndpoint};
use crate::transport::{GrantedBuffer, Transport};
use crate::writer::{MakeWriter, Writer};

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

    /// The absolute name of a topic, after remapping.
    ///
    /// # Errors
    /// When the name breaks the rules for topic names.
    pub fn resolve(&self, topic: &str) -> Result<String, ShellError> {
        Ok(self.identity.resolve(&self.arguments.remappings, topic)?)
    }

    /// A publisher of messages of one type.
    ///
    /// # Errors
    /// When the name is none, or the library refuses.
    pub fn publisher<M: RosMessage>(
        &self,
        topic: &str,
        qos: &Qos,
    ) -> Result<Publisher<M>, ShellError> {
        Ok(Publisher::new(self.outlet(topic, M::TYPE_NAME, qos, self.life.gate())?))
    }

    /// A publisher of what the node says of itself, whether it works or not.
    pub(crate) fn own_publisher<M: RosMessage>(
        &self,
        topic: &str,
        qos: &Qos,
    ) -> Result<Publisher<M>, ShellError> {
        Ok(Publisher::new(self.outlet(topic, M::TYPE_NAME, qos, Gate::default())?))
    }

    /// A publisher of messages that are encoded already; `type_name` as `sensor_msgs/msg/LaserScan`.
    ///
    /// # Errors
    /// When a name is none, or the library refuses.
    pub fn raw_publisher(
        &self,
        topic: &str,
        type_name: &str,
        qos: &Qos,
    ) -> Result<RawPublisher, ShellError> {
        Ok(RawPublisher::new(self.outlet(topic, type_name, qos, self.life.gate())?))
    }

    /// A subscription to messages of one type. What arrives while the node does not work is passed over, but for a topic
    /// whose last messages are kept for those who come late: they come once.
    ///
    /// # Errors
    /// When the name is none, or the library refuses.
    pub fn subscription<M: RosMessage>(
        &self,
        topic: &str,
        qos: &Qos,
    ) -> Result<Subscription<M>, ShellError> {
        let gate = if qos.is_transient_local() { Gate::default() } else { self.life.gate() };
        self.subscription_behind(gate, topic, qos)
    }

    fn subscription_behind<M: RosMessage>(
        &self,
        gate: Gate,
        topic: &str,
        qos: &Qos,
    ) -> Result<Subscription<M>, ShellError> {
        let absolute = self.resolve(topic)?;
        let dds_type = names::dds_type_name(M::TYPE_NAME)?;
        let queue = Arc::new(Queue::new(qos.depth()));
        let key = TopicKey { topic: absolute.clone(), dds_type: dds_type.clone() };
        let id = self.host.exchange().enter_subscription(key, qos, queue.clone());
        let endpoint = OpenEndpoint::new(id, &self.graph);
        let reader = match &self.network {
            None => self.graph.enter(id, (Role::Subscription, &absolute, &dds_type), || {
                Ok::<_, ShellError>(None)
            })?,
            Some(network) => {
                let make = network.reader_maker::<M>(&absolute, &dds_type, qos);
                let first = self
                    .graph
                    .enter(id, (Role::Subscription, &absolute, &dds_type), || make().map(Some))
                    .map_err(|reason| endpoint_error("subscription", &absolute, reason))?;
                let graph = self.graph.clone();
                let remake: MakeReader<M> = Box::new(move || graph.renew(id, &make));
                first.map(|first| {
                    let reader = Reader::new(&absolute, first, qos.is_reliable(), remake);
                    self.graph.renew_with(id, reader.renewal());
                    reader
                })
            }
        };
        let counters = self.counters.of_subscription(&absolute);
        Ok(Subscription::new((&absolute, qos.depth()), queue, reader, endpoint, (counters, gate)))
    }

    /// A service, for those outside; it must be dropped before the node is closed.
    ///
    /// # Errors
    /// When the name is none, or the library refuses.
    pub fn service<S: RosService>(&self, name: &str) -> Result<Service<S>, ShellError> {
        let absolute = self.identity.resolve_service(&self.arguments.remappings, name)?;
        match &self.network {
            None => Ok(Service::unasked(&absolute)),
            Some(network) => Service::new(network, &absolute),
        }
    }

    #[cfg(test)]
    pub(crate) fn life(&self) -> &Life {
        &self.life
    }

    #[cfg(test)]
    pub(crate) fn graph(&self) -> &Graph {
        &self.graph
    }

    fn outlet(
        &self,
        topic: &str,
        type_name: &str,
        qos: &Qos,
        gate: Gate,
    ) -> Result<Outlet, ShellError> {
        let absolute = self.resolve(topic)?;
        let dds_type = names::dds_type_name(type_name)?;
        let key = TopicKey { topic: absolute.clone(), dds_type: dds_type.clone() };
        let id = self.host.exchange().enter_publisher(key, qos);
        let endpoint = OpenEndpoint::new(id, &self.graph);
        let keeps = if qos.is_transient_local() { qos.depth() } else { 0 };
        let writer = match &self.network {
            None => self
                .graph
                .enter(id, (Role::Publisher, &absolute, &dds_type), || Ok::<_, ShellError>(None))?,
            Some(network) => {
                let make =
                    network.writer_maker(&absolute, &dds_type, qos.writer_policies(type_name));
                let first = self
                    .graph
                    .enter(id, (Role::Publisher, &absolute, &dds_type), || make().map(Some))
                    .map_err(|reason| endpoint_error("publisher", &absolute, reason))?;
                let graph = self.graph.clone();
                let remake: MakeWriter = Box::new(move || graph.renew(id, &make));
                first.map(|first| {
                    let writer = Writer::new(&absolute, first, keeps, remake);
                    let link: Weak<Writer> = Arc::downgrade(&writer);
                    self.graph.renew_with(id, link);
                    writer
                })
            }
        };
        Ok(Outlet {
            topic: absolute.as_str().into(),
            exchange: Arc::clone(self.host.exchange()),
            endpoint,
            writer,
            keeps: qos.is_transient_local(),
            granted: self.granted_buffer(),
            warned_of_size: AtomicBool::new(false),
            published: self.counters.of_publisher(&absolute),
            gate,
        })
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

fn endpoint_error(endpoint: &'static str, topic: &str, reason: String) -> ShellError {
    ShellError::Endpoint { endpoint, topic: topic.to_owned(), reason }
}
