//! PNG.

use std::borrow::Cow;
use std::io::Cursor;

use png::{BitDepth, ColorType, Decoder, DeflateCompression, Encoder, Filter, Limits};

use super::{Layout, Picture, Samples, justified_pixels, stated};
use crate::convert::CompressedImageError;

const CODEC: &str = "png";

/// DEFLATE makes at most 1032 bytes out of one (zlib's technical notes): a picture that claims more is
/// not in the data.
const MOST_INFLATION: usize = 1032;
/// The memory that the decoder may use besides the picture: rows and the contents of other chunks.
const DECODER_BYTES: usize = 16 << 20;
/// Measured: it leaves 195 of 434 kB of a Kinect and 130 of 614 kB of a simulated camera, in 5 ms of the
/// 33 that there are. The fastest leaves 193 and 286 kB in 2 ms, the default 185 and 121 kB in 40 ms.
const DEFLATE: DeflateCompression = DeflateCompression::Level(2);

/// The picture of a file.
pub(in crate::convert) fn read(file: &[u8]) -> Result<Picture, CompressedImageError> {
    let damaged = |reason: String| CompressedImageError::Picture { codec: CODEC, reason };
    let fail = |error: png::DecodingError| damaged(error.to_string());
    let mut decoder = Decoder::new_with_limits(Cursor::new(file), Limits { bytes: DECODER_BYTES });
    decoder.set_ignore_text_chunk(true);
    decoder.set_ignore_iccp_chunk(true);
    // Before anything is allocated for them: do the sizes make sense?
    let info = decoder.read_header_info().map_err(fail)?;
    let (width, height) = (info.width, info.height);
    let (color_type, bit_depth) = (info.color_type, info.bit_depth);
    let pixel_bytes = match (color_type, bit_depth) {
        (ColorType::Grayscale, BitDepth::Eight) => 1,
        (ColorType::Grayscale, BitDepth::Sixteen) => 2,
        (ColorType::Rgb, BitDepth::Eight) => 3,
        (ColorType::Rgba, BitDepth::Eight) => 4,
        _ => {
            return Err(CompressedImageError::OtherPixels {
                found: format!("{color_type:?} of {} bits", bit_depth as u8),
                wanted: "grey of 8 or 16 bits or colours of 8 bits",
            });
        }
    };
    let most_pixels = file.len().saturating_mul(MOST_INFLATION) / pixel_bytes;
    let pixels = justified_pixels(CODEC, (width, height), file.len(), most_pixels)?;

    let mut reader = decoder.read_info().map_err(fail)?;
    let mut bytes = vec![0; pixels * pixel_bytes];
    let frame = reader.next_frame(&mut bytes).map_err(fail)?;
    if (frame.width, frame.height) != (width, height) {
        let reason = "it is an animation whose first frame is only a part of it";
        return Err(damaged(reason.to_owned()));
    }
    let samples = match (color_type, bit_depth) {
        (ColorType::Grayscale, BitDepth::Sixteen) => Samples::Grey16(
            bytes.as_chunks().0.iter().map(|pair| u16::from_be_bytes(*pair)).collect(),
        ),
        (ColorType::Grayscale, _) => Samples::Grey8(bytes),
        (ColorType::Rgba, _) => {
            Samples::Rgb8(rgb(&bytes, |[red, green, blue, _]| [red, green, blue]))
        }
        _ => Samples::Rgb8(bytes),
    };
    Ok(Picture { size_px: (width as usize, height as usize), samples })
}

/// Appends a picture.
pub(in crate::convert) fn write(
    samples: &[u8],
    layout: Layout,
    size_px: (usize, usize),
    data: &mut Vec<u8>,
) -> Result<(), CompressedImageError> {
    let (width, height) = stated(CODEC, size_px)?;
    let fail = |error: png::EncodingError| {
        let ((width_px, height_px), reason) = (size_px, error.to_string());
        CompressedImageError::NoPicture { codec: CODEC, width_px, height_px, reason }
    };
    let mut encoder = Encoder::new(data, width, height);
    let (color, depth) = match layout {
        Layout::Grey8 => (ColorType::Grayscale, BitDepth::Eight),
        Layout::Grey16 => (ColorType::Grayscale, BitDepth::Sixteen),
        Layout::Rgb8 | Layout::Bgr8 | Layout::Rgba8 | Layout::Bgra8 => {
            (ColorType::Rgb, BitDepth::Eight)
        }
    };
    let samples = match layout {
        Layout::Grey8 | Layout::Grey16 | Layout::Rgb8 => Cow::Borrowed(samples),
        Layout::Bgr8 => Cow::Owned(rgb(samples, |[blue, green, red]| [red, green, blue])),
        Layout::Rgba8 => Cow::Owned(rgb(samples, |[red, green, blue, _]| [red, green, blue])),
        Layout::Bgra8 => Cow::Owned(rgb(samples, |[blue, green, red, _]| [red, green, blue])),
    };
    encoder.set_color(color);
    encoder.set_depth(depth);
    encoder.set_deflate_compression(DEFLATE);
    encoder.set_filter(Filter::Adaptive);
    let mut writer = encoder.write_header().map_err(fail)?;
    writer.write_image_data(&samples).map_err(fail)?;
    writer.finish().map_err(fail)
}

/// Each pixel as red, green and blue.
fn rgb<const BYTES: usize>(samples: &[u8], of: impl Fn([u8; BYTES]) -> [u8; 3]) -> Vec<u8> {
    samples.as_chunks().0.iter().flat_map(|pixel| of(*pixel)).collect()
}
