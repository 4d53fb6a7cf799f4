//! A depth image.

use crate::Stamp;

/// The pixels of a depth image, row by row, in one of the two encodings of REP-118.
#[derive(Clone, PartialEq, Debug)]
pub enum DepthPixels {
    /// `16UC1`: millimetres, 0 where nothing was measured.
    Millimetres(Vec<u16>),
    /// `32FC1`: metres, not finite (or not positive) where nothing was measured.
    Metres(Vec<f32>),
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
        pixels: DepthPixels,
    ) -> Result<Self, DepthSizeError> {
        let count = match &pixels {
            DepthPixels::Millimetres(values) => values.len(),
            DepthPixels::Metres(values) => values.len(),
        };
        if width_px.checked_mul(height_px) == Some(count) {
            Ok(Self { stamp, frame_id, width_px, height_px, pixels })
        } else {
            Err(DepthSizeError { width_px, height_px, pixels: count })
        }
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
                (depth_mm > 0).then(|| f32::from(depth_mm) * 1e-3)
            }
            DepthPixels::Metres(values) => {
                let depth_m = *values.get(index)?;
                (depth_m.is_finite() && depth_m > 0.0).then_some(depth_m)
            }
        }
    }
}
