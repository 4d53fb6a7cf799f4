//! Square cells of the map's plane around the platform, in a window that moves with it.

use nalgebra::{Point2, Point3};
use volume::Cell;

/// A cell's place in the map's plane, in cells from the origin.
pub(super) type CellKey = [i64; 2];

/// That a cell is free is known of one height: this much higher or lower there may be a table. Beams of a platform that pitches by 3
/// degrees are as far from level at 2 m.
const LEVEL_M: f64 = 0.1;

/// The cells of a square window. A cell of the map has one place in memory, whatever the window; the
/// cells that come into the window take the places of those that leave it.
#[derive(Clone, Debug)]
pub(super) struct RollingGrid {
    edge_m: f64,
    cells_per_m: f64,
    side: i64,
    /// The cell in the window's lower corner.
    corner: CellKey,
    /// The corner's place in memory along each axis.
    corner_place: CellKey,
    /// Evidence that was not renewed for this long is forgotten.
    memory_ms: u32,
    cells: Vec<Cell>,
    /// At which height each cell was seen last, in the map.
    heights_m: Vec<f32>,
}

impl RollingGrid {
    /// An empty window of `side` cells of `edge_m` each way; both are positive.
    pub(super) fn new(edge_m: f64, side: usize, memory_ms: u32) -> Self {
        Self {
            edge_m,
            cells_per_m: 1.0 / edge_m,
            side: side as i64,
            corner: [0, 0],
            corner_place: [0, 0],
            memory_ms,
            cells: vec![Cell::default(); side * side],
            heights_m: vec![0.0; side * side],
        }
    }

    pub(super) fn clear(&mut self) {
        self.cells.fill(Cell::default());
    }

    pub(super) fn edge_m(&self) -> f64 {
        self.edge_m
    }

    #[inline]
    pub(super) fn key_of(&self, point_m: &Point2<f64>) -> CellKey {
        [point_m.x, point_m.y].map(|along_m| {
            // `floor` without the call that some targets make of it. The cast saturates, and turns NaN to 0:
            // no number gets past the check of the window.
            let along = along_m * self.cells_per_m;
            let toward_zero = along as i64;
            toward_zero.saturating_sub(i64::from(along < toward_zero as f64))
        })
    }

    /// Moves the window so that `center_m` is in its middle.
    pub(super) fn center_on(&mut self, center_m: &Point2<f64>) {
        let corner = self.key_of(center_m).map(|key| key.saturating_sub(self.side / 2));
        let moved = [0, 1].map(|axis| corner[axis].saturating_sub(self.corner[axis]));
        let before = self.corner;
        self.corner = corner;
        self.corner_place = corner.map(|key| key.rem_euclid(self.side));
        if moved.iter().any(|cells| cells.saturating_abs() >= self.side) {
            return self.clear();
        }
        for axis in [0, 1] {
            // The new lines: after the old window if it moved up, before it otherwise.
            let new_lines = if moved[axis] > 0 {
                before[axis] + self.side..corner[axis] + self.side
            } else {
                corner[axis]..before[axis]
            };
            for line in new_lines {
                let line = line.rem_euclid(self.side);
                for other in 0..self.side {
                    let place = if axis == 0 { [line, other] } else { [other, line] };
                    self.cells[(place[1] * self.side + place[0]) as usize] = Cell::default();
                }
            }
        }
    }

    #[inline]
    fn place(&self, key: CellKey) -> Option<usize> {
        let mut place = [0, 0];
        for axis in [0, 1] {
            let from_corner = key[axis].saturating_sub(self.corner[axis]);
            if !(0..self.side).contains(&from_corner) {
                return None;
            }
            // The same as the key modulo the side, without a division for each cell.
            let along = self.corner_place[axis] + from_corner;
            place[axis] = if along >= self.side { along - self.side } else { along };
        }
        Some((place[1] * self.side + place[0]) as usize)
    }

    /// The evidence on a cell; none outside of the window.
    #[inline]
    pub(super) fn cell(&self, key: CellKey, now_ms: u32) -> Cell {
        let mut cell = self.place(key).map_or_else(Cell::default, |place| self.cells[place]);
        cell.forget_after(self.memory_ms, now_ms);
        cell
    }

    /// The same, where the cell was seen last at this height; none where it was at another one.
    #[inline]
    pub(super) fn cell_at_height(&self, key: CellKey, height_m: f64, now_ms: u32) -> Cell {
        let is_level = self.place(key).is_some_and(|place| self.is_level(place, height_m));
        if is_level { self.cell(key, now_ms) } else { Cell::default() }
    }

    /// The evidence on the cell of a place in the window, to be renewed. That it was free at another height
    /// is forgotten; background stays background.
    #[inline(always)]
    pub(super) fn cell_mut(&mut self, place_m: &Point3<f64>, now_ms: u32) -> Option<&mut Cell> {
        let place = self.place(self.key_of(&place_m.xy()))?;
        if !self.is_level(place, place_m.z) && self.cells[place].hits() == 0 {
            self.cells[place] = Cell::default();
        }
        self.heights_m[place] = place_m.z as f32;
        let cell = &mut self.cells[place];
        cell.forget_after(self.memory_ms, now_ms);
        Some(cell)
    }

    #[inline]
    fn is_level(&self, place: usize, height_m: f64) -> bool {
        (f64::from(self.heights_m[place]) - height_m).abs() <= LEVEL_M
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn places_far_away_or_not_finite_are_outside() {
        let mut grid = RollingGrid::new(0.05, 16, 10);
        for far in [1e300, -1e300, f64::INFINITY, f64::NEG_INFINITY] {
            let key = grid.key_of(&Point2::new(far, 0.0));
            assert!(grid.cell(key, 1) == Cell::default());
            assert!(grid.cell_mut(&Point3::new(far, 0.0, 0.0), 1).is_none());
            grid.center_on(&Point2::new(far, far));
            grid.center_on(&Point2::origin());
        }
        grid.center_on(&Point2::new(f64::NAN, 0.0));
    }

    proptest! {
        /// What stays in the window is kept, what leaves it is forgotten.
        #[test]
        fn it_keeps_what_stays_and_forgets_what_leaves(
            centers in prop::collection::vec((-40i64..40, -40i64..40), 1..8),
            marked in (-20i64..20, -20i64..20),
        ) {
            let mut grid = RollingGrid::new(1.0, 16, 10);
            let key = [marked.0, marked.1];
            let middle_m = Point2::new(marked.0 as f64 + 0.5, marked.1 as f64 + 0.5);
            grid.center_on(&middle_m);
            grid.cell_mut(&Point3::new(middle_m.x, middle_m.y, 0.0), 1).unwrap().pass(1);
            let mut stayed = true;
            for (x, y) in centers {
                grid.center_on(&Point2::new(x as f64 + 0.5, y as f64 + 0.5));
                stayed &= grid.place(key).is_some();
                let passes: u8 = grid.cells.iter().map(Cell::passes).sum();
                prop_assert_eq!(passes, u8::from(stayed));
                prop_assert_eq!(grid.cell(key, 1).passes(), u8::from(stayed));
            }
        }
    }
}
