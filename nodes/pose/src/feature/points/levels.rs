//! The image at several scales.

use nalgebra::Point2;

use crate::image::{GrayImage, Resampler};

/// How far from the edge of a level a corner stays: the patch that it is described by reaches 15 pixels, and one more
/// to the right, where a row of it is read as 32 bytes.
pub(super) const MARGIN_PX: usize = 16;

/// The levels of a pyramid for images of one size. The first, the image itself, is not kept.
#[derive(Clone, Debug, Default)]
pub(super) struct Pyramid {
    /// The size of the images.
    pub(super) size_px: (usize, usize),
    smaller: Vec<Level>,
}

/// A level below the first.
#[derive(Clone, Debug)]
struct Level {
    resampler: Resampler,
    image_size_px: (usize, usize),
    image: GrayImage,
}

impl Pyramid {
    /// A pyramid for images of a size (columns, rows): as many levels as requested, as long as they have room for a
    /// corner.
    pub(super) fn new(size_px: (usize, usize), levels: usize, scale_factor: f64) -> Self {
        let sizes = (0..levels as i32).map(|level| {
            let side = |side: usize| (side as f64 / scale_factor.powi(level)).round() as usize;
            (side(size_px.0), side(size_px.1))
        });
        let mut larger = size_px;
        let mut smaller = Vec::new();
        for size in sizes.skip(1) {
            if !Self::has_room(size) {
                break;
            }
            let Some(resampler) = Resampler::new(larger, size) else { break };
            let Some(image) = GrayImage::black(size.0, size.1) else { break };
            smaller.push(Level { resampler, image_size_px: size, image });
            larger = size;
        }
        Self { size_px, smaller }
    }

    /// The size of each level (columns, rows), the image's own included.
    pub(super) fn sizes_px(&self) -> Vec<(usize, usize)> {
        let smaller = self.smaller.iter().map(|level| level.image_size_px);
        std::iter::once(self.size_px).chain(smaller).collect()
    }

    /// Whether a level of a size (columns, rows) has room for a corner.
    pub(super) fn has_room((width_px, height_px): (usize, usize)) -> bool {
        width_px.min(height_px) > 2 * MARGIN_PX && width_px.max(height_px) <= usize::from(u16::MAX)
    }

    /// Where a position on a level lies in the image. The levels' outer edges lie upon each other.
    pub(super) fn in_image(&self, level: usize, position: Point2<f32>) -> Option<Point2<f32>> {
        let Some(smaller) = level.checked_sub(1) else { return Some(position) };
        let level = &self.smaller.get(smaller)?.image_size_px;
        let along = |position: f32, from: usize, to: usize| {
            (position + 0.5) * (to as f32 / from as f32) - 0.5
        };
        Some(Point2::new(
            along(position.x, level.0, self.size_px.0),
            along(position.y, level.1, self.size_px.1),
        ))
    }

    /// Makes the levels of an image, each from the one before.
    pub(super) fn fill(&mut self, image: &GrayImage) {
        let mut larger = image;
        for Level { resampler, image: smaller, .. } in &mut self.smaller {
            resampler.resample(larger, smaller);
            larger = smaller;
        }
    }

    /// A level of the image that the pyramid was filled with.
    pub(super) fn level<'a>(&'a self, image: &'a GrayImage, level: usize) -> Option<&'a GrayImage> {
        match level.checked_sub(1) {
            Some(smaller) => self.smaller.get(smaller).map(|level| &level.image),
            None => Some(image),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edges_and_middles_of_all_levels_lie_upon_each_other() {
        let pyramid = Pyramid::new((640, 480), 8, 1.2);
        let sizes = pyramid.sizes_px();
        assert_eq!((sizes[0], sizes[1], sizes[7]), ((640, 480), (533, 400), (179, 134)));
        for (level, (width, height)) in sizes.into_iter().enumerate() {
            for share in [0.0, 0.25, 0.5, 1.0] {
                let at = |(width, height): (usize, usize)| {
                    Point2::new(share * width as f32 - 0.5, share * height as f32 - 0.5)
                };
                let found = pyramid.in_image(level, at((width, height))).unwrap();
                assert!((found - at((640, 480))).norm() < 1e-3, "{level} {share}: {found}");
            }
        }
        assert_eq!(pyramid.in_image(8, Point2::origin()), None);
        assert_eq!(Pyramid::new((640, 60), 8, 1.2).sizes_px().len(), 4);
    }
}
