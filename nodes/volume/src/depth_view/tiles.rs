//! The least and greatest depth of any rectangle of the image: a pyramid over tiles of pixels, with windows at each tile.
//!
//! Each level holds, for each tile, the extremes of the square of `2^level` tiles that begins there, so that a rectangle
//! is the union of a few overlapping squares, and no tile outside of it is used (the sparse table of range minimum queries:
//! Bender and Farach-Colton, "The LCA problem revisited", 2000, section 3).

use std::ops::Range;

use multiversion::multiversion;

/// Pixels along a tile's edge, in an image of up to [`MOST_TILES`] tiles: a power of two.
const TILE_PX: usize = 4;
/// The maximum number of tiles: in a larger image a tile has more pixels.
const MOST_TILES: usize = 40_000;

/// The extremes of a rectangle.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct DepthSpan {
    /// Space is free up to this depth in the whole rectangle; 0 where that is not known for all of it.
    pub(crate) free_to_m: f32,
    /// Beyond this depth all of it is unknown; 0 where there is no return at all.
    pub(crate) known_to_m: f32,
}

/// The pyramid.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tiles {
    tile_px: usize,
    columns: usize,
    rows: usize,
    /// For each level, the least depth; 0 for tiles mostly without returns.
    least_m: Vec<Vec<f32>>,
    /// For each level, the greatest depth; 0 without returns.
    most_m: Vec<Vec<f32>>,
    scratch: OfColumns,
}

/// The extremes of each column of pixels within a row of tiles.
#[derive(Clone, Debug, Default)]
struct OfColumns {
    least_m: Vec<f32>,
    most_m: Vec<f32>,
    /// How many pixels have a return.
    returns: Vec<f32>,
}

impl OfColumns {
    fn resize(&mut self, width_px: usize) {
        for values in [&mut self.least_m, &mut self.most_m, &mut self.returns] {
            values.resize(width_px, 0.0);
        }
    }

    fn clear(&mut self) {
        self.least_m.fill(f32::MAX);
        self.most_m.fill(0.0);
        self.returns.fill(0.0);
    }

    fn join(&mut self, line_m: &[f32]) {
        join_line(line_m, &mut self.least_m, &mut self.most_m, &mut self.returns);
    }

    /// A few pixels without a return among others are noise; where most have none, there may be a surface that returns nothing.
    fn reduce(&self, tile_px: usize, lines: usize, least_m: &mut [f32], most_m: &mut [f32]) {
        let columns = self.least_m.chunks(tile_px).zip(self.most_m.chunks(tile_px));
        let columns = columns.zip(self.returns.chunks(tile_px));
        for ((((least_of, most_of), returns), least_m), most_m) in
            columns.zip(least_m.iter_mut()).zip(most_m.iter_mut())
        {
            let pixels = (returns.len() * lines) as f32;
            let least = least_of.iter().copied().fold(f32::MAX, f32::min);
            *least_m = if 2.0 * returns.iter().sum::<f32>() < pixels { 0.0 } else { least };
            *most_m = most_of.iter().copied().fold(0.0, f32::max);
        }
    }
}

#[multiversion(targets("x86_64+avx2"))]
fn join_line(line_m: &[f32], least_m: &mut [f32], most_m: &mut [f32], returns: &mut [f32]) {
    let kept = least_m.iter_mut().zip(most_m).zip(returns);
    for (depth_m, ((least_m, most_m), returns)) in line_m.iter().zip(kept) {
        let depth_m = depth_m.abs();
        let is_seen = depth_m > 0.0;
        let least = if is_seen { depth_m } else { f32::MAX };
        *returns += if is_seen { 1.0 } else { 0.0 };
        *least_m = if least < *least_m { least } else { *least_m };
        *most_m = if depth_m > *most_m { depth_m } else { *most_m };
    }
}

impl Tiles {
    pub(crate) fn refill(&mut self, depths_m: &[f32], width_px: usize, height_px: usize) {
        self.tile_px = TILE_PX;
        while width_px.div_ceil(self.tile_px) * height_px.div_ceil(self.tile_px) > MOST_TILES {
            self.tile_px *= 2;
        }
        self.columns = width_px.div_ceil(self.tile_px);
        self.rows = height_px.div_ceil(self.tile_px);
        let levels = self.columns.min(self.rows).max(1).ilog2() as usize + 1;
        let tiles = self.columns * self.rows;
        for images in [&mut self.least_m, &mut self.most_m] {
            images.resize(levels, Vec::new());
            for image in images.iter_mut() {
                image.resize(tiles, 0.0);
            }
        }
        self.fill_tiles(depths_m, width_px, height_px);
        for level in 1..levels {
            let reach = 1 << (level - 1);
            grow(&mut self.least_m, level, self.columns, reach, |a, b| if a < b { a } else { b });
            grow(&mut self.most_m, level, self.columns, reach, |a, b| if a > b { a } else { b });
        }
    }

    fn fill_tiles(&mut self, depths_m: &[f32], width_px: usize, height_px: usize) {
        let (Some(least_m), Some(most_m)) = (self.least_m.first_mut(), self.most_m.first_mut())
        else {
            return;
        };
        let tile_px = self.tile_px;
        self.scratch.resize(width_px);
        let tiles =
            least_m.chunks_exact_mut(self.columns).zip(most_m.chunks_exact_mut(self.columns));
        for (row, (least_m, most_m)) in tiles.enumerate() {
            let lines = row * tile_px..height_px.min((row + 1) * tile_px);
            self.scratch.clear();
            for line in lines.clone() {
                let line_m = depths_m.get(line * width_px..(line + 1) * width_px);
                self.scratch.join(line_m.unwrap_or_default());
            }
            self.scratch.reduce(tile_px, lines.len(), least_m, most_m);
        }
    }

    /// The extremes of the tiles that hold these columns and rows, first and last.
    #[inline]
    pub(crate) fn span(&self, columns: [u32; 2], rows: [u32; 2]) -> DepthSpan {
        // A shift: a division would take longer than the rest of the function.
        let shift = self.tile_px.trailing_zeros();
        let tile = |pixel: u32, tiles: usize| ((pixel >> shift) as usize).min(tiles - 1);
        let [left, right] = columns.map(|pixel| tile(pixel, self.columns));
        let [top, bottom] = rows.map(|pixel| tile(pixel, self.rows));
        let side = (right - left).min(bottom - top) + 1;
        let level = (side.ilog2() as usize).min(self.least_m.len() - 1);
        let window = 1 << level;
        let (least_m, most_m) = (&self.least_m[level], &self.most_m[level]);
        let mut span = DepthSpan { free_to_m: f32::MAX, known_to_m: 0.0 };
        let mut row = top;
        loop {
            let row_here = row.min(bottom + 1 - window);
            let mut column = left;
            loop {
                let column_here = column.min(right + 1 - window);
                let index = row_here * self.columns + column_here;
                span.free_to_m = span.free_to_m.min(least_m[index]);
                span.known_to_m = span.known_to_m.max(most_m[index]);
                column += window;
                if column > right {
                    break;
                }
            }
            row += window;
            if row > bottom {
                break;
            }
        }
        span
    }

    pub(crate) fn tile_px(&self) -> usize {
        self.tile_px
    }

    /// Tiles in a row.
    pub(crate) fn columns(&self) -> usize {
        self.columns
    }

    /// The least depth of each tile, row by row; 0 where it is mostly without returns.
    pub(crate) fn least_m(&self) -> &[f32] {
        self.least_m.first().map_or(&[], Vec::as_slice)
    }

    /// The greatest depth of each tile, row by row; 0 where there are no returns.
    pub(crate) fn most_m(&self) -> &[f32] {
        self.most_m.first().map_or(&[], Vec::as_slice)
    }

    /// The columns of the tiles that hold these columns of pixels, first and last.
    pub(crate) fn of_columns(&self, [first, last]: [u32; 2]) -> Range<usize> {
        let end = last as usize / self.tile_px + 1;
        first as usize / self.tile_px..end.min(self.columns)
    }

    /// The same of rows.
    pub(crate) fn of_rows(&self, [first, last]: [u32; 2]) -> Range<usize> {
        let end = last as usize / self.tile_px + 1;
        first as usize / self.tile_px..end.min(self.rows)
    }

    /// The greatest depth of all; 0 where there are no returns.
    pub(crate) fn farthest_m(&self) -> f32 {
        self.most_m.first().map_or(0.0, |most_m| most_m.iter().copied().fold(0.0, f32::max))
    }

    pub(crate) fn memory_bytes(&self) -> usize {
        let OfColumns { least_m, most_m, returns } = &self.scratch;
        let images = self.least_m.iter().chain(&self.most_m).chain([least_m, most_m, returns]);
        images.map(|image| image.capacity() * size_of::<f32>()).sum()
    }
}

/// Computes a level from the one before: from four of its squares, `reach` tiles apart. A square that extends beyond the
/// border has only the tiles inside.
fn grow(
    levels: &mut [Vec<f32>],
    level: usize,
    columns: usize,
    reach: usize,
    choose: impl Fn(f32, f32) -> f32 + Copy,
) {
    let (finer, coarser) = levels.split_at_mut(level);
    let (Some(finer), Some(coarser)) = (finer.last(), coarser.first_mut()) else { return };
    let rows = finer.len() / columns.max(1);
    let line = |row: usize| finer.get(row * columns..(row + 1) * columns).unwrap_or_default();
    for (row, made) in coarser.chunks_exact_mut(columns.max(1)).enumerate() {
        let (upper, lower) = (line(row), line((row + reach).min(rows - 1)));
        let (Some(upper_last), Some(lower_last)) = (upper.last(), lower.last()) else { return };
        // Beyond the last column the last one is repeated.
        let (inner, outer) = made.split_at_mut(columns.saturating_sub(reach));
        let right = upper.iter().skip(reach).zip(lower.iter().skip(reach));
        for (((made, upper), lower), right) in inner.iter_mut().zip(upper).zip(lower).zip(right) {
            *made = choose(choose(*upper, *right.0), choose(*lower, *right.1));
        }
        let last = choose(*upper_last, *lower_last);
        let left = upper.iter().zip(lower).skip(columns.saturating_sub(reach));
        for (made, (upper, lower)) in outer.iter_mut().zip(left) {
            *made = choose(choose(*upper, *lower), last);
        }
    }
}
