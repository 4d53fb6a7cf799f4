//! Blocks come and go: what an image makes of them, the bound, and the memory of those that are gone.

use super::block::{self, SurfaceBlock};
use super::update::Work;
use super::{Surface, SurfaceUpdate};
use crate::block::BlockKey;
use crate::descent::block_edge_m;

impl Surface {
    pub(super) fn take_back(
        &mut self,
        done: Work,
        now: u32,
        (hit_from_m, middle_in_camera_m): ([f32; 3], [f32; 3]),
        may_be_new: &dyn Fn(BlockKey) -> bool,
        update: &mut SurfaceUpdate,
    ) {
        let Some(mut block) = done.block else { return };
        if done.is_hit {
            let edge_m = block_edge_m(self.config.edge_m);
            block.hit(now, hit_from_m, middle_in_camera_m, edge_m);
        }
        if done.is_changed {
            block.last_seen = now;
            self.count_near(&mut block);
        }
        match (done.is_new, block.has_surface()) {
            (true, true) if may_be_new(done.key) => {
                block.first_seen = now;
                if self.layer.len() < self.config.max_blocks {
                    update.new_blocks += 1;
                    self.add_new(done.key, block);
                } else {
                    update.refused_blocks += 1;
                    self.near_nodes -= usize::from(block.near_nodes);
                    self.refused.push((done.key, block));
                }
            }
            (true, has_surface) => {
                update.refused_blocks += usize::from(has_surface);
                self.near_nodes -= usize::from(block.near_nodes);
                if done.is_changed {
                    self.keep_spare(block);
                } else {
                    self.spare.push(block);
                }
            }
            (false, has_surface) => {
                if let Some(place) = self.layer.get_mut(done.key) {
                    *place = Some(block);
                }
                if !has_surface {
                    self.remove(done.key, update);
                } else if done.is_changed {
                    self.changed.push(done.key);
                }
            }
        }
    }

    fn add_new(&mut self, key: BlockKey, block: Box<SurfaceBlock>) {
        self.changed.push(key);
        self.layer.insert(key, Some(block));
    }

    /// Adds the blocks of the latest image for which there was no room, as far as there is some now, as if it had been there.
    /// Returns how many.
    pub fn add_refused(&mut self) -> usize {
        let room = self.config.max_blocks.saturating_sub(self.layer.len());
        let count = room.min(self.refused.len());
        let mut refused = std::mem::take(&mut self.refused);
        for (key, block) in refused.drain(..count) {
            self.near_nodes += usize::from(block.near_nodes);
            self.add_new(key, block);
        }
        self.refused = refused;
        count
    }

    /// How many blocks [`Surface::add_refused`] would add, had it room for all.
    #[must_use]
    pub fn refused(&self) -> usize {
        self.refused.len()
    }

    pub(super) fn forget_refused(&mut self) {
        let mut refused = std::mem::take(&mut self.refused);
        for (_, block) in refused.drain(..) {
            self.keep_spare(block);
        }
        self.refused = refused;
    }

    pub(super) fn remove(&mut self, key: BlockKey, update: &mut SurfaceUpdate) {
        if let Some(block) = self.layer.remove(key).flatten() {
            update.cleared_blocks += 1;
            self.near_nodes -= usize::from(block.near_nodes);
            self.removed.push(key);
            self.loaded.forget(key);
            self.keep_spare(block);
        }
    }

    /// Counts a block's nodes near the surface, in the place of what it had.
    pub(super) fn count_near(&mut self, block: &mut SurfaceBlock) {
        let near_nodes = self.near_nodes_in(block);
        self.near_nodes += usize::from(near_nodes);
        self.near_nodes -= usize::from(block.near_nodes);
        block.near_nodes = near_nodes;
    }

    pub(super) fn count_near_of(&mut self, key: BlockKey) {
        if let Some(mut block) = self.layer.get_mut(key).and_then(Option::take) {
            self.count_near(&mut block);
            self.layer.insert(key, Some(block));
        }
    }

    /// Counts all nodes near the surface anew.
    pub fn count_near_nodes(&mut self) {
        self.block_keys().into_iter().for_each(|key| self.count_near_of(key));
    }

    fn near_nodes_in(&self, block: &SurfaceBlock) -> u16 {
        let half_an_edge = block::FULL / (2.0 * self.config.truncation_in_edges as f32);
        block.count_near(half_an_edge as i16)
    }

    /// A block's part of [`Surface::near_nodes`].
    #[must_use]
    pub fn near_nodes_of(&self, key: BlockKey) -> usize {
        self.block(key).map_or(0, |block| usize::from(self.near_nodes_in(block)))
    }

    pub(super) fn block(&self, key: BlockKey) -> Option<&SurfaceBlock> {
        self.layer.get(key)?.as_deref()
    }

    fn keep_spare(&mut self, mut block: Box<SurfaceBlock>) {
        block.clear();
        self.spare.push(block);
    }
}
