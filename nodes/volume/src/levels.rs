//! The depth image, and three coarser ones in which a pixel is the mean of a square of pixels where these show one surface.
//!
//! A voxel that spans several pixels is compared with their mean: a single pixel would have more noise, and the others would
//! not be used (the anti-aliased sampling of supereight2 and wavemap).
//!
//! A pixel has the slope of the plane that it shows with its neighbours, if they show one. The lowest eight bits of each depth
//! hold its weight; that changes the depth by less than a twenty-thousandth.

use multiversion::multiversion;

use crate::noise::{DepthNoise, weight_of};
use crate::projection::nearest;

/// The number of levels, with pixels of 1, 2, 4 and 8 pixels of the image.
pub(crate) const LEVELS: usize = 4;

/// Depths that differ by no more than this many standard deviations of the noise are of one surface.
const SAME_SURFACE_SIGMAS: f32 = 6.0;

/// The images.
#[derive(Clone, Debug, Default)]
pub(crate) struct Levels {
    packed: [Vec<LevelPixel>; LEVELS],
    /// The coarser images before their weights are in them.
    coarser: [Image; LEVELS - 1],
    /// The change of depth from pixel to pixel, of one level at a time.
    changes_m: Vec<f32>,
}

/// A pixel of a level.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub(crate) struct LevelPixel {
    /// As in the image: 0 where there is none, negative where no surface may be. Its lowest bits are its weight.
    pub(crate) depth_m: f32,
    /// The change of depth to the next column in the lower half, to the next row in the upper one, in steps of [`SLOPE_STEP_M`].
    slopes: u32,
}

/// Slopes are whole numbers of this step, up to 2 m a pixel.
const SLOPE_STEP_M: f32 = 1.0 / 16_384.0;
const MOST_SLOPE: f32 = 32_767.0;

impl LevelPixel {
    /// The change of depth to the next column and to the next row; 0 where the pixel and its neighbours are not on one plane.
    #[inline(always)]
    pub(crate) fn slopes_m(self) -> [f32; 2] {
        let slopes = self.slopes as i32;
        [slopes << 16 >> 16, slopes >> 16].map(|steps| steps as f32 * SLOPE_STEP_M)
    }
}

#[derive(Clone, Debug, Default)]
struct Image {
    width_px: usize,
    height_px: usize,
    depths_m: Vec<f32>,
}

#[derive(Clone, Copy, Debug)]
struct ImageRef<'a> {
    width_px: usize,
    height_px: usize,
    depths_m: &'a [f32],
}

impl ImageRef<'_> {
    fn depth_m(&self, column: usize, row: usize) -> f32 {
        if column >= self.width_px || row >= self.height_px {
            return 0.0;
        }
        self.depths_m.get(row * self.width_px + column).copied().unwrap_or(0.0)
    }

    /// The depth half a pixel right of and below a pixel's centre: that of the pixel, on its plane where it has one.
    fn between_m(&self, column: usize, row: usize, noise: &DepthNoise) -> f32 {
        let here_m = self.depth_m(column, row);
        if here_m <= 0.0 {
            return here_m;
        }
        let [left_m, right_m] =
            [column.wrapping_sub(1), column + 1].map(|column| self.depth_m(column, row));
        let [above_m, below_m] =
            [row.wrapping_sub(1), row + 1].map(|row| self.depth_m(column, row));
        let by_column_m = slope_m([left_m, here_m, right_m], noise);
        let by_row_m = slope_m([above_m, here_m, below_m], noise);
        here_m + 0.5 * (by_column_m + by_row_m)
    }
}

impl Image {
    fn as_ref(&self) -> ImageRef<'_> {
        let Self { width_px, height_px, ref depths_m } = *self;
        ImageRef { width_px, height_px, depths_m }
    }
}

impl Levels {
    /// Computes the levels of an image, from `least_level` on: finer ones are not to be read.
    pub(crate) fn refill(
        &mut self,
        depths_m: &[f32],
        [width_px, height_px]: [usize; 2],
        noise: &DepthNoise,
        least_level: u32,
    ) {
        let finest = ImageRef { width_px, height_px, depths_m };
        let mut finer = finest;
        for (level, image) in (1..).zip(&mut self.coarser) {
            (image.width_px, image.height_px) =
                (finer.width_px.div_ceil(2), finer.height_px.div_ceil(2));
            image.depths_m.resize(image.width_px * image.height_px, 0.0);
            halve(finer, finest, level, noise, image);
            finer = image.as_ref();
        }
        let images = [finest].into_iter().chain(self.coarser.iter().map(Image::as_ref));
        for (image, packed) in images.zip(&mut self.packed).skip(least_level as usize) {
            let pixels = image.depths_m.len();
            if self.changes_m.len() < pixels {
                self.changes_m.resize(pixels, 0.0);
            }
            // All are written; coarser levels have fewer.
            let changes_m = self.changes_m.get_mut(..pixels).unwrap_or_default();
            find_changes(image, changes_m);
            packed.resize(pixels + 1, LevelPixel::default());
            pack_depths(image.depths_m, changes_m, noise, packed);
            pack_slopes(image, noise, packed);
        }
    }

    /// The pixels of a level, row by row, and one more without a depth, for pixels outside of the image.
    pub(crate) fn pixels(&self, level: u32) -> &[LevelPixel] {
        self.packed.get(level as usize).map_or(&[], Vec::as_slice)
    }

    pub(crate) fn memory_bytes(&self) -> usize {
        let floats = self.coarser.iter().map(|image| &image.depths_m).chain([&self.changes_m]);
        let packed = self.packed.iter().map(|pixels| pixels.capacity() * size_of::<LevelPixel>());
        let floats = floats.map(|values_m| values_m.capacity() * size_of::<f32>());
        packed.chain(floats).sum()
    }
}

/// The coarsest level whose pixels are no larger than a voxel's edge at a depth.
#[inline]
pub(crate) fn level_of(edge_m: f32, pixel_slope: f32, depth_m: f32) -> u32 {
    let edge_px = edge_m / (pixel_slope * depth_m.max(1e-3));
    (1..LEVELS as u32).take_while(|level| edge_px >= (1 << level) as f32).count() as u32
}

/// The larger of the differences to the next column and the next row; it is also large where one of these has no static depth.
#[multiversion(targets("x86_64+avx2"))]
fn find_changes(image: ImageRef<'_>, changes_m: &mut [f32]) {
    let ImageRef { width_px, height_px, depths_m } = image;
    let rows = changes_m.chunks_exact_mut(width_px.max(1)).take(height_px);
    for (row_px, changes_m) in rows.enumerate() {
        let first = row_px * width_px;
        let beside =
            if row_px + 1 < height_px { first + width_px } else { first.saturating_sub(width_px) };
        let line = |first: usize| depths_m.get(first..first + width_px).unwrap_or_default();
        let (here_m, beside_m) = (line(first), line(beside));
        if let (Some(next_m), Some(changes_m)) =
            (here_m.get(1..), changes_m.get_mut(..width_px - 1))
        {
            for (((change_m, here_m), next_m), beside_m) in
                changes_m.iter_mut().zip(here_m).zip(next_m).zip(beside_m)
            {
                *change_m = (here_m - next_m).abs().max((here_m - beside_m).abs());
            }
        }
        // The last column has the change of the one before it.
        match changes_m {
            [.., before_m, last_m] => *last_m = *before_m,
            [only_m] => *only_m = 0.0,
            [] => {}
        }
    }
}

/// Sets the pixel after the last to none.
#[multiversion(targets("x86_64+avx2"))]
fn pack_depths(depths_m: &[f32], changes_m: &[f32], noise: &DepthNoise, packed: &mut [LevelPixel]) {
    for ((packed, &depth_m), change_m) in packed.iter_mut().zip(depths_m).zip(changes_m) {
        let weight = weight_of(depth_m.abs(), *change_m, noise);
        let with_weight = f32::from_bits(depth_m.to_bits() & !WEIGHT_BITS | weight);
        let depth_m = if depth_m == 0.0 { 0.0 } else { with_weight };
        *packed = LevelPixel { depth_m, slopes: 0 };
    }
    if let Some(outside) = packed.last_mut() {
        *outside = LevelPixel::default();
    }
}

/// Sets the slopes of all pixels but those at the border of the image.
#[multiversion(targets("x86_64+avx2"))]
fn pack_slopes(image: ImageRef<'_>, noise: &DepthNoise, packed: &mut [LevelPixel]) {
    let ImageRef { width_px, height_px, depths_m } = image;
    for row_px in 1..height_px.saturating_sub(1) {
        let line = |row_px: usize| {
            let first = row_px * width_px;
            depths_m.get(first..first + width_px).unwrap_or_default()
        };
        let (above_m, here_m, below_m) = (line(row_px - 1), line(row_px), line(row_px + 1));
        let first = row_px * width_px;
        let packed = packed.get_mut(first..first + width_px).unwrap_or_default();
        let inner = width_px.saturating_sub(2);
        let [left_m, right_m] =
            [0, 2].map(|from: usize| here_m.get(from..from + inner).unwrap_or_default());
        let [above_m, here_m, below_m] =
            [above_m, here_m, below_m].map(|line_m| line_m.get(1..1 + inner).unwrap_or_default());
        let packed = packed.get_mut(1..1 + inner).unwrap_or_default();
        let beside = left_m.iter().zip(right_m).zip(above_m).zip(below_m);
        for ((packed, here_m), (((left_m, right_m), above_m), below_m)) in
            packed.iter_mut().zip(here_m).zip(beside)
        {
            let by_column = slope_m([*left_m, *here_m, *right_m], noise);
            let by_row = slope_m([*above_m, *here_m, *below_m], noise);
            let [by_column, by_row] = [by_column, by_row].map(|slope_m| {
                let steps = (slope_m * (1.0 / SLOPE_STEP_M)).clamp(-MOST_SLOPE, MOST_SLOPE);
                nearest(steps)
            });
            packed.slopes = by_column & 0xffff | by_row << 16;
        }
    }
}

/// The change of depth from one of three pixels to the next, if their depths change alike; otherwise 0.
#[inline(always)]
fn slope_m([before_m, here_m, after_m]: [f32; 3], noise: &DepthNoise) -> f32 {
    let bend_m = (after_m - here_m) - (here_m - before_m);
    let is_plane = (before_m > 0.0)
        & (here_m > 0.0)
        & (after_m > 0.0)
        & (bend_m.abs() <= SAME_SURFACE_SIGMAS * noise.sigma_m(here_m));
    if is_plane { 0.5 * (after_m - before_m) } else { 0.0 }
}

/// The bits of a depth that hold its weight.
pub(crate) const WEIGHT_BITS: u32 = 0xff;

/// The mean of four pixels on one surface; otherwise the depth of the finest level at the centre of the square: the mean of
/// depths of different surfaces is on neither.
#[multiversion(targets("x86_64+avx2"))]
fn halve(
    finer: ImageRef<'_>,
    finest: ImageRef<'_>,
    level: u32,
    noise: &DepthNoise,
    coarser: &mut Image,
) {
    let to_middle = (1_usize << (level - 1)) - 1;
    let rows = coarser.depths_m.chunks_exact_mut(coarser.width_px.max(1));
    for (row_px, row) in rows.take(coarser.height_px).enumerate() {
        let line = |row_px: usize| {
            let first = row_px.min(finer.height_px - 1) * finer.width_px;
            finer.depths_m.get(first..first + finer.width_px).unwrap_or_default()
        };
        let (upper, lower) = (line(2 * row_px), line(2 * row_px + 1));
        let ((upper, upper_last), (lower, lower_last)) = (upper.as_chunks(), lower.as_chunks());
        for ((mean_m, upper), lower) in row.iter_mut().zip(upper).zip(lower) {
            *mean_m = mean_of_one_m(*upper, *lower, noise);
        }
        // Of an odd number of columns the last one stands alone.
        if let (Some(mean_m), [upper], [lower]) = (row.last_mut(), upper_last, lower_last) {
            *mean_m = mean_of_one_m([*upper; 2], [*lower; 2], noise);
        }
        let middle_row = ((row_px << level) + to_middle).min(finest.height_px - 1);
        for (column_px, mean_m) in row.iter_mut().enumerate().filter(|(_, mean_m)| mean_m.is_nan())
        {
            let middle_column = ((column_px << level) + to_middle).min(finest.width_px - 1);
            *mean_m = finest.between_m(middle_column, middle_row, noise);
        }
    }
}

/// The mean of a square of pixels, the upper two and the lower two, if they show one surface; otherwise NaN.
#[inline(always)]
fn mean_of_one_m(upper_m: [f32; 2], lower_m: [f32; 2], noise: &DepthNoise) -> f32 {
    let ([a, b], [c, d]) = (upper_m, lower_m);
    let least = a.min(b).min(c.min(d));
    let most = a.max(b).max(c.max(d));
    let is_one = (least > 0.0) & (most - least <= SAME_SURFACE_SIGMAS * noise.sigma_m(least));
    if is_one { 0.25 * ((a + b) + (c + d)) } else { f32::NAN }
}

#[cfg(test)]
mod tests;
