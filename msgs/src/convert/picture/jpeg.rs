//! JPEG.

use std::str::FromStr;

use jpeg_encoder::{ChromaSubsamplingMethod, ColorType, Encoder, SamplingFactor};
use zune_jpeg::JpegDecoder;
use zune_jpeg::errors::DecodeErrors;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

use super::{Layout, Picture, Samples, justified_pixels};
use crate::convert::CompressedImageError;

const CODEC: &str = "jpeg";

/// Each block of 64 pixels takes at least one bit of the data: a picture that claims more is not in it.
const MOST_PIXELS_PER_BYTE: usize = 512;
/// How a file ends; cameras may pad it. Coded pixels do not contain it.
const END_MARK: [u8; 2] = [0xFF, 0xD9];
/// Sides have 16 bits.
const LONGEST_SIDE_PX: usize = 65_535;

/// How well a JPEG picture keeps what it shows: 1 (worst) to 100 (best).
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct JpegQuality(u8);

/// A quality that there is not.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
#[error("{given:?} is no quality of a JPEG picture; 1 (worst) to 100 (best) are")]
pub struct JpegQualityError {
    given: String,
}

impl JpegQuality {
    /// A quality.
    ///
    /// # Errors
    /// When it is not within 1 to 100.
    pub fn new(quality: u8) -> Result<Self, JpegQualityError> {
        if (1..=100).contains(&quality) {
            Ok(Self(quality))
        } else {
            Err(JpegQualityError { given: quality.to_string() })
        }
    }

    /// The number.
    #[must_use]
    pub fn get(self) -> u8 {
        self.0
    }
}

impl Default for JpegQuality {
    /// That of `compressed_image_transport`.
    fn default() -> Self {
        Self(95)
    }
}

impl FromStr for JpegQuality {
    type Err = JpegQualityError;

    fn from_str(text: &str) -> Result<Self, JpegQualityError> {
        let given = || JpegQualityError { given: text.chars().take(20).collect() };
        text.parse()
            .map_err(|_| given())
            .and_then(|quality| Self::new(quality).map_err(|_| given()))
    }
}

/// The picture of a file.
pub(in crate::convert) fn read(file: &[u8]) -> Result<Picture, CompressedImageError> {
    let damaged = |reason: String| CompressedImageError::Picture { codec: CODEC, reason };
    let fail = |error: DecodeErrors| damaged(error.to_string());
    if !file.windows(END_MARK.len()).rev().any(|pair| pair == END_MARK) {
        return Err(damaged("its end is missing".to_owned()));
    }
    // Strict: what is cut or damaged is an error, not a picture that is grey from there on.
    let options = DecoderOptions::default()
        .set_strict_mode(true)
        .set_max_width(LONGEST_SIDE_PX)
        .set_max_height(LONGEST_SIDE_PX);
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(file), options);
    // Before anything is allocated for them: do the sizes make sense?
    decoder.decode_headers().map_err(fail)?;
    let (Some(info), Some(colours)) = (decoder.info(), decoder.input_colorspace()) else {
        return Err(damaged("it has no header".to_owned()));
    };
    let size = (u32::from(info.width), u32::from(info.height));
    let most_pixels = file.len().saturating_mul(MOST_PIXELS_PER_BYTE);
    justified_pixels(CODEC, size, file.len(), most_pixels)?;
    let wanted = match colours {
        ColorSpace::Luma => ColorSpace::Luma,
        ColorSpace::YCbCr | ColorSpace::RGB => ColorSpace::RGB,
        other => {
            let found = format!("{other:?}");
            let wanted = "greys or colours of 8 bits";
            return Err(CompressedImageError::OtherPixels { found, wanted });
        }
    };
    decoder.set_options(options.jpeg_set_out_colorspace(wanted));
    let samples = decoder.decode().map_err(fail)?;
    let samples =
        if wanted == ColorSpace::Luma { Samples::Grey8(samples) } else { Samples::Rgb8(samples) };
    Ok(Picture { size_px: (usize::from(info.width), usize::from(info.height)), samples })
}

/// The file of a picture. Colours have half the resolution of brightness, as cameras have it.
pub(in crate::convert) fn write(
    samples: &[u8],
    layout: Layout,
    size_px @ (width_px, height_px): (usize, usize),
    quality: JpegQuality,
) -> Result<Vec<u8>, CompressedImageError> {
    let fail = |reason: String| CompressedImageError::NoPicture {
        codec: CODEC,
        width_px,
        height_px,
        reason,
    };
    let color = match layout {
        Layout::Grey8 => ColorType::Luma,
        Layout::Rgb8 => ColorType::Rgb,
        Layout::Bgr8 => ColorType::Bgr,
        Layout::Rgba8 => ColorType::Rgba,
        Layout::Bgra8 => ColorType::Bgra,
        Layout::Grey16 => return Err(fail("its pixels have 16 bits".to_owned())),
    };
    let (Ok(width), Ok(height)) = (u16::try_from(size_px.0), u16::try_from(size_px.1)) else {
        return Err(fail(format!("a side can have {LONGEST_SIDE_PX} px at most")));
    };
    let mut file = Vec::new();
    let mut encoder = Encoder::new(&mut file, quality.get());
    encoder.set_sampling_factor(SamplingFactor::F_2_2);
    encoder.set_chroma_subsampling_method(ChromaSubsamplingMethod::Average);
    encoder.encode(samples, width, height, color).map_err(|error| fail(error.to_string()))?;
    Ok(file)
}
