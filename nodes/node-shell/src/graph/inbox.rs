//! The queue of one subscription, for messages that its own host published.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{SystemTime, UNIX_EPOCH};

use geometry::Stamp;
use msgs::cdr::CdrError;
use tokio::sync::Notify;

use crate::graph::exchange::Message;
use crate::graph::value::Incoming;

/// A message and when it was sent.
#[derive(Clone, PartialEq, Debug)]
pub struct Received<M> {
    /// The message; where a node of the same host published it, the very value that it published.
    pub message: Arc<M>,
    /// When its publisher sent it, by the publisher's wall clock; not when its data were measured.
    pub sent: Option<Stamp>,
}

/// A subscription, whatever its type.
pub(crate) trait Inbox: Send + Sync {
    /// Lets a message wait.
    ///
    /// # Errors
    /// When it is an encoded one that is no message of the subscription's type.
    fn push(&self, message: &Message) -> Result<(), CdrError>;
}

/// The newest messages, as many as the subscription's depth.
pub(crate) struct Queue<M> {
    depth: usize,
    waiting: Mutex<Waiting<M>>,
    arrived: Notify,
}

struct Waiting<M> {
    messages: VecDeque<Received<M>>,
    /// Messages that were dropped for newer ones since the last was taken.
    missed: u64,
}

/// A message out of the queue, and how many were dropped before it.
pub(crate) struct Taken<M> {
    pub(crate) received: Received<M>,
    pub(crate) missed: u64,
}

impl<M> Queue<M> {
    pub(crate) fn new(depth: usize) -> Self {
        let waiting = Waiting { messages: VecDeque::new(), missed: 0 };
        Self { depth: depth.max(1), waiting: Mutex::new(waiting), arrived: Notify::new() }
    }

    /// The oldest message that waits.
    pub(crate) fn take(&self) -> Option<Taken<M>> {
        let mut waiting = self.lock();
        let received = waiting.messages.pop_front()?;
        Some(Taken { received, missed: std::mem::take(&mut waiting.missed) })
    }

    /// Waits for a message. May be dropped while it waits: no message is lost by that.
    pub(crate) async fn next(&self) -> Taken<M> {
        loop {
            // A message that arrives between the look and the wait leaves its permit.
            if let Some(taken) = self.take() {
                return taken;
            }
            self.arrived.notified().await;
        }
    }

    /// How many were dropped for newer ones since the last was taken.
    pub(crate) fn missed(&self) -> u64 {
        self.lock().missed
    }

    fn put(&self, message: Arc<M>) {
        let mut waiting = self.lock();
        if waiting.messages.len() == self.depth {
            waiting.messages.pop_front();
            waiting.missed += 1;
        }
        waiting.messages.push_back(Received { message, sent: Some(now()) });
        drop(waiting);
        self.arrived.notify_one();
    }

    fn lock(&self) -> MutexGuard<'_, Waiting<M>> {
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<I: Incoming> Inbox for Queue<I> {
    fn push(&self, message: &Message) -> Result<(), CdrError> {
        let incoming = match message {
            // Another Rust type of the same ROS type cannot be, but for a fault in `msgs`.
            Message::Shared(shared) => {
                Arc::clone(shared).downcast::<I::Message>().ok().map(I::of_message)
            }
            Message::Value(sent) => I::of_value(|| sent.value(), || sent.message()),
            Message::Encoded(bytes) => Some(I::of_message(Arc::new(msgs::cdr::decode(bytes)?))),
        };
        if let Some(incoming) = incoming {
            self.put(incoming);
        }
        Ok(())
    }
}

/// When a message was sent, by the wall clock, as DDS gives it for those from outside.
fn now() -> Stamp {
    let since_epoch = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    Stamp::from_nanos(i64::try_from(since_epoch.as_nanos()).unwrap_or(i64::MAX))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn as_many_messages_wait_as_the_depth_says_and_the_others_are_counted() {
        let queue = Queue::new(3);
        (0..10).for_each(|number| queue.put(Arc::new(number)));
        let taken: Vec<(u64, i32)> = std::iter::from_fn(|| queue.take())
            .map(|taken| (taken.missed, *taken.received.message))
            .collect();
        assert_eq!(taken, [(7, 7), (0, 8), (0, 9)]);
    }
}
