//! The depth image, and three coarser ones in which a pixel is the mean of a square of pixels where these show one surface.
//!
//! A voxel that spans several pixels is compared with their mean: a single one of them has the whole noise, and the others
//! would be wasted (the anti-aliased sampling of supereight2 and wavemap).

use crate::noise::DepthNoise;

/// Images, the finest among them: pixels of 1, 2, 4 and 8.
pub(crate) const LEVELS: usize = 4;

/// Depths that differ by no more than so many standard deviations of the noise are of one surface.
const SAME_SURFACE_SIGMAS: f32 = 6.0;

/// The images.
#[derive(Clone, Debug, Default)]
pub(crate) struct Levels {
    images: [Level; LEVELS],
}

#[derive(Clone, Debug, Default)]
struct Level {
    width_px: usize,
    height_px: usize,
    /// Row by row, and one more, 0, for what is outside.
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

    /// The depths of a level, and 0 behind the last.
    pub(crate) fn depths_m(&self, level: u32) -> &[f32] {
        self.images.get(level as usize).map_or(&[], |image| &image.depths_m)
    }

    /// Makes the coarser images.
    pub(crate) fn complete(&mut self, noise: &DepthNoise) {
        let [finest, coarser @ ..] = &mut self.images;
        let mut finer: &Level = finest;
        for (level, image) in (1..).zip(coarser) {
            image.resize(finer.width_px.div_ceil(2), finer.height_px.div_ceil(2));
            halve(finer, finest, level, noise, image);
            finer = image;
        }
    }

    pub(crate) fn memory_bytes(&self) -> usize {
        self.images.iter().map(|image| image.depths_m.capacity() * size_of::<f32>()).sum()
    }
}

/// Where four pixels show one surface, their mean; otherwise the pixel of the finest image that is nearest to the middle of
/// the square: depths of different surfaces have no mean.
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
