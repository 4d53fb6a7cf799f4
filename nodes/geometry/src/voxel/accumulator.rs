//! Voxel means built up point by point.

use nalgebra::Point3;

use super::{VoxelGrid, VoxelKey, order::ranks};
use crate::point_block::{BlockKeys, PointBlock};

/// Slots of a new table.
const FIRST_SLOTS: usize = 1 << 12;
/// A table has at least this many slots for each occupied cell: most cells are found at once.
const SLOTS_PER_CELL: usize = 3;

/// Low bits of each coordinate of a key by which its cell is looked for first: 128 kB of places, and no two of the same place
/// within 32 cells along each axis.
const RECENT_BITS: u32 = 5;

/// The points of one occupied cell: the sums of their coordinates in metres, and their number, which is exact up to 2^53. In one
/// array, since the processor then adds a point in one or two instructions.
#[derive(Clone, Copy, Debug, Default)]
struct Cell([f64; 4]);

impl Cell {
    #[inline]
    fn add(&mut self, [x, y, z]: [f32; 3]) {
        for (sum, value) in self.0.iter_mut().zip([x, y, z, 1.0]) {
            *sum += f64::from(value);
        }
    }

    /// How many there are; no image has more than a count of 32 bits holds.
    fn count(&self) -> u32 {
        self.0[3] as u32
    }

    fn mean(&self) -> Point3<f32> {
        let Self([x, y, z, points]) = *self;
        Point3::from([x, y, z].map(|sum_m| (sum_m / points) as f32))
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
    /// The index of a cell that was found at this place; see [`BlockKeys::places`](crate::point_block::BlockKeys::places).
    /// Whether it is the cell looked for, its key tells.
    recent: Vec<u32>,
    points: u64,
}

impl VoxelAccumulator {
    /// An empty accumulator over `grid`.
    #[must_use]
    pub fn new(grid: VoxelGrid) -> Self {
        let slots = vec![Slot::default(); FIRST_SLOTS];
        let recent = vec![0; 1 << (3 * RECENT_BITS)];
        Self { grid, cells: Vec::new(), keys: Vec::new(), slots, recent, points: 0 }
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

    /// The keys of the occupied cells, in the order in which these were first occupied.
    pub(crate) fn keys(&self) -> &[VoxelKey] {
        &self.keys
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
        let (mut block, mut keys) = (PointBlock::default(), BlockKeys::default());
        for chunk in points_m.chunks(PointBlock::CAPACITY) {
            block.load(chunk);
            self.push_block(&block, &mut keys, |_, _| {});
        }
    }

    /// Takes the finite points of a block in order. `note` is called with the place of each and the number of its cell among
    /// [`keys`](Self::keys); the keys of the block are computed into `keys`.
    #[inline]
    pub(crate) fn push_block(
        &mut self,
        block: &PointBlock,
        keys: &mut BlockKeys,
        mut note: impl FnMut(usize, u32),
    ) {
        block.find_keys(self.grid.edge_m(), keys);
        let finite = block.finite_places();
        let recent = keys.places::<RECENT_BITS>();
        let mut points = 0;
        for place in (0..block.len.min(PointBlock::CAPACITY)).filter(|place| finite[*place]) {
            let (key, recent) = (keys.at(place), recent[place] as usize);
            // Neighbouring points are in a few cells by turns, in an order that no processor foretells. Most are found here, by
            // a comparison that it does foretell, whichever of them it is.
            let mut index = self.recent[recent] as usize;
            if self.keys.get(index) != Some(&key) {
                index = self.cell_of(key);
                self.recent[recent] = index as u32;
            }
            if let Some(cell) = self.cells.get_mut(index) {
                cell.add([block.x_m[place], block.y_m[place], block.z_m[place]]);
                note(place, index as u32);
                points += 1;
            }
        }
        self.points += points;
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
