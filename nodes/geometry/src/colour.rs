//! A colour image, and the colours of the pixels of a depth image.

mod registration;
#[cfg(test)]
mod tests;

use crate::Stamp;
pub use registration::{ColourRegistration, ColourRegistrationError};

/// In the place of a colour where none was seen. What is black is kept as [`DARKEST`], which looks the same.
pub const NO_COLOUR: [u8; 3] = [0; 3];

/// The colour of what is black.
pub const DARKEST: [u8; 3] = [1; 3];

crate::choices! {
    /// What a filtered colour image has in place of what moves.
    #[derive(Default)]
    pub enum ColourFill {
        /// Black.
        Black = "black" as default,
        /// What moves: the image passes as it came, at once.
        None = "none",
    }
}

/// A colour image: red, green and blue of each pixel.
#[derive(Clone, PartialEq, Debug)]
pub struct ColourImage {
    /// When it was taken.
    pub stamp: Stamp,
    width_px: usize,
    height_px: usize,
    pixels: Vec<[u8; 3]>,
}

/// The colours are not as many as the pixels.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
#[error("an image of {width_px} x {height_px} pixels cannot have {colours} colours")]
pub struct ColourSizeError {
    /// Columns.
    pub width_px: usize,
    /// Rows.
    pub height_px: usize,
    /// How many colours there are.
    pub colours: usize,
}

impl ColourSizeError {
    /// # Errors
    /// When the colours are not as many as the pixels.
    pub(crate) fn check(size_px: (usize, usize), colours: usize) -> Result<(), Self> {
        let (width_px, height_px) = size_px;
        if width_px.checked_mul(height_px) == Some(colours) {
            return Ok(());
        }
        Err(Self { width_px, height_px, colours })
    }
}

impl ColourImage {
    /// An image of `width_px * height_px` pixels, row by row.
    ///
    /// # Errors
    /// When the number of pixels is another.
    pub fn new(
        stamp: Stamp,
        (width_px, height_px): (usize, usize),
        pixels: Vec<[u8; 3]>,
    ) -> Result<Self, ColourSizeError> {
        ColourSizeError::check((width_px, height_px), pixels.len())?;
        Ok(Self { stamp, width_px, height_px, pixels })
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

    /// Red, green and blue, row by row.
    #[must_use]
    pub fn pixels(&self) -> &[[u8; 3]] {
        &self.pixels
    }
}

/// A colour that was seen.
#[must_use]
pub fn seen_colour(colour: [u8; 3]) -> [u8; 3] {
    if colour == NO_COLOUR { DARKEST } else { colour }
}
