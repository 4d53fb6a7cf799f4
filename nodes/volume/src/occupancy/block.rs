//! The cells of a block: one for all where they are the same, or one each.

use std::ops::Range;

use crate::block::{BLOCK_EDGE, BLOCK_VOXELS};
use crate::cell::Cell;

/// Voxels as bits.
pub(super) type Bits = [u64; BLOCK_VOXELS / 64];

/// A block.
#[derive(Clone, Debug, Default)]
pub(super) struct OccupancyBlock {
    cells: Cells,
    /// The number of the latest image that had it in view.
    pub(super) seen_by: u32,
}

#[derive(Clone, Debug)]
enum Cells {
    Same(Cell),
    Each(Box<[Cell; BLOCK_VOXELS]>),
}

impl Default for Cells {
    fn default() -> Self {
        Self::Same(Cell::default())
    }
}

impl OccupancyBlock {
    #[inline]
    pub(super) fn cell(&self, index: usize) -> Cell {
        match &self.cells {
            Cells::Same(cell) => *cell,
            Cells::Each(cells) => cells.get(index).copied().unwrap_or_default(),
        }
    }

    /// Whether some cell at these indices along x, y and z is such, but for the one at `own`. There are others than that.
    pub(super) fn has_beside(
        &self,
        [xs, ys, zs]: [Range<usize>; 3],
        own: Option<usize>,
        is_such: impl Fn(&Cell) -> bool,
    ) -> bool {
        let cells = match &self.cells {
            Cells::Same(cell) => return is_such(cell),
            Cells::Each(cells) => cells,
        };
        let mut rows = zs.flat_map(|z| ys.clone().map(move |y| (z * BLOCK_EDGE + y) * BLOCK_EDGE));
        rows.any(|row| {
            let indices = row + xs.start..row + xs.end;
            let cells = cells.get(indices.clone()).unwrap_or_default();
            cells.iter().zip(indices).any(|(cell, index)| is_such(cell) && Some(index) != own)
        })
    }

    /// An index beyond the last is the last.
    pub(super) fn cell_mut(&mut self, index: usize) -> &mut Cell {
        &mut self.each()[index.min(BLOCK_VOXELS - 1)]
    }

    fn each(&mut self) -> &mut [Cell; BLOCK_VOXELS] {
        loop {
            match self.cells {
                Cells::Same(cell) => self.cells = Cells::Each(Box::new([cell; BLOCK_VOXELS])),
                Cells::Each(ref mut cells) => break cells,
            }
        }
    }

    /// A voxel was hit.
    pub(super) fn hit(&mut self, index: usize, image: u32, now: u32) {
        self.seen_by = image;
        self.cell_mut(index).hit(now);
    }

    /// All voxels were free, except those that were hit.
    pub(super) fn pass_all(&mut self, image: u32, now: u32) {
        self.seen_by = image;
        match &mut self.cells {
            Cells::Same(cell) => cell.pass(now),
            Cells::Each(cells) => {
                cells.iter_mut().for_each(|cell| cell.pass(now));
                if cells.iter().all(Cell::is_free_for_long) {
                    let [first, ..] = **cells;
                    self.cells = Cells::Same(cells.iter().copied().fold(first, Cell::merged));
                }
            }
        }
    }

    /// Some voxels were free, except those that were hit.
    pub(super) fn pass(&mut self, voxels: &Bits, image: u32, now: u32) {
        self.seen_by = image;
        for (cells, bits) in self.each().chunks_exact_mut(64).zip(voxels) {
            let mut bits = *bits;
            while bits != 0 {
                if let Some(cell) = cells.get_mut(bits.trailing_zeros() as usize) {
                    cell.pass(now);
                }
                bits &= bits - 1;
            }
        }
    }

    /// The memory outside of the struct itself, in bytes.
    pub(super) fn cells_bytes(&self) -> usize {
        match &self.cells {
            Cells::Same(_) => 0,
            Cells::Each(cells) => size_of_val(&**cells),
        }
    }
}
