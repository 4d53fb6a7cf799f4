//! A topic of a sensor, which is subscribed to only while somebody wants what is made of it.

use std::sync::Arc;

use msgs::RosMessage;
use node_shell::{Node, Qos, ShellError, Subscription};

/// The topic.
pub(super) struct RawTopic<M: RosMessage> {
    name: &'static str,
    messages: Option<Subscription<M>>,
}

impl<M: RosMessage> RawTopic<M> {
    /// It is not subscribed to yet.
    pub(super) fn new(name: &'static str) -> Self {
        Self { name, messages: None }
    }

    /// Its name, before it is resolved.
    pub(super) fn name(&self) -> &'static str {
        self.name
    }

    /// Subscribes to it while it is wanted.
    pub(super) fn follow(
        &mut self,
        node: &Node,
        qos: &Qos,
        is_wanted: bool,
    ) -> Result<(), ShellError> {
        if !is_wanted {
            self.messages = None;
        } else if self.messages.is_none() {
            self.messages = Some(node.subscription(self.name, qos)?);
        }
        Ok(())
    }

    pub(super) fn is_subscribed(&self) -> bool {
        self.messages.is_some()
    }

    /// Whether somebody publishes it, as far as it is subscribed to.
    pub(super) fn has_source(&self) -> bool {
        self.messages.as_ref().is_some_and(|messages| messages.publisher_count() > 0)
    }

    /// The next message; never where it is not subscribed to. May be dropped while it waits.
    pub(super) async fn next(&self) -> Arc<M> {
        match &self.messages {
            Some(messages) => messages.next().await.message,
            None => std::future::pending().await,
        }
    }

    /// A message that is here already.
    pub(super) fn try_next(&self) -> Option<Arc<M>> {
        Some(self.messages.as_ref()?.try_next()?.message)
    }
}
