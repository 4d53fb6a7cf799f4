//! Depth images as the ROS package `compressed_depth_image_transport` sends them: a header of 12 bytes
//! before a PNG picture of 16-bit grey.
//!
//! The picture of a `16UC1` image holds its millimetres. That of a `32FC1` image holds inverse depth,
//! quantised by the two numbers of the header, so that it is finer the nearer the surface.

#[cfg(test)]
mod tests;

use std::io::Cursor;

use geometry::{DepthImage, DepthPixels};
use png::{BitDepth, ColorType, Decoder, DeflateCompression, Encoder, Filter, Limits};

use super::error::excerpt;
use super::{ConvertError, stamp_from_time, time_from_stamp};
use crate::sensor_msgs::CompressedImage;
use crate::std_msgs::Header;

/// The last part of the topic's name, behind the name of the raw image's topic.
pub const COMPRESSED_DEPTH_TOPIC: &str = "compressedDepth";

/// What is written into `format`.
const WRITTEN_FORMAT: &str = "16UC1; compressedDepth png";
/// What stands between the encoding of the raw image and the codec.
const TRANSPORT: &str = "compressedDepth";
/// The codec; early publishers leave its name out, since there was no other.
const PNG: &str = "png";

/// The header: a format (`int32`) and two parameters (`float32`), little endian.
const HEADER_BYTES: usize = 12;
const WORD_BYTES: usize = 4;
/// `INV_DEPTH`. The original writes it for every image, also for millimetres, and so says nothing by it.
const INVERSE_DEPTH: i32 = 0;

/// A pixel of the picture.
const PIXEL_BYTES: usize = 2;
/// DEFLATE makes at most 1032 bytes out of one (zlib's technical notes): a picture that claims more is
/// not in the data.
const MOST_INFLATION: usize = 1032;
/// What the decoder may take besides the picture: rows and what stands in other chunks.
const DECODER_BYTES: usize = 16 << 20;
/// Measured: it leaves 195 of 434 kB of a Kinect and 130 of 614 kB of a simulated camera, in 5 ms of the
/// 33 that there are. The fastest leaves 193 and 286 kB in 2 ms, the default 185 and 121 kB in 40 ms.
const DEFLATE: DeflateCompression = DeflateCompression::Level(2);
/// The farthest depth that 16 bits of millimetres hold.
const FARTHEST_MM: f32 = 65_535.0;

/// What the pixels of the picture mean.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Meaning {
    Millimetres,
    QuantisedInverse,
}

/// The depth image of a message of `compressed_depth_image_transport`: `16UC1` exactly, in millimetres;
/// `32FC1` in metres, NaN where nothing was measured, as finely as it was quantised.
///
/// # Errors
/// When the format is another, the codec is not PNG, the data is cut or damaged, or the picture is none
/// of 16-bit grey.
pub fn compressed_depth_from_message(
    message: &CompressedImage,
) -> Result<DepthImage, ConvertError> {
    let meaning = meaning(&message.format)?;
    let data_bytes = message.data.len();
    let (header, picture) = message
        .data
        .split_at_checked(HEADER_BYTES)
        .ok_or(ConvertError::CompressedDepthHeader { data_bytes })?;
    let (size_px, values) = read_picture(picture)?;
    let pixels = match meaning {
        Meaning::Millimetres => DepthPixels::Millimetres(values),
        Meaning::QuantisedInverse => DepthPixels::Metres(metres(&values, header)?),
    };
    let stamp = stamp_from_time(message.header.stamp);
    Ok(DepthImage::new(stamp, message.header.frame_id.clone(), size_px, pixels)?)
}

/// `ENCODING; compressedDepth CODEC`.
fn meaning(format: &str) -> Result<Meaning, ConvertError> {
    let unknown = || ConvertError::CompressedDepthFormat { format: excerpt(format) };
    let (encoding, transport) = format.split_once(';').ok_or_else(unknown)?;
    let meaning = match encoding.trim() {
        "16UC1" | "mono16" => Meaning::Millimetres,
        "32FC1" => Meaning::QuantisedInverse,
        _ => return Err(unknown()),
    };
    let mut words = transport.split_whitespace();
    if words.next() != Some(TRANSPORT) {
        return Err(unknown());
    }
    match words.next() {
        None | Some(PNG) => Ok(meaning),
        Some(codec) => Err(ConvertError::DepthCodec { codec: excerpt(codec) }),
    }
}

/// The size and the pixels of a picture.
fn read_picture(picture: &[u8]) -> Result<((usize, usize), Vec<u16>), ConvertError> {
    let fail = |error: png::DecodingError| ConvertError::Png { reason: error.to_string() };
    let mut decoder =
        Decoder::new_with_limits(Cursor::new(picture), Limits { bytes: DECODER_BYTES });
    decoder.set_ignore_text_chunk(true);
    decoder.set_ignore_iccp_chunk(true);
    // Before anything is allocated for them: do the sizes make sense?
    let info = decoder.read_header_info().map_err(fail)?;
    let (width, height) = (info.width, info.height);
    if (info.color_type, info.bit_depth) != (ColorType::Grayscale, BitDepth::Sixteen) {
        let found = format!("{:?} of {} bits", info.color_type, info.bit_depth as u8);
        return Err(ConvertError::PictureOfOtherPixels { found });
    }
    let size_px = (width as usize, height as usize);
    let bytes = size_px.0.checked_mul(size_px.1).and_then(|px| px.checked_mul(PIXEL_BYTES));
    let bytes = bytes
        .filter(|bytes| *bytes <= picture.len().saturating_mul(MOST_INFLATION))
        .ok_or(ConvertError::PictureBeyondData { width, height, data_bytes: picture.len() })?;

    let mut reader = decoder.read_info().map_err(fail)?;
    let mut samples = vec![0; bytes];
    let frame = reader.next_frame(&mut samples).map_err(fail)?;
    if (frame.width, frame.height) != (width, height) {
        let reason = "it is an animation whose first frame is only a part of it".to_owned();
        return Err(ConvertError::Png { reason });
    }
    let (samples, _) = samples.as_chunks::<PIXEL_BYTES>();
    Ok((size_px, samples.iter().map(|sample| u16::from_be_bytes(*sample)).collect()))
}

/// Depths out of quantised inverse depths `v`: `a / (v - b)`, and nothing measured where `v` is 0.
fn metres(values: &[u16], header: &[u8]) -> Result<Vec<f32>, ConvertError> {
    let (words, _) = header.as_chunks::<WORD_BYTES>();
    let parameter = |index: usize| words.get(index).map_or(0.0, |word| f32::from_le_bytes(*word));
    let (a, b) = (parameter(1), parameter(2));
    // No finite depth comes out of others.
    if !(a.is_finite() && a > 0.0 && b.is_finite()) {
        return Err(ConvertError::DepthQuantisation { a, b });
    }
    let metres = |value: u16| {
        let depth_m = a / (f32::from(value) - b);
        if value > 0 && depth_m.is_finite() && depth_m > 0.0 { depth_m } else { f32::NAN }
    };
    Ok(values.iter().map(|value| metres(*value)).collect())
}

/// The message of a depth image, as `16UC1; compressedDepth png`. Millimetres come back as they are.
/// Metres are rounded to millimetres, since the quantised form of `32FC1` at its usual parameters is
/// coarser than that beyond 3.2 m; what 16 bits cannot hold (beyond 65.535 m, below half a millimetre)
/// becomes not measured.
///
/// # Errors
/// When the image has no pixels, or a side beyond 31 bits: no PNG picture is like that.
pub fn compressed_message_from_depth(image: &DepthImage) -> Result<CompressedImage, ConvertError> {
    let samples: Vec<u8> = match image.pixels() {
        DepthPixels::Millimetres(pixels) => {
            pixels.iter().flat_map(|pixel| pixel.to_be_bytes()).collect()
        }
        DepthPixels::Metres(pixels) => {
            pixels.iter().flat_map(|pixel| millimetres(*pixel).to_be_bytes()).collect()
        }
    };
    let mut data = Vec::with_capacity(HEADER_BYTES + samples.len() / PIXEL_BYTES);
    data.extend(INVERSE_DEPTH.to_le_bytes());
    data.resize(HEADER_BYTES, 0);
    write_picture(&samples, (image.width_px(), image.height_px()), &mut data)?;
    let header = Header { stamp: time_from_stamp(image.stamp), frame_id: image.frame_id.clone() };
    Ok(CompressedImage { header, format: WRITTEN_FORMAT.to_owned(), data })
}

fn millimetres(depth_m: f32) -> u16 {
    let depth_mm = (depth_m * 1e3).round();
    // No range contains NaN.
    if (1.0..=FARTHEST_MM).contains(&depth_mm) { depth_mm as u16 } else { 0 }
}

/// Appends a picture.
fn write_picture(
    samples: &[u8],
    (width_px, height_px): (usize, usize),
    data: &mut Vec<u8>,
) -> Result<(), ConvertError> {
    let fail = |reason: &dyn std::fmt::Display| ConvertError::NoPicture {
        width_px,
        height_px,
        reason: reason.to_string(),
    };
    let width = u32::try_from(width_px).map_err(|error| fail(&error))?;
    let height = u32::try_from(height_px).map_err(|error| fail(&error))?;
    let mut encoder = Encoder::new(data, width, height);
    encoder.set_color(ColorType::Grayscale);
    encoder.set_depth(BitDepth::Sixteen);
    encoder.set_deflate_compression(DEFLATE);
    encoder.set_filter(Filter::Adaptive);
    let mut writer = encoder.write_header().map_err(|error| fail(&error))?;
    writer.write_image_data(samples).map_err(|error| fail(&error))?;
    writer.finish().map_err(|error| fail(&error))
}
