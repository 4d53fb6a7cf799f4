//! The least and greatest depth of any rectangle of the image: a pyramid over tiles of pixels, with windows at each tile.
//!
//! Each level holds, for each tile, the extremes of the square of `2^level` tiles that begins there, so that a rectangle
//! is the union of a few overlapping squares and nothing beside it is counted (the sparse table of range minimum queries:
//! Bender and Farach-Colton, "The LCA problem revisited", 2000, section 3).

/// Pixels along a tile's edge, in an image of a usual size.
const TILE_PX: usize = 4;
/// More tiles than this there are not: in a larger image they have more pixels.
const MOST_TILES: usize = 40_000;

/// The extremes of a rectangle.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct DepthSpan {
    /// It is free up to here wherever the image shows the rectangle; 0 where it does not show that of all of it.
    pub(crate) free_to_m: f32,
    /// Nothing is known of what is farther; 0 where nothing came back at all.
    pub(crate) known_to_m: f32,
}

/// The pyramid.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tiles {
    tile_px: usize,
    columns: usize,
    rows: usize,
    /// Of each level: the least depth; 0 where a tile is mostly without returns.
    least_m: Vec<Vec<f32>>,
    /// Of each level: the greatest depth; 0 where there are no returns.
    most_m: Vec<Vec<f32>>,
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
            grow(&mut self.least_m, level, self.columns, reach, f32::min);
            grow(&mut self.most_m, level, self.columns, reach, f32::max);
        }
    }

    fn fill_tiles(&mut self, depths_m: &[f32], width_px: usize, height_px: usize) {
        let (Some(least_m), Some(most_m)) = (self.least_m.first_mut(), self.most_m.first_mut())
        else {
            return;
        };
        let mut counts = vec![0_u32; self.columns];
        for row in 0..self.rows {
            let tiles = row * self.columns..(row + 1) * self.columns;
            let least_m = &mut least_m[tiles.clone()];
            let most_m = &mut most_m[tiles];
            least_m.fill(f32::MAX);
            most_m.fill(0.0);
            counts.fill(0);
            let lines = row * self.tile_px..height_px.min((row + 1) * self.tile_px);
            for line in lines.clone() {
                let line_m = &depths_m[line * width_px..(line + 1) * width_px];
                let pieces = line_m.chunks(self.tile_px);
                let kept = least_m.iter_mut().zip(most_m.iter_mut()).zip(&mut counts);
                for (piece, ((least_m, most_m), count)) in pieces.zip(kept) {
                    for depth_m in piece {
                        let depth_m = depth_m.abs();
                        let is_seen = depth_m > 0.0;
                        *count += u32::from(is_seen);
                        *least_m = least_m.min(if is_seen { depth_m } else { f32::MAX });
                        *most_m = most_m.max(depth_m);
                    }
                }
            }
            // A few pixels without a return among others are noise; where there are as many, something may be there that
            // gives none.
            for (column, (least_m, count)) in least_m.iter_mut().zip(&counts).enumerate() {
                let width = self.tile_px.min(width_px - column * self.tile_px);
                if 2 * (*count as usize) < width * lines.len() {
                    *least_m = 0.0;
                }
            }
        }
    }

    /// The extremes of the tiles that hold these columns and rows, first and last.
    #[inline]
    pub(crate) fn span(&self, columns: [u32; 2], rows: [u32; 2]) -> DepthSpan {
        let tile = |pixel: u32, tiles: usize| (pixel as usize / self.tile_px).min(tiles - 1);
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

    /// The greatest depth of all; 0 where there are no returns.
    pub(crate) fn farthest_m(&self) -> f32 {
        self.most_m.first().map_or(0.0, |most_m| most_m.iter().copied().fold(0.0, f32::max))
    }

    pub(crate) fn memory_bytes(&self) -> usize {
        let images = self.least_m.iter().chain(&self.most_m);
        images.map(|image| image.capacity() * size_of::<f32>()).sum()
    }
}

/// Makes a level from the one before: of four of its squares, those `reach` tiles apart. A square that would reach over the
/// border is that of the tiles there are.
fn grow(
    levels: &mut [Vec<f32>],
    level: usize,
    columns: usize,
    reach: usize,
    choose: fn(f32, f32) -> f32,
) {
    let (finer, coarser) = levels.split_at_mut(level);
    let (Some(finer), Some(coarser)) = (finer.last(), coarser.first_mut()) else { return };
    let rows = finer.len() / columns.max(1);
    for row in 0..rows {
        let upper = &finer[row * columns..(row + 1) * columns];
        let lower_row = (row + reach).min(rows - 1);
        let lower = &finer[lower_row * columns..(lower_row + 1) * columns];
        let made = &mut coarser[row * columns..(row + 1) * columns];
        for (column, made) in made.iter_mut().enumerate() {
            let right = (column + reach).min(columns - 1);
            *made =
                choose(choose(upper[column], upper[right]), choose(lower[column], lower[right]));
        }
    }
}
