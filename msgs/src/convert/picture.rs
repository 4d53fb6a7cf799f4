//! Pictures: the files that compressed images carry.

mod jpeg;
mod png;

pub use jpeg::{JpegQuality, JpegQualityError};

pub(super) use jpeg::{read as read_jpeg, write as write_jpeg};
pub(super) use png::{read as read_png, write as write_png};

use super::CompressedImageError;

/// A picture as it was decoded.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Picture {
    pub(super) size_px: (usize, usize),
    pub(super) samples: Samples,
}

/// The pixels of a picture, row by row.
#[derive(Clone, PartialEq, Debug)]
pub(super) enum Samples {
    Grey8(Vec<u8>),
    Grey16(Vec<u16>),
    /// Three bytes a pixel: red, green, blue.
    Rgb8(Vec<u8>),
}

/// The meaning of a pixel's bytes before they are encoded as a picture.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Layout {
    Grey8,
    /// Two bytes a pixel, big endian.
    Grey16,
    Rgb8,
    Bgr8,
    /// The fourth byte is not sent.
    Rgba8,
    Bgra8,
}

impl Layout {
    pub(super) fn pixel_bytes(self) -> usize {
        match self {
            Self::Grey8 => 1,
            Self::Grey16 => 2,
            Self::Rgb8 | Self::Bgr8 => 3,
            Self::Rgba8 | Self::Bgra8 => 4,
        }
    }
}

impl Samples {
    /// Their kind, for an error.
    pub(super) fn name(&self) -> &'static str {
        match self {
            Self::Grey8(_) => "grey of 8 bits",
            Self::Grey16(_) => "grey of 16 bits",
            Self::Rgb8(_) => "colours of 8 bits",
        }
    }
}

/// Sizes as pictures state them.
fn stated(
    codec: &'static str,
    (width_px, height_px): (usize, usize),
) -> Result<(u32, u32), CompressedImageError> {
    match (u32::try_from(width_px), u32::try_from(height_px)) {
        (Ok(width), Ok(height)) => Ok((width, height)),
        _ => {
            let reason = "its sides have more than 32 bits".to_owned();
            Err(CompressedImageError::NoPicture { codec, width_px, height_px, reason })
        }
    }
}

/// How many pixels there are, where that many can come out of the data.
fn justified_pixels(
    codec: &'static str,
    (width, height): (u32, u32),
    data_bytes: usize,
    most_pixels: usize,
) -> Result<usize, CompressedImageError> {
    let pixels = (width as usize).checked_mul(height as usize);
    pixels.filter(|pixels| *pixels <= most_pixels).ok_or(CompressedImageError::BeyondData {
        codec,
        width,
        height,
        data_bytes,
    })
}
