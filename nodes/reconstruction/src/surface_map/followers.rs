//! Who follows what changes in the surface: each is there while somebody wants what it makes, and all are told the same.

use volume::{BlockKey, ChangeFollower, DistanceField, MeshFollower, Surface};

/// See the module.
#[derive(Debug, Default)]
pub(super) struct Followers {
    /// The points that change.
    pub(super) changes: Option<ChangeFollower>,
    /// The triangles.
    pub(super) mesh: Option<MeshFollower>,
    /// The distances to the surface.
    pub(super) distances: Option<DistanceField>,
}

/// Calls the same method of each that is there.
macro_rules! of_each {
    ($followers:expr, $one:ident => $call:expr) => {{
        let Followers { changes, mesh, distances } = $followers;
        if let Some($one) = changes {
            $call;
        }
        if let Some($one) = mesh {
            $call;
        }
        if let Some($one) = distances {
            $call;
        }
    }};
}

impl Followers {
    /// What the latest image changed.
    pub(super) fn follow(&mut self, surface: &Surface) {
        of_each!(self, one => one.follow(surface));
    }

    /// A block was removed.
    pub(super) fn follow_block(&mut self, key: BlockKey) {
        of_each!(self, one => one.follow_block(key));
    }

    /// A block has left for the store.
    pub(super) fn left(&mut self, key: BlockKey) {
        of_each!(self, one => one.left(key));
    }

    /// The memory taken, in bytes.
    pub(super) fn memory_bytes(&self) -> usize {
        let mut bytes = 0;
        of_each!(self, one => bytes += one.memory_bytes());
        bytes
    }
}
