//! Images of colours or greys as the ROS package `compressed_image_transport` sends them: the file of a
//! JPEG or PNG picture, and in the format the encoding that the raw image had.

#[cfg(test)]
mod tests;

use std::borrow::Cow;

use super::compressed_depth::COMPRESSED_DEPTH_TOPIC;
use super::depth::{image_message, whole_pixel_bytes};
use super::error::excerpt;
use super::picture::{
    JpegQuality, Layout, Picture, Samples, read_jpeg, read_png, write_jpeg, write_png,
};
use super::rows::{Rows, StatedSizes};
use super::{CompressedImageError, ConvertError};
use crate::sensor_msgs::{CompressedImage, Image};

/// The last part of the topic's name, behind the name of the raw image's topic.
pub const COMPRESSED_IMAGE_TOPIC: &str = "compressed";

/// The text between the codec and the colours in the order that the codec was given them.
const TRANSPORT: &str = "compressed";
/// That order, whatever the raw image had: that of the library that the original compresses by. The
/// picture itself has its colours right.
const GIVEN_COLOURS: &str = "bgr8";

/// How files begin.
const JPEG_START: [u8; 3] = [0xFF, 0xD8, 0xFF];
const PNG_START: [u8; 8] = [0x89, b'P', b'N', b'G', b'\r', b'\n', 0x1A, b'\n'];

/// How an image is compressed.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum ImageCodec {
    /// JPEG: some 80 kB of an image of 640 x 480 pixels, and not quite the same. Processors round
    /// differently, so that the bytes may differ from one machine to another.
    Jpeg(JpegQuality),
    /// PNG: the same to the last bit, in some 460 kB.
    Png,
}

impl Default for ImageCodec {
    /// That of `compressed_image_transport`.
    fn default() -> Self {
        Self::Jpeg(JpegQuality::default())
    }
}

/// The image of a message of `compressed_image_transport`. What the data is, it says itself. Colours
/// become `rgb8` where the raw image had red first, and `bgr8` elsewhere, also for formats that name no
/// raw image (`jpeg`). Greys keep the raw image's encoding where it has one channel of their bits
/// (`mono8`, `16UC1`, `bayer_rggb8`), else they are `mono8` or `16UC1`.
///
/// # Errors
/// When the format is that of a depth image, or the data neither JPEG nor PNG, cut, damaged, or of
/// pixels that a camera's image does not have.
pub fn image_from_compressed_message(message: &CompressedImage) -> Result<Image, ConvertError> {
    let format = Format::read(&message.format)?;
    let picture = if message.data.starts_with(&JPEG_START) {
        read_jpeg(&message.data)?
    } else if message.data.starts_with(&PNG_START) {
        read_png(&message.data)?
    } else {
        let format = excerpt(&message.format);
        return Err(CompressedImageError::PictureFormat { format }.into());
    };
    let Picture { size_px, samples } = picture;
    let (encoding, data) = match samples {
        Samples::Grey8(data) => (format.grey("mono8", &["8UC1"], "8"), data),
        Samples::Grey16(data) => {
            (format.grey("16UC1", &["mono16"], "16"), whole_pixel_bytes(&data))
        }
        Samples::Rgb8(mut data) => {
            let (encoding, is_red_first) =
                if format.raw.starts_with("rgb") { ("rgb8", true) } else { ("bgr8", false) };
            if is_red_first == format.is_exchanged {
                exchange_red_and_blue(&mut data);
            }
            (encoding, data)
        }
    };
    Ok(image_message(message.header.clone(), encoding, size_px, data))
}

/// `RAW`; or `RAW; CODEC compressed COLOURS`; or only a codec.
struct Format<'message> {
    /// The encoding of the raw image, empty where it is not said.
    raw: &'message str,
    /// Whether the codec was given red where it takes blue, so that the picture shows the one for the
    /// other. No publisher of ROS does that any more.
    is_exchanged: bool,
}

impl<'message> Format<'message> {
    fn read(format: &'message str) -> Result<Self, CompressedImageError> {
        let Some((raw, codec)) = format.split_once(';') else {
            return Ok(Self { raw: "", is_exchanged: false });
        };
        let mut words = codec.split_whitespace().skip_while(|word| *word != TRANSPORT).skip(1);
        let is_exchanged = words.next().is_some_and(|colours| colours.starts_with("rgb"));
        if codec.split_whitespace().any(|word| word == COMPRESSED_DEPTH_TOPIC) {
            return Err(CompressedImageError::DepthFormat { format: excerpt(format) });
        }
        Ok(Self { raw: raw.trim(), is_exchanged })
    }

    /// The encoding of a grey picture: the usual one, or that of the raw image where it is another of
    /// as many bits.
    fn grey(&self, usual: &'static str, others: &[&'static str], bits: &str) -> &'message str {
        let is_mosaic = self.raw.strip_prefix("bayer_").is_some_and(|rest| {
            rest.strip_suffix(bits).is_some_and(|order| order.chars().all(char::is_alphabetic))
        });
        if others.contains(&self.raw) || is_mosaic { self.raw } else { usual }
    }
}

fn exchange_red_and_blue(data: &mut [u8]) {
    for [red, _, blue] in data.as_chunks_mut().0 {
        std::mem::swap(red, blue);
    }
}

/// The message of an image: `rgb8`, `bgr8`, `rgba8` and `bgra8` (without what is not opaque), `mono8` and
/// `8UC1`; as PNG also `mono16` and `16UC1`.
///
/// # Errors
/// When the encoding is another, rows overlap, the data is shorter than they are, or the image has no
/// pixels or more in a row than the codec takes.
pub fn compressed_message_from_image(
    image: &Image,
    codec: ImageCodec,
) -> Result<CompressedImage, ConvertError> {
    let (layout, is_colour) = match (image.encoding.as_str(), codec) {
        ("rgb8", _) => (Layout::Rgb8, true),
        ("bgr8", _) => (Layout::Bgr8, true),
        ("rgba8", _) => (Layout::Rgba8, true),
        ("bgra8", _) => (Layout::Bgra8, true),
        ("mono8" | "8UC1", _) => (Layout::Grey8, false),
        ("mono16" | "16UC1", ImageCodec::Png) => (Layout::Grey16, false),
        (other, codec) => {
            let wanted = match codec {
                ImageCodec::Jpeg(_) => {
                    "image for JPEG: rgb8, bgr8, rgba8, bgra8, mono8 and 8UC1 are"
                }
                ImageCodec::Png => {
                    "image for PNG: rgb8, bgr8, rgba8, bgra8, mono8, 8UC1, mono16 and 16UC1 are"
                }
            };
            return Err(ConvertError::Encoding { encoding: excerpt(other), wanted });
        }
    };
    let samples = samples(image, layout)?;
    let size_px = (image.width as usize, image.height as usize);
    let (data, name) = match codec {
        ImageCodec::Jpeg(quality) => (write_jpeg(&samples, layout, size_px, quality)?, "jpeg"),
        ImageCodec::Png => {
            let mut data = Vec::new();
            write_png(&samples, layout, size_px, &mut data)?;
            (data, "png")
        }
    };
    let given = if is_colour { GIVEN_COLOURS } else { "" };
    let format = format!("{}; {name} {TRANSPORT} {given}", image.encoding);
    Ok(CompressedImage { header: image.header.clone(), format, data })
}

/// The pixels without what pads their rows, those of 16 bits big endian.
fn samples(image: &Image, layout: Layout) -> Result<Cow<'_, [u8]>, ConvertError> {
    let record_bytes = layout.pixel_bytes();
    let sizes = StatedSizes {
        message: "Image",
        width: image.width,
        height: image.height,
        record_bytes: record_bytes as u32,
        step: image.step,
    };
    let rows = Rows::checked(&image.data, &sizes)?;
    let bytes = rows.records() * record_bytes;
    if layout == Layout::Grey16 && image.is_bigendian == 0 {
        let pairs = rows.iter().flat_map(|row| row.as_chunks().0);
        return Ok(pairs.flat_map(|[low, high]| [*high, *low]).collect());
    }
    if image.step as usize == image.width as usize * record_bytes {
        return Ok(Cow::Borrowed(image.data.get(..bytes).unwrap_or_default()));
    }
    let mut samples = Vec::with_capacity(bytes);
    rows.iter().for_each(|row| samples.extend_from_slice(row));
    Ok(Cow::Owned(samples))
}
