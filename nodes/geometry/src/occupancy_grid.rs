//! A floor plan in cells: free, occupied or unknown, as navigation uses it.

mod map_files;
#[cfg(test)]
mod tests;

use nalgebra::Point2;

use crate::Stamp;
pub use map_files::{FREE_THRESHOLD, OCCUPIED_THRESHOLD};

/// A grid that holds two others has at most so many times their cells.
const MOST_TIMES_WIDER: usize = 4;

/// What is known of a cell.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum GridCell {
    /// Nothing, or not enough.
    #[default]
    Unknown,
    /// Nothing is there.
    Free,
    /// Something static is there.
    Occupied,
}

/// Cells of a part of the map's xy plane. They are aligned to the resolution: cell `[x, y]` reaches from
/// `[x, y] * resolution_m` to `[x + 1, y + 1] * resolution_m`, whatever part of the plane a grid has.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct OccupancyGrid {
    /// The moment that it is of.
    pub stamp: Stamp,
    /// The frame of the map; z is up.
    pub frame_id: String,
    /// The edge of a cell.
    pub resolution_m: f64,
    /// The cell of least x and y.
    pub least: [i32; 2],
    /// Cells along x.
    pub width: usize,
    /// Cells along y.
    pub height: usize,
    /// The cells, row by row: along x, from the row of least y on.
    pub cells: Vec<GridCell>,
}

/// A part of a grid, in cells from its [`OccupancyGrid::least`] on.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct GridPart {
    /// The first column.
    pub x: usize,
    /// The first row.
    pub y: usize,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
}

impl OccupancyGrid {
    /// The corner of least x and y.
    #[must_use]
    pub fn origin_m(&self) -> Point2<f64> {
        Point2::from(self.least.map(|cell| f64::from(cell) * self.resolution_m))
    }

    /// What is known of a cell; unknown outside of the grid.
    #[must_use]
    pub fn at(&self, cell: [i32; 2]) -> GridCell {
        self.index(cell).and_then(|index| self.cells.get(index)).copied().unwrap_or_default()
    }

    /// The place of a cell among [`Self::cells`]; `None` outside of the grid.
    #[must_use]
    pub fn index(&self, cell: [i32; 2]) -> Option<usize> {
        let along = |axis: usize, size: usize| {
            let offset = i64::from(cell[axis]) - i64::from(self.least[axis]);
            usize::try_from(offset).ok().filter(|offset| *offset < size)
        };
        Some(along(1, self.height)? * self.width + along(0, self.width)?)
    }

    /// How many cells are so.
    #[must_use]
    pub fn count(&self, state: GridCell) -> usize {
        self.cells.iter().filter(|cell| **cell == state).count()
    }

    /// The same with more unknown cells around, so that it has all those of another one with the same resolution. One that is so far
    /// away that most cells would be between them is left out.
    #[must_use]
    pub fn widened_to(self, other: &Self) -> Self {
        let end = |grid: &Self| {
            [(0, grid.width), (1, grid.height)]
                .map(|(axis, size)| i64::from(grid.least[axis]) + size as i64)
        };
        let least = [0, 1].map(|axis| self.least[axis].min(other.least[axis]));
        let [width, height] = [0, 1].map(|axis| {
            let end = end(&self)[axis].max(end(other)[axis]);
            usize::try_from(end - i64::from(least[axis])).unwrap_or(0)
        });
        let is_far = width.saturating_mul(height) / MOST_TIMES_WIDER
            > self.cells.len().saturating_add(other.cells.len());
        if is_far || (least, width, height) == (self.least, self.width, self.height) {
            return self;
        }
        let cells = vec![GridCell::Unknown; width * height];
        let mut wider = Self { least, width, height, cells, ..self.clone() };
        for (y, row) in (self.least[1]..).zip(self.cells.chunks(self.width.max(1))) {
            let first = wider.index([self.least[0], y]);
            let place = first.and_then(|first| wider.cells.get_mut(first..first + row.len()));
            if let Some(place) = place {
                place.copy_from_slice(row);
            }
        }
        wider
    }

    /// Whether another grid has the same cells, whatever is known of them.
    #[must_use]
    pub fn is_same_part(&self, other: &Self) -> bool {
        let part = |grid: &Self| (grid.least, grid.width, grid.height, grid.resolution_m.to_bits());
        part(self) == part(other) && self.frame_id == other.frame_id
    }

    /// The smallest part that holds all cells that differ from another grid's of the same cells; `None` where none does.
    #[must_use]
    pub fn changed_since(&self, other: &Self) -> Option<GridPart> {
        let width = self.width.max(1);
        let mut part: Option<[usize; 4]> = None;
        for (y, (own, before)) in
            self.cells.chunks(width).zip(other.cells.chunks(width)).enumerate()
        {
            let differs = |x: &usize| own.get(*x) != before.get(*x);
            let Some(first) = (0..own.len()).find(differs) else { continue };
            let last = (0..own.len()).rfind(differs).unwrap_or(first);
            part = Some(match part {
                None => [first, y, last, y],
                Some([x, top, to, _]) => [x.min(first), top, to.max(last), y],
            });
        }
        part.map(|[x, y, to_x, to_y]| GridPart { x, y, width: to_x - x + 1, height: to_y - y + 1 })
    }

    /// The cells of a part, row by row.
    #[must_use]
    pub fn cells_of(&self, part: GridPart) -> Vec<GridCell> {
        let row = |y: usize| {
            let from = y.saturating_mul(self.width).saturating_add(part.x);
            self.cells.get(from..from.saturating_add(part.width)).unwrap_or_default()
        };
        let last = part.y.saturating_add(part.height).min(self.height);
        (part.y..last).flat_map(row).copied().collect()
    }
}
