//! A gray image.

/// A gray image, row by row, a byte a pixel. The centre of a pixel has whole coordinates, as in
/// [`geometry::CameraModel`].
#[derive(Clone, PartialEq, Eq, Default, Debug)]
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
        let start = row.checked_mul(self.width_px);
        let end = start.and_then(|start| start.checked_add(self.width_px));
        start.zip(end).and_then(|(start, end)| self.pixels.get(start..end)).unwrap_or_default()
    }

    /// The value of a pixel; none outside the image.
    #[must_use]
    pub fn pixel(&self, column: usize, row: usize) -> Option<u8> {
        self.row(row).get(column).copied()
    }

    /// An image that is black all over; none of a size that no memory holds.
    pub(crate) fn black(width_px: usize, height_px: usize) -> Option<Self> {
        let pixels = vec![0; width_px.checked_mul(height_px)?];
        Some(Self { width_px, height_px, pixels })
    }

    /// All pixels, row by row, to be written.
    pub(crate) fn pixels_mut(&mut self) -> &mut [u8] {
        &mut self.pixels
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_or_a_pixel_outside_the_image_is_none() {
        let image = GrayImage::new(2, 2, vec![1, 2, 3, 4]).unwrap();
        assert_eq!((image.row(0), image.row(1)), (&[1, 2][..], &[3, 4][..]));
        for row in [2, usize::MAX / 2, usize::MAX] {
            assert_eq!((image.row(row), image.pixel(0, row)), (&[][..], None));
        }
        assert_eq!((image.pixel(1, 1), image.pixel(2, 1)), (Some(4), None));
    }

    #[test]
    fn a_size_that_the_pixels_do_not_fill_is_refused() {
        for (width_px, height_px) in [(2, 3), (4, 0), (usize::MAX, 2), (0, 0), (5, 1)] {
            let error = GrayImage::new(width_px, height_px, vec![0; 4]).unwrap_err();
            assert_eq!(error, GraySizeError { width_px, height_px, pixels: 4 });
        }
        assert_eq!(GrayImage::black(usize::MAX, 2), None);
    }
}
