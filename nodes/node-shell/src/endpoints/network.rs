//! The network part of a node: its participant, its announcer, and its own tasks.

use std::ops::{Deref, DerefMut};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use futures::FutureExt;
use futures::future::BoxFuture;
use msgs::RosMessage;
use ros2_client::{Context, NodeName, NodeOptions};
use rustdds::{DomainParticipant, GUID, QosPolicies, RTPSEntity, Topic, TopicKind};
use tokio::sync::watch;
use tokio::task::JoinHandle;
use tracing::Instrument;

use crate::endpoints::service::Body;
use crate::graph::siblings::Siblings;
use crate::graph::{self, Graph};
use crate::settings::names::{self, NodeIdentity};
use crate::settings::qos::Qos;
use crate::wire::error::ShellError;
use crate::wire::payload::Payload;
#[cfg(feature = "zenoh")]
use crate::wire::rmw_zenoh::keys::Token;
#[cfg(feature = "zenoh")]
use crate::wire::rmw_zenoh::session::{Session, ZenohNode};
use crate::wire::transport::{
    self, Announcer, AtRest, BacklogWatch, GrantedBuffer, Joined, LibraryThreads, ReceiveHealth,
    Transport,
};

/// How long the node waits for its own tasks at the end.
const LONGEST_CLOSE: Duration = Duration::from_millis(500);

/// The network part of a node.
pub(crate) struct Network {
    /// Ends the node's own tasks; not the same as the host's shutdown, which only asks the program to end.
    stop: watch::Sender<bool>,
    tasks: Mutex<Vec<JoinHandle<()>>>,
    pub(crate) link: Link,
}

/// What the node is on the network by.
pub(crate) enum Link {
    Dds(Box<Dds>),
    #[cfg(feature = "zenoh")]
    Zenoh(ZenohNode),
}

impl Link {
    pub(crate) fn dds(&self) -> Option<&Dds> {
        match self {
            Self::Dds(dds) => Some(dds),
            #[cfg(feature = "zenoh")]
            Self::Zenoh(_) => None,
        }
    }
}

/// A node's participant, and what belongs to it.
pub(crate) struct Dds {
    pub(crate) granted: GrantedBuffer,
    pub(crate) health: Arc<ReceiveHealth>,
    /// The largest datagram that every interface carries in one piece.
    pub(crate) smallest_mtu_bytes: usize,
    // In the order in which they must end: the announcer, the watch with its handles of the sockets,
    // the node, then the context.
    _announcer: Option<Announcer>,
    _backlog: Option<BacklogWatch>,
    library: Arc<Library>,
    pub(crate) context: Context,
}

/// The library's node, which makes one endpoint at a time.
struct Library {
    node: Mutex<ros2_client::Node>,
    threads: Arc<LibraryThreads>,
}

/// The library's node while its threads are at rest, to make an endpoint.
pub(crate) struct EndpointMaker<'a> {
    // The threads go on before another thread makes an endpoint.
    _at_rest: AtRest<'a>,
    node: MutexGuard<'a, ros2_client::Node>,
}

impl Deref for EndpointMaker<'_> {
    type Target = ros2_client::Node;

    fn deref(&self) -> &Self::Target {
        &self.node
    }
}

impl DerefMut for EndpointMaker<'_> {
    fn deref_mut(&mut self) -> &mut Self::Target {
        &mut self.node
    }
}

impl Library {
    fn for_an_endpoint(&self) -> EndpointMaker<'_> {
        let node = self.node.lock().unwrap_or_else(PoisonError::into_inner);
        EndpointMaker { _at_rest: self.threads.at_rest(), node }
    }
}

impl Network {
    /// Joins the network as a node of the process that has these `siblings`.
    pub(crate) fn join(
        transport: &Transport,
        identity: &NodeIdentity,
        graph: &Graph,
        siblings: &Siblings,
    ) -> Result<Self, ShellError> {
        let join_error =
            |reason: String| ShellError::Join { transport: transport.to_string(), reason };
        let Joined { announcer, participant, granted, health, backlog, threads } =
            transport.join()?;
        siblings.enter(participant.guid());
        let at_rest = threads.at_rest();
        let names = graph::announced_names(&participant);
        drop(at_rest);
        let at_rest = threads.at_rest();
        let context = Context::from_domain_participant(participant.clone())
            .map_err(|error| join_error(error.to_string()))?;
        drop(at_rest);
        let name = NodeName::new(identity.namespace(), identity.name())
            .map_err(|error| join_error(error.to_string()))?;
        // The library's parameter services have a mapping that Cyclone's clients cannot call, and its rosout knows nothing
        // of this suite's log.
        let options = NodeOptions::new().enable_rosout(false).start_parameter_services(false);
        let at_rest = threads.at_rest();
        let node =
            context.new_node(name, options).map_err(|error| join_error(error.to_string()))?;
        drop(at_rest);
        let stop = watch::Sender::new(false);
        let follow = graph.clone().follow(participant, names, stopped(&stop));
        let follow = tokio::spawn(follow.in_current_span());
        if let Some(reason) = health.filter().missing() {
            tracing::warn!(
                "the kernel does not filter datagrams ({reason}): a crafted datagram can use up this machine's memory; let \
                 only trusted hosts reach the node (SECURITY.md)"
            );
        }
        let reach = transport.with_networks();
        let name = identity.full_name();
        if reach.is_cut_off() {
            tracing::warn!(
                "node {name} on {reach}, it hears no other process; receive buffer {granted}"
            );
        } else {
            tracing::info!("node {name} on {reach}; receive buffer {granted}");
        }
        let dds = Dds {
            granted,
            health,
            smallest_mtu_bytes: transport::smallest_mtu_bytes(),
            _announcer: announcer,
            _backlog: backlog,
            library: Arc::new(Library { node: Mutex::new(node), threads: Arc::new(threads) }),
            context,
        };
        Ok(Self { stop, tasks: Mutex::new(vec![follow]), link: Link::Dds(Box::new(dds)) })
    }

    /// Joins a Zenoh session as a node of it.
    #[cfg(feature = "zenoh")]
    pub(crate) fn join_zenoh(
        session: &Arc<Session>,
        identity: &NodeIdentity,
        graph: &Graph,
    ) -> Result<Self, ShellError> {
        let node = ZenohNode::new(session, identity).map_err(ShellError::Zenoh)?;
        let stop = watch::Sender::new(false);
        let tokens = node.follow().map_err(ShellError::Zenoh)?;
        let own = node.session_id().to_owned();
        let is_own = move |token: &Token| token.node.session == own;
        let follow = graph.clone().follow_tokens(tokens, is_own, stopped(&stop));
        let follow = tokio::spawn(follow.in_current_span());
        tracing::info!("node {} on Zenoh", identity.full_name());
        Ok(Self { stop, tasks: Mutex::new(vec![follow]), link: Link::Zenoh(node) })
    }

    /// Lets a task of the node run until the node leaves the network.
    pub(crate) fn spawn<F: Future<Output = ()> + Send + 'static>(
        &self,
        task: impl FnOnce(BoxFuture<'static, ()>) -> F,
    ) {
        let task = task(stopped(&self.stop).boxed());
        let task = tokio::spawn(task.in_current_span());
        self.tasks.lock().unwrap_or_else(PoisonError::into_inner).push(task);
    }

    /// Ends the node's own tasks.
    pub(crate) async fn stop(&mut self) {
        self.stop.send_replace(true);
        let tasks = self.tasks.get_mut().unwrap_or_else(PoisonError::into_inner);
        for mut task in tasks.drain(..) {
            if tokio::time::timeout(LONGEST_CLOSE, &mut task).await.is_err() {
                tracing::warn!("a task of the node did not end by itself");
                task.abort();
            }
        }
    }
}

impl Dds {
    /// The library's threads for this node.
    pub(crate) fn threads(&self) -> Arc<LibraryThreads> {
        Arc::clone(&self.library.threads)
    }

    /// Makes writers of one topic, one after the other.
    pub(crate) fn writer_maker(
        &self,
        absolute: &str,
        dds_type: &str,
        policies: QosPolicies,
    ) -> impl Fn() -> Result<(GUID, ros2_client::Publisher<Payload>), String> + Send + Sync + 'static
    {
        let participant = self.context.domain_participant();
        let library = Arc::clone(&self.library);
        let (absolute, dds_type) = (absolute.to_owned(), dds_type.to_owned());
        move || {
            let topic = dds_topic(&participant, &absolute, &dds_type, &policies)?;
            let mut node = library.for_an_endpoint();
            let writer = node.create_publisher(&topic, None).map_err(|error| error.to_string())?;
            Ok((writer.guid(), writer))
        }
    }

    /// Makes readers of one topic, one after the other.
    pub(crate) fn reader_maker<M: RosMessage>(
        &self,
        absolute: &str,
        dds_type: &str,
        qos: &Qos,
    ) -> impl Fn() -> Result<(GUID, ros2_client::Subscription<M>), String> + Send + Sync + 'static
    {
        let participant = self.context.domain_participant();
        let library = Arc::clone(&self.library);
        let (absolute, dds_type) = (absolute.to_owned(), dds_type.to_owned());
        let policies = qos.reader_policies();
        move || {
            let topic = dds_topic(&participant, &absolute, &dds_type, &policies)?;
            let mut node = library.for_an_endpoint();
            let reader =
                node.create_subscription(&topic, None).map_err(|error| error.to_string())?;
            Ok((reader.guid(), reader))
        }
    }

    /// A writer of a service's responses.
    pub(crate) fn response_writer(
        &self,
        absolute: &str,
        dds_type: &str,
        policies: &QosPolicies,
    ) -> Result<ros2_client::Publisher<Body>, String> {
        let name = names::dds_response_topic_name(absolute);
        let topic = self
            .context
            .domain_participant()
            .create_topic(name, dds_type.to_owned(), policies, TopicKind::NoKey)
            .map_err(|error| error.to_string())?;
        self.for_an_endpoint().create_publisher(&topic, None).map_err(|error| error.to_string())
    }

    /// The library's node, to make an endpoint.
    pub(crate) fn for_an_endpoint(&self) -> EndpointMaker<'_> {
        self.library.for_an_endpoint()
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

/// Resolves once the node stops its tasks, or is gone.
fn stopped(stop: &watch::Sender<bool>) -> impl Future<Output = ()> + Send + 'static {
    let mut stop = stop.subscribe();
    async move {
        let _ = stop.wait_for(|stopped| *stopped).await;
    }
}
