//! The depth image, and three coarser ones in which a pixel is the mean of a square of pixels where these show one surface.
//!
//! A voxel that spans several pixels is compared with their mean: a single pixel would have more noise, and the others would
//! not be used (the anti-aliased sampling of supereight2 and wavemap).
//!
//! The lowest eight bits of each depth hold its weight, so that one memory access reads both; that changes the depth by less
//! than a twenty-thousandth.

use multiversion::multiversion;

use crate::noise::{DepthNoise, weight_of};

/// The number of levels, with pixels of 1, 2, 4 and 8 pixels of the image.
pub(crate) const LEVELS: usize = 4;

/// Depths that differ by no more than this many standard deviations of the noise are of one surface.
const SAME_SURFACE_SIGMAS: f32 = 6.0;

/// The images.
#[derive(Clone, Debug, Default)]
pub(crate) struct Levels {
    images: [Level; LEVELS],
    /// The change of depth from pixel to pixel, of one level at a time.
    slopes_m: Vec<f32>,
}

#[derive(Clone, Debug, Default)]
struct Level {
    width_px: usize,
    height_px: usize,
    /// Row by row, and one more value, 0, for pixels outside of the image.
    depths_m: Vec<f32>,
}

impl Level {
    fn resize(&mut self, width_px: usize, height_px: usize) {
        (self.width_px, self.height_px) = (width_px, height_px);
        self.depths_m.resize(width_px * height_px + 1, 0.0);
        if let Some(outside) = self.depths_m.last_mut() {
            *outside = 0.0;
        }
    }
}

impl Levels {
    pub(crate) fn clear(&mut self) {
        for image in &mut self.images {
            (image.width_px, image.height_px) = (0, 0);
            image.depths_m.clear();
        }
    }

    /// The pixels of the finest image, to be filled.
    pub(crate) fn finest_mut(&mut self, width_px: usize, height_px: usize) -> &mut [f32] {
        let [finest, ..] = &mut self.images;
        finest.resize(width_px, height_px);
        let pixels = width_px * height_px;
        finest.depths_m.get_mut(..pixels).unwrap_or_default()
    }

    pub(crate) fn finest(&self) -> &[f32] {
        let [finest, ..] = &self.images;
        finest.depths_m.get(..finest.width_px * finest.height_px).unwrap_or_default()
    }

    pub(crate) fn size(&self) -> (usize, usize) {
        let [finest, ..] = &self.images;
        (finest.width_px, finest.height_px)
    }

    /// The depths of a level, and 0 after the last.
    pub(crate) fn depths_m(&self, level: u32) -> &[f32] {
        self.images.get(level as usize).map_or(&[], |image| &image.depths_m)
    }

    /// Computes the coarser levels and the weights of all depths.
    pub(crate) fn complete(&mut self, noise: &DepthNoise) {
        let [finest, coarser @ ..] = &mut self.images;
        let mut finer: &Level = finest;
        for (level, image) in (1..).zip(coarser) {
            image.resize(finer.width_px.div_ceil(2), finer.height_px.div_ceil(2));
            halve(finer, finest, level, noise, image);
            finer = image;
        }
        for image in &mut self.images {
            let (width_px, height_px) = (image.width_px, image.height_px);
            self.slopes_m.resize(width_px * height_px, 0.0);
            find_slopes(&image.depths_m, width_px, height_px, &mut self.slopes_m);
            pack_weights(&mut image.depths_m, &self.slopes_m, noise);
        }
    }

    pub(crate) fn memory_bytes(&self) -> usize {
        let images = self.images.iter().map(|image| &image.depths_m).chain([&self.slopes_m]);
        images.map(|depths_m| depths_m.capacity() * size_of::<f32>()).sum()
    }
}

/// The larger of the differences to the next column and the next row; it is also large where one of these has no static depth.
#[multiversion(targets("x86_64+avx2"))]
fn find_slopes(depths_m: &[f32], width_px: usize, height_px: usize, slopes_m: &mut [f32]) {
    let rows = slopes_m.chunks_exact_mut(width_px.max(1)).take(height_px);
    for (row_px, slopes_m) in rows.enumerate() {
        let first = row_px * width_px;
        let beside =
            if row_px + 1 < height_px { first + width_px } else { first.saturating_sub(width_px) };
        let line = |first: usize| depths_m.get(first..first + width_px).unwrap_or_default();
        let (here_m, beside_m) = (line(first), line(beside));
        if let (Some(next_m), Some(slopes_m)) = (here_m.get(1..), slopes_m.get_mut(..width_px - 1))
        {
            for (((slope_m, here_m), next_m), beside_m) in
                slopes_m.iter_mut().zip(here_m).zip(next_m).zip(beside_m)
            {
                *slope_m = (here_m - next_m).abs().max((here_m - beside_m).abs());
            }
        }
        // The last column has the slope of the one before it.
        if let [.., before_m, last_m] = slopes_m {
            *last_m = *before_m;
        }
    }
}

#[multiversion(targets("x86_64+avx2"))]
fn pack_weights(depths_m: &mut [f32], slopes_m: &[f32], noise: &DepthNoise) {
    for (depth_m, slope_m) in depths_m.iter_mut().zip(slopes_m) {
        let weight = weight_of(depth_m.abs(), *slope_m, noise);
        let packed = f32::from_bits(depth_m.to_bits() & !WEIGHT_BITS | weight);
        *depth_m = if *depth_m == 0.0 { 0.0 } else { packed };
    }
}

/// The bits of a depth that hold its weight.
pub(crate) const WEIGHT_BITS: u32 = 0xff;

/// The mean of four pixels on one surface; otherwise the pixel of the finest level nearest to the centre of the
/// square: the mean of depths of different surfaces is on neither.
#[multiversion(targets("x86_64+avx2"))]
fn halve(finer: &Level, finest: &Level, level: u32, noise: &DepthNoise, coarser: &mut Level) {
    let to_middle = (1_usize << (level - 1)) - 1;
    let rows = coarser.depths_m.chunks_exact_mut(coarser.width_px.max(1));
    for (row_px, row) in rows.take(coarser.height_px).enumerate() {
        let line = |row_px: usize| {
            let first = row_px.min(finer.height_px - 1) * finer.width_px;
            finer.depths_m.get(first..first + finer.width_px).unwrap_or_default()
        };
        let (upper, lower) = (line(2 * row_px), line(2 * row_px + 1));
        let middle_row = ((row_px << level) + to_middle).min(finest.height_px - 1);
        let middle_first = middle_row * finest.width_px;
        let middle =
            finest.depths_m.get(middle_first..middle_first + finest.width_px).unwrap_or_default();
        for (column_px, mean_m) in row.iter_mut().enumerate() {
            let left = 2 * column_px;
            let right = (left + 1).min(finer.width_px - 1);
            let four = [upper[left], upper[right], lower[left], lower[right]];
            let least = four[0].min(four[1]).min(four[2].min(four[3]));
            let most = four[0].max(four[1]).max(four[2].max(four[3]));
            let is_one = least > 0.0 && most - least <= SAME_SURFACE_SIGMAS * noise.sigma_m(least);
            *mean_m = if is_one {
                0.25 * ((four[0] + four[1]) + (four[2] + four[3]))
            } else {
                middle[((column_px << level) + to_middle).min(finest.width_px - 1)]
            };
        }
    }
}
