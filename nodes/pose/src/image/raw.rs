//! A gray image from the bytes of a camera driver's image.

mod bayer;
mod encoding;

pub use bayer::BayerPattern;
pub use encoding::{PixelEncoding, UnknownEncoding};

use super::{GrayImage, GraySizeError};
use crate::image::raw::encoding::Samples;

/// The bytes of an image as `sensor_msgs/Image` carries them.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct RawImage<'a> {
    /// Columns.
    pub width_px: usize,
    /// Rows.
    pub height_px: usize,
    /// How the bytes of a pixel are to be read.
    pub encoding: PixelEncoding,
    /// Whether numbers of 16 bits have their larger byte first.
    pub is_big_endian: bool,
    /// From the beginning of a row to that of the next, in bytes; the bytes between the last pixel and there are not
    /// read.
    pub step_bytes: usize,
    /// Row by row.
    pub data: &'a [u8],
}

/// The bytes do not hold the image.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
pub enum RawImageError {
    /// A row's bytes do not hold its pixels.
    #[error("rows of {step_bytes} bytes cannot hold {width_px} pixels, which take {needed_bytes}")]
    Step {
        /// The stated bytes of a row.
        step_bytes: usize,
        /// The stated columns.
        width_px: usize,
        /// The bytes of these.
        needed_bytes: usize,
    },
    /// There are too few bytes.
    #[error("{bytes} bytes do not hold {height_px} rows, which take {needed_bytes}")]
    Data {
        /// How many there are.
        bytes: usize,
        /// The stated rows.
        height_px: usize,
        /// The bytes of these.
        needed_bytes: usize,
    },
    /// The image has more pixels than the largest that is accepted, or its pixels come in pairs and a row has an odd
    /// number of them.
    #[error("an image of {width_px} x {height_px} pixels cannot be read")]
    Size {
        /// The stated columns.
        width_px: usize,
        /// The stated rows.
        height_px: usize,
    },
}

impl From<GraySizeError> for RawImageError {
    fn from(error: GraySizeError) -> Self {
        Self::Size { width_px: error.width_px, height_px: error.height_px }
    }
}

/// Brightness from red, green and blue, in parts of 256 (ITU-R BT.601: 0.299, 0.587, 0.114).
const LUMA: [u16; 3] = [77, 150, 29];

/// The brightness of a colour. Nothing overflows: 255 * 256 + 128 has 16 bits.
#[inline(always)]
fn luma(red: u8, green: u8, blue: u8) -> u8 {
    let sum = u16::from(red) * LUMA[0] + u16::from(green) * LUMA[1] + u16::from(blue) * LUMA[2];
    ((sum + 128) >> 8) as u8
}

/// The gray image of a driver's image: the brightness of colours (BT.601), the larger byte of numbers of 16 bits, the
/// brightness alone of YUV, colours of a Bayer pattern interpolated from their neighbours.
///
/// # Errors
/// When the bytes do not hold an image of the stated size.
pub fn gray_from_raw(raw: &RawImage<'_>) -> Result<GrayImage, RawImageError> {
    let RawImage { width_px, height_px, encoding, step_bytes, data, .. } = *raw;
    let size = RawImageError::Size { width_px, height_px };
    let pixels = width_px.checked_mul(height_px).ok_or(size)?;
    if pixels > geometry::CameraModel::MAX_PIXELS {
        return Err(size);
    }
    if pixels == 0 {
        return Ok(GrayImage::new(width_px, height_px, Vec::new())?);
    }
    let samples = encoding.samples();
    if samples.come_in_pairs() && !width_px.is_multiple_of(2) {
        return Err(size);
    }
    // The product of two numbers below 2^24 and 8.
    let row_bytes = width_px * encoding.pixel_bytes();
    if step_bytes < row_bytes {
        return Err(RawImageError::Step { step_bytes, width_px, needed_bytes: row_bytes });
    }
    let needed = height_px
        .checked_sub(1)
        .map_or(Some(0), |rows| rows.checked_mul(step_bytes)?.checked_add(row_bytes))
        .ok_or(size)?;
    if data.len() < needed {
        let bytes = data.len();
        return Err(RawImageError::Data { bytes, height_px, needed_bytes: needed });
    }
    let rows = data.chunks(step_bytes).filter_map(|row| row.get(..row_bytes)).take(height_px);
    let mut gray = Vec::with_capacity(pixels);
    for row in rows {
        append_row(row, &samples, raw.is_big_endian, &mut gray);
    }
    let gray = GrayImage::new(width_px, height_px, gray)?;
    Ok(match samples {
        Samples::Bayer { pattern, .. } => bayer::interpolated(&gray, pattern),
        _ => gray,
    })
}

/// The brightness of a row's pixels; of a Bayer pattern, the samples.
fn append_row(row: &[u8], samples: &Samples, is_big_endian: bool, gray: &mut Vec<u8>) {
    match *samples {
        Samples::Gray { bytes: 1 } | Samples::Bayer { bytes: 1, .. } => gray.extend_from_slice(row),
        Samples::Gray { .. } | Samples::Bayer { .. } => {
            let larger = usize::from(!is_big_endian);
            gray.extend(row.iter().skip(larger).step_by(2));
        }
        Samples::Pair { brightness_at } => gray.extend(row.iter().skip(brightness_at).step_by(2)),
        Samples::Colour { channels: 3, red_first: true } => {
            gray.extend(row.as_chunks::<3>().0.iter().map(|&[r, g, b]| luma(r, g, b)));
        }
        Samples::Colour { channels: 3, red_first: false } => {
            gray.extend(row.as_chunks::<3>().0.iter().map(|&[b, g, r]| luma(r, g, b)));
        }
        Samples::Colour { red_first: true, .. } => {
            gray.extend(row.as_chunks::<4>().0.iter().map(|&[r, g, b, _]| luma(r, g, b)));
        }
        Samples::Colour { red_first: false, .. } => {
            gray.extend(row.as_chunks::<4>().0.iter().map(|&[b, g, r, _]| luma(r, g, b)));
        }
    }
}

#[cfg(test)]
mod tests;
