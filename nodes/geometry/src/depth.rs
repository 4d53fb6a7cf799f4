//! A depth image.

use std::ops::Range;

use crate::Stamp;

/// The pixels of a depth image, row by row, in one of the two encodings of REP-118.
#[derive(Clone, PartialEq, Debug)]
pub enum DepthPixels {
    /// `16UC1`: millimetres, 0 where nothing was measured. [`DepthImage::new`] makes 0 of 65535, which some drivers send there.
    Millimetres(Vec<u16>),
    /// `32FC1`: metres, not finite (or not positive) where nothing was measured.
    Metres(Vec<f32>),
}

impl DepthPixels {
    /// How many there are.
    #[must_use]
    pub fn len(&self) -> usize {
        match self {
            Self::Millimetres(values) => values.len(),
            Self::Metres(values) => values.len(),
        }
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The depths of a stretch of pixels in metres, values for "not measured" included: 0, a
    /// negative number, or one that is not finite.
    pub(crate) fn load_m(&self, pixels: Range<usize>, depths_m: &mut [f32]) {
        match self {
            Self::Millimetres(values) => {
                let values = values.get(pixels).unwrap_or_default();
                for (depth_m, &depth_mm) in depths_m.iter_mut().zip(values) {
                    *depth_m = metres(depth_mm);
                }
            }
            Self::Metres(values) => {
                let values = values.get(pixels).unwrap_or_default();
                for (depth_m, &value_m) in depths_m.iter_mut().zip(values) {
                    *depth_m = value_m;
                }
            }
        }
    }
}

/// The largest value of `16UC1`: one that is saturated, or means that nothing was measured, and no depth.
const SATURATED_MM: u16 = u16::MAX;
/// The largest depth of `16UC1`.
pub(crate) const FARTHEST_MM: u16 = SATURATED_MM - 1;

/// Divided, not multiplied by 0.001: 1500 mm are 1.5 m to the last bit.
fn metres(depth_mm: u16) -> f32 {
    f32::from(depth_mm) / 1e3
}

/// A depth image: for each pixel the distance along the optical axis (not along the ray).
#[derive(Clone, PartialEq, Debug)]
pub struct DepthImage {
    /// When it was taken.
    pub stamp: Stamp,
    /// The optical frame that it was taken in.
    pub frame_id: String,
    width_px: usize,
    height_px: usize,
    pixels: DepthPixels,
}

/// The pixels do not make up an image of the stated size.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
#[error("a depth image of {width_px} x {height_px} pixels cannot hold {pixels} of them")]
pub struct DepthSizeError {
    /// The stated width.
    pub width_px: usize,
    /// The stated height.
    pub height_px: usize,
    /// How many pixels there are.
    pub pixels: usize,
}

impl DepthImage {
    /// An image of `width_px * height_px` pixels.
    ///
    /// # Errors
    /// When the number of pixels is another.
    pub fn new(
        stamp: Stamp,
        frame_id: String,
        (width_px, height_px): (usize, usize),
        mut pixels: DepthPixels,
    ) -> Result<Self, DepthSizeError> {
        let count = pixels.len();
        if let DepthPixels::Millimetres(depths_mm) = &mut pixels {
            for depth_mm in depths_mm {
                *depth_mm = if *depth_mm == SATURATED_MM { 0 } else { *depth_mm };
            }
        }
        if width_px.checked_mul(height_px) == Some(count) {
            Ok(Self { stamp, frame_id, width_px, height_px, pixels })
        } else {
            Err(DepthSizeError { width_px, height_px, pixels: count })
        }
    }

    /// The same image with other pixels, as many.
    pub(crate) fn with_millimetres(&self, pixels: Vec<u16>) -> Self {
        let size_px = (self.width_px, self.height_px);
        Self::of_millimetres(self.stamp, self.frame_id.clone(), size_px, pixels)
    }

    /// The same image, in which these pixels measured nothing.
    pub(crate) fn without(&self, pixels: impl Iterator<Item = usize>) -> Self {
        let mut image = self.clone();
        for pixel in pixels {
            match &mut image.pixels {
                DepthPixels::Millimetres(depths_mm) => clear_at(depths_mm, pixel),
                DepthPixels::Metres(depths_m) => clear_at(depths_m, pixel),
            }
        }
        image
    }

    /// The image of `width_px * height_px` pixels: the caller has as many.
    pub(crate) fn of_millimetres(
        stamp: Stamp,
        frame_id: String,
        (width_px, height_px): (usize, usize),
        pixels: Vec<u16>,
    ) -> Self {
        Self { stamp, frame_id, width_px, height_px, pixels: DepthPixels::Millimetres(pixels) }
    }

    /// Columns.
    #[must_use]
    pub fn width_px(&self) -> usize {
        self.width_px
    }

    /// Rows.
    #[must_use]
    pub fn height_px(&self) -> usize {
        self.height_px
    }

    /// The pixels, row by row.
    #[must_use]
    pub fn pixels(&self) -> &DepthPixels {
        &self.pixels
    }

    /// The depth of a pixel if it was measured.
    #[must_use]
    pub fn depth_m(&self, column_px: usize, row_px: usize) -> Option<f32> {
        if column_px >= self.width_px || row_px >= self.height_px {
            return None;
        }
        let index = row_px * self.width_px + column_px;
        match &self.pixels {
            DepthPixels::Millimetres(values) => {
                let depth_mm = *values.get(index)?;
                (depth_mm > 0).then(|| metres(depth_mm))
            }
            DepthPixels::Metres(values) => {
                let depth_m = *values.get(index)?;
                (depth_m.is_finite() && depth_m > 0.0).then_some(depth_m)
            }
        }
    }
}

/// Sets a value to that of a pixel that measured nothing.
fn clear_at<T: Default>(depths: &mut [T], pixel: usize) {
    if let Some(depth) = depths.get_mut(pixel) {
        *depth = T::default();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(
        width_px: usize,
        height_px: usize,
        pixels: DepthPixels,
    ) -> Result<DepthImage, DepthSizeError> {
        DepthImage::new(Stamp::default(), "camera".to_owned(), (width_px, height_px), pixels)
    }

    #[test]
    fn a_depth_that_was_not_measured_is_none_in_both_encodings() {
        let millimetres = image(2, 2, DepthPixels::Millimetres(vec![0, 1, 1500, 65_534])).unwrap();
        assert_eq!(millimetres.depth_m(0, 0), None);
        assert_eq!(millimetres.depth_m(1, 0), Some(0.001));
        assert_eq!(millimetres.depth_m(0, 1), Some(1.5));
        assert_eq!(millimetres.depth_m(1, 1), Some(65.534));
        let values = vec![f32::NAN, f32::INFINITY, -1.0, 0.0, 1.5, f32::NEG_INFINITY];
        let metres = image(3, 2, DepthPixels::Metres(values)).unwrap();
        let measured: Vec<_> = (0..2)
            .flat_map(|row| (0..3).map(move |column| (column, row)))
            .filter_map(|(column, row)| metres.depth_m(column, row))
            .collect();
        assert_eq!(measured, [1.5]);
        assert_eq!((metres.depth_m(3, 0), metres.depth_m(0, 2)), (None, None));
    }

    /// Regression: 65535, which some drivers send where nothing was measured, was free space as far as the map reaches.
    #[test]
    fn the_largest_value_of_16_bits_is_not_measured() {
        let depths = image(2, 1, DepthPixels::Millimetres(vec![65_535, 1500])).unwrap();
        assert_eq!((depths.depth_m(0, 0), depths.depth_m(1, 0)), (None, Some(1.5)));
        assert_eq!(depths.pixels(), &DepthPixels::Millimetres(vec![0, 1500]));
    }

    #[test]
    fn a_size_that_the_pixels_do_not_fill_is_refused() {
        for (width_px, height_px) in [(2, 3), (4, 0), (usize::MAX, 2), (0, 0), (5, 1)] {
            let error =
                image(width_px, height_px, DepthPixels::Millimetres(vec![0; 4])).unwrap_err();
            assert_eq!(error, DepthSizeError { width_px, height_px, pixels: 4 });
        }
        assert!(image(0, 7, DepthPixels::Metres(Vec::new())).is_ok());
    }
}
