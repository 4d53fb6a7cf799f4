//! Tiles on their way: from the memory to the store, and back.

use std::collections::HashMap;

use geometry::{BuildVoxelHasher, VoxelKey};
use nalgebra::Point3;

use super::super::blocks::Blocks;
use super::super::changes::Place;
use super::super::voxel::VoxelMean;
use super::super::{StaticMap, WholeMap};
use super::tile_file::TileLayout;
use crate::tiles::{InStore, Reached, SpillCounts, TileError, TileKey, TileStoreError};

impl StaticMap {
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

    /// Changes are followed from now on: what was spilled until now, listeners know as it is.
    pub(in super::super) fn follow_spilled(&mut self) {
        if let Some(spill) = &mut self.spill {
            spill.tiles.follow();
        }
    }

    /// Brings back the tile of a voxel, if it was spilled. Returns whether all that is known of the voxel is in
    /// memory now.
    pub(in super::super) fn fetch(&mut self, voxel: VoxelKey) -> bool {
        let Some(spill) = &mut self.spill else { return true };
        match spill.reach(voxel) {
            (_, Reached::InMemory) => true,
            (_, Reached::Unreadable) => false,
            (tile, Reached::InStore(spilled)) => self.bring_back(tile, spilled),
        }
    }

    fn bring_back(&mut self, tile: TileKey, spilled: InStore) -> bool {
        if !self.spill_until(spilled.parts as usize) {
            return false;
        }
        let Some(spill) = &mut self.spill else { return true };
        let voxels = match spill.read(tile) {
            Ok(voxels) => voxels,
            Err(error) => {
                let is_lost = spill.tiles.could_not_read(tile, error);
                if is_lost {
                    spill.current = Some(tile);
                    self.tiles_were_lost();
                }
                return is_lost;
            }
        };
        let listeners_know_all = spill.tiles.is_known_as_it_is(spilled);
        spill.tiles.came_back(tile);
        spill.current = Some(tile);
        let occupied = self.occupied.get_or_insert_default();
        for (key, mut voxel) in voxels {
            if listeners_know_all {
                voxel.told.tell(Place::of(&voxel.mean(), key, &self.grid));
            }
            occupied.insert(key);
            self.voxels.insert(key, voxel);
        }
        true
    }

    /// Listeners still have the points of lost tiles, and nobody knows which ones they were.
    fn tiles_were_lost(&mut self) {
        if self.changes.is_some() {
            self.follow_changes_anew();
        }
    }

    /// [`StaticMap::whole`], unless a tile cannot be read for now. What is lost is found out here, too, and the map
    /// is then what is left.
    ///
    /// # Errors
    /// The first of the tiles that cannot be read.
    pub(in super::super) fn whole_or_failing_tile(
        &mut self,
    ) -> Result<Vec<Point3<f32>>, TileError> {
        if let Some(spill) = &mut self.spill {
            spill.tiles.retry_unreadable()?;
        }
        let WholeMap { points_m, unreadable, .. } = self.whole();
        let Some(spill) = &mut self.spill else { return Ok(points_m) };
        if spill.tiles.were_read_but(unreadable)? {
            self.tiles_were_lost();
        }
        Ok(points_m)
    }

    /// Writes all tiles.
    ///
    /// # Errors
    /// When one cannot be written.
    pub(in super::super) fn spill_all(&mut self) -> Result<(), TileError> {
        if let Some(spill) = &mut self.spill {
            spill.current = None;
            spill.tiles.pass_on();
        }
        if self.spill_until(self.max_voxels) { Ok(()) } else { Err(self.why_no_room()) }
    }

    /// What the store could not do when there was no room.
    pub(in super::super) fn why_no_room(&self) -> TileError {
        let tiles = self.spill.as_ref().map(|spill| spill.tiles.why_no_room());
        tiles.unwrap_or(TileError::Another { source: TileStoreError::Missing })
    }

    /// A tile was found to be lost while all were read.
    pub(in super::super) fn lost_tile(&mut self, error: TileError) {
        if let Some(spill) = &mut self.spill {
            spill.tiles.lost_before(error);
        }
    }

    /// Writes tiles until there is room for so many voxels. Returns whether there is: not where nothing can be
    /// written.
    pub(in super::super) fn spill_until(&mut self, room: usize) -> bool {
        while self.voxels.len() + room > self.max_voxels {
            let Some(spill) = &mut self.spill else { return false };
            let Some(tile) = spill.tiles.next_to_go() else { return false };
            let mut voxels = self.occupied.as_ref().map_or_else(Vec::new, |occupied| {
                voxels_of(tile, &spill.layout, occupied, &self.voxels)
            });
            for (_, voxel) in &mut voxels {
                voxel.told.leave();
            }
            let bytes = spill.layout.encode(tile, &voxels);
            if !spill.tiles.write(tile, &bytes, voxels.len(), voxels.len()) {
                return false;
            }
            for (key, _) in &voxels {
                self.voxels.remove(key);
                if let Some(occupied) = &mut self.occupied {
                    occupied.remove(*key);
                }
            }
        }
        true
    }
}

/// The voxels of a tile in memory, by ascending key.
fn voxels_of(
    tile: TileKey,
    layout: &TileLayout,
    occupied: &Blocks,
    means: &HashMap<VoxelKey, VoxelMean, BuildVoxelHasher>,
) -> Vec<(VoxelKey, VoxelMean)> {
    let mut voxels: Vec<_> = layout
        .blocks_of(tile)
        .flat_map(|block| occupied.voxels_of(block))
        .filter_map(|key| Some((key, *means.get(&key)?)))
        .collect();
    voxels.sort_unstable_by_key(|(key, _)| *key);
    voxels
}
