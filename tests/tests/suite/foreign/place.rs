//! Where a test's nodes and peers meet, apart from those of all others; and the suite's own ends.

use std::sync::atomic::{AtomicU16, Ordering};
use std::time::Duration;

use msgs::RosMessage;
use node_shell::{Node, Publisher, RosArguments, Subscription, Transport};
use tokio::sync::{Semaphore, SemaphorePermit};
use tokio::time::timeout;

use free_domain::FreeDomain;

/// Longer than anything here takes on a busy machine; reached only by a fault.
pub(super) const PATIENCE: Duration = Duration::from_secs(120);

/// How often the first message is sent before the exchange counts as broken.
///
/// A reliable reader of Cyclone DDS takes what the first heartbeat after the match announces for history,
/// which it does not want; and RustDDS may announce a sample a moment before it sends it. So the very first
/// message after a match is lost now and then (up to one match in ten on a busy machine). Whoever answers
/// one message is past that.
pub(super) const GREETINGS: usize = 30;
/// How long one of them may take.
pub(super) const LONGEST_GREETING: Duration = Duration::from_secs(1);

/// So many tests are in their places at once: they wait for messages most of the time.
const AT_ONCE: u32 = 3;

/// A domain and a namespace.
pub(super) struct Place {
    domain: FreeDomain,
    namespace: String,
    /// Few at a time: the tests load the machine.
    _permit: SemaphorePermit<'static>,
}

impl Place {
    pub(super) async fn new() -> Self {
        Self::with(1).await
    }

    /// With no other test in its place meanwhile: for what is lost on a busy machine.
    pub(super) async fn alone() -> Self {
        Self::with(AT_ONCE).await
    }

    async fn with(permits: u32) -> Self {
        static PERMITS: Semaphore = Semaphore::const_new(AT_ONCE as usize);
        static COUNT: AtomicU16 = AtomicU16::new(0);
        let permit = PERMITS.acquire_many(permits).await.unwrap();
        let count = COUNT.fetch_add(1, Ordering::Relaxed);
        let namespace = format!("/foreign_{}_{count}", std::process::id());
        Self { domain: FreeDomain::new(), namespace, _permit: permit }
    }

    pub(super) fn domain_id(&self) -> u16 {
        self.domain.number()
    }

    pub(super) fn namespace(&self) -> &str {
        &self.namespace
    }

    /// A node of the suite in this place.
    pub(super) fn node(&self, name: &str) -> Node {
        self.node_with(name, &[])
    }

    /// The same with more of ROS 2's arguments.
    pub(super) fn node_with(&self, name: &str, more: &[&str]) -> Node {
        let namespace = format!("__ns:={}", self.namespace);
        let line = ["--ros-args", "-r", &namespace].into_iter().chain(more.iter().copied());
        let arguments = RosArguments::parse(line).unwrap();
        Node::start_on(Transport::on_domain(self.domain.number()).unwrap(), name, &arguments)
            .unwrap()
    }
}

/// The size up to which messages arrive whole at a node.
pub(super) fn largest_safe_message(node: &Node) -> usize {
    node.granted_buffer().expect("the node is on a network").largest_safe_message()
}

/// Publishes a message, which must be taken.
pub(super) fn publish<M: RosMessage>(publisher: &Publisher<M>, message: &M) {
    publisher.publish(message.clone()).unwrap();
}

/// The next message, if it comes in time.
pub(super) async fn receive<M: RosMessage>(
    subscription: &Subscription<M>,
    longest: Duration,
) -> Option<M> {
    let received = timeout(longest, subscription.next()).await.ok()?;
    let message: &M = &received.message;
    Some(message.clone())
}

/// Waits until both ends have a peer.
pub(super) async fn have_matched<M: RosMessage>(
    publisher: &Publisher<M>,
    subscription: &Subscription<M>,
    longest: Duration,
) -> bool {
    let both = async {
        publisher.wait_for_subscribers(1).await;
        subscription.wait_for_publishers(1).await;
    };
    timeout(longest, both).await.is_ok()
}
