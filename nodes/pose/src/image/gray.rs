//! A gray image.

/// A gray image, row by row, a byte a pixel. The centre of a pixel has whole coordinates, as in
/// [`geometry::CameraModel`].
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct GrayImage {
    width_px: usize,
    height_px: usize,
    pixels: Vec<u8>,
}

/// The pixels do not make up an image of the stated size.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
#[error("a gray image of {width_px} x {height_px} pixels cannot hold {pixels} of them")]
pub struct GraySizeError {
    /// The stated width.
    pub width_px: usize,
    /// The stated height.
    pub height_px: usize,
    /// How many pixels there are.
    pub pixels: usize,
}

impl GrayImage {
    /// An image of these pixels.
    ///
    /// # Errors
    /// When there are not `width_px * height_px` of them.
    pub fn new(width_px: usize, height_px: usize, pixels: Vec<u8>) -> Result<Self, GraySizeError> {
        if width_px.checked_mul(height_px) == Some(pixels.len()) {
            Ok(Self { width_px, height_px, pixels })
        } else {
            Err(GraySizeError { width_px, height_px, pixels: pixels.len() })
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

    /// All pixels, row by row.
    #[must_use]
    pub fn pixels(&self) -> &[u8] {
        &self.pixels
    }

    /// The pixels of a row; none where the image has no such row.
    #[must_use]
    pub fn row(&self, row: usize) -> &[u8] {
        self.pixels.get(row * self.width_px..(row + 1) * self.width_px).unwrap_or_default()
    }
}
