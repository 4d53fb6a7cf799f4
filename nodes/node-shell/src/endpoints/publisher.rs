//! Publishers: of messages by their type, of values, and of messages that are encoded already.

use std::marker::PhantomData;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;

use msgs::{Domain, RosMessage};

use crate::endpoints::gate::Gate;
use crate::endpoints::writer::Outside;
use crate::graph::OpenEndpoint;
use crate::graph::exchange::{Exchange, Message};
use crate::graph::value::Lazy;
use crate::process::throttle::Throttle;
use crate::wire::error::PublishError;
use crate::wire::payload::Payload;
use crate::wire::transport::GrantedBuffer;

/// How long after its match a reader outside may still ignore what is sent to it: it has to discover this
/// writer in its turn, and Cyclone DDS takes what is sent before its first request of missing samples for
/// history. No message of the protocol marks the end of that.
const SETTLING: Duration = Duration::from_millis(100);

/// Publishes messages of one type.
pub struct Publisher<M> {
    outlet: Outlet,
    failed: Throttle,
    _message: PhantomData<fn(M)>,
}

impl<M: RosMessage> Publisher<M> {
    pub(crate) fn new(outlet: Outlet) -> Self {
        Self { outlet, failed: Throttle::for_warnings(), _message: PhantomData }
    }

    /// Publishes a message. Subscriptions of the same host get this very value; for those outside it is
    /// encoded, where there are any or no local subscription takes it. Returns once the message is queued; with reliable delivery this may
    /// take up to 0.1 s when subscribers are far behind.
    ///
    /// # Errors
    /// When it cannot be encoded, or is not taken.
    pub fn publish(&self, message: impl Into<Arc<M>>) -> Result<(), PublishError> {
        self.outlet.check_open()?;
        let message = message.into();
        let shared = Message::Shared(Arc::<M>::clone(&message));
        self.outlet.hand_over(&shared)?;
        if self.outlet.is_awaited_outside() {
            self.outlet.encode_and_send(&*message)?;
        }
        self.outlet.count();
        Ok(())
    }

    /// Publishes a message; when that fails, the failure is logged once in a while, and `false` comes
    /// back. For messages that are lost without harm, or repeated. It is not logged that the node is not active.
    pub fn publish_or_warn(&self, message: impl Into<Arc<M>>) -> bool {
        warned_of(&self.failed, self.publish(message))
    }

    /// Makes a message and publishes it where there is a subscriber; without one it is not even made. For data derived for
    /// viewers. A failure is reported once in a while.
    pub fn publish_if_awaited(&self, make: impl FnOnce() -> M) {
        if self.subscriber_count() > 0 {
            self.publish_or_warn(make());
        }
    }

    /// The topic, by its absolute name.
    #[must_use]
    pub fn topic(&self) -> &str {
        &self.outlet.topic
    }

    /// How many subscribers there are.
    #[must_use]
    pub fn subscriber_count(&self) -> usize {
        self.outlet.endpoint.peers()
    }

    /// Waits until there are at least `least` subscribers, and those outside have had the time to know of
    /// this publisher too.
    pub async fn wait_for_subscribers(&self, least: usize) {
        self.outlet.wait_for_subscribers(least).await;
    }
}

/// Publishes values of one type. A [`ValueSubscription`](crate::ValueSubscription) of the same host gets the very value; its
/// message is made once, and only where somebody wants it: a subscription to the message, or a peer outside.
pub struct ValuePublisher<T> {
    outlet: Outlet,
    failed: Throttle,
    _value: PhantomData<fn(T)>,
}

impl<T: Domain> ValuePublisher<T> {
    pub(crate) fn new(outlet: Outlet) -> Self {
        Self { outlet, failed: Throttle::for_warnings(), _value: PhantomData }
    }

    /// Publishes a value, as [`Publisher::publish`] does a message.
    ///
    /// # Errors
    /// When its message cannot be encoded, or is not taken.
    pub fn publish(&self, value: impl Into<Arc<T>>) -> Result<(), PublishError> {
        self.outlet.check_open()?;
        let value = Arc::new(Lazy::new(value.into()));
        let in_transit: Arc<Lazy<T>> = Arc::clone(&value);
        self.outlet.hand_over(&Message::Value(in_transit))?;
        if self.outlet.is_awaited_outside() {
            self.outlet.encode_and_send(&**value.its_message())?;
        }
        self.outlet.count();
        Ok(())
    }

    /// Publishes a value, as [`Publisher::publish_or_warn`] does a message.
    pub fn publish_or_warn(&self, value: impl Into<Arc<T>>) -> bool {
        warned_of(&self.failed, self.publish(value))
    }

    /// Makes a value and publishes it where there is a subscriber, as [`Publisher::publish_if_awaited`] does a message.
    pub fn publish_if_awaited(&self, make: impl FnOnce() -> T) {
        if self.subscriber_count() > 0 {
            self.publish_or_warn(make());
        }
    }

    /// How many subscribers there are.
    #[must_use]
    pub fn subscriber_count(&self) -> usize {
        self.outlet.endpoint.peers()
    }

    /// Waits until there are at least `least` subscribers, and those outside have had the time to know of
    /// this publisher too.
    pub async fn wait_for_subscribers(&self, least: usize) {
        self.outlet.wait_for_subscribers(least).await;
    }
}

/// Whether something was published; a failure is reported once in a while. That the node is not active is no news.
fn warned_of(failed: &Throttle, published: Result<(), PublishError>) -> bool {
    match published {
        Ok(()) => true,
        Err(PublishError::NotActive { .. }) => false,
        Err(error) => {
            if let Some(held_back) = failed.pass() {
                tracing::warn!("{error} ({held_back} more since the last warning)");
            }
            false
        }
    }
}

/// Publishes messages that are encoded already, as those of a bag.
pub struct RawPublisher {
    outlet: Outlet,
}

impl RawPublisher {
    pub(crate) fn new(outlet: Outlet) -> Self {
        Self { outlet }
    }

    /// Publishes an encoded message: its encapsulation header of four bytes, then its body in
    /// little-endian CDR. The bytes are sent as they are, padded to a multiple of four; a subscription of
    /// the same host decodes them.
    ///
    /// # Errors
    /// When it has another encoding, is no message of its type, or is not taken.
    pub fn publish(&self, encoded: &[u8]) -> Result<(), PublishError> {
        self.outlet.check_open()?;
        Payload::check(encoded)
            .map_err(|source| PublishError::Payload { topic: self.topic().to_owned(), source })?;
        if self.outlet.is_awaited_here() {
            self.outlet.hand_over(&Message::Encoded(encoded.into()))?;
        }
        if self.outlet.is_awaited_outside() {
            self.outlet.send(encoded.to_vec())?;
        }
        self.outlet.count();
        Ok(())
    }

    /// The topic, by its absolute name.
    #[must_use]
    pub fn topic(&self) -> &str {
        &self.outlet.topic
    }

    /// How many subscribers there are.
    #[must_use]
    pub fn subscriber_count(&self) -> usize {
        self.outlet.endpoint.peers()
    }

    /// Waits until there are at least `least` subscribers, and those outside have had the time to know of
    /// this publisher too.
    pub async fn wait_for_subscribers(&self, least: usize) {
        self.outlet.wait_for_subscribers(least).await;
    }
}

/// The two outputs of a publisher: to the subscriptions of its host, and to those outside.
pub(crate) struct Outlet {
    pub(crate) topic: Arc<str>,
    pub(crate) exchange: Arc<Exchange>,
    pub(crate) endpoint: OpenEndpoint,
    /// None where the host is on no network.
    pub(crate) writer: Option<Outside>,
    /// Whether messages are kept for late subscribers.
    pub(crate) keeps: bool,
    pub(crate) granted: Option<GrantedBuffer>,
    pub(crate) warned_of_size: AtomicBool,
    pub(crate) published: Arc<AtomicU64>,
    /// Open while the node works.
    pub(crate) gate: Gate,
}

impl Outlet {
    fn check_open(&self) -> Result<(), PublishError> {
        if self.gate.is_open() {
            Ok(())
        } else {
            Err(PublishError::NotActive { topic: self.topic.to_string() })
        }
    }

    fn is_awaited_here(&self) -> bool {
        self.keeps || self.endpoint.peers_in_host() > 0
    }

    /// Whether to encode and send. A latched message is for later subscribers. One that a subscription in this host
    /// takes is sent only where there is a reader outside too. One that no local subscription takes is sent in any
    /// case: a reader outside may be matched a moment before the graph shows it.
    fn is_awaited_outside(&self) -> bool {
        self.writer.is_some()
            && (self.keeps
                || self.endpoint.peers_outside() > 0
                || self.endpoint.peers_in_host() == 0)
    }

    async fn wait_for_subscribers(&self, least: usize) {
        self.endpoint.wait_for_peers(least).await;
        if self.endpoint.peers_outside() > 0 {
            tokio::time::sleep(SETTLING).await;
        }
    }

    fn hand_over(&self, message: &Message) -> Result<(), PublishError> {
        self.exchange
            .publish(self.endpoint.id(), message)
            .map_err(|source| PublishError::Undecodable { topic: self.topic.to_string(), source })
    }

    fn encode_and_send<M: RosMessage>(&self, message: &M) -> Result<(), PublishError> {
        let encoded = msgs::cdr::encode(message)
            .map_err(|source| PublishError::Encode { topic: self.topic.to_string(), source })?;
        self.send(encoded)
    }

    fn send(&self, encoded: Vec<u8>) -> Result<(), PublishError> {
        let Some(writer) = &self.writer else { return Ok(()) };
        let payload = Payload::from_encoded(encoded)
            .map_err(|source| PublishError::Payload { topic: self.topic.to_string(), source })?;
        if let Some(Err(too_large)) =
            self.granted.map(|granted| granted.check(&self.topic, payload.len()))
            && !self.warned_of_size.swap(true, Ordering::Relaxed)
        {
            tracing::warn!("{too_large}");
        }
        writer.send(&self.topic, payload)
    }

    fn count(&self) {
        self.published.fetch_add(1, Ordering::Relaxed);
    }
}
