//! What the map says of itself.

use geometry::{VoxelGrid, VoxelKey};
use nalgebra::Point3;

use super::StaticMap;
use super::blocks::Blocks;
use super::changes::Changes;
use super::seen_order::SeenOrder;
use super::spill::Spill;
use super::voxel::VoxelMean;

impl StaticMap {
    /// The voxels that the latest cycle touched, in the order in which its points touched them.
    #[must_use]
    pub fn changed(&self) -> &[VoxelKey] {
        &self.changed
    }

    /// The point of a voxel and the number of points that it is the mean of. One that is out of memory is looked up
    /// in its tile.
    #[must_use]
    pub fn voxel(&self, key: VoxelKey) -> Option<(Point3<f32>, u32)> {
        let in_memory = self.voxels.get(&key).copied();
        let voxel = in_memory.or_else(|| self.spill.as_ref()?.look_up(key));
        voxel.map(|voxel| (voxel.mean(), voxel.points()))
    }

    /// The grid of the map's voxels.
    #[must_use]
    pub fn grid(&self) -> &VoxelGrid {
        &self.grid
    }

    /// So many voxels the map may have; so many in memory, where tiles are spilled.
    #[must_use]
    pub fn max_voxels(&self) -> usize {
        self.max_voxels
    }

    /// The frame of the map, which the first cloud sets.
    #[must_use]
    pub fn frame_id(&self) -> Option<&str> {
        self.frame_id.as_deref()
    }

    /// How many voxels, and so points, the map has, those of spilled tiles included.
    #[must_use]
    pub fn len(&self) -> usize {
        self.voxels.len() + self.spill.as_ref().map_or(0, Spill::voxels)
    }

    /// Whether the map has no point.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The points that were refused since the map was empty.
    #[must_use]
    pub fn refused_points(&self) -> u64 {
        self.refused_points
    }

    /// About how many bytes the map takes now.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        // The table is filled up to 7/8, and keeps one byte beside each entry.
        let slots = (self.voxels.capacity() * 8).div_ceil(7);
        let waiting = self.changes.as_ref().map_or(0, Changes::memory_bytes);
        let occupied = self.occupied.as_ref().map_or(0, Blocks::memory_bytes);
        let seen_order = self.seen_order.as_ref().map_or(0, SeenOrder::memory_bytes);
        let spill = self.spill.as_ref().map_or(0, Spill::memory_bytes);
        slots * (size_of::<(VoxelKey, VoxelMean)>() + 1)
            + waiting
            + occupied
            + seen_order
            + spill
            + self.behaviour.memory_bytes()
    }
}
