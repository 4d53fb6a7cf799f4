//! What is known of places in the horizontal plane: hits and passes of a [`Cell`] each, free, occupied or unknown.
//!
//! Rays of a scanner, or the nearest of each column of a depth image, update it. In each cycle a cell is hit (something static
//! ends there), passed, or neither; a hit outweighs all passes of its cycle, so hits come first. Blocks of 8 by 8 cells are
//! found by their keys, as those of voxels are. When the map is corrected, each block moves with the moment at which it was
//! seen first.

mod correction;
mod fan;
#[cfg(test)]
mod tests;

use geometry::{Stamp, VoxelEdgeError, VoxelGrid, VoxelKey};
use nalgebra::Point2;

use crate::block::{BLOCK_EDGE, BlockKey};
use crate::cell::{Cell, CellState, PassesPerHit};
use crate::layer::{Layer, Slot};
use crate::ticks::Ticks;
pub use fan::{PlaneRay, SAMPLES_PER_CELL, WIDEST_GAP_M};

/// A range may be off by more than a cell of a plan, unlike the mean of the depths of a voxel: the cells beside a wall are hit now
/// and then, and passed more often.
const PASSES_PER_HIT: PassesPerHit = PassesPerHit { where_free: 6, where_occupied: 2 };

/// Cells of a block.
const BLOCK_CELLS: usize = BLOCK_EDGE * BLOCK_EDGE;

/// The parameters of [`PlaneOccupancy`].
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct PlaneConfig {
    /// The edge of the cells, in metres.
    pub edge_m: f64,
    /// Blocks of 8 by 8 cells that are kept at most, 1 kB each; cells that need another one stay unknown.
    pub max_blocks: usize,
    /// Whether a ray passes nothing behind the first cell that is occupied; that one it passes. What is seen behind something now
    /// and then is then not free, and what has gone is cleared cell after cell.
    pub ends_at_occupied: bool,
}

/// A block of cells.
#[derive(Clone, Debug)]
struct PlaneBlock {
    /// Their times are cycles.
    cells: [Cell; BLOCK_CELLS],
    first_seen: u32,
}

/// Evidence on places in the plane. See the module.
#[derive(Clone, Debug)]
pub struct PlaneOccupancy {
    config: PlaneConfig,
    layer: Layer<Box<PlaneBlock>>,
    ticks: Ticks,
    now: u32,
    cycle: u32,
    refused_cells: u64,
    /// The block that was changed last: neighbouring cells mostly share one.
    last: Option<(BlockKey, Slot)>,
}

impl PlaneOccupancy {
    /// Nothing known.
    ///
    /// # Errors
    /// When the edge is no length.
    pub fn new(config: PlaneConfig) -> Result<Self, VoxelEdgeError> {
        VoxelGrid::new(config.edge_m)?;
        Ok(Self {
            config,
            layer: Layer::default(),
            ticks: Ticks::default(),
            now: 0,
            cycle: 0,
            refused_cells: 0,
            last: None,
        })
    }

    /// Sets the moment that what follows is of.
    pub fn begin_cycle(&mut self, stamp: Stamp) {
        self.now = self.ticks.advance(stamp);
        self.cycle = self.cycle.wrapping_add(1);
    }

    /// Something static ends at a place; before the passes of the cycle, see [`Cell`].
    pub fn hit(&mut self, place_m: &Point2<f64>) {
        self.count(place_m, Cell::hit);
    }

    /// A place is free in this cycle, unless it was hit in it. Returns whether it is occupied by what is known so far.
    pub fn pass(&mut self, place_m: &Point2<f64>) -> bool {
        self.count(place_m, Cell::pass) == Some(CellState::Occupied)
    }

    /// Counts a cell. Returns its state after it.
    fn count(&mut self, place_m: &Point2<f64>, count: fn(&mut Cell, u32)) -> Option<CellState> {
        let cell = self.cell_of(place_m)?;
        let key = BlockKey::of(VoxelKey { x: cell[0], y: cell[1], z: 0 });
        let (cycle, index) = (self.cycle, index_of(cell));
        let Some(block) = self.block_or_new(key) else {
            self.refused_cells += 1;
            return None;
        };
        let cell = block.cells.get_mut(index)?;
        count(cell, cycle);
        Some(state_of(cell))
    }

    fn block_or_new(&mut self, key: BlockKey) -> Option<&mut PlaneBlock> {
        let known = self.last.filter(|(last, _)| *last == key).map(|(_, slot)| slot);
        let slot = match known.or_else(|| self.layer.slot(key)) {
            Some(slot) => slot,
            None if self.layer.len() >= self.config.max_blocks => return None,
            None => {
                self.layer.insert(key, Box::new(PlaneBlock::new(self.now)));
                self.layer.slot(key)?
            }
        };
        self.last = Some((key, slot));
        self.layer.at_mut(slot).map(|block| &mut **block)
    }

    /// The cell of a place; `None` where its coordinates are no numbers.
    #[must_use]
    pub fn cell_of(&self, place_m: &Point2<f64>) -> Option<[i32; 2]> {
        let [x, y] = (place_m.coords / self.config.edge_m).into();
        // The casts saturate.
        let cell = |value: f64| value.floor() as i32;
        (f64::is_finite(x) && f64::is_finite(y)).then(|| [cell(x), cell(y)])
    }

    /// What is known of a cell.
    #[must_use]
    pub fn state(&self, cell: [i32; 2]) -> CellState {
        let block = self.layer.get(BlockKey::of(VoxelKey { x: cell[0], y: cell[1], z: 0 }));
        block.and_then(|block| block.cells.get(index_of(cell))).map_or(CellState::Unknown, state_of)
    }

    /// Calls `visit` with each cell of which something is known, in a fixed order.
    pub fn for_each_known(&self, mut visit: impl FnMut([i32; 2], CellState)) {
        for key in self.layer.sorted_keys() {
            let Some(block) = self.layer.get(key) else { continue };
            for (index, cell) in block.cells.iter().enumerate() {
                let state = state_of(cell);
                if state != CellState::Unknown {
                    let VoxelKey { x, y, .. } = key.voxel(index);
                    visit([x, y], state);
                }
            }
        }
    }

    /// Forgets everything.
    pub fn clear(&mut self) {
        self.layer = Layer::default();
        self.ticks = Ticks::default();
        self.refused_cells = 0;
        self.last = None;
    }

    /// The parameters.
    #[must_use]
    pub fn config(&self) -> &PlaneConfig {
        &self.config
    }

    /// How many blocks there are.
    #[must_use]
    pub fn blocks(&self) -> usize {
        self.layer.len()
    }

    /// How often a cell was refused for want of a block.
    #[must_use]
    pub fn refused_cells(&self) -> u64 {
        self.refused_cells
    }

    /// The memory taken, in bytes.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        self.layer.len() * size_of::<PlaneBlock>() + self.layer.table_bytes()
    }
}

impl PlaneBlock {
    fn new(now: u32) -> Self {
        Self { cells: [Cell::default(); BLOCK_CELLS], first_seen: now }
    }
}

/// What is known of a cell of the plane.
fn state_of(cell: &Cell) -> CellState {
    cell.state_by(PASSES_PER_HIT)
}

/// The place of a cell within its block.
fn index_of(cell: [i32; 2]) -> usize {
    let [x, y] = cell.map(|along| along.rem_euclid(BLOCK_EDGE as i32) as usize);
    y * BLOCK_EDGE + x
}
