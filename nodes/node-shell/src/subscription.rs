//! Subscriptions to messages of one type.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use geometry::Stamp;
use msgs::RosMessage;
use ros2_client::MessageInfo;
use rustdds::GUID;

use crate::counters::TopicCounters;
use crate::graph::Graph;
use crate::throttle::Throttle;

/// A message and when it was sent.
#[derive(Clone, PartialEq, Debug)]
pub struct Received<M> {
    /// The message.
    pub message: M,
    /// When its publisher sent it, by the publisher's wall clock; not when its data were measured.
    pub sent: Option<Stamp>,
}

/// Receives messages of one type.
pub struct Subscription<M: RosMessage> {
    topic: Arc<str>,
    reader: ros2_client::Subscription<M>,
    guid: GUID,
    graph: Graph,
    counters: Arc<TopicCounters>,
    sequence: Mutex<BTreeMap<GUID, i64>>,
    malformed: Throttle,
}

impl<M: RosMessage> Subscription<M> {
    pub(crate) fn new(
        topic: &str,
        reader: ros2_client::Subscription<M>,
        graph: Graph,
        counters: Arc<TopicCounters>,
    ) -> Self {
        Self {
            topic: topic.into(),
            guid: reader.guid(),
            reader,
            graph,
            counters,
            sequence: Mutex::default(),
            malformed: Throttle::for_warnings(),
        }
    }

    /// Waits for the next message. May be dropped while waiting: no message is lost by that.
    ///
    /// What cannot be decoded, and what a peer of another type sent, is counted, told of once in a
    /// while, and passed over.
    pub async fn next(&self) -> Received<M> {
        loop {
            match self.reader.async_take().await {
                Ok((message, info)) => {
                    if let Some(received) = self.accept(message, &info) {
                        return received;
                    }
                }
                Err(error) => self.refuse(&error),
            }
        }
    }

    /// The next message if it is here already.
    pub fn try_next(&self) -> Option<Received<M>> {
        loop {
            match self.reader.take() {
                Ok(None) => return None,
                Ok(Some((message, info))) => {
                    if let Some(received) = self.accept(message, &info) {
                        return Some(received);
                    }
                }
                Err(error) => self.refuse(&error),
            }
        }
    }

    /// The topic, by its absolute name.
    #[must_use]
    pub fn topic(&self) -> &str {
        &self.topic
    }

    /// How many publishers there are.
    #[must_use]
    pub fn publisher_count(&self) -> usize {
        self.graph.peers(self.guid)
    }

    /// Waits until there are at least `least` publishers.
    pub async fn wait_for_publishers(&self, least: usize) {
        self.graph.wait_for_peers(self.guid, least).await;
    }

    /// How many messages were received so far.
    #[must_use]
    pub fn received_count(&self) -> u64 {
        self.counters.received()
    }

    fn accept(&self, message: M, info: &MessageInfo) -> Option<Received<M>> {
        let sender = GUID::from(info.publisher_gid());
        if self.graph.is_foreign(self.guid, sender) {
            self.counters.count_malformed();
            return None;
        }
        self.count(sender, info.sequence_number());
        let sent = info.source_timestamp().map(|time| Stamp::from_nanos(time.to_nanos()));
        Some(Received { message, sent })
    }

    /// Counts the message, and those missing between it and the last one of the same sender.
    fn count(&self, sender: GUID, number: i64) {
        let mut sequence = self.sequence.lock().unwrap_or_else(PoisonError::into_inner);
        let lost = match sequence.insert(sender, number) {
            Some(last) if number > last => number - last - 1,
            _ => 0,
        };
        self.counters.count_received(u64::try_from(lost).unwrap_or(0));
    }

    fn refuse(&self, error: &ros2_client::ReadError) {
        self.counters.count_malformed();
        if let Some(held_back) = self.malformed.pass() {
            tracing::warn!(
                "{}: a message is no valid {} and is passed over ({held_back} more since the last \
                 warning): {error}",
                self.topic,
                M::TYPE_NAME
            );
        }
    }
}

impl<M: RosMessage> Drop for Subscription<M> {
    fn drop(&mut self) {
        self.graph.leave(self.guid);
    }
}
