//! What the feed and the connections share.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use node_shell::{Node, NodeFailure};
use tokio::sync::watch;

use super::ShownNode;
use super::commands::Commands;
use crate::{Access, LiveState};

/// Points of the map that is shown, at most: as many as the report's page carries.
const MOST_VOXELS: usize = 5_000_000;
/// Triangles that are shown, at most: 27 bytes each here, and 75 in a browser.
const MOST_TRIANGLES: usize = 1_000_000;
/// The edge of the voxels until a cycle says it: the default of the parameter `map_edge_m`.
const FIRST_EDGE_M: f64 = 0.02;

/// What the feed and the connections share.
pub(super) struct Shared {
    pub(super) access: Access,
    pub(super) commands: Commands,
    state: Mutex<LiveState>,
    /// Counts the changes of the state.
    changes: watch::Sender<u64>,
    /// How many browsers look.
    browsers: watch::Sender<usize>,
    /// How many of them ask for triangles.
    mesh_wanted: watch::Sender<usize>,
}

impl Shared {
    pub(super) fn new(
        access: Access,
        node: Arc<Node>,
        nodes: Vec<ShownNode>,
    ) -> Result<Self, NodeFailure> {
        Ok(Self {
            access,
            commands: Commands::new(node, nodes),
            state: Mutex::new(LiveState::new(FIRST_EDGE_M, MOST_VOXELS, MOST_TRIANGLES)?),
            changes: watch::Sender::new(0),
            browsers: watch::Sender::new(0),
            mesh_wanted: watch::Sender::new(0),
        })
    }

    /// The state as it is, to make a message of it.
    pub(super) fn state(&self) -> MutexGuard<'_, LiveState> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Changes the state, and wakes the connections.
    pub(super) fn change<T>(&self, change: impl FnOnce(&mut LiveState) -> T) -> T {
        let result = change(&mut self.state());
        self.changes.send_modify(|count| *count = count.wrapping_add(1));
        result
    }

    /// Counts the changes.
    pub(super) fn changes(&self) -> watch::Receiver<u64> {
        self.changes.subscribe()
    }

    /// How many browsers look.
    pub(super) fn browsers(&self) -> watch::Receiver<usize> {
        self.browsers.subscribe()
    }

    /// How many browsers ask for triangles.
    pub(super) fn mesh_wanted(&self) -> watch::Receiver<usize> {
        self.mesh_wanted.subscribe()
    }

    /// Asks for triangles as long as the value lives.
    pub(super) fn want_mesh(self: &Arc<Self>) -> WantsMesh {
        self.mesh_wanted.send_modify(|count| *count += 1);
        WantsMesh { shared: Arc::clone(self) }
    }

    /// Counts a browser in as long as the value lives; none where there are `most` already.
    pub(super) fn look(self: &Arc<Self>, most: usize) -> Option<Looking> {
        let mut has_room = false;
        self.browsers.send_modify(|count| {
            has_room = *count < most;
            *count += usize::from(has_room);
        });
        has_room.then(|| Looking { shared: Arc::clone(self) })
    }
}

/// A browser that looks.
pub(super) struct Looking {
    shared: Arc<Shared>,
}

impl Drop for Looking {
    fn drop(&mut self) {
        self.shared.browsers.send_modify(|count| *count = count.saturating_sub(1));
    }
}

/// A browser that asks for triangles.
pub(super) struct WantsMesh {
    shared: Arc<Shared>,
}

impl Drop for WantsMesh {
    fn drop(&mut self) {
        self.shared.mesh_wanted.send_modify(|count| *count = count.saturating_sub(1));
    }
}
