//! The map as triangles on its topic, `mesh`: what has changed, while somebody subscribes, so many triangles at a time.

use std::time::Duration;

use msgs::convert;
use msgs::visualization_msgs::MarkerArray;
use node_shell::{Node, NodeFailure, Publisher, Qos};
use tokio::time::Instant;

use super::parameters::Settings;
use crate::Map;

/// Messages that may wait for a subscriber: one second of the default period.
const UPDATES_KEPT: usize = 10;

/// Publishes the triangles. See the module.
pub(super) struct MeshOutput {
    updates: Publisher<MarkerArray>,
    period: Duration,
    most_triangles: usize,
    /// Those of the last look.
    subscribers: usize,
    /// A message was lost, and with it the triangles of its blocks.
    is_lost: bool,
    last: Option<Instant>,
}

impl MeshOutput {
    pub(super) fn new(node: &Node, settings: &Settings) -> Result<Self, NodeFailure> {
        Ok(Self {
            updates: node.publisher("mesh", &Qos::reliable(UPDATES_KEPT))?,
            period: settings.mesh_period,
            most_triangles: settings.most_mesh_triangles,
            subscribers: 0,
            is_lost: false,
            last: None,
        })
    }

    pub(super) fn change(&mut self, settings: &Settings) {
        (self.period, self.most_triangles) = (settings.mesh_period, settings.most_mesh_triangles);
    }

    /// Publishes what is due.
    pub(super) fn look(&mut self, map: &mut Map, now: Instant) {
        let before = std::mem::replace(&mut self.subscribers, self.updates.subscriber_count());
        if self.subscribers == 0 {
            if before > 0 {
                map.unfollow_mesh();
            }
            return;
        }
        if self.subscribers > before || std::mem::take(&mut self.is_lost) {
            map.follow_mesh();
        }
        if self.last.is_some_and(|last| now.saturating_duration_since(last) < self.period) {
            return;
        }
        let Some(update) = map.take_mesh_changes(self.most_triangles) else { return };
        self.last = Some(now);
        self.is_lost = !self.updates.publish_or_warn(convert::markers_from_mesh(&update));
    }
}
