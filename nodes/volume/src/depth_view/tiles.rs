//! The least and greatest depth of any rectangle of the image: a pyramid over tiles of pixels, with windows at each tile.
//!
//! Each level holds, for each tile, the extremes of the square of `2^level` tiles that begins there, so that a rectangle
//! is the union of a few overlapping squares, and no tile outside of it is used (the sparse table of range minimum queries:
//! Bender and Farach-Colton, "The LCA problem revisited", 2000, section 3).

use std::ops::Range;

use multiversion::multiversion;

use super::{DepthRange, of_millimetres};

/// Pixels along a tile's edge, in an image of up to [`MOST_TILES`] tiles: a power of two.
const TILE_PX: usize = 4;
/// The maximum number of tiles: in a larger image a tile has more pixels.
const MOST_TILES: usize = 40_000;

/// The depths of an image, row by row, as [`DepthView`](crate::DepthView) has them or before they are taken to metres.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Depths<'a> {
    Metres(&'a [f32]),
    Millimetres(&'a [u16], DepthRange),
}

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
    /// For each level, the extremes side by side, so that both come with one access to memory: the least depth, 0 for tiles mostly
    /// without returns, and the greatest one, 0 without returns. The greatest one is negative: of several the least is chosen of both.
    extremes_m: Vec<Vec<[f32; 2]>>,
    /// The least depth of each tile however few returns it has; 0 without returns.
    least_return_m: Vec<f32>,
    /// The greatest depth of all; 0 without returns.
    farthest_m: f32,
    scratch: Parts,
}

/// The extremes of parts of a row of tiles: of its columns of pixels first, at the end of its tiles.
#[derive(Clone, Debug, Default)]
struct Parts {
    least_m: Vec<f32>,
    most_m: Vec<f32>,
    /// How many pixels have a return.
    returns: Vec<f32>,
    spare: Vec<f32>,
}

impl Parts {
    fn reset(&mut self, parts: usize) {
        for (values, none) in
            [(&mut self.least_m, f32::MAX), (&mut self.most_m, 0.0), (&mut self.returns, 0.0)]
        {
            values.clear();
            values.resize(parts, none);
        }
    }

    #[inline(always)]
    fn join(&mut self, line_m: impl Iterator<Item = f32>) {
        let parts = self.least_m.iter_mut().zip(&mut self.most_m).zip(&mut self.returns);
        for (depth_m, ((least_m, most_m), returns)) in line_m.zip(parts) {
            let depth_m = depth_m.abs();
            let is_seen = depth_m > 0.0;
            let least = if is_seen { depth_m } else { f32::MAX };
            *returns += if is_seen { 1.0 } else { 0.0 };
            // As a comparison these would be compiled to stores by a mask, which some processors take a hundred cycles for.
            *least_m = least_m.min(least);
            *most_m = most_m.max(depth_m);
        }
    }

    /// Joins each part with the next.
    #[inline(always)]
    fn halve(&mut self) {
        let Self { least_m, most_m, returns, spare } = self;
        halve(least_m, spare, lesser);
        halve(most_m, spare, greater);
        halve(returns, spare, |a, b| a + b);
    }
}

#[inline(always)]
fn halve(values: &mut Vec<f32>, spare: &mut Vec<f32>, choose: impl Fn(f32, f32) -> f32) {
    spare.clear();
    spare.extend(values.as_chunks().0.iter().map(|&[a, b]| choose(a, b)));
    std::mem::swap(values, spare);
}

/// Of numbers alone, unlike [`f32::min`], which costs more.
#[inline(always)]
fn lesser(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

#[inline(always)]
fn greater(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

impl Tiles {
    pub(crate) fn refill(&mut self, depths: Depths<'_>, width_px: usize, height_px: usize) {
        self.tile_px = TILE_PX;
        while width_px.div_ceil(self.tile_px) * height_px.div_ceil(self.tile_px) > MOST_TILES {
            self.tile_px *= 2;
        }
        self.columns = width_px.div_ceil(self.tile_px);
        self.rows = height_px.div_ceil(self.tile_px);
        let levels = self.columns.min(self.rows).max(1).ilog2() as usize + 1;
        let tiles = self.columns * self.rows;
        self.extremes_m.resize(levels, Vec::new());
        for image in &mut self.extremes_m {
            image.resize(tiles, [0.0; 2]);
        }
        self.least_return_m.resize(tiles, 0.0);
        fill(self, depths, width_px, height_px);
        self.farthest_m = self.most_m().fold(0.0, greater);
    }

    #[inline(always)]
    fn fill_tiles<I: Iterator<Item = f32>>(
        &mut self,
        line_m: impl Fn(Range<usize>) -> I,
        width_px: usize,
        height_px: usize,
    ) {
        let Some(extremes_m) = self.extremes_m.first_mut() else { return };
        let tile_px = self.tile_px;
        let tiles = extremes_m
            .chunks_exact_mut(self.columns)
            .zip(self.least_return_m.chunks_exact_mut(self.columns));
        for (row, (extremes_m, least_return_m)) in tiles.enumerate() {
            let lines = row * tile_px..height_px.min((row + 1) * tile_px);
            self.scratch.reset(self.columns * tile_px);
            for line in lines.clone() {
                self.scratch.join(line_m(line * width_px..(line + 1) * width_px));
            }
            for _ in 0..tile_px.trailing_zeros() {
                self.scratch.halve();
            }
            // A few pixels without a return among others are noise; where most have none, there may be a surface that returns
            // nothing.
            let Parts { least_m, most_m, returns, .. } = &self.scratch;
            let parts = least_m.iter().zip(most_m).zip(returns);
            for (column, (extremes_m, ((least_m, most_m), returns))) in
                extremes_m.iter_mut().zip(parts).enumerate()
            {
                let columns_px = tile_px.min(width_px - column * tile_px);
                let pixels = (columns_px * lines.len()) as f32;
                *extremes_m = [if 2.0 * returns < pixels { 0.0 } else { *least_m }, -most_m];
            }
            for (least_return_m, least_of) in least_return_m.iter_mut().zip(&self.scratch.least_m) {
                *least_return_m = if *least_of == f32::MAX { 0.0 } else { *least_of };
            }
        }
    }

    #[inline(always)]
    fn fill_levels(&mut self) {
        for level in 1..self.extremes_m.len() {
            grow(&mut self.extremes_m, level, self.columns, 1 << (level - 1));
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
        let level = (side.ilog2() as usize).min(self.extremes_m.len() - 1);
        let window = 1 << level;
        let extremes_m = self.extremes_m[level].as_slice();
        // Windows side by side, and the last one as far as the rectangle goes.
        let (last_row, last_column) = (bottom + 1 - window, right + 1 - window);
        let (mut free_to_m, mut minus_known_to_m) = (f32::MAX, -0.0);
        let mut row = top;
        loop {
            let first = row * self.columns;
            let mut column = left;
            loop {
                let [least_m, minus_most_m] = extremes_m[first + column];
                free_to_m = lesser(free_to_m, least_m);
                minus_known_to_m = lesser(minus_known_to_m, minus_most_m);
                if column == last_column {
                    break;
                }
                column = (column + window).min(last_column);
            }
            if row == last_row {
                break;
            }
            row = (row + window).min(last_row);
        }
        DepthSpan { free_to_m, known_to_m: -minus_known_to_m }
    }

    pub(crate) fn tile_px(&self) -> usize {
        self.tile_px
    }

    /// Tiles in a row.
    pub(crate) fn columns(&self) -> usize {
        self.columns
    }

    /// Rows of tiles.
    pub(crate) fn rows(&self) -> usize {
        self.rows
    }

    /// The least depth of each tile, row by row, however few returns it has; 0 where there are none.
    pub(crate) fn least_return_m(&self) -> &[f32] {
        &self.least_return_m
    }

    /// The greatest depth of each tile, row by row; 0 where there are no returns.
    pub(crate) fn most_m(&self) -> impl Iterator<Item = f32> {
        self.extremes_m.first().into_iter().flatten().map(|[_, minus_most_m]| -minus_most_m)
    }

    /// The greatest depth of all; 0 where there are no returns.
    pub(crate) fn farthest_m(&self) -> f32 {
        self.farthest_m
    }

    pub(crate) fn memory_bytes(&self) -> usize {
        let Parts { least_m, most_m, returns, spare } = &self.scratch;
        let extremes = self.extremes_m.iter().map(|image| image.capacity() * size_of::<[f32; 2]>());
        let others = [&self.least_return_m, least_m, most_m, returns, spare];
        extremes.sum::<usize>()
            + others.map(|image| image.capacity() * size_of::<f32>()).iter().sum::<usize>()
    }
}

#[multiversion(targets("x86_64+avx2"))]
fn fill(tiles: &mut Tiles, depths: Depths<'_>, width_px: usize, height_px: usize) {
    match depths {
        Depths::Metres(depths_m) => {
            let line_m =
                |pixels: Range<usize>| depths_m.get(pixels).unwrap_or_default().iter().copied();
            tiles.fill_tiles(line_m, width_px, height_px);
        }
        Depths::Millimetres(depths_mm, range) => {
            let line_m = |pixels: Range<usize>| {
                let line_mm = depths_mm.get(pixels).unwrap_or_default();
                line_mm.iter().map(move |depth_mm| of_millimetres(*depth_mm, range))
            };
            tiles.fill_tiles(line_m, width_px, height_px);
        }
    }
    tiles.fill_levels();
}

/// Computes a level from the one before: from four of its squares, `reach` tiles apart. A square that extends beyond the
/// border has only the tiles inside.
#[inline(always)]
fn grow(levels: &mut [Vec<[f32; 2]>], level: usize, columns: usize, reach: usize) {
    let (finer, coarser) = levels.split_at_mut(level);
    let (Some(finer), Some(coarser)) = (finer.last(), coarser.first_mut()) else { return };
    let rows = finer.len() / columns.max(1);
    let line = |row: usize| finer.get(row * columns..(row + 1) * columns).unwrap_or_default();
    for (row, made) in coarser.chunks_exact_mut(columns.max(1)).enumerate() {
        let (upper, lower) = (line(row), line((row + reach).min(rows - 1)));
        let (Some(upper_last), Some(lower_last)) = (upper.last(), lower.last()) else { return };
        // Beyond the last column the last one is repeated.
        let (inner, outer) = made.split_at_mut(columns.saturating_sub(reach));
        let right = [upper, lower].map(|line| line.get(reach..).unwrap_or_default());
        // As plain numbers, several at once.
        let right = right[0].as_flattened().iter().zip(right[1].as_flattened());
        let left = upper.as_flattened().iter().zip(lower.as_flattened());
        for ((made, left), right) in inner.as_flattened_mut().iter_mut().zip(left).zip(right) {
            *made = lesser(lesser(*left.0, *right.0), lesser(*left.1, *right.1));
        }
        let last = lesser_ones(*upper_last, *lower_last);
        let left = upper.iter().zip(lower).skip(columns.saturating_sub(reach));
        for (made, (upper, lower)) in outer.iter_mut().zip(left) {
            *made = lesser_ones(lesser_ones(*upper, *lower), last);
        }
    }
}

#[inline(always)]
fn lesser_ones([a, b]: [f32; 2], [c, d]: [f32; 2]) -> [f32; 2] {
    [lesser(a, c), lesser(b, d)]
}
