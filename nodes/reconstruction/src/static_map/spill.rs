//! Tiles go to a store when the memory is full, and come back when a point or a ray reaches them.
//!
//! A tile is in memory as a whole or not at all, so that whatever is computed of a voxel is computed of all that was
//! ever known of it: the map is that of unbounded memory, to the last bit, as long as the store gives back what it
//! was given. The tile that was reached longest ago goes first.

//!
//! A store may fail for a while. A tile that could not be read or written then is asked for again in the next round: the
//! next cycle, or the next time that listeners are told of changes.

mod counts;
#[cfg(test)]
mod tests;
mod tile_file;
mod traffic;

use std::collections::{BTreeMap, HashMap};

use geometry::{BuildVoxelHasher, VoxelGrid, VoxelKey};

use super::voxel::VoxelMean;
use crate::tiles::{TileError, TileKey, TileStore};
pub use counts::SpillCounts;
use tile_file::TileLayout;

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
    round: u32,
    /// The tiles in the store that could not be read when they were last asked for, and the round in which that was:
    /// they are not tried again in it.
    unreadable: BTreeMap<TileKey, u32>,
    /// The latest write failed, in this round: no other is tried in it.
    unwritable: Option<u32>,
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
            round: 0,
            unreadable: BTreeMap::new(),
            unwritable: None,
            counts: SpillCounts::default(),
            error: None,
        };
        spill.clear();
        spill
    }

    /// The tiles of the same map as it is after a correction, in another store: none yet.
    ///
    /// # Errors
    /// When there is no other store.
    pub(super) fn another(&self) -> Result<Self, TileError> {
        let store = self.store.another().map_err(|source| TileError::Another { source })?;
        let TileLayout { edge_voxels, grid } = self.layout;
        let (round, following) = (self.round, self.following);
        let counts = SpillCounts { voxels_in_store: 0, ..self.counts };
        Ok(Self { round, following, counts, ..Self::new(edge_voxels, grid, store) })
    }

    /// Something could not be done that another attempt may do.
    pub(super) fn failed(&mut self, error: TileError) {
        self.counts.failed += 1;
        self.error = Some(error);
    }

    /// Forgets every tile.
    pub(super) fn clear(&mut self) {
        self.in_memory = HashMap::default();
        self.in_store = HashMap::default();
        self.unreadable = BTreeMap::new();
        (self.current, self.unwritable) = (None, None);
        self.counts.voxels_in_store = 0;
        if let Err(source) = self.store.clear() {
            self.counts.failed += 1;
            self.error = Some(TileError::Clear { source });
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
            + self.unreadable.len() * size_of::<(TileKey, u32)>()
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

    /// What failed may be tried again.
    pub(super) fn begin_round(&mut self) {
        self.round = self.round.wrapping_add(1);
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

    /// The tiles that could not be read when they were last asked for, by ascending key.
    pub(super) fn unreadable_by_key(&self) -> Vec<TileKey> {
        self.unreadable.keys().copied().collect()
    }

    /// Reaches the tile of a voxel. Returns it if it is in the store, unless that was tried in this round.
    fn reach(&mut self, voxel: VoxelKey) -> Reached {
        let tile = self.layout.tile_of(voxel);
        if self.current == Some(tile) {
            return Reached::InMemory;
        }
        self.time += 1;
        if let Some(known) = self.in_memory.get_mut(&tile) {
            known.reached = self.time;
        } else if let Some(spilled) = self.in_store.get(&tile) {
            if self.unreadable.get(&tile) == Some(&self.round) {
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

    /// A tile could not be read. One that is lost is in the store no more; another one counts as a failure when it
    /// could be read before. Returns whether it is lost.
    pub(super) fn could_not_read(&mut self, tile: TileKey, error: TileError) -> bool {
        let is_lost = error.is_loss();
        if is_lost {
            self.left_store(tile);
            self.counts.lost += 1;
        } else if self.unreadable.insert(tile, self.round).is_none() {
            self.counts.failed += 1;
        }
        self.error = Some(error);
        is_lost
    }

    /// All tiles of the store have been read.
    pub(super) fn could_read_all(&mut self) {
        self.unreadable = BTreeMap::new();
    }

    /// A tile could not be written, which counts as a failure when the one before could.
    fn could_not_write(&mut self, error: TileError) {
        if self.unwritable.replace(self.round).is_none() {
            self.counts.failed += 1;
        }
        self.error = Some(error);
    }

    fn went(&mut self, tile: TileKey, voxels: usize) {
        self.in_memory.remove(&tile);
        let (voxels, following) = (voxels as u32, self.following);
        self.in_store.insert(tile, InStore { voxels, following });
        self.unwritable = None;
        self.counts.voxels_in_store += voxels as usize;
        self.counts.written += 1;
    }

    /// The tile is in the store no more: it has come back, or is lost.
    fn left_store(&mut self, tile: TileKey) {
        self.unreadable.remove(&tile);
        if let Some(spilled) = self.in_store.remove(&tile) {
            self.counts.voxels_in_store =
                self.counts.voxels_in_store.saturating_sub(spilled.voxels as usize);
        }
    }
}

/// Where a tile is.
enum Reached {
    /// All that is known of it.
    InMemory,
    InStore(TileKey, InStore),
    Unreadable,
}
