//! Messages and values between the nodes of one process: shared pointers, never bytes.
//!
//! Every publisher and subscription of a host is registered here, whether or not the host is on a network too.
//! A message that a node publishes goes to the subscriptions of the same host at once, as the very value that was
//! published; DDS is for those outside.

use std::any::Any;
use std::collections::{BTreeMap, VecDeque};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use msgs::cdr::CdrError;
use tokio::sync::watch;

use crate::graph::inbox::Inbox;
use crate::graph::value::InTransit;
use crate::settings::qos::Qos;

/// One publisher or subscription of a host.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub(crate) struct EndpointId(u64);

/// A message in transit.
#[derive(Clone)]
pub(crate) enum Message {
    /// A message, as its publisher had it.
    Shared(Arc<dyn Any + Send + Sync>),
    /// A value that is a message only for those who want one.
    Value(Arc<dyn InTransit>),
    /// An encoded one, as a bag has it; every subscription decodes it for itself.
    Encoded(Arc<[u8]>),
}

/// All publishers and subscriptions of a host.
pub(crate) struct Exchange {
    state: Mutex<State>,
    changes: watch::Sender<u64>,
}

#[derive(Default)]
struct State {
    next_id: u64,
    publishers: BTreeMap<EndpointId, LocalPublisher>,
    subscriptions: BTreeMap<EndpointId, LocalSubscription>,
}

/// The values that both ends of a connection must agree on.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct TopicKey {
    /// The absolute name.
    pub(crate) topic: String,
    /// The type, as `sensor_msgs::msg::dds_::LaserScan_`.
    pub(crate) dds_type: String,
}

struct LocalPublisher {
    key: TopicKey,
    /// The messages that late subscribers still get; none where the topic keeps none.
    kept: VecDeque<Message>,
    keeps: usize,
}

struct LocalSubscription {
    key: TopicKey,
    inbox: Arc<dyn Inbox>,
}

impl Exchange {
    pub(crate) fn new() -> Self {
        Self { state: Mutex::default(), changes: watch::Sender::new(0) }
    }

    /// Enters a publisher.
    pub(crate) fn enter_publisher(&self, key: TopicKey, qos: &Qos) -> EndpointId {
        let keeps = if qos.is_transient_local() { qos.depth() } else { 0 };
        let mut state = self.lock();
        let id = state.new_id();
        state.publishers.insert(id, LocalPublisher { key, kept: VecDeque::new(), keeps });
        drop(state);
        self.notify();
        id
    }

    /// Enters a subscription. Where it asks for what was published before, it gets what is kept.
    pub(crate) fn enter_subscription(
        &self,
        key: TopicKey,
        qos: &Qos,
        inbox: Arc<dyn Inbox>,
    ) -> EndpointId {
        let mut state = self.lock();
        let id = state.new_id();
        if qos.is_transient_local() {
            let earlier = state.publishers.values().filter(|publisher| publisher.key == key);
            for message in earlier.flat_map(|publisher| &publisher.kept) {
                // A decoding error was reported to its publisher, when it was published.
                let _ = inbox.push(message);
            }
        }
        state.subscriptions.insert(id, LocalSubscription { key, inbox });
        drop(state);
        self.notify();
        id
    }

    /// Takes a publisher or a subscription out.
    pub(crate) fn leave(&self, id: EndpointId) {
        let mut state = self.lock();
        state.publishers.remove(&id);
        state.subscriptions.remove(&id);
        drop(state);
        self.notify();
    }

    /// Hands a message to every subscription of its topic and type, in the order in which they entered.
    ///
    /// # Errors
    /// When a subscription cannot decode it; the others have it all the same.
    pub(crate) fn publish(&self, from: EndpointId, message: &Message) -> Result<(), CdrError> {
        let inboxes = self.inboxes_for(from, message);
        let mut result = Ok(());
        for inbox in inboxes {
            result = result.and(inbox.push(message));
        }
        result
    }

    /// How many endpoints of this host are at the other end of this one's topic.
    pub(crate) fn counterparts(&self, id: EndpointId) -> usize {
        let state = self.lock();
        if let Some(publisher) = state.publishers.get(&id) {
            state.subscriptions.values().filter(|one| one.key == publisher.key).count()
        } else if let Some(subscription) = state.subscriptions.get(&id) {
            state.publishers.values().filter(|one| one.key == subscription.key).count()
        } else {
            0
        }
    }

    /// Counts the changes of who is there, here and outside; who waits for the next one misses none.
    pub(crate) fn changes(&self) -> watch::Receiver<u64> {
        self.changes.subscribe()
    }

    /// Notifies those who wait for a change.
    pub(crate) fn notify(&self) {
        self.changes.send_modify(|count| *count += 1);
    }

    fn inboxes_for(&self, from: EndpointId, message: &Message) -> Vec<Arc<dyn Inbox>> {
        let mut state = self.lock();
        let Some(publisher) = state.publishers.get_mut(&from) else { return Vec::new() };
        if publisher.keeps > 0 {
            if publisher.kept.len() == publisher.keeps {
                publisher.kept.pop_front();
            }
            publisher.kept.push_back(message.clone());
        }
        let key = publisher.key.clone();
        let same = |one: &&LocalSubscription| one.key == key;
        state.subscriptions.values().filter(same).map(|one| Arc::clone(&one.inbox)).collect()
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl State {
    fn new_id(&mut self) -> EndpointId {
        self.next_id += 1;
        EndpointId(self.next_id)
    }
}
