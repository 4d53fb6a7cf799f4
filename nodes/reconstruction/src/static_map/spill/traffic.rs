//! Tiles on their way: from the memory to the store, and back.

use std::collections::HashMap;

use geometry::{BuildVoxelHasher, VoxelKey};
use nalgebra::Point3;

use super::super::blocks::Blocks;
use super::super::changes::Place;
use super::super::voxel::VoxelMean;
use super::super::{StaticMap, WholeMap};
use super::tile_file::TileLayout;
use super::{InMemory, InStore, Reached, Spill, SpillCounts};
use crate::tiles::{TileError, TileKey, TileStoreError};

impl StaticMap {
    /// What became of the tiles; `None` where none are spilled.
    #[must_use]
    pub fn spill_counts(&self) -> Option<SpillCounts> {
        self.spill.as_ref().map(Spill::counts)
    }

    /// The latest of the errors since this was last asked; [`SpillCounts`] has their number.
    pub fn take_tile_error(&mut self) -> Option<TileError> {
        self.spill.as_mut()?.error.take()
    }

    /// What the store could not do may be tried again.
    pub(in super::super) fn begin_round(&mut self) {
        if let Some(spill) = &mut self.spill {
            spill.begin_round();
        }
    }

    /// Changes are followed from now on: what was spilled until now, listeners know as it is.
    pub(in super::super) fn follow_spilled(&mut self) {
        if let Some(spill) = &mut self.spill {
            spill.follow();
        }
    }

    /// Brings back the tile of a voxel, if it was spilled. Returns whether all that is known of the voxel is in
    /// memory now.
    pub(in super::super) fn fetch(&mut self, voxel: VoxelKey) -> bool {
        let Some(spill) = &mut self.spill else { return true };
        match spill.reach(voxel) {
            Reached::InMemory => true,
            Reached::Unreadable => false,
            Reached::InStore(tile, spilled) => self.bring_back(tile, spilled),
        }
    }

    fn bring_back(&mut self, tile: TileKey, spilled: InStore) -> bool {
        if let Some(spill) = &mut self.spill {
            // Room for this tile comes before what was reached last.
            spill.current = None;
        }
        if !self.spill_until(spilled.voxels as usize) {
            return false;
        }
        let Some(spill) = &mut self.spill else { return true };
        let voxels = match spill.read(tile) {
            Ok(voxels) => voxels,
            Err(error) => {
                let is_lost = spill.could_not_read(tile, error);
                if is_lost {
                    spill.current = Some(tile);
                    self.tiles_were_lost();
                }
                return is_lost;
            }
        };
        let listeners_know_all = spilled.following != spill.following;
        spill.left_store(tile);
        spill.current = Some(tile);
        spill.counts.read += 1;
        let known = InMemory { voxels: voxels.len() as u32, reached: spill.time };
        spill.in_memory.insert(tile, known);
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
        // Those that failed are tried first, so that a store that goes on failing is not read to its end each time.
        let failed = self.spill.as_ref().map_or_else(Vec::new, Spill::unreadable_by_key);
        for tile in failed {
            if let Some(spill) = &mut self.spill
                && let Err(error) = spill.read(tile)
                && !error.is_loss()
            {
                spill.could_not_read(tile, error.clone());
                return Err(error);
            }
        }
        let WholeMap { points_m, unreadable, .. } = self.whole();
        let Some(spill) = &mut self.spill else { return Ok(points_m) };
        let mut first_failure = None;
        let mut some_are_lost = false;
        for error in unreadable {
            let Some(tile) = error.tile() else { continue };
            if spill.could_not_read(tile, error.clone()) {
                some_are_lost = true;
            } else {
                first_failure.get_or_insert(error);
            }
        }
        if first_failure.is_none() {
            spill.could_read_all();
        }
        if some_are_lost {
            self.tiles_were_lost();
        }
        first_failure.map_or(Ok(points_m), Err)
    }

    /// Writes all tiles.
    ///
    /// # Errors
    /// When one cannot be written.
    pub(in super::super) fn spill_all(&mut self) -> Result<(), TileError> {
        if let Some(spill) = &mut self.spill {
            spill.current = None;
        }
        if self.spill_until(self.max_voxels) { Ok(()) } else { Err(self.why_no_room()) }
    }

    /// What the store could not do when there was no room.
    pub(in super::super) fn why_no_room(&self) -> TileError {
        let error = self.spill.as_ref().and_then(|spill| spill.error.clone());
        error.unwrap_or(TileError::Another { source: TileStoreError::Missing })
    }

    /// A tile was found to be lost while all were read.
    pub(in super::super) fn lost_tile(&mut self, error: TileError) {
        if let Some(spill) = &mut self.spill {
            spill.counts.lost += 1;
            spill.error = Some(error);
        }
    }

    /// Writes tiles until there is room for so many voxels. Returns whether there is: not where nothing can be
    /// written.
    pub(in super::super) fn spill_until(&mut self, room: usize) -> bool {
        while self.voxels.len() + room > self.max_voxels {
            let Some(spill) = &mut self.spill else { return false };
            if spill.unwritable == Some(spill.round) {
                return false;
            }
            let Some(tile) = spill.oldest() else { return false };
            let mut voxels = self.occupied.as_ref().map_or_else(Vec::new, |occupied| {
                voxels_of(tile, &spill.layout, occupied, &self.voxels)
            });
            for (_, voxel) in &mut voxels {
                voxel.told.leave();
            }
            let bytes = spill.layout.encode(tile, &voxels);
            if let Err(source) = spill.store.write(tile, &bytes) {
                spill.could_not_write(TileError::Write { tile, source });
                return false;
            }
            spill.went(tile, voxels.len());
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
