//! Receives `/tf_static` and `/tf`.

use std::sync::Arc;

use msgs::tf2_msgs::TFMessage;

use super::tree::TransformTree;
use crate::endpoints::subscription::Subscription;
use crate::node::Node;
use crate::process::throttle::Throttle;
use crate::settings::qos::Qos;
use crate::wire::error::ShellError;

/// tf2's own: each of several broadcasters of fixed transforms has its last message here.
const MESSAGES_KEPT: usize = 100;

/// A message of the tree of frames.
#[derive(Clone, Debug)]
pub enum TransformArrival {
    /// Of frames that are fixed to each other.
    Fixed(Arc<TFMessage>),
    /// Of frames that move.
    Timed(Arc<TFMessage>),
}

/// Listens to the transforms of the graph. The topics are absolute, as everywhere in ROS 2: all namespaces share
/// one tree unless they are remapped.
pub struct TransformListener {
    fixed: Subscription<TFMessage>,
    timed: Subscription<TFMessage>,
    tree: TransformTree,
    refused: Throttle,
}

impl TransformListener {
    /// Subscribes to `/tf_static`, reliable and transient local, and to `/tf`, best effort, which fits every
    /// broadcaster.
    ///
    /// # Errors
    /// When a subscription cannot be had.
    pub fn new(node: &Node) -> Result<Self, ShellError> {
        Ok(Self {
            fixed: node.subscription("/tf_static", &Qos::new(true, true, MESSAGES_KEPT))?,
            timed: node.subscription("/tf", &Qos::sensor(MESSAGES_KEPT))?,
            tree: TransformTree::default(),
            refused: Throttle::for_warnings(),
        })
    }

    /// The next message, for [`TransformListener::take`]. May be dropped while it waits.
    pub async fn next(&self) -> TransformArrival {
        tokio::select! {
            biased;
            received = self.fixed.next() => TransformArrival::Fixed(received.message),
            received = self.timed.next() => TransformArrival::Timed(received.message),
        }
    }

    /// The next message that is here already.
    pub fn try_next(&self) -> Option<TransformArrival> {
        let fixed = self.fixed.try_next().map(|received| TransformArrival::Fixed(received.message));
        fixed.or_else(|| Some(TransformArrival::Timed(self.timed.try_next()?.message)))
    }

    /// Adds the transforms of a message. Invalid ones are left out, and logged once in a while.
    pub fn take(&mut self, arrival: &TransformArrival) {
        let (message, is_fixed) = match arrival {
            TransformArrival::Fixed(message) => (message, true),
            TransformArrival::Timed(message) => (message, false),
        };
        let refused = &self.refused;
        self.tree.insert_message(message, is_fixed, |reason| {
            if let Some(held_back) = refused.pass() {
                tracing::warn!("tf: {reason} ({held_back} more since the last warning)");
            }
        });
    }

    /// The transforms that were received.
    #[must_use]
    pub fn tree(&self) -> &TransformTree {
        &self.tree
    }

    /// See [`TransformTree::forget_timed`].
    pub fn forget_timed(&mut self) {
        self.tree.forget_timed();
    }
}
