//! Voxel means built up point by point.

use nalgebra::Point3;

use super::{VoxelGrid, VoxelKey, order::ranks};
use crate::point_block::PointBlock;

/// Slots of a new table.
const FIRST_SLOTS: usize = 1 << 12;
/// A table has at least this many slots for each occupied cell: most cells are found at once.
const SLOTS_PER_CELL: usize = 3;

/// The points of one occupied cell.
#[derive(Clone, Copy, Debug, Default)]
struct Cell {
    sum_m: [f64; 3],
    points: u64,
}

impl Cell {
    #[inline]
    fn add(&mut self, [x, y, z]: [f32; 3]) {
        self.sum_m[0] += f64::from(x);
        self.sum_m[1] += f64::from(y);
        self.sum_m[2] += f64::from(z);
        self.points += 1;
    }

    /// How many there are; no image has more than a count of 32 bits holds.
    fn count(&self) -> u32 {
        u32::try_from(self.points).unwrap_or(u32::MAX)
    }

    fn mean(&self) -> Point3<f32> {
        let points = self.points as f64;
        Point3::from(self.sum_m.map(|sum_m| (sum_m / points) as f32))
    }
}

/// Where the cell of a key is found.
#[derive(Clone, Copy, Debug, Default)]
struct Slot {
    key: VoxelKey,
    /// Index of the cell plus one; 0 for an empty slot.
    number: u32,
}

/// Collects points into the cells of a grid, then gives the mean of each (Rec-HV 3.2.3).
///
/// Points may come one at a time, so a depth image is reduced without a cloud of its 307,200 points
/// ever existing. The table is kept from one frame to the next; it takes memory by the number of
/// cells of the fullest frame, some 200 bytes each at most, whatever the volume they span. It holds
/// 2^32 - 1 cells; points of further ones are left out.
#[derive(Clone, Debug)]
pub struct VoxelAccumulator {
    grid: VoxelGrid,
    /// The occupied cells and their keys, in the order in which they were first occupied.
    cells: Vec<Cell>,
    keys: Vec<VoxelKey>,
    /// Open addressing over `cells`; its length is a power of two.
    slots: Vec<Slot>,
    points: u64,
}

impl VoxelAccumulator {
    /// An empty accumulator over `grid`.
    #[must_use]
    pub fn new(grid: VoxelGrid) -> Self {
        let slots = vec![Slot::default(); FIRST_SLOTS];
        Self { grid, cells: Vec::new(), keys: Vec::new(), slots, points: 0 }
    }

    /// The grid that the points are collected into.
    #[must_use]
    pub fn grid(&self) -> VoxelGrid {
        self.grid
    }

    /// Points taken since the last [`finish`](Self::finish); those left out do not count.
    #[must_use]
    pub fn points(&self) -> u64 {
        self.points
    }

    /// Cells occupied so far.
    #[must_use]
    pub fn occupied_cells(&self) -> usize {
        self.cells.len()
    }

    /// Takes a point; leaves it out if a coordinate is not finite.
    pub fn push(&mut self, point_m: &Point3<f32>) {
        if crate::is_finite(point_m) {
            let index = self.cell_of(self.grid.key(point_m));
            if let Some(cell) = self.cells.get_mut(index) {
                cell.add([point_m.x, point_m.y, point_m.z]);
                self.points += 1;
            }
        }
    }

    /// Takes points in order; leaves out those with a coordinate that is not finite.
    pub fn push_all(&mut self, points_m: &[Point3<f32>]) {
        let mut block = PointBlock::default();
        for chunk in points_m.chunks(PointBlock::CAPACITY) {
            block.load(chunk);
            self.push_block(&block);
        }
    }

    /// Takes the finite points of a block in order.
    pub(crate) fn push_block(&mut self, block: &PointBlock) {
        let keys = block.keys(self.grid.edge_m());
        let finite = block.finite_places();
        // Neighbouring pixels mostly share a cell. Its sums are held here, where the processor need
        // not wait for one addition to reach memory and return before the next.
        let (mut open, mut open_key, mut open_index) = (Cell::default(), VoxelKey::default(), 0);
        let mut points = 0;
        let places = finite.iter().take(block.len).enumerate();
        for (place, _) in places.filter(|(_, is_finite)| **is_finite) {
            let key = keys.at(place);
            if key != open_key || open.points == 0 {
                self.close(open_index, open);
                open_index = self.cell_of(key);
                open_key = key;
                open = self.cells.get(open_index).copied().unwrap_or_default();
            }
            open.add([block.x_m[place], block.y_m[place], block.z_m[place]]);
            points += 1;
        }
        self.close(open_index, open);
        self.points += points;
    }

    /// Puts back a cell that points were added to.
    fn close(&mut self, index: usize, cell: Cell) {
        if let Some(place) = self.cells.get_mut(index).filter(|_| cell.points > 0) {
            *place = cell;
        }
    }

    /// The mean of the points of each occupied cell, in ascending order of the cells' keys. Leaves
    /// the accumulator empty, ready for the next frame.
    #[must_use]
    pub fn finish(&mut self) -> Vec<Point3<f32>> {
        self.finish_counted().0
    }

    /// The same, and how many points each of them is the mean of.
    #[must_use]
    pub fn finish_counted(&mut self) -> (Vec<Point3<f32>>, Vec<u32>) {
        let mut means_m = vec![Point3::origin(); self.cells.len()];
        let mut counts = vec![0; self.cells.len()];
        for (cell, rank) in self.cells.iter().zip(ranks(&self.keys)) {
            means_m[rank as usize] = cell.mean();
            counts[rank as usize] = cell.count();
        }
        self.clear();
        (means_m, counts)
    }

    /// Forgets the points taken so far, and keeps the memory.
    pub fn clear(&mut self) {
        self.cells.clear();
        self.keys.clear();
        self.slots.fill(Slot::default());
        self.points = 0;
    }

    /// The index of the cell of `key`, which is made if it is not there; an index beyond the cells
    /// where there is no room for another.
    #[inline]
    fn cell_of(&mut self, key: VoxelKey) -> usize {
        let last_slot = self.slots.len() - 1;
        let mut slot = key.spread() as usize & last_slot;
        // Ends: more than half of the slots are empty.
        loop {
            let Slot { key: occupant, number } = self.slots[slot & last_slot];
            if number == 0 {
                return self.new_cell(key, slot);
            }
            if occupant == key {
                return number as usize - 1;
            }
            slot = (slot + 1) & last_slot;
        }
    }

    #[cold]
    #[inline(never)]
    fn new_cell(&mut self, key: VoxelKey, slot: usize) -> usize {
        let index = self.cells.len();
        // Two hundred gigabytes of cells come before this.
        let Ok(number) = u32::try_from(index + 1) else { return usize::MAX };
        self.cells.push(Cell::default());
        self.keys.push(key);
        self.slots[slot] = Slot { key, number };
        if self.cells.len() * SLOTS_PER_CELL > self.slots.len() {
            self.grow();
        }
        index
    }

    fn grow(&mut self) {
        let last_slot = self.slots.len() * 2 - 1;
        self.slots = vec![Slot::default(); last_slot + 1];
        for (number, &key) in (1..).zip(&self.keys) {
            let mut slot = key.spread() as usize & last_slot;
            while self.slots[slot].number != 0 {
                slot = (slot + 1) & last_slot;
            }
            self.slots[slot] = Slot { key, number };
        }
    }
}
