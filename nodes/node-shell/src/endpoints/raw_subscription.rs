//! Subscriptions to messages whose type is known by its name alone.

use std::sync::Arc;

use geometry::Stamp;

use crate::endpoints::subscription::Subscription;
use crate::graph::inbox::Received;
use crate::wire::encoded::Encoded;

/// A message as it was sent, and when.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct ReceivedBytes {
    /// The message: its encapsulation header of four bytes, then its body in little-endian CDR, with up to three bytes of
    /// padding behind it.
    pub encoded: Vec<u8>,
    /// When its publisher sent it, by the publisher's wall clock; not when its data were measured.
    pub sent: Option<Stamp>,
}

/// Receives the messages of a topic without decoding them. It is for those outside: what nodes of the same host publish
/// as values has no bytes, and does not come.
pub struct RawSubscription {
    messages: Subscription<Encoded>,
}

impl RawSubscription {
    pub(crate) fn new(messages: Subscription<Encoded>) -> Self {
        Self { messages }
    }

    /// Waits for the next message. May be dropped while waiting: no message is lost by that.
    pub async fn next(&self) -> ReceivedBytes {
        bytes_of(self.messages.next().await)
    }

    /// The next message if it is here already.
    pub fn try_next(&self) -> Option<ReceivedBytes> {
        self.messages.try_next().map(bytes_of)
    }

    /// The topic, by its absolute name.
    #[must_use]
    pub fn topic(&self) -> &str {
        self.messages.topic()
    }

    /// How many publishers there are.
    #[must_use]
    pub fn publisher_count(&self) -> usize {
        self.messages.publisher_count()
    }

    /// How many messages are missing between those that came.
    #[must_use]
    pub fn lost_count(&self) -> u64 {
        self.messages.lost_count()
    }
}

fn bytes_of(received: Received<Encoded>) -> ReceivedBytes {
    let Encoded(encoded) = Arc::unwrap_or_clone(received.message);
    ReceivedBytes { encoded, sent: received.sent }
}
