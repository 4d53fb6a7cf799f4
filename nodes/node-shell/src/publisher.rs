//! Publishers: of messages by their type, and of messages that are encoded already.

use std::marker::PhantomData;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use msgs::RosMessage;
use ros2_client::WriteError;
use rustdds::GUID;

use crate::error::PublishError;
use crate::graph::Graph;
use crate::payload::Payload;
use crate::throttle::Throttle;
use crate::transport::GrantedBuffer;

/// Publishes messages of one type.
pub struct Publisher<M> {
    raw: RawPublisher,
    failed: Throttle,
    _message: PhantomData<fn(M)>,
}

impl<M: RosMessage> Publisher<M> {
    pub(crate) fn new(raw: RawPublisher) -> Self {
        Self { raw, failed: Throttle::for_warnings(), _message: PhantomData }
    }

    /// Publishes a message. Returns once the message is queued; with reliable delivery this may take up
    /// to 0.1 s when subscribers are far behind.
    ///
    /// # Errors
    /// When it cannot be encoded, or is not taken.
    pub fn publish(&self, message: &M) -> Result<(), PublishError> {
        let encoded = msgs::cdr::encode(message)
            .map_err(|source| PublishError::Encode { topic: self.raw.topic.to_string(), source })?;
        self.raw.publish_owned(encoded)
    }

    /// Publishes a message; when that fails, the failure is told of once in a while, and `false` comes
    /// back. For what is lost without harm, or comes again.
    pub fn publish_or_warn(&self, message: &M) -> bool {
        match self.publish(message) {
            Ok(()) => true,
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
        &self.raw.topic
    }

    /// How many subscribers there are.
    #[must_use]
    pub fn subscriber_count(&self) -> usize {
        self.raw.subscriber_count()
    }

    /// Waits until there are at least `least` subscribers.
    pub async fn wait_for_subscribers(&self, least: usize) {
        self.raw.wait_for_subscribers(least).await;
    }
}

/// Publishes messages that are encoded already, as those of a bag.
pub struct RawPublisher {
    topic: Arc<str>,
    writer: ros2_client::Publisher<Payload>,
    guid: GUID,
    graph: Graph,
    granted: GrantedBuffer,
    warned_of_size: AtomicBool,
    published: Arc<AtomicU64>,
}

impl RawPublisher {
    pub(crate) fn new(
        topic: &str,
        writer: ros2_client::Publisher<Payload>,
        graph: Graph,
        granted: GrantedBuffer,
        published: Arc<AtomicU64>,
    ) -> Self {
        Self {
            topic: topic.into(),
            guid: writer.guid(),
            writer,
            graph,
            granted,
            warned_of_size: AtomicBool::new(false),
            published,
        }
    }

    /// Publishes an encoded message: its encapsulation header of four bytes, then its body in
    /// little-endian CDR. The bytes are sent as they are, padded to a multiple of four.
    ///
    /// # Errors
    /// When it has another encoding, or is not taken.
    pub fn publish(&self, encoded: &[u8]) -> Result<(), PublishError> {
        self.publish_owned(encoded.to_vec())
    }

    /// The topic, by its absolute name.
    #[must_use]
    pub fn topic(&self) -> &str {
        &self.topic
    }

    /// How many subscribers there are.
    #[must_use]
    pub fn subscriber_count(&self) -> usize {
        self.graph.peers(self.guid)
    }

    /// Waits until there are at least `least` subscribers.
    pub async fn wait_for_subscribers(&self, least: usize) {
        self.graph.wait_for_peers(self.guid, least).await;
    }

    fn publish_owned(&self, encoded: Vec<u8>) -> Result<(), PublishError> {
        let topic = || self.topic.to_string();
        let payload = Payload::from_encoded(encoded)
            .map_err(|source| PublishError::Payload { topic: topic(), source })?;
        if let Err(too_large) = self.granted.check(&self.topic, payload.len())
            && !self.warned_of_size.swap(true, Ordering::Relaxed)
        {
            tracing::warn!("{too_large}");
        }
        match self.writer.publish(payload) {
            Ok(()) => {
                self.published.fetch_add(1, Ordering::Relaxed);
                Ok(())
            }
            Err(WriteError::WouldBlock { .. }) => {
                Err(PublishError::NotAcknowledged { topic: topic() })
            }
            Err(error) => Err(PublishError::Library { topic: topic(), reason: error.to_string() }),
        }
    }
}

impl Drop for RawPublisher {
    fn drop(&mut self) {
        self.graph.leave(self.guid);
    }
}
