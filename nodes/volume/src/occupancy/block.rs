//! The cells of a block: one for all where they are the same, or one each.

use crate::block::BLOCK_VOXELS;
use crate::cell::Cell;

/// Voxels as bits.
pub(super) type Bits = [u64; BLOCK_VOXELS / 64];

/// A block.
#[derive(Clone, Debug, Default)]
pub(super) struct OccupancyBlock {
    cells: Cells,
    /// The voxels that the image with the number `image` hit.
    hits: Bits,
    image: u32,
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

    /// A point of this image is in a voxel. Returns whether it is the first one in this block.
    pub(super) fn mark_hit(&mut self, index: usize, image: u32) -> bool {
        let is_first = self.image != image;
        if is_first {
            (self.hits, self.image, self.seen_by) = (Bits::default(), image, image);
        }
        if let Some(bits) = self.hits.get_mut(index / 64) {
            *bits |= 1 << (index % 64);
        }
        is_first
    }

    /// Adds the hits of this image to the evidence.
    pub(super) fn join_hits(&mut self, image: u32, now: u32) {
        if self.image == image {
            let hits = self.hits;
            self.for_each_of(&hits, |cell| cell.hit(now));
        }
    }

    /// All voxels were free, except those that were hit.
    pub(super) fn pass_all(&mut self, image: u32, now: u32) {
        if self.image == image {
            return self.pass(&[u64::MAX; BLOCK_VOXELS / 64], image, now);
        }
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
        let mut free = *voxels;
        if self.image == image {
            free.iter_mut().zip(self.hits).for_each(|(free, hits)| *free &= !hits);
        }
        if free != Bits::default() {
            self.seen_by = image;
            self.for_each_of(&free, |cell| cell.pass(now));
        }
    }

    fn for_each_of(&mut self, voxels: &Bits, mut change: impl FnMut(&mut Cell)) {
        let cells = self.each();
        for (cells, bits) in cells.chunks_exact_mut(64).zip(voxels) {
            let mut bits = *bits;
            while bits != 0 {
                if let Some(cell) = cells.get_mut(bits.trailing_zeros() as usize) {
                    change(cell);
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
