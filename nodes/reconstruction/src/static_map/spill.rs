//! Tiles go to a store when the memory is full, and come back when a point or a ray reaches them: the map is that of
//! unbounded memory, to the last bit, as long as the store gives back what it was given. [`TileTable`] has the rules.

#[cfg(test)]
mod tests;
mod tile_file;
mod traffic;

use geometry::{VoxelGrid, VoxelKey};

use super::voxel::VoxelMean;
use crate::tiles::{Reached, TileError, TileKey, TileStore, TileTable};
use tile_file::TileLayout;

/// The tiles of a map, in memory and out of it.
#[derive(Debug)]
pub(super) struct Spill {
    layout: TileLayout,
    tiles: TileTable,
    /// The tile that was reached last: nothing of it is in the store.
    current: Option<TileKey>,
}

impl Spill {
    pub(super) fn new(edge_voxels: u16, grid: VoxelGrid, store: Box<dyn TileStore>) -> Self {
        let layout = TileLayout { edge_voxels, grid };
        Self { layout, tiles: TileTable::new(store), current: None }
    }

    /// The tiles of the same map as it is after a correction, in another store: none yet.
    ///
    /// # Errors
    /// When there is no other store.
    pub(super) fn another(&self) -> Result<Self, TileError> {
        Ok(Self { layout: self.layout, tiles: self.tiles.another()?, current: None })
    }

    /// Something could not be done that another attempt may do.
    pub(super) fn failed(&mut self, error: TileError) {
        self.tiles.failed(error);
    }

    /// Forgets every tile.
    pub(super) fn clear(&mut self) {
        self.tiles.clear();
        self.current = None;
    }

    /// Voxels in the store.
    pub(super) fn voxels(&self) -> usize {
        self.tiles.points_in_store()
    }

    pub(super) fn memory_bytes(&self) -> usize {
        self.tiles.memory_bytes()
    }

    /// The current tile has a voxel that it did not have.
    pub(super) fn has_one_more(&mut self) {
        if let Some(tile) = self.current {
            self.tiles.has(tile);
        }
    }

    /// The tiles in the store.
    pub(super) fn tiles_by_key(&self) -> Vec<TileKey> {
        self.tiles.in_store_by_key()
    }

    /// The voxels of a tile in the store, by ascending key. It stays there.
    pub(super) fn read(&self, tile: TileKey) -> Result<Vec<(VoxelKey, VoxelMean)>, TileError> {
        let bytes = self.tiles.read(tile)?;
        self.layout.decode(tile, &bytes).map_err(|source| TileError::Broken { tile, source })
    }

    /// A voxel in the store.
    pub(super) fn look_up(&self, voxel: VoxelKey) -> Option<VoxelMean> {
        let tile = self.layout.tile_of(voxel);
        if !self.tiles.is_in_store(tile) {
            return None;
        }
        let voxels = self.read(tile).ok()?;
        let index = voxels.binary_search_by_key(&voxel, |(key, _)| *key).ok()?;
        voxels.get(index).map(|(_, mean)| *mean)
    }

    /// Reaches the tile of a voxel.
    fn reach(&mut self, voxel: VoxelKey) -> (TileKey, Reached) {
        let tile = self.layout.tile_of(voxel);
        if self.current == Some(tile) {
            return (tile, Reached::InMemory);
        }
        self.tiles.pass_on();
        let reached = self.tiles.reach(tile);
        self.current = matches!(reached, Reached::InMemory).then_some(tile);
        (tile, reached)
    }
}
