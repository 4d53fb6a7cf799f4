//! A ROS 2 node: its name, its parameters, its endpoints, and its participant on the network.

use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use msgs::{RosMessage, RosService};
use ros2_client::{Context, NodeName, NodeOptions};
use rustdds::{DomainParticipant, GUID, QosPolicies, RTPSEntity, Topic, TopicKind};
use serde::Serialize;
use serde::de::DeserializeOwned;
use tokio::sync::watch;
use tokio::task::JoinHandle;
use tracing::Instrument;

use crate::arguments::RosArguments;
use crate::counters::Counters;
use crate::diagnostics::Diagnostics;
use crate::error::ShellError;
use crate::exchange::TopicKey;
use crate::graph::{Graph, Match, OpenEndpoint, Role};
use crate::host::Host;
use crate::inbox::Queue;
use crate::names::{self, NodeIdentity};
use crate::parameters::{self, ParameterError};
use crate::payload::Payload;
use crate::publisher::{Outlet, Publisher, RawPublisher};
use crate::qos::Qos;
use crate::reader::{MakeReader, Reader, Renewal};
use crate::service::Service;
use crate::shutdown::Shutdown;
use crate::subscription::Subscription;
use crate::survey::{self, DiscoveredEndpoint};
use crate::transport::{Announcer, GrantedBuffer, Joined, ReceiveHealth, Transport};

/// The topic that nodes report about themselves on.
const DIAGNOSTICS: &str = "/diagnostics";
/// How long the node waits for its own tasks at the end.
const LONGEST_CLOSE: Duration = Duration::from_millis(500);

/// A running node.
pub struct Node {
    identity: NodeIdentity,
    arguments: RosArguments,
    graph: Graph,
    counters: Counters,
    host: Host,
    network: Option<Network>,
}

/// What a node has on the network.
struct Network {
    granted: GrantedBuffer,
    health: Arc<ReceiveHealth>,
    /// Ends the node's own tasks; not the same as the host's shutdown, which only asks the program to end.
    stop: watch::Sender<bool>,
    tasks: Vec<JoinHandle<()>>,
    // In the order in which they must end: the announcer, the node, then the context.
    announcer: Option<Announcer>,
    inner: Arc<Mutex<ros2_client::Node>>,
    context: Context,
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
        let graph = Graph::new(Arc::clone(host.exchange()), host.siblings().clone());
        let network = match host.transport() {
            None => None,
            Some(transport) => Some(Network::join(transport, &identity, &graph, host)?),
        };
        let mut node = Self {
            identity,
            arguments: arguments.clone(),
            graph,
            counters: Counters::default(),
            host: host.clone(),
            network,
        };
        node.start_diagnostics()?;
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
        Ok(Publisher::new(self.outlet(topic, M::TYPE_NAME, qos)?))
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
        Ok(RawPublisher::new(self.outlet(topic, type_name, qos)?))
    }

    /// A subscription to messages of one type.
    ///
    /// # Errors
    /// When the name is none, or the library refuses.
    pub fn subscription<M: RosMessage>(
        &self,
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
                let renewal = (!qos.is_reliable()).then(|| Renewal::new(remake));
                first.map(|first| Reader::new(&absolute, first, renewal))
            }
        };
        let counters = self.counters.of_subscription(&absolute);
        Ok(Subscription::new((&absolute, qos.depth()), queue, reader, endpoint, counters))
    }

    /// A service, for those outside; it must be dropped before the node is closed.
    ///
    /// # Errors
    /// When the name is none, or the library refuses.
    pub fn service<S: RosService>(&self, name: &str) -> Result<Service<S>, ShellError> {
        let absolute = self.resolve(name)?;
        match &self.network {
            None => Ok(Service::unasked(&absolute)),
            Some(network) => Service::new(&mut network.lock(), &absolute),
        }
    }

    fn outlet(&self, topic: &str, type_name: &str, qos: &Qos) -> Result<Outlet, ShellError> {
        let absolute = self.resolve(topic)?;
        let dds_type = names::dds_type_name(type_name)?;
        let key = TopicKey { topic: absolute.clone(), dds_type: dds_type.clone() };
        let id = self.host.exchange().enter_publisher(key, qos);
        let endpoint = OpenEndpoint::new(id, &self.graph);
        let writer = self.graph.enter(id, (Role::Publisher, &absolute, &dds_type), || {
            let Some(network) = &self.network else { return Ok(None) };
            let policies = qos.writer_policies();
            let participant = network.context.domain_participant();
            let writer = dds_topic(&participant, &absolute, &dds_type, &policies)
                .and_then(|topic| network.publisher(&topic))
                .map_err(|reason| endpoint_error("publisher", &absolute, reason))?;
            Ok::<_, ShellError>(Some((writer.guid(), writer)))
        })?;
        Ok(Outlet {
            topic: absolute.as_str().into(),
            exchange: Arc::clone(self.host.exchange()),
            endpoint,
            writer,
            keeps: qos.is_transient_local(),
            granted: self.granted_buffer(),
            warned_of_size: AtomicBool::new(false),
            published: self.counters.of_publisher(&absolute),
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
        let Some(network) = self.network.take() else { return };
        network.stop.send_replace(true);
        let Network { tasks, announcer, inner, context, .. } = network;
        for mut task in tasks {
            if tokio::time::timeout(LONGEST_CLOSE, &mut task).await.is_err() {
                tracing::warn!("a task of the node did not end by itself");
                task.abort();
            }
        }
        let open = self.graph.open_endpoints();
        if open > 0 {
            tracing::warn!("the node closes with {open} publishers or subscriptions still open");
        }
        drop(announcer);
        drop(inner);
        drop(context);
    }

    /// A node on no network has nobody to report to.
    fn start_diagnostics(&mut self) -> Result<(), ShellError> {
        let Some(network) = &self.network else { return Ok(()) };
        let diagnostics = Diagnostics {
            health: Arc::clone(&network.health),
            node_name: self.full_name(),
            publisher: self.publisher(DIAGNOSTICS, &Qos::reliable(10))?,
            graph: self.graph.clone(),
            counters: self.counters.clone(),
        };
        if let Some(network) = &mut self.network {
            network
                .tasks
                .push(tokio::spawn(diagnostics.run(stopped(&network.stop)).in_current_span()));
        }
        Ok(())
    }
}

impl Network {
    fn join(
        transport: &Transport,
        identity: &NodeIdentity,
        graph: &Graph,
        host: &Host,
    ) -> Result<Self, ShellError> {
        let join_error =
            |reason: String| ShellError::Join { transport: transport.to_string(), reason };
        let Joined { announcer, participant, granted, health } = transport.join()?;
        host.siblings().enter(participant.guid());
        let context = Context::from_domain_participant(participant.clone())
            .map_err(|error| join_error(error.to_string()))?;
        let name = NodeName::new(identity.namespace(), identity.name())
            .map_err(|error| join_error(error.to_string()))?;
        // The library's parameter services have a mapping that Cyclone's clients cannot call, and
        // nothing of this suite writes to its rosout.
        let options = NodeOptions::new().enable_rosout(false).start_parameter_services(false);
        let inner =
            context.new_node(name, options).map_err(|error| join_error(error.to_string()))?;
        let stop = watch::Sender::new(false);
        let follow =
            tokio::spawn(graph.clone().follow(participant, stopped(&stop)).in_current_span());
        tracing::info!("node {} on {transport}; receive buffer {granted}", identity.full_name());
        Ok(Self {
            granted,
            health,
            stop,
            tasks: vec![follow],
            announcer,
            inner: Arc::new(Mutex::new(inner)),
            context,
        })
    }

    fn publisher(&self, topic: &Topic) -> Result<ros2_client::Publisher<Payload>, String> {
        self.lock().create_publisher(topic, None).map_err(|error| error.to_string())
    }

    /// Makes readers of one topic, one after the other.
    fn reader_maker<M: RosMessage>(
        &self,
        absolute: &str,
        dds_type: &str,
        qos: &Qos,
    ) -> impl Fn() -> Result<(GUID, ros2_client::Subscription<M>), String> + Send + Sync + 'static
    {
        let participant = self.context.domain_participant();
        let inner = Arc::clone(&self.inner);
        let (absolute, dds_type) = (absolute.to_owned(), dds_type.to_owned());
        let policies = qos.reader_policies();
        move || {
            let topic = dds_topic(&participant, &absolute, &dds_type, &policies)?;
            let mut node = inner.lock().unwrap_or_else(PoisonError::into_inner);
            let reader =
                node.create_subscription(&topic, None).map_err(|error| error.to_string())?;
            Ok((reader.guid(), reader))
        }
    }

    fn lock(&self) -> MutexGuard<'_, ros2_client::Node> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The library's profiles cannot express resource limits, so the topic is made on the participant and its
/// policies hold for the endpoint.
fn dds_topic(
    participant: &DomainParticipant,
    absolute: &str,
    dds_type: &str,
    qos: &QosPolicies,
) -> Result<Topic, String> {
    participant
        .create_topic(names::dds_topic_name(absolute), dds_type.to_owned(), qos, TopicKind::NoKey)
        .map_err(|error| error.to_string())
}

fn endpoint_error(endpoint: &'static str, topic: &str, reason: String) -> ShellError {
    ShellError::Endpoint { endpoint, topic: topic.to_owned(), reason }
}

/// Resolves once the node stops its tasks, or is gone.
fn stopped(stop: &watch::Sender<bool>) -> impl Future<Output = ()> + Send + 'static {
    let mut stop = stop.subscribe();
    async move {
        let _ = stop.wait_for(|stopped| *stopped).await;
    }
}
