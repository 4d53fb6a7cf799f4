//! Blocks that wait to be looked at, in the order in which they changed first.

use std::collections::{HashSet, VecDeque};

use geometry::BuildVoxelHasher;

use super::Surface;
use crate::block::BlockKey;

/// See the module.
#[derive(Clone, Debug, Default)]
pub(super) struct WaitingBlocks {
    waiting: VecDeque<BlockKey>,
    /// Looked up by key alone.
    is_waiting: HashSet<BlockKey, BuildVoxelHasher>,
}

impl WaitingBlocks {
    /// Those that the latest image changed, and those that read their nodes.
    pub(super) fn follow(&mut self, surface: &Surface) {
        for key in surface.changed().iter().chain(surface.removed()) {
            self.has_changed(*key);
        }
    }

    /// What is made of a block lies between its nodes and those of the next blocks: it changes with these, too.
    pub(super) fn has_changed(&mut self, key: BlockKey) {
        for step in 0..8 {
            self.wait(key.offset(-(step & 1), -(step >> 1 & 1), -(step >> 2)));
        }
    }

    /// This block alone.
    pub(super) fn wait(&mut self, key: BlockKey) {
        if self.is_waiting.insert(key) {
            self.waiting.push_back(key);
        }
    }

    pub(super) fn contains(&self, key: BlockKey) -> bool {
        self.is_waiting.contains(&key)
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = &BlockKey> {
        self.waiting.iter()
    }

    pub(super) fn next(&self) -> Option<BlockKey> {
        self.waiting.front().copied()
    }

    /// The next one was looked at.
    pub(super) fn done(&mut self) {
        if let Some(key) = self.waiting.pop_front() {
            self.is_waiting.remove(&key);
        }
    }

    /// The next one comes after all others.
    pub(super) fn postpone(&mut self) {
        self.waiting.rotate_left(usize::from(!self.waiting.is_empty()));
    }

    pub(super) fn len(&self) -> usize {
        self.waiting.len()
    }

    pub(super) fn memory_bytes(&self) -> usize {
        (self.waiting.capacity() + self.is_waiting.capacity()) * size_of::<BlockKey>()
    }
}
