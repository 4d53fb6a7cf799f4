//! Tiles on their way: from the memory to the store, and back.

use nalgebra::Point3;
use volume::{BlockBox, BlockKey};

use super::super::SurfaceMap;
use super::tile_file::Known;
use crate::tiles::{InStore, Reached, SpillCounts, TileError, TileKey, TileStoreError};

impl SurfaceMap {
    /// What became of the tiles; `None` where none are spilled.
    #[must_use]
    pub fn spill_counts(&self) -> Option<SpillCounts> {
        self.spill.as_ref().map(|spill| spill.tiles.counts())
    }

    /// The latest of the errors since this was last asked; [`SpillCounts`] has their number.
    pub fn take_tile_error(&mut self) -> Option<TileError> {
        self.spill.as_mut()?.tiles.take_error()
    }

    /// What the store could not do may be tried again.
    pub(in super::super) fn begin_round(&mut self) {
        if let Some(spill) = &mut self.spill {
            spill.tiles.begin_round();
        }
    }

    /// Brings back what the image of the view can change, and what is beside: the nearest first, as far as there is room.
    pub(in super::super) fn bring_back_view(&mut self) {
        let Some(spill) = &mut self.spill else { return };
        spill.tiles.pass_on();
        let Some(all) = self.surface.view_box(&self.view) else { return };
        let camera_m = Point3::from(self.view.map_from_camera().translation.vector);
        let edge_m = spill.frame.edge_m * f64::from(spill.frame.edge_voxels);
        let mut spilled = Vec::new();
        for tile in spill.tiles.within(spill.tile_box(all.grown(1))) {
            let blocks = spill.blocks_of(tile).grown(1);
            if !self.surface.is_in_view(&self.view, blocks) {
                continue;
            }
            if let Reached::InStore(in_store) = spill.tiles.reach(tile) {
                let middle = [tile.x, tile.y, tile.z].map(|along| f64::from(along) + 0.5);
                let away_m = (Point3::from(middle) * edge_m - camera_m).norm();
                spilled.push((away_m, tile, in_store));
            }
        }
        spilled.sort_by(|(a, ..), (b, ..)| a.total_cmp(b));
        for (_, tile, in_store) in spilled {
            self.bring_back(tile, in_store);
        }
    }

    /// Brings back the tiles of blocks that were spilled. Returns whether all that is known of them is in memory now.
    pub(in super::super) fn fetch(&mut self, blocks: BlockBox) -> bool {
        let Some(spill) = &mut self.spill else { return true };
        spill.tiles.pass_on();
        let reached: Vec<(TileKey, Reached)> =
            spill.tiles_of(blocks).map(|tile| (tile, spill.tiles.reach(tile))).collect();
        reached.into_iter().all(|(tile, reached)| match reached {
            Reached::InMemory => true,
            Reached::Unreadable => false,
            Reached::InStore(spilled) => self.bring_back(tile, spilled),
        })
    }

    fn bring_back(&mut self, tile: TileKey, spilled: InStore) -> bool {
        if !self.spill_until(spilled.parts as usize) {
            return false;
        }
        let Some(spill) = &mut self.spill else { return true };
        match spill.read_into(tile, &mut self.surface) {
            Ok(known) => {
                spill.tiles.came_back(tile);
                let is_known_as_it_is = spill.tiles.is_known_as_it_is(spilled);
                let blocks = spill.blocks_of(tile);
                if let Some(distances) = &mut self.followers.distances {
                    let keys = self.surface.blocks_in(blocks);
                    keys.into_iter().for_each(|key| distances.follow_block(key));
                }
                self.listeners_know(tile, known, is_known_as_it_is);
                true
            }
            Err(error) => {
                let is_lost = spill.tiles.could_not_read(tile, error);
                if is_lost {
                    // Listeners still have its points, and nobody knows which ones they were.
                    self.follow_changes_anew();
                    self.views.clear();
                }
                is_lost
            }
        }
    }

    /// What listeners know of a tile that has come back.
    fn listeners_know(&mut self, tile: TileKey, known: Vec<Known>, is_known_as_it_is: bool) {
        let Some(mut follower) = self.followers.changes.take() else { return };
        if !is_known_as_it_is {
            known.iter().for_each(|known| follower.come_back(known.key, &known.bytes));
            self.followers.changes = Some(follower);
            return;
        }
        let has_changed = known.iter().any(|known| follower.is_waiting(known.key));
        self.visit_tiles(&[tile], |key, points, _| follower.know(key, points, self.grid()));
        self.followers.changes = Some(follower);
        if has_changed {
            // What is beside it changed while it could not be had: what listeners know of it, nobody knows any more.
            self.follow_changes_anew();
        }
    }

    /// Makes room for the blocks that the image found none for, and adds them. Returns how many.
    pub(in super::super) fn add_refused(&mut self) -> usize {
        let refused = self.surface.refused();
        if self.spill.is_none() || refused == 0 {
            return 0;
        }
        self.spill_until(refused);
        self.surface.add_refused()
    }

    /// The tiles of the blocks that the image changed have something in memory.
    pub(in super::super) fn note_changed(&mut self) {
        let Some(spill) = &mut self.spill else { return };
        let mut last = None;
        for key in self.surface.changed() {
            let tile = spill.tile_of(*key);
            if last.replace(tile) != Some(tile) {
                spill.tiles.has(tile);
            }
        }
    }

    /// Writes all tiles.
    ///
    /// # Errors
    /// When one cannot be written.
    pub(in super::super) fn spill_all(&mut self) -> Result<(), TileError> {
        if let Some(spill) = &mut self.spill {
            spill.tiles.pass_on();
        }
        let most = self.surface.config().max_blocks;
        if self.spill_until(most) { Ok(()) } else { Err(self.why_no_room()) }
    }

    /// What the store could not do when there was no room.
    pub(in super::super) fn why_no_room(&self) -> TileError {
        let tiles = self.spill.as_ref().map(|spill| spill.tiles.why_no_room());
        tiles.unwrap_or(TileError::Another { source: TileStoreError::Missing })
    }

    /// Writes tiles until there is room for so many blocks. Returns whether there is: not where nothing can be written,
    /// and not where all that is in memory is reached now.
    pub(in super::super) fn spill_until(&mut self, room: usize) -> bool {
        while self.surface.blocks() + room > self.surface.config().max_blocks {
            let Some(spill) = &mut self.spill else { return false };
            let Some(tile) = spill.tiles.next_to_go() else { return false };
            let keys = self.surface.blocks_in(spill.blocks_of(tile));
            let points = keys.iter().map(|key| self.surface.near_nodes_of(*key)).sum();
            let bytes = spill.encode(tile, &keys, &self.surface, self.followers.changes.as_ref());
            if !spill.tiles.write(tile, &bytes, keys.len(), points) {
                return false;
            }
            keys.into_iter().for_each(|key| self.left(key));
        }
        true
    }

    fn left(&mut self, key: BlockKey) {
        self.surface.remove_block(key);
        self.followers.left(key);
    }
}
