//! A map from above: where upright surfaces stand, and where there is floor with nothing upright on it.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{Point2, Point3};

use crate::saved_map::{Lie, PreparedMap};

/// The edge of a cell: an inner wall with both of its sides is one or two wide.
pub(crate) const CELL_M: f64 = 0.1;
/// The height of upright surface in a cell is counted in slices of this, up to a number: a wall counts more than a table, and as much
/// as a higher wall, of which a low camera sees no more.
const SLICE_M: f64 = 0.2;
const MOST_SLICES: usize = 8;
/// Beside an upright surface a cell counts so much: that of the other map may fall into the next one.
const BESIDE: f32 = 0.5;
/// Upright surface in a cell that is free counts so much against a place. Half: furniture moves, and doors open.
const AGAINST: f32 = -0.5;
/// Free is a cell with nothing upright within so many cells: two widths of a wall, by which the other map may be off before the
/// registration.
const CLEAR_CELLS: i32 = 2;
/// A map has no more cells from above than this: 160,000 m2. It bounds the memory.
const MOST_CELLS: usize = 16_000_000;
/// The widest windows of the pyramid are 2 to the power of this cells wide: 3.2 m, the size of a room.
pub(crate) const LEVELS: usize = 5;

/// A cell of the plan.
pub(crate) type Cell = [i32; 2];

/// The cell of a place.
pub(crate) fn cell_of(place_m: &Point2<f64>) -> Cell {
    [place_m.x, place_m.y].map(|along_m| (along_m / CELL_M).floor() as i32)
}

/// A map that is too wide for a plan.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct TooWide {
    pub(crate) extent_m: [f64; 2],
}

/// A map from above, in its level frame.
#[derive(Clone, Debug)]
pub(crate) struct Plan {
    /// What upright surface of another map counts in each cell; windows of 1, 2, 4, ... cells have the most of their cells, and begin at
    /// theirs.
    levels: Vec<Vec<f32>>,
    least: Cell,
    size: [usize; 2],
    /// The cells with floor and nothing upright in them or beside.
    free: BTreeSet<Cell>,
}

impl Plan {
    pub(crate) fn of(map: &PreparedMap) -> Result<Self, TooWide> {
        let upright = upright_cells(map.lying(Lie::Upright).map(|piece| piece.place_m));
        let level: BTreeSet<Cell> =
            map.lying(Lie::Level).map(|piece| cell_of(&piece.place_m.xy())).collect();
        let all = || upright.keys().chain(&level);
        let bound = |axis: usize| {
            let least = all().map(|cell| cell[axis]).min().unwrap_or(0);
            (least, all().map(|cell| cell[axis]).max().unwrap_or(0))
        };
        let bounds = [bound(0), bound(1)];
        // A window begins up to its width before what it reaches into.
        let border = 1 << LEVELS;
        let least = bounds.map(|(least, _)| least.saturating_sub(border));
        let size = bounds.map(|(least, most)| {
            (i64::from(most) - i64::from(least) + i64::from(border) + 2) as usize
        });
        if size[0].saturating_mul(size[1]) > MOST_CELLS {
            return Err(TooWide { extent_m: size.map(|cells| cells as f64 * CELL_M) });
        }
        let mut plan =
            Self { levels: vec![vec![0.0; size[0] * size[1]]], least, size, free: BTreeSet::new() };
        for cell in &level {
            if is_clear(&upright, cell, 1) {
                plan.free.insert(*cell);
            }
            if is_clear(&upright, cell, CLEAR_CELLS) {
                plan.raise(*cell, AGAINST);
            }
        }
        for (cell, weight) in &upright {
            for [dx, dy] in around(1) {
                let share = if [dx, dy] == [0, 0] { 1.0 } else { BESIDE };
                plan.raise([cell[0] + dx, cell[1] + dy], share * weight);
            }
        }
        for level in 0..LEVELS {
            plan.add_level(1 << level);
        }
        Ok(plan)
    }

    fn raise(&mut self, cell: Cell, to: f32) {
        if let Some(index) = self.index(cell) {
            let value = &mut self.levels[0][index];
            *value = if *value < 0.0 || to < 0.0 { to } else { value.max(to) };
        }
    }

    /// Windows of twice the width, from those of `half` cells that were added last.
    fn add_level(&mut self, half: i32) {
        let finer = self.levels.last().cloned().unwrap_or_default();
        let [width, height] = self.size;
        let at = |x: usize, y: usize| {
            if x < width && y < height { finer[y * width + x] } else { 0.0 }
        };
        let half = half as usize;
        let mut wider = Vec::with_capacity(finer.len());
        for y in 0..height {
            wider.extend((0..width).map(|x| {
                let upper = at(x, y + half).max(at(x + half, y + half));
                at(x, y).max(at(x + half, y)).max(upper)
            }));
        }
        self.levels.push(wider);
    }

    #[inline]
    fn index(&self, [x, y]: Cell) -> Option<usize> {
        let [x, y] = [x.wrapping_sub(self.least[0]), y.wrapping_sub(self.least[1])];
        let [width, height] = self.size;
        let is_within = (x as u32 as usize) < width && (y as u32 as usize) < height;
        is_within.then(|| y as u32 as usize * width + x as u32 as usize)
    }

    /// What upright surface counts in the window of this level that begins at a cell: 1 where a wall is, less than 0 where it is free.
    #[inline]
    pub(crate) fn count(&self, level: usize, cell: Cell) -> f32 {
        self.index(cell).map_or(0.0, |index| self.levels[level][index])
    }

    /// Whether floor is there, and nothing upright near it.
    pub(crate) fn is_free(&self, place_m: &Point3<f64>) -> bool {
        self.free.contains(&cell_of(&place_m.xy()))
    }

    /// The first cells along both axes that are no border, and those behind the last ones.
    pub(crate) fn bounds(&self) -> [[i32; 2]; 2] {
        let border = 1 << LEVELS;
        [0, 1].map(|axis| [self.least[axis] + border, self.least[axis] + self.size[axis] as i32])
    }
}

/// The cells with upright surface, and how much of a wall each is: from 0 to 1.
pub(crate) fn upright_cells(places_m: impl Iterator<Item = Point3<f64>>) -> BTreeMap<Cell, f32> {
    let mut slices: Vec<(Cell, i32)> = places_m
        .map(|place_m| (cell_of(&place_m.xy()), (place_m.z / SLICE_M).floor() as i32))
        .collect();
    slices.sort_unstable();
    slices.dedup();
    let of_cell = |slices: &[(Cell, i32)]| {
        (slices[0].0, slices.len().min(MOST_SLICES) as f32 / MOST_SLICES as f32)
    };
    slices.chunk_by(|a, b| a.0 == b.0).map(of_cell).collect()
}

fn is_clear(upright: &BTreeMap<Cell, f32>, [x, y]: &Cell, cells: i32) -> bool {
    around(cells).all(|[dx, dy]| !upright.contains_key(&[x + dx, y + dy]))
}

/// The steps to the cells within so many cells, and none.
fn around(cells: i32) -> impl Iterator<Item = Cell> {
    (-cells..=cells).flat_map(move |dy| (-cells..=cells).map(move |dx| [dx, dy]))
}
