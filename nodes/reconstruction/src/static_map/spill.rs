//! Tiles go to a store when the memory is full, and come back when a point or a ray reaches them.
//!
//! A tile is in memory as a whole or not at all, so that whatever is computed of a voxel is computed of all that was
//! ever known of it: the map is that of unbounded memory, to the last bit, as long as the store gives back what it
//! was given. The tile that was reached longest ago goes first.

#[cfg(test)]
mod tests;
mod tile_file;

use std::collections::HashMap;

use geometry::{VoxelGrid, VoxelKey};
use serde::Serialize;

use super::StaticMap;
use super::blocks::Blocks;
use super::changes::Place;
use super::voxel::{BuildVoxelHasher, VoxelMean};
use crate::tiles::{TileError, TileKey, TileStore};
use tile_file::TileLayout;

/// What has become of the tiles of a map that spills.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize)]
pub struct SpillCounts {
    /// Tiles in memory now.
    pub tiles_in_memory: usize,
    /// Tiles in the store now.
    pub tiles_in_store: usize,
    /// Voxels of these.
    pub voxels_in_store: usize,
    /// Tiles written since the map was made.
    pub written: u64,
    /// Tiles read back.
    pub read: u64,
    /// Tiles that were missing or broken, with all their voxels.
    pub lost: u64,
    /// How often a tile could not be written, or not be read for now.
    pub failed: u64,
}

/// The tiles of a map, in memory and out of it.
#[derive(Debug)]
pub(super) struct Spill {
    layout: TileLayout,
    store: Box<dyn TileStore>,
    /// Those with a voxel in memory. Looked up by key, or for the least of distinct times.
    in_memory: HashMap<TileKey, InMemory, BuildVoxelHasher>,
    /// Looked up by key alone, or in the order of the keys.
    in_store: HashMap<TileKey, InStore, BuildVoxelHasher>,
    /// The tile that was reached last: nothing of it is in the store.
    current: Option<TileKey>,
    time: u64,
    /// Counts how often changes began to be followed.
    following: u32,
    /// The cycle in which a tile could not be written: no other is tried in it.
    failed_in: Option<u32>,
    counts: SpillCounts,
    error: Option<TileError>,
}

#[derive(Clone, Copy, Debug)]
struct InMemory {
    voxels: u32,
    reached: u64,
}

#[derive(Clone, Copy, Debug)]
struct InStore {
    voxels: u32,
    /// [`Spill::following`] when it went.
    following: u32,
    /// The cycle in which it could not be read: it is not tried again in it.
    failed_in: Option<u32>,
}

impl Spill {
    pub(super) fn new(edge_voxels: u16, grid: VoxelGrid, store: Box<dyn TileStore>) -> Self {
        let mut spill = Self {
            layout: TileLayout { edge_voxels, grid },
            store,
            in_memory: HashMap::default(),
            in_store: HashMap::default(),
            current: None,
            time: 0,
            following: 0,
            failed_in: None,
            counts: SpillCounts::default(),
            error: None,
        };
        spill.clear();
        spill
    }

    /// Forgets every tile.
    pub(super) fn clear(&mut self) {
        self.in_memory = HashMap::default();
        self.in_store = HashMap::default();
        (self.current, self.failed_in) = (None, None);
        self.counts.voxels_in_store = 0;
        if let Err(source) = self.store.clear() {
            self.note(TileError::Clear { source });
        }
    }

    /// Voxels in the store.
    pub(super) fn voxels(&self) -> usize {
        self.counts.voxels_in_store
    }

    fn counts(&self) -> SpillCounts {
        SpillCounts {
            tiles_in_memory: self.in_memory.len(),
            tiles_in_store: self.in_store.len(),
            ..self.counts
        }
    }

    pub(super) fn memory_bytes(&self) -> usize {
        // As for the voxels: filled up to 7/8, and a byte beside each entry.
        let slots = |capacity: usize| (capacity * 8).div_ceil(7);
        slots(self.in_memory.capacity()) * (size_of::<(TileKey, InMemory)>() + 1)
            + slots(self.in_store.capacity()) * (size_of::<(TileKey, InStore)>() + 1)
    }

    /// The current tile has a voxel that it did not have.
    pub(super) fn has_one_more(&mut self) {
        let Some(tile) = self.current else { return };
        let reached = self.time;
        self.in_memory.entry(tile).or_insert(InMemory { voxels: 0, reached }).voxels += 1;
    }

    /// A voxel in memory has gone for good.
    pub(super) fn has_one_less(&mut self, voxel: VoxelKey) {
        let key = self.layout.tile_of(voxel);
        if let Some(tile) = self.in_memory.get_mut(&key) {
            tile.voxels = tile.voxels.saturating_sub(1);
            if tile.voxels == 0 {
                self.in_memory.remove(&key);
            }
        }
    }

    /// Changes are followed from now on, or anew.
    pub(super) fn follow(&mut self) {
        self.following = self.following.wrapping_add(1);
    }

    /// The tiles in the store.
    pub(super) fn tiles_by_key(&self) -> Vec<TileKey> {
        let mut tiles: Vec<TileKey> = self.in_store.keys().copied().collect();
        tiles.sort_unstable();
        tiles
    }

    /// The voxels of a tile in the store, by ascending key. It stays there.
    pub(super) fn read(&self, tile: TileKey) -> Result<Vec<(VoxelKey, VoxelMean)>, TileError> {
        let bytes = self.store.read(tile).map_err(|source| TileError::Read { tile, source })?;
        self.layout.decode(tile, &bytes).map_err(|source| TileError::Broken { tile, source })
    }

    /// A voxel in the store.
    pub(super) fn look_up(&self, voxel: VoxelKey) -> Option<VoxelMean> {
        let tile = self.layout.tile_of(voxel);
        self.in_store.get(&tile)?;
        let voxels = self.read(tile).ok()?;
        let index = voxels.binary_search_by_key(&voxel, |(key, _)| *key).ok()?;
        voxels.get(index).map(|(_, mean)| *mean)
    }

    /// Reaches the tile of a voxel. Returns it if it is in the store, unless that was tried in this cycle.
    fn reach(&mut self, voxel: VoxelKey, cycle: u32) -> Reached {
        let tile = self.layout.tile_of(voxel);
        if self.current == Some(tile) {
            return Reached::InMemory;
        }
        self.time += 1;
        if let Some(known) = self.in_memory.get_mut(&tile) {
            known.reached = self.time;
        } else if let Some(spilled) = self.in_store.get(&tile) {
            if spilled.failed_in == Some(cycle) {
                return Reached::Unreadable;
            }
            return Reached::InStore(tile, *spilled);
        }
        self.current = Some(tile);
        Reached::InMemory
    }

    /// The tile that was reached longest ago, but for the current one.
    fn oldest(&self) -> Option<TileKey> {
        let others = self.in_memory.iter().filter(|(tile, _)| self.current != Some(**tile));
        others.min_by_key(|(_, known)| known.reached).map(|(tile, _)| *tile)
    }

    /// Keeps the latest error for who asks.
    fn note(&mut self, error: TileError) {
        if error.is_loss() {
            self.counts.lost += 1;
        } else {
            self.counts.failed += 1;
        }
        self.error = Some(error);
    }

    fn went(&mut self, tile: TileKey, voxels: usize) {
        self.in_memory.remove(&tile);
        let (voxels, following) = (voxels as u32, self.following);
        self.in_store.insert(tile, InStore { voxels, following, failed_in: None });
        self.counts.voxels_in_store += voxels as usize;
        self.counts.written += 1;
    }

    /// The tile is in the store no more: it has come back, or is lost.
    fn left_store(&mut self, tile: TileKey) {
        if let Some(spilled) = self.in_store.remove(&tile) {
            self.counts.voxels_in_store =
                self.counts.voxels_in_store.saturating_sub(spilled.voxels as usize);
        }
        self.current = Some(tile);
    }
}

/// Where a tile is.
enum Reached {
    /// All that is known of it.
    InMemory,
    InStore(TileKey, InStore),
    Unreadable,
}

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

    /// Keeps an error of a tile for [`StaticMap::take_tile_error`].
    pub(super) fn note_tile_error(&mut self, error: TileError) {
        if let Some(spill) = &mut self.spill {
            spill.note(error);
        }
    }

    /// Changes are followed from now on: what was spilled until now, listeners know as it is.
    pub(super) fn follow_spilled(&mut self) {
        if let Some(spill) = &mut self.spill {
            spill.follow();
        }
    }

    /// Brings back the tile of a voxel, if it was spilled. Returns whether all that is known of the voxel is in
    /// memory now.
    pub(super) fn fetch(&mut self, voxel: VoxelKey) -> bool {
        let cycle = self.cycles;
        let Some(spill) = &mut self.spill else { return true };
        match spill.reach(voxel, cycle) {
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
                let is_loss = error.is_loss();
                if is_loss {
                    spill.left_store(tile);
                } else if let Some(spilled) = spill.in_store.get_mut(&tile) {
                    spilled.failed_in = Some(self.cycles);
                }
                spill.note(error);
                if is_loss && self.changes.is_some() {
                    // Listeners still have its points, and nobody knows which ones they were.
                    self.follow_changes_anew();
                }
                return is_loss;
            }
        };
        let listeners_know_all = spilled.following != spill.following;
        spill.left_store(tile);
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

    /// Writes tiles until there is room for so many voxels. Returns whether there is: not where nothing can be
    /// written.
    pub(super) fn spill_until(&mut self, room: usize) -> bool {
        while self.voxels.len() + room > self.max_voxels {
            let cycle = self.cycles;
            let Some(spill) = &mut self.spill else { return false };
            if spill.failed_in == Some(cycle) {
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
                spill.failed_in = Some(cycle);
                spill.note(TileError::Write { tile, source });
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
