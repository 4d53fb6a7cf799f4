//! Publishers: of messages by their type, and of messages that are encoded already.

use std::marker::PhantomData;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;

use msgs::RosMessage;
use ros2_client::WriteError;

use crate::endpoints::gate::Gate;
use crate::endpoints::writer::Writer;
use crate::graph::OpenEndpoint;
use crate::graph::exchange::{Exchange, Message};
use crate::process::throttle::Throttle;
use crate::wire::error::PublishError;
use crate::wire::payload::Payload;
use crate::wire::transport::GrantedBuffer;

/// How long after its match a reader outside may still pass over what is sent to it: it has to hear of this
/// writer in its turn, and Cyclone DDS takes what is sent before its first request of missing samples for
/// history. No message of the protocol tells the end of that.
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
    /// encoded, where there are any or nobody else takes it. Returns once the message is queued; with reliable delivery this may
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
            let encoded = msgs::cdr::encode(&*message).map_err(|source| PublishError::Encode {
                topic: self.outlet.topic.to_string(),
                source,
            })?;
            self.outlet.send(encoded)?;
        }
        self.outlet.count();
        Ok(())
    }

    /// Publishes a message; when that fails, the failure is told of once in a while, and `false` comes
    /// back. For what is lost without harm, or comes again. That the node is not active is no news.
    pub fn publish_or_warn(&self, message: impl Into<Arc<M>>) -> bool {
        match self.publish(message) {
            Ok(()) => true,
            Err(PublishError::NotActive { .. }) => false,
            Err(error) => {
                if let Some(held_back) = self.failed.pass() {
                    tracing::warn!("{error} ({held_back} more since the last warning)");
                }
                false
            }
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

/// The two ways out of a publisher: to the subscriptions of its host, and to those outside.
pub(crate) struct Outlet {
    pub(crate) topic: Arc<str>,
    pub(crate) exchange: Arc<Exchange>,
    pub(crate) endpoint: OpenEndpoint,
    /// None where the host is on no network.
    pub(crate) writer: Option<Arc<Writer>>,
    /// Whether messages are kept for those who come late.
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

    /// Whether to encode and send. A kept message is for those who come later. One that somebody in this host
    /// takes is sent only where somebody outside wants it too. One that nobody here takes is sent in any
    /// case: a reader outside may be matched a moment before the graph tells.
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

    fn send(&self, encoded: Vec<u8>) -> Result<(), PublishError> {
        let Some(writer) = &self.writer else { return Ok(()) };
        let topic = || self.topic.to_string();
        let payload = Payload::from_encoded(encoded)
            .map_err(|source| PublishError::Payload { topic: topic(), source })?;
        if let Some(Err(too_large)) =
            self.granted.map(|granted| granted.check(&self.topic, payload.len()))
            && !self.warned_of_size.swap(true, Ordering::Relaxed)
        {
            tracing::warn!("{too_large}");
        }
        writer.write(payload).map_err(|error| match error {
            WriteError::WouldBlock { .. } => PublishError::NotAcknowledged { topic: topic() },
            error => PublishError::Library { topic: topic(), reason: error.to_string() },
        })
    }

    fn count(&self) {
        self.published.fetch_add(1, Ordering::Relaxed);
    }
}
