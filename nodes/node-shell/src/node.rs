//! A ROS 2 node: one DDS participant, its name, its parameters, its endpoints.

use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use msgs::RosMessage;
use ros2_client::{Context, NodeName, NodeOptions};
use rustdds::{QosPolicies, Topic, TopicKind};
use serde::Serialize;
use serde::de::DeserializeOwned;
use tokio::sync::watch;
use tokio::task::JoinHandle;

use crate::arguments::RosArguments;
use crate::counters::Counters;
use crate::diagnostics::Diagnostics;
use crate::error::ShellError;
use crate::graph::{Graph, Match, Role};
use crate::names::{self, NodeIdentity};
use crate::parameters::{self, ParameterError};
use crate::publisher::{Publisher, RawPublisher};
use crate::qos::Qos;
use crate::shutdown::Shutdown;
use crate::subscription::Subscription;
use crate::transport::{GrantedBuffer, Transport};

/// The topic that nodes report about themselves on.
const DIAGNOSTICS: &str = "/diagnostics";
/// How long the node waits for its own tasks at the end.
const LONGEST_CLOSE: Duration = Duration::from_millis(500);

/// A running node. Each has a DDS participant of its own, since the client library tells only one node
/// of a participant about its peers.
pub struct Node {
    identity: NodeIdentity,
    arguments: RosArguments,
    granted: GrantedBuffer,
    graph: Graph,
    counters: Counters,
    shutdown: Shutdown,
    /// Ends the node's own tasks; not the same as `shutdown`, which only asks the program to end.
    stop: watch::Sender<bool>,
    tasks: Vec<JoinHandle<()>>,
    // In the order in which they must end: the node, then the context.
    inner: Mutex<ros2_client::Node>,
    context: Context,
}

impl Node {
    /// Starts a node on the network that the environment names. From then on SIGINT and SIGTERM
    /// trigger its [`Node::shutdown_signal`].
    ///
    /// # Errors
    /// When names, environment or network do not allow it. Must be called within a tokio runtime.
    pub fn start(default_name: &str, arguments: &RosArguments) -> Result<Self, ShellError> {
        Self::start_on(Transport::from_environment()?, default_name, arguments)
    }

    /// Starts a node on a given network.
    ///
    /// # Errors
    /// As [`Node::start`].
    pub fn start_on(
        transport: Transport,
        default_name: &str,
        arguments: &RosArguments,
    ) -> Result<Self, ShellError> {
        tokio::runtime::Handle::try_current().map_err(|_| ShellError::NoRuntime)?;
        let identity = arguments.identity(default_name)?;
        let join_error =
            |reason: String| ShellError::Join { transport: transport.to_string(), reason };
        let participant = transport.participant().map_err(|error| join_error(error.to_string()))?;
        let context = Context::from_domain_participant(participant.clone())
            .map_err(|error| join_error(error.to_string()))?;
        let name = NodeName::new(identity.namespace(), identity.name())
            .map_err(|error| join_error(error.to_string()))?;
        // The library's parameter services have a mapping that Cyclone's clients cannot call, and
        // nothing of this suite writes to its rosout.
        let options = NodeOptions::new().enable_rosout(false).start_parameter_services(false);
        let inner =
            context.new_node(name, options).map_err(|error| join_error(error.to_string()))?;

        let shutdown = Shutdown::new();
        shutdown.trigger_on_signals().map_err(ShellError::Process)?;
        let stop = watch::Sender::new(false);
        let graph = Graph::new();
        let follow = tokio::spawn(graph.clone().follow(participant, stopped(&stop)));
        let mut node = Self {
            identity,
            arguments: arguments.clone(),
            granted: transport.granted_buffer(),
            graph,
            counters: Counters::default(),
            shutdown,
            stop,
            tasks: vec![follow],
            inner: Mutex::new(inner),
            context,
        };
        node.start_diagnostics()?;
        tracing::info!("node {} on {transport}; receive buffer {}", node.full_name(), node.granted);
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
        Ok(Publisher::new(self.raw_publisher(topic, M::TYPE_NAME, qos)?))
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
        let absolute = self.resolve(topic)?;
        let dds_type = names::dds_type_name(type_name)?;
        let (_, writer) = self.graph.enter(Role::Publisher, &absolute, &dds_type, || {
            let failed = |reason| endpoint_error("publisher", &absolute, reason);
            let topic = self.topic(&absolute, &dds_type, &qos.writer_policies()).map_err(failed)?;
            let mut node = self.inner.lock().unwrap_or_else(PoisonError::into_inner);
            let writer =
                node.create_publisher(&topic, None).map_err(|error| failed(error.to_string()))?;
            Ok::<_, ShellError>((writer.guid(), writer))
        })?;
        let published = self.counters.of_publisher(&absolute);
        Ok(RawPublisher::new(&absolute, writer, self.graph.clone(), self.granted, published))
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
        let (_, reader) = self.graph.enter(Role::Subscription, &absolute, &dds_type, || {
            let failed = |reason| endpoint_error("subscription", &absolute, reason);
            let topic = self.topic(&absolute, &dds_type, &qos.reader_policies()).map_err(failed)?;
            let mut node = self.inner.lock().unwrap_or_else(PoisonError::into_inner);
            let reader = node
                .create_subscription(&topic, None)
                .map_err(|error| failed(error.to_string()))?;
            Ok::<_, ShellError>((reader.guid(), reader))
        })?;
        let counters = self.counters.of_subscription(&absolute);
        Ok(Subscription::new(&absolute, reader, self.graph.clone(), counters))
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

    /// The receive buffer that the kernel grants, and so what size of message arrives whole.
    #[must_use]
    pub fn granted_buffer(&self) -> GrantedBuffer {
        self.granted
    }

    /// Whether the program is to end.
    #[must_use]
    pub fn shutdown_signal(&self) -> Shutdown {
        self.shutdown.clone()
    }

    /// Leaves the network in order, so that peers know at once and need not wait for 50 s. Publishers
    /// and subscriptions must be dropped before.
    pub async fn close(mut self) {
        self.stop.send_replace(true);
        for mut task in std::mem::take(&mut self.tasks) {
            if tokio::time::timeout(LONGEST_CLOSE, &mut task).await.is_err() {
                tracing::warn!("a task of the node did not end by itself");
                task.abort();
            }
        }
        let open = self.graph.open_endpoints();
        if open > 0 {
            tracing::warn!("the node closes with {open} publishers or subscriptions still open");
        }
        let Self { inner, context, .. } = self;
        drop(inner);
        drop(context);
    }

    fn start_diagnostics(&mut self) -> Result<(), ShellError> {
        let diagnostics = Diagnostics {
            node_name: self.full_name(),
            publisher: self.publisher(DIAGNOSTICS, &Qos::reliable(10))?,
            graph: self.graph.clone(),
            counters: self.counters.clone(),
        };
        self.tasks.push(tokio::spawn(diagnostics.run(stopped(&self.stop))));
        Ok(())
    }

    /// The library's profiles cannot express resource limits, so the topic is made on the participant
    /// and its policies hold for the endpoint.
    fn topic(&self, absolute: &str, dds_type: &str, qos: &QosPolicies) -> Result<Topic, String> {
        let name = names::dds_topic_name(absolute);
        self.context
            .domain_participant()
            .create_topic(name, dds_type.to_owned(), qos, TopicKind::NoKey)
            .map_err(|error| error.to_string())
    }
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
