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
    packed: [Vec<f32>; LEVELS],
    /// The coarser images before their weights are in them.
    coarser: [Image; LEVELS - 1],
    /// The change of depth from pixel to pixel, of one level at a time.
    slopes_m: Vec<f32>,
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

impl Image {
    fn as_ref(&self) -> ImageRef<'_> {
        let Self { width_px, height_px, ref depths_m } = *self;
        ImageRef { width_px, height_px, depths_m }
    }
}

impl Levels {
    /// Computes the levels of an image.
    pub(crate) fn refill(
        &mut self,
        depths_m: &[f32],
        width_px: usize,
        height_px: usize,
        noise: &DepthNoise,
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
        for (image, packed) in images.zip(&mut self.packed) {
            let pixels = image.depths_m.len();
            if self.slopes_m.len() < pixels {
                self.slopes_m.resize(pixels, 0.0);
            }
            // All are written; coarser levels have fewer.
            let slopes_m = self.slopes_m.get_mut(..pixels).unwrap_or_default();
            find_slopes(image, slopes_m);
            packed.resize(pixels + 1, 0.0);
            pack_weights(image.depths_m, slopes_m, noise, packed);
        }
    }

    /// The depths of a level, row by row, and one more value, 0, for pixels outside of the image.
    pub(crate) fn depths_m(&self, level: u32) -> &[f32] {
        self.packed.get(level as usize).map_or(&[], Vec::as_slice)
    }

    pub(crate) fn memory_bytes(&self) -> usize {
        let coarser = self.coarser.iter().map(|image| &image.depths_m);
        let images = self.packed.iter().chain(coarser).chain([&self.slopes_m]);
        images.map(|depths_m| depths_m.capacity() * size_of::<f32>()).sum()
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
fn find_slopes(image: ImageRef<'_>, slopes_m: &mut [f32]) {
    let ImageRef { width_px, height_px, depths_m } = image;
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
        match slopes_m {
            [.., before_m, last_m] => *last_m = *before_m,
            [only_m] => *only_m = 0.0,
            [] => {}
        }
    }
}

/// Sets the value after the last to 0.
#[multiversion(targets("x86_64+avx2"))]
fn pack_weights(depths_m: &[f32], slopes_m: &[f32], noise: &DepthNoise, packed: &mut [f32]) {
    for ((packed, &depth_m), slope_m) in packed.iter_mut().zip(depths_m).zip(slopes_m) {
        let weight = weight_of(depth_m.abs(), *slope_m, noise);
        let with_weight = f32::from_bits(depth_m.to_bits() & !WEIGHT_BITS | weight);
        *packed = if depth_m == 0.0 { 0.0 } else { with_weight };
    }
    if let Some(outside) = packed.last_mut() {
        *outside = 0.0;
    }
}

/// The bits of a depth that hold its weight.
pub(crate) const WEIGHT_BITS: u32 = 0xff;

/// The mean of four pixels on one surface; otherwise the pixel of the finest level nearest to the centre of the
/// square: the mean of depths of different surfaces is on neither.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_are_of_one_surface_alone() {
        let mut depths_m = vec![2.0; 256];
        for (pixel, depth_m) in depths_m.iter_mut().enumerate() {
            *depth_m += if pixel % 2 == 0 { 0.001 } else { -0.001 };
            if pixel % 16 >= 9 {
                *depth_m = 4.0;
            }
        }
        let mut levels = Levels::default();
        levels.refill(&depths_m, 16, 16, &DepthNoise::default());
        let coarse = levels.depths_m(1);
        assert!((coarse[0] - 2.0).abs() < 2e-4 && (coarse[7] - 4.0).abs() < 2e-4);
        assert!(coarse.iter().all(|depth_m| !(2.5..3.5).contains(depth_m)));
        assert_eq!([0, 1, 2, 3].map(|level| levels.depths_m(level).len()), [257, 65, 17, 5]);
        assert!([0, 1, 2, 3].iter().all(|level| levels.depths_m(*level).last() == Some(&0.0)));
    }
}
