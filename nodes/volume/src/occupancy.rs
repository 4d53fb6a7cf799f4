//! The state of each voxel: free, occupied or unknown, and since when.
//!
//! - **Hits.** A static point of the cycle hits its voxel. It is the mean of a voxel's depths: the noise of single pixels would
//!   make each surface several voxels thick.
//! - **Passes.** A voxel is passed where all pixels that it may cover have a depth that is larger by at least an edge. A ray
//!   through its centre alone is not enough: rays over a floor pass through the voxels that the floor is in (the
//!   discretisation of Hornung et al., "OctoMap", 2013, section 5.1). So surfaces at a grazing angle are not cleared.
//! - **No return.** Where most pixels of a tile have no depth, space is unknown: there may be a dark surface.
//! - **Moving points** hit nothing; space in front of them is free.
//!
//! A block whose voxels have all been free for long is stored as one cell, so that free space takes little memory. [`crate::Cell`]
//! has the rules for hits and passes.

mod block;
mod config;
mod update;

use geometry::{Stamp, VoxelGrid, VoxelKey};

use crate::block::{BlockKey, voxel_index};
use crate::cell::{Cell, CellState};
use crate::layer::Layer;
use crate::ticks::Ticks;
use block::OccupancyBlock;
pub use config::{OccupancyConfig, OccupancyConfigError};

/// The state of a place.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Place {
    /// There is no evidence, or too little.
    Unknown,
    /// It was observed free in several cycles: what is there now is newly occupied.
    Free,
    /// It is occupied.
    Occupied {
        /// The first hit.
        since: Stamp,
        /// The last hit.
        last: Stamp,
    },
}

/// The result of one update.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct OccupancyUpdate {
    /// Blocks in view.
    pub seen_blocks: usize,
    /// Blocks that were dropped to make room: those not seen for the longest time.
    pub dropped_blocks: usize,
    /// Whether the view has more blocks than one image may update, or than memory allows.
    pub is_incomplete: bool,
}

/// The evidence on occupancy. See the module.
#[derive(Clone, Debug)]
pub struct Occupancy {
    config: OccupancyConfig,
    grid: VoxelGrid,
    layer: Layer<OccupancyBlock>,
    ticks: Ticks,
    now: u32,
    /// Counts images.
    image: u32,
}

impl Occupancy {
    /// Everything is unknown.
    ///
    /// # Errors
    /// When a parameter is out of its range.
    pub fn new(config: OccupancyConfig) -> Result<Self, OccupancyConfigError> {
        config.validate()?;
        Ok(Self {
            config,
            grid: VoxelGrid::new(config.edge_m)?,
            layer: Layer::default(),
            ticks: Ticks::default(),
            now: 0,
            image: 0,
        })
    }

    /// Sets the time of the next update. All evidence is cleared when more time has passed since the first update than the ticks
    /// of voxels can represent, 497 days: usually a clock that began at 0 and was set.
    pub fn begin_cycle(&mut self, stamp: Stamp) {
        if self.ticks.are_over_at(stamp) {
            self.clear();
        }
        // Each cycle counts, also one that is late or has the stamp of the last.
        self.now = self.ticks.at(stamp).max(self.now.saturating_add(1));
    }

    /// The state of a voxel.
    #[must_use]
    pub fn place(&self, voxel: VoxelKey) -> Place {
        let stamp = |tick| self.ticks.stamp(tick).unwrap_or_default();
        let cell = self.cell(voxel);
        match cell.state() {
            CellState::Unknown => Place::Unknown,
            CellState::Free => Place::Free,
            CellState::Occupied => Place::Occupied {
                since: stamp(cell.occupied_since()),
                last: stamp(cell.last_hit()),
            },
        }
    }

    /// The evidence on a voxel; the default where there is none.
    #[must_use]
    pub fn cell(&self, voxel: VoxelKey) -> Cell {
        let block = self.layer.get(BlockKey::of(voxel));
        block.map_or_else(Cell::default, |block| block.cell(voxel_index(voxel)))
    }

    /// Whether a voxel was hardly ever hit, and no surface is beside it.
    #[must_use]
    pub fn is_untouched(&self, voxel: VoxelKey) -> bool {
        !self.cell(voxel).was_hit() && !self.is_near_surface(voxel, 1)
    }

    /// Whether one of the voxels no more than `steps` away along each axis is, or may be, part of a surface. Not all voxels of a
    /// surface are hit in each cycle, so that a single point in free space beside one may be noise.
    #[must_use]
    pub fn is_near_surface(&self, voxel: VoxelKey, steps: i32) -> bool {
        let corner = |by: i32| VoxelKey {
            x: voxel.x.saturating_add(by),
            y: voxel.y.saturating_add(by),
            z: voxel.z.saturating_add(by),
        };
        let (least, most) = (corner(-steps), corner(steps));
        let (first, last) = (BlockKey::of(least), BlockKey::of(most));
        let is_near = |key: BlockKey| {
            let Some(block) = self.layer.get(key) else { return false };
            let own = (key == BlockKey::of(voxel)).then(|| voxel_index(voxel));
            block.has_beside(key.indices_between(least, most), own, Cell::may_be_surface)
        };
        // A block is looked up once, not once for each of its voxels.
        steps > 0
            && (first.z..=last.z).any(|z| {
                (first.y..=last.y)
                    .any(|y| (first.x..=last.x).any(|x| is_near(BlockKey { x, y, z })))
            })
    }

    /// Sets a voxel to free: the camera would have seen before what is there now.
    pub fn take_for_free(&mut self, voxel: VoxelKey) {
        self.change(voxel, Cell::take_for_free);
    }

    /// Sets a voxel to occupied since a time: a tracked object is there that has stopped for good.
    pub fn take_for_occupied(&mut self, voxel: VoxelKey, since: Stamp) {
        let (since, now) = (self.ticks.at(since), self.now);
        self.change(voxel, |cell| cell.take_for_occupied(since, now));
    }

    /// Something that moves is in a voxel in this cycle. Returns since when something that moves has been there, seen or unseen, without
    /// a pass in between; `None` when there is no room for more evidence.
    pub fn hold_moving(&mut self, voxel: VoxelKey) -> Option<Stamp> {
        let now = self.now;
        let since = self.change(voxel, |cell| cell.hold_moving(now));
        since.and_then(|since| self.ticks.stamp(since))
    }

    /// What was found in a voxel by [`Self::hold_moving`] was put there, and who did it has left.
    pub fn leave(&mut self, voxel: VoxelKey) {
        self.change(voxel, Cell::leave);
    }

    /// Sets a voxel to unknown.
    pub fn forget(&mut self, voxel: VoxelKey) {
        self.change(voxel, |cell| *cell = Cell::default());
    }

    /// `None` when there is no room for more evidence.
    fn change<T>(&mut self, voxel: VoxelKey, change: impl FnOnce(&mut Cell) -> T) -> Option<T> {
        let slot = self.slot_or_new(BlockKey::of(voxel), &mut OccupancyUpdate::default());
        let block = slot.and_then(|slot| self.layer.at_mut(slot))?;
        Some(change(block.cell_mut(voxel_index(voxel))))
    }

    /// Clears all evidence.
    pub fn clear(&mut self) {
        self.layer = Layer::default();
        (self.ticks, self.now) = (Ticks::default(), 0);
    }

    /// The grid of the voxels.
    #[must_use]
    pub fn grid(&self) -> &VoxelGrid {
        &self.grid
    }

    /// The parameters.
    #[must_use]
    pub fn config(&self) -> &OccupancyConfig {
        &self.config
    }

    /// The number of blocks.
    #[must_use]
    pub fn blocks(&self) -> usize {
        self.layer.len()
    }

    /// The memory in use, in bytes.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        let blocks = self.layer.unordered().map(|(_, block)| block.cells_bytes());
        blocks.sum::<usize>() + self.layer.table_bytes()
    }
}

#[cfg(test)]
mod tests;
