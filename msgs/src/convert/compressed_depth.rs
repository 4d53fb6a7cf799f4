//! Depth images as the ROS package `compressed_depth_image_transport` sends them: a header of 12 bytes
//! before a picture of 16-bit grey, by PNG or RVL.
//!
//! The picture of a `16UC1` image holds its millimetres. That of a `32FC1` image holds inverse depth,
//! quantised by the two numbers of the header, so that it is finer the nearer the surface.

mod inverse_depth;
mod rvl;
#[cfg(test)]
mod tests;

use geometry::{DepthImage, DepthPixels};

pub use inverse_depth::InverseDepth;
pub use rvl::RvlError;

use super::error::excerpt;
use super::picture::{Layout, Picture, Samples, read_png, write_png};
use super::{CompressedImageError, ConvertError, stamp_from_time, time_from_stamp};
use crate::sensor_msgs::CompressedImage;
use crate::std_msgs::Header;

/// The last part of the topic's name, behind the name of the raw image's topic.
pub const COMPRESSED_DEPTH_TOPIC: &str = "compressedDepth";

/// The text between the encoding of the raw image and the codec.
const TRANSPORT: &str = "compressedDepth";
const PNG: &str = "png";
const RVL: &str = "rvl";

/// The header: a format (`int32`) and two parameters (`float32`), little endian.
const HEADER_BYTES: usize = 12;
const WORD_BYTES: usize = 4;
/// `INV_DEPTH`. The original writes it for every image, also for millimetres, and so says nothing by it.
const INVERSE_DEPTH: i32 = 0;
/// An RVL stream begins with the columns and the rows (`uint32`), little endian.
const RVL_SIZE_BYTES: usize = 8;
/// A run of zeros takes next to nothing however long it is, so that the data bounds no picture: this
/// does, by four times the largest depth cameras there are.
const MOST_RVL_PIXELS: usize = 1 << 24;

/// The farthest depth that 16 bits of millimetres hold: their largest value is no depth ([`DepthImage::new`]).
const FARTHEST_MM: f32 = 65_534.0;

/// How the picture of a depth image is coded. Neither codec loses anything of it.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum DepthCodec {
    /// The smaller one, and the one that every version of ROS reads.
    #[default]
    Png,
    /// The faster one; ROS 2 reads it since Jazzy.
    Rvl,
}

/// The encoding of depths in metres (`32FC1`), of which no codec takes 32 bits.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub enum MetresAs {
    /// Rounded to millimetres, and sent as `16UC1`: finer than the usual quantisation beyond 3.2 m, and
    /// up to 65 m. What 16 bits cannot hold becomes not measured.
    #[default]
    Millimetres,
    /// Sent as `32FC1` in quantised inverse depth, as the original does.
    InverseDepth(InverseDepth),
}

/// The unit of the picture's pixels.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Meaning {
    Millimetres,
    QuantisedInverse,
}

impl Meaning {
    /// The encoding of the raw image.
    fn encoding(self) -> &'static str {
        match self {
            Self::Millimetres => "16UC1",
            Self::QuantisedInverse => "32FC1",
        }
    }
}

impl DepthCodec {
    /// Its name in the formats of messages.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Png => PNG,
            Self::Rvl => RVL,
        }
    }
}

/// The depth image of a message of `compressed_depth_image_transport`: `16UC1` exactly, in millimetres;
/// `32FC1` in metres, NaN where nothing was measured, as finely as it was quantised.
///
/// # Errors
/// When the format is another, the codec is neither PNG nor RVL, the data is cut or damaged, or the
/// picture is not of 16-bit grey.
pub fn compressed_depth_from_message(
    message: &CompressedImage,
) -> Result<DepthImage, ConvertError> {
    let (meaning, codec) = read_format(&message.format)?;
    let (header, picture) = split_header(&message.data, HEADER_BYTES, codec)?;
    let (size_px, values) = match codec {
        DepthCodec::Png => read_grey(picture)?,
        DepthCodec::Rvl => read_rvl(picture)?,
    };
    let pixels = match meaning {
        Meaning::Millimetres => DepthPixels::Millimetres(values),
        Meaning::QuantisedInverse => {
            let [_, a, b] = words(header);
            let inverse = InverseDepth::from_header(f32::from_bits(a), f32::from_bits(b))?;
            DepthPixels::Metres(values.iter().map(|value| inverse.metres(*value)).collect())
        }
    };
    let stamp = stamp_from_time(message.header.stamp);
    Ok(DepthImage::new(stamp, message.header.frame_id.clone(), size_px, pixels)?)
}

/// `ENCODING; compressedDepth CODEC`.
fn read_format(format: &str) -> Result<(Meaning, DepthCodec), CompressedImageError> {
    let unknown = || CompressedImageError::NoDepthFormat { format: excerpt(format) };
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
        // Early publishers leave its name out, since there was no other.
        None | Some(PNG) => Ok((meaning, DepthCodec::Png)),
        Some(RVL) => Ok((meaning, DepthCodec::Rvl)),
        Some(codec) => Err(CompressedImageError::DepthCodec { codec: excerpt(codec) }),
    }
}

/// The first bytes and the rest.
fn split_header(
    data: &[u8],
    header_bytes: usize,
    codec: DepthCodec,
) -> Result<(&[u8], &[u8]), CompressedImageError> {
    let (codec, data_bytes) = (codec.name(), data.len());
    data.split_at_checked(header_bytes).ok_or(CompressedImageError::Header {
        codec,
        data_bytes,
        header_bytes,
    })
}

/// The first little-endian words; 0 for those that are not there.
fn words<const COUNT: usize>(bytes: &[u8]) -> [u32; COUNT] {
    let (words, _) = bytes.as_chunks::<WORD_BYTES>();
    std::array::from_fn(|index| words.get(index).map_or(0, |word| u32::from_le_bytes(*word)))
}

/// The size and the pixels of a PNG picture.
fn read_grey(picture: &[u8]) -> Result<((usize, usize), Vec<u16>), CompressedImageError> {
    let Picture { size_px, samples } = read_png(picture)?;
    match samples {
        Samples::Grey16(values) => Ok((size_px, values)),
        other => Err(CompressedImageError::OtherPixels {
            found: other.name().to_owned(),
            wanted: "a depth image, grey of 16 bits",
        }),
    }
}

/// The size and the pixels of an RVL picture.
fn read_rvl(picture: &[u8]) -> Result<((usize, usize), Vec<u16>), CompressedImageError> {
    let (sizes, stream) = split_header(picture, RVL_SIZE_BYTES, DepthCodec::Rvl)?;
    let [width, height] = words(sizes);
    let most_pixels = MOST_RVL_PIXELS;
    let pixels = (width as usize)
        .checked_mul(height as usize)
        .filter(|pixels| *pixels <= most_pixels)
        .ok_or(CompressedImageError::TooLarge { codec: RVL, width, height, most_pixels })?;
    Ok(((width as usize, height as usize), rvl::decompress(stream, pixels)?))
}

/// The message of a depth image as PNG, metres as millimetres: what every version of ROS reads.
/// Millimetres come back as they are.
///
/// # Errors
/// When the image has no pixels, or a side beyond 31 bits: no PNG picture is like that.
pub fn compressed_message_from_depth(image: &DepthImage) -> Result<CompressedImage, ConvertError> {
    compressed_message_from_depth_with(image, DepthCodec::default(), MetresAs::default())
}

/// The message of a depth image. Millimetres come back as they are, and are `16UC1` whatever becomes of
/// metres.
///
/// # Errors
/// When the image has no pixels, or more than the codec takes.
pub fn compressed_message_from_depth_with(
    image: &DepthImage,
    codec: DepthCodec,
    metres_as: MetresAs,
) -> Result<CompressedImage, ConvertError> {
    let rounded: Vec<u16>;
    let (meaning, values, [a, b]) = match (image.pixels(), metres_as) {
        (DepthPixels::Millimetres(values), _) => (Meaning::Millimetres, values, [0.0; 2]),
        (DepthPixels::Metres(depths_m), MetresAs::Millimetres) => {
            rounded = depths_m.iter().map(|depth_m| millimetres(*depth_m)).collect();
            (Meaning::Millimetres, &rounded, [0.0; 2])
        }
        (DepthPixels::Metres(depths_m), MetresAs::InverseDepth(inverse)) => {
            rounded = depths_m.iter().map(|depth_m| inverse.value(*depth_m)).collect();
            (Meaning::QuantisedInverse, &rounded, inverse.header())
        }
    };
    // Room for what a camera's picture takes; a noisier one makes its own.
    let mut data = Vec::with_capacity(HEADER_BYTES + RVL_SIZE_BYTES + values.len());
    data.extend(INVERSE_DEPTH.to_le_bytes());
    data.extend([a, b].iter().flat_map(|parameter| parameter.to_le_bytes()));
    let size_px = (image.width_px(), image.height_px());
    match codec {
        DepthCodec::Png => {
            let samples: Vec<u8> = values.iter().flat_map(|value| value.to_be_bytes()).collect();
            write_png(&samples, Layout::Grey16, size_px, &mut data)?;
        }
        DepthCodec::Rvl => write_rvl(values, size_px, &mut data)?,
    }
    let header = Header { stamp: time_from_stamp(image.stamp), frame_id: image.frame_id.clone() };
    let format = format!("{}; {TRANSPORT} {}", meaning.encoding(), codec.name());
    Ok(CompressedImage { header, format, data })
}

fn millimetres(depth_m: f32) -> u16 {
    let depth_mm = (depth_m * 1e3).round();
    // No range contains NaN.
    if (1.0..=FARTHEST_MM).contains(&depth_mm) { depth_mm as u16 } else { 0 }
}

/// Appends a size and a stream.
fn write_rvl(
    values: &[u16],
    (width_px, height_px): (usize, usize),
    data: &mut Vec<u8>,
) -> Result<(), CompressedImageError> {
    let fail = |reason: &str| {
        let reason = reason.to_owned();
        Err(CompressedImageError::NoPicture { codec: RVL, width_px, height_px, reason })
    };
    if values.is_empty() {
        return fail("there is no pixel in it");
    }
    let (Ok(width), Ok(height)) = (u32::try_from(width_px), u32::try_from(height_px)) else {
        return fail("a side has more than 32 bits");
    };
    if values.len() > MOST_RVL_PIXELS {
        return fail("it has more pixels than are read");
    }
    data.extend(width.to_le_bytes());
    data.extend(height.to_le_bytes());
    rvl::compress(values, data);
    Ok(())
}
