//! What is known of each place: free, occupied or unknown, and since when.
//!
//! - **Hits.** A point of the cycle that does not move hits the voxel that it is in. It is the mean of a voxel's depths: the noise
//!   of single pixels would make each surface voxels thick.
//! - **Passes.** A voxel is passed where all pixels that it may cover show something farther away, by an edge at least. A ray
//!   through its middle alone would say too much: rays over a floor pass through the voxels that the floor is in (the
//!   discretisation of Hornung et al., "OctoMap", 2013, section 5.1). So surfaces at a low angle are not cleared.
//! - **No return.** Where most pixels of a tile show nothing, nothing is known: something dark may be there.
//! - **What moves** hits nothing; what is before it is free.
//! - **A hit outweighs** the passes of its cycle.
//!
//! A block of which each voxel has been free for long is one cell: free space costs little memory. See [`crate::Cell`] for what
//! is made of hits and passes.

mod block;
mod config;
mod update;

use geometry::{Stamp, VoxelGrid, VoxelKey};
use nalgebra::Point3;

use crate::block::{BlockKey, voxel_index};
use crate::cell::{Cell, CellState};
use crate::layer::Layer;
use crate::ticks::Ticks;
use block::OccupancyBlock;
pub use config::{OccupancyConfig, OccupancyConfigError};

/// What is known of a place.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Place {
    /// Nothing, or not enough.
    Unknown,
    /// It was seen free, cycle after cycle: what is there now has come.
    Free {
        /// Since when.
        since: Stamp,
    },
    /// Something is there.
    Occupied {
        /// When it was hit first.
        since: Stamp,
        /// When it was hit last.
        last: Stamp,
    },
}

/// What one image did.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct OccupancyUpdate {
    /// Blocks of which something was seen.
    pub seen_blocks: usize,
    /// Blocks that were dropped, since they were seen longest ago.
    pub dropped_blocks: usize,
    /// Whether the view has more blocks than one image may update, or than there is room for.
    pub is_incomplete: bool,
}

/// Evidence on space. See the module.
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
    /// Nothing known.
    ///
    /// # Errors
    /// When a parameter means nothing.
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

    /// Sets the moment that what follows is of. What is known is forgotten when more time has passed since the first moment
    /// than the moments of voxels can say, 497 days: a clock that began at 0 and was set, for the most part.
    pub fn begin_cycle(&mut self, stamp: Stamp) {
        if self.ticks.are_over_at(stamp) {
            self.clear();
        }
        self.now = self.ticks.at(stamp);
    }

    /// What is known of the place of a point of the map.
    #[must_use]
    pub fn place(&self, point_in_map: &Point3<f64>) -> Place {
        self.voxel(point_in_map).map_or(Place::Unknown, |voxel| self.place_of(&self.cell(voxel)))
    }

    fn place_of(&self, cell: &Cell) -> Place {
        let stamp = |tick| self.ticks.stamp(tick).unwrap_or_default();
        match cell.state() {
            CellState::Unknown => Place::Unknown,
            CellState::Free => Place::Free { since: stamp(cell.free_since()) },
            CellState::Occupied => {
                Place::Occupied { since: stamp(cell.first_hit()), last: stamp(cell.last_hit()) }
            }
        }
    }

    /// The evidence on a voxel; that of nothing where nothing is known.
    #[must_use]
    pub fn cell(&self, voxel: VoxelKey) -> Cell {
        let block = self.layer.get(BlockKey::of(voxel));
        block.map_or_else(Cell::default, |block| block.cell(voxel_index(voxel)))
    }

    /// Whether hardly anything ever ended in a place, and no surface is beside it.
    #[must_use]
    pub fn is_untouched(&self, point_in_map: &Point3<f64>) -> bool {
        let was_hit = self.voxel(point_in_map).is_some_and(|voxel| self.cell(voxel).was_hit());
        !was_hit && !self.is_near_surface(point_in_map, 1)
    }

    /// Whether one of the voxels no more than `steps` away along each axis is of a surface, or may be. Of a surface not all
    /// voxels are hit in each cycle, so that a place beside one is free only for what is part of something larger.
    #[must_use]
    pub fn is_near_surface(&self, point_in_map: &Point3<f64>, steps: i32) -> bool {
        self.voxel(point_in_map).is_some_and(|voxel| {
            let beside = voxel.within(steps).filter(|beside| *beside != voxel);
            beside.into_iter().any(|beside| self.cell(beside).may_be_surface())
        })
    }

    /// Takes a place for free: the camera would have seen what is there now.
    pub fn take_for_free(&mut self, point_in_map: &Point3<f64>) {
        let now = self.now;
        self.change(point_in_map, |cell| cell.take_for_free(now));
    }

    /// Takes a place for occupied since a moment: what is there was followed, and has stopped for good.
    pub fn take_for_occupied(&mut self, point_in_map: &Point3<f64>, since: Stamp) {
        let (since, now) = (self.ticks.at(since), self.now);
        self.change(point_in_map, |cell| cell.take_for_occupied(since, now));
    }

    /// Takes a place for one of which nothing is known.
    pub fn forget(&mut self, point_in_map: &Point3<f64>) {
        self.change(point_in_map, |cell| *cell = Cell::default());
    }

    fn change(&mut self, point_in_map: &Point3<f64>, change: impl FnOnce(&mut Cell)) {
        let Some(voxel) = self.voxel(point_in_map) else { return };
        let slot = self.slot_or_new(BlockKey::of(voxel), &mut OccupancyUpdate::default());
        if let Some(block) = slot.and_then(|slot| self.layer.at_mut(slot)) {
            change(block.cell_mut(voxel_index(voxel)));
        }
    }

    /// The voxel of a point; `None` where its coordinates are no numbers.
    fn voxel(&self, point_in_map: &Point3<f64>) -> Option<VoxelKey> {
        let [x, y, z] = (point_in_map.coords / self.config.edge_m).into();
        let is_finite = f64::is_finite(x) && f64::is_finite(y) && f64::is_finite(z);
        // The casts saturate.
        let cell = |value: f64| value.floor() as i32;
        is_finite.then(|| VoxelKey { x: cell(x), y: cell(y), z: cell(z) })
    }

    /// Forgets everything.
    pub fn clear(&mut self) {
        self.layer = Layer::default();
        self.ticks = Ticks::default();
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

    /// How many blocks there are.
    #[must_use]
    pub fn blocks(&self) -> usize {
        self.layer.len()
    }

    /// The memory taken, in bytes.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        let blocks = self.layer.unordered().map(|(_, block)| block.cells_bytes());
        blocks.sum::<usize>() + self.layer.table_bytes()
    }
}

#[cfg(test)]
mod tests;
