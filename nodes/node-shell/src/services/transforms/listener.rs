//! Receives `/tf_static` and `/tf`.

use std::sync::Arc;

use geometry::Stamp;
use msgs::convert;
use msgs::tf2_msgs::TFMessage;
use nalgebra::Isometry3;

use super::error::TransformError;
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
        for transform in &message.transforms {
            let (parent, child) = (&transform.header.frame_id, &transform.child_frame_id);
            let taken = match convert::isometry_from_transform(&transform.transform) {
                Err(error) => Err(format!("the transform from {child:?} to {parent:?}: {error}")),
                Ok(parent_from_child) => if is_fixed {
                    self.tree.insert_fixed(parent, child, &parent_from_child)
                } else {
                    let stamp = convert::stamp_from_time(transform.header.stamp);
                    self.tree.insert_timed(stamp, parent, child, &parent_from_child)
                }
                .map_err(|error| error.to_string()),
            };
            if let Err(reason) = taken
                && let Some(held_back) = self.refused.pass()
            {
                tracing::warn!("tf: {reason} ({held_back} more since the last warning)");
            }
        }
    }

    /// See [`TransformTree::lookup`].
    ///
    /// # Errors
    /// As there.
    pub fn lookup(
        &self,
        target: &str,
        source: &str,
        stamp: Stamp,
    ) -> Result<Isometry3<f64>, TransformError> {
        self.tree.lookup(target, source, stamp)
    }

    /// See [`TransformTree::lookup_latest`].
    ///
    /// # Errors
    /// As there.
    pub fn lookup_latest(
        &self,
        target: &str,
        source: &str,
    ) -> Result<Isometry3<f64>, TransformError> {
        self.tree.lookup_latest(target, source)
    }

    /// See [`TransformTree::forget_timed`].
    pub fn forget_timed(&mut self) {
        self.tree.forget_timed();
    }
}
